//! The methods by name with their parameters, and one way to run any of them.

use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;
use std::time::Instant;

use glam::DVec3;

use super::anderson::{Anderson, WINDOW};
use super::chebyshev::Chebyshev;
use super::conjugate_gradient::{ConjugateGradient, Preconditioner};
use super::direct::{Cholesky, CholeskyForm, Direct, Factorization, SecondOpinion, SparseLu};
use super::gauss_seidel::Sor;
use super::heavy_ball::HeavyBall;
use super::incomplete_cholesky::IncompleteCholesky;
use super::iteration::{Errors, Failure, Outcome, Recorded, Report, Step, Stop, WarmStart, largest, solve_in_scale};
use super::jacobi::{Jacobi, THALL_OMEGA};
use super::pia::Pia;
use super::ssor::Ssor;
use super::system::{Entries, Rows, System};
use crate::assemble::LimitSystem;
use crate::error::Error;
use crate::names;

/// ω of `sor` unless told: about the best for all schemes on irregular meshes. Tuned on the sweeps in
/// `reports/`.
pub const SOR_OMEGA: f64 = 1.1;
/// ω of `ssor` and of the preconditioner `pcg-ssor`, where the symmetric sweep is little sensitive to it.
pub const SSOR_OMEGA: f64 = 1.0;
/// The part of λ_max where the interval of Chebyshev and of the heavy ball starts if no larger λ_min is proven: modes
/// beneath are left nearly as they are.
const LOWEST: f64 = 1e-3;

/// A method with its parameters.
///
/// A parameter that is `None` is the best that is known of the spectrum:
/// [`comparison::with_spectrum`](crate::analysis::comparison::with_spectrum) sets it by estimates, and [`run`] by the
/// [proven bounds](System::bounds), which are all that it knows. So does a name that is parsed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method<'a> {
    /// Sparse LU of A.
    Lu,
    /// Sparse Cholesky M = LLᵀ.
    Cholesky,
    /// M = LLᵀ by the second, independent library.
    SecondCholesky,
    /// Sparse M = LDLᵀ.
    Ldlt,
    /// Damped Jacobi.
    Jacobi {
        /// The damping; converges for 0 < ω < 2/λ_max(D⁻¹A).
        omega: Option<f64>,
    },
    /// Jacobi with ω = ½.
    Thall,
    /// Gauss-Seidel (GS-PIA), in a vertex order.
    GaussSeidel {
        /// `order[k]` is the vertex relaxed k-th; `None` stands for the order of the rows.
        order: Option<&'a [u32]>,
    },
    /// Successive over-relaxation, in a vertex order.
    Sor {
        /// The relaxation factor; converges for 0 < ω < 2 where A is non-singular.
        omega: f64,
        /// `order[k]` is the vertex relaxed k-th; `None` stands for the order of the rows.
        order: Option<&'a [u32]>,
    },
    /// Symmetric SOR, in a vertex order and back.
    Ssor {
        /// The relaxation factor; converges for 0 < ω < 2 where A is non-singular.
        omega: f64,
        /// `order[k]` is the vertex relaxed k-th; `None` stands for the order of the rows.
        order: Option<&'a [u32]>,
    },
    /// Progressive iterative approximation: ω = 1.
    Pia,
    /// PIA with a weight.
    WPia {
        /// The weight; converges for 0 < ω < 2/λ_max(A).
        omega: Option<f64>,
    },
    /// Chebyshev iteration on A, for the eigenvalues in an interval.
    Chebyshev {
        /// (λ_min, λ_max) with 0 < λ_min ≤ λ_max: the eigenvalues of A that the iteration is made for.
        interval: Option<(f64, f64)>,
    },
    /// Conjugate gradients (CG-PIA), preconditioned by H: they see the spectrum of A.
    Cg,
    /// Conjugate gradients on M as it is.
    PlainCg,
    /// Conjugate gradients preconditioned by diag(M)⁻¹.
    PcgJacobi,
    /// Conjugate gradients preconditioned by a symmetric SOR sweep.
    PcgSsor {
        /// The relaxation factor of the sweep, 0 < ω < 2.
        omega: f64,
    },
    /// Conjugate gradients preconditioned by incomplete Cholesky without fill.
    PcgIc0,
    /// Anderson acceleration with the last `window` differences.
    Anderson {
        /// The relaxation that is accelerated.
        of: Accelerated,
        /// The most differences kept, from 1 to [`MOST`](super::anderson::MOST).
        window: usize,
    },
    /// PIA with momentum, for the eigenvalues in an interval.
    HeavyBall {
        /// (λ_min, λ_max) with 0 < λ_min ≤ λ_max: the eigenvalues of A that the iteration is made for.
        interval: Option<(f64, f64)>,
    },
}

