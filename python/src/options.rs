//! What is asked of a solution: method, order, tolerance, callback.

use limitlab::interpolate::{Options, Tolerance};
use limitlab::mesh::Surface;
use limitlab::mesh::frame::Frame;
use limitlab::mesh::order::Order;
use limitlab::names;
use limitlab::schemes::Refinement;
use limitlab::solvers::{Method, Stop};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::raised;

/// As a dictionary has it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    method: String,
    omega: Option<f64>,
    order: String,
    tol: f64,
    atol: Option<f64>,
    max_iter: usize,
    pub callback: Option<Py<PyAny>>,
}

/// What finds the control mesh.
#[derive(Clone, Copy)]
pub enum Way {
    Auto,
    Solver(Method<'static>),
    /// Zheng and Cai's own sweeps.
    TwoPhase,
    /// The fairest surface.
    Halstead,
    /// A scheme that keeps its vertices.
    Keeping(Refinement),
}

impl Asked {
    /// The method by its name; whether the order is one, too.
    pub fn way(&self, py: Python<'_>) -> PyResult<Way> {
        let mut all = vec![
            ("auto", Way::Auto),
            ("two-phase", Way::TwoPhase),
            ("halstead", Way::Halstead),
            ("butterfly", Way::Keeping(Refinement::Butterfly)),
            ("labsik-greiner", Way::Keeping(Refinement::LabsikGreiner)),
        ];
        all.extend(Method::ALL.map(|method| (method.name(), Way::Solver(method))));
        let aliases = Method::ALIASES.map(|(alias, method)| (alias, Way::Solver(method)));
        let way = names::find("method", &self.method, &all, &aliases).map_err(|e| raised(py, e))?;
        self.parsed_order(py)?;
        match (way, self.omega) {
            (way, None) => Ok(way),
            (Way::Solver(method), Some(omega)) if omega > 0.0 && omega.is_finite() => {
                method.at_omega(omega).map(Way::Solver).ok_or_else(|| without_omega(method.name()))
            }
            (Way::Solver(_), Some(omega)) => {
                Err(PyValueError::new_err(format!("omega={omega}: a positive number is needed")))
            }
            (_, Some(_)) => Err(without_omega(&self.method)),
        }
    }

    /// A method that solves a system, or `None` for `auto`.
    pub fn solver(&self, py: Python<'_>) -> PyResult<Option<Method<'static>>> {
        match self.way(py)? {
            Way::Auto => Ok(None),
            Way::Solver(method) => Ok(Some(method)),
            Way::TwoPhase | Way::Halstead | Way::Keeping(_) => Err(PyValueError::new_err(format!(
                "{} is a pipeline on a mesh, not a method for its system: use interpolate",
                self.method
            ))),
        }
    }

    fn parsed_order(&self, py: Python<'_>) -> PyResult<Order> {
        self.order.parse().map_err(|e| raised(py, e))
    }

    /// The order of sweeps in place.
    pub fn order(&self, py: Python<'_>, surface: &Surface) -> PyResult<Vec<u32>> {
        let order = self.parsed_order(py)?;
        Ok(py.detach(|| order.order(surface.mesh(), surface.incidence())))
    }

    pub fn order_name(&self) -> &str {
        &self.order
    }

    /// In the frame of the points.
    pub fn options<'a>(&self, frame: &Frame, marks: Option<&'a [bool]>) -> PyResult<Options<'a>> {
        let tolerance = match self.atol {
            Some(atol) => Tolerance::Absolute(checked("atol", atol)? / frame.scale()),
            None => Tolerance::Relative(checked("tol", self.tol)?),
        };
        Ok(Options { method: None, tolerance, max_iterations: self.max_iter, interpolated: marks })
    }

    /// When iterations on these points stop, in their frame.
    pub fn stop(&self, py: Python<'_>, frame: &Frame, points: &[glam::DVec3]) -> PyResult<Stop> {
        self.options(frame, None)?.stop(points).map_err(|e| raised(py, e))
    }
}

fn checked(name: &str, tolerance: f64) -> PyResult<f64> {
    if tolerance >= 0.0 && tolerance.is_finite() {
        return Ok(tolerance);
    }
    Err(PyValueError::new_err(format!("{name}={tolerance}: a number from 0 on is needed")))
}

fn without_omega(method: &str) -> PyErr {
    PyValueError::new_err(format!("{method} takes no omega: jacobi, pia (w-pia), sor and ssor do"))
}
