//! Sharpness in files: read by the programs, written by `interpolate`, read again.

use std::fs;

use limitlab::mesh::io;
use limitlab::mesh::validate::Boundary;
use tempfile::tempdir;

use super::{COMPARE, INTERPOLATE, SPECTRUM, SWEEP, assert_done, assert_refused, json, run, run_on, text};

/// The edges at the top of the built-in cube, as lines `a b sharpness`.
fn top_of_cube() -> String {
    let cube = limitlab::mesh::builtin::builtin("cube").unwrap();
    let top = cube.faces.face(5);
    (0..4).map(|k| format!("{} {} 10\n", top[k], top[(k + 1) % 4])).collect()
}

#[test]
fn a_control_mesh_keeps_its_tags_in_usd_and_obj() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("top.txt"), top_of_cube()).unwrap();
    let lone = fs::read_to_string(folder.path().join("top.txt")).unwrap()[..1].to_owned();
    fs::write(folder.path().join("corner.txt"), format!("{lone} 12\n")).unwrap();
    let tags = ["--creases", "top.txt", "--corners", "corner.txt"];
    for (cage, again) in [("cage.usda", "again.usda"), ("cage.obj", "again.obj")] {
        let solved = |arguments: &[&str]| {
            let output =
                run(INTERPOLATE, folder.path(), [arguments, &["--json", "--scheme", "catmull-clark"]].concat());
            assert_done(&output, cage);
            (json(&output), text(&output.stderr).to_owned())
        };
        let (first, _) = solved(&[&["cube", "-o", cage][..], &tags].concat());
        assert_eq!((&first["creases"], &first["corners"]), (&4.into(), &1.into()));
        let loaded = io::read(&folder.path().join(cage)).unwrap();
        assert_eq!((loaded.tags.creases.len(), loaded.tags.corners.len()), (4, 1));
        assert!(loaded.tags.creases.iter().all(|c| c.sharpness == 10.0));
        assert_eq!(loaded.tags.corners[0].sharpness, 12.0);
        // A closed mesh has no rule of its boundary.
        assert_eq!(loaded.tags.boundary, None);
        // The file alone has the same effect as the flags.
        let (second, remarks) = solved(&[cage, "-o", again]);
        assert_eq!(second["blocks"], first["blocks"]);
        assert!(!remarks.contains("asks for"), "{remarks}");
        assert_eq!(io::read(&folder.path().join(again)).unwrap().tags.creases.len(), 4);
        // Tags of file and flags add up.
        fs::write(folder.path().join("other.txt"), "0 10\n7 10\n").unwrap();
        let (third, _) = solved(&[cage, "-o", again, "--corners", "other.txt"]);
        assert!(third["corners"].as_u64() >= Some(2), "{third}");
    }
    // The surface itself is its faces.
    let output = run(INTERPOLATE, folder.path(), ["icosphere:1", "-o", "surface.usda", "--subdivide", "1"]);
    assert_done(&output, "surface");
    let surface = fs::read_to_string(folder.path().join("surface.usda")).unwrap();
    assert!(surface.contains("subdivisionScheme = \"none\""), "{surface}");
    let cage = fs::read_to_string(folder.path().join("cage.usda")).unwrap();
    assert!(cage.contains("subdivisionScheme = \"catmullClark\""), "{cage}");
    // Formats without tags say so.
    for (name, told) in [("cage.off", true), ("cage.ply", true), ("cage.obj", false)] {
        let output = run(INTERPOLATE, folder.path(), [&["cube", "-o", name][..], &tags].concat());
        assert_done(&output, name);
        let remark = format!("{name}: creases and corners are not written: use .usda or .obj");
        assert_eq!(text(&output.stderr).contains(&remark), told, "{}", text(&output.stderr));
    }
}

/// Two quads beside each other, by a scheme and with more properties from line 7 on.
fn open_scene(scheme: &str, more: &str) -> String {
    format!(
        "#usda 1.0\ndef Mesh \"m\"\n{{\nuniform token subdivisionScheme = \"{scheme}\"\n\
         point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 1), (2, 1, 0)]\n\
         int[] faceVertexCounts = [4, 4] int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]\n{more}\n}}\n"
    )
}

