//! Rows of A from connectivity alone: which neighbours, with weights that follow from valence and face size. The
//! kernel of the matrix-free [`Operator`](super::Operator), for double and for single precision.

use std::f64::consts::TAU;
use std::ops::{Add, AddAssign, Range, Sub};

use glam::{DVec3, Vec3A};

use super::codes::{Code, Codes, Row, Window, Windows};
use crate::prefetch::prefetch;

/// What an operator acts on: three right-hand sides of one vertex, interleaved, in doubles (24 bytes) or singles
/// (16 bytes, one vector register); or a single one, for eigenvectors.
pub trait Point: Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + AddAssign {
    const ZERO: Self;
    /// A weight as the kernel multiplies by it.
    type Weight: Copy + Send + Sync;

    fn weight(w: f64) -> Self::Weight;
    fn times(self, w: Self::Weight) -> Self;
    /// The weights by valence in this precision.
    fn rings(stencil: &Stencil) -> &Rings<Self::Weight>;
}

impl Point for DVec3 {
    const ZERO: Self = DVec3::ZERO;
    type Weight = f64;

    #[inline(always)]
    fn weight(w: f64) -> f64 {
        w
    }
    #[inline(always)]
    fn times(self, w: f64) -> Self {
        w * self
    }
    #[inline(always)]
    fn rings(stencil: &Stencil) -> &Rings<f64> {
        &stencil.double
    }
}

impl Point for f64 {
    const ZERO: Self = 0.0;
    type Weight = f64;

    #[inline(always)]
    fn weight(w: f64) -> f64 {
        w
    }
    #[inline(always)]
    fn times(self, w: f64) -> Self {
        w * self
    }
    #[inline(always)]
    fn rings(stencil: &Stencil) -> &Rings<f64> {
        &stencil.double
    }
}

impl Point for Vec3A {
    const ZERO: Self = Vec3A::ZERO;
    // In every lane, so that a loop need not spread it.
    type Weight = Vec3A;

    #[inline(always)]
    fn weight(w: f64) -> Vec3A {
        Vec3A::splat(w as f32)
    }
    #[inline(always)]
    fn times(self, w: Vec3A) -> Self {
        w * self
    }
    #[inline(always)]
    fn rings(stencil: &Stencil) -> &Rings<Vec3A> {
        &stencil.single
    }
}

/// The weights of a row around a vertex of valence n whose faces are all of one kind, times h(n).
#[derive(Clone, Copy, Debug)]
pub struct Ring<W> {
    /// At the vertex itself.
    own: W,
    /// At each edge neighbour.
    edge: W,
    /// At the opposite corner of each quad.
    opposite: W,
}

/// [`Ring`]s by valence, where all faces are quads and where all are triangles.
#[derive(Clone, Debug, Default)]
pub struct Rings<W> {
    pub(super) quads: Vec<Ring<W>>,
    pub(super) edges: Vec<Ring<W>>,
}

impl<W> Ring<W> {
    pub(super) fn new(own: W, edge: W, opposite: W) -> Self {
        Ring {
            own,
            edge,
            opposite,
        }
    }
}

impl<W: Copy> Ring<W> {
    #[inline(always)]
    fn value<P: Point<Weight = W>>(&self, own: P, edge: P, opposite: P) -> P {
        own.times(self.own) + edge.times(self.edge) + opposite.times(self.opposite)
    }

    #[inline(always)]
    fn value_of_edges<P: Point<Weight = W>>(&self, own: P, edge: P) -> P {
        own.times(self.own) + edge.times(self.edge)
    }
}

impl Rings<f64> {
    pub(super) fn single(&self) -> Rings<Vec3A> {
        let single = |rings: &[Ring<f64>]| {
            rings
                .iter()
                .map(|r| {
                    Ring::new(
                        Vec3A::weight(r.own),
                        Vec3A::weight(r.edge),
                        Vec3A::weight(r.opposite),
                    )
                })
                .collect()
        };
        Rings {
            quads: single(&self.quads),
            edges: single(&self.edges),
        }
    }
}

/// How the weights of a row are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Quads only: n edge neighbours, then n opposite corners.
    Quads,
    /// Triangles only, or a scheme that knows edges only: n edge neighbours.
    Edges,
    /// Anything else: a weight stored with every neighbour.
    Listed,
}

/// What rows with stored weights need besides their neighbours.
#[derive(Clone, Debug, Default)]
pub struct Listed {
    /// The slot of every row; of use for listed rows only, and empty where there are none.
    pub(super) slots: Vec<u32>,
    /// By slot: the weight of the vertex itself.
    pub(super) own: Vec<f64>,
    /// By slot, with one more at the end: where the weights of its neighbours start.
    pub(super) starts: Vec<u32>,
    pub(super) weights: Vec<f64>,
    /// The neighbours to these weights, until they are encoded; then empty.
    pub(super) neighbours: Vec<u32>,
    /// By slot, with one more at the end: where the large faces at the vertex start in `corners`.
    pub(super) large_starts: Vec<u32>,
    /// A large face and the place of the vertex in it.
    pub(super) corners: Vec<(u32, u32)>,
    /// h of the vertex of each slot.
    pub(super) h: Vec<f64>,
}

