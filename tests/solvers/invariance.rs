//! What must not change a run: affine maps of the data, vertex numbers (for simultaneous updates), the number of threads.

use glam::{DMat3, DVec3};
use limitlab::mesh::generate::permute_vertices;
use limitlab::mesh::order::Order;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Solution, Stop};

use super::methods::*;
use crate::common::meshes::*;
use crate::common::tol;

fn is_krylov(method: Method) -> bool {
    use Method::*;
    matches!(method, Cg | PlainCg | PcgJacobi | PcgSsor { .. } | PcgIc0 | Anderson { .. })
}

const FEW: Stop = Stop { tolerance: 0.0, max_iterations: 12 };

/// Rows of A sum to 1, so affine maps commute with every step that is linear in the data. The step sizes of conjugate
/// gradients are not, but similarities keep them.
#[test]
fn affine_maps_of_the_data_are_affine_maps_of_every_iterate() {
    let shear = DMat3::from_cols_array(&[1.1, 0.2, -0.7, 0.4, -0.9, 0.3, 0.6, 0.5, 1.3]);
    let rotation = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, 0.7) * 2.5;
    let shift = DVec3::new(0.5, -2.0, 1.0);
    for scheme in Scheme::ALL {
        let name = if scheme.needs_triangles() { "irregular-tri:80" } else { "torus:9x8" };
        let mesh = noisy(name);
        let system = system(&mesh, scheme);
        let order = reversed(mesh.len());
        for (name, method) in all(&system, &order) {
            let (map, stop) = match method {
                _ if is_krylov(method) => (rotation, FEW),
                // One solve; a second one would refine rounding errors.
                _ if DIRECT.iter().any(|d| d.1 == method) => (shear, Stop { max_iterations: 1, ..FEW }),
                _ => (shear, FEW),
            };
            let moved: Vec<DVec3> = mesh.positions.iter().map(|p| map * *p + shift).collect();
            let plain = checked(&system, &mesh.positions, method, &stop);
            let expected: Vec<DVec3> = plain.points.iter().map(|p| map * *p + shift).collect();
            let found = checked(&system, &moved, method, &stop);
            let error = distance(&found.points, &expected);
            // The shear stretches by less than 2.
            let scale = 2.0 * mesh.diagonal();
            let allowed =
                if is_krylov(method) { tol::krylov(scale) } else { tol::iterates(stop.max_iterations, scale) };
            assert!(error <= allowed, "{name}, {scheme}: {error:e}");
            assert_eq!(found.report.iterations, plain.report.iterations);
        }
    }
}

#[test]
fn renumbering_leaves_simultaneous_updates_alone_but_not_sweeps() {
    for scheme in Scheme::ALL {
        let name = if scheme.needs_triangles() { "irregular-tri:150" } else { "irregular-quad:150" };
        let mesh = noisy(name);
        let order = Order::Random(77).order(&mesh, &topology(&mesh).incidence);
        let renumbered = permute_vertices(&mesh, &order);
        let (before, after) = (system(&mesh, scheme), system(&renumbered, scheme));
        let maxima = |solution: &Solution| -> Vec<f64> { solution.report.maxima() };
        let histories = |method: Method| {
            let runs = [(&before, &mesh), (&after, &renumbered)];
            runs.map(|(system, mesh)| maxima(&checked(system, &mesh.positions, method, &FEW)))
        };
        let largest = |[a, b]: [Vec<f64>; 2]| {
            assert_eq!(a.len(), b.len());
            a.iter().zip(&b).map(|(a, b)| (a - b).abs() / mesh.diagonal()).fold(0.0, f64::max)
        };
        for method in [Method::Pia, Method::Thall, Method::Chebyshev { interval: Some((0.1, 1.0)) }] {
            let difference = largest(histories(method));
            assert!(difference <= tol::iterates(12, 1.0), "{scheme} {method:?}: {difference:e}");
        }
        let sweeps = Method::GaussSeidel { order: None };
        assert!(largest(histories(sweeps)) > 1e-6, "{scheme}: the order does not matter?");
        // Told the old order in new numbers, the sweeps are the same.
        let told = limitlab::mesh::order::inverse(&order);
        let in_order = Method::GaussSeidel { order: Some(&told) };
        let first = maxima(&checked(&before, &mesh.positions, sweeps, &FEW));
        let second = maxima(&checked(&after, &renumbered.positions, in_order, &FEW));
        assert!(largest([first, second]) <= tol::iterates(12, 1.0), "{scheme}");
    }
}

#[test]
fn results_are_bit_by_bit_the_same_with_any_number_of_threads() {
    let triangles = noisy("icosphere:5");
    assert!(triangles.len() > 10_000);
    let quads = noisy("torus:120x100");
    for (mesh, scheme) in [(&triangles, Scheme::Loop), (&quads, Scheme::CatmullClark)] {
        let system = system(mesh, scheme);
        let order = Order::Morton.order(mesh, &topology(mesh).incidence);
        let spectrum = (0.1, 1.0);
        let methods = [
            Method::Pia,
            Method::Thall,
            Method::Sor { omega: 1.1, order: Some(&order) },
            Method::Ssor { omega: 1.0, order: None },
            Method::Chebyshev { interval: Some(spectrum) },
            Method::Cg,
            Method::PlainCg,
            Method::PcgJacobi,
            Method::PcgSsor { omega: 1.0 },
            Method::PcgIc0,
            Method::Cholesky,
            Method::Ldlt,
        ];
        for method in methods {
            let [one, two, three] = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| checked(&system, &mesh.positions, method, &FEW))
            });
            for other in [two, three] {
                assert_eq!(one.report, other.report, "{scheme} {method:?}");
                let bits = |s: &Solution| -> Vec<[u64; 3]> {
                    s.points.iter().map(|p| p.to_array().map(f64::to_bits)).collect()
                };
                assert_eq!(bits(&one), bits(&other), "{scheme} {method:?}");
            }
        }
    }
}
