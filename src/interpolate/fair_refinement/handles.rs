//! The shape handles that make a first refined mesh fairest.
//!
//! With D_v the centroid of the type-V face of v, the mesh W(s)_k = D_v + s_v(W_k − D_v) is linear in the handles s, and
//! its energy quadratic: with B the matrix of the arms W_k − D_v, one column a vertex, the best handles solve the symmetric
//! positive definite system BᵀKB s = −BᵀK W(0) of N unknowns. Conjugate gradients, with the diagonal of K for
//! a preconditioner, take one product with K an iteration.

use std::ops::ControlFlow;

use glam::DVec3;

use super::energy::FirstFairness;
use super::fit::{FairRefinement, centroid_errors, require_no_handles};
use crate::Result;
use crate::interpolate::halstead::energy::Weights;
use crate::interpolate::halstead::projected::step_to_least;
use crate::interpolate::zheng_cai::Constraints;
use crate::parallel;
use crate::solvers::iteration::{largest, solve_in_scale};
use crate::solvers::{Errors, Failure, Iterate, Step, Stop};

/// The best handles, and the mesh with them.
#[derive(Clone, Debug)]
pub struct FairHandles {
    /// One a vertex; 1 where none is free. The least energy may be at handles that are 0 or negative, which turn a face over: see
    /// [`fair_handles`].
    pub handles: Vec<f64>,
    /// The mesh with these handles. The errors of the history are the moves of the corners of one face, in mesh units, by
    /// the change of its handle that would take the energy to its least value along that one, about.
    pub refined: FairRefinement,
}

