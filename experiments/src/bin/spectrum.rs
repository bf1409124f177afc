//! `spectrum`: what it does is in [`spectrum`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::spectrum;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    spectrum::main(arguments, provenance)
}
