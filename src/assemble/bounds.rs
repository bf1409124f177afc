//! Bounds on the spectrum of A that valences, face sizes and the diagonal alone prove.

use super::scheme::{Scheme, loop_beta, sqrt3_beta};

/// Proven bounds: every eigenvalue of A lies in `[lambda_min, lambda_max]`, every eigenvalue of D⁻¹A is at most
/// `jacobi_lambda_max`, D = diag A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralBounds {
    /// A lower bound of the smallest eigenvalue of A. 0 says: non-negative, no more (a vertex of valence 3 under
    /// Catmull-Clark); negative: nothing is proven about the sign.
    pub lambda_min: f64,
    /// The largest eigenvalue of A, attained by the constant vector.
    pub lambda_max: f64,
    /// An upper bound of the largest eigenvalue of D⁻¹A.
    pub jacobi_lambda_max: f64,
}

impl SpectralBounds {
    /// Gershgorin's bounds for a matrix with rows that sum to 1, no negative entry and this diagonal:
    /// `λ(A) ≥ min (2a_ii − 1)`, `λ(A) ≤ 1`, `λ(D⁻¹A) ≤ max 1/a_ii`.
    pub fn gershgorin(diagonal: &[f64]) -> Self {
        SpectralBounds {
            lambda_min: diagonal.iter().map(|a| 2.0 * a - 1.0).fold(1.0, f64::min),
            lambda_max: 1.0,
            jacobi_lambda_max: diagonal.iter().map(|a| 1.0 / a).fold(1.0, f64::max),
        }
    }
}

/// A lower bound of λ_min(A) on a closed mesh, from its valences.
///
/// Catmull-Clark: `min (n−3)/(n+5)`, from the quadratic form
/// `xᵀMx = Σ_F (4/|F|)(Σ_{i∈F} x_i)² + 2 Σ_ij (x_i+x_j)² + Σ n(n−3) x_i²`. Loop and √3: `min (3β_n − 1)/2`.
/// Nasri: the face circulants have the eigenvalues 1, ½, ½, ¼, …, so ¼, and ½ where all faces are triangles.
/// Zheng-Cai: ½. O(N).
pub fn lambda_min_bound(scheme: Scheme, valences: &[u32], triangles_only: bool) -> f64 {
    let over_valences = |bound: fn(usize) -> f64| {
        valences
            .iter()
            .map(|&n| bound(n as usize))
            .fold(1.0, f64::min)
    };
    match scheme {
        Scheme::CatmullClark => over_valences(|n| (n as f64 - 3.0) / (n as f64 + 5.0)),
        Scheme::Loop => over_valences(|n| 0.5 * (3.0 * loop_beta(n) - 1.0)),
        Scheme::Sqrt3 => over_valences(|n| 0.5 * (3.0 * sqrt3_beta(n) - 1.0)),
        Scheme::Nasri if triangles_only => 0.5,
        Scheme::Nasri => 0.25,
        Scheme::ZhengCai => 0.5,
    }
}
