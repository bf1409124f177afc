//! The program's contract: JSON, files, exit statuses.

use assert_cmd::Command;
use serde_json::Value;

fn splitting(arguments: &[&str], out: &std::path::Path) -> std::process::Output {
    let mut command = Command::cargo_bin("splitting").unwrap();
    command.args(arguments).arg("--out").arg(out).output().unwrap()
}

fn json(arguments: &[&str], out: &std::path::Path) -> Value {
    let output = splitting(arguments, out);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn json_has_the_fields_that_others_rely_on() {
    let out = tempfile::tempdir().unwrap();
    let object = json(&["--valence", "3..5", "--json"], out.path());
    let rows = object["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    assert_eq!(rows[1]["valence"], 4);
    assert_eq!(rows[1]["eigenvalues"].as_array().unwrap().len(), 9);
    let mask: Vec<f64> = rows[1]["limit_mask"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!((mask[0] - 4.0 / 9.0).abs() < 1e-12 && (mask.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!((rows[1]["lambda_subdominant_formula"].as_f64().unwrap() - 0.5).abs() < 1e-15);
    assert_eq!(rows[1]["positions"][0], "v");
    assert_eq!(rows[1]["positions"][5], "0:1,1");
    for file in ["", "-eigenvalues", "-masks"] {
        for ending in ["csv", "md"] {
            let path = out.path().join(format!("splitting-catmull-clark{file}.{ending}"));
            assert!(path.exists(), "{}", path.display());
        }
    }
    for file in ["splitting-catmull-clark-maps.png", "splitting-thall.csv", "splitting-thall-normals.md"] {
        assert!(out.path().join(file).exists(), "{file}");
    }
}

#[test]
fn sqrt3_reports_the_condition() {
    let out = tempfile::tempdir().unwrap();
    let object = json(&["--scheme", "sqrt3", "--alpha", "1", "--valence", "3..4", "--json"], out.path());
    assert_eq!(object["alpha"], 1.0);
    assert_eq!(object["rows"][0]["pair_leads"], false);
    assert_eq!(object["rows"][1]["pair_leads"], true);
    assert!(object["rows"][1]["lambda_subdominant_formula"].is_null());
    let alpha = object["condition"][1]["crossings"][0]["alpha"].as_f64().unwrap();
    assert!((alpha - 1.7156).abs() < 1e-4);
    assert!(out.path().join("splitting-sqrt3-condition.png").exists());
}

#[test]
fn bad_arguments_end_with_2_and_say_the_range() {
    let out = tempfile::tempdir().unwrap();
    for valence in ["2", "0", "0..5", "3..1000000000", "1000000000", "7..3", "x", "3..", "-1"] {
        let output = splitting(&[&format!("--valence={valence}")], out.path());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{valence}: {message}");
        assert!(message.contains("3..100") || valence == "7..3", "{valence}: {message}");
    }
    for arguments in [
        &["--scheme", "butterfly"][..],
        &["--scheme", "loop", "--alpha", "1"],
        &["--scheme", "sqrt3", "--alpha", "2.5"],
        &["--scheme", "sqrt3", "--alpha", "nan"],
    ] {
        assert_eq!(splitting(arguments, out.path()).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_folder_that_cannot_be_made_ends_with_1() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("taken");
    std::fs::write(&file, "").unwrap();
    let output = splitting(&["--valence", "3"], &file);
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.starts_with("error: ") && message.trim_end().lines().count() == 1, "{message}");
}

#[test]
fn vertices_that_are_not_smooth_have_their_own_tables() {
    let out = tempfile::tempdir().unwrap();
    for (at, valence, size) in [("boundary", "1..3", 4), ("crease", "4", 9), ("corner", "1", 4), ("dart", "3", 7)] {
        let object = json(&["--at", at, "--valence", valence, "--json"], out.path());
        assert_eq!(object["at"], at);
        let row = &object["rows"][0];
        assert_eq!(row["eigenvalues"].as_array().unwrap().len(), size, "{at}");
        let mask: Vec<f64> = row["limit_mask"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert!((mask.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{at}: {mask:?}");
        for file in ["", "-eigenvalues", "-masks"] {
            let path = out.path().join(format!("splitting-catmull-clark-{at}{file}.csv"));
            assert!(path.exists(), "{}", path.display());
        }
    }
    let object = json(&["--at", "boundary", "--scheme", "loop", "--valence", "5..6", "--json"], out.path());
    let planes: Vec<&Value> = (0..2).map(|k| &object["rows"][k]["sectors"][0]["tangent_plane"]).collect();
    assert_eq!(planes, [&Value::from(true), &Value::from(false)]);
    for (arguments, told) in [
        (&["--at", "edge"][..], "smooth, boundary, crease, corner or dart"),
        (&["--at", "dart", "--valence", "1..3"], "3..100"),
        (&["--at", "corner", "--valence", "0"], "1..100"),
        (
            &["--at", "dart", "--scheme", "sqrt3"],
            "sqrt3 has no local matrix at a dart vertex: choose catmull-clark or loop",
        ),
    ] {
        let output = splitting(arguments, out.path());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(message.contains(told), "{message}");
    }
}
