//! Kernel of the matrix-free [`Operator`](super::Operator), for double and for single precision: rows of A from
//! connectivity alone, with weights that follow from valence and face size.
//!
//! It is compiled for any x86-64 and not chosen by processor at run time: with all that a processor has (AVX-512, FMA) 29
//! iterations on a million vertices took 0.142 s instead of 0.135. A row of single precision sums points that are a register
//! each, from places that no instruction brings together.

use std::ops::Range;

use glam::Vec3A;

use super::face_sums::Polygons;
use super::neighbours::{Code, Codes, RowNeighbours, Window, Windows};
use super::weights::{Point, RowKind, RowShape, RowWeights, Weight, WeightsByValence};
use crate::parallel;

/// Rows of one task where they are built.
const CHUNK: usize = 4096;

/// The rows of A.
#[derive(Clone, Debug)]
pub struct Stencil {
    pub(super) codes: Codes,
    /// By row; equal within a run of the codes, as is the valence.
    pub(super) kinds: Vec<RowKind>,
    pub(super) double: WeightsByValence<f64>,
    pub(super) single: WeightsByValence<Vec3A>,
    pub(super) polygons: Polygons,
}

/// The first rows of the runs of rows of equal kind and valence.
pub(super) fn runs(shapes: &[RowShape]) -> Vec<u32> {
    let is_first = |i: &usize| *i == 0 || shapes[*i] != shapes[i - 1];
    parallel::flat_map(shapes.len(), CHUNK, |rows| rows.filter(is_first).map(|i| i as u32).collect())
}

impl Stencil {
    /// The weights of row `i`.
    fn ring(&self, i: usize) -> &RowWeights<f64> {
        let n = self.valence(i);
        match self.kinds[i] {
            RowKind::Quads => &self.double.quads[n],
            RowKind::Edges => &self.double.edges[n],
            RowKind::Polygons => &self.double.polygons[n],
        }
    }

    /// The valence of row `i`.
    #[inline]
    pub(super) fn valence(&self, i: usize) -> usize {
        let offsets = self.codes.offsets();
        let length = (offsets[i + 1] - offsets[i]) as usize;
        match self.kinds[i] {
            RowKind::Quads => length / 2,
            RowKind::Edges => length,
            RowKind::Polygons => self.polygons.valence(i),
        }
    }

    /// a_ii.
    pub(super) fn diagonal(&self, i: usize) -> f64 {
        let ring = self.ring(i);
        match self.kinds[i] {
            RowKind::Polygons => ring.own + ring.across * self.polygons.diagonal(i),
            _ => ring.own,
        }
    }

    /// The least and the greatest a_ii of some rows of one run.
    pub(super) fn extremes(&self, rows: Range<usize>) -> [f64; 2] {
        let rows = match self.kinds[rows.start] {
            RowKind::Polygons => rows,
            _ => rows.start..rows.start + 1,
        };
        rows.fold([f64::INFINITY, 0.0], |[least, greatest], i| {
            let d = self.diagonal(i);
            [least.min(d), greatest.max(d)]
        })
    }

    /// `out[k]` becomes (A x)_i of the k-th row i of `rows`. `points` holds x from vertex `start` on, as far as these rows
    /// reach; `sums` those of their faces, from one of them on.
    ///
    /// # Panics
    /// If a row reaches beyond the points, or `out` has not one place a row.
    pub(super) fn product<P: Point>(
        &self,
        rows: Range<usize>,
        (points, start): (&[P], usize),
        sums: (&[P], usize),
        out: &mut [P],
    ) {
        assert_eq!(rows.len(), out.len(), "one place a row");
        match self.codes.window(rows, points, start) {
            Windows::Near(window) => self.coded(&window, (points, start), sums, out),
            Windows::Far(window) => self.coded(&window, (points, start), sums, out),
        }
    }

