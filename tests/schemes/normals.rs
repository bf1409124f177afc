//! Tangent masks: eigenvectors over a real refinement, and normals against those of a finely refined mesh.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use limitlab::mesh::Surface;
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::schemes::{Refinement, Tangents, catmull_clark, loop_scheme, sqrt3};

use super::ROUNDING;
use super::meshes::*;

type TangentsOf = fn(&Surface) -> limitlab::Result<Vec<Tangents>>;

const PRIMAL: [(Refinement, TangentsOf); 3] = [
    (Refinement::CatmullClark, catmull_clark::limit_tangents),
    (Refinement::Loop, loop_scheme::limit_tangents),
    (Refinement::Sqrt3, sqrt3::limit_tangents),
];

fn meshes_for(scheme: Refinement) -> Vec<Surface> {
    match scheme {
        Refinement::CatmullClark | Refinement::DooSabin | Refinement::MidEdge => polygon_meshes(),
        _ => triangle_meshes(),
    }
}

fn normals(scheme: Refinement, surface: &Surface) -> Vec<DVec3> {
    match scheme {
        Refinement::CatmullClark => catmull_clark::limit_normals(surface),
        Refinement::Loop => loop_scheme::limit_normals(surface),
        Refinement::Sqrt3 => sqrt3::limit_normals(surface),
        Refinement::Butterfly | Refinement::LabsikGreiner | Refinement::MidEdge => scheme.limit_normals(surface),
        _ => doo_sabin::limit_normals(CornerRule::DooSabin, surface),
    }
    .unwrap()
}

/// The subdominant eigenvalue.
fn lambda(scheme: Refinement, n: usize) -> f64 {
    let size = n as f64;
    match scheme {
        Refinement::CatmullClark => (4.0 + catmull_clark::tangent_constant(n)) / 16.0,
        Refinement::Loop => 0.375 + 0.25 * (TAU / size).cos(),
        _ => 2.0 / 3.0 * (PI / size).cos(),
    }
}

/// Left eigenvectors: a step multiplies both tangents by λ (and turns them in their plane as it renumbers the
/// star), so it multiplies the bivector cosine × sine by λ².
#[test]
fn a_step_scales_the_tangents_by_the_subdominant_eigenvalue() {
    for (scheme, tangents) in PRIMAL {
        for surface in meshes_for(scheme) {
            let fine = scheme.refined(&surface).unwrap();
            let coarse_pairs = tangents(&surface).unwrap();
            let fine_pairs = tangents(&fine).unwrap();
            let incidence = surface.incidence();
            for v in 0..surface.len() {
                let scale = lambda(scheme, incidence.face_count(v)).powi(2);
                let [expected, found] = [coarse_pairs[v], fine_pairs[v]].map(|t| t.cosine.cross(t.sine));
                let size = 1.0 + expected.length();
                assert!((scale * expected - found).length() < 10.0 * ROUNDING * size, "{scheme}");
            }
        }
    }
}

#[test]
fn the_catmull_clark_constant_in_closed_form() {
    assert!((catmull_clark::tangent_constant(4) - 4.0).abs() < 1e-14);
    assert!((lambda(Refinement::CatmullClark, 3) - (9.0 + 17f64.sqrt()) / 32.0).abs() < 1e-15);
    assert!((lambda(Refinement::CatmullClark, 4) - 0.5).abs() < 1e-15);
    // Thall's m_2, m_3 for valence 4 up to sign: edges 4, 0, −4, 0 and faces 1, −1, −1, 1.
    let mask = catmull_clark::tangent_mask(4);
    let expected = [[4.0, 1.0], [0.0, -1.0], [-4.0, -1.0], [0.0, 1.0]];
    for (found, expected) in mask.iter().zip(expected) {
        assert!((found[0] - expected[0]).abs() < 1e-14 && (found[1] - expected[1]).abs() < 1e-14);
    }
}

