//! Dense eigenvalues, for systems small enough: the oracle of everything estimated.

use faer::{Mat, Side};
use glam::DVec3;

use crate::assemble::LimitSystem;
use crate::error::{Error, Result};

/// Largest N for which dense eigenvalues are computed: cubic time, about a second here.
pub const LARGEST: usize = 600;

/// All eigenvalues of A and of D⁻¹A, ascending. Both matrices are similar to symmetric ones, so all are real.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigenvalues {
    pub a: Vec<f64>,
    pub jacobi: Vec<f64>,
}

/// O(N³) time, O(N²) memory.
///
/// # Errors
/// If N exceeds [`LARGEST`], or the computation does not converge.
pub fn eigenvalues(system: &LimitSystem) -> Result<Eigenvalues> {
    within_limit(system.len())?;
    let jacobi_scale: Vec<f64> = system.m.diagonal().iter().map(|d| 1.0 / d.sqrt()).collect();
    let a_scale: Vec<f64> = system.h.iter().map(|h| h.sqrt()).collect();
    Ok(Eigenvalues {
        a: symmetric(system, &a_scale)?,
        jacobi: symmetric(system, &jacobi_scale)?,
    })
}

/// The eigenvalues of diag(s) M diag(s), ascending.
fn symmetric(system: &LimitSystem, s: &[f64]) -> Result<Vec<f64>> {
    let n = system.len();
    let mut dense = Mat::<f64>::zeros(n, n);
    for i in 0..n {
        for (j, m) in system.m.row(i) {
            dense[(i, j)] = s[i] * m * s[j];
        }
    }
    dense
        .self_adjoint_eigenvalues(Side::Lower)
        .map_err(|e| Error::Computation(format!("dense eigenvalues: {e:?}")))
}

/// The spectral radius of the error matrix of a linear iteration on `system`, from its action on unit vectors.
/// `start` makes the method for P = 0 and V₀ given, three columns of the matrix at a time.
///
/// # Errors
/// If N exceeds [`LARGEST`], or the computation does not converge.
pub fn spectral_radius(system: &LimitSystem, mut step: impl FnMut(&mut [DVec3])) -> Result<f64> {
    let n = system.len();
    within_limit(n)?;
    let mut dense = Mat::<f64>::zeros(n, n);
    let mut x = vec![DVec3::ZERO; n];
    for first in (0..n).step_by(3) {
        x.fill(DVec3::ZERO);
        for axis in 0..3.min(n - first) {
            x[first + axis][axis] = 1.0;
        }
        step(&mut x);
        for (i, v) in x.iter().enumerate() {
            for axis in 0..3.min(n - first) {
                dense[(i, first + axis)] = v[axis];
            }
        }
    }
    let all = dense
        .eigenvalues()
        .map_err(|e| Error::Computation(format!("dense eigenvalues: {e:?}")))?;
    Ok(all.iter().map(|z| z.norm()).fold(0.0, f64::max))
}

fn within_limit(n: usize) -> Result<()> {
    if n > LARGEST {
        return Err(Error::Computation(format!(
            "dense eigenvalues of {n} vertices: at most {LARGEST} are computed; use the Krylov estimate"
        )));
    }
    Ok(())
}
