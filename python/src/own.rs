//! Methods of the caller's own, in Python: their iterates one by one.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::solvers::system::Rows;
use limitlab::solvers::{Errors, Failure, Iterate, Outcome};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arrays::{array_of, points_of};

/// Where what Python raised is kept until the run has ended.
pub type Raised = Arc<Mutex<Option<PyErr>>>;

/// An iterator of Python over arrays of points.
pub struct Iterates<'a> {
    iterator: Py<PyAny>,
    system: &'a LimitSystem,
    given: &'a [DVec3],
    points: Vec<DVec3>,
    rows: Rows,
    raised: Raised,
}

impl<'a> Iterates<'a> {
    /// Calls `method` with the right-hand side, which gives the iterator; the start is V = P.
    ///
    /// # Errors
    /// What it raises, as a breakdown.
    pub fn start(
        method: &Py<PyAny>,
        system: &'a LimitSystem,
        given: &'a [DVec3],
        raised: &Raised,
    ) -> Result<Self, Failure> {
        if raised.lock().unwrap_or_else(PoisonError::into_inner).is_some() {
            return Err(broken("it has raised before"));
        }
        let made = Python::attach(|py| {
            py.check_signals()?;
            Ok(method.bind(py).call1((array_of(py, given.to_vec()),))?.try_iter()?.into_any().unbind())
        });
        let iterator = made.map_err(|error| keep(raised, error))?;
        Ok(Iterates {
            iterator,
            system,
            given,
            points: given.to_vec(),
            rows: Rows::new(given.len()),
            raised: Arc::clone(raised),
        })
    }
}

fn broken(what: &str) -> Failure {
    Failure { outcome: Outcome::Breakdown, detail: what.into() }
}

fn keep(raised: &Raised, error: PyErr) -> Failure {
    let failure = broken(&error.to_string());
    *raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
    failure
}

impl Iterate for Iterates<'_> {
    fn errors(&mut self) -> Errors {
        self.rows.errors(self.system, self.given, &self.points)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let points = &mut self.points;
        let next = Python::attach(|py| -> PyResult<bool> {
            py.check_signals()?;
            let Some(next) = self.iterator.bind(py).try_iter()?.next() else { return Ok(false) };
            let array: PyReadonlyArray2<'_, f64> = next?.extract()?;
            let n = points.len();
            points.copy_from_slice(points_of(&array, n, "an iterate")?);
            Ok(true)
        });
        match next {
            Ok(true) => Ok(()),
            Ok(false) => Err(broken("it gives no further iterate")),
            Err(error) => Err(keep(&self.raised, error)),
        }
    }

    fn points(&self) -> &[DVec3] {
        &self.points
    }
}
