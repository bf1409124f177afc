//! Anderson acceleration (Anderson 1965) of simultaneous relaxation `V ← V + s ∘ (P − A V)`: PIA with s_i = ω, Jacobi and
//! Thall's masks with s_i = ω/a_ii.
//!
//! With the updates f_k = s ∘ (P − A V_k) and the differences of the last m iterates and updates, an iteration takes the
//! coefficients γ that make ‖f_k − Σ γ_j Δf_j‖ least, and `V_{k+1} = V_k + f_k − Σ γ_j (ΔV_j + Δf_j)`. The norm is that of
//! the inner product Σ x_i·y_i/(h_i s_i), in which the relaxation is self-adjoint; the three coordinates share γ, so that a
//! rotation of the data rotates every iterate.
//!
//! The map is affine, so V_k lies in P plus the Krylov space of dimension k: the update's norm is never below that of full
//! GMRES after as many products, and with a window that forgets nothing V_{k+1} is one relaxation of GMRES's V_k (Walker
//! and Ni 2011). The matrix being self-adjoint, GMRES needs a recurrence of three terms only, and conjugate gradients do as
//! well with fewer arrays: on these systems a short window is what there is to gain, without a bound of the spectrum.
//!
//! One product and two passes over the stored vectors an iteration, 2m + 5 arrays of N points.

use glam::DVec3;
use limitlab_factorizations::dense::small_symmetric_eigen;
use nalgebra::{DMatrix, DVector};

use super::iteration::{Errors, Failure, Iterate, WarmStart};
use super::system::{Rows, System};
use crate::parallel;

/// The longest window.
pub const MOST: usize = 16;
/// Differences kept unless told: beyond, little is gained on these systems.
pub const WINDOW: usize = 5;
/// Rows of a task. Fixed, so that inner products do not depend on the number of threads.
const CHUNK: usize = 4096;
/// Combinations of differences, each of norm 1, that cancel to less than the root of this are rounding.
const CANCELLED: f64 = 1e-13;

/// What one pass adds up: the inner products of the newest Δf with all Δf, then of the update with all Δf.
type Products = [[f64; MOST + 1]; 2];

/// A relaxation, accelerated.
///
/// ```
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::{Accelerated, Method, Stop, run};
///
/// let surface = Surface::new(builtin::builtin("icosphere:2")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let stop = Stop { tolerance: 1e-9, max_iterations: 200 };
/// let steps = |method| run(&system, surface.positions(), method, &stop).report.iterations;
/// let plain = steps(Method::Pia);
/// assert!(2 * steps(Method::Anderson { of: Accelerated::Pia { omega: Some(1.0) }, window: 5 }) < plain);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub struct Anderson<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    /// s.
    scale: Vec<f64>,
    window: usize,
    current: Vec<DVec3>,
    /// f of the current iterate, and of the one before.
    update: Vec<DVec3>,
    before: Vec<DVec3>,
    /// ΔV and Δf in a ring of `window` + 1 places: one is on its way, the others count.
    steps: Vec<Vec<DVec3>>,
    changes: Vec<Vec<DVec3>>,
    /// The inner products of the Δf, by place.
    gram: DMatrix<f64>,
    /// Iterations made.
    count: usize,
    products: Vec<Products>,
    rows: Rows,
}

impl<'a, S: System> Anderson<'a, S> {
    /// Accelerates PIA with weight ω. Starts from V = P.
    ///
    /// # Panics
    /// Unless 1 ≤ `window` ≤ [`MOST`].
    pub fn of_pia(system: &'a S, points: &'a [DVec3], omega: f64, window: usize) -> Self {
        Self::new(system, points, vec![omega; points.len()], window)
    }

    /// Accelerates Jacobi with damping ω. Starts from V = P.
    ///
    /// # Panics
    /// Unless 1 ≤ `window` ≤ [`MOST`].
    pub fn of_jacobi(system: &'a S, points: &'a [DVec3], omega: f64, window: usize) -> Self {
        Self::new(system, points, system.diagonal().iter().map(|d| omega / d).collect(), window)
    }

    fn new(system: &'a S, points: &'a [DVec3], scale: Vec<f64>, window: usize) -> Self {
        assert!((1..=MOST).contains(&window), "a window of 1 to {MOST} differences");
        let n = points.len();
        let zero = || vec![DVec3::ZERO; n];
        let ring = || (0..=window).map(|_| zero()).collect();
        Anderson {
            system,
            points,
            scale,
            window,
            current: points.to_vec(),
            update: zero(),
            before: zero(),
            steps: ring(),
            changes: ring(),
            gram: DMatrix::zeros(window + 1, window + 1),
            count: 0,
            products: vec![Products::default(); n.div_ceil(CHUNK)],
            rows: Rows::new(n),
        }
    }

