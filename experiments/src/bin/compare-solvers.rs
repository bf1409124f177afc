//! Every method on the same system, start, norm and tolerance: `compare-solvers [MESH|SYSTEM_DIR…]`.

use std::process::ExitCode;

use clap::Parser;
use serde_json::json;

use limitlab::analysis::comparison::{self, MethodRow};
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::spectrum::{Spectra, spectrum};
use limitlab::mesh::order::Order;
use limitlab::solvers::{Method, System};
use limitlab::{Error, Result};
use limitlab_experiments::cli::{
    self, CommonFlags, List, Matrix, MeshFlags, OutputFlags, Problem, Progress, StopFlags,
};
use limitlab_experiments::studies::comparison::{self as study, Asked};

/// Runs every method on the same system from the same start V = P, and prints iterations, errors, observed and
/// predicted rate, and the seconds of set-up and solve apart.
///
/// A folder is taken for a system of anybody: M.mtx (symmetric positive definite), H.mtx (the positive diagonal of H; the
/// identity if it is missing) and P.mtx (N×3, N×2 or N×1) of A V = P, A = H·M, as `assemble` writes them.
///
/// Where a mesh has darts or semi-sharp vertices, methods that need a symmetric M are left out, and the others run on all of A.
#[derive(Parser)]
#[command(name = "compare-solvers", version)]
struct Arguments {
    /// Mesh files (.obj, .off, .ply, .usda), built-in names, or folders with M.mtx, H.mtx and P.mtx; torus:32x32 with --noise 0.1 unless told
    #[arg(value_name = "MESH|SYSTEM_DIR")]
    meshes: Vec<String>,
    /// Methods, separated by commas, auto among them; all unless told
    #[arg(long, value_name = "NAME,…")]
    method: Option<List<Asked>>,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        arguments.mesh.or_built_in(&mut arguments.meshes, &["torus:32x32"]);
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    if arguments.mesh.print_defects(&arguments.meshes, &arguments.common)? {
        return Ok(());
    }
    arguments.output.prepare()?;
    let mut results = Vec::new();
    for name in &arguments.meshes {
        let problem = arguments.mesh.problem(name, &arguments.stop, arguments.order, &arguments.common)?;
        let rows = compare(&problem, arguments)?;
        let about = format!(
            "{}; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {:e} ({}).",
            problem.subject.size,
            problem.stop.tolerance * problem.scale,
            problem.subject.unit
        );
        let stem = problem.subject.stem("compare-solvers");
        let table = study::table(stem.clone(), format!("All methods on {}", problem.subject.title), about, &rows);
        table.write(&arguments.output.out)?;
        let figure = study::figure(problem.subject.title.clone(), problem.subject.unit, &rows);
        figure.render()?.save(&arguments.output.out.join(format!("{stem}.png")))?;
        if !arguments.output.json {
            cli::print(&table.to_markdown())?;
        }
        results.push(problem.subject.json(json!({ "rows": study::json(&rows) })));
    }
    cli::finish(&results, &arguments.output, &arguments.common)
}

/// The rows, their errors in the units of the files.
fn compare<'a>(problem: &'a Problem, arguments: &Arguments) -> Result<Vec<MethodRow<'a>>> {
    let asked = match &arguments.method {
        Some(list) => list.0.clone(),
        None => Method::ALL.into_iter().map(Asked::Method).chain([Asked::Auto]).collect(),
    };
    let method = |asked: &Asked| if let Asked::Method(method) = *asked { Some(method) } else { None };
    let methods: Vec<Method> = asked.iter().filter_map(method).collect();
    let auto = asked.contains(&Asked::Auto);
    let progress = |lines| Progress::new(&problem.subject.name, lines + usize::from(auto), arguments.common.quiet);
    let (progress, mut rows) = match problem.matrix() {
        Matrix::Symmetric(system) => by_methods(problem, system, &spectrum(system)?, &methods, arguments, progress)?,
        Matrix::General(system, vertex) => {
            let (left_out, methods): (Vec<_>, Vec<_>) = methods.into_iter().partition(|method| method.needs_symmetry());
            if let (Some(refused), true) = (left_out.first(), methods.is_empty() && !auto) {
                return Err(Error::mesh(&problem.subject.name, refused.refused_at(vertex).to_string()));
            }
            if !left_out.is_empty() {
                let names: Vec<&str> = left_out.iter().map(|method| method.name()).collect();
                arguments.common.remark(format_args!(
                    "{}: vertex {vertex} is a dart or semi-sharp, and no diagonal makes the matrix symmetric: left out {}",
                    problem.subject.name,
                    names.join(", ")
                ));
            }
            let spectrum = ComplexSpectrum::new(system)?;
            by_methods(problem, system, &spectrum, &methods, arguments, progress)?
        }
    };
    if auto {
        rows.push(study::auto_row(problem.auto()?));
        progress.step();
    }
    for errors in rows.iter_mut().flat_map(|row| &mut row.solution.report.history) {
        *errors = *errors * problem.scale;
    }
    Ok(rows)
}

/// The rows of methods by name, and the progress with one step left for `auto`.
fn by_methods<'a>(
    problem: &'a Problem,
    system: &impl System,
    spectra: &(impl Spectra + Clone),
    methods: &[Method<'a>],
    arguments: &Arguments,
    progress: impl FnOnce(usize) -> Progress,
) -> Result<(Progress, Vec<MethodRow<'a>>)> {
    let order_name = arguments.order.to_string();
    let lines = comparison::entries(system, spectra, methods, Some(&problem.order), &order_name)?;
    let progress = progress(lines.len());
    let done = &mut || progress.step();
    let rows = comparison::compare_entries(system, spectra, problem.data(), &lines, &problem.stop, done)?;
    Ok((progress, rows))
}
