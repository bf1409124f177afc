//! Doo-Sabin subdivision (Doo & Sabin 1978) of any closed polygon mesh, and the modified first step of Zheng &
//! Cai, after which Doo-Sabin goes on. A vertex's limit point is the centroid of its type-V face after the first
//! step: the point that Nasri's system, or Zheng and Cai's, puts on the given one.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::refined::{self, push_ends, set_by_edge, set_rows};
use super::refinement::{Class, RefinementRules, Size};
use super::star::{CHUNK, Circle, Tangents, centroid, for_each_star, put_stars, require_closed, require_room, twin};
use crate::Result;
use crate::mesh::incidence::split_by_face;
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::filled;
use crate::pages::large;
use crate::parallel;

/// The rule of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerRule {
    /// V'_i = Σ_j α_ij V_j (Zheng-Cai Eq. 1).
    DooSabin,
    /// V'_i = (V_i + centroid)/2 (Zheng-Cai Eq. 4), meant for the first step only.
    ZhengCai,
}

impl CornerRule {
    /// The weights of the corners of an `m`-gon in its corner 0, in order. Doo-Sabin: (m+5)/(4m), then
    /// (3 + 2cos(2πj/m))/(4m); Zheng-Cai: ½ + 1/(2m), then 1/(2m).
    pub fn circulant(self, m: usize) -> Vec<f64> {
        let size = m as f64;
        let weight = |j: usize| match (self, j) {
            (CornerRule::DooSabin, 0) => (size + 5.0) / (4.0 * size),
            (CornerRule::DooSabin, _) => (3.0 + 2.0 * (TAU * j as f64 / size).cos()) / (4.0 * size),
            (CornerRule::ZhengCai, 0) => 0.5 + 0.5 / size,
            (CornerRule::ZhengCai, _) => 0.5 / size,
        };
        (0..m).map(weight).collect()
    }
}

/// The new point of every corner: the geometry of one step. O(m) for a face of m corners, since the rule is a
/// circulant of the constant, the first harmonic and the identity.
pub fn corner_points(mesh: &Mesh, rule: CornerRule) -> Vec<DVec3> {
    let corners = mesh.faces.corners();
    let mut points = filled(corners.len(), DVec3::ZERO);
    parallel::parts(split_by_face(&mesh.faces, CHUNK, &mut points), |range, mut part| {
        let mut circle = Circle::default();
        for f in range {
            let face = mesh.faces.face(f);
            let (points, rest) = part.split_at_mut(face.len());
            face_points(&mesh.positions, face, circle.of(face.len()), rule, points);
            part = rest;
        }
    });
    points
}

fn face_points(positions: &[DVec3], face: &[u32], circle: &[DVec2], rule: CornerRule, points: &mut [DVec3]) {
    let size = face.len() as f64;
    let (mut sum, mut cosine, mut sine) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for (&v, unit) in face.iter().zip(circle) {
        let point = positions[v as usize];
        sum += point;
        cosine += unit.x * point;
        sine += unit.y * point;
    }
    for ((&v, unit), new) in face.iter().zip(circle).zip(points) {
        let point = positions[v as usize];
        *new = match rule {
            CornerRule::DooSabin => 0.25 * point + (0.75 * sum + 0.5 * (unit.x * cosine + unit.y * sine)) / size,
            CornerRule::ZhengCai => 0.5 * (point + sum / size),
        };
    }
}

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: "doo-sabin",
    class: Class::Dual,
    needs_triangles: false,
    refine,
    refined_topology,
    pieces: None,
    size: |c| Size { vertices: c.corners, faces: c.faces + c.edges() + c.vertices, corners: 4 * c.corners },
    limit_positions: |surface| limit_positions(CornerRule::DooSabin, surface),
    limit_normals: |surface| limit_normals(CornerRule::DooSabin, surface),
};

/// One step of Doo-Sabin: [`refine_by`] with [`CornerRule::DooSabin`].
///
/// # Errors
/// As [`refine_by`].
pub fn refine(surface: &Surface) -> Result<Mesh> {
    refine_by(CornerRule::DooSabin, surface)
}

