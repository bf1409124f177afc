//! The neighbours of all rows as they are stored, and the sums over them: the innermost loop of every sweep.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::weights::{Point, RowKind, RowWeights};
use crate::mesh::incidence::split_rows;
use crate::pages::large;
use crate::parallel;
use crate::prefetch::prefetch;

/// Rows of one task.
const CHUNK: usize = 1024;
/// Bytes between what a row reads and what it fetches for later rows. Tuned.
const AHEAD: usize = 512;

/// A neighbour as it is stored.
pub trait Code: Copy + Default + Send + Sync {
    /// The greatest distance from the row that has a code.
    const REACH: u32;

    /// The code of `neighbour` in a row no further away than [`REACH`](Self::REACH).
    fn new(row: u32, neighbour: u32) -> Self;

    /// The place of the neighbour of the row at `row` within a window that begins at vertex `start`.
    fn place(self, row: usize, start: usize) -> usize;
}

impl Code for u32 {
    const REACH: u32 = u32::MAX;

    #[inline(always)]
    fn new(_row: u32, neighbour: u32) -> Self {
        neighbour
    }

    #[inline(always)]
    fn place(self, _row: usize, start: usize) -> usize {
        (self as usize).wrapping_sub(start)
    }
}

/// The distance from the row.
impl Code for i16 {
    const REACH: u32 = i16::MAX as u32;

    #[inline(always)]
    fn new(row: u32, neighbour: u32) -> Self {
        neighbour.wrapping_sub(row) as i16
    }

    #[inline(always)]
    fn place(self, row: usize, _start: usize) -> usize {
        row.wrapping_add_signed(self as isize)
    }
}

/// The neighbours of all rows, one after the other.
#[derive(Clone, Debug)]
pub enum Neighbours {
    /// As distances from the row, where the order of the vertices keeps them below 2¹⁵: 2 bytes each.
    Near(Vec<i16>),
    /// As vertices: 4 bytes each.
    Far(Vec<u32>),
}

/// The neighbours with where each row's start, checked once: every neighbour is one of the N vertices, none is further
/// from its row than the reach, and the rows of one run have equally many. The fields do not change after that, which is
/// what the sums rely on.
#[derive(Clone, Debug)]
pub struct Codes {
    offsets: Vec<u32>,
    /// The first row of each run.
    runs: Vec<u32>,
    neighbours: Neighbours,
    reach: usize,
}

impl Codes {
    /// `offsets` says where the neighbours of each row start, and the end; `runs` names the first rows of the runs, whose
    /// rows are alike; `fill(i, neighbours)` names the neighbours of row i. One parallel pass, two where a distance does
    /// not fit 16 bits.
    ///
    /// # Panics
    /// If the offsets do not ascend from 0, the runs do not ascend from row 0, the rows of a run have not equally many
    /// neighbours, or a neighbour is no vertex.
    pub(super) fn new(offsets: Vec<u32>, runs: Vec<u32>, fill: impl Fn(usize, &mut [u32]) + Sync) -> Self {
        assert!(offsets.first() == Some(&0), "offsets from 0");
        let n = offsets.len() - 1;
        assert!(runs.first() == (n > 0).then_some(&0), "runs from row 0");
        parallel::each(runs.len(), |k| {
            let rows = rows_of_run(&runs, k, n);
            assert!(!rows.is_empty() && rows.end <= n, "runs ascend");
            let lengths = offsets[rows.start..=rows.end].windows(2).map(|w| w[1].checked_sub(w[0]));
            let first = offsets[rows.start + 1].checked_sub(offsets[rows.start]);
            assert!(first.is_some() && lengths.into_iter().all(|l| l == first), "rows of one length in run {k}");
        });
        let near = encode(&offsets, &fill).map(|(reach, near)| (reach, Neighbours::Near(near)));
        let far = || encode(&offsets, &fill).map(|(reach, far)| (reach, Neighbours::Far(far)));
        let (reach, neighbours) = near.or_else(far).expect("every distance has a code of 32 bits");
        Codes { offsets, runs, neighbours, reach: reach as usize }
    }

    pub(super) fn rows(&self) -> usize {
        self.offsets.len() - 1
    }

    pub(super) fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The first row of each run.
    pub(super) fn runs(&self) -> &[u32] {
        &self.runs
    }

    /// The rows of run `k`.
    pub(super) fn run(&self, k: usize) -> Range<usize> {
        rows_of_run(&self.runs, k, self.rows())
    }

