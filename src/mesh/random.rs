//! Random meshes from a seed, for tests and measurements: closed triangulations and polygon meshes of several shapes,
//! and what becomes of a closed mesh by holes, creases, corners, darts and semi-sharp edges.

use chacha20::ChaCha8Rng;
use glam::DVec3;
use rand::{Rng, RngExt, SeedableRng, seq::SliceRandom};

use super::boundary::Boundary;
use super::features::{Rule, SHARP, Tags};
use super::generate::{
    connected_sum, dual, flip_edges, merge_faces, permute_vertices, quad_split, ring_sphere, shuffle_faces, union,
};
use super::{Faces, Mesh, Surface, builtin};

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

/// Points without any structure, coordinates between −1 and 1.
pub fn random_points(count: usize, seed: u64) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect()
}

/// A closed mesh with at most three holes, at most seven creased edges and two sharp vertices, without darts, at random
/// points; and its tags. `None` if the faces that are left are no manifold.
pub fn random_creased(closed: &Mesh, seed: u64) -> Option<(Surface, Tags)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 77);
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
        tags.creases.push((random_edge(surface.faces(), &mut rng), rng.random_range(SHARP..2.0 * SHARP)));
    }
    for _ in 0..rng.random_range(0..3) {
        tags.corners.push((rng.random_range(0..count), SHARP));
    }
    // Where an edge would end alone, a corner.
    let tagged = surface.tagged(&tags).ok()?;
    if let Some(features) = tagged.features() {
        let darts = (0..count).filter(|&v| features.rules()[v as usize] == Rule::Dart);
        tags.corners.extend(darts.map(|v| (v, SHARP)));
    }
    Some((surface.into_tagged(&tags).ok()?, tags))
}

/// As [`random_creased`], with darts and semi-sharp edges and vertices beside.
pub fn random_semi_sharp(closed: &Mesh, seed: u64) -> Option<(Surface, Tags)> {
    let (surface, mut tags) = random_creased(closed, seed)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 991);
    for _ in 0..rng.random_range(1..9) {
        let edge = random_edge(surface.faces(), &mut rng);
        // Whole numbers too, where a rule changes without a blend.
        let sharpness = if rng.random_range(0..3) == 0 { 2.0 } else { rng.random_range(0.1..4.0) };
        tags.creases.push((edge, if rng.random_range(0..4) == 0 { SHARP } else { sharpness }));
    }
    for _ in 0..rng.random_range(0..3) {
        tags.corners.push((random_edge(surface.faces(), &mut rng)[0], rng.random_range(0.1..3.0)));
    }
    Some((surface.into_tagged(&tags).ok()?, tags))
}

/// The ends of a side of a face.
pub fn random_edge(faces: &Faces, rng: &mut impl Rng) -> [u32; 2] {
    let face = faces.face(rng.random_range(0..faces.len()));
    let k = rng.random_range(0..face.len());
    [face[k], face[(k + 1) % face.len()]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creased_meshes_have_no_darts_and_semi_sharp_ones_have() {
        let (mut darts, mut semi_sharp) = (0, 0);
        for seed in 0..200 {
            let closed = random_polygons(seed);
            let Some((creased, tags)) = random_creased(&closed, seed) else { continue };
            assert_eq!(creased.features().map_or(0, |f| f.count(Rule::Dart)), 0, "seed {seed}");
            // The surface is the one that the tags make of its mesh.
            let again = Surface::examined(creased.mesh().clone(), None, tags.boundary).unwrap().tagged(&tags).unwrap();
            assert_eq!(again.features(), creased.features(), "seed {seed}");
            let (more, _) = random_semi_sharp(&closed, seed).unwrap();
            assert_eq!(more.mesh(), creased.mesh(), "seed {seed}");
            darts += more.features().map_or(0, |f| f.count(Rule::Dart));
            semi_sharp += more.features().map_or(0, |f| f.semi_sharp_edges().len());
        }
        assert!(darts > 100 && semi_sharp > 100, "{darts}, {semi_sharp}");
    }
}
