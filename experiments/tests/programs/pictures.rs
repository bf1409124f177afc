//! Pictures of one's own mesh: slowest modes and errors at its vertices as PLY, CSV and figures; mesh, cage and surface.

use std::collections::BTreeMap;

use limitlab::assemble::{LimitSystem, Stages};
use limitlab::mesh::features::Tags;
use limitlab::mesh::{Surface, io};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Stop, run as solve};
use tempfile::tempdir;

use super::*;

/// The columns of the vertices of a binary PLY file with bytes as colours and doubles, read by the letter of its header.
fn vertex_columns(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let bytes = fs::read(path).unwrap();
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let header = text(&bytes[..at]);
    let count = header.lines().find_map(|line| line.strip_prefix("element vertex ")).unwrap().parse().unwrap();
    let properties: Vec<(&str, &str)> = header
        .lines()
        .filter_map(|line| line.strip_prefix("property ")?.split_once(' '))
        .filter(|(kind, _)| *kind != "list")
        .collect();
    let mut rest = &bytes[at..];
    let mut columns = BTreeMap::new();
    for _ in 0..count {
        for (kind, name) in &properties {
            let (head, tail) = rest.split_at(if *kind == "uchar" { 1 } else { 8 });
            let value = if *kind == "uchar" { head[0].into() } else { f64::from_le_bytes(head.try_into().unwrap()) };
            columns.entry((*name).to_owned()).or_insert_with(Vec::new).push(value);
            rest = tail;
        }
    }
    columns
}

fn is_picture(path: &Path) -> bool {
    let head: &[u8] = match path.extension().unwrap().to_str().unwrap() {
        "png" => b"\x89PNG",
        "svg" => b"<?xml",
        _ => b"%PDF",
    };
    fs::read(path).is_ok_and(|bytes| bytes.starts_with(head))
}

#[test]
fn modes_of_the_icosahedron_have_the_multiplicities_of_its_graph() {
    let folder = tempdir().unwrap();
    let flags = ["icosahedron", "--modes", "4", "--json", "--quiet", "--figure", "png,svg"];
    let output = run(SPECTRUM, folder.path(), flags);
    assert_done(&output, "icosahedron");
    let found = json(&output);
    let clusters = found["mode_clusters"].as_array().unwrap();
    let of = |field: &str| -> Vec<Value> { clusters.iter().map(|c| c[field].clone()).collect() };
    assert_eq!((of("multiplicity"), of("complete")), (vec![3.into(), 5.into()], vec![true.into(), true.into()]));
    // A is a multiple of the graph's matrix and one of I, with 1 at its eigenvalue 5; the others are √5, −1 and −√5.
    let [low, next] = [0, 1].map(|k| 1.0 - clusters[k]["value"].as_f64().unwrap());
    assert!((low / next - (5.0 + 5f64.sqrt()) / 6.0).abs() < 1e-12, "{low} {next}");
    assert_eq!(found["modes"].as_array().unwrap().len(), 4);

    let stem = folder.path().join("out/spectrum-modes-icosahedron-loop");
    assert!(["png", "svg"].iter().all(|ending| is_picture(&stem.with_extension(ending))));
    let table = fs::read_to_string(stem.with_extension("md")).unwrap();
    assert!(table.lines().any(|line| line.starts_with("| 1–3 ") && line.contains("| 3 ")), "{table}");
    let mut reader = csv(&folder.path().join("out/spectrum-modes-icosahedron-loop-vertices.csv"));
    assert_eq!(reader.headers().unwrap(), ["vertex", "mode_1", "mode_2", "mode_3", "mode_4"].as_slice());
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.unwrap()).collect();
    assert_eq!((rows.len(), &rows[0][0], &rows[1][0], &rows[12][0]), (13, "eigenvalue", "0", "11"));
    let written = vertex_columns(&stem.with_extension("ply"));
    for k in 1..=4 {
        let value: f64 = rows[0][k].parse().unwrap();
        assert!((value - found["modes"][k - 1]["value"].as_f64().unwrap()).abs() < 1e-9);
        for v in 0..12 {
            let entry: f64 = rows[v + 1][k].parse().unwrap();
            assert!((entry - written[&format!("mode_{k}")][v]).abs() < 1e-9);
        }
    }
    // Red where the first mode is 1, blue where it is −1.
    let at = |x: f64| written["mode_1"].iter().position(|value| (value - x).abs() < 1e-12);
    let colour = |v: usize| ["red", "green", "blue"].map(|name| written[name][v]);
    assert_eq!(at(1.0).map(colour), Some([180.0, 4.0, 38.0]));
    assert_eq!(at(-1.0).map(colour), Some([59.0, 76.0, 192.0]));
}

