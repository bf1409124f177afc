//! All methods with their parameters on one system, and runs that hold what every run must.

use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::assemble::LimitSystem;
use limitlab::solvers::{Accelerated, Method, Outcome, Recorded, Solution, Stop, run};

use crate::common::tol;

pub const DIRECT: [(&str, Method<'static>); 4] = [
    ("lu", Method::Lu),
    ("cholesky", Method::Cholesky),
    ("ldlt", Method::Ldlt),
    ("second cholesky", Method::SecondCholesky),
];

/// Eigenvalues below count as 0 for the interval of Chebyshev's iteration.
const LOWEST: f64 = 1e-3;

/// Every iterative method. `order` is that of the ordered variants.
pub fn iterative<'a>(system: &LimitSystem, order: &'a [u32]) -> Vec<(&'static str, Method<'a>)> {
    let eigenvalues = dense::eigenvalues(system).unwrap();
    let optimal = |all: &[f64]| 2.0 / (all[0] + all[all.len() - 1]);
    let order = Some(order);
    vec![
        ("thall", Method::Thall),
        ("jacobi", Method::Jacobi { omega: Some(optimal(&eigenvalues.jacobi)) }),
        ("gauss-seidel", Method::GaussSeidel { order: None }),
        ("gauss-seidel in order", Method::GaussSeidel { order }),
        ("sor", Method::Sor { omega: 1.2, order }),
        ("ssor", Method::Ssor { omega: 1.0, order: None }),
        ("ssor in order", Method::Ssor { omega: 1.3, order }),
        ("pia", Method::Pia),
        ("w-pia", Method::WPia { omega: Some(optimal(&eigenvalues.a)) }),
        ("anderson pia", Method::Anderson { of: Accelerated::Pia { omega: Some(1.0) }, window: 5 }),
        ("anderson thall", Method::Anderson { of: Accelerated::Jacobi { omega: Some(0.5) }, window: 3 }),
        (
            "anderson jacobi",
            Method::Anderson { of: Accelerated::Jacobi { omega: Some(optimal(&eigenvalues.jacobi)) }, window: 1 },
        ),
        ("heavy ball", Method::HeavyBall { interval: Some((eigenvalues.a[0].max(LOWEST), 1.0)) }),
        ("chebyshev", Method::Chebyshev { interval: Some((eigenvalues.a[0].max(LOWEST), 1.0)) }),
        ("cg", Method::Cg),
        ("plain cg", Method::PlainCg),
        ("pcg-jacobi", Method::PcgJacobi),
        ("pcg-ssor", Method::PcgSsor { omega: 1.0 }),
        ("pcg-ic0", Method::PcgIc0),
    ]
}

pub fn all<'a>(system: &LimitSystem, order: &'a [u32]) -> Vec<(&'static str, Method<'a>)> {
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
pub fn checked(system: &LimitSystem, points: &[DVec3], method: Method, stop: &Stop) -> Solution {
    let solution = run(system, points, method, stop);
    let report = &solution.report;
    assert_eq!(report.history.len(), report.iterations + 1, "{method:?}: {:?}", report.outcome);
    assert_eq!(solution.points.len(), points.len());
    assert!(report.iterations <= stop.max_iterations, "{method:?}");
    // The same operations in the same order: the same number.
    let same = |a: f64, b: f64| a == b || a.is_nan() && b.is_nan();
    let (start, first) = (residual(system, points, points), report.history[0].errors.max);
    assert!(same(first, start), "{method:?}: {first:e} at the start is {start:e}");
    for (iteration, &Recorded { iteration: at, errors }) in report.history.iter().enumerate() {
        assert_eq!(at, iteration, "{method:?}");
        let limit = errors.max * (1.0 + tol::rounding(points.len()));
        assert!(errors.mean <= limit || errors.mean.is_nan(), "{method:?}: mean above maximum");
    }
    let (truth, last) = (residual(system, points, &solution.points), report.last().max);
    if report.outcome == Outcome::Converged {
        assert!(same(last, truth), "{method:?} claims {last:e} but has {truth:e}");
        assert!(truth <= stop.tolerance);
    }
    solution
}
