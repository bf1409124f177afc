//! The program `spectrum`: the fields of its JSON, its files, its limits.

use std::path::Path;
use std::process::Output;

const SPECTRUM: &str = env!("CARGO_BIN_EXE_spectrum");

/// With its files in `out`.
fn run(program: &str, arguments: &[&str], out: &Path) -> Output {
    let mut command = assert_cmd::Command::new(program);
    command.args(arguments).args(["--json", "--quiet", "--out"]).arg(out).output().expect("the program runs")
}

/// What a program says that succeeds.
fn object(done: &Output) -> serde_json::Value {
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).expect("one JSON object")
}

#[test]
fn the_program_prints_the_agreed_fields() {
    let out = tempfile::tempdir().expect("a folder");
    let spectrum = |arguments: &[&str]| run(SPECTRUM, arguments, out.path());
    let done = spectrum(&["torus:10x8", "--full", "--certify", "--modes", "3"]);
    let json = object(&done);
    let close = |field: &serde_json::Value, expected: f64| {
        let value = field.as_f64().expect("a number");
        assert!((value - expected).abs() < 1e-9, "{value} {expected}");
    };
    close(&json["lambda_min"], 1.0 / 9.0);
    close(&json["lambda_max"], 1.0);
    close(&json["lambda_min_bound"], 1.0 / 9.0);
    close(&json["jacobi_lambda_min"], 0.25);
    close(&json["jacobi_lambda_max"], 2.25);
    close(&json["rho"]["pia"], 8.0 / 9.0);
    close(&json["rho"]["thall"], 7.0 / 8.0);
    close(&json["rho"]["jacobi_optimal"], 0.8);
    close(&json["optimal_omega"]["w-pia"], 1.8);
    close(&json["optimal_omega"]["jacobi"], 0.8);
    close(&json["critical_omega_jacobi"], 8.0 / 9.0);
    for (field, exact) in
        [("lambda_min", 1.0 / 9.0), ("lambda_max", 1.0), ("jacobi_lambda_min", 0.25), ("jacobi_lambda_max", 2.25)]
    {
        let [bound, attained] = ["certified", "attained"].map(|side| json[side][field].as_f64().expect("a number"));
        let (low, high) = if field.ends_with("min") { (bound, attained) } else { (attained, bound) };
        assert!(low < exact + 1e-15 && exact - 1e-15 < high && high - low < 1e-7, "{field}: {low} {high}");
    }
    for (method, exact) in [("pia", 8.0 / 9.0), ("thall", 7.0 / 8.0), ("cg", 0.5), ("pcg-jacobi", 0.5)] {
        let proven = json["certified_rho"][method].as_f64().expect("a number");
        assert!(exact < proven && proven < exact + 1e-7, "{method}: {proven}");
    }
    assert_eq!(json["certified_rho"]["gauss-seidel"], serde_json::Value::Null);
    assert_eq!(json["singular"], false);
    assert_eq!(json["kernel_dimension"], 0);
    assert_eq!(json["eigenvalues"]["a"].as_array().map(Vec::len), Some(80));
    assert!(out.path().join("spectrum-histogram-torus-10x8-catmull-clark.png").is_file());

    let done = spectrum(&["cube"]);
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).expect("one JSON object");
    assert_eq!((&json["singular"], &json["kernel_dimension"]), (&true.into(), &1.into()));

    let refused = spectrum(&["torus:70x70", "--full"]);
    assert_eq!(refused.status.code(), Some(1));
    let message = String::from_utf8_lossy(&refused.stderr);
    assert!(message.starts_with("error: torus:70x70") && message.lines().count() == 1);
}

/// Iteration matrices: radii by closed forms, contractions, files; what has none, and what is too large for all of it.
#[test]
fn iteration_matrices_have_their_eigenvalues_norms_and_pictures() {
    let out = tempfile::tempdir().expect("a folder");
    let spectrum = |arguments: &[&str]| run(SPECTRUM, arguments, out.path());
    let methods = "pia,jacobi,sor:1.2,ssor:1.2,w-pia:0.5";
    let done = spectrum(&["torus:6x4", "--iteration-matrix", methods, "--order", "multicolour", "--pseudospectra"]);
    let json = object(&done);
    let found = |k: usize, field: &str| json["iteration_matrices"][k][field].as_f64().expect("a number");
    for (k, expected) in [(0, 8.0 / 9.0), (1, 0.8), (4, 1.0 - 0.5 / 9.0)] {
        assert!((found(k, "rho") - expected).abs() < 1e-9, "{k}: {}", found(k, "rho"));
    }
    // The best ω of Jacobi, as its own is open.
    assert!((found(1, "omega") - 0.8).abs() < 1e-6);
    // ‖T_SOR‖² in the energy norm is ρ of SSOR.
    let norm = json["iteration_matrices"][2]["norms"]["energy"].as_f64().expect("M is definite");
    assert!((norm * norm - found(3, "rho")).abs() < 1e-8 && found(2, "numerical_radius") < norm.max(1.0));
    assert_eq!(json["iteration_matrices"][2]["order"], "multicolour");
    assert_eq!(json["iteration_matrices"][2]["eigenvalues"].as_array().map(Vec::len), Some(24));
    // A pseudospectrum reaches beyond the spectrum.
    let reach = json["iteration_matrices"][2]["pseudospectral_radii"][1]["radius"].as_f64().expect("a number");
    assert!(reach > found(2, "rho") && reach < found(2, "rho") + 0.5, "{reach}");
    for stem in ["", "-powers", "-pseudospectra"] {
        assert!(out.path().join(format!("spectrum-iteration{stem}-torus-6x4-catmull-clark.png")).is_file(), "{stem}");
    }
    assert!(out.path().join("spectrum-iteration-eigenvalues-torus-6x4-catmull-clark.csv").is_file());

    for (arguments, status) in [
        (&["cube", "--iteration-matrix", "cg"][..], 2),
        (&["cube", "--iteration-matrix", "sor:0"], 2),
        (&["cube", "--order", "bfs"], 2),
        (&["torus:50x50", "--iteration-matrix", "pia", "--full"], 1),
        (&["torus:21x21", "--iteration-matrix", "pia", "--pseudospectra"], 1),
    ] {
        let refused = spectrum(arguments);
        assert_eq!(refused.status.code(), Some(status), "{arguments:?}");
    }
}

/// `sweep-omega` with the trajectories of eigenvalues: Jacobi's ends are as large at the best ω; SOR's dominant one leaves the axis.
#[test]
fn eigenvalues_are_followed_over_omega() {
    let out = tempfile::tempdir().expect("a folder");
    let arguments =
        ["torus:6x4", "--noise", "0.1", "--method", "jacobi,sor", "--omega", "0.6:1.4:0.2", "--eigenvalues"];
    let done = run(env!("CARGO_BIN_EXE_sweep-omega"), &arguments, out.path());
    let json = object(&done);
    let jacobi = &json["eigenvalues"][0];
    assert_eq!(jacobi["change"]["how"], "is overtaken by a negative one");
    for field in [&jacobi["change"]["omega"], &jacobi["best_omega"]] {
        assert!(field.as_f64().is_some_and(|omega| (omega - 0.8).abs() < 2e-3), "{field}");
    }
    let sor = &json["eigenvalues"][1];
    assert!(sor["best_omega"].as_f64().is_some_and(|omega| omega > 1.0 && omega < 1.3), "{sor}");
    for end in ["csv", "md", "png"] {
        assert!(out.path().join(format!("sweep-omega-eigenvalues-torus-6x4-catmull-clark.{end}")).is_file(), "{end}");
    }
}
