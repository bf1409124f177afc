//! Half-edge connectivity of a polygon mesh: opposite half-edges, edges, ordered stars, components, boundary loops,
//! Euler characteristic. Built in linear time by a counting sort, in parallel; no hashing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use rayon::slice::ParallelSliceMut;

use super::Faces;
use super::edge_numbers::EdgeNumbers;
pub use super::incidence::NONE;
use super::incidence::{FEW, Incidence};
use crate::pages::large;
use crate::parallel;

/// Vertices of one task.
const CHUNK: usize = 4096;

/// An array that many threads fill, each place once, so that the result does not depend on their order.
pub(crate) struct Scatter(Vec<AtomicU32>);

impl Scatter {
    /// All places [`NONE`].
    pub(crate) fn new(len: usize) -> Self {
        let mut places = large(Vec::with_capacity(len));
        parallel::extend(&mut places, len, |_| |_| AtomicU32::new(NONE));
        Scatter(places)
    }

    #[inline]
    pub(crate) fn set(&self, place: u32, value: u32) {
        self.0[place as usize].store(value, Ordering::Relaxed);
    }

    pub(crate) fn into_vec(self) -> Vec<u32> {
        self.0.into_iter().map(AtomicU32::into_inner).collect()
    }
}

/// How the faces hang together. Half-edge `c` leaves corner `c` for the next corner of its face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topology {
    /// The corners at every vertex and the face of every corner.
    pub incidence: Arc<Incidence>,
    twin: Vec<u32>,
    edges: usize,
    boundary: Vec<u32>,
    irregular_edges: Vec<IrregularEdge>,
}

/// An edge that is not the meeting of at most two, oppositely directed faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IrregularEdge {
    /// The two vertices, the smaller first; equal where a face names a vertex twice in a row (a loop).
    pub vertices: [u32; 2],
    /// How many face sides lie on it.
    pub sides: u32,
    /// The first and the last of these half-edges.
    pub half_edges: [u32; 2],
}

impl IrregularEdge {
    /// An edge from a vertex to itself: its face names the vertex twice in a row.
    pub fn is_loop(&self) -> bool {
        self.vertices[0] == self.vertices[1]
    }

    /// Exactly two sides, both in the same direction.
    pub fn is_misoriented(&self) -> bool {
        self.sides == 2 && !self.is_loop()
    }
}

impl Topology {
    /// Pairs the half-edges, vertex by vertex in parallel: those between a vertex and its neighbours of larger
    /// number, all of which lie in the faces at the vertex, so that one look at each face suffices.
    /// O(corners) time for bounded valences, O(n log n) within a vertex of valence n.
    ///
    /// A side whose edge has one side only, more than two, or two in the same direction has no twin, and
    /// neither has a loop (a vertex twice in a row); [`irregular_edges`](Self::irregular_edges) lists all but the
    /// first kind.
    ///
    /// # Panics
    /// If a corner names a vertex ≥ `vertices`.
    pub fn new(faces: &Faces, vertices: usize) -> Self {
        Self::of(Arc::new(Incidence::new(faces, vertices)), faces)
    }

    /// As [`new`](Self::new), where the incidence is known.
    pub(crate) fn of(incidence: Arc<Incidence>, faces: &Faces) -> Self {
        let vertices = incidence.vertices();
        let twin = Scatter::new(faces.corners().len());
        let chunks = parallel::map(vertices, CHUNK, |range| {
            let mut pairs = Pairs::default();
            range.for_each(|v| pairs.at(v, faces, &incidence, &twin));
            pairs
        });
        let mut topology =
            Topology { incidence, twin: twin.into_vec(), edges: 0, boundary: Vec::new(), irregular_edges: Vec::new() };
        for chunk in chunks {
            topology.edges += chunk.edges;
            topology.boundary.extend(chunk.boundary);
            topology.irregular_edges.extend(chunk.irregular_edges);
        }
        topology.boundary.par_sort_unstable();
        topology
    }

    /// The topology of a closed manifold from its arrays: every half-edge has its twin, every vertex one umbrella.
    pub(crate) fn closed(incidence: Arc<Incidence>, twin: Vec<u32>) -> Self {
        Topology { incidence, edges: twin.len() / 2, twin, boundary: Vec::new(), irregular_edges: Vec::new() }
    }

