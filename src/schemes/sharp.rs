//! Sharp edges and vertices under Catmull-Clark and Loop, whose curves are cubic B-splines: what a step, limit points and
//! tangents are there; and what other schemes share. A smooth vertex has all of its faces, so that everything is computed as
//! on a closed mesh first, and then set anew at the few places that are sharp. Values that the first pass gives to the ends of
//! incomplete stars are finite and mean nothing.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::slice::ParallelSliceMut;

use super::local_limit::{StarOf, StarRule};
use super::star::{CHUNK, Tangents, next_in_triangle, prev_in_triangle};
use crate::mesh::Surface;
use crate::mesh::edge_numbers::EdgeNumbers;
use crate::mesh::features::{Features, Rule};
use crate::parallel;

/// Sets the points of sharp edges, creases and corners after a step: (v + w)/2 for an edge, (a + 6v + b)/8 for a crease
/// vertex with the neighbours a and b along its curve; corners rest; what is semi-sharp blends these with the smooth points.
/// `positions` are those of the old vertices, then one for each edge, then others; `old(v)` is where a vertex that is not smooth
/// was. O(N), and O(k) by one thread for k vertices on curves and at semi-sharp edges.
pub(super) fn set_refined(
    positions: &mut [DVec3],
    surface: &Surface,
    edges: &EdgeNumbers,
    old: impl Fn(usize) -> DVec3 + Sync,
) {
    let Some(features) = surface.features() else { return };
    let (faces, topology) = (surface.faces(), surface.topology());
    let (vertices, others) = positions.split_at_mut(topology.incidence.vertices());
    set_vertices(vertices, &old, features, 0.125);
    for v in features.at_semi_sharp(surface) {
        let v = v as usize;
        // On a curve `vertices[v]` is no smooth point any more, and no rule there asks for one.
        vertices[v] = StarOf::new(surface, features, v).vertex_point(&old, vertices[v]);
    }
    let (corners, sharp) = (faces.corners(), features.sharp_half_edges());
    let midpoint = |c: u32| {
        let ends = [c, topology.incidence.next(faces, c)].map(|c| old(corners[c as usize] as usize));
        0.5 * (ends[0] + ends[1])
    };
    for &(c, sharpness) in features.semi_sharp_edges() {
        let (point, s) = (&mut others[edges.of(c) as usize], sharpness.min(1.0));
        *point = (1.0 - s) * *point + s * midpoint(c);
    }
    parallel::chunks(&mut others[..topology.edges()], CHUNK, |first, part| {
        // Sharp edges are listed by first half-edges, which is the order of their numbers.
        let from = sharp.partition_point(|&c| (edges.of(c) as usize) < first);
        for &c in &sharp[from..] {
            let Some(point) = part.get_mut(edges.of(c) as usize - first) else { break };
            *point = midpoint(c);
        }
    });
}

/// Sets `w a + (1 − 2w) v + w b` on curves, v at corners.
pub(super) fn set_vertices(points: &mut [DVec3], old: impl Fn(usize) -> DVec3 + Sync, features: &Features, w: f64) {
    let rules = features.rules();
    parallel::change(points, |v, point| {
        if rules[v] == Rule::Corner {
            *point = old(v);
        }
    });
    features.for_each_crease(|v, [a, b]| points[v] = (1.0 - 2.0 * w) * old(v) + w * (old(a) + old(b)));
}

/// Sets the limit points of curves, `w a + (1 − 2w) v + w b`, of corners, and under schemes with rules for stars those of
/// darts and of all that is semi-sharp: by their rows, O(faces of a star) each.
pub(super) fn set_limits(limits: &mut [DVec3], surface: &Surface, w: f64, rule: Option<StarRule>) {
    let Some(features) = surface.features() else { return };
    let points = surface.positions();
    set_vertices(limits, |v| points[v], features, w);
    let Some(rule) = rule else { return };
    let darts = features.with_rule(Rule::Dart);
    for v in darts.into_iter().chain(features.at_semi_sharp(surface).into_iter().map(|v| v as usize)) {
        let star = StarOf::new(surface, features, v);
        let row = star.star.row(rule);
        // As seen from the vertex: the row sums to 1.
        let moved = star.entries(&row).map(|(j, a)| a * (points[j as usize] - points[v]));
        limits[v] = points[v] + moved.sum::<DVec3>();
    }
}

/// The polygons of sharp edges, each with one point more beyond an end that is no crease vertex: mirrored at it.
pub(super) struct Polygons<'a> {
    points: &'a [DVec3],
    /// Crease vertices, ascending, with their neighbours along the curve.
    creases: Vec<(usize, [usize; 2])>,
}

impl<'a> Polygons<'a> {
    /// O(k log k) for k crease vertices.
    pub(super) fn new(points: &'a [DVec3], features: &Features) -> Self {
        let mut creases = Vec::new();
        features.for_each_crease(|v, ends| creases.push((v, ends)));
        creases.par_sort_unstable();
        Polygons { points, creases }
    }

