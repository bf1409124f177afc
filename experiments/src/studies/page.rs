//! The interactive page of a comparison of methods on one system: their errors, iterate by iterate and vertex by vertex, an ω
//! sweep, the spectra, and the surfaces.

use std::ops::ControlFlow;

use glam::DVec3;
use nalgebra::Complex;

use super::comparison::{is_over_iterations, json, label};
use super::error_maps::{method_over_iterations, watch};
use super::style;
use super::sweep::{default_grid, show};
use crate::cli::{Problem, Progress};
use crate::report::page::{Curve, Eigenvalues, Frames, Packed, Page, Place, Run, Solid, Sweep, Thinned, View};
use crate::report::readable;
use limitlab::Result;
use limitlab::analysis::comparison::MethodRow;
use limitlab::analysis::dense;
use limitlab::analysis::spectrum::{Extremes, Spectra};
use limitlab::analysis::sweep::{OmegaSweep, SweepEvent, rounding_floor, sweep};
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::interpolate::surface::{SurfaceMesh, SurfaceOptions, surface};
use limitlab::mesh::{Surface, bounding_box};
use limitlab::schemes::Scheme;
use limitlab::solvers::method::SOR_OMEGA;
use limitlab::solvers::{Method, Outcome, System};

/// Vertices that are shown at most: a larger mesh is thinned out.
const MOST_SHOWN: usize = 20_000;
/// Corners of the limit surface at most, and refinements.
const MOST_REFINED: usize = 120_000;
const MOST_LEVELS: usize = 3;
/// Bytes for the errors at the vertices, of all methods, and iterates of one method at most.
const FRAME_BYTES: usize = 1_500_000;
const MOST_FRAMES: usize = 60;
/// Entries of a history at most.
const MOST_ENTRIES: usize = 500;
/// Unknowns up to which the sweep has all ω of the usual grids.
const MOST_FINE: usize = 5000;
/// Decades of error that are coloured at most.
const DECADES: f64 = 12.0;
/// A λ_min below this part of λ_max is zero as far as rounding tells.
const VANISHING: f64 = 1e-13;
/// The methods that are swept over ω.
const SWEPT: [Method<'static>; 3] =
    [Method::Jacobi { omega: None }, Method::Pia, Method::Sor { omega: SOR_OMEGA, order: None }];

/// What a page has beside the rows of the comparison.
pub struct Measured {
    /// One a row.
    frames: Vec<Option<Frames>>,
    sweep: OmegaSweep,
    spectra: Vec<Eigenvalues>,
    shown: Option<Shown>,
}

/// The part of a mesh that is shown, and the errors of the first and of the last colour, in mesh units.
struct Shown {
    mesh: Thinned,
    range: [f64; 2],
}

/// The grids of the sweep on a system of `unknowns`: a large one, on which a run and the spectral radius of a sweep take long,
/// has every other ω of the usual ones.
fn grids(unknowns: usize) -> [(Method<'static>, Vec<f64>); 3] {
    let step = if unknowns > MOST_FINE { 2 } else { 1 };
    // From the second on: the grids begin at their step.
    SWEPT.map(|method| (method, default_grid(method).into_iter().skip(step - 1).step_by(step).collect()))
}

/// The runs of [`measure`].
pub fn steps(system: &impl System, rows: &[MethodRow]) -> usize {
    rows.len() + grids(system.len()).iter().map(|(_, grid)| grid.len()).sum::<usize>()
}

/// Sweeps over ω, and runs the methods of `rows` again, now with a watch that writes down the errors at the vertices: the
/// times of the comparison are without it. `eigenvalues` are those of A and of D⁻¹A, where they were computed. The bar is one
/// of [`steps`].
///
/// # Errors
/// If an eigenvalue computation does not converge.
pub fn measure(
    problem: &Problem,
    system: &impl System,
    spectra: &(impl Spectra + Sync),
    eigenvalues: Option<[Vec<Complex<f64>>; 2]>,
    rows: &[MethodRow],
    progress: &Progress,
) -> Result<Measured> {
    let shown = problem
        .mesh()
        .map(|(surface, ..)| Shown { mesh: Thinned::new(surface.mesh(), MOST_SHOWN), range: range(problem, rows) });
    let lines = rows.iter().filter(|row| is_over_iterations(row)).count();
    let record = |row: &MethodRow| {
        progress.message(label(row));
        let frames = shown.as_ref().and_then(|shown| {
            let most = FRAME_BYTES / (lines.max(1) * shown.mesh.first.len());
            frames(problem, system, row, shown, most.clamp(2, MOST_FRAMES))
        });
        progress.step();
        frames
    };
    let frames = rows.iter().map(record).collect();
    let grids = grids(system.len());
    let floor = rounding_floor(problem.diagonal());
    let order = Some(&problem.order[..]);
    let show = |event: SweepEvent| show(progress, &event);
    let sweep = sweep((system, spectra), problem.data(), &grids, order, &problem.stop, floor, &show)?;
    let b = system.bounds();
    let [a, jacobi] = eigenvalues.map_or([None, None], |[a, jacobi]| [Some(a), Some(jacobi)]);
    let spectra = vec![
        spectrum("A", spectra.ends(SymmetricForm::A), [b.lambda_min, b.lambda_max], a),
        spectrum("D⁻¹A", spectra.ends(SymmetricForm::Jacobi), [b.jacobi_lambda_min, b.jacobi_lambda_max], jacobi),
    ];
    Ok(Measured { frames, sweep, spectra, shown })
}

fn spectrum(matrix: &'static str, ends: Extremes, bounds: [f64; 2], all: Option<Vec<Complex<f64>>>) -> Eigenvalues {
    let packed =
        |part: fn(&Complex<f64>) -> f64, all: &[Complex<f64>]| Packed::new(all.iter().map(part).map(f64::to_le_bytes));
    let ends = [ends.min, ends.max];
    Eigenvalues {
        matrix,
        ends,
        bounds,
        most: dense::LARGEST,
        all: all.map(|all| [packed(|z| z.re, &all), packed(|z| z.im, &all)]),
    }
}

/// From the tolerance, or a little part, to the largest error of a start.
fn range(problem: &Problem, rows: &[MethodRow]) -> [f64; 2] {
    let starts = rows.iter().filter_map(|row| row.solution.report.history.first());
    let greatest = problem.scale * starts.map(|start| start.errors.max).fold(0.0, f64::max);
    let greatest = if greatest > 0.0 && greatest.is_finite() { greatest } else { 1.0 };
    let tolerance = problem.scale * problem.stop.tolerance;
    let least = greatest * 10f64.powf(-DECADES);
    [if tolerance < 0.1 * greatest { tolerance.max(least) } else { least }, greatest]
}

/// `count` whole numbers from 0 to `last`, evenly, with both ends, or all of them.
fn spread(last: usize, count: usize) -> Vec<usize> {
    let parts = last.min(count - 1);
    (0..=parts).map(|k| (k * last + parts / 2).checked_div(parts).unwrap_or(0)).collect()
}

/// Runs the method of a row once more, and keeps the errors at the vertices of some iterates.
fn frames(problem: &Problem, system: &impl System, row: &MethodRow, shown: &Shown, most: usize) -> Option<Frames> {
    let method = method_over_iterations(row)?;
    let at = spread(row.solution.report.iterations, most);
    let [least, greatest] = shown.range.map(f64::ln);
    let byte = |error: f64| {
        // What is no number has diverged.
        let part = (error.min(f64::MAX).ln() - least) / (greatest - least);
        (255.0 * part).round() as u8 // saturates
    };
    let mut errors = Vec::with_capacity(at.len() * shown.mesh.first.len());
    watch(problem, system, method, &at, &mut |_, at_vertices| {
        // Of vertices in one place the greatest.
        let mut frame = vec![0u8; shown.mesh.first.len()];
        for (&error, &place) in at_vertices.iter().zip(&shown.mesh.place) {
            let slot = &mut frame[place as usize];
            *slot = byte(problem.scale * error).max(*slot);
        }
        errors.extend(frame);
    });
    // A method that could not be set up has no iterate.
    (!errors.is_empty()).then(|| Frames {
        at: Packed::new(at.iter().map(|&k| (k as u32).to_le_bytes())),
        errors: Packed::new(errors.into_iter().map(|byte| [byte])),
    })
}

/// The page. `rows` are those that were [measured](measure), their errors now in the units of the files; `refused` says which methods were not run.
///
/// # Errors
/// If the control mesh cannot be computed at all.
pub fn page(problem: &Problem, measured: Measured, rows: &[MethodRow], refused: Option<String>) -> Result<Page> {
    let subject = &problem.subject;
    let tolerance = problem.scale * problem.stop.tolerance;
    let [a, _] = &measured.spectra[..] else { unreachable!("A and D⁻¹A") };
    let [least, greatest] = a.ends;
    let condition = match least > VANISHING * greatest {
        true => format!("condition {:.2}", greatest / least),
        false => "singular to rounding".into(),
    };
    let about = vec![
        subject.size.clone(),
        format!(
            "λ(A) from {} to {}, {condition}; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {tolerance:.1e} ({}).",
            readable(least, 4),
            readable(greatest, 4),
            subject.unit
        ),
    ];
    let curves = rows.iter().zip(measured.frames).filter(|(row, _)| is_over_iterations(row));
    Ok(Page {
        title: subject.title.clone(),
        about,
        unit: subject.unit,
        tolerance,
        curves: curves.map(|(row, frames)| curve(row, frames)).collect(),
        rows: json(rows),
        refused,
        sweep: SWEPT.map(|method| swept(&measured.sweep, method)).into(),
        spectra: measured.spectra,
        view: match (problem.mesh(), measured.shown) {
            (Some((surface, scheme, _)), Some(shown)) => Some(view(problem, surface, scheme, shown)?),
            _ => None,
        },
    })
}

fn curve(row: &MethodRow, frames: Option<Frames>) -> Curve {
    let report = &row.solution.report;
    let at = spread(report.iterations, MOST_ENTRIES);
    Curve {
        name: label(row),
        look: style::of_row(row).into(),
        outcome: report.outcome.name(),
        iterations: report.iterations,
        max: Packed::new(at.iter().map(|&k| report.history[k].errors.max.to_le_bytes())),
        at: Packed::new(at.iter().map(|&k| (k as u32).to_le_bytes())),
        frames,
    }
}

fn swept(sweep: &OmegaSweep, method: Method<'static>) -> Sweep {
    let thresholds = sweep.thresholds.iter().find(|t| t.method == method);
    let runs = sweep.rows.iter().filter(|row| row.method == method).map(|row| Run {
        omega: row.omega,
        outcome: row.outcome.name(),
        iterations: row.iterations,
        predicted: row.predicted_rho,
        measured: row.observed_rate,
    });
    Sweep {
        method: method.name(),
        look: style::of(method, "").into(),
        optimal: thresholds.map(|t| t.optimal_omega),
        critical: thresholds.map(|t| t.critical_omega),
        runs: runs.collect(),
    }
}

/// The given mesh; its control mesh by `auto` and the limit surface of that, as far as there are.
fn view(problem: &Problem, given: &Surface, scheme: Scheme, shown: Shown) -> Result<View> {
    let (least, greatest) = bounding_box(given.positions()).unwrap_or_default();
    let place = Place {
        middle: 0.5 * (least + greatest),
        unit: if given.diagonal() > 0.0 { 0.5 * given.diagonal() } else { 1.0 },
    };
    let thinned = &shown.mesh;
    let (left, all) = (thinned.first.len(), given.len());
    let packed = |points: &[DVec3]| place.packed(thinned.first.iter().map(|&v| points[v as usize]));
    let mut about = Vec::new();
    if left < all {
        about.push(format!(
            "Thinned out: {left} of {all} vertices, each with the largest error of those that it stands for."
        ));
    }
    let found = problem.auto(&mut |_, _| ControlFlow::Continue(()))?;
    let solved = found.report.outcome == Outcome::Converged;
    // A refinement makes four times as many corners, or fewer.
    let fits = |k: &usize| left == all && given.faces().corners().len() << (2 * k) <= MOST_REFINED;
    let mut limit = None;
    match (solved, (1..=MOST_LEVELS).rev().find(fits)) {
        (false, _) => about.push(format!(
            "No control mesh was found ({}), so that only the given mesh is shown.",
            found.report.outcome
        )),
        (true, None) => about.push("The limit surface is left out: a mesh as fine as this one looks the same.".into()),
        (true, Some(levels)) => match refined(given, scheme, found.points.clone(), levels) {
            Ok(surface) => limit = Some(limit_surface(&surface, given.positions(), place)),
            Err(error) => about.push(format!("The limit surface is left out: {error}.")),
        },
    }
    Ok(View {
        about: about.join(" "),
        range: shown.range,
        given: Solid::new(packed(given.positions()), &thinned.faces, &thinned.edges(creases(given))),
        cage: solved.then(|| packed(&found.points)),
        limit,
    })
}

/// The surface of control points after some refinements, at limit points.
fn refined(given: &Surface, scheme: Scheme, control: Vec<DVec3>, levels: usize) -> Result<Surface> {
    let request = SurfaceOptions { levels, limit: true, ..SurfaceOptions::default() };
    let SurfaceMesh { surface, .. } = surface(given.with_positions(control), scheme, given.positions(), &request)?;
    Ok(surface)
}

/// A refined surface, each vertex with the nearest of the given ones, O(vertices) of both.
fn limit_surface(surface: &Surface, given: &[DVec3], place: Place) -> Solid {
    let nearest = |p: &DVec3| {
        let distances = given.iter().map(|q| q.distance_squared(*p)).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(v, _)| v as u32)
    };
    let points = place.packed(surface.positions().iter().copied());
    let shown_by = Packed::new(surface.positions().iter().map(|p| nearest(p).to_le_bytes()));
    Solid { shown_by: Some(shown_by), ..Solid::new(points, surface.faces(), &creases(surface)) }
}

/// The ends of all sharp and semi-sharp edges, boundaries among them.
fn creases(surface: &Surface) -> Vec<[u32; 2]> {
    let (faces, incidence) = (surface.faces(), surface.incidence());
    let ends = |c: u32| [c, incidence.next(faces, c)].map(|c| faces.corners()[c as usize]);
    let Some(features) = surface.features() else { return Vec::new() };
    let semi_sharp = features.semi_sharp_edges().iter().map(|&(c, _)| c);
    features.sharp_half_edges().iter().copied().chain(semi_sharp).map(ends).collect()
}

#[cfg(test)]
mod tests {
    use limitlab::analysis::comparison::{Entry, compare_entry};
    use limitlab::analysis::spectrum::spectrum;
    use limitlab::mesh::order::Order;
    use limitlab::solvers::Step;

    use super::*;
    use crate::cli::{CommonFlags, Matrix, MeshFlags, STAND_IN_NOISE, StopFlags};

    #[test]
    fn spread_numbers_have_both_ends() {
        assert_eq!(spread(0, 2), [0]);
        assert_eq!(spread(3, 60), [0, 1, 2, 3]);
        assert_eq!(spread(10, 5), [0, 3, 5, 8, 10]);
        let many = spread(10_000, MOST_ENTRIES);
        assert!(many.len() == MOST_ENTRIES && many[0] == 0 && many[MOST_ENTRIES - 1] == 10_000);
        assert!(many.windows(2).all(|w| w[0] < w[1]));
    }

    #[test]
    fn a_mesh_too_large_to_be_shown_is_thinned_out() {
        let flags = MeshFlags { noise: Some(STAND_IN_NOISE), ..MeshFlags::default() };
        let stop = StopFlags { tol: 1e-6, tol_absolute: None, max_iter: 1000 };
        let common = CommonFlags { threads: None, quiet: true };
        let problem = flags.problem("torus:160x130", &stop, Order::File, &common).unwrap();
        let Matrix::Symmetric(system) = problem.matrix() else { panic!("no darts") };
        let line = Entry { method: Method::Pia, variant: "", parameter: String::new() };
        let watch = &mut |_: &Step| ControlFlow::Continue(());
        let spectrum = spectrum(system).unwrap();
        let rows = [compare_entry(system, &spectrum, problem.data(), &line, &problem.stop, watch).unwrap()];
        let (surface, scheme, _) = problem.mesh().unwrap();
        let mesh = Thinned::new(surface.mesh(), MOST_SHOWN);
        let left = mesh.first.len();
        assert!(left < MOST_SHOWN && left > MOST_SHOWN / 3, "{left}");
        let shown = Shown { mesh, range: range(&problem, &rows) };
        let found = frames(&problem, system, &rows[0], &shown, 2).unwrap();
        assert_eq!(found.at, Packed::new([0, rows[0].solution.report.iterations as u32].map(u32::to_le_bytes)));
        // At the start and at the end the greatest error of the vertices in each place.
        let [least, greatest] = shown.range.map(f64::ln);
        let mut bytes = Vec::new();
        for points in [problem.data().1, &rows[0].solution.points] {
            let mut worst = vec![0.0f64; left];
            for (v, p) in surface.positions().iter().enumerate() {
                let place = &mut worst[shown.mesh.place[v] as usize];
                *place = place.max(problem.scale * p.distance(system.row(v, points)));
            }
            let byte = |error: f64| (255.0 * (error.ln() - least) / (greatest - least)).round() as u8;
            bytes.extend(worst.into_iter().map(|error| [byte(error)]));
        }
        assert_eq!(found.errors, Packed::new(bytes));
        let view = view(&problem, surface, scheme, shown).unwrap();
        assert!(view.about.starts_with(&format!("Thinned out: {left} of 20800 vertices")), "{}", view.about);
        assert!(view.limit.is_none() && view.about.contains("limit surface is left out"));
        assert_eq!(view.given.points.as_str().len(), view.cage.unwrap().as_str().len());
    }
}
