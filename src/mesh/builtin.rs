//! Meshes by name: `cube`, `torus:16x12`, `icosphere:5`, … All are closed, oriented outwards and connected
//! unless told; vertex counts are exact.

use std::f64::consts::TAU;
use std::str::FromStr;

use glam::DVec3;

use super::generate::{
    dual, flip_edges, merge_faces, midpoint_split, quad_split, ring_sphere, union,
};
use super::topology::{Topology, next_in};
use super::{Faces, Mesh};
use crate::{Error, Result};

/// The largest built-in mesh in corners: its topology, matrix and history then fit 4 GiB.
const MAX_CORNERS: u64 = 1 << 26;

/// How to write each name, and what it is.
pub const NAMES: [(&str, &str); 17] = [
    ("cube", "8 vertices, 6 quads"),
    ("tetrahedron", "4 vertices"),
    ("octahedron", "6 vertices"),
    ("icosahedron", "12 vertices"),
    ("dodecahedron", "20 vertices, 12 pentagons"),
    (
        "truncated-octahedron",
        "24 vertices of valence 3, 6 quads and 8 hexagons",
    ),
    (
        "prism:K",
        "2K vertices of valence 3, K quads and two K-gons",
    ),
    (
        "bipyramid:K",
        "K+2 vertices, 2K triangles: two apexes of valence K, the others of valence 4",
    ),
    (
        "star:K",
        "16K+2 vertices, triangles: two of valence K, K of valence 4, the others regular",
    ),
    (
        "torus:NxM",
        "NM vertices, quads, all of valence 4: N around the axis, M around the tube",
    ),
    ("tri-torus:NxM", "NM vertices, triangles, all of valence 6"),
    (
        "icosphere:K",
        "icosahedron after K midpoint splits, on the unit sphere: 10*4^K+2 vertices",
    ),
    (
        "quad-sphere:K",
        "cube after K quad splits, on the unit sphere: 6*4^K+2 vertices",
    ),
    ("cubes:K", "K separate cubes"),
    (
        "irregular-tri:N[:SEED]",
        "N vertices, a sphere of triangles with edges flipped at random",
    ),
    (
        "irregular-quad:N[:SEED]",
        "N (even) vertices, a sphere of quads with valences from 3",
    ),
    (
        "irregular-poly:N[:SEED]",
        "N vertices, a sphere of triangles to octagons",
    ),
];

/// The names in one line, for messages and help texts.
pub fn names() -> String {
    NAMES.map(|(name, _)| name).join(", ")
}

/// The built-in mesh called `name`, as listed in [`NAMES`].
///
/// # Errors
/// [`Error::Unknown`] for any other name, and for parameters out of their range.
///
/// ```
/// let mesh = limitlab::mesh::builtin::builtin("torus:8x5")?;
/// assert_eq!((mesh.len(), mesh.faces.len()), (40, 40));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn builtin(name: &str) -> Result<Mesh> {
    let (kind, parameters) = match name.split_once(':') {
        Some((kind, parameters)) => (kind, Some(parameters)),
        None => (name, None),
    };
    let Some(&(pattern, _)) = NAMES
        .iter()
        .find(|(pattern, _)| pattern.split(':').next() == Some(kind))
    else {
        return Err(Error::Unknown(format!(
            "no file and no built-in mesh is called `{name}`; built-in are {}",
            names()
        )));
    };
    let request = Request {
        name,
        pattern,
        parameters,
    };
    match kind {
        "cube" => request.plain(cube),
        "tetrahedron" => request.plain(tetrahedron),
        "octahedron" => request.plain(octahedron),
        "icosahedron" => request.plain(icosahedron),
        "dodecahedron" => request.plain(dodecahedron),
        "truncated-octahedron" => request.plain(truncated_octahedron),
        "prism" => Ok(prism(request.number(3, MAX_CORNERS / 6)?)),
        "bipyramid" => Ok(bipyramid(request.number(3, MAX_CORNERS / 6)?)),
        "star" => Ok(star(request.number(3, MAX_CORNERS / 96)?)),
        "torus" => request.grid(4).map(|(n, m)| torus(n, m)),
        "tri-torus" => request.grid(6).map(|(n, m)| tri_torus(n, m)),
        "icosphere" => Ok(icosphere(request.number(0, levels(60))?)),
        "quad-sphere" => Ok(quad_sphere(request.number(0, levels(24))?)),
        "cubes" => Ok(cubes(request.number(1, MAX_CORNERS / 24)?)),
        "irregular-tri" => request
            .number_and_seed(5, MAX_CORNERS / 6)
            .map(|(n, seed)| irregular_tri(n, seed)),
        "irregular-quad" => {
            let (n, seed) = request.number_and_seed(26, MAX_CORNERS / 4)?;
            if n % 2 == 1 {
                return Err(request.refuse("N must be even"));
            }
            Ok(irregular_quad(n, seed))
        }
        "irregular-poly" => request
            .number_and_seed(5, MAX_CORNERS / 6)
            .map(|(n, seed)| irregular_poly(n, seed)),
        _ => unreachable!("every name listed has its arm"),
    }
}

