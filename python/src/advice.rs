//! What to do about a run that did not converge, in the words of Python.

use limitlab::analysis::failed::Failed;
use limitlab::schemes::SingularSet;
use limitlab::solvers::Outcome;

/// What a singular system leaves to do, whatever the points.
const ANOTHER_SYSTEM: &str = "use scheme=\"nasri\", which is never singular, or scheme=\"catmull-clark\" with \
                              method=\"halstead\", whose control mesh is two refinements finer";

/// Something to do that is not what has just failed. `unit` is what a length of one measures in the units of the mesh.
pub fn of_failed(failed: &Failed, unit: f64) -> String {
    if let Some(component) = failed.unreachable() {
        return format!(
            "the points have a part that no control mesh reaches, {:.3e} at each of the {} vertices of the component of \
             vertex {}, which has {}, so that the matrix is singular; {ANOTHER_SYSTEM}",
            unit * component.unreachable.length(),
            component.vertices,
            component.first_vertex,
            failed.verdict.set.condition().unwrap_or_default()
        );
    }
    let reachable = unit * failed.reachable();
    match failed.outcome {
        Outcome::MaxIterations if failed.chosen => {
            "the iterations ran out: raise max_iter, or use method=\"auto\"".into()
        }
        Outcome::MaxIterations => "the iterations ran out: raise max_iter".into(),
        Outcome::Rounding | Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown if failed.is_rounding() => {
            format!(
                "the error is the rounding of such coordinates, whose last digit is {:.1e}, and the tolerance lies below: \
                 use atol={reachable:.0e}",
                unit * failed.last_digit
            )
        }
        Outcome::Singular if failed.chosen => {
            "the matrix is singular, but these points have a control mesh: use method=\"auto\"".into()
        }
        _ if failed.chosen => "use method=\"auto\"".into(),
        _ => match failed.verdict.set {
            SingularSet::Bipartite { .. } => format!("the matrix is singular, or nearly so; {ANOTHER_SYSTEM}"),
            SingularSet::Never => {
                format!("the error that can be reached is larger than the tolerance: use atol={reachable:.0e}")
            }
        },
    }
}
