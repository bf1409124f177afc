//! `reproduce`: what it does is in [`reproduce`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::reproduce;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    reproduce::main(arguments, provenance)
}
