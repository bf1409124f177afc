//! The corners at every vertex and the face of every corner, in linear time by a counting sort, in parallel.

use std::ops::Range;

use super::Faces;
use crate::pages::large;
use crate::parallel;
use crate::prefetch::prefetch;

/// Marks an absent index in the arrays of this room.
pub const NONE: u32 = u32::MAX;
/// Vertices of one task.
const CHUNK: usize = 4096;
/// Up to this many faces at a vertex, its sides are compared each with each; beyond, sorted.
pub(super) const FEW: usize = 16;

/// The corners at every vertex, in ascending order, and the face of every corner. This is all that the
/// assembly of a limit matrix needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    offsets: Vec<u32>,
    corners: Vec<u32>,
    face: FaceOf,
}

/// The face of a corner: a division among triangles, and among quads.
#[derive(Clone, Debug, PartialEq, Eq)]
enum FaceOf {
    Triangles,
    Quads,
    Table(Vec<u32>),
}

impl FaceOf {
    fn new(faces: &Faces) -> Self {
        match faces.uniform_size() {
            Some(3) => return FaceOf::Triangles,
            Some(4) => return FaceOf::Quads,
            _ => {}
        }
        let mut table = large(vec![0; faces.corners().len()]);
        parallel::parts(split_by_face(faces, CHUNK, &mut table), |rows, mut part| {
            for f in rows {
                let (face, rest) = part.split_at_mut(faces.range(f).len());
                face.fill(f as u32);
                part = rest;
            }
        });
        FaceOf::Table(table)
    }
}

impl Incidence {
    /// A counting sort of the corners by vertex, in parallel: O(corners), stable.
    ///
    /// # Panics
    /// If a corner names a vertex ≥ `vertices` (the validator reports such faces before).
    pub fn new(faces: &Faces, vertices: usize) -> Self {
        Self::checked(faces, vertices).expect("every corner names a vertex")
    }

    /// As [`new`](Self::new); `None` if a corner names no vertex.
    pub(crate) fn checked(faces: &Faces, vertices: usize) -> Option<Self> {
        let (offsets, corners) = sorted_below(faces.corners(), vertices)?;
        Some(Incidence::from_parts(offsets, corners, faces))
    }

    /// From its arrays.
    pub(crate) fn from_parts(offsets: Vec<u32>, corners: Vec<u32>, faces: &Faces) -> Self {
        Incidence { offsets, corners, face: FaceOf::new(faces) }
    }

