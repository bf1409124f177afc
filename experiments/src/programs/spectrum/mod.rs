//! Extreme or all eigenvalues, proven bounds, singularity: `spectrum [MESH|SYSTEM_DIR…]`; iteration matrices.

mod findings;
mod iteration_matrices;
mod tables;

use std::process::ExitCode;

use clap::{Parser, ValueHint};
use serde_json::Value;

use crate::cli::{self, CommonFlags, Input, List, MeshFlags, OutputFlags, Progress, StopFlags};
use crate::report::{Provenance, Table};
use crate::studies::complex_spectrum::ComplexFindings;
use crate::studies::{iteration_matrix, modes};
use findings::{analyse, analyse_given};
use limitlab::Result;
use limitlab::mesh::features::Features;
use limitlab::mesh::order::Order;
use limitlab::solvers::Method;

/// In its help.
const EXAMPLES: [&str; 3] = [
    "spectrum model.off --modes 6",
    "spectrum icosphere:2 --scheme loop --full --json",
    "spectrum torus:16x16 --iteration-matrix gauss-seidel,sor:1.1 --order bfs --pseudospectra",
];

/// Extreme eigenvalues of A and D⁻¹A, rates of all methods, proven bounds, and whether the system is singular.
///
/// Rates are the spectral radii of the methods' error matrices. A folder is taken for a system of anybody, as
/// `compare-solvers` does: then the bounds are those of its entries, and singular is what rounding cannot tell from it.
///
/// Where a mesh has darts or semi-sharp vertices, no diagonal makes A symmetric: all eigenvalues, which may be complex, are
/// computed (up to 2000 vertices), without bounds, which are proven for symmetric matrices.
#[derive(Parser)]
#[command(name = "spectrum", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE_ANYHOW, None))]
pub struct Arguments {
    /// Mesh files (.obj, .off, .ply, .usda, .stl, .glb, .gltf), built-in names, or folders with M.mtx, H.mtx and P.mtx; unless told, four
    /// built-in ones with --noise 0.1
    #[arg(value_name = "MESH|SYSTEM_DIR", value_hint = ValueHint::AnyPath)]
    meshes: Vec<String>,
    /// Compute all eigenvalues (up to 4000 vertices), with a histogram
    #[arg(long)]
    full: bool,
    /// Compute the K slowest modes, of the least eigenvalues of A, with multiplicities: a table, the modes at the vertices as CSV,
    /// and of a mesh as PLY, with a property and colours for viewers, and as a picture. On an open or creased mesh they
    /// are those of the smooth vertices, and 0 elsewhere
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=56))]
    modes: u16,
    /// Enclose the ends between proven numbers, by Cholesky factorizations of M − σH⁻¹ and the like and by Rayleigh
    /// quotients, with all rounding bounded; and bound the rates (memory: the factor)
    #[arg(long)]
    certify: bool,
    /// Leave out the spectral radii of Gauss-Seidel, SOR and SSOR, which take the longest on large meshes
    #[arg(long)]
    no_sweeps: bool,
    /// Leave out what part of the spectra the points excite
    #[arg(long)]
    no_data: bool,
    /// In place of all this, the iteration matrices T = I − N⁻¹A of stationary methods (jacobi, thall, gauss-seidel, sor, ssor, pia,
    /// w-pia): eigenvalues in the complex plane, norms, numerical radius, and the powers of T beside those of its radius. All
    /// eigenvalues up to 600 vertices, with --full up to 2000; the outermost beyond
    #[arg(long, value_name = "METHOD[:ω],…", value_parser = stationary)]
    iteration_matrix: Option<List<Method<'static>>>,
    /// Vertex order of the sweeps of --iteration-matrix: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME", requires = "iteration_matrix", default_value_t = Order::File)]
    order: Order,
    /// Draw the ε-pseudospectra of the iteration matrices too (up to 400 vertices)
    #[arg(long, requires = "iteration_matrix")]
    pseudospectra: bool,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What begins the names of its files.
const STEMS: [&str; 6] =
    ["spectrum", "spectrum-rates", "spectrum-full", "spectrum-modes", "spectrum-histogram", "spectrum-eigenvalues"];