    /// The places of the differences that count, the newest first.
    fn places(&self) -> impl Iterator<Item = usize> + use<'a, S> {
        let (count, length) = (self.count, self.window + 1);
        (0..count.min(self.window)).map(move |age| (count - 1 - age) % length)
    }

    /// γ of the differences that count. Takes up the newest Δf.
    fn coefficients(&mut self) -> Vec<f64> {
        let places: Vec<usize> = self.places().collect();
        let Some(&newest) = places.first() else {
            return Vec::new();
        };
        let mut change = std::mem::take(&mut self.changes[newest]);
        let (update, before, changes, scale) = (&self.update, &self.before, &self.changes, &self.scale);
        let weights = self.system.weights();
        self.products.fill(Products::default());
        parallel::chunks_with(&mut change, CHUNK, &mut self.products, |first, change, sums| {
            for (i, change) in (first..).zip(change) {
                *change = update[i] - before[i];
                let weight = 1.0 / (weights[i] * scale[i]);
                let (weighted, target) = (weight * *change, weight * update[i]);
                sums[0][newest] += weighted.dot(*change);
                sums[1][newest] += target.dot(*change);
                for &place in &places[1..] {
                    sums[0][place] += weighted.dot(changes[place][i]);
                    sums[1][place] += target.dot(changes[place][i]);
                }
            }
        });
        self.changes[newest] = change;
        let total = |of: usize, place: usize| self.products.iter().map(|sums| sums[of][place]).sum::<f64>();
        for &place in &places {
            let product = total(0, place);
            self.gram[(newest, place)] = product;
            self.gram[(place, newest)] = product;
        }
        // Differences of norm 1: later ones are smaller by orders of magnitude. One that vanishes has no part in anything.
        let scales: Vec<f64> = (places.iter())
            .map(|&p| match self.gram[(p, p)] {
                0.0 => 0.0,
                square => 1.0 / square.sqrt(),
            })
            .collect();
        let size = places.len();
        let gram = DMatrix::from_fn(size, size, |i, j| self.gram[(places[i], places[j])] * scales[i] * scales[j]);
        let right = DVector::from_fn(size, |i, _| total(1, places[i]) * scales[i]);
        least_squares(gram, &right).iter().zip(&scales).map(|(gamma, scale)| gamma * scale).collect()
    }
}

/// The shortest γ that makes γᵀGγ − 2γᵀb least, G a Gram matrix with diagonal 1; what is rounding of it counts as 0.
fn least_squares(gram: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let size = gram.nrows();
    if gram.iter().chain(right).any(|x| !x.is_finite()) {
        return DVector::zeros(size);
    }
    let Some(eigen) = small_symmetric_eigen(gram, f64::EPSILON, 0) else { return DVector::zeros(size) };
    let mut parts = eigen.eigenvectors.tr_mul(right);
    for (part, &value) in parts.iter_mut().zip(&eigen.eigenvalues) {
        *part = if value > CANCELLED * size as f64 { *part / value } else { 0.0 };
    }
    eigen.eigenvectors * parts
}

impl<S: System> Iterate for Anderson<'_, S> {
    fn errors(&mut self) -> Errors {
        let scale = &self.scale;
        let out = &mut self.update;
        self.rows.residual(self.system, self.points, &self.current, out, |i, e, f, _| *f = scale[i] * e).errors
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let gamma = self.coefficients();
        let places: Vec<usize> = self.places().collect();
        let next = self.count % (self.window + 1);
        let mut step = std::mem::take(&mut self.steps[next]);
        let (update, steps, changes) = (&self.update, &self.steps, &self.changes);
        parallel::change(&mut step, |i, step| {
            *step = update[i];
            for (&gamma, &place) in gamma.iter().zip(&places) {
                *step -= gamma * (steps[place][i] + changes[place][i]);
            }
        });
        parallel::change(&mut self.current, |i, v| *v += step[i]);
        self.steps[next] = step;
        std::mem::swap(&mut self.update, &mut self.before);
        self.count += 1;
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

impl<S: System> WarmStart for Anderson<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
        self.count = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_differences_share_their_coefficient() {
        // Twice the same difference, and one across.
        let gram = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let found = least_squares(gram, &DVector::from_vec(vec![1.0, 1.0, 3.0]));
        for (found, expected) in found.iter().zip([0.5, 0.5, 3.0]) {
            assert!((found - expected).abs() < 1e-14);
        }
        let none = least_squares(DMatrix::from_element(1, 1, f64::NAN), &DVector::from_element(1, 1.0));
        assert_eq!(none[0], 0.0);
    }
}
