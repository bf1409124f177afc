//! The manifest: what it promises holds for what is locked, and what is packaged.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::below;
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

/// Where the links and pictures of a page lead to, Markdown's and HTML's, but for other sites.
fn links(page: &str) -> Vec<&str> {
    let between =
        |start: &'static str, end: char| page.split(start).skip(1).filter_map(move |rest| rest.split(end).next());
    let all = between("](", ')').chain(between("href=\"", '"')).chain(between("src=\"", '"'));
    all.filter(|to| !to.contains("://")).collect()
}

/// Places in a page: its headings as renderers name them, and those that are named in HTML.
fn places(page: &str) -> Vec<String> {
    let named = page.split("<a id=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned);
    let of_heading = |line: &str| {
        let mut place = String::new();
        for c in line.trim_start_matches('#').trim().chars() {
            match c {
                ' ' => place.push('-'),
                '-' | '_' => place.push(c),
                _ if c.is_alphanumeric() => place.extend(c.to_lowercase()),
                _ => {}
            }
        }
        place
    };
    page.lines().filter(|line| line.starts_with('#')).map(of_heading).chain(named).collect()
}

/// Links of a page that lead nowhere.
fn lost_links(path: &Path) -> Vec<String> {
    let page = std::fs::read_to_string(path).unwrap();
    let leads_nowhere = |to: &&str| {
        let (file, place) = to.split_once('#').unwrap_or((to, ""));
        let target = if file.is_empty() { path.to_owned() } else { path.parent().unwrap().join(file) };
        let has_place = || places(&std::fs::read_to_string(&target).unwrap()).iter().any(|p| p == place);
        !target.exists() || !place.is_empty() && !has_place()
    };
    links(&page).into_iter().filter(leads_nowhere).map(|to| format!("{}: {to}", path.display())).collect()
}

#[test]
fn links_of_the_pages_lead_to_files_and_places() {
    for page in ["README.md", "CONTRIBUTING.md", "docs/guide.md", "docs/methods.md", "python/README.md"] {
        let path = root().join(page);
        assert!(!links(&std::fs::read_to_string(&path).unwrap()).is_empty(), "{page}");
        assert_eq!(lost_links(&path), [""; 0]);
    }
    for file in below(&root().join("reports")).iter().filter(|file| file.ends_with(".md")) {
        assert_eq!(lost_links(&root().join("reports").join(file)), [""; 0]);
    }
}
