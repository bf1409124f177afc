//! The programs as users run them, one program of tests.

#[path = "../../tests/common/mod.rs"]
mod common;

mod flags;
mod interpolate;
mod ledger;
mod programs;
mod spectrum;
mod splitting;

#[test]
fn flags_of_any_kind_are_answered() {
    let programs = std::path::Path::new(env!("CARGO_BIN_EXE_interpolate")).parent().unwrap();
    common::replay::replay("flags", 30, |data| flags::check(data, programs));
}
