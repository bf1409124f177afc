//! The program `interpolate`: what it writes is what the library makes, and nothing is written on failure.

use std::path::PathBuf;

use assert_cmd::Command;
use glam::DVec3;
use limitlab::interpolate::limit_points;
use limitlab::mesh::{Mesh, Surface, builtin, io, noise};
use limitlab::schemes::{Refinement, Scheme, catmull_clark, doo_sabin};
use serde_json::Value;
use tempfile::TempDir;

use crate::common::pipelines::{ROUNDING, centroid, distance, noisy};

/// Runs in a folder of its own; the output there is `out.ply` unless told.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        Bench { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("interpolate").unwrap();
        command.current_dir(self.folder.path());
        command.args(arguments.split_whitespace());
        command.args(["-o", "out.ply"]);
        command
    }

    /// The JSON, and the mesh with its normals.
    fn run(&self, arguments: &str) -> (Value, io::Loaded) {
        let output = self.command(arguments).args(["--json", "--quiet"]).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments}: {error}");
        let json = serde_json::from_slice(&output.stdout).unwrap();
        (json, io::read(&self.path("out.ply")).unwrap())
    }

    /// The one line on standard error of a run that must fail with `status` and write nothing.
    fn fail(&self, arguments: &str, status: i32) -> String {
        let output = self.command(arguments).arg("--quiet").output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments}: {error}");
        assert!(!self.path("out.ply").exists(), "{arguments}");
        if status == 1 {
            assert!(error.starts_with("error: ") && error.trim_end().lines().count() == 1, "{error}");
        }
        error
    }
}

fn surface(mesh: &Mesh) -> Surface {
    Surface::new(mesh.clone()).unwrap()
}

fn with_noise(name: &str) -> Mesh {
    let mut mesh = builtin::builtin(name).unwrap();
    noise::add_noise(&mut mesh, 0.1, 1);
    mesh
}

/// What Blender's modifier does with the control mesh: refine it again and again. The original vertices go to the
/// given points; the eigenvalues by which they approach are below 3/4 at every valence.
#[test]
fn a_control_mesh_refined_again_and_again_passes_through_the_points() {
    let bench = Bench::new();
    for (mesh, scheme) in [
        ("irregular-poly:40", Refinement::CatmullClark),
        ("quad-sphere:2", Refinement::CatmullClark),
        ("icosphere:1", Refinement::Loop),
        ("icosphere:1", Refinement::Sqrt3),
    ] {
        let (json, loaded) = bench.run(&format!("{mesh} --noise 0.1 --scheme {scheme} --tol 1e-12"));
        assert!(json["max_error"].as_f64().unwrap() < 1e-11);
        let given = with_noise(mesh);
        assert_eq!(loaded.mesh.faces, given.faces);
        let mut before = distance(&loaded.mesh.positions, &given.positions);
        let mut fine = surface(&loaded.mesh);
        for _ in 0..6 {
            fine = scheme.refined(&fine).unwrap();
            let now = distance(&fine.positions()[..given.len()], &given.positions);
            assert!(now < 0.8 * before, "{mesh} {scheme}: {now} after {before}");
            before = now;
        }
        let limits = scheme.limit_positions(&fine).unwrap();
        assert!(distance(&limits[..given.len()], &given.positions) < 1e-11, "{mesh} {scheme}");
    }
}

#[test]
fn a_surface_at_its_limit_holds_the_points_and_its_normals() {
    let bench = Bench::new();
    let (json, loaded) = bench.run("irregular-poly:40 --noise 0.1 --tol 1e-13 --subdivide 2 --limit --write-normals");
    let given = with_noise("irregular-poly:40");
    assert!(distance(&loaded.mesh.positions[..given.len()], &given.positions) < ROUNDING);
    assert_eq!(json["surface"]["vertices"], loaded.mesh.len());
    assert_eq!(json["vertices"], given.len());
    let normals = loaded.normals.unwrap();
    assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < ROUNDING));
    // The same surface one level further has the same points and normals at the vertices that both have.
    let (_, finer) = bench.run("irregular-poly:40 --noise 0.1 --tol 1e-13 --subdivide 3 --limit --write-normals");
    let n = loaded.mesh.len();
    assert!(distance(&finer.mesh.positions[..n], &loaded.mesh.positions) < ROUNDING);
    assert!(distance(&finer.normals.unwrap()[..n], &normals) < 1e-9);
}

