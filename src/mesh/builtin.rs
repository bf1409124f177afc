//! Meshes by name: `cube`, `torus:16x12`, `icosphere:5`, … All are closed, oriented outwards and connected
//! unless told; vertex counts are exact.

use std::f64::consts::TAU;
use std::str::FromStr;

use glam::DVec3;

use super::generate::{dual, flip_edges, merge_faces, midpoint_split, quad_split, ring_sphere, union};
use super::incidence::next_in;
use super::topology::Topology;
use super::{Faces, Mesh};
use crate::memory::require;
use crate::names::{perhaps, same};
use crate::{Error, Result};

/// The largest built-in mesh in corners: 11 million vertices with triangles, 16 million with quads.
const MAX_CORNERS: u64 = 1 << 26;

/// Memory for each corner of a mesh while it is generated, at most; measured.
const BYTES: u64 = 48;

/// How to write each name, and what it is.
pub const NAMES: [(&str, &str); 17] = [
    ("cube", "8 vertices, 6 quads"),
    ("tetrahedron", "4 vertices"),
    ("octahedron", "6 vertices"),
    ("icosahedron", "12 vertices"),
    ("dodecahedron", "20 vertices, 12 pentagons"),
    ("truncated-octahedron", "24 vertices of valence 3, 6 quads and 8 hexagons"),
    ("prism:K", "2K vertices of valence 3, K quads and two K-gons"),
    ("bipyramid:K", "K+2 vertices, 2K triangles: two apexes of valence K, the others of valence 4"),
    ("star:K", "16K+2 vertices, triangles: two of valence K, K of valence 4, the others regular"),
    ("torus:NxM", "NM vertices, quads, all of valence 4: N around the axis, M around the tube"),
    ("tri-torus:NxM", "NM vertices, triangles, all of valence 6"),
    ("icosphere:K", "icosahedron after K midpoint splits, on the unit sphere: 10*4^K+2 vertices"),
    ("quad-sphere:K", "cube after K quad splits, on the unit sphere: 6*4^K+2 vertices"),
    ("cubes:K", "K separate cubes"),
    ("irregular-tri:N[:SEED]", "N vertices, a sphere of triangles with edges flipped at random"),
    ("irregular-quad:N[:SEED]", "N (even) vertices, a sphere of quads with valences from 3"),
    ("irregular-poly:N[:SEED]", "N vertices, a sphere of triangles to octagons"),
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
    let stems = || NAMES.iter().map(|(pattern, _)| pattern.split(':').next().unwrap_or(pattern));
    let Some((kind, &(pattern, _))) = stems().zip(&NAMES).find(|(stem, _)| same(stem, kind)) else {
        return Err(Error::Unknown(format!(
            "no file and no built-in mesh is called `{name}`{}; built-in are {}",
            perhaps(kind, stems()),
            names()
        )));
    };
    let request = Request { name, pattern, parameters };
    match kind {
        "cube" => request.plain(cube),
        "tetrahedron" => request.plain(tetrahedron),
        "octahedron" => request.plain(octahedron),
        "icosahedron" => request.plain(icosahedron),
        "dodecahedron" => request.plain(dodecahedron),
        "truncated-octahedron" => request.plain(truncated_octahedron),
        "prism" => Ok(prism(request.number(3, 6)?)),
        "bipyramid" => Ok(bipyramid(request.number(3, 6)?)),
        "star" => Ok(star(request.number(3, 96)?)),
        "torus" => request.grid(4).map(|(n, m)| torus(n, m)),
        "tri-torus" => request.grid(6).map(|(n, m)| tri_torus(n, m)),
        "icosphere" => Ok(icosphere(request.levels(60)?)),
        "quad-sphere" => Ok(quad_sphere(request.levels(24)?)),
        "cubes" => Ok(cubes(request.number(1, 24)?)),
        "irregular-tri" => request.number_and_seed(5, 6).map(|(n, seed)| irregular_tri(n, seed)),
        "irregular-quad" => {
            let (n, seed) = request.number_and_seed(26, 4)?;
            if n % 2 == 1 {
                return Err(request.refuse("N must be even"));
            }
            let mesh = irregular_quad(n, seed);
            if mesh.len() != n {
                return Err(request.refuse("no such mesh was found; take another SEED"));
            }
            Ok(mesh)
        }
        "irregular-poly" => request.number_and_seed(5, 6).map(|(n, seed)| irregular_poly(n, seed)),
        _ => unreachable!("every name listed has its arm"),
    }
}

/// A built-in mesh as it was asked for.
struct Request<'a> {
    name: &'a str,
    pattern: &'a str,
    parameters: Option<&'a str>,
}

