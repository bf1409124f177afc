//! Whatever a user gives: one line that says what is wrong, and nothing half-written.

use std::path::PathBuf;
use std::process::Stdio;

use limitlab::mesh::io;
use tempfile::{TempDir, tempdir};

use super::*;
use crate::common::collection::{collection, files};
use crate::common::meshes::*;

/// Runs all programs on a mesh that all must refuse. Returns the line of `assemble`.
fn assert_all_refuse(folder: &TempDir, mesh: &str, more: &[&str]) -> String {
    let before = below(folder.path());
    let mut lines = Vec::new();
    for program in ON_MESHES {
        let what = format!("{program} {mesh}");
        lines.push(assert_refused(&run_on(program, folder.path(), mesh, more), &what));
        let result = folder.path().join("result");
        if result.exists() {
            assert_no_files(&result, &what);
            fs::remove_dir(&result).unwrap();
        }
        assert_eq!(below(folder.path()), before, "{what} left files behind");
    }
    // All programs read meshes alike.
    assert!(lines.iter().all(|l| *l == lines[0]), "{lines:#?}");
    lines.swap_remove(0)
}

/// Writes a file and runs all programs on it.
fn refused(name: &str, bytes: &[u8]) -> String {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join(name), bytes).unwrap();
    let line = assert_all_refuse(&folder, name, &[]);
    assert!(line.starts_with(&format!("error: {name}")), "the file is named: {line}");
    line
}

#[test]
fn every_bad_model_is_refused_with_its_reason() {
    let Some(root) = collection() else { return };
    let folder = tempdir().unwrap();
    let bad = files(&root.join("bad"));
    assert!(bad.len() > 25);
    // Open, and otherwise sound: faces without area, holes.
    const SOUND: [&str; 4] = [
        "degtri_sliding_8v.off",
        "elephant_with_holes_2798v.off",
        "non_manifold_face_graph_24v.off",
        "quads_to_stitch_20v.off",
    ];
    for path in bad {
        let name = path.file_name().unwrap().to_str().unwrap();
        if SOUND.contains(&name) {
            continue;
        }
        let absolute = path.canonicalize().unwrap();
        let line = assert_all_refuse(&folder, absolute.to_str().unwrap(), &[]);
        assert!(line.contains(name), "{line}");
        let place = ["face ", "vertex ", "vertices ", "line "].iter().any(|word| line.contains(word));
        assert!(place, "no place is named: {line}");
    }
}

#[test]
fn open_models_are_refused_if_that_is_asked_for() {
    let Some(root) = collection() else { return };
    let folder = tempdir().unwrap();
    for name in ["triangle_3v.off", "cathead_131v.off", "pawn_601v_quad.off"] {
        let path = root.join("open").join(name).canonicalize().unwrap();
        let line = assert_all_refuse(&folder, path.to_str().unwrap(), &["--boundary", "refuse"]);
        assert!(line.contains("boundary edge"), "{line}");
    }
}

#[test]
fn an_open_mesh_is_refused_if_that_is_asked_for_and_the_way_out_is_named() {
    let folder = tempdir().unwrap();
    let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
    fs::write(folder.path().join("open.obj"), text).unwrap();
    let line = assert_all_refuse(&folder, "open.obj", &["--boundary", "refuse"]);
    assert!(line.contains("3 boundary edges") && line.contains("face 0, line 5, vertices 0 and 2"), "{line}");
    assert!(line.contains("leave out --boundary refuse"), "{line}");
}

