//! `limitlab`: all programs as its subcommands.

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use peak_alloc::PeakAlloc;

use limitlab_experiments::cli::{self, VERSION};
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
    let mut command = Front::command();
    let matches = command.get_matches_mut();
    let program = Front::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit()).program;
    let chosen = matches.subcommand().and_then(|(name, of)| Some((command.find_subcommand(name)?, of)));
    let provenance = chosen.map(|(program, of)| cli::provenance(program, of)).unwrap_or_default();
    match program {
        Program::Interpolate(arguments) => interpolate::main(arguments, provenance),
        Program::CompareSolvers(arguments) => compare_solvers::main(arguments, provenance),
        Program::SweepOmega(arguments) => sweep_omega::main(arguments, provenance),
        Program::Spectrum(arguments) => spectrum::main(arguments, provenance),
        Program::Splitting(arguments) => splitting::main(arguments, provenance),
        Program::Assemble(arguments) => assemble::main(arguments, provenance),
        Program::Reproduce(arguments) => reproduce::main(arguments, provenance),
        Program::Scaling(arguments) => scaling::main(arguments, provenance),
    }
}
