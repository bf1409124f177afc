//! Chebyshev iteration in single precision, corrected in double precision: the same final accuracy for about half
//! the bytes of an iteration.
//!
//! The residual e = P − A V is taken in double precision, `A d = e` is solved roughly in single precision by a
//! [`Wavefront`], V + d is taken in double precision, and so on (iterative refinement: Wilkinson 1963; Langou et al.
//! 2006). A correction gains up to five digits; two or three are usual. The recurrence does not begin anew with each: its
//! momentum γ (V_k − V_{k−1}) goes on to the next residual, as if all iterations were made in one precision (residual
//! replacement: van der Vorst & Ye 2000). So the corrections cost no iterations.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3A};

use super::chebyshev::{Recurrence, promised_iterations};
use super::iteration::{self, Outcome, Recorded, Report, Step, Stop};
use super::system::Rows;
use super::wavefront::{Scratch, Wavefront};
use crate::assemble::Operator;
use crate::pages::{filled, large};
use crate::parallel;
use crate::prefetch::{POINTS_AHEAD, prefetch};

/// A correction in single precision is not asked for more than this: half a digit above its rounding.
const GAIN: f64 = 2e-6;
/// The last iterations aim at this part of the tolerance, since what they promise is in another norm than the test.
const AIM: f64 = 0.9;
/// A correction is asked for at least this, so that one that does nothing can be told from it.
const LEAST_GAIN: f64 = 0.25;
/// A correction that reduces the error less than this has reached rounding, or met a singular matrix.
const PROGRESS: f64 = 0.5;
/// A reduction so many times weaker than promised betrays an interval that is too short.
const DOUBT: f64 = 2.0;
/// An interval is stretched to this part of the λ_min that a weak reduction speaks for: modes beneath remain.
const STRETCH: f64 = 0.8;
/// Intervals do not start below: there, conjugate gradients need fewer iterations.
const LOWEST: f64 = 1e-4;
/// An interval starts at no less than this part of the last one's start: one weak reduction may be an accident.
const STEP: f64 = 1.0 / 16.0;
/// Residuals of this many times ε·max‖p‖ are rounding.
const FLOOR: f64 = 16.0;

/// The arrays that a solution takes besides the control points, to be used again for further points.
#[derive(Clone, Debug)]
pub struct Workspace {
    rows: Rows,
    residual: Vec<Vec3A>,
    correction: Vec<Vec3A>,
    scratch: Scratch<Vec3A>,
}

impl Workspace {
    /// Three arrays of N points in single precision, one of the faces that are summed.
    pub fn new(operator: &Operator) -> Self {
        let n = operator.len();
        Workspace {
            rows: Rows::new(n),
            residual: filled(n, Vec3A::ZERO),
            correction: filled(n, Vec3A::ZERO),
            scratch: Wavefront::new(operator).scratch(),
        }
    }
}

/// Solves `A V = P` from V = P, for eigenvalues up to 1. The interval of the iterations starts at the [usual
/// λ_min](Operator::usual_lambda_min), and is stretched by what each correction was seen to gain, to the proven bound at
/// the most; then the recurrence begins anew. (Eigenvalues below the
/// interval are no danger: there |T_k| grows towards its value at 0, so their modes shrink, only slower.)
///
/// Errors are known after every correction only: the report's history has an entry for each, and its count of
/// iterations is that of all inner ones.
///
/// # Panics
/// If there is not one point a vertex.
pub fn solve(operator: &Operator, points: &[DVec3], stop: &Stop) -> (Vec<DVec3>, Report) {
    let mut control = Vec::new();
    let report = solve_from(operator, points, &mut control, &mut Workspace::new(operator), stop, &mut |_| {
        ControlFlow::Continue(())
    });
    (control, report)
}

/// As [`solve`], from V = `control`, which becomes the solution; an empty one stands for V = P. Allocates no array of N
/// points, unless `control` is empty. The watch sees the start and what each correction makes of it, and may stop the run.
///
/// # Panics
/// If there is not one point a vertex, or the workspace is that of another operator.
pub fn solve_from(
    operator: &Operator,
    points: &[DVec3],
    control: &mut Vec<DVec3>,
    workspace: &mut Workspace,
    stop: &Stop,
    watch: &mut (dyn FnMut(&Step) -> ControlFlow<()> + Send),
) -> Report {
    solve_within(operator, points, 0.0, control, workspace, stop, watch)
}

/// As [`solve_from`], for points that are differences of data whose largest coordinate is `size`: what can be told of errors
/// is what can be told there.
pub(crate) fn solve_within(
    operator: &Operator,
    points: &[DVec3],
    size: f64,
    control: &mut Vec<DVec3>,
    workspace: &mut Workspace,
    stop: &Stop,
    watch: &mut (dyn FnMut(&Step) -> ControlFlow<()> + Send),
) -> Report {
    let n = operator.len();
    assert!(points.len() == n && (control.is_empty() || control.len() == n), "one point a vertex");
    assert_eq!(workspace.residual.len(), n, "the workspace of this operator");
    // Within the thread pool, so that the many short parallel loops need not be handed over to it.
    rayon::scope(|_| in_pool(operator, points, size, control, workspace, stop, watch))
}

