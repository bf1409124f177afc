//! The system of one mesh by `auto` and by other libraries: seconds, memory, error. See `README.md` beside it.
//!
//! Each peer runs in a process of its own, all in turn in each round: those of Rust are this program again, those of Python
//! `peers.py`, the others what `make` built. All get the same system, and every solution is read back and measured here.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use clap::Parser;
use glam::DVec3;
use limitlab::assemble::petsc::{Export, Index, ORDER, read_control};
use limitlab::assemble::{LimitSystem, StreamedSystem};
use limitlab::error::{Error, Result};
use limitlab::interpolate::{Options, interpolate, limit_points};
use limitlab::mesh::generate::permute_vertices;
use limitlab::mesh::noise::move_vertices;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Incidence, Surface, builtin};
use limitlab::output::{create_dir, write_file};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Stop, run};
use limitlab_experiments::cli;
use limitlab_experiments::report::{
    Column, Columns, Figure, Format, LinePlot, Provenance, Scale, Series, marker, palette, provenance::Source,
};
use serde_json::{Value, json};
use sprs::CsMat;
use sprs::prod::mul_acc_mat_vec_csr;

/// Measures the peers of `auto`, and writes peers.md, peers.csv and peers.png.
#[derive(Parser)]
#[command(name = "peers", version = cli::VERSION)]
struct Arguments {
    /// A built-in mesh; it carries --noise 0.1
    #[arg(long, value_name = "NAME", default_value = "irregular-quad:100000")]
    mesh: String,
    #[arg(long, value_name = "NAME", default_value = "catmull-clark")]
    scheme: Scheme,
    /// The order of the vertices, for all: curve or random
    #[arg(long, value_name = "NAME", default_value = "curve")]
    order: Order,
    /// Stop at max ‖p − A v‖ ≤ T·L, of what stops so
    #[arg(long, value_name = "T", default_value_t = 1e-10)]
    tol: f64,
    /// Rounds in turn; a peer that took longer than 5 seconds runs in the first alone
    #[arg(long, value_name = "K", default_value_t = 3)]
    rounds: usize,
    /// Seconds that one run may take
    #[arg(long, value_name = "S", default_value_t = 30)]
    limit: u64,
    /// Threads of those that use them, and processes of PETSc
    #[arg(long, value_name = "N", default_value_t = 2)]
    threads: usize,
    /// Folder of what `make` built here and in engines/petsc
    #[arg(long, value_name = "DIR", default_value = "target/peers")]
    build: PathBuf,
    /// The Python that has the packages
    #[arg(long, value_name = "FILE", default_value = "python3")]
    python: PathBuf,
    /// Folder for the tables and the picture
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// One peer of Rust, as this program starts itself
    #[arg(long, value_name = "NAME", hide = true)]
    one: Option<String>,
    /// Folder of the system
    #[arg(long, value_name = "DIR", hide = true)]
    system: Option<PathBuf>,
}