    pub(super) fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// The greatest distance between a row and one of its neighbours.
    pub(super) fn reach(&self) -> usize {
        self.reach
    }

    /// The neighbours of row `i`.
    #[inline(always)]
    pub(super) fn of_row(&self, i: usize) -> RowNeighbours<'_> {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        match &self.neighbours {
            Neighbours::Near(near) => RowNeighbours::Near(&near[range]),
            Neighbours::Far(far) => RowNeighbours::Far(&far[range]),
        }
    }

    /// The points that `rows` see: `points` holds them from vertex `start` on.
    ///
    /// # Panics
    /// If a row may reach beyond the points.
    pub(super) fn window<'a, P>(&'a self, rows: Range<usize>, points: &'a [P], start: usize) -> Windows<'a, P> {
        let low = rows.start.saturating_sub(self.reach);
        let high = (rows.end + self.reach).min(self.rows());
        assert!(
            start <= low && high <= start + points.len() && rows.end <= self.rows(),
            "rows {rows:?} reach beyond the points {start}..{}",
            start + points.len()
        );
        match &self.neighbours {
            Neighbours::Near(codes) => Windows::Near(Window { all: self, codes, rows, points, start }),
            Neighbours::Far(codes) => Windows::Far(Window { all: self, codes, rows, points, start }),
        }
    }
}

/// The rows of run `k` of those that start at `runs`, among `n` rows.
fn rows_of_run(runs: &[u32], k: usize, n: usize) -> Range<usize> {
    runs[k] as usize..runs.get(k + 1).map_or(n, |&next| next as usize)
}

/// The neighbours of all rows in one kind of code, and the greatest distance; `None` if that has no code.
fn encode<C: Code>(offsets: &[u32], fill: &(impl Fn(usize, &mut [u32]) + Sync)) -> Option<(u32, Vec<C>)> {
    let n = offsets.len() - 1;
    let mut codes = large(vec![C::default(); offsets[n] as usize]);
    let too_far = AtomicBool::new(false);
    let reaches = parallel::parts(split_rows(offsets, CHUNK, &mut codes), |rows, mut part| {
        if too_far.load(Ordering::Relaxed) {
            return 0;
        }
        let (mut reach, mut last) = (0, 0);
        let mut neighbours = vec![0; part.len()];
        let mut rest = &mut neighbours[..];
        for i in rows {
            let length = (offsets[i + 1] - offsets[i]) as usize;
            let (row, after) = rest.split_at_mut(length);
            rest = after;
            fill(i, row);
            let (codes, after) = part.split_at_mut(length);
            part = after;
            let mut encode = |row: &[u32], codes: &mut [C]| {
                for (code, &j) in codes.iter_mut().zip(row) {
                    reach = reach.max(j.abs_diff(i as u32));
                    last = last.max(j);
                    *code = C::new(i as u32, j);
                }
            };
            match length {
                4 => encode(&row[..4], &mut codes[..4]),
                6 => encode(&row[..6], &mut codes[..6]),
                8 => encode(&row[..8], &mut codes[..8]),
                _ => encode(row, codes),
            }
        }
        assert!((last as usize) < n, "a neighbour that is no vertex: {last}");
        if reach > C::REACH {
            too_far.store(true, Ordering::Relaxed);
        }
        reach
    });
    let reach = reaches.into_iter().max().unwrap_or(0);
    (reach <= C::REACH).then_some((reach, codes))
}

