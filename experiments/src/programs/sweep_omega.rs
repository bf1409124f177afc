//! Iterations, measured rate and predicted ρ over ω: `sweep-omega [MESH|SYSTEM_DIR…]`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::{Parser, ValueHint};
use serde_json::{Map, Value, json};

use crate::cli::{
    self, CommonFlags, Grid, List, Matrix, MeshFlags, MonitorFlags, OutputFlags, Problem, Progress, StopFlags, number,
};
use crate::report::{Provenance, Table};
use crate::studies::trajectories::{self, Followed};
use crate::studies::{histories, sweep as study};
use limitlab::Result;
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::spectrum::spectrum;
use limitlab::analysis::sweep::{OmegaSweep, SweepEvent, rounding_floor, sweep};
use limitlab::analysis::trajectories::Trajectories;
use limitlab::error::short;
use limitlab::mesh::order::Order;
use limitlab::solvers::{Method, Recorded};

/// In its help.
const EXAMPLES: [&str; 3] = [
    "sweep-omega model.obj --method jacobi,pia --omega 0.05:1.2:0.05",
    "sweep-omega torus:32x32 --noise 0.1 --figure png,svg",
    "sweep-omega icosphere:2 --scheme loop --method sor --eigenvalues",
];

/// Sweeps the damping ω of Jacobi, PIA and SOR: iterations, measured and predicted rate.
///
/// Iterations are those to the tolerance; beside the measured rate stands the predicted spectral radius ρ(ω), with the critical
/// and the optimal ω. A folder is taken for a system of anybody, as `compare-solvers` does.
#[derive(Parser)]
#[command(name = "sweep-omega", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE_ANYHOW, None))]
pub struct Arguments {
    /// Mesh files (.obj, .off, .ply, .usda, .stl, .glb, .gltf), built-in names, or folders with M.mtx, H.mtx and P.mtx; unless
    /// told, four built-in ones with --noise 0.1
    #[arg(value_name = "MESH|SYSTEM_DIR", value_hint = ValueHint::AnyPath)]
    meshes: Vec<String>,
    /// Methods to sweep: jacobi, pia, sor
    #[arg(long, value_name = "NAME,…", default_value = "jacobi,pia,sor", value_parser = methods)]
    method: List<Method<'static>>,
    /// Values of ω from A to B, both included; unless told, 0.05 to the first value beyond each method's threshold
    #[arg(long, value_name = "A:B:STEP")]
    omega: Option<Grid>,
    /// Keep the errors of every iterate at these ω, which join the values of every method: in a CSV file and in the JSON object
    #[arg(long, value_name = "OMEGA,…", value_parser = omegas)]
    history: Option<List<f64>>,
    /// Follow all eigenvalues of the iteration matrices over ω too (up to 600 vertices): where the dominant one leaves the real axis, a
    /// table, and a picture in the complex plane
    #[arg(long)]
    eigenvalues: bool,
    /// Vertex order of SOR: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
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

/// What `sweep-omega` runs on without arguments.
const BUILT_IN: [&str; 4] = ["torus:32x32", "quad-sphere:4", "icosphere:3", "irregular-quad:1000"];

/// The methods that have an ω to sweep, each once, as a `value_parser`.
fn methods(text: &str) -> std::result::Result<List<Method<'static>>, String> {
    let list = text.parse::<List<Method<'static>>>()?.each_once();
    match list.0.iter().find(|m| !matches!(m, Method::Jacobi { .. } | Method::Pia | Method::Sor { .. })) {
        None => Ok(list),
        Some(method) => Err(format!("{method} has no ω to sweep; choose among jacobi, pia and sor")),
    }
}

