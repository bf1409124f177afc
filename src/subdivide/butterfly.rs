//! The modified Butterfly scheme (Zorin, Schröder & Sweldens 1996) on closed triangle meshes: interpolatory,
//! so limit points are the vertices themselves. The tension parameter w is 0, which leaves the 8-point
//! stencil at edges of two regular vertices.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::interpolatory::{RegularMask, SQRT_3, tangents};
use super::loop_scheme::{refined_topology, split_in_four};
use super::star::{
    CHUNK, Circle, Harmonics, Tangents, edge_numbers, find_first, next_in_triangle,
    prev_in_triangle, refuse, require_room, require_triangles, twin,
};
use crate::Result;
use crate::mesh::{Mesh, Topology};

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
    let stencil = Stencil::new(mesh, topology);
    if let Some((v, n)) = stencil.without_rule() {
        return refuse(format!(
            "vertex {v} has valence {n}, for which butterfly has no rule: remove it"
        ));
    }
    let firsts = topology.first_sides();
    let mut positions = Vec::with_capacity(mesh.len() + firsts.len());
    positions.par_extend(&mesh.positions);
    let sides = firsts.par_iter().with_min_len(CHUNK);
    positions.par_extend(sides.map(|&c| stencil.edge_point(c)));
    let edge = edge_numbers(topology, &firsts);
    Ok(Mesh::new(positions, split_in_four(mesh, &edge)))
}

/// The tangents of the limit surface at all vertices, found in the mesh refined once, which is what they cost.
///
/// # Errors
/// As [`refine`].
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_tangents(mesh: &Mesh, topology: &Topology) -> Result<Vec<Tangents>> {
    let fine = refine(mesh, topology)?;
    let finer = refined_topology(topology, &fine);
    Ok(tangents(&fine, &finer, mesh.len(), &TANGENTS))
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

/// What the points of edges are computed from.
struct Stencil<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    /// The masks of extraordinary vertices of up to [`WALKED`] neighbours, by valence.
    masks: Vec<Vec<f64>>,
    /// The other extraordinary vertices, ascending, with their rings' harmonics.
    wide: Vec<Wide>,
}

/// Up to this valence, the ring is walked once an edge: n² steps a vertex. Beyond, once a vertex.
const WALKED: usize = 16;

/// The mask of a vertex is a circulant of three harmonics, so its n products with the ring cost O(n).
struct Wide {
    vertex: u32,
    center: DVec3,
    ring: Harmonics,
    circle: Vec<DVec2>,
    /// The half-edges of the star, ascending, with their places in it.
    places: Vec<(u32, u32)>,
}

impl<'a> Stencil<'a> {
    fn new(mesh: &'a Mesh, topology: &'a Topology) -> Self {
        let masks = (0..=WALKED)
            .map(|n| {
                if n < 3 {
                    Vec::new()
                } else {
                    extraordinary_mask(n)
                }
            })
            .collect();
        let wide = (0..mesh.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .filter(|&v| topology.incidence.face_count(v) > WALKED)
            .map(|v| Wide::new(mesh, topology, v))
            .collect();
        Stencil {
            mesh,
            topology,
            masks,
            wide,
        }
    }

    /// The first vertex of valence below 3, and its valence.
    fn without_rule(&self) -> Option<(usize, usize)> {
        let valence = |v| self.topology.incidence.face_count(v);
        let v = find_first(self.mesh.len(), |v| valence(v) < 3)?;
        Some((v, valence(v)))
    }

    /// The point of the edge of half-edge `c`.
    fn edge_point(&self, c: u32) -> DVec3 {
        let t = twin(self.topology, c);
        match [c, t].map(|c| self.extraordinary(c)) {
            [None, None] => self.regular(c) + self.regular(t),
            [Some(point), None] | [None, Some(point)] => point,
            [Some(one), Some(other)] => 0.5 * one + 0.5 * other,
        }
    }

    /// The regular stencil's half on the side of half-edge `c`.
    fn regular(&self, c: u32) -> DVec3 {
        let [end, opposite, wing] = REGULAR;
        let at = |c: usize| self.mesh.positions[self.mesh.faces.corners()[c] as usize];
        let (next, prev) = (next_in_triangle(c), prev_in_triangle(c));
        let across = |side: usize| at(prev_in_triangle(twin(self.topology, side as u32)));
        end * at(c as usize) + opposite * at(prev) + wing * (across(next) + across(prev))
    }

    /// The mask of the vertex that half-edge `c` leaves, unless it is regular.
    fn extraordinary(&self, c: u32) -> Option<DVec3> {
        let corners = self.mesh.faces.corners();
        let v = corners[c as usize];
        let n = self.topology.incidence.face_count(v as usize);
        if n == 6 {
            return None;
        }
        if n > WALKED {
            let found = self.wide.binary_search_by_key(&v, |w| w.vertex).ok()?;
            return self.wide[found].point(c);
        }
        // The mask is symmetric about the edge, so its ring is walked from there in both directions.
        let neighbor = |c: u32| self.mesh.positions[corners[next_in_triangle(c)] as usize];
        let (mut left, mut right) = (c, c);
        let mask = &self.masks[n];
        let mut point = CENTER * self.mesh.positions[v as usize] + mask[0] * neighbor(c);
        for weight in &mask[1..n.div_ceil(2)] {
            left = twin(self.topology, prev_in_triangle(left) as u32);
            right = next_in_triangle(twin(self.topology, right)) as u32;
            point += *weight * (neighbor(left) + neighbor(right));
        }
        if n.is_multiple_of(2) {
            left = twin(self.topology, prev_in_triangle(left) as u32);
            point += mask[n / 2] * neighbor(left);
        }
        Some(point)
    }
}

impl Wide {
    fn new(mesh: &Mesh, topology: &Topology, v: usize) -> Self {
        let mut star = Vec::new();
        topology.star(&mesh.faces, v, &mut star);
        let circle = Circle::default().of(star.len()).to_vec();
        let neighbor = |&c: &u32| mesh.faces.corners()[next_in_triangle(c)] as usize;
        let points = star.iter().map(|c| mesh.positions[neighbor(c)]);
        let ring = Harmonics::of(points, &circle, 1);
        let mut places: Vec<(u32, u32)> = star.into_iter().zip(0..).collect();
        places.sort_unstable();
        Wide {
            vertex: v as u32,
            center: CENTER * mesh.positions[v],
            ring,
            circle,
            places,
        }
    }

    /// The point of the edge of half-edge `c`, which leaves the vertex.
    fn point(&self, c: u32) -> Option<DVec3> {
        let found = self.places.binary_search_by_key(&c, |p| p.0).ok()?;
        let place = self.places[found].1 as usize;
        let amplitudes = amplitudes(self.places.len());
        Some(self.center + self.ring.at(&self.circle, place, amplitudes))
    }
}
