//! Command line of `interpolate`.

use std::path::{Display, Path, PathBuf};

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, ValueHint};

use crate::cli::{self, CommonFlags, MeshFlags, MonitorFlags, ReplaceFlags, STANDARD_STREAM, StopFlags, WHICH_METHOD};
use limitlab::interpolate::halstead::Weights;
use limitlab::mesh::order::Order;
use limitlab::schemes::Refinement;
use limitlab::solvers::Method;
use limitlab::{Result, names};

/// In its help.
const EXAMPLES: [&str; 3] = [
    "interpolate model.obj -o cage.obj --scheme catmull-clark",
    "interpolate model.usda -o surface.ply --subdivide 2 --limit",
    "interpolate - -o - --format off --quiet",
];

/// Computes the control mesh V with A V = P: the vertices P of the mesh become points of the limit surface.
///
/// Unless refined by --subdivide, the faces stay, vertex for vertex, so that the result can replace the mesh in a tool that
/// subdivides by the same scheme; another scheme's surface misses the points.
///
/// Blender, Maya and Rhino subdivide by Catmull-Clark: for these say --scheme catmull-clark, also of a triangle mesh,
/// which is taken for Loop unless told. The last line of a run says which tools show its surface.
#[derive(Parser)]
#[command(name = "interpolate", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE, Some(WHICH_METHOD)))]
pub struct Arguments {
    /// A mesh file (.obj, .off, .ply, .usda, .stl, .glb, .gltf), a built-in name, or - for standard input (with --format)
    #[arg(value_name = "MESH", value_hint = ValueHint::FilePath)]
    pub input: String,
    /// The mesh to write (.obj, .off, .ply, .usda; - for standard output, with --format): the control mesh, or the surface
    /// with --subdivide or --limit. In .obj a control mesh has the texture coordinates, groups, materials and normals (vn)
    /// of an .obj read; these normals shade the faces of the file, --write-normals writes those of the surface
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Write .ply as text; the other formats always are
    #[arg(long)]
    pub ascii: bool,
    /// Draw the mesh, its control mesh and the limit surface with the points, side by side: a file .png, .svg or .pdf
    #[arg(long, value_name = "FILE", conflicts_with = "alpha")]
    pub picture: Option<PathBuf>,
    /// auto, lu, cholesky, ldlt, jacobi, thall, gauss-seidel, sor, ssor, pia, w-pia, chebyshev, cg, pcg-jacobi,
    /// pcg-ssor, pcg-ic0, anderson, heavy-ball; two-phase (Zheng & Cai's own sweeps, with --scheme zheng-cai); halstead (the fairest
    /// surface, with --scheme catmull-clark: a control mesh two refinements down); fair-refinement (the fairest first refined
    /// mesh, with --scheme zheng-cai: the Doo-Sabin control mesh one refinement down); butterfly and labsik-greiner (with
    /// --subdivide: schemes that pass through the vertices of triangle meshes with no system solved). auto is
    /// chebyshev in mixed precision without a stored matrix, cg where that makes no progress, and ldlt where neither
    /// does
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = choice)]
    pub method: Choice,
    /// Solve nothing, and take the solution of the system that `assemble --format petsc` wrote: a PETSc vector in the folder of that
    /// system, of the same mesh and flags. It is checked by the limit points of all vertices, against --tol
    #[arg(long, value_name = "FILE", conflicts_with_all = ["method", "order", "max_iter", "vertices", "alpha", "monitor"])]
    pub solution: Option<PathBuf>,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED.
    /// By colours, gauss-seidel and sor of all vertices run on all threads without a stored matrix
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    pub order: Order,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub replace: ReplaceFlags,
    #[command(flatten)]
    pub shape: ShapeFlags,
    #[command(flatten)]
    pub mesh: MeshFlags,
    #[command(flatten)]
    pub stop: StopFlags,
    #[command(flatten)]
    pub monitor: MonitorFlags,
    #[command(flatten)]
    pub common: CommonFlags,
}

impl Arguments {
    /// The output in words.
    pub fn output_name(&self) -> Display<'_> {
        let is_stream = self.output.as_os_str() == STANDARD_STREAM;
        if is_stream { Path::new("standard output").display() } else { self.output.display() }
    }
}

