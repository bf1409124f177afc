//! Spectral certificates by factorization (Sylvester's law of inertia): that no eigenvalue lies beyond a given number, and
//! how many lie below one.
//!
//! S = H^½ M H^½ is similar to A (or Dm^-½ M Dm^-½, Dm = diag M, to D⁻¹A). If S − σ has a Cholesky factorization, all
//! eigenvalues exceed σ; if LDLᵀ, its negative pivots count the eigenvalues below σ (Sylvester's law of inertia).

use chacha20::ChaCha8Rng;
use faer::Par;
use faer::Side;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use rand::{RngExt, SeedableRng};

use super::subspace_iteration::End;
use super::symmetric::{SymmetricForm, symmetric};
use crate::assemble::{Csr, LimitSystem};
use crate::error::{Error, Result};

/// A bound of the spectrum that a completed Cholesky factorization proves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate {
    /// At the lowest end: every eigenvalue is ≥ this; at the highest: ≤.
    pub bound: f64,
    /// The shift at which the factorization ran to completion.
    pub sigma: f64,
    /// What rounding may hide: |bound − sigma|.
    pub margin: f64,
    /// Factorizations tried.
    pub factorizations: usize,
}

/// Entries of a factor at most: 4 GiB.
const MOST_ENTRIES: usize = 1 << 29;
/// Entries of a simplicial factor at most: about ten seconds.
const MOST_ENTRIES_INERTIA: usize = 1 << 24;
/// Half the distance from 1 to the next double.
const ROUNDOFF: f64 = 0.5 * f64::EPSILON;

/// Proves a bound of the spectrum close to `estimate`, the computed end of it.
///
/// The shift starts at the estimate moved outwards by 1e-8 of its size (at least 1e-12) and moves 30 times as far
/// after each factorization that fails. If Cholesky's algorithm in doubles runs to completion on S̃, then
/// S̃ + E is positive definite with ‖E‖₂ ≤ γ/(1 − γ) tr S̃, γ = (N+1)u/(1 − (N+1)u), in whatever order the sums are taken
/// (Demmel 1989; Rump 2006); the entries of S̃ themselves are good to 6u relative. Both make the margin, so the
/// bound is a theorem about M and H as stored. `None` if five shifts fail: then the estimate was no end of the
/// spectrum.
///
/// Up to five sparse factorizations; with N = 10⁶ vertices the margin is about 5e-5.
///
/// # Errors
/// A factor of more than 4 GiB.
pub fn certify(system: &LimitSystem, form: SymmetricForm, end: End, estimate: f64) -> Result<Option<Certificate>> {
    let s = symmetric(system, form);
    let symbolic = analyse(&s, SupernodalThreshold::AUTO, MOST_ENTRIES)?;
    let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory(s.len()))?;
    let mut factor = vec![0.0; symbolic.len_val()];
    let n = s.len() as f64;
    let gamma = (n + 1.0) * ROUNDOFF / (1.0 - (n + 1.0) * ROUNDOFF);
    let row_sum = (0..s.len()).map(|i| s.row_values(i).iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let outwards = match end {
        End::Lowest => -1.0,
        End::Highest => 1.0,
    };
    let mut offset = (1e-8 * estimate.abs()).max(1e-12);
    for factorizations in 1..=5 {
        let sigma = estimate + outwards * offset;
        // Positive definite if σ lies outside: S − σ below, σ − S above.
        let values = shifted(&s, sigma, -outwards);
        let done = symbolic
            .factorize_numeric_llt(
                &mut factor,
                SparseColMatRef::new(pattern(&s), &values),
                Side::Upper,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .is_ok();
        // A completed factorization without a NaN: comparisons with NaN are false.
        if done && factor.iter().all(|x| x.is_finite()) {
            let trace: f64 = (0..s.len()).map(|i| (s.get(i, i) - sigma).abs()).sum();
            let margin = gamma / (1.0 - gamma) * trace + 6.0 * ROUNDOFF * (row_sum + sigma.abs());
            return Ok(Some(Certificate { bound: sigma + outwards * margin, sigma, margin, factorizations }));
        }
        offset *= 30.0;
    }
    Ok(None)
}

/// How many eigenvalues lie below a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Eigenvalues less than the shift σ, with multiplicity.
    pub below: usize,
    /// max ‖(LDLᵀ − (S − σ))x‖/‖x‖ over random x: what the count is a count of is S perturbed by a matrix of about
    /// this norm.
    pub backward_error: f64,
}