/// The faces whose corners are summed rather than coupled one by one: a block of rank one, or three,
/// `constant + cosine·cos(2π(s−t)/m)` between places s and t.
#[derive(Clone, Debug, Default)]
pub struct LargeFaces {
    /// Where each face's corners start in `corners`, and the end.
    pub(super) offsets: Vec<u32>,
    pub(super) corners: Vec<u32>,
    /// By face: the weights of the two parts.
    pub(super) constant: Vec<f64>,
    pub(super) cosine: Vec<f64>,
}

impl LargeFaces {
    pub(super) fn corners_of(&self, f: usize) -> &[u32] {
        &self.corners[self.offsets[f] as usize..self.offsets[f + 1] as usize]
    }

    fn len(&self) -> usize {
        self.constant.len()
    }

    /// Σ x, Σ cos·x, Σ sin·x over the corners of face `f`.
    fn moments<P: Point>(&self, f: usize, x: &[P]) -> [P; 3] {
        let corners = self.corners_of(f);
        let mut moments = [P::ZERO; 3];
        if self.cosine[f] == 0.0 {
            for &v in corners {
                moments[0] += x[v as usize];
            }
        } else {
            for (t, &v) in corners.iter().enumerate() {
                let (sin, cos) = angle(t, corners.len());
                let p = x[v as usize];
                moments[0] += p;
                moments[1] += p.times(P::weight(cos));
                moments[2] += p.times(P::weight(sin));
            }
        }
        moments
    }

    /// Calls `visit(j, m)` for what face `f` adds to the row of M at its corner `t`, at each other corner j.
    fn entries(&self, f: usize, t: usize, mut visit: impl FnMut(usize, f64)) {
        let corners = self.corners_of(f);
        for (s, &v) in corners.iter().enumerate().filter(|&(s, _)| s != t) {
            let (_, turn) = angle(s.abs_diff(t), corners.len());
            visit(v as usize, self.constant[f] + self.cosine[f] * turn);
        }
    }

    /// What face `f` adds to the row of M at its corner `t`, its own part aside.
    fn row<P: Point>(&self, f: usize, t: usize, moments: [P; 3]) -> P {
        let sum = moments[0].times(P::weight(self.constant[f]));
        if self.cosine[f] == 0.0 {
            return sum;
        }
        let (sin, cos) = angle(t, self.corners_of(f).len());
        sum + (moments[1].times(P::weight(cos)) + moments[2].times(P::weight(sin)))
            .times(P::weight(self.cosine[f]))
    }
}

fn angle(t: usize, size: usize) -> (f64, f64) {
    (TAU * t as f64 / size as f64).sin_cos()
}

/// The rows of A.
#[derive(Clone, Debug)]
pub struct Stencil {
    pub(super) codes: Codes,
    pub(super) kinds: Vec<Kind>,
    /// The first rows of the runs of equal kind and length.
    pub(super) runs: Vec<u32>,
    pub(super) double: Rings<f64>,
    pub(super) single: Rings<Vec3A>,
    pub(super) listed: Listed,
    pub(super) large: LargeFaces,
}

/// The first rows of the runs of rows of equal kind and length.
pub(super) fn runs(kinds: &[Kind], offsets: &[u32]) -> Vec<u32> {
    let key = |i: usize| (kinds[i], offsets[i + 1] - offsets[i]);
    (0..kinds.len())
        .filter(|&i| i == 0 || key(i) != key(i - 1))
        .map(|i| i as u32)
        .collect()
}

impl Stencil {
    /// The rows of run `k`.
    pub(super) fn run(&self, k: usize) -> Range<usize> {
        let end = self
            .runs
            .get(k + 1)
            .map_or(self.kinds.len(), |&r| r as usize);
        self.runs[k] as usize..end
    }

    /// The valence of row `i`, unless it is listed.
    pub(super) fn valence(&self, i: usize) -> Option<usize> {
        let offsets = self.codes.offsets();
        let length = (offsets[i + 1] - offsets[i]) as usize;
        match self.kinds[i] {
            Kind::Quads => Some(length / 2),
            Kind::Edges => Some(length),
            Kind::Listed => None,
        }
    }

    /// a_ii.
    pub(super) fn diagonal(&self, i: usize) -> f64 {
        match (self.kinds[i], self.valence(i)) {
            (Kind::Quads, Some(n)) => self.double.quads[n].own,
            (_, Some(n)) => self.double.edges[n].own,
            (_, None) => self.listed.diagonal(i, &self.large),
        }
    }

