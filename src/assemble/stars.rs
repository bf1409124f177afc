//! Rows at darts and semi-sharp vertices, which are neither those of a curve nor rows of H·M.

use glam::DVec3;

use super::csr::sum_columns;
use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::mesh::features::Rule;
use crate::schemes::Scheme;
use crate::schemes::local_limit::{StarOf, StarRow};

/// The row of A at a dart or a semi-sharp vertex, or at a vertex on a curve where semi-sharp edges end.
///
/// # Errors
/// A scheme that has no rule for it.
pub(super) fn row_at(star: &StarOf, scheme: Scheme, rule: Rule) -> Result<StarRow> {
    match scheme.star_rule() {
        Some(star_rule) => Ok(star.star.row(star_rule)),
        None if rule == Rule::Dart => Err(Error::dart(star.vertex, scheme.name())),
        None => Err(Error::SemiSharp { vertex: star.vertex, scheme: scheme.name() }),
    }
}

/// The entries of a row in the order of columns.
fn sorted(star: &StarOf, row: &StarRow) -> Vec<(u32, f64)> {
    let mut all: Vec<(u32, f64)> = star.entries(row).collect();
    sum_columns(&mut all);
    all.retain(|entry| entry.1 != 0.0);
    all
}

/// The rows at darts and semi-sharp vertices, over all columns. With S, the smooth vertices, they are solved together: A is
/// not similar to a symmetric matrix where there are some.
#[derive(Clone, Debug)]
pub struct StarRows {
    /// Ascending; row k is that of `vertices[k]`.
    vertices: Vec<u32>,
    offsets: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl StarRows {
    /// Those of a surface that are interpolated; `None` if there are none. O(corners) of their stars, in each as the greatest
    /// semi-sharpness, or some tens at a dart.
    ///
    /// # Errors
    /// Any, under a scheme that has no rule for them.
    pub(crate) fn new(surface: &Surface, scheme: Scheme, interpolated: Option<&[bool]>) -> Result<Option<Self>> {
        let Some(features) = surface.features() else { return Ok(None) };
        let mut vertices = Vec::new();
        let (mut offsets, mut entries) = (vec![0], Vec::new());
        for (v, &rule) in features.rules().iter().enumerate() {
            if !matches!(rule, Rule::Dart | Rule::SemiSharp) || interpolated.is_some_and(|marks| !marks[v]) {
                continue;
            }
            let star = StarOf::new(surface, features, v);
            entries.extend(sorted(&star, &row_at(&star, scheme, rule)?));
            vertices.push(v as u32);
            offsets.push(entries.len());
        }
        Ok(if vertices.is_empty() { None } else { Some(StarRows { vertices, offsets, entries }) })
    }

    /// The vertices, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The entries of row k.
    pub fn row(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.entries[self.offsets[k]..self.offsets[k + 1]].iter().map(|&(j, a)| (j as usize, a))
    }

    /// (A x) at these vertices.
    pub fn product(&self, x: &[DVec3]) -> Vec<DVec3> {
        let row = |k| self.row(k).fold(DVec3::ZERO, |sum, (j, a)| sum + a * x[j]);
        (0..self.vertices.len()).map(row).collect()
    }
}
