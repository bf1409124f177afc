//! `splitting`: what it does is in [`splitting`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::splitting::{self, Arguments};

fn main() -> ExitCode {
    splitting::main(Arguments::parse())
}
