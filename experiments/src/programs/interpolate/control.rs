//! Control points of the given points, by the method asked for.

use std::fs;
use std::io::ErrorKind;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use crate::cli::{Input, MANIFEST, Progress, advice};
use glam::DVec3;
use limitlab::Result;
use limitlab::analysis::failed::Failed;
use limitlab::assemble::{Operator, petsc};
use limitlab::error::{Error, counted};
use limitlab::interpolate::zheng_cai::{self, PhaseOne, Sweep};
use limitlab::interpolate::{Options, Tolerance, interpolate_watched, limit_points};
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::order::Order;
use limitlab::solvers::gauss_seidel::by_colours_watched;
use limitlab::solvers::{Errors, Method, Outcome, Recorded, Report, Step, Stop};
use serde_json::Value;

use super::arguments::{Arguments, Choice};
use super::vertex_options::VertexOptions;

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
    pub history: Vec<Recorded>,
    pub tolerance: f64,
    pub seconds: Seconds,
}

/// What is shown of a solution as it goes: a bar, or lines.
pub struct Shown<'a> {
    arguments: &'a Arguments,
    input: &'a Input,
    progress: Progress,
    tolerance: f64,
    /// What the errors of iterates are.
    quantity: &'static str,
    /// The first error seen.
    start: Option<f64>,
}

impl<'a> Shown<'a> {
    fn new(arguments: &'a Arguments, input: &'a Input, tolerance: f64) -> Self {
        Shown::of("error", arguments, input, tolerance)
    }

    pub fn of(quantity: &'static str, arguments: &'a Arguments, input: &'a Input, tolerance: f64) -> Self {
        let progress = Progress::toward("solving", arguments.monitor.no_bar(&arguments.common));
        Shown { arguments, input, progress, tolerance, quantity, start: None }
    }

    pub fn see(&mut self, method: &str, step: &Step) -> ControlFlow<()> {
        // In digits: from the first error seen to the tolerance.
        let error = step.errors.max;
        let digits = |e: f64| (e / self.tolerance).ln();
        self.progress.part(1.0 - digits(error) / digits(*self.start.get_or_insert(error)));
        let (iteration, errors) = (step.iteration, step.errors * self.input.frame.scale());
        let quantity = self.quantity;
        self.progress.message(format!("{method}: iteration {iteration}: max {quantity} {:.2e}", errors.max));
        self.arguments.monitor.see_of(quantity, format_args!("{}: {method}", self.input.name), iteration, errors);
        ControlFlow::Continue(())
    }
}

