//! Assembly of the limit system `A V = P` of a mesh: the schemes as four small functions, one generic assembler into
//! own compressed sparse rows, the same as a sequence of stages where there are boundaries and creases, and as a whole, proven bounds
//! from valences and face sizes, Matrix Market files, PETSc's binary ones; systems of other origin.
//! This room knows no solvers.

pub mod bounds;
mod build;
pub mod convert;
pub mod csr;
pub mod curves;
pub mod face_sums;
mod gather;
pub mod general;
pub mod kernel;
pub mod matrix_market;
mod neighbours;
pub mod operator;
mod parts;
pub mod petsc;
pub mod staged_operator;
pub mod stages;
pub mod stars;
pub mod streamed;
pub mod system;
pub mod weights;

pub(crate) use build::RowOrder;
pub use csr::Csr;
pub use general::GeneralSystem;
pub use operator::Operator;
pub use staged_operator::StagedOperator;
pub use stages::Stages;
pub use streamed::StreamedSystem;
pub use system::LimitSystem;
