//! The control mesh by the fastest way: what `--method auto` stands for.
//!
//! **How it picks.** One method wins wherever it applies: [Chebyshev in single precision with double-precision
//! corrections](crate::solvers::mixed) on the [matrix-free operator](Operator). It needs no inner products, its
//! iterations share passes over memory, and it moves half the bytes. What varies:
//!
//! - *Order.* A large mesh whose vertices lie [scattered](crate::mesh::curve::is_scattered) in memory has been renumbered
//!   along a space-filling curve by [`Surface`]. From [`ORDERED`] vertices on, the rows of the
//!   operator are [breadth first](in_fronts), which gives it the narrow band that groups of iterations need. Below, all
//!   arrays stay in cache in any order, and rows are [grouped by kind](in_kinds) only; so they are for mixed faces under
//!   Nasri and Zheng-Cai, where iterations are too few to pay for the search. Results come back in file order.
//! - *Bounds.* The interval starts at what λ_min usually is, or at the proven bound where that is higher; a correction
//!   that gains less than promised stretches it, down to the proven bound at the most.
//! - *Hard cases.* If that does not converge (λ_min below 10⁻⁴, a singular matrix), conjugate gradients on the same
//!   operator start from the given points: their count grows with √κ only, and they need no interval.
//!
//! Direct methods lose at every size tried, by `reports/scaling.md`.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;

use crate::assemble::Operator;
use crate::error::Result;
use crate::memory::require;
use crate::mesh::fronts::{in_fronts, in_kinds};
use crate::mesh::order::Numbering;
use crate::mesh::{Mesh, Surface};
use crate::schemes::Scheme;
use crate::solvers::conjugate_gradient::{ConjugateGradient, Preconditioner};
use crate::solvers::{Iterate, Method, Outcome, Report, Stop, mixed, solve};

/// From this many vertices on, the rows of the operator are breadth first. Tuned.
pub const ORDERED: usize = 200_000;
/// From this usual λ_min on (Nasri's), a score of iterations suffice, and on mixed faces that order does not pay. Tuned.
const FEW: f64 = 0.25;

/// Control points, how they came about and what it cost.
#[derive(Clone, Debug)]
pub struct Automatic {
    /// V, in the order of the mesh.
    pub points: Vec<DVec3>,
    /// [`Method::Chebyshev`] or [`Method::Cg`].
    pub method: Method<'static>,
    pub report: Report,
    /// The order of the rows, the operator.
    pub setup_seconds: f64,
    /// Iterations, and the way back to the order of the mesh.
    pub solve_seconds: f64,
}

/// Solves `A V = P` for the points P of a mesh.
///
/// # Errors
/// As [`require_memory`] and [`Operator::new`].
///
/// ```
/// use limitlab::schemes::Scheme;
/// use limitlab::interpolate::automatic::control_points;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::{Outcome, Stop};
///
/// let surface = Surface::new(builtin::builtin("quad-sphere:3")?)?;
/// let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
/// let found = control_points(&surface, Scheme::CatmullClark, &stop)?;
/// assert_eq!(found.report.outcome, Outcome::Converged);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn control_points(surface: &Surface, scheme: Scheme, stop: &Stop) -> Result<Automatic> {
    require_memory(surface.mesh())?;
    let start = Instant::now();
    let (operator, numbering) = operator(surface, scheme)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    // To the order of the rows, by way of that inside of the surface.
    let numberings = [surface.renumbered().map(|r| &r.numbering), numbering.as_ref()];
    let mut moved: Option<Vec<DVec3>> = None;
    for numbering in numberings.into_iter().flatten() {
        moved = Some(numbering.there(moved.as_deref().unwrap_or(surface.positions())));
    }
    let (method, mut points, report) = iterate(&operator, moved.as_deref().unwrap_or(surface.positions()), stop);
    for numbering in numberings.into_iter().rev().flatten() {
        let mut back = moved.take().unwrap_or_else(|| vec![DVec3::ZERO; points.len()]);
        numbering.back_into(&points, &mut back);
        moved = Some(std::mem::replace(&mut points, back));
    }
    Ok(Automatic { points, method, report, setup_seconds, solve_seconds: start.elapsed().as_secs_f64() })
}

/// Refuses a mesh whose topology, operator and iterates memory has no room for. The numbers are measured.
///
/// # Errors
/// [`Error::Memory`](crate::Error::Memory).
pub fn require_memory(mesh: &Mesh) -> Result<()> {
    let corners = mesh.faces.corners().len();
    // Lists of neighbours, where faces are not all of one size.
    let mixed = if mesh.faces.uniform_size().is_none() { 24 } else { 0 };
    let bytes = 64 * mesh.len() as u64 + (32 + mixed) * corners as u64;
    require(bytes, || format!("the work on {} vertices and {corners} corners", mesh.len()), "use a smaller mesh")
}

/// The operator, and the order of its rows where that is not the surface's, or not the one inside it.
fn operator(surface: &Surface, scheme: Scheme) -> Result<(Operator, Option<Numbering>)> {
    let (faces, incidence) = match surface.renumbered() {
        Some(renumbered) => (&renumbered.faces, &renumbered.incidence),
        None => (surface.faces(), surface.incidence()),
    };
    // Among mixed faces the search costs twice as much.
    let few = scheme.usual_lambda_min() >= FEW && faces.uniform_size().is_none();
    let numbering =
        if surface.len() >= ORDERED && !few { Some(in_fronts(faces, incidence)) } else { in_kinds(faces, incidence) };
    let rows = numbering.as_ref();
    let operator = match surface.renumbered() {
        Some(renumbered) => Operator::renumbered(surface, renumbered, scheme, rows)?,
        None => Operator::in_order(surface, scheme, rows)?,
    };
    Ok((operator, numbering))
}

fn iterate(operator: &Operator, points: &[DVec3], stop: &Stop) -> (Method<'static>, Vec<DVec3>, Report) {
    let (control, report) = mixed::solve(operator, points, stop);
    if !matches!(report.outcome, Outcome::Stagnated | Outcome::Diverged) {
        return (Method::Chebyshev { interval: None }, control, report);
    }
    let mut cg = ConjugateGradient::new(operator, points, Preconditioner::weights(operator));
    let report = solve(&mut cg, stop, &mut |_| ControlFlow::Continue(()));
    (Method::Cg, cg.points().to_vec(), report)
}
