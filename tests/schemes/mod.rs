//! Subdivision held against what it must be: exact identities over real refinements, closed forms on regular
//! grids, polynomials, and masks evaluated by looking at every face.

mod interpolatory;
mod kobbelt;
mod labsik_greiner;
mod limits;
mod meshes;
mod normals;
mod refined;
mod refinement;

/// Rounding of sums of some tens of terms of size 1.
const ROUNDING: f64 = 1e-13;