/// The control points, and the errors of what will be left of them in the digits of the file. Where some vertices stay, the
/// solver's own errors are those of an equation for the others, whose right-hand side is rounded.
pub fn control_mesh(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Control> {
    let mut control = solved(arguments, input, per_vertex)?;
    let frame = &input.frame;
    let rounded = |p: &DVec3| frame.there(frame.back(*p));
    let is_rounded = !frame.is_identity() && control.points.iter().any(|p| rounded(p) != *p);
    if is_rounded || per_vertex.interpolated.is_some() {
        let written: Vec<DVec3> = control.points.iter().map(rounded).collect();
        control.errors = limit_errors(input, per_vertex.interpolated.as_deref(), &written)?;
    }
    Ok(control)
}

fn solved(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Control> {
    if let Some(path) = &arguments.solution {
        return given(arguments, input, path);
    }
    if arguments.method == Choice::TwoPhase {
        return two_phase(arguments, input, per_vertex);
    }
    let stop = input.stop(&arguments.stop)?;
    if let Some(remark) = input.remark_on_rounding(input.frame.scale() * stop.tolerance) {
        arguments.common.remark(format_args!("{}: {remark}", input.name));
    }
    if let (Choice::Solver(method @ (Method::GaussSeidel { .. } | Method::Sor { .. })), Order::Multicolour, None) =
        (arguments.method, arguments.order, &per_vertex.interpolated)
        && input.surface.features().is_none()
    {
        return by_colour(arguments, input, per_vertex, method, &stop);
    }
    let order;
    let method = match arguments.method {
        Choice::Solver(method) => {
            order = arguments.order.order(input.surface.mesh(), input.surface.incidence());
            Some(method.in_order(Some(&order)))
        }
        Choice::Auto | Choice::TwoPhase | Choice::Halstead | Choice::FairRefinement | Choice::Keeping(_) => None,
    };
    let Stop { tolerance, max_iterations } = stop;
    let interpolated = per_vertex.interpolated.as_deref();
    let options = Options { method, tolerance: Tolerance::Absolute(tolerance), max_iterations, interpolated };
    let mut shown = Shown::new(arguments, input, tolerance);
    let watch = &mut |method: &str, step: &Step| shown.see(method, step);
    let found = interpolate_watched(&input.surface, input.scheme, &options, watch).map_err(|e| input.named(e))?;
    drop(shown);
    check(arguments, input, per_vertex, found.method, &found.report, &stop)?;
    Ok(Control {
        method: found.method,
        iterations: found.report.iterations,
        status: found.report.outcome.name(),
        errors: found.report.last(),
        history: found.report.history,
        tolerance,
        seconds: Seconds {
            assemble: input.check_seconds + found.setup_seconds,
            solve: found.solve_seconds,
            ..Seconds::default()
        },
        points: found.points,
    })
}

/// The solution in a file, held against the limit points of all vertices.
fn given(arguments: &Arguments, input: &Input, path: &Path) -> Result<Control> {
    let stop = input.stop(&arguments.stop)?;
    let start = Instant::now();
    check_manifest(&path.with_file_name(MANIFEST), input)?;
    let points = petsc::read_control(path, &input.surface, input.scheme).map_err(|e| match e {
        Error::Io { .. } | Error::Parse { .. } | Error::Memory { .. } => e,
        other => input.named(other),
    })?;
    let errors = limit_errors(input, None, &points)?;
    let unit = input.frame.scale();
    // What is not finite is no solution either, and a maximum does not see it.
    if errors.max > stop.tolerance || !errors.mean.is_finite() {
        let what = format!(
            "the limit points of this control mesh miss the vertices of {} by {:.3e} at the most, {:.3e} on the average, against \
             {:.3e}: solve to a smaller tolerance, or take a larger one (--tol, --tol-absolute)",
            input.name,
            unit * errors.max,
            unit * errors.mean,
            unit * stop.tolerance
        );
        return Err(Error::parse(path, None, what));
    }
    Ok(Control {
        method: "petsc",
        points,
        iterations: 0,
        status: Outcome::Converged.name(),
        errors,
        history: Vec::new(),
        tolerance: stop.tolerance,
        seconds: Seconds { assemble: input.check_seconds, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// Refuses a system of another mesh, or under another scheme.
fn check_manifest(path: &Path, input: &Input) -> Result<()> {
    let text = fs::read(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => {
            let what = "there is no such file: a solution is read in the folder of the system that was solved";
            Error::parse(path, None, what)
        }
        _ => Error::io(path, "read", e),
    })?;
    let manifest: Value = serde_json::from_slice(&text)
        .map_err(|e| Error::parse(path, Some(e.line()), format!("no JSON: {e}; assemble the system anew")))?;
    let here = [("hash", input.source().hash()), ("scheme", input.scheme.name().to_owned())];
    for (field, value) in here {
        if manifest[field] != value.as_str() {
            let what = format!(
                "the {field} is {} in this manifest, and {value} of the mesh given: name the same mesh and flags as when the system \
                 was assembled",
                manifest[field]
            );
            return Err(Error::parse(path, None, what));
        }
    }
    Ok(())
}

/// All vertices, by sweeps that relax those of one colour at once, without a stored matrix.
fn by_colour(
    arguments: &Arguments,
    input: &Input,
    per_vertex: &VertexOptions,
    method: Method,
    stop: &Stop,
) -> Result<Control> {
    let start = Instant::now();
    let mut shown = Shown::new(arguments, input, stop.tolerance);
    let surface = &input.surface;
    let numbering = in_colours(surface.faces(), surface.incidence());
    let operator = Operator::in_order(surface, input.scheme, Some(&numbering)).map_err(|e| input.named(e))?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let omega = if let Method::Sor { omega, .. } = method { omega } else { 1.0 };
    let points = numbering.there(surface.positions());
    let watch = &mut |step: &Step| shown.see(method.name(), step);
    let (control, report) = by_colours_watched(&operator, &points, omega, stop, watch);
    drop(shown);
    check(arguments, input, per_vertex, method.name(), &report, stop)?;
    Ok(Control {
        method: method.name(),
        points: numbering.back(&control),
        iterations: report.iterations,
        status: report.outcome.name(),
        errors: report.last(),
        history: report.history,
        tolerance: stop.tolerance,
        seconds: Seconds { assemble, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// Zheng & Cai's phase one by its own rule.
fn two_phase(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Control> {
    let start = Instant::now();
    let order = arguments.order.order(input.surface.mesh(), input.surface.incidence());
    let eps = arguments.shape.eps.unwrap_or(0.003);
    let phase =
        PhaseOne { sweep: Sweep::GaussSeidel(Some(&order)), max_iterations: arguments.shape.ite_max.unwrap_or(5), eps };
    let surface = &input.surface;
    let marks = per_vertex.interpolated.as_deref();
    let mut history = Vec::new();
    let watch = &mut |iteration, points: &[DVec3]| {
        // The sweeps do without errors of limit points, which are for who asks. If this fails, so does the end, which says it.
        if (arguments.json || arguments.monitor.monitor)
            && let Ok(errors) = limit_errors(input, marks, points)
        {
            history.push(Recorded { iteration, errors });
            arguments.monitor.see(format_args!("{}: two-phase", input.name), iteration, errors * input.frame.scale());
        }
    };
    let found = zheng_cai::auxiliary_watched(surface, marks, &phase, watch)?;
    Ok(Control {
        method: "two-phase",
        history,
        errors: limit_errors(input, marks, found.surface.positions())?,
        points: found.surface.into_mesh().positions,
        iterations: found.updates.len(),
        status: if found.passed { "converged" } else { "max-iterations" },
        tolerance: eps * surface.diagonal(),
        seconds: Seconds { assemble: input.check_seconds, solve: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
}

/// How far the limit points of control points are from those interpolated.
fn limit_errors(input: &Input, marks: Option<&[bool]>, control: &[DVec3]) -> Result<Errors> {
    let surface = input.surface.with_positions(control.to_vec());
    let limits = limit_points(&surface, input.scheme).map_err(|e| input.named(e))?;
    let points = input.surface.positions();
    let marked = (0..points.len()).filter(|&v| marks.is_none_or(|m| m[v]));
    let distances: Vec<f64> = marked.map(|v| limits[v].distance(points[v])).collect();
    Ok(Errors {
        max: distances.iter().copied().fold(0.0, f64::max),
        mean: distances.iter().sum::<f64>() / distances.len() as f64,
    })
}

fn failed(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions, report: &Report, stop: &Stop) -> Failed {
    let chosen = matches!(arguments.method, Choice::Solver(_));
    let system = (&input.surface, input.scheme);
    Failed::new(system, per_vertex.interpolated.as_deref(), chosen, report, stop)
}

/// A run that did not converge gives no control mesh.
fn check(
    arguments: &Arguments,
    input: &Input,
    per_vertex: &VertexOptions,
    method: &str,
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
            "{method} under {} ended as {} after {} with max error {:.3e} against {:.3e}{detail}; {}",
            input.scheme,
            report.outcome,
            counted(report.iterations, "iteration"),
            unit * report.last().max,
            unit * stop.tolerance,
            advice::of_failed(&failed(arguments, input, per_vertex, report, stop), unit)
        ),
    ))
}