#[test]
fn the_file_s_rule_of_the_boundary_holds_unless_the_flag_is_given() {
    let folder = tempdir().unwrap();
    let rule = "uniform token interpolateBoundary = \"edgeOnly\"";
    fs::write(folder.path().join("a.usda"), open_scene("loop", rule)).unwrap();
    let corners = |flags: &[&str], output: &str| {
        let arguments = [&["a.usda", "-o", output, "--json"][..], flags].concat();
        let run = run(INTERPOLATE, folder.path(), arguments);
        assert_done(&run, output);
        assert!(text(&run.stderr).contains("a.usda: the file asks for loop"), "{}", text(&run.stderr));
        (json(&run)["corners"].as_u64().unwrap(), io::read(&folder.path().join(output)).unwrap().tags.boundary)
    };
    assert_eq!(corners(&[], "b.usda"), (0, Some(Boundary::EdgeOnly)));
    assert_eq!(corners(&[], "b.obj"), (0, Some(Boundary::EdgeOnly)));
    let flag = ["--boundary", "edge-and-corner"];
    assert_eq!(corners(&flag, "b.usda"), (4, Some(Boundary::EdgeAndCorner)));
    assert_eq!(corners(&flag, "b.obj"), (4, Some(Boundary::EdgeAndCorner)));
}

#[test]
fn tags_of_a_file_are_told_at_their_line() {
    let folder = tempdir().unwrap();
    let crease = |ends: &str, sharpness: &str| {
        format!("int[] creaseIndices = [{ends}]\nint[] creaseLengths = [2]\nfloat[] creaseSharpnesses = [{sharpness}]")
    };
    for (more, told) in [
        (crease("0,\n4", "10"), "a.usda, line 7: edge 0–4 is not in the mesh"),
        (crease("1, 4", "-2.5"), "line 9: creaseSharpnesses has at place 0 the sharpness -2.5"),
        (crease("1, 6", "10"), "a.usda, line 7: creaseIndices: vertex 6 is not in the mesh"),
        (
            "int[] cornerIndices = [\n1]\nfloat[] cornerSharpnesses = [-5]".into(),
            "cornerSharpnesses has at place 0 the sharpness -5",
        ),
    ] {
        fs::write(folder.path().join("a.usda"), open_scene("catmullClark", &more)).unwrap();
        let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "a.usda", &[]), &more);
        assert!(line.contains(told), "{line}");
    }
    let quads = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 1\nv 2 1 0\nf 1 2 5 4\nf 2 3 6 5\n";
    fs::write(folder.path().join("a.obj"), format!("{quads}t crease 2/1/0 1 4 10\nt crease 2/1/0 0 5 10\n")).unwrap();
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "a.obj", &[]), "obj");
    assert!(line.contains("a.obj, line 10: edge 0–5 is not in the mesh"), "{line}");
}

/// A dome of 6 × 7 vertices, of triangles, its corners with one triangle or two.
fn dome() -> String {
    let (p, q) = (6, 7);
    let height = |i: usize, j: usize| 0.2 * (i * (p - 1 - i)) as f64 + 0.1 * ((i * j) % 3) as f64;
    let points = (0..p * q).map(|k| format!("v {} {} {}\n", k / q, k % q, height(k / q, k % q)));
    let faces = (0..p - 1).flat_map(|i| (0..q - 1).map(move |j| i * q + j + 1)).map(|a| {
        let [b, c, d] = [a + q, a + q + 1, a + 1];
        format!("f {a} {b} {c}\nf {a} {c} {d}\n")
    });
    points.chain(faces).collect()
}

