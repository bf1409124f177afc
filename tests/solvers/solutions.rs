//! Every method on every scheme: a solution chosen beforehand, a direct solve, a second library, a conserved sum.

use glam::DVec3;
use limitlab::analysis::dense::gaussian_elimination;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Stop};
use limitlab_factorizations::dense::small_lu;
use nalgebra::DMatrix;

use super::methods::*;
use crate::common::formulas::assemble;
use crate::common::meshes::*;
use crate::common::tol;

const STOP: Stop = Stop { tolerance: 1e-11, max_iterations: 200_000 };

/// Below, a system is singular or so nearly so that its solution says little: duals and other meshes of valence 3 under
/// Catmull-Clark. They have their own tests.
const LEAST: f64 = 1e-4;

#[test]
fn every_method_finds_the_solution_chosen_beforehand() {
    let (mut runs, mut breakdowns) = (0, 0);
    for scheme in Scheme::ALL {
        for seed in 0..24 {
            let mesh = small_mesh(scheme, seed);
            let system = system(&mesh, scheme);
            let lambda_min = assemble(scheme, &mesh).eigenvalues()[0];
            if lambda_min < LEAST {
                continue;
            }
            let exact = random_points(mesh.len(), seed);
            let points = product(&system, &exact);
            let order = reversed(mesh.len());
            for (name, method) in all(&system, &order) {
                let solution = checked(&system, &points, method, &STOP);
                let what = format!("{name}, {scheme}, seed {seed}, {} vertices", mesh.len());
                runs += 1;
                if method == Method::PcgIc0 && solution.report.outcome == Outcome::Breakdown {
                    breakdowns += 1;
                    continue;
                }
                assert_eq!(solution.report.outcome, Outcome::Converged, "{what}");
                let allowed = tol::solution(&system, lambda_min, STOP.tolerance, 1.0);
                let error = distance(&solution.points, &exact);
                assert!(error <= allowed, "{what}: {error:e} > {allowed:e}");
            }
            let allowed = tol::solution(&system, lambda_min, STOP.tolerance, 1.0);
            let error = distance(&gaussian_elimination(&system, &points), &exact);
            assert!(error <= allowed, "dense elimination, {scheme}, seed {seed}: {error:e} > {allowed:e}");
        }
    }
    assert!(runs > 1500, "{runs} runs");
    // M is no M-matrix, but incomplete Cholesky rarely fails.
    assert!(breakdowns * 100 < runs, "{breakdowns} breakdowns");
}

#[test]
fn every_method_agrees_with_dense_elimination_of_the_formulas() {
    for scheme in Scheme::ALL {
        let name = if scheme.needs_triangles() { "irregular-tri:150" } else { "irregular-poly:150" };
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let plain = assemble(scheme, &mesh);
        let right = DMatrix::from_fn(mesh.len(), 3, |i, axis| mesh.positions[i][axis]);
        let solved = small_lu(plain.dense_a()).solve(&right).unwrap();
        let expected: Vec<DVec3> =
            (0..mesh.len()).map(|i| DVec3::new(solved[(i, 0)], solved[(i, 1)], solved[(i, 2)])).collect();
        let lambda_min = plain.eigenvalues()[0];
        let allowed = tol::solution(&system, lambda_min, STOP.tolerance, mesh.diagonal());
        let order = reversed(mesh.len());
        for (name, method) in all(&system, &order) {
            let solution = checked(&system, &mesh.positions, method, &STOP);
            assert_eq!(solution.report.outcome, Outcome::Converged, "{name}, {scheme}");
            let error = distance(&solution.points, &expected);
            assert!(error <= allowed, "{name}, {scheme}: {error:e} > {allowed:e}");
        }
    }
}

/// wᵀA = wᵀ with w = H⁻¹1: the solution keeps Σ V_i/h_i = Σ P_i/h_i.
#[test]
fn every_solution_keeps_the_weighted_sum() {
    for scheme in Scheme::ALL {
        let name = if soluble_on_quads(scheme) { "irregular-quad:100" } else { "star:6" };
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let sum = |points: &[DVec3]| -> DVec3 { points.iter().zip(&system.h).map(|(p, h)| *p / *h).sum() };
        let total: f64 = system.h.iter().map(|h| 1.0 / h).sum();
        let order = reversed(mesh.len());
        for (name, method) in all(&system, &order) {
            let solution = checked(&system, &mesh.positions, method, &STOP);
            let drift = (sum(&solution.points) - sum(&mesh.positions)).length() / total;
            // w·(V − P) = w·(A V − P): no more than the residual, averaged.
            let allowed = STOP.tolerance + tol::rounding(mesh.len()) * mesh.diagonal();
            assert!(drift <= allowed, "{name}, {scheme}: {drift:e}");
        }
    }
}

#[test]
fn direct_methods_need_one_iteration_and_tell_their_fill() {
    let mesh = noisy("irregular-quad:1000");
    let system = system(&mesh, Scheme::CatmullClark);
    let lower = (system.m.values().len() + mesh.len()) / 2;
    for (name, method) in DIRECT {
        let solution = checked(&system, &mesh.positions, method, &STOP);
        assert_eq!((solution.report.outcome, solution.report.iterations), (Outcome::Converged, 1), "{name}");
        // Factors hold at least the matrix's own entries.
        assert!(solution.fill.is_none_or(|fill| fill >= lower), "{name}: {:?}", solution.fill);
    }
    let fill = |method| checked(&system, &mesh.positions, method, &STOP).fill.unwrap();
    // The two libraries factor in the same order; faer's supernodes store some zeros too.
    assert!(fill(Method::SecondCholesky) <= fill(Method::Cholesky));
}
