//! The library for NumPy and SciPy: what `limitlab`, the Python package, is made of.
//!
//! Python's side, in `limitlab/`, takes whatever arrays and names people have and makes of them the few forms that are taken
//! here; its functions are the documented ones. Here the library is called, without the interpreter, and what it finds goes back
//! as dictionaries of arrays: in the memory of the library wherever it can.

#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod advice;
mod arrays;
mod comparison;
mod errors;
mod interpolate;
mod interpolator;
mod options;
mod own;
mod spectra;
mod surface;
mod system;
mod watch;

use pyo3::prelude::*;

#[pymodule]
mod _limitlab {
    #[pymodule_export]
    use super::comparison::{compare_methods, sweep_omega};
    #[pymodule_export]
    use super::interpolate::interpolate;
    #[pymodule_export]
    use super::interpolator::PyInterpolator;
    #[pymodule_export]
    use super::spectra::{spectrum, splitting};
    #[pymodule_export]
    use super::surface::{PySurface, mesh, read, write};
    #[pymodule_export]
    use super::system::PySystem;

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
