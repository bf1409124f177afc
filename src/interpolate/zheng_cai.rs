//! Zheng & Cai's two-phase interpolation with Doo-Sabin surfaces (2005), and Nasri's method (1987) beside it.
//!
//! Phase one moves the vertices of the mesh until the type-V faces of its first refinement, W = (V + c_F)/2, have
//! their centroids near the given points (Eq. 7). Phase two corrects the first refinement so that the centroids are
//! exact, the faces planar, and the normals the given ones (Eq. 17). Doo-Sabin then keeps centroids and tangent
//! planes at every level.
//!
//! On open and creased meshes curves come first, exactly: their limit points are no centroids of faces, and depend on nothing
//! beside them. Both phases are those of the smooth vertices then, whose faces are all there.

use glam::DVec3;

use super::normals::unit_normals;
use crate::assemble::curves::Curves;
use crate::assemble::stages::{free, nothing};
use crate::error::short;
use crate::mesh::{Mesh, Surface};
use crate::parallel;
use crate::schemes::doo_sabin::{CornerRule, first_vertex_face, refine_by};
use crate::schemes::{Refinement, Scheme};
use crate::{Error, Result};

/// Vertices of one task.
const CHUNK: usize = 1024;

/// How phase one updates the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep<'a> {
    /// In place, in the order given, or in file order.
    GaussSeidel(Option<&'a [u32]>),
    /// All at once.
    Jacobi,
}

/// When phase one ends, and how it goes on until then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseOne<'a> {
    /// Whether vertices are updated in place, and in what order, or all at once.
    pub sweep: Sweep<'a>,
    /// The paper's ITE_MAX.
    pub max_iterations: usize,
    /// The paper's EPS: the largest update of the last sweep is at most this part of the diagonal of the bounding
    /// box of the given points.
    pub eps: f64,
}

impl Default for PhaseOne<'_> {
    /// The settings of §3.4 and §3.5: Gauss-Seidel in file order, five sweeps at most, 0.3 %.
    fn default() -> Self {
        PhaseOne { sweep: Sweep::GaussSeidel(None), max_iterations: 5, eps: 0.003 }
    }
}

/// What is asked of single vertices; one entry a vertex in each list.
#[derive(Clone, Copy, Debug, Default)]
pub struct Constraints<'a> {
    /// Which vertices are interpolated; all unless told.
    pub interpolated: Option<&'a [bool]>,
    /// Normals of the surface at interpolated points, of any length; n and −n are the same.
    pub normals: Option<&'a [Option<DVec3>]>,
    /// Shape handles s > 0: the type-V face is scaled by s about its centroid; larger is flatter. 1 where not told.
    pub handles: Option<&'a [f64]>,
}

impl Constraints<'_> {
    /// Normals, and handles other than 1, at smooth vertices only of a surface, or of one whose first vertices are refined.
    pub(super) fn check_smooth(&self, surface: &Surface) -> Result<()> {
        let Some(features) = surface.features() else { return Ok(()) };
        let is_shaped = |v: usize| {
            let has_normal = self.normals.and_then(|normals| *normals.get(v)?).is_some();
            has_normal || self.handles.and_then(|s| s.get(v)).is_some_and(|&s| s != 1.0)
        };
        match (0..surface.len()).find(|&v| is_shaped(v) && !features.is_smooth(v)) {
            None => Ok(()),
            Some(v) => Err(Error::mesh(
                "constraints",
                format!(
                    "vertex {v} is sharp, and has neither a ring nor a face that turns about its point: leave its normal \
                     out, and its shape handle at 1"
                ),
            )),
        }
    }

    pub(super) fn is_interpolated(&self, v: usize) -> bool {
        self.interpolated.is_none_or(|marks| marks[v])
    }

    /// Lists of the right length, at least one interpolated vertex, positive handles, normals and handles at
    /// interpolated vertices only.
    pub(super) fn check(&self, vertices: usize) -> Result<()> {
        let lengths = [self.interpolated.map(<[_]>::len), self.normals.map(<[_]>::len), self.handles.map(<[_]>::len)];
        assert!(lengths.iter().flatten().all(|&n| n == vertices), "one entry a vertex");
        if !(0..vertices).any(|v| self.is_interpolated(v)) {
            return Err(nothing());
        }
        let refuse = |v: usize, what: String| Err(Error::mesh("constraints", format!("vertex {v}: {what}")));
        for v in 0..vertices {
            let free = !self.is_interpolated(v);
            if free && self.normals.is_some_and(|n| n[v].is_some()) {
                return refuse(
                    v,
                    "a normal is given where no point is interpolated: interpolate the vertex, or leave the normal out"
                        .into(),
                );
            }
            let Some(s) = self.handles.map(|h| h[v]) else {
                continue;
            };
            if !(s > 0.0 && s.is_finite()) {
                return refuse(
                    v,
                    format!("the shape handle {} is no positive number: 1 leaves the shape as it is", short(s)),
                );
            }
            if free && s != 1.0 {
                return refuse(v, "a shape handle is given where no point is interpolated: interpolate the vertex, or leave the handle at 1".into());
            }
        }
        Ok(())
    }
}

