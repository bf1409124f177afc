//! Nasri's interpolation with Doo-Sabin surfaces (1987): the control mesh whose type-V faces, after one ordinary
//! step, have the given points as centroids. What Zheng & Cai compare with. The surface is plain Doo-Sabin subdivision
//! of the control mesh; [`FirstRefinement`](super::zheng_cai::FirstRefinement) with the ordinary rule adds normals and
//! shape handles where they are asked for.

use super::staged;
use crate::Result;
use crate::assemble::Stages;
use crate::mesh::Surface;
use crate::schemes::Scheme;
use crate::solvers::{Method, Solution, Stop};

/// Solves Nasri's system for the control points: all vertices, or those marked in `interpolated` with V_j = I_j at
/// the others (a principal submatrix, whose eigenvalues stay in [¼, 1], so it is soluble on every mesh).
///
/// # Errors
/// Those of [`Stages::new`]: darts, semi-sharp edges and vertices, a boundary that is treated as interior; no vertex marked.
///
/// # Panics
/// If `interpolated` has not one entry a vertex.
pub fn control_points(
    surface: &Surface,
    interpolated: Option<&[bool]>,
    method: Method,
    stop: &Stop,
) -> Result<Solution> {
    let stages = Stages::new(surface, Scheme::Nasri, interpolated)?;
    Ok(staged::run(&stages, surface.positions(), method, stop))
}
