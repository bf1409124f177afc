//! Closed-form rates on regular tori, and what the data see of them.

use limitlab::analysis::rate::observed_rate;
use limitlab::analysis::sweep::{Sweep, rounding_floor, sweep};
use limitlab::assemble::Scheme;
use limitlab::mesh::Mesh;
use limitlab::solvers::{Method, Outcome, Setup, Solution, Stop};
use std::f64::consts::TAU;

use crate::common::meshes::*;
use crate::common::tol;
use crate::setups::checked;

fn solved(mesh: &Mesh, scheme: Scheme, setup: Setup) -> Solution {
    let stop = Stop { tolerance: 1e-12 * mesh.diagonal(), max_iterations: 20_000 };
    checked(&system(mesh, scheme), &mesh.positions, setup, &stop)
}

fn rate(mesh: &Mesh, scheme: Scheme, setup: Setup) -> f64 {
    let report = solved(mesh, scheme, setup).report;
    assert_eq!(report.outcome, Outcome::Converged, "{scheme} {setup:?}");
    let history: Vec<f64> = report.history.iter().map(|e| e.max).collect();
    observed_rate(&history, rounding_floor(mesh.diagonal())).unwrap()
}

#[test]
fn rates_on_tori_are_those_of_the_symbols() {
    // Small, so that the modes are well apart and the slowest shows; sides divisible by 2 and 3, so that the ends of the
    // spectra are attained.
    let quads = noisy("torus:8x6");
    let triangles = noisy("tri-torus:6x6");
    for (mesh, scheme, setup, expected) in [
        // D⁻¹A has its spectrum in [1/4, 9/4].
        (&quads, Scheme::CatmullClark, Setup::Jacobi { omega: 0.8 }, 0.8),
        (&quads, Scheme::CatmullClark, Setup::THALL, 7.0 / 8.0),
        // A in [1/9, 1].
        (&quads, Scheme::CatmullClark, Setup::Pia { omega: 1.0 }, 8.0 / 9.0),
        (&quads, Scheme::CatmullClark, Setup::Pia { omega: 1.8 }, 0.8),
        // A in [1/4, 1], [1/2, 1].
        (&quads, Scheme::Nasri, Setup::Pia { omega: 1.0 }, 0.75),
        (&quads, Scheme::ZhengCai, Setup::Pia { omega: 1.0 }, 0.5),
        (&triangles, Scheme::Loop, Setup::Pia { omega: 1.0 }, 0.75),
        (&triangles, Scheme::Sqrt3, Setup::Pia { omega: 1.0 }, 0.75),
        // D = A/2 there: the same spectrum, halved damping.
        (&triangles, Scheme::Loop, Setup::THALL, 0.75),
    ] {
        let found = rate(mesh, scheme, setup);
        assert!((found - expected).abs() <= tol::RATE, "{scheme} {setup:?}: {found} instead of {expected}");
    }
}

#[test]
fn undamped_jacobi_diverges_on_regular_quads_and_is_found_out_early() {
    let mesh = noisy("torus:16x12");
    let solution = solved(&mesh, Scheme::CatmullClark, Setup::Jacobi { omega: 1.0 });
    let report = solution.report;
    assert_eq!(report.outcome, Outcome::Diverged);
    // It grows by up to 5/4 an iteration, and 1.25^60 = 10^5.8.
    assert!(report.iterations < 60, "{} iterations", report.iterations);
    assert!(report.last().max > report.history[0].max);
}

fn torus_sweep(grid: &[f64]) -> Sweep {
    let mesh = noisy("torus:32x32");
    let system = system(&mesh, Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 20_000 };
    let floor = rounding_floor(mesh.diagonal());
    let grids = [(Method::Jacobi, grid.to_vec())];
    sweep(&system, &mesh.positions, &grids, None, &stop, floor, &|_| {}).unwrap()
}

/// On noisy points the constant vector, which has 9/4, is not excited; its neighbours in frequency are.
#[test]
fn the_noisy_torus_is_best_at_four_fifths_and_diverges_where_an_excited_mode_grows() {
    let excited = 0.75 * (2.0 + (TAU / 32.0).cos());
    let threshold = 2.0 / excited;
    // The grid has a point between the thresholds of the matrix, 0.8889, and of the data, 0.8946.
    let grid: Vec<f64> = (1..=190).map(|k| k as f64 / 200.0).filter(|w| *w >= 0.7).collect();
    let sweep = torus_sweep(&grid);
    let thresholds = sweep.thresholds[0];
    assert!((thresholds.matrix.critical_omega() - 8.0 / 9.0).abs() < tol::ESTIMATE);
    assert!((thresholds.matrix.optimal_omega() - 0.8).abs() < tol::ESTIMATE);
    let data = thresholds.data.unwrap();
    assert!((data.critical_omega() - threshold).abs() < tol::ESTIMATE, "{}", data.critical_omega());
    for row in &sweep.rows {
        let omega = row.omega;
        let radius = (1.0 - 0.25 * omega).max((1.0 - 2.25 * omega).abs());
        assert!((row.predicted_rho - radius).abs() < tol::ESTIMATE, "ω = {omega}");
        let expected = if omega < threshold { Outcome::Converged } else { Outcome::Diverged };
        assert_eq!(row.outcome, expected, "ω = {omega}");
    }
    let between: Vec<f64> = (sweep.rows.iter())
        .filter(|r| r.outcome == Outcome::Converged && r.predicted_rho > 1.0)
        .map(|r| r.omega)
        .collect();
    assert_eq!(between, [0.89]);

    // On the program's grid, steps of 0.05, the best is exactly 0.8.
    let coarse: Vec<f64> = (1..=24).map(|k| k as f64 / 20.0).collect();
    let sweep = torus_sweep(&coarse);
    assert_eq!(sweep.best(Method::Jacobi).unwrap().omega, 0.8);
    let first = sweep.rows.iter().find(|r| r.outcome == Outcome::Diverged).unwrap();
    assert_eq!(first.omega, 0.9);
}

/// A smooth torus excites 8 of 1024 modes, all near the eigenvalue 1: PIA is done in 4 iterations, though its rate is 8/9.
#[test]
fn a_smooth_torus_says_little_about_the_matrix() {
    let smooth = built_in("torus:32x32");
    let system = system(&smooth, Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10 * smooth.diagonal(), max_iterations: 1000 };
    let pia = Setup::Pia { omega: 1.0 };
    let report = checked(&system, &smooth.positions, pia, &stop).report;
    assert_eq!((report.outcome, report.iterations), (Outcome::Converged, 4));
    let noisy = noisy("torus:32x32");
    let report = checked(&system, &noisy.positions, pia, &stop).report;
    assert!(report.iterations > 100, "{} iterations", report.iterations);
}