/// The relaxation that Anderson's acceleration is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accelerated {
    /// PIA; unless told, with ω = 1/λ_max: 1 for a scheme's matrix.
    Pia {
        /// The weight ω > 0 of the relaxation.
        omega: Option<f64>,
    },
    /// Jacobi, or Thall's masks.
    Jacobi {
        /// The damping; ½ for Thall's masks.
        omega: Option<f64>,
    },
}

impl<'a> Method<'a> {
    /// All by name, with the parameters that a name alone stands for.
    pub const ALL: [Method<'static>; 17] = [
        Method::Lu,
        Method::Cholesky,
        Method::Ldlt,
        Method::Jacobi { omega: None },
        Method::Thall,
        Method::GaussSeidel { order: None },
        Method::Sor { omega: SOR_OMEGA, order: None },
        Method::Ssor { omega: SSOR_OMEGA, order: None },
        Method::Pia,
        Method::WPia { omega: None },
        Method::Chebyshev { interval: None },
        Method::Cg,
        Method::PcgJacobi,
        Method::PcgSsor { omega: SSOR_OMEGA },
        Method::PcgIc0,
        Method::Anderson { of: Accelerated::Pia { omega: None }, window: WINDOW },
        Method::HeavyBall { interval: None },
    ];

    /// Further names of theirs: the literature's, and a short one.
    pub const ALIASES: [(&'static str, Method<'static>); 3] = [
        ("gs", Method::GaussSeidel { order: None }),
        ("gs-pia", Method::GaussSeidel { order: None }),
        ("cg-pia", Method::Cg),
    ];

