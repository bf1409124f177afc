//! Chaikin's corner cutting (Chaikin 1974) along the sharp edges of open and creased meshes, and what closes the surface of a
//! dual refinement to its points.
//!
//! Every sharp edge (a, b) has the points ¾a + ¼b and ¼a + ¾b, which both of its sides share; a vertex that is a corner stays.
//! Curves are quadratic B-splines of their polygons, straight from a corner to the middle of its first edge. At the middle of
//! the two points of a crease vertex v with the neighbours a and b they pass through (a + 6v + b)/8.
//!
//! Inside an open mesh a vertex may have two faces only. Its face of type V would have two corners W₁ and W₂: it gets two more,
//! ½(W₁ + W₂) ± d, towards its two edges, so that the centroid, the limit point, stays. The quads of these edges are divided
//! there, so that all further vertices have three faces or more.

use glam::{DVec2, DVec3};

use super::doo_sabin::{CornerRule, corner_points, face_points};
use super::refined::{push_ends, set_by_edge, set_rows};
use super::star::{CHUNK, Circle, Tangents, across, require_room, stars};
use crate::Result;
use crate::mesh::features::{Features, Rule, SHARP, Tags};
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// The most corners that a step makes of one: one in its own face, 4 in the quad of its edge, 5 about its vertex.
const MOST: usize = 10;

/// How a step numbers its vertices: C of old corners, in their order; two of every sharp edge, in the order of
/// [`Features::sharp_half_edges`], that nearer to the start of the half-edge first; the old vertices that are corners,
/// ascending; two of each vertex with two faces only and no sharp edge, by its corners, on the edges that leave these.
struct Step<'a> {
    surface: &'a Surface,
    features: &'a Features,
    /// C.
    corners: u32,
    resting: Vec<usize>,
    /// The vertices with two faces only, and no sharp edge.
    narrow: Vec<usize>,
}

impl<'a> Step<'a> {
    fn new(surface: &'a Surface, features: &'a Features) -> Self {
        let corners = surface.faces().corners().len() as u32;
        let resting = features.with_rule(Rule::Corner);
        let mut step = Step { surface, features, corners, resting, narrow: Vec::new() };
        let (faces, incidence) = (surface.faces(), surface.incidence());
        let is_sharp = |c: u32| step.on_edge(c).is_some();
        let is_narrow = |v: &usize| match *incidence.corners_at(*v) {
            [c, d] => ![c, d, incidence.prev(faces, c), incidence.prev(faces, d)].into_iter().any(is_sharp),
            _ => false,
        };
        step.narrow = parallel::flat_map(surface.len(), CHUNK, |range| range.filter(is_narrow).collect());
        step
    }

    /// The number of the first point of a corner that rests.
    fn first_resting(&self) -> usize {
        self.corners as usize + 2 * self.features.sharp_half_edges().len()
    }

    /// Half-edge `c` from its start to its end.
    fn ends(&self, c: u32) -> [DVec3; 2] {
        let (faces, points) = (self.surface.faces(), self.surface.positions());
        [c, self.surface.incidence().next(faces, c)].map(|c| points[faces.corners()[c as usize] as usize])
    }

    fn positions(&self, rule: CornerRule) -> Vec<DVec3> {
        let mut positions = corner_points(self.surface.mesh(), rule);
        positions.extend(self.features.sharp_half_edges().iter().flat_map(|&c| {
            let [a, b] = self.ends(c);
            [0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b]
        }));
        positions.extend(self.resting.iter().map(|&v| self.surface.positions()[v]));
        let incidence = self.surface.incidence();
        for &v in &self.narrow {
            // The middles of the other ends of the quads of both edges.
            let at = incidence.corners_at(v);
            let far = |c: u32| {
                let [next, twin] = self.far_corners(c);
                0.5 * (positions[next as usize] + positions[twin as usize])
            };
            let towards = 0.125 * (far(at[0]) - far(at[1]));
            let middle = 0.5 * (positions[at[0] as usize] + positions[at[1] as usize]);
            positions.extend([middle + towards, middle - towards]);
        }
        positions
    }

    /// The corners at the end of half-edge `c`, in its face and in the other one.
    fn far_corners(&self, c: u32) -> [u32; 2] {
        [self.surface.incidence().next(self.surface.faces(), c), across(self.surface.topology(), c)]
    }

    /// Of a vertex with two faces only, the point on the edge of the half-edge `c` that leaves it.
    fn in_narrow(&self, c: u32) -> Option<u32> {
        let v = self.surface.faces().corners()[c as usize] as usize;
        let k = self.narrow.binary_search(&v).ok()?;
        let second = usize::from(self.surface.incidence().corners_at(v)[0] != c);
        Some((self.first_resting() + self.resting.len() + 2 * k + second) as u32)
    }

