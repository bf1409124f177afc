//! ω sweeps: iterations and rates over a grid of ω, with the predicted spectral radius beside them.

use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use super::predict::predicted_rate;
use super::rate::observed_rate;
use super::spectrum::{Extremes, Spectra};
use super::symmetric::SymmetricForm;
use crate::error::Result;
use crate::solvers::{Errors, Method, Outcome, Step, Stop, System, run_from};

/// A method at one ω.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRow {
    /// As given with the grid; what ran is this method at `omega`.
    pub method: Method<'static>,
    /// The relaxation factor.
    pub omega: f64,
    /// How the run ended.
    pub outcome: Outcome,
    /// Updates of all vertices made.
    pub iterations: usize,
    /// The spectral radius of the error matrix.
    pub predicted_rho: f64,
    /// The same over the eigenvectors that the data excite; for relaxations whose spectrum is real.
    pub predicted_rho_data: Option<f64>,
    /// The factor per iteration fitted to the history's tail.
    pub observed_rate: Option<f64>,
    /// The last iterate's errors.
    pub errors: Errors,
}

/// The thresholds of one relaxation: of the matrix (for every start) and of the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Jacobi, Thall, PIA or W-PIA, as given with the grid.
    pub method: Method<'static>,
    /// The ends of the spectrum of D⁻¹A for Jacobi and Thall, of A for PIA and W-PIA; of its real parts where it is complex.
    pub ends: Extremes,
    /// ω beyond which the method diverges.
    pub critical_omega: f64,
    /// ω of the least radius.
    pub optimal_omega: f64,
    /// That radius.
    pub optimal_rho: f64,
    /// The ends of the part of the spectrum that the data excite; `None` if the start is the solution, or the spectrum complex.
    pub data: Option<Extremes>,
}

/// A sweep's result on one system.
#[derive(Clone, Debug, PartialEq)]
pub struct OmegaSweep {
    /// In the order of the grids; SOR has none.
    pub thresholds: Vec<Thresholds>,
    /// In the order of the grids; fewer than asked for while the sweep runs.
    pub rows: Vec<SweepRow>,
}

impl OmegaSweep {
    /// The ω with the fewest iterations among the converged rows of `method`, ties by smaller final error.
    pub fn best(&self, method: Method) -> Option<&SweepRow> {
        self.rows.iter().filter(|r| r.method == method && r.outcome == Outcome::Converged).min_by(|a, b| {
            (a.iterations, a.errors.max).partial_cmp(&(b.iterations, b.errors.max)).unwrap_or(std::cmp::Ordering::Equal)
        })
    }
}

/// What is told of a sweep as it goes.
#[derive(Clone, Copy, Debug)]
pub enum SweepEvent<'a> {
    /// An iterate of a method, as given with the grid, at an ω; first the start.
    Iterate(Method<'static>, f64, &'a Step<'a>),
    /// A run has ended: the rows that are there so far, in the order of the grids.
    Row(&'a OmegaSweep),
}

/// Rounding level of the errors of points of size `diagonal`: histories are not fitted below.
pub fn rounding_floor(diagonal: f64) -> f64 {
    64.0 * f64::EPSILON * diagonal
}

/// Runs every method at every ω of its grid on a system with these spectra, from V = `start` (P, unless there is reason for another), in parallel over the
/// grid.
///
/// `grids` pairs a method (Jacobi, PIA or SOR) with its values of ω; `order` is the vertex order of SOR;
/// `floor` the rounding level of the errors; `watch` is told of every iterate and of every row, from all threads.
///
/// # Errors
/// If an eigenvalue computation does not converge.
///
/// # Panics
/// If a method has no ω, or there is not one point a vertex in both.
pub fn sweep(
    (system, spectra): (&impl System, &(impl Spectra + Sync)),
    (points, start): (&[DVec3], &[DVec3]),
    grids: &[(Method<'static>, Vec<f64>)],
    order: Option<&[u32]>,
    stop: &Stop,
    floor: f64,
    watch: &(dyn Fn(SweepEvent) + Sync),
) -> Result<OmegaSweep> {
    let mut thresholds = Vec::new();
    for (method, _) in grids {
        let form = match method {
            Method::Jacobi { .. } | Method::Thall => SymmetricForm::Jacobi,
            Method::Pia | Method::WPia { .. } => SymmetricForm::A,
            Method::Lu
            | Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::GaussSeidel { .. }
            | Method::Sor { .. }
            | Method::Ssor { .. }
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { .. }
            | Method::HeavyBall { .. } => continue,
        };
        let (ends, critical_omega) = (spectra.ends(form), spectra.critical_omega(form));
        let optimal_omega = spectra.optimal_omega(form);
        let optimal_rho = spectra.radius(form, optimal_omega).unwrap_or_else(|| ends.radius(optimal_omega));
        let data = spectra.excited(system, (points, start), form)?;
        thresholds.push(Thresholds { method: *method, ends, critical_omega, optimal_omega, optimal_rho, data });
    }
    let jobs: Vec<(Method<'static>, f64)> =
        grids.iter().flat_map(|(method, omegas)| omegas.iter().map(|&omega| (*method, omega))).collect();
    // Beside the rows, the number of each.
    let found = Mutex::new((OmegaSweep { thresholds: thresholds.clone(), rows: Vec::new() }, Vec::new()));
    jobs.par_iter().enumerate().try_for_each(|(number, &(method, omega))| -> Result<()> {
        let Some(swept) = method.in_order(order).at_omega(omega) else {
            panic!("{method} is not swept over ω");
        };
        let told = &mut |step: &Step| {
            watch(SweepEvent::Iterate(method, omega, step));
            ControlFlow::Continue(())
        };
        let report = run_from(system, points, start, swept, stop, told).report;
        let predicted = predicted_rate(system, spectra, swept)?;
        let data = thresholds.iter().find(|t| t.method == method).and_then(|t| t.data);
        let row = SweepRow {
            method,
            omega,
            outcome: report.outcome,
            iterations: report.iterations,
            predicted_rho: predicted.unwrap_or(f64::NAN),
            predicted_rho_data: data.map(|d| d.radius(omega)),
            observed_rate: observed_rate(&report.maxima(), floor),
            errors: report.last(),
        };
        let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
        let (sweep, numbers) = &mut *found;
        let place = numbers.partition_point(|&n| n < number);
        numbers.insert(place, number);
        sweep.rows.insert(place, row);
        watch(SweepEvent::Row(sweep));
        Ok(())
    })?;
    Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner).0)
}
