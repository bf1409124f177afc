//! Vertex orders, for sweeps in place and for renumbering: order `o` puts vertex `o[k]` at the k-th place.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::DVec3;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::topology::Incidence;
use super::{Faces, Mesh, bounding_box};
use crate::{Error, Result};

/// `--order file|reverse|bfs|rcm|morton|valence|multicolour|random[:SEED]`.
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
    /// Colour by colour, where vertices of one colour share no face: a greedy colouring in the file's order. All
    /// vertices of a colour may be relaxed at once.
    Multicolour,
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
            "multicolour" => Order::Multicolour,
            "random" => Order::Random(1),
            _ => match text.strip_prefix("random:").map(str::parse) {
                Some(Ok(seed)) => Order::Random(seed),
                _ => {
                    return Err(Error::Unknown(format!(
                        "unknown vertex order `{text}`: use file, reverse, bfs, rcm, morton, valence, multicolour \
                         or random[:SEED]"
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
            Order::Multicolour => "multicolour",
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
            Order::Bfs => breadth_first(&mesh.faces, incidence),
            Order::Rcm => Search::new(&mesh.faces, incidence).reverse_cuthill_mckee(),
            Order::Morton => morton(&mesh.positions),
            Order::Valence => {
                let mut order: Vec<u32> = file.collect();
                order.sort_by_key(|&v| incidence.face_count(v as usize));
                order
            }
            Order::Multicolour => {
                let colour = colouring(&mesh.faces, incidence);
                let mut order: Vec<u32> = file.collect();
                order.sort_by_key(|&v| colour[v as usize]);
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

/// The least colour for every vertex, in the file's order, that no earlier vertex of its faces has. O(Σ|F|²).
pub fn colouring(faces: &Faces, incidence: &Incidence) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut colour = vec![NONE; incidence.vertices()];
    // The last vertex that met a colour among its neighbours.
    let mut met: Vec<u32> = Vec::new();
    for v in 0..incidence.vertices() {
        for &c in incidence.corners_at(v) {
            for &w in faces.face(incidence.face_of(c)) {
                let taken = colour[w as usize];
                if taken != NONE {
                    met[taken as usize] = v as u32;
                }
            }
        }
        let free = met.iter().position(|&last| last != v as u32);
        let free = free.unwrap_or(met.len());
        if free == met.len() {
            met.push(NONE);
        }
        colour[v] = free as u32;
    }
    colour
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

/// An order with its inverse: the way there and back.
#[derive(Clone, Debug)]
pub struct Numbering {
    order: Vec<u32>,
    place: Vec<u32>,
}

impl Numbering {
    /// # Panics
    /// If `order` is not a permutation.
    pub fn new(order: Vec<u32>) -> Self {
        Numbering {
            place: inverse(&order),
            order,
        }
    }

    /// The vertex at every place.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The place of every vertex.
    pub fn place(&self) -> &[u32] {
        &self.place
    }

    /// Values by vertex, put in order. In parallel.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn there<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        gather(values, &self.order)
    }

    /// Values in this order, by vertex again. In parallel.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn back<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        gather(values, &self.place)
    }

    /// As [`back`](Self::back), into memory that is there already: fresh pages cost more than the copy.
    ///
    /// # Panics
    /// If there is not one value, and one place in `out`, a vertex.
    pub fn back_into<T: Copy + Send + Sync>(&self, values: &[T], out: &mut [T]) {
        let n = self.place.len();
        assert!(values.len() == n && out.len() == n, "one value a vertex");
        out.par_iter_mut()
            .zip(&self.place)
            .with_min_len(4096)
            .for_each(|(out, &k)| *out = values[k as usize]);
    }
}

/// The k-th is `values[order[k]]`.
fn gather<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    assert_eq!(values.len(), order.len(), "one value a vertex");
    order
        .par_iter()
        .with_min_len(4096)
        .map(|&v| values[v as usize])
        .collect()
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
/// share with the face before it, fewer than a quarter are within 128 places of one of that face's. Looks
/// at 65 536 faces at the most.
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

/// The mesh with its vertices along Morton's curve through the cells of a grid of 64³, its faces by smallest vertex, and
/// that numbering. Every later pass over the mesh then runs through memory almost in order.
/// `None` if a face names a vertex that does not exist. Two counting sorts, of vertices and of faces.
pub fn along_curve(mesh: &Mesh) -> Option<(Mesh, Numbering)> {
    let n = mesh.len();
    let numbering = Numbering::new(morton_cells(&mesh.positions));
    let place = numbering.place();
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
    let by_smallest = counting_sort(&smallest, n);
    let faces = match moved.uniform_size() {
        // Each face has its place: all threads can work.
        Some(size) => {
            let mut corners = vec![0; moved.corners().len()];
            corners
                .par_chunks_mut(size)
                .with_min_len(8192)
                .zip(&by_smallest)
                .for_each(|(face, &f)| face.copy_from_slice(moved.face(f as usize)));
            Faces::from_parts(moved.offsets().to_vec(), corners)
        }
        None => {
            let mut faces = Faces::with_capacity(moved.corners().len());
            for &f in &by_smallest {
                faces.push(moved.face(f as usize));
            }
            faces
        }
    };
    let positions = numbering.there(&mesh.positions);
    Some((Mesh::new(positions, faces), numbering))
}

/// The numbers of the keys in ascending order of the keys, all below `end`; equal keys as they come. O(keys + end).
fn counting_sort(keys: &[u32], end: usize) -> Vec<u32> {
    let mut starts = vec![0u32; end + 1];
    for &key in keys {
        starts[key as usize + 1] += 1;
    }
    for k in 0..end {
        starts[k + 1] += starts[k];
    }
    let mut sorted = vec![0u32; keys.len()];
    for (k, &key) in (0..).zip(keys) {
        let slot = &mut starts[key as usize];
        sorted[*slot as usize] = k;
        *slot += 1;
    }
    sorted
}

/// One counting sort by the highest bits of the codes, and a sort of each of the short lists that this gives.
fn morton(positions: &[DVec3]) -> Vec<u32> {
    /// Bits of a coordinate that the counting sort looks at.
    const FIRST: u32 = 5;
    let codes = morton_codes(positions, |code| code);
    let highest = morton_codes(positions, |code| (code >> (3 * (21 - FIRST))) as u32);
    let mut order = counting_sort(&highest, 1 << (3 * FIRST));
    let mut lists: Vec<&mut [u32]> = order
        .chunk_by_mut(|&v, &w| highest[v as usize] == highest[w as usize])
        .collect();
    lists.par_iter_mut().for_each(|list| {
        list.sort_unstable_by_key(|&v| (codes[v as usize], v));
    });
    order
}

/// The positions by the cells of a grid of 64³ along the curve, within a cell as they come: near enough for memory.
fn morton_cells(positions: &[DVec3]) -> Vec<u32> {
    const BITS: u32 = 6;
    let cells = morton_codes(positions, |code| (code >> (3 * (21 - BITS))) as u32);
    counting_sort(&cells, 1 << (3 * BITS))
}

/// `take` of the place of every position along the curve, 21 bits a coordinate.
fn morton_codes<T: Send>(positions: &[DVec3], take: impl Fn(u64) -> T + Send + Sync) -> Vec<T> {
    const CELLS: f64 = ((1u64 << 21) - 1) as f64;
    let (low, high) = bounding_box(positions).unwrap_or((DVec3::ZERO, DVec3::ZERO));
    let scale = CELLS / (high - low).max_element().max(f64::MIN_POSITIVE);
    positions
        .par_iter()
        .with_min_len(8192)
        .map(|&p| {
            // A coordinate that is not a number becomes 0.
            let cell = ((p - low) * scale).to_array().map(|x| spread(x as u64));
            take(cell[0] | cell[1] << 1 | cell[2] << 2)
        })
        .collect()
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

/// One bit for each of some things: whether it was met.
struct Met(Vec<u64>);

impl Met {
    fn new(count: usize) -> Self {
        Met(vec![0; count.div_ceil(64)])
    }

    /// Whether this is the first time.
    #[inline]
    fn meet(&mut self, k: usize) -> bool {
        let bit = 1u64 << (k % 64);
        let word = &mut self.0[k / 64];
        let first = *word & bit == 0;
        *word |= bit;
        first
    }
}

/// The vertices breadth first from the first of every component, over faces. Each face is opened once: O(corners).
pub fn breadth_first(faces: &Faces, incidence: &Incidence) -> Vec<u32> {
    // Among triangles, and among quads, a corner's face takes no look-up.
    match faces.uniform_size() {
        Some(3) => search(faces, incidence, |c| (c / 3, c / 3 * 3..c / 3 * 3 + 3)),
        Some(4) => search(faces, incidence, |c| (c / 4, c / 4 * 4..c / 4 * 4 + 4)),
        _ => search(faces, incidence, |c| {
            let f = incidence.face_of(c as u32);
            (f, faces.range(f))
        }),
    }
}

fn search(
    faces: &Faces,
    incidence: &Incidence,
    face_at: impl Fn(usize) -> (usize, Range<usize>),
) -> Vec<u32> {
    let n = incidence.vertices();
    let (mut vertices, mut opened) = (Met::new(n), Met::new(faces.len()));
    // One place more, for what is written there and not kept.
    let mut order = vec![0u32; n + 1];
    let (mut next, mut end) = (0, 0);
    for seed in 0..n {
        order[end] = seed as u32;
        end += usize::from(vertices.meet(seed));
        while next < end {
            let v = order[next];
            // Places of the queue that are not taken yet hold a vertex too.
            incidence.fetch_ahead(faces, &order, next);
            next += 1;
            for &c in incidence.corners_at(v as usize) {
                let (f, range) = face_at(c as usize);
                if opened.meet(f) {
                    // No branch on what was met: there is no pattern that a processor could predict.
                    for &w in &faces.corners()[range] {
                        order[end] = w;
                        end += usize::from(vertices.meet(w as usize));
                    }
                }
            }
        }
    }
    order.truncate(n);
    order
}

/// An order for sweeps that share passes over memory: [breadth first](breadth_first), so that neighbours lie within
/// a narrow band, and [rows of one kind](in_kinds) together.
pub fn in_fronts(faces: &Faces, incidence: &Incidence) -> Numbering {
    let mut order = breadth_first(faces, incidence);
    group_kinds(faces, incidence, &mut order);
    Numbering::new(order)
}

/// The file's order, but with rows of one kind together: each 256 consecutive vertices by their number of faces and the
/// kind of these. Few enough to leave neighbours near, enough for a branch predictor (tuned). `None` where the file is
/// like this already. O(corners), in parallel.
pub fn in_kinds(faces: &Faces, incidence: &Incidence) -> Option<Numbering> {
    let mut order: Vec<u32> = (0..incidence.vertices() as u32).collect();
    group_kinds(faces, incidence, &mut order);
    (!order.is_sorted()).then(|| Numbering::new(order))
}

/// Sorts each 256 consecutive vertices by kind: rows of one length, with weights known by valence or listed. Those of one
/// kind are left as they come.
fn group_kinds(faces: &Faces, incidence: &Incidence, order: &mut [u32]) {
    const GROUP: usize = 256;
    /// Larger numbers, of faces or of neighbours, count as one.
    const MOST: usize = 63;
    let uniform = faces.uniform_size();
    // Triangles only; quads only, as a rule; others by the number of neighbours.
    let key = |v: u32| {
        let at = incidence.corners_at(v as usize);
        let n = at.len();
        let sizes = at.iter().map(|&c| faces.range(incidence.face_of(c)).len());
        let corners = uniform.map_or_else(|| sizes.sum(), |size| size * n);
        match corners {
            c if c == 3 * n => n.min(MOST),
            c if c == 4 * n => MOST + 1 + n.min(MOST),
            c => 2 * (MOST + 1) + c.saturating_sub(2 * n).min(MOST),
        }
    };
    order.par_chunks_mut(GROUP).for_each(|group| {
        let mut vertices = [(0, 0); GROUP];
        let vertices = &mut vertices[..group.len()];
        let mut starts = [0; 3 * (MOST + 1) + 1];
        for (slot, &v) in vertices.iter_mut().zip(&*group) {
            *slot = (v, key(v));
            starts[slot.1 + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        for &(v, key) in &*vertices {
            group[starts[key]] = v;
            starts[key] += 1;
        }
    });
}

/// Searches over vertices that share a face. Every face is opened once, so large faces cost no more than their
/// corners. (The reverse Cuthill-McKee of sprs looks for each component's start among all vertices,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;
    use crate::mesh::generate::{permute_vertices, random_polygons, union};

    const ALL: [Order; 7] = [
        Order::File,
        Order::Reverse,
        Order::Bfs,
        Order::Rcm,
        Order::Morton,
        Order::Valence,
        Order::Random(8),
    ];

    fn ordered(order: Order, mesh: &Mesh) -> Vec<u32> {
        order.order(mesh, &Incidence::new(&mesh.faces, mesh.len()))
    }

    fn shuffled(mesh: &Mesh) -> Mesh {
        permute_vertices(mesh, &ordered(Order::Random(3), mesh))
    }

    #[test]
    fn every_order_is_a_permutation_and_always_the_same() {
        for seed in 0..60 {
            let mut mesh = random_polygons(seed);
            // Isolated vertices too.
            mesh.positions.push(DVec3::ONE);
            mesh.positions.insert(0, DVec3::ZERO);
            for order in ALL {
                let o = ordered(order, &mesh);
                let places = inverse(&o);
                assert_eq!(o.len(), mesh.len());
                assert!((0..o.len()).all(|k| places[o[k] as usize] == k as u32));
                assert_eq!(o, ordered(order, &mesh));
            }
        }
        let empty = Mesh::new(Vec::new(), Faces::default());
        for order in ALL {
            assert!(ordered(order, &empty).is_empty());
        }
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for order in ALL {
            assert_eq!(order.to_string().parse::<Order>().unwrap(), order);
        }
        assert_eq!("random".parse::<Order>().unwrap(), Order::Random(1));
        for bad in ["", "RCM", "random:", "random:x", "random:1:2", "bfs:3"] {
            assert!(bad.parse::<Order>().is_err(), "{bad}");
        }
    }

    /// Levels of the vertices by distance from the first in its component, by brute force over face sharing.
    fn levels(mesh: &Mesh, start: u32) -> Vec<Option<u32>> {
        let mut level = vec![None; mesh.len()];
        level[start as usize] = Some(0);
        for distance in 0.. {
            let mut grown = false;
            for face in mesh.faces.iter() {
                if face.iter().any(|&v| level[v as usize] == Some(distance)) {
                    for &v in face {
                        if level[v as usize].is_none() {
                            level[v as usize] = Some(distance + 1);
                            grown = true;
                        }
                    }
                }
            }
            if !grown {
                break;
            }
        }
        level
    }

    #[test]
    fn breadth_first_orders_go_level_by_level() {
        for seed in 0..20 {
            let mesh = random_polygons(seed);
            for order in [Order::Bfs, Order::Rcm] {
                let mut o = ordered(order, &mesh);
                if order == Order::Rcm {
                    o.reverse();
                }
                let mut rest = &o[..];
                while let Some(&start) = rest.first() {
                    let level = levels(&mesh, start);
                    let size = level.iter().flatten().count();
                    // The component comes in one piece, nearer vertices first.
                    let (component, others) = rest.split_at(size);
                    let found: Vec<_> = component
                        .iter()
                        .map(|&v| level[v as usize].unwrap())
                        .collect();
                    assert!(found.is_sorted(), "{order}");
                    rest = others;
                }
            }
        }
    }

    #[test]
    fn locality_is_that_of_the_grid() {
        // Row by row on an n × m torus: the greatest step leads from the first row to the last, diagonally.
        let (n, m) = (9, 7);
        let mesh = builtin::torus(n, m);
        let file = locality(&mesh.faces, &ordered(Order::File, &mesh));
        assert_eq!(file.bandwidth as usize, n * m - 1);
        // Along the rows m − 1 steps of 1 and one of m − 1; across n − 1 of m and one of (n − 1) m.
        let along = 2.0 * (m - 1) as f64 / m as f64;
        let across = 2.0 * ((n - 1) * m) as f64 / n as f64;
        assert!((file.mean_distance - (along + across) / 2.0).abs() < 1e-12);
        let reverse = locality(&mesh.faces, &ordered(Order::Reverse, &mesh));
        assert_eq!(reverse, file);
        let empty = locality(&Faces::default(), &[0, 1]);
        assert_eq!((empty.bandwidth, empty.mean_distance), (0, 0.0));
    }

    #[test]
    fn reverse_cuthill_mckee_is_as_narrow_as_the_one_of_sprs() {
        for (mesh, name) in [
            (builtin::torus(60, 9), "torus"),
            (builtin::tri_torus(40, 12), "triangle torus"),
            (builtin::irregular_tri(2000, 1), "irregular triangles"),
            (builtin::irregular_poly(2000, 1), "irregular polygons"),
            (builtin::irregular_quad(2000, 1), "irregular quads"),
            (builtin::quad_sphere(4), "quad sphere"),
            (
                union(&[builtin::icosphere(2), builtin::torus(12, 5)]),
                "two components",
            ),
        ] {
            let mesh = shuffled(&mesh);
            let mut pattern = sprs::TriMat::new((mesh.len(), mesh.len()));
            for face in mesh.faces.iter() {
                for &v in face {
                    for &w in face {
                        pattern.add_triplet(v as usize, w as usize, 1.0);
                    }
                }
            }
            let matrix: sprs::CsMat<f64> = pattern.to_csr();
            let theirs = sprs::linalg::ordering::reverse_cuthill_mckee(matrix.view());
            let theirs: Vec<u32> = theirs.perm.vec().iter().map(|&v| v as u32).collect();
            let theirs = locality(&mesh.faces, &theirs).bandwidth;
            let ours = locality(&mesh.faces, &ordered(Order::Rcm, &mesh)).bandwidth;
            let shuffled = locality(&mesh.faces, &ordered(Order::File, &mesh)).bandwidth;
            assert!(
                f64::from(ours) <= 1.1 * f64::from(theirs),
                "{name}: {ours}, sprs {theirs}"
            );
            assert!(4 * ours < shuffled, "{name}: {ours}, shuffled {shuffled}");
        }
    }

    #[test]
    fn reverse_cuthill_mckee_finds_the_band_of_a_long_tube() {
        // From a vertex of the n × m torus, n ≫ m, each level after the first few has two rows of m vertices,
        // and neighbours are at most two levels' fill apart: bandwidth below 4m + O(1), above 2m.
        let (n, m) = (200, 6);
        let mesh = shuffled(&builtin::torus(n, m));
        let band = locality(&mesh.faces, &ordered(Order::Rcm, &mesh)).bandwidth as usize;
        assert!((2 * m..=4 * m + 2).contains(&band), "{band}");
    }

    #[test]
    fn morton_interleaves_the_bits() {
        for x in [0, 1, 2, 0x15_5555, 0x1f_ffff, 0x12_3456] {
            let plain: u64 = (0..21).map(|bit| (x >> bit & 1) << (3 * bit)).sum();
            assert_eq!(spread(x), plain);
        }
        // The corners of a cube, by their signs as bits: z is the highest.
        assert_eq!(
            ordered(Order::Morton, &builtin::cube()),
            [0, 1, 2, 3, 4, 5, 6, 7]
        );
        // Far better than chance, as it should be.
        let mesh = shuffled(&builtin::quad_sphere(5));
        let [random, morton] = [Order::File, Order::Morton]
            .map(|o| locality(&mesh.faces, &ordered(o, &mesh)).mean_distance);
        assert!(morton < random / 10.0);
        // All in one point, and one that is not finite.
        let flat = Mesh::new(vec![DVec3::ONE, DVec3::NAN, DVec3::ONE], Faces::default());
        assert_eq!(ordered(Order::Morton, &flat), [0, 1, 2]);
    }

    #[test]
    fn valence_ascends_and_ties_keep_the_order_of_the_file() {
        let mesh = builtin::star(9);
        let o = ordered(Order::Valence, &mesh);
        let four: Vec<u32> = (0..9).collect();
        assert_eq!(o[..9], four);
        assert_eq!(o[mesh.len() - 2..], [9, 10]);
        assert!(o[9..mesh.len() - 2].is_sorted());
    }

    #[test]
    fn rows_of_one_kind_come_together_and_stay_near() {
        for name in ["irregular-tri:1000", "irregular-poly:1000"] {
            let mesh = builtin::builtin(name).unwrap();
            let incidence = Incidence::new(&mesh.faces, mesh.len());
            let numbering = in_kinds(&mesh.faces, &incidence).unwrap();
            // Neighbours by face: every face adds its corners but for the vertex and one end of an edge.
            let length = |v: &u32| -> usize {
                let at = incidence.corners_at(*v as usize).iter();
                at.map(|&c| mesh.faces.face(incidence.face_of(c)).len() - 2)
                    .sum()
            };
            let changes = |order: &[u32]| {
                let pairs = order.windows(2);
                pairs.filter(|w| length(&w[0]) != length(&w[1])).count()
            };
            let file: Vec<u32> = (0..mesh.len() as u32).collect();
            assert!(4 * changes(numbering.order()) < changes(&file), "{name}");
            for (block, from) in numbering.order().chunks(256).zip(file.chunks(256)) {
                let mut block = block.to_vec();
                block.sort_unstable();
                assert_eq!(block, from, "{name}: the same vertices");
            }
            let values: Vec<u32> = numbering.there(&file);
            let mut back = vec![0; file.len()];
            numbering.back_into(&values, &mut back);
            assert_eq!(back, file);
        }
        let regular = builtin::builtin("torus:20x20").unwrap();
        let incidence = Incidence::new(&regular.faces, regular.len());
        assert!(in_kinds(&regular.faces, &incidence).is_none());
    }
}
