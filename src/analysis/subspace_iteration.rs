//! Eigenpairs at one end of the spectrum of a sparse symmetric matrix, with their multiplicities: subspace iteration
//! on a block of vectors, filtered by Chebyshev polynomials (Zhou and Saad 2007; Rutishauser 1969).
//!
//! A block of p vectors is multiplied by a polynomial in S that is small on the unwanted part of the spectrum and
//! grows fast beyond it; then it is made orthonormal and the Rayleigh-Ritz procedure reads off eigenpairs. An
//! eigenvalue of multiplicity up to the width of the block appears as often as it should, which a Krylov space of
//! one vector cannot give. The unwanted part reaches from the block's last Ritz value to the far end, for which a
//! proven bound is used; nothing is tuned to a mesh.
//!
//! Where the block's values are so close together that a polynomial of the greatest degree does not part them, as at the lowest
//! end on a large regular grid, the same filter is put to ±(S − σ)⁻¹, with σ a tenth of their distance beyond the end: there a
//! degree of six parts them.
//!
//! Memory: two blocks of N × p numbers; for the inverse a third one and a Cholesky factor. Work: products with S or its inverse
//! (counted in [`Eigenpairs::applications`]), and 6 N p² operations each time the block is made orthonormal. All sums are taken in chunks of fixed size and in
//! their order, so results do not depend on the number of threads.

use chacha20::ChaCha8Rng;
use limitlab_factorizations::dense::small_symmetric_eigen;
use nalgebra::{DMatrix, SymmetricEigen};
use rand::{RngExt, SeedableRng};

use super::shift_invert::{LANES, ShiftInvert};
use crate::assemble::Csr;
use crate::error::{Error, Result};
use crate::parallel;

/// Rows of a task.
const CHUNK: usize = 4096;
/// Vectors beside the wanted ones: they move the damped part of the spectrum away from those.
const GUARDS: usize = 8;
/// The growth of the first wanted vector over the damped part that one filter aims at: enough to gain seven
/// digits, little enough to leave the block well conditioned.
const AMPLIFICATION: f64 = 1e7;
/// Degrees of a filter.
const DEGREES: std::ops::RangeInclusive<usize> = 6..=240;
/// The distance of a shift from the end of the spectrum, in parts of that from there to the damped part: near enough that
/// filters of the least degree part the block's values, far enough that the end has mostly been found before.
const SHIFT: f64 = 0.1;
/// The least distance of the damped part from the end of the spectrum, in parts of the whole, where the block does
/// not resolve a cluster.
const LEAST_SPREAD: f64 = 1e-3;
/// Filters at most. The excess is a result: [`Eigenpairs::converged`] is false.
const ROUNDS: usize = 60;
/// Vectors of a block at most.
pub const WIDEST: usize = 64;
/// Bytes of both blocks at most.
const MEMORY: usize = 4 << 30;

/// Which end of the spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The least eigenvalue and those next above it.
    Lowest,
    /// The greatest eigenvalue and those next below it.
    Highest,
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub struct EigenpairRequest {
    /// The end to count from, inwards.
    pub end: End,
    /// Eigenpairs, counted with multiplicity.
    pub count: usize,
    /// The relative accuracy of their values.
    pub tolerance: f64,
    /// An interval that contains all of the spectrum: a bound, not an estimate.
    pub spectrum: (f64, f64),
}

/// An approximate eigenvalue with what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigenvalue {
    /// A Ritz value of S, or a computed eigenvalue where the computation was dense.
    pub value: f64,
    /// ‖S x − λ x‖₂ of the unit vector x: an eigenvalue lies within this distance (proven).
    pub residual: f64,
    /// min(r, r²/δ) with δ the distance to the first value not wanted: the error of the value if the block has
    /// missed no eigenvalue (Temple, Kato).
    pub error: f64,
}

/// Eigenpairs from the asked end inwards.
#[derive(Clone, Debug)]
pub struct Eigenpairs {
    /// As many as were asked for, multiple ones repeated, the extreme one first.
    pub values: Vec<Eigenvalue>,
    /// The unit vectors, one after the other.
    pub vectors: Vec<Vec<f64>>,
    /// Whether all of them have the accuracy asked for.
    pub converged: bool,
    /// Products of S, or of its shifted inverse, with one vector.
    pub applications: usize,
}

