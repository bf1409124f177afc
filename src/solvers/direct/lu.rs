//! Sparse LU of A by faer, with partial pivoting under a COLAMD column order.

use faer::Mat;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::lu::{LuSymbolicParams, NumericLu, SymbolicLu};
use faer::sparse::linalg::{LuError, SupernodalThreshold};
use glam::DVec3;
use limitlab_factorizations::sparse::{lu, lu_scratch, lu_solve, lu_solve_scratch, symbolic_lu};

use super::cholesky::faer_pattern;
use super::{Factorization, failed, room};
use crate::assemble::{Csr, LimitSystem};
use crate::solvers::iteration::{Failure, Outcome};

/// A factored by faer, sequentially. The supernodal variant always: the simplicial one panics on a vanishing
/// pivot.
pub struct SparseLu {
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    right_hand_sides: Mat<f64>,
    scratch: MemBuffer,
}

impl SparseLu {
    /// Factors A.
    ///
    /// # Errors
    /// [`Outcome::Singular`] if A is structurally singular, [`Outcome::Breakdown`] when memory or 32-bit indices
    /// do not suffice.
    pub fn new(system: &LimitSystem) -> Result<Self, Failure> {
        enough_room(&system.m)?;
        // Column j of A holds h_i m_ij: row j of M, weighted by the column's H.
        let m = &system.m;
        let values: Vec<f64> =
            m.pattern().columns().iter().zip(m.values()).map(|(&i, &m)| system.h[i as usize] * m).collect();
        Self::of_columns(m, &values)
    }

    /// Factors the matrix A with these rows.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_rows(a: &Csr) -> Result<Self, Failure> {
        enough_room(a)?;
        let columns = a.transpose();
        Self::of_columns(&columns, columns.values())
    }

    /// Entry k of column j is `values[k]`, in the pattern of the rows of `pattern`.
    fn of_columns(pattern: &Csr, values: &[f64]) -> Result<Self, Failure> {
        let n = pattern.len();
        let broken = |why: &dyn std::fmt::Display| failed("LU", Outcome::Breakdown, why);
        let pattern = faer_pattern(pattern);
        let params = LuSymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = symbolic_lu(pattern, params).map_err(|e| broken(&e))?;
        let mut memory = MemBuffer::try_new(lu_scratch(&symbolic)).map_err(|e| broken(&e))?;
        let mut numeric = NumericLu::new();
        let matrix = SparseColMatRef::new(pattern, values);
        lu(&symbolic, &mut numeric, matrix, MemStack::new(&mut memory)).map_err(|e| match e {
            LuError::SymbolicSingular { .. } => failed("LU", Outcome::Singular, e),
            LuError::Generic(e) => broken(&e),
        })?;
        let scratch = MemBuffer::try_new(lu_solve_scratch(&symbolic, 3)).map_err(|e| broken(&e))?;
        Ok(SparseLu { symbolic, numeric, right_hand_sides: Mat::zeros(n, 3), scratch })
    }
}

/// A copy of the values, and factors with as many entries at the least: nothing cancels.
fn enough_room(matrix: &Csr) -> Result<(), Failure> {
    room("LU", "a factorization of a matrix", matrix.values().len(), 24)
}

impl Factorization for SparseLu {
    fn solve(&mut self, _h: &[f64], x: &mut [DVec3]) {
        let b = &mut self.right_hand_sides;
        for (i, v) in x.iter().enumerate() {
            for axis in 0..3 {
                b[(i, axis)] = v[axis];
            }
        }
        lu_solve(&self.symbolic, &self.numeric, b.as_mut(), MemStack::new(&mut self.scratch));
        for (i, v) in x.iter_mut().enumerate() {
            *v = DVec3::new(b[(i, 0)], b[(i, 1)], b[(i, 2)]);
        }
    }

    /// faer keeps the size of its supernodal LU factors to itself.
    fn fill(&self) -> Option<usize> {
        None
    }
}
