//! Iteration matrices T of the splittings A = N − (N − A), T = I − N⁻¹A: eigenvalues, norms, numerical radius, powers.
//!
//! The error of a stationary method goes from e to T e in a step. T is made by running the method itself on P = 0, so that
//! it is that of any method, vertex order and back end: dense from its action on unit vectors, or by the outermost
//! eigenvalues alone from an Arnoldi process.
//!
//! T is far from normal where a sweep has a direction: then ρ(T)^k tells of ‖T^k‖ after many steps only. Norms are
//! three: the *energy norm* ‖e‖² = eᵀMe of A = H·M with M positive definite, in which every sweep with 0 < ω < 2 is a
//! contraction (Ostrowski and Reich), ‖T‖ = ‖LᵀT L⁻ᵀ‖₂ with M = LLᵀ; the Euclidean one; and the maximum norm, in which the
//! papers measure. With a sweep T and its reverse T* there, the adjoint in the energy norm, SSOR is T*T, and so
//! ‖T_SOR(ω)‖² = ρ(T_SSOR(ω)) (Young 1971; Hackbusch 2016).

use std::f64::consts::PI;
use std::ops::Range;

use faer::Mat;
use glam::DVec3;
use limitlab_factorizations::dense::{cholesky, product as matrix_product, solve_lower_triangular};
use nalgebra::Complex;

use super::dense::{self, unsymmetric_values};
use super::lanczos::{LanczosLimits, SelfAdjoint, Wanted, extremes};
use super::spectral_radius::{RitzValue, outermost};
use crate::error::{Error, Result};
use crate::parallel;
use crate::solvers::method::error_step;
use crate::solvers::system::product;
use crate::solvers::{Method, System};

/// Largest N for which T is computed when it is asked for by name: its eigenvalues take half a minute there.
pub const LARGEST: usize = dense::LARGEST_COMPLEX;

/// An entry of M and its mirror image differ by no more than this part of the largest, where M is symmetric.
const SYMMETRIC: f64 = 1e-12;
/// Of singular values, and of the numerical radius for one angle about the best.
const TOLERANCE: f64 = 1e-10;
/// Of the numerical radius for the angles that the best is looked for among.
const ROUGHLY: f64 = 1e-5;
/// Lanczos steps for these at most.
const STEPS: usize = 2000;
/// Angles between 0 and π at which the numerical range is looked at, and golden sections about the best.
const ANGLES: usize = 24;
const SECTIONS: usize = 16;

/// A norm of errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// ‖e‖² = eᵀMe.
    Energy,
    /// ‖e‖² = eᵀe.
    Euclidean,
    /// max |e_i|.
    Maximum,
}

impl Norm {
    /// All of them.
    pub const ALL: [Norm; 3] = [Norm::Energy, Norm::Euclidean, Norm::Maximum];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Norm::Energy => "energy",
            Norm::Euclidean => "2-norm",
            Norm::Maximum => "maximum",
        }
    }
}

/// T of a method on a system, N × N, and LᵀT L⁻ᵀ.
#[derive(Clone, Debug)]
pub struct IterationMatrix {
    t: Mat<f64>,
    energy: Option<Mat<f64>>,
}

