//! Every iterative method against a loop made by hand with dense matrices: the same iterates, the same counts.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::Mesh;
use limitlab::schemes::Scheme;
use limitlab::solvers::chebyshev::promised_iterations;
use limitlab::solvers::conjugate_gradient::{ConjugateGradient, Preconditioner};
use limitlab::solvers::{Errors, Iterate, Method, Outcome, Report, Stop, run_watched};
use nalgebra::DMatrix;

use super::methods::reversed;
use crate::common::formulas::{Plain, assemble};
use crate::common::meshes::*;
use crate::common::tol;

/// N×3: a point a row.
type Points = DMatrix<f64>;

/// One system as dense matrices, from the formulas.
struct Dense {
    plain: Plain,
    a: DMatrix<f64>,
    p: Points,
    tolerance: f64,
}

fn rows(points: &[DVec3]) -> Points {
    Points::from_fn(points.len(), 3, |i, axis| points[i][axis])
}

fn max_row(e: &Points) -> f64 {
    e.row_iter().map(|r| r.norm()).fold(0.0, f64::max)
}

/// Σ_ij x_ij y_ij: the three coordinates share one inner product.
fn inner(x: &Points, y: &Points) -> f64 {
    x.dot(y)
}

impl Dense {
    fn new(mesh: &Mesh, scheme: Scheme, tolerance: f64) -> Self {
        let plain = assemble(scheme, mesh);
        Dense { a: plain.dense_a(), plain, p: rows(&mesh.positions), tolerance }
    }

    fn e(&self, v: &Points) -> Points {
        &self.p - &self.a * v
    }

    /// All iterates from V = P to the first with max error ≤ tolerance, by `step`, which is given V and e.
    fn iterate(&self, mut step: impl FnMut(&Points, &Points) -> Points) -> Vec<Points> {
        let mut all = vec![self.p.clone()];
        loop {
            let v = &all[all.len() - 1];
            let e = self.e(v);
            if max_row(&e) <= self.tolerance {
                return all;
            }
            assert!(all.len() < 5000, "the loop by hand does not end");
            let next = step(v, &e);
            all.push(next);
        }
    }

    /// D/ω + L or D/ω + U of A.
    fn triangle(&self, omega: f64, lower: bool) -> DMatrix<f64> {
        let n = self.a.nrows();
        DMatrix::from_fn(n, n, |i, j| {
            if i == j {
                self.a[(i, i)] / omega
            } else if (i > j) == lower {
                self.a[(i, j)]
            } else {
                0.0
            }
        })
    }

    /// V + (D/ω + L)⁻¹ e, with U for a backward sweep.
    fn sweep(&self, omega: f64, forward: bool, v: &Points, e: &Points) -> Points {
        let t = self.triangle(omega, forward);
        let d = if forward { t.solve_lower_triangular(e) } else { t.solve_upper_triangular(e) };
        v + d.unwrap()
    }

    fn jacobi(&self, omega: f64) -> Vec<Points> {
        let inverse = DMatrix::from_diagonal(&self.a.diagonal().map(|d| omega / d));
        self.iterate(|v, e| v + &inverse * e)
    }

    fn sor(&self, omega: f64, forward: bool) -> Vec<Points> {
        self.iterate(|v, e| self.sweep(omega, forward, v, e))
    }

    fn ssor(&self, omega: f64) -> Vec<Points> {
        self.iterate(|v, e| {
            let half = self.sweep(omega, true, v, e);
            self.sweep(omega, false, &half, &self.e(&half))
        })
    }

    /// Saad, Iterative Methods for Sparse Linear Systems, Algorithm 12.1.
    fn chebyshev(&self, (low, high): (f64, f64)) -> Vec<Points> {
        let (theta, delta) = ((high + low) / 2.0, (high - low) / 2.0);
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        let mut d: Option<Points> = None;
        self.iterate(|v, e| {
            let next = match &d {
                None => e / theta,
                Some(d) => {
                    let before = rho;
                    rho = 1.0 / (2.0 * sigma - before);
                    rho * before * d + 2.0 * rho / delta * e
                }
            };
            let moved = v + &next;
            d = Some(next);
            moved
        })
    }

    /// Preconditioned CG on M V = H⁻¹P as in the textbooks, with z = B r.
    fn cg(&self, precondition: impl Fn(&Points) -> Points) -> Vec<Points> {
        let m = self.plain.dense_m();
        let mut right = self.p.clone();
        for (i, mut row) in right.row_iter_mut().enumerate() {
            row /= self.plain.h[i];
        }
        let mut r = &right - &m * &self.p;
        let mut z = precondition(&r);
        let mut direction = z.clone();
        self.iterate(|v, _| {
            let product = &m * &direction;
            let rho = inner(&r, &z);
            let alpha = rho / inner(&direction, &product);
            let next = v + alpha * &direction;
            r -= alpha * product;
            z = precondition(&r);
            direction = &z + inner(&r, &z) / rho * &direction;
            next
        })
    }

