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
pub(super) struct Conditions<'a> {
    /// The limit mask over fine vertices, and the point that it gives.
    pub(super) limit: &'a Row,
    pub(super) point: DVec3,
    /// The tangent masks, and the unit normal that they are perpendicular to.
    pub(super) tangents: Option<(&'a [Row; 2], DVec3)>,
}

/// The conditions of one ring as orthonormal rows over the scaled unknowns.
struct Ring {
    /// Places in the block.
    places: Vec<u32>,
    /// That of the limit, for all coordinates, and those of the tangents, along the normal. None if they vanish.
    rows: Vec<Vec<f64>>,
    normal: DVec3,
    /// What the rows give: a point, and numbers along the normal.
    limit: DVec3,
    slopes: Vec<f64>,
}

impl Ring {
    fn new(conditions: &Conditions, place: &[u32], first: usize, scale: &[f64]) -> Self {
        let mut places: Vec<u32> = conditions.limit.iter().map(|term| place[term.0 as usize] - first as u32).collect();
        places.sort_unstable();
        places.dedup();
        let scaled = |row: &Row| -> Vec<f64> {
            let mut values = vec![0.0; places.len()];
            for &(v, weight) in row {
                let local = place[v as usize] - first as u32;
                values[places.partition_point(|&p| p < local)] += weight * scale[place[v as usize] as usize];
            }
            values
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut limit_row = scaled(conditions.limit);
        let length = dot(&limit_row, &limit_row).sqrt();
        limit_row.iter_mut().for_each(|w| *w /= length);
        let limit = conditions.point / length;
        let mut rows = vec![limit_row];
        let mut slopes: Vec<f64> = Vec::new();
        let mut normal = DVec3::ZERO;
        if let Some((tangents, n)) = conditions.tangents {
            normal = n;
            for tangent in tangents {
                let mut row = scaled(tangent);
                let whole = dot(&row, &row).sqrt();
                // The condition is that the sum along the normal vanishes; what earlier rows have of it is known.
                let mut slope = 0.0;
                for (k, earlier) in rows.iter().enumerate() {
                    let part = dot(&row, earlier);
                    row.iter_mut().zip(earlier).for_each(|(w, e)| *w -= part * e);
                    slope -= part * if k == 0 { limit.dot(n) } else { slopes[k - 1] };
                }
                let length = dot(&row, &row).sqrt();
                if length > 1e-12 * whole {
                    row.iter_mut().for_each(|w| *w /= length);
                    rows.push(row);
                    slopes.push(slope / length);
                }
            }
        }
        Ring { places, rows, normal, limit, slopes }
    }

    /// Moves scaled unknowns to where the rows give `limit` and `slopes`.
    fn meet(&self, y: &mut [DVec3], limit: DVec3, slopes: impl Iterator<Item = f64>) {
        let (Some(first), rest) = (self.rows.first(), self.rows.get(1..).unwrap_or_default()) else { return };
        let sum =
            |row: &[f64], y: &[DVec3]| -> DVec3 { self.places.iter().zip(row).map(|(&p, w)| *w * y[p as usize]).sum() };
        let miss = limit - sum(first, y);
        self.places.iter().zip(first).for_each(|(&p, w)| y[p as usize] += *w * miss);
        for (row, slope) in rest.iter().zip(slopes) {
            let miss = (slope - sum(row, y).dot(self.normal)) * self.normal;
            self.places.iter().zip(row).for_each(|(&p, w)| y[p as usize] += *w * miss);
        }
    }

    /// Takes off what changes a condition.
    fn project(&self, y: &mut [DVec3]) {
        self.meet(y, DVec3::ZERO, std::iter::repeat(0.0));
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
    /// ‖rest‖².
    squared: f64,
    is_fresh: bool,
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

impl<'a> Minimiser<'a> {
    fn meet_conditions(&mut self) {
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        parallel::parts(elements.parts(&mut self.x), |k, x| {
            let scale = &scale[ranges[k.start].clone()];
            for ring in &rings[k.start] {
                ring.places.iter().for_each(|&p| x[p as usize] /= scale[p as usize]);
                ring.meet(x, ring.limit, ring.slopes.iter().copied());
                ring.places.iter().for_each(|&p| x[p as usize] *= scale[p as usize]);
            }
        });
    }

    /// rest ← −Q D^{-½} K x.
    fn evaluate(&mut self) {
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        elements.apply(&self.forms, &self.x, &mut self.rest, |k, _, y| {
            let scale = &scale[ranges[k].clone()];
            y.iter_mut().zip(scale).for_each(|(y, s)| *y *= -*s);
            rings[k].iter().for_each(|ring| ring.project(y));
        });
        self.is_fresh = true;
    }

    fn measure(&mut self) -> Errors {
        let scale = &self.scale;
        let mut sums = vec![Sums::default(); self.rest.len().div_ceil(CHUNK)];
        parallel::chunks_with(&mut self.rest, CHUNK, &mut sums, |first, rest, sums| {
            for (r, s) in rest.iter().zip(&scale[first..]) {
                let squared = r.length_squared();
                let length = squared.sqrt() * s;
                sums.squared += squared;
                sums.length += length;
                sums.max = if length > sums.max || length.is_nan() { length } else { sums.max };
            }
        });
        self.squared = sums.iter().map(|s| s.squared).sum();
        let max = sums.iter().fold(0.0, |max: f64, s| if s.max.is_nan() { f64::NAN } else { max.max(s.max) });
        Errors { max, mean: sums.iter().map(|s| s.length).sum::<f64>() / self.rest.len() as f64 }
    }

    /// direction ← D^{-½} rest + factor · direction.
    fn turn(&mut self, factor: f64) {
        let (rest, scale) = (&self.rest, &self.scale);
        parallel::change(&mut self.direction, |i, p| *p = scale[i] * rest[i] + factor * *p);
    }
}

impl Iterate for Minimiser<'_> {
    fn errors(&mut self) -> Errors {
        let before = self.squared;
        let errors = self.measure();
        if self.is_fresh {
            self.turn(0.0);
            self.is_fresh = false;
        } else {
            self.turn(self.squared / before);
        }
        errors
    }

    fn confirm(&mut self, errors: Errors) -> Errors {
        let _ = errors;
        self.meet_conditions();
        self.evaluate();
        let errors = self.measure();
        self.turn(0.0);
        self.is_fresh = false;
        errors
    }

    fn advance(&mut self) -> std::result::Result<(), Failure> {
        let (rings, scale, elements) = (&self.rings, &self.scale, self.elements);
        let ranges: Vec<_> = elements.blocks().collect();
        let curvatures = elements.apply(&self.forms, &self.direction, &mut self.product, |k, p, y| {
            let range = ranges[k].clone();
            let curvature: f64 = p[range.clone()].iter().zip(&*y).map(|(p, y)| p.dot(*y)).sum();
            y.iter_mut().zip(&scale[range]).for_each(|(y, s)| *y *= *s);
            rings[k].iter().for_each(|ring| ring.project(y));
            curvature
        });
        let curvature: f64 = curvatures.into_iter().sum();
        let step = self.squared / curvature;
        if !(curvature > 0.0 && step.is_finite()) {
            return Err(Failure {
                outcome: Outcome::Breakdown,
                detail: format!(
                    "the energy along the direction of iteration is {curvature:.1e}, none that can be minimised"
                ),
            });
        }
        let (direction, product) = (&self.direction, &self.product);
        parallel::change(&mut self.x, |i, x| *x += step * direction[i]);
        parallel::change(&mut self.rest, |i, r| *r -= step * product[i]);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.x
    }
}

/// The minimiser of the weighted energy among the control points that meet the conditions, in the order of the fine mesh.
/// The errors of an iterate are the steps, in mesh units, that would take the energy to its least value along one control
/// point at a time. The start is the point of the next given vertex.
pub(super) fn minimise(
    elements: &Elements,
    weights: Weights,
    points: &[DVec3],
    conditions: &[Conditions],
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
    let scale: Vec<f64> = diagonal.iter().map(|d| d.sqrt().recip()).collect();
    let place = elements.place();
    let blocks: Vec<_> = elements.blocks().collect();
    let mut of_block = vec![Vec::new(); blocks.len()];
    for (k, conditions) in conditions.iter().enumerate() {
        let at = conditions.limit.first().map_or(0, |term| place[term.0 as usize] as usize);
        of_block[blocks.partition_point(|range| range.end <= at)].push(k);
    }
    let rings = parallel::map(blocks.len(), 1, |b| {
        let first = blocks[b.start].start;
        of_block[b.start].iter().map(|&k| Ring::new(&conditions[k], place, first, &scale)).collect()
    });
    let n = place.len();
    let mut minimiser = Minimiser {
        elements,
        forms,
        scale,
        rings,
        x: elements.there(&elements.spread(points)),
        rest: vec![DVec3::ZERO; n],
        direction: vec![DVec3::ZERO; n],
        product: vec![DVec3::ZERO; n],
        squared: 0.0,
        is_fresh: true,
    };
    minimiser.meet_conditions();
    minimiser.evaluate();
    let size = largest(points);
    let report = solve_in_scale(&mut minimiser, size, stop, watch);
    minimiser.meet_conditions();
    Ok((elements.back(&minimiser.x), report))
}
