//! The fairest first refined mesh: how the freedom that Zheng & Cai's interpolation leaves (2005, §5) is used best.
//!
//! Their surface is the Doo-Sabin surface of the first refined mesh W, which has one vertex for each corner of the given
//! mesh. The points fix nothing but the centroids of its type-V faces, so that three quarters of W on quads, and five
//! sixths on triangles, are free. [`mod@energy`] is the thin-plate and membrane energy of the surface as a quadratic
//! form over W; it has exact minima:
//!
//! - [`mod@handles`]: over the shape handles s alone, W' = I + s(W − I), one number a vertex;
//! - [`mod@fit`]: over all of W.
//!
//! The energies are those of [fair interpolation by Catmull-Clark](super::halstead), with the same unit and the same
//! part left out, so that all four surfaces can be compared.

pub mod energy;
pub mod fit;
pub mod handles;

pub use energy::FirstFairness;
pub use fit::{FairRefinement, fairest};
pub use handles::{FairHandles, fair_handles};