    fn scaled_rows(&self, r: &Points, scale: impl Fn(usize) -> f64) -> Points {
        let mut z = r.clone();
        for (i, mut row) in z.row_iter_mut().enumerate() {
            row *= scale(i);
        }
        z
    }

    /// A symmetric sweep from zero on A z = H r.
    fn symmetric_sweep(&self, omega: f64, r: &Points) -> Points {
        let e = self.scaled_rows(r, |i| self.plain.h[i]);
        let zero = Points::zeros(r.nrows(), 3);
        let half = self.sweep(omega, true, &zero, &e);
        let rest = &e - &self.a * &half;
        self.sweep(omega, false, &half, &rest)
    }

    /// (L Lᵀ)⁻¹ with L from Gaussian elimination on the pattern of M, column by column.
    fn incomplete_cholesky(&self) -> DMatrix<f64> {
        let m = self.plain.dense_m();
        let n = m.nrows();
        let mut l = m.lower_triangle();
        for k in 0..n {
            l[(k, k)] = l[(k, k)].sqrt();
            for i in k + 1..n {
                l[(i, k)] /= l[(k, k)];
            }
            for j in k + 1..n {
                for i in j..n {
                    if m[(i, j)] != 0.0 {
                        l[(i, j)] -= l[(i, k)] * l[(j, k)];
                    }
                }
            }
        }
        l
    }
}

/// The iterates of the library.
fn watched(system: &LimitSystem, points: &[DVec3], method: Method, stop: &Stop) -> (Vec<Points>, Report) {
    let mut seen = Vec::new();
    let solution = run_watched(system, points, method, stop, &mut |step| {
        assert_eq!(step.iteration, seen.len());
        seen.push(rows(step.points));
        ControlFlow::Continue(())
    });
    assert_eq!(seen.last().unwrap(), &rows(&solution.points));
    (seen, solution.report)
}

/// Meshes of mixed shapes with points that excite everything.
fn meshes(scheme: Scheme) -> Vec<Mesh> {
    let mut meshes = if scheme.needs_triangles() {
        vec![noisy("icosphere:1"), noisy("bipyramid:9"), noisy("irregular-tri:60")]
    } else {
        vec![noisy("torus:6x5"), noisy("irregular-poly:60"), noisy("prism:5")]
    };
    if soluble_on_quads(scheme) {
        meshes.push(noisy("irregular-quad:50"));
    }
    meshes.extend((1..4).map(|seed| scattered(&small_triangles(seed), seed)));
    meshes
}

struct Case<'a> {
    mesh: &'a Mesh,
    scheme: Scheme,
    system: &'a LimitSystem,
    dense: &'a Dense,
}

impl Case<'_> {
    /// Equal counts, equal iterates, equal histories.
    fn hold(&self, name: &str, method: Method, expected: &[Points], allowed: impl Fn(usize, f64) -> f64) {
        let stop = Stop { tolerance: self.dense.tolerance, max_iterations: 6000 };
        let (seen, report) = watched(self.system, &self.mesh.positions, method, &stop);
        let what = format!("{name}, {}, {} vertices", self.scheme, self.mesh.len());
        assert_eq!(report.outcome, Outcome::Converged, "{what}");
        assert_eq!(report.iterations + 1, expected.len(), "{what}: counts");
        assert_eq!(seen.len(), expected.len(), "{what}: iterates seen");
        for (k, (v, w)) in seen.iter().zip(expected).enumerate() {
            let scale = max_row(w);
            let error = max_row(&(v - w));
            assert!(error <= allowed(k, scale), "{what}, iterate {k}: {error:e}");
            let e = self.dense.e(w);
            let mean = e.row_iter().map(|r| r.norm()).sum::<f64>() / e.nrows() as f64;
            let slack = allowed(k, scale);
            assert!((report.history[k].errors.max - max_row(&e)).abs() <= slack, "{what}: history");
            assert!((report.history[k].errors.mean - mean).abs() <= slack, "{what}: history");
        }
    }
}

fn for_each_case(tolerance: f64, mut visit: impl FnMut(&Case)) {
    for scheme in Scheme::ALL {
        for mesh in meshes(scheme) {
            let system = system(&mesh, scheme);
            let dense = Dense::new(&mesh, scheme, tolerance * mesh.diagonal());
            visit(&Case { mesh: &mesh, scheme, system: &system, dense: &dense });
        }
    }
}

