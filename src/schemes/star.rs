//! What the schemes share: what a mesh must be, edge numbers, sums over vertex stars, harmonics of a ring.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::mesh::features::Rule;
use crate::mesh::frame::magnitude;
use crate::mesh::incidence::split_rows;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Incidence, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel::{self, find_first};
use crate::{Error, Result};

/// Vertices, edges or faces of one task.
pub(super) const CHUNK: usize = 1024;
/// A normal shorter than this, relative to the reach of its star squared, is rounding: some tens of ε.
const DEGENERATE: f64 = 1e-14;

/// Refuses a boundary that is treated as interior: around its vertices there are no whole faces, and it has no rules of its
/// own.
pub(crate) fn require_rules(surface: &Surface) -> Result<()> {
    match surface.features() {
        None if !surface.is_closed() => Err(Error::Open { edges: surface.boundary_edges(), scheme: "subdivision" }),
        _ => Ok(()),
    }
}

/// Refuses what Chaikin's curves have no rule for: a boundary that is treated as interior, darts, and all that is semi-sharp.
pub(crate) fn require_curves(surface: &Surface, scheme: &'static str) -> Result<()> {
    require_rules(surface)?;
    require_no_semi_sharp(surface, scheme)?;
    require_no_dart(surface, scheme)
}

/// Refuses semi-sharp edges and vertices, naming the first vertex there.
pub(crate) fn require_no_semi_sharp(surface: &Surface, scheme: &'static str) -> Result<()> {
    match surface.features().and_then(|features| features.at_semi_sharp(surface).first().copied()) {
        Some(v) => Err(Error::SemiSharp { vertex: v as usize, scheme }),
        None => Ok(()),
    }
}

/// Refuses darts, naming the first.
pub(crate) fn require_no_dart(surface: &Surface, scheme: &'static str) -> Result<()> {
    match surface.features().and_then(|features| features.with_rule(Rule::Dart).first().copied()) {
        Some(vertex) => Err(Error::dart(vertex, scheme)),
        None => Ok(()),
    }
}

/// Refuses a mesh with a face that is no triangle, naming the first such face, and a boundary without rules.
pub(crate) fn require_triangles(surface: &Surface, scheme: &'static str) -> Result<()> {
    require_rules(surface)?;
    let faces = surface.faces();
    match find_first(faces.len(), |f| faces.range(f).len() != 3) {
        Some(face) => Err(Error::NotTriangles { face, corners: faces.face(face).len(), scheme }),
        None => Ok(()),
    }
}

/// Refuses two triangles with the same corners, which a valid mesh has only beside a part with a boundary.
pub(crate) fn require_no_pillow(surface: &Surface) -> Result<()> {
    if surface.is_closed() {
        return Ok(());
    }
    let (topology, incidence) = (surface.topology(), surface.incidence());
    let is_inside = |&c: &u32| topology.twin(c).is_some() && topology.twin(prev_in_triangle(c) as u32).is_some();
    let has_two = |v: usize| incidence.face_count(v) == 2 && incidence.corners_at(v).iter().all(is_inside);
    match find_first(surface.len(), has_two) {
        Some(v) => refuse(format!("vertex {v} has two triangles with the same corners; remove them")),
        None => Ok(()),
    }
}

/// Refuses a result of `factor` corners per old corner that 32-bit indices cannot number. A result has
/// fewer vertices than corners.
pub(crate) fn require_room(mesh: &Mesh, factor: usize) -> Result<()> {
    let corners = factor * mesh.faces.corners().len();
    if corners < NONE as usize {
        return Ok(());
    }
    Err(Error::TooLarge { what: format!("a further refinement has {corners} corners"), advice: "refine less often" })
}

pub(crate) fn refuse<T>(what: String) -> Result<T> {
    Err(Error::mesh("mesh", what))
}

/// The opposite half-edge in a closed mesh.
pub(crate) fn twin(topology: &Topology, c: u32) -> u32 {
    topology.twin(c).expect("a closed mesh has every twin")
}

/// The opposite half-edge; on a boundary the same.
pub(crate) fn across(topology: &Topology, c: u32) -> u32 {
    topology.twin(c).unwrap_or(c)
}

/// The sides (v, next v) of a face.
pub(crate) fn sides(face: &[u32]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let next = face.iter().cycle().skip(1);
    face.iter().zip(next).map(|(&v, &w)| (v as usize, w as usize))
}

/// The mean of the corners of a face.
pub(crate) fn centroid(positions: &[DVec3], face: &[u32]) -> DVec3 {
    let sum: DVec3 = face.iter().map(|&v| positions[v as usize]).sum();
    sum / face.len() as f64
}

