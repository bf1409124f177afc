//! The modified Butterfly scheme (Zorin, Schröder & Sweldens 1996) on triangle meshes: interpolatory,
//! so limit points are the vertices themselves. The tension parameter w is 0, which leaves the 8-point
//! stencil at edges of two regular vertices.
//!
//! Sharp edges (those of a boundary, creases) take the four-point rule (−1, 9, 9, −1)/16 along their curve, whose polygon goes
//! on beyond an end by the mirrored point 2·end − next; so the curve depends on nothing beside it. At the other edges of a sharp
//! vertex its own mask would need a ring that is not there: it counts as regular. A wing that lies beyond a sharp side xy of a
//! triangle xyz, where there is nothing or another surface, is the mirrored point x + y − z. It continues the lattice of
//! a regular mesh, so that linear functions are reproduced up to the boundary; and both sides of a crease are
//! refined without each other.

use std::f64::consts::TAU;

use glam::DVec3;

use super::interpolatory::{RegularMask, SQRT_3, tangents, vertices};
use super::loop_scheme::{refined_topology, split_in_four};
use super::refined::{self, Of};
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::ring::{Place, RingRule, Rings};
use super::sharp::{Polygons, mirrored};
use super::star::{
    Tangents, across, next_in_triangle, prev_in_triangle, require_no_pillow, require_no_semi_sharp, require_room,
    require_triangles,
};
use crate::Result;
use crate::mesh::edge_numbers::{EdgeNumbers, FirstSides};
use crate::mesh::{Mesh, Surface};
use crate::pages::large;
use crate::parallel;

/// On the command line and in messages.
const NAME: &str = "butterfly";

/// The weight of the extraordinary vertex itself.
pub const CENTER: f64 = 0.75;

/// The regular stencil: the ends of the edge, the vertices opposite to it, the four wings.
pub const REGULAR: [f64; 3] = [0.5, 0.125, -0.0625];

/// The tangents at a regular vertex, in units of 1/60 of a lattice step's inverse.
const TANGENTS: RegularMask = RegularMask {
    weights: &[
        (1, 0, [16.0, 0.0]),
        (2, 0, [1.0, 0.0]),
        // 8/√3 at 30°.
        (1, 1, [-4.0, -4.0 / SQRT_3]),
    ],
};

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

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: NAME,
    class: Class::Interpolatory,
    needs_triangles: true,
    check,
    refine,
    refined_topology,
    refined_features: |surface, refined, topology| {
        refined::features_of_pieces(surface, refined, topology, refined::halves_in_fours)
    },
    size: Size::in_four,
    limit_positions: |surface| vertices(NAME, surface),
    limit_normals,
};

/// Refuses what Loop's refinement does, and what is semi-sharp.
fn check(surface: &Surface) -> Result<()> {
    require_triangles(surface, NAME)?;
    require_no_pillow(surface)?;
    require_no_semi_sharp(surface, NAME)
}

/// One step.
///
/// An edge of two regular vertices (valence 6) takes the 8-point stencil, one with an extraordinary vertex that
/// vertex's mask, one with two the mean of both. Vertices and faces are numbered as by
/// [`loop_scheme::refine`](super::loop_scheme::refine). Sharp edges, and those beside them, take the rules
/// [above](self).
///
/// # Errors
/// As [`loop_scheme::refine`](super::loop_scheme::refine).
pub fn refine(surface: &Surface) -> Result<Mesh> {
    let mesh = surface.mesh();
    check(surface)?;
    require_room(mesh, 4)?;
    let edges = surface.topology().edge_numbers();
    if surface.features().is_none() {
        let positions = refined::points(surface, &edges, &[Of::Vertices, Of::Edges], &|surface, edges| {
            smooth_points(surface, &rings(surface), edges)
        });
        return Ok(Mesh::new(positions, split_in_four(mesh, &edges)));
    }
    let rings = rings(surface);
    let mut positions = smooth_points(surface, &rings, edges.firsts());
    set_at_sharp_edges(&mut positions[mesh.len()..], surface, &rings, &edges);
    Ok(Mesh::new(positions, split_in_four(mesh, &edges)))
}

