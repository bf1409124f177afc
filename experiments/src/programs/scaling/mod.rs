//! Time and memory against mesh size: `scaling` writes `scaling.{md,csv,png}`, `scaling-threads`, `scaling-profile`,
//! `scaling-edits`, `scaling-frames`, `scaling-steps` and `scaling-decay.{md,csv}`.

mod baseline;
mod edits;
mod frames;
mod machine;
mod profile;
mod steps;
mod threads;

use std::fmt;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use glam::DVec3;
use serde_json::json;

use crate::cli::{self, CommonFlags, FigureFlags, List, Printer, Progress, ReplaceFlags, number};
use crate::report::{Colour, Column, Columns, Dash, Figure, LinePlot, Marker, Provenance, Scale, Series, Style, Table};
use crate::studies::style;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::error::{Error, Result};
use limitlab::interpolate::interpolate;
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces};
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::order::{Numbering, Order};
use limitlab::mesh::{Faces, Incidence, Mesh, Surface, builtin::builtin, io};
use limitlab::schemes::Scheme;
use limitlab::solvers::gauss_seidel::{by_colours, in_waves};
use limitlab::solvers::{Method, Report, Stop, run};

/// In its help.
const EXAMPLES: [&str; 1] = ["scaling --sizes 1000,10000,100000 --profile 0 --gains 0 --frames 0 --steps 0"];

/// Measures time, memory and iterations of the methods over growing meshes.
///
/// Runs go from faces in memory to control points, and everything is counted.
///
/// As it stands this takes a quarter of an hour on two cores, most of it for Cholesky and incomplete Cholesky of a million
/// vertices, and 5 GB of memory; --sizes 1000,10000,100000 --profile 0 --gains 0 --frames 0 --steps 0 takes one minute. Each row is said on standard
/// error and written as soon as it is measured, and what is there stays when the program is stopped.
#[derive(Parser)]
#[command(name = "scaling", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE, None))]
pub struct Arguments {
    /// Numbers of vertices
    #[arg(long, value_name = "N,N,…", default_value = "1000,10000,100000,1000000")]
    sizes: List<usize>,
    /// Schemes
    #[arg(long, value_name = "NAME,…", default_value = "catmull-clark,loop,sqrt3,nasri,zheng-cai")]
    scheme: List<Scheme>,
    /// Cholesky up to this many vertices
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    most_cholesky: usize,
    /// LU up to this many vertices: it takes 4.5 GB at a million
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    most_lu: usize,
    /// Methods with a stored matrix up to this many vertices
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    most_stored: usize,
    /// Local edits, and the decay of the inverse, up to this many vertices
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    most_edits: usize,
    /// Stop at max_i ‖p_i − (A v)_i‖ ≤ T·L, L the diagonal of the bounding box
    #[arg(long, value_name = "T", default_value = "1e-10", value_parser = cli::positive)]
    tol: f64,
    /// Runs of which the fastest counts, where a run takes less than a second; more where it takes milliseconds
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    runs: u16,
    /// Vertices of the profile's mesh; 0 for no profile
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    profile: usize,
    /// Vertices of the meshes for one thread beside all; 0 for none
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    gains: usize,
    /// Vertices of the meshes for frames on the same faces; 0 for none
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    frames: usize,
    /// Vertices of the meshes for the steps around the solve; 0 for none
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    steps: usize,
    /// Folder for the tables (CSV, Markdown) and the figure
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Print one JSON object on standard output, and nothing else there: all tables
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    replace: ReplaceFlags,
    #[command(flatten)]
    figures: FigureFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// The names of its files.
const STEMS: [&str; 7] = [
    "scaling",
    "scaling-threads",
    "scaling-profile",
    "scaling-edits",
    "scaling-frames",
    "scaling-steps",
    "scaling-decay",
];
/// The smallest mesh that every generator makes.
const LEAST: usize = 100;
/// Vertices of the mesh that the interval of Chebyshev iterations is estimated on.
const ESTIMATE: usize = 4000;

/// Runs the program.
pub fn main(arguments: Arguments, provenance: Provenance) -> ExitCode {
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        limitlab::output::create_dir(&arguments.out)?;
        arguments.replace.settle_all(&arguments.out, STEMS)?;
        measure(&arguments, &provenance)
    })
}

