//! Histories of errors and monitors: the same numbers in JSON, in CSV and on standard error, of every program that iterates,
//! with no effect on what is computed.

use tempfile::tempdir;

use super::*;

/// The entries of a history as the monitor says them.
fn lines(of: &str, history: &Value) -> Vec<String> {
    lines_of("error", of, history)
}

/// As [`lines`], where the iterates are measured by another quantity.
fn lines_of(quantity: &str, of: &str, history: &Value) -> Vec<String> {
    let line = |entry: &Value| {
        let [max, mean] = ["max", "mean"].map(|what| entry[format!("{what}_{quantity}")].as_f64().unwrap());
        format!("{of}: iteration {}: max {quantity} {max:.6e}, mean {quantity} {mean:.6e}", entry["iteration"])
    };
    history.as_array().unwrap().iter().map(line).collect()
}

/// An object without what a clock measures, and without what made it.
fn without_seconds(mut value: Value) -> Value {
    match &mut value {
        Value::Object(fields) => {
            for name in ["seconds", "command", "options", "provenance", "replaced"] {
                fields.remove(name);
            }
            fields.values_mut().for_each(|field| *field = without_seconds(field.take()));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| *item = without_seconds(item.take())),
        _ => {}
    }
    value
}

/// Runs a program with and without a monitor: its object, the same both times, and the lines.
fn monitored(program: &str, folder: &Path, arguments: &[&str]) -> (Value, Vec<String>) {
    let with = |flags: &[&str]| {
        let output = run(program, folder, arguments.iter().chain(&["--json", "--quiet"]).chain(flags));
        assert_done(&output, &arguments.join(" "));
        (without_seconds(json(&output)), text(&output.stderr).lines().map(str::to_owned).collect::<Vec<_>>())
    };
    let (plain, nothing) = with(&[]);
    assert!(nothing.is_empty(), "{nothing:?}");
    let (object, lines) = with(&["--monitor"]);
    assert_eq!(object, plain, "{arguments:?}");
    (object, lines)
}

#[test]
fn monitors_say_the_histories_and_change_nothing() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("crease"), "0 1 10\n").unwrap();
    for (arguments, method) in [
        ("torus:8x6 --noise 0.1", "chebyshev"),
        ("torus:8x6 --noise 0.1 --vertices 0..20", "chebyshev"),
        ("torus:8x6 --noise 0.1 --creases crease", "chebyshev"),
        ("torus:8x6 --noise 0.1 --method pcg-ic0", "pcg-ic0"),
        ("torus:8x6 --noise 0.1 --method sor --order multicolour", "sor"),
        ("torus:8x6 --noise 0.1 --method two-phase", "two-phase"),
    ] {
        let mut all: Vec<&str> = arguments.split(' ').collect();
        all.extend(["-o", "a.obj"]);
        let (object, seen) = monitored(INTERPOLATE, folder, &all);
        let history = &object["history"];
        assert_eq!(seen, lines(&format!("torus:8x6: {method}"), history), "{arguments}");
        let last = history.as_array().unwrap().last().unwrap();
        assert_eq!(last["iteration"], object["iterations"], "{arguments}");
        // Of some vertices the program measures what it writes; the run, the difference from the points, which is smaller.
        let least = if arguments.contains("--vertices") { 8.0 * f64::EPSILON } else { 0.0 };
        for field in ["max_error", "mean_error"] {
            let [seen, written] = [last, &object].map(|of| of[field].as_f64().unwrap());
            assert!((seen - written).abs() <= least, "{arguments}: {seen}, {written}");
        }
    }
    let arguments = ["torus:8x6", "--noise", "0.1", "--method", "halstead", "-o", "a.obj"];
    let (object, seen) = monitored(INTERPOLATE, folder, &arguments);
    let history = object["history"].as_array().unwrap();
    assert_eq!(seen, lines_of("step", "torus:8x6: halstead", &object["history"]));
    assert_eq!(history.len() as u64, object["iterations"].as_u64().unwrap() + 1);
    let [last, tolerance] =
        [&history[history.len() - 1]["max_step"], &object["tolerance"]].map(|x| x.as_f64().unwrap());
    assert!(history.len() > 10 && last <= tolerance, "{last} {tolerance}");
    let arguments = ["torus:8x6", "--noise", "0.1", "--method", "jacobi,lu,auto"];
    let (object, seen) = monitored(COMPARE, folder, &arguments);
    let label = |row: &Value| {
        let [method, parameter] = ["method", "parameter"].map(|field| row[field].as_str().unwrap());
        lines(&format!("torus:8x6: {method} ({parameter})"), &row["history"])
    };
    let expected: Vec<String> = object["rows"].as_array().unwrap().iter().flat_map(label).collect();
    assert_eq!(seen, expected);
    // Rows are swept on all threads at once.
    let arguments =
        ["torus:8x6", "--noise", "0.1", "--method", "pia,sor", "--omega", "0.5:1:0.5", "--history", "0.5,1"];
    let (object, mut seen) = monitored(SWEEP, folder, &arguments);
    let label = |row: &Value| {
        let (method, omega) = (row["method"].as_str().unwrap(), row["omega"].as_f64().unwrap());
        lines(&format!("torus:8x6: {method} (ω={omega})"), &row["history"])
    };
    let mut expected: Vec<String> = object["rows"].as_array().unwrap().iter().flat_map(label).collect();
    seen.sort();
    expected.sort();
    assert_eq!(seen, expected);
}

