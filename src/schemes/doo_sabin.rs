//! Doo-Sabin subdivision (Doo & Sabin 1978) of any polygon mesh, and the modified first step of Zheng & Cai, after
//! which Doo-Sabin goes on. A vertex's limit point is the centroid of its type-V face after the first step: the point
//! that Nasri's system, or Zheng and Cai's, puts on the given one. Sharp edges, those of a boundary too, are cut by
//! Chaikin's rule, so that their curves are quadratic B-splines.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::chaikin;
use super::refined::{self, push_ends, set_by_edge, set_rows};
use super::refinement::{Class, RefinementRules, Size};
use super::scheme::QUADRATIC;
use super::sharp;
use super::star::{CHUNK, Circle, Tangents, centroid, for_each_star, put_stars, require_curves, require_room, twin};
use crate::Result;
use crate::mesh::features::Features;
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
    /// V'_i = ½V_i + ¼(V_{i−1} + V_{i+1}): two steps of [mid-edge](super::mid_edge) at once.
    MidEdge,
}

impl CornerRule {
    /// The rule of all steps after one by this.
    pub(super) fn further(self) -> Self {
        match self {
            CornerRule::DooSabin | CornerRule::ZhengCai => CornerRule::DooSabin,
            CornerRule::MidEdge => CornerRule::MidEdge,
        }
    }

    /// The weights of the corners of an `m`-gon in its corner 0, in order. Doo-Sabin: (m+5)/(4m), then
    /// (3 + 2cos(2πj/m))/(4m); Zheng-Cai: ½ + 1/(2m), then 1/(2m); mid-edge: ½, and ¼ on both sides.
    pub fn circulant(self, m: usize) -> Vec<f64> {
        let size = m as f64;
        let weight = |j: usize| match (self, j) {
            (CornerRule::DooSabin, 0) => (size + 5.0) / (4.0 * size),
            (CornerRule::DooSabin, _) => (3.0 + 2.0 * (TAU * j as f64 / size).cos()) / (4.0 * size),
            (CornerRule::ZhengCai, 0) => 0.5 + 0.5 / size,
            (CornerRule::ZhengCai, _) => 0.5 / size,
            (CornerRule::MidEdge, 0) => 0.5,
            (CornerRule::MidEdge, j) if j == 1 || j + 1 == m => 0.25,
            (CornerRule::MidEdge, _) => 0.0,
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

/// The new points of the corners of a face, `circle` having as many.
pub(super) fn face_points(positions: &[DVec3], face: &[u32], circle: &[DVec2], rule: CornerRule, points: &mut [DVec3]) {
    let corner = |k: usize| positions[face[k % face.len()] as usize];
    let size = face.len() as f64;
    let (mut sum, mut cosine, mut sine) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for (&v, unit) in face.iter().zip(circle) {
        let point = positions[v as usize];
        sum += point;
        cosine += unit.x * point;
        sine += unit.y * point;
    }
    for (k, ((&v, unit), new)) in face.iter().zip(circle).zip(points).enumerate() {
        let point = positions[v as usize];
        *new = match rule {
            CornerRule::DooSabin => 0.25 * point + (0.75 * sum + 0.5 * (unit.x * cosine + unit.y * sine)) / size,
            CornerRule::ZhengCai => 0.5 * (point + sum / size),
            CornerRule::MidEdge => 0.5 * point + 0.25 * (corner(k + 1) + corner(k + face.len() - 1)),
        };
    }
}

const NAME: &str = "doo-sabin";

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: NAME,
    class: Class::Dual,
    needs_triangles: false,
    check: |surface| require_curves(surface, NAME),
    refine,
    refined_topology,
    refined_features: chaikin::refined_features,
    size: Size::dual,
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

/// One step by a rule.
///
/// Vertices of the result: one for each old corner, in corner order. Faces of the result: type F, one for each
/// old face, its corners in order; type E, a quad for each edge (in order of its first half-edge); type V, one
/// for each old vertex, so that the face of vertex v has index F + E + v.
///
/// On an open or creased mesh the vertices of old corners are followed by two of every sharp edge (a, b), ¾a + ¼b and ¼a + ¾b, in
/// the order of [`sharp_half_edges`](crate::mesh::features::Features::sharp_half_edges), and then by the old vertices that are
/// corners, which stay. A sharp edge has a quad in each of its faces, between its two points and the corners there: that in the
/// face of its first half-edge in the edge's own place, the second ones, X for as many creased edges, after the quads of all
/// edges. A vertex has a face of type V between each two of its sharp edges, the first of which has index F + E + X + v; all
/// further ones come last. Inside the surface a corner with less than three sharp edges has a triangle for each two points about
/// it.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open) if the mesh has a boundary that is treated as interior,
/// [`Error::Dart`](crate::Error::Dart), [`Error::SemiSharp`](crate::Error::SemiSharp);
/// [`Error::TooLarge`](crate::Error::TooLarge) if 32-bit indices do not reach the result.
pub fn refine_by(rule: CornerRule, surface: &Surface) -> Result<Mesh> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_curves(surface, NAME)?;
    if let Some(features) = surface.features() {
        return chaikin::refine(rule, surface, features);
    }
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
    let points = match surface.renumbered() {
        Some(inside) => inside.of_corners(&corner_points(inside.surface(&mesh.positions).mesh(), rule)),
        None => corner_points(mesh, rule),
    };
    Ok(Mesh::new(points, Faces::from_parts(offsets, corners)))
}

/// The index of the type-V face of vertex 0 after a step; the first one of every vertex follows in order.
pub fn first_vertex_face(surface: &Surface) -> usize {
    let creased = surface.features().map_or(0, Features::creased_edges);
    surface.faces().len() + surface.topology().edges() + creased
}

/// The topology of `refined`, which is what [`refine_by`] made of the surface: with sharp edges, where faces of type V have
/// sizes of their own, from its faces.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    match surface.features() {
        None => refined::of_corners(surface, refined),
        Some(_) => Topology::new(&refined.faces, refined.len()),
    }
}

/// The limit points of all vertices when the first step is by `rule` and all others are Doo-Sabin, or mid-edge too: the
/// centroids of the type-V faces, (1/n) Σ of the vertex's corner points. On curves (a + 6v + b)/8 with the neighbours a
/// and b along the curve; corners rest.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open), [`Error::Dart`](crate::Error::Dart), [`Error::SemiSharp`](crate::Error::SemiSharp).
pub fn limit_positions(rule: CornerRule, surface: &Surface) -> Result<Vec<DVec3>> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_curves(surface, NAME)?;
    let mut limits = vec![DVec3::ZERO; mesh.len()];
    for (&v, point) in mesh.faces.corners().iter().zip(corner_points(mesh, rule)) {
        limits[v as usize] += point;
    }
    for (v, limit) in limits.iter_mut().enumerate() {
        *limit /= topology.incidence.face_count(v) as f64;
    }
    if let Some(features) = surface.features() {
        sharp::set_vertices(&mut limits, |v| surface.positions()[v], features, QUADRATIC);
    }
    Ok(limits)
}

/// The unit normals of the limit surface at the [`limit_positions`]; zero where [`Tangents::normal`] is, and where the surface
/// has several: on creases, and at corners that are inside or have sharp edges between the two of a boundary.
///
/// # Errors
/// As [`limit_positions`].
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
    if let Some(features) = surface.features() {
        let rules = (rule, rule.further());
        chaikin::for_each_tangents(surface, features, rules, |v, pair| normals[v] = pair.normal());
    }
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