/// Values that count as one eigenvalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// The one nearest to the end of the spectrum.
    pub value: f64,
    /// Computed values in the cluster; there may be more unless it is `complete`.
    pub multiplicity: usize,
    /// The last cluster may go on beyond what was computed.
    pub complete: bool,
}

impl Eigenpairs {
    /// Groups values that differ by no more than their errors and `relative` times the larger.
    pub fn clusters(&self, relative: f64) -> Vec<Cluster> {
        let mut clusters: Vec<Cluster> = Vec::new();
        let mut before: Option<Eigenvalue> = None;
        for &here in &self.values {
            let same = before.is_some_and(|b| {
                let slack = relative * here.value.abs().max(b.value.abs());
                (here.value - b.value).abs() <= here.error + b.error + slack
            });
            match clusters.last_mut() {
                Some(cluster) if same => cluster.multiplicity += 1,
                last => {
                    if let Some(cluster) = last {
                        cluster.complete = true;
                    }
                    clusters.push(Cluster { value: here.value, multiplicity: 1, complete: false });
                }
            }
            before = Some(here);
        }
        clusters
    }
}

/// The `count` eigenpairs of the symmetric matrix `s` at the end asked for, from a seeded random start.
///
/// # Errors
/// A matrix too small for the block (use dense eigenvalues), more pairs than [`WIDEST`] less the guards allow, a
/// block that memory does not hold, or entries that are not finite.
///
/// ```
/// use limitlab::analysis::subspace_iteration::{EigenpairRequest, End, extreme};
/// use limitlab::analysis::symmetric::{SymmetricForm, symmetric};
/// use limitlab::assemble::LimitSystem;
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
///
/// let surface = Surface::new(builtin::torus(30, 30))?;
/// let system = LimitSystem::new(&surface, Scheme::CatmullClark)?;
/// let request = EigenpairRequest { end: End::Lowest, count: 5, tolerance: 1e-10, spectrum: (0.0, 1.0) };
/// let pairs = extreme(&symmetric(&system, SymmetricForm::A), &request)?;
/// // ((2 + cos θ)/3)((2 + cos φ)/3): 1/9 once, the next value four times.
/// assert_eq!(pairs.clusters(1e-9).iter().map(|c| c.multiplicity).collect::<Vec<_>>(), [1, 4]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn extreme(s: &Csr, request: &EigenpairRequest) -> Result<Eigenpairs> {
    let n = s.len();
    let width = (request.count + GUARDS).next_multiple_of(LANES);
    if width > WIDEST {
        return Err(Error::Computation(format!(
            "{} eigenpairs were asked for: at most {} are computed at once; use dense eigenvalues on a smaller mesh",
            request.count,
            WIDEST - GUARDS
        )));
    }
    if n < 4 * width {
        return Err(Error::Computation(format!(
            "{n} vertices are too few for a block of {width} vectors; use dense eigenvalues"
        )));
    }
    if n.saturating_mul(2 * 8 * width) > MEMORY {
        return Err(Error::Computation(format!(
            "{} eigenpairs of {n} vertices need blocks of more than {} GiB; at most {} vertices fit with {width} \
             vectors: use a smaller mesh or fewer pairs",
            request.count,
            MEMORY >> 30,
            MEMORY / (2 * 8 * width)
        )));
    }
    let mut iteration = Iteration::new(s, width);
    let mut rng = ChaCha8Rng::seed_from_u64(0x62_6c6f_636b);
    for x in &mut iteration.x {
        *x = rng.random_range(-1.0..1.0);
    }
    let (lo, hi) = request.spectrum;
    let far = match request.end {
        End::Lowest => hi,
        End::Highest => lo,
    };
    let scale = lo.abs().max(hi.abs());
    let mut round = 0;
    let mut inverse = None;
    // Until a factor has no room or is not found.
    let mut may_factor = true;
    loop {
        let ritz = iteration.rayleigh_ritz(request.end, &mut rng)?;
        let cut = ritz[width - 1].0;
        let values: Vec<Eigenvalue> = ritz[..request.count]
            .iter()
            .map(|&(value, residual)| Eigenvalue {
                value,
                residual,
                error: residual.min(residual * residual / (cut - value).abs()),
            })
            .collect();
        let good = |v: &Eigenvalue| v.error <= (request.tolerance * v.value.abs()).max(8.0 * f64::EPSILON * scale);
        let converged = round > 1 && values.iter().all(good);
        if converged || round == ROUNDS {
            return Ok(Eigenpairs {
                vectors: (0..request.count).map(|j| iteration.column(j)).collect(),
                values,
                converged,
                applications: iteration.applications,
            });
        }
        round += 1;
        // A multiple eigenvalue wider than the block, or one not yet resolved: a cut within it would damp what is
        // wanted. Beyond it, whatever part of its space the block has taken is amplified as a whole.
        let spread = (cut - ritz[0].0).abs();
        let unresolved = ritz.iter().fold(0.0f64, |most, r| most.max(r.1));
        let cut = if spread < unresolved {
            let least = (10.0 * unresolved).max(LEAST_SPREAD * (far - ritz[0].0).abs());
            ritz[0].0 + least.copysign(far - ritz[0].0)
        } else {
            cut
        };
        let wanted = ritz[0].0;
        if inverse.is_none() && degree(wanted, cut, far) > *DEGREES.end() as f64 && may_factor {
            inverse = ShiftInvert::new(s, request.end, width, wanted, SHIFT * (cut - wanted).abs());
            may_factor = inverse.is_some();
        }
        // The block's values have come closer to each other than the shift is to them.
        if let Some(there) = &mut inverse
            && (wanted - there.sigma).abs() > (cut - wanted).abs()
            && !there.move_to(wanted, SHIFT * (cut - wanted).abs())
        {
            (inverse, may_factor) = (None, false);
        }
        match &mut inverse {
            None => iteration.filter(&mut Operator::Matrix, wanted, cut, far),
            Some(inverse) => {
                let (wanted, cut) = (inverse.image(wanted), inverse.image(cut));
                iteration.filter(&mut Operator::Inverse(inverse), wanted, cut, 0.0);
            }
        }
    }
}

