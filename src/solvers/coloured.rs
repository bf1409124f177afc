//! Multicolour sweeps of Gauss-Seidel and SOR: all rows of a colour at once.
//!
//! Where consecutive rows do not couple, a sweep in place may relax them in any order, or together, and gives the same
//! numbers: none of them reads what another writes. Rows [colour by colour](crate::mesh::colours::in_colours) make such
//! runs long, so that all threads have work, however many there are (Adams and Ortega 1982).
//!
//! The price against [waves](super::wavefront): a colour reads its neighbours from all over memory, so that a sweep
//! passes over the iterate about as often as there are colours (7 on irregular quads and triangles), while waves share
//! one pass among several sweeps. On a million vertices a sweep takes 24 ns a vertex on one thread and 12 on two, in
//! waves 12 and 7. But waves have no more tasks at a time than sweeps in a group; colours have as many as threads want.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use crate::assemble::Operator;
use crate::parallel;

/// Rows of one task.
const PIECE: usize = 2048;
/// Rows whose changes wait together until all of them are made: they stay in the second-level cache.
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
        let mut changes = vec![DVec3::ZERO; n.min(BLOCK)];
        let mut sums = Sums::default();
        // Within the thread pool, so that the many short parallel loops need not be handed over to it.
        rayon::scope(|_| {
            for _ in 0..count {
                sums.make(self.operator, x);
                for run in self.starts.windows(2) {
                    for first in (run[0]..run[1]).step_by(BLOCK) {
                        let rows = first..run[1].min(first + BLOCK);
                        self.block(omega, rows, p, x, (&mut changes, &sums));
                    }
                }
            }
        });
    }

    /// The changes of rows that do not couple are all made first, since all threads read `x`.
    fn block(
        &self,
        omega: f64,
        rows: Range<usize>,
        p: &[DVec3],
        x: &mut [DVec3],
        (changes, sums): (&mut [DVec3], &Sums),
    ) {
        let changes = &mut changes[..rows.len()];
        if rows.len() <= PIECE {
            self.piece(omega, rows.start, p, x, (changes, sums));
            self.add(rows.start, changes, &mut x[rows], sums);
            return;
        }
        let old = &*x;
        parallel::chunks(changes, PIECE, |first, changes| {
            self.piece(omega, rows.start + first, p, old, (changes, sums));
        });
        parallel::chunks(&mut x[rows.clone()], PIECE, |first, x| {
            self.add(rows.start + first, &changes[first..first + x.len()], x, sums);
        });
    }

    fn piece(&self, omega: f64, first: usize, p: &[DVec3], x: &[DVec3], (changes, sums): (&mut [DVec3], &Sums)) {
        let diagonal = self.operator.diagonal();
        // Row by row: among the rows of a colour few of the same kind follow each other.
        for (i, change) in (first..).zip(changes) {
            let e = p[i] - self.operator.row_by_sums(i, (x, 0), |k| sums.get(k));
            *change = (omega / diagonal[i]) * e;
        }
    }

    fn add(&self, first: usize, changes: &[DVec3], x: &mut [DVec3], sums: &Sums) {
        for (i, (x, &change)) in (first..).zip(x.iter_mut().zip(changes)) {
            *x += change;
            self.operator.follow(i, change, |k, part| sums.set(k, sums.get(k) + part));
        }
    }
}

/// The sums over faces, which follow the iterate. Rows of a run share no face, so each is changed by one thread at a time; what
/// one run writes the next one reads, after its tasks have ended.
#[derive(Default)]
struct Sums(Vec<[AtomicU64; 3]>);

impl Sums {
    fn make(&mut self, operator: &Operator, x: &[DVec3]) {
        let mut made = Vec::new();
        operator.all_sums(x, &mut made);
        let bits = |k: usize| made[k].to_array().map(|x| AtomicU64::new(x.to_bits()));
        if self.0.len() == made.len() {
            parallel::fill(&mut self.0, bits);
        } else {
            self.0 = parallel::collect(made.len(), bits);
        }
    }

    #[inline]
    fn get(&self, k: usize) -> DVec3 {
        DVec3::from_array(self.0[k].each_ref().map(|x| f64::from_bits(x.load(Ordering::Relaxed))))
    }

    #[inline]
    fn set(&self, k: usize, sum: DVec3) {
        for (x, value) in self.0[k].iter().zip(sum.to_array()) {
            x.store(value.to_bits(), Ordering::Relaxed);
        }
    }
}
