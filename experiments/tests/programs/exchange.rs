//! Meshes in and out: pipes, text, what an OBJ file says of its faces, repairs.

use limitlab::mesh::io::{self, Format};
use tempfile::tempdir;

use super::*;

/// Runs a program with `input` on standard input.
fn piped(program: &str, folder: &Path, input: &[u8], arguments: &[&str]) -> Output {
    Command::new(program).current_dir(folder).args(arguments).write_stdin(input).output().unwrap()
}

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

#[test]
fn a_mesh_comes_and_goes_by_pipes() {
    let folder = tempdir().unwrap();
    let text = format!("{TETRAHEDRON}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    fs::write(folder.path().join("a.obj"), &text).unwrap();
    for (name, format) in [("obj", Format::Obj), ("off", Format::Off), ("ply", Format::Ply), ("usda", Format::Usd)] {
        let file = format!("cage.{name}");
        assert_done(&run(INTERPOLATE, folder.path(), ["a.obj", "-o", &file]), name);
        let out = run(INTERPOLATE, folder.path(), ["a.obj", "-o", "-", "--format", name]);
        assert_done(&out, name);
        assert_eq!(without_comments(&out.stdout), content(&folder.path().join(&file)), "{name}");
        // What was written to one pipe is read from another, by every program.
        let cage = io::read_from(&out.stdout[..], format, Path::new("pipe")).unwrap().mesh;
        let again = piped(INTERPOLATE, folder.path(), &out.stdout, &["-", "-o", "-", "--format", name]);
        assert_done(&again, name);
        let finer = io::read_from(&again.stdout[..], format, Path::new("pipe")).unwrap().mesh;
        assert_eq!((finer.len(), &finer.faces), (cage.len(), &cage.faces));
        for program in [ASSEMBLE, COMPARE, SWEEP, SPECTRUM] {
            let arguments = match program {
                ASSEMBLE => vec!["-", "--format", name, "--out", "r"],
                SPECTRUM => vec!["-", "--format", name, "--out", "r", "--json"],
                _ => vec!["-", "--format", name, "--out", "r", "--json", "--method", "pia"],
            };
            let output = piped(program, folder.path(), &out.stdout, &arguments);
            assert_done(&output, program);
            if program != ASSEMBLE {
                assert_eq!(json(&output)["mesh"], "standard input");
            }
        }
    }
    let line = assert_refused(&piped(INTERPOLATE, folder.path(), b"", &["-", "-o", "x.obj"]), "no format");
    assert!(line.contains("standard input: it has no name that tells the format: give --format"), "{line}");
    let cut = &["-", "-o", "x.obj", "--quiet", "--format", "off"];
    let line = assert_refused(&piped(INTERPOLATE, folder.path(), b"OFF\n3 1 0\n0 0", cut), "cut off");
    assert!(line.starts_with("error: standard input, line 3: the file ends"), "{line}");
    for more in [&["--format", "obj", "--json"][..], &[]] {
        let output = run(INTERPOLATE, folder.path(), [&["a.obj", "-o", "-"], more].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(output.stdout.is_empty());
    }
    assert!(!folder.path().join("-").exists() && !folder.path().join("x.obj").exists());
}

#[test]
fn stl_and_gltf_are_read_and_their_cages_written_in_other_formats() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("a.obj"), format!("{TETRAHEDRON}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")).unwrap();
    // The corners of the same faces, in whose order the first of each are those of the vertices 1 3 2 4.
    let points = ["0 0 0", "0 1 0", "1 0 0", "0 0 1"];
    let faces = [[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]];
    let facet = |f: [usize; 3]| {
        let vertices: String = f.map(|v| format!("vertex {}\n", points[v])).concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let stl = format!("solid\n{}endsolid\n", faces.map(facet).concat());
    let coordinates = points.iter().flat_map(|p| p.split(' ').map(|x| x.parse::<f32>().unwrap().to_le_bytes()));
    let binary =
        [coordinates.flatten().collect(), faces.concat().iter().map(|&v| v as u8).collect::<Vec<u8>>()].concat();
    fs::write(path("a.bin"), &binary).unwrap();
    let gltf = serde_json::json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 0, 5]}, {"name": "camera"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60, "uri": "a.bin"}],
    });
    fs::write(path("a.stl"), &stl).unwrap();
    fs::write(path("a.gltf"), gltf.to_string()).unwrap();
    let cage = |arguments: &[&str], input: &[u8]| {
        let output = piped(INTERPOLATE, folder.path(), input, &[arguments, &["-o", "cage.usda"]].concat());
        assert_done(&output, arguments[0]);
        (io::read(&path("cage.usda")).unwrap(), text(&output.stderr).to_owned())
    };
    let (expected, _) = cage(&["a.obj"], b"");
    for (arguments, input, height, joined) in [
        (&["a.stl"][..], "", 0.0, true),
        (&["-", "--format", "stl"], &stl, 0.0, true),
        (&["a.gltf"], "", 5.0, false),
        (&["-", "--format", "glb"], &gltf.to_string(), 5.0, false),
    ] {
        let (found, said) = cage(arguments, input.as_bytes());
        assert_eq!(found.mesh.faces.corners(), faces.concat().iter().map(|&v| v as u32).collect::<Vec<_>>());
        for (v, of_obj) in [0, 2, 1, 3].into_iter().enumerate() {
            let wanted = expected.mesh.positions[of_obj] + glam::DVec3::new(0.0, 0.0, height);
            assert!((found.mesh.positions[v] - wanted).length() < 1e-7, "{arguments:?}: {:?}", found.mesh);
        }
        assert_eq!(
            said.contains("12 corners of triangles lie at 4 positions, each of which is one vertex"),
            joined,
            "{said}"
        );
        assert_eq!(found.stage.is_z_up, if joined { None } else { Some(false) });
    }
    for (output, format) in
        [("x.stl", &[][..]), ("x.GLB", &[]), ("-", &["--format", "stl"]), ("-", &["--format", "gltf"])]
    {
        let arguments = [&["a.obj", "-o", output], format].concat();
        let line = assert_refused(&run(INTERPOLATE, folder.path(), arguments), output);
        let name = if output == "-" { "standard output" } else { output };
        assert!(line.starts_with(&format!("error: {name}: STL and glTF are read and not written")), "{line}");
        assert!(!path(output).exists());
    }
    let line = assert_refused(&run(INTERPOLATE, folder.path(), ["a.bin", "-o", "x.obj"]), "of another kind");
    assert!(line.contains("the name must end in .usda, .obj, .off or .ply; .stl, .glb and .gltf are read"), "{line}");
}

