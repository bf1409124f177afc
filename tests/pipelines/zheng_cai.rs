//! Zheng-Cai's two phases, Nasri's method, subsets.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::assemble::{LimitSystem, Stages};
use limitlab::interpolate::surface::{self, SurfaceOptions};
use limitlab::interpolate::zheng_cai::*;
use limitlab::interpolate::{nasri, staged};
use limitlab::mesh::{Mesh, Surface, builtin, io};
use limitlab::schemes::Scheme;
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::solvers::{Method, Outcome, Stop, run, run_watched};

use crate::common::pipelines::{ROUNDING, centroid, distance, noisy_surface};

const MESHES: [&str; 4] = ["torus:7x5", "dodecahedron", "irregular-poly:60", "icosphere:1"];

/// Every second vertex or so, by no pattern of the mesh.
fn half(surface: &Surface) -> Vec<bool> {
    (0..surface.len()).map(|v| (v * v + v / 3) % 5 < 3).collect()
}

#[test]
fn both_sweeps_are_the_solvers_of_the_same_system() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let system = LimitSystem::new(&surface, Scheme::ZhengCai).unwrap();
        let order: Vec<u32> = (0..surface.len() as u32).rev().collect();
        let file = Sweep::GaussSeidel(None);
        let reverse = Sweep::GaussSeidel(Some(&order));
        for (sweep, method) in [
            (Sweep::Jacobi, Method::Jacobi { omega: Some(1.0) }),
            (file, Method::GaussSeidel { order: None }),
            (reverse, Method::GaussSeidel { order: Some(&order) }),
        ] {
            let stop = Stop { tolerance: 0.0, max_iterations: 8 };
            let mut seen = Vec::new();
            let eight = PhaseOne { sweep, max_iterations: 8, eps: 0.0 };
            auxiliary_watched(&surface, None, &eight, &mut |sweeps, points| seen.push((sweeps, points.to_vec())))
                .unwrap();
            let mut before = surface.positions().to_vec();
            run_watched(&system, surface.positions(), method, &stop, &mut |step| {
                let phase = PhaseOne { sweep, max_iterations: step.iteration, eps: 0.0 };
                let found = auxiliary(&surface, None, &phase).unwrap();
                assert!(distance(found.surface.positions(), step.points) < ROUNDING, "{name}");
                let (sweeps, points) = &seen[step.iteration];
                assert!(*sweeps == step.iteration && points == found.surface.positions(), "{name}");
                if let Some(&update) = found.updates.last() {
                    assert!((update - distance(&before, step.points)).abs() < ROUNDING);
                }
                before = step.points.to_vec();
                ControlFlow::Continue(())
            });
        }
    }
}

#[test]
fn the_largest_update_ends_the_sweeps() {
    let surface = noisy_surface("irregular-poly:60");
    let all = auxiliary(&surface, None, &PhaseOne { max_iterations: 40, eps: 0.0, ..PhaseOne::default() }).unwrap();
    assert!(!all.passed && all.updates.len() == 40);
    // Each update just above the tolerance, and just below.
    let near = all.updates[..8].iter().flat_map(|u| [u / 1.01, u * 1.01]).map(|u| u / surface.diagonal());
    for eps in near.chain([1e-2, 3e-3, 1e-8]) {
        let phase = PhaseOne { max_iterations: 40, eps, ..PhaseOne::default() };
        let found = auxiliary(&surface, None, &phase).unwrap();
        let tolerance = eps * surface.diagonal();
        let first = all.updates.iter().position(|&u| u <= tolerance).unwrap();
        assert!(found.passed);
        assert_eq!(found.updates, all.updates[..=first]);
    }
}

/// Zheng-Cai §3.5, first example: three sweeps at 0.3 % on the model with 562 vertices.
#[test]
fn the_paper_s_first_example_takes_three_sweeps() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/meshes/closed/psb_m1630_hat_562v.off");
    let Ok(loaded) = io::read(path.as_ref()) else {
        use std::io::Write;
        writeln!(std::io::stderr(), "skipped: {path} is not there").unwrap();
        return;
    };
    let surface = Surface::new(loaded.mesh).unwrap();
    assert_eq!(surface.len(), 562);
    let found = auxiliary(&surface, None, &PhaseOne::default()).unwrap();
    assert!(found.passed);
    let relative: Vec<f64> = found.updates.iter().map(|u| u / surface.diagonal()).collect();
    assert_eq!(relative.len(), 3);
    assert!((relative[1] - 0.0106).abs() < 1e-4 && (relative[2] - 0.00145).abs() < 1e-5, "{relative:?}");
}

