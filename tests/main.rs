//! The tests of the library, one program.

mod assemble;
mod common;
mod files;
mod fuzz;
mod meshes;
mod open;
mod operator;
mod pipelines;
mod schemes;
mod solvers;
mod spectra;
mod splitting;
