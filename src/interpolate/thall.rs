//! Iteratively interpolating Catmull-Clark surfaces (Thall 2003): the iteration by local masks (§2.2, §2.3), the
//! error metrics (§2.4), and attributes on the surface (§2.6). Normals (§2.5) are in
//! [`normals`](super::normals).

use glam::DVec3;

use crate::Result;
use crate::mesh::frame::of_order_one;
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::{Surface, generate};
use crate::parallel;
use crate::schemes::catmull_clark;
use crate::solvers::iteration::{Errors, Failure, Iterate};
use crate::solvers::jacobi::THALL_OMEGA;
use crate::solvers::system::Rows;

/// How the limit mask of a vertex beside faces that are no quads is inverted. On quads the two are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inverse {
    /// v + δ has the given point as its limit while all *other vertices* stay: the fourth corners R of Eq. 14
    /// depend on v and move with it. This is Jacobi with ω = ½ on every mesh.
    Exact,
    /// (n+5)/n as on quads, "without modification" (§2.2): while R *and* the other vertices stay. Not Jacobi beside
    /// other faces, but it converges all the same: the factor is at most 8/3 and A's eigenvalues at most 1, so the
    /// iteration matrix I − ½(n+5)/n·A has its spectrum in (−1/3, 1) where A is non-singular.
    Regular,
}

/// Thall's iteration at work: `v ← v + ½δ` at all vertices at once, δ from the limit mask of the regularised
/// 1-ring (Eq. 3). No matrix: two arrays of N points, one of F, and an inverse a vertex. O(corners) an iteration,
/// whatever the face sizes; run it with [`solve`](crate::solvers::solve).
///
/// ```
/// use limitlab::interpolate::thall::{Inverse, LocalIteration};
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::{Outcome, Stop, solve};
/// use std::ops::ControlFlow;
///
/// let surface = Surface::new(builtin::builtin("torus:8x6")?)?;
/// let mut iteration = LocalIteration::new(&surface, Inverse::Exact);
/// let stop = Stop { tolerance: 1e-9, max_iterations: 1000 };
/// let report = solve(&mut iteration, &stop, &mut |_| ControlFlow::Continue(()));
/// assert_eq!(report.outcome, Outcome::Converged);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub struct LocalIteration<'a> {
    surface: &'a Surface,
    /// ½ of the inverse of v's weight in its own limit.
    inverse: Vec<f64>,
    /// 4 c_F of the current iterate.
    centers: Vec<DVec3>,
    current: Vec<DVec3>,
    next: Vec<DVec3>,
    rows: Rows,
}

impl<'a> LocalIteration<'a> {
    /// Starts from V = P, the positions of a closed mesh.
    pub fn new(surface: &'a Surface, inverse: Inverse) -> Self {
        let (mesh, incidence) = (surface.mesh(), surface.incidence());
        let weight = |v: usize| {
            let star = incidence.corners_at(v);
            let n = star.len() as f64;
            // R = 4c_F − v − e_j − e_{j+1} holds v with weight 4/|F| − 1.
            let through_faces: f64 = match inverse {
                Inverse::Regular => 0.0,
                Inverse::Exact => (star.iter())
                    .map(|&c| mesh.faces.range(incidence.face_of(c)).len())
                    .map(|size| 4.0 / size as f64 - 1.0)
                    .sum(),
            };
            let [own, _, opposite] = catmull_clark::limit_mask(star.len());
            debug_assert!(n >= 2.0);
            own + opposite * through_faces
        };
        let inverse = parallel::collect(mesh.len(), |v| THALL_OMEGA / weight(v));
        LocalIteration {
            surface,
            inverse,
            centers: vec![DVec3::ZERO; mesh.faces.len()],
            current: mesh.positions.clone(),
            next: vec![DVec3::ZERO; mesh.len()],
            rows: Rows::new(mesh.len()),
        }
    }
}

/// The fourth corner R that turns a face of any size into a quad (v, e_j, R, e_{j+1}) with the same centroid c
/// (Eq. 14), and with it the limit of v.
#[inline]
fn regularised_corner(four_centers: DVec3, v: DVec3, leaving: DVec3, entering: DVec3) -> DVec3 {
    four_centers - v - leaving - entering
}

/// The limit point of `v` by the mask of its regularised 1-ring.
#[inline]
fn limit(surface: &Surface, points: &[DVec3], centers: &[DVec3], v: usize) -> DVec3 {
    let (faces, incidence) = (surface.faces(), surface.incidence());
    let corners = faces.corners();
    let star = incidence.corners_at(v);
    let here = points[v];
    let (mut edges, mut opposite) = (DVec3::ZERO, DVec3::ZERO);
    for &c in star {
        let f = incidence.face_of(c);
        let range = faces.range(f);
        let leaving = points[corners[next_in(&range, c) as usize] as usize];
        let entering = points[corners[prev_in(&range, c) as usize] as usize];
        edges += leaving;
        opposite += regularised_corner(centers[f], here, leaving, entering);
    }
    let [own, edge, face] = catmull_clark::limit_mask(star.len());
    own * here + edge * edges + face * opposite
}

