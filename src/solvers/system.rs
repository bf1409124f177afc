//! Interface between methods and linear systems, the parallel loop over rows that every fused update uses, and the
//! sweep in place.

use std::ops::Range;

use glam::DVec3;

use super::iteration::Errors;
use crate::assemble::bounds::SpectralBounds;
use crate::assemble::weights::Point;
use crate::assemble::{Csr, GeneralSystem, LimitSystem, Operator};
use crate::parallel;

/// Stored matrices: what factorizations need.
#[derive(Clone, Copy, Debug)]
pub enum Entries<'a> {
    /// A = H·M with both factors.
    Factors(&'a LimitSystem),
    /// The rows of an A without symmetry.
    Rows(&'a Csr),
}

/// The matrix A of a limit system: A = H·M with H = diag(weights) positive and M symmetric, or an A
/// [without symmetry](GeneralSystem), for which H = I.
pub trait System: Sync {
    /// The number of unknown points N.
    fn len(&self) -> usize;

    /// Whether there are no unknowns.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The diagonal of H.
    fn weights(&self) -> &[f64];

    /// The diagonal of A.
    fn diagonal(&self) -> &[f64];

    /// What is proven about the spectra of A and D⁻¹A.
    fn bounds(&self) -> SpectralBounds;

    /// An upper bound of the eigenvalues of A, which tells its scale: 1 for a scheme's matrix, whose rows sum to 1.
    fn lambda_max(&self) -> f64 {
        self.bounds().lambda_max
    }

    /// The stored matrices, where there are any.
    fn stored(&self) -> Option<Entries<'_>> {
        None
    }

    /// Row `i` of the product, (A x)_i, for x of one number or one point a vertex. In-place relaxation calls it while
    /// `x` changes.
    fn row<P: Point>(&self, i: usize, x: &[P]) -> P;

    /// Sums over `x` that the rows of one whole product share; none unless the system has some.
    fn prepare<P: Point>(&self, _x: &[P], shared: &mut Vec<P>) {
        shared.clear();
    }

    /// Whether sweeps in place keep these sums up with the iterate.
    fn sums_follow(&self) -> bool {
        false
    }

    /// As [`row`](Self::row), by these sums.
    fn row_by_sums(&self, i: usize, x: &[DVec3], _shared: &[DVec3]) -> DVec3 {
        self.row(i, x)
    }

    /// Has these sums follow a change of x_i by `change`.
    fn follow(&self, _i: usize, _change: DVec3, _shared: &mut [DVec3]) {}

    /// `out[k]` becomes (A x)_i of the k-th row i of `rows`; `shared` comes from [`prepare`](Self::prepare).
    fn product<P: Point>(&self, rows: Range<usize>, x: &[P], _shared: &[P], out: &mut [P]) {
        for (out, i) in out.iter_mut().zip(rows) {
            *out = self.row(i, x);
        }
    }
}

impl System for LimitSystem {
    fn len(&self) -> usize {
        self.h.len()
    }

    fn weights(&self) -> &[f64] {
        &self.h
    }

    fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    fn bounds(&self) -> SpectralBounds {
        self.bounds
    }

    fn stored(&self) -> Option<Entries<'_>> {
        Some(Entries::Factors(self))
    }

    #[inline]
    fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        self.a.row_times(i, x)
    }
}

impl System for GeneralSystem {
    fn len(&self) -> usize {
        self.matrix().len()
    }

    fn weights(&self) -> &[f64] {
        GeneralSystem::weights(self)
    }

    fn diagonal(&self) -> &[f64] {
        GeneralSystem::diagonal(self)
    }

    fn bounds(&self) -> SpectralBounds {
        GeneralSystem::bounds(self)
    }

    fn stored(&self) -> Option<Entries<'_>> {
        Some(Entries::Rows(self.matrix()))
    }

    #[inline]
    fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        self.matrix().row_times(i, x)
    }
}

impl System for Operator {
    fn len(&self) -> usize {
        Operator::len(self)
    }

    fn weights(&self) -> &[f64] {
        Operator::weights(self)
    }

    fn diagonal(&self) -> &[f64] {
        Operator::diagonal(self)
    }

    fn bounds(&self) -> SpectralBounds {
        Operator::bounds(self)
    }

