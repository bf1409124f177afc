//! What is computed by index arithmetic and in parallel, held against what is found by search and in one thread.

use glam::DVec3;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces, union};
use limitlab::mesh::order::Order;
use limitlab::mesh::{Faces, Mesh, Topology, builtin};
use limitlab::schemes::doo_sabin::{self, Rule};
use limitlab::schemes::{Refinement, catmull_clark, loop_scheme, sqrt3, unified_sqrt3};

use super::meshes::*;

/// Meshes for a scheme: irregular, in several components, of any polygons where the scheme takes them, in no order,
/// and the odd ones whose refinements have several edges between two vertices.
fn meshes_for(scheme: Refinement) -> Vec<Mesh> {
    let any_polygons = matches!(scheme, Refinement::CatmullClark | Refinement::DooSabin);
    let mut meshes = if any_polygons {
        let sphere = builtin::irregular_poly(6000, 3);
        vec![union(&polygon_meshes()), sphere, builtin::irregular_quad(9000, 4)]
    } else {
        vec![union(&triangle_meshes()), builtin::irregular_tri(9000, 5)]
    };
    let shuffled: Vec<Mesh> = meshes
        .iter()
        .map(|mesh| {
            let order = Order::Random(8).order(mesh, &topology(mesh).incidence);
            shuffle_faces(&permute_vertices(mesh, &order), 8)
        })
        .collect();
    meshes.extend(shuffled);
    if any_polygons {
        meshes.extend(polygon_meshes());
        // One face on both sides of both its edges.
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        meshes.push(Mesh::new(points, Faces::from_lists([[0, 1, 2, 1]])));
    } else {
        meshes.extend(triangle_meshes());
    }
    // Two triangles on the same vertices, for which the interpolatory schemes have no rule.
    if !matches!(scheme, Refinement::Butterfly | Refinement::LabsikGreiner) {
        let pillow = Faces::from_lists([[0, 1, 2], [0, 2, 1]]);
        meshes.push(Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], pillow));
    }
    meshes
}

#[test]
fn the_refined_topology_is_the_one_found_anew() {
    let mut odd = 0;
    for scheme in Refinement::ALL {
        for mesh in meshes_for(scheme) {
            let coarse = topology(&mesh);
            let fine = scheme.refine(&mesh, &coarse).unwrap();
            let found = scheme.refined_topology(&mesh, &coarse, &fine);
            assert!(found == topology(&fine), "{scheme}, {} vertices", mesh.len());
            odd += usize::from(!found.is_closed());
            if found.is_closed() && mesh.len() < 1000 {
                let finer = scheme.refine(&fine, &found).unwrap();
                let finer_topology = scheme.refined_topology(&fine, &found, &finer);
                assert!(finer_topology == topology(&finer), "{scheme}, twice");
            }
        }
    }
    assert!(odd >= 4, "{odd}");
    for mesh in meshes_for(Refinement::DooSabin) {
        let coarse = topology(&mesh);
        let fine = doo_sabin::refine_by(Rule::ZhengCai, &mesh, &coarse).unwrap();
        assert!(doo_sabin::refined_topology(&mesh, &coarse, &fine) == topology(&fine));
    }
    for mesh in meshes_for(Refinement::Sqrt3) {
        let coarse = topology(&mesh);
        let (fine, _) = unified_sqrt3::refine(&mesh, &coarse, &vec![0.7; mesh.len()]).unwrap();
        assert!(sqrt3::refined_topology(&mesh, &coarse, &fine) == topology(&fine));
    }
}

/// The sides of a face as (corner, vertex, next vertex).
fn sides(mesh: &Mesh, f: usize) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    let face = mesh.faces.face(f);
    mesh.faces.range(f).enumerate().map(move |(i, c)| {
        let next = face[(i + 1) % face.len()];
        (c, face[i] as usize, next as usize)
    })
}

