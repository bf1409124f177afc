//! Factorizations and eigenvalues by faer and nalgebra in double precision, with 32-bit indices, compiled once.
//!
//! Both libraries are generic in the numbers and the indices, so that each crate that calls them compiles them again: a quarter
//! of the code of `limitlab`, which is compiled four times when its tests run. The functions here are their entry points for
//! the types in use, and nothing more: arguments, results and errors are those of the libraries, all work is sequential,
//! and time and memory are as their documentation has them.

pub mod dense;
pub mod sparse;
