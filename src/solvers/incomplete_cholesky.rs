//! Incomplete Cholesky factorization without fill, IC(0): M ≈ L Lᵀ with L on the pattern of M's lower triangle.

use glam::DVec3;

use super::iteration::{Failure, Outcome};
use crate::assemble::Csr;

/// The factor L by rows, its diagonal last in every row, and inverted.
pub struct IncompleteCholesky {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl IncompleteCholesky {
    /// Factors the symmetric matrix `m`. O(Σ over entries of the row lengths).
    ///
    /// # Errors
    /// A pivot that is not positive: M is no M-matrix, and IC(0) need not exist.
    pub fn new(m: &Csr) -> Result<Self, Failure> {
        let n = m.len();
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0u32);
        let mut columns: Vec<u32> = Vec::with_capacity(m.values().len() / 2 + n);
        let mut values: Vec<f64> = Vec::with_capacity(columns.capacity());
        for i in 0..n {
            let start = columns.len();
            for (j, a) in m.row(i).take_while(|&(j, _)| j <= i) {
                // l_ij = (m_ij − Σ_{k<j} l_ik l_jk) / l_jj over the common columns k of rows i and j.
                let other = if j < i { offsets[j] as usize..offsets[j + 1] as usize } else { start..columns.len() };
                let dot = common_dot(
                    (&columns[start..], &values[start..]),
                    (&columns[other.clone()], &values[other.clone()]),
                    j as u32,
                );
                let rest = a - dot;
                if j < i {
                    values.push(rest * values[other.end - 1]);
                } else if rest > 0.0 {
                    values.push(1.0 / rest.sqrt());
                } else {
                    return Err(Failure {
                        outcome: Outcome::Breakdown,
                        detail: format!("incomplete Cholesky: pivot {rest:e} of vertex {i} is not positive"),
                    });
                }
                columns.push(j as u32);
            }
            offsets.push(columns.len() as u32);
        }
        Ok(IncompleteCholesky { offsets, columns, values })
    }

    /// `x ← (L Lᵀ)⁻¹ x`.
    ///
    /// # Panics
    /// If `x` has not one point a row.
    pub fn solve(&self, x: &mut [DVec3]) {
        let n = self.offsets.len() - 1;
        assert_eq!(x.len(), n, "one point a row");
        for i in 0..n {
            let (last, before) = self.split(i);
            let mut sum = x[i];
            for k in before {
                sum -= self.values[k] * x[self.columns[k] as usize];
            }
            x[i] = sum * self.values[last];
        }
        for i in (0..n).rev() {
            let (last, before) = self.split(i);
            let v = x[i] * self.values[last];
            x[i] = v;
            for k in before {
                x[self.columns[k] as usize] -= self.values[k] * v;
            }
        }
    }

    fn split(&self, i: usize) -> (usize, std::ops::Range<usize>) {
        let last = self.offsets[i + 1] as usize - 1;
        (last, self.offsets[i] as usize..last)
    }
}

/// Σ a_k b_k over the columns below `end` that two sorted rows share.
fn common_dot(a: (&[u32], &[f64]), b: (&[u32], &[f64]), end: u32) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while i < a.0.len() && j < b.0.len() && a.0[i] < end && b.0[j] < end {
        match a.0[i].cmp(&b.0[j]) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                sum += a.1[i] * b.1[j];
                i += 1;
                j += 1;
            }
        }
    }
    sum
}
