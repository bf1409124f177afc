//! Complex spectra: the eigenvalues of A and D⁻¹A of meshes with darts or semi-sharp vertices, where no diagonal makes A
//! symmetric, and the rates of relaxation that follow.

use glam::DVec3;
use nalgebra::Complex;

use super::dense::{self, complex_eigenvalues};
use super::singularity::ZERO;
use super::spectral_radius::sweep_radius;
use super::spectrum::{Extremes, Spectra, Spectrum};
use super::symmetric::SymmetricForm;
use crate::assemble::GeneralSystem;
use crate::error::Result;
use crate::solvers::System;
use crate::solvers::system::Rows;

/// What is known of the spectra of A and of D⁻¹A.
#[derive(Clone, Debug, PartialEq)]
pub struct ComplexSpectrum {
    /// Of A and D⁻¹A, of a small system.
    eigenvalues: Option<[Vec<Complex<f64>>; 2]>,
    /// Of the real parts.
    ends: [Extremes; 2],
}

impl ComplexSpectrum {
    /// All eigenvalues up to [`dense::LARGEST`] unknowns. Beyond, the ends by Arnoldi processes: the spectral radius of the
    /// matrix, and that of I less the matrix over it, as if the eigenvalues at the ends were real.
    ///
    /// # Errors
    /// If a computation does not converge.
    ///
    /// ```
    /// use limitlab::analysis::complex_spectrum::ComplexSpectrum;
    /// use limitlab::analysis::spectrum::Spectra;
    /// use limitlab::analysis::symmetric::SymmetricForm;
    /// use limitlab::assemble::Stages;
    /// use limitlab::mesh::{Surface, builtin, features::Tags};
    /// use limitlab::schemes::Scheme;
    ///
    /// // One sharp edge: two darts.
    /// let torus = Surface::new(builtin::builtin("torus:5x5")?)?;
    /// let darts = torus.tagged(&Tags { creases: vec![([0, 1], 10.0)], ..Tags::default() })?;
    /// let system = Stages::new(&darts, Scheme::CatmullClark, None)?.whole();
    /// let spectrum = ComplexSpectrum::new(&system)?;
    /// let eigenvalues = spectrum.eigenvalues(SymmetricForm::A).expect("a small mesh");
    /// assert!(eigenvalues.iter().all(|z| z.re > 0.0 && z.re < 1.0 + 1e-12));
    /// assert!(spectrum.radius(SymmetricForm::A, 1.0).is_some_and(|rho| rho < 1.0));
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn new(system: &GeneralSystem) -> Result<Self> {
        if system.matrix().len() <= dense::LARGEST {
            return Self::full(system);
        }
        let ends = [outermost(system, |_| 1.0)?, outermost(system, |i| 1.0 / system.diagonal()[i])?];
        Ok(ComplexSpectrum { eigenvalues: None, ends })
    }

    /// All eigenvalues, up to [`dense::LARGEST_COMPLEX`] unknowns. O(N³) time, O(N²) memory: some ten seconds there.
    ///
    /// # Errors
    /// If there are more, or the computation does not converge.
    pub fn full(system: &GeneralSystem) -> Result<Self> {
        let a = system.matrix();
        let inverse: Vec<f64> = system.diagonal().iter().map(|d| 1.0 / d).collect();
        let eigenvalues = [complex_eigenvalues(a)?, complex_eigenvalues(&a.scale_rows(&inverse))?];
        let ends = eigenvalues.each_ref().map(|all| {
            let real = || all.iter().map(|z| z.re);
            Extremes { min: real().fold(f64::INFINITY, f64::min), max: real().fold(f64::NEG_INFINITY, f64::max) }
        });
        Ok(ComplexSpectrum { eigenvalues: Some(eigenvalues), ends })
    }

    /// The eigenvalues of the matrix of `form`, unsorted, where all are known.
    pub fn eigenvalues(&self, form: SymmetricForm) -> Option<&[Complex<f64>]> {
        let [a, jacobi] = self.eigenvalues.as_ref()?;
        Some(match form {
            SymmetricForm::A => a,
            SymmetricForm::Jacobi => jacobi,
        })
    }

