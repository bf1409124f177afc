//! The ends of the spectra of A and D⁻¹A, dense for small systems and by Lanczos for large ones; what the data
//! excite of them; spectral radii of in-place sweeps.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{dense, lanczos};
use crate::assemble::{Csr, LimitSystem};
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

/// Relative accuracy of λ_min and λ_max.
const ACCURACY: f64 = 1e-9;
/// Lanczos steps at most: enough for the gap 10⁻⁶ of a regular grid of a million vertices.
const STEPS: usize = 8000;
/// The same for what the data excite, which no proof rests on.
const STEPS_DATA: usize = 240;
/// Weight of a Ritz value in the data below which a mode does not count as excited: amplitude 10⁻¹⁰ of the whole.
const EXCITED: f64 = 1e-20;

/// An end of a spectrum and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub value: f64,
    /// ‖S x − λ x‖₂ of a unit vector x: an eigenvalue lies within this distance of the value.
    pub residual: f64,
    /// The estimated error of the value as the end of the spectrum.
    pub error: f64,
    pub source: Source,
}

/// How a value was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// All eigenvalues were computed.
    Dense,
    /// A vector attains a proven bound.
    Proven,
    /// The Lanczos process.
    Lanczos,
    /// The Lanczos process, which did not reach its accuracy in the steps allowed.
    Unconverged,
}

impl Source {
    pub fn name(self) -> &'static str {
        match self {
            Source::Dense => "dense",
            Source::Proven => "proven",
            Source::Lanczos => "lanczos",
            Source::Unconverged => "unconverged",
        }
    }
}

/// The four ends of the spectra of A and D⁻¹A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    pub lambda_min: Estimate,
    pub lambda_max: Estimate,
    pub jacobi_lambda_min: Estimate,
    pub jacobi_lambda_max: Estimate,
    /// Products of a matrix with one vector; 0 where all was dense.
    pub applications: usize,
}

impl Ends {
    /// The values alone.
    pub fn spectrum(&self) -> Spectrum {
        let pair = |min: Estimate, max: Estimate| Extremes {
            min: min.value,
            max: max.value,
        };
        Spectrum {
            a: pair(self.lambda_min, self.lambda_max),
            jacobi: pair(self.jacobi_lambda_min, self.jacobi_lambda_max),
        }
    }

    pub fn converged(&self) -> bool {
        [
            self.lambda_min,
            self.lambda_max,
            self.jacobi_lambda_min,
            self.jacobi_lambda_max,
        ]
        .iter()
        .all(|e| e.source != Source::Unconverged)
    }
}

/// The values of [`ends`].
///
/// # Errors
/// If an eigenvalue computation does not converge.
pub fn spectrum(system: &LimitSystem) -> Result<Spectrum> {
    Ok(ends(system)?.spectrum())
}

/// The ends of both spectra with their errors, to 1e-9 relative.
///
/// Up to [`dense::LARGEST`] vertices all eigenvalues are computed. Beyond, a vector that attains a proven bound
/// settles an end at once: the constant one, and the ±1 colouring by breadth-first levels (regular grids); the other
/// ends come from Lanczos processes with a seeded random start. Time: some hundred products with the matrix where
/// the end is separated, up to 8000 where it is the edge of a dense band (then `Source::Unconverged` may be the
/// answer). Memory: one matrix and three vectors beside the system.
///
/// # Errors
/// If a dense computation does not converge.
pub fn ends(system: &LimitSystem) -> Result<Ends> {
    if system.len() <= dense::LARGEST {
        let all = dense::eigenvalues(system)?;
        let (a, jacobi) = (dense_ends(&all.a), dense_ends(&all.jacobi));
        return Ok(Ends {
            lambda_min: a.0,
            lambda_max: a.1,
            jacobi_lambda_min: jacobi.0,
            jacobi_lambda_max: jacobi.1,
            applications: 0,
        });
    }
    let b = &system.bounds;
    let signs = alternating(&system.m);
    let constant = vec![1.0; system.len()];
    let a = operator_ends(
        system,
        Operator::A,
        &[(b.lambda_min, &signs), (b.lambda_max, &constant)],
    )?;
    let jacobi = operator_ends(
        system,
        Operator::Jacobi,
        &[
            (b.jacobi_lambda_min, &signs),
            (b.jacobi_lambda_max, &constant),
        ],
    )?;
    Ok(Ends {
        lambda_min: a.0,
        lambda_max: a.1,
        jacobi_lambda_min: jacobi.0,
        jacobi_lambda_max: jacobi.1,
        applications: a.2 + jacobi.2,
    })
}

fn dense_ends(ascending: &[f64]) -> (Estimate, Estimate) {
    let nan = f64::NAN;
    let scale = ascending.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    // Backward stable: the error is a small multiple of ε‖S‖.
    let error = 8.0 * f64::EPSILON * scale;
    let estimate = |value: Option<&f64>| Estimate {
        value: value.copied().unwrap_or(nan),
        residual: error,
        error,
        source: Source::Dense,
    };
    (estimate(ascending.first()), estimate(ascending.last()))
}

