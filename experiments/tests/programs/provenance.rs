//! Provenance: what every file says of the run that made it, and that results do not depend on it.

use tempfile::tempdir;

use super::*;

/// CRC-32, bit by bit.
fn crc32(bytes: &[u8]) -> String {
    let mut remainder = u32::MAX;
    for &byte in bytes {
        remainder ^= u32::from(byte);
        for _ in 0..8 {
            remainder = if remainder & 1 == 1 { remainder >> 1 ^ 0xEDB8_8320 } else { remainder >> 1 };
        }
    }
    format!("crc32:{:08x}", !remainder)
}

fn contains(bytes: &[u8], part: &str) -> bool {
    bytes.windows(part.len()).any(|window| window == part.as_bytes())
}

const TETRAHEDRON: &str = "OFF\n4 4 6\n1 1 1\n-1 -1 1\n-1 1 -1\n1 -1 -1.5\n3 0 1 3\n3 0 2 1\n3 0 3 2\n3 1 2 3\n";

#[test]
fn every_file_says_what_made_it() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("mine.off"), TETRAHEDRON).unwrap();
    let runs: &[(&str, &[&str])] = &[
        (
            COMPARE,
            &["mine.off", "--out", "c", "--method", "pia,lu", "--figure", "png,svg,pdf", "--html", "c/page.html"],
        ),
        (SWEEP, &["mine.off", "--out", "w", "--omega", "0.5:1:0.5", "--history", "0.7", "--figure", "png,svg,pdf"]),
        (SPECTRUM, &["mine.off", "--out", "s", "--full", "--modes", "2", "--figure", "png,svg,pdf"]),
        (ASSEMBLE, &["mine.off", "--out", "a"]),
        (INTERPOLATE, &["mine.off", "-o", "i.obj", "--picture", "p.png"]),
        (INTERPOLATE, &["mine.off", "-o", "i.off"]),
        (INTERPOLATE, &["mine.off", "-o", "i.ply"]),
        (INTERPOLATE, &["mine.off", "-o", "t.ply", "--ascii"]),
        (INTERPOLATE, &["mine.off", "-o", "i.usda"]),
        (SPLITTING, &["--valence", "5..6", "--out", "l", "--figure", "png,svg,pdf"]),
    ];
    let mut endings = std::collections::BTreeSet::new();
    for (program, arguments) in runs {
        let before = below(folder.path());
        assert_done(&run(program, folder.path(), [*arguments, &["--quiet"]].concat()), program);
        let stem = Path::new(program).file_stem().unwrap().to_str().unwrap();
        for name in below(folder.path()).into_iter().filter(|name| !before.contains(name)) {
            let path = folder.path().join(&name);
            if path.is_dir() {
                continue;
            }
            let bytes = fs::read(path).unwrap();
            let command = format!("{stem} {} --quiet", arguments.join(" "));
            let date = |window: &[u8]| {
                let digits = |at: std::ops::Range<usize>| window[at].iter().all(u8::is_ascii_digit);
                window[4] == b'-' && window[10] == b'T' && window[19] == b'Z' && digits(0..4) && digits(17..19)
            };
            assert!(contains(&bytes, &command), "{name}: {command}");
            assert!(contains(&bytes, "limitlab ") && contains(&bytes, env!("CARGO_PKG_VERSION")), "{name}");
            assert!(contains(&bytes, "threads") && contains(&bytes, "quiet=true"), "{name}");
            assert!(bytes.windows(20).any(date), "{name}");
            if *program != SPLITTING {
                assert!(
                    contains(&bytes, &format!("mine.off, 4 vertices, 4 faces, {}", crc32(TETRAHEDRON.as_bytes()))),
                    "{name}"
                );
                if *program != ASSEMBLE {
                    assert!(contains(&bytes, "tol=1e-10"), "{name}: what nobody named");
                }
            }
            endings.extend(name.rsplit('.').next().map(str::to_owned));
        }
    }
    let all = ["csv", "html", "md", "mtx", "obj", "off", "pdf", "ply", "png", "svg", "usda"];
    assert_eq!(endings.iter().collect::<Vec<_>>(), all.iter().collect::<Vec<_>>());

    // A stream is the mesh alone, and all of it is read again: by the programs themselves.
    let piped = run(INTERPOLATE, folder.path(), ["mine.off", "-o", "-", "--format", "obj", "--quiet"]);
    assert!(text(&piped.stdout).starts_with("v "));
    fs::write(folder.path().join("piped.obj"), &piped.stdout).unwrap();
    let positions = |name: &str| limitlab::mesh::io::read(&folder.path().join(name)).unwrap().mesh.positions;
    for name in ["i.off", "i.ply", "t.ply", "piped.obj"] {
        assert_eq!(positions(name), positions("i.obj"), "{name}");
    }
    assert_eq!(positions("i.usda").len(), 4);
    assert_done(&run(COMPARE, folder.path(), ["a", "--method", "lu", "--out", "again", "--quiet"]), "its system");
    let table = fs::read_to_string(folder.path().join("c/compare-solvers-mine-loop.csv")).unwrap();
    let header = table.lines().find(|line| !line.starts_with("# ")).unwrap();
    assert!(header.starts_with("method,"), "{header}");
}

