//! All methods with their parameters on one system, and runs that hold what every run must.

use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::assemble::LimitSystem;
use limitlab::solvers::{Outcome, Setup, Solution, Stop, run};

pub const DIRECT: [(&str, Setup<'static>); 4] = [
    ("lu", Setup::Lu),
    ("cholesky", Setup::Cholesky),
    ("ldlt", Setup::Ldlt),
    ("second cholesky", Setup::SecondCholesky),
];

/// Eigenvalues below count as 0 for the interval of Chebyshev's iteration.
const LOWEST: f64 = 1e-3;

/// Every iterative method. `order` is that of the ordered variants.
pub fn iterative<'a>(system: &LimitSystem, order: &'a [u32]) -> Vec<(&'static str, Setup<'a>)> {
    let eigenvalues = dense::eigenvalues(system).unwrap();
    let optimal = |all: &[f64]| 2.0 / (all[0] + all[all.len() - 1]);
    let order = Some(order);
    vec![
        ("thall", Setup::THALL),
        (
            "jacobi",
            Setup::Jacobi {
                omega: optimal(&eigenvalues.jacobi),
            },
        ),
        (
            "gauss-seidel",
            Setup::Sor {
                omega: 1.0,
                order: None,
            },
        ),
        ("gauss-seidel in order", Setup::Sor { omega: 1.0, order }),
        ("sor", Setup::Sor { omega: 1.2, order }),
        (
            "ssor",
            Setup::Ssor {
                omega: 1.0,
                order: None,
            },
        ),
        ("ssor in order", Setup::Ssor { omega: 1.3, order }),
        ("pia", Setup::Pia { omega: 1.0 }),
        (
            "w-pia",
            Setup::Pia {
                omega: optimal(&eigenvalues.a),
            },
        ),
        (
            "chebyshev",
            Setup::Chebyshev {
                spectrum: (eigenvalues.a[0].max(LOWEST), 1.0),
            },
        ),
        ("cg", Setup::Cg),
        ("plain cg", Setup::PlainCg),
        ("pcg-jacobi", Setup::PcgJacobi),
        ("pcg-ssor", Setup::PcgSsor { omega: 1.0 }),
        ("pcg-ic0", Setup::PcgIc0),
    ]
}

pub fn all<'a>(system: &LimitSystem, order: &'a [u32]) -> Vec<(&'static str, Setup<'a>)> {
    let mut all = DIRECT.to_vec();
    all.extend(iterative(system, order));
    all
}

pub fn reversed(n: usize) -> Vec<u32> {
    (0..n as u32).rev().collect()
}

/// max_i ‖p_i − (A v)_i‖₂, computed here.
pub fn residual(system: &LimitSystem, points: &[DVec3], v: &[DVec3]) -> f64 {
    (0..v.len())
        .map(|i| (points[i] - system.a.row_times(i, v)).length())
        // NaN wins.
        .fold(0.0, |m: f64, e| if e > m || e.is_nan() { e } else { m })
}

/// Runs a method and checks what holds of every run, however it ended: an entry of the history for the start and for
/// each iteration, the start's error as entry 0, and no convergence without a true residual within the tolerance.
pub fn checked(system: &LimitSystem, points: &[DVec3], setup: Setup, stop: &Stop) -> Solution {
    let solution = run(system, points, setup, stop);
    let report = &solution.report;
    assert_eq!(
        report.history.len(),
        report.iterations + 1,
        "{setup:?}: {:?}",
        report.outcome
    );
    assert_eq!(solution.points.len(), points.len());
    assert!(report.iterations <= stop.max_iterations, "{setup:?}");
    let start = residual(system, points, points);
    let first = report.history[0].max;
    assert!(
        first == start
            || (first - start).abs() <= 1e-12 * start
            || start.is_nan() && first.is_nan()
    );
    for errors in &report.history {
        assert!(
            !(errors.mean > errors.max * (1.0 + 1e-12)),
            "{setup:?}: mean above maximum"
        );
    }
    if report.outcome == Outcome::Converged {
        let truth = residual(system, points, &solution.points);
        let allowed =
            stop.tolerance + 1e-15 * points.iter().fold(0.0, |m: f64, p| m.max(p.length()));
        assert!(
            truth <= allowed,
            "{setup:?} claims {} but has {truth:e}",
            report.last().max
        );
    }
    solution
}