#[test]
fn a_method_that_is_named_twice_runs_once() {
    let folder = tempdir().unwrap();
    for (program, more) in [(COMPARE, &[][..]), (SWEEP, &["--omega", "1:1:1", "--history", "1"])] {
        let arguments = [&["torus:8x6", "--method", "pia,PIA,pia", "--json", "--quiet"], more].concat();
        let object = json(&run(program, folder.path(), arguments));
        let [row] = &object["rows"].as_array().unwrap()[..] else { panic!("{program}: {object}") };
        let iterations = row["history"].as_array().unwrap().iter().map(|entry| entry["iteration"].as_u64().unwrap());
        assert!(iterations.eq(0..=row["iterations"].as_u64().unwrap()), "{program}: {row}");
    }
}

#[test]
fn three_programs_tell_one_history() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    let with = |program: &str, more: &[&str]| {
        let arguments = ["torus:8x6", "--noise", "0.1", "--method", "pia", "--tol", "1e-6", "--json", "--quiet"];
        let output = run(program, folder, arguments.iter().chain(more));
        assert_done(&output, program);
        json(&output)
    };
    let interpolated = with(INTERPOLATE, &["-o", "a.obj"]);
    let compared = with(COMPARE, &[]);
    // This ω joins the others.
    let swept = with(SWEEP, &["--omega", "0.5:0.9:0.2", "--history", "1"]);
    let rows = swept["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["omega"].as_f64().unwrap()).collect::<Vec<_>>(), [0.5, 0.7, 0.9, 1.0]);
    assert!(rows[..3].iter().all(|row| row.get("history").is_none()));
    let history = interpolated["history"].as_array().unwrap();
    assert_eq!(history.len() as u64, interpolated["iterations"].as_u64().unwrap() + 1);
    for (k, entry) in history.iter().enumerate() {
        assert_eq!(entry["iteration"], k);
    }
    assert_eq!(&interpolated["history"], &compared["rows"][0]["history"]);
    assert_eq!(&interpolated["history"], &rows[3]["history"]);
    for (name, key) in [("compare-solvers", "ω=1"), ("sweep-omega", "1")] {
        let path = folder.join(format!("out/{name}-torus-8x6-catmull-clark-history.csv"));
        let mut reader = csv(&path);
        let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.unwrap()).collect();
        assert_eq!(rows.len(), history.len(), "{name}");
        for (row, entry) in rows.iter().zip(history) {
            assert_eq!((&row[0], &row[1]), ("pia", key));
            assert_eq!(row[2], entry["iteration"].to_string());
            for (column, field) in [(3, "max_error"), (4, "mean_error")] {
                let (written, told) = (row[column].parse::<f64>().unwrap(), entry[field].as_f64().unwrap());
                assert!((written - told).abs() <= 1e-9 * told, "{name}: {written:e} is {told:e}");
            }
        }
    }
}

/// The frame that doubles are good in does not show.
#[test]
fn histories_are_in_the_units_of_the_file() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    let cube = |unit: f64| {
        let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { unit } else { -unit });
        let vertex = |k: usize| corner(k).map(|x| format!("{x:e}")).join(" ");
        let points: Vec<String> = (0..8).map(vertex).collect();
        let faces = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
        fs::write(folder.join("m.off"), format!("OFF\n8 6 0\n{}\n{faces}", points.join("\n"))).unwrap();
    };
    for (program, more) in [
        (INTERPOLATE, vec!["-o", "a.obj"]),
        (COMPARE, vec!["--method", "pia"]),
        (SWEEP, vec!["--method", "pia", "--omega", "1:1:1", "--history", "1"]),
    ] {
        let histories = [1.0, 1e-200].map(|unit| {
            cube(unit);
            let arguments = ["m.off", "--scheme", "nasri"].into_iter().chain(more.iter().copied());
            let (object, seen) = monitored(program, folder, &arguments.collect::<Vec<_>>());
            let history = if program == INTERPOLATE { &object["history"] } else { &object["rows"][0]["history"] };
            let of = seen[0].split(": iteration").next().unwrap().to_owned();
            assert_eq!(seen, lines(&of, history));
            history[0]["max_error"].as_f64().unwrap() / unit
        });
        assert!((histories[0] - histories[1]).abs() < 1e-9 * histories[0], "{program}: {histories:?}");
    }
}

#[test]
fn a_sweep_ends_with_its_best_line() {
    let folder = tempdir().unwrap();
    let arguments = ["torus:32x32", "--noise", "0.1", "--omega", "0.5:0.9:0.1", "--method", "jacobi,sor", "--quiet"];
    let output = run(SWEEP, folder.path(), arguments);
    assert_done(&output, "sweep-omega");
    let lines: Vec<&str> = text(&output.stdout).lines().collect();
    // Regular quads: D⁻¹A lies between 1/4 and 9/4, and 2/(1/4 + 9/4) = 0.8 is the best ω, with ρ = 0.8.
    let [.., jacobi, sor] = lines[..] else { panic!("two lines") };
    assert!(jacobi.starts_with("jacobi: best ω = 0.8 with "), "{jacobi}");
    assert!(jacobi.ends_with("predicted ρ = 0.8000; predicted best ω = 0.8000 with ρ = 0.8000"), "{jacobi}");
    assert!(sor.starts_with("sor: best ω = 0.9 with ") && !sor.contains("predicted best"), "{sor}");
}
