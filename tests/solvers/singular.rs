//! Singular and nearly singular systems: 3-valent bipartite meshes under Catmull-Clark.

use glam::DVec3;
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::{Mesh, io};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Stop};

use super::methods::*;
use crate::common::collection::collection;
use crate::common::meshes::*;
use crate::common::tol;

fn stop(mesh: &Mesh) -> Stop {
    Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 20_000 }
}

fn singular_meshes() -> Vec<(String, Mesh)> {
    let names = ["cube", "prism:4", "prism:6", "prism:8", "prism:50", "truncated-octahedron", "cubes:3"];
    let mut meshes: Vec<_> = names.map(|n| (n.to_owned(), built_in(n))).to_vec();
    meshes.push(("spliced cubes".into(), spliced_cubes()));
    // Cubes beside a component that is not singular.
    let both = limitlab::mesh::generate::union(&[built_in("icosahedron"), built_in("cube")]);
    meshes.push(("icosahedron and cube".into(), both));
    if let Some(root) = collection() {
        let file = "closed/platonic_shelf_50v_poly.off";
        meshes.push((file.into(), io::read(&root.join(file)).unwrap().mesh));
    }
    meshes
}

/// A vector of the kernel: ±1 by the colour of the vertex on 3-valent bipartite components, else 0.
fn kernel(mesh: &Mesh) -> Vec<f64> {
    let topology = topology(mesh);
    let (component, count) = topology.components(&mesh.faces);
    let mut colour = vec![0.0; mesh.len()];
    for k in 0..count {
        let members: Vec<usize> = (0..mesh.len()).filter(|&v| component[v] as usize == k).collect();
        let start = members[0];
        colour[start] = 1.0;
        let mut open = vec![start];
        let mut bipartite = members.iter().all(|&v| topology.incidence.face_count(v) == 3);
        while let Some(v) = open.pop() {
            for face in mesh.faces.iter() {
                for (i, &a) in face.iter().enumerate() {
                    let b = face[(i + 1) % face.len()] as usize;
                    if a as usize == v {
                        if colour[b] == 0.0 {
                            colour[b] = -colour[v];
                            open.push(b);
                        }
                        bipartite &= colour[b] == -colour[v];
                    }
                }
            }
        }
        if !bipartite {
            members.iter().for_each(|&v| colour[v] = 0.0);
        }
    }
    colour
}

#[test]
fn direct_methods_call_singular_what_is_singular_whatever_the_data() {
    for (name, mesh) in singular_meshes() {
        let system = system(&mesh, Scheme::CatmullClark);
        let colour = kernel(&mesh);
        assert!(colour.iter().any(|c| *c != 0.0), "{name} has a kernel");
        let image = |i: usize| system.a.row_times(i, &colour);
        assert!((0..mesh.len()).all(|i| image(i).abs() <= tol::rounding(32)), "{name}: A colour = 0");
        let consistent = product(&system, &random_points(mesh.len(), 4));
        let inconsistent: Vec<DVec3> = consistent.iter().zip(&colour).map(|(p, c)| *p + 0.1 * *c).collect();
        for points in [&mesh.positions, &consistent, &inconsistent] {
            for (called, method) in DIRECT {
                let solution = checked(&system, points, method, &stop(&mesh));
                let report = &solution.report;
                assert_eq!(report.outcome, Outcome::Singular, "{name}, {called}");
                assert_eq!(report.iterations, 0);
                assert_eq!(&solution.points, points);
                assert!(report.detail.as_ref().is_some_and(|d| !d.contains('\n')), "{name}, {called}");
            }
        }
    }
}

#[test]
fn meshes_beside_the_singular_ones_are_regular() {
    // Odd prisms have λ_min ≈ 0.82/k²; a valence above 3, or an odd face, is enough.
    for name in ["prism:3", "prism:5", "prism:101", "prism:1001", "dodecahedron", "tetrahedron", "octahedron"] {
        let mesh = noisy(name);
        let system = system(&mesh, Scheme::CatmullClark);
        for (called, method) in DIRECT {
            let report = checked(&system, &mesh.positions, method, &stop(&mesh)).report;
            assert_eq!(report.outcome, Outcome::Converged, "{name}, {called}: {:?}", report.detail);
        }
    }
    // The singular ones are regular under the schemes that are regular always.
    for scheme in [Scheme::Nasri, Scheme::ZhengCai] {
        for (name, mesh) in singular_meshes() {
            let system = system(&mesh, scheme);
            for (called, method) in DIRECT {
                let report = checked(&system, &mesh.positions, method, &stop(&mesh)).report;
                assert_eq!(report.outcome, Outcome::Converged, "{name}, {called}");
            }
        }
    }
}

/// The two colour classes of the cube's own corners have the same sum, so its points are orthogonal to the kernel.
#[test]
fn pia_converges_on_the_cube_s_own_points_and_stagnates_on_perturbed_ones() {
    let cube = built_in("cube");
    let system = system(&cube, Scheme::CatmullClark);
    for method in [Method::Pia, Method::Thall] {
        let solution = checked(&system, &cube.positions, method, &stop(&cube));
        assert_eq!(solution.report.outcome, Outcome::Converged);
        // A corner's limit is at half its control point: the control cube is twice as large.
        let twice: Vec<DVec3> = cube.positions.iter().map(|p| 2.0 * *p).collect();
        assert!(distance(&solution.points, &twice) < tol::SOLVED);
        for seed in 1..6 {
            let mut perturbed = cube.clone();
            add_noise(&mut perturbed, 0.1, seed);
            let report = checked(&system, &perturbed.positions, method, &stop(&cube)).report;
            assert_eq!(report.outcome, Outcome::Stagnated, "seed {seed}");
            // What is left is the points' part in the kernel, H-weighted: the same at all vertices.
            let colour = kernel(&cube);
            let part: DVec3 = perturbed.positions.iter().zip(&colour).map(|(p, c)| *p * *c).sum::<DVec3>() / 8.0;
            assert!((report.last().max - part.length()).abs() < tol::SOLVED);
        }
    }
}

#[test]
fn no_method_claims_a_solution_that_does_not_exist() {
    for (name, mesh) in singular_meshes() {
        let system = system(&mesh, Scheme::CatmullClark);
        let colour = kernel(&mesh);
        let order = reversed(mesh.len());
        for seed in 0..4 {
            let random = random_points(mesh.len(), seed);
            // (A V)_i has no part in the left kernel H⁻¹·colour; neither have consistent data.
            let consistent = product(&system, &random);
            let amount = 0.05 * (seed + 1) as f64;
            let inconsistent: Vec<DVec3> = consistent.iter().zip(&colour).map(|(p, c)| *p + amount * *c).collect();
            for (called, method) in all(&system, &order) {
                let report = checked(&system, &inconsistent, method, &stop(&mesh)).report;
                assert_ne!(report.outcome, Outcome::Converged, "{name}, {called}, seed {seed}");
                // Consistent data: relaxation finds one of infinitely many solutions.
                if matches!(method, Method::Pia | Method::GaussSeidel { .. } | Method::Sor { .. } | Method::Cg)
                    && mesh.len() < 60
                {
                    let report = checked(&system, &consistent, method, &stop(&mesh)).report;
                    assert_eq!(report.outcome, Outcome::Converged, "{name}, {called}, seed {seed}");
                }
            }
        }
    }
}
