//! `sweep-omega`: what it does is in [`sweep_omega`].

use std::process::ExitCode;

use clap::Parser;

use limitlab_experiments::programs::sweep_omega::{self, Arguments};

fn main() -> ExitCode {
    sweep_omega::main(Arguments::parse())
}
