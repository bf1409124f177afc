//! Bounds on the spectra of A and D⁻¹A that valences, face sizes and the diagonal alone prove.

use super::csr::Csr;
use crate::parallel;
use crate::schemes::Scheme;

/// Entries of one task.
const CHUNK: usize = 8192;

/// Proven bounds: every eigenvalue of A lies in `[lambda_min, lambda_max]`, every eigenvalue of D⁻¹A in
/// `[jacobi_lambda_min, jacobi_lambda_max]`, D = diag A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralBounds {
    /// A lower bound of the smallest eigenvalue of A. 0 says: non-negative, no more (a vertex of valence 3 under
    /// Catmull-Clark); negative: nothing is proven about the sign.
    pub lambda_min: f64,
    /// An upper bound of the largest eigenvalue of A; of a scheme's matrix the eigenvalue itself, attained by the constant
    /// vector.
    pub lambda_max: f64,
    /// A lower bound of the smallest eigenvalue of D⁻¹A, of the sign of `lambda_min` where that is not negative.
    pub jacobi_lambda_min: f64,
    /// An upper bound of the largest eigenvalue of D⁻¹A.
    pub jacobi_lambda_max: f64,
}

impl SpectralBounds {
    /// Gershgorin's bounds for a matrix with rows that sum to 1, no negative entry and this diagonal:
    /// `λ(A) ≥ min (2a_ii − 1)`, `λ(A) ≤ 1`, `2 − max 1/a_ii ≤ λ(D⁻¹A) ≤ max 1/a_ii`.
    pub fn gershgorin(diagonal: &[f64]) -> Self {
        // Both are attained at the least entry.
        let least = parallel::map(diagonal.len(), CHUNK, |range| diagonal[range].iter().copied().fold(1.0, f64::min));
        let least = least.into_iter().fold(1.0, f64::min);
        let jacobi_lambda_max = 1.0 / least;
        SpectralBounds {
            lambda_min: 2.0 * least - 1.0,
            lambda_max: 1.0,
            jacobi_lambda_min: 2.0 - jacobi_lambda_max,
            jacobi_lambda_max,
        }
    }

    /// Gershgorin's bounds for A = H·M and D⁻¹A, H = diag(h) positive, M any symmetric matrix with a positive diagonal.
    ///
    /// A is similar to S = H^½ M H^½, so its eigenvalues are real and each lies in a disc around some a_ii with the sum
    /// of |entries| beside the diagonal as radius: of the rows of A, of its columns, and of the rows of S alike (S has
    /// the spectrum of both). So of the three, whose radii are `h_i Σ|m_ij|`, `Σ h_j|m_ij|` and `√h_i Σ √h_j|m_ij|`, the
    /// best bound holds on either side. D⁻¹A is similar to Dm^-½ M Dm^-½, Dm = diag M: the same with 1/m_ii for h_i. All
    /// radii are widened by more than rounding can have taken from them. O(entries).
    ///
    /// With h = 1, rows and columns are the same; for rows of A that sum to 1 without a negative entry this is
    /// [`gershgorin`](Self::gershgorin) of the diagonal but for the last digits.
    ///
    /// # Panics
    /// If there is not one weight a row.
    ///
    /// ```
    /// use limitlab::assemble::bounds::SpectralBounds;
    /// use limitlab::assemble::Csr;
    /// use nalgebra_sparse::{CooMatrix, CsrMatrix};
    ///
    /// // −x'' on four points: eigenvalues 2 − 2 cos(kπ/5).
    /// let mut m = CooMatrix::new(4, 4);
    /// for i in 0..4 {
    ///     m.push(i, i, 2.0);
    ///     if i > 0 {
    ///         m.push(i, i - 1, -1.0);
    ///         m.push(i - 1, i, -1.0);
    ///     }
    /// }
    /// let m = Csr::try_from(&CsrMatrix::from(&m))?;
    /// let bounds = SpectralBounds::of_parts(&[1.0; 4], &m);
    /// assert!((bounds.lambda_max - 4.0).abs() < 1e-13 && bounds.lambda_min.abs() < 1e-13);
    /// assert!((bounds.jacobi_lambda_max - 2.0).abs() < 1e-13);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn of_parts(h: &[f64], m: &Csr) -> Self {
        assert_eq!(h.len(), m.len(), "one weight a row");
        let (lambda_min, lambda_max) = discs(h, m);
        let inverse: Vec<f64> = m.diagonal().iter().map(|d| 1.0 / d).collect();
        let (jacobi_lambda_min, jacobi_lambda_max) = discs(&inverse, m);
        SpectralBounds { lambda_min, lambda_max, jacobi_lambda_min, jacobi_lambda_max }
    }

    /// The bounds on a closed mesh. All schemes have `M ⪰ H⁻¹ diag(b)` with b_i = [`Scheme::lambda_min_at`] of the valence,
    /// so `λ(A) ≥ min b_i` and, D being `H diag M`, `λ(D⁻¹A) ≥ min b_i/a_ii`. O(N).
    pub fn closed(scheme: Scheme, valences: &[u32], triangles_only: bool, diagonal: &[f64]) -> Self {
        let mut bounds = Self::gershgorin(diagonal);
        let greatest = valences.iter().copied().max().unwrap_or(0) as usize;
        let at: Vec<f64> = (0..=greatest).map(|n| scheme.lambda_min_at(n, triangles_only)).collect();
        let least = |(a, b): (f64, f64), (c, d): (f64, f64)| (a.min(c), b.min(d));
        let none = (f64::INFINITY, f64::INFINITY);
        let ends = parallel::map(valences.len(), CHUNK, |range| {
            let pairs = valences[range.clone()].iter().zip(&diagonal[range]);
            pairs.map(|(&n, a_ii)| (at[n as usize], at[n as usize] / a_ii)).fold(none, least)
        });
        let (a, jacobi) = ends.into_iter().fold(none, least);
        bounds.lambda_min = a.min(1.0);
        bounds.jacobi_lambda_min = jacobi.min(bounds.jacobi_lambda_max);
        bounds
    }
}