/// The auxiliary mesh of phase one.
#[derive(Clone, Debug)]
pub struct Auxiliary {
    /// The given faces with the vertices V of phase one; those not interpolated stay where they were.
    pub surface: Surface,
    /// The largest update of each sweep, in the units of the mesh.
    pub updates: Vec<f64>,
    /// Whether the last of them was within the tolerance.
    pub passed: bool,
}

/// Phase one: curves by elimination, then sweeps of Eq. 7 over the smooth vertices from V = I, without a matrix. With S_F the sum of a face's corners, kept up to date
/// as vertices move, an update is V += (2mI − mV − Σ_F S_F/|F|)/(m + Σ_F 1/|F|): O(1) a corner whatever the face
/// sizes. Vertices that are not interpolated keep V = I. The system is strictly diagonally dominant, so both sweeps
/// converge on every mesh; [`Scheme::ZhengCai`] is the same system for all
/// other solvers.
///
/// # Errors
/// No vertex is interpolated; a boundary that is treated as interior, darts, semi-sharp edges and vertices.
///
/// # Panics
/// If `interpolated` has not one entry a vertex, or an order names a vertex that the mesh lacks.
pub fn auxiliary(surface: &Surface, interpolated: Option<&[bool]>, phase: &PhaseOne) -> Result<Auxiliary> {
    auxiliary_watched(surface, interpolated, phase, &mut |_, _| ())
}

/// As [`auxiliary`], with a watch that sees the vertices with the number of sweeps before, first the start.
///
/// # Errors
/// As [`auxiliary`].
///
/// # Panics
/// As [`auxiliary`].
pub fn auxiliary_watched(
    surface: &Surface,
    interpolated: Option<&[bool]>,
    phase: &PhaseOne,
    watch: &mut dyn FnMut(usize, &[DVec3]),
) -> Result<Auxiliary> {
    Refinement::DooSabin.check(surface)?;
    let mesh = surface.mesh();
    let free = free(surface, interpolated)?;
    let tolerance = phase.eps * mesh.diagonal();
    let mut system = LocalSystem::new(surface);
    Curves::new(surface, Scheme::ZhengCai, interpolated)?.solve(&mut system.points);
    let mut next = match phase.sweep {
        Sweep::Jacobi => system.points.clone(),
        Sweep::GaussSeidel(_) => Vec::new(),
    };
    let mut updates = Vec::new();
    let mut passed = false;
    watch(0, &system.points);
    while updates.len() < phase.max_iterations && !passed {
        system.sum_faces();
        let moves = |v: &usize| free.as_ref().is_none_or(|free| free[*v]);
        let largest = match phase.sweep {
            Sweep::GaussSeidel(Some(order)) => system.sweep(order.iter().map(|&v| v as usize).filter(moves)),
            Sweep::GaussSeidel(None) => system.sweep((0..mesh.len()).filter(moves)),
            Sweep::Jacobi => {
                let fixed = &system;
                let mut squared = vec![0.0f64; next.len().div_ceil(CHUNK)];
                parallel::chunks_with(&mut next, CHUNK, &mut squared, |first, next, squared| {
                    for (v, next) in (first..).zip(next).filter(|(v, _)| moves(v)) {
                        let update = fixed.update(v);
                        *next = fixed.points[v] + update;
                        *squared = squared.max(update.length_squared());
                    }
                });
                system.points.copy_from_slice(&next);
                squared.into_iter().fold(0.0, f64::max).sqrt()
            }
        };
        updates.push(largest);
        watch(updates.len(), &system.points);
        passed = largest <= tolerance;
    }
    Ok(Auxiliary { surface: surface.with_positions(system.points), updates, passed })
}

/// Eq. 6 as sums over faces.
struct LocalSystem<'a> {
    surface: &'a Surface,
    points: Vec<DVec3>,
    /// S_F: the sum of the corners of each face.
    sums: Vec<DVec3>,
}

impl<'a> LocalSystem<'a> {
    fn new(surface: &'a Surface) -> Self {
        let sums = vec![DVec3::ZERO; surface.faces().len()];
        LocalSystem { surface, points: surface.positions().to_vec(), sums }
    }

