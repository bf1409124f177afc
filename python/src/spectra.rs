//! Spectra of systems, and local matrices of single vertices.

use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::predict::predicted_rate;
use limitlab::analysis::singularity::{Singularity, SlowModes, modes};
use limitlab::analysis::spectrum::{Estimate, Spectra, SpectrumEnds, ends, mesh_ends};
use limitlab::analysis::splitting::{LocalScheme, SharpVertex, rows, sharp_rows};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::analysis::{Spectrum, dense};
use limitlab::error::Result;
use limitlab::names;
use limitlab::solvers::{Method, System};
use nalgebra::Complex;
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{points_of, rows as row_array};
use crate::errors::raised;
use crate::interpolate::numbers;
use crate::surface::placed;
use crate::system::PySystem;

/// What is asked of a spectrum, as a dictionary has it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Wanted {
    full: bool,
    modes: usize,
    rates: bool,
}

/// The predicted factors per iteration of the methods that have one.
fn rates(system: &impl System, spectra: &impl Spectra) -> Result<Vec<(&'static str, f64)>> {
    let rate = |method: Method<'static>| {
        let rate = predicted_rate(system, spectra, method).transpose();
        rate.map(|rate| Ok((method.name(), rate?)))
    };
    Method::ALL.into_iter().filter_map(rate).collect()
}

/// The ends of the spectra of A and D⁻¹A, rates, singularity; all eigenvalues and slow modes if they are asked for. Of open and
/// creased meshes those of the smooth vertices, where no diagonal makes A symmetric those of all.
#[pyfunction]
pub fn spectrum<'py>(
    py: Python<'py>,
    system: &Bound<'py, PySystem>,
    points: PyReadonlyArray2<'py, f64>,
    wanted: Wanted,
) -> PyResult<Bound<'py, PyDict>> {
    let system = system.get();
    let (points, frame) = placed(py, points_of(&points, system.stages.len(), "P")?.to_vec())?;
    if system.is_unsymmetric() {
        return complex(py, system, &wanted);
    }
    let block = system.block();
    if block.is_empty() {
        return Err(PyValueError::new_err("no vertex is smooth: there is no system beside the curves and corners"));
    }
    let mesh = system.mesh(points, frame);
    type Found = (SpectrumEnds, Vec<(&'static str, f64)>, Singularity, Option<dense::Eigenvalues>, Option<SlowModes>);
    let found = py.detach(|| -> Result<Found> {
        let ends = match system.stages.vertices() {
            None => mesh_ends(&mesh.surface, system.scheme)?,
            Some(_) => ends(block)?,
        };
        let rates = if wanted.rates { rates(block, &ends.spectrum())? } else { Vec::new() };
        let verdict = Singularity::detect(&mesh.surface, system.scheme);
        let full = wanted.full.then(|| dense::full_eigenvalues(block)).transpose()?;
        let modes =
            (wanted.modes > 0).then(|| modes(block, SymmetricForm::A, End::Lowest, wanted.modes)).transpose()?;
        Ok((ends, rates, verdict, full, modes))
    });
    let (ends, rates, verdict, full, modes) = found.map_err(|e| raised(py, e))?;
    let told = PyDict::new(py);
    let SpectrumEnds { lambda_min, lambda_max, jacobi_lambda_min, jacobi_lambda_max, .. } = ends;
    let names = ["lambda_min", "lambda_max", "jacobi_lambda_min", "jacobi_lambda_max"];
    let estimates = PyDict::new(py);
    for (name, end) in names.into_iter().zip([lambda_min, lambda_max, jacobi_lambda_min, jacobi_lambda_max]) {
        let Estimate { value, residual, error, source, multiplicity } = end;
        estimates.set_item(name, (value, residual, error, source.name(), multiplicity.map(|m| m.count)))?;
    }
    told.set_item("ends", estimates)?;
    let Spectrum { a, jacobi } = ends.spectrum();
    told.set_item("optimal_omega", [("w-pia", a.optimal_omega()), ("jacobi", jacobi.optimal_omega())])?;
    told.set_item("critical_omega", [("w-pia", a.critical_omega()), ("jacobi", jacobi.critical_omega())])?;
    told.set_item("rho", rates)?;
    told.set_item("singular", verdict.is_singular())?;
    told.set_item("kernel_dimension", verdict.kernel_dimension())?;
    told.set_item("curves", numbers(py, system.stages.curves().eigenvalues()))?;
    if let Some(full) = full {
        told.set_item("eigenvalues", numbers(py, full.a))?;
        told.set_item("jacobi_eigenvalues", numbers(py, full.jacobi))?;
    }
    if let Some(found) = modes {
        let n = system.stages.len();
        let count = found.modes.len();
        told.set_item("mode_eigenvalues", found.modes.iter().map(|mode| mode.eigenvalue.value).collect::<Vec<_>>())?;
        let all = found.modes.into_iter().flat_map(|mode| system.stages.joined(vec![0.0; n], mode.values)).collect();
        // One mode a row.
        told.set_item("modes", row_array(py, count, n, all))?;
    }
    Ok(told)
}

/// Real and imaginary parts.
fn parts<'py>(py: Python<'py>, all: &[Complex<f64>]) -> [Bound<'py, numpy::PyArray1<f64>>; 2] {
    [numbers(py, all.iter().map(|z| z.re).collect()), numbers(py, all.iter().map(|z| z.im).collect())]
}

