//! What Python sees of a run: calls back with every iterate, looks for Ctrl-C, and keeps what was raised.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use limitlab::solvers::Step;
use pyo3::prelude::*;

/// Between two looks for signals: to wait for the interpreter at every iterate would slow short ones down.
const PAUSE: Duration = Duration::from_millis(50);

/// Stops a run where the callback says so, or raises.
pub struct Watch {
    callback: Option<Py<PyAny>>,
    /// Errors here are in parts of this many units of length.
    unit: f64,
    looked: Instant,
    raised: Option<PyErr>,
}

impl Watch {
    pub fn new(callback: Option<Py<PyAny>>, unit: f64) -> Self {
        Watch { callback, unit, looked: Instant::now(), raised: None }
    }

    pub fn see(&mut self, method: &str, step: &Step) -> ControlFlow<()> {
        if self.raised.is_some() {
            return ControlFlow::Break(());
        }
        if self.callback.is_none() && self.looked.elapsed() < PAUSE {
            return ControlFlow::Continue(());
        }
        self.looked = Instant::now();
        let errors = step.errors * self.unit;
        let told = Python::attach(|py| {
            py.check_signals()?;
            match &self.callback {
                None => Ok(false),
                Some(callback) => {
                    callback.bind(py).call1((step.iteration, errors.max, errors.mean, method))?.is_truthy()
                }
            }
        });
        match told {
            Ok(false) => ControlFlow::Continue(()),
            Ok(true) => ControlFlow::Break(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Whether something was raised.
    pub fn has_raised(&self) -> bool {
        self.raised.is_some()
    }

    /// What the callback raised, or a signal.
    ///
    /// # Errors
    /// That.
    pub fn end(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }
}
