//! The process around a program: limits of memory, threads and file sizes, signals, streams that are closed or full,
//! targets that cannot be written.

use std::os::unix::process::ExitStatusExt;
use std::process::{Command as Plain, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::tempdir;

use super::*;

/// Runs a line of the shell, with the program as `$0`.
fn shell(folder: &Path, program: &str, line: &str) -> Output {
    Plain::new("bash").current_dir(folder).args(["-c", line, program]).output().unwrap()
}

/// Exit status 0, or 1 with one line `error: …`.
fn assert_done_or_refused(output: &Output, what: &str) {
    let error = text(&output.stderr);
    match output.status.code() {
        Some(0) => {}
        Some(1) => assert!(error.starts_with("error: ") && error.lines().count() == 1, "{what}: {error}"),
        status => panic!("{what}: {status:?}: {error}"),
    }
}

#[test]
fn standard_error_that_cannot_be_written_is_no_failure() {
    let folder = tempdir().unwrap();
    for (line, status) in [
        ("\"$0\" cube -o a.obj --scheme nasri 2>/dev/full", 0),
        ("\"$0\" cube -o a.obj --scheme nasri 2>&-", 0),
        ("\"$0\" no-such -o a.obj 2>/dev/full", 1),
        ("\"$0\" cube --noise 0.1 -o a.obj <&- >&- 2>&-", 1),
        ("\"$0\" cube -o a.obj --scheme nasri <&- >&- 2>&-", 0),
        (
            "{ \"$0\" cube -o a.obj --scheme nasri; echo $? >&3; } 3>&1 2>&1 >/dev/null | (sleep 0.3; head -c 0); true",
            0,
        ),
    ] {
        let output = shell(folder.path(), INTERPOLATE, line);
        assert_eq!(output.status.code(), Some(status), "{line}: {}", text(&output.stderr));
        assert!(!text(&output.stderr).contains("panicked"), "{line}");
    }
}

#[test]
fn sizes_known_before_are_refused_with_the_numbers() {
    let folder = tempdir().unwrap();
    let limited = |kilobytes: usize, program: &str, arguments: &str| {
        let start = Instant::now();
        let line = format!("ulimit -v {kilobytes}; \"$0\" {arguments} --quiet --threads 2");
        let refused = assert_refused(&shell(folder.path(), program, &line), &line);
        assert!(start.elapsed() < Duration::from_secs(60), "{line}");
        refused
    };
    let dense = "prism:5001 --scheme zheng-cai";
    for (program, arguments) in [
        (INTERPOLATE, format!("{dense} --method lu -o a.obj")),
        (ASSEMBLE, format!("{dense} --out out")),
        (COMPARE, format!("{dense} --out out")),
        (SWEEP, format!("{dense} --out out")),
        (SPECTRUM, format!("{dense} --out out")),
    ] {
        let line = limited(800_000, program, &arguments);
        assert!(line.contains("matrix with 500") && line.contains(" MB of memory"), "{line}");
    }
    for (mesh, size) in [("icosphere:2", "32-bit indices"), ("icosahedron", "GB of memory")] {
        let line = limited(800_000, INTERPOLATE, &format!("{mesh} --subdivide 12 -o a.obj"));
        assert!(line.contains("after 12 refinements") && line.contains("faces") && line.contains(size), "{line}");
    }
    for mesh in ["irregular-quad:200000", "bipyramid:4000"] {
        let fair = "--method halstead --scheme catmull-clark -o a.obj";
        let line = limited(800_000, INTERPOLATE, &format!("{mesh} {fair}"));
        assert!(line.contains("the energy of the surface ") && line.contains("B of memory"), "{line}");
    }
    let line = limited(300_000, INTERPOLATE, "torus:1000x5000 -o a.obj");
    assert!(line.contains("20000000 corners") && line.contains("MB of memory"), "{line}");
    // Room for the mesh, and none for what is done with it.
    let line = limited(1_100_000, INTERPOLATE, "torus:1000x5000 -o a.obj");
    assert!(line.contains("the work on 5000000 vertices") && line.contains("MB of memory"), "{line}");
    assert_no_files(folder.path(), "refused");
}

#[test]
fn short_memory_is_one_line_of_error() {
    let folder = tempdir().unwrap();
    for kilobytes in [60_000, 90_000, 120_000, 160_000] {
        for mesh in ["irregular-quad:200000", "irregular-poly:200000"] {
            let line = format!("ulimit -v {kilobytes}; \"$0\" {mesh} -o a.ply --quiet --threads 2");
            assert_done_or_refused(&shell(folder.path(), INTERPOLATE, &line), &line);
        }
    }
}

#[test]
fn threads_are_capped_with_a_remark() {
    let folder = tempdir().unwrap();
    let output = run(INTERPOLATE, folder.path(), ["octahedron", "-o", "a.obj", "--threads", "4000"]);
    assert_done(&output, "4000 threads");
    assert!(text(&output.stderr).contains("as many as there are processors"), "{}", text(&output.stderr));
}

/// A full disk is not at hand everywhere, a limit on the size of files is.
#[test]
fn a_limit_on_file_sizes_is_an_error_of_writing() {
    let folder = tempdir().unwrap();
    let line = "ulimit -f 8; \"$0\" torus:50x50 -o a.obj --quiet";
    let error = assert_refused(&shell(folder.path(), INTERPOLATE, line), line);
    assert!(error.contains("a.obj: cannot write: "), "{error}");
    assert_no_files(folder.path(), "beyond the limit");
}

/// Stops a program that writes as soon as its temporary file is there.
fn stopped(folder: &Path, signal: &str, before: &str) -> Output {
    let line = format!("{before} exec \"$0\" torus:1000x500 -o a.obj --quiet --method pia --tol 1e9");
    let mut command = Plain::new("bash");
    command.current_dir(folder).args(["-c", &line, INTERPOLATE]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let writes = |name: &String| fs::metadata(folder.join(name)).is_ok_and(|f| name.ends_with(".tmp") && f.len() > 0);
    while !below(folder).iter().any(writes) {
        sleep(Duration::from_millis(1));
    }
    assert!(Plain::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

/// Whether this process was told to ignore a signal, as by `nohup cargo test`.
fn is_ignored(signal: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap_or("0");
    u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[test]
fn signals_leave_the_old_file_and_no_temporary_one() {
    for (signal, number) in [("-HUP", 1), ("-INT", 2), ("-TERM", 15)] {
        if is_ignored(number) {
            // Here and in all programs that are started from here, as below.
            continue;
        }
        let folder = tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), "old").unwrap();
        let output = stopped(folder.path(), signal, "");
        assert_eq!(output.status.signal(), Some(number), "{}", text(&output.stderr));
        assert_eq!(below(folder.path()), ["a.obj"], "{signal}");
        assert_eq!(fs::read_to_string(folder.path().join("a.obj")).unwrap(), "old");
        let error = text(&output.stderr);
        assert!(error.starts_with("error: stopped by SIG") && error.contains("no file was written"), "{error}");
    }
    let folder = tempdir().unwrap();
    let output = stopped(folder.path(), "-HUP", "trap '' HUP;");
    assert_done(&output, "nohup");
}

/// Whole rows of a measurement that takes minutes, after Ctrl-C.
#[test]
fn what_was_measured_is_kept_when_scaling_is_stopped() {
    if is_ignored(2) {
        return;
    }
    let folder = tempdir().unwrap();
    let sizes = ["1000"; 500].join(",");
    let arguments =
        ["--sizes", &sizes, "--scheme", "loop", "--runs", "1", "--profile", "0", "--gains", "0", "--steps", "0"];
    let mut command = Plain::new(SCALING);
    command.current_dir(folder.path()).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let rows = || {
        let table = fs::read_to_string(folder.path().join("out/scaling.csv")).unwrap_or_default();
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(table.as_bytes());
        reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect::<Vec<Vec<String>>>()
    };
    while rows().len() < 3 {
        sleep(Duration::from_millis(5));
    }
    let before = rows();
    assert!(Plain::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.signal(), Some(2), "{}", text(&output.stderr));
    let after = rows();
    assert_eq!(after[..before.len()], before);
    assert!(after.iter().all(|row| row.len() == 11 && row[6] == "converged"), "{after:?}");
    // Each row was said when it was there, then which files are complete.
    let said: Vec<&str> = text(&output.stderr).lines().collect();
    let (end, rows) = said.split_last().unwrap();
    assert!(rows.len() >= after.len(), "{said:?}");
    assert!(rows[0].starts_with("loop, irregular-tri:1000, good order, auto: "), "{said:?}");
    assert!(end.starts_with("error: stopped by SIGINT: ") && end.contains(" complete"), "{end}");
    assert!(below(folder.path()).iter().all(|name| !name.ends_with(".tmp")), "{:?}", below(folder.path()));
}

#[test]
fn targets_that_cannot_be_written_are_found_before_the_work() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("d.obj")).unwrap();
    fs::write(folder.path().join("f"), "").unwrap();
    let soon = |program: &str, arguments: &[&str]| {
        // The mesh is not there: whatever is said of the target was found before it was read.
        let output = run(program, folder.path(), ["no-such.obj"].iter().chain(arguments));
        let line = assert_refused(&output, program);
        assert!(!line.contains("no-such"), "{line}");
        line
    };
    assert!(soon(INTERPOLATE, &["-o", "none/a.obj"]).contains("there is no folder none"));
    assert!(soon(INTERPOLATE, &["-o", "d.obj"]).contains("it is a folder"));
    assert!(soon(INTERPOLATE, &["-o", "a.xyz"]).contains("must end in"));
    for program in [ASSEMBLE, COMPARE, SWEEP, SPECTRUM] {
        assert!(soon(program, &["--out", "f"]).contains("cannot create the folder"));
        assert!(soon(program, &["--out", "/proc"]).contains("cannot write in the folder"));
    }
    assert_eq!(below(folder.path()), ["d.obj", "f"]);
}