#[test]
fn given_normals_are_those_of_the_surface() {
    let bench = Bench::new();
    let lines = bench.write("n.txt", "# vertex nx ny nz\n0 1 0.2 0.1\n7 0 0.3 -1\n");
    let wanted = [(0, DVec3::new(1.0, 0.2, 0.1)), (7, DVec3::new(0.0, 0.3, -1.0))];
    let given = with_noise("icosphere:1");
    let base = "icosphere:1 --noise 0.1 --tol 1e-13 --write-normals --limit";
    for scheme in ["catmull-clark", "loop", "sqrt3"] {
        let arguments = format!("{base} --scheme {scheme} --subdivide 3 --normals {lines} --normal-levels 2");
        let (json, loaded) = bench.run(&arguments);
        assert_eq!(json["normals"]["given"], 2);
        assert!(distance(&loaded.mesh.positions[..given.len()], &given.positions) < ROUNDING);
        let found = loaded.normals.unwrap();
        for (v, n) in wanted {
            assert!(found[v].distance(n.normalize()) < ROUNDING, "{scheme} {v}");
        }
    }
    let (_, fair) = bench.run(&format!("{base} --method halstead --subdivide 3 --normals {lines}"));
    assert!(distance(&fair.mesh.positions[..given.len()], &given.positions) < 1e-10);
    let found = fair.normals.unwrap();
    for (v, n) in wanted {
        assert!(found[v].cross(n.normalize()).length() < 1e-9);
    }
    // A mesh file with normals: here the surface's own, so that nothing turns.
    let (_, own) = bench.run(&format!("{base} --scheme loop"));
    io::write(&bench.path("own.off"), &given, own.normals.as_deref()).unwrap();
    let (json, _) = bench.run(
        "icosphere:1 --noise 0.1 --tol 1e-13 --scheme loop --subdivide 2 --normals own.off --normal-threshold 0.001",
    );
    assert_eq!((&json["normals"]["given"], &json["normals"]["set"]), (&given.len().into(), &0.into()));
}

#[test]
fn two_phases_give_exact_centroids_with_handles_and_subsets() {
    let bench = Bench::new();
    let given = with_noise("irregular-poly:40");
    for method in ["two-phase", "cg"] {
        let arguments = format!(
            "irregular-poly:40 --noise 0.1 --scheme zheng-cai --method {method} --vertices 0..9,20 --shape-handle 0.4 --subdivide 3"
        );
        let (json, loaded) = bench.run(&arguments);
        assert_eq!(json["interpolated"], 11);
        let first = given.faces.len() + surface(&given).topology().edges();
        for v in (0..10).chain([20]) {
            assert!(centroid(&loaded.mesh, first + v).distance(given.positions[v]) < ROUNDING);
        }
    }
    let (_, plain) = bench.run("irregular-poly:40 --noise 0.1 --scheme nasri --tol 1e-13 --subdivide 2");
    let (_, one) = bench.run("irregular-poly:40 --noise 0.1 --scheme nasri --tol 1e-13 --subdivide 2 --shape-handle 1");
    assert_eq!(one.mesh.positions, plain.mesh.positions);
    let (_, control) = bench.run("irregular-poly:40 --noise 0.1 --scheme nasri --tol 1e-13");
    let control = surface(&control.mesh);
    let expected = Refinement::DooSabin.refine_n(&control, 2).unwrap();
    assert!(distance(&plain.mesh.positions, &expected.positions) < ROUNDING);
    let limits = doo_sabin::limit_positions(doo_sabin::CornerRule::DooSabin, &control).unwrap();
    assert!(distance(&limits, &given.positions) < ROUNDING);
}

