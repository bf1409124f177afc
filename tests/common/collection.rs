//! The meshes of `../shared/meshes`, where they are at hand.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The collection's folder; `None`, said on standard error, where it is absent.
pub fn collection() -> Option<PathBuf> {
    let root = super::root().join("../shared/meshes");
    if root.is_dir() {
        return Some(root);
    }
    // Not `eprintln!`, which the test runner swallows.
    let mut stderr = std::io::stderr();
    writeln!(stderr, "skipped: no {}", root.display()).unwrap();
    None
}

/// The files of one of its folders, in order of their names.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}
