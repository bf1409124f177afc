//! The programs under one name, completions, manual pages, the version.

use tempfile::tempdir;

use super::*;

const LIMITLAB: &str = env!("CARGO_BIN_EXE_limitlab");
const ALL: [&str; 8] =
    ["interpolate", "compare-solvers", "sweep-omega", "spectrum", "splitting", "assemble", "reproduce", "scaling"];

#[test]
fn a_subcommand_is_the_program_of_its_name() {
    let folder = tempdir().unwrap();
    assert_done(&run(INTERPOLATE, folder.path(), ["cube", "-o", "a.off", "--quiet"]), "interpolate");
    let output = run(LIMITLAB, folder.path(), ["interpolate", "cube", "-o", "b.off", "--json", "--quiet"]);
    assert_done(&output, "limitlab interpolate");
    assert_eq!(content(&folder.path().join("a.off")), content(&folder.path().join("b.off")));
    let object = json(&output);
    assert_eq!(object["program"], "interpolate");
    assert_eq!(object["command"], "limitlab interpolate cube -o b.off --json --quiet");
    assert_eq!((&object["options"]["output"], &object["options"]["tol"]), (&"b.off".into(), &"1e-10".into()));
    let error = assert_refused(&run(LIMITLAB, folder.path(), ["interpolate", "no-such", "-o", "x.off"]), "no mesh");
    assert_eq!(error, assert_refused(&run(INTERPOLATE, folder.path(), ["no-such", "-o", "x.off"]), "no mesh"));
    for wrong in [&["--no-such-flag"][..], &[], &["no-such-program"], &["completions", "no-such-shell"]] {
        assert_eq!(run(LIMITLAB, folder.path(), wrong).status.code(), Some(2), "{wrong:?}");
    }
    let version = run(LIMITLAB, folder.path(), ["--version"]);
    let version = text(&version.stdout).trim().strip_prefix("limitlab ").unwrap();
    let commit = version.strip_prefix(env!("CARGO_PKG_VERSION")).and_then(|rest| rest.strip_prefix(" (")).unwrap();
    let commit = commit.strip_suffix(')').unwrap();
    // Where the sources are not those of the commit.
    let commit = commit.strip_suffix("-dirty").unwrap_or(commit);
    assert!(commit == "unknown" || commit.len() == 10 && commit.chars().all(|c| c.is_ascii_hexdigit()), "{commit}");
}

#[test]
fn shells_complete_programs_and_flags() {
    let folder = tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = run(LIMITLAB, folder.path(), ["completions", shell]);
        assert_done(&output, shell);
        let script = text(&output.stdout);
        assert!(ALL.iter().all(|program| script.contains(program)) && script.contains("no-clobber"), "{shell}");
        let output = run(LIMITLAB, folder.path(), ["completions", shell, "interpolate"]);
        assert_done(&output, shell);
        assert!(
            text(&output.stdout).contains("write-normals") && !text(&output.stdout).contains("sweep-omega"),
            "{shell}"
        );
    }
    let error = assert_refused(&run(LIMITLAB, folder.path(), ["completions", "bash", "interpolat"]), "no program");
    assert!(error.contains("\"interpolat\"") && error.contains("interpolate"), "{error}");
    assert_no_files(folder.path(), "completions");
}

#[test]
#[cfg(target_os = "linux")]
fn bash_completes_by_the_script() {
    let folder = tempdir().unwrap();
    let output = run(LIMITLAB, folder.path(), ["completions", "bash"]);
    fs::write(folder.path().join("script"), &output.stdout).unwrap();
    let ask = "source ./script; COMP_WORDS=(limitlab interpolate --no-cl); COMP_CWORD=2; \
               _limitlab limitlab --no-cl interpolate; echo \"${COMPREPLY[@]}\"";
    let Ok(answer) = std::process::Command::new("bash").current_dir(folder.path()).args(["-c", ask]).output() else {
        eprintln!("skipped: no bash");
        return;
    };
    assert_eq!(text(&answer.stdout).trim(), "--no-clobber", "{}", text(&answer.stderr));
}

#[test]
fn every_program_has_a_manual_page() {
    let folder = tempdir().unwrap();
    assert_done(&run(LIMITLAB, folder.path(), ["man", "--out", "deep/man1"]), "man");
    let pages = folder.path().join("deep/man1");
    let read = |name: &str| fs::read_to_string(pages.join(name)).unwrap();
    assert!(read("limitlab.1").contains(".TH limitlab 1"));
    for program in ALL {
        let page = read(&format!("limitlab-{program}.1"));
        assert!(page.contains("Exit status") && page.contains("Examples") && page.contains(".SH OPTIONS"), "{program}");
    }
    assert_eq!(below(&pages).len(), 1 + ALL.len() + 2);
}