    /// As [`closed`](Self::closed), of an open manifold: `boundary` are the half-edges without a twin, ascending.
    pub(crate) fn open(incidence: Arc<Incidence>, twin: Vec<u32>, boundary: Vec<u32>) -> Self {
        Topology { edges: (twin.len() + boundary.len()) / 2, boundary, ..Self::closed(incidence, twin) }
    }

    /// The opposite of every half-edge, [`NONE`] where it has none.
    pub(crate) fn twins(&self) -> &[u32] {
        &self.twin
    }

    /// The numbers of the edges of a manifold.
    pub(crate) fn edge_numbers(&self) -> EdgeNumbers<'_> {
        EdgeNumbers::new(&self.twin)
    }

    /// Whether the faces at vertex `v` of a closed mesh form one umbrella, which turns through all of them.
    pub(crate) fn is_one_umbrella(&self, faces: &Faces, v: usize) -> bool {
        /// Beyond these many faces, one step is taken after the other.
        const AT_ONCE: usize = 8;
        let at = self.incidence.corners_at(v);
        let n = at.len();
        if n > AT_ONCE {
            let mut c = at[0];
            let mut turns = 0;
            loop {
                c = self.twin[self.incidence.prev(faces, c) as usize];
                turns += 1;
                if c == at[0] || c == NONE || turns > n {
                    return turns == n;
                }
            }
        }
        // All steps first, so that none waits for another's place in memory; then the turn over places in the list.
        let mut here = [NONE; AT_ONCE];
        here[..n].copy_from_slice(at);
        let mut step = [0; AT_ONCE];
        for (step, &c) in step.iter_mut().zip(at) {
            let turned = self.twin[self.incidence.prev(faces, c) as usize];
            *step = (0..AT_ONCE as u32).zip(here).map(|(k, c)| if c == turned { k } else { 0 }).sum::<u32>();
        }
        let mut place = 0;
        for turns in 1..=n {
            place = step[place as usize];
            if place == 0 {
                return turns == n;
            }
        }
        false
    }

    /// The opposite half-edge, if the edge has one more side in the other direction and no further ones.
    pub fn twin(&self, c: u32) -> Option<u32> {
        let t = self.twin[c as usize];
        (t != NONE).then_some(t)
    }

    /// The number of edges, each counted once whatever its number of sides.
    pub fn edges(&self) -> usize {
        self.edges
    }

    /// The number of edges with a single side.
    pub fn boundary_edges(&self) -> usize {
        self.boundary.len()
    }

    /// The half-edges of the edges with a single side, ascending.
    pub fn boundary_half_edges(&self) -> &[u32] {
        &self.boundary
    }

    /// Edges with more than two sides, or with two in the same direction, and loops.
    pub fn irregular_edges(&self) -> &[IrregularEdge] {
        &self.irregular_edges
    }

    /// Whether every edge has two oppositely directed sides.
    pub fn is_closed(&self) -> bool {
        self.boundary.is_empty() && self.irregular_edges.is_empty()
    }

    /// One half-edge of every edge, ascending: that of the smaller index. An
    /// [irregular](Self::irregular_edges) edge comes once a side.
    pub fn edge_sides(&self) -> impl Iterator<Item = u32> + '_ {
        self.twin.iter().enumerate().filter(|&(c, &t)| c as u32 <= t).map(|(c, _)| c as u32)
    }

    /// The number of edges at vertex `v`. An [irregular](Self::irregular_edges) edge may count more than once.
    pub fn edge_valence(&self, faces: &Faces, v: usize) -> usize {
        let incoming_boundary = self
            .incidence
            .corners_at(v)
            .iter()
            .filter(|&&c| self.twin[self.incidence.prev(faces, c) as usize] == NONE)
            .count();
        self.incidence.face_count(v) + incoming_boundary
    }

    /// The corners around vertex `v` in counter-clockwise order, written to `star`; on a boundary from the
    /// first face to the last. Only the umbrella of the first corner is walked: a star shorter than
    /// [`Incidence::face_count`] betrays a non-manifold vertex. Returns whether the umbrella is closed.
    pub fn star(&self, faces: &Faces, v: usize, star: &mut Vec<u32>) -> bool {
        star.clear();
        let corners = self.incidence.corners_at(v);
        let Some(&first) = corners.first() else {
            return false;
        };
        let limit = corners.len();
        let mut start = first;
        // Clockwise to the boundary, if there is one.
        let turns = if self.is_closed() { 0 } else { limit };
        for _ in 0..turns {
            match self.clockwise(faces, start) {
                Some(c) if c == first => {
                    start = first;
                    break;
                }
                Some(c) => start = c,
                None => break,
            }
        }
        let mut c = start;
        for _ in 0..limit {
            star.push(c);
            match self.counter_clockwise(faces, c) {
                Some(next) if next == start => return true,
                Some(next) => c = next,
                None => return false,
            }
        }
        false
    }

    /// The next corner of the same vertex, counter-clockwise: across the side that enters it.
    pub fn counter_clockwise(&self, faces: &Faces, c: u32) -> Option<u32> {
        self.twin(self.incidence.prev(faces, c))
    }

    /// The next corner of the same vertex, clockwise: across the side that leaves it.
    pub fn clockwise(&self, faces: &Faces, c: u32) -> Option<u32> {
        let t = self.twin(c)?;
        Some(self.incidence.next(faces, t))
    }

    /// A component number for every vertex, numbered from 0 by their first vertex, and how many there are.
    /// Two vertices of one face are in one component; an isolated vertex is a component of its own.
    pub fn components(&self, faces: &Faces) -> (Vec<u32>, usize) {
        let n = self.incidence.vertices();
        // A forest with the first vertex of every component as its root.
        let mut label: Vec<u32> = (0..n as u32).collect();
        for face in faces.iter() {
            for side in face.windows(2) {
                join(&mut label, side[0], side[1]);
            }
        }
        let mut count = 0;
        for v in 0..n {
            // Parents come before their children, so theirs are final numbers already.
            label[v] = if label[v] == v as u32 {
                count += 1;
                count - 1
            } else {
                label[label[v] as usize]
            };
        }
        (label, count as usize)
    }

    /// V − E + F.
    pub fn euler_characteristic(&self, faces: &Faces) -> i64 {
        self.incidence.vertices() as i64 - self.edges as i64 + faces.len() as i64
    }

    /// The boundary as closed walks of half-edges, each leading to the next with the missing side on its
    /// right. At a vertex where several boundary fans meet, the walk leaves along the fan by which it arrives.
    pub fn boundary_loops(&self, faces: &Faces) -> Vec<Vec<u32>> {
        let corners = faces.corners();
        let mut seen = vec![false; corners.len()];
        let mut loops = Vec::new();
        for start in 0..corners.len() as u32 {
            if self.twin[start as usize] != NONE || seen[start as usize] {
                continue;
            }
            let mut walk = Vec::new();
            let mut c = start;
            while !seen[c as usize] {
                seen[c as usize] = true;
                walk.push(c);
                // Turn clockwise about the half-edge's end until a side without a twin leaves it.
                c = self.incidence.next(faces, c);
                while let Some(next) = self.clockwise(faces, c) {
                    c = next;
                }
            }
            loops.push(walk);
        }
        loops
    }
}