/// Two triangles side by side with vertices of their own: a seam, unless it is said to be an opening.
#[test]
fn a_seam_is_refused_and_can_be_welded() {
    let folder = tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 -0\nf 1 2 3\nf 4 5 6\n";
    fs::write(folder.path().join("seam.obj"), text).unwrap();
    // A third of the boundary: a remark.
    let output = run_on(INTERPOLATE, folder.path(), "seam.obj", &[]);
    assert_done(&output, INTERPOLATE);
    assert!(!super::text(&output.stderr).contains("join them"), "{}", super::text(&output.stderr));
    // A tetrahedron of four triangles with vertices of their own.
    let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let mut text = String::new();
    for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
        face.iter().for_each(|&v: &usize| text += &format!("v {}\n", points[v]));
    }
    text += "f 1 2 3\nf 4 5 6\nf 7 8 9\nf 10 11 12\n";
    fs::write(folder.path().join("soup.obj"), text).unwrap();
    let line = assert_all_refuse(&folder, "soup.obj", &[]);
    assert!(line.contains("all 12 boundary edges lie on each other") && line.contains("--weld"), "{line}");
    let solved = |flags: &[&str]| {
        let output = run_on(INTERPOLATE, folder.path(), "seam.obj", &[flags, &["--json"]].concat());
        assert_done(&output, INTERPOLATE);
        json(&output)
    };
    let open = solved(&["--boundary", "edge-only"]);
    assert_eq!((&open["vertices"], &open["boundary"]), (&6.into(), &6.into()));
    let welded = solved(&["--weld", "--boundary", "edge-only"]);
    assert_eq!((&welded["vertices"], &welded["boundary"]), (&4.into(), &4.into()));
    // Vertices are called by the file's numbers: 3 is where 1 is, and edge 3–4 is one of the second triangle.
    fs::write(folder.path().join("tags.txt"), "3 4 10\n").unwrap();
    let tagged = solved(&["--weld", "--creases", "tags.txt", "--vertices", "3..5"]);
    assert_eq!((&tagged["vertices"], &tagged["interpolated"]), (&4.into(), &3.into()));
    // The control mesh has the file's vertices and faces.
    let cage = io::read(&folder.path().join(welded["output"].as_str().unwrap())).unwrap().mesh;
    assert_eq!((cage.len(), cage.faces.face(1)), (6, &[3, 4, 5][..]));
    assert_eq!((cage.positions[1], cage.positions[2]), (cage.positions[3], cage.positions[5]));
    // Tools join them if they are told to.
    let output = run(INTERPOLATE, folder.path(), ["seam.obj", "--weld", "-o", "result.obj"]);
    assert!(super::text(&output.stderr).contains("join them first"), "{}", super::text(&output.stderr));
}

/// Tags that are none, each with its place.
#[test]
fn sharp_edges_and_vertices_that_are_none_are_told_at_their_line() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("tags.txt");
    for (flag, text, expected) in [
        ("--creases", "0 1 10\n0 6 10\n", "line 2: edge 0–6 is not in the mesh"),
        ("--creases", "# two\n0 1\n", "a finite number of a line `a b sharpness`"),
        ("--creases", "0 1 -3\n", "line 1: edge 0–1 has the sharpness -3"),
        ("--creases", "0 1 nan\n", "\"nan\" is not a finite number of a line `a b sharpness`"),
        ("--creases", "0 9 10\n", "line 1: vertex 9 is not in the mesh"),
        ("--creases", "# none\n", "has no line `a b sharpness`: leave the file out"),
        ("--corners", "", "has no line `vertex sharpness`: leave the file out"),
        ("--corners", "8 10\n", "line 1: vertex 8 is not in the mesh"),
        ("--corners", "1 10 10\n", "\"10\" is not the end of a line `vertex sharpness`"),
    ] {
        fs::write(&file, text).unwrap();
        let line = assert_all_refuse(&folder, "cube", &[flag, "tags.txt"]);
        assert!(line.contains(expected), "{text:?}: {line}");
    }
    fs::write(&file, "1 10\n").unwrap();
    let line = assert_all_refuse(&folder, "icosphere:1", &["--corners", "tags.txt", "--boundary", "as-interior"]);
    assert!(line.contains("contradict"), "{line}");
}

#[test]
fn missing_files_folders_and_unknown_names() {
    let folder = tempdir().unwrap();
    let line = assert_all_refuse(&folder, "missing.obj", &[]);
    assert!(line.contains("missing.obj: cannot read"), "{line}");
    fs::create_dir(folder.path().join("folder.off")).unwrap();
    fs::create_dir(folder.path().join("folder")).unwrap();
    for name in ["folder.off", "folder"] {
        let line = assert_all_refuse(&folder, name, &[]);
        assert!(line.contains(name), "{line}");
    }
    for name in
        ["cub", "torus", "torus:8", "torus:2x5", "torus:ax5", "prism:2", "icosphere:99", "", "torus:99999999x99999999"]
    {
        let line = assert_all_refuse(&folder, name, &[]);
        assert!(line.contains(&format!("`{name}`")), "{line}");
    }
    let line = assert_all_refuse(&folder, "cub", &[]);
    assert!(line.contains("cube") && line.contains("quad-sphere:K"), "the names are listed: {line}");
    fs::write(folder.path().join("mesh.3ds"), "solid").unwrap();
    let line = assert_all_refuse(&folder, "mesh.3ds", &[]);
    assert!(line.contains(".usda, .obj, .off or .ply"), "{line}");
    let line = assert_all_refuse(&folder, "cube", &["--scheme", "loop"]);
    assert!(line.contains("face 0 has 4 corners"), "{line}");
}