#[test]
#[cfg(unix)]
fn the_command_in_a_file_makes_it_again() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("it's my mesh.off"), TETRAHEDRON).unwrap();
    let cage = folder.path().join("a cage.obj");
    let arguments = ["it's my mesh.off", "-o", "a cage.obj", "--noise", "0.1:7", "--quiet"];
    assert_done(&run(INTERPOLATE, folder.path(), arguments), "interpolate");
    let written = fs::read_to_string(&cage).unwrap();
    let command = written.lines().find_map(|line| line.strip_prefix("# command: ")).unwrap();
    let first = content(&cage);
    fs::remove_file(&cage).unwrap();
    let programs = Path::new(INTERPOLATE).parent().unwrap();
    Command::new("/bin/sh").current_dir(folder.path()).env("PATH", programs).args(["-c", command]).assert().success();
    assert_eq!(content(&cage), first);
    assert!(first.starts_with(b"v "));
}

#[test]
fn json_says_what_made_it() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("mine.off"), TETRAHEDRON).unwrap();
    let hash = crc32(TETRAHEDRON.as_bytes());
    let check = |program: &str, arguments: &[&str]| {
        let output = run(program, folder.path(), [arguments, &["--json", "--threads", "1", "--quiet"]].concat());
        assert_done(&output, program);
        let object = json(&output);
        let name = Path::new(program).file_stem().unwrap().to_str().unwrap();
        assert_eq!(object["program"], name);
        assert_eq!(object["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(object["threads"], 1);
        assert_eq!(object["options"]["quiet"], true);
        let command = object["command"].as_str().unwrap();
        assert!(command.starts_with(name) && command.ends_with("--json --threads 1 --quiet"), "{command}");
        assert_eq!(object["provenance"]["date"].as_str().unwrap().len(), 20);
        let commit = object["provenance"]["commit"].as_str().unwrap();
        // Where the sources are not those of the commit, that is marked.
        let name = commit.strip_suffix("-dirty").unwrap_or(commit);
        assert!(name == "unknown" || name.len() == 10 && name.chars().all(|c| c.is_ascii_hexdigit()), "{commit}");
        object
    };
    let object = check(INTERPOLATE, &["mine.off", "-o", "x.obj"]);
    assert_eq!((&object["hash"], &object["options"]["tol"]), (&hash.into(), &"1e-10".into()));
    assert!(object["options"]["noise"].is_null());
    let object = check(SWEEP, &["mine.off", "cube", "--noise", "0.1", "--omega", "1:1:1"]);
    assert_eq!(object["options"]["meshes"], serde_json::json!(["mine.off", "cube"]));
    assert_eq!(object["results"][1]["hash"], crc32(b"cube --noise 0.1:1"));
    check(ASSEMBLE, &["cube", "--out", "a"]);
    // Of a system, its files one after the other.
    let files = ["M", "H", "P"].map(|name| fs::read(folder.path().join(format!("a/{name}.mtx"))).unwrap());
    assert_eq!(check(COMPARE, &["a", "--method", "lu"])["hash"], crc32(&files.concat()));
    check(SPLITTING, &["--valence", "5"]);
    check(INTERPOLATE, &["cube", "-o", "x.obj", "--defects"]);
    check(REPRODUCE, &["--list"]);
}

#[test]
fn reproduce_writes_the_same_bytes_every_time() {
    let folder = tempdir().unwrap();
    for (out, threads) in [("a", "1"), ("b", "2")] {
        let arguments =
            ["--only", "sparsity", "--quick", "--figure", "png,svg,pdf", "--out", out, "--threads", threads];
        assert_done(&run(REPRODUCE, folder.path(), arguments), "reproduce");
    }
    let [a, b] = ["a", "b"].map(|out| folder.path().join(out));
    let names = below(&a);
    assert_eq!(names, below(&b));
    let files: Vec<&String> = names.iter().filter(|name| a.join(name).is_file()).collect();
    assert!(files.len() > 3, "{names:?}");
    for name in files {
        let bytes = fs::read(a.join(name)).unwrap();
        assert!(bytes == fs::read(b.join(name)).unwrap(), "{name}");
        let command =
            if name.ends_with("README.md") { "reproduce --quick" } else { "reproduce --only sparsity --quick" };
        assert!(contains(&bytes, command), "{name}");
        assert!(!contains(&bytes, "date: ") && !contains(&bytes, "--threads"), "{name}");
    }
}

/// Standard error of a run that is done.
fn remarks(program: &str, folder: &Path, arguments: &[&str]) -> String {
    let output = run(program, folder, arguments);
    assert_done(&output, program);
    text(&output.stderr).into()
}

#[test]
fn no_file_is_replaced_without_a_word() {
    let folder = tempdir().unwrap();
    let at = |arguments: &[&str]| remarks(COMPARE, folder.path(), arguments);
    let first = ["cube", "--method", "pia", "--out", "o"];
    assert!(!at(&first).contains("replaced"));
    let said = at(&["cube", "--method", "lu", "--out", "o"]);
    assert!(said.contains("replaced: 4 files, the first o/compare-solvers-cube-catmull-clark.csv"), "{said}");
    let output = run(COMPARE, folder.path(), [&first[..], &["--json"]].concat());
    assert_eq!(json(&output)["replaced"].as_array().unwrap().len(), 4);
    // Another mesh has other files.
    assert!(!at(&["prism:5", "--method", "lu", "--out", "o"]).contains("replaced"));

    let cage = |more: &[&str]| remarks(INTERPOLATE, folder.path(), &[&["cube", "-o", "x.off"], more].concat());
    assert!(!cage(&[]).contains("replaced"));
    assert!(cage(&["--tol", "1e-8"]).contains("replaced: x.off\n"));
    let said = cage(&["--picture", "p.svg"]);
    assert!(!said.contains("replaced: 2 files"), "{said}");
    assert!(cage(&["--tol", "1e-7", "--picture", "p.svg"]).contains("replaced: 2 files"), "the picture too");
    // Who names one file twice wants it replaced.
    assert!(!remarks(INTERPOLATE, folder.path(), &["x.off", "-o", "x.off"]).contains("replaced"));
    // The same bytes replace nothing.
    let reproduce = ["--only", "sparsity", "--quick", "--out", "r"];
    for _ in 0..2 {
        assert!(!remarks(REPRODUCE, folder.path(), &reproduce).contains("replaced"));
    }
}

#[test]
fn no_clobber_refuses_before_the_work() {
    let folder = tempdir().unwrap();
    let runs: [(&str, &[&str], &str); 6] = [
        (COMPARE, &["cube", "--method", "pia", "--out", "c"], "c/compare-solvers-cube-catmull-clark.csv"),
        (SWEEP, &["cube", "--omega", "1:1:1", "--out", "w"], "w/sweep-omega-cube-catmull-clark.csv"),
        (SPECTRUM, &["cube", "--out", "s"], "s/spectrum-cube-catmull-clark.csv"),
        (SPLITTING, &["--valence", "5", "--out", "l"], "l/splitting-catmull-clark"),
        (ASSEMBLE, &["cube", "--out", "a"], "a/A.mtx"),
        (INTERPOLATE, &["cube", "-o", "x.off"], "x.off"),
    ];
    for (program, arguments, file) in runs {
        let refuse = [arguments, &["--no-clobber", "--quiet"]].concat();
        assert_done(&run(program, folder.path(), &refuse), "nothing is there");
        let all: Vec<_> = below(folder.path()).into_iter().map(|name| folder.path().join(name)).collect();
        let bytes = |all: &[std::path::PathBuf]| all.iter().map(|path| fs::read(path).ok()).collect::<Vec<_>>();
        let before = bytes(&all);
        let error = assert_refused(&run(program, folder.path(), &refuse), program);
        assert!(error.starts_with(&format!("error: {file}")), "{error}");
        assert!(error.ends_with("it is there already: name another place, or leave out --no-clobber"), "{error}");
        assert!(before == bytes(&all) && below(folder.path()).len() == all.len(), "{program}");
    }
    // A picture is a file like others.
    fs::write(folder.path().join("y.png"), "mine").unwrap();
    let picture = ["cube", "--scheme", "nasri", "-o", "y.off", "--picture", "y.png", "--no-clobber", "--quiet"];
    let error = assert_refused(&run(INTERPOLATE, folder.path(), picture), "picture");
    assert!(error.starts_with("error: y.png") && !folder.path().join("y.off").exists(), "{error}");
    // A table of another mesh whose name ends alike is not in the way.
    let other = ["prism:4", "--method", "pia", "--out", "c", "--no-clobber", "--quiet"];
    assert_done(&run(COMPARE, folder.path(), other), "another mesh");
    // Maps of errors, whose names are known by what was compared, are refused before anything is written.
    fs::write(folder.path().join("compare-solvers-octahedron-loop-errors-pia.ply"), "mine").unwrap();
    let maps = ["octahedron", "--scheme", "loop", "--method", "pia", "--errors-at", "1", "--out", ".", "--no-clobber"];
    let error = assert_refused(&run(COMPARE, folder.path(), maps), "maps");
    assert!(
        error.contains("errors-pia.ply") && !folder.path().join("compare-solvers-octahedron-loop.csv").exists(),
        "{error}"
    );
    let both = run(INTERPOLATE, folder.path(), ["cube", "-o", "x.off", "--no-clobber", "--force"]);
    assert_eq!(both.status.code(), Some(2));
}

#[test]
fn force_replaces_what_is_read_only() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.off");
    fs::write(&path, "mine").unwrap();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    let error = assert_refused(&run(INTERPOLATE, folder.path(), ["cube", "-o", "x.off", "--quiet"]), "read-only");
    assert!(error.contains("read-only"), "{error}");
    assert!(remarks(INTERPOLATE, folder.path(), &["cube", "-o", "x.off", "--force"]).contains("replaced: x.off"));
}

