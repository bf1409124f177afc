//! The control mesh by the fastest way: what `--method auto` stands for.
//!
//! **How it picks.** One method wins wherever it applies: [Chebyshev in single precision with double-precision
//! corrections](crate::solvers::mixed) on the [matrix-free operator](Operator). It needs no inner products, its
//! iterations share passes over memory, and it moves half the bytes. What varies:
//!
//! - *Order.* A file whose vertices lie [scattered](is_scattered) is renumbered along a space-filling curve before
//!   anything else touches its faces; from [`ORDERED`] vertices on, the operator is then renumbered breadth first,
//!   which gives it the narrow band that groups of iterations need. Results come back in file order. Below, all
//!   arrays fit the second-level cache in any order.
//! - *Bounds.* With a proven λ_min > 0 the interval is `[λ_min, 1]`. Else (vertices of valence 3 under Catmull-Clark)
//!   it is found from the reductions seen.
//! - *Hard cases.* If that does not converge (λ_min below 10⁻⁴, a singular matrix), conjugate gradients on the same
//!   operator start from the given points: their count grows with √κ only, and they need no interval.
//!
//! Direct methods lose at every size tried, by `reports/scaling.md`.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use crate::assemble::Scheme;
use crate::assemble::operator::{Operator, gather};
use crate::error::Result;
use crate::mesh::order::{along_curve, is_scattered};
use crate::mesh::{Mesh, Topology};
use crate::solvers::conjugate_gradient::{ConjugateGradient, Preconditioner};
use crate::solvers::{Iterate, Method, Outcome, Report, Stop, mixed, solve};

/// From this many vertices on, the operator is renumbered. Tuned.
pub const ORDERED: usize = 50_000;

/// Control points, how they came about and what it cost.
#[derive(Clone, Debug)]
pub struct Automatic {
    /// V, in the order of the mesh.
    pub points: Vec<DVec3>,
    /// [`Method::Chebyshev`] or [`Method::Cg`].
    pub method: Method,
    pub report: Report,
    /// Renumbering along the curve, with the topology of the renumbered mesh; 0 where the order was good.
    pub curve_seconds: f64,
    /// Operator and its order.
    pub setup_seconds: f64,
    /// Iterations, and the way back to the order of the mesh.
    pub solve_seconds: f64,
}

/// Solves `A V = P` for the points P of a mesh that the validator has passed. `topology` is made where it is not
/// given.
///
/// # Errors
/// As [`Operator::new`].
///
/// ```
/// use limitlab::assemble::Scheme;
/// use limitlab::interpolate::automatic::control_points;
/// use limitlab::mesh::builtin;
/// use limitlab::solvers::{Outcome, Stop};
///
/// let mesh = builtin::builtin("quad-sphere:3")?;
/// let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
/// let found = control_points(&mesh, None, Scheme::CatmullClark, &stop)?;
/// assert_eq!(found.report.outcome, Outcome::Converged);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn control_points(
    mesh: &Mesh,
    topology: Option<&Topology>,
    scheme: Scheme,
    stop: &Stop,
) -> Result<Automatic> {
    let start = Instant::now();
    let curve = if mesh.len() >= ORDERED && is_scattered(&mesh.faces) {
        along_curve(mesh)
    } else {
        None
    };
    let Some((moved, order)) = curve else {
        let own;
        let topology = match topology {
            Some(topology) => topology,
            None => {
                own = Topology::new(&mesh.faces, mesh.len());
                &own
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        return in_order(mesh, topology, scheme, stop, seconds);
    };
    let topology = Topology::new(&moved.faces, moved.len());
    let seconds = start.elapsed().as_secs_f64();
    let mut found = in_order(&moved, &topology, scheme, stop, seconds)?;
    let start = Instant::now();
    found.points = back(&found.points, &order);
    found.solve_seconds += start.elapsed().as_secs_f64();
    Ok(found)
}

fn in_order(
    mesh: &Mesh,
    topology: &Topology,
    scheme: Scheme,
    stop: &Stop,
    curve_seconds: f64,
) -> Result<Automatic> {
    let start = Instant::now();
    let operator = Operator::new(&mesh.faces, topology, scheme)?;
    let (operator, order) = if mesh.len() >= ORDERED {
        let order = operator.front_order();
        (operator.renumbered(&order), Some(order))
    } else {
        (operator, None)
    };
    let setup_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let moved = order.as_ref().map(|order| gather(&mesh.positions, order));
    let points = moved.as_ref().unwrap_or(&mesh.positions);
    let (method, control, report) = iterate(&operator, points, stop);
    let points = match &order {
        Some(order) => back(&control, order),
        None => control,
    };
    Ok(Automatic {
        points,
        method,
        report,
        curve_seconds,
        setup_seconds,
        solve_seconds: start.elapsed().as_secs_f64(),
    })
}

fn iterate(operator: &Operator, points: &[DVec3], stop: &Stop) -> (Method, Vec<DVec3>, Report) {
    let bound = operator.bounds().lambda_min;
    let (control, report) = mixed::solve(operator, points, bound, stop);
    if !matches!(report.outcome, Outcome::Stagnated | Outcome::Diverged) {
        return (Method::Chebyshev, control, report);
    }
    let mut cg = ConjugateGradient::new(operator, points, Preconditioner::weights(operator));
    let report = solve(&mut cg, stop, &mut |_| ControlFlow::Continue(()));
    (Method::Cg, cg.points().to_vec(), report)
}

/// From an order back to the numbers: entry `order[k]` is the k-th of `values`.
fn back(values: &[DVec3], order: &[u32]) -> Vec<DVec3> {
    let place = crate::mesh::order::inverse(order);
    place
        .par_iter()
        .with_min_len(4096)
        .map(|&k| values[k as usize])
        .collect()
}
