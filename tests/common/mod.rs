//! What the test binaries share; each uses a part of it.
#![allow(dead_code)]

pub mod collection;
pub mod formulas;
pub mod matrix_market;
pub mod meshes;
pub mod tol;
