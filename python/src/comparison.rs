//! All methods on one system, and sweeps over ω.

use glam::DVec3;
use limitlab::analysis::comparison::{MethodRow, compare, compare_entry, entries, with_least_times};
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::custom_methods::{Named, Own};
use limitlab::analysis::spectrum::Spectra;
use limitlab::analysis::sweep::{OmegaSweep, rounding_floor, sweep};
use limitlab::assemble::LimitSystem;
use limitlab::error::Result;
use limitlab::interpolate::interpolate_watched;
use limitlab::names;
use limitlab::solvers::{Failure, Iterate, Method, Step, Stop, System};
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{history, points_of};
use crate::errors::raised;
use crate::options::Asked;
use crate::own::{Iterates, Raised};
use crate::surface::{PySurface, placed};
use crate::system::PySystem;
use crate::watch::Watch;

/// What methods run on.
struct Problem<'a> {
    mesh: PySurface,
    right: Vec<DVec3>,
    start: Vec<DVec3>,
    order: Vec<u32>,
    order_name: &'a str,
    stop: Stop,
}

impl<'a> Problem<'a> {
    fn new(py: Python<'_>, system: &PySystem, points: &PyReadonlyArray2<'_, f64>, asked: &'a Asked) -> PyResult<Self> {
        let (points, frame) = placed(py, points_of(points, system.stages.len(), "P")?.to_vec())?;
        let stop = asked.stop(py, &frame, &points)?;
        let mesh = system.mesh(points, frame);
        let all = asked.order(py, &mesh.surface)?;
        let points = mesh.surface.positions();
        let known = system.stages.known(points);
        let (right, start, order) = match system.is_unsymmetric() {
            true => (points.to_vec(), points.to_vec(), all),
            false => {
                let right = system.stages.right_hand_side(&known);
                (right, system.stages.restricted(&known), system.stages.order(&all))
            }
        };
        Ok(Problem { mesh, right, start, order, order_name: asked.order_name(), stop })
    }

    fn data(&self) -> (&[DVec3], &[DVec3]) {
        (&self.right, &self.start)
    }

    /// The rows of methods by name.
    fn rows<'m, S: System, K: Spectra + Clone>(
        &'m self,
        (system, spectra): (&S, &K),
        methods: &[Method<'m>],
        watch: &mut Watch,
    ) -> Result<Vec<MethodRow<'m>>> {
        let lines = entries(system, spectra, methods, Some(&self.order), self.order_name)?;
        let mut rows = Vec::new();
        for line in &lines {
            let see = &mut |step: &Step| watch.see(line.method.name(), step);
            rows.push(compare_entry(system, spectra, self.data(), line, &self.stop, see)?);
            if watch.has_raised() {
                break;
            }
        }
        Ok(rows)
    }

    fn auto(&self, system: &PySystem, watch: &mut Watch) -> Result<MethodRow<'static>> {
        let options = self.stop.into();
        let run = |watch: &mut Watch| {
            let see = &mut |method: &'static str, step: &Step| watch.see(method, step);
            interpolate_watched(&self.mesh.surface, system.scheme, &options, see)
        };
        let first = run(watch)?;
        let solution = with_least_times(first, || run(&mut Watch::new(None, 1.0)))?;
        Ok(MethodRow {
            method: Named::Own("auto".into()),
            variant: "",
            parameter: solution.method.into(),
            solution,
            observed_rate: None,
            predicted_rate: None,
        })
    }

    /// The rows of the caller's own methods.
    fn own(&self, system: &PySystem, own: &[(String, Py<PyAny>)], raised: &Raised) -> Result<Vec<MethodRow<'static>>> {
        let starts: Vec<Box<Made<'_>>> = own.iter().map(|(_, method)| made(method, raised)).collect();
        let own: Vec<Own<'_>> = own
            .iter()
            .zip(&starts)
            .map(|((name, _), start)| Own { name: name.clone(), parameter: String::new(), start: start.as_ref() })
            .collect();
        compare(system.block(), &system.spectrum()?, self.data(), &[], &own, &self.stop, &mut || ())
    }
}

/// Makes the iteration of a caller's own method.
type Made<'s> =
    dyn for<'a> Fn(&'a LimitSystem, &'a [DVec3]) -> std::result::Result<Box<dyn Iterate + 'a>, Failure> + Sync + 's;

fn made<'s>(method: &'s Py<PyAny>, raised: &'s Raised) -> Box<Made<'s>> {
    Box::new(|system, points| Ok(Box::new(Iterates::start(method, system, points, raised)?)))
}