fn in_pool(
    operator: &Operator,
    points: &[DVec3],
    size: f64,
    control: &mut Vec<DVec3>,
    workspace: &mut Workspace,
    stop: &Stop,
    watch: &mut (dyn FnMut(&Step) -> ControlFlow<()> + Send),
) -> Report {
    let wavefront = Wavefront::new(operator);
    let Workspace { rows, residual, correction, scratch } = workspace;
    // Residuals in units of the tolerance are far from the ends of single precision's range.
    let unit = if stop.tolerance > 0.0 { stop.tolerance } else { 1.0 };
    let least = operator.bounds().lambda_min.clamp(LOWEST, 1.0);
    let floor = FLOOR * f64::EPSILON * iteration::largest_of(points, DVec3::length_squared).sqrt();
    let size = size.max(iteration::largest(points));
    let goal = stop.tolerance.max(iteration::floor(size));
    let mut history: Vec<Recorded> = Vec::new();
    let mut iterations = 0;
    let mut run = Run::new((operator.usual_lambda_min().max(least), 1.0));
    let outcome = loop {
        let first = run.recurrence.coefficients().1 as f32;
        let goes_on = run.made > 0;
        let current: &[DVec3] = if control.is_empty() { points } else { &*control };
        let errors = rows
            .product(operator, current, residual, correction, |i, ax, r, d, tally| {
                prefetch(points, i + POINTS_AHEAD);
                prefetch(std::slice::from_ref(r), POINTS_AHEAD);
                prefetch(std::slice::from_ref(d), POINTS_AHEAD);
                let e = points[i] - ax;
                tally.error(e);
                *r = (e / unit).as_vec3a();
                let step = first * *r;
                *d = if goes_on { *d + step } else { step };
            })
            .errors;
        let before = history.last().map(|e| e.errors.max);
        history.push(Recorded { iteration: iterations, errors });
        let told = watch(&Step { iteration: iterations, errors, points: current });
        if let Some(outcome) = stop.verdict(errors.max, size, iterations, told) {
            break outcome;
        }
        if let Some(before) = before {
            let gain = errors.max / before;
            if run.interval.0 > least && gain > DOUBT * run.promise() && errors.max > floor {
                let a = (STRETCH * run.lowest_mode(gain)).max(STEP * run.interval.0).max(least);
                run = Run::new((a.min(run.interval.0), 1.0));
                let first = run.recurrence.coefficients().1 as f32;
                parallel::change(correction, |i, d| *d = first * residual[i]);
            } else if gain > PROGRESS {
                break Outcome::Stagnated;
            }
        }
        let count = run.iterations_for(AIM * goal / errors.max).min(stop.max_iterations - iterations);
        let next = wavefront.iterate(run.recurrence, count, residual, correction, scratch);
        run = Run { recurrence: next, made: run.made + count, last: count, ..run };
        iterations += count;
        // The momentum of the step to come, to which the next residual will be added.
        let (gamma, last_but_one) = (next.coefficients().0 as f32, scratch.before());
        let momentum = |i: usize, x: Vec3A| gamma * (x - last_but_one[i]);
        if control.is_empty() {
            *control = large(Vec::with_capacity(points.len()));
            parallel::extend(control, points.len(), |_| |i| points[i] + unit * correction[i].as_dvec3());
            parallel::change(correction, |i, d| *d = momentum(i, *d));
        } else {
            rows.pass(control, correction, |i, v, d, _| {
                *v += unit * d.as_dvec3();
                *d = momentum(i, *d);
            });
        }
    };
    if control.is_empty() {
        *control = points.to_vec();
    }
    Report { outcome, iterations, history, detail: None }
}

/// A run of the recurrence for one interval, which goes on from one residual to the next.
#[derive(Clone, Copy)]
struct Run {
    interval: (f64, f64),
    recurrence: Recurrence,
    /// Iterations so far, and of them those since the residual before.
    made: usize,
    last: usize,
}

impl Run {
    fn new(interval: (f64, f64)) -> Self {
        Run { interval, recurrence: Recurrence::new(interval), made: 0, last: 0 }
    }

    /// The argument of the Chebyshev polynomials at 0.
    fn sigma(&self) -> f64 {
        let (a, b) = self.interval;
        (b + a) / (b - a)
    }

    /// Iterations up to the coming residual, of those that reduce the error to its `factor`: all, or an even share of
    /// them if single precision does not reach so far.
    fn iterations_for(&self, factor: f64) -> usize {
        let parts = (factor.ln() / GAIN.ln()).ceil().max(1.0);
        let factor = factor.powf(1.0 / parts).min(LEAST_GAIN);
        let count = match self.made {
            0 => promised_iterations(self.interval, factor),
            // T_{k+m}(σ)/T_k(σ) where both have grown exponentially.
            _ => ((1.0 / factor).ln() / self.sigma().acosh()).ceil(),
        };
        (count as usize).max(1)
    }

    /// What the last iterations promised to reduce the error to: T_{k−m}(σ)/T_k(σ).
    fn promise(&self) -> f64 {
        let rate = self.sigma().acosh();
        let log_cosh = |x: f64| x + (-2.0 * x).exp().ln_1p();
        (log_cosh((self.made - self.last) as f64 * rate) - log_cosh(self.made as f64 * rate)).exp()
    }

    /// The eigenvalue whose modes shrink by `gain` in the last iterations; below the interval.
    fn lowest_mode(&self, gain: f64) -> f64 {
        let (a, b) = self.interval;
        let t = (gain / self.promise()).max(1.0);
        let growth = if self.made == self.last { t.acosh() } else { t.ln() };
        let mu = (growth / self.last.max(1) as f64).cosh();
        0.5 * (b + a) - 0.5 * (b - a) * mu.min(self.sigma())
    }
}
