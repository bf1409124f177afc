//! Systems for PETSc and their solutions: `assemble --format petsc` and `interpolate --solution`. PETSc itself is run by
//! `engines/petsc/check.sh`.

use glam::DVec3;
use limitlab::assemble::petsc::{ORDER, read_indices, read_points, read_vector};
use limitlab::mesh::io;
use tempfile::tempdir;

use super::*;

/// As a vector of PETSc.
fn write_points(path: &Path, points: &[DVec3]) {
    let head = [1_211_214u32, 3 * points.len() as u32].map(u32::to_be_bytes).concat();
    let numbers = points.iter().flat_map(|p| p.to_array()).flat_map(f64::to_be_bytes);
    fs::write(path, head.into_iter().chain(numbers).collect::<Vec<u8>>()).unwrap();
}

#[test]
fn a_solution_goes_back_to_the_cage_and_a_wrong_one_is_refused() {
    let folder = tempdir().unwrap();
    let there = |name: &str| folder.path().join(name);
    fs::write(there("ring"), "0 1 10\n1 2 10\n2 3 10\n3 4 10\n4 5 10\n5 0 10\n").unwrap();
    // Far from the origin, so that the points of the system are in a frame.
    let torus = io::read(&{
        assert_done(&run(INTERPOLATE, folder.path(), ["torus:8x6", "-o", "near.obj", "--quiet"]), "near");
        there("near.obj")
    });
    let mut far = torus.unwrap().mesh;
    far.positions.iter_mut().for_each(|p| *p += DVec3::splat(1e6));
    io::write(&there("far.obj"), &far, None).unwrap();
    for (mesh, more) in
        [("torus:8x6", &[][..]), ("torus:8x6", &["--creases", "ring"]), ("far.obj", &["--scheme", "nasri"])]
    {
        for extra in [&["--order", "curve"][..], &["--index", "64", "--order", "random:3"]] {
            let what = format!("{mesh} {more:?} {extra:?}");
            let mesh_flags = [&[mesh, "--quiet", "--tol", "1e-9"], more].concat();
            let assembled = [&[mesh, "--quiet", "--format", "petsc", "--out", "d", "--json"], more, extra].concat();
            let output = run(ASSEMBLE, folder.path(), assembled);
            assert_done(&output, &what);
            let object = json(&output);
            let manifest: Value = serde_json::from_slice(&fs::read(there("d/manifest.json")).unwrap()).unwrap();
            for field in ["rows", "entries", "index", "order", "diagonal", "centre", "scale", "hash", "scheme"] {
                assert!(!object[field].is_null() && object[field] == manifest[field], "{what}: {field}");
            }
            assert_done(&run(INTERPOLATE, folder.path(), [&mesh_flags[..], &["-o", "cage.ply"]].concat()), &what);
            let cage = io::read(&there("cage.ply")).unwrap().mesh.positions;
            let order = read_indices(&there("d").join(ORDER)).unwrap();
            assert_eq!(object["rows"], order.len());
            let centre = DVec3::from_array([0, 1, 2].map(|axis| object["centre"][axis].as_f64().unwrap()));
            let scale = object["scale"].as_f64().unwrap();
            assert_eq!(centre == DVec3::ZERO, mesh != "far.obj", "{what}");
            let solved: Vec<DVec3> = order.iter().map(|&v| (cage[v as usize] - centre) / scale).collect();
            // R is H⁻¹P.
            if more.is_empty() {
                let (right, h) = (read_points(&there("d/R.petsc")).unwrap(), read_vector(&there("d/H.petsc")).unwrap());
                let given = limitlab::mesh::builtin::builtin(mesh).unwrap().positions;
                for (k, &v) in order.iter().enumerate() {
                    assert!((h[k] * right[k]).distance(given[v as usize]) < 1e-14, "{what}");
                }
            }
            write_points(&there("d/X.petsc"), &solved);
            let taken = [&mesh_flags[..], &["--solution", "d/X.petsc", "-o", "back.ply", "--json"]].concat();
            let output = run(INTERPOLATE, folder.path(), &taken);
            assert_done(&output, &what);
            assert_eq!((&json(&output)["method"], &json(&output)["status"]), (&"petsc".into(), &"converged".into()));
            let back = io::read(&there("back.ply")).unwrap().mesh.positions;
            for (a, b) in cage.iter().zip(&back) {
                assert!(a.distance(*b) < 1e-8, "{what}: {a} and {b}");
            }

            let mut wrong = solved.clone();
            wrong[1].y += 1e-3;
            write_points(&there("d/X.petsc"), &wrong);
            fs::remove_file(there("back.ply")).unwrap();
            let line = assert_refused(&run(INTERPOLATE, folder.path(), &taken), &what);
            assert!(
                line.starts_with("error: d/X.petsc: the limit points of this control mesh miss the vertices of"),
                "{line}"
            );
            assert!(!there("back.ply").exists());
        }
    }
    let other = ["torus:9x6", "--quiet", "--solution", "d/X.petsc", "-o", "back.ply"];
    let line = assert_refused(&run(INTERPOLATE, folder.path(), other), "another mesh");
    assert!(line.starts_with("error: d/manifest.json: the hash is"), "{line}");
    let other = ["far.obj", "--scheme", "zheng-cai", "--quiet", "--solution", "d/X.petsc", "-o", "back.ply"];
    let line = assert_refused(&run(INTERPOLATE, folder.path(), other), "another scheme");
    assert!(line.contains("the scheme is \"nasri\" in this manifest, and zheng-cai of the mesh given"), "{line}");
    fs::write(there("d/manifest.json"), "{").unwrap();
    let line = assert_refused(&run(INTERPOLATE, folder.path(), other), "no manifest");
    assert!(line.contains("d/manifest.json, line 1: no JSON"), "{line}");
    fs::remove_file(there("d/manifest.json")).unwrap();
    let line = assert_refused(&run(INTERPOLATE, folder.path(), other), "no manifest");
    assert!(line.contains("d/manifest.json: there is no such file: a solution is read in the folder"), "{line}");
}