/// Points are met, and more freedom takes less energy; what is written is the control mesh one refinement down, or its surface.
#[test]
fn fair_handles_and_refinements_meet_the_points_with_less_energy() {
    let bench = Bench::new();
    let given = with_noise("irregular-poly:40");
    let first = given.faces.len() + surface(&given).topology().edges();
    let base = "irregular-poly:40 --noise 0.1 --scheme zheng-cai --tol 1e-13";
    let run = |flags: &str| {
        let (json, loaded) = bench.run(&format!("{base} {flags}"));
        for (v, point) in given.positions.iter().enumerate() {
            assert!(centroid(&loaded.mesh, first + v).distance(*point) < ROUNDING, "{flags} {v}");
        }
        (json, loaded.mesh)
    };
    let energy = |json: &Value| {
        ["thin_plate", "membrane"].map(|name| json["fairness"][name].as_f64().unwrap()).iter().sum::<f64>()
    };
    let [(handles, _), (free, surface)] =
        ["--shape-handle fair", "--method fair-refinement"].map(|flags| run(&format!("{flags} --subdivide 3")));
    assert!(energy(&free) < energy(&handles), "{} {}", energy(&free), energy(&handles));
    let [least, largest] = ["least", "largest"].map(|name| handles["shape_handles"][name].as_f64().unwrap());
    assert!(0.0 < least && least < largest, "{least} {largest}");
    let history = free["history"].as_array().unwrap();
    assert!(history.len() > 5 && history[0]["max_step"].as_f64() > free["tolerance"].as_f64());
    let (_, control) = run("--method fair-refinement");
    assert_eq!(control.len(), given.faces.corners().len());
    assert_eq!(run("--method fair-refinement --subdivide 1").1.positions, control.positions);
    let expected = Refinement::DooSabin.refine_n(&Surface::new(control).unwrap(), 2).unwrap();
    assert!(distance(&surface.positions, &expected.positions) < ROUNDING);
}

#[test]
fn a_subset_moves_no_other_vertex() {
    let bench = Bench::new();
    let marks = bench.write("some.txt", "3 5\n8..11\n");
    let (json, loaded) =
        bench.run(&format!("icosphere:1 --noise 0.1 --scheme catmull-clark --tol 1e-13 --vertices {marks}"));
    assert_eq!(json["interpolated"], 6);
    let given = with_noise("icosphere:1");
    let limits = catmull_clark::limit_positions(&surface(&loaded.mesh)).unwrap();
    for (v, limit) in limits.iter().enumerate() {
        let marked = [3, 5, 8, 9, 10, 11].contains(&v);
        let point = if marked { *limit } else { loaded.mesh.positions[v] };
        assert!(point.distance(given.positions[v]) < ROUNDING, "{v}");
    }
    // To the last bit that of the file, and not of the difference that was solved for.
    let limits = limit_points(&surface(&loaded.mesh), Scheme::CatmullClark).unwrap();
    let off = [3, 5, 8, 9, 10, 11].map(|v| limits[v].distance(given.positions[v])).into_iter().fold(0.0, f64::max);
    assert_eq!(json["max_error"].as_f64(), Some(off));
}

#[test]
fn alpha_chooses_what_is_interpolated() {
    let bench = Bench::new();
    let given = with_noise("icosphere:1");
    let (json, loaded) = bench.run("icosphere:1 --noise 0.1 --alpha 0.25 --vertices 4,5 --subdivide 3");
    assert_eq!((&json["method"], &json["scheme"]), (&"lin-luo".into(), &"sqrt3".into()));
    for v in 0..given.len() {
        assert_eq!(loaded.mesh.positions[v] == given.positions[v], v == 4 || v == 5);
    }
    let (_, kobbelt) = bench.run("icosphere:1 --noise 0.1 --alpha 0 --subdivide 3");
    let expected = Refinement::Sqrt3.refine_n(&surface(&given), 3).unwrap();
    assert!(distance(&kobbelt.mesh.positions, &expected.positions) < ROUNDING);
}