    /// The four points about the sharp edge from `a` to `b`, in order.
    pub(super) fn about(&self, [a, b]: [usize; 2]) -> [DVec3; 4] {
        [self.beyond(b, a), self.points[a], self.points[b], self.beyond(a, b)]
    }

    /// The point that follows on `v`, coming from `from`.
    pub(super) fn beyond(&self, from: usize, v: usize) -> DVec3 {
        match self.creases.binary_search_by_key(&v, |crease| crease.0) {
            Ok(place) => {
                let [a, b] = self.creases[place].1;
                self.points[if a == from { b } else { a }]
            }
            Err(_) => 2.0 * self.points[v] - self.points[from],
        }
    }
}

/// The vertex that is put across sharp side xy of a triangle xyz, where there is nothing, or another surface: x + y − z.
pub(super) fn mirrored(surface: &Surface, c: u32) -> DVec3 {
    let corners = surface.faces().corners();
    let at = |c: usize| surface.positions()[corners[c] as usize];
    at(c as usize) + at(next_in_triangle(c)) - at(prev_in_triangle(c))
}

/// The weights of a tangent across the boundary at a vertex of m faces there: of its m + 1 edge neighbours, and of the
/// opposite corners of its m faces. That of the vertex itself makes their sum 0.
pub(super) struct Across {
    pub(super) edges: Vec<f64>,
    pub(super) faces: Vec<f64>,
}

/// The weights of the tangent across the boundary at a vertex of `m` triangles there, under a scheme of triangles whose step (or
/// two of them) has the left eigenvector sin jθ on the inner neighbours e_1 … e_{m−1}, θ = π/m, and `end(θ, Σ sin jθ)` on e_0
/// and e_m. With one triangle it is e_0 + e_1 − 2v. `None` from six on: the limit normals of its faces differ.
pub(super) fn across_boundary_of_triangles(m: usize, end: impl Fn(f64, f64) -> f64) -> Option<Across> {
    match m {
        1 => return Some(Across { edges: vec![1.0; 2], faces: Vec::new() }),
        2..=5 => {}
        _ => return None,
    }
    let theta = PI / m as f64;
    let mut edges: Vec<f64> = (0..=m).map(|j| (theta * j as f64).sin()).collect();
    let end = end(theta, edges[1..m].iter().sum());
    (edges[0], edges[m]) = (end, end);
    Some(Across { edges, faces: Vec::new() })
}

/// Sets the tangents of all vertices that are not smooth: of boundary vertices with one sector of m faces along the boundary,
/// e_0 − e_m, and across it by `across(m)`; of a corner with one face, along its two sides; none of others. `opposite(c, v)`
/// is the opposite corner of the face of corner c of v, as seen from v, where it is part of the mask.
pub(super) fn set_tangents(
    tangents: &mut [Tangents],
    surface: &Surface,
    across: impl Fn(usize) -> Option<Across>,
    opposite: impl Fn(u32, usize) -> DVec3,
) {
    let Some(features) = surface.features() else { return };
    let (faces, topology, points) = (surface.faces(), surface.topology(), surface.positions());
    let mut masks: Vec<Option<Option<Across>>> = Vec::new();
    let semi_sharp = features.at_semi_sharp(surface);
    let mut star = Vec::new();
    for v in (0..surface.len()).filter(|&v| !features.is_smooth(v)) {
        let mut pair = Tangents::default();
        let is_boundary = !topology.star(faces, v, &mut star);
        let m = star.len();
        let seen = |c: u32| points[faces.corners()[c as usize] as usize] - points[v];
        let edge = |j: usize| match star.get(j) {
            Some(&c) => seen(topology.incidence.next(faces, c)),
            None => seen(topology.incidence.prev(faces, star[m - 1])),
        };
        match features.rules()[v] {
            // What is semi-sharp there has part in the tangent across.
            Rule::Crease if is_boundary && semi_sharp.binary_search(&(v as u32)).is_err() => {
                if masks.len() <= m {
                    masks.resize_with(m + 1, || None);
                }
                if let Some(mask) = masks[m].get_or_insert_with(|| across(m)) {
                    pair.add(DVec2::new(1.0, mask.edges[0]), edge(0));
                    pair.add(DVec2::new(-1.0, mask.edges[m]), edge(m));
                    (1..m).for_each(|j| pair.add(DVec2::new(0.0, mask.edges[j]), edge(j)));
                    for (&c, &weight) in star.iter().zip(&mask.faces) {
                        pair.add(DVec2::new(0.0, weight), opposite(c, v));
                    }
                }
            }
            Rule::Corner if is_boundary && m == 1 => {
                pair.add(DVec2::X, edge(0));
                pair.add(DVec2::Y, edge(1));
            }
            Rule::Crease | Rule::Corner | Rule::Dart | Rule::SemiSharp | Rule::Smooth => {}
        }
        tangents[v] = pair;
    }
}