/// The neighbours of one row.
pub(super) enum RowNeighbours<'a> {
    Near(&'a [i16]),
    Far(&'a [u32]),
}

/// A [`Window`] by the kind of code.
pub(super) enum Windows<'a, P> {
    Near(Window<'a, P, i16>),
    Far(Window<'a, P, u32>),
}

/// Some rows, and the points that they see: [`Codes::window`] has made sure that every neighbour of the rows is
/// among the points.
pub(super) struct Window<'a, P, C> {
    all: &'a Codes,
    /// The neighbours of `all`.
    codes: &'a [C],
    rows: Range<usize>,
    points: &'a [P],
    start: usize,
}

/// Rows of a [`Window`] that belong to one run of its [`Codes`]: only [`Window::runs`] makes such, so they have equally
/// many neighbours and are rows of the window.
pub(super) struct Run<'w, 'a, P, C> {
    window: &'w Window<'a, P, C>,
    rows: Range<usize>,
    /// Neighbours of each row.
    length: usize,
}

impl<'a, P: Point, C: Code> Window<'a, P, C> {
    /// The rows of the window, run by run.
    pub(super) fn runs<'w>(&'w self) -> impl Iterator<Item = Run<'w, 'a, P, C>> {
        let Codes { runs, offsets, .. } = self.all;
        let mut next = runs.partition_point(|&r| r as usize <= self.rows.start);
        let mut from = self.rows.start;
        std::iter::from_fn(move || {
            if from >= self.rows.end {
                return None;
            }
            let to = runs.get(next).map_or(self.rows.end, |&r| self.rows.end.min(r as usize));
            next += 1;
            let rows = from..to;
            from = to;
            let length = (offsets[rows.start + 1] - offsets[rows.start]) as usize;
            Some(Run { window: self, rows, length })
        })
    }

    /// The neighbours of row `i`.
    pub(super) fn codes(&self, i: usize) -> &'a [C] {
        let offsets = &self.all.offsets;
        &self.codes[offsets[i] as usize..offsets[i + 1] as usize]
    }

    /// The sum over N neighbours of the row at place `at` of the points. Without a check of each neighbour: 2.5 ns
    /// a row of 8 in single precision instead of 3.5, all in cache.
    ///
    /// # Safety
    /// `codes` are neighbours of the row at place `at`, a row of this window: then `Codes::new` has found them to be
    /// vertices within reach of it, and `Codes::window` has found all such vertices among the points.
    #[inline(always)]
    unsafe fn sum<const N: usize>(&self, at: usize, codes: &[C]) -> P {
        let codes = codes.first_chunk::<N>().expect("N neighbours");
        // SAFETY: by the contract of this function.
        let mut sum = unsafe { *self.points.get_unchecked(codes[0].place(at, self.start)) };
        for &c in &codes[1..] {
            // SAFETY: likewise.
            sum += unsafe { *self.points.get_unchecked(c.place(at, self.start)) };
        }
        sum
    }
}

