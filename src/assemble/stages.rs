//! The system of a mesh in stages: points that are known, curves of sharp edges, then the block of the smooth vertices.
//!
//! On an open or creased mesh, and where some vertices only are interpolated, A is no product H·M of a diagonal and a
//! symmetric matrix. Ordered by K (known: corners, and control points that stay), C (inner vertices of curves) and S (smooth)
//! it is
//!
//! ```text
//!     ⎛ I                ⎞
//! A = ⎜ A_CK  A_CC       ⎟ ,   A_SS = H_S M_SS with M_SS symmetric.
//!     ⎝ A_SK  A_SC  A_SS ⎠
//! ```
//!
//! At darts and semi-sharp vertices A has [rows of another kind](StarRows), of the last stage too.
//!
//! Curves come [first](Curves), exactly and in O(|C|). All faces and edges at a smooth vertex are there, so that its row is
//! that of a closed mesh, and what is proven of M carries over to M_SS: the valence bounds of the smooth vertices, and, as
//! null vectors would have to vanish at K and C, no singularity in components that have a vertex there.

use std::sync::Arc;

use glam::DVec3;

use super::bounds::SpectralBounds;
use super::csr::{Csr, Pattern};
use super::curves::Curves;
use super::general::GeneralSystem;
use super::stars::StarRows;
use super::system::{LimitSystem, check, rows_of};
use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::schemes::Scheme;

/// The stages of `A V = P` on a surface, on all of its vertices or on some.
///
/// ```
/// use limitlab::assemble::Stages;
/// use limitlab::mesh::validate::Boundary;
/// use limitlab::mesh::{Faces, Mesh, Surface};
/// use limitlab::schemes::Scheme;
/// use glam::DVec3;
///
/// // Nine points on a grid: four corners, four on the boundary between them, one inside.
/// let points: Vec<DVec3> = (0..9).map(|i| DVec3::new((i % 3) as f64, (i / 3) as f64, (i % 2) as f64)).collect();
/// let quads = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];
/// let mesh = Mesh::new(points.clone(), Faces::from_lists(quads));
/// let surface = Surface::examined(mesh, None, Boundary::EdgeAndCorner).expect("valid");
/// let stages = Stages::new(&surface, Scheme::CatmullClark, None)?;
/// assert_eq!((stages.curves().len(), stages.block().len()), (4, 1));
/// let known = stages.known(&points);
/// // The corners rest, the middle of a side is its own curve: ⅔ v + ⅙(a + b) = p.
/// assert_eq!(known[0], points[0]);
/// assert!(known[1].distance(1.5 * points[1] - 0.25 * (points[0] + points[2])) < 1e-15);
/// // One row for the vertex inside.
/// let inside = stages.right_hand_side(&known)[0] / stages.block().a.get(0, 0);
/// let control = stages.joined(known, vec![inside]);
/// assert!(stages.matrix().row_times(4, &control).distance(points[4]) < 1e-14);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stages {
    curves: Curves,
    block: LimitSystem,
    stars: Option<StarRows>,
    part: Option<Part>,
}

/// What of the vertices is in the block, where not all are.
#[derive(Clone, Debug)]
struct Part {
    /// The smooth vertices, ascending: row k of the block is that of `vertices[k]`.
    vertices: Vec<u32>,
    /// The rows of A at these, and of I at all others.
    rows: Csr,
}

/// Not in the block.
const ABSENT: u32 = u32::MAX;

