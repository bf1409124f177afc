//! The guide: its commands, run as it says, show what it shows.

use std::fs;

use tempfile::tempdir;

use super::*;
use crate::common::root;

/// Whether `line` is what the guide shows; `…` there stands for anything.
fn shows(shown: &str, line: &str) -> bool {
    let Some((first, further)) = shown.split_once('…') else { return line == shown };
    let Some(mut rest) = line.strip_prefix(first) else { return false };
    for part in further.split('…') {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.is_empty() || further.ends_with('…') || further.is_empty()
}

#[test]
fn commands_of_the_guide_show_what_it_says() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("docs")).unwrap();
    fs::copy(root().join("docs/house.off"), folder.path().join("docs/house.off")).unwrap();
    let guide = fs::read_to_string(root().join("docs/guide.md")).unwrap();
    let mut commands = 0;
    for block in guide.split("```console\n$ ").skip(1) {
        let block = block.split("```").next().unwrap();
        let (command, shown) = block.split_once('\n').unwrap();
        let mut words = command.split_whitespace();
        let program = words.next().unwrap();
        let program = [INTERPOLATE, COMPARE, SWEEP, SPECTRUM].into_iter().find(|p| p.ends_with(program)).unwrap();
        let output = run(program, folder.path(), words);
        assert_done(&output, command);
        // Results, then remarks: a terminal has both.
        let mut lines = text(&output.stdout).lines().chain(text(&output.stderr).lines());
        for wanted in shown.lines().filter(|line| *line != "…") {
            assert!(lines.any(|line| shows(wanted, line)), "{command}: no line {wanted:?}, or not there\n{output:?}");
        }
        commands += 1;
    }
    assert_eq!(commands, 8);
    let picture = fs::read(folder.path().join("out/sweep-omega-house-catmull-clark.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    for picture in [
        "out/spectrum-modes-house-catmull-clark.png",
        "out/compare-solvers-house-catmull-clark-errors-pia.png",
        "cage.png",
    ] {
        assert!(folder.path().join(picture).is_file(), "{picture}");
    }
    let first = guide.split(".png`").next().unwrap();
    assert!(first.lines().count() <= 40, "forty lines to the first picture");
}
