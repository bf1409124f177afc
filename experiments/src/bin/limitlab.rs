//! `limitlab`: all programs as its subcommands.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use peak_alloc::PeakAlloc;

use limitlab_experiments::cli::VERSION;
use limitlab_experiments::programs::{
    assemble, compare_solvers, interpolate, reproduce, scaling, spectrum, splitting, sweep_omega,
};

/// What `scaling` reads the heap from.
#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Control meshes of subdivision surfaces through given points, and the linear systems behind them.
///
/// Each subcommand is a program that can be called by its own name too.
#[derive(Parser)]
#[command(name = "limitlab", version = VERSION)]
struct Front {
    #[command(subcommand)]
    program: Program,
}

#[derive(Subcommand)]
enum Program {
    Interpolate(interpolate::Arguments),
    CompareSolvers(compare_solvers::Arguments),
    SweepOmega(sweep_omega::Arguments),
    Spectrum(spectrum::Arguments),
    Splitting(splitting::Arguments),
    Assemble(assemble::Arguments),
    Reproduce(reproduce::Arguments),
    Scaling(scaling::Arguments),
}

fn main() -> ExitCode {
    match Front::parse().program {
        Program::Interpolate(arguments) => interpolate::main(arguments),
        Program::CompareSolvers(arguments) => compare_solvers::main(arguments),
        Program::SweepOmega(arguments) => sweep_omega::main(arguments),
        Program::Spectrum(arguments) => spectrum::main(arguments),
        Program::Splitting(arguments) => splitting::main(arguments),
        Program::Assemble(arguments) => assemble::main(arguments),
        Program::Reproduce(arguments) => reproduce::main(arguments),
        Program::Scaling(arguments) => scaling::main(arguments),
    }
}
