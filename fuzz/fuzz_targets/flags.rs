#![no_main]

#[path = "../../experiments/tests/flags.rs"]
mod flags;

use std::path::Path;

/// The programs as `cargo build --release` leaves them.
const PROGRAMS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/release");

libfuzzer_sys::fuzz_target!(|data: &[u8]| flags::check(data, Path::new(PROGRAMS)));
