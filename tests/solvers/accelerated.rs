//! Anderson acceleration and the heavy ball against loops made by hand, and against full GMRES.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Accelerated, Method, Outcome, Stop, run_watched};
use limitlab_factorizations::dense::small_svd;
use nalgebra::{DMatrix, DVector};

use super::methods::checked;
use crate::common::meshes::*;

/// The three coordinates one after the other.
fn stacked(points: &[DVec3]) -> DVector<f64> {
    DVector::from_iterator(3 * points.len(), (0..3).flat_map(|axis| points.iter().map(move |p| p[axis])))
}

/// A relaxation `V ← V + s ∘ (P − A V)` on stacked coordinates.
struct Relaxation {
    /// I₃ ⊗ A
    a: DMatrix<f64>,
    p: DVector<f64>,
    s: DVector<f64>,
    /// 1/(h s)
    weights: DVector<f64>,
}

impl Relaxation {
    fn new(system: &LimitSystem, points: &[DVec3], s: impl Fn(usize) -> f64) -> Self {
        let n = points.len();
        let mut a = DMatrix::zeros(3 * n, 3 * n);
        for i in 0..n {
            for (j, value) in system.a.row(i) {
                (0..3).for_each(|axis| a[(axis * n + i, axis * n + j)] = value);
            }
        }
        let s = DVector::from_fn(3 * n, |k, _| s(k % n));
        let weights = DVector::from_fn(3 * n, |k, _| 1.0 / (system.h[k % n] * s[k]));
        Relaxation { a, p: stacked(points), s, weights }
    }

    fn update(&self, v: &DVector<f64>) -> DVector<f64> {
        self.s.component_mul(&(&self.p - &self.a * v))
    }

    fn norm(&self, f: &DVector<f64>) -> f64 {
        f.component_mul(f).dot(&self.weights).sqrt()
    }

    /// The combination of `columns` nearest to `target`.
    fn nearest(&self, columns: &[DVector<f64>], target: &DVector<f64>) -> DVector<f64> {
        let roots = self.weights.map(f64::sqrt);
        let scaled: Vec<_> = columns.iter().map(|c| c.component_mul(&roots)).collect();
        let svd = small_svd(DMatrix::from_columns(&scaled));
        svd.solve(&target.component_mul(&roots), 1e-13 * svd.singular_values.max()).unwrap()
    }

    /// Anderson's iterates, textbook: least squares by singular values.
    fn anderson(&self, window: usize, count: usize) -> Vec<DVector<f64>> {
        let mut iterates = vec![self.p.clone()];
        let mut updates = vec![self.update(&self.p)];
        while iterates.len() <= count {
            let k = iterates.len() - 1;
            let first = k.saturating_sub(window);
            let differences =
                |all: &[DVector<f64>]| (first..k).map(|j| &all[j + 1] - &all[j]).collect::<Vec<DVector<f64>>>();
            let (steps, changes) = (differences(&iterates), differences(&updates));
            let mut next = &iterates[k] + &updates[k];
            if !changes.is_empty() {
                let gamma = self.nearest(&changes, &updates[k]);
                for ((gamma, step), change) in gamma.iter().zip(&steps).zip(&changes) {
                    next -= *gamma * (step + change);
                }
            }
            updates.push(self.update(&next));
            iterates.push(next);
        }
        iterates
    }

    /// The iterate of full GMRES after `k` products: the least update over P plus the Krylov space.
    fn gmres(&self, k: usize) -> DVector<f64> {
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut next = self.update(&self.p);
        for _ in 0..k {
            for b in &basis {
                let part = next.component_mul(b).dot(&self.weights);
                next -= part * b;
            }
            next /= self.norm(&next);
            basis.push(next.clone());
            next = self.s.component_mul(&(&self.a * &next));
        }
        let images: Vec<_> = basis.iter().map(|b| self.s.component_mul(&(&self.a * b))).collect();
        let mut v = self.p.clone();
        if !images.is_empty() {
            let c = self.nearest(&images, &self.update(&self.p));
            basis.iter().zip(c.iter()).for_each(|(b, c)| v += *c * b);
        }
        v
    }
}

fn iterates(system: &LimitSystem, points: &[DVec3], method: Method, count: usize) -> Vec<DVector<f64>> {
    let mut seen = Vec::new();
    let stop = Stop { tolerance: 0.0, max_iterations: count };
    run_watched(system, points, method, &stop, &mut |step| {
        seen.push(stacked(step.points));
        ControlFlow::Continue(())
    });
    seen
}

