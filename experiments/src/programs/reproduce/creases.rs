//! Creased meshes of our own, and three ways to give an interpolating surface a crease.

use glam::DVec3;

use limitlab::Result;
use limitlab::interpolate::{Options, interpolate, limit_points};
use limitlab::mesh::features::{SHARP, Tags};
use limitlab::mesh::{Mesh, Surface, builtin, generate};
use limitlab::schemes::{Refinement, Scheme};

const CC: Scheme = Scheme::CatmullClark;

/// The edges of a closed walk, all of one sharpness.
pub fn closed_loop(vertices: impl IntoIterator<Item = u32>, sharpness: f64) -> Vec<([u32; 2], f64)> {
    let vertices: Vec<u32> = vertices.into_iter().collect();
    let next = vertices.iter().cycle().skip(1);
    vertices.iter().zip(next).map(|(&a, &b)| ([a, b], sharpness)).collect()
}

/// The `j`-th loop around the axis of a torus of `n` × `m` vertices.
pub fn torus_loop(n: u32, m: u32, j: u32) -> impl Iterator<Item = u32> {
    (0..n).map(move |i| i * m + j)
}

/// A tube of `n` rings of `m` vertices about a trefoil: faces and numbers are those of the torus.
pub fn knot(n: usize, m: usize) -> Mesh {
    use std::f64::consts::TAU;
    const RADIUS: f64 = 0.45;
    let centre = |t: f64| {
        let around = 2.0 + (3.0 * t).cos();
        DVec3::new(around * (2.0 * t).cos(), around * (2.0 * t).sin(), (3.0 * t).sin())
    };
    let mut points = Vec::with_capacity(n * m);
    for i in 0..n {
        let t = TAU * i as f64 / n as f64;
        let along = (centre(t + 1e-4) - centre(t - 1e-4)).normalize();
        // The trefoil lies on a torus, whose normal is across it.
        let out = DVec3::new((3.0 * t).cos() * (2.0 * t).cos(), (3.0 * t).cos() * (2.0 * t).sin(), (3.0 * t).sin());
        let beside = along.cross(out);
        points.extend((0..m).map(|j| {
            let (sin, cos) = (TAU * j as f64 / m as f64).sin_cos();
            centre(t) + RADIUS * (cos * out + sin * beside)
        }));
    }
    Mesh::new(points, builtin::torus(n, m).faces)
}

/// The cube of edge 2 with its edges and faces split at their middles: 26 vertices, 24 quads.
pub fn split_cube() -> Mesh {
    generate::quad_split(&builtin::cube())
}

/// The edges of [`split_cube`] that run around its lower and its upper face.
pub fn rims(sharpness: f64) -> Vec<([u32; 2], f64)> {
    let Mesh { positions, faces } = split_cube();
    let on_rim = |v: u32, height: f64| {
        let p = positions[v as usize];
        p.z == height && p.x.abs().max(p.y.abs()) == 1.0
    };
    let sides = faces.iter().flat_map(|face| (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]]));
    let is_rim = |&[a, b]: &[u32; 2]| a < b && [-1.0, 1.0].iter().any(|&z| on_rim(a, z) && on_rim(b, z));
    sides.filter(is_rim).map(|edge| (edge, sharpness)).collect()
}

/// How the vertices of a crease are treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crease {
    /// They keep their points and rest in every refinement.
    Resting,
    /// They keep their points; refinement averages them along the crease.
    Averaged,
    /// They are solved for along the crease, the others after them.
    Solved,
}

impl Crease {
    pub const ALL: [Crease; 3] = [Crease::Resting, Crease::Averaged, Crease::Solved];

    /// The control mesh whose Catmull-Clark surface meets the points of the smooth vertices.
    ///
    /// # Errors
    /// Those of [`interpolate`].
    pub fn control(self, closed: &Surface, tags: &Tags) -> Result<Surface> {
        let mut free = vec![true; closed.len()];
        let mut tags = tags.clone();
        for end in tags.creases.iter().flat_map(|crease| crease.0) {
            free[end as usize] = false;
        }
        if self == Crease::Resting {
            tags.corners.extend((0..closed.len() as u32).filter(|&v| !free[v as usize]).map(|v| (v, SHARP)));
        }
        let surface = closed.tagged(&tags)?;
        let interpolated = if self == Crease::Averaged { Some(free.as_slice()) } else { None };
        let found = interpolate(&surface, CC, &Options { interpolated, ..Options::default() })?;
        Ok(surface.with_positions(found.points))
    }
}

