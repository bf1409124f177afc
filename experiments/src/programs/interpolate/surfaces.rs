//! Surfaces that `interpolate` writes: of the control points, and by schemes that need no system.

use std::time::Instant;

use crate::cli::{Input, advice};
use limitlab::Result;
use limitlab::error::{Error, counted};
use limitlab::interpolate::halstead::{self, Energies, Fairness, Solver, Weights, fit_watched};
use limitlab::interpolate::lin_luo;
use limitlab::interpolate::normals::Rotation;
use limitlab::interpolate::surface::{SurfaceMesh, SurfaceOptions, surface};
use limitlab::mesh::frame::Frame;
use limitlab::schemes::Refinement;
use limitlab::solvers::{Errors, Outcome, Recorded, Step};

use super::arguments::Arguments;
use super::control::{Control, Seconds, Shown};
use super::vertex_options::VertexOptions;

pub struct Finished {
    pub method: &'static str,
    pub made: SurfaceMesh,
    pub iterations: usize,
    pub status: &'static str,
    pub errors: Errors,
    /// Of the solution: empty where nothing iterates. By halstead steps in the place of errors.
    pub history: Vec<Recorded>,
    pub tolerance: f64,
    pub fairness: Option<Energies>,
    pub seconds: Seconds,
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

pub fn refine(input: &Input, request: &SurfaceOptions, control: Control) -> Result<Finished> {
    let start = Instant::now();
    let points = input.surface.positions();
    let control_surface = input.surface.with_positions(control.points);
    let made = surface(control_surface, input.scheme, points, request)?;
    let mut seconds = control.seconds;
    seconds.subdivide = start.elapsed().as_secs_f64();
    Ok(Finished {
        method: control.method,
        made,
        iterations: control.iterations,
        status: control.status,
        errors: control.errors,
        history: control.history,
        tolerance: control.tolerance,
        fairness: None,
        seconds,
    })
}

/// The fairest control mesh, and its surface.
pub fn fairest(arguments: &Arguments, input: &Input, per_vertex: &VertexOptions) -> Result<Finished> {
    let start = Instant::now();
    let fairness = Fairness::new(&input.surface)?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let flags = &arguments.shape;
    let weights = Weights { thin_plate: flags.thin_plate.unwrap_or(1.0), membrane: flags.membrane.unwrap_or(1.0) };
    let points = input.surface.positions();
    let stop = input.stop(&arguments.stop)?;
    let mut shown = Shown::of("step", arguments, input, stop.tolerance);
    let watch = &mut |step: &Step| shown.see("halstead", step);
    let found = fit_watched(&fairness, points, &per_vertex.constraints(), weights, Solver::Iterations, &stop, watch)?;
    drop(shown);
    let report = found.report;
    if report.outcome != Outcome::Converged {
        let unit = input.frame.scale();
        return Err(Error::Computation(format!(
            "halstead ended as {} after {}, the largest step left {:.3e} against {:.3e}; {}",
            report.outcome,
            counted(report.iterations, "iteration"),
            unit * report.last().max,
            unit * stop.tolerance,
            advice::of_unfair(report.outcome)
        )));
    }
    let solve = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let request = SurfaceOptions {
        levels: usize::from(flags.subdivide).saturating_sub(halstead::LEVELS),
        limit: flags.limit,
        normals: flags.write_normals,
        ..SurfaceOptions::default()
    };
    let made = surface(found.surface, input.scheme, &[], &request)?;
    Ok(Finished {
        method: "halstead",
        made,
        iterations: report.iterations,
        status: report.outcome.name(),
        errors: found.errors,
        history: report.history,
        tolerance: stop.tolerance,
        fairness: Some(found.energies),
        seconds: Seconds { assemble, solve, subdivide: start.elapsed().as_secs_f64(), ..Seconds::default() },
    })
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
