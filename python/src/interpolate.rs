//! The papers' pipelines on a mesh: the control mesh by any method, and the surface of it.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use limitlab::analysis::failed::Failed;
use limitlab::error::Result;
use limitlab::interpolate::halstead::{self, Energies, Fairness, Solver, Weights, fit_watched};
use limitlab::interpolate::lin_luo;
use limitlab::interpolate::normals::Rotation;
use limitlab::interpolate::surface::{SurfaceMesh, SurfaceOptions, check, surface};
use limitlab::interpolate::zheng_cai::{self, Constraints, PhaseOne, Sweep};
use limitlab::interpolate::{Options, interpolate_watched, limit_points};
use limitlab::mesh::{Surface, diagonal};
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::{Errors, Method, Outcome, Recorded, Report, Solution, Step, Stop};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::advice;
use crate::arrays::{array_of, history, of_vertices, points_of};
use crate::errors::raised;
use crate::options::{Asked, Way};
use crate::surface::PySurface;
use crate::watch::Watch;

/// What is asked of single vertices and of the surface, as a dictionary has it. Of one number for all vertices there is one.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Wishes<'py> {
    vertices: Option<PyReadonlyArray1<'py, bool>>,
    normals: Option<PyReadonlyArray2<'py, f64>>,
    handles: Option<PyReadonlyArray1<'py, f64>>,
    alpha: Option<PyReadonlyArray1<'py, f64>>,
    subdivide: usize,
    limit: bool,
    surface_normals: bool,
    normal_threshold: f64,
    normal_tolerance: f64,
    normal_levels: usize,
    ite_max: usize,
    eps: f64,
    thin_plate: f64,
    membrane: f64,
}

/// The same, one entry a vertex each.
struct OfVertices {
    interpolated: Option<Vec<bool>>,
    normals: Option<Vec<Option<DVec3>>>,
    handles: Option<Vec<f64>>,
    alpha: Option<Vec<f64>>,
}

impl OfVertices {
    fn new(wishes: &Wishes<'_>, surface: &Surface) -> PyResult<Self> {
        let n = surface.len();
        let interpolated = of_vertices(wishes.vertices.as_ref(), n, "vertices")?;
        let features = surface.features();
        let is_interpolated = |v: usize| interpolated.as_ref().is_none_or(|marks| marks[v]);
        let is_shaped = |v: usize| is_interpolated(v) && features.is_none_or(|features| features.is_smooth(v));
        let mut normals: Option<Vec<Option<DVec3>>> = None;
        if let Some(array) = &wishes.normals {
            let given = points_of(array, n, "normals")?.iter();
            let given: Vec<Option<DVec3>> = given.map(|p| (!p.is_nan() && *p != DVec3::ZERO).then_some(*p)).collect();
            // With a normal for every vertex those are meant that can have one.
            let all = given.iter().all(Option::is_some);
            let kept = (0..).zip(given).map(|(v, normal)| normal.filter(|_| !all || is_shaped(v)));
            normals = Some(kept.collect());
        }
        let for_all = |array: &PyReadonlyArray1<'_, f64>| match array.as_array().as_slice() {
            Some(&[number]) if n > 1 => Some(number),
            _ => None,
        };
        let handles = match wishes.handles.as_ref().and_then(for_all) {
            Some(handle) => Some((0..n).map(|v| if is_shaped(v) { handle } else { 1.0 }).collect()),
            None => of_vertices(wishes.handles.as_ref(), n, "handles")?,
        };
        let mut alpha = match wishes.alpha.as_ref().and_then(for_all) {
            Some(alpha) => Some(vec![alpha; n]),
            None => of_vertices(wishes.alpha.as_ref(), n, "alpha")?,
        };
        for (v, a) in alpha.iter_mut().flatten().enumerate() {
            if interpolated.as_ref().is_some_and(|marks| marks[v]) {
                *a = 1.0;
            }
        }
        Ok(OfVertices { interpolated, normals, handles, alpha })
    }

    fn marks(&self) -> Option<&[bool]> {
        self.interpolated.as_deref()
    }

    fn constraints(&self) -> Constraints<'_> {
        let (normals, handles) = (self.normals.as_deref(), self.handles.as_deref());
        Constraints { interpolated: self.marks(), normals, handles }
    }
}

