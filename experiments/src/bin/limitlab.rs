//! `limitlab`: all programs as its subcommands; what it does is in [`front`].

use std::process::ExitCode;

use peak_alloc::PeakAlloc;

use limitlab_experiments::programs::front;

/// What `scaling` reads the heap from.
#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

fn main() -> ExitCode {
    front::main()
}
