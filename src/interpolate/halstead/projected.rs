//! The fairest surface by conjugate gradients among the surfaces that meet the points.
//!
//! With D the diagonal of K and x = D^{-½}y, the unknown y is scaled so that all control points weigh alike. The conditions at
//! one given vertex are about its 1-ring, and these are disjoint: made orthonormal in y, ring by ring, they give the
//! orthogonal projector Q onto what changes no condition, as a few sums a ring. The method runs on Q D^{-½} K D^{-½} Q (the
//! constraint preconditioner with D; Gould, Hribar & Nocedal 2001). Every point that is held pins the waves that are
//! long against the distance between held points, so that with all points the number of iterations does not
//! grow with the mesh.

use std::ops::ControlFlow;

use glam::DVec3;

use super::elements::Elements;
use super::energy::{Row, Weights};
use crate::parallel;
use crate::solvers::iteration::{largest, solve_in_scale};
use crate::solvers::{Errors, Failure, Iterate, Outcome, Report, Step, Stop};
use crate::{Error, Result};

/// What is asked at one given vertex.
pub(in crate::interpolate) struct Conditions {
    /// The limit mask over fine vertices, and the point that it gives.
    pub(in crate::interpolate) limit: Row,
    pub(in crate::interpolate) point: DVec3,
    /// The tangent masks, and the unit normal that they are perpendicular to.
    pub(in crate::interpolate) tangents: Option<([Row; 2], DVec3)>,
}

/// The conditions of one ring as orthonormal rows over the scaled unknowns.
struct Ring {
    /// Places in the block.
    places: Box<[u16]>,
    /// The row of the limit, for all coordinates, and the point that it gives.
    row: Box<[f64]>,
    limit: DVec3,
    tangents: Option<Box<Tangents>>,
}

/// The rows that are summed up along a normal.
struct Tangents {
    normal: DVec3,
    /// Each with what it gives.
    rows: Vec<(Vec<f64>, f64)>,
}

/// What is left of a row that depends on others, as a part of it.
const DEPENDENT: f64 = 1e-12;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Ring {
    fn new(conditions: &Conditions, place: &[u32], first: usize, scale: &[f64]) -> Self {
        let local = |v: u32| (place[v as usize] as usize - first) as u16;
        let mut places: Vec<u16> = conditions.limit.iter().map(|term| local(term.0)).collect();
        places.sort_unstable();
        places.dedup();
        let scaled = |row: &Row| -> Vec<f64> {
            let mut values = vec![0.0; places.len()];
            for &(v, weight) in row {
                values[places.partition_point(|&p| p < local(v))] += weight * scale[place[v as usize] as usize];
            }
            values
        };
        let unit = |mut row: Vec<f64>, length: f64| {
            row.iter_mut().for_each(|w| *w /= length);
            row
        };
        let row = scaled(&conditions.limit);
        let length = dot(&row, &row).sqrt();
        let (row, limit) = (unit(row, length), conditions.point / length);
        let tangents = conditions.tangents.as_ref().map(|(tangents, normal)| {
            let mut rows: Vec<(Vec<f64>, f64)> = Vec::new();
            for tangent in tangents {
                let mut own = scaled(tangent);
                let whole = dot(&own, &own).sqrt();
                // The sum along the normal shall vanish, and what earlier rows have of it is known.
                let mut slope = 0.0;
                let earlier = rows.iter().map(|(row, slope)| (row.as_slice(), *slope));
                for (row, given) in std::iter::once((row.as_slice(), limit.dot(*normal))).chain(earlier) {
                    let part = dot(&own, row);
                    own.iter_mut().zip(row).for_each(|(w, e)| *w -= part * e);
                    slope -= part * given;
                }
                let length = dot(&own, &own).sqrt();
                if length > DEPENDENT * whole {
                    rows.push((unit(own, length), slope / length));
                }
            }
            Box::new(Tangents { normal: *normal, rows })
        });
        Ring { places: places.into(), row: row.into(), limit, tangents }
    }

    fn sum(&self, row: &[f64], y: &[DVec3]) -> DVec3 {
        self.places.iter().zip(row).map(|(&p, w)| *w * y[p as usize]).sum()
    }

    fn add(&self, row: &[f64], change: DVec3, y: &mut [DVec3]) {
        self.places.iter().zip(row).for_each(|(&p, w)| y[p as usize] += *w * change);
    }

    /// Moves scaled unknowns to where the rows give `share` of what they should: 1, or 0 to take off all that changes a condition.
    fn meet(&self, share: f64, y: &mut [DVec3]) {
        self.add(&self.row, share * self.limit - self.sum(&self.row, y), y);
        let Some(tangents) = &self.tangents else { return };
        for (row, slope) in &tangents.rows {
            let miss = share * slope - self.sum(row, y).dot(tangents.normal);
            self.add(row, miss * tangents.normal, y);
        }
    }
}