/// What is asked of the surface.
#[derive(Args)]
pub struct ShapeFlags {
    /// Refine the control mesh K times by the scheme and write the surface; by mid-edge, where there are boundaries or
    /// creases, two steps each time
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=12))]
    pub subdivide: u8,
    /// Push the vertices that are written to their limit points
    #[arg(long)]
    pub limit: bool,
    /// Write the unit normals of the limit surface with the vertices; zero where it has none
    #[arg(long)]
    pub write_normals: bool,
    /// Interpolate these vertices only: numbers and ranges A..B, separated by commas, or a file of them; the other
    /// control points stay where they are, or with --method halstead and fair-refinement go where the surface is fairest
    #[arg(long, value_name = "LIST|FILE")]
    pub vertices: Option<String>,
    /// Normals of the surface at given points: a file with lines `vertex nx ny nz`, or a mesh file with normals
    /// (.obj, .off, .ply, .usda). Loop, √3 and Catmull-Clark turn rings of the mesh refined twice or more, Doo-Sabin tilts faces
    #[arg(long, value_name = "FILE")]
    pub normals: Option<PathBuf>,
    /// Turn rings only where the normal is off by more than this angle in degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = degrees, requires = "normals")]
    pub normal_threshold: f64,
    /// Stop turning this angle in degrees before the given normal
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = degrees, requires = "normals")]
    pub normal_tolerance: f64,
    /// Spread the turn over this many levels
    #[arg(long, value_name = "L", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=8), requires = "normals")]
    pub normal_levels: u8,
    /// Scale the faces of interpolated vertices about their points after the first refinement: a positive number,
    /// a file with lines `vertex number`, or fair, the numbers of the fairest surface (schemes zheng-cai and nasri)
    #[arg(long, value_name = "S|FILE|fair", allow_negative_numbers = true)]
    pub shape_handle: Option<String>,
    /// Lin & Luo's unified √3 scheme, no system solved: α from 0 (approximating) over 1 (interpolating) to 2, a number
    /// or a file with lines `vertex number` (others 0); with --vertices, those have α = 1
    #[arg(long, value_name = "A|FILE", allow_negative_numbers = true, conflicts_with_all = ["normals", "shape_handle"])]
    pub alpha: Option<String>,
    /// Sweeps of --method two-phase at most, 5 unless told
    #[arg(long, value_name = "K")]
    pub ite_max: Option<usize>,
    /// --method two-phase stops at a largest update of this part of the bounding box's diagonal, 0.003 unless told
    #[arg(long, value_name = "T", value_parser = cli::positive)]
    pub eps: Option<f64>,
    /// Weight of the thin-plate energy in --method halstead and fair-refinement and in --shape-handle fair, 0 or more and 1
    /// unless told
    #[arg(long, value_name = "W", allow_negative_numbers = true)]
    pub thin_plate: Option<f64>,
    /// Weight of the membrane energy there, positive and 1 unless told
    #[arg(long, value_name = "W", value_parser = cli::positive)]
    pub membrane: Option<f64>,
}

impl ShapeFlags {
    /// Whether the shape handles are those of the fairest surface.
    pub fn has_fair_handles(&self) -> bool {
        self.shape_handle.as_deref().is_some_and(|text| names::same(text, "fair"))
    }

    /// Of the energies.
    pub fn weights(&self) -> Weights {
        Weights { thin_plate: self.thin_plate.unwrap_or(1.0), membrane: self.membrane.unwrap_or(1.0) }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    Auto,
    Solver(Method<'static>),
    TwoPhase,
    Halstead,
    FairRefinement,
    /// A scheme that keeps its vertices.
    Keeping(Refinement),
}

fn choice(text: &str) -> Result<Choice> {
    let mut all = vec![
        ("auto", Choice::Auto),
        ("two-phase", Choice::TwoPhase),
        ("halstead", Choice::Halstead),
        ("fair-refinement", Choice::FairRefinement),
        ("butterfly", Choice::Keeping(Refinement::Butterfly)),
        ("labsik-greiner", Choice::Keeping(Refinement::LabsikGreiner)),
    ];
    all.extend(Method::ALL.map(|method| (method.name(), Choice::Solver(method))));
    names::find("method", text, &all, &Method::ALIASES.map(|(alias, method)| (alias, Choice::Solver(method))))
}

fn degrees(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (0.0..=180.0).contains(&x) => Ok(x),
        _ => Err("an angle from 0 to 180 is needed".into()),
    }
}

/// Ends with status 2, as clap does: flags that contradict each other.
pub fn conflict(what: &str) -> ! {
    let mut command = Arguments::command();
    command.error(ErrorKind::ArgumentConflict, what).exit()
}
