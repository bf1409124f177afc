//! What the programs compute, read back and computed again from the formulas.

use std::path::Path;

use glam::DVec3;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces};
use limitlab::mesh::order::Order;
use limitlab::mesh::space_filling::is_scattered;
use limitlab::mesh::{Mesh, Surface, io};
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;
use nalgebra_sparse::CsrMatrix;
use sprs::io::read_matrix_market;
use tempfile::tempdir;

use super::*;
use crate::common::collection::{collection, files};
use crate::common::formulas;
use crate::common::matrix_market::read_array;
use crate::common::meshes::*;

/// What is promised of these files: entries within 1e-13 of the formulas (in A's scale, where rows sum to 1).
const ENTRIES: f64 = 1e-13;

fn largest_difference(read: &sprs::CsMat<f64>, plain: &CsrMatrix<f64>, h: &[f64]) -> f64 {
    assert_eq!(read.shape(), (plain.nrows(), plain.ncols()));
    let mut largest = 0.0f64;
    for (i, (ours, theirs)) in read.outer_iterator().zip(plain.row_iter()).enumerate() {
        let mut row = vec![0.0; plain.ncols()];
        ours.iter().for_each(|(j, &x)| row[j] += x);
        for (&j, &x) in theirs.col_indices().iter().zip(theirs.values()) {
            row[j] -= x;
        }
        largest = row.iter().fold(largest, |l, d| l.max(d.abs() * h[i]));
    }
    largest
}

/// Runs `assemble` and holds its files against the formulas.
fn hold_assembled(folder: &Path, name: &str, mesh: &Mesh, scheme: Scheme) {
    let what = format!("{name} under {scheme}");
    let arguments = [name, "--scheme", scheme.name(), "--out", "m", "--quiet"];
    assert_done(&run(ASSEMBLE, folder, arguments), &what);
    let path = |file: &str| folder.join("m").join(file);
    let plain = formulas::assemble(scheme, mesh);
    let ones = vec![1.0; mesh.len()];
    for (file, matrix, h) in [("A.mtx", &plain.a, &ones), ("M.mtx", &plain.m, &plain.h)] {
        let read = read_matrix_market::<f64, usize, _>(path(file)).unwrap().to_csr();
        let error = largest_difference(&read, matrix, h);
        assert!(error < ENTRIES, "{what}, {file}: {error:e}");
    }
    let [h] = read_array(&path("H.mtx")).try_into().unwrap();
    let columns = read_array(&path("P.mtx"));
    let right = read_array(&path("R.mtx"));
    assert_eq!((columns.len(), right.len()), (3, 3));
    for (i, p) in mesh.positions.iter().enumerate() {
        assert!((h[i] / plain.h[i] - 1.0).abs() < ENTRIES, "{what}, H {i}");
        for axis in 0..3 {
            assert_eq!(columns[axis][i], p[axis], "{what}, P {i}");
            let expected = p[axis] / plain.h[i];
            assert!((right[axis][i] - expected).abs() <= ENTRIES * expected.abs(), "{what}, R {i}");
        }
    }
}

#[test]
fn assembled_files_are_the_formulas_on_built_in_meshes() {
    let folder = tempdir().unwrap();
    for name in ["cube", "icosphere:2", "irregular-poly:200", "torus:6x7", "star:5"] {
        let mesh = built_in(name);
        for scheme in Scheme::ALL {
            if scheme.first_unsuitable_face(&mesh.faces).is_none() {
                hold_assembled(folder.path(), name, &mesh, scheme);
            }
        }
    }
}

#[test]
fn assembled_files_are_the_formulas_on_every_small_closed_model() {
    let Some(root) = collection() else { return };
    let folder = tempdir().unwrap();
    let mut runs = 0;
    for (k, path) in files(&root.join("closed")).into_iter().enumerate() {
        let mesh = io::read(&path).unwrap().mesh;
        if mesh.len() > 3000 {
            continue;
        }
        let suitable: Vec<Scheme> =
            Scheme::ALL.into_iter().filter(|s| s.first_unsuitable_face(&mesh.faces).is_none()).collect();
        // Two schemes a model, all schemes in turn.
        for turn in [0, suitable.len().div_ceil(2)] {
            let scheme = suitable[(k + turn) % suitable.len()];
            let absolute = path.canonicalize().unwrap();
            hold_assembled(folder.path(), absolute.to_str().unwrap(), &mesh, scheme);
            runs += 1;
        }
    }
    assert!(runs > 100, "{runs} runs");
}