#[test]
fn the_format_is_that_of_the_mesh_or_of_the_system() {
    let folder = tempdir().unwrap();
    let tetrahedron = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let arguments = ["-", "--format", "off", "--format", "PETSc", "--out", "d", "--quiet"];
    let output =
        Command::new(ASSEMBLE).current_dir(folder.path()).args(arguments).write_stdin(tetrahedron).output().unwrap();
    assert_done(&output, "a pipe");
    let mut names: Vec<String> =
        fs::read_dir(folder.path().join("d")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["H.petsc", "M.petsc", "R.petsc", "manifest.json", "order.petsc"]);
    for (arguments, what) in [
        (&["--format", "petsc", "--format", "matrix-market"][..], "two formats of one thing"),
        (&["--format", "petsk"], "unknown format \"petsk\" (perhaps petsc?)"),
        (&["--order", "curve"], "are about --format petsc"),
        (&["--index", "64"], "are about --format petsc"),
        (&["--format", "petsc", "--index", "16"], "indices have 32 bits, or 64"),
    ] {
        let output = run(ASSEMBLE, folder.path(), [&["cube", "--out", "e"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(what), "{}", text(&output.stderr));
    }
    fs::write(folder.path().join("dart"), "0 1 10\n").unwrap();
    let darts = ["torus:8x6", "--creases", "dart", "--format", "petsc", "--out", "e", "--quiet"];
    let line = assert_refused(&run(ASSEMBLE, folder.path(), darts), "darts");
    assert!(line.ends_with("use --format matrix-market, which writes all of A"), "{line}");
    let method = ["cube", "--solution", "X.petsc", "--method", "cg", "-o", "v.obj"];
    assert_eq!(run(INTERPOLATE, folder.path(), method).status.code(), Some(2));
}
