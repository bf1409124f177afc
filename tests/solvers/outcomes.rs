//! How runs end that cannot end well: breakdowns, numbers that are not finite, tolerances below rounding, small limits.

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::interpolate;
use limitlab::mesh::Surface;
use limitlab::schemes::{Masks, Scheme};
use limitlab::solvers::iteration::FLOOR;
use limitlab::solvers::{Method, Outcome, Stop, run};

use super::methods::*;
use crate::common::meshes::*;

/// The mean of the neighbours: rows sum to 1, but M = Adj has a zero diagonal and negative eigenvalues.
struct Neighbours;

impl Masks for Neighbours {
    fn h(&self, n: usize) -> f64 {
        1.0 / n as f64
    }
    fn vertex_weight(&self, _: usize) -> f64 {
        0.0
    }
    fn edge_weight(&self) -> f64 {
        1.0
    }
    fn face_weight(&self, _: usize, _: usize) -> f64 {
        0.0
    }
    fn edges_only(&self) -> bool {
        true
    }
}

#[test]
fn a_breakdown_is_an_outcome_that_says_where() {
    let surface = Surface::new(noisy("icosahedron")).unwrap();
    let system = LimitSystem::with_masks(&surface, &Neighbours).unwrap();
    let stop = Stop { tolerance: 1e-10, max_iterations: 100 };
    let report = checked(&system, surface.positions(), Method::PcgIc0, &stop).report;
    assert_eq!((report.outcome, report.iterations), (Outcome::Breakdown, 0));
    let detail = report.detail.unwrap();
    assert!(detail.contains("vertex 0") && detail.contains("pivot"), "{detail}");
    // M is indefinite, which conjugate gradients find out or live with: never a false claim.
    for method in [Method::Cg, Method::PlainCg] {
        let report = checked(&system, surface.positions(), method, &stop).report;
        assert!(matches!(report.outcome, Outcome::Breakdown | Outcome::Converged), "{:?}", report.outcome);
    }
    // Cholesky wants positive pivots, LDLᵀ and LU do not.
    let report = checked(&system, surface.positions(), Method::Cholesky, &stop).report;
    assert_eq!(report.outcome, Outcome::Singular);
    let report = checked(&system, surface.positions(), Method::Lu, &stop).report;
    assert_eq!(report.outcome, Outcome::Converged);
}

/// M under Catmull-Clark has positive entries only: it is no M-matrix, and leaving out fill takes more than the pivots
/// have.
#[test]
fn incomplete_cholesky_breaks_down_on_the_cube() {
    for name in ["cube", "prism:4", "cubes:3"] {
        let mesh = noisy(name);
        let system = system(&mesh, Scheme::CatmullClark);
        let stop = Stop { tolerance: 1e-10, max_iterations: 100 };
        let report = checked(&system, &mesh.positions, Method::PcgIc0, &stop).report;
        assert_eq!((report.outcome, report.iterations), (Outcome::Breakdown, 0), "{name}");
        assert!(report.detail.unwrap().contains("is not positive"));
    }
}

#[test]
fn numbers_that_are_not_finite_never_converge() {
    let mesh = noisy("irregular-tri:100");
    for scheme in Scheme::ALL {
        let system = system(&mesh, scheme);
        let order = reversed(mesh.len());
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for axis in 0..3 {
                let mut points = mesh.positions.clone();
                points[42][axis] = bad;
                for (name, method) in all(&system, &order) {
                    let stop = Stop { tolerance: 1e-3, max_iterations: 50 };
                    let report = checked(&system, &points, method, &stop).report;
                    assert_eq!(report.outcome, Outcome::Diverged, "{name}, {scheme}, {bad}");
                }
            }
        }
        // Nor do points so large that their squares overflow.
        let huge: Vec<DVec3> = mesh.positions.iter().map(|p| 1e200 * *p).collect();
        for (name, method) in all(&system, &order) {
            let stop = Stop { tolerance: 1e-3, max_iterations: 500 };
            let outcome = checked(&system, &huge, method, &stop).report.outcome;
            assert_ne!(outcome, Outcome::Converged, "{name}, {scheme}");
        }
    }
}