    /// The name, which says nothing of parameters and variants.
    pub fn name(self) -> &'static str {
        match self {
            Method::Lu => "lu",
            Method::Cholesky | Method::SecondCholesky => "cholesky",
            Method::Ldlt => "ldlt",
            Method::Jacobi { .. } => "jacobi",
            Method::Thall => "thall",
            Method::GaussSeidel { .. } => "gauss-seidel",
            Method::Sor { .. } => "sor",
            Method::Ssor { .. } => "ssor",
            Method::Pia => "pia",
            Method::WPia { .. } => "w-pia",
            Method::Chebyshev { .. } => "chebyshev",
            Method::Cg | Method::PlainCg => "cg",
            Method::PcgJacobi => "pcg-jacobi",
            Method::PcgSsor { .. } => "pcg-ssor",
            Method::PcgIc0 => "pcg-ic0",
            Method::Anderson { .. } => "anderson",
            Method::HeavyBall { .. } => "heavy-ball",
        }
    }

    /// Whether the method factors the matrix.
    pub fn is_direct(self) -> bool {
        self.passes().is_none()
    }

    /// Passes over the entries of the matrix that an iteration makes, the test of its error included: what iterations of
    /// different methods cost beside each other. Both triangles of a factor without fill are one pass. `None` for a method
    /// that factors the matrix.
    ///
    /// ```
    /// use limitlab::solvers::Method;
    ///
    /// assert_eq!(Method::Pia.passes(), Some(1));
    /// assert_eq!(Method::GaussSeidel { order: None }.passes(), Some(2));
    /// ```
    pub fn passes(self) -> Option<usize> {
        match self {
            Method::Lu | Method::Cholesky | Method::SecondCholesky | Method::Ldlt => None,
            // One product gives both the error and the step.
            Method::Jacobi { .. }
            | Method::Thall
            | Method::Pia
            | Method::WPia { .. }
            | Method::Chebyshev { .. }
            | Method::Anderson { .. }
            | Method::HeavyBall { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi => Some(1),
            // The sweep, or both triangular solves, and a product.
            Method::GaussSeidel { .. } | Method::Sor { .. } | Method::PcgIc0 => Some(2),
            // Two sweeps and a product.
            Method::Ssor { .. } | Method::PcgSsor { .. } => Some(3),
        }
    }

    /// Whether the method needs A = H·M with a symmetric M: Cholesky and its relatives, conjugate gradients, and iterations made
    /// for an interval of eigenvalues, which have to be real. The others run on any A with a positive diagonal; that they
    /// converge is proven for symmetric M only.
    pub fn needs_symmetry(self) -> bool {
        match self {
            Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::HeavyBall { .. } => true,
            Method::Lu
            | Method::Jacobi { .. }
            | Method::Thall
            | Method::GaussSeidel { .. }
            | Method::Sor { .. }
            | Method::Ssor { .. }
            | Method::Pia
            | Method::WPia { .. }
            | Method::Anderson { .. } => false,
        }
    }

    /// Whether a step takes the error e to T e with one matrix T: relaxation and sweeps, which have an ω.
    pub fn is_stationary(self) -> bool {
        self.at_omega(1.0).is_some()
    }

    /// The error of a method that [needs symmetry](Self::needs_symmetry), on a matrix that has none because of this vertex.
    pub fn refused_at(self, vertex: usize) -> Error {
        let others = Method::ALL.into_iter().filter(|method| !method.needs_symmetry());
        Error::Unsymmetric { vertex, method: self.name(), others: others.map(Method::name).collect() }
    }

    /// The same in another vertex order, where the method sweeps in one.
    pub fn in_order(self, order: Option<&'a [u32]>) -> Self {
        match self {
            Method::GaussSeidel { .. } => Method::GaussSeidel { order },
            Method::Sor { omega, .. } => Method::Sor { omega, order },
            Method::Ssor { omega, .. } => Method::Ssor { omega, order },
            Method::Lu
            | Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::Jacobi { .. }
            | Method::Thall
            | Method::Pia
            | Method::WPia { .. }
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { .. }
            | Method::HeavyBall { .. } => self,
        }
    }

    /// The order that an in-place sweep goes in, where it is not that of the rows.
    pub fn order(self) -> Option<&'a [u32]> {
        match self {
            Method::GaussSeidel { order } | Method::Sor { order, .. } | Method::Ssor { order, .. } => order,
            Method::Lu
            | Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::Jacobi { .. }
            | Method::Thall
            | Method::Pia
            | Method::WPia { .. }
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { .. }
            | Method::HeavyBall { .. } => None,
        }
    }

    /// The ω of a [stationary](Self::is_stationary) method, where it is set.
    pub fn omega(self) -> Option<f64> {
        match self {
            Method::Jacobi { omega } | Method::WPia { omega } => omega,
            Method::Sor { omega, .. } | Method::Ssor { omega, .. } => Some(omega),
            Method::Thall => Some(THALL_OMEGA),
            Method::GaussSeidel { .. } | Method::Pia => Some(1.0),
            Method::Lu
            | Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { .. }
            | Method::HeavyBall { .. } => None,
        }
    }

    /// The same with another ω, where it is [stationary](Self::is_stationary): `thall` becomes `jacobi`, `pia` `w-pia`, and
    /// `gauss-seidel` `sor`.
    pub fn at_omega(self, omega: f64) -> Option<Self> {
        match self {
            Method::Jacobi { .. } | Method::Thall => Some(Method::Jacobi { omega: Some(omega) }),
            Method::Pia | Method::WPia { .. } => Some(Method::WPia { omega: Some(omega) }),
            Method::GaussSeidel { order } | Method::Sor { order, .. } => Some(Method::Sor { omega, order }),
            Method::Ssor { order, .. } => Some(Method::Ssor { omega, order }),
            Method::Lu
            | Method::Cholesky
            | Method::SecondCholesky
            | Method::Ldlt
            | Method::Chebyshev { .. }
            | Method::Cg
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { .. }
            | Method::HeavyBall { .. } => None,
        }
    }
}

impl fmt::Display for Method<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method<'static> {
    type Err = Error;

    fn from_str(s: &str) -> Result<Self, Error> {
        names::find("method", s, &Method::ALL.map(|method| (method.name(), method)), &Method::ALIASES)
    }
}

/// Control points, how they came about, and what it cost.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The last iterate V, one point a vertex.
    pub points: Vec<DVec3>,
    /// The name of the method that found it.
    pub method: &'static str,
    /// How the run ended, its iterations and the history of its errors.
    pub report: Report,
    /// Factorization or preconditioner, memory included.
    pub setup_seconds: f64,
    /// All iterations, with the errors of their history.
    pub solve_seconds: f64,
    /// Stored entries of the factors of a direct method, where the library tells.
    pub fill: Option<usize>,
}