#[test]
fn garbage_is_refused_in_every_format() {
    let noise: Vec<u8> = (0..4000u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for name in ["x.obj", "x.off", "x.ply", "x.usda"] {
        for bytes in [&b""[..], b"\n\n\n", b"\0\0\0\0", b"\xff\xfe\xfd", b"hello world\n", &noise] {
            refused(name, bytes);
        }
    }
    for text in
        ["v 1 2\nf 1 2 3\n", "v 0 0 0\nf 1 2\n", "v a b c\n", "v 0 0 0\nf 0 1 2\n", "v 0 0 0\nf 1 2 99999999999\n"]
    {
        refused("x.obj", text.as_bytes());
    }
    for text in [
        "OFF",
        "OFF\n",
        "OFF\n3 1\n",
        "OFF\n-3 1 0\n",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
        "4OFF\n1 0 0\n0 0 0 0\n",
        "OFF BINARY\n",
    ] {
        refused("x.off", text.as_bytes());
    }
    for text in ["ply", "ply\nformat ascii 2.0\nend_header\n", "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n"]
    {
        refused("x.ply", text.as_bytes());
    }
}

#[test]
fn truncated_files_are_refused() {
    let folder = tempdir().unwrap();
    let mesh = noisy("icosphere:1");
    for name in ["good.obj", "good.off", "good.ply", "good.usda"] {
        let path = folder.path().join(name);
        io::write(&path, &mesh, None).unwrap();
        let bytes = fs::read(&path).unwrap();
        for part in [3, 10, 50, 90, 99] {
            refused(name, &bytes[..bytes.len() * part / 100]);
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_their_place() {
    let folder = tempdir().unwrap();
    let mesh = built_in("octahedron");
    for name in ["x.obj", "x.off", "x.ply", "x.usda"] {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut mesh = mesh.clone();
            mesh.positions[4].y = bad;
            let path = folder.path().join(name);
            io::write(&path, &mesh, None).unwrap();
            let line = refused(name, &fs::read(&path).unwrap());
            assert!(line.contains("vertex 4"), "{line}");
        }
    }
    let line = refused("x.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    assert!(line.contains("line 1"), "{line}");
    // Finite as text, not as a double.
    refused("x.obj", b"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
}

#[test]
fn absurd_counts_ask_for_no_memory() {
    const MANY: &str = "1000000000000";
    let vertices = format!("OFF\n{MANY} 1 0\n0 0 0\n");
    let faces = format!("OFF\n1 {MANY} 0\n0 0 0\n");
    let corners = format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{MANY} 0 1 2\n");
    for text in [vertices, faces, corners] {
        refused("x.off", text.as_bytes());
    }
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces) in [(MANY, "1"), ("1", MANY)] {
            let header = format!(
                "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
                 property double z\nelement face {faces}\nproperty list uint int vertex_indices\nend_header\n"
            );
            let mut bytes = header.into_bytes();
            bytes.extend(b"0 0 0\n");
            bytes.extend([0xff; 64]);
            refused("x.ply", &bytes);
        }
    }
}

#[test]
fn runs_that_do_not_converge_leave_no_control_mesh() {
    let folder = tempdir().unwrap();
    for (mesh, more, reason) in [
        ("cube", &["--noise", "0.1"][..], "a part that no control mesh reaches"),
        ("cube", &["--noise", "0.1", "--method", "pia"], "stagnated"),
        ("cube", &["--noise", "0.1", "--method", "cholesky"], "singular"),
        ("cube", &["--method", "lu"], "singular"),
        ("icosphere:1", &["--max-iter", "1"], "max-iterations"),
        ("icosphere:1", &["--max-iter", "0", "--method", "cg"], "max-iterations"),
        ("icosphere:1", &["--tol", "1e-30", "--method", "pia"], "rounding"),
    ] {
        let mut arguments = vec![mesh, "-o", "v.obj", "--quiet"];
        arguments.extend(more);
        let line = assert_refused(&run(INTERPOLATE, folder.path(), &arguments), mesh);
        assert!(line.contains(reason) && line.contains("; "), "{line}");
        assert_no_files(folder.path(), mesh);
        // A file that was there stays as it was.
        let kept = folder.path().join("v.obj");
        fs::write(&kept, "precious").unwrap();
        assert_refused(&run(INTERPOLATE, folder.path(), &arguments), mesh);
        assert_eq!(fs::read_to_string(&kept).unwrap(), "precious");
        fs::remove_file(kept).unwrap();
    }
    // The cube's own points have a control mesh, which iterations find.
    let output = run(INTERPOLATE, folder.path(), ["cube", "-o", "v.obj", "--method", "pia", "--quiet"]);
    assert_done(&output, "pia on the cube");
}

/// An octahedron, as the text of an OBJ file.
fn octahedron(to: impl Fn(f64) -> f64) -> String {
    let points =
        [[1.1, 0.1, 0.0], [0.0, 0.9, 0.1], [0.1, 0.0, 1.2], [-0.9, 0.1, 0.0], [0.0, -1.1, 0.1], [0.0, 0.1, -0.8]];
    let rows = points.map(|p| format!("v {:?} {:?} {:?}\n", to(p[0]), to(p[1]), to(p[2])));
    rows.concat() + "f 1 2 3\nf 2 4 3\nf 4 5 3\nf 5 1 3\nf 2 1 6\nf 4 2 6\nf 5 4 6\nf 1 5 6\n"
}

#[test]
fn noise_comes_after_validation() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("x.obj"), octahedron(|x| x).replace("f 1 5 6", "f 1 5 9")).unwrap();
    fs::write(folder.path().join("x.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n").unwrap();
    for (mesh, noise, place) in [("x.obj", "0.1", "line 14"), ("x.obj", "0", "line 14"), ("x.off", "0.1", "line 6")] {
        let line = assert_all_refuse(&folder, mesh, &["--noise", noise]);
        assert!(line.contains("out of range") && line.contains(place), "{line}");
    }
    let output = run_on(SPECTRUM, folder.path(), "x.obj", &["--noise", "0.1"]);
    assert!(assert_refused(&output, "spectrum").contains("line 14"));
    let output = run_on(ASSEMBLE, folder.path(), "x.obj", &["--noise", "0.1", "--defects"]);
    assert_eq!(json(&output)["totals"]["index-out-of-range"], 1);
    fs::remove_dir(folder.path().join("result")).unwrap();
    // Beyond the largest double.
    fs::write(folder.path().join("x.obj"), octahedron(|x| x * 1e300)).unwrap();
    let line = assert_all_refuse(&folder, "x.obj", &["--noise", "1e20"]);
    assert!(line.contains("vertex 0, line 1") && line.contains("--noise 1e20:1"), "{line}");
}

#[test]
fn sizes_that_doubles_cannot_hold_together_name_the_vertex() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("x.obj"), octahedron(|x| if x == 1.2 { 1e-200 } else { x * 1e200 })).unwrap();
    let line = assert_all_refuse(&folder, "x.obj", &[]);
    assert!(line.contains("vertex 2, line 3"), "{line}");
}

