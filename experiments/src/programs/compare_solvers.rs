//! Every method on the same system, start, norm and tolerance: `compare-solvers [MESH|SYSTEM_DIR…]`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueHint};
use nalgebra::Complex;
use serde_json::json;

use crate::cli::{
    self, CommonFlags, List, Matrix, MeshFlags, MonitorFlags, OutputFlags, Problem, Progress, StopFlags, WHICH_METHOD,
};
use crate::report::Provenance;
use crate::report::page::Page;
use crate::studies::comparison::{self as study, AUTO, Asked};
use crate::studies::error_maps::{self, ErrorMaps};
use crate::studies::histories;
use crate::studies::page::{self, Measured};
use limitlab::analysis::comparison::{MethodRow, compare_entry, entries, with_least_times};
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::dense;
use limitlab::analysis::spectrum::{Spectra, spectrum};
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::error::counted;
use limitlab::mesh::order::Order;
use limitlab::output::check_target;
use limitlab::solvers::{Errors, Method, Step, System};
use limitlab::{Error, Result};

/// In its help.
const EXAMPLES: [&str; 3] = [
    "compare-solvers model.off --tol 1e-8",
    "compare-solvers model.off --method pia,cg,auto --html page.html",
    "compare-solvers system/",
];

/// Runs every method on the same system from the same start V = P.
///
/// It prints iterations, errors, observed and predicted rate, and the seconds of set-up and solve apart, the least of several
/// runs where a run is short. Beside the picture stands a CSV file with the errors of every iterate.
///
/// A folder is taken for a system of anybody: M.mtx (symmetric positive definite), H.mtx (the positive diagonal of H; the
/// identity if it is missing) and P.mtx (N×3, N×2 or N×1) of A V = P, A = H·M, as `assemble` writes them.
///
/// Where a mesh has darts or semi-sharp vertices, methods that need a symmetric M are left out, and the others run on all of A.
#[derive(Parser)]
#[command(name = "compare-solvers", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE_ANYHOW, Some(WHICH_METHOD)))]
pub struct Arguments {
    /// Mesh files (.obj, .off, .ply, .usda, .stl, .glb, .gltf), built-in names, or folders with M.mtx, H.mtx and P.mtx; torus:32x32 with --noise 0.1 unless told
    #[arg(value_name = "MESH|SYSTEM_DIR", value_hint = ValueHint::AnyPath)]
    meshes: Vec<String>,
    /// Methods, separated by commas, auto among them; all unless told
    #[arg(long, value_name = "NAME,…")]
    method: Option<List<Asked>>,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
    /// Write the errors at every vertex after these iterations of each method that iterates, as far as it goes: a PLY file with a
    /// property each (error_5) and colours for viewers, and a picture of the first twelve
    #[arg(long, value_name = "K,…")]
    errors_at: Option<List<usize>>,
    /// Write an interactive page of one mesh or folder to this file too: curves of convergence, an ω sweep, the spectrum, the
    /// surfaces with the errors of every method; it needs a browser and no network
    #[arg(long, value_name = "FILE", value_parser = cli::file)]
    html: Option<PathBuf>,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    monitor: MonitorFlags,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// Runs the program.
pub fn main(mut arguments: Arguments, provenance: Provenance) -> ExitCode {
    if let (Some(_), several @ 2..) = (&arguments.html, arguments.meshes.len()) {
        let what = format!("--html makes a page of one mesh, and {several} are named: run the program once for each");
        Arguments::command().error(ErrorKind::ArgumentConflict, what).exit();
    }
    arguments.method = arguments.method.map(List::each_once);
    if let Some(List(at)) = &mut arguments.errors_at {
        at.sort_unstable();
        at.dedup();
    }
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        arguments.mesh.or_built_in(&mut arguments.meshes, &["torus:32x32"]);
        run(&arguments, &provenance)
    })
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.mesh.print_defects(&arguments.meshes, &arguments.common, provenance)? {
        return Ok(());
    }
    arguments.output.prepare()?;
    if let Some(path) = &arguments.html {
        arguments.output.replace.settle(path)?;
        check_target(path)?;
    }
    let mut results = Vec::new();
    for name in &arguments.meshes {
        let problem = arguments.mesh.problem(name, &arguments.stop, arguments.order, &arguments.common)?;
        let stem = problem.subject.stem("compare-solvers");
        arguments.output.settle([&stem])?;
        let made = provenance.about(&problem.subject.source);
        if arguments.errors_at.is_some() && problem.mesh().is_none() {
            let what = "--errors-at is about the vertices of a mesh, and this is a system without one: leave it out";
            return Err(Error::mesh(name, what));
        }
        let Compared { rows, refused, measured, error_maps } = compare(&problem, &arguments.wanted())?;
        arguments.output.settle(error_maps.iter().flatten().map(|maps| maps.id(&stem)))?;
        let about = format!(
            "{}; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {:.3e} ({}).",
            problem.subject.size,
            problem.stop.tolerance * problem.scale,
            problem.subject.unit
        );
        let table = study::table(stem.clone(), format!("All methods on {}", problem.subject.title), about, &rows);
        table.write(&arguments.output.out, &made)?;
        let figure = study::figure(problem.subject.caption(), problem.subject.unit, &rows);
        arguments.output.figure(&stem, &figure, &made)?;
        let histories = rows.iter().map(|row| &row.solution.report.history);
        let runs = rows.iter().map(|row| [row.method.to_string(), row.parameter.clone()]);
        histories::write(
            &arguments.output.out.join(format!("{stem}-history.csv")),
            ["method", "parameter"],
            runs.zip(histories.clone().map(Vec::as_slice)),
            &made,
        )?;
        if let (Some(path), Some(measured)) = (&arguments.html, measured) {
            write(path, page::page(&problem, measured, &rows, refused)?, &made, &arguments.common)?;
        }
        if !arguments.output.json {
            cli::print_table(&table)?;
        }
        let mut objects = study::json(&rows);
        for (object, history) in objects.as_array_mut().into_iter().flatten().zip(histories) {
            object["history"] = histories::json(history);
        }
        for (object, maps) in objects.as_array_mut().into_iter().flatten().zip(error_maps) {
            if let Some(maps) = maps {
                object["error_maps"] = maps.write(&problem, &stem, &arguments.output, &made)?;
            }
        }
        results.push(problem.subject.json(json!({ "rows": objects })));
    }
    cli::finish(results, &arguments.output, &arguments.common, provenance)
}

