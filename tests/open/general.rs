//! Methods on all of the matrix where darts and semi-sharp vertices leave it without symmetry, and its complex spectrum.

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::Error;
use limitlab::analysis::comparison::with_spectrum;
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::predict::predicted_rate;
use limitlab::analysis::singularity::Singularity;
use limitlab::analysis::spectrum::Spectra;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::assemble::{GeneralSystem, Stages};
use limitlab::interpolate::{Options, Tolerance, interpolate, limit_points};
use limitlab::mesh::Surface;
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::noise::add_noise;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Accelerated, Method, Outcome, Stop, run};
use limitlab_factorizations::dense::{small_eigenvalues, small_lu, small_singular_values};
use nalgebra::{DMatrix, DVector};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};

use super::random_semi_sharp;
use crate::common::meshes::built_in;

const SCHEMES: [Scheme; 2] = [Scheme::CatmullClark, Scheme::Loop];

fn dense(system: &GeneralSystem) -> DMatrix<f64> {
    let n = system.matrix().len();
    DMatrix::from_fn(n, n, |i, j| system.matrix().get(i, j))
}

fn radius(matrix: DMatrix<f64>) -> f64 {
    small_eigenvalues(matrix, 1e-14, 10_000).unwrap().iter().map(|z| z.norm()).fold(0.0, f64::max)
}

/// The error matrix of a method by its splitting: I − ωA, I − ωD⁻¹A, I − ω(D + ωL)⁻¹A in an order, there and back.
fn error_matrix(a: &DMatrix<f64>, method: Method) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let one = DMatrix::<f64>::identity(n, n);
    let inverse = DMatrix::from_diagonal(&a.diagonal().map(|d| 1.0 / d));
    let sweep = |omega: f64, order: Option<&[u32]>| {
        let mut place: Vec<usize> = (0..n).collect();
        order.into_iter().flatten().enumerate().for_each(|(k, &v)| place[v as usize] = k);
        let lower = DMatrix::from_fn(n, n, |i, j| match place[j].cmp(&place[i]) {
            std::cmp::Ordering::Less => omega * a[(i, j)],
            std::cmp::Ordering::Equal => a[(i, j)],
            std::cmp::Ordering::Greater => 0.0,
        });
        &one - small_lu(lower).solve(a).unwrap() * omega
    };
    match method {
        Method::Pia => Some(&one - a),
        Method::WPia { omega } => Some(&one - a * omega?),
        Method::Thall => Some(&one - inverse * a * 0.5),
        Method::Jacobi { omega } => Some(&one - inverse * a * omega?),
        Method::GaussSeidel { order } => Some(sweep(1.0, order)),
        Method::Sor { omega, order } => Some(sweep(omega, order)),
        Method::Ssor { omega, order } => {
            let back: Vec<u32> = order?.iter().rev().copied().collect();
            Some(sweep(omega, Some(&back)) * sweep(omega, order))
        }
        _ => None,
    }
}

