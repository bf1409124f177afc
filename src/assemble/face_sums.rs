//! Matrix-free rows on meshes of mixed polygons, by sums over faces: what a face adds to M is of rank one, or three,
//! whatever its size, so a sweep sums each face once and every corner reads the sum. Only incidence is stored.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DVec3, Vec3A};

use super::weights::{Point, RowKind, RowShape, Weight};
use crate::mesh::incidence::split_rows;
use crate::mesh::numbering::add_up;
use crate::mesh::order::Numbering;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Incidence};
use crate::pages::{filled, large};
use crate::parallel;
use crate::prefetch::prefetch;
use crate::schemes::Scheme;

/// Faces are ordered by the block of so many rows that the first of their corners is in, and by size within a block.
pub const BLOCK: usize = 1024;
/// Rows, or faces, of one task.
const CHUNK: usize = 4096;
/// Corners, or faces, between what is read and what is fetched for later. Tuned.
const AHEAD: usize = 64;
/// Faces of this size and of greater ones share a place in that order.
const LARGE: usize = 9;

/// cos and sin of 2πt/m at the places t of a face of m corners.
type Turn<W> = [W; 2];

/// The faces whose sums rows need, and what these rows read.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// Of each face Σ x, and Σ cos·x and Σ sin·x where the scheme's circulant has a cosine: 1 or 3.
    parts: usize,
    /// What a face adds between the places s and t, `constant + cosine·cos(2π(s−t)/m)`: by size m.
    weights: Vec<[f64; 2]>,
    /// By size: where its turns start.
    first_turn: Vec<u32>,
    /// What a face adds between places t apart, t = 1 − m…m − 1, twice as far from the start as its turns.
    circulants: Vec<f64>,
    double: Vec<Turn<f64>>,
    single: Vec<Turn<Vec3A>>,
    /// By face, in the order of the sums: where its corners start, and the end.
    offsets: Vec<u32>,
    /// Rows.
    corners: Vec<u32>,
    /// The first faces of the runs of equal size.
    runs: Vec<u32>,
    /// The first face of each block of rows, and the end.
    blocks: Vec<u32>,
    /// By row: where its faces start, and the end.
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// To each of these, the turn of the row in it; empty if there is one part only.
    places: Vec<u32>,
    /// The greatest distance between two rows of a face.
    reach: usize,
}

/// Faces that are summed, at rows that read no sums: what changes where such a row does.
#[derive(Clone, Debug)]
pub(super) struct Others {
    /// By row: where its faces start, and the end.
    starts: Vec<u32>,
    faces: Vec<u32>,
}

impl Others {
    #[inline]
    fn at(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }
}

impl Polygons {
    /// For the rows of the kind [`RowKind::Polygons`]; valences are by row. O(corners), in parallel but for a counting sort
    /// of the faces.
    pub(super) fn new(
        faces: &Faces,
        incidence: &Incidence,
        scheme: Scheme,
        numbering: Option<&Numbering>,
        shapes: &[RowShape],
    ) -> Self {
        let mut all = Polygons::default();
        if parallel::all(shapes.len(), |i| shapes[i].kind() != RowKind::Polygons) {
            return all;
        }
        let row = |v: u32| numbering.map_or(v, |numbering| numbering.place()[v as usize]);
        let mut numbers = all.keys(faces, shapes, row);
        let sorted = all.sort(&mut numbers, shapes.len().div_ceil(BLOCK));
        all.measure(faces, scheme, &sorted);
        all.corners = large(vec![0; all.offsets.last().map_or(0, |&end| end as usize)]);
        parallel::parts(split_rows(&all.offsets, CHUNK, &mut all.corners), |some, mut rest| {
            for &f in &sorted[some] {
                let face = faces.face(f as usize);
                let (corners, after) = rest.split_at_mut(face.len());
                corners.iter_mut().zip(face).for_each(|(c, &v)| *c = row(v));
                rest = after;
            }
        });
        all.list(faces, incidence, numbering, shapes, &numbers);
        all
    }

