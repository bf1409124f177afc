//! Comparison of methods: all on one system, from one start, in one norm, to one tolerance, with the predicted rate
//! beside the observed one.

use std::ops::ControlFlow;

use glam::DVec3;

use super::custom_methods::{Named, Own};
use super::predict::predicted_rate;
use super::rate::observed_rate;
use super::spectrum::{Spectra, Spectrum};
use super::sweep::rounding_floor;
use super::symmetric::SymmetricForm;
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::mesh::diagonal;
use crate::solvers::anderson::WINDOW;
use crate::solvers::jacobi::THALL_OMEGA;
use crate::solvers::{Accelerated, Method, Outcome, Solution, Step, Stop, System, run_from};

/// A method with its parameter in words: a line of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry<'a> {
    /// With its open parameters set, as by [`with_spectrum`].
    pub method: Method<'a>,
    /// Which of the method's lines it is, without numbers.
    pub variant: &'static str,
    /// Its numbers, the order it sweeps in and its variant, separated by commas; may be empty.
    pub parameter: String,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct MethodRow<'a> {
    /// One of the methods here, or of the caller's own.
    pub method: Named<'a>,
    /// Empty for methods of the caller's own.
    pub variant: &'static str,
    /// As in the [`Entry`], or as the caller's own method tells it.
    pub parameter: String,
    /// Control points, history of errors and times of the run: the [least](with_least_times) of several where it is short.
    pub solution: Solution,
    /// Factor per iteration fitted to the history's tail; `None` for direct methods and short histories.
    pub observed_rate: Option<f64>,
    /// The same, predicted.
    pub predicted_rate: Option<f64>,
}

/// An estimated λ_min below this part of λ_max is taken for 0: the matrix is singular for all that iterations can tell.
const VANISHING: f64 = 1e-9;
/// The part of λ_max where a Chebyshev interval starts if λ_min vanishes: modes beneath are left nearly as they are,
/// which is right where the data do not excite them. Tuned on singular meshes: lower costs iterations, higher leaves out
/// modes.
const LOWEST: f64 = 1e-3;
/// The part of an estimated λ_min that a Chebyshev interval starts from: Ritz values lie above the eigenvalue.
const SAFETY: f64 = 0.98;
/// An estimated λ_max is exceeded by this part of it, where no smaller bound is proven: it has an error, and modes above
/// the interval grow.
const EXCESS: f64 = 1e-6;

/// The method with its open parameters set by the spectrum: Jacobi and W-PIA to their best ω, the interval of the heavy
/// ball to the estimated one, that of Chebyshev to the proven one where that is positive, else to the estimated one.
/// `spectra` are asked for only where they are needed; an interval stays open where they are complex, and everything where
/// nothing is unknown.
///
/// # Errors
/// Those of `spectra`.
pub fn with_spectrum<'a, K: Spectra>(
    system: &impl System,
    method: Method<'a>,
    spectra: &dyn Fn() -> Result<K>,
) -> Result<Method<'a>> {
    if system.is_empty() {
        return Ok(method);
    }
    let bounds = &system.bounds();
    let optimal = |form| Ok(Some(spectra()?.optimal_omega(form)));
    let estimated = || Ok(spectra()?.real().map(|spectrum| estimated(system, spectrum)));
    Ok(match method {
        Method::Jacobi { omega: None } => Method::Jacobi { omega: optimal(SymmetricForm::Jacobi)? },
        Method::WPia { omega: None } => Method::WPia { omega: optimal(SymmetricForm::A)? },
        Method::Anderson { of: Accelerated::Pia { omega: None }, window } => {
            Method::Anderson { of: Accelerated::Pia { omega: Some(1.0 / bounds.lambda_max) }, window }
        }
        Method::Anderson { of: Accelerated::Jacobi { omega: None }, window } => {
            Method::Anderson { of: Accelerated::Jacobi { omega: optimal(SymmetricForm::Jacobi)? }, window }
        }
        Method::HeavyBall { interval: None } => Method::HeavyBall { interval: estimated()? },
        Method::Chebyshev { interval: None } if bounds.lambda_min > 0.0 => {
            Method::Chebyshev { interval: Some((bounds.lambda_min, bounds.lambda_max)) }
        }
        Method::Chebyshev { interval: None } => Method::Chebyshev { interval: estimated()? },
        Method::Lu
        | Method::Cholesky
        | Method::SecondCholesky
        | Method::Ldlt
        | Method::Jacobi { omega: Some(_) }
        | Method::Thall
        | Method::GaussSeidel { .. }
        | Method::Sor { .. }
        | Method::Ssor { .. }
        | Method::Pia
        | Method::WPia { omega: Some(_) }
        | Method::Chebyshev { interval: Some(_) }
        | Method::Cg
        | Method::PlainCg
        | Method::PcgJacobi
        | Method::PcgSsor { .. }
        | Method::PcgIc0
        | Method::Anderson {
            of: Accelerated::Pia { omega: Some(_) } | Accelerated::Jacobi { omega: Some(_) }, ..
        }
        | Method::HeavyBall { interval: Some(_) } => method,
    })
}