#[test]
fn methods_that_need_no_symmetry_solve_the_whole_in_any_order() {
    let stop = Stop { tolerance: 1e-11, max_iterations: 20_000 };
    for scheme in SCHEMES {
        let mut tried = 0;
        for seed in 0..120 {
            let Some((surface, _)) = random_semi_sharp(scheme, seed) else { continue };
            let stages = Stages::new(&surface, scheme, None).unwrap();
            // A tag may be a corner's already.
            if stages.stars().is_none() {
                continue;
            }
            let system = stages.whole();
            let (a, n) = (dense(&system), surface.len());
            // What is nearly singular takes too long.
            if small_singular_values(a.clone()).min() < 0.02 {
                continue;
            }
            let points = surface.positions();
            let solved =
                [0, 1, 2].map(|axis| small_lu(a.clone()).solve(&DVector::from_fn(n, |i, _| points[i][axis])).unwrap());
            let spectrum = ComplexSpectrum::new(&system).unwrap();
            let mut order: Vec<u32> = (0..n as u32).collect();
            order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
            let anderson = |omega| Method::Anderson { of: Accelerated::Jacobi { omega }, window: 5 };
            for method in Method::ALL.into_iter().chain([anderson(Some(0.5)), anderson(None)]) {
                let method = method.in_order(Some(&order));
                let what = format!("{scheme}, seed {seed}, {method}");
                let options = Options { method: Some(method), ..Options::from(stop) };
                let found = interpolate(&surface, scheme, &options);
                if method.needs_symmetry() {
                    let refused = found.unwrap_err();
                    let Error::Unsymmetric { method: name, .. } = refused else { panic!("{what}: {refused}") };
                    assert_eq!(name, method.name());
                    let outcome = run(&system, points, method, &stop).report.outcome;
                    assert_eq!(outcome, Outcome::Breakdown, "{what}");
                    continue;
                }
                let found = found.unwrap();
                assert_eq!(found.report.outcome, Outcome::Converged, "{what}");
                for (i, p) in found.points.iter().enumerate() {
                    let expected = DVec3::new(solved[0][i], solved[1][i], solved[2][i]);
                    assert!(p.distance(expected) < 1e-8, "{what}: {}", p.distance(expected));
                }
                let settled = with_spectrum(&system, method, &|| Ok(spectrum.clone())).unwrap();
                let predicted = predicted_rate(&system, &spectrum, settled).unwrap();
                match error_matrix(&a, settled) {
                    Some(error) => {
                        let expected = radius(error);
                        // Eigenvalues of defective matrices are known to the root of rounding.
                        let off = (predicted.unwrap() - expected).abs();
                        assert!(off < 1e-6, "{what}: {predicted:?} for {expected}");
                        assert!(expected < 1.0);
                    }
                    None => assert_eq!(predicted, None, "{what}"),
                }
            }
            // No ω is better than the optimal one, and beyond the critical one errors grow.
            for form in [SymmetricForm::A, SymmetricForm::Jacobi] {
                let best = spectrum.optimal_omega(form);
                let least = spectrum.radius(form, best).unwrap();
                for k in 1..40 {
                    assert!(spectrum.radius(form, 0.05 * f64::from(k)).unwrap() >= least - 1e-12);
                }
                let critical = spectrum.critical_omega(form);
                let at = |omega: f64| spectrum.radius(form, omega).unwrap();
                assert!(at(0.999 * critical) < 1.0 && at(1.001 * critical) > 1.0, "{scheme}, seed {seed}");
            }
            tried += 1;
            if tried == 25 {
                break;
            }
        }
        assert_eq!(tried, 25, "{scheme}");
    }
}