/// Values of ω, as a `value_parser`.
fn omegas(text: &str) -> std::result::Result<List<f64>, String> {
    text.split(',').map(|omega| cli::positive(omega.trim())).collect::<std::result::Result<_, _>>().map(List)
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
        let problem = arguments.mesh.problem(name, &arguments.stop, arguments.order, &arguments.common)?;
        arguments.output.settle(["sweep-omega", "sweep-omega-eigenvalues"].map(|stem| problem.subject.stem(stem)))?;
        let made = provenance.about(&problem.subject.source);
        let table = |sweep: &OmegaSweep| {
            study::table(
                problem.subject.stem("sweep-omega"),
                format!("ω sweep on {}", problem.subject.title),
                format!(
                    "{}; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {:.3e} ({}).",
                    problem.subject.size,
                    problem.stop.tolerance * problem.scale,
                    problem.subject.unit
                ),
                sweep,
            )
        };
        let write = |sweep: &OmegaSweep| table(sweep).write(&arguments.output.out, &made);
        let (sweep, histories) = sweep_one(&problem, arguments, &write)?;
        write(&sweep)?;
        let table = table(&sweep);
        let title = format!("{}, {}", problem.subject.caption(), arguments.stop.words());
        let figure = study::plot(title, &arguments.method.0, &sweep);
        arguments.output.figure(&table.id, &figure, &made)?;
        if arguments.history.is_some() {
            let runs = histories.iter().map(|of| ([of.method.to_string(), short(of.omega)], &of.history[..]));
            let path = arguments.output.out.join(format!("{}-history.csv", table.id));
            histories::write(&path, ["method", "omega"], runs, &made)?;
        }
        if !arguments.output.json {
            cli::print_table(&table)?;
            cli::print(&study::best(&arguments.method.0, &sweep))?;
        }
        let mut object = json(&problem, arguments, (&sweep, &histories), &table);
        if arguments.eigenvalues {
            let all = eigenvalues(&problem, arguments).map_err(|e| limitlab::Error::mesh(name, e.to_string()))?;
            let (id, caption) = (problem.subject.stem("sweep-omega-eigenvalues"), &problem.subject.title);
            let table = trajectories::table(id.clone(), caption, &all);
            let page = table.to_markdown();
            trajectories::eigenvalue_table(id, caption, &all).write_with_page(&arguments.output.out, &page, &made)?;
            let figure = trajectories::figure(&problem.subject.caption(), &all);
            arguments.output.figure(&table.id, &figure, &made)?;
            if !arguments.output.json {
                cli::print_table(&table)?;
            }
            object["eigenvalues"] = trajectories::json(&all);
        }
        results.push(object);
    }
    cli::finish(results, &arguments.output, &arguments.common, provenance)
}

/// The eigenvalues of each method over its grid.
fn eigenvalues(problem: &Problem, arguments: &Arguments) -> Result<Vec<Followed>> {
    let methods = &arguments.method.0;
    let name = &problem.subject.name;
    let progress = Progress::new(name, methods.len(), arguments.monitor.no_bar(&arguments.common));
    let one = |&method: &Method<'static>| {
        progress.message(format!("eigenvalues of {method} over ω"));
        let grid = arguments.omega.as_ref().map_or_else(|| study::default_grid(method), |grid| grid.0.clone());
        let swept = method.in_order(Some(&problem.order));
        let found = match problem.matrix() {
            Matrix::Symmetric(system) => Trajectories::new(system, swept, &grid),
            Matrix::General(system, _) => Trajectories::new(system, swept, &grid),
        };
        progress.step();
        Ok(Followed::new(method.name(), method, found?))
    };
    methods.iter().map(one).collect()
}

/// Between two times that the rows which are there are written.
const PAUSE: Duration = Duration::from_secs(2);

/// The errors of the iterates of a method at one ω.
struct History {
    method: Method<'static>,
    omega: f64,
    history: Vec<Recorded>,
}

