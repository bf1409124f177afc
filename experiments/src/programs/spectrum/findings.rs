//! What there is to find of the spectrum of one system: computed ends, proven bounds, certificates, rates.

use glam::DVec3;

use super::Arguments;
use crate::cli::{Given, Input, Progress};
use crate::studies::complex_spectrum::radii_of_sweeps;
use limitlab::Result;
use limitlab::analysis::a_priori::{IterationCounts, Promise};
use limitlab::analysis::dense;
use limitlab::analysis::inertia::{Certificate, certify};
use limitlab::analysis::singularity::{Singularity, SlowModes, modes};
use limitlab::analysis::spectral_radius::SpectralRadius;
use limitlab::analysis::spectrum::{Estimate, Extremes, Spectrum, SpectrumEnds, ends, excited, mesh_ends};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::assemble::bounds::SpectralBounds;
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::solvers::direct::SINGULAR;
use limitlab::solvers::{Method, Stop, System};

/// How near the ends certificates are tried first, relative.
const WITHIN: f64 = 1e-8;

/// All that is known of one mesh, or of a system without one.
pub struct Findings {
    pub bounds: SpectralBounds,
    pub ends: SpectrumEnds,
    pub full: Option<dense::Eigenvalues>,
    pub sweeps: Vec<(Method<'static>, f64, SpectralRadius)>,
    /// What theory says of a mesh.
    pub verdict: Option<Singularity>,
    pub promise: Promise,
    /// `None` where all points coincide.
    pub counts: Option<IterationCounts>,
    pub data: [Option<Extremes>; 2],
    /// At the vertices of a mesh file, at the rows of a system without one; `None` unless asked for.
    pub modes: Option<SlowModes>,
    pub certificates: [Option<Certificate>; 4],
    /// On an open or creased mesh the rest is about the smooth vertices. The eigenvalues of its curves, and its corners.
    pub curves: Vec<f64>,
    pub corners: usize,
}

/// A method's factor per iteration.
pub struct Rate {
    pub method: &'static str,
    pub parameter: String,
    /// The spectral radius of the error matrix, or what follows from the condition number.
    pub rho: f64,
    /// No greater, as the certificates prove.
    pub certified: Option<f64>,
}

/// An end of a spectrum.
pub struct Quantity {
    pub name: &'static str,
    pub estimate: Estimate,
    pub bound: f64,
    /// What factorizations prove of it: a bound, and that some eigenvalue reaches as far as this.
    pub certificate: Option<Certificate>,
    /// The end of what the points excite.
    pub excited: Option<f64>,
}

impl Findings {
    /// The ends of the spectra of A and D⁻¹A.
    pub fn quantities(&self) -> [Quantity; 4] {
        let quantity =
            |name, estimate, bound, certificate, excited| Quantity { name, estimate, bound, certificate, excited };
        let (e, b) = (&self.ends, &self.bounds);
        let [a, jacobi] = self.data;
        let [lowest, highest, jacobi_lowest, jacobi_highest] = self.certificates;
        let (low, high) = (|d: Extremes| d.min, |d: Extremes| d.max);
        [
            quantity("lambda_min", e.lambda_min, b.lambda_min, lowest, a.map(low)),
            quantity("lambda_max", e.lambda_max, b.lambda_max, highest, a.map(high)),
            quantity("jacobi_lambda_min", e.jacobi_lambda_min, b.jacobi_lambda_min, jacobi_lowest, jacobi.map(low)),
            quantity("jacobi_lambda_max", e.jacobi_lambda_max, b.jacobi_lambda_max, jacobi_highest, jacobi.map(high)),
        ]
    }

    pub fn spectrum(&self) -> Spectrum {
        self.ends.spectrum()
    }

    /// The least eigenvalue of curves and the greatest.
    pub fn ends_of_curves(&self) -> Option<(f64, f64)> {
        let least = self.curves.iter().copied().min_by(f64::total_cmp)?;
        Some((least, self.curves.iter().copied().max_by(f64::total_cmp)?))
    }

    /// How many null vectors there are: by theory on a mesh, else as far as rounding tells.
    pub fn kernel_dimension(&self, n: usize) -> Option<usize> {
        match &self.verdict {
            Some(verdict) => Some(verdict.kernel_dimension()),
            None if self.is_singular(n) => self.ends.lambda_min.multiplicity.map(|m| m.count),
            None => Some(0),
        }
    }

    pub fn is_singular(&self, n: usize) -> bool {
        match &self.verdict {
            Some(verdict) => verdict.is_singular(),
            None => self.ends.lambda_min.value.abs() <= SINGULAR * n as f64 * f64::EPSILON * self.bounds.lambda_max,
        }
    }

