//! Splitting (subdivision) matrices: what one round of refinement does to the control points about one
//! extraordinary vertex, or of Doo-Sabin face, of valence n.
//!
//! - [`star`]: a star in a regular surrounding, its positions, and the walk that finds them in a refined mesh;
//! - [`scheme`]: the schemes, applied to a star, and their closed forms;
//! - [`matrix`]: the matrix S read off from the refinement of unit vectors, and its Fourier blocks;
//! - [`spectrum`]: eigenvalues, left and right invariant subspaces, limit and tangent masks;
//! - [`evaluation`]: points of the surface at any parameter, by eigendecomposition;
//! - [`characteristic`]: characteristic maps, and whether they are regular and injective;
//! - [`condition`]: Lin & Luo's eigenvalue condition over α;
//! - [`thall`]: the matrices, masks and tables that Thall prints, against computed ones;
//! - [`row`]: all of it for one valence, as plain numbers;
//! - [`sharp`]: the same at boundary, crease, corner and dart vertices.
//!
//! ```
//! use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix};
//! let s = SplittingMatrix::new(LocalScheme::CatmullClark, 4)?;
//! assert_eq!(s.size(), 9);
//! let eigenvalues = s.eigenvalues()?;
//! assert!((eigenvalues[0].re - 1.0).abs() < 1e-14 && (eigenvalues[2].re - 0.5).abs() < 1e-14);
//! assert!((s.limit_mask()?[0] - 4.0 / 9.0).abs() < 1e-14);
//! # Ok::<(), limitlab::Error>(())
//! ```

pub mod characteristic;
pub mod condition;
pub mod evaluation;
pub mod matrix;
pub mod row;
pub mod scheme;
pub mod sharp;
pub mod spectrum;
pub mod star;
pub mod thall;

use nalgebra::Complex;

pub use characteristic::{Check, Net, characteristic_map};
pub use condition::{Condition, Crossing, condition_over_alpha, crossings};
pub use evaluation::ExactSurface;
pub use matrix::SplittingMatrix;
pub use row::{StarRow, rows};
pub use scheme::{Blended, LocalScheme, VALENCES};
pub use sharp::{SharpMask, SharpRow, SharpSector, SharpVertex, sharp_rows};
pub use spectrum::{Eigenspace, Mode, distance_to_space};
pub use star::Layout;
pub use thall::{ThallTables, thall_tables};

/// By falling modulus, then real part, then imaginary part.
fn sort(values: &mut [Complex<f64>]) {
    values.sort_by(falling);
}

fn largest_difference(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

fn falling(a: &Complex<f64>, b: &Complex<f64>) -> std::cmp::Ordering {
    let modulus = b.norm().total_cmp(&a.norm());
    modulus.then(b.re.total_cmp(&a.re)).then(b.im.total_cmp(&a.im))
}
