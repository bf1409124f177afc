//! The ends of the spectra of A and D⁻¹A, dense for small systems and by Lanczos for large ones; what the data
//! excite of them; spectral radii of in-place sweeps.

use chacha20::ChaCha8Rng;
use glam::DVec3;
use rand::{RngExt, SeedableRng};

use super::dirichlet_neumann::{alternation_is_all, bracket};
use super::inertia::inertia;
use super::lanczos::{Matrix, SelfAdjoint, rayleigh};
use super::singularity::{ZERO, colour};
use super::subspace_iteration::End;
use super::symmetric::{SymmetricForm, symmetric};
use super::{dense, lanczos};
use crate::assemble::bounds::SpectralBounds;
use crate::assemble::{Csr, LimitSystem};
use crate::error::Result;
use crate::mesh::Surface;
use crate::mesh::breadth_first::in_fronts;
use crate::schemes::Scheme;
use crate::solvers::System;
use crate::solvers::system::Rows;

/// The smallest and the largest eigenvalue of a matrix with a real spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    /// λ_min; for a singular matrix rounding may make it slightly negative.
    pub min: f64,
    /// λ_max.
    pub max: f64,
}

impl Extremes {
    /// max |1 − ωλ| over the interval: the rate of relaxation by ω.
    pub fn radius(self, omega: f64) -> f64 {
        (1.0 - omega * self.min).abs().max((1.0 - omega * self.max).abs())
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
    /// Of A, which decides PIA, Chebyshev, the heavy ball and conjugate gradients.
    pub a: Extremes,
    /// Of D⁻¹A, D = diag A, which decides Jacobi relaxation and preconditioning by the diagonal.
    pub jacobi: Extremes,
}

/// What is computed of the spectra of A and of D⁻¹A: it settles parameters that methods leave open, and predicts rates.
pub trait Spectra {
    /// max |1 − ωλ| over the eigenvalues of the matrix of `form`: the rate of relaxation by ω. `None` if too little of them is
    /// known.
    fn radius(&self, form: SymmetricForm, omega: f64) -> Option<f64>;

    /// Where that is least.
    fn optimal_omega(&self, form: SymmetricForm) -> f64;

    /// Where that is 1, beyond which relaxation diverges.
    fn critical_omega(&self, form: SymmetricForm) -> f64;

    /// The ends of the real parts of the eigenvalues.
    fn ends(&self, form: SymmetricForm) -> Extremes;

    /// The spectra themselves, where they are real: what methods need that are made for an interval.
    fn real(&self) -> Option<&Spectrum>;

    /// The ends of what a run from `start` [excites](excited) of the spectrum, where that is real.
    ///
    /// # Errors
    /// If an eigenvalue computation does not converge.
    fn excited(
        &self,
        system: &impl System,
        data: (&[DVec3], &[DVec3]),
        form: SymmetricForm,
    ) -> Result<Option<Extremes>>;
}

impl Spectra for Spectrum {
    fn radius(&self, form: SymmetricForm, omega: f64) -> Option<f64> {
        Some(self.ends(form).radius(omega))
    }

    fn optimal_omega(&self, form: SymmetricForm) -> f64 {
        self.ends(form).optimal_omega()
    }

    fn critical_omega(&self, form: SymmetricForm) -> f64 {
        self.ends(form).critical_omega()
    }

    fn ends(&self, form: SymmetricForm) -> Extremes {
        match form {
            SymmetricForm::A => self.a,
            SymmetricForm::Jacobi => self.jacobi,
        }
    }

    fn real(&self) -> Option<&Spectrum> {
        Some(self)
    }