// A loop over rows is all in one function without closures: what is called once a row must be inlined, and a closure
// may end up in another unit of code than the loop.
impl<P: Point, C: Code> Run<'_, '_, P, C> {
    pub(super) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Rows of valence N: `out[k]` becomes the k-th row's (A x)_i. Under [`RowKind::Polygons`] it holds before what the
    /// faces add, and rows may have no neighbour beside.
    ///
    /// # Panics
    /// If the rows have another number of neighbours than `kind` means.
    #[inline(always)]
    pub(super) fn weigh<const N: usize>(&self, kind: RowKind, ring: RowWeights<P::Weight>, out: &mut [P]) {
        let Window { all, codes, points, start, .. } = self.window;
        let first = self.rows.start - start;
        let own = &points[first..][..self.rows.len()];
        if kind == RowKind::Polygons && self.length == 0 {
            for (out, &own) in out.iter_mut().zip(own) {
                *out = ring.value_alone(own, *out);
            }
            return;
        }
        let length = if kind == RowKind::Quads { 2 * N } else { N };
        assert_eq!(self.length, length, "neighbours of a row");
        let codes = &codes[all.offsets[self.rows.start] as usize..all.offsets[self.rows.end] as usize];
        // The rows move on at one pace; what they read for the first time is as far ahead as they reach.
        let front = first + all.reach + AHEAD / size_of::<P>();
        for (k, ((out, &own), list)) in out.iter_mut().zip(own).zip(codes.chunks_exact(length)).enumerate() {
            prefetch(points, front + k);
            prefetch(list, AHEAD / size_of::<C>());
            let (near, across) = list.split_at(N);
            // SAFETY: `list` holds the neighbours of the row at place `first + k`, a row of the window: all rows of a
            // run have the number of neighbours that is asserted above.
            let edge = unsafe { self.window.sum::<N>(first + k, near) };
            *out = match kind {
                RowKind::Quads => {
                    // SAFETY: likewise.
                    let across = unsafe { self.window.sum::<N>(first + k, across) };
                    ring.value(own, edge, across)
                }
                RowKind::Edges => ring.value_of_edges(own, edge),
                RowKind::Polygons => ring.value(own, edge, *out),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cycle of `n` vertices: the distances of the ends of the file do not fit a narrow band.
    fn cycle_of(n: u32) -> Codes {
        let offsets = (0..=n).map(|i| 2 * i).collect();
        Codes::new(offsets, vec![0], |i, neighbours| {
            neighbours.copy_from_slice(&[(i as u32 + 1) % n, (i as u32 + n - 1) % n]);
        })
    }

    fn cycle() -> Codes {
        cycle_of(10)
    }

    #[test]
    fn codes_are_near_as_far_as_they_can() {
        for (n, near) in [(10, true), (1 << 15, true), ((1 << 15) + 1, false)] {
            let codes = cycle_of(n);
            assert_eq!(codes.reach(), n as usize - 1);
            assert_eq!(matches!(codes.neighbours(), Neighbours::Near(_)), near);
            for i in [0, 1, n as usize - 1] {
                let places: Vec<usize> = match codes.of_row(i) {
                    RowNeighbours::Near(row) => row.iter().map(|c| c.place(i, 0)).collect(),
                    RowNeighbours::Far(row) => row.iter().map(|c| c.place(i, 0)).collect(),
                };
                let n = n as usize;
                assert_eq!(places, [(i + 1) % n, (i + n - 1) % n]);
            }
        }
    }

    #[test]
    #[should_panic(expected = "no vertex")]
    fn a_neighbour_beyond_the_last_vertex_is_refused() {
        Codes::new(vec![0, 1, 2], vec![0], |i, neighbours| neighbours[0] = i as u32 + 1);
    }

    #[test]
    #[should_panic(expected = "rows of one length in run 0")]
    fn rows_of_several_lengths_are_no_run() {
        // As many neighbours as two rows of two have: a check of the sum alone would let them pass.
        Codes::new(vec![0, 1, 4], vec![0], |_, neighbours| neighbours.fill(0));
    }

    #[test]
    fn runs_that_do_not_cover_the_rows_once_are_refused() {
        for runs in [vec![], vec![1], vec![0, 1, 1], vec![0, 3], vec![0, 2, 1]] {
            let made = std::panic::catch_unwind(|| Codes::new(vec![0, 0, 0], runs.clone(), |_, _| {}));
            assert!(made.is_err(), "{runs:?}");
        }
        assert_eq!(Codes::new(vec![0], vec![], |_, _| {}).rows(), 0);
    }

    #[test]
    fn a_window_is_cut_into_the_runs_that_it_overlaps() {
        // Rows of 0, 2, 2, 2, 1 and 1 neighbours.
        let codes = Codes::new(vec![0, 0, 2, 4, 6, 7, 8], vec![0, 1, 3, 4], |_, neighbours| neighbours.fill(3));
        let points = [0.0f64; 6];
        let Windows::Near(window) = codes.window(0..5, &points, 0) else { panic!("near") };
        let found: Vec<_> = window.runs().map(|run| (run.rows(), run.length)).collect();
        assert_eq!(found, [(0..1, 0), (1..3, 2), (3..4, 2), (4..5, 1)]);
        let Windows::Near(window) = codes.window(2..3, &points, 0) else { panic!("near") };
        assert!(window.runs().map(|run| run.rows()).eq(std::iter::once(2..3)));
    }

    #[test]
    #[should_panic(expected = "reach beyond")]
    fn a_window_that_rows_may_leave_is_refused() {
        let points = [0.0f64; 9];
        cycle().window(0..2, &points, 0);
    }

    #[test]
    #[should_panic(expected = "neighbours of a row")]
    fn rows_of_another_length_are_refused() {
        let (codes, points) = (cycle(), [0.0f64; 10]);
        if let Windows::Near(window) = codes.window(0..10, &points, 0) {
            window
                .runs()
                .for_each(|run| run.weigh::<1>(RowKind::Edges, RowWeights::new(0.0, 1.0, 0.0), &mut [0.0; 10]));
        }
    }

    #[test]
    fn sums_are_those_of_the_neighbours() {
        let codes = cycle();
        let points: Vec<f64> = (0..10).map(|i| f64::from(1 << i)).collect();
        let mut sums = [0.0; 10];
        if let Windows::Near(window) = codes.window(0..10, &points, 0) {
            window.runs().for_each(|run| run.weigh::<2>(RowKind::Edges, RowWeights::new(0.0, 1.0, 0.0), &mut sums));
        }
        for (i, &sum) in sums.iter().enumerate() {
            assert_eq!(sum, points[(i + 1) % 10] + points[(i + 9) % 10]);
        }
    }
}
