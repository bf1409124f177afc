//! `scaling`: what it does is in [`scaling`].

use std::process::ExitCode;

use peak_alloc::PeakAlloc;

use limitlab_experiments::cli;
use limitlab_experiments::programs::scaling;

/// What `scaling` reads the heap from.
#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse();
    scaling::main(arguments, provenance)
}
