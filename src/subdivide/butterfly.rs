//! The modified Butterfly scheme (Zorin, Schröder & Sweldens 1996) on closed triangle meshes: interpolatory,
//! so limit points are the vertices themselves. The tension parameter w is 0, which leaves the 8-point
//! stencil at edges of two regular vertices.

use std::f64::consts::TAU;

use glam::DVec3;

use super::loop_scheme::split_in_four;
use super::star::{
    Circle, Harmonics, edge_numbers, next_in_triangle, prev_in_triangle, refuse, require_room,
    require_triangles, twin,
};
use crate::Result;
use crate::mesh::{Mesh, Topology};

/// The weight of the extraordinary vertex itself.
pub const CENTER: f64 = 0.75;

/// The regular stencil: the ends of the edge, the vertices opposite to it, the four wings.
pub const REGULAR: [f64; 3] = [0.5, 0.125, -0.0625];

/// The amplitudes of the harmonics 0, 1, 2 of an extraordinary vertex's mask: its weights are
/// s_j = (a₀ + a₁cos(2πj/n) + a₂cos(4πj/n))/n. With (¼, 1, ½) for n ≥ 5 this is the published formula. The
/// published lists (5/12, −1/12, −1/12) for n = 3 and (3/8, 0, −1/8, 0) for n = 4 have these amplitudes: the
/// second harmonic is the first's mirror image at n = 3 and its own at n = 4.
fn amplitudes(n: usize) -> [f64; 3] {
    match n {
        3 => [0.25, 1.0, 0.0],
        4 => [0.25, 1.0, 0.25],
        _ => [0.25, 1.0, 0.5],
    }
}

/// The mask of the point on edge 0 of a vertex of valence `n` ≠ 6: the weights s_0 … s_{n−1} of the neighbours
/// in circular order, which go with [`CENTER`].
///
/// # Panics
/// If `n` < 3, where the scheme has no rule.
pub fn extraordinary_mask(n: usize) -> Vec<f64> {
    assert!(n >= 3, "valence at least 3");
    let [a0, a1, a2] = amplitudes(n);
    let weight = |j: usize| {
        let angle = TAU * j as f64 / n as f64;
        (a0 + a1 * angle.cos() + a2 * (2.0 * angle).cos()) / n as f64
    };
    (0..n).map(weight).collect()
}

/// One step.
///
/// An edge of two regular vertices (valence 6) takes the 8-point stencil, one with an extraordinary vertex that
/// vertex's mask, one with two the mean of both. Vertices and faces are numbered as by
/// [`loop_scheme::refine`](super::loop_scheme::refine).
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold, a face is
/// no triangle (the first is named), a vertex has valence < 3, or the result is too large for 32-bit indices.
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn refine(mesh: &Mesh, topology: &Topology) -> Result<Mesh> {
    require_triangles(mesh, topology, "butterfly")?;
    require_room(mesh, 4)?;
    let old = &mesh.positions;
    let corners = mesh.faces.corners();
    let edge = edge_numbers(mesh, topology);
    let mut positions = Vec::with_capacity(mesh.len() + topology.edges());
    positions.extend_from_slice(old);
    positions.resize(mesh.len() + topology.edges(), DVec3::ZERO);
    let edge_points = &mut positions[mesh.len()..];
    let regular = |v: usize| topology.incidence.face_count(v) == 6;

    // The half of the stencil on the half-edge's side; the twin brings the other.
    let [end, opposite, wing] = REGULAR;
    for c in 0..corners.len() as u32 {
        let (next, prev) = (next_in_triangle(c), prev_in_triangle(c));
        let (v, w) = (corners[c as usize] as usize, corners[next] as usize);
        if regular(v) && regular(w) {
            let across = |side: usize| {
                let opposite = prev_in_triangle(twin(topology, side as u32));
                old[corners[opposite] as usize]
            };
            edge_points[edge[c as usize] as usize] += end * old[v]
                + opposite * old[corners[prev] as usize]
                + wing * (across(next) + across(prev));
        }
    }

    let mut star = Vec::new();
    let mut circle = Circle::default();
    for v in (0..mesh.len()).filter(|&v| !regular(v)) {
        topology.star(&mesh.faces, v, &mut star);
        let n = star.len();
        if n < 3 {
            return refuse(format!(
                "vertex {v} has valence {n}, for which butterfly has no rule: remove it"
            ));
        }
        let circle = circle.of(n);
        let neighbor = |c: u32| corners[next_in_triangle(c)] as usize;
        let ring = Harmonics::of(star.iter().map(|&c| old[neighbor(c)]), circle, 1);
        for (j, &c) in star.iter().enumerate() {
            let point = CENTER * old[v] + ring.at(circle, j, amplitudes(n));
            let share = if regular(neighbor(c)) { 1.0 } else { 0.5 };
            edge_points[edge[c as usize] as usize] += share * point;
        }
    }
    Ok(Mesh::new(positions, split_in_four(mesh, &edge)))
}