/// Both ends of one operator, and the products made. `attained` pairs the proven bounds of the lower and the upper
/// end with vectors, in the coordinates of A, that may attain them.
fn operator_ends(
    system: &LimitSystem,
    operator: Operator,
    attained: &[(f64, &[f64]); 2],
) -> Result<(Estimate, Estimate, usize)> {
    let s = symmetric(system, operator);
    let scale = scales(system, operator);
    let mut applications = 0;
    let [low, high] = attained.map(|(bound, v)| {
        applications += 1;
        let x: Vec<f64> = v.iter().zip(&scale).map(|(v, s)| v / s).collect();
        let (value, residual) = rayleigh(&s, &x);
        // Within rounding of the bound, as a value and as an eigenvector.
        let rounding = 64.0 * f64::EPSILON;
        let attains = (value - bound).abs() <= rounding && residual <= rounding.sqrt() * 1e-3;
        attains.then_some(Estimate {
            value,
            residual,
            error: rounding,
            source: Source::Proven,
        })
    });
    if let (Some(low), Some(high)) = (low, high) {
        return Ok((low, high, applications));
    }
    let limits = lanczos::Limits {
        tolerance: ACCURACY,
        max_steps: STEPS,
        least_weight: 0.0,
        ends: match (low, high) {
            (Some(_), _) => lanczos::Wanted::Highest,
            (_, Some(_)) => lanczos::Wanted::Lowest,
            _ => lanczos::Wanted::Both,
        },
    };
    let mut rng = ChaCha8Rng::seed_from_u64(0x5370_6563);
    let start: Vec<f64> = (0..system.len())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let run = lanczos::extremes(&s, start, limits)?;
    applications += run.steps;
    let estimate = |r: lanczos::Ritz| Estimate {
        value: r.value,
        residual: r.residual,
        error: r.error,
        source: if run.converged {
            Source::Lanczos
        } else {
            Source::Unconverged
        },
    };
    Ok((
        low.unwrap_or_else(|| estimate(run.low)),
        high.unwrap_or_else(|| estimate(run.high)),
        applications,
    ))
}

/// The Rayleigh quotient of x and the residual of x/‖x‖.
pub fn rayleigh(s: &Csr, x: &[f64]) -> (f64, f64) {
    let image: Vec<f64> = (0..s.len())
        .into_par_iter()
        .with_min_len(4096)
        .map(|i| s.row_times_scalar(i, x))
        .collect();
    let square: f64 = x.iter().map(|x| x * x).sum();
    let value = x.iter().zip(&image).map(|(x, y)| x * y).sum::<f64>() / square;
    let residual: f64 = x
        .iter()
        .zip(&image)
        .map(|(x, y)| (y - value * x).powi(2))
        .sum();
    (value, (residual / square).sqrt())
}

/// A sign for every vertex, alternating along the heaviest couplings of each row in a breadth-first search: the
/// two-colouring of the edges' graph on quads, where an edge couples four times as much as a face's diagonal.
fn alternating(m: &Csr) -> Vec<f64> {
    let mut sign = vec![0.0; m.len()];
    let mut queue: Vec<u32> = Vec::with_capacity(m.len());
    for seed in 0..m.len() {
        if sign[seed] != 0.0 {
            continue;
        }
        sign[seed] = 1.0;
        let mut next = queue.len();
        queue.push(seed as u32);
        while let Some(&i) = queue.get(next) {
            next += 1;
            let i = i as usize;
            let others = || m.row(i).filter(|&(j, _)| j != i);
            let heaviest = others().fold(0.0f64, |most, (_, v)| most.max(v));
            for (j, v) in others() {
                if sign[j] == 0.0 && v > 0.5 * heaviest {
                    sign[j] = -sign[i];
                    queue.push(j as u32);
                }
            }
        }
    }
    sign
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
    let s = symmetric(system, operator);
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
        let limits = lanczos::Limits {
            tolerance: ACCURACY,
            max_steps: STEPS_DATA,
            least_weight: EXCITED,
            ends: lanczos::Wanted::Both,
        };
        let run = lanczos::extremes(&s, start, limits)?;
        let here = Extremes {
            min: run.low.value,
            max: run.high.value,
        };
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

/// The symmetric matrix diag(s) M diag(s) that is similar to A or D⁻¹A. An eigenvector x of it makes the eigenvector
/// diag(s) x of the other.
pub fn symmetric(system: &LimitSystem, operator: Operator) -> Csr {
    system.m.scale_symmetrically(&scales(system, operator))
}

/// diag s of the [`symmetric`] matrix.
pub fn scales(system: &LimitSystem, operator: Operator) -> Vec<f64> {
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
