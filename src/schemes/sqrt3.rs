//! √3 subdivision (Kobbelt 2000) of triangle meshes: a new vertex in every triangle, old edges flipped,
//! old vertices relaxed. Two steps make a 1-to-9 split, of sharp edges too.

use std::f64::consts::TAU;

use glam::DVec3;

use super::refined::{self, set_rows};
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::scheme::{CUBIC, Definition, PaperNames, SingularSet, from_limit_weight};
use super::sharp::{self, across_boundary_of_triangles};
use super::star::{Tangents, across, blend_with_neighbors, centroid, push_blends, require_room, ring_tangents};
use super::thirds;
use crate::Result;
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// a_n = (4 − 2cos(2π/n))/9: how far an old vertex moves towards the mean of its neighbours (Lin-Luo Eq. 2).
pub fn relaxation(n: usize) -> f64 {
    (4.0 - 2.0 * (TAU / n as f64).cos()) / 9.0
}

/// The mask of the relaxed vertex at valence `n`: the weight of the vertex, 1 − a_n, and of each neighbour,
/// a_n/n.
pub fn vertex_mask(n: usize) -> [f64; 2] {
    let a = relaxation(n);
    [1.0 - a, a / n as f64]
}

/// The limit mask at valence `n`: the weight of the vertex, β_n = 1/(1 + 3a_n), and of each neighbour,
/// (1−β_n)/n.
pub fn limit_mask(n: usize) -> [f64; 2] {
    let beta = 1.0 / (1.0 + 3.0 * relaxation(n));
    [beta, (1.0 - beta) / n as f64]
}

/// The limit weight of a vertex of valence `n`: 1/(1 + 3a_n), a_n = (4 − 2cos(2π/n))/9.
pub fn sqrt3_beta(n: usize) -> f64 {
    let a = (4.0 - 2.0 * (TAU / n as f64).cos()) / 9.0;
    1.0 / (1.0 + 3.0 * a)
}

/// h(n) = (1 − β_n)/n, d(n) = nβ_n/(1 − β_n), w = 1, with the β_n of [`sqrt3_beta`].
///
/// λ_min(A) ≥ (3β_n − 1)/2, which is positive: β_n ≥ 3/8. λ_min(A) is 0.186 to 0.222 on irregular meshes of 20 000
/// vertices and on tori.
pub(super) const DEFINITION: Definition = Definition {
    name: "sqrt3",
    paper_names: PaperNames::OURS,
    h: |n| from_limit_weight(sqrt3_beta(n), n)[0],
    vertex_weight: |n| from_limit_weight(sqrt3_beta(n), n)[1],
    edge_weight: 1.0,
    circulant: None,
    needs_triangles: true,
    lambda_min_at: |n, _| 0.5 * (3.0 * sqrt3_beta(n) - 1.0),
    usual_lambda_min: 0.18,
    singular: SingularSet::Never,
    regular_symbol: (0.25, 0.5),
    refinement: Refinement::Sqrt3,
    first_rule: None,
    curve_weight: CUBIC,
    star_rule: None,
};

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: "sqrt3",
    class: Class::Primal,
    needs_triangles: true,
    check: |surface| thirds::require(surface, "sqrt3"),
    refine,
    refined_topology,
    refined_features: |surface, refined, topology| {
        refined::features_of_pieces(surface, refined, topology, thirds::pieces)
    },
    size: Size::in_three,
    limit_positions,
    limit_normals,
};

