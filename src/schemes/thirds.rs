//! Sharp edges and vertices under the √3 refinements, which split edges in three by two steps: at a boundary after Kobbelt
//! 2000 and Labsik & Greiner 2000.
//!
//! In the first of two steps sharp edges rest: they are not flipped, and sharp vertices stay. So every triangle at a sharp
//! edge then has just that one, and across from it the new vertex of the first step. In the second step the sharp edge is split
//! in three, its triangle with it, which takes no vertex inside; curves follow a ternary rule: (16, 10, 1)/27 and
//! (4, 19, 4)/27 of the cubic B-spline, (60, 30, −5, −4)/81 of cubic interpolation, or a blend by α. Beyond an end that is
//! no crease vertex a curve goes on by the mirrored point, so that its last edge is split evenly, by (2, 1)/3. Which step
//! comes next is kept with the [features](Features::is_midway): of a mesh that is given, the first.
//!
//! Between the steps the star of a vertex z across from a sharp edge xy lacks the triangles beyond. They are put there by the
//! mirrored point x + y − z, where the new vertex beyond would be on a regular mesh: so the lattice is reproduced.
//!
//! Vertices of the result: old ones, one for each face, one for each boundary edge that is split. The point of sharp half-edge c
//! that is nearer to its start is the vertex of the face of c; the other one that of the face across, or of the
//! boundary edge. Faces: one for each half-edge, as on closed meshes; that of a sharp one is the triangle that keeps
//! it, or its middle third.

use glam::DVec3;

use super::sharp::{Polygons, mirrored};
use super::star::{
    CHUNK, neighbor_sum, next_in_triangle, prev_in_triangle, require_no_dart, require_no_pillow, require_no_semi_sharp,
    require_triangles, twin,
};
use crate::mesh::Surface;
use crate::mesh::features::Features;
use crate::{Result, parallel};

/// How far a crease vertex of a cubic B-spline moves towards each of its neighbours.
const RELAXATION: f64 = 4.0 / 27.0;
/// The point at a third of an edge, from the four about it.
const SPLINE: [f64; 4] = [1.0 / 27.0, 16.0 / 27.0, 10.0 / 27.0, 0.0];
const INTERPOLATING: [f64; 4] = [-5.0 / 81.0, 60.0 / 81.0, 30.0 / 81.0, -4.0 / 81.0];

/// Refuses what the √3 refinements have no rules for.
pub(super) fn require(surface: &Surface, scheme: &'static str) -> Result<()> {
    require_triangles(surface, scheme)?;
    require_no_pillow(surface)?;
    require_no_semi_sharp(surface, scheme)?;
    require_no_dart(surface, scheme)
}

/// The half-edges after a step along sharp half-edge `c`, in this order.
pub(super) fn pieces(surface: &Surface, c: u32, put: &mut Vec<u32>) {
    match splits(surface) {
        Some(_) => {
            let before = twin(surface.topology(), prev_in_triangle(c) as u32);
            put.extend([3 * before, 3 * c, 3 * next_in_triangle(c) as u32 + 2]);
        }
        None => put.push(3 * c),
    }
}

/// Sets the faces that the flip of all edges makes wrong.
pub(super) fn keep_sharp_edges(corners: &mut [u32], surface: &Surface) {
    let Some(features) = surface.features() else { return };
    let (old, topology) = (surface.faces().corners(), surface.topology());
    let vertices = surface.len() as u32;
    for c in features.sharp_sides(topology) {
        let (next, prev) = (next_in_triangle(c), prev_in_triangle(c));
        let own = vertices + c / 3;
        let face = &mut corners[3 * c as usize..][..3];
        if splits(surface).is_none() {
            face.copy_from_slice(&[old[c as usize], old[next], own]);
            continue;
        }
        let second = later_third(surface, c) as u32;
        face.copy_from_slice(&[own, second, old[prev]]);
        corners[3 * next + 2] = second;
        corners[3 * twin(topology, next as u32) as usize + 1] = second;
    }
}

/// Where sharp vertices, and those across from sharp edges between two steps, go by a step of √3. O(N), and O(k log k) for k
/// sharp edges.
pub(super) fn moved(surface: &Surface, mask: impl Fn(usize) -> [f64; 2]) -> Vec<(usize, DVec3)> {
    let Some(features) = surface.features() else { return Vec::new() };
    let (old, topology, corners) = (surface.positions(), surface.topology(), surface.faces().corners());
    let mut moved = parallel::flat_map(old.len(), CHUNK, |range| {
        range.filter(|&v| !features.is_smooth(v)).map(|v| (v, old[v])).collect()
    });
    if splits(surface).is_none() {
        return moved;
    }
    features.for_each_crease(|v, [a, b]| moved.push((v, old[v] + RELAXATION * (old[a] - 2.0 * old[v] + old[b]))));
    let sides = features.sharp_sides(topology);
    let mut across: Vec<(usize, u32)> = sides.map(|c| (corners[prev_in_triangle(c)] as usize, c)).collect();
    across.sort_unstable();
    for sides in across.chunk_by(|a, b| a.0 == b.0) {
        let v = sides[0].0;
        let (n, sum) = neighbor_sum(surface.mesh(), surface.incidence(), v);
        let [own, other] = mask(n + sides.len());
        let beyond: DVec3 = sides.iter().map(|&(_, c)| mirrored(surface, c)).sum();
        moved.push((v, own * old[v] + other * (sum + beyond)));
    }
    moved
}