/// max_i ‖p_i − (A v)_i‖ by the formulas.
fn residual(scheme: Scheme, mesh: &Mesh, control: &Mesh) -> f64 {
    let a = formulas::assemble(scheme, mesh).a;
    a.row_iter().enumerate().fold(0.0, |largest: f64, (i, row)| {
        let limit: DVec3 = (row.col_indices().iter().zip(row.values())).map(|(&j, &x)| x * control.positions[j]).sum();
        largest.max((mesh.positions[i] - limit).length())
    })
}

#[test]
fn the_control_mesh_satisfies_the_equation_and_keeps_the_faces() {
    let folder = tempdir().unwrap();
    for scheme in Scheme::ALL {
        let mesh = noisy(if scheme.needs_triangles() { "irregular-tri:300" } else { "irregular-poly:300" });
        for (given, wanted) in [("p.obj", "v.ply"), ("p.off", "v.obj"), ("p.ply", "v.off")] {
            io::write(&folder.path().join(given), &mesh, None).unwrap();
            for (flag, tolerance, relative) in [("--tol", 1e-8, true), ("--tol-absolute", 1e-4, false)] {
                let tol = tolerance.to_string();
                let arguments = [given, "-o", wanted, "--scheme", scheme.name(), flag, &tol, "--quiet"];
                assert_done(&run(INTERPOLATE, folder.path(), arguments), scheme.name());
                let control = io::read(&folder.path().join(wanted)).unwrap().mesh;
                assert_eq!(control.faces, mesh.faces, "{scheme} {wanted}");
                let allowed = tolerance * if relative { mesh.diagonal() } else { 1.0 };
                let error = residual(scheme, &mesh, &control);
                assert!(error <= allowed * (1.0 + 1e-6), "{scheme} {wanted}: {error:e}");
                assert!(error > 1e-4 * allowed, "{scheme}: the tolerance asked for is the one used");
            }
        }
    }
}

#[test]
fn a_file_in_random_order_is_solved_and_written_in_its_own_order() {
    let folder = tempdir().unwrap();
    // Enough vertices that the program renumbers them.
    let mesh = noisy("irregular-poly:60000");
    let surface = Surface::new(mesh.clone()).unwrap();
    let order = Order::Random(3).order(&mesh, surface.incidence());
    let mesh = shuffle_faces(&permute_vertices(&mesh, &order), 3);
    assert!(is_scattered(&mesh.faces));
    io::write(&folder.path().join("p.ply"), &mesh, None).unwrap();
    let solve = |arguments: &[&str]| {
        let arguments = [&["p.ply", "-o", "v.ply", "--quiet"], arguments].concat();
        assert_done(&run(INTERPOLATE, folder.path(), &arguments), "random order");
        let written = io::read(&folder.path().join("v.ply")).unwrap().mesh;
        (written.faces == mesh.faces, written)
    };
    let (same_faces, control) = solve(&["--tol-absolute", "1e-9"]);
    assert!(same_faces);
    assert!(residual(Scheme::CatmullClark, &mesh, &control) <= 1.0001e-9);
    // What comes after the solve has the file's order too.
    let (same_faces, limit) = solve(&["--tol-absolute", "1e-9", "--limit"]);
    assert!(same_faces);
    let pairs = limit.positions.iter().zip(&mesh.positions);
    assert!(pairs.map(|(p, q)| p.distance(*q)).fold(0.0, f64::max) <= 1.0001e-9);
}

#[test]
fn every_method_gives_the_same_control_mesh() {
    let folder = tempdir().unwrap();
    let mesh = noisy("irregular-quad:400");
    io::write(&folder.path().join("p.obj"), &mesh, None).unwrap();
    let methods =
        "auto lu cholesky ldlt jacobi thall gauss-seidel sor ssor pia w-pia chebyshev cg pcg-jacobi pcg-ssor pcg-ic0";
    let by_colours = ["gauss-seidel", "sor"].map(|method| (method, "multicolour"));
    let mut first: Option<Mesh> = None;
    for (method, order) in methods.split(' ').map(|m| (m, "rcm")).chain(by_colours) {
        let arguments = ["p.obj", "-o", "v.obj", "--method", method, "--order", order, "--quiet"];
        assert_done(&run(INTERPOLATE, folder.path(), arguments), method);
        let control = io::read(&folder.path().join("v.obj")).unwrap().mesh;
        let scheme = Scheme::CatmullClark;
        assert!(residual(scheme, &mesh, &control) <= 1.001e-10 * mesh.diagonal(), "{method}, {order}");
        let reference = first.get_or_insert_with(|| control.clone());
        assert!(distance(&control.positions, &reference.positions) < 1e-6, "{method}, {order}");
    }
}

