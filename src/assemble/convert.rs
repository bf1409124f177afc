//! [`Csr`] from and to the sparse matrices of nalgebra-sparse, faer and, with the feature `sprs`, sprs.
//!
//! Entries are kept as they are stored, explicit zeros too, so that a matrix that goes there and back is the same to
//! the last bit. To another library nothing can fail. From one, a matrix is refused that is not square, whose indices
//! do not ascend strictly within each row or column (faer can hold such ones), or that has more than 2³² − 1 rows or
//! entries: [`Error::Matrix`] says which. Each takes O(N + entries) and makes one copy of pattern and values, two where
//! the other library stores by columns.
//!
//! ```
//! use faer::sparse::SparseColMat;
//! use limitlab::assemble::{Csr, LimitSystem};
//! use limitlab::schemes::Scheme;
//! use limitlab::mesh::{Surface, builtin};
//! use nalgebra_sparse::CsrMatrix;
//!
//! let surface = Surface::new(builtin::builtin("octahedron")?)?;
//! let system = LimitSystem::new(&surface, Scheme::Loop)?;
//! let ours = CsrMatrix::from(&system.a);
//! let ones = nalgebra::DVector::from_element(6, 1.0);
//! assert!((&ours * &ones - &ones).amax() < 1e-15); // rows of A sum to 1
//! let theirs = SparseColMat::<usize, f64>::from(&system.a);
//! assert_eq!(Csr::try_from(&theirs)?, Csr::try_from(&ours)?);
//!
//! let wide = CsrMatrix::<f64>::zeros(2, 3);
//! assert_eq!(Csr::try_from(&wide).unwrap_err().to_string(), "a matrix of 2 rows and 3 columns: it must be square");
//! # Ok::<(), limitlab::Error>(())
//! ```

use std::sync::Arc;

use faer::Index;
use faer::sparse::{SparseColMat, SparseRowMat, SymbolicSparseColMat, SymbolicSparseRowMat};
use nalgebra_sparse::CsrMatrix;

use super::csr::{Csr, Pattern, too_many};
use crate::error::{Error, Result};

/// Refuses shapes and sizes that [`Csr`] cannot hold.
pub(super) fn check_size(rows: usize, columns: usize, entries: usize) -> Result<()> {
    if rows != columns {
        return Err(Error::Matrix(format!("a matrix of {rows} rows and {columns} columns: it must be square")));
    }
    if rows.max(entries) > u32::MAX as usize {
        return Err(too_many(rows.max(entries)));
    }
    Ok(())
}

/// The matrix of these rows, or of these columns as rows; `line` is what one of them is called.
fn compressed<R: Iterator<Item = (usize, f64)>>(
    (rows, columns): (usize, usize),
    entries: usize,
    line: &str,
    lines: impl Iterator<Item = R>,
) -> Result<Csr> {
    check_size(rows, columns, entries)?;
    let mut offsets = Vec::with_capacity(rows + 1);
    let mut indices = Vec::with_capacity(entries);
    let mut values = Vec::with_capacity(entries);
    offsets.push(0);
    for (i, entries) in lines.enumerate() {
        let first = indices.len();
        for (j, value) in entries {
            if j >= rows || indices.len() > first && indices[indices.len() - 1] >= j as u32 {
                return Err(Error::Matrix(format!(
                    "{line} {i}: index {j} does not ascend within the matrix; sort each {line} and sum what is there \
                     twice"
                )));
            }
            indices.push(j as u32);
            values.push(value);
        }
        offsets.push(indices.len() as u32);
    }
    Ok(Csr::new(Arc::new(Pattern::new(offsets, indices)), values))
}

/// An array of small numbers in the index type of another library.
fn indices<I>(numbers: &[u32], convert: impl Fn(usize) -> I) -> Vec<I> {
    numbers.iter().map(|&k| convert(k as usize)).collect()
}

impl From<&Csr> for CsrMatrix<f64> {
    fn from(matrix: &Csr) -> Self {
        let (n, p) = (matrix.len(), matrix.pattern());
        let (offsets, columns) = (indices(p.offsets(), |k| k), indices(p.columns(), |k| k));
        CsrMatrix::try_from_csr_data(n, n, offsets, columns, matrix.values().to_vec())
            .expect("a pattern has the invariants of compressed rows")
    }
}

impl TryFrom<&CsrMatrix<f64>> for Csr {
    type Error = Error;

    fn try_from(matrix: &CsrMatrix<f64>) -> Result<Self> {
        let rows = matrix.row_iter();
        let rows = rows.map(|row| (0..row.nnz()).map(move |k| (row.col_indices()[k], row.values()[k])));
        compressed((matrix.nrows(), matrix.ncols()), matrix.nnz(), "row", rows)
    }
}

