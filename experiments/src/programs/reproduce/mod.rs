//! Every table and figure of the papers, on the papers' own models or on built-in stand-ins: `reproduce`.

mod claims;
mod context;
mod corpus;
mod creases;
mod darts;
mod figures;
mod freedom;
mod line_preconditioner;
mod methods;
mod omega;
mod open_decay;
mod open_meshes;
mod orders;
mod pages;
mod pia;
mod popping;
mod ripples;
mod rivals;
mod sparsity;
mod splitting;
mod splittings;
mod summary;
mod thall;
mod valences;
mod whole;
mod zheng_cai;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use serde_json::json;

use crate::cli::{self, CommonFlags, FigureFlags, MeshFlags, Printer, Progress};
use crate::programs::compare_solvers;
use crate::report::Provenance;
use claims::Claim;
use context::{Context, Item, Made};
use limitlab::error::Error;
use limitlab::output::check_target;
use limitlab::{Result, names};

/// In its help.
const EXAMPLES: [&str; 3] =
    ["reproduce", "reproduce --meshes DIR --only pia-table1", "reproduce --quick --out new --check reports"];

/// Regenerates the papers' tables and figures with what this workbench measures beside what they print.
///
/// With --meshes the papers' own models are read from that folder, and the results go to the report folder itself;
/// without, built-in meshes stand in, and the results go to its folder built-in. A run of everything says a line an
/// item on standard error as it works, and ends with one screen: the claims by verdict, the findings, where the tables
/// are. It writes the same files every time: only --times writes what a clock measured.
#[derive(Parser)]
#[command(name = "reproduce", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE, None))]
pub struct Arguments {
    /// Only the item or claim with this ID, with its tables on standard output; may be repeated. A claim alone is
    /// printed and not written
    #[arg(long, value_name = "ID")]
    only: Vec<String>,
    /// List the items and the papers' claims, and stop
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
    /// Write an interactive page too, of every method on the horse or on what stands in for it; it needs a browser and no
    /// network
    #[arg(long, value_name = "FILE", value_parser = cli::file)]
    html: Option<PathBuf>,
    /// Write the tables of wall-clock times too (ID--times), which differ from run to run
    #[arg(long)]
    times: bool,
    /// Print one JSON object on standard output, and nothing else there: all tables, and the claims with their numbers
    #[arg(long)]
    json: bool,
    /// Compare every table with the one of the same name in this report folder, and fail if they differ
    #[arg(long, value_name = "DIR")]
    check: Option<PathBuf>,
    #[command(flatten)]
    figures: FigureFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// All items, in the order in which they run.
const ITEMS: [Item; 22] = [
    pia::TABLE1,
    thall::ITERATIONS,
    zheng_cai::SECTION_3_5,
    omega::SWEEPS,
    methods::ALL,
    sparsity::PATTERNS,
    splitting::LOCAL,
    splittings::SPLITTINGS,
    orders::ORDERS,
    line_preconditioner::LINES,
    valences::VALENCES,
    popping::POPPING,
    ripples::RIPPLES,
    rivals::RIVALS,
    freedom::FREEDOM,
    open_meshes::OPEN_MESHES,
    open_decay::DECAY,
    darts::DARTS,
    figures::ALL,
    claims::LEDGER,
    claims::FINDINGS,
    claims::PAPER,
];

/// Runs the program.
pub fn main(arguments: Arguments, provenance: Provenance) -> ExitCode {
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        run(&arguments, &provenance)
    })
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.list {
        let claims = claims::all().map(|c| (c.id, c.title));
        if arguments.json {
            let entry = |id: &str, title: &str| json!({ "id": id, "title": title });
            let lists = json!({
                "items": ITEMS.iter().map(|i| entry(i.id, i.title)).collect::<Vec<_>>(),
                "claims": claims::all().map(|c| entry(c.id, c.title)).collect::<Vec<_>>(),
            });
            return cli::print_object(lists, provenance);
        }
        let all: Vec<(&str, &str)> = ITEMS.iter().map(|i| (i.id, i.title)).chain(claims).collect();
        let width = all.iter().map(|(id, _)| id.len()).max().unwrap_or(0);
        let lines: Vec<String> = all.iter().map(|(id, title)| format!("{id:width$}  {title}")).collect();
        return cli::print(&lines.join("\n"));
    }
    let mut chosen: Vec<&Item> = Vec::new();
    let mut claims: Vec<&'static Claim> = Vec::new();
    if arguments.only.is_empty() {
        chosen.extend(&ITEMS);
    }
    for id in &arguments.only {
        if let Some(item) = ITEMS.iter().find(|i| names::same(i.id, id)) {
            if !chosen.iter().any(|known| known.id == item.id) {
                chosen.push(item);
            }
        } else if let Some(claim) = claims::find(id) {
            if !claims.iter().any(|known| known.id == claim.id) {
                claims.push(claim);
            }
        } else {
            let ids = ITEMS.iter().map(|i| i.id).chain(claims::all().map(|c| c.id));
            let perhaps = names::perhaps(id, ids);
            return Err(Error::Unknown(format!("no item or claim is called \"{id}\"{perhaps}; see reproduce --list")));
        }
    }
    if let Some(path) = &arguments.html {
        check_target(path)?;
    }
    let mut context = Context::new(
        &arguments.out,
        arguments.meshes.as_deref(),
        arguments.quick,
        arguments.times,
        arguments.check.as_deref(),
        arguments.figures.formats(),
        // A run of everything has a screen of its own.
        if arguments.only.is_empty() && !arguments.json { Printer::Silent } else { Printer::new(arguments.json) },
    )?;
    let steps = chosen.len() + usize::from(!claims.is_empty());
    let progress = Progress::new("reproduce", steps, arguments.common.quiet);
    let width = ITEMS.iter().map(|i| i.id.len()).max().unwrap_or(0);
    let mut made = Made::default();
    for item in &chosen {
        progress.message(item.id);
        let start = Instant::now();
        context.run(item)?;
        let new = std::mem::take(&mut context.made);
        progress.line(format_args!("{:width$} {:6.1} s  {new}", item.id, start.elapsed().as_secs_f64()));
        made += &new;
        progress.step();
    }
    if !claims.is_empty() {
        progress.message("claims");
        claims::run_alone(&mut context, &claims)?;
        progress.step();
    }
    drop(progress);
    if let Some(path) = &arguments.html {
        let (name, noise) = context.argument(&corpus::HORSE);
        let mesh = MeshFlags { noise, ..MeshFlags::default() };
        compare_solvers::write_page(path, &name, &mesh, &arguments.common, provenance)?;
    }
    if !chosen.is_empty() {
        context.write_index(&ITEMS)?;
    }
    if arguments.only.is_empty() && !arguments.json {
        cli::print(&summary::screen(&context, &made))?;
    } else if !chosen.is_empty() {
        arguments.common.remark(format_args!("reports: {}", context.folder().display()));
    }
    arguments.common.remark_on_replaced();
    let claims = claims::json(&context.ledger);
    context.finish(claims, provenance)
}
