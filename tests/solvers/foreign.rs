//! Systems that no mesh made: any symmetric positive definite M with any positive H, rows that do not sum to 1, entries
//! of both signs, any scale; and matrices that are no such thing. Bounds, spectra, predictions and every method.

use std::f64::consts::PI;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::Error;
use limitlab::analysis::comparison::{Entry, compare, entries};
use limitlab::analysis::custom_methods::{Named, Own};
use limitlab::analysis::spectrum::{Source, Spectrum, ends, spectrum};
use limitlab::analysis::sweep::{rounding_floor, sweep};
use limitlab::assemble::{Csr, LimitSystem};
use limitlab::solvers::jacobi::Jacobi;
use limitlab::solvers::pia::Pia;
use limitlab::solvers::{Accelerated, Errors, Failure, Iterate, Method, Outcome, Stop, run};
use limitlab_factorizations::dense::{small_lu, small_symmetric_eigenvalues};
use nalgebra::DMatrix;
use nalgebra_sparse::{CooMatrix, CsrMatrix};
use rand::{RngExt, SeedableRng};

use super::methods::{checked, residual};
use crate::common::meshes::random_points;
use crate::common::tol;

fn csr(dense: &DMatrix<f64>) -> Csr {
    let mut coo = CooMatrix::new(dense.nrows(), dense.ncols());
    for i in 0..dense.nrows() {
        for j in 0..dense.ncols() {
            if dense[(i, j)] != 0.0 {
                coo.push(i, j, dense[(i, j)]);
            }
        }
    }
    Csr::try_from(&CsrMatrix::from(&coo)).unwrap()
}

/// The 5-point Laplacian on k×k points: eigenvalues 4 − 2cos(pπ/(k+1)) − 2cos(qπ/(k+1)).
fn laplacian(k: usize, scale: f64) -> LimitSystem {
    let at = |x: usize, y: usize| x + k * y;
    let mut coo = CooMatrix::new(k * k, k * k);
    for y in 0..k {
        for x in 0..k {
            coo.push(at(x, y), at(x, y), 4.0 * scale);
            for (there, other) in [(x + 1 < k, at(x + 1, y)), (y + 1 < k, at(x, y + 1))] {
                if there {
                    coo.push(at(x, y), other, -scale);
                    coo.push(other, at(x, y), -scale);
                }
            }
        }
    }
    LimitSystem::from_parts(vec![1.0; k * k], Csr::try_from(&CsrMatrix::from(&coo)).unwrap()).unwrap()
}

/// A random symmetric sparse matrix with entries of both signs; `shift` is added to the diagonal, which is positive.
fn random(n: usize, seed: u64, shift: f64) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut m = DMatrix::zeros(n, n);
    for i in 0..n {
        m[(i, i)] = shift + rng.random_range(0.1..1.0);
        for _ in 0..3 {
            let j = rng.random_range(0..n);
            if j != i {
                let a = rng.random_range(-1.0..1.0);
                m[(i, j)] = a;
                m[(j, i)] = a;
            }
        }
    }
    m
}

/// H^½ M H^½, and Dm^-½ M Dm^-½: eigenvalues by nalgebra.
fn eigenvalues(system: &LimitSystem) -> [Vec<f64>; 2] {
    let n = system.len();
    let m = DMatrix::from_fn(n, n, |i, j| system.m.get(i, j));
    let inverse: Vec<f64> = (0..n).map(|i| 1.0 / m[(i, i)]).collect();
    [&system.h, &inverse].map(|h| {
        let s = DMatrix::from_fn(n, n, |i, j| h[i].sqrt() * m[(i, j)] * h[j].sqrt());
        let mut all: Vec<f64> = small_symmetric_eigenvalues(s).iter().copied().collect();
        all.sort_by(f64::total_cmp);
        all
    })
}

fn weights(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 99);
    (0..n).map(|_| 10f64.powf(rng.random_range(-1.5..1.5))).collect()
}