impl<I: Index> From<&Csr> for SparseRowMat<I, f64> {
    fn from(matrix: &Csr) -> Self {
        let (n, p) = (matrix.len(), matrix.pattern());
        let (offsets, columns) = (indices(p.offsets(), I::truncate), indices(p.columns(), I::truncate));
        SparseRowMat::new(SymbolicSparseRowMat::new_checked(n, n, offsets, None, columns), matrix.values().to_vec())
    }
}

impl<I: Index> TryFrom<&SparseRowMat<I, f64>> for Csr {
    type Error = Error;

    fn try_from(matrix: &SparseRowMat<I, f64>) -> Result<Self> {
        let rows = (0..matrix.nrows())
            .map(|i| matrix.col_idx_of_row_raw(i).iter().map(|j| j.zx()).zip(matrix.val_of_row(i).iter().copied()));
        compressed((matrix.nrows(), matrix.ncols()), matrix.compute_nnz(), "row", rows)
    }
}

impl<I: Index> From<&Csr> for SparseColMat<I, f64> {
    fn from(matrix: &Csr) -> Self {
        let by_columns = matrix.transpose();
        let (n, p) = (by_columns.len(), by_columns.pattern());
        let (offsets, rows) = (indices(p.offsets(), I::truncate), indices(p.columns(), I::truncate));
        SparseColMat::new(SymbolicSparseColMat::new_checked(n, n, offsets, None, rows), by_columns.values().to_vec())
    }
}

impl<I: Index> TryFrom<&SparseColMat<I, f64>> for Csr {
    type Error = Error;

    fn try_from(matrix: &SparseColMat<I, f64>) -> Result<Self> {
        let columns = (0..matrix.ncols())
            .map(|j| matrix.row_idx_of_col_raw(j).iter().map(|i| i.zx()).zip(matrix.val_of_col(j).iter().copied()));
        let by_columns = compressed((matrix.nrows(), matrix.ncols()), matrix.compute_nnz(), "column", columns)?;
        Ok(by_columns.transpose())
    }
}

/// sprs's matrices, by the feature of that name.
///
/// ```
/// use limitlab::assemble::Csr;
/// use sprs::{CsMat, TriMat};
///
/// let mut entries = TriMat::new((2, 2));
/// entries.add_triplet(0, 0, 2.0);
/// entries.add_triplet(1, 0, -1.0);
/// entries.add_triplet(1, 1, 2.0);
/// let columns: CsMat<f64> = entries.to_csc();
/// let matrix = Csr::try_from(&columns)?;
/// assert_eq!((matrix.get(1, 0), matrix.get(0, 1)), (-1.0, 0.0));
/// assert_eq!(CsMat::from(&matrix), columns.to_csr());
/// # Ok::<(), limitlab::Error>(())
/// ```
#[cfg(feature = "sprs")]
mod with_sprs {
    use sprs::CsMatI;

    use super::{Csr, Error, Result, compressed, indices};

    macro_rules! index {
        ($index:ty) => {
            /// By rows.
            impl From<&Csr> for CsMatI<f64, $index> {
                fn from(matrix: &Csr) -> Self {
                    let (n, p) = (matrix.len(), matrix.pattern());
                    let convert = |k| k as $index;
                    let (offsets, columns) = (indices(p.offsets(), convert), indices(p.columns(), convert));
                    CsMatI::new((n, n), offsets, columns, matrix.values().to_vec())
                }
            }

            /// Of rows or of columns.
            impl TryFrom<&CsMatI<f64, $index>> for Csr {
                type Error = Error;

                fn try_from(matrix: &CsMatI<f64, $index>) -> Result<Self> {
                    let line = if matrix.is_csr() { "row" } else { "column" };
                    let lines = (0..matrix.outer_dims()).map(|k| {
                        let range = matrix.indptr().outer_inds_sz(k);
                        let stored = matrix.indices()[range.clone()].iter().zip(&matrix.data()[range]);
                        stored.map(|(&j, &value)| (j as usize, value))
                    });
                    let stored = compressed((matrix.rows(), matrix.cols()), matrix.nnz(), line, lines)?;
                    Ok(if matrix.is_csr() { stored } else { stored.transpose() })
                }
            }
        };
    }

    index!(usize);
    index!(u32);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix that large is not made here.
    #[test]
    fn what_32_bit_indices_cannot_name_is_refused() {
        let most = u32::MAX as usize;
        check_size(most, most, most).unwrap();
        for (n, entries) in [(most + 1, 0), (2, most + 1)] {
            let error = check_size(n, n, entries).unwrap_err().to_string();
            assert!(error.ends_with("32-bit indices hold 4294967295, no more"), "{error}");
        }
    }
}