    #[inline]
    fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        Operator::row(self, i, x)
    }

    fn prepare<P: Point>(&self, x: &[P], shared: &mut Vec<P>) {
        self.all_sums(x, shared);
    }

    fn sums_follow(&self) -> bool {
        Operator::sums_follow(self)
    }

    #[inline]
    fn row_by_sums(&self, i: usize, x: &[DVec3], shared: &[DVec3]) -> DVec3 {
        Operator::row_by_sums(self, i, (x, 0), |k| shared[k])
    }

    #[inline]
    fn follow(&self, i: usize, change: DVec3, shared: &mut [DVec3]) {
        Operator::follow(self, i, change, |k, part| shared[k] += part);
    }

    fn product<P: Point>(&self, rows: Range<usize>, x: &[P], shared: &[P], out: &mut [P]) {
        Operator::product(self, rows, (x, 0), (shared, 0), out);
    }
}

/// Rows of a product that is worked on while it is in the nearest cache.
pub(crate) const STRIP: usize = 128;

/// Rows of one task. Fixed, so that sums over rows do not depend on the number of threads.
const CHUNK: usize = 4096;

/// What a pass over the rows adds up.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    max_squared: f64,
    sum: f64,
    dot: f64,
}

impl Tally {
    /// Counts the difference vector `e` of one vertex into the error norms.
    #[inline]
    pub fn error(&mut self, e: DVec3) {
        let mut squared = e.length_squared();
        if squared < f64::MIN_POSITIVE && e != DVec3::ZERO {
            // What is left of the square may be nothing; the error is not told too small.
            squared = f64::MIN_POSITIVE;
        }
        if squared > self.max_squared {
            self.max_squared = squared;
        }
        // A NaN reaches the sum, whatever the comparison above makes of it.
        self.sum += squared.sqrt();
    }

    /// Adds one term of an inner product.
    #[inline]
    pub fn dot(&mut self, term: f64) {
        self.dot += term;
    }

    fn merge(self, other: Tally) -> Tally {
        Tally {
            max_squared: self.max_squared.max(other.max_squared),
            sum: self.sum + other.sum,
            dot: self.dot + other.dot,
        }
    }
}

/// The combined result of a pass: error norms and an inner product.
#[derive(Clone, Copy, Debug)]
pub struct Totals {
    /// The maximum and the mean length of the vectors counted by [`Tally::error`].
    pub errors: Errors,
    /// The sum of the terms given to [`Tally::dot`].
    pub dot: f64,
}

/// `out` becomes A x, of one number or one point a vertex, in parallel.
///
/// # Panics
/// If `x` or `out` has not one entry a vertex.
///
/// ```
/// use limitlab::assemble::Operator;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::system::product;
///
/// let surface = Surface::new(builtin::builtin("torus:4x4")?)?;
/// let operator = Operator::new(&surface, Scheme::CatmullClark)?;
/// let mut image = vec![0.0; 16];
/// product(&operator, &[1.0; 16], &mut image);
/// assert!(image.iter().all(|y| (y - 1.0f64).abs() < 1e-15));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn product<S: System, P: Point>(system: &S, x: &[P], out: &mut [P]) {
    assert!(x.len() == system.len() && out.len() == system.len(), "one entry a vertex");
    let mut shared = Vec::new();
    system.prepare(x, &mut shared);
    parallel::chunks(out, CHUNK, |first, part| {
        for (k, strip) in part.chunks_mut(STRIP).enumerate() {
            let first = first + k * STRIP;
            system.product(first..first + strip.len(), x, &shared, strip);
        }
    });
}

/// One in-place sweep over the vertices in the order given.
pub fn sweep<S: System>(system: &S, points: &[DVec3], omega: f64, order: impl Iterator<Item = usize>, x: &mut [DVec3]) {
    sweep_with(system, points, omega, order, x, &mut Vec::new());
}

/// As [`sweep`], with memory for the sums over faces that rows share: they are made once and follow the iterate, so that a row and
/// what becomes of them cost O(faces) instead of O(corners of faces).
pub(super) fn sweep_with<S: System>(
    system: &S,
    points: &[DVec3],
    omega: f64,
    order: impl Iterator<Item = usize>,
    x: &mut [DVec3],
    shared: &mut Vec<DVec3>,
) {
    let diagonal = system.diagonal();
    if !system.sums_follow() {
        for i in order {
            let e = points[i] - system.row(i, x);
            x[i] += (omega / diagonal[i]) * e;
        }
        return;
    }
    system.prepare(x, shared);
    for i in order {
        let change = (omega / diagonal[i]) * (points[i] - system.row_by_sums(i, x, shared));
        x[i] += change;
        system.follow(i, change, shared);
    }
}