    fn excited(
        &self,
        system: &impl System,
        data: (&[DVec3], &[DVec3]),
        form: SymmetricForm,
    ) -> Result<Option<Extremes>> {
        excited(system, data, form)
    }
}

/// Relative accuracy of λ_min and λ_max.
const ACCURACY: f64 = 1e-9;
/// Vertices up to which the eigenvalues at an end that Lanczos found are counted by factorizations of the whole matrix.
const COUNTED: usize = 20_000;
/// Lanczos steps at most: enough for the gap 10⁻⁶ of a regular grid of a million vertices.
const STEPS: usize = 8000;
/// The same for what the data excite, which no proof rests on.
const STEPS_DATA: usize = 240;
/// Weight of a Ritz value in the data below which a mode does not count as excited: amplitude 10⁻¹⁰ of the whole.
const EXCITED: f64 = 1e-20;

/// An end of a spectrum and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The computed eigenvalue.
    pub value: f64,
    /// ‖S x − λ x‖₂ of a unit vector x: an eigenvalue lies within this distance of the value.
    pub residual: f64,
    /// The estimated error of the value as the end of the spectrum.
    pub error: f64,
    /// How it was found, and so how far to trust it.
    pub source: Source,
    /// `None` where it was not decided.
    pub multiplicity: Option<Multiplicity>,
}

/// How many eigenvalues are equal to an end of the spectrum, where that was decided: among all eigenvalues, by
/// proof, or by counts, which rounding moves by [`LARGEST_BACKWARD_ERROR`](super::inertia::LARGEST_BACKWARD_ERROR) at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiplicity {
    /// Equal eigenvalues at the end of the spectrum.
    pub count: usize,
    /// What counts as equal: relative to the value.
    pub within: f64,
}

/// How a value was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// All eigenvalues were computed.
    Dense,
    /// A vector attains a proven bound.
    Proven,
    /// Proven bounds on both sides, around a few exceptional vertices ([`bracket`]).
    Bracketed,
    /// The Lanczos process.
    Lanczos,
    /// The Lanczos process, which did not reach its accuracy in the steps allowed.
    Unconverged,
}

impl Source {
    /// One word in lower case, for output.
    pub fn name(self) -> &'static str {
        match self {
            Source::Dense => "dense",
            Source::Proven => "proven",
            Source::Bracketed => "bracketed",
            Source::Lanczos => "lanczos",
            Source::Unconverged => "unconverged",
        }
    }
}

/// The four ends of the spectra of A and D⁻¹A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectrumEnds {
    /// The least eigenvalue of A.
    pub lambda_min: Estimate,
    /// The greatest eigenvalue of A.
    pub lambda_max: Estimate,
    /// The least eigenvalue of D⁻¹A.
    pub jacobi_lambda_min: Estimate,
    /// The greatest eigenvalue of D⁻¹A.
    pub jacobi_lambda_max: Estimate,
    /// Products of a matrix with one vector; 0 where all was dense.
    pub applications: usize,
}

impl SpectrumEnds {
    /// The values alone.
    pub fn spectrum(&self) -> Spectrum {
        let pair = |min: Estimate, max: Estimate| Extremes { min: min.value, max: max.value };
        Spectrum {
            a: pair(self.lambda_min, self.lambda_max),
            jacobi: pair(self.jacobi_lambda_min, self.jacobi_lambda_max),
        }
    }

    fn each(&mut self) -> [(SymmetricForm, End, &mut Estimate); 4] {
        [
            (SymmetricForm::A, End::Lowest, &mut self.lambda_min),
            (SymmetricForm::A, End::Highest, &mut self.lambda_max),
            (SymmetricForm::Jacobi, End::Lowest, &mut self.jacobi_lambda_min),
            (SymmetricForm::Jacobi, End::Highest, &mut self.jacobi_lambda_max),
        ]
    }

