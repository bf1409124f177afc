//! `interpolate`: what it does is in [`interpolate`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::interpolate::{self, Arguments};

fn main() -> ExitCode {
    interpolate::main(Arguments::parse())
}
