//! Symmetric SOR: a sweep in the vertex order, then one in the reverse order; both together are one iteration.
//!
//! Converges for 0 < ω < 2 where A is non-singular. Its iteration matrix has real eigenvalues in [0, 1), and so it
//! may serve as a preconditioner of conjugate gradients. Three passes over A an iteration, error included.

use glam::DVec3;

use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::system::{Rows, System, sweep_with};

/// Symmetric SOR at work.
pub struct Ssor<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    omega: f64,
    order: Option<&'a [u32]>,
    current: Vec<DVec3>,
    rows: Rows,
    sums: Vec<DVec3>,
}

impl<'a, S: System> Ssor<'a, S> {
    /// Starts from V = P; see [`Sor::new`](super::gauss_seidel::Sor::new).
    ///
    /// # Panics
    /// If the order names a vertex that the system lacks.
    pub fn new(system: &'a S, points: &'a [DVec3], omega: f64, order: Option<&'a [u32]>) -> Self {
        Ssor { system, points, omega, order, current: points.to_vec(), rows: Rows::new(points.len()), sums: Vec::new() }
    }
}

impl<S: System> Iterate for Ssor<'_, S> {
    fn errors(&mut self) -> Errors {
        self.rows.errors(self.system, self.points, &self.current)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        symmetric_sweep_with(self.system, self.points, self.omega, self.order, &mut self.current, &mut self.sums);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

impl<S: System> WarmStart for Ssor<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
    }
}

/// A forward and a backward sweep.
pub fn symmetric_sweep<S: System>(system: &S, points: &[DVec3], omega: f64, order: Option<&[u32]>, x: &mut [DVec3]) {
    symmetric_sweep_with(system, points, omega, order, x, &mut Vec::new());
}

/// As [`symmetric_sweep`], with memory for the sums over faces that rows share.
pub(super) fn symmetric_sweep_with<S: System>(
    system: &S,
    points: &[DVec3],
    omega: f64,
    order: Option<&[u32]>,
    x: &mut [DVec3],
    sums: &mut Vec<DVec3>,
) {
    match order {
        Some(order) => {
            let vertices = order.iter().map(|&i| i as usize);
            sweep_with(system, points, omega, vertices.clone(), x, sums);
            sweep_with(system, points, omega, vertices.rev(), x, sums);
        }
        None => {
            sweep_with(system, points, omega, 0..points.len(), x, sums);
            sweep_with(system, points, omega, (0..points.len()).rev(), x, sums);
        }
    }
}