/// Writes the interactive page of all methods on one mesh, as `--html` does.
///
/// # Errors
/// As the program has them.
pub fn write_page(
    path: &Path,
    name: &str,
    mesh: &MeshFlags,
    common: &CommonFlags,
    provenance: &Provenance,
) -> Result<()> {
    let problem = mesh.problem(name, &StopFlags::default(), Order::File, common)?;
    let wanted = Wanted {
        methods: None,
        order: Order::File,
        page: true,
        errors_at: None,
        monitor: &MonitorFlags::default(),
        common,
    };
    let Compared { rows, refused, measured, .. } = compare(&problem, &wanted)?;
    let Some(measured) = measured else {
        return Ok(());
    };
    let page = page::page(&problem, measured, &rows, refused)?;
    write(path, page, &provenance.about(&problem.subject.source), common)
}

fn write(path: &Path, page: Page, made: &Provenance, common: &CommonFlags) -> Result<()> {
    page.write(path, made)?;
    common.remark(format_args!("interactive page: {}", path.display()));
    Ok(())
}

/// What is compared, and what of it is shown.
struct Wanted<'a> {
    /// All unless told.
    methods: Option<&'a [Asked]>,
    order: Order,
    page: bool,
    /// Iterations, ascending, whose errors at the vertices are kept.
    errors_at: Option<&'a [usize]>,
    monitor: &'a MonitorFlags,
    common: &'a CommonFlags,
}

impl Arguments {
    fn wanted(&self) -> Wanted<'_> {
        Wanted {
            methods: self.method.as_ref().map(|list| &list.0[..]),
            order: self.order,
            page: self.html.is_some(),
            errors_at: self.errors_at.as_ref().map(|list| &list.0[..]),
            monitor: &self.monitor,
            common: &self.common,
        }
    }
}

/// What comes of one mesh or folder.
struct Compared<'a> {
    /// Their errors in the units of the files.
    rows: Vec<MethodRow<'a>>,
    /// Which methods were left out, and why.
    refused: Option<String>,
    /// For the page, if one was asked for.
    measured: Option<Measured>,
    /// One a row, if they were asked for.
    error_maps: Vec<Option<ErrorMaps>>,
}

fn compare<'a>(problem: &'a Problem, wanted: &Wanted) -> Result<Compared<'a>> {
    let asked = match wanted.methods {
        Some(list) => list.to_vec(),
        None => Method::ALL.into_iter().map(Asked::Method).chain([Asked::Auto]).collect(),
    };
    let method = |asked: &Asked| if let Asked::Method(method) = *asked { Some(method) } else { None };
    let methods: Vec<Method> = asked.iter().filter_map(method).collect();
    let auto = asked.contains(&Asked::Auto);
    let mut refused = None;
    let mut compared = match problem.matrix() {
        Matrix::Symmetric(system) => {
            let eigenvalues = |_: &_| {
                let all = (system.len() <= dense::LARGEST).then(|| dense::eigenvalues(system)).transpose()?;
                let complex = |all: Vec<f64>| all.into_iter().map(Complex::from).collect();
                Ok(all.map(|all| [complex(all.a), complex(all.jacobi)]))
            };
            by_methods(problem, system, &spectrum(system)?, eigenvalues, (&methods, auto), wanted)?
        }
        Matrix::General(system, vertex) => {
            let (left_out, methods): (Vec<_>, Vec<_>) = methods.into_iter().partition(|method| method.needs_symmetry());
            if let (Some(refused), true) = (left_out.first(), methods.is_empty() && !auto) {
                return Err(Error::mesh(&problem.subject.name, refused.refused_at(vertex).to_string()));
            }
            if !left_out.is_empty() {
                let names: Vec<&str> = left_out.iter().map(|method| method.name()).collect();
                let what = format!(
                    "vertex {vertex} is a dart or semi-sharp, and no diagonal makes the matrix symmetric: left out {}",
                    names.join(", ")
                );
                wanted.common.remark(format_args!("{}: {what}", problem.subject.name));
                refused = Some(what);
            }
            let eigenvalues = |spectrum: &ComplexSpectrum| {
                let of = |form| spectrum.eigenvalues(form).map(<[_]>::to_vec);
                Ok(of(SymmetricForm::A).zip(of(SymmetricForm::Jacobi)).map(<[_; 2]>::from))
            };
            by_methods(problem, system, &ComplexSpectrum::new(system)?, eigenvalues, (&methods, auto), wanted)?
        }
    };
    for recorded in compared.rows.iter_mut().flat_map(|row| &mut row.solution.report.history) {
        recorded.errors = recorded.errors * problem.scale;
    }
    Ok(Compared { refused, ..compared })
}

