//! Proven bounds, cheap intervals and promised counts hold.

use super::{assemble, named, random_systems};
use limitlab::analysis::a_priori::Promise;
use limitlab::analysis::dirichlet_neumann::element_bound;
use limitlab::analysis::interval::interval;
use limitlab::analysis::singularity::Singularity;
use limitlab::analysis::spectrum::{Source, ends, mesh_ends};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::analysis::{comparison, dense};
use limitlab::assemble::Operator;
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Stop, run};

#[test]
fn a_regular_grid_attains_its_bounds_at_once() {
    let ends = ends(&assemble(&builtin::torus(64, 50), Scheme::CatmullClark)).expect("values");
    for e in [ends.lambda_min, ends.lambda_max, ends.jacobi_lambda_min, ends.jacobi_lambda_max] {
        assert_eq!(e.source, Source::Proven);
    }
    assert_eq!(ends.applications, 4);
    assert!((ends.lambda_min.value - 1.0 / 9.0).abs() < 1e-15);
    assert!((ends.jacobi_lambda_min.value - 0.25).abs() < 1e-15);
}

/// The interval, the spectrum of A or D⁻¹A, and what valences prove of its lower end.
fn intervals(surface: &Surface, scheme: Scheme) -> [(limitlab::analysis::interval::Interval, f64, f64, f64); 2] {
    let operator = Operator::new(surface, scheme).expect("an operator");
    let exact = mesh_ends(surface, scheme).expect("values").spectrum();
    let b = operator.bounds();
    [(SymmetricForm::A, exact.a, b.lambda_min), (SymmetricForm::Jacobi, exact.jacobi, b.jacobi_lambda_min)].map(
        |(which, exact, bound)| {
            let found = interval(&operator, which).expect("finite numbers");
            (found, exact.min, exact.max, bound)
        },
    )
}

#[test]
fn cheap_intervals_are_proven_above_and_sharp_below() {
    for (name, surface, scheme, _) in random_systems(120) {
        for (found, min, max, bound) in intervals(&surface, scheme) {
            assert!(max <= found.high + 1e-12, "{name}: {found:?} {max}");
            // Small meshes are their own sample.
            assert!(found.least >= min - 1e-12, "{name}: {found:?} {min}");
            assert!((found.least - min).abs() <= 5e-3 * max, "{name}: {found:?} {min}");
            assert!(found.low >= bound, "{name}: {found:?} {bound}");
        }
    }
    for (name, scheme) in [
        ("irregular-quad:40000", Scheme::CatmullClark),
        ("irregular-quad:40000", Scheme::Nasri),
        ("irregular-poly:40000", Scheme::CatmullClark),
        ("irregular-tri:40000", Scheme::Loop),
        ("irregular-tri:40000", Scheme::Sqrt3),
        ("irregular-tri:40000", Scheme::CatmullClark),
        ("quad-sphere:6", Scheme::CatmullClark),
        ("torus:200x200", Scheme::CatmullClark),
    ] {
        let surface = Surface::new(named(name)).expect("a closed mesh");
        for (found, min, max, _) in intervals(&surface, scheme) {
            assert!(max <= found.high * (1.0 + 1e-12) && found.high < 1.06 * max, "{name}: {found:?} {max}");
            assert!(min <= found.least * (1.0 + 1e-9) && found.least < 1.03 * min, "{name}: {found:?} {min}");
            assert!(found.low <= min * (1.0 + 1e-12), "{name}: {found:?} {min}");
        }
    }
}

#[test]
fn elements_prove_at_least_what_valences_do() {
    let mut better = 0;
    for (name, surface, scheme, system) in random_systems(120) {
        let all = dense::eigenvalues(&system).expect("small");
        let b = system.bounds;
        let last = all.a.len() - 1;
        for (operator, end, valences, exact) in [
            (SymmetricForm::A, End::Lowest, b.lambda_min, all.a[0]),
            (SymmetricForm::A, End::Highest, b.lambda_max, all.a[last]),
            (SymmetricForm::Jacobi, End::Lowest, b.jacobi_lambda_min, all.jacobi[0]),
            (SymmetricForm::Jacobi, End::Highest, b.jacobi_lambda_max, all.jacobi[last]),
        ] {
            let bound = element_bound(&surface, scheme, operator, end).expect("closed");
            let outwards = match end {
                End::Lowest => -1.0,
                End::Highest => 1.0,
            };
            assert!(outwards * (bound - exact) > -1e-12, "{name}: {bound} {exact}");
            assert!(outwards * (valences - bound) > -1e-12, "{name}: {bound} {valences}");
            better += usize::from(outwards * (valences - bound) > 1e-3);
        }
    }
    assert!(better > 50, "{better}");
}

