//! The symmetric system `M V = R` of the smooth vertices in any order of its rows, whose entries are made as they are asked
//! for: to hand a large system on, without holding the matrix.

use glam::DVec3;

use super::csr::sum_columns;
use super::curves::Curves;
use super::operator::Operator;
use super::stages::free;
use super::stars::StarRows;
use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::mesh::order::Numbering;
use crate::parallel;
use crate::schemes::Scheme;

/// `M V = R` with `R = H⁻¹P`; on an open or creased mesh the [block](super::Stages) of the smooth vertices,
/// `M_SS V_S = H_S⁻¹(P_S − A_SK V_K − A_SC V_C)`.
///
/// Rows come from an [`Operator`]: 21 to 37 bytes a vertex among quads and 8 for the order, where the stored matrix takes 184.
/// M is symmetric to the last bits, not to the very last.
///
/// ```
/// use limitlab::assemble::StreamedSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
///
/// let surface = Surface::new(builtin::builtin("tetrahedron")?)?;
/// let system = StreamedSystem::new(&surface, Scheme::Loop, &[3, 2, 1, 0])?;
/// let mut entries = Vec::new();
/// system.row(1, &mut entries);
/// // Twice as much at the vertex itself as at each of its three neighbours.
/// assert_eq!(entries.iter().map(|e| e.0).collect::<Vec<_>>(), [0, 1, 2, 3]);
/// assert!((entries[1].1 - 2.0 * entries[0].1).abs() < 1e-15 * entries[1].1);
/// assert!(system.right_hand_side(surface.positions())[0].distance(surface.positions()[3] / system.weight(0)) < 1e-15);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct StreamedSystem {
    /// Of all vertices: those of the system in the order asked for, the others, whose rows are zero, after them.
    operator: Operator,
    numbering: Numbering,
    rows: usize,
    curves: Curves,
}

impl StreamedSystem {
    /// The system of `scheme` on a surface, its rows in an order of all vertices. O(corners).
    ///
    /// # Errors
    /// As [`Operator::new`], but for boundaries and creases; [`Error::Unsymmetric`] at darts and semi-sharp vertices; no smooth
    /// vertex.
    ///
    /// # Panics
    /// If `order` is no permutation of the vertices.
    pub fn new(surface: &Surface, scheme: Scheme, order: &[u32]) -> Result<Self> {
        if let Some(stars) = StarRows::new(surface, scheme, None)? {
            let (vertex, method) = (stars.vertices()[0] as usize, "a system of the smooth vertices");
            return Err(Error::Unsymmetric { vertex, method, others: vec!["lu"] });
        }
        let free = free(surface, None)?;
        let is_free = |v: u32| free.as_ref().is_none_or(|free| free[v as usize]);
        let mut places: Vec<u32> = order.iter().copied().filter(|&v| is_free(v)).collect();
        let rows = places.len();
        if rows == 0 {
            let what = "there is no smooth vertex: all lie on curves or at corners, and no system is left to solve";
            return Err(Error::Computation(what.into()));
        }
        places.extend(order.iter().copied().filter(|&v| !is_free(v)));
        let numbering = Numbering::new(places);
        let operator = Operator::with_fixed(surface, scheme, (Some(&numbering), free.as_deref()))?;
        Ok(StreamedSystem { operator, numbering, rows, curves: Curves::new(surface, scheme, None)? })
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.rows
    }

    /// Never: there is a smooth vertex.
    pub fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// The vertex of every row.
    pub fn vertices(&self) -> &[u32] {
        &self.numbering.order()[..self.rows]
    }

    /// h of a row.
    pub fn weight(&self, row: usize) -> f64 {
        self.operator.weight(row)
    }

    /// The entries of a row of M as (column, value), ascending, in place of what `entries` holds.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize, entries: &mut Vec<(u32, f64)>) {
        assert!(row < self.rows, "one of the rows");
        let h = self.weight(row);
        entries.clear();
        entries.push((row as u32, self.operator.stencil.diagonal(row) / h));
        self.operator.neighbours(row, |j, a| {
            if j < self.rows {
                entries.push((j as u32, a / h));
            }
        });
        sum_columns(entries);
    }

    /// R for the points P of all vertices. O(corners).
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn right_hand_side(&self, points: &[DVec3]) -> Vec<DVec3> {
        let mut known = self.known(points);
        parallel::change(&mut known[..self.rows], |_, p| *p = DVec3::ZERO);
        let order = self.numbering.order();
        let of = |k: usize| {
            let p = points[order[k] as usize];
            let others = if self.rows < known.len() { self.operator.row(k, &known) } else { DVec3::ZERO };
            (p - others) / self.weight(k)
        };
        parallel::collect(self.rows, of)
    }

    /// In the order of the operator: V on curves and at corners, P at the smooth vertices.
    fn known(&self, points: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(points.len(), self.operator.len(), "one point a vertex");
        let mut known = points.to_vec();
        self.curves.solve(&mut known);
        self.numbering.there(&known)
    }
}
