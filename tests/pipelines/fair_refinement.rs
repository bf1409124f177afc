//! The fairest first refined mesh: energies by quadrature on splines, minima by dense systems, order of the energies.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::interpolate::fair_refinement::{FairRefinement, FirstFairness, fair_handles, fairest};
use limitlab::interpolate::halstead::Weights;
use limitlab::interpolate::zheng_cai::{Constraints, FirstRefinement, PhaseOne, interpolate};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Refinement;
use limitlab::schemes::doo_sabin::{CornerRule, face_normals, refine_by};
use limitlab::solvers::{Outcome, Step, Stop};
use limitlab_factorizations::dense::{small_cholesky, small_lu};
use nalgebra::{DMatrix, DVector};

use crate::common::pipelines::{distance, noisy_surface};
use crate::open::{grid, open};

const ALL: Constraints = Constraints { interpolated: None, normals: None, handles: None };
const STOP: Stop = Stop { tolerance: 1e-13, max_iterations: 2000 };
/// Of dense systems of some hundred unknowns, for points of size 1.
const SOLVED: f64 = 1e-10;
const MESHES: [&str; 5] = ["torus:4x5", "icosahedron", "irregular-poly:30", "cube", "dodecahedron"];

fn go_on(_: &Step) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn two_phase(surface: &Surface, wishes: &Constraints) -> FirstRefinement {
    interpolate(surface, wishes, &PhaseOne::default()).unwrap().first
}

fn fit(surface: &Surface, wishes: &Constraints, weights: Weights) -> FairRefinement {
    let fairness = FirstFairness::new(surface).unwrap();
    let first = two_phase(surface, wishes).surface;
    let points = surface.positions();
    let found = fairest(&fairness, first.positions(), points, wishes, weights, &STOP, &mut go_on).unwrap();
    assert!(matches!(found.report.outcome, Outcome::Converged | Outcome::Rounding), "{}", found.report.outcome);
    found
}

/// Some vertices, normals that lean away from the surface's at some of these.
fn some(surface: &Surface) -> (Vec<bool>, Vec<Option<DVec3>>) {
    let marks: Vec<bool> = (0..surface.len()).map(|v| v % 3 != 1).collect();
    let outward = limitlab::schemes::doo_sabin::limit_normals(CornerRule::ZhengCai, surface).unwrap();
    let lean = |v: usize| DVec3::new((v as f64).sin(), (3.0 * v as f64).cos(), (v as f64).cos());
    let normal = |v: usize| (marks[v] && v.is_multiple_of(2)).then(|| 2.0 * outward[v] + 0.4 * lean(v));
    let normals = (0..surface.len()).map(normal).collect();
    (marks, normals)
}

/// The quadratic B-spline that ends at 0 and 3, and its derivatives, at the three points of Gauss of [0, 1], for the pieces
/// of the control points 0, 1, 2.
fn basis(t: f64) -> [[f64; 3]; 3] {
    let s = 1.0 - t;
    [[0.5 * s * s, 0.5 + s * t, 0.5 * t * t], [-s, s - t, t], [1.0, -2.0, 1.0]]
}