    /// The intervals that the certificates prove to hold the spectra of A and of D⁻¹A.
    pub fn certified(&self) -> Option<Spectrum> {
        let [a_min, a_max, jacobi_min, jacobi_max] = self.certificates;
        let pair =
            |min: Option<Certificate>, max: Option<Certificate>| Some(Extremes { min: min?.bound, max: max?.bound });
        Some(Spectrum { a: pair(a_min, a_max)?, jacobi: pair(jacobi_min, jacobi_max)? })
    }

    pub fn rates(&self) -> Vec<Rate> {
        let of_ends = |ends: &Spectrum, omegas: &Spectrum| {
            let (a, jacobi) = (ends.a, ends.jacobi);
            let rates = [a, a, jacobi].map(Extremes::krylov_rate);
            let radii = [
                a.radius(1.0),
                a.radius(omegas.a.optimal_omega()),
                jacobi.radius(0.5),
                jacobi.radius(1.0),
                jacobi.radius(omegas.jacobi.optimal_omega()),
            ];
            (radii, rates)
        };
        let spectrum = self.spectrum();
        let (radii, rates) = of_ends(&spectrum, &spectrum);
        let certified = self.certified().map(|ends| of_ends(&ends, &spectrum));
        // A rate is computed in a dozen roundings of numbers of size 1.
        let up = |rho: f64| rho + 16.0 * f64::EPSILON;
        let best = |omega: f64| format!("ω={omega:.6} (optimal)");
        let names = [
            ("pia", "ω=1".into()),
            ("w-pia", best(spectrum.a.optimal_omega())),
            ("thall", "ω=0.5".into()),
            ("jacobi", "ω=1".into()),
            ("jacobi_optimal", best(spectrum.jacobi.optimal_omega())),
        ];
        let mut all = Vec::new();
        for (k, (method, parameter)) in names.into_iter().enumerate() {
            all.push(Rate { method, parameter, rho: radii[k], certified: certified.map(|c| up(c.0[k])) });
        }
        for (method, omega, radius) in &self.sweeps {
            let parameter = format!("ω={omega}, file order");
            all.push(Rate { method: method.name(), parameter, rho: radius.value, certified: None });
        }
        for (k, method) in ["chebyshev", "cg", "pcg-jacobi"].into_iter().enumerate() {
            let parameter = "(√κ−1)/(√κ+1)".into();
            all.push(Rate { method, parameter, rho: rates[k], certified: certified.map(|c| up(c.1[k])) });
        }
        all
    }
}

/// All findings: from `acting`, and where entries are asked for, from `system`, which is the same with entries.
fn analyse_any(
    system: Option<&LimitSystem>,
    acting: &impl System,
    (points, start): (&[DVec3], &[DVec3]),
    parts: Parts,
    progress: &Progress,
    arguments: &Arguments,
) -> Result<Findings> {
    let Parts { name, bounds, verdict, stop, ends } = parts;
    let promise = Promise::new(&bounds);
    progress.message("iterations that suffice");
    let counts = match stop {
        Ok(stop) => Some(promise.counts(acting, (points, start), stop.tolerance)),
        Err(error) => {
            arguments.common.remark(format_args!("no iterations are promised: {error}"));
            None
        }
    };
    if arguments.full {
        progress.message("all eigenvalues");
    }
    let full = system.filter(|_| arguments.full).map(dense::full_eigenvalues).transpose()?;
    progress.step();
    progress.message("ends of the spectra");
    let ends = ends()?;
    if !ends.converged() {
        arguments.common.remark(format_args!(
            "{name}: an end of the spectrum is the edge of a dense band; its error is in the table"
        ));
    }
    progress.step();
    let sweeps = system.filter(|_| !arguments.no_sweeps).map(|system| radii_of_sweeps(system, progress));
    let sweeps = sweeps.transpose()?.unwrap_or_default();
    progress.step();
    progress.message("what the points excite, and slow modes");
    let data = if arguments.no_data {
        [None; 2]
    } else {
        let excited = |which| excited(acting, (points, start), which);
        [excited(SymmetricForm::A)?, excited(SymmetricForm::Jacobi)?]
    };
    let count = arguments.modes.into();
    let modes = system.filter(|_| count > 0).map(|s| modes(s, SymmetricForm::A, End::Lowest, count)).transpose()?;
    progress.step();
    let mut certificates = [None; 4];
    progress.message("certificates");
    if let Some(system) = system.filter(|_| arguments.certify) {
        let Spectrum { a, jacobi } = ends.spectrum();
        for (slot, (which, end, estimate)) in certificates.iter_mut().zip([
            (SymmetricForm::A, End::Lowest, a.min),
            (SymmetricForm::A, End::Highest, a.max),
            (SymmetricForm::Jacobi, End::Lowest, jacobi.min),
            (SymmetricForm::Jacobi, End::Highest, jacobi.max),
        ]) {
            *slot = certify(system, which, end, estimate, WITHIN)?;
        }
    }
    progress.step();
    let (curves, corners) = (Vec::new(), 0);
    Ok(Findings { bounds, ends, full, sweeps, verdict, promise, counts, data, modes, certificates, curves, corners })
}

/// What is known otherwise of a mesh and of a system without one.
struct Parts<'a> {
    name: &'a str,
    bounds: SpectralBounds,
    verdict: Option<Singularity>,
    stop: Result<Stop>,
    ends: &'a dyn Fn() -> Result<SpectrumEnds>,
}

