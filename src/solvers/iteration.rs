//! Iteration loop of all methods: error, stopping rules, update, history.

use std::fmt;
use std::ops::ControlFlow;

use glam::DVec3;

use crate::parallel;

/// The paper's two errors of an iterate: over the vertices, in the units of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// max_i ‖p_i − (A v)_i‖₂
    pub max: f64,
    /// mean_i ‖p_i − (A v)_i‖₂
    pub mean: f64,
}

/// The errors in another unit of length.
impl std::ops::Mul<f64> for Errors {
    type Output = Errors;

    fn mul(self, unit: f64) -> Errors {
        Errors { max: unit * self.max, mean: unit * self.mean }
    }
}

/// The errors of one iterate of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// The number of updates made before; 0 for the start.
    pub iteration: usize,
    /// What the errors were then.
    pub errors: Errors,
}

/// When to stop: at the first iterate with maximum error ≤ `tolerance` (absolute, in mesh units), or after
/// `max_iterations` updates. A tolerance below [`FLOOR`] last digits of the data ends the run there, as
/// [`Outcome::Rounding`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The bound of the maximum error, in mesh units; one that is not finite is never met, nor is it below rounding.
    pub tolerance: f64,
    /// The most updates of all vertices; the start is measured before the first.
    pub max_iterations: usize,
}

impl Stop {
    /// How a run on data whose largest coordinate is `size` ends at an error that is as small as was asked for, or as
    /// can be told. Below the floor it is a matter of luck which residuals round to the tolerance, so that none is held
    /// against it there.
    pub(crate) fn reached(&self, error: f64, size: f64) -> Option<Outcome> {
        let floor = floor(size);
        if !self.tolerance.is_finite() {
            None
        } else if self.tolerance < floor {
            (error <= floor).then_some(Outcome::Rounding)
        } else {
            (error <= self.tolerance).then_some(Outcome::Converged)
        }
    }

    /// How a run ends that has got to an error after so many iterations, on data of a `size`, and whose watch has `told` to
    /// go on or not, if it does whatever the method is.
    pub(super) fn verdict(&self, error: f64, size: f64, iterations: usize, told: ControlFlow<()>) -> Option<Outcome> {
        if let Some(reached) = self.reached(error, size) {
            Some(reached)
        } else if !error.is_finite() {
            Some(Outcome::Diverged)
        } else if told.is_break() {
            Some(Outcome::Stopped)
        } else {
            (iterations >= self.max_iterations).then_some(Outcome::MaxIterations)
        }
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The tolerance is met by the true residual.
    Converged,
    /// The true residual is within [`FLOOR`] last digits of the data, and the tolerance lies below: it cannot be told
    /// whether it is met.
    Rounding,
    /// The error grew: [`GROWTH`]-fold from its smallest value with [`RISES`] rises in a row, or
    /// [`BLOW_UP`]-fold from the start, or it is no longer finite.
    Diverged,
    /// The limit on iterations came first.
    MaxIterations,
    /// The smallest error has not improved by a relative [`PROGRESS`] within [`PATIENCE`] iterations.
    Stagnated,
    /// The matrix is singular to working precision.
    Singular,
    /// The method cannot go on (a factorization or a recurrence broke down).
    Breakdown,
    /// The caller's watch said stop.
    Stopped,
}

impl Outcome {
    /// The name in messages and reports, in lower case with hyphens.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Converged => "converged",
            Outcome::Rounding => "rounding",
            Outcome::Diverged => "diverged",
            Outcome::MaxIterations => "max-iterations",
            Outcome::Stagnated => "stagnated",
            Outcome::Singular => "singular",
            Outcome::Breakdown => "breakdown",
            Outcome::Stopped => "stopped",
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What a run leaves besides the control points.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// How the run ended.
    pub outcome: Outcome,
    /// Updates of all vertices made.
    pub iterations: usize,
    /// The errors of every iterate; entry 0 is the start, so there are `iterations + 1`. A method that knows its
    /// errors every few iterations only ([`mixed`](super::mixed)) has an entry for each time; so has `auto` at darts and
    /// semi-sharp vertices, where entry 0 comes after the first solution for the others.
    pub history: Vec<Recorded>,
    /// What was found where the outcome needs a reason.
    pub detail: Option<String>,
}

impl Report {
    /// The errors of the last iterate.
    pub fn last(&self) -> Errors {
        self.history.last().map_or(Errors { max: f64::NAN, mean: f64::NAN }, |last| last.errors)
    }

