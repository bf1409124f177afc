//! Limit points and normals of the unified √3 surface, for an α of its own at every vertex.
//!
//! With different α there is no closed mask: each step about a vertex is another one, as the α of its ring approaches
//! its own. But two steps map three rings about a vertex to three rings, so the limit can be followed at the vertex
//! alone: by rounds of two steps on 1 + 6n points, moved back to the vertex and enlarged by 3 after each, the factor by
//! which a regular star shrinks.

use glam::DVec3;

use super::surface::refine_n;
use crate::analysis::splitting::Layout;
use crate::interpolate::thall::angle;
use crate::mesh::{Faces, Mesh, Surface};
use crate::schemes::thirds::curve_limits;
use crate::schemes::{Refinement, Tangents, sqrt3};
use crate::{Error, Result, parallel};

/// Vertices that share what is worked on.
const TOGETHER: usize = 64;

/// Rings about a vertex that determine the surface there.
const RINGS: usize = 3;
/// Rounds. The star's radius falls by about 3 in each, so that what is left after these is below rounding, and what
/// is left of the differences between the α of a star by at least (4/9)^ROUNDS < 1e-14.
const ROUNDS: usize = 40;
/// The height of a star is looked at over so many rounds, since modes with complex eigenvalues turn, and may lie in the
/// plane for a moment.
const WINDOW: usize = 8;
/// The vertex has a tangent plane if the second half of the rounds makes its star flatter by this factor at least, ...
const FLATTER: f64 = 0.5;
/// ... or it is as flat as this, in parts of its radius.
const FLAT: f64 = 1e-10;
/// The last two rounds may turn the normal by this angle.
const STEADY: f64 = 1e-9;

/// Points of the limit surface and its unit normals there, one a vertex.
#[derive(Clone, Debug)]
pub struct Limits {
    /// The limit points, in mesh units; where α = 1 the vertices themselves.
    pub positions: Vec<DVec3>,
    /// Zero where the surface has no tangent plane: a star whose normal modes shrink no faster than its tangential
    /// ones comes to a point. That is so at valence 3 for α > 0.80, at others for α near 2, and in degenerate stars.
    /// Within about 3 % of such an α (in the ratio of the two) 40 rounds cannot tell, and it is zero as well. At sharp
    /// vertices it is not computed, and zero.
    pub normals: Vec<DVec3>,
}

/// The limit points and normals of the vertices under the unified √3 scheme with these α.
///
/// Vertices with α = 1 stay exactly; elsewhere the error is that of rounding, a small multiple of 1e-16 of the size of
/// the vertex's star. Time O(n) a vertex of valence n (forty rounds of about 1000 sums at n = 6), in parallel; memory
/// that of the mesh refined twice, which separates the irregular vertices.
///
/// # Errors
/// As [`refine_n`]: above all an α outside [0, 2], with its vertex.
///
/// # Panics
/// If there is not one α a vertex.
///
/// ```
/// use limitlab::interpolate::lin_luo::limit::limits;
/// use limitlab::mesh::{Surface, builtin};
/// let octahedron = Surface::new(builtin::builtin("octahedron")?)?;
/// let found = limits(&octahedron, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
/// assert_eq!(found.positions[0], octahedron.positions()[0]);
/// assert!(found.positions[1].length() < 0.7);
/// assert!(found.normals[1].distance(octahedron.positions()[1]) < 0.3);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn limits(surface: &Surface, alpha: &[f64]) -> Result<Limits> {
    let features = surface.features();
    let count = surface.len();
    if features.is_some_and(|f| f.is_midway()) {
        let (next, alpha) = refine_n(surface, alpha, 1)?;
        let mut found = limits(&next, &alpha)?;
        found.positions.truncate(count);
        found.normals.truncate(count);
        return Ok(found);
    }
    let on_curves = curve_limits(surface, alpha, ROUNDS);
    let (fine, alpha) = refine_n(surface, alpha, 2)?;
    let is_smooth = |v: usize| features.is_none_or(|f| f.is_smooth(v));
    let valence = |v: usize| fine.incidence().face_count(v);
    let largest = (0..count).filter(|&v| is_smooth(v)).map(valence).max().unwrap_or(0);
    let mut present = vec![false; largest + 1];
    for v in (0..count).filter(|&v| is_smooth(v)) {
        present[valence(v)] = true;
    }
    let rounds: Vec<Option<Round>> =
        (0..=largest).map(|n| present[n].then(|| Round::new(n)).transpose()).collect::<Result<_>>()?;
    let at = |v: usize, work: &mut Work| -> Result<(DVec3, DVec3)> {
        if !is_smooth(v) {
            return Ok((surface.positions()[v], DVec3::ZERO));
        }
        let n = valence(v);
        let Some(round) = &rounds[n] else {
            return Err(Error::Computation(format!("no star of valence {n}")));
        };
        let root = fine.incidence().corners_at(v)[0];
        let star = Layout::Triangles.walk(&fine, root, n, RINGS)?;
        let origin = fine.positions()[v];
        let points = star.iter().map(|&i| fine.positions()[i as usize] - origin);
        work.points.clear();
        work.points.extend(points);
        work.alpha.clear();
        work.alpha.extend(star.iter().map(|&i| alpha[i as usize]));
        let (moved, normal) = round.follow(n, work);
        Ok((origin + moved, normal))
    };
    let parts = parallel::map(count, TOGETHER, |range| -> Result<Vec<_>> {
        let mut work = Work::default();
        range.map(|v| at(v, &mut work)).collect()
    });
    let found = parts.into_iter().collect::<Result<Vec<_>>>()?;
    let (mut positions, normals): (Vec<DVec3>, _) = found.into_iter().flatten().unzip();
    for (v, point) in on_curves {
        positions[v] = point;
    }
    Ok(Limits { positions, normals })
}