/// Edges and orders found by hill climbing: Gauss-Seidel converges there, SOR with ω = 1.8 does not, and says so.
#[test]
fn over_relaxation_that_diverges_is_an_outcome() {
    let stop = Stop { tolerance: 1e-11, max_iterations: 20_000 };
    /// A mesh, its scheme, its sharp edges, the order of the sweep, its spectral radius.
    type Found = (&'static str, Scheme, &'static [[u32; 2]], &'static [u32], f64);
    let found: [Found; 3] = [
        ("prism:3", Scheme::CatmullClark, &[[0, 1], [0, 3], [3, 5], [4, 5]], &[5, 1, 4, 3, 0, 2], 1.186_428_9),
        (
            "torus:3x3",
            Scheme::CatmullClark,
            &[[4, 5], [2, 5], [0, 2], [6, 7], [1, 2], [0, 6]],
            &[8, 3, 4, 1, 5, 2, 0, 7, 6],
            1.176_191_0,
        ),
        (
            "bipyramid:7",
            Scheme::Loop,
            &[[0, 8], [1, 2], [2, 8], [4, 7], [0, 7]],
            &[5, 6, 8, 0, 4, 7, 1, 2, 3],
            1.465_134_3,
        ),
    ];
    for (name, scheme, edges, order, radius) in found {
        let creases = edges.iter().map(|&ends| (ends, 10.0)).collect();
        let surface = Surface::new(built_in(name)).unwrap().tagged(&Tags { creases, ..Tags::default() }).unwrap();
        assert!(surface.features().unwrap().count(Rule::Dart) > 0, "{name}");
        let system = Stages::new(&surface, scheme, None).unwrap().whole();
        let spectrum = ComplexSpectrum::new(&system).unwrap();
        let order = Some(order);
        let sor = Method::Sor { omega: 1.8, order };
        let predicted = predicted_rate(&system, &spectrum, sor).unwrap().unwrap();
        assert!((predicted - radius).abs() < 1e-6, "{name}: {predicted}");
        let outcome = |method| {
            let options = Options { method: Some(method), ..Options::from(stop) };
            interpolate(&surface, scheme, &options).unwrap().report.outcome
        };
        assert_eq!(outcome(sor), Outcome::Diverged, "{name}");
        assert_eq!(outcome(Method::GaussSeidel { order }), Outcome::Converged, "{name}");
        assert_eq!(outcome(Method::Pia), Outcome::Converged, "{name}");
    }
}

#[test]
fn some_vertices_with_darts_are_interpolated_by_sweeps() {
    let torus = Surface::new(built_in("torus:6x5")).unwrap();
    let tags = Tags { creases: vec![([0, 1], 10.0), ([7, 8], 1.5)], ..Tags::default() };
    let surface = torus.tagged(&tags).unwrap();
    let marks: Vec<bool> = (0..surface.len()).map(|v| v % 3 != 0).collect();
    let options = Options { interpolated: Some(&marks), tolerance: Tolerance::Absolute(1e-12), ..Options::default() };
    let by = |method| interpolate(&surface, Scheme::CatmullClark, &Options { method, ..options }).unwrap();
    let auto = by(None);
    assert_eq!(auto.method, "chebyshev", "LU, the last resort, would agree with itself");
    for method in [Method::GaussSeidel { order: None }, Method::Pia, Method::Lu] {
        for (v, (a, b)) in auto.points.iter().zip(by(Some(method)).points).enumerate() {
            assert!(a.distance(b) < 1e-10, "{method}, vertex {v}");
            assert!(marks[v] || b == surface.positions()[v], "{method}, vertex {v}");
        }
    }
}

/// By limit points, of the vertices in question, the ends of the sharp edges among them; and whatever ends a run, it has
/// converged if the tolerance is met.
#[test]
fn the_errors_of_auto_with_darts_are_those_of_limit_points() {
    let mut mesh = built_in("torus:6x5");
    add_noise(&mut mesh, 0.1, 1);
    let tags = Tags { creases: vec![([0, 1], 10.0), ([7, 8], 1.5)], ..Tags::default() };
    let surface = Surface::new(mesh).unwrap().tagged(&tags).unwrap();
    let some: Vec<bool> = (0..surface.len()).map(|v| v % 3 != 0).collect();
    let mut converged = 0;
    for marks in [None, Some(&some[..])] {
        for max_iterations in (1..200).chain([1000]) {
            let tolerance = Tolerance::Absolute(1e-5);
            let options = Options { interpolated: marks, tolerance, max_iterations, ..Options::default() };
            let found = interpolate(&surface, Scheme::CatmullClark, &options).unwrap();
            let limits = limit_points(&surface.with_positions(found.points), Scheme::CatmullClark).unwrap();
            let asked = (0..surface.len()).filter(|&v| marks.is_none_or(|marks| marks[v]));
            let off: Vec<f64> = asked.map(|v| surface.positions()[v].distance(limits[v])).collect();
            let (max, mean) = (off.iter().copied().fold(0.0, f64::max), off.iter().sum::<f64>() / off.len() as f64);
            let (told, outcome) = (found.report.last(), found.report.outcome);
            let what = format!("at most {max_iterations}, {}, {outcome:?}: {told:?}, {max:e}, {mean:e}", found.method);
            assert!((told.max - max).abs() < 1e-14 && (told.mean - mean).abs() < 1e-14, "{what}");
            assert_eq!(outcome == Outcome::Converged, max <= 1e-5, "{what}");
            converged += usize::from(outcome == Outcome::Converged && found.method == "chebyshev");
        }
    }
    assert!(converged > 20, "{converged}");
}

/// The directions of GMRES are solved to rounding too, so that its rounds end there, and not at LU.
#[test]
fn with_darts_a_tolerance_below_the_last_digits_ends_the_chain_at_its_first_step() {
    let mut mesh = built_in("torus:6x5");
    add_noise(&mut mesh, 0.1, 1);
    let tags = Tags { creases: vec![([0, 1], 10.0), ([7, 8], 1.5)], ..Tags::default() };
    let surface = Surface::new(mesh).unwrap().tagged(&tags).unwrap();
    let some: Vec<bool> = (0..surface.len()).map(|v| v % 3 != 0).collect();
    for interpolated in [None, Some(&some[..])] {
        let options = Options { tolerance: Tolerance::Relative(1e-18), interpolated, ..Options::default() };
        let found = interpolate(&surface, Scheme::CatmullClark, &options).unwrap();
        assert_eq!((found.report.outcome, found.method), (Outcome::Rounding, "chebyshev"), "{:?}", found.report.last());
    }
}

fn least_real_part(surface: &Surface) -> f64 {
    let system = Stages::new(surface, Scheme::CatmullClark, None).unwrap().whole();
    ComplexSpectrum::new(&system).unwrap().ends(SymmetricForm::A).min
}

/// Theorem: darts cure no singular component; a crease does, a semi-sharp one too.
#[test]
fn darts_alone_leave_cubes_and_prisms_singular() {
    for name in ["cube", "prism:4", "prism:6"] {
        let surface = Surface::new(built_in(name)).unwrap();
        let mut singular = 0;
        for seed in 0..150 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut tags = Tags::default();
            for _ in 0..rng.random_range(1..4) {
                let face = surface.faces().face(rng.random_range(0..surface.faces().len()));
                let k = rng.random_range(0..face.len());
                let sharpness = if rng.random_range(0..2) == 0 { 10.0 } else { rng.random_range(0.2..2.5) };
                tags.creases.push(([face[k], face[(k + 1) % face.len()]], sharpness));
            }
            if rng.random_range(0..6) == 0 {
                tags.corners.push((rng.random_range(0..surface.len() as u32), rng.random_range(0.2..2.5)));
            }
            let tagged = surface.tagged(&tags).unwrap();
            let verdict = Singularity::detect(&tagged, Scheme::CatmullClark).is_singular();
            let system = Stages::new(&tagged, Scheme::CatmullClark, None).unwrap().whole();
            let least = small_singular_values(dense(&system)).min();
            assert_eq!(least < 1e-12, verdict, "{name}, seed {seed}, {tags:?}: {least:e}");
            singular += usize::from(verdict);
        }
        assert!((20..120).contains(&singular), "{name}: {singular} singular");
    }
}

