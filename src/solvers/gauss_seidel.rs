//! Gauss-Seidel and SOR: in-place sweeps `v_i ← v_i + ω (p_i − (A v)_i)/a_ii` in a given vertex order.
//!
//! M is symmetric positive definite where A is non-singular, so every order converges for 0 < ω < 2 (ω = 1 is
//! Gauss-Seidel); the order changes the rate (Zheng-Cai §5). A sweep reads A once; testing the error of the
//! result reads it again. One array of N points. On a matrix-free operator with [one sum a face](Operator::sums_follow)
//! these are made once a sweep and follow each row that changes: O(faces) a row instead of O(corners of faces).

use std::ops::ControlFlow;

use glam::DVec3;

use super::coloured::Coloured;
use super::iteration::{
    Errors, Failure, Iterate, Outcome, PATIENCE, PROGRESS, Recorded, Report, Step, Stop, WarmStart, largest,
};
use super::system::{Rows, System, sweep_with};
use super::wavefront::Wavefront;
use crate::assemble::Operator;

/// Gauss-Seidel and SOR at work.
pub struct Sor<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    omega: f64,
    order: Option<&'a [u32]>,
    current: Vec<DVec3>,
    rows: Rows,
    sums: Vec<DVec3>,
}

impl<'a, S: System> Sor<'a, S> {
    /// Starts from V = P. `order[k]` is the vertex relaxed k-th; without it, the file's order.
    ///
    /// # Panics
    /// If the order names a vertex that the system lacks.
    pub fn new(system: &'a S, points: &'a [DVec3], omega: f64, order: Option<&'a [u32]>) -> Self {
        Sor { system, points, omega, order, current: points.to_vec(), rows: Rows::new(points.len()), sums: Vec::new() }
    }
}

impl<S: System> Iterate for Sor<'_, S> {
    fn errors(&mut self) -> Errors {
        self.rows.errors(self.system, self.points, &self.current)
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let n = self.points.len();
        let (system, points, omega, x, sums) =
            (self.system, self.points, self.omega, &mut self.current, &mut self.sums);
        match self.order {
            Some(order) => sweep_with(system, points, omega, order.iter().map(|&i| i as usize), x, sums),
            None => sweep_with(system, points, omega, 0..n, x, sums),
        }
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

impl<S: System> WarmStart for Sor<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
    }
}

/// Sweeps between two looks at the error.
const LOOK: usize = 8;

/// Solves `A V = P` from V = P by sweeps in the order of the operator's rows, several of them in one pass over memory
/// and on all cores ([`Wavefront::relax`]); every iterate is that of [`Sor`]. Errors are known after every few sweeps
/// only: as many as the observed rate asks for, 8 at the most. The report's history has an entry for each look.
///
/// # Panics
/// If there is not one point a vertex.
pub fn in_waves(operator: &Operator, points: &[DVec3], omega: f64, stop: &Stop) -> (Vec<DVec3>, Report) {
    let wavefront = Wavefront::new(operator);
    in_looks(operator, points, stop, &mut |_| ControlFlow::Continue(()), |count, x| {
        wavefront.relax(omega, count, points, x);
    })
}

/// As [`in_waves`], all rows that do not couple at once ([`Coloured::relax`]): for operators with their rows [colour by
/// colour](crate::mesh::colours::in_colours). On two threads waves take half to two thirds of the time, since a sweep
/// by colours reads the iterate once a colour; on many, waves run out of tasks before colours do.
///
/// # Panics
/// If there is not one point a vertex.
pub fn by_colours(operator: &Operator, points: &[DVec3], omega: f64, stop: &Stop) -> (Vec<DVec3>, Report) {
    by_colours_watched(operator, points, omega, stop, &mut |_| ControlFlow::Continue(()))
}

/// As [`by_colours`], with a watch that sees the iterate at each look, and may stop the run.
///
/// # Panics
/// As [`by_colours`].
pub fn by_colours_watched(
    operator: &Operator,
    points: &[DVec3],
    omega: f64,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> (Vec<DVec3>, Report) {
    let coloured = Coloured::new(operator);
    in_looks(operator, points, stop, watch, |count, x| {
        coloured.relax(omega, count, points, x);
    })
}

/// Calls `relax(count, x)` for `count` sweeps between two looks at the error.
fn in_looks(
    operator: &Operator,
    points: &[DVec3],
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
    relax: impl Fn(usize, &mut [DVec3]),
) -> (Vec<DVec3>, Report) {
    let mut rows = Rows::new(points.len());
    let mut x = points.to_vec();
    let size = largest(points);
    let mut history: Vec<Recorded> = Vec::new();
    let (mut iterations, mut count) = (0, LOOK);
    // The smallest error that was progress, and the sweeps before it.
    let mut progress = (f64::INFINITY, 0);
    let outcome = loop {
        let errors = rows.errors(operator, points, &x);
        let before = history.last().map(|e| e.errors.max);
        history.push(Recorded { iteration: iterations, errors });
        let told = watch(&Step { iteration: iterations, errors, points: &x });
        if let Some(outcome) = stop.verdict(errors.max, size, iterations, told) {
            break outcome;
        }
        if errors.max < (1.0 - PROGRESS) * progress.0 {
            progress = (errors.max, iterations);
        } else if before.is_some_and(|b| errors.max <= b) && iterations - progress.1 >= PATIENCE {
            // Not where the error grows: that ends as divergence.
            break Outcome::Stagnated;
        }
        if let Some(before) = before {
            let rate = (errors.max / before).ln() / count as f64;
            let needed = ((stop.tolerance / errors.max).ln() / rate).ceil();
            // Without progress there is no such number.
            count = if needed >= 1.0 && needed < LOOK as f64 { needed as usize } else { LOOK };
        }
        count = count.min(stop.max_iterations - iterations);
        relax(count, &mut x);
        iterations += count;
    };
    let report = Report { outcome, iterations, history, detail: None };
    (x, report)
}
