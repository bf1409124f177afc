//! Limit points and normals of the unified √3 surface.

use std::f64::consts::TAU;

use glam::DVec3;
use limitlab::analysis::splitting::{Layout, LocalScheme, SplittingMatrix, condition_over_alpha};
use limitlab::interpolate::lin_luo::limit::limits;
use limitlab::interpolate::lin_luo::surface::refine_n;
use limitlab::mesh::random::random_points;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::sqrt3;

use crate::common::pipelines::{ROUNDING, distance, noisy_surface};

const MESHES: [&str; 4] = ["star:5", "bipyramid:8", "irregular-tri:60", "icosphere:1"];

/// Parameters without order, within the range where every valence above 3 has a tangent plane.
fn mixed(surface: &Surface) -> Vec<f64> {
    let alpha = |v: usize| 0.75 + 0.75 * (5.3 * v as f64).sin();
    (0..surface.len()).map(alpha).collect()
}

#[test]
fn at_alpha_0_they_are_those_of_the_masks() {
    for name in MESHES.into_iter().chain(["tetrahedron"]) {
        let surface = noisy_surface(name);
        let found = limits(&surface, &vec![0.0; surface.len()]).unwrap();
        let positions = sqrt3::limit_positions(&surface).unwrap();
        let normals = sqrt3::limit_normals(&surface).unwrap();
        assert!(distance(&found.positions, &positions) < ROUNDING, "{name}");
        assert!(distance(&found.normals, &normals) < ROUNDING, "{name}");
    }
}

#[test]
fn vertices_with_alpha_1_stay_whatever_is_beside_them() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let alpha: Vec<f64> = (0..surface.len()).map(|v| [1.0, 0.3, 1.7][v % 3]).collect();
        let found = limits(&surface, &alpha).unwrap();
        for v in (0..surface.len()).step_by(3) {
            assert_eq!(found.positions[v], surface.positions()[v], "{name} {v}");
        }
    }
}

/// The surface of a mesh is the surface of the refined one, so limits computed from either are the same: nothing of
/// the method is shared but the rounds, which start two levels further down.
#[test]
fn a_refined_mesh_has_the_same_limits() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let alpha = mixed(&surface);
        let found = limits(&surface, &alpha).unwrap();
        for levels in [1, 2] {
            let (fine, parameters) = refine_n(&surface, &alpha, levels).unwrap();
            let again = limits(&fine, &parameters).unwrap();
            let n = surface.len();
            assert!(distance(&found.positions, &again.positions[..n]) < ROUNDING, "{name}");
            assert!(distance(&found.normals, &again.normals[..n]) < 1e-9, "{name}");
            let plain = |v: usize| surface.incidence().face_count(v) > 3;
            let missing = (0..n).find(|&v| plain(v) && found.normals[v] == DVec3::ZERO);
            assert_eq!(missing, None, "{name}");
        }
    }
}

/// Whole meshes, refined again and again, approach the limit points and normals.
#[test]
fn refinement_ends_at_the_limits() {
    for name in ["star:5", "bipyramid:8"] {
        let surface = noisy_surface(name);
        let alpha = mixed(&surface);
        let found = limits(&surface, &alpha).unwrap();
        let mut before = [f64::INFINITY; 2];
        for levels in [2, 4, 6, 8] {
            let (fine, _) = refine_n(&surface, &alpha, levels).unwrap();
            let mut star = Vec::new();
            let mut turned = 0.0f64;
            for (v, normal) in found.normals.iter().enumerate() {
                fine.topology().star(fine.faces(), v, &mut star);
                let sum: DVec3 = star
                    .iter()
                    .map(|&c| {
                        let face = fine.faces().face(c as usize / 3);
                        let [a, b, c] = [0, 1, 2].map(|k| fine.positions()[face[k] as usize]);
                        (b - a).cross(c - a)
                    })
                    .sum();
                turned = turned.max(sum.normalize().distance(*normal));
            }
            let off = distance(&fine.positions()[..surface.len()], &found.positions);
            assert!(off < 0.5 * before[0] && turned < 0.8 * before[1], "{name} {levels}");
            before = [off, turned];
        }
        assert!(before[0] < 2e-3 && before[1] < 0.05, "{name} {before:?}");
    }
}

