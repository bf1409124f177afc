//! The limit system of a mesh as Matrix Market files: `assemble MESH --out DIR`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueHint};
use serde_json::json;

use crate::cli::{self, CommonFlags, MeshFlags, ReplaceFlags};
use crate::report::Provenance;
use limitlab::assemble::matrix_market;
use limitlab::output::{Batch, check_target, create_dir};
use limitlab::{Error, Result};

/// In its help.
const EXAMPLES: [&str; 2] =
    ["assemble model.ply --out system", "assemble torus:8x6 --scheme nasri --out system --json"];

/// Writes A, M, H and P of the limit system A V = P, A = H·M, as Matrix Market files.
///
/// Numbers have 17 significant digits, rows the vertex order of the mesh. On an open or creased mesh A is no such product:
/// A.mtx and P.mtx are those of all vertices, and the folder `smooth` has the five files of the system of the smooth vertices,
/// in ascending order, once curves and corners are known; with darts and semi-sharp edges there is no such system.
///
/// A.mtx is general, M.mtx symmetric (lower triangle), H.mtx an N×1 array (the diagonal), P.mtx an N×3 array of the
/// given points, and R.mtx = H⁻¹P, the right-hand side of M V = R. With --scheme zheng-cai, M and R are the paper's
/// Eq. 6 in its own scaling.
#[derive(Parser)]
#[command(name = "assemble", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE, None))]
pub struct Arguments {
    /// A mesh file (.obj, .off, .ply, .usda, .stl, .glb, .gltf) or a built-in name
    #[arg(value_name = "MESH", value_hint = ValueHint::FilePath)]
    input: String,
    /// Folder for the five files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
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

/// Runs the program.
pub fn main(arguments: Arguments, provenance: Provenance) -> ExitCode {
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        run(&arguments, &provenance)
    })
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.mesh.print_defects(&[&arguments.input], &arguments.common, provenance)? {
        return Ok(());
    }
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
