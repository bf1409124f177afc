//! `compare-solvers`: what it does is in [`compare_solvers`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::compare_solvers;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    compare_solvers::main(arguments, provenance)
}
