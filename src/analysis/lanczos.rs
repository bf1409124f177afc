//! Extreme eigenvalues of a sparse symmetric matrix, or of one that is self-adjoint in a weighted inner product, by
//! the Lanczos process, in three vectors.
//!
//! One vector's Krylov space needs far fewer products for an extreme value than a block, but shows a multiple
//! eigenvalue once: [`subspace_iteration`](super::subspace_iteration) has the multiplicities and the vectors.

use std::ops::Range;

use super::symmetric::SymmetricForm;
use super::tridiagonal::Tridiagonal;
use crate::assemble::Csr;
use crate::error::{Error, Result};
use crate::parallel;
use crate::solvers::system::{STRIP, System};

/// A Ritz value with what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ritz {
    /// θ, an eigenvalue of the projected tridiagonal matrix; within the spectrum but for rounding.
    pub value: f64,
    /// ‖S x − λ x‖₂ of its unit Ritz vector x: an eigenvalue lies within this distance.
    pub residual: f64,
    /// The estimated error of the value as an end of the spectrum: min over the Ritz values θ_j next to it of
    /// `|θ_j − θ| + r²/|θ_{j+1} − θ|`, the width of the cluster that θ belongs to and the error of that cluster
    /// (Temple, Kato); at most the residual.
    pub error: f64,
    /// The squared part that the start vector has in the Ritz vector.
    pub weight: f64,
}

/// When the Lanczos process ends, and what counts.
#[derive(Clone, Copy, Debug)]
pub struct LanczosLimits {
    /// Relative accuracy T of the values looked at: error ≤ T|θ|, residual ≤ 10 T|θ|, and θ moved by no more than
    /// T|θ| while the steps grew by an eighth, and at least eight. (The residual keeps a group of nearly equal
    /// values, which the error estimate takes for one, from passing as its mean.)
    pub tolerance: f64,
    /// Lanczos steps at most, of one product with S each.
    pub max_steps: usize,
    /// Ritz values in which the start takes part with less weight do not count.
    pub least_weight: f64,
    /// Which ends need that accuracy.
    pub ends: Wanted,
}

/// The ends that a process waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The least eigenvalue alone.
    Lowest,
    /// The greatest eigenvalue alone.
    Highest,
    /// The least and the greatest eigenvalue.
    Both,
}

/// The result of a Lanczos process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LanczosRun {
    /// The least Ritz value of sufficient weight.
    pub low: Ritz,
    /// The greatest Ritz value of sufficient weight.
    pub high: Ritz,
    /// Products with S.
    pub steps: usize,
    /// Whether the accuracy asked for was reached within the steps allowed.
    pub converged: bool,
}

/// Rows of a task; sums are taken chunk by chunk in their order, whatever the number of threads.
const CHUNK: usize = 4096;
/// Ritz values beside an extreme one that its error estimate looks at.
const NEIGHBOURS: usize = 24;

/// A matrix B that is self-adjoint in the inner product `Σ g_i x_i y_i`.
pub trait SelfAdjoint: Sync {
    /// The order N of the matrix.
    fn len(&self) -> usize;

    /// Whether the matrix has no rows.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// g_i > 0.
    fn weight(&self, i: usize) -> f64;

    /// Sums over x that the rows of one whole product share; none unless the matrix has some.
    fn prepare(&self, _x: &[f64], _shared: &mut Vec<f64>) {}

    /// `out[k]` becomes (B x)_i of the k-th row i of `rows`; `shared` comes from [`prepare`](Self::prepare).
    fn product(&self, rows: Range<usize>, x: &[f64], shared: &[f64], out: &mut [f64]);
}

/// A symmetric matrix: all weights are 1.
impl SelfAdjoint for Csr {
    fn len(&self) -> usize {
        Csr::len(self)
    }

    fn weight(&self, _i: usize) -> f64 {
        1.0
    }

    fn product(&self, rows: Range<usize>, x: &[f64], _shared: &[f64], out: &mut [f64]) {
        for (out, i) in out.iter_mut().zip(rows) {
            *out = self.row_times(i, x);
        }
    }
}

/// A, self-adjoint with the weights 1/h_i, or D⁻¹A, with m_ii = a_ii/h_i.
#[derive(Debug)]
pub struct Matrix<'a, T> {
    /// Gives the products with A, the diagonal of A and the weights h_i.
    pub system: &'a T,
    /// Whether the matrix is A or D⁻¹A.
    pub which: SymmetricForm,
}

