//! Flags, exit status 2, JSON fields, several meshes, help.

use serde_json::Value;
use tempfile::tempdir;

use super::*;

#[test]
fn help_and_version_end_with_success() {
    let folder = tempdir().unwrap();
    for program in [ASSEMBLE, INTERPOLATE, COMPARE, SWEEP, REPRODUCE, SPLITTING] {
        let help = run(program, folder.path(), ["--help"]);
        assert_done(&help, program);
        let out = text(&help.stdout);
        assert!(out.contains("Usage:") && out.contains("--threads") && out.contains("--quiet"), "{out}");
        assert!(help.stderr.is_empty());
        let version = run(program, folder.path(), ["--version"]);
        assert_done(&version, program);
        assert!(text(&version.stdout).contains(env!("CARGO_PKG_VERSION")));
    }
    assert_no_files(folder.path(), "help");
}

#[test]
fn bad_arguments_end_with_2() {
    let folder = tempdir().unwrap();
    let everywhere = [&["--no-such-flag"][..], &["--threads", "0"], &["--threads", "many"], &["--threads"]];
    let on_meshes = [
        &["cube", "--scheme", "no-such-scheme"][..],
        &["cube", "--noise", "-1"],
        &["cube", "--noise", "0.1:x"],
        &["cube", "--boundary", "maybe"],
    ];
    let iterating = [
        &["cube", "--tol", "0"][..],
        &["cube", "--tol", "-1e-3"],
        &["cube", "--tol", "nan"],
        &["cube", "--tol", "1e-3", "--tol-absolute", "1e-3"],
        &["cube", "--max-iter", "-5"],
        &["cube", "--method", "no-such-method"],
        &["cube", "--order", "no-such-order"],
    ];
    let check = |program: &str, arguments: &[&str]| {
        let mut arguments = arguments.to_vec();
        match program {
            INTERPOLATE => arguments.extend(["-o", "x.obj"]),
            ASSEMBLE => arguments.extend(["--out", "x"]),
            _ => {}
        }
        let output = run(program, folder.path(), &arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{program} {arguments:?}: {error}");
        assert!(!error.contains("panicked") && output.stdout.is_empty(), "{error}");
    };
    for arguments in everywhere {
        for program in [ASSEMBLE, INTERPOLATE, COMPARE, SWEEP, REPRODUCE, SPLITTING] {
            check(program, arguments);
        }
    }
    for arguments in on_meshes {
        ON_MESHES.iter().for_each(|program| check(program, arguments));
    }
    for arguments in iterating {
        [INTERPOLATE, COMPARE, SWEEP].iter().for_each(|program| check(program, arguments));
    }
    for grid in ["", "1", "1:2", "2:1:0.1", "0.1:1:0", "0.1:1:-1", "a:b:c", "0.1:1:nan", "0:1:0.5"] {
        check(SWEEP, &["cube", "--omega", grid]);
    }
    for (program, arguments) in [(INTERPOLATE, &["cube"][..]), (ASSEMBLE, &["cube"]), (ASSEMBLE, &["--out", "x"])] {
        let output = run(program, folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{program} {arguments:?}");
    }
    assert_no_files(folder.path(), "bad arguments");
}

fn assert_fields(object: &Value, fields: &[&str]) {
    for field in fields {
        assert!(object.get(field).is_some(), "no field {field} in {object}");
    }
}

fn assert_numbers(object: &Value, fields: &[&str]) {
    for field in fields {
        let value = object.get(field).unwrap_or_else(|| panic!("no {field} in {object}"));
        assert!(value.is_number() || value.is_null(), "{field} is {value} in {object}");
    }
}

const STATUS: [&str; 7] = ["converged", "rounding", "diverged", "max-iterations", "stagnated", "singular", "breakdown"];

#[test]
fn compare_solvers_prints_the_fields_of_the_contract() {
    let folder = tempdir().unwrap();
    let arguments = ["cube", "--noise", "0.1", "--json", "--out", "out"];
    let output = run(COMPARE, folder.path(), arguments);
    assert_done(&output, "compare-solvers on a singular mesh");
    let object = json(&output);
    assert_eq!(object["mesh"], "cube");
    assert_eq!(object["scheme"], "catmull-clark");
    assert_eq!((&object["vertices"], &object["faces"]), (&8.into(), &6.into()));
    let rows = object["rows"].as_array().unwrap();
    let names =
        "lu cholesky ldlt jacobi thall gauss-seidel sor ssor pia w-pia chebyshev cg pcg-jacobi pcg-ssor pcg-ic0";
    let order: Vec<&str> = rows.iter().map(|r| r["method"].as_str().unwrap()).collect();
    // One row for each method, in the contract's order; further rows come after.
    assert_eq!(order[..15].join(" "), names);
    for row in rows {
        assert_fields(row, &["parameter", "max_error", "mean_error", "observed_rate", "predicted_rate"]);
        assert!(row["iterations"].is_u64());
        assert_numbers(row, &["max_error", "mean_error", "observed_rate", "predicted_rate"]);
        assert_numbers(&row["seconds"], &["setup", "solve"]);
        let status = row["status"].as_str().unwrap();
        assert!(STATUS.contains(&status), "{status}");
        let direct = ["lu", "cholesky", "ldlt"].contains(&row["method"].as_str().unwrap());
        assert_eq!(status == "singular", direct, "{row}");
        assert_ne!(status, "converged", "{row}");
    }
    let files = below(&folder.path().join("out"));
    assert_eq!(
        files,
        ["-history.csv", ".csv", ".md", ".png"].map(|e| format!("compare-solvers-cube-catmull-clark{e}"))
    );
}

#[test]
fn figures_come_in_the_formats_that_are_asked_for() {
    let folder = tempdir().unwrap();
    let path = folder.path().join(format!("{}/torus.obj", "a folder & <its> name ".repeat(6)));
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let torus = limitlab::mesh::builtin::builtin("torus:8x6").unwrap();
    limitlab::mesh::io::write(&path, &torus, None).unwrap();
    let file = path.to_str().unwrap();
    let sweep = |formats, out| run(SWEEP, folder.path(), [file, "--method", "pia", "--figure", formats, "--out", out]);
    assert_done(&sweep("svg,pdf,png", "out"), "sweep-omega");
    let out = folder.path().join("out");
    let read = |end: &str| fs::read(out.join(format!("sweep-omega-torus-catmull-clark.{end}"))).unwrap();
    assert!(read("pdf").starts_with(b"%PDF-") && read("png").starts_with(b"\x89PNG"));
    // The title has the file, and not the way to it.
    let svg = String::from_utf8(read("svg")).unwrap();
    assert!(svg.starts_with("<?xml") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("aria-label=\"torus.obj under catmull-clark, to 1e-10 of the diagonal\""), "{svg}");
    assert_eq!(sweep("gif", "other").status.code(), Some(2));
}

#[test]
fn sweep_omega_prints_the_fields_of_the_contract() {
    let folder = tempdir().unwrap();
    let arguments = ["torus:32x32", "--noise", "0.1", "--omega", "0.5:0.9:0.1", "--json", "--out", "out"];
    let output = run(SWEEP, folder.path(), arguments);
    assert_done(&output, "sweep-omega");
    let object = json(&output);
    let rows = object["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3 * 5);
    for row in rows {
        assert_fields(row, &["method", "omega", "iterations", "status"]);
        assert_numbers(row, &["predicted_rho", "observed_rate", "max_error"]);
        assert!(STATUS.contains(&row["status"].as_str().unwrap()));
    }
    let find = |method: &str, omega: f64| {
        let mut rows = rows.iter();
        rows.find(|r| r["method"] == method && r["omega"] == omega).unwrap()
    };
    assert_eq!(find("jacobi", 0.8)["status"], "converged");
    assert_eq!(find("jacobi", 0.9)["status"], "diverged");
    assert_eq!(object["best"]["jacobi"], 0.8);
    assert_eq!(object["best"]["pia"], 0.9);
    let critical = object["critical_omega"]["jacobi"].as_f64().unwrap();
    assert!((critical - 8.0 / 9.0).abs() < 1e-9, "{critical}");
    let out = folder.path().join("out");
    let stem = "sweep-omega-torus-32x32-catmull-clark";
    assert_eq!(below(&out), ["csv", "md", "png"].map(|e| format!("{stem}.{e}")));
    let table = fs::read_to_string(out.join(format!("{stem}.md"))).unwrap();
    assert!(table.contains("ω_crit = 0.888889") && table.contains("best on the grid: ω = 0.8 "), "{table}");
    assert!(table.contains("--noise 0.1"), "the noise is told: {table}");
}

#[test]
fn interpolate_and_assemble_print_the_fields_of_the_contract() {
    let folder = tempdir().unwrap();
    let output = run(INTERPOLATE, folder.path(), ["icosahedron", "-o", "v.off", "--json"]);
    assert_done(&output, "interpolate");
    let object = json(&output);
    assert_fields(&object, &["mesh", "scheme", "vertices", "faces", "method", "iterations"]);
    assert_eq!(object["scheme"], "loop");
    assert_eq!(object["status"], "converged");
    assert!(object["max_error"].as_f64().unwrap() >= object["mean_error"].as_f64().unwrap());
    for part in ["read", "assemble", "solve", "write"] {
        assert!(object["seconds"][part].as_f64().unwrap() >= 0.0, "{part}");
    }
    assert_eq!(below(folder.path()), ["v.off"]);

    let output = run(ASSEMBLE, folder.path(), ["prism:5", "--out", "m", "--scheme", "nasri", "--json"]);
    assert_done(&output, "assemble");
    let object = json(&output);
    assert_fields(&object, &["mesh", "scheme", "vertices", "faces", "files"]);
    assert_eq!(below(&folder.path().join("m")), ["A.mtx", "H.mtx", "M.mtx", "P.mtx", "R.mtx"]);
}

#[test]
fn several_meshes_make_a_list_of_results() {
    let folder = tempdir().unwrap();
    for program in [COMPARE, SWEEP] {
        let mut more = vec!["tetrahedron", "octahedron", "--json", "--quiet", "--method", "pia"];
        if program == SWEEP {
            more.extend(["--omega", "1:1:1"]);
        }
        let output = run(program, folder.path(), more);
        assert_done(&output, program);
        assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
        let object = json(&output);
        let results = object["results"].as_array().unwrap();
        assert!(object.get("rows").is_none() && object.get("mesh").is_none());
        let names: Vec<&str> = results.iter().map(|r| r["mesh"].as_str().unwrap()).collect();
        assert_eq!(names, ["tetrahedron", "octahedron"]);
    }
    // The default folder.
    assert_eq!(below(&folder.path().join("out")).len(), 2 * (4 + 3));
}

#[test]
fn the_scheme_that_was_chosen_is_said_unless_quiet() {
    let folder = tempdir().unwrap();
    for (mesh, scheme) in [("octahedron", "loop"), ("prism:3", "catmull-clark")] {
        let output = run(ASSEMBLE, folder.path(), [mesh, "--out", "m"]);
        assert!(text(&output.stderr).contains(&format!("scheme {scheme}")));
        let output = run_on(ASSEMBLE, folder.path(), mesh, &[]);
        assert_done(&output, mesh);
        assert!(output.stderr.is_empty() && output.stdout.is_empty());
    }
}

#[test]
fn reproduce_lists_its_items_and_refuses_others() {
    let folder = tempdir().unwrap();
    let output = run(REPRODUCE, folder.path(), ["--list"]);
    assert_done(&output, "reproduce --list");
    let list = text(&output.stdout);
    assert!(list.lines().any(|l| l.starts_with("pia-table1 ")), "{list}");
    for (arguments, what) in [
        (&["--only", "no-such-item", "--quiet"][..], "no-such-item"),
        (&["--only", "pia-table1", "--only", "nor-this", "--quiet"], "nor-this"),
        (&["--meshes", "no-such-folder", "--quiet"], "no-such-folder"),
    ] {
        let line = assert_refused(&run(REPRODUCE, folder.path(), arguments), what);
        assert!(line.contains(what), "{line}");
    }
    assert_no_files(folder.path(), "reproduce");
}

#[test]
fn names_are_taken_in_any_case_and_with_any_separator() {
    let folder = tempdir().unwrap();
    let arguments = ["Torus:6x6", "--scheme", "Catmull_Clark", "--method", "GS,gauss seidel,CG-PIA", "--order", "BFS"];
    let output = run(COMPARE, folder.path(), arguments.into_iter().chain(["--json", "--quiet"]));
    assert_done(&output, "forgiving names");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(object["scheme"], "catmull-clark");
    let methods: Vec<&str> = object["rows"].as_array().unwrap().iter().map(|r| r["method"].as_str().unwrap()).collect();
    // What is named twice runs once; cg has two rows.
    assert_eq!(methods, ["gauss-seidel", "cg", "cg"]);
}

#[test]
fn a_misspelt_name_gets_a_suggestion_and_all_names() {
    let folder = tempdir().unwrap();
    for (program, arguments, parts) in [
        (COMPARE, &["cube", "--scheme", "catmull"][..], ["perhaps catmull-clark?", "loop, sqrt3"]),
        (COMPARE, &["cube", "--method", "cholesk"], ["perhaps cholesky?", "use auto, lu"]),
        (INTERPOLATE, &["cube", "-o", "x.obj", "--method", "halsted"], ["perhaps halstead?", "two-phase"]),
        (COMPARE, &["cube", "--order", "revers"], ["perhaps reverse?", "or random"]),
        (COMPARE, &["cube", "--boundary", "edgeonly,"], ["perhaps edge-only?", "refuse"]),
        (
            SPLITTING,
            &["--valence", "4", "--at", "edge"],
            ["kind of vertex \"edge\"", "smooth, boundary, crease, corner or dart"],
        ),
        (SPLITTING, &["--valence", "4", "--scheme", "doosabins"], ["perhaps doo-sabin?", "labsik-greiner"]),
        (COMPARE, &["icospere:2"], ["perhaps icosphere?", "torus:NxM"]),
        (REPRODUCE, &["--only", "pia_table"], ["perhaps pia-table1?", "--list"]),
    ] {
        let output = run(program, folder.path(), arguments);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        let error = text(&output.stderr);
        assert!(parts.iter().all(|part| error.contains(part)), "{arguments:?}: {error}");
    }
    // A path that is not there is no misspelt built-in name.
    let line = assert_refused(&run(COMPARE, folder.path(), ["models/cube"]), "models/cube");
    assert!(line.contains("models/cube: cannot read") && !line.contains("built-in"), "{line}");
}

#[test]
fn the_result_says_which_tools_show_its_surface() {
    let folder = tempdir().unwrap();
    let said = |more: &[&str]| {
        let arguments = ["octahedron", "-o", "cage.obj"].iter().chain(more);
        let output = run(INTERPOLATE, folder.path(), arguments);
        assert_done(&output, "octahedron");
        text(&output.stderr).lines().find_map(|l| l.strip_prefix("its surface: ")).map(str::to_owned)
    };
    // Triangles are taken for Loop, which Blender does not know.
    let untold = said(&[]).unwrap();
    assert!(untold.starts_with("Loop's") && untold.contains("use --scheme catmull-clark"), "{untold}");
    let told = said(&["--scheme", "catmull-clark"]).unwrap();
    assert!(told.contains("Blender") && !told.contains("--scheme"), "{told}");
    assert!(said(&["--scheme", "zheng-cai"]).unwrap().contains("--limit"));
    // The surface itself is seen in every tool.
    assert_eq!([said(&["--limit"]), said(&["--subdivide", "1"]), said(&["--quiet"])], [None, None, None]);
    for program in [COMPARE, INTERPOLATE] {
        let help = run(program, folder.path(), ["--help"]);
        assert!(text(&help.stdout).contains("docs/methods.md"));
    }
}