#[test]
fn a_tolerance_below_rounding_ends_at_the_last_digits_of_the_data() {
    for scheme in Scheme::ALL {
        let mesh = noisy(if scheme.needs_triangles() { "irregular-tri:200" } else { "torus:14x15" });
        let system = system(&mesh, scheme);
        let order = reversed(mesh.len());
        let stop = Stop { tolerance: 1e-22 * mesh.diagonal(), max_iterations: 10_000 };
        for (name, method) in all(&system, &order) {
            let report = checked(&system, &mesh.positions, method, &stop).report;
            assert_eq!(report.outcome, Outcome::Rounding, "{name}, {scheme}, {:?}", report.last());
            let size = mesh.positions.iter().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
            assert!(report.last().max <= FLOOR * f64::EPSILON * size, "{name}, {scheme}");
            if method.is_direct() {
                assert!(report.iterations <= 3, "{name}, {scheme}: {} solves", report.iterations);
            }
        }
    }
}

#[test]
fn limits_on_iterations_are_kept() {
    let mesh = noisy("icosphere:2");
    let system = system(&mesh, Scheme::Loop);
    let order = reversed(mesh.len());
    for (name, method) in all(&system, &order) {
        for limit in [0, 1, 2] {
            // Never met: direct methods are at rounding after a solve.
            let stop = Stop { tolerance: f64::NAN, max_iterations: limit };
            let report = checked(&system, &mesh.positions, method, &stop).report;
            assert_eq!((report.outcome, report.iterations), (Outcome::MaxIterations, limit), "{name}");
        }
        // A start within the tolerance is a solution.
        let stop = Stop { tolerance: mesh.diagonal(), max_iterations: 5 };
        let report = checked(&system, &mesh.positions, method, &stop).report;
        assert_eq!((report.outcome, report.iterations), (Outcome::Converged, 0), "{name}");
    }
}

#[test]
fn the_smallest_mesh_is_solved_by_every_method() {
    let mesh = built_in("tetrahedron");
    for scheme in Scheme::ALL {
        let system = system(&mesh, scheme);
        let order = reversed(4);
        for (name, method) in all(&system, &order) {
            let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
            let report = checked(&system, &mesh.positions, method, &stop).report;
            assert_eq!(report.outcome, Outcome::Converged, "{name}, {scheme}");
        }
    }
}

/// Squares of such lengths vanish or overflow: whatever a run tells, it is not that the start solves the system.
#[test]
fn lengths_whose_squares_are_lost_never_converge() {
    let surface = Surface::new(noisy("icosphere:1")).unwrap();
    let system = LimitSystem::new(&surface, Scheme::Loop).unwrap();
    let order = reversed(surface.len());
    for unit in [1e-300, 1e-170, 1e-160, 1e155, 1e300] {
        let points: Vec<DVec3> = surface.positions().iter().map(|p| unit * *p).collect();
        let stop = Stop { tolerance: 1e-10 * unit, max_iterations: 300 };
        for (name, method) in all(&system, &order) {
            let report = run(&system, &points, method, &stop).report;
            let told = !report.maxima().iter().any(|&error| error <= stop.tolerance);
            assert!(report.outcome != Outcome::Converged && told, "{name} at {unit:e}: {report:?}");
        }
        let found = interpolate(&surface.with_positions(points), Scheme::Loop, &stop.into()).unwrap();
        assert_ne!(found.report.outcome, Outcome::Converged, "{unit:e}");
    }
}

/// At coordinates of 5·10⁵ errors of 10⁻⁹ are rounding: what wiggles there does not grow.
#[test]
fn rounding_far_from_the_origin_is_no_divergence() {
    for name in ["icosphere:1", "irregular-tri:80", "prism:7"] {
        let mesh = noisy(name);
        let system = system(&mesh, Scheme::CatmullClark);
        let points: Vec<DVec3> = mesh.positions.iter().map(|p| *p + DVec3::splat(5e5)).collect();
        let stop = Stop { tolerance: 1e-14, max_iterations: 2000 };
        let order = reversed(mesh.len());
        for (called, method) in all(&system, &order) {
            let report = run(&system, &points, method, &stop).report;
            assert_ne!(report.outcome, Outcome::Diverged, "{called} on {name}: {:e}", report.last().max);
        }
    }
}
