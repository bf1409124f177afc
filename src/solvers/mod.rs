//! Methods for `A V = P`, one file each, behind one interface: a [`System`] in, control points and a
//! [`Report`] with the whole history out. This room knows no meshes and no schemes.

pub mod anderson;
pub mod chebyshev;
pub mod coloured;
pub mod conjugate_gradient;
pub mod direct;
pub mod gauss_seidel;
pub mod gmres;
pub mod heavy_ball;
pub mod incomplete_cholesky;
pub mod iteration;
pub mod jacobi;
pub mod local_update;
pub mod method;
pub mod mixed;
pub mod pia;
pub mod ssor;
pub mod system;
pub mod wavefront;

pub use iteration::{Errors, Failure, Iterate, Outcome, Recorded, Report, Step, Stop, WarmStart, solve};
pub use method::{Accelerated, Method, Solution, run, run_from, run_watched};
pub use system::System;