/// The interval of the heavy ball, and of Chebyshev, by estimates.
fn estimated(system: &impl System, spectrum: &Spectrum) -> (f64, f64) {
    let highest = system.lambda_max().min((1.0 + EXCESS) * spectrum.a.max);
    let lowest = if spectrum.a.min < VANISHING * highest { LOWEST * highest } else { SAFETY * spectrum.a.min };
    (lowest, highest)
}

/// The line of each method in `methods`, then the further lines: other intervals, other libraries, the
/// unpreconditioned CG. `order` is the vertex order of in-place sweeps, `order_name` its name.
///
/// # Errors
/// None with given spectra; the type is that of [`with_spectrum`].
pub fn entries<'a>(
    system: &impl System,
    spectra: &(impl Spectra + Clone),
    methods: &[Method<'a>],
    order: Option<&'a [u32]>,
    order_name: &str,
) -> Result<Vec<Entry<'a>>> {
    let entry = |method: Method<'a>, variant| -> Result<Entry<'a>> {
        let method = with_spectrum(system, method.in_order(order), &|| Ok(spectra.clone()))?;
        Ok(Entry { method, variant, parameter: parameter(variant, method, order_name) })
    };
    let variants = |&method: &Method<'a>| variants(system, spectra, method);
    let (first, further): (Vec<_>, Vec<_>) = methods.iter().map(variants).unzip();
    let lines = methods.iter().copied().zip(first).chain(further.into_iter().flatten());
    lines.map(|(method, variant)| entry(method, variant)).collect()
}

/// What the line of a method is called, and its further lines.
fn variants<'a>(
    system: &impl System,
    spectra: &impl Spectra,
    method: Method<'a>,
) -> (&'static str, Vec<(Method<'a>, &'static str)>) {
    let anderson = |omega| Method::Anderson { of: Accelerated::Jacobi { omega }, window: WINDOW };
    match method {
        Method::Lu | Method::Ldlt => ("faer", Vec::new()),
        Method::Cholesky => ("faer", vec![(Method::SecondCholesky, "nalgebra-sparse")]),
        Method::SecondCholesky => ("nalgebra-sparse", Vec::new()),
        Method::Jacobi { .. } | Method::WPia { .. } => ("optimal", Vec::new()),
        Method::Chebyshev { .. } if system.bounds().lambda_min > 0.0 => {
            let real = spectra.real().filter(|_| !system.is_empty());
            let interval = real.map(|spectrum| estimated(system, spectrum));
            ("proven", vec![(Method::Chebyshev { interval }, "estimated")])
        }
        Method::Chebyshev { .. } | Method::HeavyBall { .. } => ("estimated", Vec::new()),
        Method::Anderson { of: Accelerated::Pia { .. }, .. } => {
            ("of pia", vec![(anderson(Some(THALL_OMEGA)), "of thall"), (anderson(None), "of jacobi")])
        }
        Method::Anderson { of: Accelerated::Jacobi { .. }, .. } => ("of jacobi", Vec::new()),
        Method::Cg => ("preconditioned by H", vec![(Method::PlainCg, "on M itself")]),
        Method::PlainCg => ("on M itself", Vec::new()),
        Method::PcgJacobi => ("diag(M)", Vec::new()),
        Method::PcgIc0 => ("no fill", Vec::new()),
        Method::Thall
        | Method::GaussSeidel { .. }
        | Method::Sor { .. }
        | Method::Ssor { .. }
        | Method::Pia
        | Method::PcgSsor { .. } => ("", Vec::new()),
    }
}

/// The numbers of a method, the order it sweeps in, and its variant, in words.
fn parameter(variant: &str, method: Method, order_name: &str) -> String {
    let order = format!("{order_name} order");
    let weight = |omega: f64| format!("ω={}", four_digits(omega));
    let mut words = match method {
        Method::Jacobi { omega } | Method::WPia { omega } => omega.map(weight).into_iter().collect(),
        Method::Thall => vec![weight(THALL_OMEGA)],
        Method::Pia => vec![weight(1.0)],
        Method::PcgSsor { omega } => vec![weight(omega)],
        Method::GaussSeidel { .. } => vec![order],
        Method::Sor { omega, .. } | Method::Ssor { omega, .. } => vec![weight(omega), order],
        Method::HeavyBall { interval } | Method::Chebyshev { interval } => {
            let words = |(min, max)| format!("λ ∈ [{}, {}]", four_digits(min), four_digits(max));
            interval.map(words).into_iter().collect()
        }
        Method::Anderson { of: Accelerated::Pia { omega } | Accelerated::Jacobi { omega }, window } => {
            let mut words = vec![format!("m={window}")];
            words.extend(omega.map(weight));
            words
        }
        Method::Lu
        | Method::Cholesky
        | Method::SecondCholesky
        | Method::Ldlt
        | Method::Cg
        | Method::PlainCg
        | Method::PcgJacobi
        | Method::PcgIc0 => Vec::new(),
    };
    if !variant.is_empty() {
        words.push(variant.into());
    }
    words.join(", ")
}

