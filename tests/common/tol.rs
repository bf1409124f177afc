//! The tolerances of the tests, in one place. Each says what it allows for.

use limitlab::assemble::LimitSystem;

const EPS: f64 = f64::EPSILON;

/// Sums of `terms` products of numbers of size 1, in two orders.
pub fn rounding(terms: usize) -> f64 {
    4.0 * (terms + 4) as f64 * EPS
}

/// Eigenvalues of size `norm` of a dense symmetric matrix of order `n`: backward stable, with room for the
/// rounding of its entries.
pub fn eigenvalues(n: usize, norm: f64) -> f64 {
    8.0 * (n + 16) as f64 * EPS * norm
}

/// Two runs of a relaxation from one start, after `iterations` steps on points of size `scale`: each step rounds
/// anew, and contracting steps do not amplify.
pub fn iterates(iterations: usize, scale: f64) -> f64 {
    64.0 * (iterations + 4) as f64 * EPS * scale
}

/// Two runs of conjugate gradients on points of size `scale`: differences of rounding grow while Ritz values converge,
/// at most to √ε before the directions lose their orthogonality altogether (Paige 1980).
pub fn krylov(scale: f64) -> f64 {
    EPS.sqrt() * scale
}

/// Points of size 1 by weights in single precision, after a few steps.
pub const SINGLE: f64 = 1e-6;

/// Rates fitted to histories of tens to hundreds of iterations.
pub const RATE: f64 = 5e-3;

/// Solutions and residuals of runs stopped at 10⁻¹⁰ of the diagonal: far above that, far below what is told apart.
pub const SOLVED: f64 = 1e-8;

/// Ends of spectra by Lanczos.
pub const ESTIMATE: f64 = 1e-6;

/// How far V may be from the solution if max_i ‖e_i‖ ≤ `error`. With e = A d and A similar to H^½MH^½, ‖H^-½d‖₂ ≤
/// ‖H^-½e‖₂/λ_min, so max_i ‖d_i‖ ≤ √(h_max/h_min)·√N·error/λ_min. `scale` is the size of the points, whose
/// rounding counts as an error.
pub fn solution(system: &LimitSystem, lambda_min: f64, error: f64, scale: f64) -> f64 {
    let h_max = system.h.iter().copied().fold(0.0, f64::max);
    let h_min = system.h.iter().copied().fold(f64::INFINITY, f64::min);
    let spread = (h_max / h_min * system.len() as f64).sqrt();
    spread * (error + rounding(16) * scale) / lambda_min
}