/// What `spectrum` runs on without arguments.
const BUILT_IN: [&str; 4] = ["torus:32x32", "quad-sphere:4", "icosphere:3", "prism:9"];

/// Methods that have an iteration matrix, as a `value_parser`.
fn stationary(text: &str) -> std::result::Result<List<Method<'static>>, String> {
    text.split(',').map(iteration_matrix::stationary).collect::<std::result::Result<_, _>>().map(List)
}

/// Runs the program.
pub fn main(mut arguments: Arguments, provenance: Provenance) -> ExitCode {
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        arguments.mesh.or_built_in(&mut arguments.meshes, &BUILT_IN);
        run(&arguments, &provenance)
    })
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.mesh.print_defects(&arguments.meshes, &arguments.common, provenance)? {
        return Ok(());
    }
    arguments.output.prepare()?;
    let mut results = Vec::new();
    for name in &arguments.meshes {
        if let Some(methods) = &arguments.iteration_matrix {
            results.push(iteration_matrices::write(name, &methods.0, arguments, provenance)?);
            continue;
        }
        let (subject, findings, n, mesh) = match arguments.mesh.given(name)? {
            Some(given) => {
                arguments.output.settle(STEMS.map(|stem| given.subject.stem(stem)))?;
                let findings = analyse_given(&given, arguments)?;
                (given.subject, findings, given.points.len(), None)
            }
            None => {
                let input = arguments.mesh.input(name, &arguments.common)?;
                arguments.output.settle(STEMS.map(|stem| input.stem(stem)))?;
                if input.surface.features().is_some_and(Features::has_stars) {
                    results.push(complex(&input, arguments, provenance)?);
                    continue;
                }
                let mut findings = analyse(&input, arguments)?;
                for mode in findings.modes.iter_mut().flat_map(|modes| &mut modes.modes) {
                    mode.values = input.file_values(&mode.values);
                }
                let mesh = findings.modes.is_some().then(|| input.file_mesh());
                (input.subject(), findings, input.surface.len(), mesh)
            }
        };
        let out = &arguments.output.out;
        let made = &provenance.about(&subject.source);
        let print = |table: &Table| if arguments.output.json { Ok(()) } else { cli::print_table(table) };
        for table in &[tables::eigenvalues(&subject, &findings, n), tables::rates(&subject, &findings)] {
            table.write(out, made)?;
            print(table)?;
        }
        if let Some(full) = &findings.full {
            tables::full(&subject, full).write(out, made)?;
            let figure = tables::histogram(&subject, full, &findings.promise);
            arguments.output.figure(&subject.stem("spectrum-histogram"), &figure, made)?;
        }
        if let Some(slow) = &findings.modes {
            let table = modes::table(&subject, slow);
            modes::write(&table, &subject, slow, mesh.as_ref(), &arguments.output, made)?;
            print(&table)?;
        }
        results.push(tables::json(&subject, &findings, n));
    }
    cli::finish(results, &arguments.output, &arguments.common, provenance)
}

/// Writes what there is to say of a mesh with darts or semi-sharp vertices, and gives its JSON object.
fn complex(input: &Input, arguments: &Arguments, provenance: &Provenance) -> Result<Value> {
    let left_out = [("--modes", arguments.modes > 0), ("--certify", arguments.certify)];
    for (flag, _) in left_out.into_iter().filter(|flag| flag.1) {
        arguments.common.remark(format_args!(
            "{}: {flag} is left out, as no diagonal makes the matrix symmetric where there are darts or semi-sharp vertices",
            input.name
        ));
    }
    let progress = Progress::open(&input.name, arguments.common.quiet);
    let found = ComplexFindings::new(input, !arguments.no_sweeps, &progress).map_err(|e| input.named(e))?;
    drop(progress);
    let subject = input.subject();
    let out = &arguments.output.out;
    let made = &provenance.about(&subject.source);
    for table in found.tables(&subject) {
        table.write(out, made)?;
        if !arguments.output.json {
            cli::print_table(&table)?;
        }
    }
    if arguments.full {
        found.full_table(&subject).write(out, made)?;
        arguments.output.figure(&subject.stem("spectrum-eigenvalues"), &found.figure(&subject), made)?;
    }
    Ok(subject.json(found.json(arguments.full)))
}