/// What pairing finds at some vertices.
#[derive(Default)]
struct Pairs {
    edges: usize,
    boundary: Vec<u32>,
    irregular_edges: Vec<IrregularEdge>,
    /// Sides (other vertex, half-edge) of the edges whose smaller vertex is the present one.
    sides: Vec<(u32, u32)>,
}

impl Pairs {
    /// Pairs the sides of the edges whose smaller vertex is `v`.
    fn at(&mut self, v: usize, faces: &Faces, incidence: &Incidence, twin: &Scatter) {
        let at = incidence.corners_at(v);
        if at.len() > FEW || !self.all_opposite(v as u32, at, faces, incidence, twin) {
            self.sort(v, at, faces, incidence, twin);
        }
    }

    /// The usual case: each side that leaves `v` meets exactly one that enters it, and none is left over. Otherwise
    /// nothing is done.
    #[inline]
    fn all_opposite(&mut self, v: u32, at: &[u32], faces: &Faces, incidence: &Incidence, twin: &Scatter) -> bool {
        let corners = faces.corners();
        // One more place than can be taken: what does not count is written beyond the end.
        let mut leaving = [(0, 0); FEW + 1];
        let mut entering = [(0, 0); FEW + 1];
        let (mut out, mut into) = (0, 0);
        for &c in at {
            let (next, prev) = (incidence.next(faces, c), incidence.prev(faces, c));
            let (w, u) = (corners[next as usize], corners[prev as usize]);
            // A loop leaves and never enters.
            leaving[out] = (w, c);
            out += usize::from(w >= v);
            entering[into] = (u, prev);
            into += usize::from(u > v);
        }
        let (leaving, entering) = (&leaving[..out], &entering[..into]);
        let mut partner = [0; FEW];
        let mut met = 0u32;
        for (&(w, _), partner) in leaving.iter().zip(&mut partner) {
            let mut meeting = 0u32;
            for (k, &(u, _)) in entering.iter().enumerate() {
                meeting |= u32::from(u == w) << k;
            }
            if meeting.count_ones() != 1 {
                return false;
            }
            met |= meeting;
            *partner = meeting.trailing_zeros();
        }
        if out != into || met.count_ones() as usize != into {
            return false;
        }
        for (&(_, c), &partner) in leaving.iter().zip(&partner) {
            let (_, d) = entering[partner as usize];
            twin.set(c, d);
            twin.set(d, c);
        }
        self.edges += out;
        true
    }

