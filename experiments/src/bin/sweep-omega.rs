//! `sweep-omega`: what it does is in [`sweep_omega`].

use std::process::ExitCode;

use limitlab_experiments::cli;
use limitlab_experiments::programs::sweep_omega;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    sweep_omega::main(arguments, provenance)
}
