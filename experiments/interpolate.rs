//! The control mesh, or the surface, that passes through the vertices of a mesh: `interpolate MESH -o OUT`.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser};
use glam::DVec3;
use serde_json::{Value, json};

use limitlab::Result;
use limitlab::analysis::comparison::{SOR_OMEGA, automatic, standard_setup};
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::{Operator, Scheme};
use limitlab::cli::{
    self, CommonFlags, Input, MeshFlags, Progress, StopFlags, constraints, number,
};
use limitlab::error::Error;
use limitlab::interpolate::automatic::control_points;
use limitlab::interpolate::halstead::{self, Energies, Fairness, Weights, fit};
use limitlab::interpolate::lin_luo;
use limitlab::interpolate::normals::Rotation;
use limitlab::interpolate::subset::Restriction;
use limitlab::interpolate::surface::{Request, Surface, surface};
use limitlab::interpolate::zheng_cai::{self, Constraints, PhaseOne, Sweep};
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Mesh, Topology, io};
use limitlab::solvers::gauss_seidel::by_colours;
use limitlab::solvers::{Errors, Method, Outcome, Report, Solution, Step, run_watched};
use limitlab::subdivide::Refinement;
use limitlab::subdivide::doo_sabin::{Rule, limit_positions};

/// Computes the control mesh V with A V = P: the vertices P of the mesh become points of the limit surface. Unless
/// refined by --subdivide, the faces stay, vertex for vertex, so that the result can replace the mesh in any
/// subdivision tool.
#[derive(Parser)]
#[command(name = "interpolate", version)]
struct Arguments {
    /// A mesh file (.obj, .off, .ply) or a built-in name
    #[arg(value_name = "MESH")]
    input: String,
    /// The mesh to write (.obj, .off, .ply): the control mesh, or the surface with --subdivide or --limit
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// auto, lu, cholesky, ldlt, jacobi, thall, gauss-seidel, sor, ssor, pia, w-pia, chebyshev, cg, pcg-jacobi,
    /// pcg-ssor, pcg-ic0; two-phase (Zheng & Cai's own sweeps, with --scheme zheng-cai); halstead (the fairest
    /// surface, with --scheme catmull-clark: a control mesh two refinements down); butterfly and labsik-greiner (with
    /// --subdivide: schemes that pass through the vertices of triangle meshes with no system solved). auto is
    /// chebyshev in mixed precision without a stored matrix, cg where that makes no progress, and ldlt where neither
    /// does
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = choice)]
    method: Choice,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED.
    /// By colours, gauss-seidel and sor of all vertices run on all threads without a stored matrix
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    shape: ShapeFlags,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What is asked of the surface.
#[derive(Args)]
struct ShapeFlags {
    /// Refine the control mesh K times by the scheme and write the surface
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=12))]
    subdivide: u8,
    /// Push the vertices that are written to their limit points
    #[arg(long)]
    limit: bool,
    /// Write the unit normals of the limit surface with the vertices; zero where it has none
    #[arg(long)]
    write_normals: bool,
    /// Interpolate these vertices only: numbers and ranges A..B, separated by commas, or a file of them; the other
    /// control points stay where they are, or with --method halstead go where the surface is fairest
    #[arg(long, value_name = "LIST|FILE")]
    vertices: Option<String>,
    /// Normals of the surface at given points: a file with lines `vertex nx ny nz`, or a mesh file with normals
    /// (.obj, .off, .ply). Loop, √3 and Catmull-Clark turn rings of the mesh refined twice or more, Doo-Sabin tilts faces
    #[arg(long, value_name = "FILE")]
    normals: Option<PathBuf>,
    /// Turn rings only where the normal is off by more than this angle in degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = degrees, requires = "normals")]
    normal_threshold: f64,
    /// Stop turning this angle in degrees before the given normal
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = degrees, requires = "normals")]
    normal_tolerance: f64,
    /// Spread the turn over this many levels
    #[arg(long, value_name = "L", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=8), requires = "normals")]
    normal_levels: u8,
    /// Scale the faces of interpolated vertices about their points after the first refinement: a positive number,
    /// or a file with lines `vertex number` (schemes zheng-cai and nasri)
    #[arg(long, value_name = "S|FILE", allow_negative_numbers = true)]
    shape_handle: Option<String>,
    /// Lin & Luo's unified √3 scheme, no system solved: α from 0 (approximating) over 1 (interpolating) to 2, a number
    /// or a file with lines `vertex number` (others 0); with --vertices, those have α = 1
    #[arg(long, value_name = "A|FILE", allow_negative_numbers = true, conflicts_with_all = ["normals", "shape_handle"])]
    alpha: Option<String>,
    /// Sweeps of --method two-phase at most
    #[arg(long, value_name = "K", default_value_t = 5)]
    ite_max: usize,
    /// --method two-phase stops at a largest update of this part of the bounding box's diagonal
    #[arg(long, value_name = "T", default_value_t = 0.003, value_parser = cli::positive)]
    eps: f64,
    /// Weight of the thin-plate energy in --method halstead, 0 or more
    #[arg(
        long,
        value_name = "W",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    thin_plate: f64,
    /// Weight of the membrane energy in --method halstead, positive
    #[arg(long, value_name = "W", default_value_t = 1.0, value_parser = cli::positive)]
    membrane: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Choice {
    Auto,
    Solver(Method),
    TwoPhase,
    Halstead,
    /// A scheme that keeps its vertices.
    Keeping(Refinement),
}