impl Request<'_> {
    fn refuse(&self, why: &str) -> Error {
        Error::Unknown(format!("built-in mesh `{}`: {why}; write {}", self.name, self.pattern))
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
            _ => Err(self.refuse(&format!("{symbol} is `{text}`, but must be a whole number from {min} to {max}"))),
        }
    }

    fn text(&self) -> Result<&str> {
        self.parameters.ok_or_else(|| self.refuse("it needs its parameter"))
    }

    /// Refuses so many corners where memory has no room for them.
    fn room(&self, corners: usize) -> Result<()> {
        let what = || format!("the built-in mesh `{}` with {corners} corners", self.name);
        require(corners as u64 * BYTES, what, "use a smaller one")
    }

    /// The number K of a mesh with so many corners for each.
    fn number(&self, min: u64, corners: u64) -> Result<usize> {
        let k = self.in_range(self.text()?, "K", min, MAX_CORNERS / corners)?;
        self.room(k * corners as usize)?;
        Ok(k)
    }

    /// How often a mesh of so many corners is split in four.
    fn levels(&self, corners: u64) -> Result<usize> {
        let k = self.in_range(self.text()?, "K", 0, u64::from((MAX_CORNERS / corners).ilog(4)))?;
        self.room((corners as usize) << (2 * k))?;
        Ok(k)
    }

    /// The number of vertices, so many corners for each, and the seed.
    fn number_and_seed(&self, min: u64, corners: u64) -> Result<(usize, u64)> {
        let text = self.text()?;
        let (n, seed) = match text.split_once(':') {
            Some((n, seed)) => (n, Some(seed)),
            None => (text, None),
        };
        let n = self.in_range(n, "N", min, MAX_CORNERS / corners)?;
        let seed = seed
            .map_or(Ok(1), u64::from_str)
            .map_err(|_| self.refuse("SEED must be a whole number from 0 to 18446744073709551615"))?;
        self.room(n * corners as usize)?;
        Ok((n, seed))
    }

    /// N and M of a grid with so many corners a vertex.
    fn grid(&self, corners: u64) -> Result<(usize, usize)> {
        let (n, m) = self.text()?.split_once(['x', 'X']).ok_or_else(|| self.refuse("it needs two parameters"))?;
        let max = MAX_CORNERS / corners;
        let n = self.in_range(n, "N", 3, max / 3)?;
        let m = self.in_range(m, "M", 3, max / 3)?;
        if n as u64 * m as u64 > max {
            return Err(self.refuse(&format!("N times M must not exceed {max}")));
        }
        self.room(n * m * corners as usize)?;
        Ok((n, m))
    }
}

fn mesh<const F: usize, const K: usize>(positions: &[[f64; 3]], faces: [[u32; K]; F]) -> Mesh {
    Mesh::new(positions.iter().map(|&p| DVec3::from_array(p)).collect(), Faces::from_lists(faces))
}

/// The cube [−1, 1]³, vertex k at the signs of the bits of k.
pub fn cube() -> Mesh {
    let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    let positions: Vec<[f64; 3]> = (0..8).map(|k| [sign(k & 1), sign(k & 2), sign(k & 4)]).collect();
    mesh(&positions, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
}

/// Four alternate corners of the cube [−1, 1]³.
pub fn tetrahedron() -> Mesh {
    mesh(
        &[[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )
}

/// The six unit vectors along the axes: vertices 2k and 2k + 1 on axis k.
pub fn octahedron() -> Mesh {
    mesh(
        &[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]],
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
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
        let hexagon: Vec<u32> =
            faces.range(f).flat_map(|c| [Some(c as u32), topology.twin(c as u32)]).flatten().collect();
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
    let mut faces = Faces::with_capacity(6 * k);
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
    let mut faces = Faces::with_capacity(6 * k);
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
    (0..n).flat_map(move |i| (0..m).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]))
}

/// A regular grid of n × m quads on a torus, n and m at least 3.
pub fn torus(n: usize, m: usize) -> Mesh {
    let mut faces = Faces::with_capacity(4 * n * m);
    torus_cells(n, m).for_each(|cell| faces.push(&cell));
    Mesh::new(torus_positions(n, m), faces)
}

/// The same grid with the diagonal from (i, j) to (i + 1, j + 1) in every cell.
pub fn tri_torus(n: usize, m: usize) -> Mesh {
    let mut faces = Faces::with_capacity(6 * n * m);
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
/// vertices, n even and at least 26. (For another seed than those tested, a small mesh might have too few edges
/// that can be removed, and then has more vertices.)
pub fn irregular_quad(n: usize, seed: u64) -> Mesh {
    // V + E + F = 2E + 2 on a sphere. A fifth of the triangles' edges is removed, or a few more.
    let edges = (n - 2) / 2;
    let vertices = (edges * 5 / 4 + 6) / 3;
    let removals = 3 * vertices - 6 - edges;
    quad_split(&merge_faces(&irregular_tri(vertices, seed), removals, 8, seed))
}

#[cfg(test)]
mod tests;