    /// The two points on the edge of half-edge `c` in its direction, if it is sharp.
    fn on_edge(&self, c: u32) -> Option<[u32; 2]> {
        let first = c.min(across(self.surface.topology(), c));
        let k = self.features.sharp_half_edges().binary_search(&first).ok()? as u32;
        let [a, b] = [self.corners + 2 * k, self.corners + 2 * k + 1];
        Some(if first == c { [a, b] } else { [b, a] })
    }

    fn is_on_curve(&self, point: u32) -> bool {
        (self.corners..self.first_resting() as u32).contains(&point)
    }

    /// The points about a vertex, counter-clockwise: of its corners, and between them of sharp edges; on a boundary from one
    /// side to the other, else from a sharp edge on, if there is one, and back to the first. Whether it is the latter.
    fn ring(&self, v: usize, star: &mut Vec<u32>, ring: &mut Vec<u32>) -> bool {
        let (faces, topology) = (self.surface.faces(), self.surface.topology());
        let closed = topology.star(faces, v, star);
        if closed {
            let place = star.iter().position(|&c| self.on_edge(c).is_some()).unwrap_or(0);
            star.rotate_left(place);
        }
        ring.clear();
        for &c in star.iter() {
            ring.extend(self.on_edge(c).map(|[near, _]| near).or_else(|| self.in_narrow(c)));
            ring.push(c);
        }
        match star.last() {
            Some(&last) if !closed => ring.extend(self.on_edge(topology.incidence.prev(faces, last)).map(|e| e[1])),
            _ => ring.extend_from_within(..1),
        }
        closed
    }

    /// Calls `visit` with the faces about a vertex, one between each two sharp edges. At a corner they have
    /// the vertex itself as their last; one inside the surface with less than three sharp edges has a triangle for each two
    /// points about it, so that no face meets itself and the vertex has three of them or more.
    fn faces_about(&self, v: usize, star: &mut Vec<u32>, ring: &mut Vec<u32>, mut visit: impl FnMut(&[u32])) {
        let closed = self.ring(v, star, ring);
        let place = self.resting.binary_search(&v).ok();
        let own = place.map(|k| (self.first_resting() + k) as u32);
        let sharp = ring[1..].iter().filter(|&&point| self.is_on_curve(point)).count();
        if own.is_none() && sharp == 0 {
            return visit(&ring[1..]);
        }
        let is_fan = own.is_some() && closed && sharp < 3;
        let mut face = Vec::new();
        let mut begin = 0;
        for end in 1..ring.len() {
            if is_fan || self.is_on_curve(ring[end]) {
                face.clear();
                face.extend_from_slice(&ring[begin..=end]);
                face.extend(own);
                visit(&face);
                begin = end;
            }
        }
    }
}

/// One step of a mesh with sharp edges and vertices.
///
/// Vertices: as [`Step`] numbers them. Faces: type F, one for each old face, its corners in order; type E, a quad for each edge
/// in order of its first half-edge, in that one's face if it is sharp, and then one in the other face of every crease; type V,
/// one for each old vertex; then the further ones of the edges at vertices with two faces only, and of the vertices with several.
/// O(corners), the faces of type V by one thread.
///
/// # Errors
/// [`Error::TooLarge`](crate::Error::TooLarge).
pub(super) fn refine(rule: CornerRule, surface: &Surface, features: &Features) -> Result<Mesh> {
    let (faces, topology) = (surface.faces(), surface.topology());
    require_room(surface.mesh(), MOST)?;
    let step = Step::new(surface, features);
    let (count, incidence) = (faces.corners().len(), &topology.incidence);
    let next = |c| incidence.next(faces, c);
    let quads = topology.edges() + features.creased_edges();
    let mut corners = large(vec![0; count + 4 * quads]);
    let (of_faces, of_edges) = corners.split_at_mut(count);
    let (of_edges, of_second_sides) = of_edges.as_chunks_mut::<4>().0.split_at_mut(topology.edges());
    set_rows(of_faces, |c| [c]);
    set_by_edge(of_edges.as_flattened_mut(), topology, |c| {
        let t = across(topology, c);
        [next(c), c, next(t), t]
    });
    let edges = topology.edge_numbers();
    let mut second_sides = of_second_sides.iter_mut();
    for (k, &c) in features.sharp_half_edges().iter().enumerate() {
        let [a, b] = [0, 1].map(|i| (count + 2 * k + i) as u32);
        of_edges[edges.of(c) as usize] = [next(c), c, a, b];
        if let Some((t, quad)) = topology.twin(c).and_then(|t| Some((t, second_sides.next()?))) {
            *quad = [next(t), t, b, a];
        }
    }
    let mut further = Faces::default();
    for c in step.narrow.iter().flat_map(|&v| incidence.corners_at(v).iter().copied()) {
        let t = across(topology, c);
        let (Some(near), far) = (step.in_narrow(c), step.in_narrow(t)) else { continue };
        if far.is_none() || c < t {
            of_edges[edges.of(c) as usize] = [next(t), t, far.unwrap_or(next(c)), near];
            further.push(&[&[next(c), c, near][..], far.as_slice()].concat());
        }
    }

    let mut offsets = large(Vec::with_capacity(faces.len() + quads + surface.len() + 1));
    offsets.push(0);
    offsets.extend((0..faces.len()).map(|f| faces.range(f).end as u32));
    push_ends(&mut offsets, count, 4, quads);
    let around = stars(surface);
    let (mut star, mut ring) = (Vec::new(), Vec::new());
    for (v, range) in incidence.offsets().windows(2).enumerate() {
        if features.is_smooth(v) && range[1] - range[0] > 2 {
            corners.extend_from_slice(&around[range[0] as usize..range[1] as usize]);
        } else {
            let mut is_first = true;
            step.faces_about(v, &mut star, &mut ring, |face| match std::mem::replace(&mut is_first, false) {
                true => corners.extend_from_slice(face),
                false => further.push(face),
            });
        }
        offsets.push(corners.len() as u32);
    }
    for face in further.iter() {
        corners.extend_from_slice(face);
        offsets.push(corners.len() as u32);
    }
    Ok(Mesh::new(step.positions(rule), Faces::from_parts(offsets, corners)))
}

