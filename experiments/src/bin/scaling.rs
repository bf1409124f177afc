//! `scaling`: what it does is in [`scaling`].

use std::process::ExitCode;

use clap::Parser;
use peak_alloc::PeakAlloc;

use limitlab_experiments::programs::scaling::{self, Arguments};

/// What `scaling` reads the heap from.
#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

fn main() -> ExitCode {
    scaling::main(Arguments::parse())
}