/// Positive definite systems with their names.
fn definite() -> Vec<(String, LimitSystem)> {
    let mut all = vec![
        ("1×1".into(), LimitSystem::from_parts(vec![3.0], csr(&DMatrix::from_element(1, 1, 7.0))).unwrap()),
        ("identity".into(), LimitSystem::from_parts(vec![1.0; 5], csr(&DMatrix::identity(5, 5))).unwrap()),
        ("diagonal".into(), LimitSystem::from_parts(weights(9, 1), csr(&DMatrix::identity(9, 9))).unwrap()),
    ];
    for scale in [1.0, 5.0, 1e-9, 1e12] {
        all.push((format!("Laplacian × {scale:e}"), laplacian(9, scale)));
    }
    for seed in 0..6 {
        let n = [3, 8, 20, 40][seed as usize % 4];
        let m = random(n, seed, 4.0);
        all.push((format!("random {seed}"), LimitSystem::from_parts(vec![1.0; n], csr(&m)).unwrap()));
        let m = 1e-4 * &m;
        all.push((format!("random {seed}, H"), LimitSystem::from_parts(weights(n, seed), csr(&m)).unwrap()));
        // All entries of the same size: |MᵀM|, no zero.
        let full = random(n, seed + 50, 1.0);
        let full = full.transpose() * &full + DMatrix::identity(n, n) * 0.5;
        let full = (&full + full.transpose()) * 0.5;
        all.push((format!("full {seed}"), LimitSystem::from_parts(weights(n, seed), csr(&full)).unwrap()));
    }
    all
}

/// Symmetric matrices with a positive diagonal and eigenvalues of both signs, or 0.
fn not_definite() -> Vec<(String, LimitSystem)> {
    let mut all = vec![
        ("(1 2; 2 1)".into(), DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0])),
        ("(1 1; 1 1)".into(), DMatrix::from_element(2, 2, 1.0)),
        ("(1 -9; -9 1)".into(), DMatrix::from_row_slice(2, 2, &[1.0, -9.0, -9.0, 1.0])),
        // A path without its ends held: constants are in the kernel.
        (
            "kernel".into(),
            DMatrix::from_fn(12, 12, |i, j| match i.abs_diff(j) {
                0 if i % 11 == 0 => 1.0,
                0 => 2.0,
                1 => -1.0,
                _ => 0.0,
            }),
        ),
    ];
    for seed in 0..8 {
        all.push((format!("random {seed}"), random([4, 9, 30][seed as usize % 3], seed + 200, 0.0)));
    }
    let parts = |(name, m): (String, DMatrix<f64>)| {
        let h = weights(m.nrows(), 5);
        (name, LimitSystem::from_parts(h, csr(&m)).unwrap())
    };
    all.into_iter().map(parts).collect()
}

#[test]
fn gershgorin_s_bounds_hold_and_are_attained() {
    for (name, system) in definite().into_iter().chain(not_definite()) {
        let b = &system.bounds;
        let [a, jacobi] = eigenvalues(&system);
        for (all, low, high) in [(a, b.lambda_min, b.lambda_max), (jacobi, b.jacobi_lambda_min, b.jacobi_lambda_max)] {
            let last = all[all.len() - 1];
            let slack = tol::eigenvalues(all.len(), last.abs().max(all[0].abs()));
            assert!(low <= all[0] + slack && last <= high + slack, "{name}: {low} {all:?} {high}");
        }
    }
    // Of rows, columns and the symmetric form, each may be the best.
    let m = csr(&DMatrix::from_row_slice(2, 2, &[2.0, -1.0, -1.0, 2.0]));
    let high = |h: [f64; 2]| LimitSystem::from_parts(h.to_vec(), m.clone()).unwrap().bounds.lambda_max;
    assert!((high([1.0, 1.0]) - 3.0).abs() < 1e-14);
    // Rows: 3 and 12; columns: 6 and 9; symmetric: 4 and 10.
    assert!((high([1.0, 4.0]) - 9.0).abs() < 1e-13);
}