/// One step.
///
/// Vertices of the result: old vertices, then one for each face. Faces of the result: one for each old
/// corner, in corner order, as (vertex, face across the edge that leaves it, its own face).
///
/// Sharp edges rest in the first of two steps, and sharp vertices with them. In the second they are split in three, at
/// (16, 10, 1)/27 and (1, 10, 16)/27 of the vertices along the curve, and crease vertices become (4, 19, 4)/27; at the ends of
/// curves the polygon goes on by the mirrored point; corners rest. The new vertices there take the numbers of
/// the faces, which have none inside, then further ones for boundary edges.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open) if the mesh has a boundary that is treated as interior,
/// [`Error::NotTriangles`](crate::Error::NotTriangles) with the first face that is none,
/// [`Error::Dart`](crate::Error::Dart), [`Error::SemiSharp`](crate::Error::SemiSharp),
/// [`Error::TooLarge`](crate::Error::TooLarge) if 32-bit indices do not reach the result; [`Error::Mesh`](crate::Error::Mesh)
/// with a vertex of two triangles that have all corners in common.
pub fn refine(surface: &Surface) -> Result<Mesh> {
    let mesh = surface.mesh();
    thirds::require(surface, "sqrt3")?;
    require_room(mesh, 3)?;
    let mut positions = refined::points_in_faces(surface, &smooth_points);
    for (v, point) in thirds::moved(surface, vertex_mask) {
        positions[v] = point;
    }
    thirds::set_thirds(&mut positions, surface, |_, _| 0.0);
    Ok(Mesh::new(positions, flip(surface)))
}

/// The new points of vertices and faces where nothing is sharp.
fn smooth_points(surface: &Surface) -> Vec<DVec3> {
    let mesh = surface.mesh();
    let mut positions = large(Vec::with_capacity(mesh.len() + mesh.faces.len() + surface.boundary_edges()));
    push_blends(&mut positions, surface, vertex_mask);
    parallel::extend(&mut positions, mesh.faces.len(), |_| |f| centroid(&mesh.positions, mesh.faces.face(f)));
    positions
}

/// The topology of `refined`, which is what [`refine`] made of the surface.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    refined::of_flips(surface, refined)
}

/// The faces after the split in three and the flip of every old edge that is not sharp: one for each half-edge.
pub(super) fn flip(surface: &Surface) -> Faces {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let vertices = mesh.len() as u32;
    let old = mesh.faces.corners();
    let mut corners = large(vec![0; 3 * old.len()]);
    set_rows(&mut corners, |c| {
        let across = across(topology, c);
        [old[c as usize], vertices + across / 3, vertices + c / 3]
    });
    thirds::keep_sharp_edges(&mut corners, surface);
    Faces::of_size(3, corners)
}

/// The limit points of all vertices: [`limit_mask`]; on curves (a + 4v + b)/6 with the neighbours a and b along the curve;
/// corners rest.
///
/// Between two steps that holds at all vertices but those across from sharp edges, where a point z has no row of its
/// star alone: with its ring completed to valence n, each sharp edge xy adds h(n) (w − x − y + u)/27 to the limit
/// mask, w and u being the next vertices on the curve. It costs a step there.
///
/// # Errors
/// As [`refine`].
pub fn limit_positions(surface: &Surface) -> Result<Vec<DVec3>> {
    thirds::require(surface, "sqrt3")?;
    if let Some(found) = thirds::of_next(surface, |s| Refinement::Sqrt3.refined(s), limit_positions)? {
        return Ok(found);
    }
    let mut limits = blend_with_neighbors(surface, limit_mask);
    sharp::set_limits(&mut limits, surface, CUBIC, None);
    Ok(limits)
}

/// The tangents of the limit surface at all vertices: cos(2πj/n) and sin(2πj/n) on the neighbours in
/// counter-clockwise order. A step maps the ring's first harmonic to itself, turned by π/n and scaled by
/// ⅔cos(π/n), so these span the left eigenspace of the subdominant pair.
///
/// At a boundary vertex with up to five triangles and no sharp edge between them one goes along the boundary and one across
/// it; at a corner with one triangle they go along its sides. All others that are not smooth have none.
///
/// # Errors
/// As [`refine`].
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    thirds::require(surface, "sqrt3")?;
    if let Some(found) = thirds::of_next(surface, |s| Refinement::Sqrt3.refined(s), limit_tangents)? {
        return Ok(found);
    }
    let mut tangents = ring_tangents(surface);
    // Two steps have (2 + 2cos θ)/9; the column of e_0 leaves its weight there, (3 sin θ − 4Σ sin jθ)/27 over that less 1/9.
    let end = |theta: f64, sum: f64| (3.0 * theta.sin() - 4.0 * sum) / (3.0 + 6.0 * theta.cos());
    sharp::set_tangents(&mut tangents, surface, |m| across_boundary_of_triangles(m, end), |_, _| DVec3::ZERO);
    Ok(tangents)
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(surface)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
