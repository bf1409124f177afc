//! The programs from outside: exit status, standard output and error, JSON fields, files written and not written.

mod bad_input;
mod contract;
mod darts;
mod exchange;
mod front;
mod guide;
mod histories;
mod metadata;
mod page;
mod petsc;
mod pictures;
#[cfg(target_os = "linux")]
mod process;
mod provenance;
mod results;
mod systems;
mod tags;

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

pub const ASSEMBLE: &str = env!("CARGO_BIN_EXE_assemble");
pub const INTERPOLATE: &str = env!("CARGO_BIN_EXE_interpolate");
pub const COMPARE: &str = env!("CARGO_BIN_EXE_compare-solvers");
pub const SWEEP: &str = env!("CARGO_BIN_EXE_sweep-omega");
pub const REPRODUCE: &str = env!("CARGO_BIN_EXE_reproduce");
#[cfg(target_os = "linux")]
pub const SCALING: &str = env!("CARGO_BIN_EXE_scaling");
pub const SPECTRUM: &str = env!("CARGO_BIN_EXE_spectrum");
pub const SPLITTING: &str = env!("CARGO_BIN_EXE_splitting");

/// The programs that take meshes.
pub const ON_MESHES: [&str; 4] = [ASSEMBLE, INTERPOLATE, COMPARE, SWEEP];

/// Runs a program in `folder`.
pub fn run<A: AsRef<std::ffi::OsStr>>(program: &str, folder: &Path, arguments: impl IntoIterator<Item = A>) -> Output {
    Command::new(program).current_dir(folder).args(arguments).output().unwrap()
}

/// Runs a program on a mesh, with its results below `folder`, by the shortest way.
pub fn run_on(program: &str, folder: &Path, mesh: &str, more: &[&str]) -> Output {
    let mut arguments = vec![mesh, "--quiet"];
    match program {
        INTERPOLATE => arguments.extend(["-o", "result.obj"]),
        ASSEMBLE | SPECTRUM => arguments.extend(["--out", "result"]),
        COMPARE => arguments.extend(["--out", "result", "--method", "pia"]),
        SWEEP => arguments.extend(["--out", "result", "--method", "pia", "--omega", "1:1:1"]),
        _ => unreachable!("not a program on meshes"),
    }
    arguments.extend(more);
    run(program, folder, arguments)
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

pub fn assert_done(output: &Output, what: &str) {
    assert_eq!(output.status.code(), Some(0), "{what}: {}", text(&output.stderr));
}

/// Exit status 1, nothing on standard output, one line `error: …` on standard error. Returns the line.
pub fn assert_refused(output: &Output, what: &str) -> String {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{what}: {error}");
    assert!(error.starts_with("error: "), "{what}: {error}");
    assert_eq!(error.lines().count(), 1, "{what}: {error}");
    assert!(error.ends_with('\n') && !error.contains("panicked"), "{what}: {error}");
    assert!(output.stdout.is_empty(), "{what}: {}", text(&output.stdout));
    error.trim_end().to_owned()
}

/// Standard output as one JSON object and nothing else.
pub fn json(output: &Output) -> Value {
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(value.is_object());
    value
}

/// All files and folders below a folder, sorted.
pub fn below(folder: &Path) -> Vec<String> {
    fn collect(root: &Path, folder: &Path, names: &mut Vec<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            names.push(path.strip_prefix(root).unwrap().to_str().unwrap().to_owned());
            if path.is_dir() && !path.is_symlink() {
                collect(root, &path, names);
            }
        }
    }
    let mut names = Vec::new();
    collect(folder, folder, &mut names);
    names.sort();
    names
}

/// No files at all below a folder: programs may have created the folder for their results.
pub fn assert_no_files(folder: &Path, what: &str) {
    for name in below(folder) {
        assert!(folder.join(&name).is_dir(), "{what}: left {name} behind");
    }
}

/// What a file holds beside what made it: the rows and pixels, without comments and footers.
pub fn content(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).unwrap();
    match path.extension().and_then(|e| e.to_str()) {
        Some("png") => {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            pixels
        }
        Some("md") => text(&bytes).split("\n---\n").next().unwrap().into(),
        _ => without_comments(&bytes),
    }
}

/// The lines of a file that are no comments.
pub fn without_comments(bytes: &[u8]) -> Vec<u8> {
    let signs = [&b"# "[..], b"% ", b"comment "];
    let lines = bytes.split_inclusive(|&b| b == b'\n');
    lines.filter(|line| !signs.iter().any(|sign| line.starts_with(sign))).flatten().copied().collect()
}

/// A reader of a CSV file whose comments are passed over.
pub fn csv(path: &Path) -> csv::Reader<fs::File> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap()
}