/// The rows of methods by name, and of `auto` if it is asked for; what the page needs beside them, with all `eigenvalues` of A
/// and of D⁻¹A where there are not too many.
fn by_methods<'a, S: System, K: Spectra + Clone + Sync>(
    problem: &'a Problem,
    system: &S,
    spectra: &K,
    eigenvalues: impl FnOnce(&K) -> Result<Option<[Vec<Complex<f64>>; 2]>>,
    (methods, auto): (&[Method<'a>], bool),
    wanted: &Wanted,
) -> Result<Compared<'a>> {
    let order_name = wanted.order.to_string();
    let lines = entries(system, spectra, methods, Some(&problem.order), &order_name)?;
    let subject = &problem.subject.name;
    let of_rows = Progress::new(subject, lines.len() + usize::from(auto), wanted.monitor.no_bar(wanted.common));
    let see = |name: &str, iteration, errors: Errors| {
        wanted.monitor.see(format_args!("{subject}: {name}"), iteration, errors * problem.scale);
        ControlFlow::Continue(())
    };
    let mut rows = Vec::new();
    for line in &lines {
        let name = study::name(line);
        of_rows.message(name.as_str());
        let watch = &mut |step: &Step| see(&name, step.iteration, step.errors);
        rows.push(compare_entry(system, spectra, problem.data(), line, &problem.stop, watch)?);
        of_rows.step();
    }
    if auto {
        of_rows.message(AUTO);
        let watch = &mut |method: &str, step: &Step| see(&format!("{AUTO} ({method})"), step.iteration, step.errors);
        let again = || problem.auto(&mut |_, _| ControlFlow::Continue(()));
        rows.push(study::auto_row(with_least_times(problem.auto(watch)?, again)?));
        of_rows.step();
    }
    drop(of_rows);
    let error_maps = match wanted.errors_at {
        Some(at) => error_maps(problem, system, &rows, at, wanted.common)?,
        None => Vec::new(),
    };
    if !wanted.page {
        return Ok(Compared { rows, refused: None, measured: None, error_maps });
    }
    let of_page = Progress::new(subject, page::steps(system, &rows), wanted.common.quiet);
    let measured = page::measure(problem, system, spectra, eigenvalues(spectra)?, &rows, &of_page)?;
    Ok(Compared { rows, refused: None, measured: Some(measured), error_maps })
}

/// The errors at the vertices after the iterations `at`, one a row; says which rows have none, or not all.
fn error_maps(
    problem: &Problem,
    system: &impl System,
    rows: &[MethodRow],
    at: &[usize],
    common: &CommonFlags,
) -> Result<Vec<Option<ErrorMaps>>> {
    let subject = &problem.subject.name;
    let maps: Vec<_> = rows.iter().map(|row| error_maps::measure(problem, system, row, at)).collect();
    let without = rows.iter().zip(&maps).filter(|(_, maps)| maps.is_none());
    let without: Vec<String> = without.map(|(row, _)| study::label(row)).collect();
    let what = "no errors at the vertices after these iterations: solved at once or by corrections, or ended before";
    if without.len() == rows.len() {
        let what = format!("{}: {what}; name a method that iterates, such as --method pia", without.join(", "));
        return Err(Error::mesh(subject, what));
    }
    if !without.is_empty() {
        common.remark(format_args!("{subject}: {}: {what}", without.join(", ")));
    }
    for (row, maps) in rows.iter().zip(&maps) {
        let last = row.solution.report.iterations;
        if maps.is_some() && at.iter().any(|&k| k > last) {
            common.remark(format_args!(
                "{subject}: {} ended after {}: no errors beyond",
                row.method.name(),
                counted(last, "iteration")
            ));
        }
    }
    Ok(maps)
}