    /// Whether no end is [`Source::Unconverged`].
    pub fn converged(&self) -> bool {
        [self.lambda_min, self.lambda_max, self.jacobi_lambda_min, self.jacobi_lambda_max]
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
/// ends come from Lanczos processes with a seeded random start. [`mesh_ends`] is faster on large meshes, and knows
/// more multiplicities. Time: some hundred products with the matrix where
/// the end is separated, up to 8000 where it is the edge of a dense band (then `Source::Unconverged` may be the
/// answer). Memory: one matrix and three vectors beside the system.
///
/// # Errors
/// If a dense computation does not converge.
pub fn ends(system: &LimitSystem) -> Result<SpectrumEnds> {
    if system.len() <= dense::LARGEST {
        let all = dense::eigenvalues(system)?;
        let (a, jacobi) = (dense_ends(&all.a), dense_ends(&all.jacobi));
        return Ok(SpectrumEnds {
            lambda_min: a.0,
            lambda_max: a.1,
            jacobi_lambda_min: jacobi.0,
            jacobi_lambda_max: jacobi.1,
            applications: 0,
        });
    }
    let components = components(&system.m);
    let known = Known {
        bounds: system.bounds,
        signs: alternating(&system.m),
        alternation_is_all: false,
        components: system.m.values().iter().all(|&v| v >= 0.0).then_some(components),
    };
    known.ends(system, |_, _| Ok(None))
}

/// As [`ends`], for large meshes: the matrix is not stored; an end that belongs to modes around a few exceptional
/// vertices is enclosed there ([`bracket`]), with its multiplicity; other ends come from Lanczos
/// processes on the [`Operator`](crate::assemble::Operator) in an order of its own. Up to 20 000 vertices the
/// eigenvalues at these are counted, and none is missed beyond, by factorizations of the whole matrix.
///
/// Memory: the operator and four vectors; the factor of a small mesh.
///
/// # Errors
/// As [`LimitSystem::new`]; if an eigenvalue computation does not converge.
///
/// ```
/// use limitlab::analysis::spectrum::{Source, mesh_ends};
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
///
/// let surface = Surface::new(builtin::builtin("quad-sphere:7")?)?;
/// let ends = mesh_ends(&surface, Scheme::CatmullClark)?;
/// assert_eq!(ends.lambda_min.multiplicity.map(|m| m.count), Some(8));
/// assert_eq!(ends.lambda_max.source, Source::Proven);
/// assert_eq!(ends.lambda_max.multiplicity.map(|m| m.count), Some(1));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn mesh_ends(surface: &Surface, scheme: Scheme) -> Result<SpectrumEnds> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    if mesh.len() <= dense::LARGEST {
        return ends(&LimitSystem::new(surface, scheme)?);
    }
    let fronts = in_fronts(surface.faces(), surface.incidence());
    let operator = crate::assemble::Operator::in_order(surface, scheme, Some(&fronts))?;
    let signs: Vec<f64> = colour(surface).into_iter().map(f64::from).collect();
    let known = Known {
        bounds: operator.bounds(),
        signs: fronts.there(&signs),
        alternation_is_all: alternation_is_all(&mesh.faces, scheme),
        components: Some(topology.components(&mesh.faces).1),
    };
    let mut ends = known.ends(&operator, |which, end| {
        let found = bracket(surface, scheme, which, end, ACCURACY)?;
        Ok(found.map(|found| Estimate {
            value: found.value,
            residual: found.width,
            error: found.width,
            source: Source::Bracketed,
            multiplicity: Some(Multiplicity { count: found.multiplicity, within: found.width / found.value.abs() }),
        }))
    })?;
    if mesh.len() <= COUNTED {
        let mut system = None;
        for (which, end, estimate) in ends.each() {
            if estimate.source == Source::Lanczos && estimate.multiplicity.is_none() {
                let system = match &system {
                    Some(system) => system,
                    None => system.insert(LimitSystem::new(surface, scheme)?),
                };
                count(&symmetric(system, which), end, estimate);
            }
        }
    }
    Ok(ends)
}

/// Counts the eigenvalues at an end that Lanczos has found, and those beyond, which it has missed if there are any.
/// Leaves the estimate as it is if a factorization is not stable.
fn count(s: &Csr, end: End, estimate: &mut Estimate) {
    let within = 2.0 * ACCURACY;
    let slack = (within * estimate.value.abs()).max(ZERO);
    let below = |sigma: f64| inertia(s, sigma).ok().map(|i| i.below);
    let (lower, upper) = rayon::join(|| below(estimate.value - slack), || below(estimate.value + slack));
    if let (Some(lower), Some(upper)) = (lower, upper) {
        let beyond = match end {
            End::Lowest => lower,
            End::Highest => s.len() - upper,
        };
        if beyond > 0 {
            estimate.source = Source::Unconverged;
        } else {
            let count = upper - lower;
            estimate.multiplicity = Some(Multiplicity { count, within });
        }
    }
}

