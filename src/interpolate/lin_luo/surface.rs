//! The unified √3 surface (§4, §5): levels, choice of interpolated vertices, and what α does to the shape.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::Result;
use crate::interpolate::thall::angle;
use crate::mesh::{Mesh, Surface};
use crate::schemes::unified_sqrt3;

/// α = 1, interpolated, at the vertices marked, and `elsewhere` at the others.
pub fn choose(interpolated: &[bool], elsewhere: f64) -> Vec<f64> {
    let choice = |&marked: &bool| if marked { 1.0 } else { elsewhere };
    interpolated.iter().map(choice).collect()
}

/// `levels` steps of [`unified_sqrt3::refine`]: the refined mesh and its parameters. Old vertices keep their
/// numbers.
///
/// # Errors
/// As [`unified_sqrt3::refine`]: above all an α outside [0, 2], with its vertex.
///
/// # Panics
/// If there is not one α a vertex.
pub fn refine_n(surface: &Surface, alpha: &[f64], levels: usize) -> Result<(Surface, Vec<f64>)> {
    let (mut surface, mut alpha) = (surface.clone(), alpha.to_vec());
    for level in 1..=levels {
        (surface, alpha) = if level < levels || surface.features().is_some() {
            unified_sqrt3::refined(&surface, &alpha)?
        } else {
            let (last, parameters) = unified_sqrt3::refine(&surface, &alpha)?;
            (Surface::of_valid(last), parameters)
        };
    }
    Ok((surface, alpha))
}

/// The volume that a closed, outward oriented mesh encloses: Σ over triangles of p·(q × r)/6, faces of more corners
/// cut as fans. Negative if the mesh is turned inside out.
pub fn volume(mesh: &Mesh) -> f64 {
    // Seen from a vertex, so that a mesh far from the origin loses no digits.
    let Some(&origin) = mesh.positions.first() else {
        return 0.0;
    };
    let at = |v: u32| mesh.positions[v as usize] - origin;
    let fan = |face: &[u32]| -> f64 {
        let pairs = face.windows(2).skip(1);
        pairs.map(|w| at(face[0]).dot(at(w[0]).cross(at(w[1])))).sum()
    };
    mesh.faces.iter().map(fan).sum::<f64>() / 6.0
}

/// How a subdivision surface differs from the mesh that it was made of: the jump that is seen when a viewer switches
/// between the two ("popping").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Popping {
    /// Volume over that of the mesh: below 1 it shrinks, above it bulges.
    pub volume_ratio: f64,
    /// The distance of the vertices from where they were, over the diagonal of the bounding box.
    pub vertex_mean: f64,
    /// The largest of these distances; the former is their mean.
    pub vertex_max: f64,
    /// The distance of the triangles' centres from where they were, over the same diagonal.
    pub center_mean: f64,
    /// The largest of these; the former is their mean.
    pub center_max: f64,
    /// The mean of the latter along the triangles' normals: positive outward.
    pub center_outward: f64,
}

/// Compares the mesh with its unified √3 surface after `levels` ≥ 1 steps. Vertices are followed by their own
/// images, triangles by those of the points put in their centres. The limit is met within a factor of about 1/3 a
/// level.
///
/// # Errors
/// As [`refine_n`].
///
/// # Panics
/// If there is not one α a vertex, or `levels` is 0.
pub fn popping(surface: &Surface, alpha: &[f64], levels: usize) -> Result<Popping> {
    assert!(levels > 0, "at least one step");
    let (fine, _) = refine_n(surface, alpha, levels)?;
    let (mesh, fine) = (surface.mesh(), fine.mesh());
    let diagonal = mesh.diagonal();
    let (mut mean, mut max) = (0.0, 0.0f64);
    for (p, q) in mesh.positions.iter().zip(&fine.positions) {
        let moved = p.distance(*q) / diagonal;
        mean += moved;
        max = max.max(moved);
    }
    let (mut center_mean, mut center_max, mut outward) = (0.0, 0.0f64, 0.0);
    for (face, q) in mesh.faces.iter().zip(&fine.positions[mesh.len()..]) {
        let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[face[k] as usize]);
        let moved = (*q - (a + b + c) / 3.0) / diagonal;
        center_mean += moved.length();
        center_max = center_max.max(moved.length());
        outward += moved.dot((b - a).cross(c - a).normalize_or_zero());
    }
    let faces = mesh.faces.len() as f64;
    Ok(Popping {
        volume_ratio: volume(fine) / volume(mesh),
        vertex_mean: mean / mesh.len() as f64,
        vertex_max: max,
        center_mean: center_mean / faces,
        center_max,
        center_outward: outward / faces,
    })
}

/// The largest angle between the normals of faces that share an edge: the first divided difference of the surface
/// jumps by it. A C¹ surface needs it to tend to 0 over the levels. Triangles without area count a right angle.
///
/// # Panics
/// If `topology` is not that of `mesh`, or a face is no triangle.
pub fn largest_fold(surface: &Surface) -> f64 {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let normals: Vec<DVec3> = (mesh.faces.iter())
        .map(|face| {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[face[k] as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let fold = |c: u32| {
        let across = topology.twin(c)?;
        let [n, m] = [c, across].map(|c| normals[topology.incidence.face_of(c)]);
        Some(if n == DVec3::ZERO || m == DVec3::ZERO { FRAC_PI_2 } else { angle(n, m) })
    };
    topology.edge_sides().filter_map(fold).fold(0.0, f64::max)
}