fn measure(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    let threads = rayon::current_num_threads();
    let bandwidth = machine::triad();
    let mut printer = Printer::new(arguments.json);
    let mut table = columns().table("scaling", "Time and memory from faces in memory to control points", &[]);
    table.note(format!(
        "{threads} threads, STREAM triad {:.1} GB/s in this run. Noise 0.1 on every mesh; start V = P; stop at max_i ‖p_i − \
         (A v)_i‖ ≤ {:e}·L. Seconds count topology, order, set-up and solve; the memory is the most heap that is held \
         at once beyond the mesh. Order random: vertices and faces shuffled.",
        bandwidth / 1e9,
        arguments.tol
    ));
    table.note(
        "plain-chebyshev is the yardstick: index-only, double precision, all of an iteration in one pass over the arrays, no \
         renumbering. \"File to file\" is auto with all that `interpolate` does beside: reading, validation, writing, of \
         binary PLY.",
    );
    let mut panels = Vec::new();
    for &scheme in &arguments.scheme.0 {
        panels.extend(of_scheme(arguments, scheme, bandwidth, &mut table, provenance)?);
    }
    let progress = Progress::open("scaling", arguments.common.quiet);
    if !panels.is_empty() {
        let rows = panels.len() as u32 / 2;
        let mut figure = Figure::row(panels);
        let processor = machine::processor();
        figure.title = format!(
            "Time from faces to control points on {threads} threads of {processor}, STREAM triad {:.1} GB/s",
            bandwidth / 1e9
        );
        figure.columns = 2;
        (figure.width, figure.height) = (900, 40 + 230 * rows);
        figure.write(&arguments.out, "scaling", arguments.figures.formats(), provenance)?;
    }
    local_edits(arguments, &progress, &mut printer, provenance)?;
    if arguments.frames >= LEAST {
        let mut rows = Vec::new();
        for scheme in [Scheme::CatmullClark, Scheme::Loop] {
            let name = family(scheme, arguments.frames);
            progress.message(format!("frames: {name}, {scheme}"));
            frames::frames(&name, noisy(&name)?, scheme, &mut rows)?;
            frames::frames_table(&rows).write(&arguments.out, provenance)?;
        }
        printer.table(&frames::frames_table(&rows))?;
    }
    if arguments.steps >= LEAST {
        steps::steps(arguments.steps, &arguments.out, &progress, &mut printer, provenance)?;
    }
    let all = rayon::current_num_threads();
    if arguments.gains >= LEAST && all > 1 {
        threads::gains(arguments, all, &progress, &mut printer, provenance)?;
    }
    if arguments.profile >= LEAST {
        let name = family(Scheme::CatmullClark, arguments.profile);
        let mesh = noisy(&name)?;
        progress.message(format!("profile: {name}"));
        let profile = profile::profile(&name, &mesh, Scheme::CatmullClark, all)?;
        profile.write(&arguments.out, provenance)?;
        printer.table(&profile)?;
    }
    drop(progress);
    printer.table(&table)?;
    arguments.common.remark(format_args!("tables and plot: {}", arguments.out.display()));
    arguments.common.remark_on_replaced();
    printer.finish(json!({ "threads": threads, "triad_bytes_per_second": number(bandwidth) }), provenance)
}

