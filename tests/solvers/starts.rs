//! Runs that begin elsewhere than at V = P.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::assemble::LimitSystem;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Solution, Stop, run, run_from};

use super::methods::*;
use crate::common::meshes::*;
use crate::common::tol;

fn from(system: &LimitSystem, points: &[DVec3], start: &[DVec3], method: Method, stop: &Stop) -> Solution {
    run_from(system, points, start, method, stop, &mut |_| ControlFlow::Continue(()))
}

/// Every method under every scheme, on a mesh where it has a solution.
fn for_each_method(visit: impl Fn(&str, &LimitSystem, &[DVec3], Method)) {
    for scheme in Scheme::ALL {
        let name = if soluble_on_quads(scheme) { "irregular-quad:60" } else { "irregular-tri:60" };
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let order = reversed(mesh.len());
        for (called, method) in all(&system, &order) {
            visit(&format!("{called}, {scheme}"), &system, &mesh.positions, method);
        }
    }
}

#[test]
fn a_start_at_the_points_is_the_usual_one() {
    let stop = Stop { tolerance: 0.0, max_iterations: 15 };
    for_each_method(|what, system, points, method| {
        let (usual, copy) = (run(system, points, method, &stop), points.to_vec());
        let found = from(system, points, &copy, method, &stop);
        assert_eq!((&found.points, &found.report), (&usual.points, &usual.report), "{what}");
    });
}

#[test]
fn every_start_ends_at_the_solution() {
    for_each_method(|what, system, points, method| {
        let size = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        let stop = Stop { tolerance: 1e-10 * size, max_iterations: 20_000 };
        let exact = run(system, points, Method::Cholesky, &Stop { tolerance: 0.0, max_iterations: 2 }).points;
        let least = dense::eigenvalues(system).unwrap().a[0];
        let allowed = tol::solution(system, least, stop.tolerance, size);
        let random = random_points(points.len(), 11);
        let far: Vec<DVec3> = random.iter().map(|p| 100.0 * size * *p).collect();
        for start in [vec![DVec3::ZERO; points.len()], random, far] {
            let found = from(system, points, &start, method, &stop);
            assert_eq!(found.report.outcome, Outcome::Converged, "{what}: {:?}", found.report.detail);
            assert_eq!(found.report.history[0].errors.max, residual(system, points, &start), "{what}");
            assert!(distance(&found.points, &exact) <= allowed, "{what}");
        }
        let again = from(system, points, &exact, method, &stop);
        assert_eq!((again.report.outcome, again.report.iterations), (Outcome::Converged, 0), "{what}");
        assert_eq!(again.points, exact);
    });
}

/// The start is what a run that cannot begin leaves.
#[test]
fn a_set_up_that_fails_leaves_the_start() {
    let mesh = noisy("cube");
    let system = system(&mesh, Scheme::CatmullClark);
    let start = random_points(8, 1);
    let found = from(&system, &mesh.positions, &start, Method::Cholesky, &Stop { tolerance: 0.0, max_iterations: 5 });
    assert_eq!((found.report.outcome, &found.points), (Outcome::Singular, &start));
    assert_eq!(found.report.last().max, residual(&system, &mesh.positions, &start));
}