#[test]
fn failures_say_what_is_wrong_and_write_nothing() {
    let bench = Bench::new();
    let outward = noisy("icosahedron").positions[4];
    let opposite = bench.write("opposite.txt", &format!("4 {} {} {}\n", -outward.x, -outward.y, -outward.z));
    let twice = bench.write("twice.txt", "4 1 0 0\n4 0 1 0\n");
    let zero = bench.write("zero.txt", "4 0 0 0\n");
    let handles = bench.write("handles.txt", "4 -1\n");
    let square = bench.write("square.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    for (arguments, what) in [
        ("icosahedron --alpha -0.5 --subdivide 1".to_owned(), "α = -0.5 at vertex 0"),
        ("icosahedron --method halstead --thin-plate -1".to_owned(), "fairness weights -1"),
        ("icosahedron --scheme nasri --shape-handle -1 --subdivide 1".to_owned(), "vertex 0: the shape handle -1"),
        ("icosahedron --alpha 2.5 --subdivide 1".to_owned(), "α = 2.5 at vertex 0"),
        ("icosahedron --alpha 1".into(), "--subdivide"),
        ("cube --method labsik-greiner --subdivide 2".into(), "face 0 has 4 corners"),
        ("icosahedron --vertices 12".into(), "\"12\" names a vertex that the mesh lacks"),
        ("icosahedron --vertices none.txt".into(), "\"none.txt\" is neither"),
        (format!("icosahedron --normals {twice} --subdivide 2"), "line 2: vertex 4 is given twice"),
        (format!("icosahedron --normals {zero} --subdivide 2"), "vertex 4"),
        ("icosahedron --normals nowhere.txt --subdivide 2".into(), "nowhere.txt: cannot read"),
        (format!("icosahedron --normals {twice}"), "given twice"),
        (format!("icosahedron --normals {zero} --scheme zheng-cai"), "--subdivide 1"),
        (
            format!("icosahedron --normals {opposite} --vertices 1,2 --scheme nasri --subdivide 2"),
            "vertex 4: a normal is given where",
        ),
        (format!("icosahedron --shape-handle {handles} --scheme nasri --subdivide 2"), "vertex 4: the shape handle -1"),
        ("icosahedron --shape-handle 2 --scheme loop".into(), "use --scheme zheng-cai"),
        ("icosahedron --shape-handle fair --scheme loop --subdivide 2".into(), "use --scheme zheng-cai"),
        ("icosahedron --shape-handle fair --scheme nasri".into(), "use --subdivide 1 or more"),
        (format!("{square} --shape-handle fair --scheme nasri --subdivide 2"), "needs a mesh without creases"),
        ("icosahedron --method fair-refinement --max-iter 1".into(), "fair-refinement ended as max-iterations"),
        ("icosahedron --method pia --max-iter 1".into(), "ran out"),
        (
            "icosahedron --method halstead --max-iter 1".into(),
            "ended as max-iterations after 1 iteration, the largest step",
        ),
    ] {
        let error = bench.fail(&arguments, 1);
        assert!(error.contains(what), "{arguments}: {error}");
    }
    // Without noise the limit normal is the position's direction: opposite to rounding.
    let p = builtin::icosahedron().positions[4];
    let exact = bench.write("exact.txt", &format!("4 {} {} {}\n", -p.x, -p.y, -p.z));
    let error = bench.fail(&format!("icosahedron --normals {exact} --subdivide 2"), 1);
    assert!(error.contains("vertex 4: the given normal is opposite"), "{error}");
    for arguments in [
        "icosahedron --alpha 1 --scheme loop --subdivide 1",
        "icosahedron --alpha 1 --normals n.txt",
        "icosahedron --method two-phase --scheme loop",
        "icosahedron --method labsik-greiner",
        "icosahedron --method butterfly --scheme loop --subdivide 2",
        "icosahedron --method butterfly --vertices 1 --subdivide 2",
        "icosahedron --method halstead --subdivide 1",
        "icosahedron --method halstead --shape-handle 2",
        "icosahedron --method fair-refinement --shape-handle 2",
        "icosahedron --method fair-refinement --scheme nasri",
        "icosahedron --normal-levels 2",
        "icosahedron --subdivide 13",
    ] {
        bench.fail(arguments, 2);
    }
}