/// What a round works on; kept from vertex to vertex.
#[derive(Default)]
struct Work {
    points: Vec<DVec3>,
    alpha: Vec<f64>,
    displacements: Vec<DVec3>,
    star: Vec<(DVec3, f64)>,
}

/// Two steps on a star of one valence: the triangles before each, and where the star is found after both.
struct Round {
    levels: [Level; 2],
    found: Vec<u32>,
}

struct Level {
    faces: Faces,
    /// a_n and a_n/n of each vertex.
    relaxation: Vec<[f64; 2]>,
}

impl Round {
    fn new(n: usize) -> Result<Self> {
        let vertices = Layout::Triangles.len(n, RINGS) + 1;
        let faces = Layout::Triangles.closed(n, RINGS);
        let mut surface = Surface::new(Mesh::new(vec![DVec3::ZERO; vertices], faces))?;
        let mut level = || -> Result<Level> {
            let relaxation = (0..surface.len()).map(|v| {
                let n = surface.incidence().face_count(v);
                let a = sqrt3::relaxation(n);
                [a, a / n as f64]
            });
            let relaxation = relaxation.collect();
            let next = Refinement::Sqrt3.refined(&surface)?;
            let faces = std::mem::replace(&mut surface, next).into_mesh().faces;
            Ok(Level { faces, relaxation })
        };
        let levels = [level()?, level()?];
        // The first half-edge stays the first, turned back by half a sector a step: one sector on it is where it was.
        let root = surface.topology().counter_clockwise(surface.faces(), 0);
        let root = root.ok_or_else(|| Error::Computation("the star is open".into()))?;
        let found = Layout::Triangles.walk(&surface, root, n, RINGS)?;
        Ok(Round { levels, found })
    }

    /// How far the vertex, which is the star's origin, moves to its limit, and the normal there.
    fn follow(&self, n: usize, work: &mut Work) -> (DVec3, DVec3) {
        let mut moved = DVec3::ZERO;
        let mut scale = 1.0;
        let mut normals = [DVec3::ZERO; 2];
        let (mut halfway, mut last) = (0.0f64, 0.0f64);
        for round in 1..=ROUNDS {
            // The apex that closes the star is out of reach of what is looked at.
            work.points.push(DVec3::ZERO);
            work.alpha.push(0.0);
            for level in &self.levels {
                level.step(work);
            }
            let star = self.found.iter().map(|&i| i as usize);
            work.star.clear();
            work.star.extend(star.map(|i| (work.points[i], work.alpha[i])));
            let step = work.star[0].0;
            moved += scale * step;
            scale /= 3.0;
            work.points.clear();
            work.points.extend(work.star.iter().map(|(p, _)| 3.0 * (*p - step)));
            work.alpha.clear();
            work.alpha.extend(work.star.iter().map(|(_, a)| a));
            let half = (ROUNDS / 2 - WINDOW..ROUNDS / 2).contains(&(round - 1));
            if half || round > ROUNDS - WINDOW {
                normals = [normals[1], Tangents::of_ring(&work.points[1..=n]).normal()];
                let height = height(&work.points, normals[1]);
                if half {
                    halfway = halfway.max(height);
                } else {
                    last = last.max(height);
                }
            }
        }
        let [before, normal] = normals;
        let plane =
            normal != DVec3::ZERO && angle(before, normal) < STEADY && (last < FLAT || last < FLATTER * halfway);
        (moved, if plane { normal } else { DVec3::ZERO })
    }
}

/// How far points reach along `normal`, in parts of how far they reach.
fn height(points: &[DVec3], normal: DVec3) -> f64 {
    let reach = points.iter().map(|p| p.length()).fold(0.0, f64::max);
    let along = points.iter().map(|p| p.dot(normal).abs());
    along.fold(0.0, f64::max) / reach.max(f64::MIN_POSITIVE)
}

impl Level {
    /// One step of the unified scheme: new points and their α after the old ones.
    fn step(&self, work: &mut Work) {
        let displacements = &mut work.displacements;
        displacements.clear();
        displacements.resize(self.relaxation.len(), DVec3::ZERO);
        for face in self.faces.iter() {
            for k in 0..3 {
                displacements[face[k] as usize] += work.points[face[(k + 1) % 3] as usize];
            }
        }
        let relaxed = displacements.iter_mut().zip(&work.points);
        for ((delta, p), [a, share]) in relaxed.zip(&self.relaxation) {
            *delta = *share * *delta - *a * *p;
        }
        for face in self.faces.iter() {
            let (mut point, mut alpha) = (DVec3::ZERO, 0.0);
            for v in face.iter().map(|&v| v as usize) {
                point += work.points[v] - work.alpha[v] * displacements[v];
                alpha += work.alpha[v];
            }
            work.points.push(point / 3.0);
            work.alpha.push(alpha / 3.0);
        }
        for (v, delta) in displacements.iter().enumerate() {
            work.points[v] += (1.0 - work.alpha[v]) * *delta;
        }
    }
}
