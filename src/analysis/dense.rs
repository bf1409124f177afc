//! Dense eigenvalues, for systems small enough: the oracle of everything estimated.

use faer::Mat;
use glam::DVec3;
use limitlab_factorizations::dense;
use nalgebra::Complex;

use super::symmetric::{SymmetricForm, symmetric};
use crate::assemble::{Csr, LimitSystem};
use crate::error::{Error, Result};
use crate::memory::require;
use crate::solvers::System;

/// Largest N for which dense eigenvalues are computed: cubic time, about a second here.
pub const LARGEST: usize = 600;

/// All eigenvalues of A and of D⁻¹A, ascending. Both matrices are similar to symmetric ones, so all are real.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigenvalues {
    /// The N eigenvalues of A.
    pub a: Vec<f64>,
    /// The N eigenvalues of D⁻¹A.
    pub jacobi: Vec<f64>,
}

/// Largest N for which dense eigenvalues are computed when they are asked for by name: about half a minute and
/// 300 MB.
pub const LARGEST_FULL: usize = 4000;

/// Largest N for which all eigenvalues of a matrix that is similar to no symmetric one are computed.
pub const LARGEST_COMPLEX: usize = 2000;

/// O(N³) time, O(N²) memory.
///
/// # Errors
/// If N exceeds [`LARGEST`], or the computation does not converge.
pub fn eigenvalues(system: &LimitSystem) -> Result<Eigenvalues> {
    within_limit(system.len(), LARGEST)?;
    both(system)
}

/// As [`eigenvalues`], up to [`LARGEST_FULL`] vertices.
///
/// # Errors
/// If N exceeds that, or the computation does not converge.
pub fn full_eigenvalues(system: &LimitSystem) -> Result<Eigenvalues> {
    within_limit(system.len(), LARGEST_FULL)?;
    both(system)
}

fn both(system: &LimitSystem) -> Result<Eigenvalues> {
    Ok(Eigenvalues {
        a: values(&symmetric(system, SymmetricForm::A))?,
        jacobi: values(&symmetric(system, SymmetricForm::Jacobi))?,
    })
}

/// The eigenvalues of a matrix that is similar to no symmetric one, unsorted. O(N³) time, O(N²) memory.
///
/// # Errors
/// If N exceeds [`LARGEST_COMPLEX`], or the computation does not converge.
pub fn complex_eigenvalues(a: &Csr) -> Result<Vec<Complex<f64>>> {
    within_limit(a.len(), LARGEST_COMPLEX)?;
    unsymmetric_values(&to_dense(a))
}

/// The eigenvalues of a full matrix, unsorted.
///
/// # Errors
/// If the computation does not converge.
pub(super) fn unsymmetric_values(matrix: &Mat<f64>) -> Result<Vec<Complex<f64>>> {
    dense::eigenvalues(matrix).map_err(|e| Error::Computation(format!("dense eigenvalues: {e:?}")))
}

fn values(s: &Csr) -> Result<Vec<f64>> {
    dense::self_adjoint_eigenvalues(&to_dense(s)).map_err(|e| Error::Computation(format!("dense eigenvalues: {e:?}")))
}

/// All eigenvalues, ascending, and the unit eigenvectors of the symmetric matrix `s`.
///
/// # Errors
/// If N exceeds [`LARGEST_FULL`], or the computation does not converge.
pub fn eigenpairs(s: &Csr) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    within_limit(s.len(), LARGEST_FULL)?;
    let eigen = dense::self_adjoint_eigen(&to_dense(s))
        .map_err(|e| Error::Computation(format!("dense eigenvectors: {e:?}")))?;
    let n = s.len();
    let values = (0..n).map(|j| eigen.S().column_vector()[j]).collect();
    let vectors = (0..n).map(|j| (0..n).map(|i| eigen.U()[(i, j)]).collect()).collect();
    Ok((values, vectors))
}

/// The solution V of `A V = P` by Gaussian elimination with partial pivoting on the full matrix, as the papers solve
/// Nasri's system. O(N³) time, 8N² bytes. Not finite where A is singular.
///
/// # Panics
/// If there is not one point a vertex.
pub fn gaussian_elimination(system: &LimitSystem, points: &[DVec3]) -> Vec<DVec3> {
    assert_eq!(points.len(), system.len(), "one point a vertex");
    let mut v = Mat::from_fn(points.len(), 3, |i, axis| points[i][axis]);
    dense::solve(&to_dense(&system.a), v.as_mut());
    (0..points.len()).map(|i| DVec3::new(v[(i, 0)], v[(i, 1)], v[(i, 2)])).collect()
}

fn to_dense(s: &Csr) -> Mat<f64> {
    let mut dense = Mat::<f64>::zeros(s.len(), s.len());
    for i in 0..s.len() {
        for (j, v) in s.row(i) {
            dense[(i, j)] = v;
        }
    }
    dense
}

/// The spectral radius of the error matrix of a linear iteration on `system`, from its action on unit vectors.
/// `start` makes the method for P = 0 and V₀ given, three columns of the matrix at a time.
///
/// # Errors
/// If N exceeds [`LARGEST`], or the computation does not converge.
pub fn spectral_radius(system: &impl System, mut step: impl FnMut(&mut [DVec3])) -> Result<f64> {
    let n = system.len();
    within_limit(n, LARGEST)?;
    let Some(dense) = columns(n, &mut step)? else { return Ok(f64::INFINITY) };
    Ok(unsymmetric_values(&dense)?.iter().map(|z| z.norm()).fold(0.0, f64::max))
}

/// The N × N matrix of a linear map, three columns at a time from its action on unit vectors; `None` if an entry is not finite.
///
/// # Errors
/// If memory has no room for it.
pub(super) fn columns(n: usize, step: &mut dyn FnMut(&mut [DVec3])) -> Result<Option<Mat<f64>>> {
    require(8 * (n * n) as u64, || format!("a dense matrix of order {n}"), "use a coarser mesh")?;
    let mut dense = Mat::<f64>::zeros(n, n);
    let mut x = vec![DVec3::ZERO; n];
    for first in (0..n).step_by(3) {
        x.fill(DVec3::ZERO);
        for axis in 0..3.min(n - first) {
            x[first + axis][axis] = 1.0;
        }
        step(&mut x);
        if !x.iter().all(|v| v.is_finite()) {
            return Ok(None);
        }
        for (i, v) in x.iter().enumerate() {
            for axis in 0..3.min(n - first) {
                dense[(i, first + axis)] = v[axis];
            }
        }
    }
    Ok(Some(dense))
}

fn within_limit(n: usize, limit: usize) -> Result<()> {
    if n > limit {
        return Err(Error::Computation(format!(
            "dense eigenvalues of {n} vertices: at most {limit} are computed; use a coarser mesh, or the extreme \
             eigenvalues, which have no such limit"
        )));
    }
    Ok(())
}