impl Stages {
    /// The stages under `scheme`, with V_j = P_j at vertices that are not marked in `interpolated`. O(corners).
    ///
    /// # Errors
    /// As [`LimitSystem::new`], but for boundaries and creases; darts and semi-sharp edges under schemes that have no rule for
    /// them; no vertex marked.
    ///
    /// # Panics
    /// If there is not one mark a vertex.
    pub fn new(surface: &Surface, scheme: Scheme, interpolated: Option<&[bool]>) -> Result<Self> {
        check(surface, scheme)?;
        let Some(free) = free(surface, interpolated)? else {
            let (curves, block) = (Curves::default(), LimitSystem::new(surface, scheme)?);
            return Ok(Stages { curves, block, stars: None, part: None });
        };
        let full = rows_of(surface, &scheme, Some(&free))?;
        let vertices: Vec<u32> = (0..surface.len() as u32).filter(|&v| free[v as usize]).collect();
        let place = places(&vertices, surface.len());
        let mut offsets = Vec::with_capacity(vertices.len() + 1);
        offsets.push(0u32);
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for &v in &vertices {
            for (j, m) in full.m.row(v as usize) {
                if place[j] != ABSENT {
                    columns.push(place[j]);
                    values.push(m);
                }
            }
            offsets.push(columns.len() as u32);
        }
        let h: Vec<f64> = vertices.iter().map(|&v| full.h[v as usize]).collect();
        let m = Csr::new(Arc::new(Pattern::new(offsets, columns)), values);
        let a = m.scale_rows(&h);
        let diagonal = a.diagonal();
        let bounds = match surface.is_closed() || surface.features().is_some() {
            true => {
                let valences: Vec<u32> =
                    vertices.iter().map(|&v| surface.incidence().face_count(v as usize) as u32).collect();
                SpectralBounds::closed(scheme, &valences, surface.faces().uniform_size() == Some(3), &diagonal)
            }
            false => SpectralBounds::gershgorin(&diagonal),
        };
        Ok(Stages {
            curves: Curves::new(surface, scheme, interpolated)?,
            stars: StarRows::new(surface, scheme, interpolated)?,
            block: LimitSystem { diagonal, bounds, h, m, a },
            part: Some(Part { vertices, rows: full.a }),
        })
    }

    /// A_SS with its factors, and what is proven of it.
    pub fn block(&self) -> &LimitSystem {
        &self.block
    }

    /// The curves, C.
    pub fn curves(&self) -> &Curves {
        &self.curves
    }

    /// The rows at darts and semi-sharp vertices, which belong to the block but are no rows of H·M.
    pub fn stars(&self) -> Option<&StarRows> {
        self.stars.as_ref()
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.part.as_ref().map_or(self.block.len(), |part| part.rows.len())
    }

    /// Never: a surface has vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vertex of each row of the block; `None` if the k-th is that of vertex k.
    pub fn vertices(&self) -> Option<&[u32]> {
        self.part.as_ref().map(|part| part.vertices.as_slice())
    }

    /// A vertex order of the whole mesh as an order of the rows of the block.
    ///
    /// # Panics
    /// If `order` names a vertex that the mesh lacks.
    pub fn order(&self, order: &[u32]) -> Vec<u32> {
        let Some(part) = &self.part else { return order.to_vec() };
        let place = places(&part.vertices, order.len());
        order.iter().map(|&v| place[v as usize]).filter(|&k| k != ABSENT).collect()
    }

    /// The values of the block's vertices, of one for each vertex.
    pub fn restricted(&self, values: &[DVec3]) -> Vec<DVec3> {
        self.vertices()
            .map_or_else(|| values.to_vec(), |vertices| vertices.iter().map(|&v| values[v as usize]).collect())
    }

