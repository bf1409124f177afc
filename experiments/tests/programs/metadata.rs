//! The manifest: what it promises holds for what is locked, and what is packaged.

use std::process::Command;

use serde_json::Value;

use crate::common::root;

/// Standard output of cargo at the root of the project.
fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO")).current_dir(root()).args(arguments).output().unwrap();
    assert!(output.status.success(), "cargo {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The platform that tests run on: packages of others need not be here.
fn host() -> String {
    let output = Command::new("rustc").arg("-vV").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().find_map(|l| l.strip_prefix("host: ")).unwrap().to_owned()
}

/// `1.89` or `1.89.0` as numbers.
fn version(text: &str) -> Vec<u32> {
    text.split('.').map(|part| part.parse().unwrap()).collect()
}

#[test]
fn every_locked_package_builds_with_the_rust_version_that_is_promised() {
    let platform = host();
    let text = cargo(&["metadata", "--format-version=1", "--locked", "--offline", "--filter-platform", &platform]);
    let metadata: Value = serde_json::from_str(&text).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let promised = version(env!("CARGO_PKG_RUST_VERSION"));
    let newer: Vec<String> = packages
        .iter()
        .filter(|p| p["rust_version"].as_str().is_some_and(|v| version(v)[..2] > promised[..2]))
        .map(|p| format!("{} {} needs {}", p["name"], p["version"], p["rust_version"]))
        .collect();
    assert!(packages.len() > 50 && newer.is_empty(), "{newer:#?}");
}

#[test]
fn what_is_packaged_is_small() {
    let list = cargo(&["package", "--package", "limitlab", "--list", "--allow-dirty", "--offline", "--locked"]);
    assert!(list.lines().any(|name| name == "src/lib.rs"), "{list}");
    let root = root();
    let bytes = list.lines().filter_map(|name| root.join(name).metadata().ok()).map(|m| m.len()).sum::<u64>();
    // Registries take 10 MiB of it compressed.
    assert!(bytes < 5 << 20, "{bytes} bytes");
}

#[test]
fn the_citation_has_the_version_of_the_manifest() {
    let citation = std::fs::read_to_string(root().join("CITATION.cff")).unwrap();
    let version = citation.lines().find_map(|line| line.strip_prefix("version: "));
    assert_eq!(version, Some(env!("CARGO_PKG_VERSION")));
}

/// Files that a page links to, without addresses and anchors.
fn links(page: &str) -> impl Iterator<Item = &str> {
    let targets = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|to| !to.contains("://")).filter_map(|to| to.split('#').next()).filter(|to| !to.is_empty())
}

#[test]
fn links_of_the_pages_lead_to_files() {
    for page in ["README.md", "CONTRIBUTING.md", "docs/guide.md", "docs/methods.md"] {
        let path = root().join(page);
        let text = std::fs::read_to_string(&path).unwrap();
        let lost: Vec<&str> = links(&text).filter(|to| !path.parent().unwrap().join(to).exists()).collect();
        assert!(links(&text).count() > 0 && lost.is_empty(), "{page}: {lost:?}");
    }
}
