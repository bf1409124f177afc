//! Vertex orders, for sweeps in place and for renumbering: order `o` puts vertex `o[k]` at the k-th place.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::topology::Incidence;
use super::{Faces, Mesh, bounding_box};
use crate::{Error, Result};

/// `--order file|reverse|bfs|rcm|morton|valence|random[:SEED]`.
///
/// Neighbours in `Bfs` and `Rcm` are vertices that share a face: the pattern of the limit matrices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// As in the file.
    #[default]
    File,
    /// The file's order, last vertex first.
    Reverse,
    /// Breadth first from the first vertex of every component, neighbours by face.
    Bfs,
    /// Reverse Cuthill-McKee: breadth first from a pseudo-peripheral vertex of every component, neighbours by
    /// ascending degree, all in reverse (Cuthill and McKee 1969; start by George and Liu 1979).
    Rcm,
    /// Along the space-filling curve of Morton through the bounding box, 21 bits a coordinate.
    Morton,
    /// By ascending number of faces, ties as in the file.
    Valence,
    /// Shuffled from a seed.
    Random(u64),
}

impl FromStr for Order {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let order = match text {
            "file" => Order::File,
            "reverse" => Order::Reverse,
            "bfs" => Order::Bfs,
            "rcm" => Order::Rcm,
            "morton" => Order::Morton,
            "valence" => Order::Valence,
            "random" => Order::Random(1),
            _ => match text.strip_prefix("random:").map(str::parse) {
                Some(Ok(seed)) => Order::Random(seed),
                _ => {
                    return Err(Error::Unknown(format!(
                        "unknown vertex order `{text}`: use file, reverse, bfs, rcm, morton, valence or random[:SEED]"
                    )));
                }
            },
        };
        Ok(order)
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Order::File => "file",
            Order::Reverse => "reverse",
            Order::Bfs => "bfs",
            Order::Rcm => "rcm",
            Order::Morton => "morton",
            Order::Valence => "valence",
            Order::Random(seed) => return write!(f, "random:{seed}"),
        };
        f.write_str(name)
    }
}

impl Order {
    /// The vertices of `mesh` in this order. O(corners), but for the sort of `Morton` and, within the
    /// neighbours of each vertex, of `Rcm`.
    pub fn order(&self, mesh: &Mesh, incidence: &Incidence) -> Vec<u32> {
        let file = 0..mesh.len() as u32;
        match *self {
            Order::File => file.collect(),
            Order::Reverse => file.rev().collect(),
            Order::Bfs => Search::new(&mesh.faces, incidence).breadth_first(),
            Order::Rcm => Search::new(&mesh.faces, incidence).reverse_cuthill_mckee(),
            Order::Morton => morton(&mesh.positions),
            Order::Valence => {
                let mut order: Vec<u32> = file.collect();
                order.sort_by_key(|&v| incidence.face_count(v as usize));
                order
            }
            Order::Random(seed) => {
                let mut order: Vec<u32> = file.collect();
                order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                order
            }
        }
    }
}

/// The place of every vertex: `inverse(o)[o[k]] = k`.
///
/// # Panics
/// If `order` is not a permutation.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![u32::MAX; order.len()];
    for (k, &v) in order.iter().enumerate() {
        let place = &mut inverse[v as usize];
        assert_eq!(*place, u32::MAX, "vertex {v} occurs twice in the order");
        *place = k as u32;
    }
    inverse
}

/// How far apart an order puts neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Locality {
    /// The greatest difference of the places of two vertices of one face: the bandwidth of the limit matrix.
    pub bandwidth: u32,
    /// The mean difference of the places of the two ends of a face side; 0 without faces.
    pub mean_distance: f64,
}