fn is_planar(mesh: &Mesh, f: usize, normal: DVec3, center: DVec3) -> bool {
    let corners = mesh.faces.face(f).iter();
    corners.map(|&c| (mesh.positions[c as usize] - center).dot(normal)).all(|d| d.abs() < ROUNDING)
}

/// Directions that lean away from the mean direction of the faces, at some interpolated vertices.
fn leaning(surface: &Surface, interpolated: &[bool]) -> Vec<Option<DVec3>> {
    let outward = doo_sabin::limit_normals(CornerRule::ZhengCai, surface).unwrap();
    let lean = |v: usize| DVec3::new((v as f64).sin(), (3.0 * v as f64).cos(), (v as f64).cos());
    (0..surface.len()).map(|v| (interpolated[v] && v % 3 == 0).then(|| 2.0 * outward[v] + 0.4 * lean(v))).collect()
}

/// Exact centroids, planes and normals after one sweep as after many, at every level, with
/// handles, for a subset.
#[test]
fn centroids_planes_and_normals_are_exact_at_every_level() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let some = half(&surface);
        let normals = leaning(&surface, &some);
        let handles: Vec<f64> =
            (0..surface.len()).map(|v| if some[v] { 0.4 + 0.1 * (v % 20) as f64 } else { 1.0 }).collect();
        for sweeps in [0, 1, 7] {
            let phase = PhaseOne { max_iterations: sweeps, eps: 0.0, ..PhaseOne::default() };
            let constraints =
                Constraints { interpolated: Some(&some), normals: Some(&normals), handles: Some(&handles) };
            let result = interpolate(&surface, &constraints, &phase).unwrap();
            assert!(result.first.not_flattened.is_empty());
            for v in (0..surface.len()).filter(|&v| !some[v]) {
                assert_eq!(result.auxiliary.surface.positions()[v], surface.positions()[v]);
            }
            for level in [1, 2, 4] {
                let fine = result.first.at_level(level).unwrap();
                let found = doo_sabin::face_normals(&fine);
                for v in (0..surface.len()).filter(|&v| some[v]) {
                    let f = result.first.first_vertex_face + v;
                    assert!(centroid(&fine, f).distance(surface.positions()[v]) < ROUNDING);
                    assert!(is_planar(&fine, f, found[f], surface.positions()[v]), "{name} {level} {v}");
                    if let Some(n) = normals[v] {
                        assert!(found[f].cross(n.normalize()).length() < ROUNDING, "{name} {v}");
                    }
                }
            }
        }
    }
}

#[test]
fn opposite_normals_are_the_same_and_handles_scale() {
    let surface = noisy_surface("irregular-poly:60");
    let all = vec![true; surface.len()];
    let normals = leaning(&surface, &all);
    let turned: Vec<Option<DVec3>> = normals.iter().map(|n| n.map(|n| -3.0 * n)).collect();
    let handles: Vec<f64> = (0..surface.len()).map(|v| 0.5 + (v % 4) as f64).collect();
    let first = |normals: &[Option<DVec3>], handles: Option<&[f64]>| {
        let constraints = Constraints { normals: Some(normals), handles, ..Constraints::default() };
        interpolate(&surface, &constraints, &PhaseOne::default()).unwrap().first
    };
    let plain = first(&normals, None);
    assert!(distance(plain.surface.positions(), first(&turned, None).surface.positions()) < ROUNDING);
    let scaled = first(&normals, Some(&handles));
    for (v, &s) in handles.iter().enumerate() {
        for &c in plain.surface.faces().face(plain.first_vertex_face + v) {
            let (p, q) = (plain.surface.positions()[c as usize], scaled.surface.positions()[c as usize]);
            let expected = surface.positions()[v] + s * (p - surface.positions()[v]);
            assert!(q.distance(expected) < ROUNDING);
        }
    }
}

