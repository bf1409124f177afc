//! Multicolour sweeps of Gauss-Seidel and SOR: all rows of a colour at once.
//!
//! Where consecutive rows do not couple, a sweep in place may relax them in any order, or together, and gives the same
//! numbers: none of them reads what another writes. Rows [colour by colour](crate::mesh::colours::in_colours) make such
//! runs long, so that all threads have work, however many there are (Adams and Ortega 1982).
//!
//! The price against [waves](super::wavefront): a colour reads its neighbours from all over memory, so that a sweep
//! passes over the iterate about as often as there are colours (7 on irregular quads and triangles), while waves share
//! one pass among several sweeps. On a million vertices a sweep takes 24 ns a vertex on one thread and 12 on two, in
//! waves 12 and 7. Rows make the sums of faces anew, also where other sweeps [keep them up](Operator::sums_follow) with the
//! iterate: out of order that reads and writes as much, and the numbers are then equal to rounding. But waves have no more tasks at a time than sweeps in a group; colours have as many as threads want.

use std::ops::Range;

use glam::DVec3;

use crate::assemble::Operator;
use crate::parallel;

/// Rows of one task.
const PIECE: usize = 2048;
/// Rows whose new values wait together until all of them are made: they stay in the second-level cache.
const BLOCK: usize = 16 * PIECE;

/// An operator with its rows cut into runs that do not couple.
pub struct Coloured<'a> {
    operator: &'a Operator,
    /// The first row of every run, and the end.
    starts: Vec<usize>,
}

impl<'a> Coloured<'a> {
    /// Cuts the rows, in the order that they have, into runs as long as they can be. One parallel pass over the
    /// operator's neighbours, O(Σ|F|²) for large faces.
    pub fn new(operator: &'a Operator) -> Self {
        let n = operator.len();
        // One more than the last neighbour before each row; 0 without one.
        let before: Vec<u32> = parallel::collect(n, |i| {
            let mut before = 0;
            operator.neighbours(i, |j, _| {
                if j < i {
                    before = before.max(j as u32 + 1);
                }
            });
            before
        });
        let mut starts = vec![0];
        let mut start = 0;
        for (i, &before) in before.iter().enumerate() {
            if before as usize > start {
                start = i;
                starts.push(start);
            }
        }
        starts.push(n);
        Coloured { operator, starts }
    }

    /// The number of runs: that of the colours, or fewer, where rows are colour by colour.
    pub fn colours(&self) -> usize {
        self.starts.len() - 1
    }

    /// `count` sweeps in place, `x_i ← x_i + ω (p_i − (A x)_i)/a_ii`, in the order of the rows. Every number is the one
    /// that rows one after the other give, for any number of threads.
    ///
    /// # Panics
    /// If the arrays have not one point a vertex.
    pub fn relax(&self, omega: f64, count: usize, p: &[DVec3], x: &mut [DVec3]) {
        let n = self.operator.len();
        assert!(p.len() == n && x.len() == n, "one point a vertex");
        let mut fresh = vec![DVec3::ZERO; n.min(BLOCK)];
        // Within the thread pool, so that the many short parallel loops need not be handed over to it.
        rayon::scope(|_| {
            for _ in 0..count {
                for run in self.starts.windows(2) {
                    for first in (run[0]..run[1]).step_by(BLOCK) {
                        let rows = first..run[1].min(first + BLOCK);
                        self.block(omega, rows, p, x, &mut fresh);
                    }
                }
            }
        });
    }

    /// The new values of rows that do not couple go to `fresh` first, since all threads read `x`.
    fn block(&self, omega: f64, rows: Range<usize>, p: &[DVec3], x: &mut [DVec3], fresh: &mut [DVec3]) {
        let fresh = &mut fresh[..rows.len()];
        if rows.len() <= PIECE {
            self.piece(omega, rows.start, p, x, fresh);
            x[rows].copy_from_slice(fresh);
            return;
        }
        let old = &*x;
        parallel::chunks(fresh, PIECE, |first, fresh| self.piece(omega, rows.start + first, p, old, fresh));
        parallel::chunks(&mut x[rows], PIECE, |first, x| x.copy_from_slice(&fresh[first..first + x.len()]));
    }

    fn piece(&self, omega: f64, first: usize, p: &[DVec3], x: &[DVec3], fresh: &mut [DVec3]) {
        let diagonal = self.operator.diagonal();
        // Row by row: among the rows of a colour few of the same kind follow each other.
        for (i, fresh) in (first..).zip(fresh) {
            let e = p[i] - self.operator.row(i, x);
            *fresh = x[i] + (omega / diagonal[i]) * e;
        }
    }
}
