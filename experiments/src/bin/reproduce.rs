//! `reproduce`: what it does is in [`reproduce`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::reproduce::{self, Arguments};

fn main() -> ExitCode {
    reproduce::main(Arguments::parse())
}
