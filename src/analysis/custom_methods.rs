//! Custom methods: a caller's own iterations, run and reported as those of the library.

use std::fmt;
use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;

use crate::assemble::LimitSystem;
use crate::solvers::system::Rows;
use crate::solvers::{Errors, Failure, Iterate, Method, Outcome, Recorded, Report, Solution, Stop, solve};

/// Makes an iteration for a system and its points, at V = P.
pub type Start<'s> =
    &'s (dyn for<'a> Fn(&'a LimitSystem, &'a [DVec3]) -> Result<Box<dyn Iterate + 'a>, Failure> + Sync);

/// A method that is not one of [`Method`]: a name, and what makes an [`Iterate`] of a system and its points.
///
/// It is run by the loop of all methods, from V = P, with their stopping rules; its errors must be those of the house,
/// max_i and mean_i ‖p_i − (A v)_i‖₂. That is checked where it costs nothing: at the start, and before it counts as
/// converged, by a product.
///
/// ```
/// use limitlab::analysis::custom_methods::Own;
/// use limitlab::assemble::LimitSystem;
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::{Outcome, Stop, pia::Pia};
///
/// // Richardson's iteration, as if it were not here.
/// let mine = Own {
///     name: "richardson".into(),
///     parameter: "ω=1.2".into(),
///     start: &|system, points| Ok(Box::new(Pia::new(system, points, 1.2))),
/// };
/// let surface = Surface::new(builtin::builtin("octahedron")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let solution = mine.run(&system, surface.positions(), &Stop { tolerance: 1e-9, max_iterations: 100 });
/// assert_eq!(solution.report.outcome, Outcome::Converged);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone)]
pub struct Own<'s> {
    /// What the method is called in reports.
    pub name: String,
    /// What else its row says: numbers, variants; may be empty.
    pub parameter: String,
    /// Makes the iteration; its time counts as set-up.
    pub start: Start<'s>,
}

impl fmt::Debug for Own<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Own").field("name", &self.name).field("parameter", &self.parameter).finish_non_exhaustive()
    }
}

/// The errors of the start that the method tells may differ by this part from what they are.
const SAME: f64 = 1e-6;

impl Own<'_> {
    /// Solves `A V = P` from V = P. A start that fails, and errors in another norm, are an outcome.
    ///
    /// # Panics
    /// If there is not one point a vertex, of `points` or of an iterate.
    pub fn run(&self, system: &LimitSystem, points: &[DVec3], stop: &Stop) -> Solution {
        assert_eq!(points.len(), system.len(), "one point a vertex");
        let mut rows = Rows::new(points.len());
        let begin = Instant::now();
        let started = (self.start)(system, points);
        let setup_seconds = begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let (points, report) = match started {
            Ok(method) => {
                let mut confirmed = Confirmed { method, system, points, rows, failure: None, begun: false };
                let report = solve(&mut confirmed, stop, &mut |_| ControlFlow::Continue(()));
                (confirmed.points().to_vec(), report)
            }
            Err(Failure { outcome, detail }) => {
                let history = vec![Recorded { iteration: 0, errors: rows.errors(system, points, points) }];
                (points.to_vec(), Report { outcome, iterations: 0, history, detail: Some(detail) })
            }
        };
        Solution {
            points,
            method: "own",
            report,
            setup_seconds,
            solve_seconds: begin.elapsed().as_secs_f64(),
            fill: None,
        }
    }
}

/// A method whose word is checked before a decision rests on it.
struct Confirmed<'a> {
    method: Box<dyn Iterate + 'a>,
    system: &'a LimitSystem,
    points: &'a [DVec3],
    rows: Rows,
    begun: bool,
    failure: Option<Failure>,
}

impl Confirmed<'_> {
    fn truth(&mut self) -> Errors {
        let current = self.method.points();
        assert_eq!(current.len(), self.points.len(), "one point a vertex");
        self.rows.errors(self.system, self.points, current)
    }
}

impl Iterate for Confirmed<'_> {
    fn errors(&mut self) -> Errors {
        let told = self.method.errors();
        if std::mem::replace(&mut self.begun, true) {
            return told;
        }
        let truth = self.truth();
        let differs = |a: f64, b: f64| (a - b).abs() > SAME * b.abs() || a.is_nan() != b.is_nan();
        if differs(told.max, truth.max) || differs(told.mean, truth.mean) {
            self.failure = Some(Failure {
                outcome: Outcome::Breakdown,
                detail: format!(
                    "the method tells an error of {:e} for its start, mean {:e}; max_i and mean_i ‖p_i − (A v)_i‖₂ are \
                     {:e} and {:e}",
                    told.max, told.mean, truth.max, truth.mean
                ),
            });
        }
        truth
    }

    fn confirm(&mut self, _: Errors) -> Errors {
        self.truth()
    }

    fn advance(&mut self) -> Result<(), Failure> {
        self.failure.take().map_or_else(|| self.method.advance(), Err)
    }

    fn points(&self) -> &[DVec3] {
        self.method.points()
    }
}

/// What a row of a comparison is about.
#[derive(Clone, Debug, PartialEq)]
pub enum Named<'a> {
    /// One of the methods here.
    Ours(Method<'a>),
    /// One of the caller's, by its name.
    Own(String),
}

impl Named<'_> {
    /// The name of the method, or the one that the caller gave.
    pub fn name(&self) -> &str {
        match self {
            Named::Ours(method) => method.name(),
            Named::Own(name) => name,
        }
    }

    /// [Passes](Method::passes) over the matrix in an iteration, where they are known.
    pub fn passes(&self) -> Option<usize> {
        match self {
            Named::Ours(method) => method.passes(),
            Named::Own(_) => None,
        }
    }

    /// Whether it is known to factor the matrix.
    pub fn is_direct(&self) -> bool {
        matches!(self, Named::Ours(method) if method.is_direct())
    }
}

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
