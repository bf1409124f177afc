//! The limit systems held against brute-force subdivision, the formulas through other libraries, identities, closed
//! forms and dense eigenvalues; their files against other readers.

mod brute_force;
mod convert;
mod files;
mod formulas;
mod matrix_market;
mod petsc;
mod refusals;
mod spectra;
