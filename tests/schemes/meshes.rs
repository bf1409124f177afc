//! Small closed meshes with known shapes, irregular ones from a seed, and what the tests ask of a mesh.

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::mesh::{Faces, Mesh, Surface};
use rand::{RngExt, SeedableRng};

pub use crate::common::meshes::distance;

fn surface(points: Vec<DVec3>, faces: &[Vec<u32>]) -> Surface {
    Surface::new(Mesh::new(points, Faces::from_lists(faces))).unwrap()
}

fn on_circle(k: u32, j: u32, z: f64) -> DVec3 {
    let angle = std::f64::consts::TAU * f64::from(j) / f64::from(k);
    DVec3::new(angle.cos(), angle.sin(), z)
}

pub fn tetrahedron() -> Surface {
    pyramid(3)
}

pub fn cube() -> Surface {
    prism(4)
}

/// A k-gon below, a k-gon above, k quads; all valences 3.
pub fn prism(k: u32) -> Surface {
    let ring = |z| (0..k).map(move |j| on_circle(k, j, z));
    let mut faces = vec![(0..k).rev().collect(), (k..2 * k).collect::<Vec<u32>>()];
    faces.extend((0..k).map(|j| vec![j, (j + 1) % k, k + (j + 1) % k, k + j]));
    surface(ring(-0.7).chain(ring(0.7)).collect(), &faces)
}

/// A k-gon base, vertices 0 to k−1, and an apex k of valence k.
pub fn pyramid(k: u32) -> Surface {
    let mut points: Vec<DVec3> = (0..k).map(|j| on_circle(k, j, -0.3)).collect();
    points.push(DVec3::new(0.0, 0.0, 0.9));
    let mut faces = vec![(0..k).rev().collect::<Vec<u32>>()];
    faces.extend((0..k).map(|j| vec![j, (j + 1) % k, k]));
    surface(points, &faces)
}

/// A ring of vertices 0 to k−1 of valence 4, the top k and the bottom k+1 of valence k. k = 4: the octahedron.
pub fn bipyramid(k: u32) -> Surface {
    let mut points: Vec<DVec3> = (0..k).map(|j| on_circle(k, j, 0.0)).collect();
    points.extend([DVec3::Z, -DVec3::Z]);
    let mut faces = Vec::new();
    for j in 0..k {
        faces.push(vec![j, (j + 1) % k, k]);
        faces.push(vec![(j + 1) % k, j, k + 1]);
    }
    surface(points, &faces)
}

fn torus_points(rows: u32, columns: u32) -> Vec<DVec3> {
    let point = |i, j| {
        let (u, v) = (on_circle(rows, i, 0.0), on_circle(columns, j, 0.0));
        DVec3::new((2.0 + v.x) * u.x, (2.0 + v.x) * u.y, v.y)
    };
    (0..rows).flat_map(|i| (0..columns).map(move |j| point(i, j))).collect()
}

/// A regular grid of quads: vertex i·columns + j; face i·columns + j starts at that vertex and goes first to
/// the next row.
pub fn torus(rows: u32, columns: u32) -> Surface {
    let at = |i, j| (i % rows) * columns + j % columns;
    let quad = |i, j| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
    let faces: Vec<_> = (0..rows).flat_map(|i| (0..columns).map(move |j| quad(i, j))).collect();
    surface(torus_points(rows, columns), &faces)
}

