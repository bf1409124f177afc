//! Interpolation for points that move.

use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use limitlab::interpolate::Interpolator;
use limitlab::mesh::frame::Frame;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Report, Step};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{of_vertices, points_of};
use crate::errors::raised;
use crate::interpolate::of_run;
use crate::options::Asked;
use crate::surface::PySurface;
use crate::watch::Watch;

/// The operator, the order of its rows, and all arrays.
struct State {
    interpolator: Interpolator,
    /// Of the last points.
    frame: Frame,
    points: Vec<DVec3>,
    control: Vec<DVec3>,
}

/// As the library's, for one thread at a time.
#[pyclass(frozen, name = "Interpolator")]
pub struct PyInterpolator {
    scheme: Scheme,
    n: usize,
    state: Mutex<State>,
}

#[pymethods]
impl PyInterpolator {
    #[new]
    #[pyo3(signature = (mesh, scheme, vertices))]
    fn new(
        py: Python<'_>,
        mesh: &Bound<'_, PySurface>,
        scheme: Option<&str>,
        vertices: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<Self> {
        let mesh = mesh.get();
        let scheme = mesh.scheme_of(py, scheme)?;
        let n = mesh.surface.len();
        let marks = of_vertices(vertices.as_ref(), n, "vertices")?;
        let made = py.detach(|| Interpolator::new(&mesh.surface, scheme, marks.as_deref()));
        let interpolator = made.map_err(|e| raised(py, e))?;
        let state = State { interpolator, frame: Frame::IDENTITY, points: Vec::new(), control: Vec::new() };
        Ok(PyInterpolator { scheme, n, state: Mutex::new(state) })
    }

    fn __len__(&self) -> usize {
        self.n
    }

    #[getter]
    fn scheme(&self) -> &'static str {
        self.scheme.name()
    }

    /// Writes the control points of `points` to `out`, from those of the points before if it is `warm`.
    fn solve<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        mut out: PyReadwriteArray2<'py, f64>,
        warm: bool,
        asked: Asked,
    ) -> PyResult<Bound<'py, PyDict>> {
        if asked.solver(py)?.is_some() {
            return Err(PyValueError::new_err("an Interpolator solves by method=\"auto\""));
        }
        let points = points_of(&points, self.n, "P")?;
        let out: &mut [DVec3] = bytemuck::cast_slice_mut(out.as_slice_mut()?);
        if out.len() != self.n {
            return Err(PyValueError::new_err(format!("out: a contiguous array of shape ({}, 3) is needed", self.n)));
        }
        if points.iter().any(|p| !p.is_finite()) {
            return Err(PyValueError::new_err("P has a coordinate that is not finite"));
        }
        // The lock is taken without the interpreter: who holds it may wait for that in a callback.
        let solved = py.detach(|| self.solved(points, out, warm, asked));
        let (method, report, unit, tolerance) = solved?;
        of_run(py, (method, report), unit, tolerance)
    }
}

impl PyInterpolator {
    fn solved(
        &self,
        given: &[DVec3],
        out: &mut [DVec3],
        warm: bool,
        asked: Asked,
    ) -> PyResult<(&'static str, Report, f64, f64)> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let State { interpolator, frame, points, control } = &mut *state;
        points.clear();
        points.extend_from_slice(given);
        let before = *frame;
        *frame = Frame::of(points).map_err(|v| {
            PyValueError::new_err(format!("vertex {v}: doubles cannot hold its coordinates beside the largest"))
        })?;
        frame.enter(points);
        if !warm || *frame != before {
            control.clear();
        }
        let stop = Python::attach(|py| asked.stop(py, frame, points))?;
        let mut watch = Watch::new(asked.callback, frame.scale());
        let see = &mut |method: &'static str, step: &Step| watch.see(method, step);
        let (method, report) = interpolator.solve_watched(points, control, &stop, see);
        watch.end()?;
        out.copy_from_slice(control);
        frame.leave(out);
        Ok((method, report, frame.scale(), stop.tolerance))
    }
}
