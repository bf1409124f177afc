//! `spectrum`: what it does is in [`spectrum`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::spectrum::{self, Arguments};

fn main() -> ExitCode {
    spectrum::main(Arguments::parse())
}
