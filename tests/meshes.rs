//! Every mesh of `../shared/meshes` against its MANIFEST: sizes, shape, and what is wrong with it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::common::collection::collection;
use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::mesh::io::{self, Loaded};
use limitlab::mesh::origin::Numbers;
use limitlab::mesh::repair::{RepairKind, repair};
use limitlab::mesh::topology::IrregularEdge;
use limitlab::mesh::validate::{Boundary, DefectKind, Validation, validate};
use limitlab::mesh::{Faces, Mesh, Surface, Topology, builtin};
use rand::{RngExt, SeedableRng};

/// One row of the MANIFEST.
struct Row {
    file: String,
    columns: Vec<String>,
}

impl Row {
    fn number(&self, column: usize) -> i64 {
        self.columns[column].parse().unwrap()
    }

    /// The number that stands before `what` in the notes, as the last remark about it; 0 if none does.
    fn noted(&self, what: &str) -> usize {
        let notes = &self.columns[15];
        notes.rfind(what).map_or(0, |at| {
            let before = notes[..at].trim_end();
            before.rsplit(' ').next().unwrap().parse().unwrap()
        })
    }
}

fn rows(root: &Path) -> Vec<Row> {
    let text = fs::read_to_string(root.join("MANIFEST.tsv")).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let columns: Vec<String> = line.split('\t').map(str::to_owned).collect();
        Row { file: columns[0].clone(), columns }
    });
    rows.collect()
}

fn report(loaded: &Loaded, boundary: Boundary) -> Validation {
    let lines = loaded.lines.as_ref();
    let lines = lines.map(|l| (&l.vertices[..], &l.faces[..]));
    validate(&loaded.mesh, lines, boundary)
}

/// The number in front of the remark that holds `what`; 0 if there is none.
fn remarked(report: &Validation, what: &str) -> usize {
    let remark = report.remarks.iter().find(|r| r.contains(what));
    remark.map_or(0, |r| r.split(' ').next().unwrap().parse().unwrap())
}

/// The readers refuse this file, as they must: it has four coordinates a vertex.
const REFUSED: &str = "bad/hypercube_4off_16v.off";

#[test]
fn counts_and_defects_are_those_of_the_manifest() {
    let Some(root) = collection() else { return };
    let rows = rows(&root);
    assert!(rows.len() > 100);
    for row in &rows {
        if row.file == REFUSED {
            assert!(io::read(&root.join(&row.file)).is_err());
            continue;
        }
        let file = &row.file;
        let loaded = io::read(&root.join(file)).unwrap();
        let report = report(&loaded, Boundary::Refuse);
        let topology = Topology::new(&loaded.mesh.faces, loaded.mesh.len());
        let counts = report.counts.as_ref().unwrap();
        let sizes = [counts.vertices, counts.edges, counts.faces, counts.components];
        assert_eq!(sizes.map(|n| n as i64), [2, 3, 4, 9].map(|c| row.number(c)), "{file}");
        assert_eq!(counts.euler_characteristic, row.number(10), "{file}");

        let totals = report.totals();
        let total = |kind| totals.get(&kind).copied().unwrap_or(0);
        // The MANIFEST counts a vertex twice in a row as an edge: among those in 3+ faces if that often, and
        // twice in a valence.
        let loops: Vec<_> = topology.irregular_edges().iter().filter(|e| e.is_loop()).collect();
        let long_loops = loops.iter().filter(|e| e.sides > 2).count();
        let looped: BTreeSet<u32> = loops.iter().map(|e| e.vertices[0]).collect();
        if looped.is_empty() {
            let valences = [counts.min_valence, counts.max_valence].map(|n| n as i64);
            assert_eq!(valences, [11, 12].map(|c| row.number(c)), "{file}");
        }
        // It looks at umbrellas only where no edge has more than two faces.
        let pinched = match row.noted("edges in 3+ faces") {
            0 => total(DefectKind::NonManifoldVertex),
            _ => row.noted("non-manifold vertices"),
        };
        let found = [
            total(DefectKind::BoundaryEdge),
            total(DefectKind::InconsistentOrientation),
            total(DefectKind::NonManifoldEdge) + long_loops,
            pinched,
            total(DefectKind::IsolatedVertex),
            total(DefectKind::RepeatedVertex),
            remarked(&report, "duplicate position"),
            remarked(&report, "zero-area face"),
        ];
        let noted = [
            "boundary edges",
            "misoriented edges",
            "edges in 3+ faces",
            "non-manifold vertices",
            "isolated vertices",
            "faces with a repeated vertex",
            "duplicate vertex positions",
            "zero-area faces",
        ];
        assert_eq!(found, noted.map(|what| row.noted(what)), "{file}");
        // The MANIFEST compares faces by vertices; by position there are more where positions are doubled.
        let (faces, noted) = (remarked(&report, "on the same positions"), row.noted("duplicate faces"));
        let more = match file.as_str() {
            "closed/psb_m149_boy_17342v_holesfilled.off" | "bad/all_degen_7v.off" => 2,
            _ => 0,
        };
        assert_eq!(faces, noted + more, "{file}");
    }
}

