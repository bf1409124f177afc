//! The methods by name, and one way to run any of them.

use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;
use std::time::Instant;

use glam::DVec3;

use super::anderson::Anderson;
use super::chebyshev::Chebyshev;
use super::conjugate_gradient::{ConjugateGradient, Preconditioner};
use super::direct::{Cholesky, Direct, Factorization, Kind, SecondOpinion, SparseLu};
use super::gauss_seidel::Sor;
use super::heavy_ball::HeavyBall;
use super::incomplete_cholesky::IncompleteCholesky;
use super::iteration::{Errors, Failure, Outcome, Report, Step, Stop, WarmStart, largest, solve_in_scale};
use super::jacobi::{Jacobi, THALL_OMEGA};
use super::pia::Pia;
use super::ssor::Ssor;
use super::system::{Rows, System};
use crate::error::Error;

/// A method, without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Sparse LU of A.
    Lu,
    /// Sparse Cholesky M = LLᵀ.
    Cholesky,
    /// Sparse M = LDLᵀ.
    Ldlt,
    /// Damped Jacobi with a given ω.
    Jacobi,
    /// Jacobi with ω = ½.
    Thall,
    /// Gauss-Seidel (GS-PIA), in a vertex order.
    GaussSeidel,
    /// Successive over-relaxation, in a vertex order.
    Sor,
    /// Symmetric SOR, in a vertex order and back.
    Ssor,
    /// Progressive iterative approximation.
    Pia,
    /// PIA with a weight.
    WPia,
    /// Chebyshev iteration on A.
    Chebyshev,
    /// Conjugate gradients (CG-PIA), preconditioned by H: they see the spectrum of A.
    Cg,
    /// Conjugate gradients preconditioned by diag(M)⁻¹.
    PcgJacobi,
    /// Conjugate gradients preconditioned by a symmetric SOR sweep.
    PcgSsor,
    /// Conjugate gradients preconditioned by incomplete Cholesky without fill.
    PcgIc0,
    /// Anderson acceleration of PIA, of Thall's masks or of Jacobi.
    Anderson,
    /// PIA with momentum.
    HeavyBall,
}

impl Method {
    pub const ALL: [Method; 17] = [
        Method::Lu,
        Method::Cholesky,
        Method::Ldlt,
        Method::Jacobi,
        Method::Thall,
        Method::GaussSeidel,
        Method::Sor,
        Method::Ssor,
        Method::Pia,
        Method::WPia,
        Method::Chebyshev,
        Method::Cg,
        Method::PcgJacobi,
        Method::PcgSsor,
        Method::PcgIc0,
        Method::Anderson,
        Method::HeavyBall,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Method::Lu => "lu",
            Method::Cholesky => "cholesky",
            Method::Ldlt => "ldlt",
            Method::Jacobi => "jacobi",
            Method::Thall => "thall",
            Method::GaussSeidel => "gauss-seidel",
            Method::Sor => "sor",
            Method::Ssor => "ssor",
            Method::Pia => "pia",
            Method::WPia => "w-pia",
            Method::Anderson => "anderson",
            Method::HeavyBall => "heavy-ball",
            Method::Chebyshev => "chebyshev",
            Method::Cg => "cg",
            Method::PcgJacobi => "pcg-jacobi",
            Method::PcgSsor => "pcg-ssor",
            Method::PcgIc0 => "pcg-ic0",
        }
    }

    /// Whether the method factors the matrix.
    pub fn is_direct(self) -> bool {
        matches!(self, Method::Lu | Method::Cholesky | Method::Ldlt)
    }

    /// Whether the method depends on the vertex order.
    pub fn is_ordered(self) -> bool {
        matches!(self, Method::GaussSeidel | Method::Sor | Method::Ssor | Method::PcgSsor)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(s: &str) -> Result<Self, Error> {
        Method::ALL.into_iter().find(|m| m.name() == s).ok_or_else(|| {
            let names = Method::ALL.map(Method::name).join(", ");
            Error::Unknown(format!("unknown method \"{s}\"; the methods are {names}"))
        })
    }
}