/// How often a mesh of that many corners can be split in four.
fn levels(corners: u64) -> u64 {
    u64::from((MAX_CORNERS / corners).ilog(4))
}

/// A built-in mesh as it was asked for.
struct Request<'a> {
    name: &'a str,
    pattern: &'a str,
    parameters: Option<&'a str>,
}

impl Request<'_> {
    fn refuse(&self, why: &str) -> Error {
        Error::Unknown(format!(
            "built-in mesh `{}`: {why}; write {}",
            self.name, self.pattern
        ))
    }

    fn plain(&self, make: fn() -> Mesh) -> Result<Mesh> {
        match self.parameters {
            None => Ok(make()),
            Some(_) => Err(self.refuse("it takes no parameter")),
        }
    }

    fn in_range(&self, text: &str, symbol: &str, min: u64, max: u64) -> Result<usize> {
        match u64::from_str(text) {
            Ok(n) if (min..=max).contains(&n) => Ok(n as usize),
            _ => Err(self.refuse(&format!(
                "{symbol} is `{text}`, but must be a whole number from {min} to {max}"
            ))),
        }
    }

    fn text(&self) -> Result<&str> {
        self.parameters
            .ok_or_else(|| self.refuse("it needs its parameter"))
    }

    fn number(&self, min: u64, max: u64) -> Result<usize> {
        self.in_range(self.text()?, "K", min, max)
    }

    fn number_and_seed(&self, min: u64, max: u64) -> Result<(usize, u64)> {
        let text = self.text()?;
        let (n, seed) = match text.split_once(':') {
            Some((n, seed)) => (n, Some(seed)),
            None => (text, None),
        };
        let n = self.in_range(n, "N", min, max)?;
        let seed = seed.map_or(Ok(1), u64::from_str).map_err(|_| {
            self.refuse("SEED must be a whole number from 0 to 18446744073709551615")
        })?;
        Ok((n, seed))
    }

    /// N and M of a grid with so many corners a vertex.
    fn grid(&self, corners: u64) -> Result<(usize, usize)> {
        let (n, m) = self
            .text()?
            .split_once('x')
            .ok_or_else(|| self.refuse("it needs two parameters"))?;
        let max = MAX_CORNERS / corners;
        let n = self.in_range(n, "N", 3, max / 3)?;
        let m = self.in_range(m, "M", 3, max / 3)?;
        if n as u64 * m as u64 > max {
            return Err(self.refuse(&format!("N times M must not exceed {max}")));
        }
        Ok((n, m))
    }
}

fn mesh<const F: usize, const K: usize>(positions: &[[f64; 3]], faces: [[u32; K]; F]) -> Mesh {
    Mesh::new(
        positions.iter().map(|&p| DVec3::from_array(p)).collect(),
        Faces::from_lists(faces),
    )
}

/// The cube [−1, 1]³, vertex k at the signs of the bits of k.
pub fn cube() -> Mesh {
    let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    let positions: Vec<[f64; 3]> = (0..8)
        .map(|k| [sign(k & 1), sign(k & 2), sign(k & 4)])
        .collect();
    mesh(
        &positions,
        [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ],
    )
}

/// Four alternate corners of the cube [−1, 1]³.
pub fn tetrahedron() -> Mesh {
    mesh(
        &[
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ],
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )
}

