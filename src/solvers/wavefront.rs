//! Wavefront (temporal) blocking: several Chebyshev iterations, or sweeps of Gauss-Seidel, in one pass over memory.
//!
//! Iterate k + 1 of a row needs iterate k of its neighbours only. Where the vertex order keeps neighbours within a
//! narrow band, the vertices are cut into bands as long as a row reaches: band j of iterate k + 1 can be made as
//! soon as band j + 1 of iterate k is there, long before that iterate is complete. A wave therefore advances band
//! w − 2k of every iterate k at once; these updates touch disjoint parts of two arrays and run in parallel, and all
//! that they touch stays in cache from one wave to the next. Each thread of a team has the same iterates in
//! every wave, so that it finds there what it wrote itself. Where rows read [sums over
//! faces](crate::assemble::face_sums), the sums of a band are made one wave before its rows, and iterates follow each
//! other three bands apart. Every number is computed from the same operands as in
//! iterations one after the other, so results do not depend on the number of threads, nor on the length of a group
//! of iterations (Wonnacott's time skewing, 2000).

use std::ops::Range;

use glam::DVec3;

use super::chebyshev::Recurrence;
use super::system::STRIP;
use super::system::sweep_with;
use crate::assemble::Operator;
use crate::assemble::face_sums::BLOCK;
use crate::assemble::weights::{Point, Weight};
use crate::memory::last_level_cache;
use crate::pages::filled;
use crate::parallel;
use crate::prefetch::{POINTS_AHEAD, prefetch};

/// Iterations of one group, which share a pass over memory, at the most.
const GROUP: usize = 16;
/// Rows of one task where iterations go one after the other, and of a band at the least.
const CHUNK: usize = 4096;
/// Rows of one task in a group: short tasks end together. Tuned.
const PIECE: usize = 2048;
/// Below, all arrays stay in cache anyhow, and iterations go one after the other.
const SMALL: usize = 100_000;

/// Chebyshev iterations for `A x = r` from x = 0.
pub struct Wavefront<'a> {
    operator: &'a Operator,
    /// Length of a band; `None` for iterations one after the other.
    band: Option<usize>,
}

/// What iterations write besides the iterate that they return.
#[derive(Clone, Debug)]
pub struct Scratch<P> {
    other: Vec<P>,
    sums: Vec<P>,
}

impl<P> Scratch<P> {
    /// The iterate before the one that [`iterate`](Wavefront::iterate) has returned.
    pub fn before(&self) -> &[P] {
        &self.other
    }
}

