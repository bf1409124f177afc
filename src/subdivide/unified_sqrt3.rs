//! The unified √3 scheme of Lin & Luo (§4–5): a parameter α at every vertex blends the approximating √3 scheme
//! (α = 0) with an interpolatory one (α = 1). New vertices take the mean α of their triangle.

use glam::DVec3;
use rayon::prelude::*;

use super::sqrt3::{flip, relaxation};
use super::star::{CHUNK, blend_with_neighbors, refuse, require_room, require_triangles};
use crate::Result;
use crate::mesh::{Mesh, Topology};

/// The parameters that the paper allows.
pub const ALPHA_RANGE: std::ops::RangeInclusive<f64> = 0.0..=2.0;

/// One step: the refined mesh and the parameters of its vertices.
///
/// With Δ_i = a_n(mean of the neighbours − P_i), the displacement of [`sqrt3`](super::sqrt3), an old vertex
/// becomes P_i + (1−α_i)Δ_i (Eq. 11, expanded form) and the new one of a triangle
/// ⅓ Σ (P_i − α_i Δ_i) (Eq. 8 with Eq. 10; Eq. 4 and 9 as printed have the opposite sign of Δ). Vertices and
/// faces are numbered as by [`sqrt3::refine`](super::sqrt3::refine).
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold, a face is
/// no triangle (the first is named), the result is too large for 32-bit indices, or a parameter lies outside [`ALPHA_RANGE`].
///
/// # Panics
/// If `topology` is not that of `mesh`, or `alpha` has not one entry for each vertex.
pub fn refine(mesh: &Mesh, topology: &Topology, alpha: &[f64]) -> Result<(Mesh, Vec<f64>)> {
    assert!(alpha.len() == mesh.len(), "one α for each vertex");
    require_triangles(mesh, topology, "unified sqrt3")?;
    require_room(mesh, 3)?;
    if let Some(v) = alpha.iter().position(|a| !ALPHA_RANGE.contains(a)) {
        return refuse(format!(
            "α = {} at vertex {v}: the unified sqrt3 scheme takes 0 (approximating) to 2, 1 interpolating",
            alpha[v]
        ));
    }
    let displacements = blend_with_neighbors(mesh, topology, |n| {
        let a = relaxation(n);
        [-a, a / n as f64]
    });
    let old = &mesh.positions;
    let mut positions = Vec::with_capacity(mesh.len() + mesh.faces.len());
    let mut parameters = Vec::with_capacity(positions.capacity());
    let vertices = (0..mesh.len()).into_par_iter().with_min_len(CHUNK);
    positions.par_extend(vertices.map(|v| old[v] + (1.0 - alpha[v]) * displacements[v]));
    parameters.extend_from_slice(alpha);
    let faces = || (0..mesh.faces.len()).into_par_iter().with_min_len(CHUNK);
    let corners = |f| mesh.faces.face(f).iter().map(|&v| v as usize);
    positions.par_extend(faces().map(|f| {
        let shares = corners(f).map(|v| old[v] - alpha[v] * displacements[v]);
        shares.sum::<DVec3>() / 3.0
    }));
    parameters.par_extend(faces().map(|f| corners(f).map(|v| alpha[v]).sum::<f64>() / 3.0));
    Ok((Mesh::new(positions, flip(mesh, topology)), parameters))
}
