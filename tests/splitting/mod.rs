//! Splitting matrices held against closed forms, the masks of the schemes, real refinement, and what the papers
//! print.

mod blend;
mod maps;
mod matrices;
mod printed;
mod sharp;

use limitlab::analysis::splitting::LocalScheme;

/// Rounding of sums of some tens of terms of size 1.
const ROUNDING: f64 = 1e-13;

/// Eigenvalues of blocks of some rows with entries of size 1, well conditioned.
const EIGEN: f64 = 1e-12;

const SCHEMES: [LocalScheme; 4] =
    [LocalScheme::CatmullClark, LocalScheme::Loop, LocalScheme::DooSabin, LocalScheme::Sqrt3 { alpha: 0.0 }];
