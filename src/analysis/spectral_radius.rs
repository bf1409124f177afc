//! Spectral radii of iterations whose error matrix is not symmetric: Gauss-Seidel, SOR, SSOR.

use chacha20::ChaCha8Rng;
use faer::Mat;
use glam::DVec3;
use limitlab_factorizations::dense::{small_complex_lu, small_eigenvalues};
use nalgebra::{Complex, DMatrix, DVector};
use rand::{RngExt, SeedableRng};

use super::dense;
use crate::error::Result;
use crate::parallel;
use crate::solvers::System;

/// Steps of the power method before the first Arnoldi process.
const WARM_UP: usize = 30;
/// Vectors of an Arnoldi process at most, and at least where memory is short.
const VECTORS: usize = 40;
const FEWEST_VECTORS: usize = 10;
/// Bytes of its basis at most.
const MEMORY: usize = 1 << 30;
/// Processes at most; where one with more vectors is affordable, it follows this many.
const CYCLES: usize = 12;
const SHORT_CYCLES: usize = 3;
/// The longest process: its multiplications, and its vectors.
const WORK: usize = 1_000_000_000;
const MOST_VECTORS: usize = 320;
/// Residual at which to stop, in relation to the radius.
const TOLERANCE: f64 = 1e-8;
/// A change of the radius from cycle to cycle that is as good as convergence.
const STILL: f64 = 1e-10;
/// A next vector of this length is rounding, and what would follow it no longer orthogonal.
const CLOSED: f64 = 1e-11;
/// Up to this many vertices the whole matrix is computed.
const DENSE: usize = 300;

/// A spectral radius with what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralRadius {
    /// The largest modulus of an eigenvalue, a factor per iteration; infinite if an iterate overflows.
    pub value: f64,
    /// ‖E x − μ x‖ of the unit Ritz vector of the dominant μ; the error of |μ| is of this size times the eigenvalue's
    /// condition (the matrix is not normal). Rounding level where the computation was dense.
    pub residual: f64,
    /// Iterations made.
    pub applications: usize,
    /// Whether the residual fell below 1e-8, or the value stood still to 1e-10.
    pub converged: bool,
}

/// The value of [`spectral_radius`].
///
/// # Errors
/// As there.
pub fn sweep_radius(system: &impl System, step: impl FnMut(&mut [DVec3])) -> Result<f64> {
    Ok(spectral_radius(system, step)?.value)
}

/// The spectral radius of the error matrix E of a linear iteration; `step` replaces V by the next iterate for P = 0.
///
/// Dense up to 300 vertices, else the largest Ritz value of restarted Arnoldi processes (Saad 1980) on the three
/// coordinates together, from a seeded random start. Where many eigenvalues lie near the circle of radius ρ, as those of SOR
/// beyond the best ω do, restarts lose what parts them: after 3 processes of 40 steps comes one of up to 320, as far as 10⁹
/// multiplications go, up to some 13 000 vertices; beyond, at most 12 of 40. On a torus of 1024 vertices and ω up to 1.95 what
/// is found then is within 5·10⁻⁴ of ρ, from below; the residual tells. A basis of 3N numbers a step, fewer steps where that
/// exceeds 1 GiB.
///
/// # Errors
/// If the dense computation does not converge.
pub fn spectral_radius(system: &impl System, mut step: impl FnMut(&mut [DVec3])) -> Result<SpectralRadius> {
    let n = system.len();
    if n <= DENSE {
        return Ok(SpectralRadius {
            value: dense::spectral_radius(system, step)?,
            residual: n as f64 * f64::EPSILON,
            applications: n.div_ceil(3),
            converged: true,
        });
    }
    let room = (MEMORY / (24 * n)).max(FEWEST_VECTORS);
    let vectors = room.min(VECTORS);
    // Gram-Schmidt twice on k vectors of 3N numbers takes 12 N k² multiplications.
    let longest = (WORK / (12 * n)).isqrt().min(MOST_VECTORS).min(room);
    let (cycles, last) = if longest > 2 * vectors { (SHORT_CYCLES + 1, longest) } else { (CYCLES, vectors) };
    let mut x = random(n);
    for _ in 0..WARM_UP {
        step(&mut x);
        let length = normalize(&mut x);
        if !length.is_finite() {
            return Ok(exact(f64::INFINITY, WARM_UP));
        }
        if length <= f64::MIN_POSITIVE {
            return Ok(exact(0.0, WARM_UP));
        }
    }
    let mut applications = WARM_UP;
    let mut before = f64::NAN;
    for cycle in 1.. {
        let found = arnoldi(x, if cycle == cycles { last } else { vectors }, &mut step)?;
        applications += found.steps;
        let value = found.ritz.norm();
        let still = (value - before).abs() <= STILL * value;
        let good = found.residual <= TOLERANCE * value || still;
        if good || cycle == cycles {
            return Ok(SpectralRadius { value, residual: found.residual, applications, converged: good });
        }
        before = value;
        x = found.restart;
    }
    unreachable!("the last cycle returns")
}

