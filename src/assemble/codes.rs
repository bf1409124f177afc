//! The neighbours of all rows as they are stored, and the sums over them: the innermost loop of every sweep.

use std::ops::Range;

use rayon::prelude::*;

use super::stencil::Point;

/// Rows of one task.
const CHUNK: usize = 4096;

/// A neighbour as it is stored.
pub trait Code: Copy + Send + Sync {
    /// The place of the neighbour of the row at `row` within a window that begins at vertex `start`.
    fn place(self, row: usize, start: usize) -> usize;
}

impl Code for u32 {
    #[inline(always)]
    fn place(self, _row: usize, start: usize) -> usize {
        (self as usize).wrapping_sub(start)
    }
}

/// The distance from the row.
impl Code for i16 {
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

/// The neighbours with where each row's start, checked once: every neighbour is one of the N vertices, and none is
/// further from its row than the reach. The fields do not change after that, which is what the sums rely on.
#[derive(Clone, Debug)]
pub struct Codes {
    offsets: Vec<u32>,
    neighbours: Neighbours,
    reach: usize,
}

impl Codes {
    /// `offsets` says where the neighbours of each row start, and the end. One parallel pass.
    ///
    /// # Panics
    /// If the offsets do not ascend from 0 to the number of neighbours, or a neighbour is no vertex.
    pub(super) fn new(offsets: Vec<u32>, neighbours: Neighbours) -> Self {
        let length = match &neighbours {
            Neighbours::Near(near) => near.len(),
            Neighbours::Far(far) => far.len(),
        };
        assert!(
            offsets.first() == Some(&0)
                && offsets.last().is_some_and(|&end| end as usize == length),
            "offsets from 0 to the number of neighbours"
        );
        let reach = match &neighbours {
            Neighbours::Near(near) => greatest_distance(&offsets, near),
            Neighbours::Far(far) => greatest_distance(&offsets, far),
        };
        Codes {
            offsets,
            neighbours,
            reach,
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.offsets.len() - 1
    }

    pub(super) fn offsets(&self) -> &[u32] {
        &self.offsets
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
    pub(super) fn of_row(&self, i: usize) -> Row<'_> {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        match &self.neighbours {
            Neighbours::Near(near) => Row::Near(&near[range]),
            Neighbours::Far(far) => Row::Far(&far[range]),
        }
    }

    /// The points that `rows` see: `points` holds them from vertex `start` on.
    ///
    /// # Panics
    /// If a row may reach beyond the points.
    pub(super) fn window<'a, P>(
        &'a self,
        rows: Range<usize>,
        points: &'a [P],
        start: usize,
    ) -> Windows<'a, P> {
        let low = rows.start.saturating_sub(self.reach);
        let high = (rows.end + self.reach).min(self.rows());
        assert!(
            start <= low && high <= start + points.len() && rows.end <= self.rows(),
            "rows {rows:?} reach beyond the points {start}..{}",
            start + points.len()
        );
        let offsets = &self.offsets;
        match &self.neighbours {
            Neighbours::Near(codes) => Windows::Near(Window {
                offsets,
                codes,
                rows,
                points,
                start,
            }),
            Neighbours::Far(codes) => Windows::Far(Window {
                offsets,
                codes,
                rows,
                points,
                start,
            }),
        }
    }
}

/// Checks every neighbour.
fn greatest_distance<C: Code>(offsets: &[u32], codes: &[C]) -> usize {
    let n = offsets.len() - 1;
    (0..n)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|i| {
            let mut reach = 0;
            for c in &codes[offsets[i] as usize..offsets[i + 1] as usize] {
                let j = c.place(i, 0);
                assert!(j < n, "row {i} names a neighbour that is no vertex");
                reach = reach.max(j.abs_diff(i));
            }
            reach
        })
        .max()
        .unwrap_or(0)
}

/// The neighbours of one row.
pub(super) enum Row<'a> {
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
    offsets: &'a [u32],
    codes: &'a [C],
    rows: Range<usize>,
    points: &'a [P],
    start: usize,
}

impl<'a, P: Point, C: Code> Window<'a, P, C> {
    pub(super) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// The neighbours of row `i`.
    pub(super) fn codes(&self, i: usize) -> &'a [C] {
        &self.codes[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }

    /// For rows of 2N neighbours each, `visit(slot, own, sum of the first N, sum of the others)`, `slot` from
    /// `slots`.
    ///
    /// # Panics
    /// If the rows are not among those of the window, or have another number of neighbours.
    #[inline(always)]
    pub(super) fn halves<const N: usize, T>(
        &self,
        rows: Range<usize>,
        slots: impl Iterator<Item = T>,
        mut visit: impl FnMut(T, P, P, P),
    ) {
        self.each(rows, 2 * N, slots, |slot, own, at, codes| {
            let (near, across) = codes.split_at(N);
            // SAFETY: `at` and `codes` are of one row.
            let sums = unsafe { (self.sum::<N>(at, near), self.sum::<N>(at, across)) };
            visit(slot, own, sums.0, sums.1);
        });
    }

