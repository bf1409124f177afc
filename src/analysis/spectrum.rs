//! The ends of the spectra of A and D⁻¹A, dense for small systems and by Lanczos for large ones; what the data
//! excite of them; spectral radii of in-place sweeps.

use glam::DVec3;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{dense, lanczos};
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::solvers::System;

/// The smallest and the largest eigenvalue of a matrix with a real spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    pub min: f64,
    pub max: f64,
}

impl Extremes {
    /// max |1 − ωλ| over the interval: the rate of relaxation by ω.
    pub fn radius(self, omega: f64) -> f64 {
        (1.0 - omega * self.min)
            .abs()
            .max((1.0 - omega * self.max).abs())
    }

    /// 2/(λ_min + λ_max), where the rate is best.
    pub fn optimal_omega(self) -> f64 {
        2.0 / (self.min + self.max)
    }

    /// 2/λ_max, beyond which relaxation diverges.
    pub fn critical_omega(self) -> f64 {
        2.0 / self.max
    }

    /// κ = λ_max/λ_min.
    pub fn condition(self) -> f64 {
        self.max / self.min
    }

    /// The factor per iteration of Chebyshev iteration and conjugate gradients: (√κ − 1)/(√κ + 1); 1 for a
    /// singular matrix, whose smallest eigenvalue rounding may make negative.
    pub fn krylov_rate(self) -> f64 {
        if self.min <= 0.0 {
            return 1.0;
        }
        let root = self.condition().sqrt();
        (root - 1.0) / (root + 1.0)
    }
}

/// The ends of the spectra of A and of D⁻¹A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    pub a: Extremes,
    pub jacobi: Extremes,
}

/// Which of two similar matrices a symmetric operator diag(s) M diag(s) stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// A: s = √h.
    A,
    /// D⁻¹A: s = 1/√m_ii.
    Jacobi,
}

/// Residual bound at which Lanczos estimates stop: the values themselves are then good to about its square over
/// the gap to the next eigenvalue.
const RESIDUAL: f64 = 1e-7;
/// Lanczos steps at most.
const STEPS: usize = 240;
/// Weight of a Ritz value in the data below which a mode does not count as excited: amplitude 10⁻¹⁰ of the whole.
const EXCITED: f64 = 1e-20;

/// The ends of both spectra: dense up to [`dense::LARGEST`] vertices, else Lanczos from a random start (seeded).
///
/// # Errors
/// If an eigenvalue computation does not converge.
pub fn spectrum(system: &LimitSystem) -> Result<Spectrum> {
    if system.len() <= dense::LARGEST {
        let all = dense::eigenvalues(system)?;
        return Ok(Spectrum {
            a: ends(&all.a),
            jacobi: ends(&all.jacobi),
        });
    }
    let mut rng = ChaCha8Rng::seed_from_u64(0x5370_6563);
    let start: Vec<f64> = (0..system.len())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    Ok(Spectrum {
        a: krylov(system, Operator::A, start.clone(), 0.0)?,
        jacobi: krylov(system, Operator::Jacobi, start, 0.0)?,
    })
}

/// The ends of the part of the spectrum that the run from V = P excites: Lanczos from the first differences
/// e₀ = (I − A) P, which meets only eigenvectors that e₀ has a part in. `None` if e₀ vanishes.
///
/// # Errors
/// If an eigenvalue computation does not converge.
///
/// # Panics
/// If there is not one point a vertex.
pub fn excited(
    system: &LimitSystem,
    points: &[DVec3],
    operator: Operator,
) -> Result<Option<Extremes>> {
    let e: Vec<DVec3> = (0..system.len())
        .map(|i| points[i] - system.row(i, points))
        .collect();
    let largest = e.iter().fold(0.0f64, |m, e| m.max(e.abs().max_element()));
    let scale = scales(system, operator);
    let mut found: Option<Extremes> = None;
    for axis in 0..3 {
        // The residual H⁻¹e of the symmetric system in the operator's coordinates.
        let start: Vec<f64> = e
            .iter()
            .zip(&scale)
            .zip(&system.h)
            .map(|((e, s), h)| s * e[axis] / h)
            .collect();
        if e.iter().all(|e| e[axis].abs() <= 1e-12 * largest) {
            continue;
        }
        let here = krylov(system, operator, start, EXCITED)?;
        found = Some(match found {
            None => here,
            Some(f) => Extremes {
                min: f.min.min(here.min),
                max: f.max.max(here.max),
            },
        });
    }
    Ok(found)
}