/// The least and the greatest eigenvalue that Gershgorin's discs allow diag(h)·M to have.
fn discs(h: &[f64], m: &Csr) -> (f64, f64) {
    let roots: Vec<f64> = h.iter().map(|h| h.sqrt()).collect();
    let ends = |i: usize| {
        let (mut centre, mut by_row, mut by_column, mut symmetric) = (0.0, 0.0, 0.0, 0.0);
        for (j, value) in m.row(i) {
            if i == j {
                centre = h[i] * value;
            } else {
                by_row += value.abs();
                by_column += h[j] * value.abs();
                symmetric += roots[j] * value.abs();
            }
        }
        let count = m.row(i).len() as f64;
        [h[i] * by_row, by_column, roots[i] * symmetric].map(|radius| {
            let rounding = (count + 8.0) * f64::EPSILON * (radius + centre.abs());
            [centre - radius - rounding, centre + radius + rounding]
        })
    };
    // f64::min and max would drop a NaN.
    let least = |a: f64, b: f64| if a.is_nan() || a <= b { a } else { b };
    let greatest = |a: f64, b: f64| if a.is_nan() || a >= b { a } else { b };
    let none = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let joined = |a: [[f64; 2]; 3], b: [[f64; 2]; 3]| {
        std::array::from_fn(|k| [least(a[k][0], b[k][0]), greatest(a[k][1], b[k][1])])
    };
    let all = parallel::map(m.len(), CHUNK, |range| range.map(ends).fold(none, joined)).into_iter().fold(none, joined);
    let best =
        |end: fn(&[f64; 2]) -> f64, choose: fn(f64, f64) -> f64| all.iter().map(end).reduce(choose).unwrap_or(0.0);
    (best(|e| e[0], f64::max), best(|e| e[1], f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows (a, 1 − a) and (1 − a, a) have the eigenvalues 1 and 2a − 1, and 1/a and 2 − 1/a over their diagonal.
    #[test]
    fn two_rows_attain_the_bounds_of_gershgorin() {
        for a in [0.25, 0.5, 0.75] {
            let bounds = SpectralBounds::gershgorin(&[a, a]);
            let expected = SpectralBounds {
                lambda_min: 2.0 * a - 1.0,
                lambda_max: 1.0,
                jacobi_lambda_min: 2.0 - 1.0 / a,
                jacobi_lambda_max: 1.0 / a,
            };
            assert_eq!(bounds, expected);
            // The least entry decides.
            assert_eq!(SpectralBounds::gershgorin(&[0.8, a, 0.9]), expected);
        }
    }
}
