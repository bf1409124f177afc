//! Surfaces that `interpolate` writes: of the control points, and by schemes that need no system.

use std::time::Instant;

use crate::cli::{Input, advice};
use limitlab::Result;
use limitlab::error::{Error, counted, short};
use limitlab::interpolate::fair_refinement::{self, FairRefinement, FirstFairness, fair_handles};
use limitlab::interpolate::halstead::{self, Energies, Fairness, Solver, fit_watched};
use limitlab::interpolate::lin_luo;
use limitlab::interpolate::normals::Rotation;
use limitlab::interpolate::surface::{SurfaceMesh, SurfaceOptions, surface};
use limitlab::interpolate::zheng_cai::{self, Constraints, FirstRefinement, PhaseOne};
use limitlab::mesh::frame::Frame;
use limitlab::schemes::doo_sabin::CornerRule;
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::{Errors, Outcome, Recorded, Report, Step, Stop};

use super::arguments::Arguments;
use super::control::{Control, Seconds, Shown};
use super::vertex_options::VertexOptions;

pub struct Finished {
    pub method: &'static str,
    pub made: SurfaceMesh,
    pub iterations: usize,
    pub status: &'static str,
    pub errors: Errors,
    /// Of the solution: empty where nothing iterates. By halstead and fair-refinement steps in the place of errors.
    pub history: Vec<Recorded>,
    pub tolerance: f64,
    pub fairness: Option<Energies>,
    /// Those of the fairest surface.
    pub shaped: Option<Shaped>,
    pub seconds: Seconds,
}

/// Shape handles of the fairest surface.
pub struct Shaped {
    pub least: f64,
    pub largest: f64,
    pub iterations: usize,
    energies: Energies,
    seconds: f64,
}

/// What is asked of the surface of a control mesh.
pub fn request<'a>(arguments: &Arguments, per_vertex: &'a VertexOptions) -> SurfaceOptions<'a> {
    let flags = &arguments.shape;
    SurfaceOptions {
        levels: flags.subdivide.into(),
        limit: flags.limit,
        normals: flags.write_normals,
        constraints: per_vertex.constraints(),
        rotation: Rotation {
            threshold: flags.normal_threshold.to_radians(),
            tolerance: flags.normal_tolerance.to_radians(),
            levels: flags.normal_levels.into(),
        },
    }
}

pub fn refine(input: &Input, request: &SurfaceOptions, control: Control, shaped: Option<Shaped>) -> Result<Finished> {
    let start = Instant::now();
    let points = input.surface.positions();
    let control_surface = input.surface.with_positions(control.points);
    let made = surface(control_surface, input.scheme, points, request)?;
    let mut seconds = control.seconds;
    seconds.solve += shaped.as_ref().map_or(0.0, |shaped| shaped.seconds);
    seconds.subdivide = start.elapsed().as_secs_f64();
    Ok(Finished {
        method: control.method,
        made,
        iterations: control.iterations,
        status: control.status,
        errors: control.errors,
        history: control.history,
        tolerance: control.tolerance,
        fairness: shaped.as_ref().map(|shaped| shaped.energies),
        shaped,
        seconds,
    })
}

