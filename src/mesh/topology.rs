//! Who meets whom: corners at each vertex, opposite half-edges, edges, ordered stars, components, boundary
//! loops, Euler characteristic. Built in linear time by counting sorts; no hashing.

use rayon::prelude::*;

use super::Faces;

/// Marks an absent index in the arrays of this room.
pub const NONE: u32 = u32::MAX;

/// The corners at every vertex, in ascending order, and the face of every corner. This is all that the
/// assembly of a limit matrix needs.
#[derive(Clone, Debug)]
pub struct Incidence {
    offsets: Vec<u32>,
    corners: Vec<u32>,
    face: Vec<u32>,
}

impl Incidence {
    /// One counting sort of the corners by vertex: O(corners), stable.
    ///
    /// # Panics
    /// If a corner names a vertex ≥ `vertices` (the validator reports such faces before).
    pub fn new(faces: &Faces, vertices: usize) -> Self {
        let mut offsets = vec![0u32; vertices + 1];
        for &v in faces.corners() {
            offsets[v as usize + 1] += 1;
        }
        for v in 0..vertices {
            offsets[v + 1] += offsets[v];
        }
        let mut next = offsets.clone();
        let mut corners = vec![0u32; faces.corners().len()];
        let mut face = vec![0u32; faces.corners().len()];
        for f in 0..faces.len() {
            for c in faces.range(f) {
                face[c] = f as u32;
                let slot = &mut next[faces.corners()[c] as usize];
                corners[*slot as usize] = c as u32;
                *slot += 1;
            }
        }
        Incidence {
            offsets,
            corners,
            face,
        }
    }

    /// The number of vertices N.
    pub fn vertices(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The corners at vertex `v`, ascending, so ordered by face.
    pub fn corners_at(&self, v: usize) -> &[u32] {
        &self.corners[self.offsets[v] as usize..self.offsets[v + 1] as usize]
    }

    /// The number of faces at vertex `v`: its valence n on a closed mesh.
    pub fn face_count(&self, v: usize) -> usize {
        (self.offsets[v + 1] - self.offsets[v]) as usize
    }

    /// The face of corner `c`.
    pub fn face_of(&self, c: u32) -> usize {
        self.face[c as usize] as usize
    }
}

impl Incidence {
    /// Whether every side of a face has exactly one opposite: one other side between its vertices, in the other
    /// direction. In parallel, O(Σ n²) over the valences n up to [`MANY`], with sorts beyond.
    ///
    /// ```
    /// use limitlab::mesh::{Faces, Incidence};
    /// let closed = |faces: &Faces| Incidence::new(faces, 4).is_closed(faces);
    /// let tetrahedron = [[0u32, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    /// assert!(closed(&Faces::from_lists(tetrahedron)));
    /// assert!(!closed(&Faces::from_lists(&tetrahedron[1..])));
    /// ```
    pub fn is_closed(&self, faces: &Faces) -> bool {
        let corners = faces.corners();
        (0..self.vertices())
            .into_par_iter()
            .with_min_len(4096)
            .all(|v| {
                let at = self.corners_at(v);
                let sides = |c: u32| {
                    let range = faces.range(self.face_of(c));
                    let before = corners[prev_in(&range, c) as usize];
                    (corners[next_in(&range, c) as usize], before)
                };
                if at.len() > MANY {
                    let (mut out, mut into): (Vec<u32>, Vec<u32>) =
                        at.iter().map(|&c| sides(c)).unzip();
                    out.sort_unstable();
                    into.sort_unstable();
                    return out == into
                        && out.windows(2).all(|w| w[0] != w[1])
                        && out.binary_search(&(v as u32)).is_err();
                }
                let mut ends = [(0, 0); MANY];
                let ends = &mut ends[..at.len()];
                for (end, &c) in ends.iter_mut().zip(at) {
                    *end = sides(c);
                }
                ends.iter().all(|&(out, _)| {
                    let count = |same: fn(&(u32, u32)) -> u32| {
                        ends.iter().filter(|e| same(e) == out).count()
                    };
                    out as usize != v && count(|e| e.0) == 1 && count(|e| e.1) == 1
                })
            })
    }

    /// The opposite of every half-edge, if each has exactly one: the usual case, in parallel. O(Σ n²) over the
    /// valences n, so vertices of more than [`MANY`] faces are left to the sorts.
    fn pairs(&self, faces: &Faces) -> Option<Vec<u32>> {
        // Among triangles, and among quads, the next corner takes no look at the face.
        match faces.uniform_size() {
            Some(3) => self.pairs_by(faces, |c| if c % 3 == 2 { c - 2 } else { c + 1 }),
            Some(4) => self.pairs_by(faces, |c| if c % 4 == 3 { c - 3 } else { c + 1 }),
            _ => self.pairs_by(faces, |c| next_in(&faces.range(self.face_of(c)), c)),
        }
    }

