//! `compare-solvers`: what it does is in [`compare_solvers`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::compare_solvers::{self, Arguments};

fn main() -> ExitCode {
    compare_solvers::main(Arguments::parse())
}
