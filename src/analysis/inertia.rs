//! Spectral certificates by factorization: that no eigenvalue lies beyond a given number (a completed Cholesky
//! factorization), how many lie below one (Sylvester's law of inertia), and that some eigenvalue reaches one (a Rayleigh
//! quotient). All rounding is bounded, none estimated.
//!
//! S = diag(s) M diag(s) is similar to A for s = √h, to D⁻¹A for s = 1/√m_ii. Let S̃ be S ∓ σ as it is stored, and L its
//! Cholesky factor in doubles, of which row j has ν_j entries. Whatever the order of the sums, with or without fused
//! multiplications, and with multiplication by a reciprocal in place of a division,
//!
//! `|S̃ − LLᵀ|_ij ≤ γ_min(m_i,m_j) (|L||L|ᵀ)_ij`, m_j = ν_j + 6, γ_m = mu/(1 − mu), u = 2⁻⁵³
//!
//! (Higham 2002, Lemma 8.4 and Theorem 10.3: an entry is the end of a sum of at most ν_j − 1 products, and six more
//! roundings are those of a square root, a reciprocal and four products). The rows of L have ‖l_j‖² ≤ s̃_jj/(1 − γ_m_j), so
//!
//! `‖S̃ − LLᵀ‖₂ ≤ Σ_j γ_m_j/(1 − γ_m_j) s̃_jj`
//!
//! (Demmel 1989; Rump 2006, BIT 46), a number that is known before the factorization: if that runs to completion, no
//! eigenvalue of S̃ is less than its negative. For S̃ = LDLᵀ with any signs the first bound holds with |L||D||L|ᵀ, whose rows
//! are summed.

use chacha20::ChaCha8Rng;
use faer::MatMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use limitlab_factorizations::sparse::{
    ldlt, ldlt_scratch, llt, llt_scratch, llt_solve, solve_scratch, symbolic_cholesky,
};
use rand::{RngExt, SeedableRng};

use super::subspace_iteration::End;
use super::symmetric::{SymmetricForm, scales, symmetric};
use crate::assemble::{Csr, LimitSystem};
use crate::error::{Error, Result};
use crate::parallel;

/// What a completed Cholesky factorization and a Rayleigh quotient prove: an end of the spectrum lies between two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate {
    /// At the lowest end: every eigenvalue is ≥ this; at the highest: ≤.
    pub bound: f64,
    /// At the lowest end: some eigenvalue is ≤ this; at the highest: ≥. A Rayleigh quotient and all that rounding may have
    /// taken from it.
    pub attained: f64,
    /// The shift at which the factorization ran to completion.
    pub sigma: f64,
    /// What rounding may hide: |bound − sigma|, up to the last digit.
    pub margin: f64,
    /// Factorizations tried.
    pub factorizations: usize,
}

/// Entries of a factor at most: 4 GiB.
const MOST_ENTRIES: usize = 1 << 29;
/// Entries of a simplicial factor at most: about ten seconds.
const MOST_ENTRIES_INERTIA: usize = 1 << 24;
/// u, half the distance from 1 to the next double.
const ROUNDOFF: f64 = 0.5 * f64::EPSILON;
/// Roundings of an entry of a factor that are not those of its sum.
const BESIDE_SUM: f64 = 6.0;
/// Roundings behind an entry of H, of S, or behind one term of a sum in M: in the weights of a scheme (at most 20, with the
/// cosine good to one unit in the last place, as `tests/spectra` confirms in more digits), in their scaling.
const FORMED: f64 = 32.0;
/// Sums of roundings are enlarged by this, which is more than their own rounding for fewer than 2³² terms.
const ROUNDED_UP: f64 = 1.0 + 1e-6;
/// Factorizations at most.
const TRIES: usize = 5;
/// Solutions with the factor, from a random start, for the vector of the Rayleigh quotient: the first two suffice where the
/// shift is near the end.
const SOLUTIONS: usize = 4;
/// Entries of that vector below this part of the largest are put to zero, so that no product underflows.
const NOTHING: f64 = 1e-100;
/// Terms of a sum that are added up one after the other.
const CHUNK: usize = 1024;

/// γ_m = mu/(1 − mu): the relative error of m roundings (Higham 2002, Lemma 3.1).
fn gamma(m: f64) -> f64 {
    m * ROUNDOFF / (1.0 - m * ROUNDOFF)
}

