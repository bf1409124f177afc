//! Folders with a system of anybody: what `assemble` wrote gives the rows of the mesh, a Laplacian those of its spectrum;
//! what needs a mesh says so.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;

use limitlab::mesh::io;
use serde_json::json as object;
use tempfile::tempdir;

use super::*;
use crate::common::meshes::noisy;

/// Iterations and status of each row by method and parameter. The numbers of an estimated Chebyshev interval may differ
/// in their last digit, and a proven one by more: what valences prove is not known from entries.
fn rows(output: &Output) -> BTreeMap<(String, String), (u64, String)> {
    let parameter = |row: &Value| {
        let whole = row["parameter"].as_str().unwrap().to_owned();
        if row["method"] == "chebyshev" { whole.rsplit(", ").next().unwrap().to_owned() } else { whole }
    };
    let object = json(output);
    let rows = object["rows"].as_array().unwrap().iter();
    rows.map(|row| {
        let text = |field: &str| row[field].as_str().unwrap().to_owned();
        ((text("method"), parameter(row)), (row["iterations"].as_u64().unwrap(), text("status")))
    })
    .filter(|((_, parameter), _)| parameter != "proven")
    .collect()
}

#[test]
fn what_assemble_wrote_gives_the_iterations_of_the_mesh() {
    let folder = tempdir().unwrap();
    // Far from one: the frame takes the size away, exactly.
    let mut tiny = noisy("tri-torus:5x4");
    tiny.positions.iter_mut().for_each(|p| *p *= 2f64.powi(-400));
    io::write(&folder.path().join("tiny.obj"), &tiny, None).unwrap();
    for (mesh, scheme, order) in [
        ("cube", "catmull-clark", "file"),
        ("prism:7", "catmull-clark", "reverse"),
        ("icosphere:1", "loop", "random:3"),
        ("tiny.obj", "sqrt3", "file"),
        ("irregular-poly:60", "nasri", "reverse"),
        ("torus:6x5", "zheng-cai", "file"),
    ] {
        let what = format!("{mesh} under {scheme}");
        let flags: &[&str] = if mesh == "tiny.obj" { &[] } else { &["--noise", "0.1:2"] };
        let on_mesh = [&[mesh, "--scheme", scheme, "--quiet"], flags].concat();
        assert_done(&run(ASSEMBLE, folder.path(), [&on_mesh[..], &["--out", "d"]].concat()), &what);
        let more = ["--json", "--order", order, "--max-iter", "3000"];
        let by_mesh = run(COMPARE, folder.path(), [&on_mesh[..], &more].concat());
        let by_files = run(COMPARE, folder.path(), [&["d", "--quiet"], &more[..]].concat());
        assert_done(&by_mesh, &what);
        assert_done(&by_files, &what);
        let (mut by_mesh, mut by_files) = (rows(&by_mesh), rows(&by_files));
        // On a mesh auto begins without a matrix; on both it knows what is soluble.
        for rows in [&mut by_mesh, &mut by_files] {
            let auto: Vec<bool> =
                rows.iter().filter(|(row, _)| row.0 == "auto").map(|(_, (_, status))| status == "converged").collect();
            assert_eq!(auto, [mesh != "cube"], "{what}");
            rows.retain(|row, _| row.0 != "auto");
        }
        // On a mesh with a proven λ_min the estimated interval has a row of its own.
        assert!(by_mesh.len() >= 16, "{by_mesh:?}");
        let names = |rows: &BTreeMap<_, _>| rows.keys().cloned().collect::<Vec<(String, String)>>();
        assert_eq!(names(&by_mesh), names(&by_files), "{what}");
        for (row, (iterations, status)) in &by_mesh {
            let (other, other_status) = &by_files[row];
            assert_eq!(status, other_status, "{what}, {row:?}");
            assert!(iterations.abs_diff(*other) <= 1, "{what}, {row:?}: {iterations} and {other}");
        }
        // Errors are in the units of the points.
        let sweep = ["--method", "pia,jacobi,sor", "--omega", "0.5:0.7:0.1", "--json", "--order", order];
        let by_mesh = json(&run(SWEEP, folder.path(), [&on_mesh[..], &sweep].concat()));
        let by_files = json(&run(SWEEP, folder.path(), [&["d", "--quiet"], &sweep[..]].concat()));
        for (a, b) in by_mesh["rows"].as_array().unwrap().iter().zip(by_files["rows"].as_array().unwrap()) {
            assert_eq!((&a["method"], &a["omega"], &a["status"]), (&b["method"], &b["omega"], &b["status"]));
            assert!(a["iterations"].as_u64().unwrap().abs_diff(b["iterations"].as_u64().unwrap()) <= 1, "{a} {b}");
            let [a, b] = [a, b].map(|row| row["max_error"].as_f64().unwrap());
            assert!((a / b - 1.0).abs() < 1e-3 || a < 1e-12, "{what}: {a:e} and {b:e}");
        }
    }
}

