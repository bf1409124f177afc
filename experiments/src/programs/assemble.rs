//! The limit system of a mesh as files: `assemble MESH --out DIR`, in Matrix Market's format or PETSc's.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueHint};
use serde_json::json;

use crate::cli::{self, CommonFlags, MeshFlags, ReplaceFlags};
use crate::report::Provenance;
use limitlab::assemble::petsc::{self, Export, Index};
use limitlab::assemble::{StreamedSystem, matrix_market};
use limitlab::mesh::features::Features;
use limitlab::mesh::io::Format;
use limitlab::mesh::order::Order;
use limitlab::output::{Batch, check_target, create_dir};
use limitlab::{Error, Result, names};

/// In its help.
const EXAMPLES: [&str; 3] = [
    "assemble model.ply --out system",
    "assemble torus:8x6 --scheme nasri --out system --json",
    "assemble model.ply --format petsc --order curve --out system",
];

/// Writes A, M, H and P of the limit system A V = P, A = H·M, as Matrix Market files, or for PETSc.
///
/// Numbers have 17 significant digits, rows the vertex order of the mesh. On an open or creased mesh A is no such product:
/// A.mtx and P.mtx are those of all vertices, and the folder `smooth` has the five files of the system of the smooth vertices,
/// in ascending order, once curves and corners are known; with darts and semi-sharp edges there is no such system.
///
/// A.mtx is general, M.mtx symmetric (lower triangle), H.mtx an N×1 array (the diagonal), P.mtx an N×3 array of the
/// given points, and R.mtx = H⁻¹P, the right-hand side of M V = R. With --scheme zheng-cai, M and R are the paper's
/// Eq. 6 in its own scaling.
///
/// With --format petsc: M.petsc and R.petsc (the coordinates of each row in turn) of the smooth vertices, H.petsc, the vertex of
/// each row (order.petsc), and manifest.json, in which diagonal is L. Points are (P − centre)/scale, which is P on most meshes. No
/// matrix is held; engines/petsc solves the system on many processes, and `interpolate --solution` takes the result.
#[derive(Parser)]
#[command(
    name = "assemble",
    version = cli::VERSION,
    after_help = cli::ending(&EXAMPLES, cli::DONE, None),
    // The one flag here is about the files on either side.
    mut_arg("format", |of_mesh| of_mesh.long("mesh-format").hide(true))
)]
pub struct Arguments {
    /// A mesh file (.obj, .off, .ply, .usda, .stl, .glb, .gltf) or a built-in name
    #[arg(value_name = "MESH", value_hint = ValueHint::FilePath)]
    input: String,
    /// Folder for the five files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Of the files written: matrix-market (unless told) or petsc. And of a mesh on standard input, whose name is -: obj, off,
    /// ply, usda, stl or gltf
    #[arg(long = "format", id = "formats", value_name = "NAME", value_parser = any_format)]
    formats: Vec<AnyFormat>,
    /// The order of the rows with --format petsc: file (unless told), curve (along a space-filling curve, by which processes
    /// share few vertices), reverse, bfs, rcm, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME")]
    order: Option<Order>,
    /// Bits of an index with --format petsc: 32 (unless told), or 64 for a PETSc that is configured so
    #[arg(long, value_name = "BITS", value_parser = index)]
    index: Option<Index>,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    replace: ReplaceFlags,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// The folder of the system of the smooth vertices.
const OF_BLOCK: &str = "smooth";
/// What is written.
const FILES: [&str; 5] = ["A.mtx", "M.mtx", "H.mtx", "P.mtx", "R.mtx"];
/// What is written for PETSc.
const OF_PETSC: [&str; 5] = ["M.petsc", "R.petsc", "H.petsc", petsc::ORDER, cli::MANIFEST];

/// What one flag names.
#[derive(Clone, Copy, Debug)]
enum AnyFormat {
    OfMesh(Format),
    OfSystem(System),
}

/// How a system is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum System {
    MatrixMarket,
    Petsc,
}

fn any_format(text: &str) -> Result<AnyFormat> {
    if let Ok(format) = text.parse() {
        return Ok(AnyFormat::OfMesh(format));
    }
    let systems = [("matrix-market", System::MatrixMarket), ("petsc", System::Petsc)];
    let all: Vec<(&str, AnyFormat)> = systems.map(|(name, system)| (name, AnyFormat::OfSystem(system))).to_vec();
    names::find("format", text, &all, &[("mtx", AnyFormat::OfSystem(System::MatrixMarket))])
}

fn index(text: &str) -> std::result::Result<Index, String> {
    match text {
        "32" => Ok(Index::Bits32),
        "64" => Ok(Index::Bits64),
        _ => Err("indices have 32 bits, or 64".into()),
    }
}

/// Ends with status 2, as clap does: flags that contradict each other.
fn conflict(what: &str) -> ! {
    Arguments::command().error(ErrorKind::ArgumentConflict, what).exit()
}

/// Runs the program.
pub fn main(mut arguments: Arguments, provenance: Provenance) -> ExitCode {
    let mut system = None;
    for format in &arguments.formats {
        let is_second = match *format {
            AnyFormat::OfMesh(format) => arguments.mesh.format.replace(format).is_some(),
            AnyFormat::OfSystem(format) => system.replace(format).is_some(),
        };
        if is_second {
            conflict("--format names two formats of one thing: the mesh has one, and the files written have one");
        }
    }
    let system = system.unwrap_or(System::MatrixMarket);
    if system == System::MatrixMarket && (arguments.order.is_some() || arguments.index.is_some()) {
        conflict(
            "--order and --index are about --format petsc: rows of Matrix Market files are in the order of the mesh",
        );
    }
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        if arguments.mesh.print_defects(&[&arguments.input], &arguments.common, &provenance)? {
            return Ok(());
        }
        match system {
            System::MatrixMarket => run(&arguments, &provenance),
            System::Petsc => run_petsc(&arguments, &provenance),
        }
    })
}

