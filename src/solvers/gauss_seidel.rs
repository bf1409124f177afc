//! Gauss-Seidel and SOR: in-place sweeps `v_i ← v_i + ω (p_i − (A v)_i)/a_ii` in a given vertex order.
//!
//! M is symmetric positive definite where A is non-singular, so every order converges for 0 < ω < 2 (ω = 1 is
//! Gauss-Seidel); the order changes the rate (Zheng-Cai §5). A sweep reads A once; testing the error of the
//! result reads it again. One array of N points.

use glam::DVec3;

use super::iteration::{Errors, Failure, Iterate};
use super::system::{Rows, System};

/// Gauss-Seidel and SOR at work.
pub struct Sor<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    omega: f64,
    order: Option<&'a [u32]>,
    current: Vec<DVec3>,
    rows: Rows,
}

impl<'a, S: System> Sor<'a, S> {
    /// Starts from V = P. `order[k]` is the vertex relaxed k-th; without it, the file's order.
    ///
    /// # Panics
    /// If the order names a vertex that the system lacks.
    pub fn new(system: &'a S, points: &'a [DVec3], omega: f64, order: Option<&'a [u32]>) -> Self {
        Sor {
            system,
            points,
            omega,
            order,
            current: points.to_vec(),
            rows: Rows::new(points.len()),
        }
    }
}

impl<S: System> Iterate for Sor<'_, S> {
    fn errors(&mut self) -> Errors {
        self.rows.errors(self.system, self.points, &self.current)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let n = self.points.len();
        match self.order {
            Some(order) => sweep(
                self.system,
                self.points,
                self.omega,
                order.iter().map(|&i| i as usize),
                &mut self.current,
            ),
            None => sweep(
                self.system,
                self.points,
                self.omega,
                0..n,
                &mut self.current,
            ),
        }
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

/// One in-place sweep over the vertices in the order given.
pub fn sweep<S: System>(
    system: &S,
    points: &[DVec3],
    omega: f64,
    order: impl Iterator<Item = usize>,
    x: &mut [DVec3],
) {
    let diagonal = system.diagonal();
    for i in order {
        let e = points[i] - system.row(i, x);
        x[i] += (omega / diagonal[i]) * e;
    }
}