/// One step by either rule.
///
/// Vertices of the result: one for each old corner, in corner order. Faces of the result: type F, one for each
/// old face, its corners in order; type E, a quad for each edge (in order of its first half-edge); type V, one
/// for each old vertex, so that the face of vertex v has index F + E + v.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh has a boundary or the
/// result is too large for 32-bit indices.
pub fn refine_by(rule: CornerRule, surface: &Surface) -> Result<Mesh> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_closed(surface)?;
    require_room(mesh, 4)?;
    let count = mesh.faces.corners().len();
    let incidence = &topology.incidence;
    let mut corners = large(vec![0; 4 * count]);
    let (of_faces, rest) = corners.split_at_mut(count);
    let (of_edges, of_vertices) = rest.split_at_mut(2 * count);
    set_rows(of_faces, |c| [c]);
    set_by_edge(of_edges, topology, |c| {
        let t = twin(topology, c);
        let next = |c| incidence.next(&mesh.faces, c);
        [next(c), c, next(t), t]
    });
    put_stars(surface, of_vertices);

    let mut offsets = large(Vec::with_capacity(mesh.faces.len() + count / 2 + mesh.len() + 1));
    offsets.push(0);
    parallel::extend(&mut offsets, mesh.faces.len(), |_| |f| mesh.faces.range(f).end as u32);
    push_ends(&mut offsets, count, 4, count / 2);
    let first = 3 * count as u32;
    let ends = &incidence.offsets()[1..];
    parallel::extend(&mut offsets, ends.len(), |_| |v| first + ends[v]);
    Ok(Mesh::new(corner_points(mesh, rule), Faces::from_parts(offsets, corners)))
}

/// The topology of `refined`, which is what [`refine_by`] made of the surface.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    refined::of_corners(surface, refined)
}

/// The limit points of all vertices when the first step is by `rule` and all others are Doo-Sabin: the
/// centroids of the type-V faces, (1/n) Σ of the vertex's corner points.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open).
pub fn limit_positions(rule: CornerRule, surface: &Surface) -> Result<Vec<DVec3>> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_closed(surface)?;
    let mut limits = vec![DVec3::ZERO; mesh.len()];
    for (&v, point) in mesh.faces.corners().iter().zip(corner_points(mesh, rule)) {
        limits[v as usize] += point;
    }
    for (v, limit) in limits.iter_mut().enumerate() {
        *limit /= topology.incidence.face_count(v) as f64;
    }
    Ok(limits)
}

/// The unit normals of the limit surface at the [`limit_positions`]; zero where [`Tangents::normal`] is.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open).
pub fn limit_normals(rule: CornerRule, surface: &Surface) -> Result<Vec<DVec3>> {
    let mesh = surface.mesh();
    let limits = limit_positions(rule, surface)?;
    let points = corner_points(mesh, rule);
    let mut normals = Vec::with_capacity(mesh.len());
    let mut circle = Circle::default();
    for_each_star(surface, |v, star| {
        let ring = star.iter().map(|&c| points[c as usize]);
        normals.push(ring_normal(limits[v], ring, circle.of(star.len())));
    });
    Ok(normals)
}

/// The unit normals of the Doo-Sabin limit surface at the centroids of the faces, which it passes through; zero
/// where [`Tangents::normal`] is.
pub fn face_normals(mesh: &Mesh) -> Vec<DVec3> {
    let mut circle = Circle::default();
    let normal = |face: &[u32]| {
        let center = centroid(&mesh.positions, face);
        let ring = face.iter().map(|&v| mesh.positions[v as usize]);
        ring_normal(center, ring, circle.of(face.len()))
    };
    mesh.faces.iter().map(normal).collect()
}

/// The normal at the centroid of a face: (cos, sin)(2πj/m) on its corners are the left eigenvectors of the
/// subdominant eigenvalue ½ of the circulant.
fn ring_normal(center: DVec3, ring: impl Iterator<Item = DVec3>, circle: &[DVec2]) -> DVec3 {
    let mut pair = Tangents::default();
    for (point, &weights) in ring.zip(circle) {
        pair.add(weights, point - center);
    }
    pair.normal()
}
