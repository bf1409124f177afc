//! Dense factorizations and eigenvalues: by faer for matrices of any size, by nalgebra for small ones.
//!
//! ```
//! use faer::mat;
//! use limitlab_factorizations::dense::self_adjoint_eigenvalues;
//!
//! let values = self_adjoint_eigenvalues(&mat![[2.0, 1.0], [1.0, 2.0]]).expect("it converges");
//! assert!((values[0] - 1.0).abs() < 1e-15 && (values[1] - 3.0).abs() < 1e-15);
//! ```

use faer::linalg::evd::EvdError;
use faer::linalg::solvers::{SelfAdjointEigen, Solve, Svd};
use faer::linalg::svd::SvdError;
use faer::linalg::triangular_solve;
use faer::{Mat, MatMut, MatRef, Par, Side, c64};
use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn, Hessenberg, LU, QR, SVD, Schur, SymmetricEigen};

/// The eigenvalues of a square matrix, in no order.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn eigenvalues(matrix: &Mat<f64>) -> Result<Vec<c64>, EvdError> {
    matrix.eigenvalues()
}

/// The eigenvalues of a square complex matrix, in no order.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn complex_eigenvalues(matrix: &Mat<c64>) -> Result<Vec<c64>, EvdError> {
    matrix.eigenvalues()
}

/// The eigenvalues of a symmetric matrix, of which the lower triangle is read, ascending.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn self_adjoint_eigenvalues(matrix: &Mat<f64>) -> Result<Vec<f64>, EvdError> {
    matrix.self_adjoint_eigenvalues(Side::Lower)
}

/// The eigenvalues, ascending, and eigenvectors of a symmetric matrix, of which the lower triangle is read.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn self_adjoint_eigen(matrix: &Mat<f64>) -> Result<SelfAdjointEigen<f64>, EvdError> {
    matrix.self_adjoint_eigen(Side::Lower)
}

/// U, S and V of a matrix, S descending.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn svd(matrix: &Mat<f64>) -> Result<Svd<f64>, SvdError> {
    matrix.svd()
}

/// U, S and V of a complex matrix, S descending.
///
/// # Errors
/// If they do not converge.
#[inline(never)]
pub fn complex_svd(matrix: &Mat<c64>) -> Result<Svd<c64>, SvdError> {
    matrix.svd()
}

/// L of a symmetric positive definite matrix, of which the lower triangle is read; `None` on a pivot that is not positive.
#[inline(never)]
pub fn cholesky(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    matrix.llt(Side::Lower).ok().map(|llt| llt.L().to_owned())
}

/// `x` becomes matrix⁻¹x, by LU with partial pivoting.
#[inline(never)]
pub fn solve(matrix: &Mat<f64>, x: MatMut<f64>) {
    matrix.partial_piv_lu().solve_in_place(x);
}

/// `x` becomes l⁻¹x, of a lower triangle.
#[inline(never)]
pub fn solve_lower_triangular(l: &Mat<f64>, x: MatMut<f64>) {
    triangular_solve::solve_lower_triangular_in_place(l.as_ref(), x, Par::Seq);
}

/// a b, by all threads.
#[inline(never)]
pub fn product(a: MatRef<f64>, b: MatRef<f64>) -> Mat<f64> {
    a * b
}

/// The eigenvalues and eigenvectors of a small symmetric matrix, in no order; `None` if they do not converge to `tolerance` within so
/// many iterations (0: without end).
#[inline(never)]
pub fn small_symmetric_eigen(
    matrix: DMatrix<f64>,
    tolerance: f64,
    iterations: usize,
) -> Option<SymmetricEigen<f64, Dyn>> {
    SymmetricEigen::try_new(matrix, tolerance, iterations)
}

/// The eigenvalues of a small symmetric matrix, in no order.
#[inline(never)]
pub fn small_symmetric_eigenvalues(matrix: DMatrix<f64>) -> DVector<f64> {
    matrix.symmetric_eigenvalues()
}

/// The eigenvalues of a small matrix, in no order, by one thread; `None` if they do not converge, as above.
#[inline(never)]
pub fn small_eigenvalues(matrix: DMatrix<f64>, tolerance: f64, iterations: usize) -> Option<Vec<Complex<f64>>> {
    Schur::try_new(matrix, tolerance, iterations).map(|schur| schur.complex_eigenvalues().iter().copied().collect())
}

/// The eigenvalues of a small complex matrix, in no order; `None` if they do not converge, as above.
#[inline(never)]
pub fn small_complex_eigenvalues(
    matrix: DMatrix<Complex<f64>>,
    tolerance: f64,
    iterations: usize,
) -> Option<DVector<Complex<f64>>> {
    Schur::try_new(matrix, tolerance, iterations)?.eigenvalues()
}

/// H of a matrix QHQᵀ.
#[inline(never)]
pub fn hessenberg(matrix: DMatrix<f64>) -> DMatrix<f64> {
    Hessenberg::new(matrix).unpack_h()
}

/// LU of a small matrix, with partial pivoting.
#[inline(never)]
pub fn small_lu(matrix: DMatrix<f64>) -> LU<f64, Dyn, Dyn> {
    matrix.lu()
}

/// The same of a complex matrix.
#[inline(never)]
pub fn small_complex_lu(matrix: DMatrix<Complex<f64>>) -> LU<Complex<f64>, Dyn, Dyn> {
    matrix.lu()
}

/// QR of a small matrix.
#[inline(never)]
pub fn small_qr(matrix: DMatrix<f64>) -> QR<f64, Dyn, Dyn> {
    matrix.qr()
}

/// L of a small symmetric matrix, of which the lower triangle is read; `None` if it is not positive definite.
#[inline(never)]
pub fn small_cholesky(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    matrix.cholesky()
}

/// U, S and V of a small matrix, S descending.
#[inline(never)]
pub fn small_svd(matrix: DMatrix<f64>) -> SVD<f64, Dyn, Dyn> {
    matrix.svd(true, true)
}

/// The singular values of a small matrix, descending.
#[inline(never)]
pub fn small_singular_values(matrix: DMatrix<f64>) -> DVector<f64> {
    matrix.singular_values()
}