/// Local edits on the meshes of all schemes and sizes, and the decay on the largest.
fn local_edits(
    arguments: &Arguments,
    progress: &Progress,
    printer: &mut Printer,
    provenance: &Provenance,
) -> Result<()> {
    let mut sizes = arguments.sizes.0.clone();
    sizes.retain(|&n| n <= arguments.most_edits);
    let Some(&most) = sizes.iter().max() else {
        return Ok(());
    };
    let mut rows = Vec::new();
    let mut largest = Vec::new();
    for &scheme in &arguments.scheme.0 {
        for &n in &sizes {
            let name = family(scheme, n);
            let mesh = noisy(&name)?;
            progress.message(format!("local edits: {name}, {scheme}"));
            let operator = edits::edits(&name, mesh, scheme, arguments.tol, &mut rows)?;
            edits::edits_table(arguments.tol, &rows).write(&arguments.out, provenance)?;
            progress.step();
            if n == most {
                largest.push((format!("{name}, {scheme}"), operator));
            }
        }
    }
    let table = edits::edits_table(arguments.tol, &rows);
    progress.message("decay of the inverse");
    edits::decay_table(&largest)?.write(&arguments.out, provenance)?;
    printer.table(&table)
}

/// The built-in mesh of about `n` vertices that suits the scheme.
fn family(scheme: Scheme, n: usize) -> String {
    let n = n.max(LEAST);
    match scheme {
        Scheme::CatmullClark => format!("irregular-quad:{}", n & !1),
        Scheme::Loop | Scheme::Sqrt3 => format!("irregular-tri:{n}"),
        Scheme::Nasri | Scheme::ZhengCai | Scheme::MidEdge => format!("irregular-poly:{n}"),
    }
}

fn noisy(name: &str) -> Result<Mesh> {
    let mut mesh = builtin(name)?;
    add_noise(&mut mesh, 0.1, 1);
    Ok(mesh)
}

/// A way from faces to control points.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Auto,
    /// As `interpolate` does: read, validate, solve, write.
    Files,
    Plain,
    Free(Method<'static>),
    /// Gauss-Seidel on the operator in fronts.
    Waves,
    /// Gauss-Seidel on the operator by colours.
    Colours,
    Stored(Method<'static>),
}

const CHEBYSHEV: Method<'static> = Method::Chebyshev { interval: None };
const GAUSS_SEIDEL: Method<'static> = Method::GaussSeidel { order: None };

/// The method, with the interval of Chebyshev where an estimate starts it.
fn from_estimate(method: Method<'static>, estimate: f64) -> Method<'static> {
    if method == CHEBYSHEV { Method::Chebyshev { interval: Some((estimate, 1.0)) } } else { method }
}

impl Way {
    const ALL: [Way; 12] = [
        Way::Auto,
        Way::Files,
        Way::Plain,
        Way::Free(CHEBYSHEV),
        Way::Free(Method::Cg),
        Way::Waves,
        Way::Colours,
        Way::Stored(CHEBYSHEV),
        Way::Stored(GAUSS_SEIDEL),
        Way::Stored(Method::PcgIc0),
        Way::Stored(Method::Cholesky),
        Way::Stored(Method::Lu),
    ];

    fn name(self) -> String {
        match self {
            Way::Auto => "auto".into(),
            Way::Files => "auto (file to file)".into(),
            Way::Plain => "plain-chebyshev".into(),
            Way::Free(method) => format!("{method} (matrix-free)"),
            Way::Waves => format!("{GAUSS_SEIDEL} (in waves)"),
            Way::Colours => format!("{GAUSS_SEIDEL} (by colours)"),
            Way::Stored(method) => method.name().into(),
        }
    }

    fn most(self, arguments: &Arguments) -> usize {
        match self {
            Way::Stored(Method::Cholesky) => arguments.most_cholesky,
            Way::Stored(Method::Lu) => arguments.most_lu,
            Way::Stored(_) => arguments.most_stored,
            _ => usize::MAX,
        }
    }
}

/// Time per vertex of one way over the sizes.
struct Curve {
    way: Way,
    random: bool,
    points: Vec<(f64, f64)>,
}

struct Outcome {
    iterations: usize,
    status: &'static str,
    solve_seconds: f64,
}

/// One way on one mesh.
struct Row {
    scheme: Scheme,
    name: String,
    random: bool,
    way: Way,
    vertices: usize,
    seconds: f64,
    outcome: Outcome,
    /// Bytes.
    memory: usize,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Row { scheme, name, way, seconds, outcome: Outcome { iterations, status, .. }, .. } = self;
        let order = order(self.random);
        write!(f, "{scheme}, {name}, {order} order, {}: {seconds:.2e} s, {iterations} iterations, {status}", way.name())
    }
}

/// The order of vertices and faces in words.
fn order(random: bool) -> &'static str {
    if random { "random" } else { "good" }
}

