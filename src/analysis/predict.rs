//! Predicted convergence rates: what theory says of each method, as a factor per iteration.

use glam::DVec3;

use super::spectral_radius::sweep_radius;
use super::spectrum::{Extremes, Spectra};
use super::symmetric::SymmetricForm;
use crate::error::Result;
use crate::solvers::jacobi::THALL_OMEGA;
use crate::solvers::ssor::symmetric_sweep;
use crate::solvers::system::{Rows, sweep};
use crate::solvers::{Method, System};

/// The predicted factor per iteration of a method on a system with the given spectra, whose best parameters stand for those
/// that are open. For relaxation it is the
/// spectral radius of the error matrix; for the heavy ball, Chebyshev and conjugate gradients (√κ−1)/(√κ+1), which
/// conjugate gradients may beat. `None` for direct methods, where no prediction is made (Anderson acceleration, plain
/// and incomplete-Cholesky conjugate gradients), and of methods made for real spectra where they are complex.
///
/// # Errors
/// If the spectral radius of a sweep cannot be computed.
pub fn predicted_rate(system: &impl System, spectra: &impl Spectra, method: Method) -> Result<Option<f64>> {
    let relaxed = |form, omega: Option<f64>| -> Result<Option<f64>> {
        let omega = omega.unwrap_or_else(|| spectra.optimal_omega(form));
        match spectra.radius(form, omega) {
            Some(radius) => Ok(Some(radius)),
            None => Ok(Some(relaxation_radius(system, form, omega)?)),
        }
    };
    let real = spectra.real();
    let zero = || vec![DVec3::ZERO; system.len()];
    Ok(match method {
        Method::Lu | Method::Cholesky | Method::SecondCholesky | Method::Ldlt | Method::PlainCg | Method::PcgIc0 => {
            None
        }
        // Between the relaxation's own rate and that of full GMRES.
        Method::Anderson { .. } => None,
        Method::Jacobi { omega } => relaxed(SymmetricForm::Jacobi, omega)?,
        Method::Thall => relaxed(SymmetricForm::Jacobi, Some(THALL_OMEGA))?,
        Method::Pia => relaxed(SymmetricForm::A, Some(1.0))?,
        Method::WPia { omega } => relaxed(SymmetricForm::A, omega)?,
        Method::GaussSeidel { order } => return predicted_rate(system, spectra, Method::Sor { omega: 1.0, order }),
        Method::Sor { omega, order } => {
            let points = zero();
            let natural: Vec<u32>;
            let order = match order {
                Some(order) => order,
                None => {
                    natural = (0..system.len() as u32).collect();
                    &natural
                }
            };
            let vertices = || order.iter().map(|&i| i as usize);
            Some(sweep_radius(system, |x| {
                sweep(system, &points, omega, vertices(), x);
            })?)
        }
        Method::Ssor { omega, order } => {
            let points = zero();
            Some(sweep_radius(system, |x| {
                symmetric_sweep(system, &points, omega, order, x);
            })?)
        }
        Method::HeavyBall { interval } | Method::Chebyshev { interval } => {
            real.map(|s| interval.map_or(s.a, |(min, max)| Extremes { min, max }).krylov_rate())
        }
        Method::Cg => real.map(|s| s.a.krylov_rate()),
        Method::PcgJacobi => real.map(|s| s.jacobi.krylov_rate()),
        Method::PcgSsor { .. } if real.is_none() => None,
        Method::PcgSsor { omega } => {
            // The preconditioned matrix is I − E with E the error matrix of SSOR, whose spectrum is in [0, ρ].
            let points = zero();
            let radius = sweep_radius(system, |x| {
                symmetric_sweep(system, &points, omega, None, x);
            })?;
            let ends = Extremes { min: 1.0 - radius, max: 1.0 };
            Some(ends.krylov_rate())
        }
    })
}

/// The spectral radius of I − ωA or I − ωD⁻¹A by an Arnoldi process.
fn relaxation_radius(system: &impl System, form: SymmetricForm, omega: f64) -> Result<f64> {
    let n = system.len();
    let (mut rows, mut next, mut nothing) = (Rows::new(n), vec![DVec3::ZERO; n], vec![(); n]);
    sweep_radius(system, |x| {
        rows.product(system, x, &mut next, &mut nothing, |i, ax, next, (), _| {
            let scale = match form {
                SymmetricForm::A => omega,
                SymmetricForm::Jacobi => omega / system.diagonal()[i],
            };
            *next = x[i] - scale * ax;
        });
        x.copy_from_slice(&next);
    })
}