    /// Any case.
    fn sort(&mut self, v: usize, at: &[u32], faces: &Faces, incidence: &Incidence, twin: &Scatter) {
        let corners = faces.corners();
        self.sides.clear();
        for &c in at {
            let out = corners[incidence.next(faces, c) as usize];
            let back = incidence.prev(faces, c);
            let into = corners[back as usize];
            // A side from v to v (a vertex repeated in a row) is a loop: counted once, never paired.
            if out as usize >= v {
                self.sides.push((out, c));
            }
            if into as usize > v {
                self.sides.push((into, back));
            }
        }
        self.sides.sort_unstable();
        for edge in self.sides.chunk_by(|a, b| a.0 == b.0) {
            self.edges += 1;
            match *edge {
                [(w, c)] if w as usize != v => self.boundary.push(c),
                [(w, a), (_, b)]
                    if (corners[a as usize] as usize == v) != (corners[b as usize] as usize == v)
                        && w as usize != v =>
                {
                    twin.set(a, b);
                    twin.set(b, a);
                }
                [(w, first), ..] => self.irregular_edges.push(IrregularEdge {
                    vertices: [v as u32, w],
                    sides: edge.len() as u32,
                    half_edges: [first, edge[edge.len() - 1].1],
                }),
                [] => {}
            }
        }
    }
}

