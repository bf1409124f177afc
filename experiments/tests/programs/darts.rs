//! Programs on meshes with darts and semi-sharp vertices, where no diagonal makes the matrix symmetric.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use super::{COMPARE, INTERPOLATE, SPECTRUM, SWEEP, assert_done, assert_no_files, assert_refused, json, run, text};

const NONE: [&str; 8] = ["cholesky", "ldlt", "chebyshev", "cg", "pcg-jacobi", "pcg-ssor", "pcg-ic0", "heavy-ball"];

/// A folder with tags: two darts and a semi-sharp edge on a torus, and one sharp edge on a cube.
fn folder() -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("torus.txt"), "0 1 10\n12 13 1.5\n").unwrap();
    fs::write(folder.path().join("cube.txt"), "0 1 10\n").unwrap();
    folder
}

fn on_torus<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["torus:6x6", "--noise", "0.1", "--creases", "torus.txt", "--quiet"][..], more].concat()
}

fn cage(folder: &Path, method: &str) -> (Value, String) {
    let output = run(INTERPOLATE, folder, on_torus(&["--method", method, "-o", "cage.obj", "--json"]));
    assert_done(&output, method);
    (json(&output), fs::read_to_string(folder.join("cage.obj")).unwrap())
}

#[test]
fn cages_are_found_by_every_method_that_needs_no_symmetry() {
    let folder = folder();
    let points = |text: &str| -> Vec<f64> {
        let lines = text.lines().filter_map(|line| line.strip_prefix("v "));
        lines.flat_map(|line| line.split(' ').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>()).collect()
    };
    let (_, auto) = cage(folder.path(), "auto");
    for method in ["lu", "jacobi", "thall", "gauss-seidel", "sor", "ssor", "pia", "w-pia", "anderson"] {
        let (found, text) = cage(folder.path(), method);
        assert_eq!(found["method"], method);
        assert_eq!((&found["darts"], &found["semi_sharp"]), (&2.into(), &2.into()));
        let (a, b) = (points(&auto), points(&text));
        assert_eq!(a.len(), 108);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-7), "{method}");
    }
    fs::remove_file(folder.path().join("cage.obj")).unwrap();
    for method in NONE {
        let output = run(INTERPOLATE, folder.path(), on_torus(&["--method", method, "-o", "cage.obj"]));
        let line = assert_refused(&output, method);
        assert!(line.contains(&format!("as {method} needs it; use auto, lu, jacobi, ")), "{line}");
        assert!(!folder.path().join("cage.obj").exists());
    }
}

#[test]
fn comparisons_leave_out_what_needs_symmetry_and_say_so() {
    let folder = folder();
    let loud: Vec<&str> = on_torus(&["--json", "--out", "result"]).into_iter().filter(|&a| a != "--quiet").collect();
    let output = run(COMPARE, folder.path(), loud);
    assert_done(&output, "all");
    let remarks = text(&output.stderr);
    let told = format!(
        "vertex 0 is a dart or semi-sharp, and no diagonal makes the matrix symmetric: left out {}",
        NONE.join(", ")
    );
    assert_eq!(remarks.matches(&told).count(), 1, "{remarks}");
    let object = json(&output);
    let rows = object["rows"].as_array().unwrap();
    let found = |method: &str| rows.iter().filter(|r| r["method"] == method).collect::<Vec<_>>();
    for method in ["auto", "lu", "jacobi", "thall", "gauss-seidel", "sor", "ssor", "pia", "w-pia", "anderson"] {
        assert!(!found(method).is_empty(), "{method}");
        for row in found(method) {
            assert_eq!(row["status"], "converged", "{row}");
            let predicted = row["predicted_rate"].as_f64();
            assert_eq!(predicted.is_some(), !["auto", "lu", "anderson"].contains(&method), "{row}");
            if let (Some(predicted), Some(observed)) = (predicted, row["observed_rate"].as_f64()) {
                assert!((predicted - observed).abs() < 0.03, "{row}");
            }
        }
    }
    assert!(NONE.iter().all(|method| found(method).is_empty()));
    // If nothing is left, that is refused.
    let output = run(COMPARE, folder.path(), on_torus(&["--method", "cg,cholesky", "--out", "other"]));
    assert!(assert_refused(&output, "cg").contains("as cg needs it"));
    assert_no_files(&folder.path().join("other"), "refused");
}

