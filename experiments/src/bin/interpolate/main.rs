//! The control mesh, or the surface, that passes through the vertices of a mesh: `interpolate MESH -o OUT`.

mod control;
mod surfaces;
mod tell;
mod wishes;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser};

use glam::DVec3;

use limitlab::Result;
use limitlab::error::Error;
use limitlab::mesh::features::Tags;
use limitlab::mesh::file_tags::Subdivision;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Mesh, io};
use limitlab::output::{allow_replacing, check_target};
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::Method;
use limitlab_experiments::cli::{self, CommonFlags, MeshFlags, StopFlags, subdivision_of};

use control::control_mesh;
use surfaces::{fairest, keeping, leave, refine, require_finite, unified};
use tell::tell;
use wishes::Wishes;

/// Computes the control mesh V with A V = P: the vertices P of the mesh become points of the limit surface. Unless
/// refined by --subdivide, the faces stay, vertex for vertex, so that the result can replace the mesh in any
/// subdivision tool.
#[derive(Parser)]
#[command(name = "interpolate", version)]
struct Arguments {
    /// A mesh file (.obj, .off, .ply, .usda) or a built-in name
    #[arg(value_name = "MESH")]
    input: String,
    /// The mesh to write (.obj, .off, .ply, .usda): the control mesh, or the surface with --subdivide or --limit
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// auto, lu, cholesky, ldlt, jacobi, thall, gauss-seidel, sor, ssor, pia, w-pia, chebyshev, cg, pcg-jacobi,
    /// pcg-ssor, pcg-ic0, anderson, heavy-ball; two-phase (Zheng & Cai's own sweeps, with --scheme zheng-cai); halstead (the fairest
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
    /// (.obj, .off, .ply, .usda). Loop, √3 and Catmull-Clark turn rings of the mesh refined twice or more, Doo-Sabin tilts faces
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
    #[arg(long, value_name = "W", default_value_t = 1.0, allow_negative_numbers = true)]
    thin_plate: f64,
    /// Weight of the membrane energy in --method halstead, positive
    #[arg(long, value_name = "W", default_value_t = 1.0, value_parser = cli::positive)]
    membrane: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Choice {
    Auto,
    Solver(Method<'static>),
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
            conflict("--method halstead has no type-V faces for shape handles: use --scheme zheng-cai or nasri");
        }
        if arguments.shape.subdivide == 1 {
            conflict("--method halstead gives a mesh two refinements down: use --subdivide 2 or more, or leave it out");
        }
    }
    if let Choice::Keeping(scheme) = arguments.method {
        let shape = &arguments.shape;
        if arguments.mesh.scheme.is_some() {
            conflict(&format!("--method {scheme} is a scheme of its own: leave --scheme out"));
        }
        if shape.vertices.is_some() || shape.normals.is_some() || shape.shape_handle.is_some() {
            conflict(&format!("--method {scheme} passes through all vertices and takes no normals or shape handles"));
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

/// Whether the output is the input: who names one file twice wants it replaced, read-only or not (as by `sed -i`).
fn is_file_of(input: &str, output: &Path) -> bool {
    let [input, output] = [Path::new(input), output].map(|path| path.canonicalize().ok());
    input.is_some_and(|input| output.is_some_and(|output| input == output && input.is_file()))
}

fn run(arguments: &Arguments) -> Result<()> {
    if arguments.mesh.print_defects(&[&arguments.input], &arguments.common)? {
        return Ok(());
    }
    io::check_name(&arguments.output)?;
    let in_place = is_file_of(&arguments.input, &arguments.output);
    if !in_place {
        check_target(&arguments.output)?;
    }
    let input = arguments.mesh.input(&arguments.input, &arguments.common)?;
    let refinement = match arguments.method {
        Choice::Keeping(scheme) => scheme,
        _ => input.scheme.refinement(),
    };
    refinement.check_size(input.surface.mesh(), arguments.shape.subdivide.into()).map_err(|e| input.named(e))?;
    let wishes = Wishes::read(&arguments.shape, &input)?;
    let named = |e: Error| match e {
        Error::Io { .. } | Error::Parse { .. } | Error::Memory { .. } => e,
        other => input.named(other),
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
    leave(&input.frame, &mut result);
    require_finite(&input, &result.made)?;

    let start = Instant::now();
    if in_place {
        allow_replacing(&arguments.output)?;
    }
    let made = &result.made;
    let (normals, levels) = (made.normals.as_deref(), arguments.shape.subdivide);
    // The surface itself is its faces; refined control meshes have other edges than the tags.
    let is_control = !arguments.shape.limit && levels == 0;
    let subdivision = if is_control { subdivision_of(input.scheme) } else { Subdivision::None };
    // The fairest control mesh is refined too.
    let has_edges = is_control && made.surface.len() == input.surface.len();
    let tags = if has_edges { input.file_tags() } else { Cow::Owned(Tags::default()) };
    let write = |mesh: &Mesh, normals: Option<&[DVec3]>| {
        io::write_control(&arguments.output, mesh, normals, subdivision, &tags)
    };
    let remark = match input.welded.as_ref().filter(|_| made.surface.len() == input.surface.len()) {
        None => write(made.surface.mesh(), normals)?,
        // The file's own vertices and faces, one position for each that was made one.
        Some((place, faces)) => {
            let spread = |values: &[DVec3]| -> Vec<DVec3> { place.iter().map(|&v| values[v as usize]).collect() };
            let mesh = Mesh::new(spread(made.surface.positions()), faces.clone());
            write(&mesh, normals.map(spread).as_deref())?
        }
    };
    if let Some(remark) = remark {
        arguments.common.remark(format_args!("{}: {remark}", arguments.output.display()));
    }
    result.seconds.write = start.elapsed().as_secs_f64();
    tell(arguments, &input, &wishes, &result)
}
