//! The program `spectrum`: the fields of its JSON, its files, its limits.

#[test]
fn the_program_prints_the_agreed_fields() {
    let out = tempfile::tempdir().expect("a folder");
    let spectrum = |arguments: &[&str]| {
        assert_cmd::Command::new(env!("CARGO_BIN_EXE_spectrum"))
            .args(arguments)
            .args(["--json", "--quiet", "--out"])
            .arg(out.path())
            .output()
            .expect("the program runs")
    };
    let done = spectrum(&["torus:10x8", "--full", "--certify", "--modes", "3"]);
    assert!(done.status.success());
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).expect("one JSON object");
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