/// The state of the method; all arrays in the order of the elements.
struct Minimiser<'a> {
    elements: &'a Elements,
    forms: Vec<Vec<f64>>,
    /// D^{-½}.
    scale: Vec<f64>,
    /// By block.
    rings: Vec<Vec<Ring>>,
    /// The iterate, unscaled.
    x: Vec<DVec3>,
    /// −Q D^{-½} K x, what is left of the gradient.
    rest: Vec<DVec3>,
    /// The direction, unscaled.
    direction: Vec<DVec3>,
    product: Vec<DVec3>,
    /// ‖rest‖², and of the iterate before where the direction goes on from it.
    squared: f64,
    before: Option<f64>,
    errors: Errors,
}

/// What the chunks of a vector add up.
#[derive(Clone, Copy, Default)]
struct Sums {
    squared: f64,
    max: f64,
    length: f64,
}

/// Elements of one task.
const CHUNK: usize = 4096;

impl Minimiser<'_> {
    /// The iterate; memory of all else is free then.
    fn into_points(self) -> Vec<DVec3> {
        self.x
    }

    fn meet_conditions(&mut self) {
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        parallel::parts(elements.parts(&mut self.x), |k, x| {
            let scale = &scale[ranges[k.start].clone()];
            for ring in &rings[k.start] {
                ring.places.iter().for_each(|&p| x[p as usize] /= scale[p as usize]);
                ring.meet(1.0, x);
                ring.places.iter().for_each(|&p| x[p as usize] *= scale[p as usize]);
            }
        });
    }

    /// rest ← −Q D^{-½} K x.
    fn evaluate(&mut self) {
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        elements.apply(&self.forms, &self.x, &mut self.rest, &|k, _, y: &mut [DVec3]| {
            let scale = &scale[ranges[k].clone()];
            y.iter_mut().zip(scale).for_each(|(y, s)| *y *= -*s);
            rings[k].iter().for_each(|ring| ring.meet(0.0, y));
        });
        self.before = None;
        self.walk(0.0);
    }

    /// x += step·direction and rest −= step·product, and what the new rest comes to.
    fn walk(&mut self, step: f64) {
        let (direction, product, scale) = (&self.direction, &self.product, &self.scale);
        let mut sums = vec![Sums::default(); self.rest.len().div_ceil(CHUNK)];
        parallel::chunks_of_two(&mut self.x, &mut self.rest, CHUNK, &mut sums, |first, x, rest, sums| {
            for (i, (x, r)) in (first..).zip(x.iter_mut().zip(rest)) {
                *x += step * direction[i];
                *r -= step * product[i];
                let squared = r.length_squared();
                let length = squared.sqrt() * scale[i];
                sums.squared += squared;
                sums.length += length;
                sums.max = if length > sums.max || length.is_nan() { length } else { sums.max };
            }
        });
        self.squared = sums.iter().map(|s| s.squared).sum();
        let max = sums.iter().fold(0.0, |max: f64, s| if s.max.is_nan() { f64::NAN } else { max.max(s.max) });
        let mean = sums.iter().map(|s| s.length).sum::<f64>() / self.rest.len() as f64;
        self.errors = Errors { max, mean };
    }

    /// direction ← D^{-½} rest + factor · direction.
    fn turn(&mut self, factor: f64) {
        let (rest, scale) = (&self.rest, &self.scale);
        parallel::change(&mut self.direction, |i, p| *p = scale[i] * rest[i] + factor * *p);
    }
}