/// A regular grid of triangles: vertex i·columns + j, faces 2v and 2v+1 for each vertex v.
pub fn tri_torus(rows: u32, columns: u32) -> Surface {
    let at = |i, j| (i % rows) * columns + j % columns;
    let mut faces = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            faces.push(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push(vec![at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    surface(torus_points(rows, columns), &faces)
}

/// A triangulated sphere with valences from 3 to above 12: triangles drawn at random from a tetrahedron's are
/// split in three.
pub fn stacked(seed: u64, vertices: u32) -> Surface {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start = tetrahedron();
    let mut points = start.positions().to_vec();
    let mut faces: Vec<Vec<u32>> = start.faces().iter().map(<[u32]>::to_vec).collect();
    for new in 4..vertices {
        let f = rng.random_range(0..faces.len());
        let [a, b, c] = [faces[f][0], faces[f][1], faces[f][2]];
        let sum = points[a as usize] + points[b as usize] + points[c as usize];
        points.push(sum * rng.random_range(0.35..0.5));
        faces[f] = vec![a, b, new];
        faces.push(vec![b, c, new]);
        faces.push(vec![c, a, new]);
    }
    surface(points, &faces)
}

/// A sphere of triangles, quads, pentagons and larger faces: [`stacked`] with random edges taken out, never
/// below valence 3 nor so that two faces share two edges.
pub fn polygons(seed: u64, vertices: u32) -> Surface {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000);
    let start = stacked(seed, vertices);
    let mut valence = vec![0; start.len()];
    for &v in start.faces().corners() {
        valence[v as usize] += 1;
    }
    let mut faces: Vec<Vec<u32>> = start.faces().iter().map(<[u32]>::to_vec).collect();
    for _ in 0..2 * vertices {
        let f = rng.random_range(0..faces.len());
        let mut left = faces[f].clone();
        let turn = rng.random_range(0..left.len());
        left.rotate_left(turn);
        // left runs from w round to v; the face across runs from v on to w.
        let (w, v) = (left[0], left[left.len() - 1]);
        let across = faces.iter().position(|g| (0..g.len()).any(|i| g[i] == w && g[(i + 1) % g.len()] == v));
        let Some(g) = across else { continue };
        let mut right = faces[g].clone();
        let first = right.iter().position(|&x| x == v).unwrap();
        right.rotate_left(first);
        let shared = left.iter().filter(|x| right.contains(x)).count();
        if g == f || shared != 2 || valence[v as usize] == 3 || valence[w as usize] == 3 {
            continue;
        }
        valence[v as usize] -= 1;
        valence[w as usize] -= 1;
        left.extend(&right[1..right.len() - 1]);
        faces[f] = left;
        faces.swap_remove(g);
    }
    surface(start.positions().to_vec(), &faces)
}

/// The same faces with random points: identities of masks must hold for any points.
pub fn scattered(mut surface: Surface, seed: u64) -> Surface {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 2000);
    for p in surface.positions_mut() {
        *p = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    }
    surface
}

/// Meshes of triangles with valences 3 to 12 and more, at random points.
pub fn triangle_meshes() -> Vec<Surface> {
    let mut surfaces: Vec<Surface> = (3..=12).map(bipyramid).collect();
    surfaces.push(tetrahedron());
    surfaces.push(tri_torus(4, 5));
    surfaces.extend((7..10).map(|seed| stacked(seed, 40)));
    surfaces.into_iter().zip(11..).map(|(surface, seed)| scattered(surface, seed)).collect()
}

/// [`triangle_meshes`] and meshes with faces of 3 to 12 corners, at random points.
pub fn polygon_meshes() -> Vec<Surface> {
    let mut surfaces: Vec<Surface> = (3..=12).flat_map(|k| [prism(k), pyramid(k)]).collect();
    surfaces.push(torus(4, 5));
    surfaces.extend((17..20).map(|seed| polygons(seed, 40)));
    let scattered = surfaces.into_iter().zip(51..).map(|(surface, seed)| scattered(surface, seed));
    scattered.chain(triangle_meshes()).collect()
}

/// Neighbours and face centroids of a vertex, found by looking at every side: no topology involved.
pub struct Star {
    pub valence: usize,
    pub neighbors: DVec3,
    pub centroids: DVec3,
}

pub fn star(surface: &Surface, v: usize) -> Star {
    let mut star = Star { valence: 0, neighbors: DVec3::ZERO, centroids: DVec3::ZERO };
    for face in surface.faces().iter() {
        if let Some(i) = face.iter().position(|&x| x as usize == v) {
            let points: Vec<DVec3> = face.iter().map(|&x| surface.positions()[x as usize]).collect();
            star.valence += 1;
            star.neighbors += points[(i + 1) % points.len()];
            star.centroids += points.iter().sum::<DVec3>() / points.len() as f64;
        }
    }
    star
}

/// That the mesh is closed, each vertex has one umbrella, and V − E + F is `euler`.
pub fn assert_manifold(surface: &Surface, euler: i64) {
    let topology = surface.topology();
    assert!(topology.is_closed());
    assert_eq!(topology.euler_characteristic(surface.faces()), euler);
    let mut star = Vec::new();
    for v in 0..surface.len() {
        assert!(topology.star(surface.faces(), v, &mut star));
        assert_eq!(star.len(), topology.incidence.face_count(v));
    }
}
