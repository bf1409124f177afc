//! The fairest surface by a factorization of the Karush-Kuhn-Tucker system [K Cᵀ; C 0], symmetric and indefinite: with
//! points alone one system of n + N unknowns for all three coordinates; with normals, which couple them, one of
//! 3n + 3N + 2·(normals). With small shifts, K + εI and −δI, it is quasi-definite and has an LDLᵀ without pivoting in any
//! order (Vanderbei 1995), which faer makes under minimum degree; refinement with the unshifted matrix takes the shifts out
//! again. Some 180 KB a vertex.

use std::sync::Arc;

use glam::DVec3;

use super::energy::{Fairness, Row, Weights};
use super::fit::Masks;
use crate::assemble::Csr;
use crate::assemble::csr::{Pattern, sum_columns};
use crate::parallel;
use crate::solvers::direct::{Cholesky, CholeskyForm, Factorization};
use crate::{Error, Result};

/// ε and δ against weights of sum 1. Tuned: refinement gains three digits or more a step on all built-in meshes.
const PRIMAL_SHIFT: f64 = 1e-8;
const DUAL_SHIFT: f64 = 1e-6;
/// Steps of refinement at most.
const MOST_REFINEMENTS: usize = 20;
/// Rows of one task.
const CHUNK: usize = 4096;

/// Points alone: the coordinates do not know of each other.
pub(super) fn by_points(
    fairness: &Fairness,
    masks: &Masks,
    points: &[DVec3],
    chosen: &[usize],
    weights: Weights,
) -> Result<Vec<DVec3>> {
    let n = fairness.fine.len();
    let forms = fairness.forms()?;
    let mut kkt = Kkt::new(n);
    kkt.energy(&forms, weights, 0);
    let mut right = vec![DVec3::ZERO; n];
    for &v in chosen {
        kkt.constraint(masks.limit(v).into_iter());
        right.push(points[v]);
    }
    let mut x = kkt.solve(right)?;
    x.truncate(n);
    Ok(x)
}

/// Points and normals: unknown 3i + axis, in the first coordinate of the solver's vectors.
pub(super) fn by_normals(
    fairness: &Fairness,
    masks: &Masks,
    points: &[DVec3],
    chosen: &[usize],
    normals: &[Option<DVec3>],
    weights: Weights,
) -> Result<Vec<DVec3>> {
    let n = fairness.fine.len();
    let forms = fairness.forms()?;
    let mut kkt = Kkt::new(3 * n);
    for axis in 0..3 {
        kkt.energy(&forms, weights, axis);
    }
    let mut right = vec![DVec3::ZERO; 3 * n];
    for &v in chosen {
        for axis in 0..3 {
            kkt.constraint(masks.limit(v).into_iter().map(|(j, w)| (3 * j + axis, w)));
            right.push(DVec3::X * points[v][axis as usize]);
        }
        let Some(normal) = normals[v] else { continue };
        for tangent in masks.tangents(v) {
            let terms = tangent.into_iter().flat_map(|(j, w)| (0..3).map(move |a| (3 * j + a, w * normal[a as usize])));
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
    fn energy(&mut self, forms: &[Csr; 2], weights: Weights, axis: u32) {
        let [thin, membrane] = forms;
        let n = thin.len();
        let stride = (self.unknowns / n) as u32;
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
        let mut terms: Row = terms.collect();
        // A vertex may be met twice in a ring; a vanishing weight must stay, for the pattern is symmetric.
        sum_columns(&mut terms);
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
