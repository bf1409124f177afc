//! Control points in [stages](Stages): curves exactly, then the block of smooth vertices by any method.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::assemble::Stages;
use crate::solvers::{self, Method, Solution, Step, Stop};

/// Solves `A V = P`: the curves, then the block by `method` from V_S = P_S. The solution holds all vertices; its errors are
/// those of the block, the mean too.
///
/// # Panics
/// As [`solvers::run_from`].
///
/// ```
/// use limitlab::assemble::Stages;
/// use limitlab::interpolate::staged;
/// use limitlab::mesh::{Surface, builtin, features::Tags};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::{Method, Stop};
///
/// let cube = Surface::new(builtin::builtin("cube")?)?;
/// let top = [[4, 5], [5, 7], [7, 6], [6, 4]].map(|edge| (edge, 10.0));
/// let creased = cube.tagged(&Tags { creases: top.to_vec(), ..Tags::default() })?;
/// let stages = Stages::new(&creased, Scheme::CatmullClark, None)?;
/// let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
/// let control = staged::run(&stages, creased.positions(), Method::Cholesky, &stop).points;
/// let limit = stages.matrix().row_times(0, &control);
/// assert!(limit.distance(creased.positions()[0]) < 1e-12);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn run(stages: &Stages, points: &[DVec3], method: Method, stop: &Stop) -> Solution {
    run_watched(stages, points, method, stop, &mut |_| ControlFlow::Continue(()))
}

/// As [`run`], with a watch that sees every iterate, V_S. The order of a method is one of rows of the
/// [block](Stages::order).
///
/// # Panics
/// As [`run`].
pub fn run_watched(
    stages: &Stages,
    points: &[DVec3],
    method: Method,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    run_from(stages, points, points, method, stop, watch)
}

/// As [`run_watched`], from V = `start` on the smooth vertices instead of V = P.
///
/// # Panics
/// As [`run_watched`], and if there is not one point of the start a vertex.
pub fn run_from(
    stages: &Stages,
    points: &[DVec3],
    start: &[DVec3],
    method: Method,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    if stages.vertices().is_none() {
        return solvers::run_from(stages.block(), points, start, method, stop, watch);
    }
    let known = stages.known(points);
    let (right, start) = (stages.right_hand_side(&known), stages.restricted(start));
    let Solution { points: block, method, report, setup_seconds, solve_seconds, fill } =
        solvers::run_from(stages.block(), &right, &start, method, stop, watch);
    Solution { points: stages.joined(known, block), method, report, setup_seconds, solve_seconds, fill }
}