/// The 5-point Laplacian on k×k points, without H, its right-hand side a column.
fn write_laplacian(folder: &Path, k: usize) {
    let n = k * k;
    let mut lines = String::new();
    let mut count = 0;
    for i in 0..n {
        for (there, j, a) in [(i >= k, i.wrapping_sub(k), -1), (i % k > 0, i.wrapping_sub(1), -1), (true, i, 4)] {
            if there {
                writeln!(lines, "{} {} {a}", i + 1, j + 1).unwrap();
                count += 1;
            }
        }
    }
    fs::create_dir_all(folder).unwrap();
    let m = format!("%%MatrixMarket matrix coordinate integer symmetric\n{n} {n} {count}\n{lines}");
    fs::write(folder.join("M.mtx"), m).unwrap();
    let p: String = (0..n).map(|i| format!("{}\n", (i * 7919 % 101) as f64 / 101.0)).collect();
    fs::write(folder.join("P.mtx"), format!("%%MatrixMarket matrix array real general\n{n} 1\n{p}")).unwrap();
}

#[test]
fn a_laplacian_is_solved_by_all_methods_that_can() {
    let folder = tempdir().unwrap();
    let system = folder.path().join("my laplacian");
    // More rows than dense eigenvalues are computed of.
    let k = 26;
    write_laplacian(&system, k);
    let output = run(COMPARE, folder.path(), ["my laplacian", "--json", "--quiet", "--tol", "1e-8"]);
    assert_done(&output, "Laplacian");
    let found = json(&output);
    assert_eq!(found["system"], "my laplacian");
    assert_eq!((&found["vertices"], &found["mesh"], &found["scheme"]), (&object!(k * k), &Value::Null, &Value::Null));
    for row in found["rows"].as_array().unwrap() {
        let expected = if row["method"] == "pia" { "diverged" } else { "converged" };
        assert_eq!(row["status"], expected, "{row}");
    }
    assert_eq!(
        below(&folder.path().join("out")),
        ["-history.csv", ".csv", ".md", ".png"].map(|e| format!("compare-solvers-my-laplacian{e}"))
    );
    let table = content(&folder.path().join("out/compare-solvers-my-laplacian.md"));
    let table = text(&table);
    assert!(table.contains("All methods on my laplacian") && table.contains("units of P") && !table.contains("mesh"));

    let output = run(SWEEP, &system, [".", "--omega", "0.1:0.3:0.1", "--method", "pia", "--json", "--out", "o"]);
    assert_done(&output, "sweep");
    let c = (PI / (k as f64 + 1.0)).cos();
    let found = json(&output);
    let critical = found["critical_omega"]["pia"].as_f64().unwrap();
    assert!((critical * (4.0 + 4.0 * c) / 2.0 - 1.0).abs() < 1e-8, "{critical}");
    let status: Vec<&str> = found["rows"].as_array().unwrap().iter().map(|r| r["status"].as_str().unwrap()).collect();
    assert_eq!(status, ["converged", "converged", "diverged"]);
    assert_eq!(found["best"]["pia"], 0.2);
    assert!(below(&system.join("o")).contains(&"sweep-omega-my-laplacian.png".to_owned()));
}

/// Names of methods have the ends of the spectrum in them, and stand in legends.
#[test]
fn entries_of_any_size_leave_room_for_the_figure() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("d")).unwrap();
    let of = |name: &str, text: &str| fs::write(folder.path().join("d").join(name), text).unwrap();
    of("P.mtx", "%%MatrixMarket matrix array real general\n3 1\n1\n2\n3\n");
    for large in ["1e300", "1e-300"] {
        of("M.mtx", &format!("%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 2\n2 2 2\n3 3 {large}\n"));
        let output = run(COMPARE, folder.path(), ["d", "--method", "chebyshev,jacobi,pia", "--json", "--quiet"]);
        assert_done(&output, large);
        for row in json(&output)["rows"].as_array().unwrap() {
            assert!(row["parameter"].as_str().unwrap().len() < 60, "{row}");
        }
    }
}