fn choice(text: &str) -> Result<Choice> {
    match text {
        "auto" => Ok(Choice::Auto),
        "two-phase" => Ok(Choice::TwoPhase),
        "halstead" => Ok(Choice::Halstead),
        "butterfly" => Ok(Choice::Keeping(Refinement::Butterfly)),
        "labsik-greiner" => Ok(Choice::Keeping(Refinement::LabsikGreiner)),
        _ => text.parse().map(Choice::Solver),
    }
}

fn degrees(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (0.0..=180.0).contains(&x) => Ok(x),
        _ => Err("an angle from 0 to 180 is needed".into()),
    }
}

/// Ends with status 2, as clap does: flags that contradict each other.
fn conflict(what: &str) -> ! {
    let mut command = Arguments::command();
    command.error(ErrorKind::ArgumentConflict, what).exit()
}

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    if arguments.shape.alpha.is_some() {
        if *arguments.mesh.scheme.get_or_insert(Scheme::Sqrt3) != Scheme::Sqrt3 {
            conflict("--alpha belongs to the unified √3 scheme: use it with --scheme sqrt3");
        }
        if arguments.method != Choice::Auto {
            conflict("--alpha solves no system: leave --method out");
        }
    }
    if arguments.method == Choice::TwoPhase
        && *arguments.mesh.scheme.get_or_insert(Scheme::ZhengCai) != Scheme::ZhengCai
    {
        conflict("--method two-phase belongs to --scheme zheng-cai");
    }
    if arguments.method == Choice::Halstead {
        if *arguments.mesh.scheme.get_or_insert(Scheme::CatmullClark) != Scheme::CatmullClark {
            conflict("--method halstead belongs to --scheme catmull-clark");
        }
        if arguments.shape.shape_handle.is_some() {
            conflict(
                "--method halstead has no type-V faces for shape handles: use --scheme zheng-cai or nasri",
            );
        }
        if arguments.shape.subdivide == 1 {
            conflict(
                "--method halstead gives a mesh two refinements down: use --subdivide 2 or more, or leave it out",
            );
        }
    }
    if let Choice::Keeping(scheme) = arguments.method {
        let shape = &arguments.shape;
        if arguments.mesh.scheme.is_some() {
            conflict(&format!(
                "--method {scheme} is a scheme of its own: leave --scheme out"
            ));
        }
        if shape.vertices.is_some() || shape.normals.is_some() || shape.shape_handle.is_some() {
            conflict(&format!(
                "--method {scheme} passes through all vertices and takes no normals or shape handles"
            ));
        }
        if shape.subdivide == 0 {
            conflict(&format!(
                "--method {scheme} leaves the control mesh as it is: ask for the surface with --subdivide"
            ));
        }
        // Its topology is that of the scheme which is named where none is.
        arguments.mesh.scheme = Some(Scheme::Loop);
    }
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
    let wishes = Wishes::read(&arguments.shape, &input)?;
    let named = |e: Error| match e {
        Error::Computation(what) | Error::Mesh { what, .. } => Error::mesh(&input.name, what),
        other => other,
    };
    let mut result = match (&wishes.alpha, arguments.method) {
        (Some(alpha), _) => unified(arguments, &input, alpha).map_err(named)?,
        (None, Choice::Halstead) => fairest(arguments, &input, &wishes).map_err(named)?,
        (None, Choice::Keeping(scheme)) => keeping(arguments, &input, scheme).map_err(named)?,
        (None, _) => {
            let control = control_mesh(arguments, &input, &wishes)?;
            refine(arguments, &input, &wishes, control).map_err(named)?
        }
    };
    require_finite(&input, &result.surface)?;

    let start = Instant::now();
    let normals = result.surface.normals.as_deref();
    io::write(&arguments.output, &result.surface.mesh, normals)?;
    result.seconds.write = start.elapsed().as_secs_f64();
    tell(arguments, &input, &wishes, &result)
}