/// λ_min ≈ 0.82/k²: conjugate gradients make no progress for hundreds of iterations, a factorization is sure.
#[test]
fn a_nearly_singular_system_is_solved_by_the_automatic_choice() {
    let folder = tempdir().unwrap();
    let arguments = ["prism:1001", "--noise", "0.1", "-o", "v.obj", "--json", "--quiet"];
    let output = run(INTERPOLATE, folder.path(), arguments);
    assert_done(&output, "prism:1001");
    assert_eq!(json(&output)["method"], "ldlt");
    let mesh = noisy("prism:1001");
    let control = io::read(&folder.path().join("v.obj")).unwrap().mesh;
    let error = residual(Scheme::CatmullClark, &mesh, &control);
    assert!(error <= 1.001e-10 * mesh.diagonal(), "{error:e}");
}

/// A is linear: points 2ᵏ times as large have control points, errors and surfaces 2ᵏ times as large, to the last bit.
#[test]
fn powers_of_two_change_nothing_but_the_unit() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("n.txt"), "0 1e300 1e300 1e300\n3 -1e-310 0 1e-310\n").unwrap();
    let base = noisy("icosphere:1");
    let solve = |power: i32, more: &[&str]| {
        let unit = 2f64.powi(power);
        let mut mesh = base.clone();
        mesh.positions.iter_mut().for_each(|p| *p *= unit);
        io::write(&folder.path().join("p.obj"), &mesh, None).unwrap();
        let arguments = [&["p.obj", "-o", "v.obj", "--json", "--quiet"], more].concat();
        let output = run(INTERPOLATE, folder.path(), &arguments);
        assert_done(&output, &format!("2^{power} {more:?}"));
        let report = json(&output);
        let number = |name: &str| report[name].as_f64().unwrap() / unit;
        let mut written = io::read(&folder.path().join("v.obj")).unwrap().mesh;
        written.positions.iter_mut().for_each(|p| *p /= unit);
        (written, report["iterations"].as_u64(), number("max_error"), number("mean_error"), number("tolerance"))
    };
    for more in [
        &[][..],
        &["--method", "lu"],
        &["--method", "cg"],
        &["--method", "sor", "--order", "multicolour"],
        &["--vertices", "0..9", "--limit"],
        &["--subdivide", "2", "--normals", "n.txt", "--write-normals"],
        &["--method", "two-phase", "--subdivide", "1"],
        &["--method", "halstead", "--scheme", "catmull-clark"],
        &["--alpha", "0.5", "--subdivide", "1"],
        &["--scheme", "nasri", "--subdivide", "1"],
    ] {
        let plain = solve(0, more);
        for power in [-900, -530, 40, 512, 1000] {
            assert!(solve(power, more) == plain, "2^{power} {more:?}");
        }
    }
}

/// Rows of A sum to 1: far from the origin, every method finds what it finds at the origin, to the last digit of the
/// coordinates there.
#[test]
fn offsets_cost_the_digits_of_the_coordinates_and_no_more() {
    let folder = tempdir().unwrap();
    for offset in [DVec3::splat(1e7), DVec3::new(1e7, 0.0, -5.4e6), DVec3::Z * 1e12] {
        let mut mesh = noisy("icosphere:1");
        mesh.positions.iter_mut().for_each(|p| *p += offset);
        io::write(&folder.path().join("p.obj"), &mesh, None).unwrap();
        mesh.positions.iter_mut().for_each(|p| *p -= offset);
        io::write(&folder.path().join("q.obj"), &mesh, None).unwrap();
        let digit = offset.abs().max_element() * f64::EPSILON;
        let methods = Method::ALL.map(Method::name).map(|m| vec!["--method", m]);
        let more =
            [vec![], vec!["--subdivide", "2", "--limit"], vec!["--vertices", "3..20"], vec!["--method", "two-phase"]];
        for more in methods.into_iter().chain(more) {
            let solve = |name: &str| {
                let arguments = [&[name, "-o", "v.obj", "--json"], &more[..]].concat();
                let output = run(INTERPOLATE, folder.path(), &arguments);
                assert_done(&output, &format!("{name} {offset} {more:?}"));
                (io::read(&folder.path().join("v.obj")).unwrap().mesh.positions, output)
            };
            let (near, at_origin) = solve("q.obj");
            let (far, output) = solve("p.obj");
            let moved: Vec<DVec3> = far.iter().map(|p| *p - offset).collect();
            assert!(distance(&moved, &near) < 2.0 * digit + 1e-9, "{offset} {more:?}");
            let error = |output: &Output| json(output)["max_error"].as_f64().unwrap();
            assert!(error(&output) <= error(&at_origin) + 2.0 * digit, "{offset} {more:?}");
            if more.is_empty() {
                let told = text(&output.stderr);
                assert!(told.contains("their last digit is") && told.contains("the tolerance 3."), "{told}");
            }
        }
    }
}

