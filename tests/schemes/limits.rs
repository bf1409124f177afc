//! Limit masks against real refinement.

use std::f64::consts::TAU;

use glam::DVec3;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::schemes::{Refinement, catmull_clark, loop_scheme, mid_edge, sqrt3};

use super::ROUNDING;
use super::meshes::*;

type Limits = fn(&Surface) -> limitlab::Result<Vec<DVec3>>;

const PRIMAL: [(Refinement, Limits); 3] = [
    (Refinement::CatmullClark, catmull_clark::limit_positions),
    (Refinement::Loop, loop_scheme::limit_positions),
    (Refinement::Sqrt3, sqrt3::limit_positions),
];

fn meshes_for(scheme: Refinement) -> Vec<Surface> {
    if scheme == Refinement::CatmullClark { polygon_meshes() } else { triangle_meshes() }
}

#[test]
fn a_refined_mesh_has_the_same_limit_points() {
    for (scheme, limits) in PRIMAL {
        for surface in meshes_for(scheme) {
            let fine = scheme.refined_n(&surface, 2).unwrap();
            let coarse_limits = limits(&surface).unwrap();
            let fine_limits = limits(&fine).unwrap();
            let error = distance(&coarse_limits, &fine_limits[..surface.len()]);
            assert!(error < ROUNDING, "{scheme} {error:e}");
        }
    }
}

/// The two eigenvalues μ ≠ 1 with which the points of a vertex approach its limit, as (μ₁ + μ₂, μ₁μ₂): those
/// of the rotation-invariant block of the splitting matrix.
fn contraction(scheme: Refinement, n: usize) -> (f64, f64) {
    let n = n as f64;
    match scheme {
        Refinement::CatmullClark => ((3.0 * n - 7.0) / (4.0 * n), (n - 3.0) / (16.0 * n)),
        Refinement::Loop => ((0.375 + 0.25 * (TAU / n).cos()).powi(2), 0.0),
        _ => (2.0 / 3.0 - sqrt3::relaxation(n as usize), 0.0),
    }
}

/// The tracked vertices of five levels of refinement approach the mask's limit exactly as the splitting
/// matrix says: e_{k+2} = (μ₁+μ₂) e_{k+1} − μ₁μ₂ e_k with e = point − limit.
#[test]
fn refined_vertices_converge_to_the_limit_at_the_known_rate() {
    for (scheme, limits) in PRIMAL {
        for k in 3..=12 {
            let surface = match scheme {
                Refinement::CatmullClark => scattered(pyramid(k), 5),
                _ => scattered(bipyramid(k), 5),
            };
            let limits = limits(&surface).unwrap();
            let levels: Vec<Mesh> = (0..=5).map(|level| scheme.refine_n(&surface, level).unwrap()).collect();
            let incidence = surface.incidence();
            for (v, &limit) in limits.iter().enumerate() {
                let (sum, product) = contraction(scheme, incidence.face_count(v));
                let error = |level: usize| levels[level].positions[v] - limit;
                for level in 0..=3 {
                    let expected = sum * error(level + 1) - product * error(level);
                    assert!((error(level + 2) - expected).length() < ROUNDING, "{scheme} {k}");
                }
                assert!(error(0).length() > 1e-3, "the test sees a motion");
            }
        }
    }
}

#[test]
fn seven_levels_end_at_the_limit_points() {
    for (scheme, limits) in PRIMAL {
        let surface = scattered(tetrahedron(), 6);
        let fine = scheme.refine_n(&surface, 7).unwrap();
        let limits = limits(&surface).unwrap();
        let error = distance(&fine.positions[..4], &limits);
        // Valence 3: μ₁ = 1/6, 1/16, 1/9.
        let rate: f64 = match scheme {
            Refinement::CatmullClark => 1.0 / 6.0,
            Refinement::Loop => 1.0 / 16.0,
            _ => 1.0 / 9.0,
        };
        assert!(error < 4.0 * rate.powi(7) && error > 0.0, "{scheme} {error:e}");
    }
}

#[test]
fn limits_equal_their_masks_evaluated_face_by_face() {
    for surface in polygon_meshes() {
        let found = catmull_clark::limit_positions(&surface).unwrap();
        for (v, &limit) in found.iter().enumerate() {
            let star = star(&surface, v);
            let n = star.valence as f64;
            let [center, edge, face] = catmull_clark::limit_mask(star.valence);
            // Thall Eq. 14: the opposite corners of regularised faces, summed over the star.
            let opposite = 4.0 * star.centroids - n * surface.positions()[v] - 2.0 * star.neighbors;
            let expected = center * surface.positions()[v] + edge * star.neighbors + face * opposite;
            assert!((limit - expected).length() < ROUNDING);
        }
    }
    for surface in triangle_meshes() {
        let looped = loop_scheme::limit_positions(&surface).unwrap();
        let flipped = sqrt3::limit_positions(&surface).unwrap();
        for v in 0..surface.len() {
            let star = star(&surface, v);
            for (found, [a, b]) in
                [(looped[v], loop_scheme::limit_mask(star.valence)), (flipped[v], sqrt3::limit_mask(star.valence))]
            {
                let expected = a * surface.positions()[v] + b * star.neighbors;
                assert!((found - expected).length() < ROUNDING);
            }
        }
    }
}