/// Passes over all rows, in parallel, with sums that are the same for any number of threads: each chunk of 4096
/// rows is added up in row order, the chunks in their order.
#[derive(Clone, Debug)]
pub struct Rows {
    tallies: Vec<Tally>,
    n: usize,
    shared: Vec<DVec3>,
}

impl Rows {
    /// Passes over `n` rows.
    pub fn new(n: usize) -> Self {
        Rows { tallies: vec![Tally::default(); n.div_ceil(CHUNK)], n, shared: Vec::new() }
    }

    /// Calls `visit(i, &mut a[i], &mut b[i], tally)` for every row.
    pub fn pass<A: Send, B: Send>(
        &mut self,
        a: &mut [A],
        b: &mut [B],
        visit: impl Fn(usize, &mut A, &mut B, &mut Tally) + Sync,
    ) -> Totals {
        self.chunks(a, b, |first, a, b, tally| {
            for (offset, (a, b)) in a.iter_mut().zip(b).enumerate() {
                visit(first + offset, a, b, tally);
            }
        })
    }

    /// Calls `visit(i, (A x)_i, &mut a[i], &mut b[i], tally)` for every row.
    pub fn product<S: System, A: Send, B: Send>(
        &mut self,
        system: &S,
        x: &[DVec3],
        a: &mut [A],
        b: &mut [B],
        visit: impl Fn(usize, DVec3, &mut A, &mut B, &mut Tally) + Sync,
    ) -> Totals {
        let mut shared = std::mem::take(&mut self.shared);
        system.prepare(x, &mut shared);
        let totals = self.chunks(a, b, |first, a, b, tally| {
            let mut image = [DVec3::ZERO; STRIP];
            for (k, (a, b)) in a.chunks_mut(STRIP).zip(b.chunks_mut(STRIP)).enumerate() {
                let first = first + k * STRIP;
                let image = &mut image[..a.len()];
                system.product(first..first + a.len(), x, &shared, image);
                for (i, ((&ax, a), b)) in (first..).zip(image.iter().zip(a).zip(b)) {
                    visit(i, ax, a, b, tally);
                }
            }
        });
        self.shared = shared;
        totals
    }

    /// Calls `chunk(first row, its part of a, its part of b, tally)` for chunks of 4096 rows.
    fn chunks<A: Send, B: Send>(
        &mut self,
        a: &mut [A],
        b: &mut [B],
        chunk: impl Fn(usize, &mut [A], &mut [B], &mut Tally) + Sync,
    ) -> Totals {
        self.tallies.fill(Tally::default());
        parallel::chunks_of_two(a, b, CHUNK, &mut self.tallies, chunk);
        let total = self.tallies.iter().fold(Tally::default(), |sum, &t| sum.merge(t));
        let mean = total.sum / self.n.max(1) as f64;
        let max = if mean.is_nan() { f64::NAN } else { total.max_squared.sqrt() };
        Totals { errors: Errors { max, mean }, dot: total.dot }
    }

    /// The differences e_i = p_i − (A x)_i are handed to `visit(i, e_i, &mut out[i], tally)` after they were
    /// counted into the error norms.
    pub fn residual<S: System, B: Send>(
        &mut self,
        system: &S,
        points: &[DVec3],
        x: &[DVec3],
        out: &mut [B],
        visit: impl Fn(usize, DVec3, &mut B, &mut Tally) + Sync,
    ) -> Totals {
        // A vector of () takes no memory.
        let mut nothing = vec![(); out.len()];
        self.product(system, x, out, &mut nothing, |i, ax, out, (), tally| {
            let e = points[i] - ax;
            tally.error(e);
            visit(i, e, out, tally);
        })
    }

    /// As [`pass`](Self::pass), over one array.
    pub fn pass_one<A: Send>(&mut self, a: &mut [A], visit: impl Fn(usize, &mut A, &mut Tally) + Sync) -> Totals {
        let mut nothing = vec![(); a.len()];
        self.pass(a, &mut nothing, |i, a, (), tally| visit(i, a, tally))
    }

    /// The error norms of `x` alone.
    pub fn errors<S: System>(&mut self, system: &S, points: &[DVec3], x: &[DVec3]) -> Errors {
        let mut nothing = vec![(); self.n];
        self.residual(system, points, x, &mut nothing, |_, _, (), _| {}).errors
    }
}
