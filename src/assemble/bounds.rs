//! Bounds on the spectra of A and D⁻¹A that valences, face sizes and the diagonal alone prove.

use rayon::prelude::*;

use super::scheme::{Scheme, loop_beta, sqrt3_beta};

/// Entries of one task.
const CHUNK: usize = 8192;

/// Proven bounds: every eigenvalue of A lies in `[lambda_min, lambda_max]`, every eigenvalue of D⁻¹A in
/// `[jacobi_lambda_min, jacobi_lambda_max]`, D = diag A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralBounds {
    /// A lower bound of the smallest eigenvalue of A. 0 says: non-negative, no more (a vertex of valence 3 under
    /// Catmull-Clark); negative: nothing is proven about the sign.
    pub lambda_min: f64,
    /// The largest eigenvalue of A, attained by the constant vector.
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
        let least = diagonal.par_iter().with_min_len(CHUNK).copied().reduce(|| 1.0, f64::min);
        let jacobi_lambda_max = 1.0 / least;
        SpectralBounds {
            lambda_min: 2.0 * least - 1.0,
            lambda_max: 1.0,
            jacobi_lambda_min: 2.0 - jacobi_lambda_max,
            jacobi_lambda_max,
        }
    }

    /// The bounds on a closed mesh. All schemes have `M ⪰ H⁻¹ diag(b)` with b_i = [`lambda_min_at`] of the valence,
    /// so `λ(A) ≥ min b_i` and, D being `H diag M`, `λ(D⁻¹A) ≥ min b_i/a_ii`. O(N).
    pub fn closed(scheme: Scheme, valences: &[u32], triangles_only: bool, diagonal: &[f64]) -> Self {
        let mut bounds = Self::gershgorin(diagonal);
        let greatest = valences.iter().copied().max().unwrap_or(0) as usize;
        let at: Vec<f64> = (0..=greatest).map(|n| lambda_min_at(scheme, n, triangles_only)).collect();
        let (a, jacobi) = valences
            .par_iter()
            .zip(diagonal)
            .with_min_len(CHUNK)
            .map(|(&n, a_ii)| (at[n as usize], at[n as usize] / a_ii))
            .reduce(|| (f64::INFINITY, f64::INFINITY), |(a, b), (c, d)| (a.min(c), b.min(d)));
        bounds.lambda_min = a.min(1.0);
        bounds.jacobi_lambda_min = jacobi.min(bounds.jacobi_lambda_max);
        bounds
    }
}

/// What a vertex of valence n ≥ 3 allows λ_min(A) to be on a closed mesh.
///
/// Catmull-Clark: `(n−3)/(n+5)`, from the quadratic form
/// `xᵀMx = Σ_F (4/|F|)(Σ_{i∈F} x_i)² + 2 Σ_ij (x_i+x_j)² + Σ n(n−3) x_i²`. Loop and √3: `(3β_n − 1)/2`.
/// Nasri: the face circulants have the eigenvalues 1, ½, ½, ¼, …, so ¼, and ½ where all faces are triangles.
/// Zheng-Cai: ½.
pub fn lambda_min_at(scheme: Scheme, n: usize, triangles_only: bool) -> f64 {
    match scheme {
        Scheme::CatmullClark => (n as f64 - 3.0) / (n as f64 + 5.0),
        Scheme::Loop => 0.5 * (3.0 * loop_beta(n) - 1.0),
        Scheme::Sqrt3 => 0.5 * (3.0 * sqrt3_beta(n) - 1.0),
        Scheme::Nasri if triangles_only => 0.5,
        Scheme::Nasri => 0.25,
        Scheme::ZhengCai => 0.5,
    }
}

/// What λ_min(A) usually is, or a little less: 0.086 to 0.111 under Catmull-Clark, 0.205 to 0.25 under Loop, 0.186 to
/// 0.222 under √3 (`spectrum` on irregular meshes of 20 000 vertices and on tori). Nothing is proven by it. The other
/// schemes have their proven bound.
pub fn usual_lambda_min(scheme: Scheme) -> f64 {
    match scheme {
        Scheme::CatmullClark => 0.085,
        Scheme::Loop => 0.2,
        Scheme::Sqrt3 => 0.18,
        Scheme::Nasri => 0.25,
        Scheme::ZhengCai => 0.5,
    }
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