#[test]
fn catmull_clark_limits_of_a_regular_grid_are_those_of_the_cubic_spline() {
    let (rows, columns) = (5usize, 6usize);
    let surface = scattered(torus(5, 6), 7);
    let found = catmull_clark::limit_positions(&surface).unwrap();
    let spline = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
    for i in 0..rows {
        for j in 0..columns {
            let mut expected = DVec3::ZERO;
            for (a, wa) in spline.iter().enumerate() {
                for (b, wb) in spline.iter().enumerate() {
                    let (row, column) = ((i + rows + a - 1) % rows, (j + columns + b - 1) % columns);
                    expected += wa * wb * surface.positions()[row * columns + column];
                }
            }
            assert!((found[i * columns + j] - expected).length() < ROUNDING);
        }
    }
}

fn face_centroid(surface: &Surface, f: usize) -> DVec3 {
    let face = surface.faces().face(f);
    face.iter().map(|&v| surface.positions()[v as usize]).sum::<DVec3>() / face.len() as f64
}

/// The face of vertex v after the first step is face F + E + v, then face F + E + v of all type-F faces for
/// ever: its centroid stays, and its corners come as near as the circulant's eigenvalue ½ says.
#[test]
fn doo_sabin_limits_are_the_centroids_that_stay() {
    for rule in [CornerRule::DooSabin, CornerRule::ZhengCai] {
        for surface in polygon_meshes() {
            let first = surface.faces().len() + surface.topology().edges();
            let limits = doo_sabin::limit_positions(rule, &surface).unwrap();
            let once = Surface::new(doo_sabin::refine_by(rule, &surface).unwrap()).unwrap();
            let fine = Refinement::DooSabin.refined_n(&once, 3).unwrap();
            for (v, limit) in limits.iter().enumerate() {
                let face = first + v;
                assert!((face_centroid(&once, face) - *limit).length() < ROUNDING);
                assert!((face_centroid(&fine, face) - *limit).length() < ROUNDING);
                let radius = |m: &Surface| {
                    let corners = m.faces().face(face).iter();
                    let squares = corners.map(|&c| (m.positions()[c as usize] - *limit).length_squared());
                    squares.sum::<f64>().sqrt()
                };
                assert!(radius(&fine) <= radius(&once) / 8.0 + ROUNDING);
            }
        }
    }
}

/// The face of vertex v after the first step is face F + v, then for ever: its centroid stays, and its first harmonic
/// shrinks by cos(π/n) a step.
#[test]
fn mid_edge_limits_are_the_centroids_that_stay() {
    for surface in polygon_meshes().into_iter().chain(triangle_meshes()) {
        let limits = mid_edge::limit_positions(&surface).unwrap();
        let once = Refinement::MidEdge.refined(&surface).unwrap();
        let fine = Refinement::MidEdge.refined_n(&once, 4).unwrap();
        for (v, limit) in limits.iter().enumerate() {
            let face = surface.faces().len() + v;
            assert!((face_centroid(&once, face) - *limit).length() < ROUNDING);
            assert!((face_centroid(&fine, face) - *limit).length() < ROUNDING);
            let harmonic = |m: &Surface| {
                let corners = m.faces().face(face);
                let step = TAU / corners.len() as f64;
                let parts = corners.iter().enumerate().map(|(j, &c)| {
                    let (sin, cos) = (step * j as f64).sin_cos();
                    [cos * m.positions()[c as usize], sin * m.positions()[c as usize]]
                });
                let [cos, sin] = parts.fold([DVec3::ZERO; 2], |[a, b], [c, d]| [a + c, b + d]);
                (cos.length_squared() + sin.length_squared()).sqrt()
            };
            let shrunk = (0.5 * TAU / surface.incidence().face_count(v) as f64).cos().powi(4);
            assert!((harmonic(&fine) - shrunk * harmonic(&once)).abs() < ROUNDING);
        }
    }
}

#[test]
fn doo_sabin_limits_of_triangles_do_not_depend_on_the_first_rule() {
    for surface in triangle_meshes() {
        let [nasri, zheng_cai] = [CornerRule::DooSabin, CornerRule::ZhengCai]
            .map(|rule| doo_sabin::limit_positions(rule, &surface).unwrap());
        assert!(distance(&nasri, &zheng_cai) < ROUNDING);
    }
}

/// Zheng-Cai Eq. 6, vertex by vertex: 2n I = n V + Σ_F Σ_{j∈F} V_j/|F|.
#[test]
fn zheng_cai_limits_satisfy_their_equation() {
    for surface in polygon_meshes() {
        let limits = doo_sabin::limit_positions(CornerRule::ZhengCai, &surface).unwrap();
        for (v, &limit) in limits.iter().enumerate() {
            let star = star(&surface, v);
            let n = star.valence as f64;
            let residual = 2.0 * n * limit - n * surface.positions()[v] - star.centroids;
            assert!(residual.length() < ROUNDING);
        }
    }
}

#[test]
fn the_cube_in_closed_form() {
    let mut surface = cube();
    for p in surface.positions_mut() {
        *p = DVec3::new(p.x - p.y, p.x + p.y, p.z).signum();
    }
    let limits = catmull_clark::limit_positions(&surface).unwrap();
    for (p, limit) in surface.positions().iter().zip(limits) {
        // Neighbours and centroids of a corner p sum to p each: (6 + 2 + 4)/24 = 1/2.
        assert!((limit - 0.5 * *p).length() < ROUNDING);
    }
}
