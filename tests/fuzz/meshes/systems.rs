//! Matrices and solutions of one scheme on one mesh, against dense matrices from the formulas.

use glam::DVec3;
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::interpolate::interpolate;
use limitlab::mesh::Surface;
use limitlab::mesh::breadth_first::{in_fronts, in_kinds};
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces};
use limitlab::mesh::order::{Numbering, Order};
use limitlab::mesh::space_filling::along_curve;
use limitlab::schemes::Scheme;
use limitlab::solvers::direct::SINGULAR;
use limitlab::solvers::{Method, Outcome, Solution, Stop, run};
use limitlab_factorizations::dense::small_lu;
use nalgebra::{DMatrix, DVector};

use super::{Case, on_any_threads};
use crate::common::formulas;
use crate::common::meshes::{distance, random_points};
use crate::common::tol;

/// Vertices up to which eigenvalues are computed.
const DENSE: usize = 64;
/// Systems with λ_min from here on are solved to any tolerance that is asked for here.
const REGULAR: f64 = 1e-3;

/// The explicit matrix = the matrix-free operator, in any order of its rows = the formulas.
pub fn matrices_agree(surface: &Surface, scheme: Scheme) {
    let n = surface.len();
    let plain = formulas::assemble(scheme, surface.mesh());
    let h = &plain.h;
    let (a, m) = (plain.dense_a(), plain.dense_m());
    let system = LimitSystem::new(surface, scheme).unwrap();
    let operator = Operator::new(surface, scheme).unwrap();
    // Entries are sums over the faces at a vertex.
    let close = |x: f64, y: f64| (x - y).abs() <= tol::rounding(n);
    for i in 0..n {
        assert!(close(system.h[i] / h[i], 1.0) && close(operator.weights()[i] / h[i], 1.0), "{scheme}: h of {i}");
        assert!(close(system.diagonal[i], a[(i, i)]), "{scheme}: diagonal of {i}");
        assert!(close(operator.diagonal()[i], a[(i, i)]), "{scheme}: the operator's diagonal of {i}");
        let mut row = vec![0.0; n];
        row[i] = operator.diagonal()[i];
        operator.neighbours(i, |j, entry| row[j] += entry);
        for j in 0..n {
            assert!(close(system.a.get(i, j), a[(i, j)]), "{scheme}: entry {i}, {j} of A");
            assert!(close(row[j], a[(i, j)]), "{scheme}: the operator's entry {i}, {j}");
            assert!(close(h[i] * system.m.get(i, j), h[i] * m[(i, j)]), "{scheme}: entry {i}, {j} of M");
            assert_eq!(system.m.get(i, j), system.m.get(j, i), "{scheme}: M is not symmetric");
        }
    }
    let x = random_points(n, 1);
    let product = times(&a, &x);
    for numbering in numberings(surface) {
        let mut seen = vec![false; n];
        numbering.order().iter().for_each(|&v| seen[v as usize] = true);
        assert!(seen.len() == n && seen.iter().all(|&seen| seen), "not a permutation");
        let moved = Operator::in_order(surface, scheme, Some(&numbering)).unwrap();
        let there = numbering.there(&x);
        let rows: Vec<DVec3> = (0..n).map(|i| moved.row(i, &there)).collect();
        assert!(distance(&numbering.back(&rows), &product) <= tol::rounding(n), "{scheme}: rows in another order");
    }
}

fn numberings(surface: &Surface) -> Vec<Numbering> {
    let (mesh, faces, incidence) = (surface.mesh(), surface.faces(), surface.incidence());
    let mut all = vec![in_fronts(faces, incidence), in_colours(faces, incidence)];
    all.extend(in_kinds(faces, incidence));
    all.extend(along_curve(mesh).map(|(_, numbering, _)| numbering));
    all.extend([Order::File, Order::Random(5)].map(|order| Numbering::new(order.order(mesh, incidence))));
    all
}