/// What a filter is a polynomial in.
enum Operator<'a, 'b> {
    Matrix,
    Inverse(&'a mut ShiftInvert<'b>),
}

/// The degree at which the polynomial amplifies `wanted` as it should over [`cut`, `far`].
fn degree(wanted: f64, cut: f64, far: f64) -> f64 {
    let (c, e) = (0.5 * (far + cut), 0.5 * (far - cut));
    let outside = ((wanted - c) / e).abs();
    if outside > 1.0 { ((2.0 * AMPLIFICATION).ln() / outside.acosh()).ceil() } else { f64::INFINITY }
}

struct Iteration<'a> {
    s: &'a Csr,
    width: usize,
    /// Row-major, N × width.
    x: Vec<f64>,
    y: Vec<f64>,
    /// By columns; empty until the inverse is needed.
    z: Vec<f64>,
    applications: usize,
}

impl<'a> Iteration<'a> {
    fn new(s: &'a Csr, width: usize) -> Self {
        let zeros = vec![0.0; s.len() * width];
        Iteration { s, width, x: zeros.clone(), y: zeros, z: Vec::new(), applications: 0 }
    }

    fn column(&self, j: usize) -> Vec<f64> {
        self.x.chunks_exact(self.width).map(|row| row[j]).collect()
    }

    /// `x ← T_m((S − c)/e) x`, or so of the inverse in the place of S, scaled to stay near 1 at `wanted`; [`cut`, `far`] is mapped
    /// to [−1, 1].
    fn filter(&mut self, operator: &mut Operator, wanted: f64, cut: f64, far: f64) {
        let (c, e) = (0.5 * (far + cut), 0.5 * (far - cut));
        let outside = ((wanted - c) / e).abs();
        // Infinity becomes the greatest number.
        let degree = (degree(wanted, cut, far) as usize).clamp(*DEGREES.start(), *DEGREES.end());
        let first = if outside > 1.0 { e / (wanted - c) } else { -1.0 };
        let mut sigma = first;
        // y = (S x − c x) σ/e, then the recurrence, each step in the place of the older vector.
        self.step(operator, sigma / e, c, 0.0);
        std::mem::swap(&mut self.x, &mut self.y);
        for _ in 1..degree {
            let next = 1.0 / (2.0 / first - sigma);
            self.step(operator, 2.0 * next / e, c, -sigma * next);
            std::mem::swap(&mut self.x, &mut self.y);
            sigma = next;
        }
    }