#[test]
fn surfaces_of_open_triangle_meshes_pass_through_their_points() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("dome.obj"), dome()).unwrap();
    // Along a row inside, from boundary to boundary.
    let crease: String = (0..6).map(|j| format!("{} {} 10\n", 21 + j, 22 + j)).collect();
    fs::write(folder.path().join("row.txt"), crease).unwrap();
    let given = io::read(&folder.path().join("dome.obj")).unwrap().mesh;
    let all_stay = ["butterfly", "labsik-greiner"].map(|name| ["--method", name]);
    for creases in [&[][..], &["--creases", "row.txt"]] {
        for levels in ["1", "2", "3"] {
            let by_sqrt3 = ["--scheme", "sqrt3", "--limit", "--tol", "1e-12"];
            let ways = all_stay.iter().map(|way| &way[..]).chain([&["--alpha", "1"][..], &by_sqrt3]);
            for way in ways {
                let more = [way, creases, &["--subdivide", levels, "--write-normals", "--json"]].concat();
                let output = run_on(INTERPOLATE, folder.path(), "dome.obj", &more);
                assert_done(&output, &format!("{more:?}"));
                assert_eq!(json(&output)["boundary"], 22);
                let found = io::read(&folder.path().join("result.obj")).unwrap();
                let factor = if way.contains(&"butterfly") { 4 } else { 3_usize };
                assert_eq!(found.mesh.faces.len(), given.faces.len() * factor.pow(levels.parse().unwrap()));
                for (a, b) in found.mesh.positions.iter().zip(&given.positions) {
                    assert!(a.distance(*b) < 1e-10, "{more:?}: {a} {b}");
                }
            }
        }
    }
    // Blended with the scheme that approximates, only those marked stay.
    let more = ["--alpha", "0", "--vertices", "0,3,17", "--subdivide", "3", "--limit"];
    assert_done(&run_on(INTERPOLATE, folder.path(), "dome.obj", &more), "alpha");
    let found = io::read(&folder.path().join("result.obj")).unwrap().mesh;
    for (v, (a, b)) in found.positions.iter().zip(&given.positions).enumerate() {
        // A crease vertex between two that lie straight beside it stays too, and so do corners.
        let stays = [0, 3, 17].contains(&v);
        assert!(!stays || a == b, "vertex {v}");
        assert!(v != 16 || a.distance(*b) > 1e-3, "vertex {v}: {a}");
    }
    // A normal at a sharp vertex is refused before anything is solved.
    fs::write(folder.path().join("n.txt"), "17 0 0 1\n2 0 0 1\n").unwrap();
    let more = ["--scheme", "loop", "--subdivide", "2", "--normals", "n.txt", "--max-iter", "1"];
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "dome.obj", &more), "sharp");
    assert!(line.contains("vertex 2 is sharp"), "{line}");
    // A dart has no rule by √3.
    fs::write(folder.path().join("row.txt"), "21 22 10\n22 23 10\n").unwrap();
    let more = ["--method", "labsik-greiner", "--creases", "row.txt", "--subdivide", "2"];
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "dome.obj", &more), "dart");
    assert!(line.contains("vertex 23 is a dart") && line.contains("make it a corner"), "{line}");
    let more = ["--method", "butterfly", "--creases", "row.txt", "--subdivide", "2"];
    assert_done(&run_on(INTERPOLATE, folder.path(), "dome.obj", &more), "dart");
    let more = ["--method", "halstead", "--creases", "row.txt"];
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "dome.obj", &more), "halstead");
    assert!(line.contains("vertex 23 is a dart") && line.contains("make it a corner"), "{line}");
}