fn complex<'py>(py: Python<'py>, system: &PySystem, wanted: &Wanted) -> PyResult<Bound<'py, PyDict>> {
    if wanted.modes > 0 {
        return Err(PyValueError::new_err(
            "modes need a symmetric matrix, and darts and semi-sharp vertices leave none",
        ));
    }
    let general = system.general();
    let found = py.detach(|| -> Result<_> {
        let spectrum = if wanted.full { ComplexSpectrum::full(general)? } else { ComplexSpectrum::new(general)? };
        let rates = if wanted.rates { rates(general, &spectrum)? } else { Vec::new() };
        Ok((spectrum, rates))
    });
    let (spectrum, rates) = found.map_err(|e| raised(py, e))?;
    let told = PyDict::new(py);
    let estimates = PyDict::new(py);
    let forms = [("", SymmetricForm::A), ("jacobi_", SymmetricForm::Jacobi)];
    for (prefix, form) in forms {
        let ends = spectrum.ends(form);
        for (name, value) in [("lambda_min", ends.min), ("lambda_max", ends.max)] {
            estimates
                .set_item(format!("{prefix}{name}"), (value, None::<f64>, None::<f64>, "real parts", None::<usize>))?;
        }
        if let Some(all) = spectrum.eigenvalues(form).filter(|_| wanted.full) {
            told.set_item(format!("{prefix}eigenvalues"), parts(py, all))?;
        }
    }
    told.set_item("ends", estimates)?;
    let omegas = |of: fn(&ComplexSpectrum, SymmetricForm) -> f64| {
        [("w-pia", of(&spectrum, SymmetricForm::A)), ("jacobi", of(&spectrum, SymmetricForm::Jacobi))]
    };
    told.set_item("optimal_omega", omegas(Spectra::optimal_omega))?;
    told.set_item("critical_omega", omegas(Spectra::critical_omega))?;
    told.set_item("rho", rates)?;
    Ok(told)
}

/// Splitting matrices of a scheme, at a smooth vertex or at a sharp one, a dictionary a valence.
#[pyfunction]
pub fn splitting<'py>(
    py: Python<'py>,
    valences: Vec<usize>,
    scheme: &str,
    alpha: Option<f64>,
    at: &str,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let scheme = LocalScheme::new(scheme, alpha).map_err(|e| raised(py, e))?;
    let mut kinds = vec![("smooth", None)];
    kinds.extend(SharpVertex::ALL.map(|vertex| (vertex.name(), Some(vertex))));
    match names::find("kind of vertex", at, &kinds, &[]).map_err(|e| raised(py, e))? {
        None => {
            let rows = py.detach(|| rows(scheme, &valences)).map_err(|e| raised(py, e))?;
            let told = rows.into_iter().map(|row| {
                let told = PyDict::new(py);
                let positions: Vec<String> =
                    (0..row.limit_mask.len()).map(|i| scheme.layout().label(row.valence, i)).collect();
                told.set_item("valence", row.valence)?;
                told.set_item("positions", positions)?;
                told.set_item("eigenvalues", parts(py, &row.eigenvalues))?;
                told.set_item("eigenvalue_error", row.eigenvalue_error)?;
                told.set_item("lambda_subdominant", row.lambda_subdominant.re)?;
                told.set_item("lambda_subdominant_formula", row.lambda_subdominant_formula)?;
                told.set_item("limit_mask", numbers(py, row.limit_mask))?;
                told.set_item("limit_mask_error", row.limit_mask_error)?;
                let tangents = row.tangent_masks.map(|[cosine, sine]| [("cosine", cosine), ("sine", sine)]);
                told.set_item("tangent_masks", tangents.map_or_else(Vec::new, Vec::from))?;
                let map = row.map.as_ref();
                told.set_item("regular", map.map(|map| map.regular))?;
                told.set_item("injective", map.map(|map| map.injective))?;
                Ok(told)
            });
            told.collect()
        }
        Some(vertex) => {
            vertex.require_rules(scheme).map_err(|e| raised(py, e))?;
            let rows = py.detach(|| sharp_rows(scheme, vertex, &valences)).map_err(|e| raised(py, e))?;
            let told = rows.into_iter().map(|row| {
                let told = PyDict::new(py);
                told.set_item("valence", row.valence)?;
                told.set_item("positions", row.positions)?;
                told.set_item("eigenvalues", parts(py, &row.eigenvalues))?;
                told.set_item("eigenvalue_error", row.eigenvalue_error)?;
                told.set_item("limit_mask_error", row.limit_mask_error)?;
                let mut masks = row.masks.into_iter();
                told.set_item("limit_mask", masks.next().map(|mask| numbers(py, mask.weights)))?;
                told.set_item("tangent_masks", masks.map(|mask| (mask.name, mask.weights)).collect::<Vec<_>>())?;
                Ok(told)
            });
            told.collect()
        }
    }
}