#[test]
fn spectra_are_those_of_the_formula_where_entries_are_negative() {
    // Beyond the size up to which all eigenvalues are computed: the highest mode is odd about both axes for even k, and
    // a start that is even would never see it.
    for k in [26, 30, 31] {
        for scale in [1.0, 1e-7, 1e7] {
            let system = laplacian(k, scale);
            let found = ends(&system).unwrap();
            let c = (PI / (k as f64 + 1.0)).cos();
            for (value, exact) in [
                (found.lambda_min.value, 4.0 - 4.0 * c),
                (found.lambda_max.value, 4.0 + 4.0 * c),
                (found.jacobi_lambda_min.value / (0.25 / scale), 4.0 - 4.0 * c),
                (found.jacobi_lambda_max.value / (0.25 / scale), 4.0 + 4.0 * c),
            ] {
                let error = value / (scale * exact) - 1.0;
                assert!(error.abs() < 1e-8, "{k} × {scale:e}: {value} for {}", scale * exact);
            }
            assert_eq!(found.lambda_max.multiplicity, None);
        }
    }
    // The identity attains its bound everywhere, in as many ways as there are rows.
    let n = 700;
    let mut coo = CooMatrix::new(n, n);
    (0..n).for_each(|i| coo.push(i, i, 1.0));
    let one = LimitSystem::from_parts(vec![2.0; n], Csr::try_from(&CsrMatrix::from(&coo)).unwrap()).unwrap();
    let found = ends(&one).unwrap();
    assert_eq!((found.lambda_max.value, found.lambda_max.source), (2.0, Source::Proven));
    assert_eq!(found.lambda_max.multiplicity.map(|m| m.count), Some(n));
}

fn all_entries<'a>(system: &LimitSystem, spectrum: &Spectrum) -> Vec<Entry<'a>> {
    entries(system, spectrum, &Method::ALL, None, "file").unwrap()
}