    /// The number of vertices N.
    pub fn vertices(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The corners at vertex `v`, ascending, so ordered by face.
    pub fn corners_at(&self, v: usize) -> &[u32] {
        &self.corners[self.offsets[v] as usize..self.offsets[v + 1] as usize]
    }

    /// The corners at all vertices, those of vertex `v` from [`offsets`](Self::offsets)`[v]` on.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Where the corners at each vertex start in [`corners`](Self::corners), and the end.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The number of faces at vertex `v`: its valence n on a closed mesh.
    pub fn face_count(&self, v: usize) -> usize {
        (self.offsets[v + 1] - self.offsets[v]) as usize
    }

    /// The face of corner `c`.
    #[inline]
    pub fn face_of(&self, c: u32) -> usize {
        match &self.face {
            FaceOf::Triangles => (c / 3) as usize,
            FaceOf::Quads => (c / 4) as usize,
            FaceOf::Table(table) => table[c as usize] as usize,
        }
    }

    /// Fetches what a walk over the faces at the vertices of `order`, now at place `k`, will soon read, in the
    /// order in which one look-up needs the other.
    #[inline(always)]
    pub(crate) fn fetch_ahead(&self, faces: &Faces, order: &[u32], k: usize) {
        /// Vertices between one look-up and the next. Tuned.
        const AHEAD: usize = 8;
        if let Some(&v) = order.get(k + 3 * AHEAD) {
            prefetch(&self.offsets, v as usize);
        }
        if let Some(&v) = order.get(k + 2 * AHEAD) {
            prefetch(&self.corners, self.offsets[v as usize] as usize);
        }
        if let Some(&v) = order.get(k + AHEAD) {
            for &c in self.corners_at(v as usize) {
                prefetch(faces.corners(), c as usize);
                if let FaceOf::Table(table) = &self.face {
                    prefetch(table, c as usize);
                }
            }
        }
    }

    /// The corner after `c` in its face.
    #[inline]
    pub fn next(&self, faces: &Faces, c: u32) -> u32 {
        match &self.face {
            FaceOf::Triangles if c % 3 == 2 => c - 2,
            FaceOf::Triangles => c + 1,
            FaceOf::Quads => (c & !3) | ((c + 1) & 3),
            FaceOf::Table(table) => next_in(&faces.range(table[c as usize] as usize), c),
        }
    }

    /// The corner before `c` in its face.
    #[inline]
    pub fn prev(&self, faces: &Faces, c: u32) -> u32 {
        match &self.face {
            FaceOf::Triangles if c.is_multiple_of(3) => c + 2,
            FaceOf::Triangles => c - 1,
            FaceOf::Quads => (c & !3) | (c.wrapping_sub(1) & 3),
            FaceOf::Table(table) => prev_in(&faces.range(table[c as usize] as usize), c),
        }
    }

    /// Whether every side of a face has exactly one opposite (one other side between its vertices, in the other
    /// direction), and the faces at every vertex form one umbrella. In parallel, O(Σ n²) over the valences n up to 16,
    /// with sorts beyond.
    ///
    /// ```
    /// use limitlab::mesh::{Faces, Incidence};
    /// let closed = |faces: &Faces| Incidence::new(faces, 4).is_closed_manifold(faces);
    /// let tetrahedron = [[0u32, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    /// assert!(closed(&Faces::from_lists(tetrahedron)));
    /// assert!(!closed(&Faces::from_lists(&tetrahedron[1..])));
    /// ```
    pub fn is_closed_manifold(&self, faces: &Faces) -> bool {
        self.boundary_vertices(faces).is_some_and(|vertices| vertices.is_empty())
    }

    /// The vertices on the boundary, ascending, of an oriented manifold: every side of a face has one opposite at the most,
    /// and the faces at every vertex form one umbrella, or one fan. `None` if this is none. In parallel, in the same time.
    ///
    /// ```
    /// use limitlab::mesh::{Faces, Incidence};
    /// let boundary = |faces: &Faces| Incidence::new(faces, 4).boundary_vertices(faces);
    /// let tetrahedron = [[0u32, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    /// assert_eq!(boundary(&Faces::from_lists(&tetrahedron[1..])), Some(vec![0, 1, 2]));
    /// // A face turned round.
    /// assert_eq!(boundary(&Faces::from_lists([[0u32, 1, 2], [0, 1, 3]])), None);
    /// ```
    pub fn boundary_vertices(&self, faces: &Faces) -> Option<Vec<u32>> {
        // Compiled for each kind of face.
        match &self.face {
            FaceOf::Triangles => self.boundary_by(faces, |c| (c - c % 3 + (c + 1) % 3, c - c % 3 + (c + 2) % 3)),
            FaceOf::Quads => self.boundary_by(faces, |c| (c & !3 | (c + 1) & 3, c & !3 | (c + 3) & 3)),
            FaceOf::Table(_) => self.boundary_by(faces, |c| (self.next(faces, c), self.prev(faces, c))),
        }
    }

    /// `beside` tells the corners after and before one in its face.
    fn boundary_by(&self, faces: &Faces, beside: impl Fn(u32) -> (u32, u32) + Sync) -> Option<Vec<u32>> {
        let corners = faces.corners();
        let parts = parallel::map(self.vertices(), CHUNK, |range| {
            let mut found = Vec::new();
            for v in range {
                if self.is_met_twice(v) {
                    return None;
                }
                let sides = self.corners_at(v).iter().map(|&c| {
                    let (after, before) = beside(c);
                    (corners[after as usize], corners[before as usize])
                });
                // Eight at a time, by one comparison of all: a vertex of more faces is rare.
                let is_umbrella = match sides.len() {
                    n if n > FEW => one_umbrella(v, sides),
                    n if n <= FEW / 2 => each_once::<{ FEW / 2 }>(v, sides),
                    _ => each_once::<FEW>(v, sides),
                };
                if !is_umbrella {
                    fan(v, self.sides_at(faces, v))?;
                    found.push(v as u32);
                }
            }
            Some(found)
        });
        let parts: Option<Vec<Vec<u32>>> = parts.into_iter().collect();
        Some(parts?.concat())
    }

    /// The half-edge that leaves a boundary vertex of a manifold along the boundary.
    pub fn boundary_side(&self, faces: &Faces, v: usize) -> Option<u32> {
        fan(v, self.sides_at(faces, v)).map(|first| self.corners_at(v)[first])
    }

    /// The half-edge from one vertex to the other, or back where there is only that. O(valence).
    pub fn half_edge(&self, faces: &Faces, [from, to]: [u32; 2]) -> Option<u32> {
        let leaving = |[from, to]: [u32; 2]| {
            let at = if (from as usize) < self.vertices() { from as usize } else { return None };
            let leads = |&&c: &&u32| faces.corners()[self.next(faces, c) as usize] == to;
            self.corners_at(at).iter().find(leads).copied()
        };
        leaving([from, to]).or_else(|| leaving([to, from]))
    }

    /// Of each face at `v`: the vertex that a side leaves for, and the one that a side enters from.
    fn sides_at<'a>(&'a self, faces: &'a Faces, v: usize) -> impl Iterator<Item = (u32, u32)> + 'a {
        let corners = faces.corners();
        self.corners_at(v).iter().map(move |&c| {
            let (after, before) = (self.next(faces, c), self.prev(faces, c));
            (corners[after as usize], corners[before as usize])
        })
    }

    /// Whether a face passes `v` more than once.
    #[inline(always)]
    fn is_met_twice(&self, v: usize) -> bool {
        // Among triangles such corners follow each other: a side from `v` to itself.
        let at = self.corners_at(v);
        !matches!(self.face, FaceOf::Triangles) && at.windows(2).any(|c| self.face_of(c[0]) == self.face_of(c[1]))
    }
}

/// A counting sort: where the numbers k of each key `keys[k]` start, and the end; and these numbers, ascending for each key.
/// In parallel: each thread reads all keys and sorts those in a range of its own. O(keys + end).
///
/// # Panics
/// If a key is `end` or greater.
pub(super) fn sorted_by(keys: &[u32], end: usize) -> (Vec<u32>, Vec<u32>) {
    sorted_below(keys, end).expect("every key is below the end")
}

/// As [`sorted_by`]; `None` if a key is `end` or greater.
fn sorted_below(keys: &[u32], end: usize) -> Option<(Vec<u32>, Vec<u32>)> {
    /// Beyond these many threads, reading the keys outweighs sorting them.
    const MOST_PARTS: usize = 8;
    let parts = rayon::current_num_threads().min(MOST_PARTS);
    let share = end.div_ceil(parts).max(CHUNK);
    let mut offsets = large(vec![0u32; end + 1]);
    parallel::chunks(&mut offsets[1..], share, |first, counts| {
        let first = first as u32;
        for &key in keys {
            if let Some(count) = counts.get_mut(key.wrapping_sub(first) as usize) {
                *count += 1;
            }
        }
    });
    for key in 0..end {
        offsets[key + 1] += offsets[key];
    }
    if offsets[end] as usize != keys.len() {
        return None;
    }
    let mut sorted = large(vec![0u32; keys.len()]);
    parallel::parts(split_rows(&offsets, share, &mut sorted), |rows, sorted| {
        let base = offsets[rows.start];
        let mut next = large(Vec::with_capacity(rows.len()));
        next.extend(offsets[rows.clone()].iter().map(|&o| o - base));
        let first = rows.start as u32;
        for (&key, k) in keys.iter().zip(0..) {
            if let Some(slot) = next.get_mut(key.wrapping_sub(first) as usize) {
                sorted[*slot as usize] = k;
                *slot += 1;
            }
        }
    });
    Some((offsets, sorted))
}

/// Whether the vertices where sides leave `v` for are the ones that sides enter it from, no two the same and none `v`,
/// and the faces form one umbrella; at most `MOST`.
#[inline(always)]
fn each_once<const MOST: usize>(v: usize, sides: impl Iterator<Item = (u32, u32)>) -> bool {
    // What no place of a list holds is no vertex.
    let (mut out, mut into) = ([NONE; MOST], [NONE; MOST]);
    let mut count = 0;
    for (k, (to, from)) in sides.enumerate() {
        (out[k], into[k]) = (to, from);
        count += 1;
    }
    // Across the side that enters, the next face counter-clockwise: one bit for each side that leaves for the same vertex.
    let mut next = [0u32; MOST];
    let mut wrong = u32::from(count == 0);
    for (next, &w) in next.iter_mut().zip(&into[..count]) {
        let meeting: u32 = (0..MOST).zip(out).map(|(k, x)| u32::from(x == w) << k).sum();
        wrong |= u32::from(meeting == 0) | u32::from(w as usize == v);
        *next = meeting.trailing_zeros();
    }
    if wrong != 0 {
        return false;
    }
    // A turn through all faces passes each side that leaves once, so that no two lead to one vertex.
    let mut place = 0;
    for turns in 1..=count {
        place = next[place as usize];
        if place == 0 {
            return turns == count;
        }
    }
    false
}

/// As [`each_once`], for any number of faces.
fn one_umbrella(v: usize, sides: impl Iterator<Item = (u32, u32)>) -> bool {
    let (mut out, into): (Vec<(u32, u32)>, Vec<u32>) = (0..).zip(sides).map(|(k, (to, from))| ((to, k), from)).unzip();
    out.sort_unstable();
    let leaves_once = out.windows(2).all(|w| w[0].0 != w[1].0) && out.iter().all(|&(w, _)| w as usize != v);
    let find = |w: u32| out.binary_search_by_key(&w, |&(to, _)| to).ok().map(|at| out[at].1);
    let mut place = 0;
    for turns in 1..=into.len() {
        match find(into[place as usize]) {
            Some(0) => return leaves_once && turns == into.len(),
            Some(next) => place = next,
            None => return false,
        }
    }
    false
}

/// The first face, counter-clockwise, of the faces at `v` if they form one fan: their sides meet one by one, but for the first
/// that leaves and the last that enters.
fn fan(v: usize, sides: impl Iterator<Item = (u32, u32)>) -> Option<usize> {
    let (mut out, into): (Vec<(u32, usize)>, Vec<u32>) =
        (0..).zip(sides).map(|(k, (to, from))| ((to, k), from)).unzip();
    out.sort_unstable();
    let mut entered = into.clone();
    entered.sort_unstable();
    let sound = out.windows(2).all(|w| w[0].0 != w[1].0)
        && entered.windows(2).all(|w| w[0] != w[1])
        && out.iter().all(|&(w, _)| w as usize != v)
        && into.iter().all(|&w| w as usize != v);
    if !sound {
        return None;
    }
    let mut starts = out.iter().filter(|&(w, _)| entered.binary_search(w).is_err());
    let (Some(&(_, first)), None) = (starts.next(), starts.next()) else { return None };
    let mut place = first;
    for turns in 1..=into.len() {
        match out.binary_search_by_key(&into[place], |&(to, _)| to) {
            Ok(at) => place = out[at].1,
            Err(_) => return (turns == into.len()).then_some(first),
        }
    }
    None
}

/// Cuts `values`, of which row i is `offsets[i]..offsets[i + 1]`, after every `chunk` rows.
pub(crate) fn split_rows<'a, T>(
    offsets: &[u32],
    chunk: usize,
    values: &'a mut [T],
) -> Vec<(Range<usize>, &'a mut [T])> {
    split(offsets.len() - 1, chunk, values, |rows| (offsets[rows.end] - offsets[rows.start]) as usize)
}