fn ends(ascending: &[f64]) -> Extremes {
    let nan = f64::NAN;
    Extremes {
        min: ascending.first().copied().unwrap_or(nan),
        max: ascending.last().copied().unwrap_or(nan),
    }
}

fn scales(system: &LimitSystem, operator: Operator) -> Vec<f64> {
    match operator {
        Operator::A => system.h.iter().map(|h| h.sqrt()).collect(),
        // m_ii = a_ii/h_i
        Operator::Jacobi => system
            .diagonal
            .iter()
            .zip(&system.h)
            .map(|(a, h)| (h / a).sqrt())
            .collect(),
    }
}

fn krylov(
    system: &LimitSystem,
    operator: Operator,
    start: Vec<f64>,
    least_weight: f64,
) -> Result<Extremes> {
    let s = scales(system, operator);
    let mut scaled = vec![0.0; system.len()];
    let apply = |x: &[f64], y: &mut [f64]| {
        for ((t, x), s) in scaled.iter_mut().zip(x).zip(&s) {
            *t = s * x;
        }
        y.par_iter_mut()
            .with_min_len(4096)
            .enumerate()
            .for_each(|(i, y)| *y = s[i] * system.m.row_times_scalar(i, &scaled));
    };
    let limits = lanczos::Limits {
        tolerance: RESIDUAL,
        max_steps: STEPS,
    };
    let (low, high) = lanczos::extremes(apply, start, limits, least_weight)?;
    Ok(Extremes {
        min: low.value,
        max: high.value,
    })
}

/// Steps of the power method before [`sweep_radius`] starts its Arnoldi process, and the size of that.
const WARM_UP: usize = 30;
const ARNOLDI: usize = 40;

/// The spectral radius of the error matrix of a linear iteration that is not symmetric (Gauss-Seidel, SOR): dense
/// for small systems, else the largest Ritz value of an Arnoldi process on the three coordinates together, from a
/// seeded random start. `step` replaces V by the next iterate for P = 0. 70 steps, 40 vectors of 3N numbers.
///
/// # Errors
/// If the dense computation does not converge.
pub fn sweep_radius(system: &LimitSystem, mut step: impl FnMut(&mut [DVec3])) -> Result<f64> {
    let n = system.len();
    if n <= dense::LARGEST / 2 {
        return dense::spectral_radius(system, step);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(0x4172_6e6f);
    let mut x: Vec<DVec3> = (0..n)
        .map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0))))
        .collect();
    let inner = |a: &[DVec3], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
    let normalize = |x: &mut [DVec3]| -> f64 {
        let norm = inner(x, x).sqrt();
        x.iter_mut().for_each(|v| *v /= norm);
        norm
    };
    for _ in 0..WARM_UP {
        step(&mut x);
        normalize(&mut x);
    }
    let mut basis = vec![x];
    let mut hessenberg = DMatrix::<f64>::zeros(ARNOLDI, ARNOLDI);
    for k in 0..ARNOLDI {
        let mut w = basis[k].clone();
        step(&mut w);
        // Gram-Schmidt twice: once is not enough where the space is nearly invariant.
        for _ in 0..2 {
            for (j, v) in basis.iter().enumerate() {
                let c = inner(v, &w);
                hessenberg[(j, k)] += c;
                for (w, v) in w.iter_mut().zip(v) {
                    *w -= c * *v;
                }
            }
        }
        if k + 1 == ARNOLDI {
            break;
        }
        let norm = normalize(&mut w);
        if norm <= 1e-14 {
            let used = hessenberg.view((0, 0), (k + 1, k + 1)).into_owned();
            return Ok(largest_modulus(used));
        }
        hessenberg[(k + 1, k)] = norm;
        basis.push(w);
    }
    Ok(largest_modulus(hessenberg))
}

fn largest_modulus(matrix: DMatrix<f64>) -> f64 {
    matrix
        .complex_eigenvalues()
        .iter()
        .map(|z| z.re.hypot(z.im))
        .fold(0.0, f64::max)
}