/// Sets the handles of interpolated vertices to those of the fairest surface.
pub fn shaped(
    arguments: &Arguments,
    input: &Input,
    fairness: &FirstFairness,
    per_vertex: &mut VertexOptions,
    control: &Control,
) -> Result<Shaped> {
    let start = Instant::now();
    let stop = input.stop(&arguments.stop)?;
    let rule = input.scheme.first_rule().unwrap_or(CornerRule::DooSabin);
    let wishes = Constraints { handles: None, ..per_vertex.constraints() };
    let points = input.surface.positions();
    let control = input.surface.with_positions(control.points.clone());
    let first = FirstRefinement::new(&control, rule, points, &wishes)?.surface;
    let mut shown = Shown::of("step", arguments, input, stop.tolerance);
    let watch = &mut |step: &Step| shown.see("fair handles", step);
    let found = fair_handles(fairness, first.positions(), points, &wishes, arguments.shape.weights(), &stop, watch)?;
    drop(shown);
    require_fair("fair handles", input, &found.refined.report, &stop)?;
    if let Some((v, &s)) = found.handles.iter().enumerate().find(|(_, s)| **s <= 0.0) {
        return Err(Error::Computation(format!(
            "vertex {v}: the shape handle of the fairest surface is {}, which turns its face over: use --method \
             fair-refinement, or name handles",
            short(s)
        )));
    }
    let bounds = |(least, largest): (f64, f64), &s: &f64| (least.min(s), largest.max(s));
    let (least, largest) = found.handles.iter().fold((f64::INFINITY, f64::NEG_INFINITY), bounds);
    per_vertex.handles = Some(found.handles);
    let FairRefinement { energies, report, .. } = found.refined;
    Ok(Shaped { least, largest, iterations: report.iterations, energies, seconds: start.elapsed().as_secs_f64() })
}

/// A least energy that was not found gives no surface.
fn require_fair(method: &str, input: &Input, report: &Report, stop: &Stop) -> Result<()> {
    if report.outcome == Outcome::Converged {
        return Ok(());
    }
    let unit = input.frame.scale();
    Err(Error::Computation(format!(
        "{method} ended as {} after {}, the largest step left {:.3e} against {:.3e}; {}",
        report.outcome,
        counted(report.iterations, "iteration"),
        unit * report.last().max,
        unit * stop.tolerance,
        advice::of_unfair(report.outcome)
    )))
}