/// Cuts `values`, one a corner, after the corners of every `chunk` faces.
pub(crate) fn split_by_face<'a, T>(
    faces: &Faces,
    chunk: usize,
    values: &'a mut [T],
) -> Vec<(Range<usize>, &'a mut [T])> {
    split(faces.len(), chunk, values, |rows| faces.range(rows.end - 1).end - faces.range(rows.start).start)
}

fn split<T>(
    rows: usize,
    chunk: usize,
    values: &mut [T],
    length: impl Fn(&Range<usize>) -> usize,
) -> Vec<(Range<usize>, &mut [T])> {
    let mut rest = values;
    (0..rows)
        .step_by(chunk)
        .map(|first| {
            let range = first..(first + chunk).min(rows);
            let (part, after) = std::mem::take(&mut rest).split_at_mut(length(&range));
            rest = after;
            (range, part)
        })
        .collect()
}

/// The corner after `c` in its face, whose corners are `range`.
pub fn next_in(range: &Range<usize>, c: u32) -> u32 {
    if c as usize + 1 == range.end { range.start as u32 } else { c + 1 }
}

/// The corner before `c` in its face, whose corners are `range`.
pub fn prev_in(range: &Range<usize>, c: u32) -> u32 {
    if c as usize == range.start { range.end as u32 - 1 } else { c - 1 }
}