/// For PETSc: the files, each as its rows come.
fn run_petsc(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    create_dir(&arguments.out)?;
    let paths = OF_PETSC.map(|name| arguments.out.join(name));
    for path in &paths {
        arguments.replace.settle(path)?;
        check_target(path)?;
    }
    let input = arguments.mesh.input(&arguments.input, &arguments.common)?;
    let surface = &input.surface;
    if surface.features().is_some_and(Features::has_stars) {
        let what = "darts and semi-sharp vertices have no symmetric system, as this format is for: use --format \
                    matrix-market, which writes all of A";
        return Err(Error::mesh(&input.name, what));
    }
    let (order, index) = (arguments.order.unwrap_or_default(), arguments.index.unwrap_or(Index::Bits32));
    let places = order.order(surface.mesh(), surface.incidence());
    let system = StreamedSystem::new(surface, input.scheme, &places).map_err(|e| input.named(e))?;
    drop(places);
    let export = Export::new(&system, index).map_err(|e| match e {
        Error::TooLarge { .. } => Error::mesh(&input.name, format!("{e}: --index 64")),
        other => input.named(other),
    })?;
    let fields = input.json(json!({
        "rows": system.len(),
        "entries": export.entries(),
        "index": index.bits(),
        "order": order.to_string(),
        "diagonal": surface.diagonal(),
        "centre": input.frame.back(glam::DVec3::ZERO).to_array(),
        "scale": input.frame.scale(),
        "files": paths.each_ref().map(|path| path.display().to_string()),
    }));
    let mut batch = Batch::default();
    let [matrix, right, weights, vertices, manifest] = &paths;
    batch.write(matrix, |out| export.write_matrix(out))?;
    batch.write(right, |out| export.write_right_hand_side(surface.positions(), out))?;
    batch.write(weights, |out| export.write_weights(out))?;
    batch.write(vertices, |out| export.write_order(out))?;
    let text = cli::object_text(&fields, provenance)?;
    batch.write(manifest, |out| out.write_all(&text))?;
    batch.commit()?;
    arguments.common.remark(format_args!(
        "{}: {} rows in {order} order, {} entries, {}-bit indices",
        arguments.out.display(),
        system.len(),
        export.entries(),
        index.bits()
    ));
    arguments.common.remark_on_replaced();
    if arguments.json { cli::print_object(fields, provenance) } else { Ok(()) }
}

/// In Matrix Market's format.
fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    create_dir(&arguments.out)?;
    for name in FILES {
        arguments.replace.settle(&arguments.out.join(name))?;
        arguments.replace.settle(&arguments.out.join(OF_BLOCK).join(name))?;
        check_target(&arguments.out.join(name))?;
    }
    let input = arguments.mesh.input(&arguments.input, &arguments.common)?;
    let stages = input.stages()?;
    let matrix = stages.matrix();
    let points = &*input.given_points();
    let known = stages.known(points);
    let mut files = Vec::new();
    let comments = provenance.about(&input.source()).lines();
    let mut batch = Batch::default();
    let whole = ["A.mtx", "P.mtx"].map(|name| arguments.out.join(name));
    let mut folder = arguments.out.clone();
    if stages.vertices().is_some() {
        batch.write(&whole[0], |out| matrix_market::write_general(&matrix, &comments, out))?;
        batch.write(&whole[1], |out| matrix_market::write_points(points, &comments, out))?;
        files.extend(whole);
        folder.push(OF_BLOCK);
    }
    // With darts and semi-sharp vertices the smooth ones have no system of their own.
    if stages.stars().is_none() {
        create_dir(&folder)?;
        let of_block = FILES.map(|name| folder.join(name));
        let block = stages.block();
        let right = stages.right_hand_side(&known);
        let symmetric = block.symmetric_right_hand_side(&right);
        batch.write(&of_block[0], |out| matrix_market::write_general(&block.a, &comments, out))?;
        batch.write(&of_block[1], |out| matrix_market::write_symmetric(&block.m, &comments, out))?;
        batch.write(&of_block[2], |out| matrix_market::write_vector(&block.h, &comments, out))?;
        batch.write(&of_block[3], |out| matrix_market::write_points(&right, &comments, out))?;
        batch.write(&of_block[4], |out| matrix_market::write_points(&symmetric, &comments, out))?;
        files.extend(of_block);
    }
    // What an earlier run left there would pass for a part of this system.
    let folders = [arguments.out.clone(), arguments.out.join(OF_BLOCK)];
    let others = folders.iter().flat_map(|folder| FILES.map(|name| folder.join(name)));
    if let Some(stale) = others.filter(|path| !files.contains(path)).find(|path| path.exists()) {
        let what =
            "it is of another system, and would stand among the files of this one: remove it, or name another folder";
        return Err(Error::mesh(stale.display().to_string(), what));
    }
    batch.commit()?;
    let names = input.scheme.paper_names();
    arguments.common.remark(format_args!(
        "{}: {} vertices, {} entries; in the paper {} = {}·{}",
        arguments.out.display(),
        stages.len(),
        matrix.values().len(),
        names.system,
        names.diagonal,
        names.symmetric
    ));
    arguments.common.remark_on_replaced();
    if arguments.json {
        let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
        let object = input.json(json!({
            "entries": matrix.values().len(),
            "bandwidth": matrix.pattern().bandwidth(),
            "files": files,
        }));
        cli::print_object(object, provenance)?;
    }
    Ok(())
}