#[test]
fn proven_bounds_hold_on_hundreds_of_random_meshes() {
    let mut tried = 0;
    for (name, surface, scheme, system) in random_systems(260) {
        let all = dense::eigenvalues(&system).expect("small");
        let b = system.bounds;
        let slack = 1e-12;
        let (low, high) = (all.a[0], all.a[all.a.len() - 1]);
        assert!(b.lambda_min <= low + slack, "{name}: {} > {low}", b.lambda_min);
        assert!((high - 1.0).abs() < 1e-11 && b.lambda_max == 1.0, "{name}: {high}");
        assert!(b.jacobi_lambda_min <= all.jacobi[0] + slack, "{name}");
        assert!(all.jacobi[all.a.len() - 1] <= b.jacobi_lambda_max + slack, "{name}");
        let ceiling = match scheme {
            Scheme::CatmullClark | Scheme::Nasri => 4.0,
            Scheme::Loop => 2.5,
            Scheme::Sqrt3 => 8.0 / 3.0,
            Scheme::ZhengCai | Scheme::MidEdge => 2.0,
        };
        assert!(b.jacobi_lambda_max <= ceiling + slack, "{name}");
        let promise = Promise::new(&system.bounds);
        assert!(promise.safe_omega_jacobi >= 0.5 - slack);
        // The detective's theory against the numbers.
        let verdict = Singularity::detect(&surface, scheme);
        let zeros = all.a.iter().filter(|l| l.abs() < 1e-10).count();
        assert_eq!(verdict.kernel_dimension(), zeros, "{name}");
        tried += 1;
    }
    assert!(tried > 300, "{tried} systems");
}

#[test]
fn promised_counts_are_kept_by_runs() {
    let mut tight = 0;
    for (name, surface, _, system) in random_systems(60) {
        let mut mesh = surface.into_mesh();
        add_noise(&mut mesh, 0.1, 5);
        let tolerance = 1e-8 * mesh.diagonal();
        let promise = Promise::new(&system.bounds);
        let counts = promise.counts(&system, (&mesh.positions, &mesh.positions), tolerance);
        let stop = Stop { tolerance, max_iterations: 5000 };
        let mut check = |method: Method, promised: f64| {
            if !promised.is_finite() {
                return;
            }
            let report = run(&system, &mesh.positions, method, &stop).report;
            assert_eq!(report.outcome, Outcome::Converged, "{name} {method:?}");
            let took = report.iterations as f64;
            assert!(took <= promised, "{name} {method:?}: {took} > {promised}");
            tight += usize::from(took > 0.5 * promised);
        };
        check(Method::Pia, counts.pia);
        check(Method::WPia { omega: Some(promise.omega_w_pia) }, counts.w_pia);
        check(Method::Thall, counts.thall);
        if promise.a.min > 0.0 {
            let spectrum = (promise.a.min, promise.a.max);
            check(Method::Chebyshev { interval: Some(spectrum) }, counts.chebyshev);
        }
    }
    assert!(tight > 50, "the promises are not idle: {tight}");
}

/// Without a proven bound the interval starts a little below the computed λ_min, or at 10⁻³ where that vanishes.
#[test]
fn an_estimated_chebyshev_interval_holds_the_spectrum() {
    for name in ["prism:5", "dodecahedron", "cube"] {
        let system = assemble(&named(name), Scheme::CatmullClark);
        assert_eq!(system.bounds.lambda_min, 0.0);
        let least = dense::eigenvalues(&system).expect("small").a[0];
        let spectrum = || limitlab::analysis::spectrum::spectrum(&system);
        let method =
            comparison::with_spectrum(&system, Method::Chebyshev { interval: None }, &spectrum).expect("dense spectra");
        let Method::Chebyshev { interval: Some((low, high)) } = method else { panic!("{method:?}") };
        assert_eq!(high, 1.0);
        if name == "cube" {
            assert_eq!(low, 1e-3);
        } else {
            assert!((0.95 * least..0.99 * least).contains(&low), "{name}: {low} for {least}");
        }
    }
}
