//! From a mesh to its limit system `A V = P`: the schemes as four small functions, one generic assembler into
//! own compressed sparse rows, proven bounds from valences and face sizes, Matrix Market files; systems of other origin.
//! This room knows no solvers.

pub mod bounds;
mod codes;
pub mod convert;
pub mod csr;
pub mod matrix_market;
pub mod operator;
mod parts;
pub mod polygons;
mod rows;
mod source;
pub mod stencil;
pub mod system;

pub use csr::Csr;
pub use operator::Operator;
pub use system::LimitSystem;