/// The faces at every vertex, flooded across edges at it: an oracle that shares nothing with the validator.
fn pinched_vertices(mesh: &Mesh) -> Vec<u32> {
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (f, face) in mesh.faces.iter().enumerate() {
        for &v in face {
            at.entry(v).or_default().push(f);
        }
    }
    let edges_at = |f: usize, v: u32| {
        let face = mesh.faces.face(f);
        let sides = (0..face.len()).map(|k| (face[k], face[(k + 1) % face.len()]));
        let ends = sides.filter_map(|(a, b)| match (a == v, b == v) {
            (true, false) => Some(b),
            (false, true) => Some(a),
            _ => None,
        });
        ends.collect::<BTreeSet<u32>>()
    };
    let mut pinched = Vec::new();
    for (v, faces) in at {
        let mut rest: BTreeSet<usize> = faces.into_iter().collect();
        let mut queue: Vec<usize> = rest.pop_first().into_iter().collect();
        while let Some(f) = queue.pop() {
            let here = edges_at(f, v);
            let joined = |g: &usize| !edges_at(*g, v).is_disjoint(&here);
            let reached: Vec<usize> = rest.iter().copied().filter(joined).collect();
            for g in reached {
                rest.remove(&g);
                queue.push(g);
            }
        }
        if !rest.is_empty() {
            pinched.push(v);
        }
    }
    pinched
}

#[test]
fn non_manifold_vertices_are_those_that_flooding_finds() {
    let Some(root) = collection() else { return };
    let bad = |row: &&Row| row.file.starts_with("bad/") && row.file != REFUSED;
    for row in rows(&root).iter().filter(bad) {
        let loaded = io::read(&root.join(&row.file)).unwrap();
        let report = report(&loaded, Boundary::Refuse);
        let found: Vec<u32> = (report.defects.iter())
            .filter(|d| d.kind == DefectKind::NonManifoldVertex)
            .filter_map(|d| d.vertex)
            .collect();
        assert_eq!(found, pinched_vertices(&loaded.mesh), "{}", row.file);
    }
}

#[test]
fn closed_meshes_are_valid_open_and_bad_ones_are_not() {
    let Some(root) = collection() else { return };
    for row in rows(&root).iter().filter(|row| row.file != REFUSED) {
        let file = &row.file;
        let loaded = io::read(&root.join(file)).unwrap();
        let refused = report(&loaded, Boundary::Refuse);
        let summary = refused.summary_line();
        assert!(!summary.contains('\n'));
        // Every line that is named is that of the vertex or face.
        let lines = loaded.lines.as_ref().unwrap();
        for d in &refused.defects {
            let line = match (d.face, d.vertex) {
                (Some(f), _) => lines.faces[f as usize],
                (None, Some(v)) => lines.vertices[v as usize],
                (None, None) => panic!("{file}: a defect without a place"),
            };
            assert_eq!(d.line, Some(line));
        }
        match file.split('/').next().unwrap() {
            "closed" => {
                assert!(refused.is_valid(), "{file}: {summary}");
                assert_eq!(Surface::new(loaded.mesh).unwrap().remarks(&Numbers::default()), refused.remarks, "{file}");
            }
            "open" => {
                assert_eq!(refused.defects[0].kind, DefectKind::BoundaryEdge, "{file}");
                assert!(summary.contains("boundary edge"), "{file}: {summary}");
                let has_valence_two = row.number(11) < 3;
                assert_eq!(summary.contains("valence below three"), has_valence_two, "{file}");
                let interior = report(&loaded, Boundary::AsInterior);
                assert!(interior.totals().keys().all(|&k| k == DefectKind::LowValence));
                assert_eq!(interior.is_valid(), !has_valence_two, "{file}");
                assert!(interior.remarks[0].contains("treated as interior"), "{file}");
            }
            _ => {
                assert!(!refused.is_valid(), "{file}");
                let examined = Surface::examined(loaded.mesh, Some((&lines.vertices, &lines.faces)), Boundary::Refuse);
                assert_eq!(examined.unwrap_err().summary_line(), summary, "{file}");
            }
        }
    }
}