/// Solves `A V = P` from V = P, on a stored matrix or without one. A set-up that fails (a singular matrix, a breakdown, a
/// factorization of a matrix that is not [stored](System::stored), a matrix [without
/// symmetry](crate::assemble::GeneralSystem) that the method [needs](Method::needs_symmetry)) is an outcome with the start as its history, and V = P.
///
/// # Panics
/// If there is not one point a vertex, or an order names a vertex that the system lacks.
///
/// ```
/// use limitlab::assemble::LimitSystem;
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::solvers::{Outcome, Method, Stop, run};
///
/// let surface = Surface::new(builtin::builtin("octahedron")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let stop = Stop { tolerance: 1e-9, max_iterations: 1000 };
/// let solution = run(&system, surface.positions(), Method::Pia, &stop);
/// assert_eq!(solution.report.outcome, Outcome::Converged);
/// // By symmetry the control mesh is a larger octahedron: opposite corners excite the eigenvalue 2β₄ − 1… only.
/// let v = solution.points[0];
/// assert!((system.a.row_times(0, &solution.points) - surface.positions()[0]).length() < 1e-9);
/// assert!(v.length() > surface.positions()[0].length());
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn run<S: System>(system: &S, points: &[DVec3], method: Method, stop: &Stop) -> Solution {
    run_watched(system, points, method, stop, &mut |_| ControlFlow::Continue(()))
}

/// As [`run`], with a watch that sees every iterate.
///
/// # Panics
/// As [`run`].
pub fn run_watched<S: System>(
    system: &S,
    points: &[DVec3],
    method: Method,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    run_from(system, points, points, method, stop, watch)
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
/// use limitlab::solvers::{Method, Step, Stop, run, run_from};
///
/// let surface = Surface::new(builtin::builtin("icosphere:2")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// // A rough solution, then on from there: the iterations of one run.
/// let (method, points) = (Method::Pia, surface.positions());
/// let stop = |tolerance| Stop { tolerance, max_iterations: 1000 };
/// let rough = run(&system, points, method, &stop(1e-3));
/// let watch = &mut |_: &Step<'_>| ControlFlow::Continue(());
/// let fine = run_from(&system, points, &rough.points, method, &stop(1e-9), watch);
/// let whole = run(&system, points, method, &stop(1e-9));
/// assert_eq!(rough.report.iterations + fine.report.iterations, whole.report.iterations);
/// assert_eq!(fine.points, whole.points);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn run_from<S: System>(
    system: &S,
    points: &[DVec3],
    start: &[DVec3],
    method: Method,
    stop: &Stop,
    watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
) -> Solution {
    assert_eq!(points.len(), system.len(), "one point a vertex");
    assert_eq!(start.len(), system.len(), "one point of the start a vertex");
    let elsewhere = !std::ptr::eq(points, start);
    let size = if elsewhere { largest(points).max(largest(start)) } else { largest(points) };
    let begin = Instant::now();
    let prepared = prepare(system, points, method);
    let setup_seconds = begin.elapsed().as_secs_f64();
    let (mut iterate, fill) = match prepared {
        Ok(prepared) => prepared,
        Err(failure) => return not_set_up(system, (points, start), method.name(), (failure, setup_seconds)),
    };
    let begin = Instant::now();
    if elsewhere {
        iterate.start_at(start);
    }
    let report = solve_in_scale(iterate.as_mut(), size, stop, watch);
    Solution {
        points: iterate.points().to_vec(),
        method: method.name(),
        report,
        setup_seconds,
        solve_seconds: begin.elapsed().as_secs_f64(),
        fill,
    }
}

/// Gives `work` the map e ↦ T e of a [stationary](Method::is_stationary) method: a step of its own, for P = 0.
///
/// # Errors
/// A method that is not stationary.
pub(crate) fn error_step<S: System, R>(
    system: &S,
    method: Method,
    work: impl FnOnce(&mut dyn FnMut(&mut [DVec3])) -> R,
) -> Result<R, Error> {
    let refused = |why: &str| Error::Computation(format!("{method} has no iteration matrix: {why}"));
    if !method.is_stationary() {
        return Err(refused("its step depends on those before, or on the data"));
    }
    let nothing = vec![DVec3::ZERO; system.len()];
    let (mut iterate, _) = prepare(system, &nothing, method).map_err(|failure| refused(&failure.detail))?;
    let mut failed = None;
    let result = work(&mut |x| {
        iterate.start_at(x);
        // It makes ready for the step.
        iterate.errors();
        failed = failed.take().or(iterate.advance().err());
        x.copy_from_slice(iterate.points());
    });
    match failed {
        None => Ok(result),
        Some(failure) => Err(refused(&failure.detail)),
    }
}

type Prepared<'a> = (Box<dyn WarmStart + 'a>, Option<usize>);