/// Encloses the end of the spectrum of A or D⁻¹A near `estimate`, the computed end of it, between proven numbers.
///
/// The shift starts at the estimate moved outwards by `within` of its size, or by what rounding may hide where that is more,
/// and moves 30 times as far after each factorization that fails. One that completes proves the bound; inverse iteration with
/// its factor gives a vector whose Rayleigh quotient is the other side.
///
/// Proven is a statement about A = H·M as a scheme defines it, up to the accuracy of the cosine: the roundings of the weights,
/// of their sums and of S are counted, as those of the factorization are (see the module). Of a system of other origin it is
/// one about H and M as stored. `None` if five shifts fail: then the estimate was no end of the spectrum.
///
/// One sparse factorization, or up to five, and four solutions. What rounding may hide is some 10⁻⁹ with N = 10⁶
/// vertices.
///
/// # Errors
/// A factor of more than 4 GiB.
///
/// ```
/// use limitlab::analysis::inertia::certify;
/// use limitlab::analysis::{subspace_iteration::End, symmetric::SymmetricForm};
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
///
/// let system = LimitSystem::new(&Surface::new(builtin::builtin("torus:8x6")?)?, Scheme::CatmullClark)?;
/// let proof = certify(&system, SymmetricForm::A, End::Lowest, 1.0 / 9.0, 1e-10)?.expect("an end of the spectrum");
/// // λ_min = 1/9, by the symbol.
/// assert!(proof.bound <= 1.0 / 9.0 && 1.0 / 9.0 <= proof.attained && proof.attained - proof.bound < 1e-10);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn certify(
    system: &LimitSystem,
    form: SymmetricForm,
    end: End,
    estimate: f64,
    within: f64,
) -> Result<Option<Certificate>> {
    let mut prover = Prover::new(system, form, end)?;
    let outwards = prover.outwards();
    let mut offset = (within * estimate.abs()).max(prover.margin(estimate));
    for factorizations in 1..=TRIES {
        if let Some(found) = prover.certificate(estimate + outwards * offset) {
            return Ok(Some(Certificate { factorizations, ..found }));
        }
        offset *= 30.0;
    }
    Ok(None)
}

/// What one factorization at the shift `sigma` proves; `None` if it does not run to completion, which proves nothing.
///
/// # Errors
/// A factor of more than 4 GiB.
pub fn certify_at(system: &LimitSystem, form: SymmetricForm, end: End, sigma: f64) -> Result<Option<Certificate>> {
    Ok(Prover::new(system, form, end)?.certificate(sigma))
}

/// S, the pattern of its factors, and what of their rounding does not depend on the shift.
struct Prover<'a> {
    system: &'a LimitSystem,
    form: SymmetricForm,
    end: End,
    s: Csr,
    symbolic: SymbolicCholesky<u32>,
    scratch: MemBuffer,
    factor: Vec<f64>,
    /// γ/(1 − γ) of every row of S.
    weights: Vec<f64>,
    diagonal: Vec<f64>,
    /// What forming S may change its eigenvalues by.
    formed: f64,
}

impl<'a> Prover<'a> {
    fn new(system: &'a LimitSystem, form: SymmetricForm, end: End) -> Result<Self> {
        let s = symmetric(system, form);
        let symbolic = analyse(&s, SupernodalThreshold::AUTO, MOST_ENTRIES)?;
        let need = llt_scratch(&symbolic).or(solve_scratch(&symbolic, 1));
        let scratch = MemBuffer::try_new(need).map_err(|_| out_of_memory(s.len()))?;
        let factor = vec![0.0; symbolic.len_val()];
        let weights = entries_of_rows(&symbolic).into_iter().map(|m| {
            let gamma = gamma(m + BESIDE_SUM);
            gamma / (1.0 - gamma)
        });
        let weights = weights.collect();
        let (diagonal, formed) = (s.diagonal(), formation_error(&s));
        Ok(Prover { system, form, end, s, symbolic, scratch, factor, weights, diagonal, formed })
    }

    fn outwards(&self) -> f64 {
        match self.end {
            End::Lowest => -1.0,
            End::Highest => 1.0,
        }
    }