#[test]
fn text_ply_is_written_on_request() {
    let folder = tempdir().unwrap();
    assert_done(&run(INTERPOLATE, folder.path(), ["cube", "-o", "a.ply", "--write-normals"]), "binary");
    assert_done(&run(INTERPOLATE, folder.path(), ["cube", "-o", "b.ply", "--write-normals", "--ascii"]), "text");
    let [binary, ascii] = ["a.ply", "b.ply"].map(|name| io::read(&folder.path().join(name)).unwrap());
    assert_eq!((&binary.mesh, &binary.normals), (&ascii.mesh, &ascii.normals));
    assert!(binary.lines.is_none() && ascii.lines.is_some());
    let output = run(INTERPOLATE, folder.path(), ["cube", "-o", "c.off", "--ascii"]);
    assert!(text(&output.stderr).contains("c.off: --ascii is about .ply"), "{}", text(&output.stderr));
}

#[test]
fn what_an_obj_file_says_of_its_faces_goes_to_the_cage() {
    let folder = tempdir().unwrap();
    let values = "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nvn 0 1 0\n";
    let faces = "mtllib a.mtl\no left\nusemtl wood\ns 1\nf 1/1/1 3/2/1 2/3/1\nf 1/1/2 2/2/2 4/3/2\ng top\ns off\n\
                 f 2 3 4\nf 3//1 1//2 4//1\n";
    fs::write(folder.path().join("a.obj"), format!("{TETRAHEDRON}{values}{faces}")).unwrap();
    let interpolate = |output: &str, more: &[&str]| {
        let run = run(INTERPOLATE, folder.path(), [&["a.obj", "-o", output], more].concat());
        assert_done(&run, output);
        let written = fs::read(folder.path().join(output)).unwrap();
        (text(&run.stderr).to_owned(), String::from_utf8_lossy(&written).into_owned())
    };
    let (remarks, cage) = interpolate("cage.obj", &[]);
    assert!(cage.ends_with(&format!("{values}{faces}")), "{cage}");
    assert!(remarks.contains("cage.obj: its 2 normals (vn) are those of the file"), "{remarks}");
    let (remarks, cage) = interpolate("cage.obj", &["--write-normals"]);
    assert!(cage.contains("f 1/1/1 3/2/3 2/3/2\n") && !remarks.contains("(vn)"), "{cage}");
    let all = "3 texture coordinates (vt), 2 normals (vn), 2 group names (g, o), 2 smoothing groups (s), \
               2 material statements";
    let (remarks, _) = interpolate("cage.off", &[]);
    assert!(remarks.contains(&format!("cage.off: not written: {all}: use .obj")), "{remarks}");
    let (remarks, fine) = interpolate("fine.obj", &["--subdivide", "1"]);
    assert!(remarks.contains(&format!("not written, for they are about the faces of the file: {all}")), "{remarks}");
    assert!(!fine.contains("usemtl"));
}