/// Where a peer comes from.
#[derive(Clone, Copy)]
enum Origin {
    /// This program, with threads.
    Rust(&'static str, bool),
    Python(&'static str, bool),
    Built(&'static str, &'static str, bool),
    /// On one process, or as many as threads are asked for.
    Petsc(bool),
}

/// Who takes part, by the libraries' names.
const PEERS: [(&str, Origin); 18] = [
    ("limitlab auto", Origin::Rust("auto", true)),
    ("limitlab auto", Origin::Rust("auto", false)),
    ("limitlab cg", Origin::Rust("cg", true)),
    ("faer LLT", Origin::Rust("faer-llt", false)),
    ("faer LU", Origin::Rust("faer-lu", false)),
    ("nalgebra-sparse Cholesky", Origin::Rust("nalgebra-sparse", false)),
    ("sprs products, CG", Origin::Rust("sprs", false)),
    ("SciPy SuperLU", Origin::Python("superlu", false)),
    ("SciPy CG, Jacobi", Origin::Python("scipy-cg", false)),
    ("PARDISO LLT (MKL)", Origin::Python("pardiso", true)),
    ("PyAMG CG, aggregation", Origin::Python("pyamg", false)),
    ("CHOLMOD LLT", Origin::Built("suitesparse", "cholmod", true)),
    ("UMFPACK LU", Origin::Built("suitesparse", "umfpack", false)),
    ("AMGCL CG, aggregation", Origin::Built("amgcl", "amg", true)),
    ("AMGCL CG, SPAI-0", Origin::Built("amgcl", "spai0", true)),
    ("PETSc CG", Origin::Petsc(false)),
    ("PETSc CG", Origin::Petsc(true)),
    ("UMFPACK LU (scikit-umfpack)", Origin::Python("umfpack", false)),
];

/// What came of one run.
enum Ran {
    Done(Run),
    /// It is not on this machine, or took too long, or failed: in words.
    Not(String),
}

#[derive(Clone)]
struct Run {
    setup: f64,
    solve: f64,
    megabytes: f64,
    iterations: Option<i64>,
    error: f64,
}

fn main() -> ExitCode {
    let (arguments, provenance) = cli::parse::<Arguments>();
    cli::exit(|| match (&arguments.one, &arguments.system) {
        (Some(name), Some(folder)) => one(&arguments, name, folder),
        _ => all(&arguments, provenance),
    })
}

/// The mesh that all take, in the order asked for.
fn surface(arguments: &Arguments) -> Result<Surface> {
    let mesh = builtin::builtin(&arguments.mesh)?;
    let order = arguments.order.order(&mesh, &Incidence::new(&mesh.faces, mesh.len()));
    let mut surface = Surface::new(permute_vertices(&mesh, &order))?;
    move_vertices(&mut surface, 0.1, 1);
    Ok(surface)
}

/// A peer of Rust: the solution to X.petsc, and what it took to standard output.
fn one(arguments: &Arguments, name: &str, folder: &Path) -> Result<()> {
    let threads = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build_global();
    threads.map_err(|e| Error::Computation(e.to_string()))?;
    let surface = surface(arguments)?;
    let stop = Stop { tolerance: arguments.tol * surface.diagonal(), max_iterations: 10_000 };
    let points = surface.positions().to_vec();
    let stored = |method: Method| {
        let system = LimitSystem::new(&surface, arguments.scheme)?;
        from_here();
        let solution = run(&system, &points, method, &stop);
        let iterations = matches!(method, Method::Cg).then_some(solution.report.iterations);
        check(solution.report.outcome)?;
        Ok((solution.setup_seconds, solution.solve_seconds, iterations, solution.points))
    };
    let (setup, solve, iterations, control) = match name {
        "auto" => {
            from_here();
            let found = interpolate(&surface, arguments.scheme, &Options::from(stop))?;
            check(found.report.outcome)?;
            (found.setup_seconds, found.solve_seconds, Some(found.report.iterations), found.points)
        }
        "cg" => stored(Method::Cg)?,
        "faer-llt" => stored(Method::Cholesky)?,
        "faer-lu" => stored(Method::Lu)?,
        "nalgebra-sparse" => stored(Method::SecondCholesky)?,
        _ => by_products(&LimitSystem::new(&surface, arguments.scheme)?, &points)?,
    };
    let megabytes = memory()?;
    let numbers = control.iter().flat_map(|p| p.to_array());
    write_file(&folder.join("X.petsc"), |out| {
        [1_211_214, 3 * control.len() as u32].iter().try_for_each(|i| out.write_all(&i.to_be_bytes()))?;
        numbers.clone().try_for_each(|x| out.write_all(&x.to_be_bytes()))
    })?;
    let seconds = json!({ "setup": setup, "solve": solve });
    cli::print(&json!({ "seconds": seconds, "iterations": iterations, "megabytes": megabytes }).to_string())
}

type Solved = (f64, f64, Option<usize>, Vec<DVec3>);

/// M V = R scaled to a diagonal of ones, each coordinate by itself, to a relative residual of 3·10⁻¹²: conjugate gradients on the
/// products of sprs, whose own BiCGSTAB keeps its vectors sparse and takes 17 s at 10 000 vertices.
fn by_products(system: &LimitSystem, points: &[DVec3]) -> Result<Solved> {
    from_here();
    let start = Instant::now();
    let scale: Vec<f64> = system.m.diagonal().iter().map(|d| 1.0 / d.sqrt()).collect();
    let scaled = system.m.scale_symmetrically(&scale);
    let wide = |all: &[u32]| all.iter().map(|&i| i as usize).collect::<Vec<_>>();
    let (offsets, columns) = (wide(scaled.pattern().offsets()), wide(scaled.pattern().columns()));
    let matrix = CsMat::new((points.len(), points.len()), offsets, columns, scaled.values().to_vec());
    let setup = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let right = system.symmetric_right_hand_side(points);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut control = vec![DVec3::ZERO; points.len()];
    let mut most = 0;
    for axis in 0..3 {
        let mut x: Vec<f64> = points.iter().zip(&scale).map(|(p, s)| p[axis] / s).collect();
        let mut r: Vec<f64> = right.iter().zip(&scale).map(|(r, s)| r[axis] * s).collect();
        let end = 3e-12 * dot(&r, &r).sqrt();
        let mut product = vec![0.0; x.len()];
        mul_acc_mat_vec_csr(matrix.view(), &x[..], &mut product[..]);
        r.iter_mut().zip(&product).for_each(|(r, q)| *r -= q);
        let mut direction = r.clone();
        let mut square = dot(&r, &r);
        let mut iterations = 0;
        while square.sqrt() > end && iterations < 1000 {
            product.fill(0.0);
            mul_acc_mat_vec_csr(matrix.view(), &direction[..], &mut product[..]);
            let step = square / dot(&direction, &product);
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
            r.iter_mut().zip(&product).for_each(|(r, q)| *r -= step * q);
            let before = square;
            square = dot(&r, &r);
            direction.iter_mut().zip(&r).for_each(|(d, r)| *d = r + square / before * *d);
            iterations += 1;
        }
        most = most.max(iterations);
        control.iter_mut().zip(&x).zip(&scale).for_each(|((v, x), s)| v[axis] = x * s);
    }
    Ok((setup, start.elapsed().as_secs_f64(), Some(most), control))
}

fn check(outcome: Outcome) -> Result<()> {
    match outcome {
        Outcome::Converged => Ok(()),
        other => Err(Error::Computation(format!("it ended as {other}"))),
    }
}

/// From here on the peak of memory is that of the work, and of what is held beside it; where the system lets that be said.
fn from_here() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// The peak of the resident set in MB.
fn memory() -> Result<f64> {
    let path = Path::new("/proc/self/status");
    let status = fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    Ok(kilobytes.unwrap_or(f64::NAN) / 1024.0)
}

/// All peers, in turn.
fn all(arguments: &Arguments, provenance: Provenance) -> Result<()> {
    create_dir(&arguments.out)?;
    let folder = std::env::temp_dir().join(format!("limitlab-peers-{}", std::process::id()));
    create_dir(&folder)?;
    let done = measured(arguments, provenance, &folder);
    let _ = fs::remove_dir_all(&folder);
    done
}

fn measured(arguments: &Arguments, provenance: Provenance, folder: &Path) -> Result<()> {
    let surface = surface(arguments)?;
    export(&surface, arguments, folder)?;
    let mut runs: BTreeMap<usize, Vec<Run>> = BTreeMap::new();
    let mut absent: BTreeMap<usize, String> = BTreeMap::new();
    for round in 0..arguments.rounds {
        for (k, &(name, from)) in PEERS.iter().enumerate() {
            let is_slow = runs.get(&k).is_some_and(|runs| runs.iter().any(|run| run.setup + run.solve > 5.0));
            if is_slow || absent.contains_key(&k) {
                continue;
            }
            match ran(arguments, from, folder, &surface)? {
                Ran::Done(run) => {
                    cli::say(format_args!(
                        "{}: {}: {:.3} + {:.3} s, {:.0} MB, error {:.1e}·L",
                        round + 1,
                        label(arguments, name, from),
                        run.setup,
                        run.solve,
                        run.megabytes,
                        run.error
                    ));
                    runs.entry(k).or_default().push(run);
                }
                Ran::Not(why) => {
                    cli::say(format_args!("{}: {}: {why}", round + 1, label(arguments, name, from)));
                    absent.insert(k, why);
                }
            }
        }
    }
    write(arguments, &provenance, &surface, &runs, &absent)
}

/// The files of the system.
fn export(surface: &Surface, arguments: &Arguments, folder: &Path) -> Result<()> {
    let order: Vec<u32> = (0..surface.len() as u32).collect();
    let system = StreamedSystem::new(surface, arguments.scheme, &order)?;
    let export = Export::new(&system, Index::Bits32)?;
    write_file(&folder.join("M.petsc"), |out| export.write_matrix(out))?;
    write_file(&folder.join("R.petsc"), |out| export.write_right_hand_side(surface.positions(), out))?;
    write_file(&folder.join("H.petsc"), |out| export.write_weights(out))?;
    write_file(&folder.join(ORDER), |out| export.write_order(out))?;
    let manifest = json!({ "diagonal": surface.diagonal(), "index": 32 }).to_string();
    write_file(&folder.join(cli::MANIFEST), |out| out.write_all(manifest.as_bytes()))
}

/// How many threads, or processes.
fn threads(arguments: &Arguments, from: Origin) -> usize {
    match from {
        Origin::Rust(_, many) | Origin::Python(_, many) | Origin::Built(_, _, many) | Origin::Petsc(many) => {
            if many {
                arguments.threads
            } else {
                1
            }
        }
    }
}

fn label(arguments: &Arguments, name: &str, from: Origin) -> String {
    let unit = if matches!(from, Origin::Petsc(_)) { "P" } else { "T" };
    format!("{name}, {}{unit}", threads(arguments, from))
}

/// Runs one peer, and measures its solution.
fn ran(arguments: &Arguments, from: Origin, folder: &Path, surface: &Surface) -> Result<Ran> {
    let threads = threads(arguments, from).to_string();
    let built = |name: &str| arguments.build.join(name);
    let mut command = match from {
        Origin::Rust(name, _) => {
            let this = std::env::current_exe().map_err(|e| Error::io(Path::new("peers"), "find", e))?;
            let mut command = Command::new(this);
            command.args(["--one", name, "--threads", &threads, "--mesh", &arguments.mesh]);
            command.args(["--scheme", arguments.scheme.name(), "--order", &arguments.order.to_string()]);
            command.args(["--tol", &arguments.tol.to_string()]).arg("--system").arg(folder);
            command
        }
        Origin::Python(name, _) => {
            let mut command = Command::new(&arguments.python);
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../benches/peers/peers.py");
            command.args([script, name]).arg(folder).arg(&threads);
            command
        }
        Origin::Built(program, method, _) => {
            let mut command = Command::new(built(program));
            command.arg(method).arg(folder).arg(&threads);
            command
        }
        Origin::Petsc(_) => {
            if !built("solve").exists() {
                return Ok(Ran::Not("not built".into()));
            }
            let mut command = Command::new("mpirun");
            command.args(["-n", &threads]).arg(built("solve")).arg("-dir").arg(folder);
            command.args(["-tol", &arguments.tol.to_string()]);
            command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
            command.env("OMPI_MCA_rmaps_base_oversubscribe", "1");
            command
        }
    };
    let for_threads = if matches!(from, Origin::Petsc(_)) { "1" } else { &threads };
    for name in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"] {
        command.env(name, for_threads);
    }
    // Threads that wait by turning round take the time of those that work.
    command.env("OMP_WAIT_POLICY", "passive");
    let solution = folder.join("X.petsc");
    let _ = fs::remove_file(&solution);
    let told = match output(&mut command, Duration::from_secs(arguments.limit)) {
        Ok(told) => told,
        Err(why) => return Ok(Ran::Not(why)),
    };
    if let Some(name) = told["missing"].as_str() {
        return Ok(Ran::Not(format!("no {name} here")));
    }
    let control = match read_control(&solution, surface, arguments.scheme) {
        Ok(control) => control,
        Err(e) => return Ok(Ran::Not(e.to_string())),
    };
    let limits = limit_points(&surface.with_positions(control), arguments.scheme)?;
    let distances = limits.iter().zip(surface.positions()).map(|(a, p)| a.distance(*p));
    let seconds = |of: &str| told["seconds"][of].as_f64();
    Ok(Ran::Done(Run {
        setup: seconds("setup").or(seconds("assemble")).unwrap_or(f64::NAN),
        solve: seconds("solve").unwrap_or(f64::NAN),
        megabytes: told["megabytes"].as_f64().unwrap_or(f64::NAN),
        iterations: told["iterations"].as_i64(),
        error: distances.fold(0.0, f64::max) / surface.diagonal(),
    }))
}

/// The JSON that a program prints within the time; or why there is none.
fn output(command: &mut Command, limit: Duration) -> std::result::Result<Value, String> {
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = child.map_err(|_| "not built, or not found".to_owned())?;
    let start = Instant::now();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if start.elapsed() > limit => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("more than {} s", limit.as_secs()));
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(20)),
            Err(e) => return Err(e.to_string()),
        }
    };
    // Both are short.
    let (mut text, mut errors) = (String::new(), String::new());
    let read = child.stdout.as_mut().map(|out| out.read_to_string(&mut text));
    let _ = child.stderr.as_mut().map(|err| err.read_to_string(&mut errors));
    match (status.success(), read, serde_json::from_str(&text)) {
        (true, Some(Ok(_)), Ok(told)) => Ok(told),
        _ => Err(format!("failed: {}", errors.lines().last().unwrap_or("without a word"))),
    }
}

