//! Progressive iterative approximation (Richardson): `V ← V + ω (P − A V)`.
//!
//! PIA §2 and §3 with ω = 1; W-PIA with another ω. The error matrix is I − ωA, so the rate is
//! max |1 − ωλ| over the eigenvalues λ of A; ω = 2/(λ_min + λ_max) gives the best, (κ−1)/(κ+1). One pass over
//! A an iteration, two arrays of N points.

use glam::DVec3;

use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::system::{Rows, System};

/// PIA and W-PIA at work.
pub struct Pia<'a, S> {
    relaxation: Relaxation<'a, S>,
    omega: f64,
}

impl<'a, S: System> Pia<'a, S> {
    /// Starts from V = P.
    pub fn new(system: &'a S, points: &'a [DVec3], omega: f64) -> Self {
        Pia { relaxation: Relaxation::new(system, points), omega }
    }
}

impl<S: System> Iterate for Pia<'_, S> {
    fn errors(&mut self) -> Errors {
        let omega = self.omega;
        self.relaxation.prepare(|_| omega)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.relaxation.accept();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.relaxation.current
    }
}

impl<S: System> WarmStart for Pia<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.relaxation.current.copy_from_slice(at);
    }
}

/// Simultaneous relaxation `v_i ← v_i + s_i e_i`: the residual, its norms and the next iterate in one pass.
pub(super) struct Relaxation<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    pub(super) current: Vec<DVec3>,
    next: Vec<DVec3>,
    rows: Rows,
}

impl<'a, S: System> Relaxation<'a, S> {
    pub(super) fn new(system: &'a S, points: &'a [DVec3]) -> Self {
        Relaxation {
            system,
            points,
            current: points.to_vec(),
            next: vec![DVec3::ZERO; points.len()],
            rows: Rows::new(points.len()),
        }
    }

    /// The errors of the current iterate; the next one is written beside it.
    pub(super) fn prepare(&mut self, scale: impl Fn(usize) -> f64 + Sync) -> Errors {
        let current = &self.current;
        self.rows
            .residual(self.system, self.points, current, &mut self.next, |i, e, next, _| {
                *next = current[i] + scale(i) * e
            })
            .errors
    }

    pub(super) fn accept(&mut self) {
        std::mem::swap(&mut self.current, &mut self.next);
    }
}
