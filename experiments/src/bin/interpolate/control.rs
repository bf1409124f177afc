//! From given points to control points, by the method that is asked for.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use limitlab::Result;
use limitlab::analysis::advice::Failed;
use limitlab::analysis::comparison::{automatic, with_spectrum};
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::Operator;
use limitlab::error::Error;
use limitlab::interpolate::automatic::control_points;
use limitlab::interpolate::subset::Restriction;
use limitlab::interpolate::zheng_cai::{self, PhaseOne, Sweep};
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::order::Order;
use limitlab::solvers::gauss_seidel::by_colours;
use limitlab::solvers::system::Rows;
use limitlab::solvers::{Errors, Method, Outcome, Report, Solution, Step, Stop, run_watched};
use limitlab_experiments::cli::{Input, Progress};

use super::wishes::Wishes;
use super::{Arguments, Choice};

#[derive(Default)]
pub struct Seconds {
    pub assemble: f64,
    pub solve: f64,
    pub subdivide: f64,
    pub write: f64,
}

/// Control points and how they came about.
pub struct Control {
    pub method: &'static str,
    pub points: Vec<DVec3>,
    pub iterations: usize,
    pub status: &'static str,
    pub errors: Errors,
    pub tolerance: f64,
    pub seconds: Seconds,
}

