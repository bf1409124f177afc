//! Who meets whom: corners at each vertex, opposite half-edges, edges, ordered stars, components, boundary
//! loops, Euler characteristic. Built in linear time by counting sorts; no hashing.

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

/// How the faces hang together. Half-edge `c` leaves corner `c` for the next corner of its face.
#[derive(Clone, Debug)]
pub struct Topology {
    pub incidence: Incidence,
    twin: Vec<u32>,
    edges: usize,
    boundary_edges: usize,
    irregular_edges: Vec<IrregularEdge>,
}

/// An edge that is not the meeting of at most two, oppositely directed faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IrregularEdge {
    /// The two vertices, the smaller first.
    pub vertices: [u32; 2],
    /// How many face sides lie on it.
    pub sides: u32,
    /// A face on it: that of the last side.
    pub face: u32,
    /// Exactly two sides, both in the same direction.
    pub misoriented: bool,
}

impl Topology {
    /// Pairs the half-edges: a counting sort by smaller vertex, then a sort of each (short) bucket.
    /// O(corners) time for bounded valences, O(n log n) within a vertex of valence n.
    ///
    /// A side whose edge has one side only, more than two, or two in the same direction has no twin;
    /// [`irregular_edges`](Self::irregular_edges) lists the latter two kinds.
    ///
    /// # Panics
    /// If a corner names a vertex ≥ `vertices`.
    pub fn new(faces: &Faces, vertices: usize) -> Self {
        let incidence = Incidence::new(faces, vertices);
        let corners = faces.corners();
        let mut twin = vec![NONE; corners.len()];
        let mut edges = 0;
        let mut boundary_edges = 0;
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
                    [_] => boundary_edges += 1,
                    [(w, a), (_, b)]
                        if (corners[a as usize] as usize == v)
                            != (corners[b as usize] as usize == v)
                            && w as usize != v =>
                    {
                        twin[a as usize] = b;
                        twin[b as usize] = a;
                    }
                    [.., (w, last)] => irregular_edges.push(IrregularEdge {
                        vertices: [v as u32, w],
                        sides: edge.len() as u32,
                        face: incidence.face_of(last) as u32,
                        misoriented: edge.len() == 2,
                    }),
                    [] => {}
                }
            }
        }
        Topology {
            incidence,
            twin,
            edges,
            boundary_edges,
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
        self.boundary_edges
    }

    /// Edges with more than two sides, or with two in the same direction.
    pub fn irregular_edges(&self) -> &[IrregularEdge] {
        &self.irregular_edges
    }

    /// Whether every edge has two oppositely directed sides.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.irregular_edges.is_empty()
    }

    /// One half-edge of every edge: that of the smaller index.
    pub fn edge_sides(&self) -> impl Iterator<Item = u32> + '_ {
        self.twin
            .iter()
            .enumerate()
            .filter(|&(c, &t)| c as u32 <= t)
            .map(|(c, _)| c as u32)
    }

    /// The number of edges at every vertex. Loops and repeated edges count as often as they occur.
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
        let mut label = vec![NONE; n];
        let mut stack = Vec::new();
        let mut count = 0u32;
        for seed in 0..n {
            if label[seed] != NONE {
                continue;
            }
            label[seed] = count;
            stack.push(seed);
            while let Some(v) = stack.pop() {
                for &c in self.incidence.corners_at(v) {
                    let range = faces.range(self.incidence.face_of(c));
                    // The neighbours along the two sides suffice: faces are connected by their sides.
                    for w in [next_in(&range, c), prev_in(&range, c)] {
                        let w = faces.corners()[w as usize] as usize;
                        if label[w] == NONE {
                            label[w] = count;
                            stack.push(w);
                        }
                    }
                }
            }
            count += 1;
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
