//! Every method on one system, from one start, in one norm, to one tolerance, with its predicted rate beside the
//! observed one.

use glam::DVec3;

use super::predict::predicted_rate;
use super::rate::observed_rate;
use super::spectrum::{Spectrum, spectrum};
use super::sweep::rounding_floor;
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::solvers::{Method, Setup, Solution, Stop, run};

/// A method with its parameter in words: a line of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry<'a> {
    pub method: Method,
    pub parameter: String,
    pub setup: Setup<'a>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Row {
    pub method: Method,
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
/// Chebyshev intervals start at this at the lowest: below, the matrix is near singular, and the modes beneath are
/// left out.
const LOWEST: f64 = 1e-6;
/// The part of an estimated λ_min that a Chebyshev interval starts from: Ritz values lie above the eigenvalue.
const SAFETY: f64 = 0.98;

/// The set-up that is meant by a method's name alone: Jacobi and W-PIA at their best ω, Chebyshev with the proven
/// interval where that is positive, else with an estimated one. `spectrum` is asked only where it is needed.
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
        Method::Jacobi => Setup::Jacobi {
            omega: spectrum()?.jacobi.optimal_omega(),
        },
        Method::Thall => Setup::THALL,
        Method::GaussSeidel => Setup::Sor { omega: 1.0, order },
        Method::Sor => Setup::Sor {
            omega: SOR_OMEGA,
            order,
        },
        Method::Ssor => Setup::Ssor {
            omega: SSOR_OMEGA,
            order,
        },
        Method::Pia => Setup::Pia { omega: 1.0 },
        Method::WPia => Setup::Pia {
            omega: spectrum()?.a.optimal_omega(),
        },
        Method::Chebyshev if system.bounds.lambda_min > 0.0 => Setup::Chebyshev {
            spectrum: (system.bounds.lambda_min, system.bounds.lambda_max),
        },
        Method::Chebyshev => estimated_chebyshev(&spectrum()?),
        Method::Cg => Setup::Cg,
        Method::PcgJacobi => Setup::PcgJacobi,
        Method::PcgSsor => Setup::PcgSsor { omega: SSOR_OMEGA },
        Method::PcgIc0 => Setup::PcgIc0,
    })
}

fn estimated_chebyshev(spectrum: &Spectrum) -> Setup<'static> {
    Setup::Chebyshev {
        spectrum: ((SAFETY * spectrum.a.min).max(LOWEST), 1.0),
    }
}

/// The method that `auto` stands for: Chebyshev with proven bounds where the one for λ_min is positive (no inner
/// products, a count known in advance), else conjugate gradients, which need no bound.
pub fn automatic(system: &LimitSystem) -> Method {
    if system.bounds.lambda_min > 0.0 {
        Method::Chebyshev
    } else {
        Method::Cg
    }
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
    let mut lines = Vec::new();
    for &method in methods {
        let setup = standard_setup(system, method, order, &|| Ok(*spectrum))?;
        let in_order = format!("{order_name} order");
        let parameter = match (method, setup) {
            (Method::Lu | Method::Cholesky | Method::Ldlt, _) => "faer".into(),
            (Method::GaussSeidel, _) => in_order,
            (Method::Jacobi | Method::WPia, Setup::Jacobi { omega } | Setup::Pia { omega }) => {
                format!("ω={} (optimal)", short(omega))
            }
            (_, Setup::Sor { omega, .. } | Setup::Ssor { omega, .. }) => {
                format!("ω={}, {in_order}", short(omega))
            }
            (_, Setup::Jacobi { omega } | Setup::Pia { omega } | Setup::PcgSsor { omega }) => {
                format!("ω={}", short(omega))
            }
            (_, Setup::Chebyshev { spectrum }) => {
                let proven = system.bounds.lambda_min > 0.0;
                interval(spectrum, if proven { "proven" } else { "estimated" })
            }
            (_, Setup::Cg) => "preconditioned by H".into(),
            (_, Setup::PcgJacobi) => "diag(M)".into(),
            (_, Setup::PcgIc0) => "no fill".into(),
            (
                _,
                Setup::PlainCg | Setup::Lu | Setup::Cholesky | Setup::SecondCholesky | Setup::Ldlt,
            ) => String::new(),
        };
        lines.push(Entry {
            method,
            parameter,
            setup,
        });
    }
    for &method in methods {
        let (parameter, setup) = match method {
            Method::Cholesky => ("nalgebra-sparse".into(), Setup::SecondCholesky),
            Method::Cg => ("on M itself".into(), Setup::PlainCg),
            Method::Chebyshev if system.bounds.lambda_min > 0.0 => {
                let setup = estimated_chebyshev(spectrum);
                let Setup::Chebyshev { spectrum } = setup else {
                    continue;
                };
                (interval(spectrum, "estimated"), setup)
            }
            _ => continue,
        };
        lines.push(Entry {
            method,
            parameter,
            setup,
        });
    }
    Ok(lines)
}

fn interval((min, max): (f64, f64), how: &str) -> String {
    format!("λ ∈ [{}, {}] ({how})", short(min), short(max))
}

/// Four significant digits without trailing zeros.
fn short(x: f64) -> String {
    let text = format!(
        "{x:.*}",
        (3 - x.abs().log10().floor() as i32).clamp(0, 12) as usize
    );
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// Runs the lines one after the other, so that their times are comparable. `done` is called after each.
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
    stop: &Stop,
    diagonal: f64,
    done: &mut dyn FnMut(),
) -> Result<Vec<Row>> {
    let floor = rounding_floor(diagonal);
    entries
        .iter()
        .map(|entry| {
            let solution = run(system, points, entry.setup, stop);
            let maxima: Vec<f64> = solution.report.history.iter().map(|e| e.max).collect();
            let observed_rate = (!entry.method.is_direct())
                .then(|| observed_rate(&maxima, floor))
                .flatten();
            let predicted_rate = predicted_rate(system, spectrum, entry.setup)?;
            done();
            Ok(Row {
                method: entry.method,
                parameter: entry.parameter.clone(),
                solution,
                observed_rate,
                predicted_rate,
            })
        })
        .collect()
}

/// [`spectrum`], [`entries`] and [`compare`] in one.
///
/// # Errors
/// As these.
///
/// # Panics
/// As [`compare`].
pub fn compare_methods(
    system: &LimitSystem,
    points: &[DVec3],
    methods: &[Method],
    stop: &Stop,
    diagonal: f64,
) -> Result<Vec<Row>> {
    let spectrum = spectrum(system)?;
    let lines = entries(system, &spectrum, methods, None, "file")?;
    compare(
        system,
        &spectrum,
        points,
        &lines,
        stop,
        diagonal,
        &mut || {},
    )
}
