//! Runs that did not converge: what stood in the way, and what helps.

use glam::DVec3;

use super::singularity::{SingularComponent, Singularity};
use crate::mesh::Surface;
use crate::schemes::{Scheme, SingularSet};
use crate::solvers::{Method, Outcome, Report, Stop};

/// Errors of this many times ε·max‖p‖ are rounding: what methods leave on the edge of theirs.
const ROUNDING: f64 = 64.0;
/// What a singular system leaves to do, whatever the points.
const ANOTHER_SYSTEM: &str = "use --scheme nasri, which is never singular, or --scheme catmull-clark with --method \
                              halstead, whose control mesh is two refinements finer";

/// A run of A V = P that ended without a solution.
#[derive(Clone, Debug)]
pub struct Failed {
    /// As it was asked for; `None` where the program chose.
    method: Option<Method<'static>>,
    outcome: Outcome,
    max_error: f64,
    tolerance: f64,
    /// ε·max‖p‖.
    rounding: f64,
    verdict: Singularity,
}

impl Failed {
    /// A run on the positions of `surface`; on those marked as `interpolated` alone where there are marks. O(corners).
    pub fn new(
        (surface, scheme): (&Surface, Scheme),
        interpolated: Option<&[bool]>,
        method: Option<Method<'static>>,
        report: &Report,
        stop: &Stop,
    ) -> Self {
        let mut verdict = Singularity::detect(surface, scheme);
        let mut signs = verdict.colouring.iter().enumerate().filter(|(_, sign)| **sign != 0);
        // A vertex that stays holds the others: only whole components are singular.
        if interpolated.is_some_and(|marks| signs.any(|(v, _)| !marks[v])) {
            verdict.singular.clear();
        }
        let largest = surface.positions().iter().fold(DVec3::ZERO, |m, p| m.max(p.abs())).max_element();
        Failed {
            method,
            outcome: report.outcome,
            max_error: report.last().max,
            tolerance: stop.tolerance,
            rounding: f64::EPSILON * largest,
            verdict,
        }
    }

    /// Where the points have the largest part that no control mesh reaches, if it exceeds the tolerance: then no
    /// method converges.
    pub fn unreachable(&self) -> Option<&SingularComponent> {
        let size = |c: &SingularComponent| c.unreachable.length();
        let worst = self.verdict.singular.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        worst.filter(|c| self.verdict.excited && size(c) > self.tolerance)
    }

    /// A sentence for the user, with something to do that is not what has just failed. `unit` is what a length of one
    /// measures in the units of the mesh.
    pub fn advice(&self, unit: f64) -> String {
        if let Some(component) = self.unreachable() {
            return format!(
                "the points have a part that no control mesh reaches, {:.3e} at each of the {} vertices of the \
                 component of vertex {}, which has {}, so that the matrix is singular; {ANOTHER_SYSTEM}",
                unit * component.unreachable.length(),
                component.vertices,
                component.first_vertex,
                self.verdict.set.condition().unwrap_or_default()
            );
        }
        let reachable = unit * 2.0 * self.max_error;
        let chosen = self.method.is_some();
        match self.outcome {
            Outcome::MaxIterations if chosen => "the iterations ran out: raise --max-iter, or use --method auto".into(),
            Outcome::MaxIterations => "the iterations ran out: raise --max-iter".into(),
            Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown
                if self.max_error <= ROUNDING * self.rounding =>
            {
                format!(
                    "the error is the rounding of such coordinates, whose last digit is {:.1e}, and the tolerance lies \
                     below: use --tol-absolute {reachable:.0e}",
                    unit * self.rounding
                )
            }
            Outcome::Singular if chosen => {
                "the matrix is singular, but these points have a control mesh: use --method auto".into()
            }
            _ if chosen => "use --method auto".into(),
            _ => match self.verdict.set {
                SingularSet::Bipartite { .. } => format!("the matrix is singular, or nearly so; {ANOTHER_SYSTEM}"),
                SingularSet::Never => format!(
                    "the error that can be reached is larger than the tolerance: use --tol-absolute {reachable:.0e}"
                ),
            },
        }
    }
}