/// The flags about single vertices, one entry a vertex each.
struct Wishes {
    interpolated: Option<Vec<bool>>,
    normals: Option<Vec<Option<DVec3>>>,
    handles: Option<Vec<f64>>,
    alpha: Option<Vec<f64>>,
}

impl Wishes {
    fn read(flags: &ShapeFlags, input: &Input) -> Result<Self> {
        let n = input.mesh.len();
        let marks = flags.vertices.as_deref();
        let interpolated = marks.map(|t| constraints::vertex_marks(t, n)).transpose()?;
        let is_interpolated = |v: usize| interpolated.as_ref().is_none_or(|m| m[v]);
        let file = flags.normals.as_deref();
        let mut normals = file.map(|p| constraints::normals(p, n)).transpose()?;
        if let Some(normals) = normals.as_mut().filter(|n| n.iter().all(Option::is_some)) {
            // A file with a normal for every vertex means those that are interpolated.
            for (v, normal) in normals.iter_mut().enumerate() {
                *normal = normal.filter(|_| is_interpolated(v));
            }
        }
        let text = flags.shape_handle.as_deref();
        let mut handles = text.map(|t| constraints::numbers(t, n, 1.0)).transpose()?;
        if text.is_some_and(|t| t.parse::<f64>().is_ok()) {
            for (v, handle) in handles.iter_mut().flatten().enumerate() {
                *handle = if is_interpolated(v) { *handle } else { 1.0 };
            }
        }
        let text = flags.alpha.as_deref();
        let mut alpha = text.map(|t| constraints::numbers(t, n, 0.0)).transpose()?;
        for (v, a) in alpha.iter_mut().flatten().enumerate() {
            if interpolated.as_ref().is_some_and(|m| m[v]) {
                *a = 1.0;
            }
        }
        Ok(Wishes {
            interpolated,
            normals,
            handles,
            alpha,
        })
    }

    fn constraints(&self) -> Constraints<'_> {
        Constraints {
            interpolated: self.interpolated.as_deref(),
            normals: self.normals.as_deref(),
            handles: self.handles.as_deref(),
        }
    }
}

#[derive(Default)]
struct Seconds {
    assemble: f64,
    solve: f64,
    subdivide: f64,
    write: f64,
}

/// Control points and how they came about.
struct Control {
    method: &'static str,
    points: Vec<DVec3>,
    iterations: usize,
    status: &'static str,
    errors: Errors,
    tolerance: f64,
    seconds: Seconds,
}

