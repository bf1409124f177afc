//! PIA with momentum, the heavy-ball method (Polyak 1964): `V_{k+1} = V_k + β (V_k − V_{k−1}) + α (P − A V_k)`.
//!
//! For a spectrum within `[λ_min, λ_max]` the best constants are α = 4/(√λ_min + √λ_max)² and
//! β = ((√κ−1)/(√κ+1))², κ = λ_max/λ_min: those that Chebyshev's coefficients tend to. The first step is the best one of
//! PIA, 2/(λ_min + λ_max) = α/(1+β), for which nothing overshoots: with 2√β cos θ = 1 + β − αλ the part of the error along
//! an eigenvalue λ is multiplied by `β^{k/2} (cos kθ + (1−β)/(1+β)·cos θ sin kθ/sin θ)`, at most
//! `(1 + k(1−β)/(1+β)) β^{k/2}`, after k iterations (Golub and Varga 1961): Chebyshev's rate, but for that factor.
//! No inner products; one pass over A an iteration, two arrays of N points.

use glam::DVec3;

use super::chebyshev::ThreeTerm;
use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::system::System;

/// The heavy-ball method at work.
///
/// ```
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::{Method, Stop, run};
///
/// let surface = Surface::new(builtin::builtin("icosphere:2")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let stop = Stop { tolerance: 1e-9, max_iterations: 200 };
/// let steps = |method| run(&system, surface.positions(), method, &stop).report.iterations;
/// let spectrum = (system.bounds.lambda_min, system.bounds.lambda_max);
/// assert!(steps(Method::HeavyBall { interval: Some(spectrum) }) < steps(Method::Pia));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub struct HeavyBall<'a, S> {
    iterates: ThreeTerm<'a, S>,
    /// Of the coming step, and of all after the first: β and α.
    coming: (f64, f64),
    later: (f64, f64),
}

impl<'a, S: System> HeavyBall<'a, S> {
    /// Starts from V = P, for eigenvalues within `spectrum`.
    ///
    /// # Panics
    /// Unless 0 < λ_min ≤ λ_max.
    pub fn new(system: &'a S, points: &'a [DVec3], spectrum: (f64, f64)) -> Self {
        let (beta, alpha) = constants(spectrum);
        let coming = first(beta, alpha);
        HeavyBall { iterates: ThreeTerm::new(system, points), coming, later: (beta, alpha) }
    }
}

/// The coefficients of the first step.
fn first(beta: f64, alpha: f64) -> (f64, f64) {
    (0.0, alpha / (1.0 + beta))
}

/// β and α for eigenvalues within an interval.
fn constants((lambda_min, lambda_max): (f64, f64)) -> (f64, f64) {
    assert!(0.0 < lambda_min && lambda_min <= lambda_max, "a positive interval, not [{lambda_min}, {lambda_max}]");
    let (low, high) = (lambda_min.sqrt(), lambda_max.sqrt());
    let sum = low + high;
    (((high - low) / sum).powi(2), 4.0 / (sum * sum))
}

impl<S: System> Iterate for HeavyBall<'_, S> {
    fn errors(&mut self) -> Errors {
        self.iterates.prepare(self.coming)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.coming = self.later;
        self.iterates.accept();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.iterates.current
    }
}

impl<S: System> WarmStart for HeavyBall<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.coming = first(self.later.0, self.later.1);
        self.iterates.start_at(at);
    }
}