    /// The moments of all large faces, for the passes over rows that follow; empty without large faces.
    pub(super) fn moments<P: Point>(&self, x: &[P], moments: &mut Vec<[P; 3]>) {
        moments.clear();
        moments.extend((0..self.large.len()).map(|f| self.large.moments(f, x)));
    }

    /// Calls `visit(slot, x_i, (A x)_i)` for every row i of `rows`, the slots from `slots(number of rows)`, which is
    /// asked for one run of rows after the other. `points` holds x from vertex `start` on, as far as these rows
    /// reach; `moments` is of the whole x.
    ///
    /// # Panics
    /// If a row reaches beyond the points.
    #[inline(always)]
    pub(super) fn rows<P: Point, I: Iterator>(
        &self,
        rows: Range<usize>,
        (points, start): (&[P], usize),
        moments: &[[P; 3]],
        slots: impl FnMut(usize) -> I,
        visit: impl FnMut(I::Item, P, P),
    ) {
        match self.codes.window(rows, points, start) {
            Windows::Near(window) => self.coded(&window, (points, start), moments, slots, visit),
            Windows::Far(window) => self.coded(&window, (points, start), moments, slots, visit),
        }
    }

    #[inline(always)]
    fn coded<P: Point, C: Code, I: Iterator>(
        &self,
        window: &Window<P, C>,
        (points, start): (&[P], usize),
        moments: &[[P; 3]],
        mut slots: impl FnMut(usize) -> I,
        mut visit: impl FnMut(I::Item, P, P),
    ) {
        let rings = P::rings(self);
        let rows = window.rows();
        let offsets = self.codes.offsets();
        let mut next = self.runs.partition_point(|&r| r as usize <= rows.start);
        let mut from = rows.start;
        while from < rows.end {
            let to = self
                .runs
                .get(next)
                .map_or(rows.end, |&r| rows.end.min(r as usize));
            next += 1;
            let run = Run {
                window,
                rows: from..to,
                slots: slots(to - from),
            };
            let length = (offsets[from + 1] - offsets[from]) as usize;
            match (self.kinds[from], length) {
                (Kind::Quads, 8) => run.quads::<4>(rings, &mut visit),
                (Kind::Quads, 6) => run.quads::<3>(rings, &mut visit),
                (Kind::Quads, 10) => run.quads::<5>(rings, &mut visit),
                (Kind::Quads, 12) => run.quads::<6>(rings, &mut visit),
                (Kind::Edges, 6) => run.edges::<6>(rings, &mut visit),
                (Kind::Edges, 5) => run.edges::<5>(rings, &mut visit),
                (Kind::Edges, 7) => run.edges::<7>(rings, &mut visit),
                (Kind::Edges, 4) => run.edges::<4>(rings, &mut visit),
                (Kind::Edges, 3) => run.edges::<3>(rings, &mut visit),
                (Kind::Edges, 8) => run.edges::<8>(rings, &mut visit),
                _ => {
                    for (i, slot) in (from..to).zip(run.slots) {
                        let codes = window.codes(i);
                        let value = self.coded_row(codes, i, points, start, |f, _| moments[f]);
                        visit(slot, points[i - start], value);
                    }
                }
            }
            from = to;
        }
    }