#[test]
fn a_folder_holds_the_files_of_one_system() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("ring"), "0 1 10\n1 2 10\n2 3 10\n3 4 10\n4 5 10\n5 0 10\n").unwrap();
    let assemble = |more: &[&str]| run(ASSEMBLE, folder.path(), [&["torus:8x6", "--quiet"], more].concat());
    let plain = |out| vec!["--out", out];
    let creased = |out| vec!["--creases", "ring", "--out", out];
    for (first, second, stale) in [(plain("d"), creased("d"), "d/M.mtx"), (creased("e"), plain("e"), "e/smooth/A.mtx")]
    {
        assert_done(&assemble(&first), stale);
        let before = fs::read(folder.path().join(stale)).unwrap();
        let error = assert_refused(&assemble(&second), stale);
        assert!(error.starts_with(&format!("error: {stale}: it is of another system")), "{error}");
        assert!(fs::read(folder.path().join(stale)).unwrap() == before, "{stale}");
        assert_done(&assemble(&first), "the same again");
    }
}

#[test]
fn spectra_are_those_of_the_mesh_and_of_the_formula() {
    let folder = tempdir().unwrap();
    let spectrum = |arguments: &[&str]| {
        let output =
            run(SPECTRUM, folder.path(), [arguments, &["--json", "--quiet", "--certify", "--modes", "2"]].concat());
        assert_done(&output, &arguments.join(" "));
        json(&output)
    };
    let mesh = ["prism:7", "--noise", "0.1"];
    assert_done(&run(ASSEMBLE, folder.path(), [&mesh[..], &["--out", "d", "--quiet"]].concat()), "assemble");
    let (by_mesh, by_files) = (spectrum(&mesh), spectrum(&["d"]));
    let near = |a: &Value, b: &Value| (a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-9;
    for field in ["lambda_min", "lambda_max", "jacobi_lambda_min", "jacobi_lambda_max", "critical_omega_jacobi"] {
        assert!(near(&by_mesh[field], &by_files[field]), "{field}");
    }
    for method in ["pia", "gauss-seidel", "sor", "ssor", "cg"] {
        assert!(near(&by_mesh["rho"][method], &by_files["rho"][method]), "{method}");
    }
    assert_eq!((&by_files["singular"], &by_files["kernel_dimension"]), (&object!(false), &object!(0)));
    assert_eq!((&by_files["system"], &by_files["vertices"]), (&object!("d"), &by_mesh["vertices"]));

    let k = 26;
    write_laplacian(&folder.path().join("l"), k);
    let c = (PI / (k as f64 + 1.0)).cos();
    let found = spectrum(&["l"]);
    for (field, exact) in [("lambda_min", 4.0 - 4.0 * c), ("lambda_max", 4.0 + 4.0 * c)] {
        assert!((found[field].as_f64().unwrap() / exact - 1.0).abs() < 1e-8, "{field}");
    }
    assert_eq!(found["kernel_dimension"], 0);
    let table = fs::read_to_string(folder.path().join("out/spectrum-l.md")).unwrap();
    assert!(table.contains("positive definite") && table.contains("the entries (Gershgorin)"), "{table}");

    // Two paths with free ends: constants on each are in the kernel; and an indefinite pair.
    let m = "%%MatrixMarket matrix coordinate real symmetric\n5 5 8\n1 1 1\n2 1 -1\n2 2 2\n3 2 -1\n3 3 1\n4 4 1\n5 4 -1\n5 5 1\n";
    fs::write(folder.path().join("l/M.mtx"), m).unwrap();
    let p = "%%MatrixMarket matrix array real general\n5 1\n1\n2\n3\n4\n5\n";
    fs::write(folder.path().join("l/P.mtx"), p).unwrap();
    let found = json(&run(SPECTRUM, folder.path(), ["l", "--json"]));
    assert_eq!((&found["singular"], &found["kernel_dimension"]), (&object!(true), &object!(2)));
    fs::write(folder.path().join("l/M.mtx"), m.replace("5 4 -1", "5 4 -2")).unwrap();
    let found = json(&run(SPECTRUM, folder.path(), ["l", "--json"]));
    assert!(found["lambda_min"].as_f64().unwrap() < -0.9, "{found}");
    assert_eq!(found["singular"], false);
    let table = fs::read_to_string(folder.path().join("out/spectrum-l.md")).unwrap();
    assert!(table.contains("**indefinite**"), "{table}");
}

#[test]
fn folders_that_hold_no_system_and_flags_that_need_a_mesh_are_refused() {
    let folder = tempdir().unwrap();
    write_laplacian(&folder.path().join("d"), 3);
    fs::create_dir(folder.path().join("empty")).unwrap();
    let line = assert_refused(&run_on(SPECTRUM, folder.path(), "d", &["--noise", "0.1"]), "spectrum");
    assert!(line.contains("d: --noise is about a mesh"), "{line}");
    for program in [COMPARE, SWEEP] {
        for (more, what) in [
            (&["--noise", "0.1"][..], "--noise is about a mesh"),
            (&["--scheme", "loop"], "--scheme is about a mesh"),
            (&["--boundary", "as-interior"], "--boundary is about a mesh"),
            (&["--order", "rcm"], "the order rcm goes by a mesh"),
            (&["--defects"], "a mesh is needed"),
        ] {
            let line = assert_refused(&run_on(program, folder.path(), "d", more), what);
            assert!(line.contains("d: ") && line.contains(what), "{line}");
        }
        let line = assert_refused(&run_on(program, folder.path(), "empty", &[]), "empty");
        assert!(line.contains("empty: it is a folder, and a mesh is needed"), "{line}");
    }
    for program in [INTERPOLATE, ASSEMBLE] {
        let line = assert_refused(&run_on(program, folder.path(), "d", &[]), program);
        assert!(line.contains("d: it is a folder, and a mesh is needed"), "{line}");
    }
    // A right-hand side of ones has no extent; a number says what is wanted.
    let ones = format!("%%MatrixMarket matrix array real general\n9 1\n{}", "1\n".repeat(9));
    fs::write(folder.path().join("d/P.mtx"), ones).unwrap();
    let line = assert_refused(&run_on(COMPARE, folder.path(), "d", &[]), "ones");
    assert!(line.contains("--tol-absolute"), "{line}");
    assert_done(&run_on(COMPARE, folder.path(), "d", &["--tol-absolute", "1e-9"]), "ones");
    // Errors name the file and the line.
    let m = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 x\n2 2 1\n";
    fs::write(folder.path().join("d/M.mtx"), m).unwrap();
    let line = assert_refused(&run_on(COMPARE, folder.path(), "d", &[]), "damaged");
    assert!(line.contains("M.mtx, line 4: \"x\" is not entry 2 of 3"), "{line}");
    let m = "%%MatrixMarket matrix array real general\n2 2\n1\n0.5\n0.25\n1\n";
    fs::write(folder.path().join("d/M.mtx"), m).unwrap();
    fs::write(folder.path().join("d/P.mtx"), "%%MatrixMarket matrix array real general\n2 1\n1\n2\n").unwrap();
    let line = assert_refused(&run_on(COMPARE, folder.path(), "d", &[]), "not symmetric");
    assert!(line.contains("d: M is not symmetric: entry (0, 1) is 0.25"), "{line}");
    // Indefinite: rows with their outcomes, and none that is wrong.
    let m = "%%MatrixMarket matrix array real general\n2 2\n1\n3\n3\n1\n";
    fs::write(folder.path().join("d/M.mtx"), m).unwrap();
    let output = run(COMPARE, folder.path(), ["d", "--json", "--quiet"]);
    assert_done(&output, "indefinite");
    for row in json(&output)["rows"].as_array().unwrap() {
        let converged = row["status"] == "converged";
        assert!(!converged || row["max_error"].as_f64().unwrap() < 1e-9, "{row}");
        assert!(
            !converged
                || ["lu", "ldlt", "cg", "pcg-jacobi", "anderson", "auto"].contains(&row["method"].as_str().unwrap()),
            "{row}"
        );
    }
}
