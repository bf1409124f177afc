//! ±(S − σ)⁻¹ of a sparse symmetric matrix, with σ beyond an end of its spectrum: what is clustered at that end of S is spread
//! out by it (Ericsson and Ruhe 1980).

use faer::MatMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::SymbolicCholesky;
use limitlab_factorizations::sparse::{llt, llt_scratch, llt_solve, solve_scratch};

use super::inertia::{analyse, pattern, shifted};
use super::subspace_iteration::End;
use crate::assemble::Csr;
use crate::memory::require;
use crate::parallel;

/// Columns that are solved for at once, by one thread.
pub(super) const LANES: usize = 8;
/// Entries of a factor at most: 4 GiB.
const MOST_ENTRIES: usize = 1 << 29;

/// S, and the Cholesky factor of S − σ (σ − S at the highest end).
pub(super) struct ShiftInvert<'a> {
    s: &'a Csr,
    end: End,
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    scratch: Vec<MemBuffer>,
    /// The shift of the factor.
    pub sigma: f64,
}

impl<'a> ShiftInvert<'a> {
    /// Factors at `ritz`, a value at the end, moved outwards by `distance`, or by four times as much until no eigenvalue lies
    /// beyond; for blocks of `width` vectors. `None` if that does not happen, or where memory has no room for the factor.
    pub fn new(s: &'a Csr, end: End, width: usize, ritz: f64, distance: f64) -> Option<Self> {
        let symbolic = analyse(s, SupernodalThreshold::AUTO, MOST_ENTRIES).ok()?;
        let bytes = 8 * (symbolic.len_val() + 2 * width * s.len()) as u64;
        require(bytes, || "a factor".into(), "use a smaller mesh").ok()?;
        let need = solve_scratch(&symbolic, LANES);
        let scratch = (0..width / LANES).map(|_| MemBuffer::try_new(need).ok()).collect::<Option<_>>()?;
        let factor = vec![0.0; symbolic.len_val()];
        let mut inverse = ShiftInvert { s, end, symbolic, factor, scratch, sigma: f64::NAN };
        inverse.move_to(ritz, distance).then_some(inverse)
    }

    /// The same factor at another shift. Whether there is one.
    pub fn move_to(&mut self, ritz: f64, mut distance: f64) -> bool {
        const TRIES: usize = 5;
        let Ok(mut memory) = MemBuffer::try_new(llt_scratch(&self.symbolic)) else { return false };
        let outwards = match self.end {
            End::Lowest => -1.0,
            End::Highest => 1.0,
        };
        for _ in 0..TRIES {
            self.sigma = ritz + outwards * distance;
            let values = shifted(self.s, self.sigma, -outwards);
            let matrix = SparseColMatRef::new(pattern(self.s), &values);
            if llt(&self.symbolic, &mut self.factor, matrix, MemStack::new(&mut memory)).is_ok() {
                return true;
            }
            distance *= 4.0;
        }
        false
    }

    /// The eigenvalue of the inverse that λ of S becomes: 1/|λ − σ|.
    pub fn image(&self, lambda: f64) -> f64 {
        1.0 / (lambda - self.sigma).abs()
    }

    /// `z ← ±(S − σ)⁻¹ x`: `x` by rows, of as many vectors as the factor was made for, `z` by columns. In parallel over
    /// columns, eight a thread.
    pub fn solve(&mut self, x: &[f64], z: &mut [f64]) {
        let n = self.s.len();
        let width = z.len() / n;
        let (symbolic, factor) = (&self.symbolic, &self.factor);
        parallel::chunks_with(z, LANES * n, &mut self.scratch, |first, z, memory| {
            for (j, column) in (first / n..).zip(z.chunks_exact_mut(n)) {
                for (z, row) in column.iter_mut().zip(x.chunks_exact(width)) {
                    *z = row[j];
                }
            }
            let z = MatMut::from_column_major_slice_mut(z, n, LANES);
            llt_solve(symbolic, factor, z, MemStack::new(memory));
        });
    }
}