/// A part of an iteration on one band.
enum Task<'b, P> {
    Rows(Update<'b, P>),
    /// The sums over some faces.
    Faces {
        /// The iterate, from a vertex on.
        window: (&'b [P], usize),
        /// The first of the sums.
        first: usize,
        sums: &'b mut [P],
    },
}

struct Update<'b, P> {
    rows: Range<usize>,
    /// The iterate, from a vertex on.
    window: (&'b [P], usize),
    /// Those of the faces that the rows need, from a number on.
    sums: (&'b [P], usize),
    /// The iterate before it, replaced by the one after it.
    out: &'b mut [P],
    coefficients: (f64, f64),
}

impl<'a> Wavefront<'a> {
    /// Bands by the reach of the operator's rows: groups of iterations pay where there are many.
    pub fn new(operator: &'a Operator) -> Self {
        let n = operator.len();
        let band = operator.reach().max(CHUNK);
        let many = n >= SMALL && n / band >= GROUP;
        Self::in_bands(operator, many.then_some(band))
    }

    /// Bands of a given length, or a little more; `None` for iterations one after the other.
    ///
    /// # Panics
    /// If rows reach further than a band.
    pub fn in_bands(operator: &'a Operator, band: Option<usize>) -> Self {
        assert!(band.is_none_or(|band| operator.reach() <= band), "rows reach no further than a band");
        // Sums are ordered by blocks of rows.
        let sums = !operator.sums_of(0..operator.len()).is_empty();
        let band = band.map(|band| if sums { band.next_multiple_of(BLOCK) } else { band });
        Wavefront { operator, band }
    }

    /// Arrays for [`iterate`](Self::iterate), to be used again and again.
    pub fn scratch<P: Point>(&self) -> Scratch<P> {
        let n = self.operator.len();
        Scratch { other: filled(n, P::ZERO), sums: filled(self.operator.sums_of(0..n).len(), P::ZERO) }
    }

    /// `count` ≥ 1 iterations for eigenvalues within the interval of `recurrence`, from x = 0. The first of them is
    /// a multiple of `r`, to which an iterate [before](Scratch::before) x = 0 may add, and must be in `x` already:
    /// `x = τ r − γ x₋₁` with the coefficients of the recurrence. The last iterate is returned in `x`, with the recurrence at
    /// the step that comes after it.
    ///
    /// Reads, for each group of up to 16 iterations, the operator, `r` and both iterates once from memory.
    ///
    /// # Panics
    /// If the arrays have not one point a vertex.
    pub fn iterate<P: Point>(
        &self,
        mut recurrence: Recurrence,
        count: usize,
        r: &[P],
        x: &mut Vec<P>,
        scratch: &mut Scratch<P>,
    ) -> Recurrence {
        let n = self.operator.len();
        let Scratch { other, sums } = scratch;
        assert!(r.len() == n && x.len() == n && other.len() == n, "one point a vertex");
        parallel::chunks(other, CHUNK, |_, c| c.fill(P::ZERO));
        let coefficients: Vec<(f64, f64)> = (1..count)
            .map(|_| {
                recurrence.step();
                recurrence.coefficients()
            })
            .collect();
        let lag = if sums.is_empty() { 2 } else { 3 };
        let length = self.band.map_or(1, |band| self.group_length::<P>(lag * band));
        parallel::team(|| {
            for group in coefficients.chunks(length) {
                match self.band {
                    Some(band) => self.group(band, group, r, (x, other), sums),
                    None => self.plain(group[0], r, (x, other), sums),
                }
                if group.len() % 2 == 1 {
                    std::mem::swap(x, other);
                }
            }
        });
        recurrence.step();
        recurrence
    }

    /// `count` sweeps of Gauss-Seidel or SOR in the order of the rows, `x_i ← x_i + ω (p_i − (A x)_i)/a_ii`.
    ///
    /// Sweep k + 1 may pass a band as soon as sweep k has passed the one after it: a wave advances band w − 3k of every
    /// sweep k at once. Each works on three bands of its own, so they run in parallel, and every number is the one that
    /// sweeps one after the other give.
    ///
    /// # Panics
    /// If the arrays have not one point a vertex.
    pub fn relax(&self, omega: f64, count: usize, p: &[DVec3], x: &mut [DVec3]) {
        let n = self.operator.len();
        assert!(p.len() == n && x.len() == n, "one point a vertex");
        let Some(band) = self.band else {
            let mut sums = Vec::new();
            for _ in 0..count {
                sweep_with(self.operator, p, omega, 0..n, x, &mut sums);
            }
            return;
        };
        let diagonal = self.operator.diagonal();
        let bands = n.div_ceil(band);
        let at = |j: usize| (j * band).min(n);
        let length = self.group_length::<DVec3>(3 * band);
        let operator = self.operator;
        let sums_of = |rows: Range<usize>| if operator.sums_follow() { operator.sums_of(rows) } else { 0..0 };
        let mut sums = filled(sums_of(0..n).len(), DVec3::ZERO);
        parallel::team(|| {
            for first in (0..count).step_by(length) {
                let sweeps = length.min(count - first);
                for wave in 0..bands + 3 * (sweeps - 1) {
                    let mut rest = (&mut *x, 0);
                    let mut rest_of_sums = (&mut *sums, 0);
                    let tasks: Vec<_> = (0..sweeps)
                        .rev()
                        .filter_map(|k| wave.checked_sub(3 * k).filter(|&j| j < bands))
                        .map(|j| {
                            let seen = at(j.saturating_sub(1))..at(j + 2);
                            let known = sums_of(at(j.saturating_sub(1))..at(j + 1));
                            let (start, first) = (seen.start, known.start);
                            let sums = (cut(&mut rest_of_sums, known), first);
                            (at(j)..at(j + 1), (cut(&mut rest, seen), start), sums)
                        })
                        .collect();
                    parallel::tasks(tasks, |(rows, (window, start), (sums, first))| {
                        if sums.is_empty() {
                            for i in rows {
                                let e = p[i] - operator.row_within(i, (window, start));
                                window[i - start] += (omega / diagonal[i]) * e;
                            }
                            return;
                        }
                        // No row of a face whose first one is here has been passed by this sweep, all by the one before it.
                        let made = operator.sums_of(rows.clone());
                        operator.sums(made.start, (window, start), &mut sums[made.start - first..made.end - first]);
                        for i in rows {
                            let e = p[i] - operator.row_by_sums(i, (window, start), |f| sums[f - first]);
                            let change = (omega / diagonal[i]) * e;
                            window[i - start] += change;
                            operator.follow(i, change, |f, part| sums[f - first] += part);
                        }
                    });
                }
            }
        });
    }

    /// How many iterations fit half of the last-level cache if each is `lag` rows behind the one before it. As few as fit the
    /// second level are no faster where a band is short, and take up to 1.6 times as long elsewhere.
    fn group_length<P>(&self, lag: usize) -> usize {
        // Two iterates, the right-hand side, the operator.
        let row = 3 * size_of::<P>() + self.operator.sweep_bytes() / self.operator.len().max(1);
        (last_level_cache() / 2 / (lag * row)).clamp(2, GROUP)
    }

    /// One iteration: `other` becomes the next one after `x`.
    fn plain<P: Point>(&self, coefficients: (f64, f64), r: &[P], (x, other): (&[P], &mut [P]), sums: &mut Vec<P>) {
        self.operator.all_sums(x, sums);
        parallel::chunks(other, CHUNK, |first, out| {
            let update = Update { rows: first..first + out.len(), window: (x, 0), sums: (sums, 0), out, coefficients };
            self.update(update, r);
        });
    }

    /// A group of iterations, band by band. After an odd number of them the last is in `other`, else in `x`.
    fn group<P: Point>(
        &self,
        band: usize,
        group: &[(f64, f64)],
        r: &[P],
        (x, other): (&mut [P], &mut [P]),
        sums: &mut [P],
    ) {
        let n = r.len();
        let bands = n.div_ceil(band);
        let at = |j: usize| (j * band).min(n);
        // Rows come this many waves after the sums of their band.
        let behind = usize::from(!sums.is_empty());
        let lag = 2 + behind;
        for wave in 0..bands + lag * (group.len() - 1) + behind {
            let mut tasks = Vec::with_capacity(2 * group.len() * band.div_ceil(PIECE));
            // What is left of the arrays, each with its first number. The last iteration of the group is at the
            // foremost band: later ones come in ascending order of bands.
            let mut rest = [(&mut *x, 0), (&mut *other, 0)];
            let mut rest_of_sums = (&mut *sums, 0);
            for (k, &coefficients) in group.iter().enumerate().rev() {
                let front = wave.checked_sub(lag * k);
                let Some(front) = front.filter(|&front| front < bands + behind) else {
                    continue;
                };
                let seen = at(front.saturating_sub(1 + behind))..at(front + 2);
                let start = seen.start;
                let window = (&*cut(&mut rest[k % 2], seen), start);
                if let Some(j) = front.checked_sub(behind).filter(|&j| j < bands) {
                    let known = self.operator.sums_of(at(j.saturating_sub(1))..at(j + 1));
                    let first = known.start;
                    let sums = (&*cut(&mut rest_of_sums, known), first);
                    let rows = at(j)..at(j + 1);
                    let out = cut(&mut rest[(k + 1) % 2], rows.clone());
                    for (from, out) in rows.step_by(PIECE).zip(out.chunks_mut(PIECE)) {
                        tasks.push(Task::Rows(Update {
                            rows: from..from + out.len(),
                            window,
                            sums,
                            out,
                            coefficients,
                        }));
                    }
                }
                if behind > 0 && front < bands {
                    let made = self.operator.sums_of(at(front)..at(front + 1));
                    let first = made.start;
                    let sums = cut(&mut rest_of_sums, made);
                    // Whole faces: sums come in ones or in threes.
                    let piece = 3 * PIECE;
                    for (k, sums) in sums.chunks_mut(piece).enumerate() {
                        tasks.push(Task::Faces { window, first: first + k * piece, sums });
                    }
                }
            }
            parallel::tasks(tasks, |task| match task {
                Task::Rows(update) => self.update(update, r),
                Task::Faces { window, first, sums } => self.operator.sums(first, window, sums),
            });
        }
    }

    /// `out ← v + γ (v − out) + τ (r − A v)` on the rows of the task.
    fn update<P: Point>(&self, task: Update<P>, r: &[P]) {
        let (gamma, tau) = task.coefficients;
        let (gamma, tau) = (P::Weight::of(gamma), P::Weight::of(tau));
        let (points, start) = task.window;
        let mut image = [P::ZERO; STRIP];
        for (first, out) in task.rows.step_by(STRIP).zip(task.out.chunks_mut(STRIP)) {
            let rows = first..first + out.len();
            let image = &mut image[..out.len()];
            self.operator.product(rows.clone(), task.window, task.sums, image);
            let v = &points[rows.start - start..rows.end - start];
            for (((out, r), &v), &ax) in out.iter_mut().zip(&r[rows]).zip(v).zip(&*image) {
                prefetch(std::slice::from_ref(out), POINTS_AHEAD);
                prefetch(std::slice::from_ref(r), POINTS_AHEAD);
                *out = v + (v - *out).times(gamma) + (*r - ax).times(tau);
            }
        }
    }
}

/// Cuts the vertices `range` out of what is `rest`, which begins at its second component; what comes before is let
/// go.
fn cut<'b, P>(rest: &mut (&'b mut [P], usize), range: Range<usize>) -> &'b mut [P] {
    let (slice, start) = (std::mem::take(&mut rest.0), rest.1);
    let (_, from) = slice.split_at_mut(range.start - start);
    let (part, after) = from.split_at_mut(range.len());
    *rest = (after, range.end);
    part
}