#[test]
fn every_method_solves_what_is_positive_definite_or_says_why_not() {
    for (name, system) in definite() {
        let n = system.len();
        let points = random_points(n, 3);
        let spectrum = spectrum(&system).unwrap();
        let [a, jacobi] = eigenvalues(&system);
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-9 * y.abs();
        assert!(near(spectrum.a.min, a[0]) && near(spectrum.a.max, a[n - 1]), "{name}");
        assert!(near(spectrum.jacobi.max, jacobi[n - 1]), "{name}");
        let exact = small_lu(DMatrix::from_fn(n, n, |i, j| system.a.get(i, j)))
            .solve(&DMatrix::from_fn(n, 3, |i, k| points[i][k]))
            .unwrap();
        let stop = Stop { tolerance: 1e-9, max_iterations: 100_000 };
        for entry in all_entries(&system, &spectrum) {
            let what = format!("{name}, {} {}", entry.method, entry.parameter);
            let report = checked(&system, &points, entry.method, &stop);
            let outcome = report.report.outcome;
            let rate = |all: &[f64], omega: f64| (1.0 - omega * all[0]).abs().max((1.0 - omega * all[n - 1]).abs());
            let rate = match entry.method {
                Method::WPia { omega: Some(omega) } => rate(&a, omega),
                Method::Jacobi { omega: Some(omega) } => rate(&jacobi, omega),
                // A short window need not help what stands still without it.
                Method::Anderson { of: Accelerated::Pia { omega: Some(omega) }, .. } => rate(&a, omega).min(1.0),
                Method::Anderson { of: Accelerated::Jacobi { omega: Some(omega) }, .. } => {
                    rate(&jacobi, omega).min(1.0)
                }
                Method::Pia => rate(&a, 1.0),
                Method::Thall => rate(&jacobi, 0.5),
                _ => 0.0,
            };
            match entry.method {
                _ if rate > 1.001 => assert_eq!(outcome, Outcome::Diverged, "{what}"),
                // So slow that it may be taken for a standstill.
                _ if rate > 0.999 => {}
                // An incomplete factorization need not exist.
                Method::PcgIc0 if outcome == Outcome::Breakdown => {}
                _ => {
                    assert_eq!(outcome, Outcome::Converged, "{what}: {:?}", report.report.detail);
                    let error =
                        |(v, i): (&DVec3, usize)| (*v - DVec3::from_array([0, 1, 2].map(|k| exact[(i, k)]))).length();
                    let error = report.points.iter().zip(0..).map(error).fold(0.0, f64::max);
                    assert!(error <= tol::solution(&system, a[0], stop.tolerance, 1.0), "{what}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn rates_are_predicted_where_rows_do_not_sum_to_1() {
    let system = laplacian(12, 10.0);
    let points = random_points(system.len(), 1);
    let spectrum = spectrum(&system).unwrap();
    assert!((78.0..80.0).contains(&spectrum.a.max));
    let lines = all_entries(&system, &spectrum);
    let stop = Stop { tolerance: 1e-9, max_iterations: 20_000 };
    let rows = compare(&system, &spectrum, (&points, &points), &lines, &[], &stop, &mut || ()).unwrap();
    for row in rows {
        let what = format!("{} {}: {:?} {:?}", row.method, row.parameter, row.predicted_rate, row.observed_rate);
        let Named::Ours(method) = row.method else { panic!("{what}") };
        match method {
            Method::Pia => assert!(row.predicted_rate.unwrap() > 70.0, "{what}"),
            Method::Jacobi { .. }
            | Method::WPia { .. }
            | Method::GaussSeidel { .. }
            | Method::Thall
            | Method::Ssor { .. } => {
                assert!((row.predicted_rate.unwrap() - row.observed_rate.unwrap()).abs() < tol::RATE, "{what}");
            }
            Method::Chebyshev { .. } => {
                assert!((row.predicted_rate.unwrap() - row.observed_rate.unwrap()).abs() < 0.05, "{what}");
            }
            _ => {}
        }
    }
    // ω sweeps too: the thresholds are those of this matrix.
    let grids = vec![(Method::Pia, vec![0.01, 0.02, 0.03]), (Method::Jacobi { omega: None }, vec![0.5, 1.5])];
    let found =
        sweep((&system, &spectrum), (&points, &points), &grids, None, &stop, rounding_floor(2.0), &|_| ()).unwrap();
    for row in &found.rows {
        let converges = row.predicted_rho < 1.0;
        assert_eq!(row.outcome == Outcome::Converged, converges, "{row:?}");
        assert_eq!(row.outcome == Outcome::Diverged, !converges, "{row:?}");
    }
    assert!(found.best(Method::Pia).is_some() && found.rows.iter().any(|r| r.predicted_rho > 1.0));
}

/// No run on an indefinite or singular matrix claims a solution that is none, or panics.
#[test]
fn what_is_not_positive_definite_ends_as_an_outcome() {
    for (name, system) in not_definite() {
        let points = random_points(system.len(), 3);
        let spectrum = spectrum(&system).unwrap();
        let lines = all_entries(&system, &spectrum);
        let stop = Stop { tolerance: 1e-9, max_iterations: 3000 };
        for entry in &lines {
            let solution = checked(&system, &points, entry.method, &stop);
            let what = format!("{name}, {}", entry.method);
            if solution.report.outcome == Outcome::Converged {
                assert!(residual(&system, &points, &solution.points) <= stop.tolerance, "{what}");
                // Only what needs no definite matrix, or does not notice.
                let any = matches!(
                    entry.method,
                    Method::Lu
                        | Method::Ldlt
                        | Method::Anderson { .. }
                        | Method::Cg
                        | Method::PlainCg
                        | Method::PcgJacobi
                        | Method::PcgSsor { .. }
                        | Method::PcgIc0
                );
                assert!(any, "{what}");
            }
        }
        compare(&system, &spectrum, (&points, &points), &lines, &[], &stop, &mut || ()).unwrap();
    }
}

/// λ_min/λ_max = 10⁻¹⁴ and 10⁻¹⁷, at three scales: direct methods solve the one and call the other singular.
#[test]
fn nearly_singular_is_told_in_the_scale_of_the_matrix() {
    for scale in [1e-12, 1.0, 1e12] {
        for (gap, outcome) in [(1e-6, Outcome::Converged), (1e-17, Outcome::Singular)] {
            let m = DMatrix::from_row_slice(2, 2, &[1.0, 1.0 - gap, 1.0 - gap, 1.0]) * scale;
            let system = LimitSystem::from_parts(vec![1.0; 2], csr(&m)).unwrap();
            let stop = Stop { tolerance: 1e-8, max_iterations: 50 };
            for method in [Method::Lu, Method::Cholesky, Method::Ldlt, Method::SecondCholesky] {
                let found = checked(&system, &[DVec3::X, DVec3::Y], method, &stop);
                assert_eq!(found.report.outcome, outcome, "{method:?} {scale:e} {gap:e}: {:?}", found.report.detail);
            }
        }
    }
}

#[test]
fn parts_that_make_no_system_are_refused() {
    let told = |h: &[f64], rows: usize, m: &[f64]| {
        let m = csr(&DMatrix::from_row_slice(rows, rows, m));
        match LimitSystem::from_parts(h.to_vec(), m) {
            Err(Error::Matrix(what)) => what,
            other => panic!("{other:?}"),
        }
    };
    let id = [1.0, 0.0, 0.0, 1.0];
    for (h, m, what) in [
        (&[1.0][..], &id, "H has 1 entries and M 2 rows"),
        (&[1.0, 0.0], &id, "entry 1 of H is 0: it must be positive"),
        (&[1.0, f64::NAN], &id, "entry 1 of H is NaN"),
        (&[f64::INFINITY, 1.0], &id, "entry 0 of H is inf"),
        (&[1.0; 2], &[1.0, f64::NAN, f64::NAN, 1.0], "entry (0, 1) of M is NaN"),
        (&[1.0; 2], &[1.0, 0.0, 0.0, 0.0], "entry (1, 1) of M is 0: M is not positive definite"),
        (&[1.0; 2], &[1.0, 0.0, 0.0, -2.0], "entry (1, 1) of M is -2"),
        (&[1.0; 2], &[1.0, 0.5, 0.25, 1.0], "M is not symmetric: entry (0, 1) is 0.5, entry (1, 0) is 0.25"),
        (&[1.0; 2], &[1.0, 0.0, 0.25, 1.0], "M is not symmetric: entry (0, 1) is 0, entry (1, 0) is 0.25"),
        (&[1e300; 2], &[1e300, 0.0, 0.0, 1.0], "beyond the range of doubles"),
        (&[1e-300; 2], &[1e-300, 0.0, 0.0, 1.0], "beyond the range of doubles"),
    ] {
        let line = told(h, 2, m);
        assert!(line.contains(what), "{line}");
    }
    assert!(told(&[], 0, &[]).contains("no rows"));
}

/// Rounding is evened out: the matrix is symmetric to the last bit afterwards, on a symmetric pattern.
#[test]
fn rounding_beside_symmetry_is_taken_for_symmetry() {
    for seed in 0..20 {
        let mut m = random(15, seed, 4.0);
        let exact = m.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        m.iter_mut().for_each(|a| *a *= 1.0 + f64::EPSILON * rng.random_range(-4.0..4.0));
        m[(3, 4)] += 1e-16;
        let system = LimitSystem::from_parts(weights(15, seed), csr(&m)).unwrap();
        for i in 0..15 {
            for (j, value) in system.m.row(i) {
                assert_eq!(value.to_bits(), system.m.get(j, i).to_bits());
                assert!(system.m.row(j).any(|e| e.0 == i));
                assert!((value - exact[(i, j)]).abs() < 1e-14);
            }
        }
    }
}

/// PIA, and what it says of its errors made wrong.
struct Liar<'a> {
    honest: Pia<'a, LimitSystem>,
    lie: fn(Errors, usize) -> Errors,
    iteration: usize,
}

impl Iterate for Liar<'_> {
    fn errors(&mut self) -> Errors {
        (self.lie)(self.honest.errors(), self.iteration)
    }
    fn advance(&mut self) -> Result<(), Failure> {
        self.iteration += 1;
        self.honest.advance()
    }
    fn points(&self) -> &[DVec3] {
        self.honest.points()
    }
}

#[test]
fn methods_of_one_s_own_are_run_as_ours_and_not_believed() {
    let system = laplacian(9, 1.0);
    let points = random_points(81, 2);
    let spectrum = spectrum(&system).unwrap();
    let stop = Stop { tolerance: 1e-8, max_iterations: 5000 };
    let omega = spectrum.jacobi.optimal_omega();
    let [name, parameter] = ["mine"; 2].map(String::from);
    let mine = [
        Own { name, parameter, start: &|system, points| Ok(Box::new(Jacobi::new(system, points, omega))) },
        Own {
            name: "fails".into(),
            parameter: String::new(),
            start: &|_, _| Err(Failure { outcome: Outcome::Singular, detail: "no".into() }),
        },
        Own {
            name: "other norm".into(),
            parameter: String::new(),
            start: &|system, points| {
                let lie = |e: Errors, _| e * 0.5;
                Ok(Box::new(Liar { honest: Pia::new(system, points, 0.2), lie, iteration: 0 }))
            },
        },
        // Right at the start, then too small: it must go on.
        Own {
            name: "too early".into(),
            parameter: String::new(),
            start: &|system, points| {
                let lie = |e: Errors, k| if k > 30 { e * 1e-12 } else { e };
                Ok(Box::new(Liar { honest: Pia::new(system, points, 0.2), lie, iteration: 0 }))
            },
        },
    ];
    let lines = entries(&system, &spectrum, &[Method::Jacobi { omega: None }], None, "file").unwrap();
    let mut done = 0;
    let rows = compare(&system, &spectrum, (&points, &points), &lines, &mine, &stop, &mut || done += 1).unwrap();
    assert_eq!((done, rows.len()), (5, 5));
    let (ours, same) = (&rows[0].solution, &rows[1].solution);
    assert_eq!((&ours.report, &ours.points), (&same.report, &same.points));
    assert_eq!(rows[0].observed_rate, rows[1].observed_rate);
    assert_eq!((rows[1].method.name(), rows[1].parameter.as_str(), rows[1].predicted_rate), ("mine", "mine", None));
    assert_eq!(
        ours.report.iterations,
        run(&system, &points, Method::Jacobi { omega: Some(omega) }, &stop).report.iterations
    );
    let report = &rows[2].solution.report;
    assert_eq!((report.outcome, report.iterations, report.detail.as_deref()), (Outcome::Singular, 0, Some("no")));
    assert_eq!(report.last().max, residual(&system, &points, &points));
    let report = &rows[3].solution.report;
    assert_eq!((report.outcome, report.iterations), (Outcome::Breakdown, 0));
    assert!(report.detail.as_ref().unwrap().contains("the method tells an error of"));
    let solution = &rows[4].solution;
    let truth = residual(&system, &points, &solution.points);
    assert!(solution.report.outcome != Outcome::Converged || truth <= stop.tolerance, "{truth:e}");
    assert!(solution.report.iterations > 31);
}