/// The fairest surface passes through the points of open and creased meshes, and its control mesh, two refinements down, goes
/// with its own sharp edges and corners.
#[test]
fn the_fairest_surfaces_of_sharp_meshes_and_their_control_meshes() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("dome.obj"), dome()).unwrap();
    let across: String = (0..6).map(|j| format!("{} {} 10\n", 21 + j, 22 + j)).collect();
    let around: String = (0..8).map(|k| format!("{k} {} 10\n", (k + 1) % 8)).collect();
    for (mesh, creases) in [("dome.obj", ""), ("dome.obj", &across[..]), ("torus:5x8", &around)] {
        fs::write(folder.path().join("creases.txt"), creases).unwrap();
        let tags = if creases.is_empty() { &[][..] } else { &["--creases", "creases.txt", "--corners", "corner.txt"] };
        fs::write(folder.path().join("corner.txt"), "3 10\n").unwrap();
        let given = match io::read(&folder.path().join(mesh)) {
            Ok(loaded) => loaded.mesh,
            Err(_) => limitlab::mesh::builtin::builtin(mesh).unwrap(),
        };
        let reaches = |points: &[glam::DVec3], what: &str, within: f64| {
            for (v, (a, b)) in points.iter().zip(&given.positions).enumerate() {
                assert!(a.distance(*b) < within, "{mesh}, {what}, vertex {v}: {a} {b}");
            }
        };
        let fairest = |output: &str, more: &[&str]| {
            let flags = [&[mesh, "-o", output, "--method", "halstead"][..], tags, more].concat();
            assert_done(&run(INTERPOLATE, folder.path(), &flags), mesh);
            io::read(&folder.path().join(output)).unwrap()
        };
        reaches(&fairest("surface.obj", &["--subdivide", "3", "--limit"]).mesh.positions, "surface", 1e-12);
        // USD holds nine digits.
        for (cage, within) in [("cage.usda", 1e-8), ("cage.obj", 1e-12)] {
            let control = fairest(cage, &[]);
            assert_eq!(control.tags.creases.len(), 4 * creases.lines().count());
            // What the file says is all that a reader knows.
            let tags = control.tags;
            let tags = limitlab::mesh::features::Tags {
                boundary: tags.boundary.unwrap_or(Boundary::EdgeOnly),
                creases: tags.creases.iter().map(|c| (c.ends, c.sharpness)).collect(),
                corners: tags.corners.iter().map(|c| (c.vertex, c.sharpness)).collect(),
            };
            let surface = limitlab::mesh::Surface::examined(control.mesh, None, Boundary::EdgeOnly).unwrap();
            let limits = limitlab::schemes::catmull_clark::limit_positions(&surface.tagged(&tags).unwrap()).unwrap();
            reaches(&limits, cage, within);
        }
    }
}

#[test]
fn tags_go_through_welding() {
    let folder = tempdir().unwrap();
    // Two quads with a seam between them, sharp there and at one end of it: 1–2 and 4–7 lie on each other.
    let quads = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 1\nf 1 2 3 4\nf 5 6 7 8\n";
    let tags = "t crease 2/1/0 4 7 10\nt corner 1/1/0 2 10\n";
    fs::write(folder.path().join("a.obj"), format!("{quads}{tags}")).unwrap();
    let output = run_on(INTERPOLATE, folder.path(), "a.obj", &["--weld", "--json"]);
    assert_done(&output, "weld");
    let found = json(&output);
    assert_eq!((&found["vertices"], &found["creases"]), (&6.into(), &1.into()));
    let cage = io::read(&folder.path().join("result.obj")).unwrap();
    assert_eq!(cage.mesh.len(), 8);
    assert_eq!(cage.tags.creases.iter().map(|c| c.ends).collect::<Vec<_>>(), [[1, 2], [4, 7]]);
    assert_eq!(cage.tags.corners.iter().map(|c| c.vertex).collect::<Vec<_>>(), [2, 7]);
    // What is not there is told with the numbers of the file.
    fs::write(folder.path().join("a.obj"), format!("{quads}t crease 2/1/0 6 4 10\n")).unwrap();
    let line = assert_refused(&run_on(INTERPOLATE, folder.path(), "a.obj", &["--weld"]), "no edge");
    assert!(line.contains("a.obj, line 11: edge 6–4 is not in the mesh"), "{line}");
}

