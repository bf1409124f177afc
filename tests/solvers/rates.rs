//! Closed-form rates on regular tori, and what the data see of them.

use limitlab::analysis::rate::observed_rate;
use limitlab::analysis::spectrum::{excited, spectrum};
use limitlab::analysis::sweep::{OmegaSweep, SweepRow, rounding_floor, sweep};
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::mesh::Mesh;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Errors, Method, Outcome, Solution, Stop};
use std::f64::consts::TAU;

use super::methods::checked;
use crate::common::meshes::*;
use crate::common::tol;

fn solved(mesh: &Mesh, scheme: Scheme, method: Method) -> Solution {
    let stop = Stop { tolerance: 1e-12 * mesh.diagonal(), max_iterations: 20_000 };
    checked(&system(mesh, scheme), &mesh.positions, method, &stop)
}

fn rate(mesh: &Mesh, scheme: Scheme, method: Method) -> f64 {
    let report = solved(mesh, scheme, method).report;
    assert_eq!(report.outcome, Outcome::Converged, "{scheme} {method:?}");
    observed_rate(&report.maxima(), rounding_floor(mesh.diagonal())).unwrap()
}

#[test]
fn rates_on_tori_are_those_of_the_symbols() {
    // Small, so that the modes are well apart and the slowest shows; sides divisible by 2 and 3, so that the ends of the
    // spectra are attained.
    let quads = noisy("torus:8x6");
    let triangles = noisy("tri-torus:6x6");
    for (mesh, scheme, method, expected) in [
        // D⁻¹A has its spectrum in [1/4, 9/4].
        (&quads, Scheme::CatmullClark, Method::Jacobi { omega: Some(0.8) }, 0.8),
        (&quads, Scheme::CatmullClark, Method::Thall, 7.0 / 8.0),
        // A in [1/9, 1].
        (&quads, Scheme::CatmullClark, Method::Pia, 8.0 / 9.0),
        (&quads, Scheme::CatmullClark, Method::WPia { omega: Some(1.8) }, 0.8),
        // A in [1/4, 1], [1/2, 1].
        (&quads, Scheme::Nasri, Method::Pia, 0.75),
        (&quads, Scheme::ZhengCai, Method::Pia, 0.5),
        (&triangles, Scheme::Loop, Method::Pia, 0.75),
        (&triangles, Scheme::Sqrt3, Method::Pia, 0.75),
        // D = A/2 there: the same spectrum, halved damping.
        (&triangles, Scheme::Loop, Method::Thall, 0.75),
    ] {
        let found = rate(mesh, scheme, method);
        assert!((found - expected).abs() <= tol::RATE, "{scheme} {method:?}: {found} instead of {expected}");
    }
}

#[test]
fn undamped_jacobi_diverges_on_regular_quads_and_is_found_out_early() {
    let mesh = noisy("torus:16x12");
    let solution = solved(&mesh, Scheme::CatmullClark, Method::Jacobi { omega: Some(1.0) });
    let report = solution.report;
    assert_eq!(report.outcome, Outcome::Diverged);
    // It grows by up to 5/4 an iteration, and 1.25^60 = 10^5.8.
    assert!(report.iterations < 60, "{} iterations", report.iterations);
    assert!(report.last().max > report.history[0].errors.max);
}

const JACOBI: Method<'static> = Method::Jacobi { omega: None };

fn torus_sweep(grid: &[f64]) -> OmegaSweep {
    let mesh = noisy("torus:32x32");
    let system = system(&mesh, Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 20_000 };
    let floor = rounding_floor(mesh.diagonal());
    let grids = [(JACOBI, grid.to_vec())];
    sweep(
        (&system, &spectrum(&system).unwrap()),
        (&mesh.positions, &mesh.positions),
        &grids,
        None,
        &stop,
        floor,
        &|_| {},
    )
    .unwrap()
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
    assert!((thresholds.critical_omega - 8.0 / 9.0).abs() < tol::ESTIMATE);
    assert!((thresholds.optimal_omega - 0.8).abs() < tol::ESTIMATE);
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
    assert_eq!(sweep.best(JACOBI).unwrap().omega, 0.8);
    let first = sweep.rows.iter().find(|r| r.outcome == Outcome::Diverged).unwrap();
    assert_eq!(first.omega, 0.9);
}

#[test]
fn the_best_omega_has_the_fewest_iterations_then_the_smallest_error() {
    let row = |method, omega, outcome, iterations, max| SweepRow {
        method,
        omega,
        outcome,
        iterations,
        predicted_rho: 0.5,
        predicted_rho_data: None,
        observed_rate: None,
        errors: Errors { max, mean: 0.5 * max },
    };
    let (converged, pia) = (Outcome::Converged, Method::Pia);
    let rows = vec![
        row(pia, 0.9, converged, 30, 1e-12),
        row(pia, 1.0, converged, 20, 3e-11),
        row(pia, 1.1, converged, 20, 1e-11),
        row(pia, 1.2, converged, 20, 2e-11),
        row(pia, 1.3, Outcome::MaxIterations, 10, 1e-13),
        row(JACOBI, 0.8, converged, 5, 1e-13),
    ];
    let sweep = OmegaSweep { thresholds: Vec::new(), rows };
    assert_eq!(sweep.best(pia).map(|r| r.omega), Some(1.1));
    assert_eq!(sweep.best(JACOBI).map(|r| r.omega), Some(0.8));
    assert_eq!(sweep.best(Method::Sor { omega: 1.1, order: None }), None);
}

/// A smooth torus, and a part of it in the lowest mode, ±1 over a chessboard, of ever smaller amplitude.
#[test]
fn a_mode_counts_as_excited_down_to_a_ten_thousand_millionth() {
    let mut mesh = built_in("torus:12x10");
    let system = system(&mesh, Scheme::CatmullClark);
    let smooth = mesh.positions.clone();
    let mut lowest = |amplitude: f64| {
        for (v, (p, smooth)) in mesh.positions.iter_mut().zip(&smooth).enumerate() {
            let sign = if (v / 10 + v % 10) % 2 == 0 { 1.0 } else { -1.0 };
            *p = *smooth + amplitude * sign * glam::DVec3::ONE;
        }
        excited(&system, (&mesh.positions, &mesh.positions), SymmetricForm::A).unwrap().unwrap().min
    };
    for amplitude in [1e-2, 1e-5, 1e-8] {
        let found = lowest(amplitude);
        assert!((found - 1.0 / 9.0).abs() < tol::ESTIMATE, "{amplitude:e}: {found}");
    }
    assert!(lowest(0.0) > 0.5);
}

/// A smooth torus excites 8 of 1024 modes, all near the eigenvalue 1: PIA is done in 4 iterations, though its rate is 8/9.
#[test]
fn a_smooth_torus_says_little_about_the_matrix() {
    let smooth = built_in("torus:32x32");
    let system = system(&smooth, Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10 * smooth.diagonal(), max_iterations: 1000 };
    let pia = Method::Pia;
    let report = checked(&system, &smooth.positions, pia, &stop).report;
    assert_eq!((report.outcome, report.iterations), (Outcome::Converged, 4));
    let noisy = noisy("torus:32x32");
    let report = checked(&system, &noisy.positions, pia, &stop).report;
    assert!(report.iterations > 100, "{} iterations", report.iterations);
}
