//! Sparse Cholesky M = LLᵀ and LDLᵀ by faer, under an approximate minimum degree order.

use faer::Mat;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltError;
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::SymbolicCholesky;
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use glam::DVec3;
use limitlab_factorizations::sparse::{
    ldlt, ldlt_scratch, ldlt_solve, llt, llt_scratch, llt_solve, solve_scratch, symbolic_cholesky,
};

use super::{Factorization, failed, room};
use crate::assemble::Csr;
use crate::solvers::iteration::{Failure, Outcome};

/// Which of the two factorizations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CholeskyForm {
    /// M = LLᵀ: fails on a pivot that is not positive.
    Llt,
    /// M = LDLᵀ: fails on a vanishing pivot only.
    Ldlt,
}

/// M factored by faer. Sequential: for these small supernodes a second thread costs more than it gives, and the
/// result does not depend on the number of threads.
pub struct Cholesky {
    kind: CholeskyForm,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    right_hand_sides: Mat<f64>,
    scratch: MemBuffer,
}

/// M, which is symmetric, as faer's compressed columns, without a copy.
pub(super) fn faer_pattern(m: &Csr) -> SymbolicSparseColMatRef<'_, u32> {
    let (offsets, columns) = (m.pattern().offsets(), m.pattern().columns());
    SymbolicSparseColMatRef::new_checked(m.len(), m.len(), offsets, None, columns)
}

impl Cholesky {
    /// Factors the symmetric matrix `m`.
    ///
    /// # Errors
    /// [`Outcome::Singular`] on a pivot that the factorization refuses, [`Outcome::Breakdown`] when memory or
    /// 32-bit indices do not suffice.
    pub fn new(m: &Csr, kind: CholeskyForm) -> Result<Self, Failure> {
        let name = match kind {
            CholeskyForm::Llt => "Cholesky",
            CholeskyForm::Ldlt => "LDLᵀ",
        };
        let broken = |why: &dyn std::fmt::Display| failed(name, Outcome::Breakdown, why);
        let pattern = faer_pattern(m);
        // The graph twice while it is ordered, and the columns of its elements.
        room(name, "the order of a matrix", m.values().len(), 12)?;
        let symbolic = symbolic_cholesky(pattern, Default::default()).map_err(|e| broken(&e))?;
        let matrix = SparseColMatRef::new(pattern, m.values());
        let fill = symbolic.len_val();
        room(name, "the factor", fill, 8)?;
        let mut values = vec![0.0; fill];
        match kind {
            CholeskyForm::Llt => {
                let mut memory = MemBuffer::try_new(llt_scratch(&symbolic)).map_err(|e| broken(&e))?;
                llt(&symbolic, &mut values, matrix, MemStack::new(&mut memory)).map_err(|e| match e {
                    LltError::NonPositivePivot { index } => {
                        Failure { outcome: Outcome::Singular, detail: format!("{name}: pivot {index} is not positive") }
                    }
                })?;
            }
            CholeskyForm::Ldlt => {
                let mut memory = MemBuffer::try_new(ldlt_scratch(&symbolic)).map_err(|e| broken(&e))?;
                ldlt(&symbolic, &mut values, matrix, MemStack::new(&mut memory)).map_err(|e| match e {
                    LdltError::ZeroPivot { index } => {
                        Failure { outcome: Outcome::Singular, detail: format!("{name}: pivot {index} vanishes") }
                    }
                })?;
            }
        }
        let scratch = MemBuffer::try_new(solve_scratch(&symbolic, 3)).map_err(|e| broken(&e))?;
        Ok(Cholesky { kind, symbolic, values, right_hand_sides: Mat::zeros(m.len(), 3), scratch })
    }
}

impl Factorization for Cholesky {
    fn solve(&mut self, h: &[f64], x: &mut [DVec3]) {
        let b = &mut self.right_hand_sides;
        for (i, (v, h)) in x.iter().zip(h).enumerate() {
            for axis in 0..3 {
                b[(i, axis)] = v[axis] / h;
            }
        }
        let stack = MemStack::new(&mut self.scratch);
        match self.kind {
            CholeskyForm::Llt => llt_solve(&self.symbolic, &self.values, b.as_mut(), stack),
            CholeskyForm::Ldlt => ldlt_solve(&self.symbolic, &self.values, b.as_mut(), stack),
        }
        for (i, v) in x.iter_mut().enumerate() {
            *v = DVec3::new(b[(i, 0)], b[(i, 1)], b[(i, 2)]);
        }
    }

    fn fill(&self) -> Option<usize> {
        Some(self.symbolic.len_val())
    }
}
