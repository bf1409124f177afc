//! Random closed meshes from a seed, for tests and measurements: triangulations and polygon meshes of several shapes.

use rand::{Rng, RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::generate::{
    connected_sum, dual, flip_edges, merge_faces, permute_vertices, quad_split, ring_sphere, shuffle_faces, union,
};
use super::{Mesh, builtin};

/// A random closed triangulation of a few to about two thousand vertices: a sphere, a torus, a connected sum, or
/// two components, with valences from 3 to 1000, edges flipped at random, vertices and faces in random order.
pub fn random_triangulation(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut mesh = match rng.random_range(0..8) {
        0 => connected_sum(&random_base(&mut rng), &random_base(&mut rng)),
        1 => union(&[random_base(&mut rng), random_base(&mut rng)]),
        _ => random_base(&mut rng),
    };
    // None in a quarter of the cases, which keeps the largest valences.
    let attempts = rng.random_range(0..4) * mesh.len();
    flip_edges(&mut mesh, attempts, rng.next_u64());
    shuffle(&mesh, &mut rng)
}

fn random_base(rng: &mut ChaCha8Rng) -> Mesh {
    match rng.random_range(0..6) {
        0 => builtin::tetrahedron(),
        1 => builtin::bipyramid(rng.random_range(3..40)),
        2 => builtin::bipyramid(rng.random_range(3..=1000)),
        3 => builtin::tri_torus(rng.random_range(3..12), rng.random_range(3..12)),
        4 => builtin::icosphere(rng.random_range(0..3)),
        _ => ring_sphere(rng.random_range(5..400)),
    }
}

/// A random closed polygon mesh from a [`random_triangulation`]: mixed polygons, its dual, quads, or itself.
pub fn random_polygons(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let triangles = random_triangulation(rng.next_u64());
    let mut merged = || {
        let removals = rng.random_range(0..=triangles.faces.len());
        let max_size = rng.random_range(4..12);
        merge_faces(&triangles, removals, max_size, rng.next_u64())
    };
    let mesh = match seed % 5 {
        0 => merged(),
        1 => dual(&triangles),
        2 => quad_split(&triangles),
        3 => quad_split(&merged()),
        _ => triangles,
    };
    shuffle(&mesh, &mut rng)
}

fn shuffle(mesh: &Mesh, rng: &mut ChaCha8Rng) -> Mesh {
    let mut order: Vec<u32> = (0..mesh.len() as u32).collect();
    order.shuffle(rng);
    shuffle_faces(&permute_vertices(mesh, &order), rng.next_u64())
}