/// The six unit vectors along the axes: vertices 2k and 2k + 1 on axis k.
pub fn octahedron() -> Mesh {
    mesh(
        &[
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ],
        [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    )
}

/// The icosahedron with vertices on the unit sphere.
pub fn icosahedron() -> Mesh {
    let t = (1.0 + 5f64.sqrt()) / 2.0;
    let mut mesh = mesh(
        &[
            [-1.0, t, 0.0],
            [1.0, t, 0.0],
            [-1.0, -t, 0.0],
            [1.0, -t, 0.0],
            [0.0, -1.0, t],
            [0.0, 1.0, t],
            [0.0, -1.0, -t],
            [0.0, 1.0, -t],
            [t, 0.0, -1.0],
            [t, 0.0, 1.0],
            [-t, 0.0, -1.0],
            [-t, 0.0, 1.0],
        ],
        [
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ],
    );
    onto_sphere(&mut mesh);
    mesh
}

/// The dual of the icosahedron, on the unit sphere.
pub fn dodecahedron() -> Mesh {
    let mut mesh = dual(&icosahedron());
    onto_sphere(&mut mesh);
    mesh
}

/// The permutations of (0, ±1, ±2): every edge of the octahedron 3·(±eᵢ) cut in three.
pub fn truncated_octahedron() -> Mesh {
    let octahedron = octahedron();
    let faces = &octahedron.faces;
    let topology = Topology::new(faces, octahedron.len());
    // Vertex c of the result lies on half-edge c, near its start.
    let positions = (0..faces.corners().len())
        .map(|c| {
            let range = faces.range(topology.incidence.face_of(c as u32));
            let [a, b] = [c as u32, next_in(&range, c as u32)]
                .map(|c| octahedron.positions[faces.corners()[c as usize] as usize]);
            2.0 * a + b
        })
        .collect();
    let mut cut = Faces::default();
    for f in 0..faces.len() {
        let hexagon: Vec<u32> = faces
            .range(f)
            .flat_map(|c| [Some(c as u32), topology.twin(c as u32)])
            .flatten()
            .collect();
        cut.push(&hexagon);
    }
    let mut star = Vec::new();
    for v in 0..octahedron.len() {
        topology.star(faces, v, &mut star);
        cut.push(&star);
    }
    Mesh::new(positions, cut)
}

/// `k` vertices on the unit circle at height `z`.
fn ring(k: usize, z: f64) -> impl Iterator<Item = DVec3> {
    (0..k).map(move |j| {
        let (sin, cos) = (TAU * j as f64 / k as f64).sin_cos();
        DVec3::new(cos, sin, z)
    })
}

/// Two `k`-gons, at z = −1 and z = 1, and `k` quads between them: 2k vertices of valence 3.
pub fn prism(k: usize) -> Mesh {
    let positions = ring(k, -1.0).chain(ring(k, 1.0)).collect();
    let mut faces = Faces::with_capacity(k + 2, 6 * k);
    let n = k as u32;
    for j in 0..n {
        let next = (j + 1) % n;
        faces.push(&[j, next, n + next, n + j]);
    }
    faces.push(&(0..n).rev().collect::<Vec<_>>());
    faces.push(&(n..2 * n).collect::<Vec<_>>());
    Mesh::new(positions, faces)
}

/// A `k`-gon of vertices of valence 4 in the plane z = 0, then the apexes (0, 0, 1) and (0, 0, −1) of valence k.
pub fn bipyramid(k: usize) -> Mesh {
    let positions = ring(k, 0.0).chain([DVec3::Z, DVec3::NEG_Z]).collect();
    let mut faces = Faces::with_capacity(2 * k, 6 * k);
    let n = k as u32;
    for j in 0..n {
        let next = (j + 1) % n;
        faces.push(&[j, next, n]);
        faces.push(&[next, j, n + 1]);
    }
    Mesh::new(positions, faces)
}

/// A bipyramid after two midpoint splits: the apexes, vertices k and k + 1, keep valence k, the k vertices
/// before them have valence 4, all others 6. 16k + 2 vertices on the unit sphere.
pub fn star(k: usize) -> Mesh {
    let mut mesh = midpoint_split(&midpoint_split(&bipyramid(k)));
    onto_sphere(&mut mesh);
    mesh
}

/// The torus of radii 2 and 1 about the z axis: vertex i·m + j at the i-th of `n` angles around the axis and the
/// j-th of `m` around the tube.
fn torus_positions(n: usize, m: usize) -> Vec<DVec3> {
    let mut positions = Vec::with_capacity(n * m);
    for around in ring(n, 0.0) {
        for tube in ring(m, 0.0) {
            positions.push(around * (2.0 + tube.x) + DVec3::Z * tube.y);
        }
    }
    positions
}

/// The corners (i, j), (i+1, j), (i+1, j+1), (i, j+1) of all cells of a torus grid.
fn torus_cells(n: usize, m: usize) -> impl Iterator<Item = [u32; 4]> {
    let at = move |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    (0..n).flat_map(move |i| {
        (0..m).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
    })
}

/// A regular grid of n × m quads on a torus, n and m at least 3.
pub fn torus(n: usize, m: usize) -> Mesh {
    let mut faces = Faces::with_capacity(n * m, 4 * n * m);
    torus_cells(n, m).for_each(|cell| faces.push(&cell));
    Mesh::new(torus_positions(n, m), faces)
}

/// The same grid with the diagonal from (i, j) to (i + 1, j + 1) in every cell.
pub fn tri_torus(n: usize, m: usize) -> Mesh {
    let mut faces = Faces::with_capacity(2 * n * m, 6 * n * m);
    for [a, b, c, d] in torus_cells(n, m) {
        faces.push(&[a, b, c]);
        faces.push(&[a, c, d]);
    }
    Mesh::new(torus_positions(n, m), faces)
}

/// The icosahedron after `k` midpoint splits, each pushed onto the unit sphere: 10·4ᵏ + 2 vertices.
pub fn icosphere(k: usize) -> Mesh {
    (0..k).fold(icosahedron(), |mesh, _| {
        let mut mesh = midpoint_split(&mesh);
        onto_sphere(&mut mesh);
        mesh
    })
}

/// The cube after `k` quad splits, then pushed onto the unit sphere: 6·4ᵏ + 2 vertices.
pub fn quad_sphere(k: usize) -> Mesh {
    let mut mesh = (0..k).fold(cube(), |mesh, _| quad_split(&mesh));
    onto_sphere(&mut mesh);
    mesh
}

fn onto_sphere(mesh: &mut Mesh) {
    for p in &mut mesh.positions {
        *p = p.normalize();
    }
}

/// `k` separate cubes in a row along x.
pub fn cubes(k: usize) -> Mesh {
    let cube = cube();
    let moved = |j: usize| {
        let shift = DVec3::X * (3 * j) as f64;
        let positions = cube.positions.iter().map(|&p| p + shift).collect();
        Mesh::new(positions, cube.faces.clone())
    };
    union(&(0..k).map(moved).collect::<Vec<_>>())
}

/// A [`ring_sphere`] of `n` ≥ 5 vertices with three attempts a vertex to [flip an edge](flip_edges): as many as
/// there are edges.
pub fn irregular_tri(n: usize, seed: u64) -> Mesh {
    let mut mesh = ring_sphere(n);
    flip_edges(&mut mesh, 3 * n, seed);
    mesh
}

/// An [`irregular_tri`] of `n` ≥ 5 vertices with two fifths of its edges removed where that is possible, up to
/// faces of eight corners.
pub fn irregular_poly(n: usize, seed: u64) -> Mesh {
    let removals = 2 * (3 * n - 6) / 5;
    merge_faces(&irregular_tri(n, seed), removals, 8, seed)
}

/// The [`quad_split`] of an irregular polygon mesh with such a number of edges that there are exactly `n`
/// vertices, n even and at least 26.
pub fn irregular_quad(n: usize, seed: u64) -> Mesh {
    // V + E + F = 2E + 2 on a sphere. A fifth of the triangles' edges is removed, or a few more.
    let edges = (n - 2) / 2;
    let vertices = (edges * 5 / 4 + 6) / 3;
    let removals = 3 * vertices - 6 - edges;
    quad_split(&merge_faces(
        &irregular_tri(vertices, seed),
        removals,
        8,
        seed,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::validate::{Boundary, validate};

    /// Six times the signed volume: positive if the faces are counter-clockwise seen from outside.
    fn volume(mesh: &Mesh) -> f64 {
        let p = |v: u32| mesh.positions[v as usize];
        mesh.faces
            .iter()
            .map(|f| {
                let fan = f[1..].windows(2).map(|w| p(w[0]).cross(p(w[1])));
                p(f[0]).dot(fan.sum())
            })
            .sum()
    }

    #[test]
    fn every_mesh_is_valid_and_outward_with_the_promised_counts() {
        // Vertices, faces, V − E + F, least and greatest valence.
        for (name, v, f, euler, min, max) in [
            ("cube", 8, 6, 2, 3, 3),
            ("tetrahedron", 4, 4, 2, 3, 3),
            ("octahedron", 6, 8, 2, 4, 4),
            ("icosahedron", 12, 20, 2, 5, 5),
            ("dodecahedron", 20, 12, 2, 3, 3),
            ("truncated-octahedron", 24, 14, 2, 3, 3),
            ("prism:3", 6, 5, 2, 3, 3),
            ("prism:1000", 2000, 1002, 2, 3, 3),
            ("bipyramid:3", 5, 6, 2, 3, 4),
            ("bipyramid:9", 11, 18, 2, 4, 9),
            ("star:3", 50, 96, 2, 3, 6),
            ("star:17", 274, 544, 2, 4, 17),
            ("torus:3x3", 9, 9, 0, 4, 4),
            ("torus:7x4", 28, 28, 0, 4, 4),
            ("tri-torus:3x3", 9, 18, 0, 6, 6),
            ("tri-torus:5x8", 40, 80, 0, 6, 6),
            ("icosphere:0", 12, 20, 2, 5, 5),
            ("icosphere:3", 642, 1280, 2, 5, 6),
            ("quad-sphere:0", 8, 6, 2, 3, 3),
            ("quad-sphere:4", 1538, 1536, 2, 3, 4),
            ("cubes:5", 40, 30, 10, 3, 3),
        ] {
            let mesh = builtin(name).unwrap();
            let report = validate(&mesh, None, Boundary::Refuse);
            assert!(report.is_valid(), "{name}: {}", report.summary_line());
            assert!(report.remarks.is_empty(), "{name}: {:?}", report.remarks);
            let c = report.counts.unwrap();
            let found = (
                c.vertices,
                c.faces,
                c.euler_characteristic,
                c.min_valence,
                c.max_valence,
            );
            assert_eq!(found, (v, f, euler, min, max), "{name}");
            assert_eq!(
                c.components,
                if name == "cubes:5" { 5 } else { 1 },
                "{name}"
            );
            assert!(volume(&mesh) > 0.0, "{name}");
        }
    }

    #[test]
    fn volumes_are_the_known_ones() {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        // Circumradius 1: the edge of the icosahedron is 1/sin 72°, of the dodecahedron 2/(√3 φ).
        let icosahedron_edge = 1.0 / (TAU / 5.0).sin();
        let dodecahedron_edge = 2.0 / (3f64.sqrt() * golden);
        for (name, expected) in [
            ("cube", 8.0),
            ("tetrahedron", 8.0 / 3.0),
            ("octahedron", 4.0 / 3.0),
            (
                "icosahedron",
                5.0 / 12.0 * (3.0 + 5f64.sqrt()) * icosahedron_edge.powi(3),
            ),
            (
                "dodecahedron",
                (15.0 + 7.0 * 5f64.sqrt()) / 4.0 * dodecahedron_edge.powi(3),
            ),
            // Edge √2.
            (
                "truncated-octahedron",
                8.0 * 2f64.sqrt() * 2f64.sqrt().powi(3),
            ),
            ("prism:4", 4.0),
            ("bipyramid:6", 3f64.sqrt()),
            ("cubes:3", 24.0),
        ] {
            let found = volume(&builtin(name).unwrap()) / 6.0;
            assert!(
                (found - expected).abs() < 1e-14 * expected,
                "{name}: {found} {expected}"
            );
        }
        // Fine meshes approach the sphere, 4π/3, and the torus of radii 2 and 1, 4π², quadratically.
        for (coarse, fine, limit) in [
            ("icosphere:3", "icosphere:4", TAU * 2.0 / 3.0),
            ("quad-sphere:4", "quad-sphere:5", TAU * 2.0 / 3.0),
            ("torus:32x16", "torus:64x32", TAU * TAU),
            ("tri-torus:32x16", "tri-torus:64x32", TAU * TAU),
        ] {
            let error = |name| limit - volume(&builtin(name).unwrap()) / 6.0;
            let ratio = error(coarse) / error(fine);
            assert!((3.8..4.2).contains(&ratio), "{coarse}: {ratio}");
        }
    }

    #[test]
    fn spheres_and_stars_lie_on_the_unit_sphere() {
        for name in [
            "icosahedron",
            "dodecahedron",
            "icosphere:3",
            "quad-sphere:3",
            "star:8",
            "irregular-tri:300",
        ] {
            for p in builtin(name).unwrap().positions {
                assert!((p.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{name}");
            }
        }
    }

    #[test]
    fn grids_are_numbered_row_by_row() {
        let (n, m) = (6, 5);
        for (mesh, diagonal) in [(torus(n, m), false), (tri_torus(n, m), true)] {
            let topology = Topology::new(&mesh.faces, mesh.len());
            for c in topology.edge_sides() {
                let range = mesh.faces.range(topology.incidence.face_of(c));
                let [a, b] =
                    [c, next_in(&range, c)].map(|c| mesh.faces.corners()[c as usize] as usize);
                let step = ((b / m + n - a / m) % n, (b % m + m - a % m) % m);
                let back = ((n - step.0) % n, (m - step.1) % m);
                let allowed = [(1, 0), (0, 1), (1, 1)];
                let allowed = &allowed[..if diagonal { 3 } else { 2 }];
                assert!(
                    allowed.contains(&step) || allowed.contains(&back),
                    "{step:?}"
                );
            }
        }
    }

    #[test]
    fn a_star_has_its_valences_where_they_are_promised() {
        let k = 11;
        let mesh = star(k);
        let topology = Topology::new(&mesh.faces, mesh.len());
        for v in 0..mesh.len() {
            let expected = match v {
                v if v < k => 4,
                v if v < k + 2 => k,
                _ => 6,
            };
            assert_eq!(topology.edge_valence(&mesh.faces, v), expected);
        }
    }

    #[test]
    fn irregular_meshes_have_exactly_the_vertices_asked_for() {
        for n in (5..120).chain([1000, 4321]) {
            for seed in 0..3 {
                for kind in ["tri", "poly", "quad"] {
                    if kind == "quad" && (n % 2 == 1 || n < 26) {
                        continue;
                    }
                    let name = format!("irregular-{kind}:{n}:{seed}");
                    let mesh = builtin(&name).unwrap();
                    assert_eq!(mesh.len(), n, "{name}");
                    let report = validate(&mesh, None, Boundary::Refuse);
                    assert!(report.is_valid(), "{name}: {}", report.summary_line());
                    let c = report.counts.unwrap();
                    assert_eq!((c.components, c.euler_characteristic), (1, 2), "{name}");
                    let size = mesh.faces.uniform_size();
                    match kind {
                        "tri" => assert_eq!(size, Some(3)),
                        "quad" => assert_eq!(size, Some(4)),
                        _ => assert!(mesh.faces.iter().all(|f| f.len() <= 8)),
                    }
                }
            }
        }
        // Irregular indeed, and different for every seed.
        let counts = |name: &str| {
            let report = validate(&builtin(name).unwrap(), None, Boundary::Refuse);
            report.counts.unwrap()
        };
        assert!(counts("irregular-tri:2000").max_valence > 8);
        assert_eq!(counts("irregular-tri:2000").min_valence, 3);
        assert_eq!(
            builtin("irregular-tri:200").unwrap(),
            builtin("irregular-tri:200:1").unwrap()
        );
        assert_ne!(
            builtin("irregular-tri:200").unwrap(),
            builtin("irregular-tri:200:2").unwrap()
        );
        let sizes = builtin("irregular-poly:2000").unwrap();
        for n in 3..=8 {
            assert!(sizes.faces.iter().any(|f| f.len() == n), "{n}-gons");
        }
    }

    #[test]
    fn wrong_names_and_parameters_say_what_is_right() {
        let error = |name: &str| builtin(name).unwrap_err().to_string();
        for (pattern, _) in NAMES {
            assert!(error("cbue").contains(pattern));
        }
        for (name, part) in [
            ("cube:3", "takes no parameter"),
            ("prism", "write prism:K"),
            ("prism:2", "from 3 to 11184810"),
            ("prism:x", "K is `x`"),
            ("torus:8", "write torus:NxM"),
            ("torus:2x5", "N is `2`"),
            ("torus:5x", "M is ``"),
            ("torus:5000x5000", "N times M must not exceed 16777216"),
            ("icosphere:11", "from 0 to 10"),
            ("icosphere:-1", "K is `-1`"),
            ("icosphere:99999999999999999999", "from 0 to 10"),
            ("quad-sphere:11", "from 0 to 10"),
            ("cubes:0", "from 1"),
            ("irregular-tri:4", "from 5"),
            ("irregular-quad:27", "even"),
            ("irregular-quad:24", "from 26"),
            ("irregular-tri:50:x", "SEED"),
            ("irregular-tri:50:1:2", "SEED"),
            ("", "built-in are cube,"),
        ] {
            let message = error(name);
            assert!(message.contains(part), "{name}: {message}");
            assert!(!message.contains('\n'));
        }
    }

    #[test]
    fn every_listed_name_can_be_built() {
        for (pattern, _) in NAMES {
            let name = (pattern.split('[').next().unwrap())
                .replace("NxM", "4x5")
                .replace(":N", ":30")
                .replace(":K", ":3");
            assert!(builtin(&name).is_ok(), "{name}");
        }
    }
}
