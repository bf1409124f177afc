//! The matrix-free operator of an open or creased mesh, with the curves that are solved before it.

use super::curves::Curves;
use super::operator::Operator;
use super::stars::StarRows;
use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::parallel;
use crate::schemes::Scheme;

/// As [`Stages`](super::Stages), without stored entries but for those of A_SC: rows of smooth vertices S, which are those of H·M
/// at x_C = 0, and of the vertices C on curves and at corners, which see C alone.
#[derive(Clone, Debug)]
pub struct StagedOperator {
    operator: Operator,
    curves: Curves,
    /// C, ascending, and where the entries of each column begin.
    fixed: Vec<u32>,
    offsets: Vec<u32>,
    /// Row and entry.
    entries: Vec<(u32, f64)>,
}

impl StagedOperator {
    /// Of all vertices, in the order of the surface. O(corners).
    ///
    /// # Errors
    /// As [`Operator::new`], but for boundaries and creases; [`Error::Unsymmetric`] at darts and semi-sharp vertices.
    pub fn new(surface: &Surface, scheme: Scheme) -> Result<Self> {
        if let Some(stars) = StarRows::new(surface, scheme, None)? {
            let (vertex, method) = (stars.vertices()[0] as usize, "an operator in stages");
            return Err(Error::Unsymmetric { vertex, method, others: vec!["lu"] });
        }
        let features = surface.features();
        let is_free = |v: usize| features.is_none_or(|f| f.is_smooth(v));
        let free: Vec<bool> = parallel::collect(surface.len(), is_free);
        let operator = Operator::with_fixed(surface, scheme, (None, Some(&free)))?;
        let fixed: Vec<u32> = (0..surface.len()).filter(|&v| !free[v]).map(|v| v as u32).collect();
        let mut triplets = Vec::new();
        let (faces, incidence) = (surface.faces(), surface.incidence());
        let mut rows: Vec<u32> = Vec::new();
        for &c in &fixed {
            let at = incidence.corners_at(c as usize).iter();
            rows.extend(at.flat_map(|&corner| faces.face(incidence.face_of(corner))).filter(|&&v| free[v as usize]));
        }
        rows.sort_unstable();
        rows.dedup();
        for &i in &rows {
            operator.neighbours(i as usize, |j, a| {
                if !free[j] {
                    triplets.push((j as u32, i, a));
                }
            });
        }
        triplets.sort_unstable_by_key(|&(j, i, _)| (j, i));
        let offsets = fixed.iter().map(|&c| triplets.partition_point(|t| t.0 < c) as u32);
        let offsets = offsets.chain([triplets.len() as u32]).collect();
        let entries = triplets.into_iter().map(|(_, i, a)| (i, a)).collect();
        Ok(StagedOperator { operator, curves: Curves::new(surface, scheme, None)?, fixed, offsets, entries })
    }

    /// The rows of S over all columns; those of C are zero.
    pub fn operator(&self) -> &Operator {
        &self.operator
    }

    /// What is solved first.
    pub fn curves(&self) -> &Curves {
        &self.curves
    }

    /// The vertices C, ascending.
    pub fn fixed(&self) -> &[u32] {
        &self.fixed
    }

    /// The rows of S with their entries in the column of the k-th vertex of [C](Self::fixed). A row that is joined to the vertex
    /// more than once comes as often.
    ///
    /// # Panics
    /// If there are not more than `k`.
    pub fn column(&self, k: usize) -> &[(u32, f64)] {
        &self.entries[self.offsets[k] as usize..self.offsets[k + 1] as usize]
    }
}