fn center(mesh: &Mesh, f: usize) -> DVec3 {
    let face = mesh.faces.face(f);
    let sum: DVec3 = face.iter().map(|&v| mesh.positions[v as usize]).sum();
    sum / face.len() as f64
}

/// The edge of every half-edge, numbered by first sides.
fn edges(mesh: &Mesh, topology: &Topology) -> Vec<usize> {
    let mut edge = vec![0; mesh.faces.corners().len()];
    for (e, c) in topology.edge_sides().enumerate() {
        edge[c as usize] = e;
        edge[topology.twin(c).unwrap() as usize] = e;
    }
    edge
}

/// Points summed face by face, as the definitions read: the same terms in the same order, so equal to the last bit.
#[test]
fn points_equal_those_scattered_face_by_face() {
    for mesh in meshes_for(Refinement::CatmullClark) {
        let topology = topology(&mesh);
        let edge = edges(&mesh, &topology);
        let old = &mesh.positions;
        let mut vertex_points = vec![DVec3::ZERO; mesh.len()];
        let mut edge_points = vec![DVec3::ZERO; topology.edges()];
        let mut points = Vec::new();
        for f in 0..mesh.faces.len() {
            let center = center(&mesh, f);
            for (c, v, w) in sides(&mesh, f) {
                edge_points[edge[c]] += 0.25 * (old[v] + center);
                vertex_points[v] += old[w] + center;
            }
        }
        for (v, sum) in vertex_points.into_iter().enumerate() {
            let n = topology.incidence.face_count(v) as f64;
            points.push((n - 2.0) / n * old[v] + sum / (n * n));
        }
        points.extend(edge_points);
        points.extend((0..mesh.faces.len()).map(|f| center(&mesh, f)));
        let fine = catmull_clark::refine(&mesh, &topology).unwrap();
        assert!(fine.positions == points);
    }
    for mesh in meshes_for(Refinement::Loop) {
        let topology = topology(&mesh);
        let edge = edges(&mesh, &topology);
        let old = &mesh.positions;
        let mut neighbors = vec![DVec3::ZERO; mesh.len()];
        let mut edge_points = vec![DVec3::ZERO; topology.edges()];
        for f in 0..mesh.faces.len() {
            for (c, v, w) in sides(&mesh, f) {
                neighbors[v] += old[w];
                let face = mesh.faces.face(f);
                let opposite = face[(c - 3 * f + 2) % 3] as usize;
                edge_points[edge[c]] += 0.375 * old[v] + 0.125 * old[opposite];
            }
        }
        let blend = |mask: fn(usize) -> [f64; 2]| {
            let points = neighbors.iter().enumerate().map(|(v, &sum)| {
                let [a, b] = mask(topology.incidence.face_count(v));
                a * old[v] + b * sum
            });
            points.collect::<Vec<_>>()
        };
        let looped = [blend(loop_scheme::vertex_mask), edge_points].concat();
        let centers = (0..mesh.faces.len()).map(|f| center(&mesh, f)).collect();
        let flipped = [blend(sqrt3::vertex_mask), centers].concat();
        let fine = loop_scheme::refine(&mesh, &topology).unwrap();
        assert!(fine.positions == looped);
        let fine = sqrt3::refine(&mesh, &topology).unwrap();
        assert!(fine.positions == flipped);
    }
}

#[test]
fn steps_do_not_depend_on_the_number_of_threads() {
    for scheme in Refinement::ALL {
        for mesh in meshes_for(scheme).iter().filter(|m| m.len() > 1000) {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                pool.build().unwrap().install(|| {
                    let coarse = topology(mesh);
                    let fine = scheme.refine(mesh, &coarse).unwrap();
                    let finer = scheme.refined_topology(mesh, &coarse, &fine);
                    (coarse, fine, finer)
                })
            };
            let alone = run(1);
            for threads in [2, 3, 5] {
                assert!(run(threads) == alone, "{scheme}, {threads} threads");
            }
        }
    }
}