    /// `y ← α (S x − c x) + β y`, or so of the inverse.
    fn step(&mut self, operator: &mut Operator, alpha: f64, c: f64, beta: f64) {
        self.applications += self.width;
        match operator {
            Operator::Matrix => self.step_of_matrix(alpha, c, beta),
            Operator::Inverse(inverse) => self.step_of_inverse(inverse, alpha, c, beta),
        }
    }

    fn step_of_inverse(&mut self, inverse: &mut ShiftInvert, alpha: f64, c: f64, beta: f64) {
        let (n, width) = (self.s.len(), self.width);
        self.z.resize(n * width, 0.0);
        inverse.solve(&self.x, &mut self.z);
        let (x, z) = (&self.x, &self.z);
        parallel::chunks(&mut self.y, CHUNK * width, |first, y| {
            for (i, y) in (first / width..).zip(y.chunks_exact_mut(width)) {
                for (j, y) in y.iter_mut().enumerate() {
                    let old = if beta == 0.0 { 0.0 } else { beta * *y };
                    *y = alpha * (z[j * n + i] - c * x[i * width + j]) + old;
                }
            }
        });
    }

    /// Parallel over rows.
    fn step_of_matrix(&mut self, alpha: f64, c: f64, beta: f64) {
        let (s, x, width) = (self.s, &self.x, self.width);
        parallel::chunks(&mut self.y, CHUNK * width, |first, y| {
            for (i, y) in (first / width..).zip(y.chunks_exact_mut(width)) {
                for (lane, y) in y.chunks_exact_mut(LANES).enumerate() {
                    let at = lane * LANES;
                    let sum = row_times_lanes(s, i, x, width, at);
                    let own = &x[i * width + at..][..LANES];
                    for l in 0..LANES {
                        // β = 0 must also clear what is not a number.
                        let old = if beta == 0.0 { 0.0 } else { beta * y[l] };
                        y[l] = alpha * (sum[l] - c * own[l]) + old;
                    }
                }
            }
        });
    }

    /// Orthonormal vectors of the same span, ordered Ritz pairs of S in it: (value, residual).
    fn rayleigh_ritz(&mut self, end: End, rng: &mut ChaCha8Rng) -> Result<Vec<(f64, f64)>> {
        self.orthonormalize(rng)?;
        self.step(&mut Operator::Matrix, 1.0, 0.0, 0.0);
        let projected = gram(&self.x, &self.y, self.width);
        let eigen = decompose(symmetrized(projected))?;
        let mut order: Vec<usize> = (0..self.width).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        if end == End::Highest {
            order.reverse();
        }
        let rotation = DMatrix::from_fn(self.width, self.width, |i, j| eigen.eigenvectors[(i, order[j])]);
        rotate(&mut self.x, &rotation);
        rotate(&mut self.y, &rotation);
        let values: Vec<f64> = order.iter().map(|&j| eigen.eigenvalues[j]).collect();
        let squares = residual_squares(&self.x, &self.y, &values);
        Ok(values.into_iter().zip(squares).map(|(value, square)| (value, square.sqrt())).collect())
    }

