//! Chebyshev iteration on A for a spectrum within `[λ_min, λ_max]`: the three-term recurrence
//! `V_{k+1} = V_k + γ_k (V_k − V_{k−1}) + τ_k (P − A V_k)`.
//!
//! After k iterations the error in ‖H^-½·‖₂ has shrunk at least by 1/T_k((κ+1)/(κ−1)), κ = λ_max/λ_min: the
//! count for a reduction by ε is known in advance, ⌈acosh(1/ε)/acosh((κ+1)/(κ−1))⌉. No inner products; one
//! pass over A an iteration, two arrays of N points.

use glam::DVec3;

use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::system::{Rows, System};

/// The Chebyshev iteration at work.
pub struct Chebyshev<'a, S> {
    iterates: ThreeTerm<'a, S>,
    spectrum: (f64, f64),
    recurrence: Recurrence,
}

impl<'a, S: System> Chebyshev<'a, S> {
    /// Starts from V = P, for eigenvalues within `spectrum`.
    ///
    /// # Panics
    /// Unless 0 < λ_min ≤ λ_max.
    pub fn new(system: &'a S, points: &'a [DVec3], spectrum: (f64, f64)) -> Self {
        Chebyshev { iterates: ThreeTerm::new(system, points), spectrum, recurrence: Recurrence::new(spectrum) }
    }
}

impl<S: System> Iterate for Chebyshev<'_, S> {
    fn errors(&mut self) -> Errors {
        self.iterates.prepare(self.recurrence.coefficients())
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.recurrence.step();
        self.iterates.accept();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.iterates.current
    }
}

impl<S: System> WarmStart for Chebyshev<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.recurrence = Recurrence::new(self.spectrum);
        self.iterates.start_at(at);
    }
}

/// `V_{k+1} = V_k + γ (V_k − V_{k−1}) + τ (P − A V_k)`: the residual, its norms and the next iterate in one pass.
pub(super) struct ThreeTerm<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    pub(super) current: Vec<DVec3>,
    /// The iterate before the current one, which is itself at the start; then the next.
    other: Vec<DVec3>,
    rows: Rows,
}

impl<'a, S: System> ThreeTerm<'a, S> {
    pub(super) fn new(system: &'a S, points: &'a [DVec3]) -> Self {
        let (current, other) = (points.to_vec(), points.to_vec());
        ThreeTerm { system, points, current, other, rows: Rows::new(points.len()) }
    }

    /// The errors of the current iterate; the next one is written over the one before it.
    pub(super) fn prepare(&mut self, (gamma, tau): (f64, f64)) -> Errors {
        let current = &self.current;
        self.rows
            .residual(self.system, self.points, current, &mut self.other, |i, e, other, _| {
                let v = current[i];
                *other = v + gamma * (v - *other) + tau * e;
            })
            .errors
    }

    pub(super) fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
        self.other.copy_from_slice(at);
    }

    pub(super) fn accept(&mut self) {
        std::mem::swap(&mut self.current, &mut self.other);
    }
}

/// The coefficients γ_k, τ_k of the recurrence.
#[derive(Clone, Copy, Debug)]
pub struct Recurrence {
    /// Half the length of the interval.
    delta: f64,
    /// Its midpoint over `delta`; the argument of the Chebyshev polynomials at 0. Infinite for one point.
    sigma: f64,
    midpoint: f64,
    /// T_{k−1}(σ)/T_k(σ); 0 stands for the first step.
    ratio: f64,
}

impl Recurrence {
    /// # Panics
    /// Unless 0 < λ_min ≤ λ_max.
    pub fn new((lambda_min, lambda_max): (f64, f64)) -> Self {
        assert!(0.0 < lambda_min && lambda_min <= lambda_max, "a positive interval, not [{lambda_min}, {lambda_max}]");
        let delta = 0.5 * (lambda_max - lambda_min);
        let midpoint = 0.5 * (lambda_max + lambda_min);
        Recurrence { delta, sigma: midpoint / delta, midpoint, ratio: 0.0 }
    }

    /// γ_k and τ_k of the coming step.
    pub fn coefficients(&self) -> (f64, f64) {
        if self.ratio == 0.0 {
            return (0.0, 1.0 / self.midpoint);
        }
        let next = 1.0 / (2.0 * self.sigma - self.ratio);
        (next * self.ratio, 2.0 * next / self.delta)
    }

    /// Goes on to the next step.
    pub fn step(&mut self) {
        // An interval of one point needs the first step only, again and again.
        if self.sigma.is_finite() {
            self.ratio = if self.ratio == 0.0 { 1.0 / self.sigma } else { 1.0 / (2.0 * self.sigma - self.ratio) };
        }
    }
}

/// The number of iterations that the theory promises for a reduction of the error in ‖H^-½·‖₂ by `factor` < 1:
/// ⌈acosh(1/factor)/acosh((κ+1)/(κ−1))⌉.
pub fn promised_iterations((lambda_min, lambda_max): (f64, f64), factor: f64) -> f64 {
    let kappa = lambda_max / lambda_min;
    ((1.0 / factor).acosh() / ((kappa + 1.0) / (kappa - 1.0)).acosh()).ceil()
}