#[test]
fn the_papers_boy_has_six_holes() {
    let Some(root) = collection() else { return };
    let loaded = io::read(&root.join("open/psb_m149_boy_17342v_raw.off")).unwrap();
    let report = report(&loaded, Boundary::AsInterior);
    assert!(report.is_valid());
    assert_eq!(
        report.remarks,
        [
            "26 boundary edges in 6 loops: boundary vertices are treated as interior",
            "4 duplicate positions (first: vertex 14664 lies on vertex 378)",
        ]
    );
    let surface = Surface::examined(loaded.mesh, None, Boundary::AsInterior).unwrap();
    assert_eq!(surface.remarks(&Numbers::default()), report.remarks);
    let mut loops: Vec<usize> = surface.topology().boundary_loops(surface.faces()).iter().map(Vec::len).collect();
    loops.sort_unstable();
    assert_eq!(loops, [4, 4, 4, 4, 5, 5]);
}

/// The pairing as it is defined, from a map of all edges.
fn assert_paired_as_defined(faces: &Faces, vertices: usize) {
    let topology = Topology::new(faces, vertices);
    let mut edges: BTreeMap<[u32; 2], Vec<(u32, bool)>> = BTreeMap::new();
    for f in 0..faces.len() {
        let face = faces.face(f);
        for (i, c) in faces.range(f).enumerate() {
            let (v, w) = (face[i], face[(i + 1) % face.len()]);
            let sides = edges.entry([v.min(w), v.max(w)]).or_default();
            sides.push((c as u32, v < w));
        }
    }
    let mut twins = vec![None; faces.corners().len()];
    let (mut boundary, mut irregular) = (Vec::new(), Vec::new());
    for (&[v, w], sides) in &edges {
        match sides[..] {
            [(c, _)] if v != w => boundary.push(c),
            [(a, forth), (b, back)] if v != w && forth != back => {
                twins[a as usize] = Some(b);
                twins[b as usize] = Some(a);
            }
            _ => irregular.push(IrregularEdge {
                vertices: [v, w],
                sides: sides.len() as u32,
                half_edges: [sides[0].0, sides[sides.len() - 1].0],
            }),
        }
    }
    boundary.sort_unstable();
    assert_eq!(topology.edges(), edges.len());
    assert_eq!(topology.boundary_half_edges(), boundary);
    assert_eq!(topology.irregular_edges(), irregular);
    for (c, &twin) in (0..).zip(&twins) {
        assert_eq!(topology.twin(c), twin, "half-edge {c}");
    }
    let incidence = &topology.incidence;
    for v in 0..vertices {
        let all = 0..faces.corners().len() as u32;
        let at: Vec<u32> = all.filter(|&c| faces.corners()[c as usize] as usize == v).collect();
        assert_eq!(incidence.corners_at(v), at);
    }
    for f in 0..faces.len() {
        let size = faces.face(f).len();
        for (i, c) in faces.range(f).enumerate() {
            let at = |k: usize| (faces.range(f).start + k % size) as u32;
            assert_eq!(incidence.face_of(c as u32), f);
            assert_eq!(incidence.next(faces, c as u32), at(i + 1));
            assert_eq!(incidence.prev(faces, c as u32), at(i + size - 1));
        }
    }
}

/// On the boundary a face that is folded back has twins, and edges with other faces.
#[test]
fn a_doubled_face_on_the_boundary_is_dropped() {
    let points: Vec<DVec3> = (0..4).map(|k| DVec3::new(f64::from(k), f64::from(k * k), 0.0)).collect();
    let lists = [[0, 1, 2], [2, 1, 3], [1, 2, 3]];
    let repaired = repair(&Mesh::new(points, Faces::from_lists(lists))).unwrap();
    assert_eq!(repaired.mesh.faces, Faces::from_lists(&lists[..2]));
    let [done] = &repaired.repairs[..] else { panic!("{:?}", repaired.repairs) };
    assert_eq!((done.kind, done.count, done.face), (RepairKind::DoubledFaces, 1, Some(2)));
}

#[test]
fn any_faces_are_paired_as_defined() {
    let mut rng = ChaCha8Rng::seed_from_u64(71);
    for round in 0..400 {
        let vertices = rng.random_range(2..40);
        let sizes = match round % 3 {
            0 => 3..=3,
            1 => 4..=4,
            _ => 3..=7,
        };
        // Loops, repeated vertices, edges with any number of sides in either direction.
        let faces = (0..rng.random_range(0..30)).map(|_| {
            let size = rng.random_range(sizes.clone());
            (0..size).map(|_| rng.random_range(0..vertices)).collect::<Vec<u32>>()
        });
        assert_paired_as_defined(&Faces::from_lists(faces.collect::<Vec<_>>()), vertices as usize);
    }
    for mesh in [builtin::bipyramid(40), builtin::irregular_tri(500, 2), builtin::irregular_poly(500, 2)] {
        // Closed, and with every fifth face missing.
        assert_paired_as_defined(&mesh.faces, mesh.len());
        let lists = mesh.faces.iter().enumerate();
        let some = lists.filter(|(f, _)| f % 5 > 0).map(|(_, face)| face);
        assert_paired_as_defined(&Faces::from_lists(some), mesh.len());
    }
}
