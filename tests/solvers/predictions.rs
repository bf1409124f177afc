//! The rates that are predicted for the methods against the eigenvalues of their dense error matrices.

use limitlab::analysis::a_priori::Promise;
use limitlab::analysis::predict::predicted_rate;
use limitlab::analysis::{Extremes, Spectrum};
use limitlab::mesh::order::Order;
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;
use limitlab_factorizations::dense::{self, small_lu};
use nalgebra::{Complex, DMatrix};

use crate::common::formulas::assemble;
use crate::common::meshes::*;
use crate::common::tol;

/// I − (D/ω + L)⁻¹A, L being what is left of the diagonal if rows and columns are put in `order`.
fn sweep(a: &DMatrix<f64>, omega: f64, order: &[u32]) -> DMatrix<f64> {
    let n = a.nrows();
    let place = limitlab::mesh::order::inverse(order);
    let split = DMatrix::from_fn(n, n, |i, j| match place[j].cmp(&place[i]) {
        std::cmp::Ordering::Less => a[(i, j)],
        std::cmp::Ordering::Equal => a[(i, i)] / omega,
        std::cmp::Ordering::Greater => 0.0,
    });
    DMatrix::identity(n, n) - small_lu(split).solve(a).unwrap()
}

fn symmetric_sweep(a: &DMatrix<f64>, omega: f64, order: &[u32]) -> DMatrix<f64> {
    let back: Vec<u32> = order.iter().rev().copied().collect();
    sweep(a, omega, &back) * sweep(a, omega, order)
}

/// By faer: nalgebra's iteration does not end on some of these matrices, which have many eigenvalues near 0.
fn eigenvalues(e: &DMatrix<f64>) -> Vec<Complex<f64>> {
    dense::eigenvalues(&faer::Mat::from_fn(e.nrows(), e.ncols(), |i, j| e[(i, j)])).unwrap()
}

fn radius(e: &DMatrix<f64>) -> f64 {
    eigenvalues(e).iter().map(|z| z.norm()).fold(0.0, f64::max)
}

/// 1/(σ + √(σ² − 1)), by which the Chebyshev polynomials T_k fall at the image of 0, σ = (b + a)/(b − a).
fn chebyshev_rate((a, b): (f64, f64)) -> f64 {
    let sigma = (b + a) / (b - a);
    1.0 / (sigma + (sigma * sigma - 1.0).sqrt())
}

#[test]
fn predicted_rates_are_those_of_the_dense_error_matrices() {
    for scheme in Scheme::ALL {
        // Irregular, so that A and D⁻¹A have different spectra.
        let mesh = noisy(if scheme.needs_triangles() { "irregular-tri:60" } else { "irregular-poly:60" });
        let n = mesh.len();
        let system = system(&mesh, scheme);
        let plain = assemble(scheme, &mesh);
        let ends = |values: &[f64]| Extremes { min: values[0], max: values[n - 1] };
        let (of_a, of_jacobi) = (ends(&plain.eigenvalues()), ends(&plain.jacobi_eigenvalues()));
        let spectrum = Spectrum { a: of_a, jacobi: of_jacobi };
        let a = plain.dense_a();
        let over_d = DMatrix::from_diagonal(&a.diagonal().map(|d| 1.0 / d));
        let one = DMatrix::identity(n, n);
        let file: Vec<u32> = (0..n as u32).collect();
        let other = Order::Random(3).order(&mesh, &topology(&mesh).incidence);

        let mut rates: Vec<(Method, f64)> = Vec::new();
        for omega in [0.5, 1.0, 1.2] {
            rates.push((Method::Jacobi { omega: Some(omega) }, radius(&(&one - omega * &over_d * &a))));
            rates.push((Method::WPia { omega: Some(omega) }, radius(&(&one - omega * &a))));
            for order in [None, Some(other.as_slice())] {
                let ordered = order.unwrap_or(&file);
                rates.push((Method::Sor { omega, order }, radius(&sweep(&a, omega, ordered))));
                rates.push((Method::Ssor { omega, order }, radius(&symmetric_sweep(&a, omega, ordered))));
            }
            // The preconditioned matrix, similar to a symmetric one, has its spectrum in (0, 1].
            let preconditioned = &one - symmetric_sweep(&a, omega, &file);
            let values = eigenvalues(&preconditioned);
            assert!(values.iter().all(|z| z.re < 1.0 + 1e-10 && z.im.abs() < 1e-6));
            let least = values.iter().map(|z| z.re).fold(1.0, f64::min);
            rates.push((Method::PcgSsor { omega }, chebyshev_rate((least, 1.0))));
        }
        for spectrum in [(0.05, 1.0), (0.3, 0.9)] {
            rates.push((Method::Chebyshev { interval: Some(spectrum) }, chebyshev_rate(spectrum)));
        }
        rates.push((Method::Cg, chebyshev_rate((of_a.min, of_a.max))));
        rates.push((Method::PcgJacobi, chebyshev_rate((of_jacobi.min, of_jacobi.max))));
        for (method, expected) in rates {
            let found = predicted_rate(&system, &spectrum, method).unwrap().unwrap();
            assert!((found - expected).abs() < tol::ESTIMATE, "{scheme} {method:?}: {found} instead of {expected}");
        }
        for method in
            [Method::Lu, Method::Cholesky, Method::SecondCholesky, Method::Ldlt, Method::PlainCg, Method::PcgIc0]
        {
            assert_eq!(predicted_rate(&system, &spectrum, method).unwrap(), None, "{method:?}");
        }
    }
}