#[test]
fn relaxations_are_their_splittings() {
    for_each_case(1e-7, |case| {
        let Case { dense, .. } = case;
        case.hold("thall", Method::Thall, &dense.jacobi(0.5), tol::iterates);
        case.hold("jacobi", Method::Jacobi { omega: Some(0.4) }, &dense.jacobi(0.4), tol::iterates);
        for (name, omega) in [("pia", 1.0), ("w-pia", 1.3)] {
            let expected = dense.iterate(|v, e| v + omega * e);
            case.hold(name, Method::WPia { omega: Some(omega) }, &expected, tol::iterates);
        }
    });
}

#[test]
fn sweeps_are_triangular_solves() {
    for_each_case(1e-8, |case| {
        let Case { dense, mesh, .. } = case;
        let order = reversed(mesh.len());
        for omega in [1.0, 0.7, 1.2] {
            let forward = Method::Sor { omega, order: None };
            case.hold("sor", forward, &dense.sor(omega, true), tol::iterates);
            // The reversed order is the splitting by the other triangle.
            let backward = Method::Sor { omega, order: Some(&order) };
            case.hold("sor reversed", backward, &dense.sor(omega, false), tol::iterates);
            let both = Method::Ssor { omega, order: None };
            case.hold("ssor", both, &dense.ssor(omega), tol::iterates);
        }
    });
}

#[test]
fn chebyshev_is_the_textbook_s() {
    for_each_case(1e-9, |case| {
        let lambda_min = case.dense.plain.eigenvalues()[0];
        for low in [0.9 * lambda_min, 0.5 * lambda_min] {
            let spectrum = (low, 1.0);
            let expected = case.dense.chebyshev(spectrum);
            // The recurrence forgets no error of its two terms at once.
            let allowed = |k, scale| 8.0 * tol::iterates(k, scale);
            case.hold("chebyshev", Method::Chebyshev { interval: Some(spectrum) }, &expected, allowed);
        }
    });
}

/// Conjugate gradients amplify rounding while Ritz values converge (Paige 1980), by how much shows a second run by hand,
/// on points that differ by rounding: two implementations may differ by a small multiple of that.
fn hold_cg(case: &Case, name: &str, method: Method, loops: impl Fn(&Dense) -> Vec<Points>) {
    const FACTOR: f64 = 100.0;
    let expected = loops(case.dense);
    let mut other = Dense::new(case.mesh, case.scheme, case.dense.tolerance);
    for (k, x) in other.p.iter_mut().enumerate() {
        *x *= 1.0 + f64::EPSILON * [1.0, -2.0, 3.0][k % 3];
    }
    let mut spread: Vec<f64> = (expected.iter().zip(loops(&other))).map(|(v, w)| max_row(&(v - w))).collect();
    for k in 1..spread.len() {
        spread[k] = spread[k].max(spread[k - 1]);
    }
    let last = spread.len() - 1;
    case.hold(name, method, &expected, |k, scale| tol::iterates(k, scale) + FACTOR * spread[k.min(last)]);
    // Not so much that the comparison would be idle.
    assert!(spread[last] < 1e-2 * case.dense.tolerance, "{name}: {:e}", spread[last]);
}

#[test]
fn conjugate_gradients_are_the_textbook_s() {
    for_each_case(1e-4, |case| {
        hold_cg(case, "cg", Method::Cg, |d| d.cg(|r| d.scaled_rows(r, |i| d.plain.h[i])));
        hold_cg(case, "plain cg", Method::PlainCg, |d| d.cg(Points::clone));
        hold_cg(case, "pcg-jacobi", Method::PcgJacobi, |d| {
            let diagonal = d.plain.dense_m().diagonal();
            d.cg(|r| d.scaled_rows(r, |i| 1.0 / diagonal[i]))
        });
        for omega in [1.0, 1.2] {
            let method = Method::PcgSsor { omega };
            hold_cg(case, "pcg-ssor", method, |d| d.cg(|r| d.symmetric_sweep(omega, r)));
        }
        hold_cg(case, "pcg-ic0", Method::PcgIc0, |d| {
            let l = d.incomplete_cholesky();
            d.cg(|r| {
                let y = l.solve_lower_triangular(r).unwrap();
                l.tr_solve_lower_triangular(&y).unwrap()
            })
        });
    });
}

