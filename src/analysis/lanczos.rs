//! Extreme eigenvalues of symmetric operators by the Lanczos process.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::error::{Error, Result};

/// A Ritz value with the bound on its distance from an eigenvalue: ‖S x − λ x‖₂ of its unit Ritz vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ritz {
    pub value: f64,
    pub residual: f64,
    /// The squared part that the start vector has in the Ritz vector.
    pub weight: f64,
}

/// When the Lanczos process ends.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Residual of both extreme Ritz values at which to stop.
    pub tolerance: f64,
    pub max_steps: usize,
}

/// The smallest and largest Ritz value of the symmetric operator `apply` (y ← S x) from the start `x`, among those
/// in which the start takes part with weight ≥ `least_weight`.
///
/// Plain three-term recurrence, three vectors: lost orthogonality repeats converged Ritz values but does not
/// falsify extreme ones. Multiplicities are not found. The projected problem is solved each time the steps have
/// grown by a quarter.
///
/// # Errors
/// A start that is zero or not finite, or a projected problem whose eigenvalues do not converge.
pub fn extremes(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    start: Vec<f64>,
    limits: Limits,
    least_weight: f64,
) -> Result<(Ritz, Ritz)> {
    let n = start.len();
    let mut v = start;
    let norm = norm2(&v);
    if !(norm > 0.0 && norm.is_finite()) {
        return Err(Error::Computation(
            "the start of the Lanczos process must be finite and not zero".into(),
        ));
    }
    v.iter_mut().for_each(|x| *x /= norm);
    let mut before = vec![0.0; n];
    let mut w = vec![0.0; n];
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut next_check = 8;
    loop {
        apply(&v, &mut w);
        let beta_before = betas.last().copied().unwrap_or(0.0);
        let alpha: f64 = dot(&w, &v);
        for ((w, v), b) in w.iter_mut().zip(&v).zip(&before) {
            *w -= alpha * v + beta_before * b;
        }
        alphas.push(alpha);
        let beta = norm2(&w);
        betas.push(beta);
        let steps = alphas.len();
        // An invariant subspace: rounding leaves β at a few ε of the operator's norm.
        let closed = beta <= 1e-14 * alphas.iter().fold(0.0f64, |m, a| m.max(a.abs()));
        if steps >= next_check || closed || steps == limits.max_steps || steps == n {
            next_check = steps + steps.div_ceil(4);
            let (low, high) = projected(&alphas, &betas, least_weight)?;
            let settled = low.residual.max(high.residual) <= limits.tolerance;
            if settled || closed || steps >= limits.max_steps {
                return Ok((low, high));
            }
        }
        std::mem::swap(&mut before, &mut v);
        std::mem::swap(&mut v, &mut w);
        v.iter_mut().for_each(|x| *x /= beta);
    }
}

/// The extreme eigenvalues of the tridiagonal matrix so far.
fn projected(alphas: &[f64], betas: &[f64], least_weight: f64) -> Result<(Ritz, Ritz)> {
    let k = alphas.len();
    let mut t = DMatrix::zeros(k, k);
    for i in 0..k {
        t[(i, i)] = alphas[i];
        if i + 1 < k {
            t[(i, i + 1)] = betas[i];
            t[(i + 1, i)] = betas[i];
        }
    }
    let eigen = SymmetricEigen::try_new(t, f64::EPSILON, 200 * k).ok_or_else(|| {
        Error::Computation("the eigenvalues of a projected matrix did not converge".into())
    })?;
    let ritz = |j: usize| Ritz {
        value: eigen.eigenvalues[j],
        residual: betas[k - 1] * eigen.eigenvectors[(k - 1, j)].abs(),
        weight: eigen.eigenvectors[(0, j)].powi(2),
    };
    let mut all: Vec<Ritz> = (0..k)
        .map(ritz)
        .filter(|r| r.weight >= least_weight)
        .collect();
    all.sort_by(|a, b| a.value.total_cmp(&b.value));
    match (all.first(), all.last()) {
        (Some(&low), Some(&high)) => Ok((low, high)),
        _ => Err(Error::Computation(
            "no Ritz value has the least weight asked for".into(),
        )),
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm2(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(values: &[f64]) -> impl FnMut(&[f64], &mut [f64]) {
        move |x, y| {
            for ((y, x), d) in y.iter_mut().zip(x).zip(values) {
                *y = d * x;
            }
        }
    }

    const LIMITS: Limits = Limits {
        tolerance: 1e-9,
        max_steps: 300,
    };

    #[test]
    fn finds_both_ends_of_a_known_spectrum() {
        let values: Vec<f64> = (0..=400).map(|i| 0.1 + 0.9 * i as f64 / 400.0).collect();
        let start = (0..=400).map(|i| 1.0 + (i % 7) as f64).collect();
        let (low, high) = extremes(diagonal(&values), start, LIMITS, 0.0).expect("a good start");
        assert!((high.value - 1.0).abs() < 1e-12, "{high:?}");
        assert!((low.value - 0.1).abs() < 1e-12, "{low:?}");
    }

    #[test]
    fn sees_only_what_the_start_excites() {
        let values = [0.1, 0.2, 0.5, 0.7, 3.0];
        let start = vec![0.0, 1.0, 1.0, 1.0, 0.0];
        let (low, high) = extremes(diagonal(&values), start, LIMITS, 1e-20).expect("a good start");
        assert!((low.value - 0.2).abs() < 1e-12 && (high.value - 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_zero_start_is_an_error() {
        assert!(extremes(diagonal(&[1.0, 2.0]), vec![0.0; 2], LIMITS, 0.0).is_err());
    }
}
