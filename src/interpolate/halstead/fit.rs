//! The fairest surface through given points: a sparse constrained least-squares problem.

use std::ops::ControlFlow;

use glam::DVec3;

use super::direct::{by_normals, by_points};
use super::energy::{Energies, Fairness, Row, SharpMasks, Weights};
use super::projected::{Conditions, minimise};
use crate::interpolate::normals::unit_normals;
use crate::interpolate::zheng_cai::Constraints;
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::{Surface, diagonal};
use crate::schemes::catmull_clark::{limit_mask, tangent_constant};
use crate::solvers::system::Rows;
use crate::solvers::{Errors, Outcome, Report, Step, Stop};
use crate::{Error, Result};

/// The fairest control mesh.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The control mesh two refinements below the given one; original vertices come first.
    pub surface: Surface,
    /// The energies of its surface, unweighted.
    pub energies: Energies,
    /// The distances of the limit points from the given ones, in mesh units, over the interpolated vertices.
    pub errors: Errors,
    /// How it was found. The errors of its history are not those above, which vanish all the way: they are the steps, in mesh
    /// units, that would take the energy to its least value along one control point at a time.
    pub report: Report,
}

/// How the least energy is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Conjugate gradients among the control points that meet the conditions, without a matrix: 4 KB a vertex in all.
    #[default]
    Iterations,
    /// LDLᵀ of one large sparse matrix, some 180 KB a vertex: what the iterations are held against.
    Factorization,
}

/// What [`fit`] iterates to, relative to the diagonal of the bounding box of the points.
pub const TOLERANCE: f64 = 1e-12;
/// And in how many iterations at most.
pub const MAX_ITERATIONS: usize = 10_000;

/// A fit that misses its points by more than this part of their size has failed: sums of ring points round at 10⁻¹⁵,
/// and the rest is room for the growth of the factorization.
const MISS: f64 = 1e-8;

/// Minimises xᵀKx, K the weighted forms of `fairness`, over the fine control points x, under the limit masks' equations
/// at the interpolated vertices (all unless told), ℓ_v·x = P_v, and where a normal n is given under the tangent masks'
/// (τ·x)·n = 0 for both tangents. The other vertices go where the surface is fairest. On curves ℓ_v is ⅙(1, 4, 1), at
/// corners 1. A positive membrane weight makes the minimum unique on every mesh.
///
/// By [`Solver::Iterations`], to [`TOLERANCE`].
///
/// # Errors
/// Weights that are negative, not finite, or without a membrane part; a component without an interpolated vertex, which
/// could be anywhere; a normal without direction, or at a vertex that is sharp or not interpolated; shape handles, which
/// scale faces of Doo-Sabin surfaces; iterations that do not reach the tolerance; points that are missed.
///
/// # Panics
/// If there is not one point, and one entry in each list of `wishes`, for each original vertex of the mesh that
/// `fairness` was made of.
///
/// ```
/// use limitlab::interpolate::halstead::{Fairness, Weights, fit};
/// use limitlab::interpolate::zheng_cai::Constraints;
/// use limitlab::mesh::{Surface, builtin};
///
/// let surface = Surface::new(builtin::builtin("icosahedron")?)?;
/// let fairness = Fairness::new(&surface)?;
/// let fair = fit(&fairness, surface.positions(), &Constraints::default(), Weights::default())?;
/// assert!(fair.errors.max < 1e-12);
/// let weights = Weights { membrane: 10.0, ..Weights::default() };
/// let tighter = fit(&fairness, surface.positions(), &Constraints::default(), weights)?;
/// assert!(tighter.energies.membrane < fair.energies.membrane);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn fit(fairness: &Fairness, points: &[DVec3], wishes: &Constraints, weights: Weights) -> Result<Fit> {
    let stop = Stop { tolerance: TOLERANCE * diagonal(points), max_iterations: MAX_ITERATIONS };
    let mut watch = |_: &Step| ControlFlow::Continue(());
    fit_watched(fairness, points, wishes, weights, Solver::Iterations, &stop, &mut watch)?.found()
}

impl Fit {
    /// The fit itself, if it is the fairest as far as was asked.
    ///
    /// # Errors
    /// Iterations that ended elsewhere than at the tolerance, at rounding, or where the watch said stop.
    pub fn found(self) -> Result<Self> {
        match self.report.outcome {
            Outcome::Converged | Outcome::Rounding | Outcome::Stopped => Ok(self),
            outcome @ (Outcome::Diverged
            | Outcome::MaxIterations
            | Outcome::Stagnated
            | Outcome::Singular
            | Outcome::Breakdown) => Err(Error::Computation(format!(
                "the fairest surface was not found in {} iterations ({outcome}): raise the membrane weight, or interpolate \
                 more vertices",
                self.report.iterations
            ))),
        }
    }
}