/// In the norms that the iterations shrink, with the constants that lead from these to the maximum: the least k with
/// √h_max ρ^k ‖H^-½e₀‖₂, or max(h√m) ρ^k ‖Dm^-½H⁻¹e₀‖₂, within the tolerance.
#[test]
fn promised_counts_follow_from_their_norms() {
    for (name, scheme) in [
        ("irregular-tri:60", Scheme::Loop),
        ("irregular-poly:60", Scheme::ZhengCai),
        ("torus:7x6", Scheme::CatmullClark),
    ] {
        let mesh = noisy(name);
        let n = mesh.len();
        let system = system(&mesh, scheme);
        let plain = assemble(scheme, &mesh);
        let (a, m) = (plain.dense_a(), plain.dense_m());
        let p = DMatrix::from_fn(n, 3, |i, axis| mesh.positions[i][axis]);
        let e = &p - &a * &p;
        let norm = |weight: &dyn Fn(usize) -> f64| -> f64 {
            (0..n).map(|i| weight(i) * e.row(i).norm_squared()).sum::<f64>().sqrt()
        };
        let most = |value: &dyn Fn(usize) -> f64| (0..n).map(value).fold(0.0, f64::max);
        let h = |i: usize| plain.h[i];
        let in_h = most(&h).sqrt() * norm(&|i| 1.0 / h(i));
        let in_d = most(&|i| h(i) * m[(i, i)].sqrt()) * norm(&|i| 1.0 / (m[(i, i)] * h(i) * h(i)));
        let bounds = system.bounds;
        let (low, jacobi) = (bounds.lambda_min, (bounds.jacobi_lambda_min, bounds.jacobi_lambda_max));
        for tolerance in [1e-2, 1e-5, 1e-10].map(|t| t * mesh.diagonal()) {
            let least = |start: f64, rho: f64| (0..).find(|&k| start * rho.powi(k) <= tolerance).unwrap();
            let counts = Promise::new(&bounds).counts(&system, (&mesh.positions, &mesh.positions), tolerance);
            assert_eq!(counts.pia, f64::from(least(in_h, 1.0 - low)), "{name}");
            assert_eq!(counts.w_pia, f64::from(least(in_h, (1.0 - low) / (1.0 + low))), "{name}");
            let thall = (1.0 - 0.5 * jacobi.0).abs().max((1.0 - 0.5 * jacobi.1).abs());
            assert_eq!(counts.thall, f64::from(least(in_d, thall)), "{name}");
            // 1/T_k(σ) with T_k(σ) = (t^k + t^-k)/2, t = σ + √(σ² − 1).
            let t = 1.0 / chebyshev_rate((low, 1.0));
            let chebyshev = (0..).find(|&k| 2.0 * in_h / (t.powi(k) + t.powi(-k)) <= tolerance).unwrap();
            assert_eq!(counts.chebyshev, f64::from(chebyshev), "{name}");
        }
    }
}