/// The locality of `order`. O(corners).
///
/// # Panics
/// If `order` is not a permutation of vertices that include all of the faces'.
pub fn locality(faces: &Faces, order: &[u32]) -> Locality {
    let place = inverse(order);
    let (mut bandwidth, mut total) = (0, 0u64);
    for face in faces.iter() {
        let (mut min, mut max) = (u32::MAX, 0);
        let mut before = face.last().map_or(0, |&v| place[v as usize]);
        for &v in face {
            let here = place[v as usize];
            min = min.min(here);
            max = max.max(here);
            total += u64::from(here.abs_diff(before));
            before = here;
        }
        bandwidth = bandwidth.max(max.saturating_sub(min));
    }
    Locality {
        bandwidth,
        mean_distance: total as f64 / faces.corners().len().max(1) as f64,
    }
}

/// Whether vertices that faces bring together lie scattered through memory: of the vertices that a face does not
/// share with the face before it, fewer than [`NEAR_SHARE`] are within [`NEAR`] places of one of that face's. Looks
/// at [`SAMPLE`] faces.
pub fn is_scattered(faces: &Faces) -> bool {
    const NEAR: u32 = 128;
    const NEAR_SHARE: f64 = 0.25;
    const SAMPLE: usize = 1 << 16;
    let (mut fresh, mut near) = (0u32, 0u32);
    for f in (1..faces.len()).step_by(faces.len() / SAMPLE + 1) {
        let before = faces.face(f - 1);
        for &v in faces.face(f).iter().filter(|v| !before.contains(v)) {
            fresh += 1;
            near += u32::from(before.iter().any(|&w| v.abs_diff(w) <= NEAR));
        }
    }
    f64::from(near) < NEAR_SHARE * f64::from(fresh)
}

/// The mesh with its vertices along Morton's curve, its faces by smallest vertex, and the order: vertex k of the
/// result is vertex `order[k]` of `mesh`. Every later pass over the mesh then runs through memory almost in order.
/// `None` if a face names a vertex that does not exist. One parallel sort of the vertices, one counting sort of the
/// faces.
pub fn along_curve(mesh: &Mesh) -> Option<(Mesh, Vec<u32>)> {
    let n = mesh.len();
    let order = morton(&mesh.positions);
    let place = inverse(&order);
    let corners: Option<Vec<u32>> = mesh
        .faces
        .corners()
        .par_iter()
        .with_min_len(8192)
        .map(|&v| place.get(v as usize).copied())
        .collect();
    let moved = Faces::from_parts(mesh.faces.offsets().to_vec(), corners?);
    let smallest: Vec<u32> = (0..moved.len())
        .into_par_iter()
        .with_min_len(8192)
        .map(|f| moved.face(f).iter().copied().min().unwrap_or(0))
        .collect();
    let mut starts = vec![0u32; n + 1];
    for &v in &smallest {
        starts[v as usize + 1] += 1;
    }
    for v in 0..n {
        starts[v + 1] += starts[v];
    }
    let mut by_smallest = vec![0u32; moved.len()];
    for (f, &v) in smallest.iter().enumerate() {
        let slot = &mut starts[v as usize];
        by_smallest[*slot as usize] = f as u32;
        *slot += 1;
    }
    let mut faces = Faces::with_capacity(moved.len(), moved.corners().len());
    for &f in &by_smallest {
        faces.push(moved.face(f as usize));
    }
    let positions = order
        .par_iter()
        .with_min_len(8192)
        .map(|&v| mesh.positions[v as usize])
        .collect();
    Some((Mesh::new(positions, faces), order))
}

fn morton(positions: &[DVec3]) -> Vec<u32> {
    const CELLS: f64 = ((1u64 << 21) - 1) as f64;
    let (low, high) = bounding_box(positions).unwrap_or((DVec3::ZERO, DVec3::ZERO));
    let scale = CELLS / (high - low).max_element().max(f64::MIN_POSITIVE);
    let mut codes: Vec<(u64, u32)> = positions
        .par_iter()
        .enumerate()
        .map(|(v, &p)| {
            // A coordinate that is not a number becomes 0.
            let cell = ((p - low) * scale).to_array().map(|x| spread(x as u64));
            (cell[0] | cell[1] << 1 | cell[2] << 2, v as u32)
        })
        .collect();
    codes.par_sort_unstable();
    codes.into_iter().map(|(_, v)| v).collect()
}

