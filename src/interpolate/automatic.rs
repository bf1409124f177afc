//! The control mesh by the fastest way: what `--method auto` stands for.
//!
//! **How it picks.** One method wins wherever it applies: [Chebyshev in single precision with double-precision
//! corrections](crate::solvers::mixed) on the [matrix-free operator](Operator). It needs no inner products, its
//! iterations share passes over memory, and it moves half the bytes. What varies:
//!
//! - *Order.* A file whose vertices lie [scattered](is_scattered) is renumbered along a space-filling curve before
//!   anything else touches its faces, from [`SCATTERED`] vertices on. From [`ORDERED`] vertices on, the rows of the
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
use crate::mesh::curve::{along_curve, is_scattered};
use crate::mesh::fronts::{in_fronts, in_kinds};
use crate::mesh::order::Numbering;
use crate::mesh::{Incidence, Mesh, Topology};
use crate::schemes::Scheme;
use crate::solvers::conjugate_gradient::{ConjugateGradient, Preconditioner};
use crate::solvers::{Iterate, Method, Outcome, Report, Stop, mixed, solve};

/// From this many vertices on, a scattered file is renumbered. Tuned.
pub const SCATTERED: usize = 50_000;
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
    pub method: Method,
    pub report: Report,
    /// Renumbering along the curve; 0 where the order was good.
    pub curve_seconds: f64,
    /// Who meets whom, the order of the rows, the operator.
    pub setup_seconds: f64,
    /// Iterations, and the way back to the order of the mesh.
    pub solve_seconds: f64,
}

/// Solves `A V = P` for the points P of a mesh that the validator has passed. `topology` spares a look
/// for boundaries where it is given.
///
/// # Errors
/// As [`require_memory`] and [`Operator::new`].
///
/// ```
/// use limitlab::schemes::Scheme;
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
pub fn control_points(mesh: &Mesh, topology: Option<&Topology>, scheme: Scheme, stop: &Stop) -> Result<Automatic> {
    require_memory(mesh)?;
    let start = Instant::now();
    let Some(moved) = renumbered(mesh) else {
        return in_order(mesh, topology, scheme, stop);
    };
    let seconds = start.elapsed().as_secs_f64();
    let mut found = moved.control_points(None, scheme, stop)?;
    found.curve_seconds = seconds;
    Ok(found)
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

/// A mesh along a space-filling curve.
#[derive(Clone, Debug)]
pub struct Renumbered {
    pub mesh: Mesh,
    pub numbering: Numbering,
}

/// `mesh` [along a curve](along_curve), if its vertices are [`SCATTERED`] or more and lie [scattered](is_scattered) in
/// memory: every pass over it is several times faster then.
pub fn renumbered(mesh: &Mesh) -> Option<Renumbered> {
    if mesh.len() < SCATTERED || !is_scattered(&mesh.faces) {
        return None;
    }
    let (mesh, numbering) = along_curve(mesh)?;
    Some(Renumbered { mesh, numbering })
}

impl Renumbered {
    /// As [`control_points`] of the mesh that was renumbered, in its order. `topology` is that of the renumbered mesh.
    ///
    /// # Errors
    /// As [`Operator::new`].
    pub fn control_points(&self, topology: Option<&Topology>, scheme: Scheme, stop: &Stop) -> Result<Automatic> {
        let mut found = in_order(&self.mesh, topology, scheme, stop)?;
        let start = Instant::now();
        found.points = self.numbering.back(&found.points);
        found.solve_seconds += start.elapsed().as_secs_f64();
        Ok(found)
    }
}

fn in_order(mesh: &Mesh, topology: Option<&Topology>, scheme: Scheme, stop: &Stop) -> Result<Automatic> {
    let start = Instant::now();
    let (operator, numbering) = operator(mesh, topology, scheme)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let moved = numbering.as_ref().map(|n| n.there(&mesh.positions));
    let points = moved.as_ref().unwrap_or(&mesh.positions);
    let (method, control, report) = iterate(&operator, points, stop);
    let points = match (numbering, moved) {
        (Some(numbering), Some(mut points)) => {
            numbering.back_into(&control, &mut points);
            points
        }
        _ => control,
    };
    Ok(Automatic {
        points,
        method,
        report,
        curve_seconds: 0.0,
        setup_seconds,
        solve_seconds: start.elapsed().as_secs_f64(),
    })
}

/// The operator, and the order of its rows where that is not the mesh's.
fn operator(mesh: &Mesh, topology: Option<&Topology>, scheme: Scheme) -> Result<(Operator, Option<Numbering>)> {
    let own;
    let incidence = match topology {
        Some(topology) => &topology.incidence,
        None => {
            own = Incidence::new(&mesh.faces, mesh.len());
            &own
        }
    };
    // Among mixed faces the search costs twice as much.
    let few = scheme.usual_lambda_min() >= FEW && mesh.faces.uniform_size().is_none();
    let number = || {
        if mesh.len() >= ORDERED && !few {
            Some(in_fronts(&mesh.faces, incidence))
        } else {
            in_kinds(&mesh.faces, incidence)
        }
    };
    // The search occupies one thread.
    let (numbering, closed) = rayon::join(number, || topology.is_some() || incidence.is_closed(&mesh.faces));
    let rows = numbering.as_ref();
    let operator = match topology {
        Some(topology) => Operator::in_order(&mesh.faces, topology, scheme, rows)?,
        None if closed => Operator::closed_in_order(&mesh.faces, incidence, scheme, rows)?,
        None => {
            let topology = Topology::new(&mesh.faces, mesh.len());
            Operator::in_order(&mesh.faces, &topology, scheme, rows)?
        }
    };
    Ok((operator, numbering))
}

fn iterate(operator: &Operator, points: &[DVec3], stop: &Stop) -> (Method, Vec<DVec3>, Report) {
    let (control, report) = mixed::solve(operator, points, stop);
    if !matches!(report.outcome, Outcome::Stagnated | Outcome::Diverged) {
        return (Method::Chebyshev, control, report);
    }
    let mut cg = ConjugateGradient::new(operator, points, Preconditioner::weights(operator));
    let report = solve(&mut cg, stop, &mut |_| ControlFlow::Continue(()));
    (Method::Cg, cg.points().to_vec(), report)
}