/// The features of what [`refine`] made of a mesh with features: edges between two points of curves are sharp, and old corners
/// rest. O(N), and O(k log k) for k sharp edges.
///
/// # Errors
/// None that a step could cause.
pub(super) fn refined_features(surface: &Surface, refined: &Mesh, topology: &Topology) -> Result<Option<Features>> {
    let Some(features) = surface.features() else { return Ok(None) };
    let (incidence, corners) = (&topology.incidence, refined.faces.corners());
    let first = surface.faces().corners().len() as u32;
    let first_resting = first + 2 * features.sharp_half_edges().len() as u32;
    let of_curves = first..first_resting + features.count(Rule::Corner) as u32;
    let leaving = of_curves.clone().flat_map(|v| {
        let ends = incidence.corners_at(v as usize).iter();
        ends.map(move |&c| [v, corners[incidence.next(&refined.faces, c) as usize]])
    });
    let tags = Tags {
        boundary: surface.boundary(),
        creases: leaving.filter(|ends| of_curves.contains(&ends[1])).map(|ends| (ends, SHARP)).collect(),
        corners: (first_resting..of_curves.end).map(|v| (v, SHARP)).collect(),
    };
    Features::new(&refined.faces, incidence, topology.boundary_half_edges(), &tags)
}

/// Calls `set(v, tangents)` for every vertex that is not smooth, where the first step is by `first` and all others by `then`.
///
/// After a step all faces along a boundary are quads, and after each further one the surface there is that of the points of
/// the curve and of the next row: across the boundary straight, as from a corner of a curve to the middle of its first edge. So
/// its tangents at a boundary vertex are along the curve, and from there to the middle of the next row; at a corner with one
/// face then, along both curves. The others, with several sectors, have none.
pub(super) fn for_each_tangents(
    surface: &Surface,
    features: &Features,
    (first, then): (CornerRule, CornerRule),
    mut set: impl FnMut(usize, Tangents),
) {
    let step = Step::new(surface, features);
    let points = step.positions(first);
    let mut circle = Circle::default();
    let (mut star, mut ring) = (Vec::new(), Vec::new());
    for v in (0..surface.len()).filter(|&v| !features.is_smooth(v)) {
        let mut pair = Tangents::default();
        let closed = step.ring(v, &mut star, &mut ring);
        let n = ring.len();
        if !closed && !ring[1..n - 1].iter().any(|&point| step.is_on_curve(point)) {
            let [start, end] = [ring[0], ring[n - 1]].map(|point| points[point as usize]);
            match features.rules()[v] {
                Rule::Corner => {
                    pair.add(DVec2::X, start - surface.positions()[v]);
                    pair.add(DVec2::Y, end - surface.positions()[v]);
                }
                Rule::Crease | Rule::Smooth | Rule::Dart | Rule::SemiSharp => {
                    let mut row = vec![DVec3::ZERO; n];
                    face_points(&points, &ring, circle.of(n), then, &mut row);
                    pair.add(DVec2::X, start - end);
                    pair.add(DVec2::Y, 0.5 * (row[0] + row[n - 1]) - 0.5 * (start + end));
                }
            }
        }
        set(v, pair);
    }
}