/// Joins the trees of `a` and `b` in a forest of parents, the smaller root above; whether they were two. Paths
/// are halved on the way (Tarjan and van Leeuwen 1984).
pub(super) fn join(parent: &mut [u32], a: u32, b: u32) -> bool {
    let mut root = |mut x: u32| {
        while parent[x as usize] != x {
            parent[x as usize] = parent[parent[x as usize] as usize];
            x = parent[x as usize];
        }
        x
    };
    let (a, b) = (root(a), root(b));
    parent[a.max(b) as usize] = a.min(b);
    a != b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::incidence::{next_in, prev_in};

    fn topology(vertices: usize, faces: &[&[u32]]) -> (Faces, Topology) {
        let faces = Faces::from_lists(faces);
        let topology = Topology::new(&faces, vertices);
        (faces, topology)
    }

    const TETRAHEDRON: [&[u32]; 4] = [&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]];

    #[test]
    fn a_tetrahedron_is_closed_and_every_star_turns_once() {
        let (faces, t) = topology(4, &TETRAHEDRON);
        assert!(t.is_closed());
        assert_eq!((t.edges(), t.boundary_edges()), (6, 0));
        assert_eq!(t.euler_characteristic(&faces), 2);
        assert_eq!(t.components(&faces), (vec![0; 4], 1));
        assert_eq!(t.edge_sides().count(), 6);
        let mut star = Vec::new();
        for v in 0..4 {
            assert_eq!(t.edge_valence(&faces, v), 3);
            assert!(t.star(&faces, v, &mut star));
            assert_eq!(star.len(), 3);
            // Counter-clockwise: the side that enters v in one face leaves it in the next.
            for k in 0..3 {
                let (here, next) = (star[k], star[(k + 1) % 3]);
                let range = faces.range(t.incidence.face_of(here));
                let entering_from = faces.corners()[prev_in(&range, here) as usize];
                let range = faces.range(t.incidence.face_of(next));
                let leaving_to = faces.corners()[next_in(&range, next) as usize];
                assert_eq!(entering_from, leaving_to);
            }
        }
    }

    #[test]
    fn twins_are_opposite_and_mutual() {
        let (faces, t) = topology(4, &TETRAHEDRON);
        for c in 0..12u32 {
            let d = t.twin(c).unwrap();
            assert_eq!(t.twin(d), Some(c));
            let ends = |c: u32| {
                let range = faces.range(t.incidence.face_of(c));
                (faces.corners()[c as usize], faces.corners()[next_in(&range, c) as usize])
            };
            let ((a, b), (e, f)) = (ends(c), ends(d));
            assert_eq!((a, b), (f, e));
        }
    }

    #[test]
    fn an_open_fan_is_walked_from_its_first_face_to_its_last() {
        // Three triangles about vertex 0, given out of order.
        let (faces, t) = topology(5, &[&[0, 2, 3], &[0, 3, 4], &[0, 1, 2]]);
        assert_eq!((t.edges(), t.boundary_edges()), (7, 5));
        let mut star = Vec::new();
        assert!(!t.star(&faces, 0, &mut star));
        let order: Vec<usize> = star.iter().map(|&c| t.incidence.face_of(c)).collect();
        assert_eq!(order, [2, 0, 1]);
        let valences: Vec<usize> = (0..5).map(|v| t.edge_valence(&faces, v)).collect();
        assert_eq!(valences, [4, 2, 3, 3, 2]);
        let loops = t.boundary_loops(&faces);
        assert_eq!(loops.len(), 1);
        let walk: Vec<u32> = loops[0].iter().map(|&c| faces.corners()[c as usize]).collect();
        assert_eq!(walk, [2, 3, 4, 0, 1]);
    }

    #[test]
    fn two_triangles_at_one_vertex_have_two_boundary_loops_and_a_short_star() {
        let (faces, t) = topology(5, &[&[0, 1, 2], &[0, 3, 4]]);
        let mut loops = t.boundary_loops(&faces);
        loops.sort();
        assert_eq!(loops, [vec![0, 1, 2], vec![3, 4, 5]]);
        let mut star = Vec::new();
        t.star(&faces, 0, &mut star);
        assert!(star.len() < t.incidence.face_count(0));
        assert_eq!(t.components(&faces).1, 1);
    }

    #[test]
    fn irregular_edges_are_listed_with_their_sides() {
        // Three triangles on edge 0-1.
        let (_, t) = topology(5, &[&[0, 1, 2], &[1, 0, 3], &[0, 1, 4]]);
        assert_eq!(t.irregular_edges(), [IrregularEdge { vertices: [0, 1], sides: 3, half_edges: [0, 6] }]);
        assert!(!t.irregular_edges()[0].is_misoriented());
        assert_eq!((t.edges(), t.boundary_edges()), (7, 6));
        // Two triangles that run along edge 0-1 in the same direction.
        let (_, t) = topology(4, &[&[0, 1, 2], &[3, 0, 1]]);
        let edge = t.irregular_edges()[0];
        assert!(edge.is_misoriented());
        assert_eq!((edge.vertices, edge.half_edges), ([0, 1], [0, 4]));
        assert_eq!(t.twin(0), None);
        // A vertex twice in a row: a loop, neither boundary nor misoriented, however often it occurs.
        for repeats in 1..4 {
            let faces: Vec<&[u32]> = vec![&[0, 1, 1]; repeats];
            let (_, t) = topology(2, &faces);
            let loops = t.irregular_edges().iter().filter(|e| e.is_loop()).count();
            assert_eq!(loops, 1);
            assert!(!t.irregular_edges().iter().any(|e| e.is_misoriented() && e.is_loop()));
            assert!(t.boundary_half_edges().is_empty());
        }
    }

    /// Between the vertices of a single face there is no way but its sides.
    #[test]
    fn a_face_of_any_size_is_one_component() {
        for size in 3..40u32 {
            let even: Vec<u32> = (0..size).map(|k| 2 * k).collect();
            let odd: Vec<u32> = (0..size).rev().map(|k| 2 * k + 1).collect();
            let (faces, t) = topology(2 * size as usize, &[&even, &odd]);
            let expected: Vec<u32> = (0..2 * size).map(|v| v % 2).collect();
            assert_eq!(t.components(&faces), (expected, 2), "{size} corners");
        }
    }

    #[test]
    fn isolated_vertices_are_components_of_their_own() {
        let (faces, t) = topology(5, &[&[1, 2, 4]]);
        assert_eq!(t.components(&faces), (vec![0, 1, 1, 2, 1], 3));
        assert_eq!(t.incidence.face_count(0), 0);
        let mut star = vec![7];
        assert!(!t.star(&faces, 0, &mut star));
        assert!(star.is_empty());
    }
}