/// A torus with a sharp ring, and a vertex of no face before it.
fn write_creased(folder: &Path) -> Vec<[u32; 2]> {
    let torus = limitlab::mesh::builtin::builtin("torus:9x7").unwrap();
    let mut lines = format!("OFF\n{} {} 0\n5 5 5\n", torus.len() + 1, torus.faces.len());
    torus.positions.iter().for_each(|p| lines += &format!("{} {} {}\n", p.x + 0.1 * p.y * p.z, p.y, p.z));
    for face in torus.faces.iter() {
        let corners: Vec<String> = face.iter().map(|v| (v + 1).to_string()).collect();
        lines += &format!("{} {}\n", face.len(), corners.join(" "));
    }
    fs::write(folder.join("m.off"), lines).unwrap();
    // One way around, of 7 vertices: a curve without ends.
    let creases: Vec<[u32; 2]> = (0..7).map(|k| [k, (k + 1) % 7]).collect();
    let text: String = creases.iter().map(|[a, b]| format!("{} {} 10\n", a + 1, b + 1)).collect();
    fs::write(folder.join("c.txt"), text).unwrap();
    creases
}

const ON_CREASED: [&str; 7] = ["m.off", "--repair", "--creases", "c.txt", "--json", "--quiet", "--figure"];

/// The mesh of [`write_creased`] without its first vertex, which has no face.
fn creased(folder: &Path) -> (Surface, Stages) {
    let creases = write_creased(folder);
    let mut mesh = io::read(&folder.join("m.off")).unwrap().mesh;
    mesh.positions.remove(0);
    mesh.faces.corners_mut().iter_mut().for_each(|v| *v -= 1);
    let tags = Tags { creases: creases.into_iter().map(|ends| (ends, 10.0)).collect(), ..Tags::default() };
    let surface = Surface::new(mesh).unwrap().tagged(&tags).unwrap();
    let stages = Stages::new(&surface, Scheme::CatmullClark, None).unwrap();
    (surface, stages)
}

#[test]
fn modes_of_a_creased_mesh_are_those_of_its_smooth_vertices() {
    let folder = tempdir().unwrap();
    let (surface, stages) = creased(folder.path());
    let output = run(SPECTRUM, folder.path(), ON_CREASED.iter().chain(&["pdf", "--modes", "3"]));
    assert_done(&output, "creased");
    let found = json(&output);
    let stem = folder.path().join("out/spectrum-modes-m-catmull-clark");
    assert!(is_picture(&stem.with_extension("pdf")));
    let read = io::read(&stem.with_extension("ply")).unwrap().mesh;
    assert_eq!(read, io::read(&folder.path().join("m.off")).unwrap().mesh);
    let written = vertex_columns(&stem.with_extension("ply"));
    let smooth = stages.vertices().unwrap();
    assert!(smooth.len() < surface.len());
    for k in 1..=3 {
        let values = &written[&format!("mode_{k}")];
        let lambda = found["modes"][k - 1]["value"].as_f64().unwrap();
        let x: Vec<f64> = smooth.iter().map(|&v| values[v as usize + 1]).collect();
        for i in 0..x.len() {
            assert!((stages.block().a.row_times(i, &x) - lambda * x[i]).abs() < 1e-12);
        }
        let others = (0..values.len()).filter(|v| !smooth.iter().any(|&s| s as usize + 1 == *v));
        assert!(others.clone().count() > 1 && others.map(|v| values[v]).all(|value| value == 0.0));
    }
}

#[test]
fn errors_at_vertices_are_those_of_runs_of_so_many_iterations() {
    let folder = tempdir().unwrap();
    let flags = [
        "torus:8x6",
        "--noise",
        "0.1",
        "--json",
        "--quiet",
        "--method",
        "pia,gauss-seidel,lu",
        "--errors-at",
        "3,0,9,3",
    ];
    let output = run(COMPARE, folder.path(), flags);
    assert_done(&output, "torus");
    let rows = json(&output)["rows"].clone();
    assert_eq!(rows[0]["error_maps"]["iterations"], serde_json::json!([0, 3, 9]));
    assert!(rows[2].get("error_maps").is_none());
    assert_eq!(
        below(&folder.path().join("out")),
        [
            "-errors-gauss-seidel.ply",
            "-errors-gauss-seidel.png",
            "-errors-pia.ply",
            "-errors-pia.png",
            "-history.csv",
            ".csv",
            ".md",
            ".png"
        ]
        .map(|end| format!("compare-solvers-torus-8x6-catmull-clark{end}"))
    );
    assert!(is_picture(&folder.path().join("out/compare-solvers-torus-8x6-catmull-clark-errors-pia.png")));
    for (method, name) in [(Method::Pia, "pia"), (Method::GaussSeidel { order: None }, "gauss-seidel")] {
        let file = folder.path().join(format!("out/compare-solvers-torus-8x6-catmull-clark-errors-{name}.ply"));
        let surface = Surface::new(io::read(&file).unwrap().mesh).unwrap();
        let points = surface.positions();
        let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
        let written = vertex_columns(&file);
        for k in [0, 3, 9] {
            let v = solve(&system, points, method, &Stop { tolerance: 0.0, max_iterations: k }).points;
            for (i, &error) in written[&format!("error_{k}")].iter().enumerate() {
                let exact = points[i].distance(system.a.row_times(i, &v));
                assert!((error - exact).abs() <= 1e-14, "{name} {k} {i}: {error} {exact}");
            }
        }
    }
}

