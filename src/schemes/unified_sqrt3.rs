//! The unified √3 scheme of Lin & Luo (§4–5): a parameter α at every vertex blends the approximating √3 scheme
//! (α = 0) with an interpolatory one (α = 1). New vertices take the mean α of their triangle.

use super::refinement::Refinement;
use super::sqrt3::{flip, relaxation, vertex_mask};
use super::star::{by_valence, centroid, neighbor_sum, refuse, require_room};
use super::thirds;
use crate::Result;
use crate::mesh::{Mesh, Surface};
use crate::pages::large;
use crate::parallel::{self, find_first};

/// The parameters that the paper allows.
pub const ALPHA_RANGE: std::ops::RangeInclusive<f64> = 0.0..=2.0;

/// One step: the refined mesh and the parameters of its vertices.
///
/// With Δ_i = a_n(mean of the neighbours − P_i), the displacement of [`sqrt3`](super::sqrt3), an old vertex
/// becomes P_i + (1−α_i)Δ_i (Eq. 11, expanded form) and the new one of a triangle
/// ⅓ Σ (P_i − α_i Δ_i) (Eq. 8 with Eq. 10; Eq. 4 and 9 as printed have the opposite sign of Δ). Vertices and
/// faces are numbered as by [`sqrt3::refine`](super::sqrt3::refine).
///
/// On sharp edges and vertices Δ_i is the displacement by √3 too, which is none in the first of two steps. The new points on an
/// edge from a to b blend those of √3 with cubic interpolation, (60, 30, −5, −4)/81, by their own parameter (2α_a + α_b)/3. The
/// paper has no rule there.
///
/// # Errors
/// As [`sqrt3::refine`](super::sqrt3::refine); [`Error::Mesh`](crate::Error::Mesh) with a parameter outside [`ALPHA_RANGE`].
///
/// # Panics
/// If `alpha` has not one entry for each vertex.
pub fn refine(surface: &Surface, alpha: &[f64]) -> Result<(Mesh, Vec<f64>)> {
    let (mesh, incidence) = (surface.mesh(), surface.incidence());
    assert!(alpha.len() == mesh.len(), "one α for each vertex");
    thirds::require(surface, "unified sqrt3")?;
    require_room(mesh, 3)?;
    if let Some(v) = find_first(alpha.len(), |v| !ALPHA_RANGE.contains(&alpha[v])) {
        return refuse(format!(
            "α = {} at vertex {v}: the unified sqrt3 scheme takes 0 (approximating) to 2, 1 interpolating",
            alpha[v]
        ));
    }
    let masks = by_valence(incidence, |n| {
        let a = relaxation(n);
        [-a, a / n as f64]
    });
    let old = &mesh.positions;
    let count = mesh.len() + mesh.faces.len() + surface.boundary_edges();
    let mut displacements = parallel::collect(mesh.len(), |v| {
        let (n, sum) = neighbor_sum(mesh, incidence, v);
        let [a, b] = masks[n];
        a * old[v] + b * sum
    });
    for (v, point) in thirds::moved(surface, vertex_mask) {
        displacements[v] = point - old[v];
    }
    let mut positions = large(Vec::with_capacity(count));
    parallel::extend(&mut positions, mesh.len(), |_| |v| old[v] + (1.0 - alpha[v]) * displacements[v]);
    // What each vertex gives to its triangles.
    let mut shares = displacements;
    parallel::change(&mut shares, |v, d| *d = old[v] - alpha[v] * *d);
    parallel::extend(&mut positions, mesh.faces.len(), |_| |f| centroid(&shares, mesh.faces.face(f)));
    let mut parameters = large(Vec::with_capacity(count));
    parallel::append(&mut parameters, alpha);
    let sum = |face: &[u32]| face.iter().map(|&v| alpha[v as usize]).sum::<f64>();
    parallel::extend(&mut parameters, mesh.faces.len(), |_| |f| sum(mesh.faces.face(f)) / 3.0);
    thirds::set_thirds(&mut positions, surface, |a, b| (2.0 * alpha[a] + alpha[b]) / 3.0);
    thirds::set_means(&mut parameters, surface);
    Ok((Mesh::new(positions, flip(surface)), parameters))
}

/// As [`refine`], with the topology of the refined mesh.
///
/// # Errors
/// As [`refine`].
///
/// # Panics
/// As [`refine`].
pub fn refined(surface: &Surface, alpha: &[f64]) -> Result<(Surface, Vec<f64>)> {
    let (mesh, parameters) = refine(surface, alpha)?;
    Ok((Refinement::Sqrt3.refined_surface(surface, mesh)?, parameters))
}
