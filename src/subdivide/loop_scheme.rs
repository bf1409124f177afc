//! Loop subdivision (Loop 1987) of closed triangle meshes, with Loop's own weights at extraordinary vertices.

use std::f64::consts::TAU;

use glam::DVec3;

use super::star::{
    Tangents, blend_with_neighbors, edge_numbers, require_room, require_triangles, ring_tangents,
};
use crate::Result;
use crate::mesh::{Faces, Mesh, Topology};

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

/// One step.
///
/// Vertices of the result: old vertices, then one for each edge (in order of its first half-edge). Faces of
/// the result: four for each old face, one at each of its corners as (vertex, edge leaving it, edge entering
/// it), then the middle one.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold, a face is
/// no triangle (the first is named), or the result is too large for 32-bit indices.
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn refine(mesh: &Mesh, topology: &Topology) -> Result<Mesh> {
    require_triangles(mesh, topology, "loop")?;
    require_room(mesh, 4)?;
    let vertices = mesh.len();
    let edge = edge_numbers(mesh, topology);
    let mut positions = blend_with_neighbors(mesh, topology, vertex_mask);
    positions.resize(vertices + topology.edges(), DVec3::ZERO);
    let edge_points = &mut positions[vertices..];
    let corners = mesh.faces.corners();
    for (face, edges) in corners.chunks_exact(3).zip(edge.chunks_exact(3)) {
        for (i, &e) in edges.iter().enumerate() {
            // 3/8 of the vertex that the half-edge leaves, 1/8 of the vertex opposite to it; the twin brings
            // the other half of the mask (3/8, 3/8, 1/8, 1/8).
            let vertex = mesh.positions[face[i] as usize];
            let opposite = mesh.positions[face[(i + 2) % 3] as usize];
            edge_points[e as usize] += 0.375 * vertex + 0.125 * opposite;
        }
    }
    Ok(Mesh::new(positions, split_in_four(mesh, &edge)))
}

/// The faces of a 1-to-4 split of triangles.
pub(super) fn split_in_four(mesh: &Mesh, edge: &[u32]) -> Faces {
    let vertices = mesh.len() as u32;
    let mut corners = Vec::with_capacity(4 * mesh.faces.corners().len());
    for (face, edges) in mesh
        .faces
        .corners()
        .chunks_exact(3)
        .zip(edge.chunks_exact(3))
    {
        let [a, b, c] = [edges[0], edges[1], edges[2]].map(|e| vertices + e);
        corners.extend([face[0], a, c, face[1], b, a, face[2], c, b, a, b, c]);
    }
    let offsets = (0..=corners.len() as u32).step_by(3).collect();
    Faces::from_parts(offsets, corners)
}

/// The limit points of all vertices.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold or a face
/// is no triangle.
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_positions(mesh: &Mesh, topology: &Topology) -> Result<Vec<DVec3>> {
    require_triangles(mesh, topology, "loop")?;
    Ok(blend_with_neighbors(mesh, topology, limit_mask))
}

/// The tangents of the limit surface at all vertices: cos(2πj/n) and sin(2πj/n) on the neighbours in
/// counter-clockwise order.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold or a face
/// is no triangle.
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_tangents(mesh: &Mesh, topology: &Topology) -> Result<Vec<Tangents>> {
    require_triangles(mesh, topology, "loop")?;
    Ok(ring_tangents(mesh, topology))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_normals(mesh: &Mesh, topology: &Topology) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(mesh, topology)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