impl IterationMatrix {
    /// T of `method`, whose open ω is that of the proven bounds. N/3 steps, and O(N³) time for the energy norm, which there is
    /// where M is symmetric and positive definite; 16 N² bytes.
    ///
    /// # Errors
    /// A method that is [not stationary](Method::is_stationary); more than [`LARGEST`] unknowns; entries that are not finite.
    ///
    /// ```
    /// use limitlab::analysis::iteration_matrix::{IterationMatrix, Norm};
    /// use limitlab::assemble::LimitSystem;
    /// use limitlab::mesh::{Surface, builtin};
    /// use limitlab::schemes::Scheme;
    /// use limitlab::solvers::Method;
    ///
    /// let surface = Surface::new(builtin::builtin("torus:6x6")?)?;
    /// let system = LimitSystem::new(&surface, Scheme::CatmullClark)?;
    /// // PIA is I − A, which is normal there: its norms but for the maximum norm are its radius, 1 − 1/9.
    /// let pia = IterationMatrix::new(&system, Method::Pia)?;
    /// assert!((pia.eigenvalues()?[0].re - 8.0 / 9.0).abs() < 1e-12);
    /// assert!((pia.norm(Norm::Euclidean)?.expect("a number") - 8.0 / 9.0).abs() < 1e-9);
    /// // A sweep contracts by more than its radius in the end, and by less at first.
    /// let sweep = IterationMatrix::new(&system, Method::GaussSeidel { order: None })?;
    /// let (radius, norm) = (sweep.eigenvalues()?[0].norm(), sweep.norm(Norm::Energy)?.expect("M is definite"));
    /// assert!((radius - 0.5639).abs() < 1e-4 && radius < norm && norm < 1.0);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn new<S: System>(system: &S, method: Method) -> Result<Self> {
        within_limit(system.len())?;
        let t = error_step(system, method, |step| dense::columns(system.len(), step))??;
        Self::of(system, t)
    }

    /// T of any linear iteration: `step` replaces e by T e.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_step<S: System>(system: &S, mut step: impl FnMut(&mut [DVec3])) -> Result<Self> {
        within_limit(system.len())?;
        let t = dense::columns(system.len(), &mut step)?;
        Self::of(system, t)
    }

    fn of<S: System>(system: &S, t: Option<Mat<f64>>) -> Result<Self> {
        let Some(t) = t else {
            return Err(Error::Computation("an entry of the iteration matrix is not finite".into()));
        };
        let energy = factor(system)?.map(|l| {
            // (L⁻¹(LᵀT)ᵀ)ᵀ = LᵀT L⁻ᵀ.
            let mut image = matrix_product(t.transpose(), l.as_ref());
            solve_lower_triangular(&l, image.as_mut());
            image.transpose().to_owned()
        });
        Ok(IterationMatrix { t, energy })
    }

    /// N.
    pub fn len(&self) -> usize {
        self.t.nrows()
    }

    /// Whether there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.t.nrows() == 0
    }

    /// The entry of row `i` and column `j`.
    ///
    /// # Panics
    /// If there is none.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        self.t[(i, j)]
    }

    /// T in the energy norm's orthonormal coordinates where there are such, else T itself: what pseudospectra are of.
    pub(super) fn in_best_coordinates(&self) -> &Mat<f64> {
        self.energy.as_ref().unwrap_or(&self.t)
    }

    /// Whether M is symmetric and positive definite, so that errors have an energy.
    pub fn has_energy(&self) -> bool {
        self.energy.is_some()
    }

    /// All N eigenvalues, the largest modulus first; of equal ones the larger real part, then the larger imaginary part. O(N³)
    /// time.
    ///
    /// # Errors
    /// If the computation does not converge.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>> {
        let mut all = unsymmetric_values(&self.t)?;
        sort(&mut all);
        Ok(all)
    }

    /// ‖T‖; `None` for the energy norm where M is not positive definite.
    ///
    /// # Errors
    /// If a Lanczos process fails.
    pub fn norm(&self, norm: Norm) -> Result<Option<f64>> {
        size(&self.t, self.energy.as_ref(), norm)
    }

    /// max |x*T x| over the unit vectors x of ℂ^N, in the Euclidean norm: ‖T‖/2 ≤ w ≤ ‖T‖, w ≥ ρ, and ‖T^k‖ ≤ 2w^k (Berger). The
    /// largest eigenvalue of the Hermitian part of e^{iθ}T for the best of 24 angles, improved by golden sections; from below,
    /// as every angle is. Each angle takes a Lanczos process of 4N² a step.
    ///
    /// # Errors
    /// If a Lanczos process fails.
    pub fn numerical_radius(&self) -> Result<f64> {
        const PART: f64 = 0.618_033_988_749_894_8;
        if self.is_empty() {
            return Ok(0.0);
        }
        let to = |tolerance: f64, angle: f64| largest(&Rotated { t: &self.t, angle }, 2 * self.len(), tolerance);
        let at = |angle: f64| to(TOLERANCE, angle);
        // T is real: −θ is as good as θ.
        let step = PI / ANGLES as f64;
        let (mut best, mut least) = (0.0, f64::NEG_INFINITY);
        for k in 0..=ANGLES {
            let value = to(ROUGHLY, k as f64 * step)?;
            if value > least {
                (best, least) = (k as f64 * step, value);
            }
        }
        let least = at(best)?;
        let (mut from, mut to) = (best - step, best + step);
        let mut probes = [to - PART * (to - from), from + PART * (to - from)];
        let mut values = [at(probes[0])?, at(probes[1])?];
        for _ in 0..SECTIONS {
            let up = usize::from(values[1] > values[0]);
            if up == 1 {
                from = probes[0]
            } else {
                to = probes[1]
            }
            probes = [to - PART * (to - from), from + PART * (to - from)];
            values[1 - up] = values[up];
            values[up] = at(probes[up])?;
        }
        Ok(least.max(values[0]).max(values[1]))
    }

    /// ‖T^k‖ for k = 1, 2, …, as [`Norm::ALL`]: up to `count`, or to the first of which none is above `until`. O(N³) time each.
    ///
    /// # Errors
    /// If a Lanczos process fails.
    pub fn powers(&self, count: usize, until: f64) -> Result<Vec<[Option<f64>; 3]>> {
        let (mut t, mut energy) = (self.t.clone(), self.energy.clone());
        let mut norms: Vec<[Option<f64>; 3]> = Vec::new();
        for k in 1..=count {
            if k > 1 {
                t = matrix_product(t.as_ref(), self.t.as_ref());
                energy = energy.zip(self.energy.as_ref()).map(|(p, one)| matrix_product(p.as_ref(), one.as_ref()));
            }
            let [a, b, c] = Norm::ALL.map(|norm| size(&t, energy.as_ref(), norm));
            let here = [a?, b?, c?];
            norms.push(here);
            if here.into_iter().flatten().all(|norm| norm <= until) {
                break;
            }
        }
        Ok(norms)
    }
}