    /// Anew in every sweep, so that rounding does not add up.
    fn sum_faces(&mut self) {
        let (faces, points) = (self.surface.faces(), &self.points);
        parallel::fill(&mut self.sums, |f| faces.face(f).iter().map(|&v| points[v as usize]).sum());
    }

    /// How far Eq. 7 moves `v`.
    #[inline]
    fn update(&self, v: usize) -> DVec3 {
        let star = self.surface.incidence().corners_at(v);
        let m = star.len() as f64;
        let (mut means, mut weight) = (DVec3::ZERO, m);
        for &c in star {
            let f = self.surface.incidence().face_of(c);
            let share = 1.0 / self.surface.faces().range(f).len() as f64;
            means += share * self.sums[f];
            weight += share;
        }
        (2.0 * m * self.surface.positions()[v] - m * self.points[v] - means) / weight
    }

    /// Moves the vertices in turn; the length of the largest update.
    fn sweep(&mut self, order: impl Iterator<Item = usize>) -> f64 {
        let mut largest: f64 = 0.0;
        for v in order {
            let update = self.update(v);
            self.points[v] += update;
            for &c in self.surface.incidence().corners_at(v) {
                self.sums[self.surface.incidence().face_of(c)] += update;
            }
            largest = largest.max(update.length_squared());
        }
        largest.sqrt()
    }
}

/// The first refined mesh with its corrected type-V faces: a Doo-Sabin mesh whose limit surface passes through the
/// interpolated points.
#[derive(Clone, Debug)]
pub struct FirstRefinement {
    /// The corrected mesh: faces of type F first, then E, then V.
    pub surface: Surface,
    /// The type-V face of vertex v is face `first_vertex_face + v`; of one that is not smooth, the first of them.
    pub first_vertex_face: usize,
    /// Interpolated vertices whose type-V face should have been flattened and has no average normal (its corners lie in a line or a point, or its
    /// vector area vanishes): their centroid is exact, but the face was only moved, not flattened.
    pub not_flattened: Vec<u32>,
}

impl FirstRefinement {
    /// Refines `auxiliary` once by `rule` and corrects the type-V face of every smooth interpolated vertex (§3.3, §4):
    /// W_k += ((W_c − W_k)·n) n + (I − W_c), then W_k ← I + s(W_k − I). n is the given normal or the average one
    /// of Eq. 10. Afterwards the centroid is I and the face lies in a plane perpendicular to n, so the limit surface
    /// passes through I with the normal ±n. Of all such corrections this is the smallest (Eq. 9).
    ///
    /// By another rule than [`CornerRule::ZhengCai`] faces have their centroids already, as far as the system was solved.
    /// Only those are corrected of which something is asked, a normal or a handle other than 1, and only a given
    /// normal flattens one.
    ///
    /// Type-V faces share no vertices, so each is corrected on its own; time and memory are those of the
    /// refinement.
    ///
    /// # Errors
    /// What [`refine_by`] refuses; constraints that contradict each other or make no sense, or are about vertices that are not
    /// smooth; a normal in whose plane the face would have no area. All with the vertex.
    ///
    /// # Panics
    /// If `points` or a list of constraints has not one entry a vertex.
    pub fn new(auxiliary: &Surface, rule: CornerRule, points: &[DVec3], constraints: &Constraints) -> Result<Self> {
        assert_eq!(points.len(), auxiliary.len(), "one point a vertex");
        constraints.check(points.len())?;
        constraints.check_smooth(auxiliary)?;
        let normals = constraints.normals.map(unit_normals).transpose()?;
        let mut mesh = refine_by(rule, auxiliary)?;
        let first_vertex_face = first_vertex_face(auxiliary);
        // Those of sharp vertices hold no limit points.
        let is_smooth = |v: usize| auxiliary.features().is_none_or(|features| features.is_smooth(v));
        // What phase one leaves of the distance to the points is left to phase two everywhere.
        let corrects_all = rule == CornerRule::ZhengCai;
        let mut not_flattened = Vec::new();
        let mut ring = Vec::new();
        for (v, &point) in points.iter().enumerate() {
            let given = normals.as_ref().and_then(|n| n[v]);
            let scale = constraints.handles.map_or(1.0, |s| s[v]);
            let is_asked = corrects_all || given.is_some() || scale != 1.0;
            if !constraints.is_interpolated(v) || !is_smooth(v) || !is_asked {
                continue;
            }
            let face = mesh.faces.face(first_vertex_face + v);
            ring.clear();
            ring.extend(face.iter().map(|&c| mesh.positions[c as usize]));
            let center = ring.iter().sum::<DVec3>() / ring.len() as f64;
            ring.iter_mut().for_each(|w| *w -= center);
            let normal = match given {
                Some(n) => {
                    require_area(v, &ring, n)?;
                    Some(n)
                }
                None if corrects_all => average_normal(&ring),
                None => None,
            };
            if corrects_all && normal.is_none() {
                not_flattened.push(v as u32);
            }
            for (&c, &w) in face.iter().zip(&ring) {
                let flat = normal.map_or(w, |n| w - w.dot(n) * n);
                mesh.positions[c as usize] = point + scale * flat;
            }
        }
        let surface = match auxiliary.features() {
            None => Surface::of_valid(mesh),
            Some(_) => Refinement::DooSabin.refined_surface(auxiliary, mesh)?,
        };
        Ok(FirstRefinement { surface, first_vertex_face, not_flattened })
    }