/// The cosine tangent of a pyramid's apex, from the mask's numbers and Thall's regularised faces.
#[test]
fn tangents_equal_their_masks() {
    for k in 3..=12u32 {
        let surface = scattered(pyramid(k), 9);
        let found = catmull_clark::limit_tangents(&surface).unwrap()[k as usize];
        // The star of the apex starts at its first corner, in face (0, 1, apex): neighbours 0, 1, ….
        let point = |j: u32| surface.positions()[(j % k) as usize];
        let apex = surface.positions()[k as usize];
        let mut expected = DVec3::ZERO;
        for (j, [edge, face]) in (0..k).zip(catmull_clark::tangent_mask(k as usize)) {
            let opposite = (point(j) + point(j + 1) + apex) / 3.0;
            expected += edge * point(j) + face * opposite;
        }
        assert!((found.cosine - expected).length() < 10.0 * ROUNDING);
    }
}

#[test]
fn refined_meshes_have_the_same_normals() {
    for scheme in [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::Sqrt3,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
    ] {
        for surface in meshes_for(scheme) {
            let fine = scheme.refined_n(&surface, 2).unwrap();
            let (coarse, fine) = (normals(scheme, &surface), normals(scheme, &fine));
            for (v, normal) in coarse.iter().enumerate() {
                assert!((normal.length() - 1.0).abs() < ROUNDING);
                // Random stars may be nearly flat, which magnifies rounding.
                assert!((*normal - fine[v]).length() < 1e-9, "{scheme}");
            }
        }
    }
}

/// The sum of the cross products around a vertex: the normal that a viewer of the refined mesh sees.
fn discrete_normal(surface: &Surface, v: usize) -> DVec3 {
    let mut star = Vec::new();
    surface.topology().star(surface.faces(), v, &mut star);
    let center = surface.positions()[v];
    let ring: Vec<DVec3> = star
        .iter()
        .map(|&c| {
            let range = surface.faces().range(surface.incidence().face_of(c));
            let next = limitlab::mesh::incidence::next_in(&range, c);
            surface.positions()[surface.faces().corners()[next as usize] as usize] - center
        })
        .collect();
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    pairs.map(|(a, b)| a.cross(*b)).sum::<DVec3>().normalize()
}

#[test]
fn normals_are_those_of_a_finely_refined_mesh() {
    for scheme in [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::Sqrt3,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
    ] {
        for k in [3, 4, 5, 7] {
            let surface = bipyramid(k);
            let normals = normals(scheme, &surface);
            let levels = match scheme {
                Refinement::Sqrt3 | Refinement::LabsikGreiner => 9,
                _ => 6,
            };
            let fine = scheme.refined_n(&surface, levels).unwrap();
            for (v, normal) in normals.iter().enumerate() {
                let seen = discrete_normal(&fine, v);
                assert!((seen - *normal).length() < 0.01, "{scheme} {k} {v}: {seen} {normal}");
                // Outward: the body is convex around the origin.
                assert!(normal.dot(surface.positions()[v]) > 0.0);
            }
        }
    }
}

#[test]
fn doo_sabin_normals_are_those_of_a_finely_refined_mesh() {
    for surface in [prism(3), prism(5), pyramid(6), bipyramid(5), cube()] {
        let first = surface.faces().len() + surface.topology().edges();
        for rule in [CornerRule::DooSabin, CornerRule::ZhengCai] {
            let normals = doo_sabin::limit_normals(rule, &surface).unwrap();
            let once = Surface::new(doo_sabin::refine_by(rule, &surface).unwrap()).unwrap();
            let fine = Refinement::DooSabin.refine_n(&once, 5).unwrap();
            let center: DVec3 = surface.positions().iter().sum::<DVec3>() / surface.len() as f64;
            let limits = doo_sabin::limit_positions(rule, &surface).unwrap();
            for (v, normal) in normals.iter().enumerate() {
                let face = fine.faces.face(first + v);
                let ring: Vec<DVec3> = face.iter().map(|&c| fine.positions[c as usize] - limits[v]).collect();
                let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
                let seen = pairs.map(|(a, b)| a.cross(*b)).sum::<DVec3>().normalize();
                assert!((seen - *normal).length() < 0.01);
                assert!(normal.dot(limits[v] - center) > 0.0);
                let face = doo_sabin::face_normals(once.mesh())[first + v];
                assert!((face - *normal).length() < ROUNDING);
            }
        }
    }
}