/// The energies are those of the biquadratic splines two steps further, by quadrature, all of them and no more.
#[test]
fn first_refinement_energies_are_those_of_splines_by_quadrature() {
    let root = 0.6f64.sqrt();
    let gauss = [(0.5 - 0.5 * root, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + 0.5 * root, 5.0 / 18.0)];
    for name in ["torus:4x5", "irregular-poly:30", "icosahedron", "tetrahedron"] {
        let surface = noisy_surface(name);
        let first = Surface::new(refine_by(CornerRule::ZhengCai, &surface).unwrap()).unwrap();
        let fine = Refinement::DooSabin.refined_n(&first, 2).unwrap();
        let (faces, topology) = (fine.faces(), fine.topology());
        let next = |c: u32| topology.incidence.next(faces, c);
        let prev = |c: u32| topology.incidence.prev(faces, c);
        let at = |c: u32| fine.positions()[faces.corners()[c as usize] as usize];
        let (mut thin_plate, mut membrane, mut splines) = (0.0, 0.0, 0);
        let mut star = Vec::new();
        for v in 0..fine.len() {
            topology.star(faces, v, &mut star);
            if star.iter().any(|&c| faces.face(topology.incidence.face_of(c)).len() != 4) {
                continue;
            }
            splines += 1;
            // u along the side that leaves corner 0 of the star, v along that of corner 1.
            let [a, b, c, d] = [star[0], star[1], star[2], star[3]];
            let rows = [
                [at(next(next(c))), at(next(d)), at(next(next(d)))],
                [at(next(c)), at(a), at(next(a))],
                [at(next(next(b))), at(next(b)), at(next(next(a)))],
            ];
            assert_eq!(at(prev(a)), at(next(b)));
            for (t, wt) in gauss {
                for (s, ws) in gauss {
                    let (along, across) = (basis(t), basis(s));
                    let derivative = |i: usize, j: usize| -> DVec3 {
                        let row = |row: &[DVec3; 3]| -> DVec3 { row.iter().zip(along[i]).map(|(p, w)| *p * w).sum() };
                        rows.iter().zip(across[j]).map(|(points, w)| row(points) * w).sum()
                    };
                    let square = |i: usize, j: usize| derivative(i, j).length_squared();
                    thin_plate += wt * ws * (square(2, 0) + 2.0 * square(1, 1) + square(0, 2));
                    membrane += wt * ws * (square(1, 0) + square(0, 1));
                }
            }
        }
        assert!(2 * splines > fine.len());
        let found = FirstFairness::new(&surface).unwrap().energies(first.positions());
        // Two halvings of the parameters.
        assert!((found.thin_plate / (16.0 * thin_plate) - 1.0).abs() < 1e-12, "{name} {}", found.thin_plate);
        assert!((found.membrane / membrane - 1.0).abs() < 1e-12, "{name} {}", found.membrane);
    }
}

/// K column by column, from gradients that differences of energies confirm.
fn dense(fairness: &FirstFairness, corners: usize, weights: Weights) -> DMatrix<f64> {
    let mut k = DMatrix::zeros(corners, corners);
    // Three columns at a time, one a coordinate.
    for first in (0..corners).step_by(3) {
        let mut x = vec![DVec3::ZERO; corners];
        let columns = first..corners.min(first + 3);
        columns.clone().for_each(|j| x[j][j - first] = 1.0);
        let product = fairness.gradient(&x, weights);
        columns.for_each(|j| product.iter().enumerate().for_each(|(i, p)| k[(i, j)] = p[j - first]));
    }
    k
}

#[test]
fn first_refinement_gradients_are_differences_of_energies() {
    let surface = noisy_surface("irregular-poly:30");
    let fairness = FirstFairness::new(&surface).unwrap();
    let x = two_phase(&surface, &ALL).surface.into_mesh().positions;
    let weights = Weights { thin_plate: 0.7, membrane: 1.9 };
    let gradient = fairness.gradient(&x, weights);
    for k in 0..5 {
        let wave = |i: usize| ((7 * k + 3 * i) as f64).sin();
        let step: Vec<DVec3> = (0..x.len()).map(|i| DVec3::new(wave(i), wave(2 * i + 1), wave(5 * i + 2))).collect();
        let at = |t: f64| -> f64 {
            let moved: Vec<DVec3> = x.iter().zip(&step).map(|(x, d)| *x + t * *d).collect();
            fairness.energies(&moved).weighted(weights)
        };
        // Exact, the energy being quadratic.
        let (found, expected) =
            (gradient.iter().zip(&step).map(|(g, d)| g.dot(*d)).sum::<f64>(), (at(1.0) - at(-1.0)) / 4.0);
        assert!((found - expected).abs() < 1e-10 * at(1.0), "{found} {expected}");
    }
}