fn exact(value: f64, applications: usize) -> SpectralRadius {
    SpectralRadius { value, residual: 0.0, applications, converged: true }
}

/// An eigenvalue as an Arnoldi process finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RitzValue {
    /// The value.
    pub value: Complex<f64>,
    /// ‖E x − μ x‖ of its unit Ritz vector.
    pub residual: f64,
}

/// The `count` Ritz values of largest modulus, the largest first, of a linear map on N points: one Arnoldi process from a
/// seeded random start, as long as [`spectral_radius`] makes it at the most.
///
/// # Errors
/// If the projected eigenvalues are not found.
pub(super) fn outermost(n: usize, count: usize, step: &mut dyn FnMut(&mut [DVec3])) -> Result<Vec<RitzValue>> {
    if n == 0 {
        return Ok(Vec::new());
    }
    let room = (MEMORY / (24 * n)).max(FEWEST_VECTORS);
    let vectors = (WORK / (12 * n)).isqrt().clamp(VECTORS, MOST_VECTORS).min(room);
    // In one coordinate alone: of all three, rounding brings up every eigenvalue three times.
    let mut start = random(n);
    start.iter_mut().for_each(|v| *v = DVec3::new(v.x, 0.0, 0.0));
    normalize(&mut start);
    let krylov = krylov(start, vectors.min(n), CLOSED, step);
    let mut all = ritz_values(&krylov.projected)?;
    super::iteration_matrix::sort(&mut all);
    all.truncate(count);
    Ok(all.into_iter().map(|value| krylov.residual(value)).map(|(ritz, _)| ritz).collect())
}

/// A unit vector, the same each time.
fn random(n: usize) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(0x4172_6e6f);
    let mut x: Vec<DVec3> =
        (0..n).map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect();
    normalize(&mut x);
    x
}

struct Cycle {
    /// The Ritz value of largest modulus.
    ritz: Complex<f64>,
    residual: f64,
    steps: usize,
    /// The real part of its Ritz vector, unit.
    restart: Vec<DVec3>,
}