    /// By the eigenvectors of the scaled Gram matrix (Stathopoulos and Wu 2002), repeated until the columns are
    /// orthonormal to rounding. Columns that depend on the others give way to random ones.
    fn orthonormalize(&mut self, rng: &mut ChaCha8Rng) -> Result<()> {
        const PASSES: usize = 6;
        /// Parts of unit columns below this, squared, are rounding errors of the Gram matrix.
        const DEPENDENT: f64 = 1e-14;
        let p = self.width;
        for _ in 0..PASSES {
            let g = gram(&self.x, &self.x, p);
            let off = (0..p)
                .flat_map(|i| (0..p).map(move |j| (i, j)))
                .map(|(i, j)| (g[(i, j)] - if i == j { 1.0 } else { 0.0 }).abs())
                .fold(0.0, f64::max);
            if off.is_nan() {
                return Err(Error::Computation(
                    "the matrix or the block of vectors holds numbers that are not finite".into(),
                ));
            }
            if off <= 1e-13 {
                return Ok(());
            }
            let d: Vec<f64> = (0..p).map(|j| if g[(j, j)] > 0.0 { 1.0 / g[(j, j)].sqrt() } else { 0.0 }).collect();
            let scaled = DMatrix::from_fn(p, p, |i, j| d[i] * g[(i, j)] * d[j]);
            let eigen = decompose(symmetrized(scaled))?;
            let lost: Vec<bool> = eigen.eigenvalues.iter().map(|&l| l <= DEPENDENT).collect();
            let t = DMatrix::from_fn(p, p, |i, j| {
                if lost[j] { 0.0 } else { d[i] * eigen.eigenvectors[(i, j)] / eigen.eigenvalues[j].sqrt() }
            });
            rotate(&mut self.x, &t);
            if lost.contains(&true) {
                for row in self.x.chunks_exact_mut(p) {
                    for (x, _) in row.iter_mut().zip(&lost).filter(|(_, lost)| **lost) {
                        *x = rng.random_range(-1.0..1.0);
                    }
                }
            }
        }
        Err(Error::Computation("a block of vectors could not be made orthonormal".into()))
    }
}

/// Row `i` of S times eight neighbouring columns of `x`.
#[inline]
fn row_times_lanes(s: &Csr, i: usize, x: &[f64], width: usize, at: usize) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for (j, v) in s.row(i) {
        let x = &x[j * width + at..][..LANES];
        for l in 0..LANES {
            sum[l] += v * x[l];
        }
    }
    sum
}

/// XᵀY for row-major blocks: chunks of rows in parallel, added up in their order.
fn gram(x: &[f64], y: &[f64], p: usize) -> DMatrix<f64> {
    let parts = parallel::map(x.len(), CHUNK * p, |range| {
        let mut sum = vec![0.0; p * p];
        for (x, y) in x[range.clone()].chunks_exact(p).zip(y[range].chunks_exact(p)) {
            for (sum, &a) in sum.chunks_exact_mut(p).zip(x) {
                for (sum, &b) in sum.iter_mut().zip(y) {
                    *sum += a * b;
                }
            }
        }
        sum
    });
    let mut total = DMatrix::zeros(p, p);
    for part in parts {
        total += DMatrix::from_row_slice(p, p, &part);
    }
    total
}

fn residual_squares(x: &[f64], y: &[f64], values: &[f64]) -> Vec<f64> {
    let p = values.len();
    let parts = parallel::map(x.len(), CHUNK * p, |range| {
        let mut sum = vec![0.0; p];
        for (x, y) in x[range.clone()].chunks_exact(p).zip(y[range].chunks_exact(p)) {
            for j in 0..p {
                let r = y[j] - values[j] * x[j];
                sum[j] += r * r;
            }
        }
        sum
    });
    let mut total = vec![0.0; p];
    for part in parts {
        total.iter_mut().zip(part).for_each(|(t, s)| *t += s);
    }
    total
}

/// Every row times the square matrix `t`, in place.
fn rotate(x: &mut [f64], t: &DMatrix<f64>) {
    let p = t.nrows();
    let by_rows: Vec<f64> = t.transpose().as_slice().to_vec();
    parallel::chunks(x, CHUNK * p, |_, x| {
        let mut new = vec![0.0; p];
        for row in x.chunks_exact_mut(p) {
            new.fill(0.0);
            for (&a, t) in row.iter().zip(by_rows.chunks_exact(p)) {
                for (new, &t) in new.iter_mut().zip(t) {
                    *new += a * t;
                }
            }
            row.copy_from_slice(&new);
        }
    });
}

fn symmetrized(m: DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (&m + m.transpose())
}

fn decompose(m: DMatrix<f64>) -> Result<SymmetricEigen<f64, nalgebra::Dyn>> {
    let size = m.nrows();
    small_symmetric_eigen(m, f64::EPSILON, 1000 * size)
        .ok_or_else(|| Error::Computation("the eigenvalues of a projected matrix did not converge".into()))
}