#[test]
fn points_that_coincide_need_an_absolute_tolerance() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("x.obj"), octahedron(|_| 3.0)).unwrap();
    for program in [INTERPOLATE, COMPARE, SWEEP] {
        let line = assert_refused(&run_on(program, folder.path(), "x.obj", &[]), program);
        assert!(line.contains("all points coincide") && line.contains("--tol-absolute"), "{line}");
        assert_done(&run_on(program, folder.path(), "x.obj", &["--tol-absolute", "1e-9"]), program);
    }
    // The matrix has its spectrum all the same.
    let output = run_on(SPECTRUM, folder.path(), "x.obj", &["--json"]);
    assert_done(&output, "spectrum");
    assert!(json(&output)["lambda_min"].as_f64().unwrap() > 0.1);
    assert!(json(&output)["promised_iterations"]["pia"].is_null());
}

/// Whoever follows the advice of a failed run arrives at a control mesh.
#[test]
fn advice_helps_and_never_names_what_failed() {
    let folder = tempdir().unwrap();
    let words = |line: &str| -> Vec<String> {
        let advice = line.rsplit("; ").next().unwrap();
        advice.split([' ', ',']).map(|w| w.trim_matches('.').to_owned()).collect()
    };
    let mut runs: Vec<Vec<&str>> = ["lu", "cholesky", "ldlt", "pia", "jacobi", "gauss-seidel", "cg", "pcg-ic0", "auto"]
        .iter()
        .map(|method| vec!["cube", "--noise", "0.1", "--method", method])
        .collect();
    runs.extend(["lu", "cholesky", "ldlt", "pcg-ic0"].map(|method| vec!["cube", "--method", method]));
    for method in ["pia", "cg", "lu", "auto"] {
        runs.push(vec!["icosphere:1", "--tol", "1e-30", "--method", method]);
    }
    for arguments in runs {
        let all = [&arguments[..], &["-o", "v.obj", "--quiet"]].concat();
        let line = assert_refused(&run(INTERPOLATE, folder.path(), all), "a run that fails");
        let words = words(&line);
        let failed = arguments.last().unwrap();
        let flags: Vec<&[String]> = words.windows(2).filter(|w| w[0].starts_with("--")).collect();
        assert!(!flags.is_empty() && flags.iter().all(|w| w[1] != *failed), "{line}");
        // Each alternative: a flag, and those that go with it.
        for alternative in words.split(|w| w == "or") {
            let pairs: Vec<&[String]> = alternative.windows(2).filter(|w| w[0].starts_with("--")).collect();
            let mut command: Vec<&str> = arguments.clone();
            for pair in &pairs {
                if let Some(at) =
                    command.iter().position(|a| *a == pair[0] || (*a == "--tol" && pair[0] == "--tol-absolute"))
                {
                    command.drain(at..at + 2);
                }
                command.extend([pair[0].as_str(), pair[1].as_str()]);
            }
            command.extend(["-o", "v.obj", "--quiet"]);
            assert_done(&run(INTERPOLATE, folder.path(), &command), &format!("{command:?} after {line}"));
        }
    }
}

