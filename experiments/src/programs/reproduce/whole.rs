//! All of A on open and creased meshes, dense: complex eigenvalues, singular values, spectral radii of iterations on
//! it.

use glam::DVec3;
use limitlab_factorizations::dense::small_eigenvalues;
use nalgebra::{Complex, DMatrix};

use limitlab::Result;
use limitlab::analysis::dense;
use limitlab::assemble::{GeneralSystem, Stages};
use limitlab::error::Error;
use limitlab::mesh::Surface;
use limitlab::schemes::Scheme;
use limitlab::solvers::system::sweep;
use limitlab::solvers::{Method, Report, Stop, run};

/// A of a mesh, with the rows of curves, corners, darts and semi-sharp vertices.
pub struct Whole {
    system: GeneralSystem,
}

/// An iteration, by its error matrix.
#[derive(Clone, Copy, Debug)]
pub enum Relaxation<'a> {
    /// I − ωA.
    Pia(f64),
    /// I − ωD⁻¹A.
    Jacobi(f64),
    /// Of sweeps in this order.
    Sor(f64, &'a [u32]),
}

impl Whole {
    /// # Errors
    /// As [`Stages::new`].
    pub fn new(surface: &Surface, scheme: Scheme) -> Result<Self> {
        Ok(Self::of(&Stages::new(surface, scheme, None)?))
    }

    pub fn of(stages: &Stages) -> Self {
        Whole { system: stages.whole() }
    }

    pub fn len(&self) -> usize {
        self.system.matrix().len()
    }

    pub fn dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.len(), self.len());
        for i in 0..self.len() {
            self.system.matrix().row(i).for_each(|(j, a)| dense[(i, j)] = a);
        }
        dense
    }

    /// a_ii − Σ |a_ij|, the others of the row.
    pub fn excess(&self, i: usize) -> f64 {
        self.system.matrix().row(i).map(|(j, a)| if i == j { a } else { -a.abs() }).sum()
    }

    /// max |(A x)_i|
    pub fn image(&self, x: &[f64]) -> f64 {
        let row = |i| self.system.matrix().row(i).map(|(j, a)| a * x[j]).sum::<f64>();
        (0..self.len()).map(|i| row(i).abs()).fold(0.0, f64::max)
    }

    /// Solves A V = P on all vertices together, from V = P.
    ///
    /// # Panics
    /// As [`run`].
    pub fn run(&self, points: &[DVec3], method: Method, stop: &Stop) -> Report {
        run(&self.system, points, method, stop).report
    }

    /// The complex eigenvalues of A.
    ///
    /// # Errors
    /// If the computation does not converge.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>> {
        eigenvalues(self.dense())
    }

    /// The spectral radius of an iteration's error matrix.
    ///
    /// # Errors
    /// As [`dense::spectral_radius`].
    pub fn radius(&self, relaxation: Relaxation) -> Result<f64> {
        let zero = vec![DVec3::ZERO; self.len()];
        let mut image = zero.clone();
        dense::spectral_radius(&self.system, |x| match relaxation {
            Relaxation::Pia(omega) | Relaxation::Jacobi(omega) => {
                for (i, to) in image.iter_mut().enumerate() {
                    let scale = if matches!(relaxation, Relaxation::Pia(_)) { 1.0 } else { self.system.diagonal()[i] };
                    *to = x[i] - omega / scale * self.system.matrix().row_times(i, x);
                }
                x.copy_from_slice(&image);
            }
            Relaxation::Sor(omega, order) => {
                sweep(&self.system, &zero, omega, order.iter().map(|&i| i as usize), x);
            }
        })
    }
}

/// The eigenvalues of a matrix that is not symmetric, by one thread, so that a search takes the same way on any machine.
///
/// # Errors
/// If the computation does not converge.
fn eigenvalues(matrix: DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    /// Of the QR algorithm; some defective matrices need more than machine precision allows.
    const TOLERANCE: f64 = 1e-14;
    const ITERATIONS: usize = 10_000;
    let n = matrix.nrows();
    small_eigenvalues(matrix, TOLERANCE, ITERATIONS)
        .ok_or_else(|| Error::Computation(format!("the eigenvalues of a matrix of order {n} are not found")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use limitlab::mesh::builtin;

    #[test]
    fn radii_are_those_of_the_eigenvalues() {
        let surface = Surface::new(builtin::torus(4, 5)).unwrap();
        let whole = Whole::new(&surface, Scheme::CatmullClark).unwrap();
        let all = whole.eigenvalues().unwrap();
        let pia = all.iter().map(|z| (1.0 - 1.2 * z).norm()).fold(0.0, f64::max);
        assert!((whole.radius(Relaxation::Pia(1.2)).unwrap() - pia).abs() < 1e-10);
        // The diagonal is 4/9 everywhere.
        let jacobi = all.iter().map(|z| (1.0 - 0.5 * z / (4.0 / 9.0)).norm()).fold(0.0, f64::max);
        assert!((whole.radius(Relaxation::Jacobi(0.5)).unwrap() - jacobi).abs() < 1e-10);
        let order: Vec<u32> = (0..20).collect();
        let sweeps = whole.radius(Relaxation::Sor(1.0, &order)).unwrap();
        assert!(sweeps < pia && sweeps > 0.0);
        assert!((whole.image(&[1.0; 20]) - 1.0).abs() < 1e-14);
    }
}
