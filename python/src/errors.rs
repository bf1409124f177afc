//! Errors of the library as exceptions: those of `limitlab.errors`, and Python's own where they say the same.

use std::io::ErrorKind;

use limitlab::Error;
use limitlab::mesh::validate::Validation;
use pyo3::exceptions::{PyMemoryError, PyOSError, PyValueError};
use pyo3::prelude::*;

/// The exception for an error of the library.
pub fn raised(py: Python<'_>, error: Error) -> PyErr {
    exception(py, error).unwrap_or_else(|failed| failed)
}

/// The exception for a mesh with defects, all of which it carries.
pub fn of_defects(py: Python<'_>, report: &Validation) -> PyErr {
    let or = match (report.is_open_only(), report.is_repairable) {
        (true, _) => ", or leave out boundary=\"refuse\"",
        (false, true) => "; the program `interpolate` repairs it",
        (false, false) => "",
    };
    let text = report.summary_line() + or;
    let made = || {
        let json = serde_json::to_string(report).map_err(|e| PyValueError::new_err(e.to_string()))?;
        let report = py.import("json")?.getattr("loads")?.call1((json,))?;
        made(py, "MeshError", (text, report))
    };
    made().unwrap_or_else(|failed| failed)
}

fn exception(py: Python<'_>, error: Error) -> PyResult<PyErr> {
    let text = error.to_string();
    // A place on the mesh, as a defect has it.
    let at = |kind: &str, place: &str, number: usize| {
        let report = pyo3::types::PyDict::new(py);
        let defect = pyo3::types::PyDict::new(py);
        defect.set_item("kind", kind)?;
        defect.set_item(place, number)?;
        report.set_item("defects", [defect])?;
        made(py, "MeshError", (text.clone(), report))
    };
    match error {
        Error::Io { path, source, .. } => {
            // From a code, words and a name Python makes FileNotFoundError and its like.
            let errno = py.import("errno")?;
            let code: i32 = match (source.raw_os_error(), source.kind()) {
                (Some(code), _) => code,
                (None, ErrorKind::NotFound) => errno.getattr("ENOENT")?.extract()?,
                (None, _) => errno.getattr("EIO")?.extract()?,
            };
            Ok(PyOSError::new_err((code, source.to_string(), path.display().to_string())))
        }
        Error::Parse { path, line, .. } => made(py, "FormatError", (text, path.display().to_string(), line)),
        Error::Defects(report) => Ok(of_defects(py, &report)),
        Error::NotTriangles { face, .. } => at("not-a-triangle", "face", face),
        Error::Dart { vertex, .. } => at("dart", "vertex", vertex),
        Error::SemiSharp { vertex, .. } => at("semi-sharp", "vertex", vertex),
        Error::Unsymmetric { vertex, .. } => at("unsymmetric", "vertex", vertex),
        Error::Open { .. } | Error::Tag(_) | Error::Creased { .. } | Error::Mesh { .. } => {
            made(py, "MeshError", (text, py.None()))
        }
        Error::TooLarge { .. } | Error::Memory { .. } => Ok(PyMemoryError::new_err(text)),
        Error::TooFewLevels { needed, .. } => {
            Ok(PyValueError::new_err(format!("{text}: use subdivide={needed} or more")))
        }
        Error::Computation(_) => made(py, "ComputationError", (text,)),
        // Names, numbers and matrices that mean nothing here.
        _ => Ok(PyValueError::new_err(text)),
    }
}

/// An exception of `limitlab.errors`, which Python has because their attributes are its objects.
fn made<'py, A: pyo3::call::PyCallArgs<'py>>(py: Python<'py>, name: &str, arguments: A) -> PyResult<PyErr> {
    Ok(PyErr::from_value(py.import("limitlab.errors")?.getattr(name)?.call1(arguments)?))
}