#[test]
fn as_interior_serves_loop_and_sqrt3() {
    let Some(root) = collection() else { return };
    let folder = tempdir().unwrap();
    let model = root.join("open/cathead_131v.off").canonicalize().unwrap();
    let (name, mesh) = (model.to_str().unwrap(), io::read(&model).unwrap().mesh);
    for scheme in [Scheme::Loop, Scheme::Sqrt3] {
        let arguments = [name, "-o", "v.obj", "--scheme", scheme.name(), "--boundary", "as-interior", "--quiet"];
        assert_done(&run(INTERPOLATE, folder.path(), arguments), scheme.name());
        let control = io::read(&folder.path().join("v.obj")).unwrap().mesh;
        assert!(residual(scheme, &mesh, &control) <= 1.001e-10 * mesh.diagonal());
    }
    for scheme in ["catmull-clark", "nasri", "zheng-cai"] {
        let arguments = [name, "--out", "m", "--scheme", scheme, "--boundary", "as-interior", "--quiet"];
        let line = assert_refused(&run(ASSEMBLE, folder.path(), arguments), scheme);
        assert!(line.contains("cathead") && line.contains("boundary edges"), "{line}");
    }
}

/// The columns of a CSV file without those that hold times.
fn without_times(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv(path);
    let header = reader.headers().unwrap().clone();
    let kept: Vec<usize> = (0..header.len()).filter(|&k| !header[k].contains("seconds")).collect();
    let pick = |record: &csv::StringRecord| kept.iter().map(|&k| record[k].to_owned()).collect::<Vec<_>>();
    let mut rows = vec![pick(&header)];
    rows.extend(reader.records().map(|r| pick(&r.unwrap())));
    rows
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for threads in ["1", "2"] {
        let common = ["--noise", "0.1", "--threads", threads, "--quiet"];
        let with = |more: &[&str]| -> Vec<String> { more.iter().chain(&common).map(|s| s.to_string()).collect() };
        // Above 10 000 vertices the sums over vertices are made of parts.
        let control = format!("v{threads}.obj");
        let arguments = with(&["icosphere:5", "-o", &control, "--tol", "1e-7", "--method", "cg"]);
        assert_done(&run(INTERPOLATE, folder.path(), arguments), "interpolate");
        let out = format!("out{threads}");
        let arguments = with(&["irregular-tri:12000", "--out", &out]);
        assert_done(&run(ASSEMBLE, folder.path(), arguments), "assemble");
        let arguments = with(&["torus:75x70", "--out", &out, "--omega", "0.7:0.9:0.1", "--tol", "1e-4"]);
        assert_done(&run(SWEEP, folder.path(), arguments), "sweep-omega");
        let arguments = with(&["torus:75x70", "--out", &out, "--method", "lu,pia,chebyshev,cg,sor", "--tol", "1e-4"]);
        assert_done(&run(COMPARE, folder.path(), arguments), "compare-solvers");
    }
    assert!(content(&path("v1.obj")) == content(&path("v2.obj")), "control meshes differ");
    assert_eq!(below(&path("out1")), below(&path("out2")));
    for name in below(&path("out1")) {
        let [one, two] = ["out1", "out2"].map(|out| format!("{out}/{name}"));
        if name.starts_with("compare") {
            if name.ends_with(".csv") {
                assert_eq!(without_times(&path(&one)), without_times(&path(&two)));
            }
        } else {
            assert!(content(&path(&one)) == content(&path(&two)), "{name} differs");
        }
    }
}