/// Against the dense system of Karush, Kuhn and Tucker, all coordinates together.
#[test]
fn the_fairest_refinement_is_that_of_a_dense_system() {
    let weights =
        [Weights::default(), Weights { thin_plate: 1.0, membrane: 0.1 }, Weights { thin_plate: 0.0, membrane: 1.0 }];
    for ((name, with_normals), weights) in
        [("torus:4x5", true), ("icosahedron", true), ("cube", false)].into_iter().zip(weights)
    {
        let surface = noisy_surface(name);
        let (marks, normals) = some(&surface);
        let wishes =
            Constraints { interpolated: Some(&marks), normals: with_normals.then_some(&normals), handles: None };
        let found = fit(&surface, &wishes, weights);
        let n = found.points.len();
        let k = dense(&FirstFairness::new(&surface).unwrap(), n, weights);
        let mut rows: Vec<(Vec<(usize, f64)>, f64)> = Vec::new();
        let mut star = Vec::new();
        for v in (0..surface.len()).filter(|&v| marks[v]) {
            surface.topology().star(surface.faces(), v, &mut star);
            let m = star.len() as f64;
            for axis in 0..3 {
                let row = star.iter().map(|&c| (3 * c as usize + axis, 1.0 / m)).collect();
                rows.push((row, surface.positions()[v][axis]));
            }
            let Some(normal) = wishes.normals.and_then(|normals| normals[v]) else { continue };
            for harmonic in [f64::cos, f64::sin] {
                let weight = |j: usize| harmonic(std::f64::consts::TAU * j as f64 / m);
                let terms = star.iter().enumerate().flat_map(|(j, &c)| (0..3).map(move |axis| (c, axis, j)));
                rows.push((terms.map(|(c, axis, j)| (3 * c as usize + axis, weight(j) * normal[axis])).collect(), 0.0));
            }
        }
        let size = 3 * n + rows.len();
        let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for i in 0..n {
            for j in 0..n {
                (0..3).for_each(|axis| matrix[(3 * i + axis, 3 * j + axis)] = k[(i, j)]);
            }
        }
        for (r, (terms, value)) in rows.iter().enumerate() {
            right[3 * n + r] = *value;
            for &(j, w) in terms {
                matrix[(3 * n + r, j)] += w;
                matrix[(j, 3 * n + r)] += w;
            }
        }
        let solution = small_lu(matrix).solve(&right).unwrap();
        let expected: Vec<DVec3> =
            (0..n).map(|i| DVec3::new(solution[3 * i], solution[3 * i + 1], solution[3 * i + 2])).collect();
        assert!(distance(&found.points, &expected) < SOLVED, "{name} {:e}", distance(&found.points, &expected));
        let first = two_phase(&surface, &wishes);
        let mesh = first.surface.with_positions(found.points).into_mesh();
        let outward = face_normals(&mesh);
        for (v, normal) in normals.iter().enumerate().filter(|_| with_normals) {
            let angle = normal.map_or(0.0, |n| outward[first.first_vertex_face + v].cross(n.normalize()).length());
            assert!(angle < 1e-9, "{name} {v} {angle}");
        }
    }
}

/// Against the dense system of N unknowns, and the second phase with the handles found.
#[test]
fn fair_handles_are_those_of_a_dense_system() {
    for name in ["torus:4x5", "irregular-poly:30"] {
        let surface = noisy_surface(name);
        let (marks, _) = some(&surface);
        let wishes = Constraints { interpolated: Some(&marks), ..ALL };
        let result = interpolate(&surface, &wishes, &PhaseOne::default()).unwrap();
        let first = result.first.surface.positions();
        let fairness = FirstFairness::new(&surface).unwrap();
        let weights = Weights { thin_plate: 1.0, membrane: 0.5 };
        let found = fair_handles(&fairness, first, surface.positions(), &wishes, weights, &STOP, &mut go_on).unwrap();
        assert_eq!(found.refined.report.outcome, Outcome::Converged);
        let k = dense(&fairness, first.len(), weights);
        let free: Vec<usize> = (0..surface.len()).filter(|&v| marks[v]).collect();
        let mut at_zero = first.to_vec();
        let arms: Vec<Vec<(usize, DVec3)>> = free
            .iter()
            .map(|&v| {
                let corners = surface.incidence().corners_at(v).iter().map(|&c| c as usize);
                corners
                    .map(|c| {
                        at_zero[c] = surface.positions()[v];
                        (c, first[c] - surface.positions()[v])
                    })
                    .collect()
            })
            .collect();
        let form = |a: &[(usize, DVec3)], b: &[(usize, DVec3)]| -> f64 {
            a.iter().flat_map(|(i, p)| b.iter().map(|(j, q)| k[(*i, *j)] * p.dot(*q))).sum()
        };
        let rest: Vec<(usize, DVec3)> = at_zero.iter().copied().enumerate().collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| form(&arms[i], &arms[j]));
        let right = DVector::from_fn(free.len(), |i, _| -form(&arms[i], &rest));
        let expected = small_cholesky(matrix).unwrap().solve(&right);
        for (v, s) in found.handles.iter().enumerate() {
            let expected = free.iter().position(|&w| w == v).map_or(1.0, |i| expected[i]);
            assert!((s - expected).abs() < SOLVED, "{name} {v} {s} {expected}");
        }
        assert!(found.handles.iter().all(|&s| s > 0.0));
        let wishes = Constraints { handles: Some(&found.handles), ..wishes };
        let again = FirstRefinement::new(&result.auxiliary.surface, CornerRule::ZhengCai, surface.positions(), &wishes);
        assert!(distance(again.unwrap().surface.positions(), &found.refined.points) < SOLVED);
    }
}