    fn pairs_by(&self, faces: &Faces, next: impl Fn(u32) -> u32 + Sync) -> Option<Vec<u32>> {
        let corners = faces.corners();
        let end = |c: u32| corners[next(c) as usize];
        (0..corners.len() as u32)
            .into_par_iter()
            .with_min_len(8192)
            .map(|c| {
                let (from, to) = (corners[c as usize], end(c));
                let at = self.corners_at(to as usize);
                if from == to || at.len() > MANY {
                    return None;
                }
                let mut opposite = at.iter().copied().filter(|&d| end(d) == from);
                match (opposite.next(), opposite.next()) {
                    (Some(d), None) => Some(d),
                    _ => None,
                }
            })
            .collect()
    }
}

/// Beyond this many faces at a vertex, a sort of its sides is faster than comparing each with each.
const MANY: usize = 64;

/// How the faces hang together. Half-edge `c` leaves corner `c` for the next corner of its face.
#[derive(Clone, Debug)]
pub struct Topology {
    pub incidence: Incidence,
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
    /// Pairs the half-edges: a counting sort by smaller vertex, then a sort of each (short) bucket.
    /// O(corners) time for bounded valences, O(n log n) within a vertex of valence n.
    ///
    /// A side whose edge has one side only, more than two, or two in the same direction has no twin, and
    /// neither has a loop (a vertex twice in a row); [`irregular_edges`](Self::irregular_edges) lists all but the
    /// first kind.
    ///
    /// # Panics
    /// If a corner names a vertex ≥ `vertices`.
    pub fn new(faces: &Faces, vertices: usize) -> Self {
        let incidence = Incidence::new(faces, vertices);
        let corners = faces.corners();
        if let Some(twin) = incidence.pairs(faces) {
            return Topology {
                incidence,
                edges: twin.len() / 2,
                twin,
                boundary: Vec::new(),
                irregular_edges: Vec::new(),
            };
        }
        let mut twin = vec![NONE; corners.len()];
        let mut edges = 0;
        let mut boundary = Vec::new();
        let mut irregular_edges = Vec::new();
        // Sides (other vertex, half-edge) of the edges whose smaller vertex is v.
        let mut sides: Vec<(u32, u32)> = Vec::new();
        for v in 0..vertices {
            sides.clear();
            for &c in incidence.corners_at(v) {
                let range = faces.range(incidence.face_of(c));
                let out = corners[next_in(&range, c) as usize];
                let back = prev_in(&range, c);
                let into = corners[back as usize];
                // A side from v to v (a vertex repeated in a row) is a loop: counted once, never paired.
                if out as usize >= v {
                    sides.push((out, c));
                }
                if into as usize > v {
                    sides.push((into, back));
                }
            }
            sides.sort_unstable();
            for edge in sides.chunk_by(|a, b| a.0 == b.0) {
                edges += 1;
                match *edge {
                    [(w, c)] if w as usize != v => boundary.push(c),
                    [(w, a), (_, b)]
                        if (corners[a as usize] as usize == v)
                            != (corners[b as usize] as usize == v)
                            && w as usize != v =>
                    {
                        twin[a as usize] = b;
                        twin[b as usize] = a;
                    }
                    [(w, first), ..] => irregular_edges.push(IrregularEdge {
                        vertices: [v as u32, w],
                        sides: edge.len() as u32,
                        half_edges: [first, edge[edge.len() - 1].1],
                    }),
                    [] => {}
                }
            }
        }
        boundary.sort_unstable();
        Topology {
            incidence,
            twin,
            edges,
            boundary,
            irregular_edges,
        }
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
        self.twin
            .iter()
            .enumerate()
            .filter(|&(c, &t)| c as u32 <= t)
            .map(|(c, _)| c as u32)
    }

    /// The number of edges at vertex `v`. An [irregular](Self::irregular_edges) edge may count more than once.
    pub fn edge_valence(&self, faces: &Faces, v: usize) -> usize {
        let incoming_boundary = self
            .incidence
            .corners_at(v)
            .iter()
            .filter(|&&c| {
                let range = faces.range(self.incidence.face_of(c));
                self.twin[prev_in(&range, c) as usize] == NONE
            })
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
        for _ in 0..limit {
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
        let range = faces.range(self.incidence.face_of(c));
        self.twin(prev_in(&range, c))
    }

    /// The next corner of the same vertex, clockwise: across the side that leaves it.
    pub fn clockwise(&self, faces: &Faces, c: u32) -> Option<u32> {
        let t = self.twin(c)?;
        let range = faces.range(self.incidence.face_of(t));
        Some(next_in(&range, t))
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
                let range = faces.range(self.incidence.face_of(c));
                c = next_in(&range, c);
                while let Some(next) = self.clockwise(faces, c) {
                    c = next;
                }
            }
            loops.push(walk);
        }
        loops
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

/// The corner after `c` in its face, whose corners are `range`.
pub fn next_in(range: &std::ops::Range<usize>, c: u32) -> u32 {
    if c as usize + 1 == range.end {
        range.start as u32
    } else {
        c + 1
    }
}

/// The corner before `c` in its face, whose corners are `range`.
pub fn prev_in(range: &std::ops::Range<usize>, c: u32) -> u32 {
    if c as usize == range.start {
        range.end as u32 - 1
    } else {
        c - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                (
                    faces.corners()[c as usize],
                    faces.corners()[next_in(&range, c) as usize],
                )
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
        let walk: Vec<u32> = loops[0]
            .iter()
            .map(|&c| faces.corners()[c as usize])
            .collect();
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
        assert_eq!(
            t.irregular_edges(),
            [IrregularEdge {
                vertices: [0, 1],
                sides: 3,
                half_edges: [0, 6]
            }]
        );
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
            assert!(
                !t.irregular_edges()
                    .iter()
                    .any(|e| e.is_misoriented() && e.is_loop())
            );
            assert!(t.boundary_half_edges().is_empty());
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