impl<T: System> SelfAdjoint for Matrix<'_, T> {
    fn len(&self) -> usize {
        self.system.weights().len()
    }

    #[inline]
    fn weight(&self, i: usize) -> f64 {
        let h = self.system.weights()[i];
        match self.which {
            SymmetricForm::A => 1.0 / h,
            SymmetricForm::Jacobi => self.system.diagonal()[i] / h,
        }
    }

    fn prepare(&self, x: &[f64], shared: &mut Vec<f64>) {
        self.system.prepare(x, shared);
    }

    fn product(&self, rows: Range<usize>, x: &[f64], shared: &[f64], out: &mut [f64]) {
        self.system.product(rows.clone(), x, shared, out);
        if self.which == SymmetricForm::Jacobi {
            for (out, a) in out.iter_mut().zip(&self.system.diagonal()[rows]) {
                *out /= a;
            }
        }
    }
}

/// The Rayleigh quotient of x and the residual of x/‖x‖, in the inner product of `s`.
pub fn rayleigh(s: &impl SelfAdjoint, x: &[f64]) -> (f64, f64) {
    let mut shared = Vec::new();
    s.prepare(x, &mut shared);
    // Σ g x², Σ g x·Bx and Σ g (Bx)² would lose half of the residual's digits, so B x is kept.
    let mut image = vec![0.0; s.len()];
    parallel::chunks(&mut image, CHUNK, |first, image| {
        s.product(first..first + image.len(), x, &shared, image);
    });
    let parts = parallel::map(s.len(), CHUNK, |range| {
        let (mut square, mut product) = (0.0, 0.0);
        for i in range {
            let (g, x, y) = (s.weight(i), x[i], image[i]);
            square += g * x * x;
            product += g * x * y;
        }
        (square, product)
    });
    let (square, product) = parts.iter().fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    let value = product / square;
    let parts = parallel::map(s.len(), CHUNK, |range| -> f64 {
        range.map(|i| s.weight(i) * (image[i] - value * x[i]).powi(2)).sum()
    });
    let rest: f64 = parts.iter().sum();
    (value, (rest / square).sqrt())
}

/// The smallest and largest Ritz value of `s` from the start `x`.
///
/// Plain three-term recurrence: lost orthogonality repeats converged Ritz values but does not falsify extreme ones
/// (Paige 1976). The projected problem is looked at each time the steps have grown by an eighth, and at least eight;
/// values must have stood still since the last look.
///
/// # Errors
/// A start that is zero or not finite.
pub fn extremes(s: &impl SelfAdjoint, start: Vec<f64>, limits: LanczosLimits) -> Result<LanczosRun> {
    let n = start.len();
    let mut v = start;
    // The vectors are kept as they come, each with its norm.
    let mut norm = weighted_norm(s, &v);
    if !(norm > 0.0 && norm.is_finite()) {
        return Err(Error::Computation("the start of the Lanczos process must be finite and not zero".into()));
    }
    let mut w = vec![0.0; n];
    let mut norm_before = f64::INFINITY;
    let mut shared = Vec::new();
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut next_check = 8;
    let mut before: Option<(f64, f64)> = None;
    loop {
        // w holds the vector before v.
        s.prepare(&v, &mut shared);
        let alpha = product(s, (&v, norm), (&mut w, norm_before), &shared);
        let beta = orthogonalize(s, (&v, norm), &mut w, alpha);
        alphas.push(alpha);
        betas.push(beta);
        if !beta.is_finite() {
            return Err(Error::Computation("the matrix holds entries that are not finite".into()));
        }
        let steps = alphas.len();
        let scale = alphas.iter().fold(0.0f64, |m, a| m.max(a.abs()));
        // An invariant subspace: rounding leaves β at a few ε of the operator's norm.
        let closed = beta <= 1e-14 * scale;
        if steps >= next_check || closed || steps == limits.max_steps || steps == n {
            next_check = steps + steps.div_ceil(8).max(8);
            let (low, high) = projected(&alphas, &betas, limits.least_weight)?;
            let good = |r: Ritz, old: f64| {
                let allowed = (limits.tolerance * r.value.abs()).max(8.0 * f64::EPSILON * scale);
                r.error <= allowed
                    && r.residual <= (10.0 * allowed).max(1e-13 * scale)
                    && (r.value - old).abs() <= allowed
            };
            let settled = before.is_some_and(|(l, h)| {
                (limits.ends == Wanted::Highest || good(low, l)) && (limits.ends == Wanted::Lowest || good(high, h))
            });
            let run = LanczosRun { low, high, steps, converged: settled || closed };
            if run.converged || steps >= limits.max_steps {
                return Ok(run);
            }
            before = Some((low.value, high.value));
        }
        std::mem::swap(&mut v, &mut w);
        (norm_before, norm) = (norm, beta);
    }
}