/// What the method is told of its errors is twice the truth, or the truth: the step after it is the first one of a new
/// process from the same iterate, or the next one of the process at work.
#[test]
fn conjugate_gradients_that_have_lost_touch_start_afresh() {
    const STEPS: usize = 4;
    let mut held = 0;
    for_each_case(1e-9, |case| {
        let weights = |d: &Dense, r: &Points| d.scaled_rows(r, |i| d.plain.h[i]);
        let expected = case.dense.cg(|r| weights(case.dense, r));
        // The smallest meshes are done before.
        if expected.len() < STEPS + 3 {
            return;
        }
        held += 1;
        for lost in [false, true] {
            let mut method =
                ConjugateGradient::new(case.system, &case.mesh.positions, Preconditioner::weights(case.system));
            for _ in 0..STEPS {
                method.errors();
                method.advance().unwrap();
            }
            let known = method.errors();
            let told = if lost { Errors { max: 2.0 * known.max, ..known } } else { known };
            let truth = method.confirm(told);
            assert!((truth.max / known.max - 1.0).abs() < 1e-6);
            method.advance().unwrap();
            let found = rows(method.points());
            // z = H r = e, and the step that minimises the energy along it.
            let before = &expected[STEPS];
            let e = case.dense.e(before);
            let r = case.dense.scaled_rows(&e, |i| 1.0 / case.dense.plain.h[i]);
            let afresh = before + inner(&r, &e) / inner(&e, &(case.dense.plain.dense_m() * &e)) * &e;
            let next = &expected[STEPS + 1];
            let apart = max_row(&(&afresh - next));
            let distance = max_row(&(found - if lost { &afresh } else { next }));
            assert!(distance < 1e-3 * apart, "{}, lost {lost}: {distance:e} of {apart:e}", case.scheme);
        }
    });
    assert!(held > 10, "{held}");
}

#[test]
fn sor_at_1_is_gauss_seidel_at_every_sweep() {
    for_each_case(1e-8, |case| {
        let n = case.mesh.len();
        let order = reversed(n);
        for order in [None, Some(order.as_slice())] {
            // Gauss-Seidel by its definition: v_i ← (p_i − Σ_{j≠i} a_ij v_j)/a_ii.
            let expected = case.dense.iterate(|v, _| {
                let mut v = v.clone();
                for k in 0..n {
                    let i = order.map_or(k, |o| o[k] as usize);
                    for axis in 0..3 {
                        let others: f64 = (0..n).filter(|&j| j != i).map(|j| case.dense.a[(i, j)] * v[(j, axis)]).sum();
                        v[(i, axis)] = (case.dense.p[(i, axis)] - others) / case.dense.a[(i, i)];
                    }
                }
                v
            });
            case.hold("sor(1)", Method::GaussSeidel { order }, &expected, tol::iterates);
        }
    });
}

/// ‖H^-½ e_k‖₂ ≤ ε ‖H^-½ e_0‖₂ after the promised number of iterations, with the proven interval; and a run to a maximum
/// error needs no more than the number promised for ε = tolerance/(√h_max ‖H^-½e_0‖₂).
#[test]
fn chebyshev_keeps_its_promise() {
    // The proven interval of the mid-edge scheme begins at 0.
    for scheme in Scheme::ALL.into_iter().filter(|&scheme| scheme != Scheme::MidEdge) {
        let name = if scheme.needs_triangles() { "irregular-tri:300" } else { "torus:16x15" };
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let spectrum = (system.bounds.lambda_min, system.bounds.lambda_max);
        assert!(spectrum.0 > 0.0);
        let norm = |v: &[DVec3]| -> f64 {
            let squares =
                (0..v.len()).map(|i| (mesh.positions[i] - system.a.row_times(i, v)).length_squared() / system.h[i]);
            squares.sum::<f64>().sqrt()
        };
        let start = norm(&mesh.positions);
        for factor in [1e-2, 1e-5, 1e-9] {
            let promised = promised_iterations(spectrum, factor);
            let stop = Stop { tolerance: 0.0, max_iterations: promised as usize };
            let solution = super::methods::checked(
                &system,
                &mesh.positions,
                Method::Chebyshev { interval: Some(spectrum) },
                &stop,
            );
            assert_eq!(solution.report.iterations as f64, promised, "{scheme}");
            let reached = norm(&solution.points) / start;
            assert!(reached <= factor * (1.0 + 1e-6), "{scheme}: {reached:e} > {factor:e}");

            let h_max = system.h.iter().copied().fold(0.0, f64::max);
            let stop = Stop { tolerance: factor * h_max.sqrt() * start, max_iterations: 1000 };
            let solution = super::methods::checked(
                &system,
                &mesh.positions,
                Method::Chebyshev { interval: Some(spectrum) },
                &stop,
            );
            assert_eq!(solution.report.outcome, Outcome::Converged);
            assert!(solution.report.iterations as f64 <= promised, "{scheme}");
        }
        // ⌈acosh(1/ε)/acosh((κ+1)/(κ−1))⌉ by hand: κ = 9, ε = 10⁻⁶ give acosh(10⁶) = 14.5087, acosh(1.25) = ln 2.
        assert_eq!(promised_iterations((1.0 / 9.0, 1.0), 1e-6), 21.0);
    }
}