fn dense_ends(ascending: &[f64]) -> (Estimate, Estimate) {
    let scale = ascending.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    // Backward stable: the error is a small multiple of ε‖S‖.
    let error = 8.0 * f64::EPSILON * scale;
    let estimate = |value: Option<&f64>| {
        // A matrix without rows is an identity, of which 1 is proven too.
        let value = value.copied().unwrap_or(1.0);
        let equal = |x: &&f64| (*x - value).abs() <= ACCURACY * value.abs() + error;
        Estimate {
            value,
            residual: error,
            error,
            source: Source::Dense,
            multiplicity: Some(Multiplicity { count: ascending.iter().filter(equal).count(), within: ACCURACY }),
        }
    };
    (estimate(ascending.first()), estimate(ascending.last()))
}

/// What is known of a system before any iteration.
struct Known {
    bounds: SpectralBounds,
    /// ±1 at every vertex: what may attain the lower bounds. The constant vector may attain the upper ones.
    signs: Vec<f64>,
    /// Whether nothing else attains the lower bounds on a connected mesh.
    alternation_is_all: bool,
    /// The number of components of a matrix without negative entries; `None` for others.
    components: Option<usize>,
}

impl Known {
    /// The ends of both operators; `enclose` may know an end that attains no bound.
    fn ends<T: System>(
        &self,
        system: &T,
        enclose: impl Fn(SymmetricForm, End) -> Result<Option<Estimate>>,
    ) -> Result<SpectrumEnds> {
        let b = &self.bounds;
        let mut applications = 0;
        let a = self.operator_ends(
            &Matrix { system, which: SymmetricForm::A },
            (b.lambda_min, b.lambda_max),
            b.lambda_max,
            &enclose,
            &mut applications,
        )?;
        let jacobi = self.operator_ends(
            &Matrix { system, which: SymmetricForm::Jacobi },
            (b.jacobi_lambda_min, b.jacobi_lambda_max),
            // D⁻¹A has a diagonal of ones, whatever the scale of A.
            1.0,
            &enclose,
            &mut applications,
        )?;
        Ok(SpectrumEnds {
            lambda_min: a.0,
            lambda_max: a.1,
            jacobi_lambda_min: jacobi.0,
            jacobi_lambda_max: jacobi.1,
            applications,
        })
    }

