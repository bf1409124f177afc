//! Interpolation by nearest points (Maekawa, Matsumoto & Namiki 2007, reference 1 of PIA): every control point is moved by the difference
//! between its given point and the point of the limit surface nearest to that, where PIA takes the vertex's own limit point. As PIA §1
//! and §2 and the abstract of the paper tell it; the paper itself, and with it its local adjusting, which PIA says to be needless, was
//! not at hand.
//!
//! The surface passes through the points then, but not with its vertices' limit points there: nothing holds these, and the
//! equations left are one a vertex, along the normal, for three unknowns.
//!
//! The nearest point is looked for on the control mesh refined and pushed to its limit points: down from the vertex from neighbour to
//! neighbour as long as these are nearer, then on the triangles there, which stay within a multiple of the square of their size of
//! the surface. That is its accuracy.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::Result;
use crate::mesh::Surface;
use crate::parallel;
use crate::schemes::{Class, Refinement};
use crate::solvers::{Errors, Failure, Iterate, Report, Stop, solve};

/// Refinements of the surface on which points are looked for: triangles of 1/8 of the size of the given faces.
pub const LEVELS: usize = 3;

/// What nearest points have led to.
#[derive(Clone, Debug)]
pub struct Found {
    /// The control mesh.
    pub control: Surface,
    /// For each given point the nearest one of the surface.
    pub feet: Vec<DVec3>,
    /// The unit normals of the triangles that these lie in.
    pub normals: Vec<DVec3>,
    /// How the run ended, and the distances between given points and the surface on the way.
    pub report: Report,
}

/// Iterates V ← V + P − Q(V), Q the nearest points, from V = P. A step refines three times, and takes some tens of triangles a
/// vertex. Proven is nothing: this is PIA's step but for where the surface is looked at.
///
/// # Errors
/// Those of the refinement.
///
/// # Panics
/// If the refinement is not [primal](Class::Primal).
///
/// ```
/// use limitlab::interpolate::nearest;
/// use limitlab::mesh::{Surface, builtin::builtin};
/// use limitlab::schemes::Refinement;
/// use limitlab::solvers::{Outcome, Stop};
/// let surface = Surface::new(builtin("icosahedron")?)?;
/// let stop = Stop { tolerance: 1e-6, max_iterations: 1000 };
/// let found = nearest::interpolate(&surface, Refinement::Loop, &stop)?;
/// assert_eq!(found.report.outcome, Outcome::Converged);
/// assert!(found.feet[3].distance(surface.positions()[3]) < 1e-6);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn interpolate(surface: &Surface, refinement: Refinement, stop: &Stop) -> Result<Found> {
    assert_eq!(refinement.class(), Class::Primal, "a refinement that keeps its vertices and moves them");
    // What can be refused is refused here.
    refinement.refined_n(surface, LEVELS)?;
    let points = surface.positions();
    let mut method =
        Nearest { refinement, points, control: surface.clone(), feet: vec![Foot::default(); points.len()] };
    let report = solve(&mut method, stop, &mut |_| ControlFlow::Continue(()));
    let Nearest { control, feet, .. } = method;
    let normals = feet.iter().map(|foot| foot.normal).collect();
    Ok(Found { control, feet: feet.iter().map(|foot| foot.point).collect(), normals, report })
}

/// A point of the surface, and the unit normal of its triangle.
#[derive(Clone, Copy, Default)]
struct Foot {
    point: DVec3,
    normal: DVec3,
}

/// The method at work.
struct Nearest<'a> {
    refinement: Refinement,
    points: &'a [DVec3],
    control: Surface,
    feet: Vec<Foot>,
}

impl Iterate for Nearest<'_> {
    fn errors(&mut self) -> Errors {
        const REFINED: &str = "what was refined before";
        let mut fine = self.refinement.refined_n(&self.control, LEVELS).expect(REFINED);
        let limits = self.refinement.limit_positions(&fine).expect(REFINED);
        fine.positions_mut().copy_from_slice(&limits);
        self.feet = parallel::collect(self.points.len(), |v| foot(&fine, v, self.points[v]));
        let distances = self.feet.iter().zip(self.points).map(|(foot, p)| foot.point.distance(*p));
        let (sum, max) = distances.fold((0.0, 0.0f64), |(sum, max), d| (sum + d, max.max(d)));
        Errors { max, mean: sum / self.points.len() as f64 }
    }

    fn advance(&mut self) -> std::result::Result<(), Failure> {
        let moves = self.feet.iter().zip(self.points).map(|(foot, p)| p - foot.point);
        self.control.positions_mut().iter_mut().zip(moves).for_each(|(v, by)| *v += by);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        self.control.positions()
    }
}

