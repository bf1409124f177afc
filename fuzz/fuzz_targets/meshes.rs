#![no_main]

#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "../../tests/fuzz/formats.rs"]
mod formats;
#[path = "../../tests/fuzz/meshes/mod.rs"]
mod meshes;
#[path = "../../tests/fuzz/surface.rs"]
mod surface;

libfuzzer_sys::fuzz_target!(|data: &[u8]| meshes::check(data));