/// One line of the table.
struct Row {
    name: String,
    least: Option<Run>,
    ratio: f64,
    rounds: usize,
    remark: String,
}

fn write(
    arguments: &Arguments,
    provenance: &Provenance,
    surface: &Surface,
    runs: &BTreeMap<usize, Vec<Run>>,
    absent: &BTreeMap<usize, String>,
) -> Result<()> {
    let total = |run: &Run| run.setup + run.solve;
    let ours = runs.get(&0).map_or(&[][..], Vec::as_slice);
    let mut rows = Vec::new();
    for (k, &(name, from)) in PEERS.iter().enumerate() {
        let theirs = runs.get(&k).map_or(&[][..], Vec::as_slice);
        let mut ratios: Vec<f64> = theirs.iter().zip(ours).map(|(a, b)| total(a) / total(b)).collect();
        ratios.sort_by(f64::total_cmp);
        rows.push(Row {
            name: label(arguments, name, from),
            least: theirs.iter().min_by(|a, b| total(a).total_cmp(&total(b))).cloned(),
            ratio: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
            rounds: theirs.len(),
            remark: absent.get(&k).cloned().unwrap_or_default(),
        });
    }
    rows.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    let of = |value: fn(&Run) -> f64| move |row: &Row| row.least.as_ref().map(value);
    let title = format!("{}, {}, {} order", arguments.mesh, arguments.scheme, arguments.order);
    let mut table = Columns::<Row>::new()
        .col(Column::key("peer"), |row| row.name.clone())
        .col(Column::time("setup_seconds"), of(|run| run.setup))
        .col(Column::time("solve_seconds"), of(|run| run.solve))
        .col(Column::time("total_over_auto"), |row| row.least.as_ref().map(|_| row.ratio))
        .col(Column::number("megabytes", 0.5, 3), of(|run| run.megabytes))
        .col(Column::count("iterations"), |row| row.least.as_ref().and_then(|run| run.iterations))
        .col(Column::number("error", 10.0, 2), of(|run| run.error))
        .col(Column::count("rounds"), |row| row.rounds as i64)
        .col(Column::remark("remark"), |row| row.remark.clone())
        .table("peers", format!("Peers: {title}"), &rows);
    table.note(
        "Three right-hand sides, noise 0.1. Set-up: all before the first right-hand side (analysis and factorization, hierarchy; \
         of auto its order and operator, from faces); reading and assembling the matrix, which auto does without, not counted. \
         Seconds: of the round with the least sum. Ratio: median of the rounds, each against auto with all threads in the same round.",
    );
    table.note(
        "Megabytes: peak resident set during the work, in a process of its own, with the system (and the interpreter) beside; of \
         PETSc of all processes, reading too. Error: max ‖p − A v‖ in parts of the diagonal, measured here; of iterations by relative \
         2-norm (SciPy, sprs, PyAMG, AMGCL) at 3e-12 of it, of the others as asked for: T threads, P processes.",
    );
    let label = Source { name: arguments.mesh.clone(), size: format!("{} vertices", surface.len()), checksum: 0 };
    let label = Source { checksum: crc32fast::hash(arguments.mesh.as_bytes()), ..label };
    let provenance = provenance.about(&label);
    table.write(&arguments.out, &provenance)?;
    let found = rows.iter().filter_map(|row| Some((row, row.least.as_ref()?))).enumerate();
    let series = found.map(|(k, (row, run))| {
        let point = (total(run), run.megabytes);
        let series = Series::scatter(row.name.as_str(), [point]).marker(marker(k / 7 + k)).colour(palette(k));
        Series { bold: row.name.starts_with("limitlab"), ..series }
    });
    let plot = LinePlot {
        title,
        x_label: "seconds: set-up and three right-hand sides".into(),
        y_label: "peak resident set, MB".into(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: series.collect(),
        ..LinePlot::default()
    };
    Figure::new(plot).write(&arguments.out, "peers", &[Format::Png], &provenance)?;
    cli::print(&table.to_markdown())
}
