//! Every method on one system, from one start, in one norm, to one tolerance, with its predicted rate beside the
//! observed one.

use glam::DVec3;

use super::own::{Named, Own};
use super::predict::predicted_rate;
use super::rate::observed_rate;
use super::spectrum::Spectrum;
use super::sweep::rounding_floor;
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::mesh::diagonal;
use crate::solvers::anderson::WINDOW;
use crate::solvers::jacobi::THALL_OMEGA;
use crate::solvers::{Method, Setup, Solution, Stop, System, run};

/// A method with its parameter in words: a line of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry<'a> {
    pub method: Method,
    /// Which of the method's lines it is, without numbers.
    pub variant: &'static str,
    pub parameter: String,
    pub setup: Setup<'a>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Row {
    pub method: Named,
    /// Empty for methods of the caller's own.
    pub variant: &'static str,
    pub parameter: String,
    pub solution: Solution,
    /// Factor per iteration fitted to the history's tail; `None` for direct methods and short histories.
    pub observed_rate: Option<f64>,
    /// The same, predicted.
    pub predicted_rate: Option<f64>,
}

/// ω of `sor` unless told: about the best for all schemes on irregular meshes. Tuned on the sweeps in
/// `reports/`.
pub const SOR_OMEGA: f64 = 1.1;
/// ω of `ssor` and of the preconditioner `pcg-ssor`, where the symmetric sweep is little sensitive to it.
pub const SSOR_OMEGA: f64 = 1.0;
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

/// The set-up that is meant by a method's name alone: Jacobi and W-PIA at their best ω, Anderson's acceleration of PIA, the
/// heavy ball with an estimated interval, Chebyshev with the proven one where that is positive, else with an estimated one. `spectrum` is asked only where it is needed.
///
/// # Errors
/// Those of `spectrum`.
pub fn standard_setup<'a>(
    system: &LimitSystem,
    method: Method,
    order: Option<&'a [u32]>,
    spectrum: &dyn Fn() -> Result<Spectrum>,
) -> Result<Setup<'a>> {
    Ok(match method {
        Method::Lu => Setup::Lu,
        Method::Cholesky => Setup::Cholesky,
        Method::Ldlt => Setup::Ldlt,
        Method::Jacobi => Setup::Jacobi { omega: spectrum()?.jacobi.optimal_omega() },
        Method::Thall => Setup::THALL,
        Method::GaussSeidel => Setup::Sor { omega: 1.0, order },
        Method::Sor => Setup::Sor { omega: SOR_OMEGA, order },
        Method::Ssor => Setup::Ssor { omega: SSOR_OMEGA, order },
        Method::Pia => Setup::Pia { omega: 1.0 },
        Method::WPia => Setup::Pia { omega: spectrum()?.a.optimal_omega() },
        // ω = 1 for a scheme's matrix.
        Method::Anderson => Setup::AndersonPia { omega: 1.0 / system.lambda_max(), window: WINDOW },
        Method::HeavyBall => Setup::HeavyBall { spectrum: estimated(system, &spectrum()?) },
        Method::Chebyshev if system.bounds.lambda_min > 0.0 => {
            Setup::Chebyshev { spectrum: (system.bounds.lambda_min, system.bounds.lambda_max) }
        }
        Method::Chebyshev => Setup::Chebyshev { spectrum: estimated(system, &spectrum()?) },
        Method::Cg => Setup::Cg,
        Method::PcgJacobi => Setup::PcgJacobi,
        Method::PcgSsor => Setup::PcgSsor { omega: SSOR_OMEGA },
        Method::PcgIc0 => Setup::PcgIc0,
    })
}

/// The interval of the heavy ball, and of Chebyshev, by estimates.
fn estimated(system: &LimitSystem, spectrum: &Spectrum) -> (f64, f64) {
    let highest = system.bounds.lambda_max.min((1.0 + EXCESS) * spectrum.a.max);
    let lowest = if spectrum.a.min < VANISHING * highest { LOWEST * highest } else { SAFETY * spectrum.a.min };
    (lowest, highest)
}

/// The method that `auto` stands for: Chebyshev with proven bounds where the one for λ_min is positive (no inner
/// products, a count known in advance), else conjugate gradients, which need no bound.
pub fn automatic(system: &LimitSystem) -> Method {
    if system.bounds.lambda_min > 0.0 { Method::Chebyshev } else { Method::Cg }
}

