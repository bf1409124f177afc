//! The fairest surface through given points: a sparse constrained least-squares problem.

use std::sync::Arc;

use glam::DVec3;

use super::energy::{Energies, Fairness, Row, SharpMasks, Weights};
use crate::assemble::Csr;
use crate::assemble::csr::Pattern;
use crate::error::short;
use crate::interpolate::normals::unit_normals;
use crate::interpolate::zheng_cai::Constraints;
use crate::mesh::Surface;
use crate::mesh::incidence::{next_in, prev_in};
use crate::parallel;
use crate::schemes::catmull_clark::{limit_mask, tangent_constant};
use crate::solvers::Errors;
use crate::solvers::direct::{Cholesky, CholeskyForm, Factorization};
use crate::solvers::system::Rows;
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
}

/// ε and δ against weights of sum 1. Tuned: refinement gains three digits or more a step on all built-in meshes.
const PRIMAL_SHIFT: f64 = 1e-8;
const DUAL_SHIFT: f64 = 1e-6;
/// Steps of refinement at most.
const MOST_REFINEMENTS: usize = 20;
/// A fit that misses its points by more than this part of their size has failed: sums of ring points round at 10⁻¹⁵,
/// and the rest is room for the growth of the factorization.
const MISS: f64 = 1e-8;
/// Rows of one task.
const CHUNK: usize = 4096;

