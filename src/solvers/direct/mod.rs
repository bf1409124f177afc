//! Direct methods: a factorization of A or M, as an iteration whose first step solves and whose further steps
//! refine. Every solve is followed by a check of the true residual: that is the history's next entry.

mod cholesky;
mod lu;
mod second_opinion;

pub use cholesky::{Cholesky, CholeskyForm};
pub use lu::SparseLu;
pub use second_opinion::SecondOpinion;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use rand::{RngExt, SeedableRng};

use super::iteration::{Errors, Failure, Iterate, Outcome, WarmStart};
use super::system::{Rows, System};
use crate::memory::require;

/// A factored matrix that solves systems with A.
pub trait Factorization {
    /// `x ← A⁻¹ x` for three right-hand sides at once. `h` is the diagonal of H.
    fn solve(&mut self, h: &[f64], x: &mut [DVec3]);

    /// The number of stored entries of the factors, if the library tells.
    fn fill(&self) -> Option<usize>;
}

/// A direct method at work. Iteration 1 is the solve; more only follow, as iterative refinement, if its residual
/// misses the tolerance.
pub struct Direct<'a, S, F> {
    system: &'a S,
    points: &'a [DVec3],
    factorization: F,
    current: Vec<DVec3>,
    residual: Vec<DVec3>,
    rows: Rows,
}

/// A is called singular if the estimate of λ_min(A) is below this many times N·ε·λ_max: backward stable factorizations
/// perturb the eigenvalues by a small multiple of ελ_max that grows with N at most linearly.
pub const SINGULAR: f64 = 4.0;

impl<'a, S: System, F: Factorization> Direct<'a, S, F> {
    /// Starts from V = P with a factorization of the system's matrix.
    ///
    /// # Errors
    /// [`Outcome::Singular`] if three steps of inverse iteration on H^½MH^½, which is similar to A, estimate
    /// λ_min(A) below [`SINGULAR`]·N·ε·λ_max, λ_max the system's bound.
    pub fn new(system: &'a S, points: &'a [DVec3], mut factorization: F) -> Result<Self, Failure> {
        let n = system.len();
        let threshold = SINGULAR * n as f64 * f64::EPSILON * system.lambda_max();
        let estimate = smallest_eigenvalue(system.weights(), &mut factorization);
        // Not a number: an exactly vanishing pivot.
        if estimate.is_nan() || estimate < threshold {
            return Err(Failure {
                outcome: Outcome::Singular,
                detail: format!(
                    "the smallest eigenvalue of A is estimated as {estimate:.1e}, below {SINGULAR}·N·ε·λ_max = {threshold:.1e}"
                ),
            });
        }
        Ok(Direct {
            system,
            points,
            factorization,
            current: points.to_vec(),
            residual: vec![DVec3::ZERO; n],
            rows: Rows::new(n),
        })
    }
}

/// |x|/|A⁻¹x| after inverse iteration from a random vector, three of them at once: an upper bound of the smallest
/// eigenvalue of H^½MH^½, close where that one is tiny. NaN or 0 if the factors hold a vanishing pivot.
fn smallest_eigenvalue(h: &[f64], factorization: &mut impl Factorization) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(0x7069_766f_7473);
    let mut x: Vec<DVec3> = (0..h.len())
        .map(|_| DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)))
        .collect();
    let norm = |x: &[DVec3]| x.iter().fold(DVec3::ZERO, |sum, v| sum + *v * *v).map(f64::sqrt);
    let mut estimate = DVec3::ONE;
    for _ in 0..3 {
        let before = norm(&x);
        // (H^½MH^½)⁻¹ = H^-½ A⁻¹ H^½
        for (v, h) in x.iter_mut().zip(h) {
            *v *= h.sqrt() / before;
        }
        factorization.solve(h, &mut x);
        for (v, h) in x.iter_mut().zip(h) {
            *v /= h.sqrt();
        }
        estimate = norm(&x).recip();
        if estimate.is_nan() || estimate.min_element() == 0.0 {
            break;
        }
    }
    if estimate.is_nan() { f64::NAN } else { estimate.min_element() }
}

impl<S: System, F: Factorization> Iterate for Direct<'_, S, F> {
    fn errors(&mut self) -> Errors {
        self.rows.residual(self.system, self.points, &self.current, &mut self.residual, |_, e, out, _| *out = e).errors
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.factorization.solve(self.system.weights(), &mut self.residual);
        for (v, d) in self.current.iter_mut().zip(&self.residual) {
            *v += *d;
        }
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

impl<S: System, F: Factorization> WarmStart for Direct<'_, S, F> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
    }
}

/// Passes if memory has room for a part of a method that takes so many bytes for each of the entries of `what`.
fn room(method: &str, what: &str, entries: usize, bytes: u64) -> Result<(), Failure> {
    require(bytes * entries as u64, || format!("{what} with {entries} entries"), "use an iterative method")
        .map_err(|e| failed(method, Outcome::Breakdown, e))
}

/// A factorization that could not be made.
fn failed(method: &str, outcome: Outcome, why: impl std::fmt::Display) -> Failure {
    Failure { outcome, detail: format!("{method}: {why}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assemble::LimitSystem;
    use crate::mesh::{Surface, builtin};
    use crate::schemes::Scheme;

    /// The factors of λ times the identity.
    struct Multiple(f64);

    impl Factorization for Multiple {
        fn solve(&mut self, _h: &[f64], x: &mut [DVec3]) {
            x.iter_mut().for_each(|x| *x /= self.0);
        }
        fn fill(&self) -> Option<usize> {
            None
        }
    }

    #[test]
    fn singular_begins_at_four_units_of_rounding_a_vertex() {
        for mesh in [builtin::cube(), builtin::torus(40, 30)] {
            let surface = Surface::new(mesh.clone()).unwrap();
            let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
            let outcome =
                |lambda: f64| Direct::new(&system, &mesh.positions, Multiple(lambda)).err().map(|f| f.outcome);
            let unit = mesh.len() as f64 * f64::EPSILON;
            assert_eq!(outcome(3.9 * unit), Some(Outcome::Singular), "{} vertices", mesh.len());
            assert_eq!(outcome(4.1 * unit), None, "{} vertices", mesh.len());
            for bad in [0.0, f64::NAN] {
                assert_eq!(outcome(bad), Some(Outcome::Singular), "{bad}");
            }
        }
    }
}