/// Appends the points of boundary edges, and sets those of all sharp edges; `alpha(a, b)` is that of the point at a third of the
/// edge from vertex a to b: 0 for the cubic B-spline, 1 to interpolate.
pub(super) fn set_thirds(positions: &mut Vec<DVec3>, surface: &Surface, alpha: impl Fn(usize, usize) -> f64) {
    let Some(features) = splits(surface) else { return };
    let polygons = Polygons::new(surface.positions(), features);
    for_each_third(surface, features, positions, |ends| third(alpha(ends[0], ends[1]), polygons.about(ends)));
}

/// The point at a third of an edge, from the four about it.
fn third(alpha: f64, about: [DVec3; 4]) -> DVec3 {
    let weights = SPLINE.into_iter().zip(INTERPOLATING).map(|(a, b)| (1.0 - alpha) * a + alpha * b);
    weights.zip(about).map(|(w, p)| w * p).sum()
}

/// The limit points of crease vertices for an α of its own at every vertex, by rounds of two steps on the two neighbours at either
/// side, moved back to the vertex and enlarged by 3 after each.
pub(crate) fn curve_limits(surface: &Surface, alpha: &[f64], rounds: usize) -> Vec<(usize, DVec3)> {
    let Some(features) = surface.features() else { return Vec::new() };
    let points = surface.positions();
    let polygons = Polygons::new(points, features);
    let mut limits = Vec::new();
    features.for_each_crease(|v, [a, b]| {
        let own = alpha[v];
        // From the neighbour to the one beyond it.
        let mut sides = [a, b].map(|w| [points[w] - points[v], polygons.beyond(v, w) - points[v]]);
        let mut others = [alpha[a], alpha[b]];
        let (mut moved, mut scale) = (DVec3::ZERO, 1.0);
        for _ in 0..rounds {
            let step = (1.0 - own) * RELAXATION * (sides[0][0] + sides[1][0]);
            moved += scale * step;
            scale /= 3.0;
            let thirds = [0, 1].map(|k| {
                let ([near, far], other) = (sides[k], others[k]);
                let about = [sides[1 - k][0], DVec3::ZERO, near, far];
                let back = [far, near, DVec3::ZERO, about[0]];
                [third((2.0 * own + other) / 3.0, about), third((own + 2.0 * other) / 3.0, back)]
            });
            sides = thirds.map(|side| side.map(|p| 3.0 * (p - step)));
            others = others.map(|other| (2.0 * own + other) / 3.0);
        }
        limits.push((v, points[v] + moved));
    });
    limits
}

/// Appends values of the new vertices on boundary edges, and sets those on all sharp edges: (2 a + b)/3 of their ends.
pub(super) fn set_means(values: &mut Vec<f64>, surface: &Surface) {
    let Some(features) = splits(surface) else { return };
    let old = values[..surface.len()].to_vec();
    for_each_third(surface, features, values, |[a, b]| (2.0 * old[a] + old[b]) / 3.0);
}

/// Gives each new vertex on a sharp edge the value of the edge's ends, the nearer one first.
fn for_each_third<T: Copy + Default>(
    surface: &Surface,
    features: &Features,
    values: &mut Vec<T>,
    value: impl Fn([usize; 2]) -> T,
) {
    let (topology, corners) = (surface.topology(), surface.faces().corners());
    values.resize(values.len() + surface.boundary_edges(), T::default());
    for c in features.sharp_sides(topology) {
        let [a, b] = [c as usize, next_in_triangle(c)].map(|c| corners[c] as usize);
        values[surface.len() + c as usize / 3] = value([a, b]);
        if topology.twin(c).is_none() {
            values[later_third(surface, c)] = value([b, a]);
        }
    }
}

/// The vertex on sharp half-edge `c` that is nearer to its end.
fn later_third(surface: &Surface, c: u32) -> usize {
    let boundary = surface.boundary_half_edges();
    let place = match surface.topology().twin(c) {
        Some(t) => t as usize / 3,
        None => surface.faces().len() + boundary.partition_point(|&b| b < c),
    };
    surface.len() + place
}

/// The features, if the next step splits sharp edges.
pub(super) fn splits(surface: &Surface) -> Option<&Features> {
    surface.features().filter(|f| f.is_midway())
}

/// Between two steps, what the mesh after the second has at the vertices of this one, where stars are whole again; otherwise
/// `None`.
pub(super) fn of_next<T>(
    surface: &Surface,
    refined: impl Fn(&Surface) -> Result<Surface>,
    of: impl Fn(&Surface) -> Result<Vec<T>>,
) -> Result<Option<Vec<T>>> {
    if splits(surface).is_none() {
        return Ok(None);
    }
    let mut found = of(&refined(surface)?)?;
    found.truncate(surface.len());
    Ok(Some(found))
}