/// `mask(n)` for every valence up to the largest of the mesh.
pub(crate) fn by_valence<T>(incidence: &Incidence, mask: impl Fn(usize) -> T) -> Vec<T> {
    let largest =
        parallel::map(incidence.vertices(), CHUNK, |range| range.map(|v| incidence.face_count(v)).max().unwrap_or(0));
    (0..=largest.into_iter().max().unwrap_or(0)).map(mask).collect()
}

/// `mask(n) = [a, b]` at every vertex of a closed mesh: a times the vertex plus b times the sum of its n
/// neighbours.
pub(crate) fn blend_with_neighbors(surface: &Surface, mask: impl Fn(usize) -> [f64; 2]) -> Vec<DVec3> {
    let mut points = Vec::new();
    push_blends(&mut points, surface, mask);
    points
}

/// Appends the points of [`blend_with_neighbors`].
pub(crate) fn push_blends(points: &mut Vec<DVec3>, surface: &Surface, mask: impl Fn(usize) -> [f64; 2]) {
    let (mesh, incidence) = (surface.mesh(), surface.incidence());
    let masks = by_valence(incidence, mask);
    parallel::extend(points, mesh.len(), |_| {
        |v| {
            let (n, sum) = neighbor_sum(mesh, incidence, v);
            let [a, b] = masks[n];
            a * mesh.positions[v] + b * sum
        }
    });
}

/// The number of neighbours of vertex `v` of a closed mesh, and their sum.
#[inline]
pub(crate) fn neighbor_sum(mesh: &Mesh, incidence: &Incidence, v: usize) -> (usize, DVec3) {
    let star = incidence.corners_at(v);
    let mut sum = DVec3::ZERO;
    for &c in star {
        let w = mesh.faces.corners()[incidence.next(&mesh.faces, c) as usize];
        sum += mesh.positions[w as usize];
    }
    (star.len(), sum)
}

/// The corners at each vertex in counter-clockwise order, one vertex after the other as in the incidence.
pub(crate) fn stars(surface: &Surface) -> Vec<u32> {
    let mesh = surface.mesh();
    let mut stars = large(vec![0; mesh.faces.corners().len()]);
    put_stars(surface, &mut stars);
    stars
}

/// As [`stars`], into memory that is there already.
pub(crate) fn put_stars(surface: &Surface, stars: &mut [u32]) {
    match surface.renumbered() {
        None => put(surface.faces(), surface.topology(), stars),
        Some(inside) => {
            let mut near = large(vec![0; stars.len()]);
            put(&inside.faces, inside.topology(), &mut near);
            let (_, moved) = inside.of_vertices(surface.faces(), &near);
            parallel::fill(stars, |k| moved[k]);
        }
    }
}

fn put(faces: &Faces, topology: &Topology, stars: &mut [u32]) {
    parallel::parts(split_rows(topology.incidence.offsets(), CHUNK, stars), |range, mut part| {
        let mut star = Vec::new();
        for v in range {
            topology.star(faces, v, &mut star);
            let (here, rest) = part.split_at_mut(star.len());
            here.copy_from_slice(&star);
            part = rest;
        }
    });
}

/// Calls `visit(v, corners)` for every vertex with its corners in counter-clockwise order.
pub(crate) fn for_each_star(surface: &Surface, mut visit: impl FnMut(usize, &[u32])) {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let mut star = Vec::new();
    for v in 0..mesh.len() {
        topology.star(&mesh.faces, v, &mut star);
        visit(v, &star);
    }
}

/// The points (cos, sin)(2πj/n) of the unit circle: kept for small n, and for the last large one.
#[derive(Default)]
pub(crate) struct Circle {
    small: Vec<Vec<DVec2>>,
    large: Vec<DVec2>,
}

impl Circle {
    const SMALL: usize = 32;

    pub(crate) fn of(&mut self, n: usize) -> &[DVec2] {
        let points = if n < Self::SMALL {
            self.small.resize(Self::SMALL, Vec::new());
            &mut self.small[n]
        } else {
            &mut self.large
        };
        if points.len() != n {
            let step = TAU / n as f64;
            points.clear();
            points.extend((0..n).map(|j| DVec2::from_angle(step * j as f64)));
        }
        points
    }
}

/// The harmonics 0, 1 and 2 of the points of a ring, divided by their number n: a circulant mask of these harmonics
/// is applied to the whole ring in O(n).
pub(crate) struct Harmonics {
    mean: DVec3,
    once: [DVec3; 2],
    twice: [DVec3; 2],
}

