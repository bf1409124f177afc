//! All methods with their parameters on one system, and runs that hold what every run must.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::assemble::LimitSystem;
use limitlab::assemble::bounds::SpectralBounds;
use limitlab::assemble::weights::Point;
use limitlab::mesh::builtin::builtin;
use limitlab::schemes::Scheme;
use limitlab::solvers::system::Entries;
use limitlab::solvers::{Accelerated, Method, Outcome, Recorded, Solution, Stop, System, run};

use crate::common::{meshes, tol};

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
    if matches!(report.outcome, Outcome::Converged | Outcome::Rounding) {
        assert!(same(last, truth), "{method:?} claims {last:e} but has {truth:e}");
        assert!(truth <= stop.tolerance || report.outcome == Outcome::Rounding);
    }
    solution
}

/// A system that counts the rows it is asked for.
struct Counted<'a> {
    system: &'a LimitSystem,
    rows: AtomicUsize,
}

impl System for Counted<'_> {
    fn len(&self) -> usize {
        self.system.len()
    }

    fn weights(&self) -> &[f64] {
        System::weights(self.system)
    }

    fn diagonal(&self) -> &[f64] {
        System::diagonal(self.system)
    }

    fn bounds(&self) -> SpectralBounds {
        System::bounds(self.system)
    }

    fn stored(&self) -> Option<Entries<'_>> {
        self.system.stored()
    }

    fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        self.rows.fetch_add(1, Ordering::Relaxed);
        self.system.row(i, x)
    }
}

#[test]
fn iterations_make_as_many_passes_as_is_said() {
    let system = meshes::system(&builtin("irregular-quad:400").unwrap(), Scheme::CatmullClark);
    let points: Vec<DVec3> =
        (0..system.len()).map(|i| DVec3::new((i as f64).sin(), (7 * i) as f64 % 5.0, 1.0)).collect();
    for (name, method) in iterative(&system, &reversed(system.len())) {
        // Four iterations more: what a start takes is in both. After more, conjugate gradients evaluate drift at times.
        let rows = [2, 6].map(|max_iterations| {
            let counted = Counted { system: &system, rows: AtomicUsize::new(0) };
            let report = run(&counted, &points, method, &Stop { tolerance: 1e-300, max_iterations }).report;
            assert_eq!(report.iterations, max_iterations, "{name}");
            counted.rows.into_inner()
        });
        let products = (rows[1] - rows[0]) as f64 / (4 * system.len()) as f64;
        // The triangular solves read the factor.
        let of_factors = if method == Method::PcgIc0 { 1.0 } else { 0.0 };
        assert_eq!(method.passes().map(|passes| passes as f64), Some(products + of_factors), "{name}");
    }
}
