#![no_main]

#[path = "../../tests/fuzz/formats.rs"]
mod formats;
#[path = "../../tests/fuzz/readers.rs"]
mod readers;
#[path = "../../tests/fuzz/surface.rs"]
mod surface;

libfuzzer_sys::fuzz_target!(|data: &[u8]| readers::check(data));