/// Takes from `w` its part in the span of the orthonormal `basis`, and gives the coefficients of that. Gram-Schmidt twice: once
/// is not enough where the space is nearly invariant; all coefficients at once, so that a piece of `w` stays at hand while the
/// basis goes by.
fn orthogonalize(w: &mut [DVec3], basis: &[Vec<DVec3>]) -> Vec<f64> {
    const CHUNK: usize = 1024;
    let mut coefficients = vec![0.0; basis.len()];
    for _ in 0..2 {
        let parts = parallel::map(w.len(), CHUNK, |range| -> Vec<f64> {
            basis.iter().map(|v| inner(&v[range.clone()], &w[range.clone()])).collect()
        });
        let mut sums = vec![0.0; basis.len()];
        for part in parts {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        parallel::chunks(w, CHUNK, |first, w| {
            for (v, &c) in basis.iter().zip(&sums) {
                for (w, v) in w.iter_mut().zip(&v[first..]) {
                    *w -= c * *v;
                }
            }
        });
        coefficients.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
    }
    coefficients
}

/// What an Arnoldi process leaves.
struct Krylov {
    /// Orthonormal.
    basis: Vec<Vec<DVec3>>,
    /// The matrix on their span, upper Hessenberg.
    projected: DMatrix<f64>,
    /// The length of the next vector.
    next: f64,
}

impl Krylov {
    /// A Ritz value with its residual, and the unit eigenvector of the projected matrix.
    fn residual(&self, value: Complex<f64>) -> (RitzValue, DVector<Complex<f64>>) {
        let y = eigenvector(&self.projected, value);
        let residual = self.next * y[y.len() - 1].norm();
        (RitzValue { value, residual }, y)
    }
}

/// An Arnoldi process from the unit vector `start`, until the next vector is no longer than `closed`.
fn krylov(start: Vec<DVec3>, vectors: usize, closed: f64, step: &mut dyn FnMut(&mut [DVec3])) -> Krylov {
    let mut basis = vec![start];
    let mut hessenberg = DMatrix::<f64>::zeros(vectors + 1, vectors);
    let mut next = 0.0;
    for k in 0..vectors {
        let mut w = basis[k].clone();
        step(&mut w);
        for (j, c) in orthogonalize(&mut w, &basis).into_iter().enumerate() {
            hessenberg[(j, k)] = c;
        }
        next = normalize(&mut w);
        hessenberg[(k + 1, k)] = next;
        if next <= closed || k + 1 == vectors {
            break;
        }
        basis.push(w);
    }
    let m = basis.len();
    Krylov { basis, projected: hessenberg.view((0, 0), (m, m)).into_owned(), next }
}

/// One Arnoldi process from the unit vector `start`, and where the next begins.
///
/// # Errors
/// If the eigenvalues of the projected matrix are not found.
fn arnoldi(start: Vec<DVec3>, vectors: usize, step: &mut dyn FnMut(&mut [DVec3])) -> Result<Cycle> {
    let krylov = krylov(start, vectors, 1e-14, step);
    let ritz = ritz_values(&krylov.projected)?
        .into_iter()
        .fold(Complex::new(0.0, 0.0), |best, z| if z.norm() > best.norm() { z } else { best });
    let (RitzValue { residual, .. }, y) = krylov.residual(ritz);
    let basis = krylov.basis;
    let mut restart = vec![DVec3::ZERO; basis[0].len()];
    for (v, c) in basis.iter().zip(y.iter()) {
        for (r, v) in restart.iter_mut().zip(v) {
            *r += c.re * *v;
        }
    }
    if normalize(&mut restart) <= 1e-8 {
        // The eigenvector came out as nearly imaginary.
        for (v, c) in basis.iter().zip(y.iter()) {
            for (r, v) in restart.iter_mut().zip(v) {
                *r += c.im * *v;
            }
        }
        normalize(&mut restart);
    }
    Ok(Cycle { ritz, residual, steps: basis.len(), restart })
}

/// The eigenvalues of a projected matrix. Where many are equal but for rounding, as at a tiny ω or on a mesh of like
/// components, the QR iterations of `nalgebra` may go on for ever: then by `faer`.
fn ritz_values(square: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    const ITERATIONS: usize = 1000;
    match small_eigenvalues(square.clone(), f64::EPSILON, ITERATIONS) {
        Some(values) => Ok(values),
        None => dense::unsymmetric_values(&Mat::from_fn(square.nrows(), square.ncols(), |i, j| square[(i, j)])),
    }
}

/// A unit eigenvector of the computed eigenvalue `z` by inverse iteration.
fn eigenvector(matrix: &DMatrix<f64>, z: Complex<f64>) -> DVector<Complex<f64>> {
    let m = matrix.nrows();
    // Off the eigenvalue by rounding, so that the factors exist.
    let shift = z + Complex::new(1e-14, 1e-14) * z.norm().max(f64::MIN_POSITIVE);
    let lu = small_complex_lu(DMatrix::from_fn(m, m, |i, j| {
        Complex::new(matrix[(i, j)], 0.0) - if i == j { shift } else { Complex::new(0.0, 0.0) }
    }));
    let mut y = DVector::from_element(m, Complex::new(1.0 / (m as f64).sqrt(), 0.0));
    for _ in 0..3 {
        if let Some(solved) = lu.solve(&y) {
            let norm = solved.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
            if norm.is_finite() && norm > 0.0 {
                y = solved.map(|z| z / norm);
            }
        }
    }
    y
}

fn inner(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn normalize(x: &mut [DVec3]) -> f64 {
    let norm = inner(x, x).sqrt();
    if norm > 0.0 {
        x.iter_mut().for_each(|v| *v /= norm);
    }
    norm
}
