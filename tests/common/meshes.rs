//! Random meshes that are small enough for dense matrices, random points, special shapes.

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::generate::{
    connected_sum, dual, flip_edges, merge_faces, permute_vertices, quad_split, ring_sphere, shuffle_faces, union,
};
use limitlab::mesh::order::Order;
use limitlab::mesh::{Faces, Mesh, Surface, Topology, builtin};
use limitlab::schemes::Scheme;
use rand::{RngExt, SeedableRng};

pub fn topology(mesh: &Mesh) -> Topology {
    Topology::new(&mesh.faces, mesh.len())
}

pub fn system(mesh: &Mesh, scheme: Scheme) -> LimitSystem {
    LimitSystem::new(&Surface::new(mesh.clone()).unwrap(), scheme).unwrap()
}

pub fn built_in(name: &str) -> Mesh {
    builtin::builtin(name).unwrap()
}

/// A built-in mesh with the noise that makes its points excite every eigenvector.
pub fn noisy(name: &str) -> Mesh {
    let mut mesh = built_in(name);
    limitlab::mesh::noise::add_noise(&mut mesh, 0.1, 1);
    mesh
}

fn base(rng: &mut ChaCha8Rng) -> Mesh {
    match rng.random_range(0..6) {
        0 => builtin::tetrahedron(),
        1 => builtin::icosahedron(),
        2 => builtin::tri_torus(rng.random_range(3..6), rng.random_range(3..6)),
        3 => builtin::bipyramid(rng.random_range(3..=16)),
        _ => ring_sphere(rng.random_range(5..48)),
    }
}

/// A random closed triangulation of 4 to about 100 vertices: sphere, torus, sum or union, flipped and renumbered.
pub fn small_triangles(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 3100);
    let mut mesh = match rng.random_range(0..8) {
        0 => connected_sum(&base(&mut rng), &base(&mut rng)),
        1 => union(&[base(&mut rng), base(&mut rng)]),
        _ => base(&mut rng),
    };
    let attempts = rng.random_range(0..4) * mesh.len();
    flip_edges(&mut mesh, attempts, seed);
    renumbered(&mesh, seed)
}

/// A random closed polygon mesh of 4 to about 200 vertices: mixed polygons, a dual (all valences 3), quads, triangles.
pub fn small_polygons(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 5200);
    let triangles = small_triangles(seed);
    let mut merged = || {
        let removals = rng.random_range(0..=triangles.faces.len());
        merge_faces(&triangles, removals, rng.random_range(4..12), seed)
    };
    let mesh = match seed % 5 {
        0 | 1 => merged(),
        2 => dual(&triangles),
        3 if triangles.len() < 30 => quad_split(&merged()),
        _ => triangles,
    };
    renumbered(&mesh, seed + 1)
}

/// Whether `scheme` has a solution for any points of closed quads: the mid-edge scheme's matrix is singular on them if they
/// have no handle.
pub fn soluble_on_quads(scheme: Scheme) -> bool {
    !scheme.needs_triangles() && scheme != Scheme::MidEdge
}

/// A random mesh on which `scheme` is defined.
pub fn small_mesh(scheme: Scheme, seed: u64) -> Mesh {
    if scheme.needs_triangles() { small_triangles(seed) } else { small_polygons(seed) }
}

fn renumbered(mesh: &Mesh, seed: u64) -> Mesh {
    let order = Order::Random(seed).order(mesh, &topology(mesh).incidence);
    shuffle_faces(&permute_vertices(mesh, &order), seed)
}

pub fn random_points(count: usize, seed: u64) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 7300);
    (0..count).map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect()
}

/// The same faces at random points.
pub fn scattered(mesh: &Mesh, seed: u64) -> Mesh {
    Mesh::new(random_points(mesh.len(), seed), mesh.faces.clone())
}

/// A grid of 2 × `m` quads on a torus: (0, j) and (1, j) are joined twice, faces (0, j) and (1, j) share two edges.
/// The validator refuses it, since a file cannot tell the two edges apart.
pub fn double_torus_row(m: u32) -> Mesh {
    let at = |i: u32, j: u32| (i % 2) * m + j % m;
    let faces = (0..2).flat_map(|i| (0..m).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    Mesh::new(random_points(2 * m as usize, 1), Faces::from_lists(faces.collect::<Vec<_>>()))
}

/// Two cubes, each with an edge cut open, joined at the loose ends: a valid mesh with two octagons that share two
/// edges, all valences 3, bipartite.
pub fn spliced_cubes() -> Mesh {
    let cube = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    // Edges 0–1 and 8–9 go, edges 1–8 and 0–9 come: faces 0 and 2 of the one cube join those of the other.
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for shift in [0, 8] {
        for k in [1, 3, 4, 5] {
            faces.push(cube[k].iter().map(|v| v + shift).collect());
        }
    }
    faces.push(vec![0, 3, 2, 1, 8, 11, 10, 9]);
    faces.push(vec![1, 5, 4, 0, 9, 13, 12, 8]);
    Mesh::new(random_points(16, 2), Faces::from_lists(faces))
}

/// The largest distance between points of the same index.
pub fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distances = a.iter().zip(b).map(|(p, q)| (*p - *q).length());
    distances.fold(0.0, f64::max)
}

/// A v by the library's rows, which `tests/assemble` holds against other computations.
pub fn product(system: &LimitSystem, v: &[DVec3]) -> Vec<DVec3> {
    (0..v.len()).map(|i| system.a.row_times(i, v)).collect()
}
