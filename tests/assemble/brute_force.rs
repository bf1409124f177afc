//! Rows of A against subdivision to the limit: limit masks on hundreds of random meshes, and plain refinement, which
//! knows no masks, on a few.

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::random::{random_polygons, random_triangulation};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::schemes::{Refinement, Scheme, catmull_clark, loop_scheme, mid_edge, sqrt3};
use rayon::prelude::*;

use crate::common::meshes::*;
use crate::common::tol;

/// The limit points of the control mesh by the masks of the room `schemes`.
fn limits(scheme: Scheme, surface: &Surface) -> Vec<DVec3> {
    match scheme {
        Scheme::CatmullClark => catmull_clark::limit_positions(surface),
        Scheme::Loop => loop_scheme::limit_positions(surface),
        Scheme::Sqrt3 => sqrt3::limit_positions(surface),
        Scheme::Nasri => doo_sabin::limit_positions(CornerRule::DooSabin, surface),
        Scheme::ZhengCai => doo_sabin::limit_positions(CornerRule::ZhengCai, surface),
        Scheme::MidEdge => mid_edge::limit_positions(surface),
    }
    .unwrap()
}

fn hold_against_masks(scheme: Scheme, surface: &Surface, what: &str) {
    let system = LimitSystem::new(surface, scheme).unwrap();
    for (v, limit) in limits(scheme, surface).into_iter().enumerate() {
        let error = (system.a.row_times(v, surface.positions()) - limit).length();
        let allowed = tol::rounding(system.a.row(v).len());
        assert!(error <= allowed, "{scheme}, {what}, vertex {v}: {error:e}");
    }
}

#[test]
fn rows_are_the_limit_masks_on_random_meshes() {
    for scheme in Scheme::ALL {
        (0..150u64).into_par_iter().for_each(|seed| {
            let large = if scheme.needs_triangles() { random_triangulation(seed) } else { random_polygons(seed) };
            for mesh in [small_mesh(scheme, seed), large] {
                let surface = Surface::new(scattered(&mesh, seed)).unwrap();
                hold_against_masks(scheme, &surface, &format!("seed {seed}"));
            }
        });
    }
}

/// Column by column: the limit points of a mesh with one control point at 1 and the others at 0.
#[test]
fn every_entry_is_the_response_to_a_unit_vector() {
    for scheme in Scheme::ALL {
        for seed in 0..12 {
            let mut surface = Surface::new(small_mesh(scheme, seed)).unwrap();
            let system = LimitSystem::new(&surface, scheme).unwrap();
            for first in (0..surface.len()).step_by(3) {
                surface.positions_mut().fill(DVec3::ZERO);
                let axes = 3.min(surface.len() - first);
                for axis in 0..axes {
                    surface.positions_mut()[first + axis][axis] = 1.0;
                }
                for (i, limit) in limits(scheme, &surface).into_iter().enumerate() {
                    for axis in 0..axes {
                        let error = (system.a.get(i, first + axis) - limit[axis]).abs();
                        assert!(error <= tol::rounding(8), "{scheme} {seed}: {error:e}");
                    }
                }
            }
        }
    }
}

/// The limit of one vertex's points over consecutive levels. The star of a vertex approaches its limit by μ_1ᵏ and, under
/// Catmull-Clark, μ_2ᵏ: the differences tell the μ, and these the limit (minimal polynomial extrapolation).
fn extrapolate(scheme: Scheme, valence: usize, x: &[DVec3]) -> DVec3 {
    // At valence 3, μ_2 = 0: gone after a step. The other schemes have no μ_2.
    let single = match (scheme, valence) {
        (Scheme::CatmullClark, 3) => Some(&x[1..]),
        (Scheme::CatmullClark, _) => None,
        _ => Some(x),
    };
    if let Some(x) = single {
        let (before, after) = (x[1] - x[0], x[2] - x[1]);
        let mu = before.dot(after) / before.length_squared();
        return x[2] + mu / (1.0 - mu) * after;
    }
    let d: Vec<DVec3> = x.windows(2).map(|w| w[1] - w[0]).collect();
    // d_{k+2} = s d_{k+1} − p d_k for all k, in the least squares sense, by the normal equations. (Of one k alone it may
    // be undetermined: among triangles all differences of a vertex are parallel.)
    let (mut a, mut b, mut c, mut f, mut g) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for w in d.windows(3) {
        a += w[1].length_squared();
        b -= w[1].dot(w[0]);
        c += w[0].length_squared();
        f += w[1].dot(w[2]);
        g -= w[0].dot(w[2]);
    }
    let determinant = a * c - b * b;
    let s = (f * c - b * g) / determinant;
    let p = (a * g - b * f) / determinant;
    let [.., before, last, next] = x else { unreachable!("at least three levels") };
    (*next - s * *last + p * *before) / (1.0 - s + p)
}