/// How far the powers of T stay above those of its radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hump {
    /// max_k ‖T^k‖/ρ^k.
    pub height: f64,
    /// The first k at which that ratio is within a hundredth of it.
    pub length: usize,
}

impl Hump {
    /// The hump of ‖T^k‖, k = 1, 2, …; a `length` that is the last k says that it may go on. `None` if ρ = 0 or there are no
    /// powers.
    ///
    /// ```
    /// use limitlab::analysis::iteration_matrix::Hump;
    ///
    /// // A Jordan block of order 2 with the eigenvalue ½ and 1 above it has about 2k(½)^k.
    /// let hump = Hump::new((1..=20).map(|k| 2.0 * f64::from(k) * 0.5f64.powi(k)), 0.5).expect("powers");
    /// assert!((hump.height - 40.0).abs() < 1e-12 && hump.length == 20);
    /// ```
    pub fn new(norms: impl IntoIterator<Item = f64>, radius: f64) -> Option<Self> {
        const NEARLY: f64 = 0.99;
        let ratios: Vec<f64> = norms.into_iter().zip(1..).map(|(norm, k)| norm / radius.powi(k)).collect();
        let height = ratios.iter().copied().reduce(f64::max).filter(|height| height.is_finite())?;
        let length = 1 + ratios.iter().position(|&ratio| ratio >= NEARLY * height)?;
        Some(Hump { height, length })
    }
}

/// Sorts eigenvalues: the largest modulus first; of moduli that are equal but for rounding the larger real part, then the
/// larger imaginary part.
pub fn sort(eigenvalues: &mut [Complex<f64>]) {
    eigenvalues.sort_unstable_by(|a, b| b.norm().total_cmp(&a.norm()));
    let mut first = 0;
    for i in 1..=eigenvalues.len() {
        if i == eigenvalues.len()
            || eigenvalues[i - 1].norm() - eigenvalues[i].norm() > 1e-12 * eigenvalues[first].norm()
        {
            eigenvalues[first..i].sort_unstable_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
            first = i;
        }
    }
}

/// The outermost `count` eigenvalues of T on a system of any size by an Arnoldi process of up to 320 vectors, each with its
/// residual: an eigenvalue is as near as that times its condition. Multiple ones come once. O(N) memory a vector.
///
/// # Errors
/// A method that is [not stationary](Method::is_stationary); if the projected eigenvalues are not found.
pub fn outermost_eigenvalues<S: System>(system: &S, method: Method, count: usize) -> Result<Vec<RitzValue>> {
    error_step(system, method, |step| outermost(system.len(), count, step))?
}

fn within_limit(n: usize) -> Result<()> {
    if n > LARGEST {
        return Err(Error::Computation(format!(
            "the iteration matrix of {n} vertices: all of it is computed up to {LARGEST}; use a coarser mesh, or the outermost \
             eigenvalues, which have no such limit"
        )));
    }
    Ok(())
}

/// L of M = LLᵀ; `None` where M = H⁻¹A is not symmetric and positive definite.
fn factor<S: System>(system: &S) -> Result<Option<Mat<f64>>> {
    let n = system.len();
    let mut image = vec![DVec3::ZERO; n];
    let mut apply = |x: &mut [DVec3]| {
        product(system, x, &mut image);
        for ((x, image), h) in x.iter_mut().zip(&image).zip(system.weights()) {
            *x = *image / *h;
        }
    };
    let Some(m) = dense::columns(n, &mut apply)? else { return Ok(None) };
    let most = (0..n).map(|i| m[(i, i)].abs()).fold(0.0, f64::max);
    let same = |i: usize, j: usize| (m[(i, j)] - m[(j, i)]).abs() <= SYMMETRIC * most;
    if !(0..n).all(|j| (0..j).all(|i| same(i, j))) {
        return Ok(None);
    }
    let Some(l) = cholesky(&m) else { return Ok(None) };
    // A pivot that is rounding alone.
    let definite = (0..n).all(|i| l[(i, i)] * l[(i, i)] > n as f64 * f64::EPSILON * most);
    Ok(definite.then_some(l))
}