    /// (A x)_i, with the sums over large faces taken anew: O(neighbours + corners of large faces at `i`).
    #[inline]
    pub(super) fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        let moments = |f, x: &[P]| self.large.moments(f, x);
        match self.codes.of_row(i) {
            Row::Near(near) => self.coded_row(near, i, x, 0, moments),
            Row::Far(far) => self.coded_row(far, i, x, 0, moments),
        }
    }

    #[inline(always)]
    fn coded_row<P: Point, C: Code>(
        &self,
        codes: &[C],
        i: usize,
        window: &[P],
        start: usize,
        moments: impl Fn(usize, &[P]) -> [P; 3],
    ) -> P {
        let rings = P::rings(self);
        let row = i - start;
        match self.kinds[i] {
            Kind::Quads => {
                let n = codes.len() / 2;
                let (near, across) = codes.split_at(n);
                rings.quads[n].value(
                    window[row],
                    sum(near, window, row, start),
                    sum(across, window, row, start),
                )
            }
            Kind::Edges => {
                let edge = sum(codes, window, row, start);
                rings.edges[codes.len()].value_of_edges(window[row], edge)
            }
            Kind::Listed => self.listed_row(i, codes, window, row, start, moments),
        }
    }

    /// As [`row`](Self::row), for points from vertex `start` on, as far as the row reaches. There must be no large
    /// faces.
    #[inline]
    pub(super) fn row_within<P: Point>(&self, i: usize, (points, start): (&[P], usize)) -> P {
        let none = |_, _: &[P]| [P::ZERO; 3];
        match self.codes.of_row(i) {
            Row::Near(near) => self.coded_row(near, i, points, start, none),
            Row::Far(far) => self.coded_row(far, i, points, start, none),
        }
    }

    /// Calls `visit(j, part of a_ij)` for every neighbour.
    pub(super) fn entries(&self, i: usize, visit: impl FnMut(usize, f64)) {
        match self.codes.of_row(i) {
            Row::Near(near) => self.coded_entries(near, i, visit),
            Row::Far(far) => self.coded_entries(far, i, visit),
        }
    }

    fn coded_entries<C: Code>(&self, codes: &[C], i: usize, mut visit: impl FnMut(usize, f64)) {
        match self.kinds[i] {
            Kind::Quads => {
                let n = codes.len() / 2;
                let ring = self.double.quads[n];
                for (k, c) in codes.iter().enumerate() {
                    let a = if k < n { ring.edge } else { ring.opposite };
                    visit(c.place(i, 0), a);
                }
            }
            Kind::Edges => {
                let ring = self.double.edges[codes.len()];
                codes.iter().for_each(|c| visit(c.place(i, 0), ring.edge));
            }
            Kind::Listed => {
                let listed = &self.listed;
                let slot = listed.slots[i] as usize;
                let weights = &listed.weights[listed.starts[slot] as usize..];
                for (c, &a) in codes.iter().zip(weights) {
                    visit(c.place(i, 0), a);
                }
                for &(f, t) in listed.large_at(i) {
                    self.large.entries(f as usize, t as usize, |j, m| {
                        visit(j, listed.h[slot] * m);
                    });
                }
            }
        }
    }

    #[inline(never)]
    fn listed_row<P: Point, C: Code>(
        &self,
        i: usize,
        codes: &[C],
        window: &[P],
        row: usize,
        start: usize,
        moments: impl Fn(usize, &[P]) -> [P; 3],
    ) -> P {
        /// Entries between what is read and what is fetched for later rows. Tuned.
        const AHEAD: usize = 64;
        let listed = &self.listed;
        let slot = listed.slots[i] as usize;
        let weights = &listed.weights[listed.starts[slot] as usize..][..codes.len()];
        prefetch(weights, AHEAD);
        prefetch(codes, AHEAD);
        let term = |c: C, w| window[c.place(row, start)].times(P::weight(w));
        // Two sums, so that one addition need not wait for the other.
        let mut sum = window[row].times(P::weight(listed.own[slot]));
        let mut other = P::ZERO;
        let (pairs, last) = codes.as_chunks::<2>();
        let (pairs_of_weights, last_weight) = weights.as_chunks::<2>();
        for (c, w) in pairs.iter().zip(pairs_of_weights) {
            sum += term(c[0], w[0]);
            other += term(c[1], w[1]);
        }
        if let (&[c], &[w]) = (last, last_weight) {
            sum += term(c, w);
        }
        sum += other;
        if listed.corners.is_empty() {
            return sum;
        }
        let large = listed.large_starts[slot] as usize..listed.large_starts[slot + 1] as usize;
        for &(f, t) in &listed.corners[large] {
            let f = f as usize;
            let part = self.large.row(f, t as usize, moments(f, window));
            sum += part.times(P::weight(listed.h[slot]));
        }
        sum
    }
}

#[inline(always)]
fn sum<P: Point, C: Code>(codes: &[C], window: &[P], row: usize, start: usize) -> P {
    let mut places = codes.iter().map(|c| c.place(row, start));
    let Some(first) = places.next() else {
        return P::ZERO;
    };
    let mut sum = window[first];
    for place in places {
        sum += window[place];
    }
    sum
}

/// Consecutive rows of one kind and length.
struct Run<'w, 'a, P, C, I> {
    window: &'w Window<'a, P, C>,
    rows: Range<usize>,
    slots: I,
}

impl<P: Point, C: Code, I: Iterator> Run<'_, '_, P, C, I> {
    /// Rows of valence N among quads.
    #[inline(always)]
    fn quads<const N: usize>(
        self,
        rings: &Rings<P::Weight>,
        visit: &mut impl FnMut(I::Item, P, P),
    ) {
        let ring = rings.quads[N];
        self.window
            .halves::<N, _>(self.rows, self.slots, |slot, own, edge, opposite| {
                visit(slot, own, ring.value(own, edge, opposite));
            });
    }

    /// Rows of N edge neighbours.
    #[inline(always)]
    fn edges<const N: usize>(
        self,
        rings: &Rings<P::Weight>,
        visit: &mut impl FnMut(I::Item, P, P),
    ) {
        let ring = rings.edges[N];
        self.window
            .wholes::<N, _>(self.rows, self.slots, |slot, own, edge| {
                visit(slot, own, ring.value_of_edges(own, edge));
            });
    }
}
