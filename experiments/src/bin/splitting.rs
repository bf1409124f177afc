//! `splitting`: what it does is in [`splitting`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::splitting;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    splitting::main(arguments, provenance)
}