/// More freedom takes no more energy, with normals and subsets too, and points are met.
#[test]
fn more_freedom_is_fairer() {
    let weights = Weights::default();
    for name in MESHES {
        let surface = noisy_surface(name);
        let (marks, normals) = some(&surface);
        let fairness = FirstFairness::new(&surface).unwrap();
        for wishes in [ALL, Constraints { interpolated: Some(&marks), normals: Some(&normals), handles: None }] {
            let first = two_phase(&surface, &wishes).surface;
            let points = surface.positions();
            let handles =
                fair_handles(&fairness, first.positions(), points, &wishes, weights, &STOP, &mut go_on).unwrap();
            let all = fit(&surface, &wishes, weights);
            let energy = |points: &[DVec3]| fairness.energies(points).weighted(weights);
            let [two_phase, handled, free] = [first.positions(), &handles.refined.points, &all.points].map(energy);
            assert!(
                free < handled * (1.0 - 1e-4) && handled < two_phase * (1.0 - 1e-6),
                "{name} {free} {handled} {two_phase}"
            );
            assert!(all.errors.max < SOLVED && handles.refined.errors.max < SOLVED, "{name}");
            assert_eq!(all.energies.weighted(weights), free);
        }
    }
}

/// On a mesh of several blocks: nothing is left of the gradient along what changes no point, nor along the arms of a face.
#[test]
fn large_fair_refinements_are_stationary() {
    let surface = noisy_surface("irregular-poly:2500");
    let fairness = FirstFairness::new(&surface).unwrap();
    let marks: Vec<bool> = (0..surface.len()).map(|v| v % 7 != 3).collect();
    let wishes = Constraints { interpolated: Some(&marks), ..ALL };
    let weights = Weights::default();
    let stop = Stop { tolerance: 1e-10, max_iterations: 200 };
    let first = two_phase(&surface, &wishes).surface.into_mesh().positions;
    let points = surface.positions();
    let free = fairest(&fairness, &first, points, &wishes, weights, &stop, &mut go_on).unwrap();
    let handles = fair_handles(&fairness, &first, points, &wishes, weights, &stop, &mut go_on).unwrap();
    assert!([&free, &handles.refined].iter().all(|fair| fair.report.outcome == Outcome::Converged));
    let [of_free, of_handles] = [&free, &handles.refined].map(|fair| fairness.gradient(&fair.points, weights));
    let before = fairness.gradient(&first, weights).iter().map(|g| g.length()).fold(0.0, f64::max);
    for (v, point) in points.iter().enumerate() {
        let star = surface.incidence().corners_at(v).iter().map(|&c| c as usize);
        let mean = star.clone().map(|c| of_free[c]).sum::<DVec3>() / star.len() as f64;
        let along: f64 = star.clone().map(|c| of_handles[c].dot(first[c] - *point)).sum();
        for c in star {
            let rest = of_free[c] - if marks[v] { mean } else { DVec3::ZERO };
            assert!(rest.length() < 1e-7 * before, "{v} {rest}");
            assert!(marks[v] || handles.refined.points[c] == first[c]);
        }
        assert!(!marks[v] || along.abs() < 1e-7 * before, "{v} {along}");
    }
}

#[test]
fn fair_refinements_without_sense_are_errors() {
    let surface = Surface::new(builtin::icosahedron()).unwrap();
    let fairness = FirstFairness::new(&surface).unwrap();
    let first = two_phase(&surface, &ALL).surface;
    let refused = |wishes: Constraints, membrane: f64| {
        let weights = Weights { thin_plate: 1.0, membrane };
        let (first, points) = (first.positions(), surface.positions());
        let one = fairest(&fairness, first, points, &wishes, weights, &STOP, &mut go_on).unwrap_err().to_string();
        let other =
            fair_handles(&fairness, first, points, &wishes, weights, &STOP, &mut go_on).unwrap_err().to_string();
        assert_eq!(one, other);
        one
    };
    assert!(refused(ALL, 0.0).contains("fairness weights"));
    assert!(refused(Constraints { handles: Some(&[1.0; 12]), ..ALL }, 1.0).contains("leave them out"));
    assert!(refused(Constraints { interpolated: Some(&[false; 12]), ..ALL }, 1.0).contains("no vertex"));
    let flat = open(grid(4, 5, false), Boundary::EdgeAndCorner);
    assert!(FirstFairness::new(&flat).unwrap_err().to_string().contains("without creases, corners and boundaries"));
}