#[test]
fn sweeps_over_omega_know_their_thresholds() {
    let folder = folder();
    let output = run(SWEEP, folder.path(), on_torus(&["--json", "--out", "result", "--omega", "0.4:1.6:0.4"]));
    assert_done(&output, "sweep");
    let object = json(&output);
    let critical = |method: &str| object["critical_omega"][method].as_f64().unwrap();
    // A has the eigenvalue 1 and no other of that modulus.
    assert!((critical("pia") - 2.0).abs() < 1e-9 && critical("jacobi") < 1.2);
    for row in object["rows"].as_array().unwrap() {
        let rho = row["predicted_rho"].as_f64().unwrap();
        let status = if rho < 1.0 { "converged" } else { "diverged" };
        assert_eq!(row["status"], status, "{row}");
    }
}

#[test]
fn spectra_have_imaginary_parts_and_no_bounds() {
    let folder = folder();
    // The largest imaginary part that hill climbing finds on this torus.
    let edges = [[1, 2], [1, 4], [2, 0], [3, 6], [4, 7], [6, 0]];
    fs::write(folder.path().join("small.txt"), edges.map(|[a, b]| format!("{a} {b} 10\n")).concat()).unwrap();
    let small = ["torus:3x3", "--creases", "small.txt", "--json", "--out", "result", "--full", "--quiet"];
    let output = run(SPECTRUM, folder.path(), small);
    assert_done(&output, "spectrum");
    let found = json(&output);
    let number = |field: &str| found[field].as_f64().unwrap();
    let eigenvalues = found["eigenvalues"]["a"].as_array().unwrap();
    assert_eq!(eigenvalues.len(), 9);
    let parts = |k: usize| eigenvalues.iter().map(move |z| z[k].as_f64().unwrap());
    assert_eq!(number("lambda_min"), parts(0).fold(f64::INFINITY, f64::min));
    assert_eq!(number("imaginary_max"), parts(1).fold(0.0, |m, x| x.abs().max(m)));
    assert!((number("imaginary_max") - 0.0737).abs() < 5e-5 && (number("lambda_max") - 1.0).abs() < 1e-12);
    let radius = eigenvalues.iter().map(|z| (1.0 - z[0].as_f64().unwrap()).hypot(z[1].as_f64().unwrap()));
    assert!((found["rho"]["pia"].as_f64().unwrap() - radius.fold(0.0, f64::max)).abs() < 1e-14);
    assert!(found["rho"]["gauss-seidel"].as_f64().unwrap() < found["rho"]["pia"].as_f64().unwrap());
    assert!(found["lambda_min_bound"].is_null() && found["singular"] == false);
    let table = fs::read_to_string(folder.path().join("result/spectrum-torus-3x3-catmull-clark.md")).unwrap();
    assert!(table.contains("2 darts and 0 semi-sharp ones") && table.contains("is left out: bounds"), "{table}");
    assert!(folder.path().join("result/spectrum-eigenvalues-torus-3x3-catmull-clark.png").exists());
    // Darts alone do not cure a cube.
    let cube = ["cube", "--creases", "cube.txt", "--json", "--out", "result", "--quiet"];
    let output = run(SPECTRUM, folder.path(), cube);
    assert_done(&output, "cube");
    assert_eq!((&json(&output)["singular"], &json(&output)["kernel_dimension"]), (&true.into(), &1.into()));
    // What is too large is refused with the number.
    let large = ["torus:50x50", "--creases", "torus.txt", "--out", "other", "--quiet"];
    fs::write(folder.path().join("torus.txt"), "0 1 10\n").unwrap();
    let line = assert_refused(&run(SPECTRUM, folder.path(), large), "large");
    assert!(line.contains("2500 vertices") && line.contains("up to 2000"), "{line}");
}
