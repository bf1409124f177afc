//! Fair interpolation with Catmull-Clark surfaces (Halstead, Kass & DeRose 1993): among all control meshes of a
//! refined topology whose surface meets the given points, and normals if there are any, the one with the least
//! fairness energy.
//!
//! The unknowns are the vertices of the mesh refined [`LEVELS`] times: by then the 1-rings of the original vertices
//! are disjoint, so the constraints, each on one ring, are independent and always soluble, on meshes too whose own
//! limit system is singular. Boundaries are natural, and a crease is a boundary of each of its sides. [`mod@energy`]
//! makes the energy as a quadratic form, a sum over elements, [`mod@fit`] minimises it under the constraints, by projected
//! conjugate gradients or by a factorization, [`mod@follow`] holds the
//! iterative methods against it.

mod direct;
pub(super) mod elements;
pub mod energy;
pub mod fit;
pub mod follow;
pub(super) mod projected;

pub use energy::{Energies, Fairness, Weights};
pub use fit::{Fit, Solver, fit, fit_watched};
pub use follow::{FairnessRow, follow};

/// Refinements between the given mesh and the unknowns.
pub const LEVELS: usize = 2;