impl Iterate for LocalIteration<'_> {
    fn errors(&mut self) -> Errors {
        let (surface, current) = (self.surface, &self.current);
        parallel::change(&mut self.centers, |f, c| {
            let face = surface.faces().face(f);
            let sum: DVec3 = face.iter().map(|&v| current[v as usize]).sum();
            *c = 4.0 / face.len() as f64 * sum;
        });
        let (centers, inverse) = (&self.centers, &self.inverse);
        self.rows
            .pass_one(&mut self.next, |v, next, tally| {
                let error = surface.positions()[v] - limit(surface, current, centers, v);
                tally.error(error);
                *next = current[v] + inverse[v] * error;
            })
            .errors
    }

    fn advance(&mut self) -> std::result::Result<(), Failure> {
        std::mem::swap(&mut self.current, &mut self.next);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

/// Metric 1 of §2.4: the distance of every surface point from the given one, divided by the radius there (the
/// medial radius r in the paper; any positive tolerance field will do).
///
/// # Panics
/// If the three do not have one entry a vertex.
pub fn scaled_distances(surface: &[DVec3], given: &[DVec3], radius: &[f64]) -> Vec<f64> {
    assert!(surface.len() == given.len() && given.len() == radius.len(), "one entry a vertex");
    let pairs = surface.iter().zip(given).zip(radius);
    pairs.map(|((s, g), r)| s.distance(*g) / r).collect()
}

/// Metric 2 of §2.4: the angle in radians, 0 to π, between every surface normal and the given one; π where either
/// is the zero vector, so that a normal that does not exist never looks right.
///
/// # Panics
/// If there are not as many of one as of the other.
pub fn normal_deviations(surface: &[DVec3], given: &[DVec3]) -> Vec<f64> {
    assert_eq!(surface.len(), given.len(), "one normal a vertex");
    let pairs = surface.iter().zip(given);
    pairs.map(|(s, g)| angle(*s, *g)).collect()
}

/// The angle between two vectors by its tangent, accurate near 0 and π too; π if one is zero.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    if a == DVec3::ZERO || b == DVec3::ZERO {
        return std::f64::consts::PI;
    }
    let (a, b) = (of_order_one(a), of_order_one(b));
    a.cross(b).length().atan2(a.dot(b))
}

/// A medial atom: the ball of centre `position` and radius `radius` that touches the boundary at its involutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MedialAtom {
    /// The centre of the ball.
    pub position: DVec3,
    /// The radius, in mesh units; negative if fitted to normals that point to the centre.
    pub radius: f64,
}

impl MedialAtom {
    /// The atom of given boundary points y_k with outward unit normals n_k: the position p and radius r with the
    /// least Σ‖y_k − r n_k − p‖², so p = ȳ − r n̄ and r = Σ(y_k−ȳ)·(n_k−n̄)/Σ‖n_k−n̄‖². On a sphere it is the
    /// sphere. `None` where the normals are parallel to rounding: they fix no ball.
    pub fn fit(boundary: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> Option<Self> {
        let (mut count, mut point, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for (y, n) in boundary.clone() {
            count += 1.0;
            point += y;
            normal += n;
        }
        if count == 0.0 {
            return None;
        }
        let (point, normal) = (point / count, normal / count);
        let (mut along, mut spread) = (0.0, 0.0);
        for (y, n) in boundary {
            along += (y - point).dot(n - normal);
            spread += (n - normal).length_squared();
        }
        // Unit normals carry errors of some ε each.
        if spread <= count * 1e-24 {
            return None;
        }
        let radius = along / spread;
        Some(MedialAtom { position: point - radius * normal, radius })
    }
}

/// Metric 3 of §2.4: how far each medial atom moves, relative to its radius, when it is made anew from the surface
/// points and normals instead of the given ones. `involutes` lists the vertices of each atom, as the faces of a
/// mesh list theirs. `None` for an atom that either side does not fix ([`MedialAtom::fit`]).
///
/// The paper takes the new atom from a construction of another chapter of the thesis, which is not at hand; the
/// least-squares ball stands in for it. It agrees with any such construction where the points and normals are those
/// of a ball.
///
/// # Panics
/// If an atom names a vertex without a point or a normal.
pub fn medial_shifts(
    involutes: &crate::mesh::Faces,
    surface: (&[DVec3], &[DVec3]),
    given: (&[DVec3], &[DVec3]),
) -> Vec<Option<f64>> {
    let atom = |vertices: &[u32], (points, normals): (&[DVec3], &[DVec3])| {
        let boundary = vertices.iter().map(|&v| (points[v as usize], normals[v as usize]));
        MedialAtom::fit(boundary)
    };
    involutes
        .iter()
        .map(|vertices| {
            let (new, old) = (atom(vertices, surface)?, atom(vertices, given)?);
            Some(new.position.distance(old.position) / old.radius.abs())
        })
        .collect()
}

/// The rule by which an attribute follows a refinement (§2.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttributeRule {
    /// Values at vertices stay, edges take the mean of their ends, faces that of their corners: C⁰, and no value
    /// ever creeps.
    Midpoint,
    /// As the positions, by Catmull-Clark: smooth, but known values creep. Values that were first made to
    /// interpolate (their limit system solved as for points) come back to the given ones in the limit.
    Scheme,
}

/// One refinement of attributes: up to three numbers a vertex (u, v, t, or r alone), one vector each. The result is
/// numbered as [`catmull_clark::refine`] numbers its vertices.
///
/// # Errors
/// As [`catmull_clark::refine`].
///
/// # Panics
/// If there is not one value a vertex.
pub fn refine_attributes(surface: &Surface, values: Vec<DVec3>, rule: AttributeRule) -> Result<Vec<DVec3>> {
    assert_eq!(values.len(), surface.len(), "one value a vertex");
    let values = surface.with_positions(values);
    let refined = match rule {
        AttributeRule::Midpoint => generate::quad_split(values.mesh()),
        AttributeRule::Scheme => catmull_clark::refine(&values)?,
    };
    Ok(refined.positions)
}