/// As [`fit`] by any solver, with a watch that sees each iterate, its points in an order of the method's own. What the
/// outcome is of iterations that end otherwise than converged is said in [`Fit::report`], beside the last iterate.
///
/// # Errors
/// As [`fit`], but for the outcome of iterations; a factorization that breaks down, or that memory has no room for.
///
/// # Panics
/// As [`fit`].
pub fn fit_watched(
    fairness: &Fairness,
    points: &[DVec3],
    wishes: &Constraints,
    weights: Weights,
    solver: Solver,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Result<Fit> {
    weights.check()?;
    assert!(points.len() < fairness.fine.len(), "the given points, not the fine ones");
    wishes.check(points.len())?;
    if wishes.handles.is_some() {
        return Err(Error::NotOffered {
            what: "shape handles scale the type-V faces of Doo-Sabin surfaces, and the fairest surface is none".into(),
            schemes: &["zheng-cai", "nasri"],
        });
    }
    wishes.check_smooth(&fairness.fine)?;
    require_anchors(&fairness.fine, wishes, points.len())?;
    let normals = wishes.normals.map(unit_normals).transpose()?;
    let normals = normals.filter(|n| n.iter().any(Option::is_some));
    let chosen: Vec<usize> = (0..points.len()).filter(|&v| wishes.is_interpolated(v)).collect();
    let masks = Masks { fine: &fairness.fine, sharp: SharpMasks::new(&fairness.fine) };
    let (x, report) = match solver {
        Solver::Iterations => {
            let conditions = |v: usize| {
                let normal = normals.as_ref().and_then(|normals| normals[v]);
                let tangents = normal.map(|normal| (masks.tangents(v), normal));
                Conditions { limit: masks.limit(v), point: points[v], tangents }
            };
            // Every control point begins at the given point that is next to it.
            let start = fairness.elements.spread(points);
            minimise(&fairness.elements, weights, start, &chosen, &conditions, stop, watch)?
        }
        Solver::Factorization => {
            let x = match normals {
                None => by_points(fairness, &masks, points, &chosen, weights)?,
                Some(normals) => by_normals(fairness, &masks, points, &chosen, &normals, weights)?,
            };
            (x, Report { outcome: Outcome::Converged, iterations: 1, history: Vec::new(), detail: None })
        }
    };
    let surface = fairness.fine.with_positions(x);
    let mut nothing = vec![(); chosen.len()];
    let totals = Rows::new(chosen.len()).pass_one(&mut nothing, |k, (), tally| {
        let v = chosen[k];
        let limit: DVec3 = masks.limit(v).iter().map(|&(j, w)| w * surface.positions()[j as usize]).sum();
        tally.error(points[v] - limit);
    });
    let size = points.iter().fold(0.0f64, |a, p| a.max(p.abs().max_element()));
    if !(totals.errors.max <= MISS * size && size.is_finite()) {
        let what = if totals.errors.max.is_finite() {
            "the system is too ill-conditioned; raise the membrane weight"
        } else {
            "the points or weights are too large for doubles; scale them down"
        };
        return Err(Error::Computation(format!(
            "the fairest surface misses its points by {:.1e}: {what}",
            totals.errors.max
        )));
    }
    Ok(Fit { energies: fairness.energies(surface.positions()), surface, errors: totals.errors, report })
}

/// Every component needs a point that holds it. The given vertices are the first of the surface's.
pub(in crate::interpolate) fn require_anchors(surface: &Surface, wishes: &Constraints, originals: usize) -> Result<()> {
    if wishes.interpolated.is_none() {
        return Ok(());
    }
    let (component, count) = surface.topology().components(surface.faces());
    let mut held = vec![false; count];
    for v in (0..originals).filter(|&v| wishes.is_interpolated(v)) {
        held[component[v] as usize] = true;
    }
    match (0..originals).find(|&v| !held[component[v] as usize]) {
        None => Ok(()),
        Some(v) => Err(Error::Computation(format!(
            "no vertex of the component of vertex {v} is interpolated, so that its place is not determined: name at \
             least one"
        ))),
    }
}

/// The masks of original vertices as rows over the fine control points. They are made where they are needed: to keep
/// them all takes 300 bytes a vertex.
pub(super) struct Masks<'a> {
    fine: &'a Surface,
    sharp: SharpMasks<'a>,
}

impl Masks<'_> {
    fn star(&self, v: usize) -> Vec<u32> {
        let mut star = Vec::new();
        self.fine.topology().star(self.fine.faces(), v, &mut star);
        star
    }

    pub(super) fn limit(&self, v: usize) -> Row {
        self.sharp.of(v, 1.0 / 6.0).unwrap_or_else(|| limit_row(self.fine, v, &self.star(v)))
    }

    /// Cosine and sine, at a smooth vertex.
    pub(super) fn tangents(&self, v: usize) -> [Row; 2] {
        tangent_rows(self.fine, &self.star(v))
    }
}

/// The edge neighbour and the opposite corner that a quad brings to the star of one of its corners.
fn neighbors(surface: &Surface, c: u32) -> [u32; 2] {
    let faces = surface.faces();
    let range = faces.range(surface.incidence().face_of(c));
    let next = next_in(&range, c);
    debug_assert_eq!(next_in(&range, next_in(&range, next)), prev_in(&range, c));
    [next, next_in(&range, next)].map(|c| faces.corners()[c as usize])
}

fn limit_row(surface: &Surface, v: usize, star: &[u32]) -> Row {
    let [own, edge, face] = limit_mask(star.len());
    let mut row = vec![(v as u32, own)];
    for &c in star {
        let [e, f] = neighbors(surface, c);
        row.extend([(e, edge), (f, face)]);
    }
    row
}

fn tangent_rows(surface: &Surface, star: &[u32]) -> [Row; 2] {
    let n = star.len();
    let constant = tangent_constant(n);
    let angle = |j: usize| std::f64::consts::TAU * j as f64 / n as f64;
    [f64::cos, f64::sin].map(|harmonic| {
        let mut row = Vec::with_capacity(2 * n);
        for (j, &c) in star.iter().enumerate() {
            let [e, f] = neighbors(surface, c);
            let (here, next) = (harmonic(angle(j)), harmonic(angle(j + 1)));
            row.extend([(e, constant * here), (f, here + next)]);
        }
        row
    })
}