/// Extrapolation divides by the differences, of which the later ones are some 10⁻³ of the points, twice.
const EXTRAPOLATION: f64 = 1e-8;

#[test]
fn plain_refinement_ends_where_the_rows_say() {
    for (scheme, refinement, first) in [
        // Stars are made of quads from the first refinement on.
        (Scheme::CatmullClark, Refinement::CatmullClark, 1),
        (Scheme::Loop, Refinement::Loop, 0),
        (Scheme::Sqrt3, Refinement::Sqrt3, 0),
    ] {
        for seed in 0..6 {
            let surface = Surface::new(scattered(&small_mesh(scheme, seed), seed)).unwrap();
            let system = LimitSystem::new(&surface, scheme).unwrap();
            let mut level = refinement.refined_n(&surface, first).unwrap();
            let mut levels = vec![level.positions()[..surface.len()].to_vec()];
            for _ in 0..4 {
                level = refinement.refined(&level).unwrap();
                levels.push(level.positions()[..surface.len()].to_vec());
            }
            for v in 0..surface.len() {
                let path: Vec<DVec3> = levels.iter().map(|points| points[v]).collect();
                let limit = extrapolate(scheme, surface.incidence().face_count(v), &path);
                let row = system.a.row_times(v, surface.positions());
                let error = (row - limit).length();
                assert!(error < EXTRAPOLATION, "{scheme} {seed}, vertex {v}: {error:e}");
                assert!((path[4] - row).length() < (path[0] - row).length() || error == 0.0);
            }
        }
    }
}

/// Under Doo-Sabin the face of a vertex shrinks to the limit point, and its centroid stays where the first step put it.
#[test]
fn the_faces_of_vertices_shrink_to_where_the_rows_say() {
    for (scheme, rule) in [(Scheme::Nasri, CornerRule::DooSabin), (Scheme::ZhengCai, CornerRule::ZhengCai)] {
        for seed in 0..8 {
            let surface = Surface::new(scattered(&small_polygons(seed), seed)).unwrap();
            let system = LimitSystem::new(&surface, scheme).unwrap();
            let once = Surface::new(doo_sabin::refine_by(rule, &surface).unwrap()).unwrap();
            let fine = Refinement::DooSabin.refine_n(&once, 3).unwrap();
            for v in 0..surface.len() {
                let row = system.a.row_times(v, surface.positions());
                let face = surface.faces().len() + surface.topology().edges() + v;
                let corners =
                    |m: &Mesh| -> Vec<DVec3> { m.faces.face(face).iter().map(|&c| m.positions[c as usize]).collect() };
                let (before, after) = (corners(once.mesh()), corners(&fine));
                let mean = after.iter().sum::<DVec3>() / after.len() as f64;
                assert!((mean - row).length() <= tol::rounding(64), "{scheme} {seed}, vertex {v}");
                // Three halvings, in the norm in which the circulant is normal.
                let radius = |points: &[DVec3]| -> f64 {
                    points.iter().map(|p| (*p - row).length_squared()).sum::<f64>().sqrt()
                };
                assert!(radius(&after) <= radius(&before) / 8.0 + tol::rounding(64));
            }
        }
    }
}