/// Twelve meshes with damage of all kinds: where the advice names --repair it helps, and where it does not, it would not.
#[test]
fn repair_is_advised_exactly_where_it_helps() {
    let folder = tempdir().unwrap();
    let closed = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let square = "v 2 0 0\nv 2 1 0\nv 3 1 1\n";
    let cases = [
        ("turned", format!("{TETRAHEDRON}f 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"), true),
        ("isolated", format!("{TETRAHEDRON}{square}{closed}"), true),
        ("doubled", format!("{TETRAHEDRON}{closed}f 2 3 1\n"), true),
        ("repeated", format!("{TETRAHEDRON}f 1 3 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4 3\n"), true),
        ("fin", format!("{TETRAHEDRON}v 2 0 0\n{closed}f 1 2 5\n"), true),
        ("bow tie", format!("{TETRAHEDRON}{square}{closed}f 1 5 6\n"), true),
        ("bow tie of two", format!("{TETRAHEDRON}{square}{closed}f 4 5 6\nf 4 6 7\n"), true),
        ("moebius", format!("{TETRAHEDRON}v 3 2 1\nf 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2\n"), true),
        ("no such vertex", format!("{TETRAHEDRON}{closed}f 1 2 9\n"), false),
        ("not a number", format!("v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{closed}f 1 2 3\n"), false),
        ("nothing left", format!("{TETRAHEDRON}f 1 2 1\n"), false),
        ("valence two", format!("{TETRAHEDRON}{closed}v 1 1 1\nv 2 2 2\nv 3 3 5\nf 5 6 7\nf 7 6 5\n"), false),
    ];
    for (what, text, _) in &cases {
        let name = format!("{what}.obj");
        fs::write(folder.path().join(&name), text).unwrap();
        let found = run_on(INTERPOLATE, folder.path(), &name, &["--boundary", "edge-and-corner"]);
        let repaired = run_on(INTERPOLATE, folder.path(), &name, &["--repair", "--json"]);
        if found.status.success() {
            // A boundary that is allowed: nothing is mended.
            assert_eq!(json(&repaired)["repair"], Value::Array(Vec::new()), "{what}");
            continue;
        }
        let line = assert_refused(&found, what);
        if line.contains("--repair") {
            assert_done(&repaired, what);
            let done = json(&repaired)["repair"].as_array().unwrap().clone();
            assert!(!done.is_empty() && done.iter().all(|r| r["count"].as_u64() > Some(0)), "{what}");
            let cage = io::read(&folder.path().join("result.obj")).unwrap().mesh;
            let given = io::read(&folder.path().join(&name)).unwrap().mesh;
            assert!(cage.len() >= given.len(), "{what}");
        } else {
            assert_eq!(assert_refused(&repaired, what), line, "{what}");
        }
    }
    for (what, _, helps) in cases {
        let name = format!("{what}.obj");
        let plain = run_on(INTERPOLATE, folder.path(), &name, &[]);
        assert_eq!(text(&plain.stderr).contains("--repair"), helps, "{what}: {}", text(&plain.stderr));
    }
}

/// What is left to tell of a welded or repaired mesh is told in the numbers of its file.
#[test]
fn places_of_a_mended_mesh_are_those_of_its_file() {
    let folder = tempdir().unwrap();
    // Four triangles and a fin with vertices of their own, whose edge is that of 2 and 5, and a vertex of no face.
    let [o, x, y, z] = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let points = [o, y, x, o, x, z, x, y, z, y, o, z, z, x, "2 2 2", "9 9 9"];
    let points: String = points.iter().map(|p| format!("v {p}\n")).collect();
    let soup = format!("{points}f 1 2 3\nf 4 5 6\nf 7 8 9\nf 10 11 12\nf 13 14 15\n");
    fs::write(folder.path().join("soup.obj"), soup).unwrap();
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "soup.obj", &["--weld"]), "welded");
    for place in ["(face 1, line 18, vertices 2 and 5, 3 face sides)", "(vertex 15, line 16)"] {
        assert!(line.contains(place), "{line}");
    }
    // Vertex 4 has no face, face 4 is a double, face 5 a flat fin at the edge 0–1: its ends are cut off as 6 and 7.
    let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 2 3 1\nf 1 2 6\n";
    fs::write(folder.path().join("fin.obj"), format!("{TETRAHEDRON}v 5 5 5\nv 3 0 0\n{faces}")).unwrap();
    let flags = ["fin.obj", "-o", "cage.obj", "--repair", "--scheme", "catmull-clark"];
    let output = run(INTERPOLATE, folder.path(), flags);
    assert_done(&output, "repaired");
    let remarks = text(&output.stderr);
    for remark in ["2 duplicate positions (first: vertex 6 lies on vertex 0)", "1 zero-area face (first: face 5)"] {
        assert!(remarks.contains(remark), "{remarks}");
    }
}

