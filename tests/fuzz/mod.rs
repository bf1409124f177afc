//! The targets of `fuzz/` as ordinary tests: what the fuzzer kept, and as many mutants of that as take a second or two.
//! The target `flags`, which runs the programs, is among their tests.

mod formats;
mod meshes;
mod readers;
mod surface;

use crate::common::replay::replay;

#[test]
fn readers() {
    replay("readers", 20_000, readers::check);
}

#[test]
fn meshes() {
    replay("meshes", 60, meshes::check);
}