fn rings(surface: &Surface) -> Rings<'_> {
    Rings::new(surface, RingRule { place: Place::Edge, mask: |n| (CENTER, extraordinary_mask(n)), amplitudes })
}

/// The points of vertices and edges, those of sharp edges and beside them as if these were not there.
fn smooth_points(surface: &Surface, rings: &Rings, edges: &FirstSides) -> Vec<DVec3> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let mut positions = large(Vec::with_capacity(mesh.len() + topology.edges()));
    parallel::append(&mut positions, &mesh.positions);
    let at = |c: usize| mesh.positions[mesh.faces.corners()[c] as usize];
    edges.extend(&mut positions, |c| {
        point(surface, rings, c, |side| at(prev_in_triangle(across(topology, side as u32))))
    });
    positions
}

/// The new point of the edge of half-edge `c`; `beyond(side)` is the vertex across a side of its triangles.
fn point(surface: &Surface, rings: &Rings, c: u32, beyond: impl Fn(usize) -> DVec3) -> DVec3 {
    let t = across(surface.topology(), c);
    match [c, t].map(|c| rings.is_extraordinary(c)) {
        [false, false] => regular(surface, c, &beyond) + regular(surface, t, &beyond),
        [true, false] => rings.point(c),
        [false, true] => rings.point(t),
        [true, true] => 0.5 * (rings.point(c) + rings.point(t)),
    }
}

/// The regular stencil's half on the side of half-edge `c`.
fn regular(surface: &Surface, c: u32, beyond: impl Fn(usize) -> DVec3) -> DVec3 {
    let mesh = surface.mesh();
    let [end, opposite, wing] = REGULAR;
    let at = |c: usize| mesh.positions[mesh.faces.corners()[c] as usize];
    let (next, prev) = (next_in_triangle(c), prev_in_triangle(c));
    end * at(c as usize) + opposite * at(prev) + wing * (beyond(next) + beyond(prev))
}

/// Sets the points of sharp edges, and of the other edges of their triangles, whose wings lie beyond. `points` is one an edge.
/// O(k log k) for k sharp edges, by one thread.
fn set_at_sharp_edges(points: &mut [DVec3], surface: &Surface, rings: &Rings, edges: &EdgeNumbers) {
    let Some(features) = surface.features() else { return };
    let (old, topology, corners) = (surface.positions(), surface.topology(), surface.faces().corners());
    let at = |c: usize| old[corners[c] as usize];
    let beyond = |side: usize| match features.is_sharp(topology, side as u32) {
        true => mirrored(surface, side as u32),
        false => at(prev_in_triangle(across(topology, side as u32))),
    };
    let polygons = Polygons::new(old, features);
    for &sharp in features.sharp_half_edges() {
        let ends = [sharp as usize, next_in_triangle(sharp)].map(|c| corners[c] as usize);
        let [before, a, b, after] = polygons.about(ends);
        points[edges.of(sharp) as usize] = 0.5625 * (a + b) - 0.0625 * (before + after);
    }
    for side in features.sharp_sides(topology) {
        for c in [next_in_triangle(side) as u32, prev_in_triangle(side) as u32] {
            if !features.is_sharp(topology, c) {
                points[edges.of(c) as usize] = point(surface, rings, c, beyond);
            }
        }
    }
}

/// The tangents of the limit surface at all smooth vertices, found in the mesh refined once, which is what they cost. Sharp
/// vertices have none.
///
/// # Errors
/// As [`refine`].
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    let fine = Refinement::Butterfly.refined(surface)?;
    Ok(tangents(&fine, surface.len(), &TANGENTS))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(surface)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