/// The limit of the unified scheme, pushed to from any level, and the schemes that need no system.
#[test]
fn surfaces_without_a_system_pass_through_the_points() {
    let bench = Bench::new();
    let given = with_noise("icosphere:1");
    let alpha = "icosphere:1 --noise 0.1 --alpha 0.25 --vertices 4,5 --limit --write-normals";
    let (_, coarse) = bench.run(alpha);
    let (_, fine) = bench.run(&format!("{alpha} --subdivide 2"));
    let n = given.len();
    assert_eq!(coarse.mesh.faces, given.faces);
    assert!(distance(&coarse.mesh.positions, &fine.mesh.positions[..n]) < ROUNDING);
    assert!(coarse.mesh.positions[4..6] == given.positions[4..6]);
    assert!(coarse.mesh.positions[3].distance(given.positions[3]) > 1e-3);
    let normals = coarse.normals.unwrap();
    assert!(distance(&normals, &fine.normals.unwrap()[..n]) < 1e-9);
    for (name, scheme) in [("butterfly", Refinement::Butterfly), ("labsik-greiner", Refinement::LabsikGreiner)] {
        let (json, loaded) =
            bench.run(&format!("icosphere:1 --noise 0.1 --method {name} --subdivide 2 --limit --write-normals"));
        assert_eq!((&json["scheme"], &json["method"]), (&name.into(), &name.into()));
        assert_eq!(loaded.mesh, scheme.refine_n(&surface(&given), 2).unwrap());
        let normals = loaded.normals.unwrap();
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < ROUNDING));
        assert_eq!(loaded.mesh.positions[..n], given.positions);
    }
}

/// Coincident points and faces without area: finite meshes, whatever the scheme and the outcome of its normals.
#[test]
fn degenerate_points_give_finite_files() {
    let bench = Bench::new();
    let mut mesh = noisy("icosphere:1");
    let p = mesh.positions[0];
    mesh.positions[..8].fill(p);
    let mut flat = mesh.clone();
    flat.positions.iter_mut().for_each(|p| *p = DVec3::X * p.x);
    let mut point = mesh.clone();
    point.positions.fill(p);
    io::write(&bench.path("point.off"), &point, None).unwrap();
    assert!(bench.fail("point.off", 1).contains("all points coincide"));
    let (_, loaded) = bench.run("point.off --tol-absolute 1e-12 --subdivide 2 --write-normals");
    assert!(loaded.normals.unwrap().iter().all(|n| *n == DVec3::ZERO));
    for (name, mesh) in [("some.off", mesh), ("flat.off", flat)] {
        io::write(&bench.path(name), &mesh, None).unwrap();
        for scheme in ["catmull-clark", "loop", "sqrt3", "nasri", "zheng-cai"] {
            let arguments = format!("{name} --scheme {scheme} --subdivide 2 --limit --write-normals");
            let (_, loaded) = bench.run(&arguments);
            let normals = loaded.normals.unwrap();
            assert!(loaded.mesh.positions.iter().chain(&normals).all(|p| p.is_finite()), "{arguments}");
        }
    }
}