    /// The maximum errors of the history, in its order.
    pub fn maxima(&self) -> Vec<f64> {
        self.history.iter().map(|recorded| recorded.errors.max).collect()
    }
}

/// What the watch sees after the errors of an iterate are known, first for the start.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// The number of updates made; 0 for the start.
    pub iteration: usize,
    /// The errors of this iterate.
    pub errors: Errors,
    /// The iterate itself, one point a vertex.
    pub points: &'a [DVec3],
}

/// Why a method cannot be set up or go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// [`Outcome::Singular`] or [`Outcome::Breakdown`].
    pub outcome: Outcome,
    /// The reason in words, such as the pivot that vanishes.
    pub detail: String,
}

/// One method at work on one system: it knows the errors of its current iterate and can replace it by the next.
pub trait Iterate {
    /// The errors of the current iterate. Called once an iterate, before
    /// [`advance`](Self::advance), so that a method may prepare the update in the same pass.
    fn errors(&mut self) -> Errors;

    /// Checks `errors`, what [`errors`](Self::errors) said of the current iterate, before a decision rests on them.
    /// Only a method that gets them by a recurrence has anything to do: evaluate them by a product.
    fn confirm(&mut self, errors: Errors) -> Errors {
        errors
    }

    /// Replaces the current iterate by the next one.
    ///
    /// # Errors
    /// A recurrence that broke down; the current iterate stays.
    fn advance(&mut self) -> Result<(), Failure>;

    /// The current iterate: control points, one a vertex.
    fn points(&self) -> &[DVec3];
}

/// A method that can begin elsewhere than at V = P.
pub trait WarmStart: Iterate {
    /// Goes back to the first iterate, which becomes `at`. To be called before the first errors are asked for.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    fn start_at(&mut self, at: &[DVec3]);
}

/// An error this many times the smallest one so far is divergence, if it also rose [`RISES`] times in a row.
/// Tuned: errors of convergent runs of all methods here rose less than 100-fold.
pub const GROWTH: f64 = 1e3;
/// Rises in a row that go with [`GROWTH`].
pub const RISES: usize = 10;
/// An error this many times the start's is divergence at once.
pub const BLOW_UP: f64 = 1e12;
/// Errors below this part of the start's count as this much, so that noise at rounding level is no growth.
pub const NOISE: f64 = 1e-13;
/// Iterations without [`PROGRESS`] after which a run has stagnated.
pub const PATIENCE: usize = 100;
/// The relative improvement of the smallest error that counts as progress.
pub const PROGRESS: f64 = 1e-8;

/// Errors of this many times ε·max|p|, the last digit of the data, are rounding: what one product leaves of an exact
/// solution on meshes of usual valences, and so nothing that a tolerance below can be held against.
pub const FLOOR: f64 = 4.0;

/// What errors cannot be told below, for data whose largest coordinate is `size`; 0 where that overflows.
pub(super) fn floor(size: f64) -> f64 {
    let floor = FLOOR * f64::EPSILON * size;
    if floor.is_finite() { floor } else { 0.0 }
}

/// Runs `method` until a stopping rule applies. The start is the method's current iterate. The watch sees every
/// iterate and may stop the run.
pub fn solve(method: &mut dyn Iterate, stop: &Stop, watch: &mut dyn FnMut(&Step) -> ControlFlow<()>) -> Report {
    let size = largest(method.points());
    solve_in_scale(method, size, stop, watch)
}

/// The largest coordinate.
pub(crate) fn largest(points: &[DVec3]) -> f64 {
    largest_of(points, |p| p.abs().max_element())
}

/// The largest `value` of a point, 0 at least; what is not a number does not count. In parallel.
pub(crate) fn largest_of(points: &[DVec3], value: impl Fn(DVec3) -> f64 + Sync) -> f64 {
    const CHUNK: usize = 4096;
    let parts =
        parallel::map(points.len(), CHUNK, |range| points[range].iter().fold(0.0, |m: f64, &p| m.max(value(p))));
    parts.into_iter().fold(0.0, f64::max)
}

