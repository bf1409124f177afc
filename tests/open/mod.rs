//! Open and creased meshes: rows against refinement by hand, closed forms, all methods on the stages, the front door.

mod closed_forms;
mod methods;
mod naive;
mod refinement;
mod rows;
mod thirds;

use glam::DVec3;
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::meshes::{small_mesh, small_triangles};

/// Points without any structure.
pub fn random_points(n: usize, seed: u64) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect()
}

/// A random mesh with holes and creases without darts, its points at random, and its tags; `None` if the faces that are left
/// are no manifold.
pub fn random_creased(scheme: Scheme, seed: u64) -> Option<(Surface, Tags)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 77);
    let closed = if scheme.needs_triangles() { small_triangles(seed) } else { small_mesh(scheme, seed) };
    let holes = rng.random_range(0..4);
    let mut lists: Vec<Vec<u32>> = closed.faces.iter().map(<[u32]>::to_vec).collect();
    for _ in 0..holes.min(lists.len() - 1) {
        lists.swap_remove(rng.random_range(0..lists.len()));
    }
    // Vertices of no face go.
    let mut number = vec![u32::MAX; closed.len()];
    let mut count = 0;
    for v in lists.iter_mut().flatten() {
        let place = &mut number[*v as usize];
        if *place == u32::MAX {
            *place = count;
            count += 1;
        }
        *v = *place;
    }
    let mesh = Mesh::new(random_points(count as usize, seed), Faces::from_lists(&lists));
    let boundary = if rng.random_range(0..2) == 0 { Boundary::EdgeAndCorner } else { Boundary::EdgeOnly };
    let surface = Surface::examined(mesh, None, boundary).ok()?;
    let mut tags = Tags { boundary, ..Tags::default() };
    for _ in 0..rng.random_range(0..8) {
        let face = &lists[rng.random_range(0..lists.len())];
        let k = rng.random_range(0..face.len());
        tags.creases.push(([face[k], face[(k + 1) % face.len()]], rng.random_range(10.0..20.0)));
    }
    for _ in 0..rng.random_range(0..3) {
        tags.corners.push((rng.random_range(0..count), 10.0));
    }
    // Where an edge would end alone, a corner.
    let tagged = surface.tagged(&tags).unwrap();
    if let Some(features) = tagged.features() {
        let darts = (0..count).filter(|&v| features.rules()[v as usize] == Rule::Dart);
        tags.corners.extend(darts.map(|v| (v, 10.0)));
    }
    Some((surface.tagged(&tags).unwrap(), tags))
}

/// As [`random_creased`], with darts and semi-sharp edges and vertices beside.
pub fn random_semi_sharp(scheme: Scheme, seed: u64) -> Option<(Surface, Tags)> {
    let (surface, mut tags) = random_creased(scheme, seed)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 991);
    let some = |rng: &mut ChaCha8Rng| {
        let face = surface.faces().face(rng.random_range(0..surface.faces().len()));
        let k = rng.random_range(0..face.len());
        [face[k], face[(k + 1) % face.len()]]
    };
    for _ in 0..rng.random_range(1..9) {
        let edge = some(&mut rng);
        // Whole numbers too, where a rule changes without a blend.
        let sharpness = if rng.random_range(0..3) == 0 { 2.0 } else { rng.random_range(0.1..4.0) };
        tags.creases.push((edge, if rng.random_range(0..4) == 0 { 10.0 } else { sharpness }));
    }
    for _ in 0..rng.random_range(0..3) {
        tags.corners.push((some(&mut rng)[0], rng.random_range(0.1..3.0)));
    }
    Some((surface.tagged(&tags).unwrap(), tags))
}

/// A grid of p × q vertices, of quads or of triangles.
pub fn grid(p: usize, q: usize, triangles: bool) -> Mesh {
    let mut faces = Faces::default();
    for i in 0..p as u32 - 1 {
        for j in 0..q as u32 - 1 {
            let at = |i: u32, j: u32| i * q as u32 + j;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            match triangles {
                true => {
                    faces.push(&[a, b, c]);
                    faces.push(&[a, c, d]);
                }
                false => faces.push(&[a, b, c, d]),
            }
        }
    }
    let positions = (0..p * q).map(|k| DVec3::new((k / q) as f64, (k % q) as f64, ((k * k) % 7) as f64 * 0.1));
    Mesh::new(positions.collect(), faces)
}

pub fn open(mesh: Mesh, boundary: Boundary) -> Surface {
    Surface::examined(mesh, None, boundary).unwrap()
}
