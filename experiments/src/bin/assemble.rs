//! `assemble`: what it does is in [`assemble`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::assemble;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    assemble::main(arguments, provenance)
}