/// The point of a mesh nearest to `p`, as far as one comes from vertex `v` downhill.
fn foot(mesh: &Surface, mut v: usize, p: DVec3) -> Foot {
    let (faces, incidence, positions) = (mesh.faces(), mesh.incidence(), mesh.positions());
    let about = |v: usize| incidence.corners_at(v).iter().map(|&c| faces.face(incidence.face_of(c)));
    let distance = |v: usize| positions[v].distance_squared(p);
    while let Some(nearer) =
        about(v).flatten().map(|&w| w as usize).min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        && distance(nearer) < distance(v)
    {
        v = nearer;
    }
    let mut best = Foot { point: positions[v], normal: DVec3::ZERO };
    for face in about(v) {
        for pair in face[1..].windows(2) {
            let corners = [face[0], pair[0], pair[1]].map(|w| positions[w as usize]);
            let point = nearest_in_triangle(corners, p);
            if best.normal == DVec3::ZERO || point.distance_squared(p) < best.point.distance_squared(p) {
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
                best = Foot { point, normal };
            }
        }
    }
    best
}

/// The point of a triangle nearest to `p`: within, or on the nearest side.
fn nearest_in_triangle(corners: [DVec3; 3], p: DVec3) -> DVec3 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let side = |k: usize| [corners[k], corners[(k + 1) % 3]];
    let inside = |k: usize| {
        let [from, to] = side(k);
        normal.cross(to - from).dot(p - from) >= 0.0
    };
    if normal != DVec3::ZERO && (0..3).all(inside) {
        return p - (p - a).dot(normal) / normal.length_squared() * normal;
    }
    let on_side = |k: usize| {
        let [from, to] = side(k);
        let along = to - from;
        let length = along.length_squared();
        if length == 0.0 { from } else { from + ((p - from).dot(along) / length).clamp(0.0, 1.0) * along }
    };
    let nearer =
        |one: DVec3, other: DVec3| if other.distance_squared(p) < one.distance_squared(p) { other } else { one };
    nearer(nearer(on_side(0), on_side(1)), on_side(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin::builtin;
    use crate::mesh::random::random_points;
    use crate::solvers::Outcome;

    /// Against all points of a grid of barycentric coordinates.
    #[test]
    fn no_point_of_the_triangle_is_nearer() {
        let points = random_points(400, 3);
        for four in points.chunks_exact(4) {
            let [a, b, c, p] = [four[0], four[1], four[2], 1.5 * four[3]];
            let found = nearest_in_triangle([a, b, c], p);
            const N: usize = 40;
            let grid = (0..=N).flat_map(|i| (0..=N - i).map(move |j| [i, j].map(|k| k as f64 / N as f64)));
            let least = grid.map(|[s, t]| (a + s * (b - a) + t * (c - a)).distance(p)).fold(f64::INFINITY, f64::min);
            let size = a.distance(b).max(a.distance(c));
            let distance = found.distance(p);
            assert!(distance <= least + 1e-12 && distance > least - 0.06 * size, "{distance} {least}");
            // In the plane, and not outside.
            let normal = (b - a).cross(c - a).normalize();
            assert!((found - a).dot(normal).abs() < 1e-12);
            assert!(nearest_in_triangle([a, b, c], found).distance(found) < 1e-9);
        }
    }

    /// Nearest points of a sphere's own surface lie straight below, so the control mesh is that of PIA there.
    #[test]
    fn the_surface_passes_through_the_points_and_by_symmetry_as_that_of_pia_does() {
        let surface = Surface::new(builtin("octahedron").expect("a mesh")).expect("closed");
        let stop = Stop { tolerance: 1e-9, max_iterations: 1000 };
        let found = interpolate(&surface, Refinement::Loop, &stop).expect("closed");
        assert_eq!(found.report.outcome, Outcome::Converged);
        let same =
            super::super::interpolate(&surface, crate::schemes::Scheme::Loop, &stop.into()).expect("closed").points;
        for (v, w) in found.control.positions().iter().zip(same) {
            assert!(v.distance(w) < 1e-7, "{v} {w}");
        }
        // Elsewhere feet are as near as asked for, and the vertices' limit points are not.
        let mut surface = Surface::new(builtin("irregular-tri:60").expect("a mesh")).expect("closed");
        let noise = random_points(60, 5);
        surface.positions_mut().iter_mut().zip(noise).for_each(|(p, n)| *p += 0.05 * n);
        let stop = Stop { tolerance: 1e-6, max_iterations: 1000 };
        let found = interpolate(&surface, Refinement::Loop, &stop).expect("closed");
        assert_eq!(found.report.outcome, Outcome::Converged);
        let limits = Refinement::Loop.limit_positions(&found.control).expect("closed");
        let off = |at: &[DVec3]| at.iter().zip(surface.positions()).map(|(q, p)| q.distance(*p)).fold(0.0, f64::max);
        assert!(off(&found.feet) <= 1e-6 && off(&limits) > 1e-3, "{} {}", off(&found.feet), off(&limits));
    }
}
