//! `reproduce` and the ledger of the papers' claims: what is listed, what runs alone, what is written and compared.

use std::path::Path;
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
    for id in ["claims", "findings", "T1", "T29", "Z26", "P17", "L12"] {
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

#[test]
fn the_quick_ledger_is_written_and_held_against_a_committed_one() {
    let dir = tempfile::tempdir().unwrap();
    let output = reproduce(dir.path(), &["--quick", "--only", "claims", "--only", "findings"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let folder = dir.path().join("built-in");
    let json = std::fs::read_to_string(folder.join("claims.json")).unwrap();
    let records: serde_json::Value = serde_json::from_str(&json).unwrap();
    let records = records.as_array().unwrap();
    assert!(records.len() > 50);
    for record in records {
        assert_ne!(record["verdict"], "not confirmed", "{record:#}");
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