/// Runs methods by name, `auto` among them, then the caller's own. The rows, and what was left out for lack of symmetry.
#[pyfunction]
#[pyo3(name = "compare")]
pub fn compare_methods<'py>(
    py: Python<'py>,
    system: &Bound<'py, PySystem>,
    points: PyReadonlyArray2<'py, f64>,
    methods: Vec<String>,
    own: Vec<(String, Py<PyAny>)>,
    mut asked: Asked,
) -> PyResult<(Vec<Bound<'py, PyDict>>, Vec<&'static str>)> {
    let system = system.get();
    let callback = asked.callback.take();
    let problem = Problem::new(py, system, &points, &asked)?;
    let unit = problem.mesh.frame.scale();
    let is_auto = |name: &&String| names::same(name, "auto");
    let auto = methods.iter().any(|name| is_auto(&name));
    let parsed = methods.iter().filter(|name| !is_auto(name)).map(|name| name.parse::<Method<'static>>());
    let mut methods: Vec<Method<'static>> = parsed.collect::<Result<_>>().map_err(|e| raised(py, e))?;
    let mut left_out = Vec::new();
    if system.is_unsymmetric() {
        if !own.is_empty() {
            let what = "methods of your own get A, h and P of a symmetric system, and darts and semi-sharp vertices leave none";
            return Err(PyValueError::new_err(what));
        }
        left_out = methods.extract_if(.., |method| method.needs_symmetry()).map(Method::name).collect();
    }
    let exceptions = Raised::default();
    let mut watch = Watch::new(callback, unit);
    let rows = py.detach(|| -> Result<Vec<MethodRow<'_>>> {
        let mut rows = match system.is_unsymmetric() {
            true => problem.rows((system.general(), &ComplexSpectrum::new(system.general())?), &methods, &mut watch)?,
            false => problem.rows((system.block(), &system.spectrum()?), &methods, &mut watch)?,
        };
        if auto && !watch.has_raised() {
            rows.push(problem.auto(system, &mut watch)?);
        }
        if !own.is_empty() && !watch.has_raised() {
            rows.extend(problem.own(system, &own, &exceptions)?);
        }
        Ok(rows)
    });
    watch.end()?;
    if let Some(error) = exceptions.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
        return Err(error);
    }
    let rows = rows.map_err(|e| raised(py, e))?;
    let described: PyResult<_> = rows.iter().map(|row| described(py, row, unit)).collect();
    Ok((described?, left_out))
}

fn described<'py>(py: Python<'py>, row: &MethodRow<'_>, unit: f64) -> PyResult<Bound<'py, PyDict>> {
    let (solution, report) = (&row.solution, &row.solution.report);
    let errors = report.last() * unit;
    let told = PyDict::new(py);
    told.set_item("method", row.method.name())?;
    told.set_item("parameter", &row.parameter)?;
    told.set_item("status", report.outcome.name())?;
    told.set_item("iterations", report.iterations)?;
    told.set_item("max_error", errors.max)?;
    told.set_item("mean_error", errors.mean)?;
    told.set_item("observed_rate", row.observed_rate)?;
    told.set_item("predicted_rate", row.predicted_rate)?;
    told.set_item("passes", row.method.passes())?;
    told.set_item("fill", solution.fill)?;
    told.set_item("setup_seconds", solution.setup_seconds)?;
    told.set_item("solve_seconds", solution.solve_seconds)?;
    told.set_item("detail", &report.detail)?;
    told.set_item("history", history(py, &report.history, unit))?;
    Ok(told)
}

/// A sweep over ω of methods, each with its grid.
#[pyfunction]
pub fn sweep_omega<'py>(
    py: Python<'py>,
    system: &Bound<'py, PySystem>,
    points: PyReadonlyArray2<'py, f64>,
    grids: Vec<(String, Vec<f64>)>,
    asked: Asked,
) -> PyResult<Bound<'py, PyDict>> {
    let system = system.get();
    let problem = Problem::new(py, system, &points, &asked)?;
    let mut parsed: Vec<(Method<'static>, Vec<f64>)> = Vec::new();
    for (name, omegas) in grids {
        let method: Method<'static> = name.parse().map_err(|e| raised(py, e))?;
        if !matches!(method, Method::Jacobi { .. } | Method::Pia | Method::Sor { .. }) {
            return Err(PyValueError::new_err(format!("{method} has no ω to sweep: choose among jacobi, pia and sor")));
        }
        if let Some(omega) = omegas.iter().find(|&&omega| !(omega > 0.0 && omega.is_finite())) {
            return Err(PyValueError::new_err(format!("ω = {omega}: positive numbers are needed")));
        }
        parsed.push((method, omegas));
    }
    let floor = rounding_floor(problem.mesh.surface.diagonal());
    let (data, order, stop) = (problem.data(), Some(&problem.order[..]), &problem.stop);
    let found = py.detach(|| match system.is_unsymmetric() {
        true => {
            let general = system.general();
            sweep((general, &ComplexSpectrum::new(general)?), data, &parsed, order, stop, floor, &|_| ())
        }
        false => sweep((system.block(), &system.spectrum()?), data, &parsed, order, stop, floor, &|_| ()),
    });
    swept(py, &found.map_err(|e| raised(py, e))?, problem.mesh.frame.scale())
}

fn swept<'py>(py: Python<'py>, found: &OmegaSweep, unit: f64) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    let rows: PyResult<Vec<_>> = found
        .rows
        .iter()
        .map(|row| {
            let told = PyDict::new(py);
            told.set_item("method", row.method.name())?;
            told.set_item("omega", row.omega)?;
            told.set_item("status", row.outcome.name())?;
            told.set_item("iterations", row.iterations)?;
            told.set_item("predicted_rho", row.predicted_rho)?;
            told.set_item("observed_rate", row.observed_rate)?;
            told.set_item("max_error", (row.errors * unit).max)?;
            Ok(told)
        })
        .collect();
    told.set_item("rows", rows?)?;
    let (best, optimal, critical) = (PyDict::new(py), PyDict::new(py), PyDict::new(py));
    for row in found.rows.iter().filter_map(|row| found.best(row.method)) {
        best.set_item(row.method.name(), row.omega)?;
    }
    for threshold in &found.thresholds {
        optimal.set_item(threshold.method.name(), threshold.optimal_omega)?;
        critical.set_item(threshold.method.name(), threshold.critical_omega)?;
    }
    told.set_item("best", best)?;
    told.set_item("optimal", optimal)?;
    told.set_item("critical", critical)?;
    Ok(told)
}