    /// Both ends of one operator of eigenvalues of size `scale`: by a vector that attains a proven bound, else enclosed,
    /// else by Lanczos, where a less accurate enclosure may still tell the multiplicity.
    fn operator_ends<T: System>(
        &self,
        matrix: &Matrix<'_, T>,
        (least, greatest): (f64, f64),
        scale: f64,
        enclose: &impl Fn(SymmetricForm, End) -> Result<Option<Estimate>>,
        applications: &mut usize,
    ) -> Result<(Estimate, Estimate)> {
        let exactly = |count| Multiplicity { count, within: 0.0 };
        let mut attained = |bound: f64, x: &[f64], multiplicity| {
            *applications += 1;
            let (value, residual) = rayleigh(matrix, x);
            // Within rounding of the bound, as a value and as an eigenvector.
            let relative = 64.0 * f64::EPSILON;
            let rounding = relative * scale;
            let attains = (value - bound).abs() <= rounding && residual <= relative.sqrt() * 1e-3 * scale;
            attains.then_some(Estimate { value, residual, error: rounding, source: Source::Proven, multiplicity })
        };
        let once = self.components.map(exactly);
        let low = attained(least, &self.signs, once.filter(|_| self.alternation_is_all));
        // Where no entry is negative, a positive eigenvector belongs to the largest eigenvalue, once in each component
        // (Perron, Frobenius).
        let constant = vec![1.0; self.signs.len()];
        let high = attained(greatest, &constant, once);
        let mut iterate = |end: End, known: Option<Estimate>| -> Result<Estimate> {
            if let Some(known) = known {
                return Ok(known);
            }
            let enclosed = enclose(matrix.which, end)?;
            if let Some(enclosed) = enclosed.filter(|e| e.error <= 1.01 * ACCURACY * e.value.abs()) {
                return Ok(enclosed);
            }
            let ends = match end {
                End::Lowest => lanczos::Wanted::Lowest,
                End::Highest => lanczos::Wanted::Highest,
            };
            let start = if end == End::Highest && self.components.is_some() {
                // Positive, so with a part in the positive eigenvector that belongs to the largest eigenvalue of each
                // component; and of all the symmetries that this one has, which leaves fewer values near it.
                constant.clone()
            } else {
                let mut rng = ChaCha8Rng::seed_from_u64(0x5370_6563);
                std::iter::repeat_with(|| rng.random_range(-1.0..1.0)).take(matrix.len()).collect()
            };
            let limits = lanczos::LanczosLimits { tolerance: ACCURACY, max_steps: STEPS, least_weight: 0.0, ends };
            let run = lanczos::extremes(matrix, start, limits)?;
            *applications += run.steps;
            let found = match end {
                End::Lowest => run.low,
                End::Highest => run.high,
            };
            Ok(Estimate {
                value: found.value,
                residual: found.residual,
                error: found.error,
                source: if run.converged { Source::Lanczos } else { Source::Unconverged },
                multiplicity: enclosed.and_then(|e| e.multiplicity),
            })
        };
        Ok((iterate(End::Lowest, low)?, iterate(End::Highest, high)?))
    }
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

/// The number of sets of rows that no entry couples to each other.
fn components(m: &Csr) -> usize {
    let mut count = 0;
    let mut seen = vec![false; m.len()];
    let mut waiting = Vec::new();
    for seed in 0..m.len() {
        if seen[seed] {
            continue;
        }
        seen[seed] = true;
        count += 1;
        waiting.push(seed);
        while let Some(i) = waiting.pop() {
            for (j, _) in m.row(i).filter(|e| e.1 != 0.0) {
                if !std::mem::replace(&mut seen[j], true) {
                    waiting.push(j);
                }
            }
        }
    }
    count
}

/// The ends of the part of the spectrum that the run of A V = `points` from V = `start` excites: Lanczos from the first
/// residual, which meets only eigenvectors that it has a part in. `None` if it vanishes.
///
/// # Errors
/// If an eigenvalue computation does not converge.
///
/// # Panics
/// If there is not one point a vertex.
pub fn excited(
    system: &impl System,
    (points, start): (&[DVec3], &[DVec3]),
    form: SymmetricForm,
) -> Result<Option<Extremes>> {
    let n = points.len();
    let mut e = vec![DVec3::ZERO; n];
    let errors = Rows::new(n).residual(system, points, start, &mut e, |_, e, out, _| *out = e);
    let largest = errors.errors.max;
    let matrix = Matrix { system, which: form };
    let mut found: Option<Extremes> = None;
    for axis in 0..3 {
        if e.iter().all(|e| e[axis].abs() <= 1e-12 * largest) {
            continue;
        }
        // The residual of A V = P, or of D⁻¹A V = D⁻¹P.
        let start: Vec<f64> = match form {
            SymmetricForm::A => e.iter().map(|e| e[axis]).collect(),
            SymmetricForm::Jacobi => e.iter().zip(system.diagonal()).map(|(e, a)| e[axis] / a).collect(),
        };
        let limits = lanczos::LanczosLimits {
            tolerance: ACCURACY,
            max_steps: STEPS_DATA,
            least_weight: EXCITED,
            ends: lanczos::Wanted::Both,
        };
        let run = lanczos::extremes(&matrix, start, limits)?;
        let here = Extremes { min: run.low.value, max: run.high.value };
        found = Some(match found {
            None => here,
            Some(f) => Extremes { min: f.min.min(here.min), max: f.max.max(here.max) },
        });
    }
    Ok(found)
}