impl Row {
    fn nanoseconds_per_vertex(&self) -> f64 {
        1e9 * self.seconds / self.vertices as f64
    }
}

fn columns() -> Columns<'static, Row> {
    Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("mesh"), |r| r.name.clone())
        .col(Column::key("order"), |r| order(r.random))
        .col(Column::key("method"), |r| r.way.name())
        .col(Column::count("vertices"), |r| r.vertices)
        .col(Column::count("iterations"), |r| r.outcome.iterations)
        .col(Column::text("status"), |r| r.outcome.status)
        .col(Column::time("seconds"), |r| r.seconds)
        .col(Column::time("solve_seconds"), |r| r.outcome.solve_seconds)
        .col(Column::time("nanoseconds_per_vertex"), Row::nanoseconds_per_vertex)
        .col(Column::time("peak_megabytes"), |r| r.memory as f64 / 1e6)
}

/// Where the interval of Chebyshev iterations starts, by a small mesh.
fn estimate(scheme: Scheme) -> Result<f64> {
    let small = noisy(&family(scheme, ESTIMATE))?;
    let system = LimitSystem::new(&Surface::new(small)?, scheme)?;
    Ok(0.98 * spectrum(&system)?.a.min)
}

fn of_scheme(
    arguments: &Arguments,
    scheme: Scheme,
    bandwidth: f64,
    table: &mut Table,
    provenance: &Provenance,
) -> Result<[LinePlot; 2]> {
    let columns = columns();
    let estimate = estimate(scheme)?;
    let mut curves: Vec<Curve> = Vec::new();
    let mut bound = Vec::new();
    let ways = |n: usize| Way::ALL.iter().filter(move |way| n <= way.most(arguments));
    let runs = 2 * arguments.sizes.0.iter().map(|&n| ways(n).count()).sum::<usize>();
    let progress = Progress::new(scheme.name(), runs, arguments.common.quiet);
    for &n in &arguments.sizes.0 {
        let name = family(scheme, n);
        let good = noisy(&name)?;
        for random in [false, true] {
            let scattered;
            let mesh = if random {
                let order = Order::Random(7).order(&good, &Incidence::new(&good.faces, good.len()));
                scattered = shuffle_faces(&permute_vertices(&good, &order), 7);
                &scattered
            } else {
                &good
            };
            for &way in ways(n) {
                progress.message(format!("{name}: {}", way.name()));
                let measured = timed(arguments, mesh, scheme, way, estimate)?;
                progress.step();
                let Some((seconds, outcome, memory)) = measured else {
                    continue;
                };
                let (name, vertices) = (name.clone(), mesh.len());
                let row = Row { scheme, name, random, way, vertices, seconds, outcome, memory };
                progress.line(&row);
                table.push(columns.row(&row));
                // A run of hours may be stopped: what was measured is kept.
                table.write(&arguments.out, provenance)?;
                let at = (row.vertices as f64, row.nanoseconds_per_vertex());
                let known = curves.iter_mut().find(|c| c.way == way && c.random == random);
                match known {
                    Some(curve) => curve.points.push(at),
                    None => curves.push(Curve { way, random, points: vec![at] }),
                }
                if way == Way::Free(CHEBYSHEV) && !random {
                    // What a fused iteration in double precision must move, as often.
                    let bytes = 4.0 * 24.0 + 37.0;
                    bound.push((at.0, 1e9 * bytes * row.outcome.iterations as f64 / bandwidth));
                }
            }
        }
    }
    drop(progress);
    Ok([false, true].map(|random| plot(scheme, random, &curves, &bound)))
}