/// A second way for one α everywhere: the left eigenvector of the local matrix's eigenvalue 1, on the star that two
/// steps leave regular.
#[test]
fn for_one_alpha_they_are_those_of_the_local_matrix() {
    for (k, surface) in [3, 4, 5, 8].map(|k| (k, noisy_surface(&format!("bipyramid:{k}")))) {
        for alpha in [0.3, 0.7, 1.4] {
            let found = limits(&surface, &vec![alpha; surface.len()]).unwrap();
            let matrix = SplittingMatrix::new(LocalScheme::Sqrt3 { alpha }, k).unwrap();
            let mask = matrix.limit_mask().unwrap();
            let (fine, _) = refine_n(&surface, &vec![alpha; surface.len()], 2).unwrap();
            // Apices are vertices k and k + 1.
            for v in [k, k + 1] {
                let root = fine.incidence().corners_at(v)[0];
                let layout = LocalScheme::Sqrt3 { alpha }.layout();
                let star = layout.walk(&fine, root, k, 3).unwrap();
                let limit: DVec3 = star.iter().zip(mask.iter()).map(|(&i, w)| *w * fine.positions()[i as usize]).sum();
                assert!(limit.distance(found.positions[v]) < ROUNDING, "{k} {alpha}");
            }
        }
    }
}

/// A vertex has a normal exactly where the pair of the local matrix leads.
#[test]
fn normals_are_where_the_eigenvalue_condition_holds() {
    let valences = [3, 4, 5, 8];
    let alphas = [0.0, 0.4, 0.7, 0.9, 1.0, 1.3, 1.6, 2.0];
    let mut seen = [0, 0];
    for condition in condition_over_alpha(&valences, &alphas).unwrap() {
        let surface = noisy_surface(&format!("bipyramid:{}", condition.valence));
        let found = limits(&surface, &vec![condition.alpha; surface.len()]).unwrap();
        let normal = found.normals[condition.valence];
        let what = format!("{} {}", condition.valence, condition.alpha);
        assert_eq!(normal != DVec3::ZERO, condition.holds, "{what}");
        seen[usize::from(condition.holds)] += 1;
    }
    assert!(seen[0] > 4 && seen[1] > 15, "{seen:?}");
}

#[test]
fn degenerate_stars_have_limits_and_no_normals() {
    let mut surface = noisy_surface("star:5");
    surface.positions_mut().fill(DVec3::ONE);
    let found = limits(&surface, &mixed(&surface)).unwrap();
    assert!(found.positions.iter().all(|p| p.distance(DVec3::ONE) < ROUNDING));
    assert!(found.normals.iter().all(|n| *n == DVec3::ZERO));
    // All points on a line.
    for (v, p) in surface.positions_mut().iter_mut().enumerate() {
        *p = (TAU * v as f64).sin() * DVec3::X + v as f64 * DVec3::X;
    }
    let found = limits(&surface, &mixed(&surface)).unwrap();
    assert!(found.positions.iter().all(|p| p.is_finite()));
    assert!(found.normals.iter().all(|n| *n == DVec3::ZERO));
    let error = limits(&surface, &vec![2.5; surface.len()]).unwrap_err();
    assert!(error.to_string().contains("at vertex 0"));
}

/// At valence 3 the surface comes to a point for α > 0.7992, whatever is beside it: its star turns as it shrinks, so that at
/// some round it may lie in a plane.
#[test]
fn a_vertex_of_valence_3_has_a_normal_only_below_its_limit_of_alpha() {
    for (own, expected) in [(0.7, true), (1.0, false), (1.4, false)] {
        for seed in 0..40 {
            let mut points = random_points(20, 2 * seed);
            points.truncate(Layout::Triangles.len(3, 3) + 1);
            let mut alpha: Vec<f64> = random_points(20, 2 * seed + 1).iter().map(|p| 0.25 + 0.25 * p.x).collect();
            alpha[0] = own;
            let star = Surface::new(Mesh::new(points, Layout::Triangles.closed(3, 3))).unwrap();
            let found = limits(&star, &alpha).unwrap();
            assert_eq!(found.normals[0] != DVec3::ZERO, expected, "α = {own}, {seed}");
        }
    }
}