/// `w ← B v − β u` for the unit vectors v and u along `v` and `w`, β = ‖`v`‖, and the inner product of v and w, in
/// one pass.
fn product(s: &impl SelfAdjoint, (v, norm): (&[f64], f64), (w, norm_before): (&mut [f64], f64), shared: &[f64]) -> f64 {
    // In the first step there is no vector before, and its norm is infinite.
    let (unit, back) = (1.0 / norm, norm / norm_before);
    let mut parts = vec![0.0; w.len().div_ceil(CHUNK)];
    parallel::chunks_with(w, CHUNK, &mut parts, |first, w, dot| {
        let mut image = [0.0; STRIP];
        for (k, w) in w.chunks_mut(STRIP).enumerate() {
            let rows = first + k * STRIP..first + k * STRIP + w.len();
            let image = &mut image[..w.len()];
            s.product(rows.clone(), v, shared, image);
            for ((i, w), image) in rows.zip(w).zip(image) {
                let new = unit * *image - back * *w;
                *dot += s.weight(i) * new * (unit * v[i]);
                *w = new;
            }
        }
    });
    parts.iter().sum()
}

/// `w ← w − α v` for the unit vector v along `v`, and the norm of w, in one pass.
fn orthogonalize(s: &impl SelfAdjoint, (v, norm): (&[f64], f64), w: &mut [f64], alpha: f64) -> f64 {
    let step = alpha / norm;
    let mut parts = vec![0.0; w.len().div_ceil(CHUNK)];
    parallel::chunks_with(w, CHUNK, &mut parts, |first, w, square| {
        for ((i, w), v) in (first..).zip(w).zip(&v[first..]) {
            *w -= step * v;
            *square += s.weight(i) * *w * *w;
        }
    });
    parts.iter().sum::<f64>().sqrt()
}

/// The extreme eigenvalues of the tridiagonal matrix so far.
fn projected(alphas: &[f64], betas: &[f64], least_weight: f64) -> Result<(Ritz, Ritz)> {
    let k = alphas.len();
    let t = Tridiagonal { alphas, betas: &betas[..k - 1] };
    let end = |from_below: bool| {
        let index = |j: usize| if from_below { j } else { k - 1 - j };
        for j in 0..k {
            let value = t.eigenvalue(index(j));
            let ends = t.vector_ends(value);
            let weight = ends.first.powi(2);
            if weight < least_weight {
                continue;
            }
            let residual = betas[k - 1] * ends.last.abs();
            let mut error = residual;
            let mut width = 0.0;
            for next in j + 1..(j + 1 + NEIGHBOURS).min(k) {
                let gap = (t.eigenvalue(index(next)) - value).abs();
                if width >= error {
                    break;
                }
                error = error.min(width + residual * residual / gap);
                width = gap;
            }
            return Ok(Ritz { value, residual, error, weight });
        }
        Err(Error::Computation("no Ritz value has the least weight asked for".into()))
    };
    Ok((end(true)?, end(false)?))
}

