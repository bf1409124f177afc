//! Spectral radii of sweeps, vertex orders and greedy relaxation.

use super::{assemble, named};
use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::analysis::order_study::{self, gauss_southwell, order_study, random_spread};
use limitlab::analysis::spectral_radius::spectral_radius;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::Surface;
use limitlab::mesh::noise::add_noise;
use limitlab::schemes::Scheme;
use limitlab::solvers::ssor::symmetric_sweep;
use limitlab::solvers::system::sweep;
use limitlab::solvers::{Method, Outcome, Stop, run};

#[test]
fn spectral_radii_of_sweeps_agree_with_dense_ones() {
    for (name, scheme) in [
        ("quad-sphere:3", Scheme::CatmullClark),
        ("irregular-quad:500", Scheme::Nasri),
        ("icosphere:2", Scheme::Loop),
        ("irregular-quad:560", Scheme::CatmullClark),
    ] {
        let system = assemble(&named(name), scheme);
        let zero = vec![DVec3::ZERO; system.len()];
        for omega in [0.8, 1.0, 1.3] {
            let plain = |x: &mut [DVec3]| sweep(&system, &zero, omega, 0..zero.len(), x);
            let both = |x: &mut [DVec3]| symmetric_sweep(&system, &zero, omega, None, x);
            let exact = dense::spectral_radius(&system, plain).expect("small");
            let found = spectral_radius(&system, plain).expect("a value");
            assert!((found.value - exact).abs() < 1e-5 * exact, "{name} SOR({omega}): {found:?} {exact}");
            let exact = dense::spectral_radius(&system, both).expect("small");
            let found = spectral_radius(&system, both).expect("a value");
            assert!((found.value - exact).abs() < 1e-5 * exact, "{name} SSOR({omega}): {found:?} {exact}");
        }
    }
}

/// Where over-relaxed sweeps have many eigenvalues of nearly the largest modulus.
#[test]
fn radii_are_found_where_eigenvalues_crowd_the_circle() {
    let system = assemble(&named("torus:24x24"), Scheme::CatmullClark);
    let zero = vec![DVec3::ZERO; system.len()];
    for omega in [1.1, 1.5, 1.7, 1.9] {
        let plain = |x: &mut [DVec3]| sweep(&system, &zero, omega, 0..zero.len(), x);
        let exact = dense::spectral_radius(&system, plain).expect("small");
        let found = spectral_radius(&system, plain).expect("a value");
        assert!((found.value - exact).abs() < 1e-4 * exact, "SOR({omega}): {found:?} {exact}");
    }
}

/// The Arnoldi process has few directions to go: the others are rounding.
#[test]
fn radii_are_found_where_eigenvalues_are_few() {
    for (name, scheme) in [
        ("cubes:40", Scheme::CatmullClark),
        ("cubes:60", Scheme::CatmullClark),
        ("cubes:60", Scheme::Nasri),
        ("torus:20x20", Scheme::CatmullClark),
    ] {
        let system = assemble(&named(name), scheme);
        let zero = vec![DVec3::ZERO; system.len()];
        for omega in [1e-12, 1e-6, 0.8, 1.0, 1.3] {
            let plain = |x: &mut [DVec3]| sweep(&system, &zero, omega, 0..zero.len(), x);
            let exact = dense::spectral_radius(&system, plain).expect("small");
            let found = spectral_radius(&system, plain).expect("a value");
            assert!((found.value - exact).abs() < 1e-5 * exact, "{name}, {scheme}, ω = {omega}: {found:?} {exact}");
        }
    }
}

#[test]
fn greedy_and_ordered_sweeps_solve_the_same_system() {
    let mut mesh = named("irregular-quad:400");
    add_noise(&mut mesh, 0.1, 1);
    let surface = Surface::new(mesh).expect("a closed mesh");
    for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai] {
        let system = LimitSystem::new(&surface, scheme).expect("a system");
        let stop = Stop { tolerance: 1e-10 * surface.diagonal(), max_iterations: 2000 };
        let greedy = gauss_southwell(&system, surface.positions(), &stop);
        assert_eq!(greedy.outcome, Outcome::Converged);
        assert!(greedy.max_error <= 1.01 * stop.tolerance);
        let direct = run(&system, surface.positions(), Method::Cholesky, &stop).points;
        for (a, b) in greedy.points.iter().zip(&direct) {
            assert!(a.distance(*b) < 1e-6 * surface.diagonal());
        }
        let rows = order_study(&surface, &system, &[1.0], 5, &stop).expect("rows");
        assert_eq!(rows.len(), 7 + 5 + 1);
        assert!(rows.iter().all(|r| r.outcome == Outcome::Converged));
        let spread = random_spread(&rows, 1.0).expect("five random orders");
        assert!(spread.rho[0] <= spread.rho[1] && spread.rho[1] <= spread.rho[2]);
        // SOR converges in every order; the reverse order has the transposed matrix's spectrum.
        let rho = |name: &str| rows.iter().find(|r| r.order == name).and_then(|r| r.rho);
        let (forward, backward) = (rho("file").expect("a row"), rho("reverse").expect("a row"));
        assert!((forward - backward).abs() < 1e-6 * forward);
    }
}

#[test]
fn the_spread_is_that_of_the_random_orders_at_one_omega() {
    let row = |order: &str, omega, rho, iterations| order_study::OrderRow {
        order: order.into(),
        omega,
        rho: Some(rho),
        outcome: Outcome::Converged,
        iterations,
        max_error: 0.0,
    };
    let rows = [
        row("file", 1.0, 0.1, 1.0),
        row("random:1", 1.0, 0.5, 20.0),
        row("random:2", 1.0, 0.25, 26.0),
        row("random:3", 1.0, 0.75, 23.0),
        row("random:1", 1.1, 0.9, 90.0),
    ];
    let found = random_spread(&rows, 1.0).expect("three rows");
    assert_eq!((found.omega, found.runs), (1.0, 3));
    assert_eq!((found.rho, found.iterations), ([0.25, 0.5, 0.75], [20.0, 23.0, 26.0]));
    assert_eq!(random_spread(&rows, 1.1).expect("a row").rho, [0.9; 3]);
    assert_eq!(random_spread(&rows, 1.2), None);
}

#[test]
fn greedy_sweeps_count_as_many_updates_as_there_are_vertices() {
    let mut mesh = named("torus:8x6");
    add_noise(&mut mesh, 0.1, 1);
    let system = assemble(&mesh, Scheme::CatmullClark);
    for sweeps in [0, 1, 3] {
        let stop = Stop { tolerance: 0.0, max_iterations: sweeps };
        let greedy = gauss_southwell(&system, &mesh.positions, &stop);
        assert_eq!((greedy.outcome, greedy.updates), (Outcome::MaxIterations, 48 * sweeps));
    }
}