    /// For rows of N neighbours each, `visit(slot, own, their sum)`.
    ///
    /// # Panics
    /// As [`halves`](Self::halves).
    #[inline(always)]
    pub(super) fn wholes<const N: usize, T>(
        &self,
        rows: Range<usize>,
        slots: impl Iterator<Item = T>,
        mut visit: impl FnMut(T, P, P),
    ) {
        self.each(rows, N, slots, |slot, own, at, codes| {
            // SAFETY: `at` and `codes` are of one row.
            let sum = unsafe { self.sum::<N>(at, codes) };
            visit(slot, own, sum);
        });
    }

    /// `visit(slot, own, place, codes)` for rows of `length` neighbours.
    #[inline(always)]
    fn each<T>(
        &self,
        rows: Range<usize>,
        length: usize,
        slots: impl Iterator<Item = T>,
        mut visit: impl FnMut(T, P, usize, &[C]),
    ) {
        assert!(
            self.rows.start <= rows.start && rows.end <= self.rows.end,
            "rows of the window"
        );
        let codes = &self.codes[self.offsets[rows.start] as usize..self.offsets[rows.end] as usize];
        assert_eq!(
            codes.len(),
            rows.len() * length,
            "rows of {length} neighbours"
        );
        let first = rows.start - self.start;
        let own = &self.points[first..][..rows.len()];
        let lists = codes.chunks_exact(length);
        for (k, ((slot, &own), list)) in slots.zip(own).zip(lists).enumerate() {
            visit(slot, own, first + k, list);
        }
    }

    /// The sum over N neighbours of the row at place `at` of the points. Without a check of each neighbour: 2.5 ns
    /// a row of 8 in single precision instead of 3.5, all in cache.
    ///
    /// # Safety
    /// `codes` are neighbours of the row at place `at`, a row of this window: then `Codes::new` has found them to be
    /// vertices within reach of it, and `Codes::window` has found all such vertices among the points.
    #[inline(always)]
    unsafe fn sum<const N: usize>(&self, at: usize, codes: &[C]) -> P {
        // SAFETY: by the contract of this function.
        let point = |c: C| unsafe { *self.points.get_unchecked(c.place(at, self.start)) };
        let codes = codes.first_chunk::<N>().expect("N neighbours");
        let mut sum = point(codes[0]);
        for &c in &codes[1..] {
            sum += point(c);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cycle of 10 vertices: the distances of the ends of the file do not fit a narrow band.
    fn cycle() -> Codes {
        let near = (0..10i16).flat_map(|i| [(i + 1) % 10 - i, (i + 9) % 10 - i]);
        Codes::new(
            (0..=10).map(|i| 2 * i).collect(),
            Neighbours::Near(near.collect()),
        )
    }

    #[test]
    fn reach_is_the_greatest_distance_whatever_the_code() {
        assert_eq!(cycle().reach(), 9);
        let far = Codes::new(vec![0, 1, 2, 3], Neighbours::Far(vec![1, 2, 0]));
        assert_eq!(far.reach(), 2);
    }

    #[test]
    #[should_panic(expected = "no vertex")]
    fn a_neighbour_beyond_the_last_vertex_is_refused() {
        Codes::new(vec![0, 1, 2], Neighbours::Near(vec![1, 1]));
    }

    #[test]
    #[should_panic(expected = "no vertex")]
    fn a_neighbour_before_the_first_vertex_is_refused() {
        Codes::new(vec![0, 1, 2], Neighbours::Near(vec![-1, -1]));
    }

    #[test]
    #[should_panic(expected = "reach beyond")]
    fn a_window_that_rows_may_leave_is_refused() {
        let points = [0.0f64; 9];
        cycle().window(0..2, &points, 0);
    }

    #[test]
    #[should_panic(expected = "rows of 1 neighbours")]
    fn rows_of_another_length_are_refused() {
        let (codes, points) = (cycle(), [0.0f64; 10]);
        if let Windows::Near(window) = codes.window(0..10, &points, 0) {
            window.wholes::<1, _>(0..10, 0..10, |_, _, _| {});
        }
    }

    #[test]
    fn sums_are_those_of_the_neighbours() {
        let codes = cycle();
        let points: Vec<f64> = (0..10).map(|i| f64::from(1 << i)).collect();
        let mut sums = [0.0; 10];
        if let Windows::Near(window) = codes.window(0..10, &points, 0) {
            window.wholes::<2, _>(0..10, sums.iter_mut(), |slot, _, sum| *slot = sum);
        }
        for (i, &sum) in sums.iter().enumerate() {
            assert_eq!(sum, points[(i + 1) % 10] + points[(i + 9) % 10]);
        }
    }
}
