//! All programs under one name, with completions of shells and manual pages: `limitlab SUBCOMMAND`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;
use clap_mangen::Man;

use super::{assemble, compare_solvers, interpolate, reproduce, scaling, spectrum, splitting, sweep_omega};
use crate::cli::{self, DONE, VERSION, ending};
use crate::report::Provenance;
use limitlab::Result;
use limitlab::error::Error;
use limitlab::output::{Batch, create_dir};

/// Control meshes of subdivision surfaces through given points, and the linear systems behind them.
///
/// The subcommands but the last two are programs that can be called by their own names too; `limitlab SUBCOMMAND --help`
/// lists the flags of each, with examples.
#[derive(Parser)]
#[command(name = NAME, version = VERSION, after_help = ending(&EXAMPLES, DONE, None))]
pub struct Front {
    #[command(subcommand)]
    program: Program,
}

const NAME: &str = "limitlab";

const EXAMPLES: [&str; 3] = [
    "limitlab interpolate model.obj -o cage.obj --scheme catmull-clark",
    "limitlab completions bash > ~/.local/share/bash-completion/completions/limitlab",
    "limitlab man --out ~/.local/share/man/man1",
];

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
    /// Print the completions of a shell on standard output
    #[command(after_help = ending(&["limitlab completions zsh > ~/.zfunc/_limitlab"], DONE, None))]
    Completions {
        #[arg(value_name = "SHELL")]
        shell: Shell,
        /// Those of a program that is called by its own name
        #[arg(value_name = "PROGRAM")]
        program: Option<String>,
    },
    /// Write the manual pages, limitlab.1 and one a program
    #[command(after_help = ending(&["limitlab man --out ~/.local/share/man/man1"], DONE, None))]
    Man {
        /// Folder for the pages
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

/// Runs the subcommand that the command line names.
pub fn main() -> ExitCode {
    let mut command = Front::command();
    let matches = command.get_matches_mut();
    let front = Front::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit());
    let chosen = matches.subcommand().and_then(|(name, of)| Some((command.find_subcommand(name)?, of)));
    let provenance = chosen.map_or_else(Provenance::default, |(program, of)| cli::provenance(program, of));
    match front.program {
        Program::Interpolate(arguments) => interpolate::main(arguments, provenance),
        Program::CompareSolvers(arguments) => compare_solvers::main(arguments, provenance),
        Program::SweepOmega(arguments) => sweep_omega::main(arguments, provenance),
        Program::Spectrum(arguments) => spectrum::main(arguments, provenance),
        Program::Splitting(arguments) => splitting::main(arguments, provenance),
        Program::Assemble(arguments) => assemble::main(arguments, provenance),
        Program::Reproduce(arguments) => reproduce::main(arguments, provenance),
        Program::Scaling(arguments) => scaling::main(arguments, provenance),
        Program::Completions { shell, program } => cli::exit(|| completions(shell, program.as_deref())),
        Program::Man { out } => cli::exit(|| manual(&out)),
    }
}

/// Prints the completions of a program, or of all.
fn completions(shell: Shell, program: Option<&str>) -> Result<()> {
    let front = Front::command();
    let mut command = match program {
        None => front,
        Some(name) => front.find_subcommand(name).cloned().ok_or_else(|| unknown(name, &front))?,
    };
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, name, &mut script);
    cli::write_standard(|out| out.write_all(&script))
}

fn unknown(name: &str, front: &Command) -> Error {
    let names: Vec<&str> = front.get_subcommands().map(Command::get_name).collect();
    Error::Unknown(format!("no program is called \"{name}\": choose among {}", names.join(", ")))
}

/// Writes the manual pages.
fn manual(folder: &Path) -> Result<()> {
    create_dir(folder)?;
    let mut front = Front::command();
    front.build();
    let mut pages = Batch::default();
    for command in [&front].into_iter().chain(front.get_subcommands().filter(|command| command.get_name() != "help")) {
        let page = Man::new(command.clone());
        pages.write(&folder.join(page.get_filename()), |out| page.render(out))?;
    }
    pages.commit()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a command, which has no quotes; what a shell redirects is not among them.
    fn words(example: &str) -> impl Iterator<Item = &str> {
        example.split(" > ").next().into_iter().flat_map(str::split_whitespace)
    }

    #[test]
    fn the_help_of_every_program_has_examples_that_it_takes_and_the_exit_statuses() {
        let front = Front::command();
        front.clone().debug_assert();
        for command in [&front].into_iter().chain(front.get_subcommands()) {
            let (name, help) = (command.get_name(), command.clone().render_long_help().to_string());
            let examples: Vec<&str> = help
                .lines()
                .skip_while(|line| *line != "Examples:")
                .skip(1)
                .map_while(|line| line.strip_prefix("  "))
                .collect();
            assert!(!examples.is_empty(), "{name}: {help}");
            for example in examples {
                let of_front = words(example).next() == Some(NAME);
                let program = if of_front { &front } else { command };
                assert_eq!(words(example).next(), Some(program.get_name()), "{example}");
                program.clone().try_get_matches_from(words(example)).unwrap_or_else(|e| panic!("{example}: {e}"));
            }
            assert!(help.contains("Exit status: 0 ") && help.contains("; 2 bad arguments."), "{name}: {help}");
        }
    }
}