    /// By face: the key to sort it by; [`NONE`] if no row needs its sum.
    fn keys(&mut self, faces: &Faces, shapes: &[RowShape], row: impl Fn(u32) -> u32 + Sync) -> Vec<u32> {
        let mut keys = large(vec![NONE; faces.len()]);
        let mut reach = vec![0; keys.len().div_ceil(CHUNK)];
        parallel::chunks_with(&mut keys, CHUNK, &mut reach, |start, keys, reach| {
            for (f, key) in (start..).zip(keys) {
                let face = faces.face(f);
                let (mut first, mut last, mut summed) = (NONE, 0, false);
                for &v in face {
                    let i = row(v);
                    (first, last) = (first.min(i), last.max(i));
                    summed |= shapes[i as usize].kind() == RowKind::Polygons;
                }
                if summed {
                    *key = (first as usize / BLOCK * (LARGE + 1) + face.len().min(LARGE)) as u32;
                    *reach = last.abs_diff(first).max(*reach);
                }
            }
        });
        self.reach = reach.into_iter().max().unwrap_or(0) as usize;
        keys
    }

    /// The faces by their keys, which become their places among them.
    fn sort(&mut self, keys: &mut [u32], blocks: usize) -> Vec<u32> {
        let mut starts = vec![0u32; blocks * (LARGE + 1) + 1];
        for &key in keys.iter().filter(|&&key| key != NONE) {
            starts[key as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        self.blocks = starts.iter().copied().step_by(LARGE + 1).collect();
        let mut sorted = large(vec![0; self.blocks[blocks] as usize]);
        for (f, key) in (0..).zip(keys).filter(|(_, key)| **key != NONE) {
            let next = &mut starts[*key as usize];
            *key = *next;
            sorted[*next as usize] = f;
            *next += 1;
        }
        sorted
    }

    /// Where corners start, and what is known by size.
    fn measure(&mut self, faces: &Faces, scheme: Scheme, sorted: &[u32]) {
        self.offsets = large(Vec::with_capacity(sorted.len() + 1));
        self.offsets.push(0);
        let (mut end, mut last) = (0, usize::MAX);
        for (k, &f) in (0..).zip(sorted) {
            let size = faces.range(f as usize).len();
            end += size as u32;
            self.offsets.push(end);
            if size == last {
                continue;
            }
            last = size;
            self.runs.push(k);
            if size >= self.weights.len() {
                self.weights.resize(size + 1, [0.0; 2]);
                self.first_turn.resize(size + 1, NONE);
            }
            if self.first_turn[size] == NONE {
                let circulant = scheme.circulant(size);
                self.weights[size] = [circulant.constant, circulant.cosine];
                self.first_turn[size] = self.double.len() as u32;
                self.parts = if circulant.cosine == 0.0 { 1 } else { 3 };
                self.double.extend((0..size).map(|t| turn(t, size)));
                let turns = &self.double[self.double.len() - size..];
                let places = (1..size).rev().chain(0..size);
                let weight = |t: usize| circulant.constant + circulant.cosine * turns[t][0];
                self.circulants.extend(places.map(weight));
                self.circulants.push(0.0);
            }
        }
        self.single = self.double.iter().map(|t| t.map(<Vec3A as Weight>::of)).collect();
    }

    /// The faces at every row.
    fn list(
        &mut self,
        faces: &Faces,
        incidence: &Incidence,
        numbering: Option<&Numbering>,
        shapes: &[RowShape],
        numbers: &[u32],
    ) {
        let length = |i: usize| if shapes[i].kind() == RowKind::Polygons { shapes[i].valence() } else { 0 };
        self.starts = parallel::offsets(shapes.len(), length).expect("no more faces at all rows than corners");
        let listed = self.table(faces, incidence, numbering, |c| numbers[incidence.face_of(c)]);
        if self.parts > 1 {
            let places = self.table(faces, incidence, numbering, |c| {
                let range = faces.range(incidence.face_of(c));
                self.first_turn[range.len()] + c - range.start as u32
            });
            self.places = places;
        }
        self.faces = listed;
    }

    /// `value(corner)` for the corners at all rows that read sums.
    fn table(
        &self,
        faces: &Faces,
        incidence: &Incidence,
        numbering: Option<&Numbering>,
        value: impl Fn(u32) -> u32 + Sync,
    ) -> Vec<u32> {
        let count = self.starts.last().map_or(0, |&end| end as usize);
        let mut table = large(vec![0; count]);
        parallel::parts(split_rows(&self.starts, CHUNK, &mut table), |rows, mut rest| {
            for i in rows.filter(|&i| !self.at(i).is_empty()) {
                if let Some(numbering) = numbering {
                    incidence.fetch_ahead(faces, numbering.order(), i);
                }
                let v = numbering.map_or(i, |numbering| numbering.order()[i] as usize);
                let corners = incidence.corners_at(v);
                let (at, after) = rest.split_at_mut(corners.len());
                at.iter_mut().zip(corners).for_each(|(slot, &c)| *slot = value(c));
                rest = after;
            }
        });
        table
    }

    pub(super) fn reach(&self) -> usize {
        self.reach
    }

    /// The number of faces at row `i`.
    #[inline]
    pub(super) fn valence(&self, i: usize) -> usize {
        self.at(i).len()
    }

    /// Where the faces of row `i` are listed.
    #[inline]
    pub(super) fn at(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// Bytes that one sweep reads.
    pub(super) fn bytes(&self) -> usize {
        let lists = [&self.offsets, &self.corners, &self.starts, &self.faces, &self.places];
        4 * lists.into_iter().map(Vec::len).sum::<usize>()
    }

    /// Where the sums lie, among those of all faces, of the faces whose first corner is in `rows`: blocks of rows, or up
    /// to the last. Nowhere if no face is summed.
    pub(super) fn sums_of(&self, rows: Range<usize>) -> Range<usize> {
        if self.blocks.is_empty() {
            return 0..0;
        }
        let first = |row: usize| {
            debug_assert!(row.is_multiple_of(BLOCK) || row.div_ceil(BLOCK) + 1 == self.blocks.len());
            self.parts * self.blocks[row.div_ceil(BLOCK)] as usize
        };
        first(rows.start)..first(rows.end)
    }

    /// What the faces add to the diagonal of M at row `i`.
    pub(super) fn diagonal(&self, i: usize) -> f64 {
        let at = self.faces[self.at(i)].iter();
        at.map(|&f| {
            let [constant, cosine] = self.weights[self.size(f as usize)];
            constant + cosine
        })
        .sum()
    }

    fn size(&self, f: usize) -> usize {
        (self.offsets[f + 1] - self.offsets[f]) as usize
    }

    fn corners_of(&self, f: usize) -> &[u32] {
        &self.corners[self.offsets[f] as usize..self.offsets[f + 1] as usize]
    }

    /// The corners of face `e` of those listed, and what it adds to M between each of them and the row that lists it.
    #[inline(always)]
    fn block(&self, e: usize) -> (&[u32], &[f64]) {
        let corners = self.corners_of(self.faces[e] as usize);
        let size = corners.len();
        let first = self.first_turn[size] as usize;
        let place = self.places.get(e).map_or(0, |&place| place as usize - first);
        let circulant = &self.circulants[2 * first + size - 1 - place..];
        (corners, &circulant[..size])
    }

    /// Calls `visit(j, m)` for what each face adds to the row of M at row `i`, at each other corner j.
    pub(super) fn entries(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        for e in self.at(i) {
            let (corners, weights) = self.block(e);
            for (&j, &m) in corners.iter().zip(weights).filter(|&(&j, _)| j as usize != i) {
                visit(j as usize, m);
            }
        }
    }

    /// All sums.
    pub(super) fn all_sums<P: Point>(&self, x: &[P], sums: &mut Vec<P>) {
        let count = self.sums_of(0..self.starts.len().saturating_sub(1)).end;
        if sums.len() != count {
            *sums = filled(count, P::ZERO);
        }
        parallel::chunks(sums, self.parts.max(1) * CHUNK, |first, sums| self.sum(first, (x, 0), sums));
    }

    /// The sums from number `first` on, of whole faces. `points` holds x from row `start` on, as far as these reach.
    pub(super) fn sum<P: Point>(&self, first: usize, (points, start): (&[P], usize), sums: &mut [P]) {
        if sums.is_empty() {
            return;
        }
        let faces = first / self.parts..(first + sums.len()) / self.parts;
        let mut next = self.runs.partition_point(|&r| r as usize <= faces.start);
        let (mut from, mut rest) = (faces.start, sums);
        while from < faces.end {
            let to = self.runs.get(next).map_or(faces.end, |&r| faces.end.min(r as usize));
            next += 1;
            let corners = self.offsets[from] as usize..self.offsets[to] as usize;
            let (sums, after) = rest.split_at_mut(self.parts * (to - from));
            rest = after;
            match self.size(from) {
                3 => self.sum_run(3, corners, (points, start), sums),
                4 => self.sum_run(4, corners, (points, start), sums),
                5 => self.sum_run(5, corners, (points, start), sums),
                6 => self.sum_run(6, corners, (points, start), sums),
                size => self.sum_run(size, corners, (points, start), sums),
            }
            from = to;
        }
    }

    /// The sums of faces of one size.
    #[inline(always)]
    fn sum_run<P: Point>(&self, size: usize, corners: Range<usize>, (points, start): (&[P], usize), sums: &mut [P]) {
        let point = |&v: &u32| points[(v as usize).wrapping_sub(start)];
        let far = is_far(points);
        let ahead = self.corners.get(corners.start + AHEAD..).unwrap_or_default();
        let mut ahead = ahead.chunks_exact(size);
        let mut fetch = || {
            for &v in ahead.next().unwrap_or_default() {
                prefetch(points, (v as usize).wrapping_sub(start));
            }
        };
        let corners = &self.corners[corners];
        let [constant, cosine] = self.weights[size].map(P::Weight::of);
        if self.parts == 1 {
            for (corners, sum) in corners.chunks_exact(size).zip(sums) {
                if far {
                    fetch();
                }
                let mut total = point(&corners[0]);
                corners[1..].iter().for_each(|v| total += point(v));
                *sum = total.times(constant);
            }
            return;
        }
        let turns = &P::Weight::pairs(&self.double, &self.single)[self.first_turn[size] as usize..][..size];
        for (corners, sums) in corners.chunks_exact(size).zip(sums.as_chunks_mut::<3>().0) {
            if far {
                fetch();
            }
            let mut total = point(&corners[0]);
            let (mut cos, mut sin) = (total, P::ZERO);
            for (v, turn) in corners.iter().zip(turns).skip(1) {
                let p = point(v);
                total += p;
                cos += p.times(turn[0]);
                sin += p.times(turn[1]);
            }
            *sums = [total.times(constant), cos.times(cosine), sin.times(cosine)];
        }
    }

    /// What the faces at each row add up to, where all rows have `valence` of them, their sums known from number `first`
    /// on.
    pub(super) fn gather<P: Point>(&self, rows: Range<usize>, valence: usize, sums: (&[P], usize), out: &mut [P]) {
        match valence {
            3 => self.gather_run(rows, 3, sums, out),
            4 => self.gather_run(rows, 4, sums, out),
            5 => self.gather_run(rows, 5, sums, out),
            6 => self.gather_run(rows, 6, sums, out),
            n => self.gather_run(rows, n, sums, out),
        }
    }

    #[inline(always)]
    fn gather_run<P: Point>(&self, rows: Range<usize>, n: usize, (sums, first): (&[P], usize), out: &mut [P]) {
        let far = is_far(sums);
        let turns = P::Weight::pairs(&self.double, &self.single);
        let start = self.at(rows.start).start;
        for (k, out) in out.iter_mut().enumerate() {
            let e = start + k * n..start + (k + 1) * n;
            if far {
                let ahead = self.faces.get(e.start + AHEAD..e.end + AHEAD);
                for &f in ahead.unwrap_or_default() {
                    prefetch(sums, (self.parts * f as usize).wrapping_sub(first));
                }
            }
            let faces = &self.faces[e.clone()];
            let mut total = P::ZERO;
            if self.parts == 1 {
                for &f in faces {
                    total += sums[(f as usize).wrapping_sub(first)];
                }
            } else {
                for (&f, &place) in faces.iter().zip(&self.places[e]) {
                    let at = (3 * f as usize).wrapping_sub(first);
                    let [cos, sin] = turns[place as usize];
                    let sums = &sums[at..at + 3];
                    total += sums[0] + sums[1].times(cos) + sums[2].times(sin);
                }
            }
            *out = total;
        }
    }

    /// Whether sums are kept up with an iterate that changes row by row: where there is one a face. With three, and as many
    /// turns to be read, a row that makes them anew is as fast.
    pub(super) fn follow_rows(&self) -> bool {
        self.parts == 1
    }

    /// What the faces at row `i` add up to, where `sum(f)` is that of a face: O(faces).
    #[inline]
    pub(super) fn total(&self, i: usize, sum: impl Fn(usize) -> DVec3) -> DVec3 {
        let faces = self.faces[self.at(i)].iter();
        faces.fold(DVec3::ZERO, |total, &f| total + sum(f as usize))
    }

    /// Calls `add(f, part)` for what is to be added to the sum of each face at row `i` where its point changes by `change`.
    /// `others` are those of rows that read no sums. O(faces).
    #[inline]
    pub(super) fn follow(&self, others: &Others, i: usize, change: DVec3, mut add: impl FnMut(usize, DVec3)) {
        for &f in self.faces[self.at(i)].iter().chain(&others.faces[others.at(i)]) {
            let [constant, _] = self.weights[self.size(f as usize)];
            add(f as usize, constant * change);
        }
    }

    /// The faces that are summed at rows that read no sums, as they are not of the kind [`RowKind::Polygons`]. O(corners).
    pub(super) fn others(&self, kinds: &[RowKind]) -> Others {
        let reads = |v: u32| kinds[v as usize] == RowKind::Polygons;
        let mut starts = large(vec![0; kinds.len() + 1]);
        for &v in self.corners.iter().filter(|&&v| !reads(v)) {
            starts[v as usize + 1] += 1;
        }
        add_up(&mut starts);
        let mut next = starts.clone();
        let mut faces = vec![0; next[kinds.len()] as usize];
        for f in 0..self.offsets.len() - 1 {
            for &v in self.corners_of(f).iter().filter(|&&v| !reads(v)) {
                faces[next[v as usize] as usize] = f as u32;
                next[v as usize] += 1;
            }
        }
        Others { starts, faces }
    }

    /// What the faces at row `i` add up to, for this row alone: O(corners of these faces).
    #[inline]
    pub(super) fn row<P: Point>(&self, i: usize, (points, start): (&[P], usize)) -> P {
        let mut total = P::ZERO;
        for e in self.at(i) {
            let (corners, weights) = self.block(e);
            // A sum of its own, so that no face need wait for another.
            let mut part = P::ZERO;
            for (&j, &m) in corners.iter().zip(weights) {
                part += points[(j as usize).wrapping_sub(start)].times(P::Weight::of(m));
            }
            total += part;
        }
        total
    }
}

/// Whether an array is too long to stay in a processor's own cache, so that what is read of it is worth fetching ahead;
/// elsewhere that costs a fifth.
#[inline(always)]
fn is_far<P>(array: &[P]) -> bool {
    size_of_val(array) > 1 << 21
}

/// cos and sin of the place `t` in a face of `size` corners.
fn turn(t: usize, size: usize) -> Turn<f64> {
    let (sin, cos) = (TAU * t as f64 / size as f64).sin_cos();
    [cos, sin]
}
