//! The rate that theory predicts for each method, as a factor per iteration.

use glam::DVec3;

use super::radius::sweep_radius;
use super::spectrum::{Extremes, Spectrum};
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::solvers::Setup;
use crate::solvers::gauss_seidel::sweep;
use crate::solvers::ssor::symmetric_sweep;

/// The predicted factor per iteration of a method on a system with the given spectra. For relaxation it is the
/// spectral radius of the error matrix; for the heavy ball, Chebyshev and conjugate gradients (√κ−1)/(√κ+1), which
/// conjugate gradients may beat. `None` for direct methods, and where no prediction is made (Anderson acceleration, plain
/// and incomplete-Cholesky conjugate gradients).
///
/// # Errors
/// If the spectral radius of a sweep cannot be computed.
pub fn predicted_rate(system: &LimitSystem, spectrum: &Spectrum, setup: Setup) -> Result<Option<f64>> {
    let zero = || vec![DVec3::ZERO; system.len()];
    Ok(match setup {
        Setup::Lu | Setup::Cholesky | Setup::SecondCholesky | Setup::Ldlt | Setup::PlainCg | Setup::PcgIc0 => None,
        // Between the relaxation's own rate and that of full GMRES.
        Setup::AndersonPia { .. } | Setup::AndersonJacobi { .. } => None,
        Setup::Jacobi { omega } => Some(spectrum.jacobi.radius(omega)),
        Setup::Pia { omega } => Some(spectrum.a.radius(omega)),
        Setup::Sor { omega, order } => {
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
        Setup::Ssor { omega, order } => {
            let points = zero();
            Some(sweep_radius(system, |x| {
                symmetric_sweep(system, &points, omega, order, x);
            })?)
        }
        Setup::HeavyBall { spectrum: (min, max) } | Setup::Chebyshev { spectrum: (min, max) } => {
            Some(Extremes { min, max }.krylov_rate())
        }
        Setup::Cg => Some(spectrum.a.krylov_rate()),
        Setup::PcgJacobi => Some(spectrum.jacobi.krylov_rate()),
        Setup::PcgSsor { omega } => {
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