impl Harmonics {
    /// Of points at every `stride`-th place of `circle`.
    pub(crate) fn of(ring: impl ExactSizeIterator<Item = DVec3>, circle: &[DVec2], stride: usize) -> Self {
        let share = 1.0 / ring.len() as f64;
        let mut found = Harmonics { mean: DVec3::ZERO, once: [DVec3::ZERO; 2], twice: [DVec3::ZERO; 2] };
        for (j, point) in ring.enumerate() {
            let point = share * point;
            let [once, twice] = places(circle, stride * j);
            found.mean += point;
            found.once[0] += once.x * point;
            found.once[1] += once.y * point;
            found.twice[0] += twice.x * point;
            found.twice[1] += twice.y * point;
        }
        found
    }

    /// The blend with these amplitudes, symmetric about `place` of the circle.
    pub(crate) fn at(&self, circle: &[DVec2], place: usize, amplitudes: [f64; 3]) -> DVec3 {
        let [once, twice] = places(circle, place);
        amplitudes[0] * self.mean
            + amplitudes[1] * (once.x * self.once[0] + once.y * self.once[1])
            + amplitudes[2] * (twice.x * self.twice[0] + twice.y * self.twice[1])
    }
}

/// A place on the circle, and that of twice its angle.
fn places(circle: &[DVec2], place: usize) -> [DVec2; 2] {
    [circle[place], circle[2 * place % circle.len()]]
}

/// Two vectors that span the tangent plane of a limit surface at a point: the tangent masks (left eigenvectors
/// of the subdominant eigenvalue) applied to the control points, cosine first. Their lengths have no meaning
/// beyond the mask's own scale; on a regular star they are perpendicular and of the same length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tangents {
    /// The tangent by the cosine mask.
    pub cosine: DVec3,
    /// The tangent by the sine mask, a quarter turn counter-clockwise from the other on a regular star.
    pub sine: DVec3,
    /// Σ |weight|·|vector|: what the tangents would measure without cancellation.
    reach: f64,
}

impl Tangents {
    /// Adds a control point, given from the star's centre, with the weights of the two masks.
    pub(crate) fn add(&mut self, weights: DVec2, vector: DVec3) {
        self.cosine += weights.x * vector;
        self.sine += weights.y * vector;
        self.reach += weights.length() * vector.length();
    }

    /// Those of a ring in counter-clockwise order about the origin: (cos, sin)(2πj/n) on its points.
    pub(crate) fn of_ring(ring: &[DVec3]) -> Self {
        let step = TAU / ring.len() as f64;
        let mut pair = Tangents::default();
        for (j, &point) in ring.iter().enumerate() {
            pair.add(DVec2::from_angle(step * j as f64), point);
        }
        pair
    }

    /// The unit normal `cosine × sine`: outward where faces are counter-clockwise seen from outside. The zero
    /// vector where the tangents are parallel up to rounding, so that no tangent plane is defined (a star in
    /// one line or point, valence 2).
    pub fn normal(&self) -> DVec3 {
        // A small star on a large mesh: its reach to the fourth power may vanish.
        let unit = magnitude(self.reach);
        let cross = (self.cosine / unit).cross(self.sine / unit);
        let length = cross.length();
        let reach = self.reach / unit;
        if length > DEGENERATE * reach * reach { cross / length } else { DVec3::ZERO }
    }
}

/// The tangents of schemes whose tangent mask is (cos, sin)(2πj/n) on the neighbours in counter-clockwise
/// order: Loop, √3 and mid-edge.
pub(crate) fn ring_tangents(surface: &Surface) -> Vec<Tangents> {
    let (mesh, incidence) = (surface.mesh(), surface.incidence());
    let mut tangents = Vec::with_capacity(mesh.len());
    let mut circle = Circle::default();
    for_each_star(surface, |v, star| {
        let mut pair = Tangents::default();
        for (&c, &weights) in star.iter().zip(circle.of(star.len())) {
            let w = mesh.faces.corners()[incidence.next(&mesh.faces, c) as usize];
            pair.add(weights, mesh.positions[w as usize] - mesh.positions[v]);
        }
        tangents.push(pair);
    });
    tangents
}

/// The corner after `c` in a mesh of triangles.
pub(crate) fn next_in_triangle(c: u32) -> usize {
    let c = c as usize;
    if c % 3 == 2 { c - 2 } else { c + 1 }
}

/// The corner before `c` in a mesh of triangles: the one opposite to half-edge `next(c)`.
pub(crate) fn prev_in_triangle(c: u32) -> usize {
    let c = c as usize;
    if c.is_multiple_of(3) { c + 2 } else { c - 1 }
}