/// Minimises xᵀKx, K the weighted forms of `fairness`, over the fine control points x, under the limit masks' equations
/// at the interpolated vertices (all unless told), ℓ_v·x = P_v, and where a normal n is given under the tangent masks'
/// (τ·x)·n = 0 for both tangents. The other vertices go where the surface is fairest. On curves ℓ_v is ⅙(1, 4, 1), at
/// corners 1.
///
/// Solved by the Karush-Kuhn-Tucker system [K Cᵀ; C 0], symmetric and indefinite: with points alone one system of n + N
/// unknowns for all three coordinates; with normals, which couple them, one of 3n + 3N + 2·(normals). A positive membrane
/// weight makes it regular on every mesh. With small shifts, K + εI and −δI, it is quasi-definite and has an LDLᵀ
/// without pivoting in any order (Vanderbei 1995), which faer makes under minimum degree; refinement with the unshifted
/// matrix takes the shifts out again.
///
/// # Errors
/// Weights that are negative, not finite, or without a membrane part; a component without an interpolated vertex, which
/// could be anywhere; a normal without direction, or at a vertex that is sharp or not interpolated; shape handles, which
/// scale faces of Doo-Sabin surfaces; a factorization that breaks down or misses the constraints.
///
/// # Panics
/// If there is not one point, and one entry in each list of `wishes`, for each original vertex of the mesh that
/// `fairness` was made of.
pub fn fit(fairness: &Fairness, points: &[DVec3], wishes: &Constraints, weights: Weights) -> Result<Fit> {
    let valid = |w: f64| w >= 0.0 && w.is_finite();
    if !(valid(weights.thin_plate) && valid(weights.membrane) && weights.membrane > 0.0) {
        return Err(Error::Computation(format!(
            "the fairness weights {} (thin plate) and {} (membrane) must be finite, none negative, and the second \
             positive",
            short(weights.thin_plate),
            short(weights.membrane)
        )));
    }
    assert!(points.len() < fairness.fine.len(), "the given points, not the fine ones");
    wishes.check(points.len())?;
    if wishes.handles.is_some() {
        return Err(Error::NotOffered {
            what: "shape handles scale the type-V faces of Doo-Sabin surfaces, and the fairest surface is none".into(),
            schemes: &["zheng-cai", "nasri"],
        });
    }
    wishes.check_smooth(&fairness.fine)?;
    require_anchors(fairness, wishes, points.len())?;
    let normals = wishes.normals.map(unit_normals).transpose()?;
    let normals = normals.filter(|n| n.iter().any(Option::is_some));
    let chosen: Vec<usize> = (0..points.len()).filter(|&v| wishes.is_interpolated(v)).collect();
    let rings = Rings::new(fairness, points.len());
    let x = match normals {
        None => by_points(fairness, &rings, points, &chosen, weights)?,
        Some(normals) => by_normals(fairness, &rings, points, &chosen, &normals, weights)?,
    };
    let surface = fairness.fine.with_positions(x);
    let mut nothing = vec![(); chosen.len()];
    let totals = Rows::new(chosen.len()).pass_one(&mut nothing, |k, (), tally| {
        let v = chosen[k];
        let terms = rings.limits[v].iter();
        let limit: DVec3 = terms.map(|&(j, w)| w * surface.positions()[j as usize]).sum();
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
    Ok(Fit { energies: fairness.energies(surface.positions()), surface, errors: totals.errors })
}

/// Every component needs a point that holds it.
fn require_anchors(fairness: &Fairness, wishes: &Constraints, originals: usize) -> Result<()> {
    if wishes.interpolated.is_none() {
        return Ok(());
    }
    let (component, count) = fairness.fine.topology().components(fairness.fine.faces());
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

/// The masks of the original vertices as rows over the fine control points.
struct Rings {
    limits: Vec<Row>,
    /// Cosine and sine; none of sharp vertices.
    tangents: Vec<[Row; 2]>,
}

impl Rings {
    fn new(fairness: &Fairness, originals: usize) -> Self {
        let fine = &fairness.fine;
        let sharp = SharpMasks::new(fine);
        let mut star = Vec::new();
        let mut rings = Rings { limits: Vec::with_capacity(originals), tangents: Vec::with_capacity(originals) };
        for v in 0..originals {
            if let Some(row) = sharp.of(v, 1.0 / 6.0) {
                rings.limits.push(row);
                rings.tangents.push(Default::default());
                continue;
            }
            fine.topology().star(fine.faces(), v, &mut star);
            rings.limits.push(limit_row(fine, v, &star));
            rings.tangents.push(tangent_rows(fine, &star));
        }
        rings
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

/// Points alone: the coordinates do not know of each other.
fn by_points(
    fairness: &Fairness,
    rings: &Rings,
    points: &[DVec3],
    chosen: &[usize],
    weights: Weights,
) -> Result<Vec<DVec3>> {
    let n = fairness.fine.len();
    let mut kkt = Kkt::new(n);
    kkt.energy(fairness, weights, 0);
    let mut right = vec![DVec3::ZERO; n];
    for &v in chosen {
        kkt.constraint(rings.limits[v].iter().copied());
        right.push(points[v]);
    }
    let mut x = kkt.solve(right)?;
    x.truncate(n);
    Ok(x)
}

/// Points and normals: unknown 3i + axis, in the first coordinate of the solver's vectors.
fn by_normals(
    fairness: &Fairness,
    rings: &Rings,
    points: &[DVec3],
    chosen: &[usize],
    normals: &[Option<DVec3>],
    weights: Weights,
) -> Result<Vec<DVec3>> {
    let n = fairness.fine.len();
    let mut kkt = Kkt::new(3 * n);
    for axis in 0..3 {
        kkt.energy(fairness, weights, axis);
    }
    let mut right = vec![DVec3::ZERO; 3 * n];
    for &v in chosen {
        for axis in 0..3 {
            kkt.constraint(rings.limits[v].iter().map(|&(j, w)| (3 * j + axis, w)));
            right.push(DVec3::X * points[v][axis as usize]);
        }
        let Some(normal) = normals[v] else { continue };
        for tangent in &rings.tangents[v] {
            let terms = tangent.iter().flat_map(|&(j, w)| (0..3).map(move |a| (3 * j + a, w * normal[a as usize])));
            kkt.constraint(terms);
            right.push(DVec3::ZERO);
        }
    }
    let x = kkt.solve(right)?;
    let point = |i: usize| DVec3::new(x[3 * i].x, x[3 * i + 1].x, x[3 * i + 2].x);
    Ok((0..n).map(point).collect())
}

/// [K Cᵀ; C 0] while it is put together: one sorted list an unknown or multiplier.
struct Kkt {
    unknowns: usize,
    rows: Vec<Row>,
}

impl Kkt {
    fn new(unknowns: usize) -> Self {
        Kkt { unknowns, rows: vec![Row::new(); unknowns] }
    }

    /// Writes K for the unknowns of one axis; `unknowns` is once or three times the number of fine points.
    fn energy(&mut self, fairness: &Fairness, weights: Weights, axis: u32) {
        let n = fairness.fine.len();
        let stride = (self.unknowns / n) as u32;
        let (thin, membrane) = (&fairness.thin_plate, &fairness.membrane);
        for i in 0..n {
            let entries = thin.row(i).zip(membrane.row_values(i));
            let row = &mut self.rows[i * stride as usize + axis as usize];
            row.extend(
                entries.map(|((j, t), m)| (stride * j as u32 + axis, weights.thin_plate * t + weights.membrane * m)),
            );
        }
    }

    fn constraint(&mut self, terms: impl Iterator<Item = (u32, f64)>) {
        let multiplier = self.rows.len() as u32;
        // A vertex may be met twice in a ring; a vanishing weight must stay, for the pattern is symmetric.
        let mut terms: Row = terms.collect();
        terms.sort_by_key(|t| t.0);
        terms.dedup_by(|b, a| {
            let same = a.0 == b.0;
            if same {
                a.1 += b.1;
            }
            same
        });
        for &(j, w) in &terms {
            self.rows[j as usize].push((multiplier, w));
        }
        terms.push((multiplier, 0.0));
        self.rows.push(terms);
    }

    /// Solves by LDLᵀ of a nearby quasi-definite matrix and refinement with the true one.
    fn solve(self, right: Vec<DVec3>) -> Result<Vec<DVec3>> {
        let unknowns = self.unknowns;
        let mut offsets = vec![0u32];
        let mut columns = Vec::new();
        let (mut values, mut shifted) = (Vec::new(), Vec::new());
        for (i, row) in self.rows.iter().enumerate() {
            for &(j, value) in row {
                let shift = match (j as usize == i, i < unknowns) {
                    (false, _) => 0.0,
                    (true, true) => PRIMAL_SHIFT,
                    (true, false) => -DUAL_SHIFT,
                };
                columns.push(j);
                values.push(value);
                shifted.push(value + shift);
            }
            let end = u32::try_from(columns.len()).map_err(|_| Error::TooLarge {
                what: "the fairness system has more than 2³² − 1 entries".into(),
                advice: "use another method",
            })?;
            offsets.push(end);
        }
        let pattern = Arc::new(Pattern::new(offsets, columns));
        let matrix = Csr::new(Arc::clone(&pattern), values);
        let mut factors = Cholesky::new(&Csr::new(pattern, shifted), CholeskyForm::Ldlt).map_err(|f| {
            let what = format!("the fairness system cannot be factored: {}", f.detail);
            Error::Computation(what)
        })?;
        let ones = vec![1.0; matrix.len()];
        let mut x = vec![DVec3::ZERO; matrix.len()];
        let mut rest = right.clone();
        let mut smallest = f64::INFINITY;
        for _ in 0..MOST_REFINEMENTS {
            factors.solve(&ones, &mut rest);
            x.iter_mut().zip(&rest).for_each(|(x, d)| *x += *d);
            let mut largest = vec![0.0f64; rest.len().div_ceil(CHUNK)];
            parallel::chunks_with(&mut rest, CHUNK, &mut largest, |first, rest, largest| {
                for (i, r) in (first..).zip(rest) {
                    *r = right[i] - matrix.row_times(i, &x);
                    *largest = largest.max(r.abs().max_element());
                }
            });
            let largest = largest.into_iter().fold(0.0, f64::max);
            // The residual falls by a constant factor until it is rounding, and then no more.
            if largest.is_nan() || largest > 0.5 * smallest {
                break;
            }
            smallest = largest;
        }
        Ok(x)
    }
}