/// The step along a direction p that takes the energy to its least value there: rᵀr / pᵀKp.
pub(in crate::interpolate) fn step_to_least(squared: f64, curvature: f64) -> std::result::Result<f64, Failure> {
    let step = squared / curvature;
    if curvature > 0.0 && step.is_finite() {
        return Ok(step);
    }
    let detail = format!("the energy along the direction of iteration is {curvature:.1e}, none that can be minimised");
    Err(Failure { outcome: Outcome::Breakdown, detail })
}

impl Iterate for Minimiser<'_> {
    fn errors(&mut self) -> Errors {
        self.errors
    }

    /// By a product; the method goes on from there as from a start.
    fn confirm(&mut self, _: Errors) -> Errors {
        self.meet_conditions();
        self.evaluate();
        self.errors
    }

    fn advance(&mut self) -> std::result::Result<(), Failure> {
        self.turn(self.before.map_or(0.0, |before| self.squared / before));
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        let curvatures =
            elements.apply(&self.forms, &self.direction, &mut self.product, &|k, p: &[DVec3], y: &mut [DVec3]| {
                let range = ranges[k].clone();
                let curvature: f64 = p[range.clone()].iter().zip(&*y).map(|(p, y)| p.dot(*y)).sum();
                y.iter_mut().zip(&scale[range]).for_each(|(y, s)| *y *= *s);
                rings[k].iter().for_each(|ring| ring.meet(0.0, y));
                curvature
            });
        let curvature: f64 = curvatures.into_iter().sum();
        let step = step_to_least(self.squared, curvature)?;
        self.before = Some(self.squared);
        self.walk(step);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.x
    }
}

/// The minimiser of the weighted energy among the control points that meet the conditions at the `chosen` given vertices, in the order of the fine mesh.
/// The errors of an iterate are the steps, in mesh units, that would take the energy to its least value along one control
/// point at a time. The start, in the order within, need not meet the conditions.
pub(in crate::interpolate) fn minimise(
    elements: &Elements,
    weights: Weights,
    start: Vec<DVec3>,
    chosen: &[usize],
    conditions: &(dyn Fn(usize) -> Conditions + Sync),
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Result<(Vec<DVec3>, Report)> {
    let forms = elements.weighted(weights);
    let diagonal = elements.diagonal(&forms);
    if !diagonal.iter().all(|&d| d > 0.0 && d.is_finite()) {
        return Err(Error::Computation(
            "the energy does not hold every control point in doubles: choose fairness weights nearer to 1".into(),
        ));
    }
    let scale: Vec<f64> = diagonal.into_iter().map(|d| d.sqrt().recip()).collect();
    let place = elements.place();
    let blocks: Vec<_> = elements.blocks().collect();
    let mut of_block = vec![Vec::new(); blocks.len()];
    let block_of = elements.block_of_given();
    chosen.iter().for_each(|&v| of_block[block_of[v] as usize].push(v));
    let rings = parallel::map(blocks.len(), 1, |b| {
        let first = blocks[b.start].start;
        of_block[b.start].iter().map(|&v| Ring::new(&conditions(v), place, first, &scale)).collect()
    });
    drop(of_block);
    let (n, size) = (place.len(), largest(&start));
    let mut minimiser = Minimiser {
        elements,
        forms,
        scale,
        rings,
        x: start,
        rest: vec![DVec3::ZERO; n],
        direction: vec![DVec3::ZERO; n],
        product: vec![DVec3::ZERO; n],
        squared: 0.0,
        before: None,
        errors: Errors { max: f64::NAN, mean: f64::NAN },
    };
    minimiser.meet_conditions();
    minimiser.evaluate();
    let report = solve_in_scale(&mut minimiser, size, stop, watch);
    minimiser.meet_conditions();
    Ok((elements.back(&minimiser.into_points()), report))
}
