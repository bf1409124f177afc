//! Chebyshev iteration in single precision, corrected in double precision: the same final accuracy for about half
//! the bytes of an iteration.
//!
//! The residual e = P − A V is taken in double precision, `A d = e` is solved roughly in single precision by a
//! [`Wavefront`], and V + d is taken in double precision again (iterative refinement: Wilkinson 1963; Langou et al.
//! 2006). A correction gains up to five digits; two or three are usual.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3A};

use super::chebyshev::{Recurrence, promised_iterations};
use super::iteration::{self, Outcome, Recorded, Report, Step, Stop};
use super::system::Rows;
use super::wavefront::{Scratch, Wavefront};
use crate::assemble::Operator;
use crate::pages::filled;
use crate::parallel;
use crate::prefetch::{POINTS_AHEAD, prefetch};

/// A correction in single precision is not asked for more than this: half a digit above its rounding.
const GAIN: f64 = 2e-6;
/// Iterations of the last correction beyond those promised, since the promise is in another norm than the test.
const SPARE: usize = 1;
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
/// the most. (Eigenvalues below the
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
    let mut interval = (operator.usual_lambda_min().max(least), 1.0);
    let largest = points.iter().map(|p| p.length_squared()).fold(0.0, f64::max);
    let floor = FLOOR * f64::EPSILON * largest.sqrt();
    let size = size.max(iteration::largest(points));
    let goal = stop.tolerance.max(iteration::floor(size));
    let mut history: Vec<Recorded> = Vec::new();
    let mut iterations = 0;
    // The last correction: its number of iterations.
    let mut count = 0;
    let outcome = loop {
        let recurrence = Recurrence::new(interval);
        let first = recurrence.coefficients().1 as f32;
        let current: &[DVec3] = if control.is_empty() { points } else { &*control };
        let errors = rows
            .product(operator, current, residual, correction, |i, ax, r, d, tally| {
                prefetch(points, i + POINTS_AHEAD);
                prefetch(std::slice::from_ref(r), POINTS_AHEAD);
                prefetch(std::slice::from_ref(d), POINTS_AHEAD);
                let e = points[i] - ax;
                tally.error(e);
                *r = (e / unit).as_vec3a();
                *d = first * *r;
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
            let doubtful = interval.0 > least && gain > DOUBT * reduction(interval, count) && errors.max > floor;
            if doubtful {
                let a = (STRETCH * lowest_mode(interval, count, gain)).max(STEP * interval.0).max(least);
                // The correction prepared above begins with the old interval's step.
                let rescale = {
                    interval = (a.min(interval.0), 1.0);
                    Recurrence::new(interval).coefficients().1 as f32 / first
                };
                parallel::change(correction, |_, d| *d *= rescale);
            } else if gain > PROGRESS {
                break Outcome::Stagnated;
            }
        }
        count = iterations_for(interval, goal / errors.max).min(stop.max_iterations - iterations);
        wavefront.iterate(Recurrence::new(interval), count, residual, correction, scratch);
        iterations += count;
        if control.is_empty() {
            *control = parallel::collect(points.len(), |i| points[i] + unit * correction[i].as_dvec3());
        } else {
            parallel::change(control, |i, v| *v += unit * correction[i].as_dvec3());
        }
    };
    if control.is_empty() {
        *control = points.to_vec();
    }
    Report { outcome, iterations, history, detail: None }
}

/// Iterations of the coming correction, of those that reduce the error to its `factor`: all, or an even share of
/// them if single precision does not reach so far.
fn iterations_for(interval: (f64, f64), factor: f64) -> usize {
    let parts = (factor.ln() / GAIN.ln()).ceil().max(1.0);
    let spare = if parts > 1.0 { 0 } else { SPARE };
    (promised_iterations(interval, factor.powf(1.0 / parts)) as usize).max(1) + spare
}

/// What `count` iterations promise to reduce the error to: 1/T_count(σ).
fn reduction((a, b): (f64, f64), count: usize) -> f64 {
    let sigma = (b + a) / (b - a);
    1.0 / (count as f64 * sigma.acosh()).cosh()
}

/// The eigenvalue whose modes shrink by `gain` in `count` iterations for the interval; below it.
fn lowest_mode((a, b): (f64, f64), count: usize, gain: f64) -> f64 {
    let sigma = (b + a) / (b - a);
    let t = (gain / reduction((a, b), count)).max(1.0);
    let mu = (t.acosh() / count.max(1) as f64).cosh();
    0.5 * (b + a) - 0.5 * (b - a) * mu.min(sigma)
}
