//! Limit systems from given factors H and M, of any origin.

use super::bounds::SpectralBounds;
use super::csr::Csr;
use super::system::LimitSystem;
use crate::error::{Error, Result, short};

/// m_ij and m_ji may differ by this part of √(m_ii m_jj): what rounding leaves of a matrix that was computed.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl LimitSystem {
    /// The system `A V = P` with A = H·M of any origin: H = diag(h), M symmetric with a positive diagonal. Methods that
    /// promise convergence do so for a positive definite M, as for a scheme's; whether it is, is not decided here, and an
    /// indefinite one ends as an outcome of the run. Rows of A need not sum to 1, and entries may be negative.
    ///
    /// M is taken for symmetric if m_ij and m_ji differ by rounding: at most 64ε√(m_ii m_jj), which is
    /// what a factorization may change M by. Then both become their mean, stored on both sides, so that M is symmetric to
    /// the last bit. The bounds are
    /// [Gershgorin's](SpectralBounds::of_parts).
    ///
    /// O(entries), one transposed copy of M on the way.
    ///
    /// # Errors
    /// [`Error::Matrix`] with the row: no rows, sizes that differ, an entry of H that is not positive, one of M that is not
    /// finite, a diagonal entry that is missing or not positive, two entries that differ; products beyond the range of
    /// doubles.
    ///
    /// ```
    /// use limitlab::assemble::{Csr, LimitSystem};
    /// use limitlab::solvers::{Method, Outcome, Stop, run};
    /// use glam::DVec3;
    /// use limitlab::analysis::spectrum::spectrum;
    /// use nalgebra_sparse::{CooMatrix, CsrMatrix};
    ///
    /// // −x'' on 50 points.
    /// let mut m = CooMatrix::new(50, 50);
    /// for i in 0..50 {
    ///     m.push(i, i, 2.0);
    ///     if i > 0 {
    ///         m.push(i, i - 1, -1.0);
    ///         m.push(i - 1, i, -1.0);
    ///     }
    /// }
    /// let system = LimitSystem::from_parts(vec![1.0; 50], Csr::try_from(&CsrMatrix::from(&m))?)?;
    /// let stop = Stop { tolerance: 1e-10, max_iterations: 100 };
    /// let solution = run(&system, &[DVec3::X; 50], Method::Cg, &stop);
    /// // The parabola, symmetric about the middle, as half of the eigenvectors are.
    /// assert_eq!(solution.report.outcome, Outcome::Converged);
    /// assert!(solution.report.iterations <= 25);
    /// assert!((spectrum(&system)?.a.max - (2.0 + 2.0 * (std::f64::consts::PI / 51.0).cos())).abs() < 1e-12);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn from_parts(h: Vec<f64>, m: Csr) -> Result<Self> {
        let refuse = |what: String| Err(Error::Matrix(what));
        let n = m.len();
        if h.len() != n {
            return refuse(format!("H has {} entries and M {n} rows: both need as many", h.len()));
        }
        if n == 0 {
            return refuse("the matrix M has no rows: there is nothing to solve".into());
        }
        if let Some(i) = h.iter().position(|&h| !(h > 0.0 && h.is_finite())) {
            return refuse(format!("entry {i} of H is {}: it must be positive and finite", short(h[i])));
        }
        let diagonal = m.diagonal();
        for (i, &d) in diagonal.iter().enumerate() {
            if let Some((j, value)) = m.row(i).find(|e| !e.1.is_finite()) {
                return refuse(format!("entry ({i}, {j}) of M is {value}: it must be finite"));
            }
            if d <= 0.0 {
                return refuse(format!(
                    "entry ({i}, {i}) of M is {}: M is not positive definite, whose diagonal entries are all positive",
                    short(d)
                ));
            }
        }
        let m = symmetric(m, &diagonal)?;
        let a = m.scale_rows(&h);
        let diagonal = a.diagonal();
        let bounds = SpectralBounds::of_parts(&h, &m);
        let b = [bounds.lambda_min, bounds.lambda_max, bounds.jacobi_lambda_min, bounds.jacobi_lambda_max];
        let normal = |d: &f64| d.is_normal();
        if !(b.iter().all(|b| b.is_finite()) && diagonal.iter().all(normal) && a.values().iter().all(|a| a.is_finite()))
        {
            return refuse(
                "the entries of A = H·M, or the sums of its rows, go beyond the range of doubles: scale H".into(),
            );
        }
        Ok(LimitSystem { h, m, a, diagonal, bounds })
    }
}

/// M with equal entries at (i, j) and (j, i), to the last bit; `diagonal` is its own.
fn symmetric(m: Csr, diagonal: &[f64]) -> Result<Csr> {
    let transposed = m.transpose();
    if transposed == m {
        return Ok(m);
    }
    let n = m.len();
    let mut rows: Vec<Vec<(u32, f64)>> = Vec::with_capacity(n);
    for i in 0..n {
        let (mut ours, mut theirs) = (m.row(i).peekable(), transposed.row(i).peekable());
        let mut row = Vec::with_capacity(ours.len().max(theirs.len()));
        while let Some(j) = ours.peek().into_iter().chain(theirs.peek()).map(|e| e.0).min() {
            let (stored, mirrored) = (ours.next_if(|e| e.0 == j), theirs.next_if(|e| e.0 == j));
            let (a, b) = (stored.map_or(0.0, |e| e.1), mirrored.map_or(0.0, |e| e.1));
            let scale = diagonal[i].sqrt() * diagonal[j].sqrt();
            if (a - b).abs() > ROUNDING * scale {
                return Err(Error::Matrix(format!(
                    "M is not symmetric: entry ({i}, {j}) is {}, entry ({j}, {i}) is {}",
                    short(a),
                    short(b)
                )));
            }
            row.push((j as u32, 0.5 * a + 0.5 * b));
        }
        rows.push(row);
    }
    Csr::from_sorted_rows(rows.iter().map(|row| row.iter().copied()))
}
