//! Every method under every scheme on both back ends: the stored matrix, and the operator without one.

use limitlab::assemble::{LimitSystem, Operator};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Stop, run};

use super::methods::*;
use crate::common::meshes::*;

/// The methods that need the entries of the matrix.
fn factors(method: Method) -> bool {
    DIRECT.iter().any(|d| d.1 == method) || method == Method::PcgIc0
}

/// Meshes whose rows are of every kind: triangles, quads, polygons, mixed.
fn meshes(scheme: Scheme) -> Vec<Mesh> {
    let names: &[&str] = match scheme.needs_triangles() {
        true => &["icosphere:1", "irregular-tri:80"],
        false => &["icosphere:1", "irregular-poly:80", "torus:7x6", "prism:7"],
    };
    let mut meshes: Vec<Mesh> = names.iter().map(|name| noisy(name)).collect();
    if soluble_on_quads(scheme) {
        meshes.push(noisy("irregular-quad:80"));
    }
    meshes
}

fn hold(scheme: Scheme, mesh: &Mesh, explicit: &LimitSystem, free: &Operator) {
    let points = &mesh.positions;
    let stop = Stop { tolerance: 1e-9 * mesh.diagonal(), max_iterations: 20_000 };
    let order = reversed(mesh.len());
    for (name, method) in all(explicit, &order) {
        let what = format!("{name}, {scheme}, {} vertices", mesh.len());
        let stored = run(explicit, points, method, &stop);
        let found = run(free, points, method, &stop);
        if factors(method) {
            assert_eq!((found.report.outcome, found.report.iterations), (Outcome::Breakdown, 0), "{what}");
            assert!(found.report.detail.is_some_and(|d| d.contains("does not store")), "{what}");
            assert_eq!(&found.points, points);
            continue;
        }
        let (stored, found) = (stored.report, found.report);
        assert_eq!(stored.outcome, Outcome::Converged, "{what}");
        assert_eq!(found.outcome, stored.outcome, "{what}");
        // Anderson's coefficients are quotients of differences, which grow the last digits' differences.
        let accelerated = matches!(method, Method::Anderson { .. });
        let allowed = 1 + if accelerated { stored.iterations / 10 } else { 0 };
        let counts = (stored.iterations, found.iterations);
        assert!(counts.0.abs_diff(counts.1) <= allowed, "{what}: {counts:?}");
        for (a, b) in stored.history.iter().zip(&found.history).take(5) {
            assert!(
                (a.errors.max - b.errors.max).abs() <= 1e-11 * (1.0 + a.errors.max),
                "{what}: {:e} and {:e}",
                a.errors.max,
                b.errors.max
            );
        }
    }
}

#[test]
fn every_method_under_every_scheme_runs_on_both_back_ends_alike() {
    for scheme in Scheme::ALL {
        for mesh in meshes(scheme) {
            let surface = Surface::new(mesh).unwrap();
            let free = Operator::new(&surface, scheme).expect("an operator");
            let stored = LimitSystem::new(&surface, scheme).expect("a system");
            hold(scheme, surface.mesh(), &stored, &free);
        }
    }
}