/// A method with the numbers that it needs. The parameters come from bounds or estimates of the spectrum, which
/// this room does not make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setup<'a> {
    Lu,
    Cholesky,
    /// M = LLᵀ by the second, independent library.
    SecondCholesky,
    Ldlt,
    Jacobi {
        omega: f64,
    },
    Sor {
        omega: f64,
        order: Option<&'a [u32]>,
    },
    Ssor {
        omega: f64,
        order: Option<&'a [u32]>,
    },
    Pia {
        omega: f64,
    },
    /// PIA accelerated with the last `window` differences.
    AndersonPia {
        omega: f64,
        window: usize,
    },
    /// Jacobi accelerated, or Thall's masks.
    AndersonJacobi {
        omega: f64,
        window: usize,
    },
    HeavyBall {
        spectrum: (f64, f64),
    },
    Chebyshev {
        spectrum: (f64, f64),
    },
    /// Preconditioned by H.
    Cg,
    /// Not preconditioned: CG on M as it is.
    PlainCg,
    PcgJacobi,
    PcgSsor {
        omega: f64,
    },
    PcgIc0,
}

impl Setup<'_> {
    /// Thall's iteration.
    pub const THALL: Setup<'static> = Setup::Jacobi { omega: THALL_OMEGA };
}

/// Control points, how they came about, and what it cost.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The last iterate V, one point a vertex.
    pub points: Vec<DVec3>,
    pub report: Report,
    /// Factorization or preconditioner, memory included.
    pub setup_seconds: f64,
    /// All iterations, with the errors of their history.
    pub solve_seconds: f64,
    /// Stored entries of the factors of a direct method, where the library tells.
    pub fill: Option<usize>,
}

/// Solves `A V = P` from V = P, on a stored matrix or without one. A set-up that fails (a singular matrix, a breakdown, a
/// factorization of a matrix that is not [stored](System::stored)) is an outcome with the start as its history, and V = P.
///
/// # Panics
/// If there is not one point a vertex, or an order names a vertex that the system lacks.
///
/// ```
/// use limitlab::assemble::LimitSystem;
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::{Outcome, Setup, Stop, run};
///
/// let surface = Surface::new(builtin::builtin("octahedron")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let stop = Stop { tolerance: 1e-9, max_iterations: 1000 };
/// let solution = run(&system, surface.positions(), Setup::Pia { omega: 1.0 }, &stop);
/// assert_eq!(solution.report.outcome, Outcome::Converged);
/// // By symmetry the control mesh is a larger octahedron: opposite corners excite the eigenvalue 2β₄ − 1… only.
/// let v = solution.points[0];
/// assert!((system.a.row_times(0, &solution.points) - surface.positions()[0]).length() < 1e-9);
/// assert!(v.length() > surface.positions()[0].length());
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn run<S: System>(system: &S, points: &[DVec3], setup: Setup, stop: &Stop) -> Solution {
    run_watched(system, points, setup, stop, &mut |_| ControlFlow::Continue(()))
}

/// As [`run`], with a watch that sees every iterate.
///
/// # Panics
/// As [`run`].
pub fn run_watched<S: System>(
    system: &S,
    points: &[DVec3],
    setup: Setup,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    run_from(system, points, points, setup, stop, watch)
}

/// As [`run_watched`], from V = `start` instead of V = P: that of a mesh that has moved a little, or of a solution to be
/// made better. A direct method solves for the difference.
///
/// # Panics
/// As [`run`], and if there is not one point of the start a vertex.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::{Setup, Step, Stop, run, run_from};
///
/// let surface = Surface::new(builtin::builtin("icosphere:2")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// // A rough solution, then on from there: the iterations of one run.
/// let (setup, points) = (Setup::Pia { omega: 1.0 }, surface.positions());
/// let stop = |tolerance| Stop { tolerance, max_iterations: 1000 };
/// let rough = run(&system, points, setup, &stop(1e-3));
/// let watch = &mut |_: &Step<'_>| ControlFlow::Continue(());
/// let fine = run_from(&system, points, &rough.points, setup, &stop(1e-9), watch);
/// let whole = run(&system, points, setup, &stop(1e-9));
/// assert_eq!(rough.report.iterations + fine.report.iterations, whole.report.iterations);
/// assert_eq!(fine.points, whole.points);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn run_from<S: System>(
    system: &S,
    points: &[DVec3],
    start: &[DVec3],
    setup: Setup,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    assert_eq!(points.len(), system.len(), "one point a vertex");
    assert_eq!(start.len(), system.len(), "one point of the start a vertex");
    let elsewhere = !std::ptr::eq(points, start);
    let size = if elsewhere { largest(points).max(largest(start)) } else { largest(points) };
    let begin = Instant::now();
    let prepared = prepare(system, points, setup);
    let setup_seconds = begin.elapsed().as_secs_f64();
    let (mut method, fill) = match prepared {
        Ok(prepared) => prepared,
        Err(failure) => return not_set_up(system, (points, start), failure, setup_seconds),
    };
    let begin = Instant::now();
    if elsewhere {
        method.start_at(start);
    }
    let report = solve_in_scale(method.as_mut(), size, stop, watch);
    Solution {
        points: method.points().to_vec(),
        report,
        setup_seconds,
        solve_seconds: begin.elapsed().as_secs_f64(),
        fill,
    }
}

