//! The limit system of a mesh as Matrix Market files: `assemble MESH --out DIR`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use serde_json::json;

use limitlab::Result;
use limitlab::assemble::matrix_market;
use limitlab::output::{Batch, check_target, create_dir};
use limitlab_experiments::cli::{self, CommonFlags, MeshFlags};

/// Writes A, M, H and P of the limit system A V = P, A = H·M, as Matrix Market files with 17 significant digits,
/// in the vertex order of the mesh.
///
/// A.mtx is general, M.mtx symmetric (lower triangle), H.mtx an N×1 array (the diagonal), P.mtx an N×3 array of the
/// given points, and R.mtx = H⁻¹P, the right-hand side of M V = R. With --scheme zheng-cai, M and R are the paper's
/// Eq. 6 in its own scaling.
#[derive(Parser)]
#[command(name = "assemble", version)]
struct Arguments {
    /// A mesh file (.obj, .off, .ply) or a built-in name
    #[arg(value_name = "MESH")]
    input: String,
    /// Folder for the five files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What is written.
const FILES: [&str; 5] = ["A.mtx", "M.mtx", "H.mtx", "P.mtx", "R.mtx"];

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    if arguments.mesh.print_defects(&[&arguments.input], &arguments.common)? {
        return Ok(());
    }
    create_dir(&arguments.out)?;
    let path = |name: &str| arguments.out.join(name);
    for name in FILES {
        check_target(&path(name))?;
    }
    let input = arguments.mesh.input(&arguments.input, &arguments.common)?;
    let system = input.system()?;
    let points = &*input.given_points();
    let right_hand_side = system.symmetric_right_hand_side(points);
    let mut batch = Batch::default();
    batch.write(&path("A.mtx"), |out| matrix_market::write_general(&system.a, out))?;
    batch.write(&path("M.mtx"), |out| matrix_market::write_symmetric(&system.m, out))?;
    batch.write(&path("H.mtx"), |out| matrix_market::write_vector(&system.h, out))?;
    batch.write(&path("P.mtx"), |out| matrix_market::write_points(points, out))?;
    batch.write(&path("R.mtx"), |out| matrix_market::write_points(&right_hand_side, out))?;
    batch.commit()?;
    let names = input.scheme.paper_names();
    arguments.common.remark(format_args!(
        "{}: {} vertices, {} entries; in the paper {} = {}·{}",
        arguments.out.display(),
        system.len(),
        system.a.values().len(),
        names.system,
        names.diagonal,
        names.symmetric
    ));
    if arguments.json {
        let files = FILES.map(|n| path(n).display().to_string());
        let object = input.json(json!({
            "entries": system.a.values().len(),
            "bandwidth": system.a.pattern().bandwidth(),
            "files": files,
        }));
        cli::print_json(&object)?;
    }
    Ok(())
}