fn times(a: &DMatrix<f64>, x: &[DVec3]) -> Vec<DVec3> {
    let row = |i: usize| x.iter().enumerate().map(|(j, &p)| a[(i, j)] * p).sum();
    (0..x.len()).map(row).collect()
}

/// What is known of one system, and how close solutions have to be.
struct Reference<'a> {
    scheme: Scheme,
    points: &'a [DVec3],
    stop: Stop,
    a: DMatrix<f64>,
    system: LimitSystem,
    /// Of the dense matrix, where that is small.
    lambda_min: Option<f64>,
}

impl Reference<'_> {
    /// Rounding of the residual of control points of the size of `v`.
    fn rounding(&self, v: &[DVec3]) -> f64 {
        let size = |points: &[DVec3]| points.iter().map(|p| p.length()).fold(0.0, f64::max);
        tol::rounding(v.len()) * size(v).max(size(self.points))
    }

    /// No convergence without an error within the tolerance.
    fn check(&self, outcome: Outcome, v: &[DVec3], what: &str) {
        assert_eq!(v.len(), self.points.len());
        if outcome == Outcome::Converged {
            let error = distance(&times(&self.a, v), self.points);
            let allowed = self.stop.tolerance + self.rounding(v);
            assert!(error <= allowed, "{} {what}: converged with an error of {error:e}, not {allowed:e}", self.scheme);
        }
    }

    /// How far V may be from the solution.
    fn distance(&self, v: &[DVec3], lambda_min: f64) -> f64 {
        let error = self.stop.tolerance + self.rounding(v);
        tol::solution(&self.system, lambda_min, error, 0.0)
    }
}

/// `auto` on any number of threads = in any numbering = dense elimination, as far as the condition allows; singular is
/// what has no inverse; no method claims what it has not reached.
pub fn solutions_agree(case: &Case, surface: &Surface, scheme: Scheme) {
    let mesh = surface.mesh();
    let n = mesh.len();
    let stop = Stop { tolerance: case.tolerance * mesh.diagonal(), max_iterations: 10_000 };
    if stop.tolerance == 0.0 {
        return;
    }
    let plain = formulas::assemble(scheme, mesh);
    let system = LimitSystem::new(surface, scheme).unwrap();
    let lambda_min = (n <= DENSE).then(|| plain.eigenvalues()[0]);
    let reference = Reference { scheme, points: &mesh.positions, stop, a: plain.dense_a(), system, lambda_min };
    if let Some(truth) = lambda_min {
        let proven = reference.system.bounds.lambda_min;
        assert!(proven <= truth + tol::eigenvalues(n, 1.0), "{scheme}: {truth} is below the bound of {proven}");
    }

    let (points, outcome) = automatic(surface, scheme, &stop);
    reference.check(outcome, &points, "auto");
    if let Some(lambda_min) = lambda_min.filter(|&l| l >= REGULAR) {
        let slack = reference.rounding(&points) * (n as f64).sqrt() / lambda_min;
        assert!(
            outcome == Outcome::Converged || stop.tolerance < slack,
            "{scheme}: auto {outcome}, λ_min {lambda_min}"
        );
        let near = reference.distance(&points, lambda_min);
        let off = distance(&points, &eliminate(&reference.a, &mesh.positions));
        assert!(off <= near, "{scheme}: auto is off by {off:e}, not {near:e}");

        let order = Order::Random(case.seed).order(mesh, surface.incidence());
        let renumbered = shuffle_faces(&permute_vertices(mesh, &order), case.seed);
        let (moved, _) = automatic(&Surface::new(renumbered).unwrap(), scheme, &stop);
        let off = distance(&Numbering::new(order).back(&moved), &points);
        assert!(off <= 2.0 * near, "{scheme}: renumbered, auto is off by {off:e}, not {near:e}");
    }
    methods(&reference);
}

