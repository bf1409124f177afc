//! Damped Jacobi: `V ← V + ω D⁻¹ (P − A V)`, D = diag A.
//!
//! Converges for every start iff 0 < ω < 2/λ_max(D⁻¹A). Thall's iteration (Eq. 3) is ω = ½, which converges
//! whenever A is non-singular. One pass over A an iteration, two arrays of N points.

use glam::DVec3;

use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::pia::Relaxation;
use super::system::System;

/// Thall's damping.
pub const THALL_OMEGA: f64 = 0.5;

/// Damped Jacobi at work.
pub struct Jacobi<'a, S> {
    relaxation: Relaxation<'a, S>,
    scale: Vec<f64>,
}

impl<'a, S: System> Jacobi<'a, S> {
    /// Starts from V = P. The diagonal of A is positive, as every mask's is.
    pub fn new(system: &'a S, points: &'a [DVec3], omega: f64) -> Self {
        Jacobi {
            relaxation: Relaxation::new(system, points),
            scale: system.diagonal().iter().map(|d| omega / d).collect(),
        }
    }
}

impl<S: System> Iterate for Jacobi<'_, S> {
    fn errors(&mut self) -> Errors {
        let scale = &self.scale;
        self.relaxation.prepare(|i| scale[i])
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.relaxation.accept();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.relaxation.current
    }
}

impl<S: System> WarmStart for Jacobi<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.relaxation.current.copy_from_slice(at);
    }
}
