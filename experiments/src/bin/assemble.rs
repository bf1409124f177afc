//! `assemble`: what it does is in [`assemble`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::assemble::{self, Arguments};

fn main() -> ExitCode {
    assemble::main(Arguments::parse())
}
