//! Linear systems `A V = P` without a symmetric factor: the rows of A alone.

use super::bounds::SpectralBounds;
use super::csr::Csr;

/// `A V = P` of a matrix with rows that sum to 1 and no negative entry, which no diagonal makes symmetric: that of a mesh with
/// darts or semi-sharp vertices, [all of it](super::Stages::whole).
///
/// Its eigenvalues may be complex, and nothing is proven of them but that they lie in Gershgorin's discs.
#[derive(Clone, Debug)]
pub struct GeneralSystem {
    a: Csr,
    diagonal: Vec<f64>,
    ones: Vec<f64>,
}

impl GeneralSystem {
    pub(super) fn new(a: Csr) -> Self {
        GeneralSystem { diagonal: a.diagonal(), ones: vec![1.0; a.len()], a }
    }

    /// A.
    pub fn matrix(&self) -> &Csr {
        &self.a
    }

    /// diag A.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// As many ones: there is no H.
    pub fn weights(&self) -> &[f64] {
        &self.ones
    }

    /// Of the real parts of the eigenvalues.
    pub fn bounds(&self) -> SpectralBounds {
        SpectralBounds::gershgorin(&self.diagonal)
    }
}