/// What is seen of a crease of a control mesh, the largest at any of its vertices.
pub struct Artifacts {
    /// The distance of the limit point from the given one.
    pub gap: f64,
    /// The angle, in degrees, by which the limit curve turns at a vertex.
    pub turn: f64,
    /// The angle, in degrees, between neighbouring facets at a vertex on the same side of the crease.
    pub jump: f64,
}

impl Artifacts {
    /// Of Catmull-Clark surfaces after `levels` refinements, where a smooth surface has turned by little.
    ///
    /// # Errors
    /// Those of the refinement.
    pub fn new(control: &Surface, points: &[DVec3], levels: usize) -> Result<Self> {
        let gaps = limit_points(control, CC)?;
        let fine = Refinement::CatmullClark.refined_n(control, levels)?;
        let limits = Refinement::CatmullClark.limit_positions(&fine)?;
        let (faces, topology) = (fine.faces(), fine.topology());
        let corners = faces.corners();
        let normal = |c: u32| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| limits[faces.face(topology.incidence.face_of(c))[k] as usize]);
            (c - a).cross(d - b)
        };
        let mut found = Artifacts { gap: 0.0, turn: 0.0, jump: 0.0 };
        for v in 0..control.len() {
            let here = limits[v];
            let mut along = Vec::new();
            let mut jumps = Vec::new();
            for &c in topology.incidence.corners_at(v) {
                let Some(twin) = topology.twin(c) else { continue };
                let end = limits[corners[topology.incidence.next(faces, c) as usize] as usize];
                if fine.features().is_some_and(|f| f.sharpness(c.min(twin)) >= SHARP) {
                    along.push(end - here);
                } else {
                    jumps.push(normal(c).angle_between(normal(twin)));
                }
            }
            if let [a, b] = along[..] {
                let jump = jumps.into_iter().fold(0.0, f64::max);
                found.gap = found.gap.max(gaps[v].distance(points[v]));
                found.turn = found.turn.max((-a).angle_between(b).to_degrees());
                found.jump = found.jump.max(jump.to_degrees());
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use limitlab::mesh::features::Rule;

    #[test]
    fn the_rims_are_two_closed_curves_of_eight_edges() {
        let cube = Surface::new(split_cube()).unwrap();
        let tagged = cube.tagged(&Tags { creases: rims(SHARP), ..Tags::default() }).unwrap();
        let features = tagged.features().unwrap();
        assert_eq!((features.count(Rule::Crease), features.creased_edges()), (16, 16));
        assert_eq!(features.curves().iter().filter(|c| c.closed && c.vertices.len() == 8).count(), 2);
    }

    #[test]
    fn the_knot_is_a_tube_along_which_loops_run() {
        let knot = Surface::new(knot(48, 6)).unwrap();
        let sides = closed_loop(torus_loop(48, 6, 3), SHARP);
        let tagged = knot.tagged(&Tags { creases: sides, ..Tags::default() }).unwrap();
        assert_eq!(tagged.features().unwrap().curves().len(), 1);
        // No ring touches another: neighbours along and around are nearer than half the tube's width to nothing else.
        let p = knot.positions();
        let apart = |a: usize, b: usize| (a / 6).abs_diff(b / 6).min(48 - (a / 6).abs_diff(b / 6)) > 6;
        let pairs = (0..p.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let least = pairs.filter(|&(a, b)| apart(a, b)).map(|(a, b)| p[a].distance(p[b])).fold(f64::INFINITY, f64::min);
        assert!(least > 0.2, "{least}");
    }

    #[test]
    fn the_three_creases_differ_as_they_should() {
        let torus = Surface::new(builtin::torus(10, 8)).unwrap();
        let tags = Tags { creases: closed_loop(torus_loop(10, 8, 2), SHARP), ..Tags::default() };
        let found = |crease: Crease| {
            let control = crease.control(&torus, &tags).unwrap();
            Artifacts::new(&control, torus.positions(), 3).unwrap()
        };
        let [resting, averaged, solved] = Crease::ALL.map(found);
        // A regular polygon of ten sides.
        assert!((resting.turn - 36.0).abs() < 1e-9 && resting.gap == 0.0);
        // (2 + cos 36°)/3 of the radius 2 is left.
        assert!((averaged.gap - 2.0 * (1.0 - 36f64.to_radians().cos()) / 3.0).abs() < 1e-12);
        assert!(solved.gap < 1e-9 && solved.turn < resting.turn / 6.0);
    }
}
