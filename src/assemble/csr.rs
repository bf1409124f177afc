//! Compressed sparse rows with 32-bit indices.

use std::sync::Arc;

use super::weights::{Point, Weight};
use crate::error::{Error, Result};
use crate::mesh::incidence::split_rows;
use crate::parallel;

/// Rows of one task.
const CHUNK: usize = 4096;

/// Which entries of a square matrix are stored: row `i` holds `columns[offsets[i]..offsets[i + 1]]`, ascending
/// and without repetition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    offsets: Vec<u32>,
    columns: Vec<u32>,
}

impl Pattern {
    /// # Panics
    /// If the arrays do not describe a square matrix with ascending columns in every row.
    pub fn new(offsets: Vec<u32>, columns: Vec<u32>) -> Self {
        assert!(offsets.first() == Some(&0) && offsets.is_sorted(), "row offsets ascend from 0");
        assert!(offsets.last().map(|&l| l as usize) == Some(columns.len()), "row offsets end at the number of entries");
        let n = offsets.len() - 1;
        let pattern = Pattern { offsets, columns };
        parallel::each(n, |i| {
            let row = pattern.row(i);
            assert!(
                row.is_sorted_by(|a, b| a < b) && row.last().is_none_or(|&c| (c as usize) < n),
                "the columns of row {i} ascend within the matrix"
            );
        });
        pattern
    }

    /// The number of rows N.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the entries of row `i` lie in [`columns`](Self::columns) and in the values of a matrix.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The columns of row `i`, ascending.
    pub fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.range(i)]
    }

    /// Where each row starts in [`columns`](Self::columns), and the end: N + 1 numbers.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The columns of all entries, row after row.
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// The largest |i − j| of a stored entry.
    pub fn bandwidth(&self) -> usize {
        (0..self.len()).flat_map(|i| self.row(i).iter().map(move |&j| i.abs_diff(j as usize))).max().unwrap_or(0)
    }
}

/// A square sparse matrix of doubles. Matrices of one structure (A and M of a system) share their [`Pattern`].
#[derive(Clone, Debug, PartialEq)]
pub struct Csr {
    pattern: Arc<Pattern>,
    values: Vec<f64>,
}

impl Csr {
    /// # Panics
    /// If there is not one value for every stored entry.
    pub fn new(pattern: Arc<Pattern>, values: Vec<f64>) -> Self {
        assert_eq!(pattern.columns.len(), values.len(), "one value for every entry");
        Csr { pattern, values }
    }

    /// The matrix of these rows, each of ascending (column, value).
    ///
    /// # Errors
    /// More than 2³² − 1 entries.
    ///
    /// # Panics
    /// If the columns of a row do not ascend within the matrix.
    pub(super) fn from_sorted_rows<R: Iterator<Item = (u32, f64)>>(rows: impl Iterator<Item = R>) -> Result<Csr> {
        let (mut offsets, mut columns, mut values) = (vec![0u32], Vec::new(), Vec::new());
        for row in rows {
            for (j, value) in row {
                columns.push(j);
                values.push(value);
            }
            let end = u32::try_from(columns.len()).map_err(|_| too_many(columns.len()))?;
            offsets.push(end);
        }
        Ok(Csr::new(Arc::new(Pattern::new(offsets, columns)), values))
    }

    /// The number of rows N.
    pub fn len(&self) -> usize {
        self.pattern.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.pattern.is_empty()
    }

    /// Which entries are stored.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// The values of all stored entries, row after row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The values of row `i`, in ascending order of columns.
    pub fn row_values(&self, i: usize) -> &[f64] {
        &self.values[self.pattern.range(i)]
    }

    /// The stored entries of row `i` as (column, value).
    pub fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (usize, f64)> + '_ {
        let range = self.pattern.range(i);
        self.pattern.columns[range.clone()].iter().zip(&self.values[range]).map(|(&j, &a)| (j as usize, a))
    }

    /// The entry (i, j); 0 where none is stored. O(log of the row's length).
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let range = self.pattern.range(i);
        match self.pattern.row(i).binary_search(&(j as u32)) {
            Ok(k) => self.values[range.start + k],
            Err(_) => 0.0,
        }
    }

    /// The main diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        parallel::collect(self.len(), |i| self.get(i, i))
    }

    /// The transposed matrix. O(N + entries).
    pub fn transpose(&self) -> Csr {
        let n = self.len();
        // `next[j + 1]` is where the next entry of row j goes, and ends as where row j + 1 begins.
        let mut next = vec![0u32; n + 2];
        for &j in self.pattern.columns() {
            next[j as usize + 2] += 1;
        }
        for j in 2..n + 2 {
            next[j] += next[j - 1];
        }
        let mut columns = vec![0; self.values.len()];
        let mut values = vec![0.0; self.values.len()];
        for i in 0..n {
            for (j, a) in self.row(i) {
                let place = next[j + 1] as usize;
                columns[place] = i as u32;
                values[place] = a;
                next[j + 1] += 1;
            }
        }
        next.pop();
        Csr::new(Arc::new(Pattern::new(next, columns)), values)
    }

    /// `diag(scale) · self`, on the same pattern.
    ///
    /// # Panics
    /// If `scale` does not hold one number a row.
    pub fn scale_rows(&self, scale: &[f64]) -> Csr {
        assert_eq!(scale.len(), self.len(), "one factor a row");
        let mut values = vec![0.0; self.values.len()];
        parallel::parts(split_rows(&self.pattern.offsets, CHUNK, &mut values), |rows, mut part| {
            for (i, &s) in rows.clone().zip(&scale[rows]) {
                let row = self.row_values(i);
                let (out, after) = part.split_at_mut(row.len());
                for (out, &v) in out.iter_mut().zip(row) {
                    *out = s * v;
                }
                part = after;
            }
        });
        Csr { pattern: Arc::clone(&self.pattern), values }
    }

    /// `diag(scale) · self · diag(scale)`, on the same pattern; symmetric to the last bit if `self` is.
    ///
    /// # Panics
    /// If `scale` does not hold one number a row.
    pub fn scale_symmetrically(&self, scale: &[f64]) -> Csr {
        assert_eq!(scale.len(), self.len(), "one factor a row");
        let mut values = Vec::with_capacity(self.values.len());
        for (i, &s) in scale.iter().enumerate() {
            values.extend(self.row(i).map(|(j, v)| v * (s * scale[j])));
        }
        Csr { pattern: Arc::clone(&self.pattern), values }
    }

    /// Row `i` times `x`, points or numbers: Σ_j a_ij x_j.
    #[inline]
    pub fn row_times<P: Point>(&self, i: usize, x: &[P]) -> P {
        let range = self.pattern.range(i);
        let mut sum = P::ZERO;
        for (&j, &a) in self.pattern.columns[range.clone()].iter().zip(&self.values[range]) {
            sum += x[j as usize].times(P::Weight::of(a));
        }
        sum
    }
}

/// The error of so many rows or entries.
pub(super) fn too_many(count: usize) -> Error {
    Error::Matrix(format!("a matrix with {count} rows or entries: 32-bit indices hold 4294967295, no more"))
}

/// Puts the entries of a row in the order of columns, and adds up those of one column.
pub(crate) fn sum_columns(row: &mut Vec<(u32, f64)>) {
    row.sort_by_key(|entry| entry.0);
    row.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        if is_same {
            kept.1 += next.1;
        }
        is_same
    });
}
