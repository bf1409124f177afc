//! The programs as users run them, one program of tests.

#[path = "../../tests/common/mod.rs"]
mod common;

mod flags;
mod interpolate;
mod ledger;
#[path = "../examples/own_method.rs"]
#[allow(dead_code)]
mod own_method;
mod programs;
mod spectrum;
mod splitting;

#[test]
fn flags_of_any_kind_are_answered() {
    let programs = std::path::Path::new(env!("CARGO_BIN_EXE_interpolate")).parent().unwrap();
    common::replay::replay("flags", 30, |data| flags::check(data, programs));
}

#[test]
fn the_example_runs_a_method_of_its_own_beside_ours() {
    let folder = tempfile::tempdir().unwrap();
    let rows = own_method::run(folder.path()).unwrap();
    let iterations = |name: &str| {
        let row = rows.iter().find(|row| row.method.name() == name).unwrap();
        assert_eq!(row.solution.report.outcome, limitlab::solvers::Outcome::Converged, "{name}");
        row.solution.report.iterations
    };
    // Never faster than conjugate gradients, and in no other class than relaxation by the best ω.
    let mine = iterations("steepest-descent");
    assert!(iterations("cg") < mine && mine < 3 * iterations("w-pia"), "{mine}");
    assert!(folder.path().join("own_method.png").exists());
}
