//! Symmetric matrices similar to A and to D⁻¹A: A = H M and D⁻¹A are products of a positive diagonal and a symmetric matrix,
//! so each has the real spectrum of diag(s) M diag(s).

use crate::assemble::{Csr, LimitSystem};

/// Which of the two matrices the symmetric diag(s) M diag(s) is similar to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymmetricForm {
    /// A: s = √h.
    A,
    /// D⁻¹A: s = 1/√m_ii.
    Jacobi,
}

/// The symmetric matrix diag(s) M diag(s) that is similar to A or D⁻¹A. An eigenvector x of it makes the eigenvector
/// diag(s) x of the other.
pub fn symmetric(system: &LimitSystem, form: SymmetricForm) -> Csr {
    system.m.scale_symmetrically(&scales(system, form))
}

/// diag s of the [`symmetric`] matrix.
pub fn scales(system: &LimitSystem, form: SymmetricForm) -> Vec<f64> {
    match form {
        SymmetricForm::A => system.h.iter().map(|h| h.sqrt()).collect(),
        // m_ii = a_ii/h_i
        SymmetricForm::Jacobi => system.diagonal.iter().zip(&system.h).map(|(a, h)| (h / a).sqrt()).collect(),
    }
}