/// Backward error beyond which a count is refused: LDLᵀ without pivoting may grow on an indefinite matrix.
const LARGEST_BACKWARD_ERROR: f64 = 1e-11;

/// The number of eigenvalues of A, or D⁻¹A, below `sigma`, by the signs of the pivots of S − σ = LDLᵀ.
///
/// # Errors
/// A factor too large (some 200 000 vertices), a vanishing pivot (σ is an eigenvalue of a leading block), or a
/// factorization without pivoting that was not stable: then another σ will do.
pub fn eigenvalues_below(system: &LimitSystem, form: SymmetricForm, sigma: f64) -> Result<Inertia> {
    inertia(&symmetric(system, form), sigma)
}

/// The number of eigenvalues of the symmetric matrix `s` below `sigma`, as [`eigenvalues_below`].
///
/// # Errors
/// As there.
pub fn inertia(s: &Csr, sigma: f64) -> Result<Inertia> {
    let symbolic = analyse(s, SupernodalThreshold::FORCE_SIMPLICIAL, MOST_ENTRIES_INERTIA)?;
    let need = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory(s.len()))?;
    let mut factor = vec![0.0; symbolic.len_val()];
    let values = shifted(s, sigma, 1.0);
    symbolic
        .factorize_numeric_ldlt(
            &mut factor,
            SparseColMatRef::new(pattern(s), &values),
            Side::Upper,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .map_err(|_| unstable(sigma))?;
    let (SymbolicCholeskyRaw::Simplicial(l), Some(permutation)) = (symbolic.raw(), symbolic.perm()) else {
        return Err(Error::Computation("the factorization is not of the kind that was asked for".into()));
    };
    // Column j of L: its first entry holds d_j in place of the 1.
    let (starts, rows) = (l.col_ptr(), l.row_idx());
    let (place, _) = permutation.arrays();
    let column = |j: usize| starts[j] as usize..starts[j + 1] as usize;
    let n = s.len();
    let below = (0..n).filter(|&j| factor[column(j).start] < 0.0).count();
    let mut rng = ChaCha8Rng::seed_from_u64(0x4c_444c);
    let mut backward_error = 0.0f64;
    for _ in 0..3 {
        let x: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let permuted: Vec<f64> = place.iter().map(|&i| x[i as usize]).collect();
        let mut y = vec![0.0; n];
        for (j, y) in y.iter_mut().enumerate() {
            let range = column(j);
            let mut sum = permuted[j];
            for k in range.start + 1..range.end {
                sum += factor[k] * permuted[rows[k] as usize];
            }
            *y = sum * factor[range.start];
        }
        let mut z = y.clone();
        for (j, &y) in y.iter().enumerate() {
            for k in column(j).skip(1) {
                z[rows[k] as usize] += factor[k] * y;
            }
        }
        let (mut error, mut norm) = (0.0f64, 0.0f64);
        for (k, &i) in place.iter().enumerate() {
            let i = i as usize;
            let exact = s.row_times(i, &x) - sigma * x[i];
            error += (z[k] - exact).powi(2);
            norm += x[i] * x[i];
        }
        let here = (error / norm).sqrt();
        // Not f64::max, which would drop a NaN.
        if here.is_nan() || here > backward_error {
            backward_error = here;
        }
        if here.is_nan() {
            break;
        }
    }
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
    let symbolic = factorize_symbolic_cholesky(pattern(s), Side::Upper, SymmetricOrdering::Amd, params)
        .map_err(|_| out_of_memory(s.len()))?;
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