    fn coded<P: Point, C: Code>(
        &self,
        window: &Window<P, C>,
        (points, start): (&[P], usize),
        sums: (&[P], usize),
        mut out: &mut [P],
    ) {
        use RowKind::{Edges, Polygons, Quads};
        let rings = P::Weight::by_valence(&self.double, &self.single);
        for run in window.runs() {
            let Range { start: from, end: to } = run.rows();
            let out = out.split_off_mut(..to - from).expect("one place a row");
            let (kind, valence) = (self.kinds[from], self.valence(from));
            if kind == Polygons {
                self.polygons.gather(from..to, valence, sums, out);
            }
            match (kind, valence) {
                (Quads, 4) => run.weigh::<4>(Quads, rings.quads[4], out),
                (Quads, 3) => run.weigh::<3>(Quads, rings.quads[3], out),
                (Quads, 5) => run.weigh::<5>(Quads, rings.quads[5], out),
                (Quads, 6) => run.weigh::<6>(Quads, rings.quads[6], out),
                (Edges, 6) => run.weigh::<6>(Edges, rings.edges[6], out),
                (Edges, 5) => run.weigh::<5>(Edges, rings.edges[5], out),
                (Edges, 7) => run.weigh::<7>(Edges, rings.edges[7], out),
                (Edges, 4) => run.weigh::<4>(Edges, rings.edges[4], out),
                (Edges, 3) => run.weigh::<3>(Edges, rings.edges[3], out),
                (Edges, 8) => run.weigh::<8>(Edges, rings.edges[8], out),
                (Polygons, 3) => run.weigh::<3>(Polygons, rings.polygons[3], out),
                (Polygons, 4) => run.weigh::<4>(Polygons, rings.polygons[4], out),
                (Polygons, 5) => run.weigh::<5>(Polygons, rings.polygons[5], out),
                (Polygons, 6) => run.weigh::<6>(Polygons, rings.polygons[6], out),
                _ => {
                    for (i, out) in (from..to).zip(out) {
                        *out = self.coded_row(window.codes(i), i, points, start, |_| *out);
                    }
                }
            }
        }
    }

    /// (A x)_i, faces summed for this row alone: O(neighbours + corners of the faces at `i`). `points` holds x from
    /// vertex `start` on, as far as the row reaches.
    #[inline]
    pub(super) fn row<P: Point>(&self, i: usize, window: (&[P], usize)) -> P {
        self.row_by(i, window, |i| self.polygons.row(i, window))
    }

    /// As [`row`](Self::row); `faces(i)` is what the faces at row i add up to.
    #[inline]
    pub(super) fn row_by<P: Point>(&self, i: usize, (points, start): (&[P], usize), faces: impl Fn(usize) -> P) -> P {
        match self.codes.of_row(i) {
            RowNeighbours::Near(near) => self.coded_row(near, i, points, start, faces),
            RowNeighbours::Far(far) => self.coded_row(far, i, points, start, faces),
        }
    }

    /// `faces(i)` is what the faces at row i add up to.
    #[inline(always)]
    fn coded_row<P: Point, C: Code>(
        &self,
        codes: &[C],
        i: usize,
        window: &[P],
        start: usize,
        faces: impl Fn(usize) -> P,
    ) -> P {
        let rings = P::Weight::by_valence(&self.double, &self.single);
        let row = i - start;
        match self.kinds[i] {
            RowKind::Quads => {
                let n = codes.len() / 2;
                let (near, across) = codes.split_at(n);
                rings.quads[n].value(window[row], sum(near, window, row, start), sum(across, window, row, start))
            }
            RowKind::Edges => {
                let edge = sum(codes, window, row, start);
                rings.edges[codes.len()].value_of_edges(window[row], edge)
            }
            RowKind::Polygons => {
                let ring = &rings.polygons[self.polygons.valence(i)];
                if codes.is_empty() {
                    return ring.value_alone(window[row], faces(i));
                }
                ring.value(window[row], sum(codes, window, row, start), faces(i))
            }
        }
    }

    /// Calls `visit(j, part of a_ij)` for every neighbour.
    pub(super) fn entries(&self, i: usize, visit: impl FnMut(usize, f64)) {
        match self.codes.of_row(i) {
            RowNeighbours::Near(near) => self.coded_entries(near, i, visit),
            RowNeighbours::Far(far) => self.coded_entries(far, i, visit),
        }
    }

    fn coded_entries<C: Code>(&self, codes: &[C], i: usize, mut visit: impl FnMut(usize, f64)) {
        let ring = self.ring(i);
        let edges = match self.kinds[i] {
            RowKind::Quads => codes.len() / 2,
            RowKind::Edges | RowKind::Polygons => codes.len(),
        };
        for (k, c) in codes.iter().enumerate() {
            let a = if k < edges { ring.edge } else { ring.across };
            visit(c.place(i, 0), a);
        }
        if self.kinds[i] == RowKind::Polygons {
            let part = |j, m| visit(j, ring.across * m);
            self.polygons.entries(i, part);
        }
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