/// As [`solve`], for data whose largest coordinate is `size`.
pub(crate) fn solve_in_scale(
    method: &mut dyn Iterate,
    size: f64,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Report {
    let mut history: Vec<Recorded> = Vec::new();
    let mut rules = Rules { rounding: f64::EPSILON * size, ..Rules::default() };
    loop {
        let mut errors = method.errors();
        let iteration = history.len();
        if stop.reached(errors.max, size).is_some() || iteration >= stop.max_iterations {
            errors = method.confirm(errors);
        }
        history.push(Recorded { iteration, errors });
        let step = Step { iteration, errors, points: method.points() };
        let told = watch(&step);
        let ended = if let Some(reached) = stop.reached(errors.max, size) {
            Some(reached)
        } else if let Some(outcome) = rules.judge(errors.max) {
            Some(outcome)
        } else if told.is_break() {
            Some(Outcome::Stopped)
        } else if iteration >= stop.max_iterations {
            Some(Outcome::MaxIterations)
        } else {
            None
        };
        let (outcome, detail) = match ended {
            Some(outcome) => (outcome, None),
            None => match method.advance() {
                Ok(()) => continue,
                Err(failure) => (failure.outcome, Some(failure.detail)),
            },
        };
        return Report { outcome, iterations: iteration, history, detail };
    }
}

/// The state of the rules for divergence and stagnation.
#[derive(Clone, Copy, Debug, Default)]
struct Rules {
    /// Of the data: no error can be told below, and what stays near it does not grow.
    rounding: f64,
    start: Option<f64>,
    previous: f64,
    smallest: f64,
    rises: usize,
    since_progress: usize,
}

impl Rules {
    fn judge(&mut self, error: f64) -> Option<Outcome> {
        if !error.is_finite() {
            return Some(Outcome::Diverged);
        }
        let Some(start) = self.start else {
            *self = Rules { start: Some(error), previous: error, smallest: error, ..*self };
            return None;
        };
        self.rises = if error > self.previous { self.rises + 1 } else { 0 };
        self.previous = error;
        if error < self.smallest * (1.0 - PROGRESS) {
            self.since_progress = 0;
        } else {
            self.since_progress += 1;
        }
        self.smallest = self.smallest.min(error);
        let floor = self.smallest.max(NOISE * start).max(self.rounding);
        if error > BLOW_UP * start.max(self.rounding) || (error > GROWTH * floor && self.rises >= RISES) {
            Some(Outcome::Diverged)
        } else if self.since_progress >= PATIENCE && self.rises < RISES {
            Some(Outcome::Stagnated)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_is_found_among_many() {
        let mut points = vec![DVec3::ONE; 10_000];
        (points[20], points[9_999]) = (DVec3::NAN, DVec3::new(0.0, -3.0, 4.0));
        assert_eq!((largest(&points), largest_of(&points, DVec3::length_squared)), (4.0, 25.0));
        assert_eq!(largest(&[]), 0.0);
    }

    /// An iteration whose errors are a given sequence.
    struct Script<'a> {
        errors: &'a dyn Fn(usize) -> f64,
        k: usize,
        points: &'a [DVec3],
    }

    impl Iterate for Script<'_> {
        fn errors(&mut self) -> Errors {
            let max = (self.errors)(self.k);
            Errors { max, mean: 0.5 * max }
        }
        fn advance(&mut self) -> Result<(), Failure> {
            self.k += 1;
            Ok(())
        }
        fn points(&self) -> &[DVec3] {
            self.points
        }
    }

    fn run(errors: &dyn Fn(usize) -> f64, tolerance: f64) -> Report {
        run_on(&[], errors, tolerance)
    }

    fn run_on(points: &[DVec3], errors: &dyn Fn(usize) -> f64, tolerance: f64) -> Report {
        let stop = Stop { tolerance, max_iterations: 5000 };
        solve(&mut Script { errors, k: 0, points }, &stop, &mut |_| ControlFlow::Continue(()))
    }

    #[test]
    fn converges_at_the_first_iterate_within_tolerance() {
        let report = run(&|k| 0.5f64.powi(k as i32), 1e-3);
        assert_eq!(report.outcome, Outcome::Converged);
        assert_eq!(report.iterations, 10); // 2⁻¹⁰ < 10⁻³ < 2⁻⁹
        assert_eq!(report.history.len(), 11);
        assert_eq!(report.history[0], Recorded { iteration: 0, errors: Errors { max: 1.0, mean: 0.5 } });
        assert_eq!(report.history[10].iteration, 10);
    }

    #[test]
    fn a_start_within_tolerance_needs_no_iteration() {
        let report = run(&|_| 0.0, 0.0);
        assert_eq!((report.outcome, report.iterations), (Outcome::Converged, 0));
    }

    #[test]
    fn geometric_growth_is_divergence_early() {
        // 1.25^31 is the first power beyond 1000.
        let report = run(&|k| 1.25f64.powi(k as i32), 1e-3);
        assert_eq!((report.outcome, report.iterations), (Outcome::Diverged, 31));
    }

    #[test]
    fn decay_that_turns_into_growth_is_divergence() {
        let report = run(&|k| 0.7f64.powi(k as i32) + 1e-4 * 1.01f64.powi(k as i32), 1e-9);
        assert_eq!(report.outcome, Outcome::Diverged);
    }

    #[test]
    fn slow_growth_is_not_called_stagnation() {
        let report = run(&|k| 1.0025f64.powi(k as i32), 1e-9);
        assert_eq!(report.outcome, Outcome::Diverged);
    }

    #[test]
    fn a_floor_is_stagnation() {
        let report = run(&|k| 0.5f64.powi(k as i32) + 1e-5, 1e-9);
        assert_eq!(report.outcome, Outcome::Stagnated);
        assert!(report.iterations < 200);
    }

    #[test]
    fn growth_within_the_rounding_of_the_data_is_stagnation() {
        // An error that falls below the last digit of coordinates of 5·10⁵, by a recurrence, and climbs back to it.
        let errors = |k: usize| (1e-2 * 0.01f64.powi(k as i32)).max(1e-20 * 3f64.powi(k.min(23) as i32));
        assert_eq!(run(&errors, 1e-30).outcome, Outcome::Diverged);
        assert_eq!(run_on(&[DVec3::X * 5e5], &errors, f64::NAN).outcome, Outcome::Stagnated);
        let report = run_on(&[DVec3::X * 5e5], &|k| 1.25f64.powi(k as i32), 1e-3);
        assert_eq!((report.outcome, report.iterations), (Outcome::Diverged, 31));
    }

    #[test]
    fn a_tolerance_below_a_few_last_digits_of_the_data_ends_at_them() {
        let errors = |k: usize| 0.1f64.powi(k as i32);
        // The floor is 4ε = 8.9e-16 for coordinates of size 1.
        let points = [DVec3::new(0.5, -1.0, 0.25)];
        for (tolerance, outcome, iterations) in [
            (1.1e-14, Outcome::Converged, 14),
            (9e-16, Outcome::Converged, 16),
            (8e-16, Outcome::Rounding, 16),
            (1e-30, Outcome::Rounding, 16),
            (0.0, Outcome::Rounding, 16),
            (-1.0, Outcome::Rounding, 16),
        ] {
            let report = run_on(&points, &errors, tolerance);
            assert_eq!((report.outcome, report.iterations), (outcome, iterations), "{tolerance:e}");
        }
        // A residual that happens to round to nothing is none the nearer.
        assert_eq!(run_on(&points, &|_| 0.0, 0.0).outcome, Outcome::Rounding);
        // The floor goes with the data.
        let report = run_on(&[DVec3::Y * 1e6], &errors, 1e-10);
        assert_eq!((report.outcome, report.iterations), (Outcome::Rounding, 10));
        // Where the data overflow, nothing is told.
        assert_eq!(run_on(&[DVec3::Y * f64::INFINITY], &errors, 1e-10).outcome, Outcome::Converged);
    }

    #[test]
    fn what_is_not_finite_never_converges() {
        assert_eq!(run(&|_| f64::INFINITY, f64::INFINITY).outcome, Outcome::Diverged);
        assert_ne!(run(&|_| 1.0, f64::INFINITY).outcome, Outcome::Converged);
        assert_eq!(run(&|_| f64::NAN, 1.0).outcome, Outcome::Diverged);
    }

    #[test]
    fn slow_convergence_is_no_stagnation() {
        let report = run(&|k| (-1e-6 * k as f64).exp(), 1e-9);
        assert_eq!(report.outcome, Outcome::MaxIterations);
        assert_eq!(report.iterations, 5000);
    }

    #[test]
    fn not_a_number_is_divergence() {
        let report = run(
            &|k| {
                if k == 3 { f64::NAN } else { 1.0 / (k + 1) as f64 }
            },
            1e-9,
        );
        assert_eq!((report.outcome, report.iterations), (Outcome::Diverged, 3));
    }

    #[test]
    fn the_watch_sees_every_iterate_and_may_stop() {
        let mut seen = Vec::new();
        let stop = Stop { tolerance: 0.0, max_iterations: 50 };
        let errors = |k: usize| 1.0 / (k + 1) as f64;
        let report = solve(&mut Script { errors: &errors, k: 0, points: &[] }, &stop, &mut |step| {
            seen.push(step.iteration);
            if step.iteration == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(seen, [0, 1, 2, 3, 4]);
        assert_eq!((report.outcome, report.iterations), (Outcome::Stopped, 4));
    }
}
