//! A-priori estimates, from the proven bounds alone: ω intervals that are safe, rates, iteration counts.

use glam::DVec3;

use super::spectrum::Extremes;
use crate::assemble::bounds::SpectralBounds;
use crate::solvers::System;
use crate::solvers::chebyshev::promised_iterations;
use crate::solvers::system::Rows;

/// Safe intervals and rates that follow from [`SpectralBounds`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// [λ_min bound, λ_max] of A.
    pub a: Extremes,
    /// The same of D⁻¹A.
    pub jacobi: Extremes,
    /// W-PIA converges for 0 < ω < this on a non-singular system.
    pub safe_omega_pia: f64,
    /// Damped Jacobi converges for 0 < ω < this on a non-singular system.
    pub safe_omega_jacobi: f64,
    /// The ω of W-PIA that the bounds make best, 2/(λ_min bound + λ_max).
    pub omega_w_pia: f64,
}

/// Iterations after which max_i ‖e_i‖₂ is at most the tolerance, by proof; infinite where the bound for λ_min is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IterationCounts {
    /// PIA, which is ω = 1.
    pub pia: f64,
    /// W-PIA at [`Promise::omega_w_pia`].
    pub w_pia: f64,
    /// Thall's iteration, damped Jacobi at ω = ½.
    pub thall: f64,
    /// Chebyshev iteration on the proven interval of A.
    pub chebyshev: f64,
}

impl Promise {
    /// What these bounds imply, by arithmetic alone.
    pub fn new(b: &SpectralBounds) -> Self {
        let a = Extremes { min: b.lambda_min, max: b.lambda_max };
        let jacobi = Extremes { min: b.jacobi_lambda_min, max: b.jacobi_lambda_max };
        Promise {
            a,
            jacobi,
            safe_omega_pia: a.critical_omega(),
            safe_omega_jacobi: jacobi.critical_omega(),
            omega_w_pia: a.optimal_omega(),
        }
    }

    /// A-priori iteration counts from V = `start` (P, unless there is reason for another). With e₀ = P − A V:
    /// PIA, W-PIA: `max ‖e_i‖ ≤ √h_max ρ^k ‖H^-½e₀‖₂`, ρ = 1 − λ_min and (κ−1)/(κ+1);
    /// Chebyshev: the same with 1/T_k((κ+1)/(κ−1)) for ρ^k;
    /// Thall: `max ‖e_i‖ ≤ max(h_i√m_ii) ρ^k ‖Dm^-½H⁻¹e₀‖₂`, Dm = diag M, as AD⁻¹ is symmetric in that norm.
    /// One product with A.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn counts(
        &self,
        system: &impl System,
        (points, start): (&[DVec3], &[DVec3]),
        tolerance: f64,
    ) -> IterationCounts {
        assert_eq!(points.len(), system.len(), "one point a vertex");
        let (mut in_h, mut in_d) = (0.0, 0.0);
        let (mut h_max, mut d_max) = (0.0f64, 0.0f64);
        // Rows one by one would sum a large face once for each of its corners.
        let mut errors = vec![DVec3::ZERO; points.len()];
        Rows::new(points.len()).residual(system, points, start, &mut errors, |_, e, out, _| *out = e);
        for (i, e) in errors.into_iter().enumerate() {
            let h = system.weights()[i];
            let m = system.diagonal()[i] / h;
            in_h += e.length_squared() / h;
            in_d += e.length_squared() / (h * h * m);
            h_max = h_max.max(h);
            d_max = d_max.max(h * m.sqrt());
        }
        let reduction_h = tolerance / (h_max.sqrt() * in_h.sqrt());
        let reduction_d = tolerance / (d_max * in_d.sqrt());
        let powers = |reduction: f64, rho: f64| match () {
            () if reduction >= 1.0 => 0.0,
            () if rho < 1.0 => (reduction.ln() / rho.ln()).ceil(),
            () => f64::INFINITY,
        };
        let chebyshev = match () {
            () if reduction_h >= 1.0 => 0.0,
            () if self.a.min > 0.0 => promised_iterations((self.a.min, self.a.max), reduction_h),
            () => f64::INFINITY,
        };
        IterationCounts {
            pia: powers(reduction_h, self.a.radius(1.0)),
            w_pia: powers(reduction_h, self.a.radius(self.omega_w_pia)),
            thall: powers(reduction_d, self.jacobi.radius(0.5)),
            chebyshev,
        }
    }
}
