//! What the test binaries share; each uses a part of it.
#![allow(dead_code)]

pub mod collection;
pub mod formulas;
pub mod matrix_market;
pub mod meshes;
pub mod pipelines;
pub mod replay;
pub mod tol;

use std::path::{Path, PathBuf};

/// The root of the project, whichever of its packages is tested: each has a folder there.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
