//! Every table and figure of the papers, on the papers' own models or on built-in stand-ins: `reproduce`.

#[path = "../common/sweep.rs"]
mod common;
mod context;
mod figures;
#[path = "../common/splitting.rs"]
mod local_matrices;
mod methods;
mod omega;
mod orders;
mod pia;
mod sparsity;
mod splitting;
mod thall;
mod valences;
mod zheng_cai;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

use context::{Context, Item};
use limitlab::Result;
use limitlab::cli::{self, CommonFlags, Progress};
use limitlab::error::Error;

/// Regenerates the papers' tables and figures with what this workbench measures beside what they print.
///
/// With --meshes the papers' own models are read from that folder, and the results go to the report folder itself;
/// without, built-in meshes stand in, and the results go to its folder built-in.
#[derive(Parser)]
#[command(name = "reproduce", version)]
struct Arguments {
    /// Only the item with this ID; may be repeated
    #[arg(long, value_name = "ID")]
    only: Vec<String>,
    /// List the items and stop
    #[arg(long)]
    list: bool,
    /// The report folder
    #[arg(long, value_name = "DIR", default_value = "reports")]
    out: PathBuf,
    /// The folder with the real models (closed/, open/)
    #[arg(long, value_name = "DIR")]
    meshes: Option<PathBuf>,
    /// A subset of the rows, within a minute
    #[arg(long)]
    quick: bool,
    /// Compare every table with the one of the same name in this report folder, and fail if they differ
    #[arg(long, value_name = "DIR")]
    check: Option<PathBuf>,
    #[command(flatten)]
    common: CommonFlags,
}

/// All items, in the order in which they run.
const ITEMS: [Item; 10] = [
    pia::TABLE1,
    thall::ITERATIONS,
    zheng_cai::SECTION_3_5,
    omega::SWEEPS,
    methods::ALL,
    sparsity::PATTERNS,
    splitting::LOCAL,
    orders::ORDERS,
    valences::VALENCES,
    figures::ALL,
];

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    if arguments.list {
        let width = ITEMS.iter().map(|i| i.id.len()).max().unwrap_or(0);
        let lines: Vec<String> = ITEMS
            .iter()
            .map(|i| format!("{:width$}  {}", i.id, i.title))
            .collect();
        return cli::print(&lines.join("\n"));
    }
    let chosen: Vec<&Item> = if arguments.only.is_empty() {
        ITEMS.iter().collect()
    } else {
        arguments
            .only
            .iter()
            .map(|id| {
                ITEMS.iter().find(|i| i.id == id).ok_or_else(|| {
                    Error::Unknown(format!("no item is called \"{id}\"; see reproduce --list"))
                })
            })
            .collect::<Result<_>>()?
    };
    let mut context = Context::new(
        &arguments.out,
        arguments.meshes.as_deref(),
        arguments.quick,
        arguments.check.as_deref(),
    )?;
    let progress = Progress::new("reproduce", chosen.len(), arguments.common.quiet);
    for item in chosen {
        progress.message(item.id);
        (item.run)(&mut context)?;
        progress.step();
    }
    drop(progress);
    context.write_index(&ITEMS)?;
    arguments
        .common
        .remark(format_args!("reports: {}", context.folder().display()));
    context.verdict()
}