/// The smooth vertices of an open or creased mesh.
fn analyse_stages(input: &Input, arguments: &Arguments) -> Result<Findings> {
    let stages = input.stages()?;
    let block = stages.block();
    let known = stages.known(input.surface.positions());
    let (right, start) = (stages.right_hand_side(&known), stages.restricted(&known));
    let progress = Progress::new(&input.name, 5, arguments.common.quiet);
    let parts = Parts {
        name: &input.name,
        bounds: block.bounds,
        verdict: Some(Singularity::detect(&input.surface, input.scheme)),
        stop: input.stop(&arguments.stop),
        ends: &|| ends(block),
    };
    let found = analyse_any(Some(block), block, (&right, &start), parts, &progress, arguments);
    let mut found = found.map_err(|e| input.named(e))?;
    found.curves = stages.curves().eigenvalues();
    found.corners = input.surface.len() - stages.curves().len() - block.len();
    for mode in found.modes.iter_mut().flat_map(|modes| &mut modes.modes) {
        mode.values = stages.joined(vec![0.0; stages.len()], std::mem::take(&mut mode.values));
    }
    if let Some(full) = &mut found.full {
        // The other stages have 1 and the eigenvalues of the curves, over their diagonals too.
        let diagonal = 1.0 - 2.0 * stages.curves().weight();
        let add = |all: &mut Vec<f64>, scale: f64| {
            all.extend(found.curves.iter().map(|x| x / scale));
            all.extend(std::iter::repeat_n(1.0, found.corners));
            all.sort_unstable_by(f64::total_cmp);
        };
        add(&mut full.a, 1.0);
        add(&mut full.jacobi, diagonal);
    }
    Ok(found)
}

/// Of a mesh: where it is open or creased, of its smooth vertices.
pub fn analyse(input: &Input, arguments: &Arguments) -> Result<Findings> {
    if input.surface.features().is_some() {
        return analyse_stages(input, arguments);
    }
    // Only some of what can be asked for needs entries.
    let explicit = arguments.full || !arguments.no_sweeps || arguments.modes > 0 || arguments.certify;
    let system =
        explicit.then(|| LimitSystem::new(&input.surface, input.scheme)).transpose().map_err(|e| input.named(e))?;
    let surface = &input.surface;
    let mesh = surface.mesh();
    let operator = Operator::new(surface, input.scheme).map_err(|e| input.named(e))?;
    let progress = Progress::new(&input.name, 5, arguments.common.quiet);
    let parts = Parts {
        name: &input.name,
        bounds: operator.bounds(),
        verdict: Some(Singularity::detect(surface, input.scheme)),
        stop: input.stop(&arguments.stop),
        ends: &|| mesh_ends(surface, input.scheme),
    };
    analyse_any(system.as_ref(), &operator, (&mesh.positions, &mesh.positions), parts, &progress, arguments)
        .map_err(|e| input.named(e))
}

/// Of a system without a mesh.
pub fn analyse_given(given: &Given, arguments: &Arguments) -> Result<Findings> {
    let Given { subject, system, points, .. } = given;
    let progress = Progress::new(&subject.name, 5, arguments.common.quiet);
    let stop = given.stop(&arguments.stop);
    let parts = Parts { name: &subject.name, bounds: system.bounds, verdict: None, stop, ends: &|| ends(system) };
    let found = analyse_any(Some(system), system, (points, points), parts, &progress, arguments);
    found.map_err(|e| limitlab::Error::mesh(&subject.name, e.to_string()))
}