fn size(t: &Mat<f64>, energy: Option<&Mat<f64>>, norm: Norm) -> Result<Option<f64>> {
    let n = t.nrows();
    let singular = |matrix: &Mat<f64>| Ok(Some(largest(&Gram(matrix), n, TOLERANCE)?.max(0.0).sqrt()));
    match norm {
        Norm::Energy => energy.map_or(Ok(None), singular),
        Norm::Euclidean => singular(t),
        Norm::Maximum => {
            let row = |i: usize| (0..n).map(|j| t[(i, j)].abs()).sum::<f64>();
            Ok(Some((0..n).map(row).fold(0.0, f64::max)))
        }
    }
}

/// The largest eigenvalue of a symmetric matrix of order n, to a relative tolerance.
fn largest(s: &dyn Dense, n: usize, tolerance: f64) -> Result<f64> {
    if n == 0 {
        return Ok(0.0);
    }
    let limits = LanczosLimits { tolerance, max_steps: STEPS, least_weight: 0.0, ends: Wanted::Highest };
    // No start by a pattern that a mesh could share.
    let start = (0..n).map(|i| 1.0 + (0.618_033_988_75 * (i + 1) as f64).fract()).collect();
    Ok(extremes(&Symmetric(s), start, limits)?.high.value)
}

/// A symmetric matrix by its product with a vector.
trait Dense: Sync {
    fn len(&self) -> usize;
    /// The whole product.
    fn apply(&self, x: &[f64]) -> Vec<f64>;
}

/// One type for all of them, so that there is one Lanczos process.
struct Symmetric<'a>(&'a dyn Dense);

impl SelfAdjoint for Symmetric<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn weight(&self, _i: usize) -> f64 {
        1.0
    }

    fn prepare(&self, x: &[f64], shared: &mut Vec<f64>) {
        *shared = self.0.apply(x);
    }

    fn product(&self, rows: Range<usize>, _x: &[f64], shared: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&shared[rows]);
    }
}

/// CᵀC.
struct Gram<'a>(&'a Mat<f64>);

impl Dense for Gram<'_> {
    fn len(&self) -> usize {
        self.0.ncols()
    }

    fn apply(&self, x: &[f64]) -> Vec<f64> {
        transposed(self.0, &times(self.0, x))
    }
}

/// The Hermitian part of e^{iθ}T, real of order 2N: (P −Q; Q P) with P = cos θ (T + Tᵀ)/2, Q = sin θ (T − Tᵀ)/2.
struct Rotated<'a> {
    t: &'a Mat<f64>,
    angle: f64,
}

impl Dense for Rotated<'_> {
    fn len(&self) -> usize {
        2 * self.t.nrows()
    }

    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let (sin, cos) = self.angle.sin_cos();
        let (re, im) = x.split_at(self.t.nrows());
        let [t_re, t_im] = [re, im].map(|x| times(self.t, x));
        let [u_re, u_im] = [re, im].map(|x| transposed(self.t, x));
        let upper = (0..re.len()).map(|i| 0.5 * (cos * (t_re[i] + u_re[i]) - sin * (t_im[i] - u_im[i])));
        let lower = (0..re.len()).map(|i| 0.5 * (cos * (t_im[i] + u_im[i]) + sin * (t_re[i] - u_re[i])));
        upper.chain(lower).collect()
    }
}

/// Columns of a task: work enough for a thread to be woken for it.
const CHUNK: usize = 256;

/// C x, column by column, as they lie in memory.
fn times(c: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    let n = c.nrows();
    let parts = parallel::map(x.len(), CHUNK, |range| {
        let mut sum = vec![0.0; n];
        for j in range {
            for (sum, c) in sum.iter_mut().zip(c.col(j).iter()) {
                *sum += x[j] * c;
            }
        }
        sum
    });
    parts.into_iter().fold(vec![0.0; n], |mut sum, part| {
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        sum
    })
}

/// Cᵀx.
fn transposed(c: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    let mut image = vec![0.0; c.ncols()];
    parallel::chunks(&mut image, CHUNK, |first, image| {
        for (j, image) in (first..).zip(image) {
            *image = c.col(j).iter().zip(x).map(|(c, x)| c * x).sum();
        }
    });
    image
}