/// The sweep, and the histories that were asked for in the order of its rows, their errors in the units of the files. What there is of a long one is written now and then, so that it may be stopped.
fn sweep_one(
    problem: &Problem,
    arguments: &Arguments,
    write: &(dyn Fn(&OmegaSweep) -> Result<Vec<PathBuf>> + Sync),
) -> Result<(OmegaSweep, Vec<History>)> {
    let kept = arguments.history.as_ref().map_or(&[][..], |omegas| &omegas.0);
    let grids: Vec<(Method<'static>, Vec<f64>)> = arguments
        .method
        .0
        .iter()
        .map(|&m| {
            let mut grid = arguments.omega.as_ref().map_or_else(|| study::default_grid(m), |grid| grid.0.clone());
            grid.extend(kept);
            grid.sort_unstable_by(f64::total_cmp);
            grid.dedup();
            (m, grid)
        })
        .collect();
    let runs = grids.iter().map(|(_, g)| g.len()).sum();
    let name = &problem.subject.name;
    let progress = Progress::new(name, runs, arguments.monitor.no_bar(&arguments.common));
    let of_kept = |&(method, ref grid): &(Method<'static>, Vec<f64>)| {
        let kept = grid.iter().copied().filter(|omega| kept.contains(omega));
        kept.map(move |omega| History { method, omega, history: Vec::new() }).collect::<Vec<_>>()
    };
    let histories: Mutex<Vec<History>> = Mutex::new(grids.iter().flat_map(of_kept).collect());
    let in_units_of_files = |mut sweep: OmegaSweep| {
        for row in &mut sweep.rows {
            row.errors = row.errors * problem.scale;
        }
        sweep
    };
    let written = Mutex::new(Instant::now());
    let watch = |event: SweepEvent| {
        study::show(&progress, &event);
        let so_far = match event {
            SweepEvent::Iterate(method, omega, step) => {
                let (iteration, errors) = (step.iteration, step.errors * problem.scale);
                arguments.monitor.see(format_args!("{name}: {}", study::name(method, omega)), iteration, errors);
                if kept.contains(&omega) {
                    let mut histories = histories.lock().unwrap_or_else(PoisonError::into_inner);
                    let of_run = histories.iter_mut().find(|of| of.method == method && of.omega == omega);
                    of_run.into_iter().for_each(|of| of.history.push(Recorded { iteration, errors }));
                }
                return;
            }
            SweepEvent::Row(so_far) => so_far,
        };
        let mut written = written.lock().unwrap_or_else(PoisonError::into_inner);
        if written.elapsed() >= PAUSE {
            // If this fails, so does the end, which says it.
            let _ = write(&in_units_of_files(so_far.clone()));
            *written = Instant::now();
        }
    };
    let (data, order, stop) = (problem.data(), Some(&problem.order[..]), &problem.stop);
    let floor = rounding_floor(problem.diagonal());
    let found = match problem.matrix() {
        Matrix::Symmetric(system) => sweep((system, &spectrum(system)?), data, &grids, order, stop, floor, &watch)?,
        Matrix::General(system, _) => {
            let spectrum = ComplexSpectrum::new(system)?;
            sweep((system, &spectrum), data, &grids, order, stop, floor, &watch)?
        }
    };
    Ok((in_units_of_files(found), histories.into_inner().unwrap_or_else(PoisonError::into_inner)))
}

/// The rows are those of the table, with ω as a number, and their histories where they were kept.
fn json(
    problem: &Problem,
    arguments: &Arguments,
    (sweep, histories): (&OmegaSweep, &[History]),
    table: &Table,
) -> Value {
    let mut rows = table.to_json();
    for (row, object) in sweep.rows.iter().zip(rows.as_array_mut().into_iter().flatten()) {
        object["omega"] = number(row.omega);
        if let Some(of) = histories.iter().find(|of| of.method == row.method && of.omega == row.omega) {
            object["history"] = histories::json(&of.history);
        }
    }
    let (mut best, mut critical, mut critical_data, mut optimal) = (Map::new(), Map::new(), Map::new(), Map::new());
    for &method in &arguments.method.0 {
        let omega = sweep.best(method).map_or(Value::Null, |r| number(r.omega));
        best.insert(method.name().into(), omega);
    }
    for t in &sweep.thresholds {
        let name = t.method.name();
        critical.insert(name.into(), number(t.critical_omega));
        optimal.insert(name.into(), number(t.optimal_omega));
        let data = t.data.map_or(Value::Null, |d| number(d.critical_omega()));
        critical_data.insert(name.into(), data);
    }
    problem.subject.json(json!({
        "rows": rows,
        "best": best,
        "optimal_omega": optimal,
        "critical_omega": critical,
        "critical_omega_data": critical_data,
    }))
}
