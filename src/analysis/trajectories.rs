//! Trajectories of the eigenvalues of iteration matrices over ω: where the dominant one leaves the positive real axis, and whether
//! that is where the spectral radius is least.
//!
//! For small ω the dominant eigenvalue of every relaxation is 1 − ωλ_min and a little, real and positive. Of Jacobi and PIA it is
//! so until the other end of the spectrum, negative, has its modulus, at the best ω. Of SOR with a consistently ordered
//! matrix it meets another at Young's ω, and both leave the axis as a pair of modulus ω − 1: the best ω again. Elsewhere a pair
//! may overtake it first, or the pair that it becomes may shrink further.

use nalgebra::Complex;

use super::dense;
use super::iteration_matrix::IterationMatrix;
use super::young::best_omega;
use crate::error::{Error, Result};
use crate::solvers::{Method, System};

/// What becomes of the dominant eigenvalue on the positive real axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It meets another one, and both leave the axis as a pair.
    Leaves,
    /// It stays there, and a pair that is not real has a larger modulus.
    Overtaken,
    /// A negative one has a larger modulus.
    Opposite,
}

impl Change {
    /// In words, after "the dominant eigenvalue".
    pub fn name(self) -> &'static str {
        match self {
            Change::Leaves => "leaves the axis",
            Change::Overtaken => "is overtaken by a pair",
            Change::Opposite => "is overtaken by a negative one",
        }
    }
}

/// The eigenvalues of T over ω.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectories {
    /// Each ω with all eigenvalues there, the largest modulus first.
    pub rows: Vec<(f64, Vec<Complex<f64>>)>,
    /// Where the dominant eigenvalue ceases to be positive and real, to 10⁻³, and how; `None` where it does not between the first and
    /// the last ω.
    pub change: Option<(f64, Change)>,
    /// The ω of least ρ, to about 10⁻³, and that ρ.
    pub best: (f64, f64),
}

/// An imaginary part is one above this part of the modulus: double eigenvalues are good to the root of rounding.
const REAL: f64 = 1e-6;
/// The width to which an ω is found.
const WIDTH: f64 = 1e-3;
/// An eigenvalue that stays on the axis moves by no more than this over that width; one that meets another moves like the
/// root of the distance.
const STAYS: f64 = 5e-3;

impl Trajectories {
    /// Of a stationary method, whatever its ω, at ascending `omegas`. Dense, so up to [`dense::LARGEST`] unknowns: a second for each ω
    /// there, and some forty more for the two points.
    ///
    /// # Errors
    /// More unknowns; a method that is not stationary; if a computation does not converge.
    ///
    /// ```
    /// use limitlab::analysis::trajectories::{Change, Trajectories};
    /// use limitlab::assemble::LimitSystem;
    /// use limitlab::mesh::{Surface, builtin};
    /// use limitlab::schemes::Scheme;
    /// use limitlab::solvers::Method;
    ///
    /// let surface = Surface::new(builtin::builtin("torus:6x6")?)?;
    /// let system = LimitSystem::new(&surface, Scheme::CatmullClark)?;
    /// let jacobi = Trajectories::new(&system, Method::Jacobi { omega: None }, &[0.4, 0.6, 0.8, 1.0])?;
    /// // λ(D⁻¹A) from ¼ to 9/4: both ends have the modulus 0.8 at ω = 0.8.
    /// let (omega, change) = jacobi.change.expect("within the grid");
    /// assert!((omega - 0.8).abs() < 2e-3 && change == Change::Opposite);
    /// assert!((jacobi.best.0 - 0.8).abs() < 2e-3 && (jacobi.best.1 - 0.8).abs() < 1e-3);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn new<S: System>(system: &S, method: Method, omegas: &[f64]) -> Result<Self> {
        let n = system.len();
        if n > dense::LARGEST {
            return Err(Error::Computation(format!(
                "eigenvalues over ω of {n} vertices: they are computed up to {}; use a coarser mesh",
                dense::LARGEST
            )));
        }
        let at = |omega: f64| -> Result<Vec<Complex<f64>>> {
            let Some(method) = method.at_omega(omega) else {
                return Err(Error::Computation(format!("{method} has no ω")));
            };
            IterationMatrix::new(system, method)?.eigenvalues()
        };
        let rows: Vec<(f64, Vec<Complex<f64>>)> =
            omegas.iter().map(|&omega| Ok((omega, at(omega)?))).collect::<Result<_>>()?;
        let first = rows.iter().position(|(_, all)| !all.first().is_some_and(on_axis));
        let change = match first {
            Some(k) if k > 0 => Some(meeting(&at, rows[k - 1].clone(), rows[k].clone())?),
            Some(_) | None => None,
        };
        let largest = |all: &[Complex<f64>]| all.first().map_or(0.0, |z| z.norm());
        let radius = |omega: f64| match rows.iter().find(|row| row.0 == omega) {
            Some((_, all)) => Ok(largest(all)),
            None => Ok(largest(&at(omega)?)),
        };
        let best = best_omega(&radius)?;
        Ok(Trajectories { rows, change, best })
    }
}

/// Whether an eigenvalue is positive and real.
fn on_axis(z: &Complex<f64>) -> bool {
    z.re > 0.0 && z.im.abs() <= REAL * z.norm()
}

type Row = (f64, Vec<Complex<f64>>);

/// Between an ω where the dominant eigenvalue is on the axis and one where it is not.
fn meeting(at: &dyn Fn(f64) -> Result<Vec<Complex<f64>>>, mut before: Row, mut after: Row) -> Result<(f64, Change)> {
    while after.0 - before.0 > WIDTH {
        let omega = 0.5 * (before.0 + after.0);
        let all = at(omega)?;
        if all.first().is_some_and(on_axis) { before = (omega, all) } else { after = (omega, all) }
    }
    let (was, now) = (before.1[0].norm(), after.1[0]);
    let stays = || after.1.iter().any(|z| on_axis(z) && (z.re - was).abs() <= STAYS);
    let change = match () {
        () if now.im.abs() <= REAL * now.norm() => Change::Opposite,
        () if stays() => Change::Overtaken,
        () => Change::Leaves,
    };
    Ok((0.5 * (before.0 + after.0), change))
}