/// A control mesh, how it came about, and its surface if that was asked for.
struct Found {
    solution: Solution,
    tolerance: f64,
    /// A control mesh that has other faces than the given mesh.
    fine: Option<Surface>,
    fairness: Option<Energies>,
    /// Of the limit points, where the history holds steps.
    errors: Option<Errors>,
    made: Option<SurfaceMesh>,
}

impl Found {
    /// Without a system: the points themselves.
    fn unsolved(method: &'static str, points: &[DVec3], made: SurfaceMesh) -> Self {
        let report = Report { outcome: Outcome::Converged, iterations: 0, history: Vec::new(), detail: None };
        Found {
            solution: solution(points.to_vec(), method, report),
            tolerance: 0.0,
            fine: None,
            fairness: None,
            errors: None,
            made: Some(made),
        }
    }
}

fn solution(points: Vec<DVec3>, method: &'static str, report: Report) -> Solution {
    Solution { points, method, report, setup_seconds: 0.0, solve_seconds: 0.0, fill: None }
}

/// All that a run needs beside the mesh.
struct Run<'a> {
    surface: &'a Surface,
    scheme: Scheme,
    way: Way,
    options: Options<'a>,
    order: Vec<u32>,
    of_vertices: &'a OfVertices,
    request: SurfaceOptions<'a>,
    phase: (usize, f64),
    weights: Weights,
}

/// Solves for the control mesh, and refines it if that is wanted.
#[pyfunction]
pub fn interpolate<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PySurface>,
    scheme: Option<&str>,
    asked: Asked,
    wishes: Wishes<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let mesh = mesh.get();
    let PySurface { surface, frame } = mesh;
    let way = asked.way(py)?;
    let scheme = scheme_of(py, mesh, scheme, way, &wishes)?;
    let of_vertices = OfVertices::new(&wishes, surface)?;
    let run = Run {
        surface,
        scheme,
        way,
        options: asked.options(frame, of_vertices.marks())?,
        order: match way {
            Way::Solver(_) | Way::TwoPhase => asked.order(py, surface)?,
            Way::Auto | Way::Halstead | Way::Keeping(_) => Vec::new(),
        },
        of_vertices: &of_vertices,
        request: request(&wishes, &of_vertices)?,
        phase: (wishes.ite_max, wishes.eps),
        weights: Weights { thin_plate: wishes.thin_plate, membrane: wishes.membrane },
    };
    let mut watch = Watch::new(asked.callback, frame.scale());
    let found = py.detach(|| run.found(&mut watch));
    watch.end()?;
    let found = found.map_err(|e| raised(py, e))?;
    run.told(py, mesh, found)
}