/// The face of a vertex approaches the tangent plane, and so do the surroundings: like a power of the number of steps at
/// valence 3, where the face lies in the plane.
#[test]
fn mid_edge_normals_are_those_of_a_finely_refined_mesh() {
    for surface in [prism(3), prism(5), pyramid(6), bipyramid(5), bipyramid(7)] {
        let normals = normals(Refinement::MidEdge, &surface);
        let valences = surface.incidence();
        let center: DVec3 = surface.positions().iter().sum::<DVec3>() / surface.len() as f64;
        let at = |levels: usize| {
            let fine = Refinement::MidEdge.refined_n(&surface, levels).unwrap();
            let seen = |v: usize| {
                let face = fine.faces().face(surface.faces().len() + v);
                let corners: Vec<DVec3> = face.iter().map(|&c| fine.positions()[c as usize]).collect();
                let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
                let own = pairs.map(|(a, b)| a.cross(*b)).sum::<DVec3>().normalize();
                let around = |&c: &u32| (discrete_normal(&fine, c as usize) - normals[v]).length();
                (own, face.iter().map(around).fold(0.0, f64::max))
            };
            (0..surface.len()).map(seen).collect::<Vec<_>>()
        };
        let (coarse, fine) = (at(4), at(8));
        for (v, normal) in normals.iter().enumerate() {
            assert!(normal.dot(surface.positions()[v] - center) > 0.0);
            // Of an n-gon the other harmonics must die out first.
            let n = valences.face_count(v);
            let allowed = if n == 3 { 1e-9 } else { 0.01 };
            assert!((fine[v].0 - *normal).length() < allowed, "{v} of valence {n}: {} {normal}", fine[v].0);
            let (before, after) = (coarse[v].1, fine[v].1);
            assert!(after < 0.02 || after < 0.75 * before, "{v} of valence {n}: {before} then {after}");
        }
    }
}

/// A step halves both tangents of a face and turns nothing: the type-F face has the same normal.
#[test]
fn doo_sabin_face_normals_stay() {
    for surface in polygon_meshes() {
        let fine = Refinement::DooSabin.refine_n(&surface, 2).unwrap();
        let (coarse, fine) = (doo_sabin::face_normals(surface.mesh()), doo_sabin::face_normals(&fine));
        for (normal, refined) in coarse.iter().zip(&fine) {
            assert!((normal.length() - 1.0).abs() < ROUNDING);
            assert!((*normal - *refined).length() < 1e-9);
        }
    }
}

#[test]
fn normals_turn_with_the_mesh_and_do_not_see_shifts_and_scales() {
    let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    for scheme in [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::Sqrt3,
        Refinement::DooSabin,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
        Refinement::MidEdge,
    ] {
        for surface in meshes_for(scheme) {
            let points = surface.positions().iter().map(|p| 1e-6 * (turn * *p) + DVec3::splat(2e-6));
            let turned = surface.with_positions(points.collect());
            for (a, b) in normals(scheme, &surface).iter().zip(normals(scheme, &turned)) {
                assert!((turn * *a - b).length() < 1e-9, "{scheme}");
            }
        }
    }
}

#[test]
fn stars_without_a_plane_have_zero_normals() {
    for scheme in [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::Sqrt3,
        Refinement::DooSabin,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
        Refinement::MidEdge,
    ] {
        let mut line = bipyramid(5);
        for (v, p) in line.positions_mut().iter_mut().enumerate() {
            *p = DVec3::new(0.3, -0.2, 0.7) * (v as f64 - 2.2) + DVec3::ONE;
        }
        let mut point = bipyramid(4);
        point.positions_mut().fill(DVec3::new(0.1, 0.2, 0.3));
        for surface in [line, point] {
            assert!(normals(scheme, &surface).iter().all(|n| *n == DVec3::ZERO), "{scheme}");
        }
    }
}