/// Flags that have no part in what is asked for are named, and no others.
#[test]
fn flags_without_their_method_are_remarked() {
    let folder = tempdir().unwrap();
    let said = |flags: &str| {
        let always = ["icosahedron", "-o", "cage.obj"];
        let output = run(INTERPOLATE, folder.path(), always.into_iter().chain(flags.split(' ')));
        assert_done(&output, flags);
        text(&output.stderr).lines().filter(|line| line.ends_with("not used")).collect::<Vec<_>>().join("; ")
    };
    for (flags, expected) in [
        ("--ite-max 3 --eps 0.1", "--ite-max, --eps without --method two-phase: not used"),
        ("--method two-phase --ite-max 30 --eps 0.1", ""),
        (
            "--scheme catmull-clark --membrane 2",
            "--membrane without --method halstead or fair-refinement, or --shape-handle fair: not used",
        ),
        ("--method halstead --membrane 2 --thin-plate 0.5", ""),
        ("--method fair-refinement --membrane 2 --thin-plate 0.5", ""),
        (
            "--format off",
            "--format without a mesh on standard input or output (-), for names tell their formats: not used",
        ),
    ] {
        assert_eq!(said(flags), expected, "{flags}");
    }
}

#[test]
fn a_repaired_mesh_comes_back_in_the_numbers_of_its_file() {
    let folder = tempdir().unwrap();
    // Vertex 4 has no face, face 1 is turned, face 4 a double, and two more faces stand on the edge 0–1.
    let faces = "f 1 3 2\nf 4 2 1\nf 2 3 4\nf 3 1 4\nf 2 3 1\ng fin\nf 1 2 6\nf 1 6 7\n";
    let tags = "t crease 2/1/0 0 1 10\nt corner 1/1/0 0 10\n";
    let given = format!("{TETRAHEDRON}v 5 5 5\nv 1 -1 0\nv 0 -1 -1\n{faces}{tags}");
    fs::write(folder.path().join("a.obj"), given).unwrap();
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "a.obj", &[]), "damaged");
    assert!(line.ends_with("; --repair makes it valid"), "{line}");
    let flags = ["a.obj", "-o", "cage.obj", "--repair", "--scheme", "catmull-clark"];
    let output = run(INTERPOLATE, folder.path(), flags);
    assert_done(&output, "repaired");
    let remarks = text(&output.stderr);
    for remark in [
        "a.obj: repaired: 1 face on the vertices of another dropped (first: face 4)",
        "a.obj: repaired: 1 face turned round to agree with the neighbours (first: face 1)",
        "a.obj: repaired: 1 edge with more than two faces cut into a side for each (first: vertices 0 and 1)",
        "a.obj: repaired: 1 vertex of no face left out (first: vertex 4)",
    ] {
        assert!(remarks.contains(remark), "{remarks}");
    }
    let cage = io::read(&folder.path().join("cage.obj")).unwrap();
    assert_eq!(cage.mesh.positions[4].to_array(), [5.0, 5.0, 5.0]);
    assert_eq!((cage.mesh.faces.face(0), cage.mesh.faces.face(1)), (&[0, 2, 1][..], &[3, 0, 1][..]));
    // The fin has copies of the ends of its edge after the vertices of the file, sharp as the file says.
    let fin = cage.mesh.faces.face(4);
    assert_eq!((fin[2], fin.iter().filter(|&&v| v >= 7).count()), (5, 2));
    let ends: Vec<_> = cage.tags.creases.iter().map(|c| c.ends).collect();
    assert!(ends.contains(&[0, 1]) && ends.iter().any(|e| e[0] >= 7), "{ends:?}");
    assert!(cage.tags.corners.iter().any(|c| c.vertex >= 7));
    // Its group begins with its face, the number of which is one less now.
    let written = fs::read_to_string(folder.path().join("cage.obj")).unwrap();
    let of_group = written.split("g fin\n").nth(1).and_then(|rest| rest.lines().next());
    assert!(of_group.is_some_and(|face| face.ends_with(" 6")), "{written}");
    // A mesh without defects is as it was.
    assert_done(&run(INTERPOLATE, folder.path(), ["torus:8x6", "-o", "one.ply", "--quiet"]), "plain");
    assert_done(&run(INTERPOLATE, folder.path(), ["torus:8x6", "-o", "two.ply", "--repair", "--quiet"]), "valid");
    let [one, two] = ["one.ply", "two.ply"].map(|name| content(&folder.path().join(name)));
    assert_eq!(one, two);
}
