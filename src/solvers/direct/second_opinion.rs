//! A second, independent Cholesky: nalgebra-sparse's, which has no order of its own, on M permuted by the
//! approximate minimum degree order that faer finds.

use glam::DVec3;
use limitlab_factorizations::sparse::symbolic_cholesky;
use nalgebra::DMatrix;
use nalgebra_sparse::csc::CscMatrix;
use nalgebra_sparse::factorization::CscCholesky;

use super::cholesky::faer_pattern;
use super::{Factorization, failed, room};
use crate::assemble::Csr;
use crate::solvers::iteration::{Failure, Outcome};

/// M factored by nalgebra-sparse.
pub struct SecondOpinion {
    factor: CscCholesky<f64>,
    /// `order[k]` is the vertex eliminated k-th.
    order: Vec<u32>,
    right_hand_sides: DMatrix<f64>,
}

impl SecondOpinion {
    /// Factors the symmetric matrix `m`.
    ///
    /// # Errors
    /// [`Outcome::Singular`] on a pivot that is not positive.
    pub fn new(m: &Csr) -> Result<Self, Failure> {
        let name = "nalgebra-sparse Cholesky";
        let n = m.len();
        let symbolic =
            symbolic_cholesky(faer_pattern(m), Default::default()).map_err(|e| failed(name, Outcome::Breakdown, e))?;
        let fill = symbolic.len_val();
        // Its indices take as much as its values, and while it is found it is there twice.
        room(name, "the factor", fill, 32)?;
        let order: Vec<u32> = match symbolic.perm() {
            Some(perm) => perm.arrays().0.to_vec(),
            None => (0..n as u32).collect(),
        };
        let mut place = vec![0u32; n];
        for (k, &v) in order.iter().enumerate() {
            place[v as usize] = k as u32;
        }
        let mut offsets = vec![0usize];
        let mut rows = Vec::with_capacity(m.values().len());
        let mut values = Vec::with_capacity(m.values().len());
        let mut column: Vec<(usize, f64)> = Vec::new();
        for &v in &order {
            column.clear();
            column.extend(m.row(v as usize).map(|(j, a)| (place[j] as usize, a)));
            column.sort_unstable_by_key(|e| e.0);
            rows.extend(column.iter().map(|e| e.0));
            values.extend(column.iter().map(|e| e.1));
            offsets.push(rows.len());
        }
        let permuted = CscMatrix::try_from_csc_data(n, n, offsets, rows, values)
            .map_err(|e| failed(name, Outcome::Breakdown, e))?;
        let factor = CscCholesky::factor(&permuted).map_err(|e| failed(name, Outcome::Singular, e))?;
        Ok(SecondOpinion { factor, order, right_hand_sides: DMatrix::zeros(n, 3) })
    }
}

impl Factorization for SecondOpinion {
    fn solve(&mut self, h: &[f64], x: &mut [DVec3]) {
        let b = &mut self.right_hand_sides;
        for (k, &v) in self.order.iter().enumerate() {
            for axis in 0..3 {
                b[(k, axis)] = x[v as usize][axis] / h[v as usize];
            }
        }
        self.factor.solve_mut(&mut *b);
        for (k, &v) in self.order.iter().enumerate() {
            x[v as usize] = DVec3::new(b[(k, 0)], b[(k, 1)], b[(k, 2)]);
        }
    }

    fn fill(&self) -> Option<usize> {
        Some(self.factor.l().nnz())
    }
}
