//! Loop subdivision (Loop 1987) of closed triangle meshes, with Loop's own weights at extraordinary vertices.

use std::f64::consts::TAU;

use glam::DVec3;

use super::local_limit::StarRule;
use super::refined::{self, set_rows};
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::scheme::{CUBIC, Definition, PaperNames, SingularSet, from_limit_weight};
use super::star::{
    Tangents, blend_with_neighbors, prev_in_triangle, push_blends, require_room, require_triangles, ring_tangents, twin,
};
use crate::Result;
use crate::mesh::edge_numbers::EdgeNumbers;
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::large;

/// The mask of the vertex point at valence `n`: the weight of the vertex, 3/8 + (3/8 + ¼cos(2π/n))², and of
/// each neighbour, the rest over n.
pub fn vertex_mask(n: usize) -> [f64; 2] {
    let n = n as f64;
    let root = 0.375 + 0.25 * (TAU / n).cos();
    let neighbors = 0.625 - root * root;
    [1.0 - neighbors, neighbors / n]
}

/// The limit mask at valence `n`: the weight of the vertex, β_n = 3/(11 − 8(3/8 + (3/8 + ¼cos(2π/n))²)) (PIA
/// §2), and of each neighbour, (1−β_n)/n.
pub fn limit_mask(n: usize) -> [f64; 2] {
    let [vertex, _] = vertex_mask(n);
    let beta = 3.0 / (11.0 - 8.0 * vertex);
    [beta, (1.0 - beta) / n as f64]
}

/// The limit weight of a vertex of valence `n` (PIA Eq. 1): β_n = 3/(11 − 8(3/8 + (3/8 + ¼cos(2π/n))²)).
pub fn loop_beta(n: usize) -> f64 {
    let c = 0.375 + 0.25 * (TAU / n as f64).cos();
    3.0 / (11.0 - 8.0 * (0.375 + c * c))
}

/// h(n) = (1 − β_n)/n, d(n) = nβ_n/(1 − β_n), w = 1.
///
/// λ_min(A) ≥ (3β_n − 1)/2, which is positive: β_n increases from 2/5. λ_min(A) is 0.205 to 0.25 on irregular meshes of
/// 20 000 vertices and on tori.
pub(super) const DEFINITION: Definition = Definition {
    name: "loop",
    paper_names: PaperNames { system: "B", diagonal: "D", symmetric: "S" },
    h: |n| from_limit_weight(loop_beta(n), n)[0],
    vertex_weight: |n| from_limit_weight(loop_beta(n), n)[1],
    edge_weight: 1.0,
    circulant: None,
    needs_triangles: true,
    lambda_min_at: |n, _| 0.5 * (3.0 * loop_beta(n) - 1.0),
    usual_lambda_min: 0.2,
    singular: SingularSet::Never,
    regular_symbol: (0.25, 0.5),
    refinement: Refinement::Loop,
    first_rule: None,
    curve_weight: CUBIC,
    star_rule: Some(StarRule::Loop),
};

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: "loop",
    class: Class::Primal,
    needs_triangles: true,
    refine,
    refined_topology,
    size: Size::in_four,
    limit_positions,
    limit_normals,
};

/// One step.
///
/// Vertices of the result: old vertices, then one for each edge (in order of its first half-edge). Faces of
/// the result: four for each old face, one at each of its corners as (vertex, edge leaving it, edge entering
/// it), then the middle one.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh has a boundary, a face is
/// no triangle (the first is named), or the result is too large for 32-bit indices.
pub fn refine(surface: &Surface) -> Result<Mesh> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_triangles(surface, "loop")?;
    require_room(mesh, 4)?;
    let (old, corners) = (&mesh.positions, mesh.faces.corners());
    let edges = topology.edge_numbers();
    let mut positions = large(Vec::with_capacity(mesh.len() + topology.edges()));
    push_blends(&mut positions, surface, vertex_mask);
    edges.extend(&mut positions, |c| {
        // 3/8 of the vertex that a side leaves, 1/8 of the vertex opposite to it.
        let [one, other] = [c, twin(topology, c)].map(|c| {
            let opposite = old[corners[prev_in_triangle(c)] as usize];
            0.375 * old[corners[c as usize] as usize] + 0.125 * opposite
        });
        one + other
    });
    Ok(Mesh::new(positions, split_in_four(mesh, &edges)))
}

/// The topology of `refined`, which is what [`refine`] or [`butterfly`](super::butterfly) made of the surface.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    refined::of_fours(surface.topology(), refined)
}

/// The faces of a 1-to-4 split of triangles.
pub(super) fn split_in_four(mesh: &Mesh, edges: &EdgeNumbers) -> Faces {
    let vertices = mesh.len() as u32;
    let old = mesh.faces.corners();
    let mut corners = large(vec![0; 4 * old.len()]);
    set_rows(&mut corners, |f| {
        let own = [0, 1, 2].map(|i| 3 * f + i);
        let [u, v, w] = own.map(|c| old[c as usize]);
        let [a, b, c] = own.map(|c| vertices + edges.of(c));
        [u, a, c, v, b, a, w, c, b, a, b, c]
    });
    Faces::of_size(3, corners)
}

/// The limit points of all vertices.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh has a boundary or a face
/// is no triangle.
pub fn limit_positions(surface: &Surface) -> Result<Vec<DVec3>> {
    require_triangles(surface, "loop")?;
    Ok(blend_with_neighbors(surface, limit_mask))
}

/// The tangents of the limit surface at all vertices: cos(2πj/n) and sin(2πj/n) on the neighbours in
/// counter-clockwise order.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh has a boundary or a face
/// is no triangle.
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    require_triangles(surface, "loop")?;
    Ok(ring_tangents(surface))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(surface)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