struct Finished {
    method: &'static str,
    surface: Surface,
    iterations: usize,
    status: &'static str,
    errors: Errors,
    tolerance: f64,
    fairness: Option<Energies>,
    seconds: Seconds,
}

fn control_mesh(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Control> {
    if arguments.method == Choice::TwoPhase {
        return two_phase(arguments, input, wishes);
    }
    if input.mesh.diagonal() == 0.0 && arguments.stop.tol_absolute.is_none() {
        return Err(Error::mesh(
            &input.name,
            "all points coincide, so no tolerance can be relative to their extent: give --tol-absolute",
        ));
    }
    if let (
        Choice::Solver(method @ (Method::GaussSeidel | Method::Sor)),
        Order::Multicolour,
        None,
    ) = (arguments.method, arguments.order, &wishes.interpolated)
    {
        return by_colour(arguments, input, method);
    }
    let mut chosen = match arguments.method {
        Choice::Solver(method) => Some(method),
        _ => None,
    };
    if arguments.method == Choice::Auto && wishes.interpolated.is_none() {
        if let Some(control) = fastest(arguments, input)? {
            return Ok(control);
        }
        // A factorization tells a nearly singular matrix, on which iterations may make no progress for long, from a
        // singular one.
        chosen = Some(Method::Ldlt);
    }
    let start = Instant::now();
    let system = input.system()?;
    let part = match &wishes.interpolated {
        Some(marks) => Some(Restriction::new(&system, marks)?),
        None => None,
    };
    let solved = part.as_ref().map_or(&system, |p| &p.system);
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let mut method = chosen.unwrap_or_else(|| automatic(solved));
    let start = Instant::now();
    let order = arguments
        .order
        .order(&input.mesh, &input.topology().incidence);
    let order = part
        .as_ref()
        .map_or_else(|| order.clone(), |p| p.order(&order));
    let stop = arguments.stop.stop(&input.mesh);
    let progress = Progress::toward("solving", arguments.common.quiet);
    let solve = |method: Method| -> Result<Solution> {
        let setup = standard_setup(solved, method, Some(&order), &|| spectrum(solved))?;
        let mut start = None;
        let watch = &mut |step: &Step| {
            // In digits: from the first error seen to the tolerance.
            let error = step.errors.max;
            let digits = |e: f64| (e / stop.tolerance).ln();
            progress.part(1.0 - digits(error) / digits(*start.get_or_insert(error)));
            let iteration = step.iteration;
            progress.message(format!(
                "{method}, iteration {iteration}: max error {error:.2e}"
            ));
            ControlFlow::Continue(())
        };
        let points = &input.mesh.positions;
        Ok(match &part {
            Some(part) => part.solve(&system, points, setup, &stop, watch),
            None => run_watched(&system, points, setup, &stop, watch),
        })
    };
    let mut solution = solve(method)?;
    let outcome = solution.report.outcome;
    if arguments.method == Choice::Auto && no_progress(outcome) {
        method = Method::Ldlt;
        solution = solve(method)?;
    }
    drop(progress);
    check(input, method, &solution.report, stop.tolerance)?;
    Ok(Control {
        method: method.name(),
        points: solution.points,
        // The start on a subset is what one PIA step makes of V = P.
        iterations: solution.report.iterations + usize::from(part.is_some()),
        status: solution.report.outcome.name(),
        errors: solution.report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds {
            assemble,
            solve: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    })
}

/// Whether an iteration ended without getting nearer.
fn no_progress(outcome: Outcome) -> bool {
    matches!(
        outcome,
        Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown
    )
}

/// All vertices, by the library's choice of order, operator and method; `None` if that makes no progress.
fn fastest(arguments: &Arguments, input: &Input) -> Result<Option<Control>> {
    let stop = arguments.stop.stop(&input.mesh);
    let progress = Progress::open("solving", arguments.common.quiet);
    let found = match input.renumbered() {
        Some((moved, topology)) => moved.control_points(Some(topology), input.scheme, &stop),
        None => control_points(&input.mesh, Some(input.topology()), input.scheme, &stop),
    }
    .map_err(|e| Error::mesh(&input.name, e.to_string()))?;
    drop(progress);
    if no_progress(found.report.outcome) {
        return Ok(None);
    }
    check(input, found.method, &found.report, stop.tolerance)?;
    Ok(Some(Control {
        method: found.method.name(),
        points: found.points,
        iterations: found.report.iterations,
        status: found.report.outcome.name(),
        errors: found.report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds {
            assemble: input.check_seconds + found.curve_seconds + found.setup_seconds,
            solve: found.solve_seconds,
            ..Seconds::default()
        },
    }))
}

/// All vertices, by sweeps that relax those of one colour at once, without a stored matrix.
fn by_colour(arguments: &Arguments, input: &Input, method: Method) -> Result<Control> {
    let start = Instant::now();
    let stop = arguments.stop.stop(&input.mesh);
    let progress = Progress::open("solving", arguments.common.quiet);
    let (mesh, topology) = (&input.mesh, input.topology());
    let numbering = in_colours(&mesh.faces, &topology.incidence);
    let operator = Operator::in_order(&mesh.faces, topology, input.scheme, Some(&numbering))
        .map_err(|e| Error::mesh(&input.name, e.to_string()))?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let omega = if method == Method::Sor {
        SOR_OMEGA
    } else {
        1.0
    };
    let points = numbering.there(&mesh.positions);
    let (control, report) = by_colours(&operator, &points, omega, &stop);
    drop(progress);
    check(input, method, &report, stop.tolerance)?;
    Ok(Control {
        method: method.name(),
        points: numbering.back(&control),
        iterations: report.iterations,
        status: report.outcome.name(),
        errors: report.last(),
        tolerance: stop.tolerance,
        seconds: Seconds {
            assemble,
            solve: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    })
}

/// Zheng & Cai's phase one by its own rule.
fn two_phase(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Control> {
    let start = Instant::now();
    let order = arguments
        .order
        .order(&input.mesh, &input.topology().incidence);
    let phase = PhaseOne {
        sweep: Sweep::GaussSeidel(Some(&order)),
        max_iterations: arguments.shape.ite_max,
        eps: arguments.shape.eps,
    };
    let (mesh, topology) = (&input.mesh, input.topology());
    let marks = wishes.interpolated.as_deref();
    let found = zheng_cai::auxiliary(mesh, topology, marks, &phase)?;
    Ok(Control {
        method: "two-phase",
        errors: auxiliary_errors(input, marks, &found.mesh)?,
        points: found.mesh.positions,
        iterations: found.updates.len(),
        status: if found.passed {
            "converged"
        } else {
            "max-iterations"
        },
        tolerance: arguments.shape.eps * mesh.diagonal(),
        seconds: Seconds {
            assemble: input.check_seconds,
            solve: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    })
}

/// How far the limit points of an auxiliary mesh are from those interpolated.
fn auxiliary_errors(input: &Input, marks: Option<&[bool]>, auxiliary: &Mesh) -> Result<Errors> {
    let limits = limit_positions(Rule::ZhengCai, auxiliary, input.topology())?;
    let pairs = input.mesh.positions.iter().zip(&limits).enumerate();
    let distances: Vec<f64> = pairs
        .filter(|(v, _)| marks.is_none_or(|m| m[*v]))
        .map(|(_, (p, q))| p.distance(*q))
        .collect();
    Ok(Errors {
        max: distances.iter().copied().fold(0.0, f64::max),
        mean: distances.iter().sum::<f64>() / distances.len() as f64,
    })
}

fn refine(
    arguments: &Arguments,
    input: &Input,
    wishes: &Wishes,
    control: Control,
) -> Result<Finished> {
    let start = Instant::now();
    let flags = &arguments.shape;
    let mesh = Mesh::new(control.points, input.mesh.faces.clone());
    let request = Request {
        levels: flags.subdivide.into(),
        limit: flags.limit,
        normals: flags.write_normals,
        constraints: wishes.constraints(),
        rotation: Rotation {
            threshold: flags.normal_threshold.to_radians(),
            tolerance: flags.normal_tolerance.to_radians(),
            levels: flags.normal_levels.into(),
        },
    };
    let points = &input.mesh.positions;
    let surface = surface(mesh, || input.topology(), input.scheme, points, &request)?;
    let mut seconds = control.seconds;
    seconds.subdivide = start.elapsed().as_secs_f64();
    Ok(Finished {
        method: control.method,
        surface,
        iterations: control.iterations,
        status: control.status,
        errors: control.errors,
        tolerance: control.tolerance,
        fairness: None,
        seconds,
    })
}

/// The fairest control mesh, and its surface.
fn fairest(arguments: &Arguments, input: &Input, wishes: &Wishes) -> Result<Finished> {
    let start = Instant::now();
    let fairness = Fairness::new(&input.mesh)?;
    let assemble = input.check_seconds + start.elapsed().as_secs_f64();
    let start = Instant::now();
    let flags = &arguments.shape;
    let weights = Weights {
        thin_plate: flags.thin_plate,
        membrane: flags.membrane,
    };
    let points = &input.mesh.positions;
    let found = fit(&fairness, points, &wishes.constraints(), weights)?;
    let solve = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let request = Request {
        levels: usize::from(flags.subdivide).saturating_sub(halstead::LEVELS),
        limit: flags.limit,
        normals: flags.write_normals,
        ..Request::default()
    };
    let surface = surface(
        found.mesh,
        || &fairness.topology,
        input.scheme,
        &[],
        &request,
    )?;
    Ok(Finished {
        method: "halstead",
        surface,
        iterations: 1,
        status: "converged",
        errors: found.errors,
        tolerance: 0.0,
        fairness: Some(found.energies),
        seconds: Seconds {
            assemble,
            solve,
            subdivide: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    })
}

/// The unified √3 surface. Its errors are the distances of the vertices with α = 1, which stay: 0.
fn unified(arguments: &Arguments, input: &Input, alpha: &[f64]) -> Result<Finished> {
    let flags = &arguments.shape;
    if flags.subdivide == 0 && !flags.limit {
        return Err(Error::Computation(
            "the unified √3 scheme leaves the control mesh as it is: ask for the surface with --subdivide or --limit"
                .into(),
        ));
    }
    let start = Instant::now();
    let (mut mesh, alpha) = lin_luo::surface::refine_n(&input.mesh, alpha, flags.subdivide.into())?;
    let mut normals = None;
    if flags.limit || flags.write_normals {
        let found = lin_luo::limit::limits(&mesh, &alpha)?;
        normals = flags.write_normals.then_some(found.normals);
        if flags.limit {
            mesh.positions = found.positions;
        }
    }
    let surface = Surface {
        normals,
        ..Surface::plain(mesh)
    };
    Ok(unsolved("lin-luo", input, surface, start))
}

/// The surface of a scheme that keeps its vertices.
fn keeping(arguments: &Arguments, input: &Input, scheme: Refinement) -> Result<Finished> {
    let flags = &arguments.shape;
    let start = Instant::now();
    let mesh = scheme.refine_n(&input.mesh, flags.subdivide.into())?;
    let normals = if flags.write_normals {
        let topology = Topology::new(&mesh.faces, mesh.len());
        Some(scheme.limit_normals(&mesh, &topology)?)
    } else {
        None
    };
    let surface = Surface {
        normals,
        ..Surface::plain(mesh)
    };
    Ok(unsolved(scheme.name(), input, surface, start))
}

/// A surface without a system: vertices that are interpolated stay, so their errors are 0.
fn unsolved(method: &'static str, input: &Input, surface: Surface, start: Instant) -> Finished {
    Finished {
        method,
        surface,
        iterations: 0,
        status: "converged",
        errors: Errors {
            max: 0.0,
            mean: 0.0,
        },
        tolerance: 0.0,
        fairness: None,
        seconds: Seconds {
            assemble: input.check_seconds,
            subdivide: start.elapsed().as_secs_f64(),
            ..Seconds::default()
        },
    }
}

/// Nothing that is no number reaches a file.
fn require_finite(input: &Input, surface: &Surface) -> Result<()> {
    let normals = surface.normals.iter().flatten();
    match surface
        .mesh
        .positions
        .iter()
        .chain(normals)
        .position(|p| !p.is_finite())
    {
        None => Ok(()),
        Some(v) => Err(Error::mesh(
            &input.name,
            format!(
                "vertex {} of the result is not finite: the points are too large for doubles; scale the mesh down",
                v % surface.mesh.len()
            ),
        )),
    }
}

fn tell(arguments: &Arguments, input: &Input, wishes: &Wishes, result: &Finished) -> Result<()> {
    let Finished {
        surface,
        errors,
        seconds,
        ..
    } = result;
    let common = &arguments.common;
    if !surface.not_flattened.is_empty() {
        common.remark(format_args!(
            "{}: the faces of {} vertices have no average normal and were moved, not flattened (first: vertex {})",
            input.name,
            surface.not_flattened.len(),
            surface.not_flattened[0]
        ));
    }
    let without = surface
        .normals
        .iter()
        .flatten()
        .filter(|n| **n == DVec3::ZERO)
        .count();
    if without > 0 {
        common.remark(format_args!(
            "{}: the surface has no normal at {without} vertices; (0, 0, 0) is written",
            input.name
        ));
    }
    common.remark(format_args!(
        "{}: {} by {}, {} iterations, max error {:.3e}, mean {:.3e} (mesh units)",
        arguments.output.display(),
        match arguments.method {
            Choice::Keeping(scheme) => scheme.name(),
            _ => input.scheme.name(),
        },
        result.method,
        result.iterations,
        errors.max,
        errors.mean
    ));
    common.remark(format_args!(
        "seconds: read {:.3}, assemble {:.3}, solve {:.3}, subdivide {:.3}, write {:.3}",
        input.read_seconds, seconds.assemble, seconds.solve, seconds.subdivide, seconds.write
    ));
    if !arguments.json {
        return Ok(());
    }
    let marked = |marks: &Vec<bool>| marks.iter().filter(|&&m| m).count();
    let given = |normals: &Vec<Option<DVec3>>| normals.iter().flatten().count();
    let mut object = input.json(json!({
        "method": result.method,
        "iterations": result.iterations,
        "status": result.status,
        "max_error": number(errors.max),
        "mean_error": number(errors.mean),
        "tolerance": number(result.tolerance),
        "output": arguments.output.display().to_string(),
        "interpolated": wishes.interpolated.as_ref().map_or(input.mesh.len(), marked),
        "subdivide": arguments.shape.subdivide,
        "limit": arguments.shape.limit,
        "surface": {
            "vertices": surface.mesh.len(),
            "faces": surface.mesh.faces.len(),
        },
        "normals": wishes.normals.as_ref().map_or(Value::Null, |n| json!({
            "given": given(n),
            "set": surface.normals_set,
        })),
        "fairness": result.fairness.map_or(Value::Null, |e| json!({
            "thin_plate": number(e.thin_plate),
            "membrane": number(e.membrane),
        })),
        "seconds": {
            "read": number(input.read_seconds),
            "assemble": number(seconds.assemble),
            "solve": number(seconds.solve),
            "subdivide": number(seconds.subdivide),
            "write": number(seconds.write),
        },
    }));
    if let Choice::Keeping(scheme) = arguments.method {
        object["scheme"] = json!(scheme.name());
    }
    cli::print(&format!("{object:#}"))
}

/// A run that did not converge gives no control mesh.
fn check(input: &Input, method: Method, report: &Report, tolerance: f64) -> Result<()> {
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