fn automatic(surface: &Surface, scheme: Scheme, stop: &Stop) -> (Vec<DVec3>, Outcome) {
    on_any_threads(|| {
        let found = interpolate(surface, scheme, &(*stop).into()).unwrap();
        (found.points, found.report.outcome)
    })
}

/// Gaussian elimination with row pivots.
fn eliminate(a: &DMatrix<f64>, points: &[DVec3]) -> Vec<DVec3> {
    let lu = small_lu(a.clone());
    let [x, y, z] = [0, 1, 2].map(|k| {
        let column = DVector::from_iterator(points.len(), points.iter().map(|p| p[k]));
        lu.solve(&column).expect("a regular matrix")
    });
    (0..points.len()).map(|i| DVec3::new(x[i], y[i], z[i])).collect()
}

fn methods(reference: &Reference) {
    let Reference { scheme, points, stop, ref system, lambda_min, .. } = *reference;
    let n = points.len();
    let few = Stop { max_iterations: 300, ..stop };
    let iterative = [
        Method::Thall,
        Method::Sor { omega: 1.1, order: None },
        Method::Ssor { omega: 1.0, order: None },
        Method::Pia,
        Method::Cg,
        Method::PlainCg,
        Method::PcgJacobi,
        Method::PcgSsor { omega: 1.0 },
        Method::PcgIc0,
    ];
    for method in iterative {
        let Solution { points: v, report, .. } = run(system, points, method, &few);
        reference.check(report.outcome, &v, &format!("{method:?}"));
    }
    // What elimination cannot tell from 0.
    let threshold = SINGULAR * n as f64 * f64::EPSILON;
    for method in [Method::Lu, Method::Cholesky, Method::Ldlt, Method::SecondCholesky] {
        let Solution { points: v, report, .. } = run(system, points, method, &stop);
        let outcome = report.outcome;
        reference.check(outcome, &v, &format!("{method:?}"));
        let Some(lambda_min) = lambda_min else { continue };
        let what = format!("{scheme} {method:?}: {outcome} with λ_min {lambda_min:e}");
        if lambda_min < 0.25 * threshold {
            assert_ne!(outcome, Outcome::Converged, "{what}");
        } else if lambda_min >= REGULAR {
            assert!(outcome == Outcome::Converged || stop.tolerance < reference.rounding(&v), "{what}");
            let off = distance(&v, &eliminate(&reference.a, points));
            assert!(off <= reference.distance(&v, lambda_min), "{what}: off by {off:e}");
        } else if lambda_min > 16.0 * threshold {
            assert_ne!(outcome, Outcome::Singular, "{what}");
        }
    }
}

/// On a mesh of thousands of vertices: rows of the operator = rows of the explicit matrix, `auto` on any number of
/// threads.
pub fn large(surface: &Surface, scheme: Scheme, tolerance: f64) {
    let stop = Stop { tolerance: tolerance * surface.diagonal(), max_iterations: 1000 };
    let system = LimitSystem::new(surface, scheme).unwrap();
    let x = random_points(surface.len(), 2);
    let rows = on_any_threads(|| {
        let operator = Operator::new(surface, scheme).unwrap();
        (0..x.len()).map(|i| operator.row(i, &x)).collect::<Vec<DVec3>>()
    });
    let explicit: Vec<DVec3> = (0..x.len()).map(|i| system.a.row_times(i, &x)).collect();
    let off = distance(&rows, &explicit);
    assert!(off <= tol::rounding(256), "{scheme}: {off:e} between operator and matrix");
    let (v, outcome) = automatic(surface, scheme, &stop);
    if outcome == Outcome::Converged {
        let reached: Vec<DVec3> = (0..v.len()).map(|i| system.a.row_times(i, &v)).collect();
        let error = distance(&reached, surface.positions());
        let size = v.iter().map(|p| p.length()).fold(0.0, f64::max);
        assert!(error <= stop.tolerance + tol::rounding(256) * size, "{scheme}: converged with an error of {error:e}");
    }
}