    /// By how much an eigenvalue may lie beyond `sigma` if the factorization there runs to completion.
    fn margin(&self, sigma: f64) -> f64 {
        let (mut factor, mut largest) = (0.0, 0.0f64);
        for (weight, value) in self.weights.iter().zip(&self.diagonal) {
            let shifted = (value - sigma).abs();
            factor += weight * shifted;
            largest = largest.max(shifted);
        }
        // Each of the N² entries may miss a few products that are less than the least normal number.
        let n = self.weights.len() as f64;
        let underflow = 8.0 * n * n * largest.max(1.0).powi(2) * f64::MIN_POSITIVE;
        ROUNDED_UP * (factor + self.formed + ROUNDOFF * largest + FORMED * ROUNDOFF * sigma.abs() + underflow)
    }

    fn certificate(&mut self, sigma: f64) -> Option<Certificate> {
        let outwards = self.outwards();
        // Positive definite if σ lies outside: S − σ below, σ − S above.
        let values = shifted(&self.s, sigma, -outwards);
        let matrix = SparseColMatRef::new(pattern(&self.s), &values);
        let done = llt(&self.symbolic, &mut self.factor, matrix, MemStack::new(&mut self.scratch));
        // A factorization that met a NaN or an infinity is none.
        if done.is_err() || !self.factor.iter().all(|x| x.is_finite()) {
            return None;
        }
        let margin = self.margin(sigma);
        let vector = self.inverse_iteration();
        let (low, high) = rayleigh_enclosure(self.system, self.form, &vector);
        let (bound, attained) = match self.end {
            End::Lowest => ((sigma - margin).next_down(), high),
            End::Highest => ((sigma + margin).next_up(), low),
        };
        Some(Certificate { bound, attained, sigma, margin, factorizations: 1 })
    }

    /// A vector near the eigenvector of A or D⁻¹A at the end, of largest entry 1. Nothing rests on how near.
    fn inverse_iteration(&mut self) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(0x52_6179);
        let n = self.s.len();
        let mut x: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        for _ in 0..SOLUTIONS {
            let column = MatMut::from_column_major_slice_mut(&mut x, n, 1);
            llt_solve(&self.symbolic, &self.factor, column, MemStack::new(&mut self.scratch));
            normalize(&mut x);
        }
        for (x, scale) in x.iter_mut().zip(scales(self.system, self.form)) {
            *x *= scale;
        }
        normalize(&mut x);
        x
    }
}

/// Divides by the largest entry.
fn normalize(x: &mut [f64]) {
    let largest = x.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    x.iter_mut().for_each(|x| *x /= largest);
}

/// Two numbers between which the Rayleigh quotient xᵀMx/xᵀH⁻¹x (D⁻¹A: xᵀMx/Σ m_ii x_i²) of a vector of largest entry 1
/// lies for certain, so that λ_min is at most the second and λ_max at least the first.
///
/// Each sum is within γ_k of the sum of its absolute terms, k roundings being behind every term at most. M and H are taken to
/// be as far from what they stand for as [`certify`] says. O(entries).
///
/// # Panics
/// If there is not one number a row.
pub fn rayleigh_enclosure(system: &LimitSystem, form: SymmetricForm, x: &[f64]) -> (f64, f64) {
    let n = system.len();
    assert_eq!(x.len(), n, "one number a row");
    let x: Vec<f64> = x.iter().map(|&x| if x.abs() < NOTHING { 0.0 } else { x }).collect();
    let parts = parallel::map(n, CHUNK, |rows| {
        let (mut product, mut absolute, mut square) = (0.0, 0.0, 0.0);
        for i in rows {
            let (mut sum, mut of_absolutes, mut own) = (0.0, 0.0, 0.0);
            for (j, m) in system.m.row(i) {
                sum += m * x[j];
                of_absolutes += m.abs() * x[j].abs();
                if i == j {
                    own = m;
                }
            }
            product += x[i] * sum;
            absolute += x[i].abs() * of_absolutes;
            square += match form {
                SymmetricForm::A => x[i] * x[i] / system.h[i],
                SymmetricForm::Jacobi => own * x[i] * x[i],
            };
        }
        [product, absolute, square]
    });
    let add = |sum: [f64; 3], part: &[f64; 3]| [sum[0] + part[0], sum[1] + part[1], sum[2] + part[2]];
    let [product, absolute, square] = parts.iter().fold([0.0; 3], add);
    let longest = (0..n).map(|i| system.m.row(i).len()).max().unwrap_or(0);
    let roundings = gamma((3 * longest + CHUNK + parts.len()) as f64 + FORMED + 8.0);
    let underflow = (system.m.values().len() + n) as f64 * f64::MIN_POSITIVE;
    let error = ROUNDED_UP * (roundings * absolute + underflow);
    let (least, most) = (product - error, product + error);
    let part = ROUNDED_UP * roundings;
    let (smallest, largest) = (square * (1.0 - part) - underflow, square * (1.0 + part) + underflow);
    let low = least / if least >= 0.0 { largest } else { smallest };
    let high = most / if most >= 0.0 { smallest } else { largest };
    let certain = smallest > 0.0 && low.is_finite() && high.is_finite();
    if certain { (low.next_down(), high.next_up()) } else { (f64::NEG_INFINITY, f64::INFINITY) }
}