/// Surfaces of open and creased meshes; what a refinement has no rule for is refused before a system is solved.
#[test]
fn surfaces_of_sharp_meshes_are_written_or_refused_before_the_work() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("a.usda"), open_scene("catmullClark", "")).unwrap();
    fs::write(folder.path().join("top.txt"), top_of_cube()).unwrap();
    let torus = limitlab::mesh::builtin::builtin("torus:8x6").unwrap();
    let face = torus.faces.face(0);
    let semi_sharp: String = (0..3).map(|k| format!("{} {} 1.5\n", face[k], face[k + 1])).collect();
    fs::write(folder.path().join("semi.txt"), semi_sharp).unwrap();
    fs::write(folder.path().join("dart.txt"), top_of_cube().lines().next().unwrap()).unwrap();
    let surface = |mesh: &str, flags: &[&str]| {
        let output =
            run_on(INTERPOLATE, folder.path(), mesh, &[&["--limit", "--write-normals", "--json"], flags].concat());
        assert_done(&output, mesh);
        let made = io::read(&folder.path().join("result.obj")).unwrap().mesh;
        assert_eq!(json(&output)["surface"]["vertices"], made.len());
        made
    };
    for scheme in ["nasri", "zheng-cai", "mid-edge"] {
        // Eight corners, two points of each of six sides, four corners that rest; two faces, seven quads, six at vertices.
        let made = surface("a.usda", &["--scheme", scheme, "--subdivide", "1"]);
        assert_eq!((made.len(), made.faces.len()), (8 + 12 + 4, 2 + 7 + 6), "{scheme}");
        let top = surface("cube", &["--scheme", scheme, "--subdivide", "2", "--creases", "top.txt"]);
        assert!(top.positions.iter().all(|p| p.is_finite()));
    }
    let two_phase = ["--method", "two-phase", "--shape-handle", "0.7", "--subdivide", "1"];
    assert_eq!(surface("a.usda", &two_phase).len(), 24);
    // Sharpness 1.5 is gone after two levels; vertices keep their numbers.
    for levels in ["0", "1", "2", "3"] {
        let flags = ["--scheme", "catmull-clark", "--subdivide", levels, "--creases", "semi.txt"];
        let made = surface("torus:8x6", &flags);
        for (p, q) in torus.positions.iter().zip(&made.positions) {
            assert!(p.distance(*q) < 1e-9, "{levels} levels: {p} {q}");
        }
    }
    // One iteration would not do, and be told instead.
    let refused = |mesh: &str, flags: &[&str]| {
        let flags = [&["--method", "pia", "--max-iter", "1"], flags].concat();
        assert_refused(&run_on(INTERPOLATE, folder.path(), mesh, &flags), mesh)
    };
    let line = refused("cube", &["--scheme", "nasri", "--creases", "dart.txt", "--subdivide", "1"]);
    assert!(line.contains("is a dart") && line.contains("make it a corner"), "{line}");
    let line = refused("torus:8x6", &["--scheme", "mid-edge", "--creases", "semi.txt", "--subdivide", "1"]);
    assert!(line.contains("is semi-sharp"), "{line}");
    let points: String = (0..16).map(|k| format!("v {} {} {}\n", k / 4, k % 4, k * k % 7)).collect();
    let corner = |k: usize| k + k / 3 + 1;
    let pairs = (0..9).map(corner).map(|v| format!("f {v} {} {}\nf {v} {} {}\n", v + 4, v + 5, v + 5, v + 1));
    let triangles = points + &pairs.collect::<String>();
    fs::write(folder.path().join("t.obj"), triangles).unwrap();
    fs::write(folder.path().join("n.txt"), "1 0 0 1\n").unwrap();
    let line = refused("t.obj", &["--scheme", "zheng-cai", "--normals", "n.txt", "--subdivide", "1"]);
    assert!(line.contains("vertex 1 is sharp"), "{line}");
}

/// A single quad: its corners are all known, and nothing is left to solve.
#[test]
fn a_mesh_without_smooth_vertices_is_one_of_which_all_is_known() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("quad.off"), "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n").unwrap();
    for (program, arguments) in [
        (COMPARE, &["quad.off", "--html", "page.html"][..]),
        (SWEEP, &["quad.off", "--history", "1"]),
        (SPECTRUM, &["quad.off", "--full", "--modes", "2"]),
        (INTERPOLATE, &["quad.off", "-o", "a.obj", "--method", "heavy-ball"]),
    ] {
        let output = run(program, folder.path(), [arguments, &["--quiet"]].concat());
        assert_done(&output, program);
        assert!(!text(&output.stdout).contains("NaN"), "{program}: {}", text(&output.stdout));
    }
    // Of no rows there is no spectrum that a parameter could come from.
    let methods = ["quad.off", "--method", "jacobi,chebyshev,heavy-ball", "--json", "--quiet"];
    let found = json(&run(COMPARE, folder.path(), methods));
    let parameters: Vec<&str> =
        found["rows"].as_array().unwrap().iter().map(|row| row["parameter"].as_str().unwrap()).collect();
    assert_eq!(parameters, ["optimal", "proven", "estimated", "estimated"]);
    let found = json(&run(SPECTRUM, folder.path(), ["quad.off", "--json", "--quiet"]));
    assert_eq!(
        (&found["lambda_min"], &found["lambda_max"], &found["rho"]["pia"]),
        (&1.0.into(), &1.0.into(), &0.0.into())
    );
}
