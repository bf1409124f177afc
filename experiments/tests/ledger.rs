//! `reproduce` and the ledger of the papers' claims: what is listed, what runs alone, what is written and compared.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;

fn reproduce(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::cargo_bin("reproduce").unwrap();
    let out = folder.to_str().unwrap();
    command.args(["--quiet", "--out", out]).args(arguments);
    command.output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn the_list_names_items_and_claims() {
    let dir = tempfile::tempdir().unwrap();
    let output = reproduce(dir.path(), &["--list"]);
    assert!(output.status.success());
    let ids: Vec<&str> = text(&output.stdout).lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    for id in ["claims", "findings", "T1", "T29", "Z31", "P17", "L16", "B4"] {
        assert_eq!(ids.iter().filter(|i| **i == id).count(), 1, "{id}");
    }
}

#[test]
fn claims_run_alone_and_write_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let output = reproduce(dir.path(), &["--only", "T4", "--only", "P8"]);
    assert!(output.status.success());
    let page = text(&output.stdout);
    let headings: Vec<&str> = page.lines().filter(|l| l.starts_with("### ")).collect();
    assert_eq!(headings.len(), 2, "{page}");
    assert!(headings[0].starts_with("### T4 ") && headings[0].ends_with("— corrected"));
    assert!(headings[1].starts_with("### P8 ") && headings[1].ends_with("— corrected"));
    let written = std::fs::read_dir(dir.path().join("built-in")).unwrap();
    assert_eq!(written.count(), 0);
}

#[test]
fn without_models_a_claim_says_why_it_cannot_run() {
    let dir = tempfile::tempdir().unwrap();
    let output = reproduce(dir.path(), &["--only", "P1"]);
    assert!(output.status.success());
    let page = text(&output.stdout);
    assert!(page.contains("— not reproducible") && page.contains("--meshes"), "{page}");
}

#[test]
fn an_unknown_claim_is_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let output = reproduce(dir.path(), &["--only", "T99"]);
    assert_eq!(output.status.code(), Some(1));
    let line = text(&output.stderr);
    assert!(line.starts_with("error: ") && line.contains("T99") && line.contains("--list"), "{line}");
    assert_eq!(line.lines().count(), 1);
}

/// All files below a folder, with their bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), std::fs::read(&path).unwrap());
        }
    }
    found
}

/// One test of all that a quick run of everything does, as it takes its time.
#[test]
fn a_quick_run_ends_with_one_screen_and_is_held_against_a_committed_one() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let output = Command::cargo_bin("reproduce").unwrap().args(["--quick", "--out", out]).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let folder = dir.path().join("built-in");

    // A line an item: its name, seconds, what came out.
    let lines: Vec<&str> = text(&output.stderr).lines().collect();
    let list = reproduce(dir.path(), &["--list"]);
    let items = text(&list.stdout).lines().map(|line| line.split_whitespace().next().unwrap());
    for (item, line) in items.zip(&lines) {
        let words: Vec<&str> = line.split_whitespace().collect();
        assert!(words[0] == item && words[1].parse::<f64>().is_ok() && words[2] == "s", "{line}");
    }
    assert_eq!(lines.len(), 22, "{lines:#?}");
    assert!(lines[0].ends_with("1 table of 5 rows"), "{}", lines[0]);
    // Verdicts with the claims that are not as printed, and where the rest is.
    let screen = text(&output.stdout);
    assert!(screen.lines().count() < 25 && screen.lines().all(|l| !l.starts_with('|')), "{screen}");
    assert!(screen.lines().any(|l| l.contains("corrected") && l.contains(" P8 ")), "{screen}");
    assert!(screen.contains("README.md") && screen.contains(folder.to_str().unwrap()), "{screen}");

    // What a clock measures is written only if asked for; all else is the same from run to run.
    let before = files(dir.path());
    assert!(before.keys().all(|path| !path.to_str().unwrap().contains("--times.")), "{:#?}", before.keys());
    assert!(reproduce(dir.path(), &["--quick", "--only", "zheng-cai-3-5", "--only", "popping"]).status.success());
    assert!(files(dir.path()) == before, "a second run changed a file");
    assert!(reproduce(dir.path(), &["--quick", "--only", "zheng-cai-3-5", "--times"]).status.success());
    assert!(folder.join("zheng-cai-3-5--times.md").exists());

    let json = std::fs::read_to_string(folder.join("claims.json")).unwrap();
    let records: serde_json::Value = serde_json::from_str(&json).unwrap();
    let records = records.as_array().unwrap();
    assert!(records.len() > 50);
    for record in records {
        assert_ne!(record["verdict"], "not confirmed", "{record:#}");
        // A duration has no value here, and so decides nothing.
        for evidence in record["evidence"].as_array().unwrap() {
            assert!(evidence["relation"].is_null() || !evidence["value"].is_null(), "{record:#}");
        }
    }
    let page = std::fs::read_to_string(folder.join("claims.md")).unwrap();
    assert!(page.contains("Quick run, without"));
    // Findings quote claims that a quick run leaves out.
    assert!(!folder.join("findings.md").exists());

    let check = ["--only", "T4", "--check", dir.path().to_str().unwrap()];
    assert!(reproduce(dir.path(), &check).status.success());
    // The committed number of the ledger's first claim altered: 1/3 is no longer found.
    let csv = std::fs::read_to_string(folder.join("claims.csv")).unwrap();
    let altered: String = csv
        .lines()
        .map(|l| if l.starts_with("T4,") { l.replace("0.3333333333", "0.4") } else { l.to_owned() } + "\n")
        .collect();
    assert_ne!(altered, csv);
    std::fs::write(folder.join("claims.csv"), altered).unwrap();
    let output = reproduce(dir.path(), &check);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("claims: row [T4, "), "{}", text(&output.stderr));
}