#[test]
fn a_path_of_two_sharp_edges_cures_the_cube() {
    let cube = Surface::new(built_in("cube")).unwrap();
    let creases = vec![([0, 1], 10.0), ([1, 3], 10.0)];
    let path = cube.tagged(&Tags { creases, ..Tags::default() }).unwrap();
    let count = |rule| path.features().unwrap().count(rule);
    assert_eq!((count(Rule::Dart), count(Rule::Crease)), (2, 1));
    let least = least_real_part(&path);
    assert!((least - 0.0239).abs() < 5e-5, "{least}");
}

/// Beyond what is computed in full, Arnoldi processes find the ends and the rates.
#[test]
fn large_systems_have_the_ends_of_their_spectra() {
    let torus = Surface::new(built_in("torus:26x24")).unwrap();
    let creases = vec![([0, 1], 10.0), ([1, 25], 10.0), ([300, 301], 2.5), ([400, 424], 10.0)];
    let surface = torus.tagged(&Tags { creases, ..Tags::default() }).unwrap();
    let system = Stages::new(&surface, Scheme::CatmullClark, None).unwrap().whole();
    let [found, full] = [ComplexSpectrum::new(&system).unwrap(), ComplexSpectrum::full(&system).unwrap()];
    assert!(found.eigenvalues(SymmetricForm::A).is_none() && full.eigenvalues(SymmetricForm::A).is_some());
    for form in [SymmetricForm::A, SymmetricForm::Jacobi] {
        let (a, b) = (found.ends(form), full.ends(form));
        assert!((a.min - b.min).abs() < 1e-3 * b.min && (a.max - b.max).abs() < 1e-3 * b.max, "{a:?} for {b:?}");
        let [a, b] = [&found, &full].map(|spectrum| spectrum.optimal_omega(form));
        assert!((a - b).abs() < 1e-3 * b, "{a} for {b}");
    }
    for method in [Method::Pia, Method::Thall, Method::Jacobi { omega: None }] {
        let [a, b] = [predicted_rate(&system, &found, method), predicted_rate(&system, &full, method)];
        let [a, b] = [a.unwrap().unwrap(), b.unwrap().unwrap()];
        assert!((a - b).abs() < 1e-3, "{method}: {a} for {b}");
        let options = Options { method: Some(method), ..Options::default() };
        let outcome = interpolate(&surface, Scheme::CatmullClark, &options).unwrap().report.outcome;
        assert_eq!(outcome, Outcome::Converged, "{method}");
    }
}