    /// Those that are not 0: others keep their part of the error whatever ω is.
    fn moving(&self, form: SymmetricForm) -> Option<Vec<Complex<f64>>> {
        Some(self.eigenvalues(form)?.iter().copied().filter(|z| z.norm() > ZERO).collect())
    }
}

/// The ends of diag(scale)·A.
fn outermost(system: &GeneralSystem, scale: impl Fn(usize) -> f64 + Sync) -> Result<Extremes> {
    let n = system.matrix().len();
    let (mut rows, mut image, mut nothing) = (Rows::new(n), vec![DVec3::ZERO; n], vec![(); n]);
    let mut apply = |x: &mut [DVec3], shift: f64, factor: f64| {
        rows.product(system, x, &mut image, &mut nothing, |i, ax, image, (), _| {
            *image = shift * x[i] + (factor * scale(i)) * ax;
        });
        x.copy_from_slice(&image);
    };
    let max = sweep_radius(system, |x| apply(x, 0.0, 1.0))?;
    let least = sweep_radius(system, |x| apply(x, 1.0, -1.0 / max))?;
    Ok(Extremes { min: max * (1.0 - least), max })
}

/// max |1 − ωλ|.
fn radius(eigenvalues: &[Complex<f64>], omega: f64) -> f64 {
    eigenvalues.iter().map(|z| (1.0 - omega * z).norm()).fold(0.0, f64::max)
}

impl Spectra for ComplexSpectrum {
    fn radius(&self, form: SymmetricForm, omega: f64) -> Option<f64> {
        Some(radius(self.eigenvalues(form)?, omega))
    }

    /// By golden sections: the radius is a convex function of ω.
    fn optimal_omega(&self, form: SymmetricForm) -> f64 {
        const PART: f64 = 0.618_033_988_749_894_8;
        const SECTIONS: usize = 80;
        let Some(moving) = self.moving(form) else { return self.ends(form).optimal_omega() };
        let (mut from, mut to) = (0.0, self.critical_omega(form));
        for _ in 0..SECTIONS {
            let [left, right] = [to - PART * (to - from), from + PART * (to - from)];
            if radius(&moving, left) <= radius(&moving, right) {
                to = right;
            } else {
                from = left;
            }
        }
        0.5 * (from + to)
    }

    /// |1 − ωλ| < 1 for 0 < ω < 2 Re λ/|λ|².
    fn critical_omega(&self, form: SymmetricForm) -> f64 {
        let Some(moving) = self.moving(form) else { return self.ends(form).critical_omega() };
        moving.iter().map(|z| 2.0 * z.re / z.norm_sqr()).fold(f64::INFINITY, f64::min).max(0.0)
    }

    fn ends(&self, form: SymmetricForm) -> Extremes {
        let [a, jacobi] = self.ends;
        match form {
            SymmetricForm::A => a,
            SymmetricForm::Jacobi => jacobi,
        }
    }

    fn real(&self) -> Option<&Spectrum> {
        None
    }

    fn excited(&self, _: &impl System, _: (&[DVec3], &[DVec3]), _: SymmetricForm) -> Result<Option<Extremes>> {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |1 − ωλ|² = 1 − 0.2ω + 0.17ω² for λ = 0.1 ± 0.4i: more than (1 − ω)² up to ω = 180/83.
    #[test]
    fn a_complex_pair_sets_the_best_and_the_critical_omega() {
        // That which is 0 but for rounding sets none.
        let real = [1.0, -1e-17].map(Complex::from);
        let all: Vec<_> = real.into_iter().chain([0.4, -0.4].map(|im| Complex::new(0.1, im))).collect();
        let ends = Extremes { min: 0.0, max: 1.0 };
        let spectrum = ComplexSpectrum { eigenvalues: Some([all.clone(), all]), ends: [ends; 2] };
        for form in [SymmetricForm::A, SymmetricForm::Jacobi] {
            // Where the parabola is least, and where it is 1 again.
            let [best, critical] = [spectrum.optimal_omega(form), spectrum.critical_omega(form)];
            assert!((best - 0.1 / 0.17).abs() < 1e-6, "{best}");
            assert!((critical - 0.2 / 0.17).abs() < 1e-15, "{critical}");
        }
    }
}