/// The control points, and the errors of what will be left of them in the digits of the file.
pub fn control_mesh(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Control> {
    let mut control = solved(arguments, input, wishes)?;
    let frame = &input.frame;
    let rounded = |p: &DVec3| frame.there(frame.back(*p));
    if !frame.is_identity() && control.points.iter().any(|p| rounded(p) != *p) {
        let written: Vec<DVec3> = control.points.iter().map(rounded).collect();
        control.errors = limit_errors(input, wishes.interpolated.as_deref(), &written)?;
    }
    Ok(control)
}

fn solved(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Control> {
    if arguments.method == Choice::TwoPhase {
        return two_phase(arguments, input, wishes);
    }
    let stop = input.stop(&arguments.stop)?;
    if let Some(remark) = input.remark_on_rounding(input.frame.scale() * stop.tolerance) {
        arguments.common.remark(format_args!("{}: {remark}", input.name));
    }
    if let (Choice::Solver(method @ (Method::GaussSeidel { .. } | Method::Sor { .. })), Order::Multicolour, None) =
        (arguments.method, arguments.order, &wishes.interpolated)
    {
        return by_colour(arguments, input, wishes, method, &stop);
    }
    let mut chosen = match arguments.method {
        Choice::Solver(method) => Some(method),
        _ => None,
    };
    if arguments.method == Choice::Auto && wishes.interpolated.is_none() {
        if let Some(control) = fastest(arguments, input, wishes, &stop)? {
            return Ok(control);
        }
        // A factorization tells a nearly singular matrix, on which iterations may make no progress for long, from a
        // singular one.
        chosen = Some(Method::Ldlt);
    }
    let start = Instant::now();
    let system = input.system()?;
    let part = match &wishes.interpolated {
        Some(marks) => Some(Restriction::new(&system, marks)?),
        None => None,
    };
    let solved = part.as_ref().map_or(&system, |p| &p.system);
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let mut method = chosen.unwrap_or_else(|| automatic(solved));
    let start = Instant::now();
    let order = arguments.order.order(input.surface.mesh(), input.surface.incidence());
    let order = part.as_ref().map_or_else(|| order.clone(), |p| p.order(&order));
    let progress = Progress::toward("solving", arguments.common.quiet);
    let solve = |method: Method| -> Result<Solution> {
        let method = with_spectrum(solved, method.in_order(Some(&order)), &|| spectrum(solved))?;
        let mut start = None;
        let watch = &mut |step: &Step| {
            // In digits: from the first error seen to the tolerance.
            let error = step.errors.max;
            let digits = |e: f64| (e / stop.tolerance).ln();
            progress.part(1.0 - digits(error) / digits(*start.get_or_insert(error)));
            let iteration = step.iteration;
            let error = input.frame.scale() * error;
            progress.message(format!("{method}, iteration {iteration}: max error {error:.2e}"));
            ControlFlow::Continue(())
        };
        let points = input.surface.positions();
        Ok(match &part {
            Some(part) => part.solve(&system, points, method, &stop, watch),
            None => run_watched(&system, points, method, &stop, watch),
        })
    };
    let mut solution = solve(method)?;
    let outcome = solution.report.outcome;
    if arguments.method == Choice::Auto && no_progress(outcome) {
        method = Method::Ldlt;
        solution = solve(method)?;
    }
    drop(progress);
    check(arguments, input, wishes, method, &solution.report, &stop)?;
    Ok(Control {
        method: method.name(),
        points: solution.points,
        // The start on a subset is what one PIA step makes of V = P.
        iterations: solution.report.iterations + usize::from(part.is_some()),
        status: solution.report.outcome.name(),
        errors: solution.report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds { assemble, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// Whether an iteration ended without getting nearer.
fn no_progress(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown)
}

/// All vertices, by the library's choice of order, operator and method; `None` if that makes no progress, and a
/// solution may exist all the same.
fn fastest(arguments: &Arguments, input: &Input, wishes: &Wishes, stop: &Stop) -> Result<Option<Control>> {
    let progress = Progress::open("solving", arguments.common.quiet);
    let found = control_points(&input.surface, input.scheme, stop).map_err(|e| input.named(e))?;
    drop(progress);
    if no_progress(found.report.outcome)
        && failed(arguments, input, wishes, &found.report, stop).unreachable().is_none()
    {
        return Ok(None);
    }
    check(arguments, input, wishes, found.method, &found.report, stop)?;
    Ok(Some(Control {
        method: found.method.name(),
        points: found.points,
        iterations: found.report.iterations,
        status: found.report.outcome.name(),
        errors: found.report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds {
            assemble: input.check_seconds + found.setup_seconds,
            solve: found.solve_seconds,
            ..Seconds::default()
        },
    }))
}

/// All vertices, by sweeps that relax those of one colour at once, without a stored matrix.
fn by_colour(arguments: &Arguments, input: &Input, wishes: &Wishes, method: Method, stop: &Stop) -> Result<Control> {
    let start = Instant::now();
    let progress = Progress::open("solving", arguments.common.quiet);
    let surface = &input.surface;
    let numbering = in_colours(surface.faces(), surface.incidence());
    let operator = Operator::in_order(surface, input.scheme, Some(&numbering)).map_err(|e| input.named(e))?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let omega = if let Method::Sor { omega, .. } = method { omega } else { 1.0 };
    let points = numbering.there(surface.positions());
    let (control, report) = by_colours(&operator, &points, omega, stop);
    drop(progress);
    check(arguments, input, wishes, method, &report, stop)?;
    Ok(Control {
        method: method.name(),
        points: numbering.back(&control),
        iterations: report.iterations,
        status: report.outcome.name(),
        errors: report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds { assemble, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// Zheng & Cai's phase one by its own rule.
fn two_phase(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Control> {
    let start = Instant::now();
    let order = arguments.order.order(input.surface.mesh(), input.surface.incidence());
    let phase = PhaseOne {
        sweep: Sweep::GaussSeidel(Some(&order)),
        max_iterations: arguments.shape.ite_max,
        eps: arguments.shape.eps,
    };
    let surface = &input.surface;
    let marks = wishes.interpolated.as_deref();
    let found = zheng_cai::auxiliary(surface, marks, &phase)?;
    Ok(Control {
        method: "two-phase",
        errors: limit_errors(input, marks, found.surface.positions())?,
        points: found.surface.into_mesh().positions,
        iterations: found.updates.len(),
        status: if found.passed { "converged" } else { "max-iterations" },
        tolerance: arguments.shape.eps * surface.diagonal(),
        seconds: Seconds { assemble: input.check_seconds, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// How far the limit points of control points are from those interpolated.
fn limit_errors(input: &Input, marks: Option<&[bool]>, control: &[DVec3]) -> Result<Errors> {
    let operator = Operator::new(&input.surface, input.scheme).map_err(|e| input.named(e))?;
    let points = input.surface.positions();
    let mut distances = vec![0.0; points.len()];
    Rows::new(points.len()).residual(&operator, points, control, &mut distances, |_, e, out, _| *out = e.length());
    let marked = distances.iter().enumerate().filter(|(v, _)| marks.is_none_or(|m| m[*v]));
    let distances: Vec<f64> = marked.map(|(_, d)| *d).collect();
    Ok(Errors {
        max: distances.iter().copied().fold(0.0, f64::max),
        mean: distances.iter().sum::<f64>() / distances.len() as f64,
    })
}

fn failed(arguments: &Arguments, input: &Input, wishes: &Wishes, report: &Report, stop: &Stop) -> Failed {
    let asked = match arguments.method {
        Choice::Solver(method) => Some(method),
        _ => None,
    };
    let system = (&input.surface, input.scheme);
    Failed::new(system, wishes.interpolated.as_deref(), asked, report, stop)
}

/// A run that did not converge gives no control mesh.
fn check(
    arguments: &Arguments,
    input: &Input,
    wishes: &Wishes,
    method: Method,
    report: &Report,
    stop: &Stop,
) -> Result<()> {
    if report.outcome == Outcome::Converged {
        return Ok(());
    }
    let unit = input.frame.scale();
    let detail = report.detail.as_ref().map_or_else(String::new, |d| format!(" [{d}]"));
    Err(Error::mesh(
        &input.name,
        format!(
            "{method} under {} ended as {} after {} iterations with max error {:.3e} against {:.3e}{detail}; {}",
            input.scheme,
            report.outcome,
            report.iterations,
            unit * report.last().max,
            unit * stop.tolerance,
            failed(arguments, input, wishes, report, stop).advice(unit)
        ),
    ))
}
