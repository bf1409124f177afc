//! The fairest of all first refined meshes whose surface meets the points, and normals if there are any.
//!
//! The surface passes through the centroid of a type-V face, with the normal of the face's first harmonic: the vectors
//! Σ cos(2πj/m) W_j and Σ sin(2πj/m) W_j span its tangent plane. So a point is one row, and a normal two, where Zheng & Cai
//! put the whole face into the plane: with m > 3 corners that asks for more than the normal. Type-V faces share no
//! vertices, and the method is [Halstead's](crate::interpolate::halstead) by projected conjugate gradients.

use std::ops::ControlFlow;

use glam::DVec3;

use super::energy::FirstFairness;
use crate::interpolate::halstead::energy::{Energies, Row, Weights};
use crate::interpolate::halstead::fit::require_anchors;
use crate::interpolate::halstead::projected::{Conditions, minimise};
use crate::interpolate::normals::unit_normals;
use crate::interpolate::zheng_cai::Constraints;
use crate::solvers::{Errors, Report, Step, Stop};
use crate::{Error, Result};

/// A first refined mesh of least energy.
#[derive(Clone, Debug)]
pub struct FairRefinement {
    /// Its vertices, one for each corner of the given mesh.
    pub points: Vec<DVec3>,
    /// The energies of its surface, unweighted.
    pub energies: Energies,
    /// The distances of the limit points from the given ones, in mesh units, over the interpolated vertices.
    pub errors: Errors,
    /// How it was found. The errors of its history are the steps, in mesh units, that would take the energy to its least
    /// value along one vertex at a time.
    pub report: Report,
}

/// Minimises WᵀKW, K the weighted forms of `fairness`, over the first refined meshes W with the given points as the
/// centroids of the type-V faces of interpolated vertices, (1/m) Σ W_j = I, all unless told; where a normal n is given also
/// under (Σ cos(2πj/m) W_j)·n = (Σ sin(2πj/m) W_j)·n = 0. The faces of other vertices go where the surface is fairest. A
/// positive membrane weight makes the minimum unique.
///
/// `start` is where the iterations begin: what meets the conditions next to it, and from there the energy falls, so that it
/// ends no higher than at [`FirstRefinement`](crate::interpolate::zheng_cai::FirstRefinement)s with the same wishes. 250 B a
/// corner with the energy; with all points the number of iterations does not grow with the mesh.
///
/// # Errors
/// Weights that are negative, not finite, or without a membrane part; a component without an interpolated vertex, which
/// could be anywhere; a normal without direction, or at a vertex that is not interpolated; shape handles, which scale what
/// is free here. Iterations that end otherwise than converged are no error: see the report.
///
/// # Panics
/// If there is not one point, and one entry in each list of `wishes`, a vertex, and one start a corner of the mesh
/// that `fairness` was made of.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use limitlab::interpolate::fair_refinement::{FirstFairness, fairest};
/// use limitlab::interpolate::halstead::Weights;
/// use limitlab::interpolate::zheng_cai::{Constraints, PhaseOne, interpolate};
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::Stop;
///
/// let surface = Surface::new(builtin::builtin("icosahedron")?)?;
/// let (all, weights) = (Constraints::default(), Weights::default());
/// let first = interpolate(&surface, &all, &PhaseOne::default())?.first.surface;
/// let fairness = FirstFairness::new(&surface)?;
/// let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
/// let (start, points) = (first.positions(), surface.positions());
/// let fair = fairest(&fairness, start, points, &all, weights, &stop, &mut |_| ControlFlow::Continue(()))?;
/// assert!(fair.errors.max < 1e-12);
/// assert!(fair.energies.weighted(weights) < fairness.energies(first.positions()).weighted(weights));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn fairest(
    fairness: &FirstFairness,
    start: &[DVec3],
    points: &[DVec3],
    wishes: &Constraints,
    weights: Weights,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Result<FairRefinement> {
    let given = fairness.given;
    assert_eq!(points.len(), given.len(), "one point a vertex");
    fairness.require_points(start);
    weights.check()?;
    wishes.check(points.len())?;
    require_no_handles(wishes)?;
    require_anchors(given, wishes, points.len())?;
    let normals = wishes.normals.map(unit_normals).transpose()?;
    let chosen: Vec<usize> = (0..points.len()).filter(|&v| wishes.is_interpolated(v)).collect();
    let conditions = |v: usize| {
        let mut star = Vec::new();
        given.topology().star(given.faces(), v, &mut star);
        let m = star.len() as f64;
        let row = |weight: &dyn Fn(f64) -> f64| -> Row {
            (0..).zip(&star).map(|(j, &c)| (c, weight(f64::from(j)))).collect()
        };
        let angle = |j: f64| std::f64::consts::TAU * j / m;
        let tangents = || [row(&|j| angle(j).cos()), row(&|j| angle(j).sin())];
        let normal = normals.as_ref().and_then(|normals| normals[v]);
        Conditions { limit: row(&|_| 1.0 / m), point: points[v], tangents: normal.map(|normal| (tangents(), normal)) }
    };
    let start = fairness.elements.there(start);
    let (found, report) = minimise(&fairness.elements, weights, start, &chosen, &conditions, stop, watch)?;
    let errors = centroid_errors(fairness, &found, points, &chosen);
    Ok(FairRefinement { energies: fairness.energies(&found), points: found, errors, report })
}

pub(super) fn require_no_handles(wishes: &Constraints) -> Result<()> {
    match wishes.handles {
        None => Ok(()),
        Some(_) => Err(Error::Computation(
            "shape handles scale the faces of interpolated vertices, which are what is chosen here: leave them out"
                .into(),
        )),
    }
}

/// The distances of the centroids of type-V faces from the points of the chosen vertices.
pub(super) fn centroid_errors(
    fairness: &FirstFairness,
    refined: &[DVec3],
    points: &[DVec3],
    chosen: &[usize],
) -> Errors {
    let incidence = fairness.given.incidence();
    let (mut max, mut sum) = (0.0f64, 0.0);
    for &v in chosen {
        let star = incidence.corners_at(v);
        let centroid = star.iter().map(|&c| refined[c as usize]).sum::<DVec3>() / star.len() as f64;
        let distance = centroid.distance(points[v]);
        max = if distance > max || distance.is_nan() { distance } else { max };
        sum += distance;
    }
    Errors { max, mean: sum / chosen.len() as f64 }
}