/// Methods with their relaxation.
fn cases(system: &LimitSystem, points: &[DVec3], window: usize) -> [(&'static str, Method<'static>, Relaxation); 3] {
    let of_jacobi = |omega: f64| Relaxation::new(system, points, |i| omega / system.diagonal[i]);
    [
        (
            "pia",
            Method::Anderson { of: Accelerated::Pia { omega: Some(1.0) }, window },
            Relaxation::new(system, points, |_| 1.0),
        ),
        ("thall", Method::Anderson { of: Accelerated::Jacobi { omega: Some(0.5) }, window }, of_jacobi(0.5)),
        ("jacobi", Method::Anderson { of: Accelerated::Jacobi { omega: Some(0.8) }, window }, of_jacobi(0.8)),
    ]
}

const MESHES: [(&str, Scheme); 3] = [
    ("icosphere:1", Scheme::Loop),
    ("irregular-poly:60", Scheme::ZhengCai),
    ("irregular-quad:50", Scheme::CatmullClark),
];

#[test]
fn anderson_is_the_textbook_s() {
    for (name, scheme) in MESHES {
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        for window in [1, 2, 5, 16] {
            for (what, method, relaxation) in cases(&system, &mesh.positions, window) {
                let expected = relaxation.anderson(window, 10);
                let found = iterates(&system, &mesh.positions, method, 10);
                for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    // Normal equations hold half the digits of the differences, which are as small as the updates.
                    let allowed = 1e-7 * relaxation.update(&relaxation.p).amax();
                    let error = (found - expected).amax();
                    assert!(error < allowed, "{what}, {name}, {scheme}, m = {window}, {k}: {error:e} > {allowed:e}");
                }
            }
        }
    }
}

/// After k products no iterate has a smaller update than GMRES's; with a window that forgets nothing, the next iterate is
/// one relaxation of GMRES's.
#[test]
fn anderson_is_never_better_than_gmres_for_as_many_products() {
    for (name, scheme) in MESHES {
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        for window in [1, 3, 16] {
            for (what, method, relaxation) in cases(&system, &mesh.positions, window) {
                let found = iterates(&system, &mesh.positions, method, 12);
                for (k, v) in found.iter().enumerate() {
                    let least = relaxation.norm(&relaxation.update(&relaxation.gmres(k)));
                    let reached = relaxation.norm(&relaxation.update(v));
                    assert!(
                        reached >= least * (1.0 - 1e-9),
                        "{what}, {name}, m = {window}, {k}: {reached:e} < {least:e}"
                    );
                }
                if window == 16 {
                    for k in 0..8 {
                        let v = relaxation.gmres(k);
                        let expected = &v + relaxation.update(&v);
                        let error = (&found[k + 1] - expected).amax() / relaxation.update(&relaxation.p).amax();
                        assert!(error < 1e-7, "{what}, {name}, {k}: {error:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_heavy_ball_is_its_recurrence_and_keeps_its_rate() {
    for (name, scheme) in MESHES {
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let all = limitlab::analysis::dense::eigenvalues(&system).unwrap().a;
        let (low, high) = (all[0], 1.0f64);
        let beta = ((high.sqrt() - low.sqrt()) / (high.sqrt() + low.sqrt())).powi(2);
        let alpha = 4.0 / (high.sqrt() + low.sqrt()).powi(2);
        let relaxation = Relaxation::new(&system, &mesh.positions, |_| alpha);
        let method = Method::HeavyBall { interval: Some((low, high)) };
        let found = iterates(&system, &mesh.positions, method, 40);
        let (mut v, mut before) = (relaxation.p.clone(), relaxation.p.clone());
        let start = relaxation.norm(&relaxation.update(&v));
        for (k, found) in found.iter().enumerate() {
            assert!((found - &v).amax() < 1e-12 * mesh.diagonal(), "{name}, {k}");
            let bound = (1.0 + k as f64 * (1.0 - beta) / (1.0 + beta)) * beta.sqrt().powi(k as i32);
            let error = relaxation.norm(&relaxation.update(found));
            assert!(error <= bound * start * (1.0 + 1e-9) + 1e-13, "{name}, {k}: {error:e} > {bound:e}·{start:e}");
            let next = match k {
                0 => &v + relaxation.update(&v) / (1.0 + beta),
                _ => &v + beta * (&v - &before) + relaxation.update(&v),
            };
            before = std::mem::replace(&mut v, next);
        }
    }
}

#[test]
fn a_short_window_saves_half_of_the_iterations() {
    let mesh = noisy("irregular-tri:500");
    let system = system(&mesh, Scheme::Loop);
    let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 1000 };
    let count = |method| {
        let report = checked(&system, &mesh.positions, method, &stop).report;
        assert_eq!(report.outcome, Outcome::Converged);
        report.iterations
    };
    let pia = count(Method::Pia);
    let accelerated = count(Method::Anderson { of: Accelerated::Pia { omega: Some(1.0) }, window: 5 });
    assert!(2 * accelerated < pia, "{accelerated} of {pia}");
    assert!(accelerated >= count(Method::Cg) - 2);
}