/// Minimises the weighted energy of the surface of `first`, a first refined mesh, over the shape handles of the interpolated
/// vertices, all unless told; with the handles of [`Constraints`] set to what is found, [`FirstRefinement`] makes the same mesh.
/// Centroids, and the planes of flat faces, stay, so that it interpolates as `first` does. A face without size has the handle 1.
///
/// Nothing keeps a handle positive: where the arms of neighbouring faces push a handle to 0 or below, its face shrinks to its point, or is
/// turned over, and the surface has a fold there.
///
/// [`FirstRefinement`]: crate::interpolate::zheng_cai::FirstRefinement
///
/// # Errors
/// Weights that are negative, not finite, or without a membrane part; handles in `wishes`, which are sought here.
/// Iterations that end otherwise than converged are no error: see the report.
///
/// # Panics
/// If there is not one point, and one entry in each list of `wishes`, a vertex, and one vertex of `first` a corner of the
/// mesh that `fairness` was made of.
pub fn fair_handles(
    fairness: &FirstFairness,
    first: &[DVec3],
    points: &[DVec3],
    wishes: &Constraints,
    weights: Weights,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Result<FairHandles> {
    let given = fairness.given;
    assert_eq!(points.len(), given.len(), "one point a vertex");
    fairness.require_points(first);
    weights.check()?;
    wishes.check(points.len())?;
    require_no_handles(wishes)?;
    let mut scaling = Scaling::new(fairness, first, wishes, weights);
    scaling.evaluate();
    let report = solve_in_scale(&mut scaling, largest(points), stop, watch);
    let mut handles = vec![1.0; points.len()];
    scaling.groups.iter().zip(&scaling.handles).for_each(|(group, &s)| handles[group.vertex as usize] = s);
    let refined = fairness.elements.back(&scaling.x);
    let chosen: Vec<usize> = (0..points.len()).filter(|&v| wishes.is_interpolated(v)).collect();
    let errors = centroid_errors(fairness, &refined, points, &chosen);
    let refined = FairRefinement { energies: fairness.energies(&refined), points: refined, errors, report };
    Ok(FairHandles { handles, refined })
}

/// The corners of one type-V face: places in the order of the elements.
struct Group {
    vertex: u32,
    start: u32,
    end: u32,
    /// d^{-½}, d the energy of the arms by the diagonal of K; 0 of a face that stays as it is.
    scale: f64,
    /// The longest arm.
    reach: f64,
}

impl Group {
    fn places(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// The state of the method; arrays of corners in the order of the elements, of handles in that of the groups.
struct Scaling<'a> {
    fairness: &'a FirstFairness<'a>,
    forms: Vec<Vec<f64>>,
    groups: Vec<Group>,
    /// The group of each corner.
    group_of: Vec<u32>,
    arms: Vec<DVec3>,
    x: Vec<DVec3>,
    handles: Vec<f64>,
    /// −D^{-½} Bᵀ K x, D the diagonal of the d.
    rest: Vec<f64>,
    /// The direction, unscaled.
    direction: Vec<f64>,
    /// B times it.
    field: Vec<DVec3>,
    product: Vec<DVec3>,
    squared: f64,
    before: Option<f64>,
}

impl<'a> Scaling<'a> {
    fn new(fairness: &'a FirstFairness, first: &[DVec3], wishes: &Constraints, weights: Weights) -> Self {
        let elements = &fairness.elements;
        let forms = elements.weighted(weights);
        let diagonal = elements.diagonal(&forms);
        let x = elements.there(first);
        let owners = elements.there(fairness.given.faces().corners());
        let mut groups: Vec<Group> = Vec::with_capacity(fairness.given.len());
        let mut arms = vec![DVec3::ZERO; x.len()];
        let mut group_of = Vec::with_capacity(x.len());
        let mut start = 0;
        for same in owners.chunk_by(|a, b| a == b) {
            let places = start..start + same.len();
            group_of.resize(places.end, groups.len() as u32);
            let centroid = x[places.clone()].iter().sum::<DVec3>() / same.len() as f64;
            let (mut energy, mut reach) = (0.0, 0.0f64);
            if wishes.is_interpolated(same[0] as usize) {
                for i in places.clone() {
                    arms[i] = x[i] - centroid;
                    energy += diagonal[i] * arms[i].length_squared();
                    reach = reach.max(arms[i].length());
                }
            }
            let scale = if energy > 0.0 { energy.sqrt().recip() } else { 0.0 };
            groups.push(Group { vertex: same[0], start: start as u32, end: places.end as u32, scale, reach });
            start = places.end;
        }
        let count = groups.len();
        Scaling {
            fairness,
            forms,
            groups,
            group_of,
            field: vec![DVec3::ZERO; x.len()],
            product: vec![DVec3::ZERO; x.len()],
            arms,
            x,
            handles: vec![1.0; count],
            rest: vec![0.0; count],
            direction: vec![0.0; count],
            squared: 0.0,
            before: None,
        }
    }

    /// rest ← −D^{-½} Bᵀ K x.
    fn evaluate(&mut self) {
        self.fairness.elements.apply(&self.forms, &self.x, &mut self.product, &|_, _: &[DVec3], _: &mut [DVec3]| ());
        let (groups, arms, product) = (&self.groups, &self.arms, &self.product);
        parallel::fill(&mut self.rest, |g| -along(&groups[g], arms, product));
        self.before = None;
        self.squared = self.rest.iter().map(|r| r * r).sum();
    }
}

/// The scaled sum of a field along the arms of a face.
fn along(group: &Group, arms: &[DVec3], field: &[DVec3]) -> f64 {
    group.scale * group.places().map(|i| arms[i].dot(field[i])).sum::<f64>()
}

impl Iterate for Scaling<'_> {
    fn errors(&mut self) -> Errors {
        let moves = self.groups.iter().zip(&self.rest).map(|(group, r)| (group.reach * group.scale * r).abs());
        let (mut max, mut sum) = (0.0f64, 0.0);
        for length in moves {
            max = if length > max || length.is_nan() { length } else { max };
            sum += length;
        }
        Errors { max, mean: sum / self.groups.len() as f64 }
    }

    /// By a product; the method goes on from there as from a start.
    fn confirm(&mut self, _: Errors) -> Errors {
        self.evaluate();
        self.errors()
    }

    fn advance(&mut self) -> std::result::Result<(), Failure> {
        let factor = self.before.map_or(0.0, |before| self.squared / before);
        let (groups, group_of, arms, rest) = (&self.groups, &self.group_of, &self.arms, &self.rest);
        parallel::change(&mut self.direction, |g, p| *p = groups[g].scale * rest[g] + factor * *p);
        let direction = &self.direction;
        parallel::fill(&mut self.field, |i| direction[group_of[i] as usize] * arms[i]);
        let elements = &self.fairness.elements;
        let blocks: Vec<_> = elements.blocks().collect();
        let curvatures =
            elements.apply(&self.forms, &self.field, &mut self.product, &|k, p: &[DVec3], y: &mut [DVec3]| {
                p[blocks[k].clone()].iter().zip(&*y).map(|(p, y)| p.dot(*y)).sum::<f64>()
            });
        let curvature: f64 = curvatures.into_iter().sum();
        let step = step_to_least(self.squared, curvature)?;
        self.before = Some(self.squared);
        let (product, field) = (&self.product, &self.field);
        parallel::change(&mut self.rest, |g, r| *r -= step * along(&groups[g], arms, product));
        parallel::change(&mut self.handles, |g, s| *s += step * direction[g]);
        parallel::change(&mut self.x, |i, x| *x += step * field[i]);
        self.squared = self.rest.iter().map(|r| r * r).sum();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.x
    }
}
