//! The programs: parse, call the library, write. Each is a module with its arguments and a `main` that takes them; the
//! binaries of their names are in `bin`, and `limitlab` has all of them as subcommands.

pub mod assemble;
pub mod compare_solvers;
pub mod front;
pub mod interpolate;
pub mod reproduce;
pub mod scaling;
pub mod spectrum;
pub mod splitting;
pub mod sweep_omega;