type Prepared<'a> = (Box<dyn WarmStart + 'a>, Option<usize>);

fn prepare<'a, S: System>(system: &'a S, points: &'a [DVec3], setup: Setup<'a>) -> Result<Prepared<'a>, Failure> {
    let stored = || system.stored().ok_or_else(|| without_entries(setup));
    let method: Box<dyn WarmStart + 'a> = match setup {
        Setup::Lu => return direct(system, points, SparseLu::new(stored()?)?),
        Setup::Cholesky => return direct(system, points, Cholesky::new(&stored()?.m, Kind::Llt)?),
        Setup::Ldlt => return direct(system, points, Cholesky::new(&stored()?.m, Kind::Ldlt)?),
        Setup::SecondCholesky => return direct(system, points, SecondOpinion::new(&stored()?.m)?),
        Setup::Jacobi { omega } => Box::new(Jacobi::new(system, points, omega)),
        Setup::Sor { omega, order } => Box::new(Sor::new(system, points, omega, order)),
        Setup::Ssor { omega, order } => Box::new(Ssor::new(system, points, omega, order)),
        Setup::Pia { omega } => Box::new(Pia::new(system, points, omega)),
        Setup::AndersonPia { omega, window } => Box::new(Anderson::of_pia(system, points, omega, window)),
        Setup::AndersonJacobi { omega, window } => Box::new(Anderson::of_jacobi(system, points, omega, window)),
        Setup::HeavyBall { spectrum } => Box::new(HeavyBall::new(system, points, spectrum)),
        Setup::Chebyshev { spectrum } => Box::new(Chebyshev::new(system, points, spectrum)),
        Setup::Cg => cg(system, points, Preconditioner::weights(system)),
        Setup::PlainCg => cg(system, points, Preconditioner::identity(system)),
        Setup::PcgJacobi => cg(system, points, Preconditioner::jacobi(system)),
        Setup::PcgSsor { omega } => cg(system, points, Preconditioner::Ssor { omega }),
        Setup::PcgIc0 => {
            let factor = IncompleteCholesky::new(&stored()?.m)?;
            cg(system, points, Preconditioner::IncompleteCholesky(factor))
        }
    };
    Ok((method, None))
}

/// A factorization is asked of a system without stored matrices.
fn without_entries(setup: Setup) -> Failure {
    Failure {
        outcome: Outcome::Breakdown,
        detail: format!("{setup:?} factors the matrix, and this system does not store it: assemble a LimitSystem"),
    }
}

fn cg<'a, S: System>(system: &'a S, points: &'a [DVec3], preconditioner: Preconditioner) -> Box<dyn WarmStart + 'a> {
    Box::new(ConjugateGradient::new(system, points, preconditioner))
}

fn direct<'a, S: System, F: Factorization + 'a>(
    system: &'a S,
    points: &'a [DVec3],
    factorization: F,
) -> Result<Prepared<'a>, Failure> {
    let fill = factorization.fill();
    let method = Direct::new(system, points, factorization)?;
    Ok((Box::new(method), fill))
}

fn not_set_up<S: System>(
    system: &S,
    (points, start): (&[DVec3], &[DVec3]),
    failure: Failure,
    setup_seconds: f64,
) -> Solution {
    let errors: Errors = Rows::new(points.len()).errors(system, points, start);
    Solution {
        points: start.to_vec(),
        report: Report { outcome: failure.outcome, iterations: 0, history: vec![errors], detail: Some(failure.detail) },
        setup_seconds,
        solve_seconds: 0.0,
        fill: None,
    }
}