/// The fairest control mesh, and its surface.
pub fn fairest(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Finished> {
    let start = Instant::now();
    let fairness = Fairness::new(&input.surface)?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let flags = &arguments.shape;
    let weights = flags.weights();
    let points = input.surface.positions();
    let stop = input.stop(&arguments.stop)?;
    let mut shown = Shown::of("step", arguments, input, stop.tolerance);
    let watch = &mut |step: &Step| shown.see("halstead", step);
    let found = fit_watched(&fairness, points, &per_vertex.constraints(), weights, Solver::Iterations, &stop, watch)?;
    drop(shown);
    let report = found.report;
    require_fair("halstead", input, &report, &stop)?;
    let solve = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let request = SurfaceOptions {
        levels: usize::from(flags.subdivide).saturating_sub(halstead::LEVELS),
        limit: flags.limit,
        normals: flags.write_normals,
        ..SurfaceOptions::default()
    };
    let made = surface(found.surface, input.scheme, &[], &request)?;
    let seconds = Seconds { assemble, solve, subdivide: start.elapsed().as_secs_f64(), ..Seconds::default() };
    Ok(Finished { fairness: Some(found.energies), seconds, ..iterated("halstead", made, report, found.errors, &stop) })
}

/// The fairest first refined mesh, and its surface.
pub fn fair_refinement(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Finished> {
    let start = Instant::now();
    let (given, wishes) = (&input.surface, per_vertex.constraints());
    let fairness = FirstFairness::new(given)?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let stop = input.stop(&arguments.stop)?;
    let first = zheng_cai::interpolate(given, &wishes, &PhaseOne::default())?.first.surface;
    let mut shown = Shown::of("step", arguments, input, stop.tolerance);
    let watch = &mut |step: &Step| shown.see("fair-refinement", step);
    let (begin, points, flags) = (first.positions(), given.positions(), &arguments.shape);
    let found = fair_refinement::fairest(&fairness, begin, points, &wishes, flags.weights(), &stop, watch)?;
    drop(shown);
    let report = found.report;
    require_fair("fair-refinement", input, &report, &stop)?;
    let solve = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let request = SurfaceOptions {
        levels: usize::from(flags.subdivide).saturating_sub(1),
        limit: flags.limit,
        normals: flags.write_normals,
        ..SurfaceOptions::default()
    };
    // From the first refinement on the steps are Doo-Sabin's, as Nasri's are from the start.
    let made = surface(first.with_positions(found.points), Scheme::Nasri, &[], &request)?;
    let seconds = Seconds { assemble, solve, subdivide: start.elapsed().as_secs_f64(), ..Seconds::default() };
    let finished = iterated("fair-refinement", made, report, found.errors, &stop);
    Ok(Finished { fairness: Some(found.energies), seconds, ..finished })
}

/// What iterations have led to, without its seconds.
fn iterated(method: &'static str, made: SurfaceMesh, report: Report, errors: Errors, stop: &Stop) -> Finished {
    Finished {
        method,
        made,
        iterations: report.iterations,
        status: report.outcome.name(),
        errors,
        history: report.history,
        tolerance: stop.tolerance,
        fairness: None,
        shaped: None,
        seconds: Seconds::default(),
    }
}

/// The unified √3 surface. Its errors are the distances of the vertices with α = 1, which stay: 0.
pub fn unified(arguments: &Arguments, input: &Input, alpha: &[f64]) -> Result<Finished> {
    let flags = &arguments.shape;
    if flags.subdivide == 0 && !flags.limit {
        return Err(Error::Computation(
            "the unified √3 scheme leaves the control mesh as it is: ask for the surface with --subdivide or --limit"
                .into(),
        ));
    }
    let start = Instant::now();
    let (mut surface, alpha) = lin_luo::surface::refine_n(&input.surface, alpha, flags.subdivide.into())?;
    let mut normals = None;
    if flags.limit || flags.write_normals {
        let found = lin_luo::limit::limits(&surface, &alpha)?;
        normals = flags.write_normals.then_some(found.normals);
        if flags.limit {
            surface.positions_mut().copy_from_slice(&found.positions);
        }
    }
    let made = SurfaceMesh { normals, ..SurfaceMesh::plain(surface) };
    Ok(unsolved("lin-luo", input, made, start))
}

/// The surface of a scheme that keeps its vertices.
pub fn keeping(arguments: &Arguments, input: &Input, scheme: Refinement) -> Result<Finished> {
    let flags = &arguments.shape;
    let start = Instant::now();
    let surface = scheme.refined_n(&input.surface, flags.subdivide.into())?;
    let normals = if flags.write_normals { Some(scheme.limit_normals(&surface)?) } else { None };
    let made = SurfaceMesh { normals, ..SurfaceMesh::plain(surface) };
    Ok(unsolved(scheme.name(), input, made, start))
}

/// A surface without a system: vertices that are interpolated stay, so their errors are 0.
fn unsolved(method: &'static str, input: &Input, made: SurfaceMesh, start: Instant) -> Finished {
    Finished {
        method,
        made,
        iterations: 0,
        status: "converged",
        errors: Errors { max: 0.0, mean: 0.0 },
        history: Vec::new(),
        tolerance: 0.0,
        fairness: None,
        shaped: None,
        seconds: Seconds {
            assemble: input.check_seconds,
            subdivide: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    }
}

/// Takes what was computed in the frame of the input to mesh units.
pub fn leave(frame: &Frame, finished: &mut Finished) {
    let unit = frame.scale();
    frame.leave(finished.made.surface.positions_mut());
    finished.errors = finished.errors * unit;
    finished.history.iter_mut().for_each(|at| at.errors = at.errors * unit);
    finished.tolerance *= unit;
    if let Some(energies) = &mut finished.fairness {
        // Integrals of squares.
        energies.thin_plate *= unit * unit;
        energies.membrane *= unit * unit;
    }
}

/// Nothing that is no number reaches a file.
pub fn require_finite(input: &Input, made: &SurfaceMesh) -> Result<()> {
    let normals = made.normals.iter().flatten();
    match made.surface.positions().iter().chain(normals).position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(v) => Err(Error::mesh(
            &input.name,
            format!(
                "vertex {} of the result is not finite: the points are too large for doubles; scale the mesh down",
                v % made.surface.len()
            ),
        )),
    }
}