#[test]
fn pia_table_1_is_reproduced_on_the_paper_s_models() {
    let Some(root) = collection() else { return };
    let folder = tempdir().unwrap();
    let root = root.canonicalize().unwrap();
    let arguments = ["--only", "pia-table1", "--out", "r", "--quiet", "--meshes", root.to_str().unwrap()];
    assert_done(&run(REPRODUCE, folder.path(), arguments), "reproduce");
    let path = folder.path().join("r/pia-table1.csv");
    let mut reader = csv(&path);
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(|r| r.unwrap()).collect();
    // Printed in PIA, Table 1: # of iterations, max error, ave error.
    let printed = [
        ("Horse", 12, 0.000912016, 0.00022811),
        ("Bird", 9, 0.000766811, 8.8345e-5),
        ("Hand", 3, 0.000914111, 0.000164207),
        ("Boy", 6, 0.000913795, 9.5615e-5),
        ("Mushroom", 8, 0.000813821, 0.000235506),
    ];
    let reproduced: Vec<_> = rows.iter().filter(|r| &r[column("verdict")] == "reproduced").collect();
    assert_eq!(reproduced.len(), printed.len());
    for (row, (model, iterations, max, mean)) in reproduced.iter().zip(printed) {
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap();
        assert_eq!(&row[column("model")], model);
        assert_eq!(number("measured_iterations"), f64::from(iterations));
        assert_eq!(number("updates"), f64::from(iterations - 1));
        for (name, value) in [("measured_max_error", max), ("measured_mean_error", mean)] {
            assert!((number(name) / value - 1.0).abs() <= 2e-5, "{model} {name}: {}", number(name));
        }
        for (name, value) in [("printed_max_error", max), ("printed_mean_error", mean)] {
            assert_eq!(number(name), value);
        }
    }
    // The Mushroom under the true limit mask, in a row of its own.
    let [corrected] =
        rows.iter().filter(|r| &r[column("verdict")] != "reproduced").collect::<Vec<_>>().try_into().unwrap();
    assert_eq!(&corrected[column("model")], "Mushroom");
    for (name, value) in [("measured_max_error", 0.00080917), ("measured_mean_error", 0.00023088)] {
        let measured: f64 = corrected[column(name)].parse().unwrap();
        assert!((measured / value - 1.0).abs() < 2e-5, "{name}: {measured}");
    }
}

#[test]
fn an_item_or_a_claim_that_is_named_twice_is_made_once() {
    let folder = tempdir().unwrap();
    let arguments = ["--only", "pia-table1", "--only", "PIA-Table1", "--only", "T8", "--only", "t8", "--json"];
    let output = run(REPRODUCE, folder.path(), arguments.iter().chain(&["--quick", "--quiet", "--out", "r"]));
    assert_done(&output, "reproduce");
    let object = json(&output);
    assert_eq!((object["tables"].as_array().unwrap().len(), object["claims"].as_array().unwrap().len()), (1, 1));
}

#[test]
fn pages_show_pictures_of_the_formats_that_are_written() {
    let folder = tempdir().unwrap();
    for (formats, shown) in [("svg,pdf", Some("sparsity.svg")), ("svg,png", Some("sparsity.png")), ("pdf", None)] {
        let arguments = ["--only", "sparsity", "--quick", "--quiet", "--figure", formats, "--out", formats];
        assert_done(&run(REPRODUCE, folder.path(), arguments), formats);
        for page in ["sparsity.md", "README.md"] {
            let page = fs::read_to_string(folder.path().join(formats).join("built-in").join(page)).unwrap();
            let sources: Vec<&str> = page.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
            assert_eq!(sources, Vec::from_iter(shown), "{formats}: {page}");
        }
    }
}

#[test]
fn stand_ins_never_overwrite_results_on_the_real_models() {
    let folder = tempdir().unwrap();
    let kept = folder.path().join("r/pia-table1.csv");
    fs::create_dir(folder.path().join("r")).unwrap();
    fs::write(&kept, "results on the real models\n").unwrap();
    let arguments = ["--only", "pia-table1", "--out", "r", "--quick", "--quiet"];
    assert_done(&run(REPRODUCE, folder.path(), arguments), "reproduce");
    assert_eq!(fs::read_to_string(&kept).unwrap(), "results on the real models\n");
    let table = fs::read_to_string(folder.path().join("r/built-in/pia-table1.md")).unwrap();
    assert!(table.contains("stand-in") && !table.contains("reproduced |"), "{table}");
}