/// How many entries each row of the factor has at most, the diagonal one with it, by rows of the matrix.
fn entries_of_rows(symbolic: &SymbolicCholesky<u32>) -> Vec<f64> {
    let mut entries = vec![0u32; symbolic.nrows()];
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(l) => l.row_idx().iter().for_each(|&i| entries[i as usize] += 1),
        SymbolicCholeskyRaw::Supernodal(l) => {
            let ends = l.supernode_end();
            for (k, &end) in ends.iter().enumerate() {
                let block = l.supernode(k);
                let width = end - block.start() as u32;
                (1..).zip(&mut entries[block.start()..end as usize]).for_each(|(count, entries)| *entries += count);
                block.pattern().iter().for_each(|&i| entries[i as usize] += width);
            }
        }
    }
    let Some(permutation) = symbolic.perm() else { return entries.into_iter().map(f64::from).collect() };
    let (_, place) = permutation.arrays();
    place.iter().map(|&k| f64::from(entries[k as usize])).collect()
}

/// What the roundings of its entries may change the eigenvalues of a symmetric matrix by: no more than a sum of |entries|
/// of a row, times the relative error, which is that of a sum of as many terms as there are edges and corners at a vertex.
fn formation_error(s: &Csr) -> f64 {
    let of_row = |i: usize| {
        let row = s.row_values(i);
        gamma(2.0 * row.len() as f64 + FORMED) * row.iter().map(|v| v.abs()).sum::<f64>()
    };
    (0..s.len()).map(of_row).fold(0.0, f64::max)
}

/// How many eigenvalues lie below a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Negative pivots: eigenvalues less than the shift σ, with multiplicity, of S moved by a matrix of norm
    /// [`backward_error`](Self::backward_error) at most. So at least as many as this are less than σ + that, and at most as
    /// many are less than σ − that.
    pub below: usize,
    /// What rounding may hide.
    pub backward_error: f64,
}

/// Backward error beyond which a count is refused: LDLᵀ without pivoting may grow on an indefinite matrix.
pub const LARGEST_BACKWARD_ERROR: f64 = 1e-11;

/// The number of eigenvalues of A, or D⁻¹A, below `sigma`, by the signs of the pivots of S − σ = LDLᵀ.
///
/// # Errors
/// A factor too large (some 200 000 vertices), a vanishing pivot (σ is an eigenvalue of a leading block), or a
/// factorization without pivoting that was not stable: then another σ will do.
pub fn eigenvalues_below(system: &LimitSystem, form: SymmetricForm, sigma: f64) -> Result<Inertia> {
    let s = symmetric(system, form);
    let found = inertia(&s, sigma)?;
    let formed = formation_error(&s) + FORMED * ROUNDOFF * sigma.abs();
    Ok(Inertia { backward_error: found.backward_error + ROUNDED_UP * formed, ..found })
}