/// The scheme that is meant, and what contradicts itself.
fn scheme_of(py: Python<'_>, mesh: &PySurface, name: Option<&str>, way: Way, wishes: &Wishes<'_>) -> PyResult<Scheme> {
    let refuse = |what: &str| Err(PyValueError::new_err(what.to_owned()));
    let belongs = |to: Scheme, what: &str| match name {
        None => Ok(to),
        Some(name) if name.parse::<Scheme>().map_err(|e| raised(py, e))? == to => Ok(to),
        Some(_) => Err(PyValueError::new_err(format!("{what} belongs to scheme=\"{to}\""))),
    };
    if wishes.alpha.is_some() {
        if !matches!(way, Way::Auto) {
            return refuse("alpha solves no system: leave method out");
        }
        if wishes.normals.is_some() || wishes.handles.is_some() {
            return refuse("alpha takes no normals or handles");
        }
        if wishes.subdivide == 0 && !wishes.limit && !wishes.surface_normals {
            return refuse("alpha leaves the control mesh as it is: ask for the surface with subdivide or limit");
        }
        return belongs(Scheme::Sqrt3, "alpha");
    }
    match way {
        Way::Auto | Way::Solver(_) => mesh.scheme_of(py, name),
        Way::TwoPhase => belongs(Scheme::ZhengCai, "method=\"two-phase\""),
        Way::Halstead if wishes.subdivide == 1 => {
            refuse("method=\"halstead\" gives a mesh two refinements down: use subdivide=2 or more, or leave it out")
        }
        Way::Halstead => belongs(Scheme::CatmullClark, "method=\"halstead\""),
        Way::Keeping(scheme) => {
            if name.is_some() {
                return refuse(&format!("method=\"{scheme}\" is a scheme of its own: leave scheme out"));
            }
            if wishes.vertices.is_some() || wishes.normals.is_some() || wishes.handles.is_some() {
                return refuse(&format!(
                    "method=\"{scheme}\" passes through all vertices and takes no normals or handles"
                ));
            }
            if wishes.subdivide == 0 {
                return refuse(&format!(
                    "method=\"{scheme}\" leaves the control mesh as it is: ask for the surface with subdivide"
                ));
            }
            Ok(Scheme::Loop)
        }
    }
}

fn request<'a>(wishes: &Wishes<'_>, of_vertices: &'a OfVertices) -> PyResult<SurfaceOptions<'a>> {
    for (name, degrees) in
        [("normal_threshold", wishes.normal_threshold), ("normal_tolerance", wishes.normal_tolerance)]
    {
        if !(0.0..=180.0).contains(&degrees) {
            return Err(PyValueError::new_err(format!("{name}={degrees}: an angle from 0 to 180 degrees is needed")));
        }
    }
    if wishes.normal_levels == 0 {
        return Err(PyValueError::new_err("normal_levels=0: at least one level is needed"));
    }
    Ok(SurfaceOptions {
        levels: wishes.subdivide,
        limit: wishes.limit,
        normals: wishes.surface_normals,
        constraints: of_vertices.constraints(),
        rotation: Rotation {
            threshold: wishes.normal_threshold.to_radians(),
            tolerance: wishes.normal_tolerance.to_radians(),
            levels: wishes.normal_levels,
        },
    })
}

