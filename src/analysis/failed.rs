//! Diagnosis of runs that did not converge: what stood in the way.

use glam::DVec3;

use super::singularity::{SingularComponent, Singularity};
use crate::mesh::Surface;
use crate::mesh::features::Features;
use crate::schemes::Scheme;
use crate::solvers::iteration::FLOOR;
use crate::solvers::{Outcome, Report, Stop};

/// Errors of this many times ε·max‖p‖ are rounding: what methods leave on the edge of theirs.
const ROUNDING: f64 = 64.0;

/// A run of A V = P that ended without a solution.
#[derive(Clone, Debug)]
pub struct Failed {
    /// Whether a method was asked for; otherwise the chain of `auto` was run.
    pub chosen: bool,
    /// How the run ended.
    pub outcome: Outcome,
    /// The maximum error of the last iterate, in mesh units; NaN for an empty history.
    pub max_error: f64,
    /// The maximum error that was allowed, in mesh units.
    pub tolerance: f64,
    /// The last digit of the points: ε·max‖p‖.
    pub last_digit: f64,
    /// Components that are singular, but for those that vertices which stay hold.
    pub verdict: Singularity,
}

impl Failed {
    /// A run on the positions of `surface`; on those marked as `interpolated` alone where there are marks. O(corners).
    pub fn new(
        (surface, scheme): (&Surface, Scheme),
        interpolated: Option<&[bool]>,
        chosen: bool,
        report: &Report,
        stop: &Stop,
    ) -> Self {
        let mut verdict = Singularity::detect(surface, scheme);
        let mut signs = verdict.colouring.iter().enumerate().filter(|(_, sign)| **sign != 0);
        // A vertex that stays holds the others: only whole components are singular. And with darts the left null vector, by
        // which points that nothing reaches are told, is another than the colouring.
        let other_null_vector = surface.features().is_some_and(Features::has_stars);
        if other_null_vector || interpolated.is_some_and(|marks| signs.any(|(v, _)| !marks[v])) {
            verdict.singular.clear();
        }
        let largest = surface.positions().iter().fold(DVec3::ZERO, |m, p| m.max(p.abs())).max_element();
        Failed {
            chosen,
            outcome: report.outcome,
            max_error: report.last().max,
            tolerance: stop.tolerance,
            last_digit: f64::EPSILON * largest,
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

    /// A tolerance that this run would have met: twice its last error, and no less than twice what rounding leaves.
    pub fn reachable(&self) -> f64 {
        2.0 * self.max_error.max(FLOOR * self.last_digit)
    }

    /// Whether the error is as small as the digits of the points allow.
    pub fn is_rounding(&self) -> bool {
        self.outcome == Outcome::Rounding || self.max_error <= ROUNDING * self.last_digit
    }
}