/// Under Nasri's rule, whose surface is plain Doo-Sabin, a handle of 1 is no wish, and a wish is one vertex's.
#[test]
fn nasri_s_surface_changes_only_where_something_is_asked() {
    let surface = noisy_surface("irregular-poly:60");
    let stop = Stop { tolerance: 1e-13, max_iterations: 5000 };
    let solution = nasri::control_points(&surface, None, Method::Cholesky, &stop).unwrap();
    let control = surface.with_positions(solution.points);
    let made = |constraints: Constraints| {
        let request = SurfaceOptions { levels: 1, constraints, ..SurfaceOptions::default() };
        surface::surface(control.clone(), Scheme::Nasri, surface.positions(), &request).unwrap().surface
    };
    let plain = made(Constraints::default());
    // A face of three corners is flat by itself.
    let wide = (4..surface.len()).find(|&v| surface.incidence().face_count(v) > 3).unwrap();
    let mut handles = vec![1.0; surface.len()];
    assert_eq!(made(Constraints { handles: Some(&handles), ..Constraints::default() }).positions(), plain.positions());

    let mut normals = vec![None; surface.len()];
    handles[wide] = 2.5;
    normals[3] = Some(DVec3::new(0.2, 0.9, -0.4));
    let shaped = made(Constraints { handles: Some(&handles), normals: Some(&normals), interpolated: None });
    let first = doo_sabin::first_vertex_face(&surface);
    for v in 0..surface.len() {
        let point = surface.positions()[v];
        for &c in plain.faces().face(first + v) {
            let (p, q) = (plain.positions()[c as usize], shaped.positions()[c as usize]);
            match v {
                // No plane: its own corners, further out.
                _ if v == wide => assert!(q.distance(point + 2.5 * (p - point)) < ROUNDING),
                3 => assert!((q - point).dot(normals[3].unwrap()).abs() < ROUNDING),
                _ => assert_eq!(p, q, "vertex {v}"),
            }
        }
    }
}

#[test]
fn affine_maps_commute_with_phase_one() {
    let surface = noisy_surface("irregular-poly:60");
    let map = |p: &DVec3| DVec3::new(p.x + 2.0 * p.y, p.z - 3.0, 0.5 * p.x - p.y + 4.0 * p.z);
    let moved = surface.with_positions(surface.positions().iter().map(map).collect());
    let phase = PhaseOne { eps: 0.0, ..PhaseOne::default() };
    let [here, there] = [&surface, &moved].map(|s| auxiliary(s, None, &phase).unwrap().surface);
    let here: Vec<DVec3> = here.positions().iter().map(map).collect();
    assert!(distance(&here, there.positions()) < 1e-11);
}

#[test]
fn constraints_without_sense_are_errors_that_name_the_vertex() {
    let surface = Surface::new(builtin::icosahedron()).unwrap();
    let refused =
        |constraints: &Constraints| interpolate(&surface, constraints, &PhaseOne::default()).unwrap_err().to_string();
    let mut some = vec![true; 12];
    some[5] = false;
    let mut normals = vec![None; 12];
    normals[5] = Some(DVec3::X);
    let text = refused(&Constraints { interpolated: Some(&some), normals: Some(&normals), handles: None });
    assert!(text.contains("vertex 5: a normal is given where"), "{text}");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut handles = [1.0; 12];
        handles[3] = bad;
        let text = refused(&Constraints { handles: Some(&handles), ..Constraints::default() });
        assert!(text.contains("vertex 3: the shape handle"), "{text}");
    }
    let mut handles = [1.0; 12];
    handles[5] = 2.0;
    let text = refused(&Constraints { interpolated: Some(&some), handles: Some(&handles), normals: None });
    assert!(text.contains("vertex 5: a shape handle is given where"), "{text}");
    let none = [false; 12];
    assert!(refused(&Constraints { interpolated: Some(&none), ..Constraints::default() }).contains("at least one"));
    // A normal in the plane of the face. Before any sweep the face lies square to the axis, by symmetry.
    let mut normals = vec![None; 12];
    normals[0] = Some(surface.positions()[0].any_orthogonal_vector());
    let edge_on = Constraints { normals: Some(&normals), ..Constraints::default() };
    let none = PhaseOne { max_iterations: 0, ..PhaseOne::default() };
    let text = interpolate(&surface, &edge_on, &none).unwrap_err().to_string();
    assert!(text.contains("vertex 0: the given normal lies in the plane"), "{text}");
    normals[0] = Some(DVec3::ZERO);
    assert!(refused(&Constraints { normals: Some(&normals), ..Constraints::default() }).contains("vertex 0"));
}

