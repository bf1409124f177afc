//! Complex spectra: the eigenvalues of A and D⁻¹A of meshes with darts or semi-sharp vertices, where no diagonal makes A
//! symmetric, and the rates of relaxation that follow.

use glam::DVec3;
use nalgebra::Complex;

use super::dense::complex_eigenvalues;
use super::singularity::ZERO;
use super::spectrum::{Extremes, Spectra, Spectrum};
use super::symmetric::SymmetricForm;
use crate::assemble::GeneralSystem;
use crate::error::Result;
use crate::solvers::System;

/// All eigenvalues of A and of D⁻¹A, or none where there are too many.
#[derive(Clone, Debug, PartialEq)]
pub struct ComplexSpectrum {
    eigenvalues: Option<[Vec<Complex<f64>>; 2]>,
}

impl ComplexSpectrum {
    /// Up to [`LARGEST_COMPLEX`](super::dense::LARGEST_COMPLEX) unknowns by a dense computation; nothing is known beyond.
    ///
    /// # Errors
    /// If the computation does not converge.
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
        Ok(ComplexSpectrum { eigenvalues: complex_eigenvalues(system)? })
    }

    /// The eigenvalues of the matrix of `form`, unsorted.
    pub fn eigenvalues(&self, form: SymmetricForm) -> Option<&[Complex<f64>]> {
        let [a, jacobi] = self.eigenvalues.as_ref()?;
        Some(match form {
            SymmetricForm::A => a,
            SymmetricForm::Jacobi => jacobi,
        })
    }
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
    fn optimal_omega(&self, form: SymmetricForm) -> Option<f64> {
        const PART: f64 = 0.618_033_988_749_894_8;
        const SECTIONS: usize = 80;
        let eigenvalues = self.eigenvalues(form)?;
        let (mut from, mut to) = (0.0, self.critical_omega(form)?);
        for _ in 0..SECTIONS {
            let [left, right] = [to - PART * (to - from), from + PART * (to - from)];
            if radius(eigenvalues, left) <= radius(eigenvalues, right) {
                to = right;
            } else {
                from = left;
            }
        }
        Some(0.5 * (from + to))
    }

    /// |1 − ωλ| < 1 for 0 < ω < 2 Re λ/|λ|²; an eigenvalue that is 0 keeps its part of the error whatever ω is.
    fn critical_omega(&self, form: SymmetricForm) -> Option<f64> {
        let moving = self.eigenvalues(form)?.iter().filter(|z| z.norm() > ZERO);
        Some(moving.map(|z| 2.0 * z.re / z.norm_sqr()).fold(f64::INFINITY, f64::min).max(0.0))
    }

    fn ends(&self, form: SymmetricForm) -> Option<Extremes> {
        let parts = || self.eigenvalues(form).map(|all| all.iter().map(|z| z.re));
        Some(Extremes { min: parts()?.fold(f64::INFINITY, f64::min), max: parts()?.fold(f64::NEG_INFINITY, f64::max) })
    }

    fn real(&self) -> Option<&Spectrum> {
        None
    }

    fn excited(&self, _: &impl System, _: (&[DVec3], &[DVec3]), _: SymmetricForm) -> Result<Option<Extremes>> {
        Ok(None)
    }
}