fn prepare<'a, S: System>(system: &'a S, points: &'a [DVec3], method: Method<'a>) -> Result<Prepared<'a>, Failure> {
    if method.needs_symmetry() && matches!(system.stored(), Some(Entries::Rows(_))) {
        return Err(without_symmetry(method));
    }
    let stored = || system.stored().ok_or_else(|| without_entries(method));
    let symmetric = || -> Result<&'a LimitSystem, Failure> {
        match stored()? {
            Entries::Factors(system) => Ok(system),
            Entries::Rows(_) => Err(without_symmetry(method)),
        }
    };
    let bounds = system.bounds();
    let jacobi_omega = |omega: Option<f64>| {
        omega.unwrap_or_else(|| 2.0 / (bounds.jacobi_lambda_min.max(0.0) + bounds.jacobi_lambda_max))
    };
    let pia_omega =
        |omega: Option<f64>| omega.unwrap_or_else(|| 2.0 / (bounds.lambda_min.max(0.0) + bounds.lambda_max));
    let proven = |interval: Option<(f64, f64)>| {
        interval.unwrap_or_else(|| (bounds.lambda_min.max(LOWEST * bounds.lambda_max), bounds.lambda_max))
    };
    let iterate: Box<dyn WarmStart + 'a> = match method {
        Method::Lu => {
            let factors = match stored()? {
                Entries::Factors(system) => SparseLu::new(system)?,
                Entries::Rows(a) => SparseLu::of_rows(a)?,
            };
            return direct(system, points, factors);
        }
        Method::Cholesky => return direct(system, points, Cholesky::new(&symmetric()?.m, CholeskyForm::Llt)?),
        Method::Ldlt => return direct(system, points, Cholesky::new(&symmetric()?.m, CholeskyForm::Ldlt)?),
        Method::SecondCholesky => return direct(system, points, SecondOpinion::new(&symmetric()?.m)?),
        Method::Jacobi { omega } => Box::new(Jacobi::new(system, points, jacobi_omega(omega))),
        Method::Thall => Box::new(Jacobi::new(system, points, THALL_OMEGA)),
        Method::GaussSeidel { order } => Box::new(Sor::new(system, points, 1.0, order)),
        Method::Sor { omega, order } => Box::new(Sor::new(system, points, omega, order)),
        Method::Ssor { omega, order } => Box::new(Ssor::new(system, points, omega, order)),
        Method::Pia => Box::new(Pia::new(system, points, 1.0)),
        Method::WPia { omega } => Box::new(Pia::new(system, points, pia_omega(omega))),
        Method::Anderson { of: Accelerated::Pia { omega }, window } => {
            let omega = omega.unwrap_or(1.0 / bounds.lambda_max);
            Box::new(Anderson::of_pia(system, points, omega, window))
        }
        Method::Anderson { of: Accelerated::Jacobi { omega }, window } => {
            Box::new(Anderson::of_jacobi(system, points, jacobi_omega(omega), window))
        }
        Method::HeavyBall { interval } => Box::new(HeavyBall::new(system, points, proven(interval))),
        Method::Chebyshev { interval } => Box::new(Chebyshev::new(system, points, proven(interval))),
        Method::Cg => cg(system, points, Preconditioner::weights(system)),
        Method::PlainCg => cg(system, points, Preconditioner::identity(system)),
        Method::PcgJacobi => cg(system, points, Preconditioner::jacobi(system)),
        Method::PcgSsor { omega } => cg(system, points, Preconditioner::Ssor { omega }),
        Method::PcgIc0 => {
            let factor = IncompleteCholesky::new(&symmetric()?.m)?;
            cg(system, points, Preconditioner::IncompleteCholesky(factor))
        }
    };
    Ok((iterate, None))
}

/// A factorization is asked of a system without stored matrices.
fn without_entries(method: Method) -> Failure {
    Failure {
        outcome: Outcome::Breakdown,
        detail: format!("{method} factors the matrix, and this system does not store it: assemble a LimitSystem"),
    }
}

/// A method for symmetric matrices is asked of one that is not.
fn without_symmetry(method: Method) -> Failure {
    Failure {
        outcome: Outcome::Breakdown,
        detail: format!("{method} needs a symmetric M, and no diagonal makes this matrix symmetric"),
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
    let iterate = Direct::new(system, points, factorization)?;
    Ok((Box::new(iterate), fill))
}

fn not_set_up<S: System>(
    system: &S,
    (points, start): (&[DVec3], &[DVec3]),
    method: &'static str,
    (failure, setup_seconds): (Failure, f64),
) -> Solution {
    let errors: Errors = Rows::new(points.len()).errors(system, points, start);
    Solution {
        points: start.to_vec(),
        method,
        report: Report {
            outcome: failure.outcome,
            iterations: 0,
            history: vec![Recorded { iteration: 0, errors }],
            detail: Some(failure.detail),
        },
        setup_seconds,
        solve_seconds: 0.0,
        fill: None,
    }
}
