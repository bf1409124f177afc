//! The control mesh whose limit surface passes through the vertices of a mesh: `interpolate MESH -o OUT`.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use serde_json::json;

use limitlab::Result;
use limitlab::analysis::comparison::{automatic, standard_setup};
use limitlab::analysis::spectrum::spectrum;
use limitlab::cli::{self, CommonFlags, Input, MeshFlags, Progress, StopFlags, number};
use limitlab::error::Error;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Mesh, io};
use limitlab::solvers::{Method, Outcome, Solution, run_watched};

/// Computes the control mesh V with A V = P: the vertices P of the mesh become points of the limit surface. The
/// faces stay, vertex for vertex, so that the result can replace the mesh in any subdivision tool.
#[derive(Parser)]
#[command(name = "interpolate", version)]
struct Arguments {
    /// A mesh file (.obj, .off, .ply) or a built-in name
    #[arg(value_name = "MESH")]
    input: String,
    /// The control mesh to write (.obj, .off, .ply)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// auto, lu, cholesky, ldlt, jacobi, thall, gauss-seidel, sor, ssor, pia, w-pia, chebyshev, cg, pcg-jacobi,
    /// pcg-ssor or pcg-ic0; auto is chebyshev with proven bounds where there are any, else cg, and ldlt where that makes
    /// no progress
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = choice)]
    method: Choice,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, random or random:SEED
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// `--method`: a name, or `None` for `auto`.
type Choice = Option<Method>;

fn choice(text: &str) -> Result<Choice> {
    if text == "auto" {
        Ok(None)
    } else {
        text.parse().map(Some)
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    let Some(input) = arguments.mesh.input(&arguments.input, &arguments.common)? else {
        return Ok(());
    };
    io::check_name(&arguments.output)?;
    let start = Instant::now();
    let system = input.system()?;
    let assemble_seconds = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let order = arguments
        .order
        .order(&input.mesh, &input.topology.incidence);
    let stop = arguments.stop.stop(&input.mesh);
    let progress = Progress::open("solving", arguments.common.quiet);
    let solve = |method: Method| -> Result<Solution> {
        let setup = standard_setup(&system, method, Some(&order), &|| spectrum(&system))?;
        let points = &input.mesh.positions;
        Ok(run_watched(&system, points, setup, &stop, &mut |step| {
            progress.step();
            progress.message(format!("{method}: max error {:.2e}", step.errors.max));
            ControlFlow::Continue(())
        }))
    };
    let mut method = arguments.method.unwrap_or_else(|| automatic(&system));
    let mut solution = solve(method)?;
    let outcome = solution.report.outcome;
    if arguments.method.is_none() && matches!(outcome, Outcome::Stagnated | Outcome::Diverged) {
        // A factorization tells a nearly singular matrix, on which iterations may make no progress for long, from a
        // singular one.
        method = Method::Ldlt;
        solution = solve(method)?;
    }
    drop(progress);
    let solve_seconds = start.elapsed().as_secs_f64();
    check(&input, method, &solution, stop.tolerance)?;

    let start = Instant::now();
    let control = Mesh::new(solution.points, input.mesh.faces.clone());
    io::write(&arguments.output, &control, None)?;
    let write_seconds = start.elapsed().as_secs_f64();

    let report = &solution.report;
    let last = report.last();
    arguments.common.remark(format_args!(
        "{}: {} by {method}, {} iterations, max error {:.3e}, mean {:.3e} (mesh units)",
        arguments.output.display(),
        input.scheme,
        report.iterations,
        last.max,
        last.mean
    ));
    arguments.common.remark(format_args!(
        "seconds: read {:.3}, assemble {assemble_seconds:.3}, solve {solve_seconds:.3}, write {write_seconds:.3}",
        input.read_seconds
    ));
    if arguments.json {
        let object = input.json(json!({
            "method": method.name(),
            "iterations": report.iterations,
            "status": report.outcome.name(),
            "max_error": number(last.max),
            "mean_error": number(last.mean),
            "tolerance": number(stop.tolerance),
            "output": arguments.output.display().to_string(),
            "seconds": {
                "read": number(input.read_seconds),
                "assemble": number(assemble_seconds),
                "solve": number(solve_seconds),
                "write": number(write_seconds),
            },
        }));
        cli::print(&format!("{object:#}"))?;
    }
    Ok(())
}

/// A run that did not converge gives no control mesh.
fn check(input: &Input, method: Method, solution: &Solution, tolerance: f64) -> Result<()> {
    let report = &solution.report;
    let what = match report.outcome {
        Outcome::Converged => return Ok(()),
        Outcome::Singular => {
            "the matrix is singular (valences 3 and a bipartite graph?); the points decide whether a control mesh \
             exists: try --method pia"
        }
        Outcome::Diverged => "the iteration diverged; try --method auto",
        Outcome::MaxIterations => "the iterations ran out; raise --max-iter, or try --method auto",
        Outcome::Stagnated => {
            "the error no longer shrinks: raise --tol if it is below rounding; else the matrix is nearly singular, or no \
             control mesh exists: --method ldlt tells which"
        }
        Outcome::Breakdown | Outcome::Stopped => "the method broke down; try another --method",
    };
    let detail = report
        .detail
        .as_ref()
        .map_or_else(String::new, |d| format!(" [{d}]"));
    Err(Error::mesh(
        &input.name,
        format!(
            "{method} under {} ended as {} after {} iterations with max error {:.3e} against {tolerance:.3e}{detail}; \
             {what}",
            input.scheme,
            report.outcome,
            report.iterations,
            report.last().max
        ),
    ))
}