    /// The control points that are known without the block: V at K and C, P at S, at darts and at semi-sharp vertices. O(|C|)
    /// beside the copy.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn known(&self, points: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(points.len(), self.len(), "one point a vertex");
        let mut known = points.to_vec();
        self.curves.solve(&mut known);
        known
    }

    /// The right-hand side of the block, `P_S − A_SK V_K − A_SC V_C`, from [`known`](Self::known).
    pub fn right_hand_side(&self, known: &[DVec3]) -> Vec<DVec3> {
        let Some(part) = &self.part else { return known.to_vec() };
        let place = places(&part.vertices, known.len());
        let others = |&v: &u32| {
            let row = part.rows.row(v as usize).filter(|&(j, _)| place[j] == ABSENT);
            row.fold(known[v as usize], |sum, (j, a)| sum - a * known[j])
        };
        part.vertices.iter().map(others).collect()
    }

    /// The whole of A: rows of curves, of I at known vertices, and those of the smooth ones. O(entries).
    pub fn matrix(&self) -> Csr {
        let Some(part) = &self.part else { return self.block.a.clone() };
        /// Where a row comes from.
        #[derive(Clone, Copy)]
        enum Of {
            Block,
            Curve(f64, [usize; 2]),
            Star(usize),
        }
        let mut rows = vec![Of::Block; self.len()];
        self.curves.rows(|v, w, ends| rows[v] = Of::Curve(w, ends));
        let stars = self.stars.iter().flat_map(|stars| stars.vertices().iter().enumerate());
        stars.for_each(|(k, &v)| rows[v as usize] = Of::Star(k));
        let mut offsets = Vec::with_capacity(self.len() + 1);
        offsets.push(0u32);
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for (v, of) in rows.into_iter().enumerate() {
            match of {
                Of::Block => part.rows.row(v).for_each(|(j, a)| {
                    columns.push(j as u32);
                    values.push(a);
                }),
                Of::Star(k) => self.stars.iter().flat_map(|stars| stars.row(k)).for_each(|(j, a)| {
                    columns.push(j as u32);
                    values.push(a);
                }),
                Of::Curve(w, [a, b]) => {
                    let mut row = vec![(v, 1.0 - 2.0 * w), (a, w)];
                    match a == b {
                        true => row[1].1 += w,
                        false => row.push((b, w)),
                    }
                    row.sort_unstable_by_key(|entry| entry.0);
                    columns.extend(row.iter().map(|entry| entry.0 as u32));
                    values.extend(row.iter().map(|entry| entry.1));
                }
            }
            offsets.push(columns.len() as u32);
        }
        Csr::new(Arc::new(Pattern::new(offsets, columns)), values)
    }

    /// `A V = P` of all vertices at once, for methods that need no symmetry.
    pub fn whole(&self) -> GeneralSystem {
        GeneralSystem::new(self.matrix())
    }

    /// All control points, or what else there is at the vertices, from the [known](Self::known) ones and those of the block.
    ///
    /// # Panics
    /// If there is not one a vertex of the block.
    pub fn joined<T>(&self, mut known: Vec<T>, block: Vec<T>) -> Vec<T> {
        assert_eq!(block.len(), self.block.len(), "one a vertex of the block");
        let Some(part) = &self.part else { return block };
        for (&v, x) in part.vertices.iter().zip(block) {
            known[v as usize] = x;
        }
        known
    }
}

/// The place of each vertex in a list; [`ABSENT`] if it is not there.
fn places(vertices: &[u32], n: usize) -> Vec<u32> {
    let mut place = vec![ABSENT; n];
    for (k, &v) in (0..).zip(vertices) {
        place[v as usize] = k;
    }
    place
}

/// Marks of the block's vertices: smooth, and interpolated; `None` if all are.
///
/// # Errors
/// No vertex is to be interpolated.
///
/// # Panics
/// If there is not one mark a vertex.
pub(crate) fn free(surface: &Surface, interpolated: Option<&[bool]>) -> Result<Option<Vec<bool>>> {
    if let Some(marks) = interpolated {
        assert_eq!(marks.len(), surface.len(), "one mark a vertex");
        if !marks.contains(&true) {
            return Err(nothing());
        }
    }
    Ok(match (surface.features(), interpolated) {
        (None, None) => None,
        (None, Some(marks)) => Some(marks.to_vec()),
        (Some(features), marks) => {
            Some((0..surface.len()).map(|v| features.is_smooth(v) && marks.is_none_or(|m| m[v])).collect())
        }
    })
}

pub(crate) fn nothing() -> Error {
    Error::Computation("no vertex is to be interpolated: name at least one".into())
}