/// The thinner the mesh, the smaller the areas of its faces against their sides; only rounding takes the normal away.
#[test]
fn thin_faces_are_flattened_down_to_rounding() {
    let surface = noisy_surface("irregular-poly:60");
    for (thin, flattened) in [(1e-3, true), (1e-6, true), (1e-9, true), (1e-15, false), (0.0, false)] {
        let positions = surface.positions().iter().map(|p| DVec3::new(p.x, thin * p.y, thin * p.z)).collect();
        let thinned = surface.with_positions(positions);
        let first = interpolate(&thinned, &Constraints::default(), &PhaseOne::default()).unwrap().first;
        let expected = if flattened { 0 } else { surface.len() };
        assert_eq!(first.not_flattened.len(), expected, "{thin:e}");
    }
}

#[test]
fn coincident_points_give_finite_meshes() {
    let mut surface = noisy_surface("torus:7x5");
    let p = surface.positions()[0];
    for q in &mut surface.positions_mut()[..15] {
        *q = p;
    }
    let flat = surface.with_positions(surface.positions().iter().map(|q| DVec3::X * q.x).collect());
    for surface in [surface, flat] {
        let result = interpolate(&surface, &Constraints::default(), &PhaseOne::default()).unwrap();
        let fine = result.first.at_level(3).unwrap();
        assert!(fine.positions.iter().all(|p| p.is_finite()));
        for v in 0..surface.len() {
            let f = result.first.first_vertex_face + v;
            assert!(centroid(&fine, f).distance(surface.positions()[v]) < ROUNDING);
        }
    }
}

#[test]
fn nasri_s_faces_have_the_given_centroids() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let some = half(&surface);
        let stop = Stop { tolerance: 1e-13, max_iterations: 5000 };
        for marks in [None, Some(&some[..])] {
            let solution = nasri::control_points(&surface, marks, Method::Cholesky, &stop).unwrap();
            assert_eq!(solution.report.outcome, Outcome::Converged);
            let control = surface.with_positions(solution.points);
            let limits = doo_sabin::limit_positions(CornerRule::DooSabin, &control).unwrap();
            for v in 0..surface.len() {
                let expected = if marks.is_none_or(|m| m[v]) { limits[v] } else { control.positions()[v] };
                assert!(expected.distance(surface.positions()[v]) < ROUNDING, "{name} {v}");
            }
        }
    }
}

/// Every method on a subset finds the same control points, and they satisfy the rows that are asked for.
#[test]
fn a_subset_is_interpolated_by_every_scheme_and_method() {
    let surface = noisy_surface("icosphere:1");
    let some = half(&surface);
    let stop = Stop { tolerance: 1e-12, max_iterations: 5000 };
    for scheme in Scheme::ALL {
        let full = LimitSystem::new(&surface, scheme).unwrap();
        let part = Stages::new(&surface, scheme, Some(&some)).unwrap();
        let file: Vec<u32> = (0..surface.len() as u32).rev().collect();
        let order = part.order(&file);
        assert_eq!(order.len(), part.vertices().unwrap().len());
        let mut first: Option<Vec<DVec3>> = None;
        for method in [
            Method::Lu,
            Method::Cholesky,
            Method::Thall,
            Method::Pia,
            Method::Cg,
            Method::GaussSeidel { order: Some(&order) },
            Method::Chebyshev { interval: Some((full.bounds.lambda_min.max(0.02), 1.0)) },
        ] {
            let solution = staged::run(&part, surface.positions(), method, &stop);
            assert_eq!(solution.report.outcome, Outcome::Converged, "{scheme} {method:?}");
            for (v, &marked) in some.iter().enumerate() {
                let value = if marked { full.a.row_times(v, &solution.points) } else { solution.points[v] };
                assert!(value.distance(surface.positions()[v]) < 1e-11);
            }
            match &first {
                None => first = Some(solution.points),
                Some(points) => assert!(distance(points, &solution.points) < 1e-9),
            }
        }
    }
    // All vertices: the whole system, from the same start.
    let full = LimitSystem::new(&surface, Scheme::Loop).unwrap();
    let part = Stages::new(&surface, Scheme::Loop, Some(&vec![true; surface.len()])).unwrap();
    assert_eq!(part.block().a, full.a);
    let stop = Stop { tolerance: 0.0, max_iterations: 5 };
    let found = staged::run(&part, surface.positions(), Method::Pia, &stop);
    assert_eq!(found.points, run(&full, surface.positions(), Method::Pia, &stop).points);
    assert!(Stages::new(&surface, Scheme::Loop, Some(&vec![false; surface.len()])).is_err());
}