/// Puts two zeros between the lowest 21 bits.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Breadth-first search over vertices that share a face. Every face is opened once, so large faces cost no more
/// than their corners. (The reverse Cuthill-McKee of sprs looks for each component's start among all vertices,
/// which is quadratic for many components, and needs an assembled matrix.)
struct Search<'a> {
    faces: &'a Faces,
    incidence: &'a Incidence,
    /// The last search that met the vertex or face.
    vertex_seen: Vec<u32>,
    face_seen: Vec<u32>,
    round: u32,
}

impl<'a> Search<'a> {
    fn new(faces: &'a Faces, incidence: &'a Incidence) -> Self {
        Search {
            faces,
            incidence,
            vertex_seen: vec![0; incidence.vertices()],
            face_seen: vec![0; faces.len()],
            round: 0,
        }
    }

    /// Appends the unseen neighbours of `v`.
    fn visit(&mut self, v: u32, queue: &mut Vec<u32>) {
        for &c in self.incidence.corners_at(v as usize) {
            let f = self.incidence.face_of(c);
            if self.face_seen[f] == self.round {
                continue;
            }
            self.face_seen[f] = self.round;
            for &w in self.faces.face(f) {
                if self.vertex_seen[w as usize] != self.round {
                    self.vertex_seen[w as usize] = self.round;
                    queue.push(w);
                }
            }
        }
    }

    fn breadth_first(mut self) -> Vec<u32> {
        let n = self.incidence.vertices();
        self.round = 1;
        let mut order = Vec::with_capacity(n);
        let mut next = 0;
        for seed in 0..n {
            if self.vertex_seen[seed] != self.round {
                self.vertex_seen[seed] = self.round;
                order.push(seed as u32);
            }
            while next < order.len() {
                self.visit(order[next], &mut order);
                next += 1;
            }
        }
        order
    }

    fn reverse_cuthill_mckee(mut self) -> Vec<u32> {
        let n = self.incidence.vertices();
        // On a closed mesh whose faces share an edge or a vertex at most: the number of neighbours.
        let degree: Vec<u32> = (0..n)
            .map(|v| {
                let faces = self.incidence.corners_at(v).iter();
                faces
                    .map(|&c| self.faces.range(self.incidence.face_of(c)).len() as u32)
                    .map(|size| size.saturating_sub(2))
                    .sum()
            })
            .collect();
        let mut order: Vec<u32> = Vec::with_capacity(n);
        let mut placed = vec![false; n];
        let mut levels = Vec::new();
        for seed in 0..n as u32 {
            if placed[seed as usize] {
                continue;
            }
            let start = self.pseudo_peripheral(seed, &degree, &mut levels);
            self.round += 1;
            self.vertex_seen[start as usize] = self.round;
            let mut next = order.len();
            order.push(start);
            while next < order.len() {
                let v = order[next];
                placed[v as usize] = true;
                let new = order.len();
                self.visit(v, &mut order);
                order[new..].sort_unstable_by_key(|&w| (degree[w as usize], w));
                next += 1;
            }
        }
        order.reverse();
        order
    }

    /// A vertex far from others: from `seed`, moves to a vertex of least degree in the last level of the search
    /// as long as that gives more levels.
    fn pseudo_peripheral(&mut self, seed: u32, degree: &[u32], level: &mut Vec<u32>) -> u32 {
        // The number of levels grows with each round; two or three are usual, and this bounds the time.
        const ROUNDS: usize = 8;
        let mut start = seed;
        let mut height = 0;
        for _ in 0..ROUNDS {
            self.round += 1;
            self.vertex_seen[start as usize] = self.round;
            level.clear();
            level.push(start);
            let (mut first, mut levels) = (0, 1);
            loop {
                let end = level.len();
                for k in first..end {
                    self.visit(level[k], level);
                }
                if level.len() == end {
                    break;
                }
                first = end;
                levels += 1;
            }
            if levels <= height {
                break;
            }
            height = levels;
            let last = level[first..].iter().copied();
            let Some(far) = last.min_by_key(|&v| (degree[v as usize], v)) else {
                break;
            };
            start = far;
        }
        start
    }
}