    /// The mesh at `level`: 1 is the first refinement itself, each further one a Doo-Sabin step. The type-V face of
    /// a vertex keeps its number, its centroid and, if it is flat, its plane.
    ///
    /// # Errors
    /// As [`Refinement::refine`].
    ///
    /// # Panics
    /// If `level` is 0.
    pub fn at_level(&self, level: usize) -> Result<Mesh> {
        assert!(level > 0, "level 1 is the first refinement");
        // A step puts type-F faces first, in the order of the old faces: face numbers stay.
        Refinement::DooSabin.refine_n(&self.surface, level - 1)
    }
}

/// What phase one and two make together.
#[derive(Clone, Debug)]
pub struct TwoPhase {
    /// Phase one: the moved vertices.
    pub auxiliary: Auxiliary,
    /// Phase two: the first refinement with its corrected type-V faces.
    pub first: FirstRefinement,
}

/// The whole algorithm of §3.4 with the extensions of §4.
///
/// # Errors
/// As [`FirstRefinement::new`].
///
/// # Panics
/// As [`auxiliary`] and [`FirstRefinement::new`].
///
/// ```
/// use limitlab::interpolate::zheng_cai::{Constraints, PhaseOne, interpolate};
/// use limitlab::mesh::{Surface, builtin};
///
/// let surface = Surface::new(builtin::builtin("icosahedron")?)?;
/// let result = interpolate(&surface, &Constraints::default(), &PhaseOne::default())?;
/// // Three sweeps or thirty: the centroids of the type-V faces are the given points.
/// let fine = result.first.at_level(3)?;
/// let face = fine.faces.face(result.first.first_vertex_face + 7);
/// let centroid = face.iter().map(|&c| fine.positions[c as usize]).sum::<glam::DVec3>() / face.len() as f64;
/// assert!(centroid.distance(surface.positions()[7]) < 1e-14);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn interpolate(surface: &Surface, constraints: &Constraints, phase: &PhaseOne) -> Result<TwoPhase> {
    constraints.check(surface.len())?;
    constraints.check_smooth(surface)?;
    let auxiliary = auxiliary(surface, constraints.interpolated, phase)?;
    let first = FirstRefinement::new(&auxiliary.surface, CornerRule::ZhengCai, surface.positions(), constraints)?;
    Ok(TwoPhase { auxiliary, first })
}

/// Below this part of Σ|W_k||W_{k+1}| a vector area is rounding, or so nearly that its direction is.
const NO_AREA: f64 = 1e-12;

/// Σ W_k × W_{k+1} and Σ |W_k||W_{k+1}| of a ring seen from its centroid.
fn vector_area(ring: &[DVec3]) -> (DVec3, f64) {
    let next = ring.iter().cycle().skip(1);
    ring.iter()
        .zip(next)
        .fold((DVec3::ZERO, 0.0), |(area, scale), (w, x)| (area + w.cross(*x), scale + w.length() * x.length()))
}

/// Eq. 10; `None` where there is none.
fn average_normal(ring: &[DVec3]) -> Option<DVec3> {
    let (area, scale) = vector_area(ring);
    let length = area.length();
    (length > NO_AREA * scale).then(|| area / length)
}

/// Refuses a normal whose plane sees the ring edge-on: the corrected face would collapse to a line, and the surface
/// would have no tangent plane there.
fn require_area(v: usize, ring: &[DVec3], normal: DVec3) -> Result<()> {
    let (area, scale) = vector_area(ring);
    if area.dot(normal).abs() > NO_AREA * scale {
        return Ok(());
    }
    Err(Error::mesh(
        "normals",
        format!(
            "vertex {v}: the given normal lies in the plane of the vertex's face, which would collapse: tilt it, or give none"
        ),
    ))
}