impl Run<'_> {
    fn points(&self) -> &[DVec3] {
        self.surface.positions()
    }

    fn wants_surface(&self) -> bool {
        self.request.levels > 0 || self.request.limit || self.request.normals
    }

    fn found(&self, watch: &mut Watch) -> Result<Found> {
        if let Some(alpha) = &self.of_vertices.alpha {
            return self.unified(alpha);
        }
        match self.way {
            Way::Auto => self.solved(None, watch),
            Way::Solver(method) => self.solved(Some(method.in_order(Some(&self.order))), watch),
            Way::TwoPhase => self.two_phase(watch),
            Way::Halstead => self.fairest(watch),
            Way::Keeping(refinement) => self.keeping(refinement),
        }
    }

    fn solved(&self, method: Option<Method<'_>>, watch: &mut Watch) -> Result<Found> {
        check(self.surface, self.scheme, &self.request)?;
        let Options { tolerance, max_iterations, interpolated, .. } = self.options;
        let options = Options { method, tolerance, max_iterations, interpolated };
        let stop = options.stop(self.points())?;
        let see = &mut |method: &'static str, step: &Step| watch.see(method, step);
        let solution = interpolate_watched(self.surface, self.scheme, &options, see)?;
        self.refined(solution, stop.tolerance)
    }

    /// With the surface, unless the run ended elsewhere than at a solution.
    fn refined(&self, solution: Solution, tolerance: f64) -> Result<Found> {
        let made = if self.wants_surface() && solution.points.iter().all(|p| p.is_finite()) {
            let control = self.surface.with_positions(solution.points.clone());
            Some(surface(control, self.scheme, self.points(), &self.request)?)
        } else {
            None
        };
        Ok(Found { solution, tolerance, fine: None, fairness: None, errors: None, made })
    }

    fn two_phase(&self, watch: &mut Watch) -> Result<Found> {
        check(self.surface, self.scheme, &self.request)?;
        let begin = Instant::now();
        let (max_iterations, eps) = self.phase;
        let phase = PhaseOne { sweep: Sweep::GaussSeidel(Some(&self.order)), max_iterations, eps };
        let marks = self.of_vertices.marks();
        let mut history = Vec::new();
        let see = &mut |iteration: usize, points: &[DVec3]| {
            // If this fails, so does the end, which says it.
            if let Ok(errors) = self.limit_errors(points) {
                history.push(Recorded { iteration, errors });
                // The sweeps go on to their end, of which there are a few.
                let _: ControlFlow<()> = watch.see("two-phase", &Step { iteration, errors, points });
            }
        };
        let found = zheng_cai::auxiliary_watched(self.surface, marks, &phase, see)?;
        let outcome = if found.passed { Outcome::Converged } else { Outcome::MaxIterations };
        let report = Report { outcome, iterations: found.updates.len(), history, detail: None };
        let solve_seconds = begin.elapsed().as_secs_f64();
        let solution = solution(found.surface.into_mesh().positions, "two-phase", report);
        self.refined(Solution { solve_seconds, ..solution }, eps * self.surface.diagonal())
    }

    fn fairest(&self, watch: &mut Watch) -> Result<Found> {
        let begin = Instant::now();
        let fairness = Fairness::new(self.surface)?;
        let setup_seconds = begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let size = diagonal(self.points());
        let stop = Stop { tolerance: halstead::fit::TOLERANCE * size, max_iterations: halstead::fit::MAX_ITERATIONS };
        let see = &mut |step: &Step| watch.see("halstead", step);
        let (wishes, way) = (&self.request.constraints, Solver::Iterations);
        let found = fit_watched(&fairness, self.points(), wishes, self.weights, way, &stop, see)?.found()?;
        let solve_seconds = begin.elapsed().as_secs_f64();
        // Where no smaller step can be told the surface is as fair as doubles have it.
        let outcome = match found.report.outcome {
            Outcome::Rounding => Outcome::Converged,
            outcome => outcome,
        };
        let report = Report { outcome, ..found.report };
        let made = if self.wants_surface() {
            let levels = self.request.levels.saturating_sub(halstead::LEVELS);
            let (limit, normals) = (self.request.limit, self.request.normals);
            let request = SurfaceOptions { levels, limit, normals, ..SurfaceOptions::default() };
            Some(surface(found.surface.clone(), self.scheme, &[], &request)?)
        } else {
            None
        };
        let solution = solution(found.surface.positions().to_vec(), "halstead", report);
        let solution = Solution { setup_seconds, solve_seconds, ..solution };
        Ok(Found {
            solution,
            tolerance: stop.tolerance,
            fine: Some(found.surface),
            fairness: Some(found.energies),
            errors: Some(found.errors),
            made,
        })
    }

    /// Lin and Luo's unified √3 surface.
    fn unified(&self, alpha: &[f64]) -> Result<Found> {
        let (mut surface, alpha) = lin_luo::surface::refine_n(self.surface, alpha, self.request.levels)?;
        let mut normals = None;
        if self.request.limit || self.request.normals {
            let found = lin_luo::limit::limits(&surface, &alpha)?;
            normals = self.request.normals.then_some(found.normals);
            if self.request.limit {
                surface.positions_mut().copy_from_slice(&found.positions);
            }
        }
        Ok(Found::unsolved("lin-luo", self.points(), SurfaceMesh { normals, ..SurfaceMesh::plain(surface) }))
    }

    fn keeping(&self, refinement: Refinement) -> Result<Found> {
        let surface = refinement.refined_n(self.surface, self.request.levels)?;
        let normals = if self.request.normals { Some(refinement.limit_normals(&surface)?) } else { None };
        let made = SurfaceMesh { normals, ..SurfaceMesh::plain(surface) };
        Ok(Found::unsolved(refinement.name(), self.points(), made))
    }

    /// How far the limit points of control points are from those interpolated.
    fn limit_errors(&self, control: &[DVec3]) -> Result<Errors> {
        let limits = limit_points(&self.surface.with_positions(control.to_vec()), self.scheme)?;
        let marked = (0..control.len()).filter(|&v| self.of_vertices.marks().is_none_or(|marks| marks[v]));
        let distances: Vec<f64> = marked.map(|v| limits[v].distance(self.points()[v])).collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        Ok(Errors { max: distances.iter().copied().fold(0.0, f64::max), mean })
    }

    /// What was found as a dictionary of arrays, in the units of the points as they were given.
    fn told<'py>(&self, py: Python<'py>, mesh: &PySurface, found: Found) -> PyResult<Bound<'py, PyDict>> {
        let Found { solution, tolerance, fine, fairness, errors, made } = found;
        let unit = mesh.frame.scale();
        let failed = match (self.way, solution.report.outcome) {
            (_, Outcome::Converged | Outcome::Stopped) | (Way::TwoPhase, _) => None,
            (way, _) => {
                let stop = Stop { tolerance, max_iterations: self.options.max_iterations };
                let chosen = matches!(way, Way::Solver(_));
                let system = (self.surface, self.scheme);
                let made = || Failed::new(system, self.of_vertices.marks(), chosen, &solution.report, &stop);
                Some(advice::of_failed(&py.detach(made), unit))
            }
        };
        let told = told(py, solution, (tolerance, failed), mesh)?;
        told.set_item("scheme", self.scheme.name())?;
        let energies = fairness.map(|e| (unit * unit * e.thin_plate, unit * unit * e.membrane));
        told.set_item("energies", energies)?;
        told.set_item("errors", errors.map(|errors| (unit * errors.max, unit * errors.mean)))?;
        told.set_item("control", fine.map(|fine| mesh.described(py, fine)).transpose()?)?;
        let described = made.map(|made| -> PyResult<_> {
            told.set_item("normals_set", made.normals_set)?;
            told.set_item("not_flattened", made.not_flattened)?;
            let described = mesh.described(py, made.surface)?;
            described.set_item("normals", made.normals.map(|normals| array_of(py, normals)))?;
            Ok(described)
        });
        told.set_item("surface", described.transpose()?)?;
        Ok(told)
    }
}