/// Time per vertex over the number of vertices, in one of the two orders. The legend stands beside the second.
fn plot(scheme: Scheme, random: bool, curves: &[Curve], bound: &[(f64, f64)]) -> LinePlot {
    // The method has the colour, the way the dashes and the marker.
    let of = |method, dash, marker| Style { dash, marker, ..style::of(method, "") };
    let look = |way: Way| match way {
        Way::Auto => style::of_auto(),
        Way::Files => Style { dash: Dash::Dashed, marker: Marker::Triangle, ..style::of_auto() },
        Way::Plain => of(CHEBYSHEV, Dash::Dotted, Marker::Square),
        Way::Free(method) => of(method, Dash::Solid, Marker::Circle),
        Way::Waves => of(GAUSS_SEIDEL, Dash::Solid, Marker::Circle),
        Way::Colours => of(GAUSS_SEIDEL, Dash::Dotted, Marker::Diamond),
        Way::Stored(method) => of(method, Dash::Dashed, style::of(method, "").marker),
    };
    let points = || curves.iter().flat_map(|c| &c.points);
    let largest = points().map(|p| p.0).fold(0.0, f64::max);
    let slowest = points().map(|p| p.1).fold(2.5e4, f64::max);
    let mut series: Vec<Series> = curves
        .iter()
        .filter(|c| c.random == random)
        .map(|c| {
            let last = c.points.last().map_or(0.0, |p| p.0);
            let name = match random {
                false => String::new(),
                // Where it was not run further.
                true if last < largest => format!("{} (to {last} vertices)", c.way.name()),
                true => c.way.name(),
            };
            // What users run, with and without files, and the yardstick.
            let bold = matches!(c.way, Way::Auto | Way::Files | Way::Plain);
            Series { bold, ..Series::line(name, c.points.iter().copied()).style(look(c.way)) }
        })
        .collect();
    if bound.len() > 1 {
        let name = if random { "bandwidth bound: chebyshev's bytes at the triad's speed" } else { "" };
        series.push(Series::line(name, bound.iter().copied()).colour(Colour(110, 110, 110)).dash(Dash::DashDotted));
    }
    LinePlot {
        title: format!("{scheme}, {} order", order(random)),
        x_label: "vertices".into(),
        y_label: "nanoseconds a vertex".into(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        // The same in both orders.
        y_range: Some((30.0, 1.2 * slowest)),
        series,
        ..LinePlot::default()
    }
}

/// Seconds that runs take at least together, where one takes less.
const SHORT: f64 = 0.03;

/// The fastest of several runs, with the memory of the first.
fn timed(
    arguments: &Arguments,
    mesh: &Mesh,
    scheme: Scheme,
    way: Way,
    estimate: f64,
) -> Result<Option<(f64, Outcome, usize)>> {
    let paths = ["points", "control"].map(|name| arguments.out.join(format!("scaling-{name}.ply")));
    if way == Way::Files {
        io::write(&paths[0], mesh, None)?;
    }
    let once = || {
        let mesh = mesh.clone();
        let start = Instant::now();
        let outcome = match way {
            Way::Files => Some(file_to_file(&paths, scheme, arguments.tol)?),
            _ => go(mesh, scheme, way, estimate, arguments.tol)?,
        };
        Ok::<_, Error>(outcome.map(|o| (start.elapsed().as_secs_f64(), o)))
    };
    let (first, memory) = machine::peak_memory(once);
    let Some((mut seconds, mut outcome)) = first? else {
        return Ok(None);
    };
    // A run of less than a millisecond finds cold caches and sleeping threads, if it comes alone.
    let runs = match seconds {
        s if s > 1.0 => 1,
        s => usize::from(arguments.runs).max((SHORT / s) as usize),
    };
    for _ in 1..runs {
        if let Some((again, o)) = once()?
            && again < seconds
        {
            (seconds, outcome) = (again, o);
        }
    }
    if way == Way::Files {
        for path in &paths {
            std::fs::remove_file(path).map_err(|e| Error::io(path, "remove", e))?;
        }
    }
    Ok(Some((seconds, outcome, memory)))
}

/// From the points in one file to the control points in another.
fn file_to_file([from, to]: &[PathBuf; 2], scheme: Scheme, tol: f64) -> Result<Outcome> {
    let surface = Surface::new(io::read(from)?.mesh)?;
    let stop = Stop { tolerance: tol * surface.diagonal(), max_iterations: 10_000 };
    let found = interpolate(&surface, scheme, &stop.into())?;
    let (iterations, status) = (found.report.iterations, found.report.outcome.name());
    io::write(to, &Mesh::new(found.points, surface.into_mesh().faces), None)?;
    Ok(Outcome { iterations, status, solve_seconds: found.solve_seconds })
}

type Number = fn(&Faces, &Incidence) -> Numbering;
type Sweeps = fn(&Operator, &[DVec3], f64, &Stop) -> (Vec<DVec3>, Report);

/// One run from faces in memory to control points; `None` if the way does not suit the mesh.
fn go(mesh: Mesh, scheme: Scheme, way: Way, estimate: f64, tol: f64) -> Result<Option<Outcome>> {
    let stop = Stop { tolerance: tol * mesh.diagonal(), max_iterations: 10_000 };
    let start = |seconds: &mut f64, since: Instant| *seconds = since.elapsed().as_secs_f64();
    let mut solve_seconds = 0.0;
    let outcome = match way {
        // Not from faces in memory.
        Way::Files => return Ok(None),
        Way::Auto => {
            let found = interpolate(&Surface::new(mesh)?, scheme, &stop.into())?;
            Outcome {
                iterations: found.report.iterations,
                status: found.report.outcome.name(),
                solve_seconds: found.solve_seconds,
            }
        }
        Way::Plain => {
            let Some(plain) = baseline::Plain::new(&mesh, scheme) else {
                return Ok(None);
            };
            let since = Instant::now();
            let (_, iterations, converged) =
                plain.chebyshev(&mesh.positions, (estimate, 1.0), stop.tolerance, stop.max_iterations);
            start(&mut solve_seconds, since);
            Outcome { iterations, status: if converged { "converged" } else { "max-iterations" }, solve_seconds }
        }
        Way::Waves | Way::Colours => {
            let surface = Surface::new(mesh)?;
            let (number, sweeps): (Number, Sweeps) = match way {
                Way::Waves => (in_fronts, in_waves),
                _ => (in_colours, by_colours),
            };
            let numbering = number(surface.faces(), surface.incidence());
            let operator = Operator::in_order(&surface, scheme, Some(&numbering))?;
            let since = Instant::now();
            let moved = numbering.there(surface.positions());
            let (control, report) = sweeps(&operator, &moved, 1.0, &stop);
            numbering.back(&control);
            start(&mut solve_seconds, since);
            Outcome { iterations: report.iterations, status: report.outcome.name(), solve_seconds }
        }
        Way::Free(method) => {
            let surface = Surface::new(mesh)?;
            let operator = Operator::new(&surface, scheme)?;
            let since = Instant::now();
            let report = run(&operator, surface.positions(), from_estimate(method, estimate), &stop).report;
            start(&mut solve_seconds, since);
            Outcome { iterations: report.iterations, status: report.outcome.name(), solve_seconds }
        }
        Way::Stored(method) => {
            let surface = Surface::new(mesh)?;
            let system = LimitSystem::new(&surface, scheme)?;
            let since = Instant::now();
            let solution = run(&system, surface.positions(), from_estimate(method, estimate), &stop);
            start(&mut solve_seconds, since);
            Outcome { iterations: solution.report.iterations, status: solution.report.outcome.name(), solve_seconds }
        }
    };
    Ok(Some(outcome))
}