/// The standard line of each method in `methods`, then the further lines: other intervals, other libraries, the
/// unpreconditioned CG. `order` is the vertex order of in-place sweeps, `order_name` its name.
///
/// # Errors
/// None with a given spectrum; the type is that of [`standard_setup`].
pub fn entries<'a>(
    system: &LimitSystem,
    spectrum: &Spectrum,
    methods: &[Method],
    order: Option<&'a [u32]>,
    order_name: &str,
) -> Result<Vec<Entry<'a>>> {
    let proven = system.bounds.lambda_min > 0.0;
    let entry =
        |method, variant, setup| Entry { method, variant, parameter: parameter(variant, setup, order_name), setup };
    let mut lines = Vec::new();
    for &method in methods {
        let variant = match method {
            Method::Lu | Method::Cholesky | Method::Ldlt => "faer",
            Method::Jacobi | Method::WPia => "optimal",
            Method::Chebyshev if proven => "proven",
            Method::HeavyBall | Method::Chebyshev => "estimated",
            Method::Anderson => "of pia",
            Method::Cg => "preconditioned by H",
            Method::PcgJacobi => "diag(M)",
            Method::PcgIc0 => "no fill",
            Method::Thall | Method::GaussSeidel | Method::Sor | Method::Ssor | Method::Pia | Method::PcgSsor => "",
        };
        let setup = standard_setup(system, method, order, &|| Ok(*spectrum))?;
        lines.push(entry(method, variant, setup));
    }
    for &method in methods {
        match method {
            Method::Cholesky => {
                lines.push(entry(method, "nalgebra-sparse", Setup::SecondCholesky));
            }
            Method::Cg => lines.push(entry(method, "on M itself", Setup::PlainCg)),
            Method::Anderson => {
                let of_jacobi = |omega| Setup::AndersonJacobi { omega, window: WINDOW };
                lines.push(entry(method, "of thall", of_jacobi(THALL_OMEGA)));
                lines.push(entry(method, "of jacobi", of_jacobi(spectrum.jacobi.optimal_omega())));
            }
            Method::Chebyshev if proven => {
                let setup = Setup::Chebyshev { spectrum: estimated(system, spectrum) };
                lines.push(entry(method, "estimated", setup));
            }
            Method::Lu
            | Method::Ldlt
            | Method::Jacobi
            | Method::Thall
            | Method::GaussSeidel
            | Method::Sor
            | Method::Ssor
            | Method::Pia
            | Method::WPia
            | Method::HeavyBall
            | Method::Chebyshev
            | Method::PcgJacobi
            | Method::PcgSsor
            | Method::PcgIc0 => {}
        }
    }
    Ok(lines)
}

/// The numbers of a set-up, the order it sweeps in, and its variant, in words.
fn parameter(variant: &str, setup: Setup, order_name: &str) -> String {
    let order = format!("{order_name} order");
    let mut words = match setup {
        Setup::Jacobi { omega } | Setup::Pia { omega } | Setup::PcgSsor { omega } => {
            vec![format!("ω={}", four_digits(omega))]
        }
        Setup::Sor { omega: 1.0, .. } => vec![order],
        Setup::Sor { omega, .. } | Setup::Ssor { omega, .. } => {
            vec![format!("ω={}", four_digits(omega)), order]
        }
        Setup::HeavyBall { spectrum: (min, max) } | Setup::Chebyshev { spectrum: (min, max) } => {
            vec![format!("λ ∈ [{}, {}]", four_digits(min), four_digits(max))]
        }
        Setup::AndersonPia { omega, window } | Setup::AndersonJacobi { omega, window } => {
            vec![format!("m={window}"), format!("ω={}", four_digits(omega))]
        }
        Setup::Lu
        | Setup::Cholesky
        | Setup::SecondCholesky
        | Setup::Ldlt
        | Setup::Cg
        | Setup::PlainCg
        | Setup::PcgJacobi
        | Setup::PcgIc0 => Vec::new(),
    };
    if !variant.is_empty() {
        words.push(variant.into());
    }
    words.join(", ")
}

/// Four significant digits without trailing zeros.
fn four_digits(x: f64) -> String {
    let text = format!("{x:.*}", (3 - x.abs().log10().floor() as i32).clamp(0, 12) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Runs the lines, then the methods of the caller's [own], one after the other, so that their times are comparable.
/// `done` is called after each.
///
/// [own]: super::own
///
/// # Errors
/// If an eigenvalue computation for a prediction does not converge.
///
/// # Panics
/// If there is not one point a vertex.
pub fn compare(
    system: &LimitSystem,
    spectrum: &Spectrum,
    points: &[DVec3],
    entries: &[Entry],
    own: &[Own],
    stop: &Stop,
    done: &mut dyn FnMut(),
) -> Result<Vec<Row>> {
    let floor = rounding_floor(diagonal(points));
    let observed_rate = |solution: &Solution| {
        let maxima: Vec<f64> = solution.report.history.iter().map(|e| e.max).collect();
        observed_rate(&maxima, floor)
    };
    let ours = entries
        .iter()
        .map(|entry| {
            let solution = run(system, points, entry.setup, stop);
            let observed_rate = (!entry.method.is_direct()).then(|| observed_rate(&solution)).flatten();
            let predicted_rate = predicted_rate(system, spectrum, entry.setup)?;
            done();
            Ok(Row {
                method: Named::Ours(entry.method),
                variant: entry.variant,
                parameter: entry.parameter.clone(),
                solution,
                observed_rate,
                predicted_rate,
            })
        })
        .collect::<Result<Vec<Row>>>()?;
    let theirs = own.iter().map(|own| {
        let solution = own.run(system, points, stop);
        done();
        Row {
            method: Named::Own(own.name.clone()),
            variant: "",
            parameter: own.parameter.clone(),
            observed_rate: observed_rate(&solution),
            predicted_rate: None,
            solution,
        }
    });
    Ok(ours.into_iter().chain(theirs).collect())
}