#[test]
fn many_errors_at_vertices_make_a_picture_of_the_first() {
    let folder = tempdir().unwrap();
    let at: Vec<String> = (0..20).map(|k| k.to_string()).collect();
    let flags = ["torus:5x5", "--noise", "0.1", "--method", "pia", "--quiet", "--figure", "svg", "--errors-at"];
    assert_done(&run(COMPARE, folder.path(), flags.iter().copied().chain([at.join(",").as_str()])), "20 iterations");
    let stem = folder.path().join("out/compare-solvers-torus-5x5-catmull-clark-errors-pia");
    let picture = fs::read_to_string(stem.with_extension("svg")).unwrap();
    assert_eq!(picture.matches("aria-label=\"k = ").count(), 12);
    assert!(picture.contains("(12 of 20)"));
    let columns = vertex_columns(&stem.with_extension("ply"));
    assert_eq!(columns.keys().filter(|name| name.starts_with("error_")).count(), 20);
}

#[test]
fn errors_at_vertices_are_in_the_numbers_of_the_file() {
    let folder = tempdir().unwrap();
    let (surface, stages) = creased(folder.path());
    let flags = ["png", "--method", "pia", "--errors-at", "2,5"];
    assert_done(&run(COMPARE, folder.path(), ON_CREASED.iter().chain(&flags)), "creased");
    let written = vertex_columns(&folder.path().join("out/compare-solvers-m-catmull-clark-errors-pia.ply"));
    let points = surface.positions();
    for k in [2, 5] {
        let stop = Stop { tolerance: 0.0, max_iterations: k };
        let v = limitlab::interpolate::staged::run(&stages, points, Method::Pia, &stop).points;
        let errors = &written[&format!("error_{k}")];
        assert_eq!((errors.len(), errors[0]), (surface.len() + 1, 0.0));
        let matrix = stages.matrix();
        for (i, &error) in errors[1..].iter().enumerate() {
            // Curves are solved first.
            assert!((error - points[i].distance(matrix.row_times(i, &v))).abs() < 1e-13, "{k} {i}");
        }
        assert!(errors.iter().any(|&error| error > 1e-6));
    }
}

#[test]
fn methods_without_iterates_have_no_error_maps() {
    let folder = tempdir().unwrap();
    let flags = ["cube", "--scheme", "nasri", "--quiet", "--json", "--method", "lu,auto", "--errors-at", "1"];
    let line = assert_refused(&run(COMPARE, folder.path(), flags), "lu, auto");
    assert!(line.contains("lu (faer), auto (") && line.contains("name a method that iterates"), "{line}");
    assert_done(&run(ASSEMBLE, folder.path(), ["torus:8x6", "--out", "d", "--quiet"]), "assemble");
    let line =
        assert_refused(&run(COMPARE, folder.path(), ["d", "--method", "pia", "--quiet", "--errors-at", "1"]), "folder");
    assert!(line.contains("leave it out"), "{line}");
}

#[test]
fn a_picture_stands_beside_the_cage() {
    let folder = tempdir().unwrap();
    for (mesh, name) in [
        ("torus:8x6 --noise 0.1", "a.png"),
        ("icosahedron", "a.svg"),
        ("cube --scheme zheng-cai --vertices 0..3", "a.pdf"),
        ("octahedron --scheme sqrt3 --method lu --subdivide 1", "b.PNG"),
        ("tri-torus:6x4 --scheme mid-edge --method pia", "c.png"),
    ] {
        let arguments = mesh.split(' ').chain(["-o", "a.obj", "--quiet", "--picture", name]);
        assert_done(&run(INTERPOLATE, folder.path(), arguments), mesh);
        let written = folder.path().join(name);
        let picture = folder.path().join(name.to_lowercase());
        fs::rename(written, &picture).unwrap();
        assert!(is_picture(&picture), "{name}");
    }
    let with = |more: &str| {
        let arguments = ["octahedron", "-o", "z.obj", "--quiet"].into_iter().chain(more.split(' '));
        run(INTERPOLATE, folder.path(), arguments)
    };
    let line = assert_refused(&with("--picture a.gif"), "gif");
    assert!(line.contains("ends in .png, .svg or .pdf"), "{line}");
    assert_refused(&with("--picture no/a.png"), "no folder");
    for more in ["--method halstead", "--method butterfly --subdivide 1", "--alpha 1 --subdivide 1"] {
        assert_eq!(with(&format!("{more} --picture z.png")).status.code(), Some(2), "{more}");
    }
    assert!(!folder.path().join("z.obj").exists() && !folder.path().join("z.png").exists());
}