#[test]
fn a_picture_is_a_file_as_the_mesh_is() {
    let folder = tempdir().unwrap();
    let picture = folder.path().join("x.svg");
    fs::write(&picture, "mine").unwrap();
    let drawn = ["cube", "-o", "x.off", "--picture", "x.svg"];
    let refused = run(INTERPOLATE, folder.path(), [&drawn[..], &["--no-clobber", "--quiet"]].concat());
    assert!(assert_refused(&refused, "there").starts_with("error: x.svg: cannot write: it is there already"));
    assert_eq!((below(folder.path()).len(), fs::read_to_string(&picture).unwrap().as_str()), (1, "mine"));
    let mut permissions = fs::metadata(&picture).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&picture, permissions).unwrap();
    assert!(remarks(INTERPOLATE, folder.path(), &[&drawn[..], &["--force"]].concat()).contains("replaced: x.svg"));
    // It says of which mesh it is.
    let written = fs::read_to_string(&picture).unwrap();
    assert!(written.contains("\ninput: cube, 8 vertices, 6 faces, crc32:"), "{}", &written[..1000]);
}

#[test]
fn a_run_does_not_write_over_its_own_results() {
    let folder = tempdir().unwrap();
    for (name, mesh) in [("a", "tri-torus:5x4"), ("b", "icosahedron")] {
        fs::create_dir(folder.path().join(name)).unwrap();
        let target = format!("{name}/m.off");
        assert_done(&run(INTERPOLATE, folder.path(), [mesh, "-o", &target, "--quiet"]), mesh);
    }
    for (program, file) in [
        (COMPARE, "out/compare-solvers-m-loop.csv"),
        (SWEEP, "out/sweep-omega-m-loop.csv"),
        (SPECTRUM, "out/spectrum-m-loop.csv"),
    ] {
        let output = run(program, folder.path(), ["a/m.off", "b/m.off", "--json", "--quiet"]);
        let error = assert_refused(&output, program);
        assert!(error.starts_with(&format!("error: {file}: ")) && error.contains("called the same"), "{error}");
        let kept = fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(kept.contains("\n# input: a/m.off, 20 vertices"), "{kept}");
    }
}
