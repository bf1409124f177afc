//! What is computed by index arithmetic and in parallel, held against what is found by search and in one thread.

use glam::DVec3;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces, union};
use limitlab::mesh::order::Order;
use limitlab::mesh::{Mesh, Surface, Topology, builtin};
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::schemes::{Refinement, catmull_clark, loop_scheme, sqrt3, unified_sqrt3};

use super::meshes::*;

/// Meshes for a scheme: irregular, in several components, of any polygons where the scheme takes them, in no order.
fn meshes_for(scheme: Refinement) -> Vec<Surface> {
    let any_polygons = matches!(scheme, Refinement::CatmullClark | Refinement::DooSabin);
    let mut surfaces = if any_polygons { polygon_meshes() } else { triangle_meshes() };
    let parts: Vec<Mesh> = surfaces.iter().map(|s| s.mesh().clone()).collect();
    let mut large = vec![union(&parts)];
    if any_polygons {
        large.extend([builtin::irregular_poly(6000, 3), builtin::irregular_quad(9000, 4)]);
    } else {
        large.push(builtin::irregular_tri(9000, 5));
    }
    for mesh in large {
        let surface = Surface::new(mesh).unwrap();
        let order = Order::Random(8).order(surface.mesh(), surface.incidence());
        let shuffled = shuffle_faces(&permute_vertices(surface.mesh(), &order), 8);
        surfaces.extend([surface, Surface::new(shuffled).unwrap()]);
    }
    surfaces
}

#[test]
fn the_refined_topology_is_the_one_found_anew() {
    let hold = |fine: &Surface, what: &str| {
        assert!(*fine.topology() == Topology::new(fine.faces(), fine.len()), "{what}");
        assert!(fine.is_closed(), "{what}");
    };
    for scheme in Refinement::ALL {
        for surface in meshes_for(scheme) {
            let fine = scheme.refined(&surface).unwrap();
            hold(&fine, &format!("{scheme}, {} vertices", surface.len()));
            if surface.len() < 1000 {
                hold(&scheme.refined(&fine).unwrap(), &format!("{scheme}, twice"));
            }
        }
    }
    // The faces of a step do not depend on the rule.
    for surface in meshes_for(Refinement::DooSabin) {
        let [ours, others] =
            [CornerRule::DooSabin, CornerRule::ZhengCai].map(|rule| doo_sabin::refine_by(rule, &surface).unwrap());
        assert!(ours.faces == others.faces);
    }
    for surface in meshes_for(Refinement::Sqrt3) {
        let (fine, _) = unified_sqrt3::refined(&surface, &vec![0.7; surface.len()]).unwrap();
        hold(&fine, "unified");
    }
}

/// The sides of a face as (corner, vertex, next vertex).
fn sides(surface: &Surface, f: usize) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    let face = surface.faces().face(f);
    surface.faces().range(f).enumerate().map(move |(i, c)| {
        let next = face[(i + 1) % face.len()];
        (c, face[i] as usize, next as usize)
    })
}

fn center(surface: &Surface, f: usize) -> DVec3 {
    let face = surface.faces().face(f);
    let sum: DVec3 = face.iter().map(|&v| surface.positions()[v as usize]).sum();
    sum / face.len() as f64
}

/// The edge of every half-edge, numbered by first sides.
fn edges(surface: &Surface) -> Vec<usize> {
    let mut edge = vec![0; surface.faces().corners().len()];
    for (e, c) in surface.topology().edge_sides().enumerate() {
        edge[c as usize] = e;
        edge[surface.topology().twin(c).unwrap() as usize] = e;
    }
    edge
}

/// Points summed face by face, as the definitions read: the same terms in the same order, so equal to the last bit.
#[test]
fn points_equal_those_scattered_face_by_face() {
    for surface in meshes_for(Refinement::CatmullClark) {
        let edge = edges(&surface);
        let old = surface.positions();
        let mut vertex_points = vec![DVec3::ZERO; surface.len()];
        let mut edge_points = vec![DVec3::ZERO; surface.topology().edges()];
        let mut points = Vec::new();
        for f in 0..surface.faces().len() {
            let center = center(&surface, f);
            for (c, v, w) in sides(&surface, f) {
                edge_points[edge[c]] += 0.25 * (old[v] + center);
                vertex_points[v] += old[w] + center;
            }
        }
        for (v, sum) in vertex_points.into_iter().enumerate() {
            let n = surface.incidence().face_count(v) as f64;
            points.push((n - 2.0) / n * old[v] + sum / (n * n));
        }
        points.extend(edge_points);
        points.extend((0..surface.faces().len()).map(|f| center(&surface, f)));
        let fine = catmull_clark::refine(&surface).unwrap();
        assert!(fine.positions == points);
    }
    for surface in meshes_for(Refinement::Loop) {
        let edge = edges(&surface);
        let old = surface.positions();
        let mut neighbors = vec![DVec3::ZERO; surface.len()];
        let mut edge_points = vec![DVec3::ZERO; surface.topology().edges()];
        for f in 0..surface.faces().len() {
            for (c, v, w) in sides(&surface, f) {
                neighbors[v] += old[w];
                let face = surface.faces().face(f);
                let opposite = face[(c - 3 * f + 2) % 3] as usize;
                edge_points[edge[c]] += 0.375 * old[v] + 0.125 * old[opposite];
            }
        }
        let blend = |mask: fn(usize) -> [f64; 2]| {
            let points = neighbors.iter().enumerate().map(|(v, &sum)| {
                let [a, b] = mask(surface.incidence().face_count(v));
                a * old[v] + b * sum
            });
            points.collect::<Vec<_>>()
        };
        let looped = [blend(loop_scheme::vertex_mask), edge_points].concat();
        let centers = (0..surface.faces().len()).map(|f| center(&surface, f)).collect();
        let flipped = [blend(sqrt3::vertex_mask), centers].concat();
        let fine = loop_scheme::refine(&surface).unwrap();
        assert!(fine.positions == looped);
        let fine = sqrt3::refine(&surface).unwrap();
        assert!(fine.positions == flipped);
    }
}

#[test]
fn steps_do_not_depend_on_the_number_of_threads() {
    for scheme in Refinement::ALL {
        for surface in meshes_for(scheme).iter().filter(|s| s.len() > 1000) {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                pool.build().unwrap().install(|| {
                    let coarse = Surface::new(surface.mesh().clone()).unwrap();
                    let fine = scheme.refined(&coarse).unwrap();
                    (coarse.topology().clone(), fine.topology().clone(), fine.into_mesh())
                })
            };
            let alone = run(1);
            for threads in [2, 3, 5] {
                assert!(run(threads) == alone, "{scheme}, {threads} threads");
            }
        }
    }
}
