//! `interpolate`: what it does is in [`interpolate`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::interpolate;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    interpolate::main(arguments, provenance)
}