#[test]
fn methods_without_omega_are_bad_arguments_of_a_sweep() {
    let folder = tempdir().unwrap();
    let output = run(SWEEP, folder.path(), ["octahedron", "--method", "pia,cg", "--out", "result"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("cg has no ω to sweep; choose among jacobi, pia and sor"));
}

#[test]
fn omega_may_have_any_size() {
    let folder = tempdir().unwrap();
    for (grid, values) in [("1e-13:3e-13:1e-13", vec![1e-13, 2e-13, 3e-13]), ("1e297:1e297:1", vec![1e297])] {
        for mesh in ["octahedron", "icosphere:3"] {
            let arguments = [mesh, "--omega", grid, "--max-iter", "3", "--json", "--quiet", "--out", "result"];
            let output = run(SWEEP, folder.path(), arguments);
            assert_done(&output, grid);
            let report = json(&output);
            let rows = report["rows"].as_array().unwrap();
            let omegas: Vec<f64> = rows.iter().map(|r| r["omega"].as_f64().unwrap()).collect();
            assert_eq!(omegas, [values.clone(), values.clone(), values.clone()].concat(), "{grid} on {mesh}");
            assert!(rows.iter().all(|r| r["status"] != "converged"));
        }
    }
}

#[test]
fn normals_without_direction_are_told_shortly() {
    let folder = tempdir().unwrap();
    let refuse = |normal: &str| {
        fs::write(folder.path().join("n.txt"), format!("0 {normal}\n")).unwrap();
        run(
            INTERPOLATE,
            folder.path(),
            ["icosahedron", "--normals", "n.txt", "--subdivide", "2", "-o", "v.obj", "--quiet"],
        )
    };
    let line = assert_refused(&refuse("1e-300 nan 0"), "no number");
    assert!(line.contains("n.txt, line 1: \"nan\" is not a finite number"), "{line}");
    let line = assert_refused(&refuse("0 0 0"), "no length");
    assert!(line.contains("vertex 0: (0, 0, 0) has no direction"), "{line}");
    for normal in ["1e300 1e300 1e300", "1e-200 0 1e-200", "0 1e-310 0"] {
        assert_done(&refuse(normal), normal);
    }
}

#[test]
fn hints_about_a_boundary_fit_the_mesh() {
    let folder = tempdir().unwrap();
    let mut quads = built_in("torus:4x5");
    quads.faces = limitlab::mesh::Faces::from_lists(quads.faces.iter().skip(1));
    io::write(&folder.path().join("x.obj"), &quads, None).unwrap();
    let line = assert_all_refuse(&folder, "x.obj", &["--boundary", "refuse"]);
    assert!(line.contains("leave out --boundary refuse") && !line.contains("as-interior"), "{line}");
    for (scheme, way_out) in [("catmull-clark", ": --boundary edge-and-corner"), ("loop", "triangulate the mesh")] {
        let line = assert_all_refuse(&folder, "x.obj", &["--boundary", "as-interior", "--scheme", scheme]);
        assert!(!line.contains("--scheme") && line.ends_with(way_out), "{line}");
    }
}

#[test]
fn defects_are_printed_as_json() {
    let folder = tempdir().unwrap();
    // Vertex 4 is isolated, the face on line 8 is turned round.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\nf 1 3 2\nf 1 2 4\nf 2 4 3\nf 3 1 4\n";
    fs::write(folder.path().join("x.obj"), text).unwrap();
    for program in ON_MESHES {
        let output = run_on(program, folder.path(), "x.obj", &["--defects"]);
        assert_done(&output, program);
        let report = json(&output);
        assert_eq!(report["valid"], false);
        assert_eq!(report["totals"]["isolated-vertex"], 1);
        assert_eq!(report["totals"]["inconsistent-orientation"], 3);
        let defects = report["defects"].as_array().unwrap();
        assert_eq!(defects.len(), 4);
        assert!(defects.iter().all(|d| d["line"].is_u64()), "{report}");
        let output = run_on(program, folder.path(), "tetrahedron", &["--defects"]);
        assert_eq!(json(&output)["valid"], true);
    }
    assert_eq!(below(folder.path()).iter().filter(|n| n.ends_with("obj")).count(), 1);
    // Of several meshes one object, and no folder for files that there are not.
    for program in [COMPARE, SPECTRUM, SWEEP] {
        let output = run_on(program, folder.path(), "x.obj", &["cube", "--defects"]);
        assert_done(&output, program);
        let results = json(&output)["results"].as_array().unwrap().clone();
        assert_eq!(results.iter().map(|report| report["valid"] == true).collect::<Vec<_>>(), [false, true]);
        assert!(!folder.path().join("result").exists());
    }
}

#[test]
fn the_output_s_name_tells_its_format() {
    let folder = tempdir().unwrap();
    for name in ["v", "v.stl", "v.obj.bak"] {
        let output = run(INTERPOLATE, folder.path(), ["cube", "-o", name, "--quiet", "--method", "pia"]);
        let line = assert_refused(&output, name);
        assert!(line.contains(name) && line.contains(".usda, .obj, .off or .ply"), "{line}");
    }
    #[cfg(unix)]
    {
        // Standard streams have no ending: OBJ.
        let output = run(INTERPOLATE, folder.path(), ["cube", "-o", "/dev/stdout", "--quiet", "--method", "pia"]);
        assert!(output.status.success() && text(&output.stdout).starts_with("v "), "{output:?}");
    }
    let output = run(INTERPOLATE, folder.path(), ["cube", "-o", "no/such/v.obj", "--quiet", "--method", "pia"]);
    let line = assert_refused(&output, "missing folder");
    assert!(line.contains("there is no folder"), "{line}");
    fs::create_dir(folder.path().join("dir.obj")).unwrap();
    let output = run(INTERPOLATE, folder.path(), ["cube", "-o", "dir.obj", "--quiet", "--method", "pia"]);
    assert!(assert_refused(&output, "a folder").contains("it is a folder"));
    assert_no_files(folder.path(), "refused outputs");
    // A file where the folder for the results should be.
    fs::write(folder.path().join("file"), "").unwrap();
    for program in [ASSEMBLE, COMPARE, SWEEP, REPRODUCE] {
        let mut arguments = vec!["--out", "file", "--quiet"];
        if program != REPRODUCE {
            arguments.push("octahedron");
        }
        let line = assert_refused(&run(program, folder.path(), arguments), program);
        assert!(line.contains("file"), "{line}");
    }
    assert_eq!(fs::read(folder.path().join("file")).unwrap(), b"");
}

#[cfg(target_os = "linux")]
mod linux {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn places_that_cannot_be_written_are_errors() {
        let folder = tempdir().unwrap();
        for program in ON_MESHES {
            let arguments = match program {
                INTERPOLATE => vec!["octahedron", "-o", "/proc/v.obj", "--quiet"],
                _ => vec!["octahedron", "--out", "/proc/results", "--quiet"],
            };
            let line = assert_refused(&run(program, folder.path(), arguments), program);
            assert!(line.contains("/proc/"), "{line}");
        }
        let output = run(REPRODUCE, folder.path(), ["--out", "/proc/results", "--quiet", "--only", "pia-table1"]);
        assert_refused(&output, "reproduce");
    }

    #[test]
    fn a_full_disk_is_an_error() {
        let folder = tempdir().unwrap();
        let full = |name: &str| {
            let path = folder.path().join(name);
            symlink("/dev/full", &path).unwrap();
            path
        };
        let control = full("v.off");
        let output = run(INTERPOLATE, folder.path(), ["icosphere:2", "-o", "v.off", "--quiet"]);
        let line = assert_refused(&output, "interpolate");
        assert!(line.contains("v.off: cannot write"), "{line}");
        assert!(control.is_symlink());
        // The third of five files: the others do not appear.
        fs::create_dir(folder.path().join("m")).unwrap();
        full("m/H.mtx");
        let output = run(ASSEMBLE, folder.path(), ["icosphere:2", "--out", "m", "--quiet"]);
        assert!(assert_refused(&output, "assemble").contains("H.mtx"));
        assert_eq!(below(&folder.path().join("m")), ["H.mtx"]);
    }

    #[test]
    fn standard_output_that_is_full_is_an_error_and_one_that_is_closed_is_none() {
        let folder = tempdir().unwrap();
        let arguments: [(&str, &[&str]); 5] = [
            (ASSEMBLE, &["octahedron", "--out", "m", "--json", "--quiet"]),
            (INTERPOLATE, &["octahedron", "-o", "v.obj", "--json", "--quiet"]),
            (COMPARE, &["octahedron", "--method", "pia", "--quiet"]),
            (SWEEP, &["octahedron", "--method", "pia", "--omega", "1:1:1", "--quiet"]),
            (REPRODUCE, &["--list"]),
        ];
        for (program, arguments) in arguments {
            let command = |stdout: Stdio| {
                let mut command = std::process::Command::new(program);
                command.current_dir(folder.path()).args(arguments).stdout(stdout);
                command
            };
            let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
            let output = command(full.into()).stderr(Stdio::piped()).output().unwrap();
            let line = assert_refused(&output, program);
            assert!(line.contains("standard output"), "{line}");

            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            let output = command(writer.into()).stderr(Stdio::piped()).output().unwrap();
            assert_done(&output, program);
        }
    }

    #[test]
    fn links_are_followed_and_stay_links() {
        let folder = tempdir().unwrap();
        let path = |name: &str| -> PathBuf { folder.path().join(name) };
        fs::create_dir(path("deep")).unwrap();
        symlink("deep/target.ply", path("link.obj")).unwrap();
        let output = run(INTERPOLATE, folder.path(), ["octahedron", "-o", "link.obj", "--quiet"]);
        assert_done(&output, "through a link");
        assert!(path("link.obj").is_symlink());
        // The name that was asked for tells the format.
        assert!(fs::read_to_string(path("deep/target.ply")).unwrap().contains("\nv "));
        let linked = io::read(&path("link.obj")).unwrap().mesh;
        assert_eq!(linked.faces, built_in("octahedron").faces);

        // A link with a known ending is the way to standard output.
        symlink("/dev/stdout", path("out.off")).unwrap();
        let output = run(INTERPOLATE, folder.path(), ["octahedron", "-o", "out.off", "--quiet"]);
        assert_done(&output, "to standard output");
        assert!(text(&output.stdout).starts_with("OFF"));
        assert_eq!(text(&without_comments(&output.stdout)).lines().count(), 2 + 6 + 8);
        assert_eq!(below(folder.path()), ["deep", "deep/target.ply", "link.obj", "out.off"]);
    }

    #[test]
    fn a_mesh_may_be_replaced_by_its_own_control_mesh() {
        let folder = tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        let mesh = noisy("irregular-tri:100");
        io::write(&path, &mesh, None).unwrap();
        let output = run(INTERPOLATE, folder.path(), ["mesh.ply", "-o", "mesh.ply", "--quiet"]);
        assert_done(&output, "in place");
        let control = io::read(&path).unwrap().mesh;
        assert_eq!(control.faces, mesh.faces);
        assert!(distance(&control.positions, &mesh.positions) > 1e-3);
        assert_eq!(below(folder.path()), ["mesh.ply"]);
    }
}