/// Four significant digits without trailing zeros, as a power of ten where many zeros would stand before or after them.
fn four_digits(x: f64) -> String {
    if !(1e-9..1e9).contains(&x.abs()) {
        return format!("{x:.3e}");
    }
    let text = format!("{x:.*}", (3 - x.abs().log10().floor() as i32).clamp(0, 12) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Runs the lines from V = `start` (P, unless there is reason for another), one after the other, so that their times are
/// comparable, then the methods of the caller's [own], which start from the points. `done` is called after each.
///
/// [own]: super::custom_methods
///
/// # Errors
/// If an eigenvalue computation for a prediction does not converge.
///
/// # Panics
/// If there is not one point a vertex in both.
pub fn compare<'a>(
    system: &LimitSystem,
    spectrum: &Spectrum,
    (points, start): (&[DVec3], &[DVec3]),
    entries: &[Entry<'a>],
    own: &[Own],
    stop: &Stop,
    done: &mut dyn FnMut(),
) -> Result<Vec<MethodRow<'a>>> {
    let watch = &mut |_: &Step| ControlFlow::Continue(());
    let mut ours = |entry| {
        let row = compare_entry(system, spectrum, (points, start), entry, stop, watch);
        done();
        row
    };
    let ours: Vec<MethodRow> = entries.iter().map(&mut ours).collect::<Result<_>>()?;
    let theirs = own.iter().map(|own| {
        let solution = with_least_times(own.run(system, points, stop), || Ok(own.run(system, points, stop)))?;
        done();
        Ok(MethodRow {
            method: Named::Own(own.name.clone()),
            variant: "",
            parameter: own.parameter.clone(),
            observed_rate: observed(&solution, points),
            predicted_rate: None,
            solution,
        })
    });
    ours.into_iter().map(Ok).chain(theirs).collect()
}

/// Seconds below which a run is made again, all runs together, and runs at most.
const SHORT: f64 = 0.1;
const RUNS: usize = 5;

/// A solution with the least times of several runs, where a run is short: the first one may pay for threads that wake up and
/// for cold caches. All else is that of the first.
///
/// # Errors
/// Those of `again`, which makes the run once more.
pub fn with_least_times(first: Solution, mut again: impl FnMut() -> Result<Solution>) -> Result<Solution> {
    let seconds = |solution: &Solution| solution.setup_seconds + solution.solve_seconds;
    let mut spent = seconds(&first);
    let mut least = first;
    for _ in 1..RUNS {
        if spent >= SHORT || least.report.outcome == Outcome::Stopped {
            break;
        }
        let other = again()?;
        spent += seconds(&other);
        least.setup_seconds = least.setup_seconds.min(other.setup_seconds);
        least.solve_seconds = least.solve_seconds.min(other.solve_seconds);
    }
    Ok(least)
}

/// Runs one line from V = `start`. The watch sees every iterate, and may stop the run; a short run is [timed
/// again](with_least_times) without it.
///
/// # Errors
/// If an eigenvalue computation for the prediction does not converge.
///
/// # Panics
/// If there is not one point a vertex in both.
pub fn compare_entry<'a>(
    system: &impl System,
    spectra: &impl Spectra,
    (points, start): (&[DVec3], &[DVec3]),
    entry: &Entry<'a>,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Result<MethodRow<'a>> {
    let run =
        |watch: &mut dyn FnMut(&Step) -> ControlFlow<()>| run_from(system, points, start, entry.method, stop, watch);
    let first = run(watch);
    let solution = with_least_times(first, || Ok(run(&mut |_| ControlFlow::Continue(()))))?;
    Ok(MethodRow {
        method: Named::Ours(entry.method),
        variant: entry.variant,
        parameter: entry.parameter.clone(),
        observed_rate: (!entry.method.is_direct()).then(|| observed(&solution, points)).flatten(),
        solution,
        predicted_rate: predicted_rate(system, spectra, entry.method)?,
    })
}

/// The factor per iteration fitted to the history's tail.
fn observed(solution: &Solution, points: &[DVec3]) -> Option<f64> {
    observed_rate(&solution.report.maxima(), rounding_floor(diagonal(points)))
}