/// The number of eigenvalues of the symmetric matrix `s` below `sigma`, as [`eigenvalues_below`].
///
/// # Errors
/// As there.
pub fn inertia(s: &Csr, sigma: f64) -> Result<Inertia> {
    let symbolic = analyse(s, SupernodalThreshold::FORCE_SIMPLICIAL, MOST_ENTRIES_INERTIA)?;
    let mut memory = MemBuffer::try_new(ldlt_scratch(&symbolic)).map_err(|_| out_of_memory(s.len()))?;
    let mut factor = vec![0.0; symbolic.len_val()];
    let values = shifted(s, sigma, 1.0);
    let matrix = SparseColMatRef::new(pattern(s), &values);
    ldlt(&symbolic, &mut factor, matrix, MemStack::new(&mut memory)).map_err(|_| unstable(sigma))?;
    let (SymbolicCholeskyRaw::Simplicial(l), Some(permutation)) = (symbolic.raw(), symbolic.perm()) else {
        return Err(Error::Computation("the factorization is not of the kind that was asked for".into()));
    };
    // Column j of L: its first entry holds d_j in place of the 1.
    let (starts, rows) = (l.col_ptr(), l.row_idx());
    let (place, _) = permutation.arrays();
    let column = |j: usize| starts[j] as usize..starts[j + 1] as usize;
    let n = s.len();
    let below = (0..n).filter(|&j| factor[column(j).start] < 0.0).count();
    // |D||L|ᵀ1, then |L| times that: the sums of the rows of |L||D||L|ᵀ.
    let mut sums = vec![0.0; n];
    for j in 0..n {
        let range = column(j);
        let size: f64 = 1.0 + factor[range.start + 1..range.end].iter().map(|l| l.abs()).sum::<f64>();
        let size = factor[range.start].abs() * size;
        sums[j] += size;
        for k in range.skip(1) {
            sums[rows[k] as usize] += factor[k].abs() * size;
        }
    }
    let entries = entries_of_rows(&symbolic);
    let largest = place.iter().zip(&sums).fold(0.0f64, |most, (&i, sum)| {
        let of_row = gamma(entries[i as usize] + BESIDE_SUM) * sum;
        // Not f64::max, which would drop a NaN.
        if of_row.is_nan() || of_row > most { of_row } else { most }
    });
    let diagonal = values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let backward_error = ROUNDED_UP * (largest + ROUNDOFF * diagonal + 8.0 * (n * n) as f64 * f64::MIN_POSITIVE);
    if backward_error.is_nan() || backward_error > LARGEST_BACKWARD_ERROR {
        return Err(unstable(sigma));
    }
    Ok(Inertia { below, backward_error })
}

pub(super) fn pattern(s: &Csr) -> SymbolicSparseColMatRef<'_, u32> {
    let (offsets, columns) = (s.pattern().offsets(), s.pattern().columns());
    SymbolicSparseColMatRef::new_checked(s.len(), s.len(), offsets, None, columns)
}

/// The entries of ±(S − σ).
pub(super) fn shifted(s: &Csr, sigma: f64, sign: f64) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(s.values().len());
    for i in 0..s.len() {
        values.extend(s.row(i).map(|(j, v)| sign * if i == j { v - sigma } else { v }));
    }
    values
}

/// The pattern of the factor of a matrix of this pattern, of `most` entries at most.
pub(super) fn analyse(
    s: &Csr,
    supernodal_flop_ratio_threshold: SupernodalThreshold,
    most: usize,
) -> Result<SymbolicCholesky<u32>> {
    let params = CholeskySymbolicParams { supernodal_flop_ratio_threshold, ..Default::default() };
    let symbolic = symbolic_cholesky(pattern(s), params).map_err(|_| out_of_memory(s.len()))?;
    if symbolic.len_val() > most {
        return Err(Error::Computation(format!(
            "the factor for {} vertices would have {} entries, at most {most} are allowed; use a mesh about {:.0} times \
             smaller, or the eigenvalue estimates, which need no factor",
            s.len(),
            symbolic.len_val(),
            (symbolic.len_val() as f64 / most as f64).ceil()
        )));
    }
    Ok(symbolic)
}

fn out_of_memory(n: usize) -> Error {
    Error::Computation(format!(
        "memory or 32-bit indices do not suffice to factor the matrix of {n} vertices; use a smaller mesh, or the \
         eigenvalue estimates, which need no factor"
    ))
}

fn unstable(sigma: f64) -> Error {
    Error::Computation(format!("LDLᵀ without pivoting is not stable at the shift {sigma}; use another shift"))
}
