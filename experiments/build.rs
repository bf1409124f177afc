//! The commit that is built, for `--version` and for what the programs write: `LIMITLAB_COMMIT`; as git has it, with `-dirty`
//! behind it where the sources are not those of the commit.

use std::path::Path;
use std::process::Command;

/// What the programs are built from.
const SOURCES: [&str; 6] = ["../src", "../Cargo.toml", "../Cargo.lock", "src", "Cargo.toml", "build.rs"];

fn main() {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    // From an archive of the sources there is none to tell.
    let commit = git(&["rev-parse", "--short=10", "HEAD"]).unwrap_or_else(|| "unknown".into());
    // What is built is not the commit where one of these differs from it.
    let mut status = vec!["--no-optional-locks", "status", "--porcelain", "--"];
    status.extend(SOURCES);
    let changed = git(&status).is_some_and(|files| !files.is_empty());
    println!("cargo::rustc-env=LIMITLAB_COMMIT={commit}{}", if changed { "-dirty" } else { "" });
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    // It grows with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| Path::new(log).exists()) {
        println!("cargo::rerun-if-changed={log}");
    }
}
