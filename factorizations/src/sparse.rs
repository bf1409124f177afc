//! Sparse Cholesky and LU by faer.
//!
//! ```
//! use faer::dyn_stack::{MemBuffer, MemStack};
//! use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
//! use limitlab_factorizations::sparse::{llt, llt_scratch, llt_solve, solve_scratch, symbolic_cholesky};
//!
//! // (2 1; 1 2) x = (3, 3)
//! let pattern = SymbolicSparseColMatRef::new_checked(2, 2, &[0, 2, 4], None, &[0u32, 1, 0, 1]);
//! let symbolic = symbolic_cholesky(pattern, Default::default())?;
//! let mut scratch = MemBuffer::new(llt_scratch(&symbolic).or(solve_scratch(&symbolic, 1)));
//! let mut factor = vec![0.0; symbolic.len_val()];
//! let matrix = SparseColMatRef::new(pattern, &[2.0, 1.0, 1.0, 2.0]);
//! llt(&symbolic, &mut factor, matrix, MemStack::new(&mut scratch)).expect("positive definite");
//! let mut x = faer::mat![[3.0], [3.0]];
//! llt_solve(&symbolic, &factor, x.as_mut(), MemStack::new(&mut scratch));
//! assert!((x[(0, 0)] - 1.0).abs() < 1e-15 && (x[(1, 0)] - 1.0).abs() < 1e-15);
//! # Ok::<(), faer::sparse::FaerError>(())
//! ```

use faer::dyn_stack::{MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltError;
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// The pattern of the Cholesky factors of a symmetric matrix, under an approximate minimum degree order.
///
/// # Errors
/// Where memory or 32-bit indices do not suffice.
#[inline(never)]
pub fn symbolic_cholesky(
    pattern: SymbolicSparseColMatRef<u32>,
    params: CholeskySymbolicParams,
) -> Result<SymbolicCholesky<u32>, FaerError> {
    factorize_symbolic_cholesky(pattern, Side::Upper, SymmetricOrdering::Amd, params)
}

/// The memory that [`llt`] works in.
#[inline(never)]
pub fn llt_scratch(symbolic: &SymbolicCholesky<u32>) -> StackReq {
    symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
}

/// `factor` becomes L of LLᵀ, of the upper triangle of `matrix`.
///
/// # Errors
/// On a pivot that is not positive.
#[inline(never)]
pub fn llt(
    symbolic: &SymbolicCholesky<u32>,
    factor: &mut [f64],
    matrix: SparseColMatRef<u32, f64>,
    stack: &mut MemStack,
) -> Result<(), LltError> {
    let (regularization, params) = (Default::default(), Default::default());
    symbolic.factorize_numeric_llt(factor, matrix, Side::Upper, regularization, Par::Seq, stack, params).map(|_| ())
}

/// The memory that [`ldlt`] works in.
#[inline(never)]
pub fn ldlt_scratch(symbolic: &SymbolicCholesky<u32>) -> StackReq {
    symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
}

/// `factor` becomes L and D of LDLᵀ, of the upper triangle of `matrix`.
///
/// # Errors
/// On a pivot that vanishes.
#[inline(never)]
pub fn ldlt(
    symbolic: &SymbolicCholesky<u32>,
    factor: &mut [f64],
    matrix: SparseColMatRef<u32, f64>,
    stack: &mut MemStack,
) -> Result<(), LdltError> {
    let (regularization, params) = (Default::default(), Default::default());
    symbolic.factorize_numeric_ldlt(factor, matrix, Side::Upper, regularization, Par::Seq, stack, params).map(|_| ())
}

/// The memory that [`llt_solve`] and [`ldlt_solve`] work in.
#[inline(never)]
pub fn solve_scratch(symbolic: &SymbolicCholesky<u32>, columns: usize) -> StackReq {
    symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq)
}

/// `x` becomes (LLᵀ)⁻¹x.
#[inline(never)]
pub fn llt_solve(symbolic: &SymbolicCholesky<u32>, factor: &[f64], x: MatMut<f64>, stack: &mut MemStack) {
    LltRef::new(symbolic, factor).solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
}

/// `x` becomes (LDLᵀ)⁻¹x.
#[inline(never)]
pub fn ldlt_solve(symbolic: &SymbolicCholesky<u32>, factor: &[f64], x: MatMut<f64>, stack: &mut MemStack) {
    LdltRef::new(symbolic, factor).solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
}

/// The pattern of the LU factors of a square matrix, under a COLAMD column order.
///
/// # Errors
/// Where memory or 32-bit indices do not suffice.
#[inline(never)]
pub fn symbolic_lu(
    pattern: SymbolicSparseColMatRef<u32>,
    params: LuSymbolicParams,
) -> Result<SymbolicLu<u32>, FaerError> {
    factorize_symbolic_lu(pattern, params)
}

/// The memory that [`lu`] works in.
#[inline(never)]
pub fn lu_scratch(symbolic: &SymbolicLu<u32>) -> StackReq {
    symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default())
}

/// `numeric` becomes the LU factors of `matrix`, with partial pivoting.
///
/// # Errors
/// A structurally singular matrix; memory or 32-bit indices that do not suffice.
#[inline(never)]
pub fn lu(
    symbolic: &SymbolicLu<u32>,
    numeric: &mut NumericLu<u32, f64>,
    matrix: SparseColMatRef<u32, f64>,
    stack: &mut MemStack,
) -> Result<(), LuError> {
    symbolic.factorize_numeric_lu(numeric, matrix, Par::Seq, stack, Default::default()).map(|_| ())
}

/// The memory that [`lu_solve`] works in.
#[inline(never)]
pub fn lu_solve_scratch(symbolic: &SymbolicLu<u32>, columns: usize) -> StackReq {
    symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq)
}

/// `x` becomes (LU)⁻¹x.
#[inline(never)]
pub fn lu_solve(symbolic: &SymbolicLu<u32>, numeric: &NumericLu<u32, f64>, x: MatMut<f64>, stack: &mut MemStack) {
    LuRef::new_unchecked(symbolic, numeric).solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
}