fn weighted_norm(s: &impl SelfAdjoint, x: &[f64]) -> f64 {
    let parts = parallel::map(x.len(), CHUNK, |range| -> f64 { range.map(|i| s.weight(i) * x[i] * x[i]).sum() });
    parts.iter().sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::assemble::csr::Pattern;

    fn diagonal(values: &[f64]) -> Csr {
        let n = values.len() as u32;
        let pattern = Pattern::new((0..=n).collect(), (0..n).collect());
        Csr::new(Arc::new(pattern), values.to_vec())
    }

    const LIMITS: LanczosLimits =
        LanczosLimits { tolerance: 1e-12, max_steps: 300, least_weight: 0.0, ends: Wanted::Both };

    #[test]
    fn finds_both_ends_of_a_known_spectrum() {
        let values: Vec<f64> = (0..=400).map(|i| 0.1 + 0.9 * i as f64 / 400.0).collect();
        let start = (0..=400).map(|i| 1.0 + (i % 7) as f64).collect();
        let run = extremes(&diagonal(&values), start, LIMITS).expect("a good start");
        assert!(run.converged);
        assert!((run.high.value - 1.0).abs() < 1e-12, "{run:?}");
        assert!((run.low.value - 0.1).abs() < 1e-12, "{run:?}");
    }

    #[test]
    fn the_error_estimate_covers_the_error_before_convergence() {
        let values: Vec<f64> = (0..4000).map(|i| (i as f64 / 4000.0).powi(2)).collect();
        let start: Vec<f64> = (0..4000).map(|i| 1.0 + (i % 7) as f64).collect();
        for max_steps in [40, 80, 160, 320, 640] {
            let limits = LanczosLimits { max_steps, tolerance: 1e-15, ..LIMITS };
            let run = extremes(&diagonal(&values), start.clone(), limits).expect("a good start");
            assert!(run.low.residual >= run.low.error);
            // The lowest eigenvalue is 0: the value is its error.
            assert!(run.low.value <= run.low.error, "{run:?}");
        }
    }

    /// By the definition, from all eigenvalues and vectors of the projected matrix.
    #[test]
    fn the_error_estimate_is_the_least_of_the_clusters() {
        use nalgebra::{DMatrix, SymmetricEigen};
        let mut wider = 0;
        // Two values near 0, a third one far away, and a residual that is larger than the distance of the two.
        let pairs = [1.0, -1.0]
            .into_iter()
            .flat_map(|far| [1e-2, 1e-3, 1e-5].map(|near| (vec![far, 0.0, 0.0], vec![near, near, 10.0 * near])));
        let wave = |i: usize| (1.7 * i as f64).sin();
        let others = (3..20).map(|k| ((0..k).map(wave).collect(), (k..2 * k).map(|i| 0.2 + 0.1 * wave(i)).collect()));
        for (alphas, betas) in pairs.chain(others) {
            let (alphas, betas): (Vec<f64>, Vec<f64>) = (alphas, betas);
            let k = alphas.len();
            let dense = DMatrix::from_fn(k, k, |i, j| match i.abs_diff(j) {
                0 => alphas[i],
                1 => betas[i.min(j)],
                _ => 0.0,
            });
            let eigen = SymmetricEigen::new(dense);
            let mut pairs: Vec<(f64, f64)> =
                (0..k).map(|j| (eigen.eigenvalues[j], eigen.eigenvectors[(k - 1, j)])).collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (low, high) = projected(&alphas, &betas, 0.0).expect("values");
            for (found, from_above) in [(low, false), (high, true)] {
                if from_above {
                    pairs.reverse();
                }
                let (value, last) = pairs[0];
                let residual = betas[k - 1] * last.abs();
                let away = |j: usize| (pairs[j].0 - value).abs();
                let clusters = (0..k - 1).map(|j| away(j) + residual * residual / away(j + 1));
                let error = clusters.fold(residual, f64::min);
                assert!((found.value - value).abs() < 1e-12 && (found.residual - residual).abs() < 1e-9);
                assert!((found.error - error).abs() < 1e-9, "{k}: {} instead of {error}", found.error);
                wider += usize::from(error < residual && error < residual * residual / away(1));
            }
        }
        assert!(wider > 2, "{wider} clusters of more than one value");
    }

    #[test]
    fn sees_only_what_the_start_excites() {
        let start = vec![0.0, 1.0, 1.0, 1.0, 0.0];
        let limits = LanczosLimits { least_weight: 1e-20, ..LIMITS };
        let run = extremes(&diagonal(&[0.1, 0.2, 0.5, 0.7, 3.0]), start, limits).expect("a start");
        assert!((run.low.value - 0.2).abs() < 1e-12 && (run.high.value - 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_zero_start_is_an_error() {
        assert!(extremes(&diagonal(&[1.0, 2.0]), vec![0.0; 2], LIMITS).is_err());
    }
}