/// A solution as a dictionary, in the units of the points as they were given.
pub fn told<'py>(
    py: Python<'py>,
    solution: Solution,
    (tolerance, failed): (f64, Option<String>),
    mesh: &PySurface,
) -> PyResult<Bound<'py, PyDict>> {
    let Solution { mut points, method, report, setup_seconds, solve_seconds, fill } = solution;
    let unit = mesh.frame.scale();
    mesh.frame.leave(&mut points);
    let told = of_run(py, (method, report), unit, tolerance)?;
    told.set_item("vertices", array_of(py, points))?;
    told.set_item("setup_seconds", setup_seconds)?;
    told.set_item("solve_seconds", solve_seconds)?;
    told.set_item("fill", fill)?;
    told.set_item("failed", failed)?;
    Ok(told)
}

/// What a run by a method came to, as a dictionary; `unit` is what a length of one measures in the units of the points.
pub fn of_run<'py>(
    py: Python<'py>,
    (method, report): (&str, Report),
    unit: f64,
    tolerance: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("method", method)?;
    told.set_item("status", report.outcome.name())?;
    told.set_item("iterations", report.iterations)?;
    told.set_item("history", history(py, &report.history, unit))?;
    told.set_item("detail", report.detail)?;
    told.set_item("tolerance", unit * tolerance)?;
    Ok(told)
}

/// An array of numbers.
pub fn numbers(py: Python<'_>, values: Vec<f64>) -> Bound<'_, numpy::PyArray1<f64>> {
    values.into_pyarray(py)
}
