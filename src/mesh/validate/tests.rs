use super::*;
use crate::mesh::builtin;
use glam::DVec3;

fn mesh(vertices: usize, faces: &[&[u32]]) -> Mesh {
    // Points on a moment curve: no two equal, no three collinear.
    let at = |k: usize| DVec3::new(k as f64, (k * k) as f64, (k * k * k) as f64);
    Mesh::new((0..vertices).map(at).collect(), Faces::from_lists(faces))
}

fn refuse(mesh: &Mesh) -> Validation {
    validate(mesh, None, Boundary::Refuse)
}

fn kinds(report: &Validation) -> Vec<(DefectKind, usize)> {
    report.totals().into_iter().collect()
}

#[test]
fn closed_meshes_have_no_defects_and_known_counts() {
    let report = refuse(&builtin::cube());
    assert!(report.is_valid() && report.remarks.is_empty());
    assert_eq!(report.summary_line(), "no defects");
    let counts = report.counts.clone().unwrap();
    assert_eq!((counts.vertices, counts.edges, counts.faces), (8, 12, 6));
    assert_eq!((counts.euler_characteristic, counts.components), (2, 1));
    assert_eq!((counts.min_valence, counts.max_valence), (3, 3));
    assert_eq!(counts.boundary_loops, Some(0));
    assert_eq!(report.topology.map(|t| t.edges()), Some(12));
}

#[test]
fn an_index_out_of_range_comes_first_and_hides_the_topology_only() {
    let mut m = mesh(5, &[&[0, 1, 9], &[0, 1, 1], &[0, 1, 2], &[7, 8, 0]]);
    m.positions[3].y = f64::NAN;
    let (vertex_lines, face_lines) = ([2, 3, 4, 5, 6], [7, 8, 9, 11]);
    let report = validate(&m, Some((&vertex_lines, &face_lines)), Boundary::Refuse);
    assert!(report.topology.is_none() && report.counts.is_none());
    let places: Vec<_> = (report.defects.iter()).map(|d| (d.kind, d.face, d.vertex, d.line)).collect();
    use DefectKind::*;
    assert_eq!(
        places,
        [
            (IndexOutOfRange, Some(0), Some(9), Some(7)),
            (IndexOutOfRange, Some(3), Some(7), Some(11)),
            (IndexOutOfRange, Some(3), Some(8), Some(11)),
            (RepeatedVertex, Some(1), Some(1), Some(8)),
            (NonFiniteCoordinate, None, Some(3), Some(5)),
            (IsolatedVertex, None, Some(3), Some(5)),
            (IsolatedVertex, None, Some(4), Some(6)),
        ]
    );
    let line = report.summary_line();
    assert!(
        line.starts_with(
            "3 indices out of range (first: face 0, line 7, vertex 9, the mesh has 5 vertices); \
             1 face with a repeated vertex (face 1, line 8, vertex 1); "
        ),
        "{line}"
    );
    assert!(!line.contains('\n'));
    let error = crate::Error::Defects(Box::new(report)).to_string();
    assert_eq!(error, line);
}

#[test]
fn empty_meshes_say_what_is_missing() {
    let kinds = |m: &Mesh| kinds(&refuse(m));
    use DefectKind::*;
    assert_eq!(kinds(&mesh(0, &[])), [(NoVertices, 1), (NoFaces, 1)]);
    assert_eq!(kinds(&mesh(3, &[])), [(NoFaces, 1)]);
    assert!(refuse(&mesh(3, &[])).summary_line().starts_with("no faces; "));
    assert_eq!(kinds(&mesh(0, &[&[0, 1, 2]])), [(NoVertices, 1), (IndexOutOfRange, 3)]);
}

#[test]
fn faces_of_two_one_and_no_corners_are_defects_and_do_no_harm() {
    let m = mesh(4, &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0], &[1, 2], &[3], &[]]);
    let report = refuse(&m);
    let small: Vec<_> =
        (report.defects.iter()).filter(|d| d.kind == DefectKind::TooFewCorners).map(|d| (d.face, d.count)).collect();
    assert_eq!(small, [(Some(4), Some(2)), (Some(5), Some(1)), (Some(6), Some(0))]);
}

#[test]
fn a_vertex_twice_in_a_row_is_no_edge_defect() {
    // A cone over the square 0123 whose faces at the apex 4 are quads with the apex twice, and its base.
    let m = mesh(5, &[&[0, 1, 4, 4], &[1, 2, 4, 4], &[2, 3, 4, 4], &[3, 0, 4, 4], &[3, 2, 1, 0]]);
    let report = refuse(&m);
    assert_eq!(kinds(&report), [(DefectKind::RepeatedVertex, 4)]);
    let counts = report.counts.unwrap();
    assert_eq!((counts.min_valence, counts.max_valence), (3, 4));
}

#[test]
fn an_open_mesh_is_refused_or_treated_as_interior() {
    let mut open = builtin::icosahedron();
    open.faces = Faces::from_lists(open.faces.iter().skip(1));
    let report = refuse(&open);
    assert_eq!(kinds(&report), [(DefectKind::BoundaryEdge, 3)]);
    assert!(report.is_open_only());
    let sharp = validate(&open, None, Boundary::EdgeAndCorner);
    assert!(sharp.is_valid() && sharp.remarks[0].starts_with("3 boundary edges in 1 loop: they are sharp"));
    let mut twice = open.clone();
    twice.faces.push(&[0, 1, 1]);
    assert!(!refuse(&twice).is_open_only());
    let report = validate(&open, None, Boundary::AsInterior);
    assert!(report.is_valid());
    assert_eq!(report.remarks, ["3 boundary edges in 1 loop: boundary vertices are treated as interior"]);
    // Valences count edges: the removed face took no edge away.
    assert_eq!(report.counts.unwrap().min_valence, 5);
    // A single triangle has valence 2 whatever is made of its boundary.
    let report = validate(&mesh(3, &[&[0, 1, 2]]), None, Boundary::AsInterior);
    assert_eq!(kinds(&report), [(DefectKind::LowValence, 3)]);
    assert!(validate(&mesh(3, &[&[0, 1, 2]]), None, Boundary::EdgeOnly).is_valid());
}

#[test]
fn turned_faces_are_found_and_the_fewest_are_named() {
    let base = builtin::irregular_tri(500, 7);
    for turned in [vec![3], vec![0, 17, 18, 400], (0..500).collect()] {
        let mut lists: Vec<Vec<u32>> = base.faces.iter().map(<[u32]>::to_vec).collect();
        for &f in &turned {
            lists[f].reverse();
        }
        let m = Mesh::new(base.positions.clone(), Faces::from_lists(&lists));
        let report = refuse(&m);
        assert_eq!(kinds(&report).len(), 1);
        let orientation = report.orientation.clone().unwrap();
        let fewest = turned.len().min(lists.len() - turned.len());
        assert_eq!(orientation.faces_to_flip, fewest);
        assert_eq!(orientation.unorientable_components, 0);
        // An edge is misoriented when just one of its two faces is turned.
        let topology = Topology::new(&base.faces, base.len());
        let is_turned = |c: u32| turned.contains(&topology.incidence.face_of(c));
        let expected =
            (topology.edge_sides()).filter(|&c| is_turned(c) != is_turned(topology.twin(c).unwrap())).count();
        assert_eq!(report.defects.len(), expected);
        assert!(report.summary_line().contains("to orient the mesh consistently"));
    }
}

#[test]
fn a_moebius_band_cannot_be_oriented() {
    let n = 7u32;
    let band: Vec<[u32; 4]> = (0..n)
        .map(|k| match k + 1 {
            next if next < n => [2 * k, 2 * next, 2 * next + 1, 2 * k + 1],
            _ => [2 * k, 1, 0, 2 * k + 1],
        })
        .collect();
    let lists: Vec<&[u32]> = band.iter().map(|f| &f[..]).collect();
    let report = refuse(&mesh(2 * n as usize, &lists));
    assert_eq!(kinds(&report), [(DefectKind::InconsistentOrientation, 1), (DefectKind::BoundaryEdge, 2 * n as usize)]);
    assert_eq!(report.orientation.as_ref().unwrap().unorientable_components, 1);
    assert!(report.summary_line().contains("Möbius"));
}

#[test]
fn two_surfaces_in_one_vertex_or_edge_are_not_manifold() {
    // Two tetrahedra that share vertex 0, then edge 0-1.
    let at_vertex =
        mesh(7, &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0], &[0, 4, 5], &[0, 6, 4], &[4, 6, 5], &[5, 6, 0]]);
    let report = refuse(&at_vertex);
    assert_eq!(kinds(&report), [(DefectKind::NonManifoldVertex, 1)]);
    assert_eq!(report.defects[0].vertex, Some(0));
    assert_eq!(report.defects[0].count, Some(2));
    let at_edge =
        mesh(6, &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0], &[0, 1, 4], &[0, 5, 1], &[1, 5, 4], &[4, 5, 0]]);
    let report = refuse(&at_edge);
    assert_eq!(kinds(&report), [(DefectKind::NonManifoldEdge, 1)]);
    let edge = &report.defects[0];
    assert_eq!((edge.vertex, edge.other_vertex, edge.count), (Some(0), Some(1), Some(4)));
}

#[test]
fn the_json_has_every_defect_with_its_place() {
    let m = mesh(4, &[&[0, 1, 2]]);
    let report = validate(&m, Some((&[3, 4, 5, 6], &[7])), Boundary::Refuse);
    let json: serde_json::Value = serde_json::to_value(&report).unwrap();
    assert_eq!(json["valid"], false);
    assert_eq!(json["totals"]["boundary-edge"], 3);
    assert_eq!(json["totals"]["isolated-vertex"], 1);
    let isolated = serde_json::json!({"kind": "isolated-vertex", "vertex": 3, "line": 6});
    assert_eq!(json["defects"][0], isolated);
    let edge = serde_json::json!(
        {"kind": "boundary-edge", "face": 0, "vertex": 0, "other_vertex": 1, "line": 7}
    );
    assert_eq!(json["defects"][1], edge);
    assert_eq!(json["counts"]["edges"], 3);
}

#[test]
fn boundary_treatments_are_read_and_written() {
    for b in [Boundary::Refuse, Boundary::AsInterior] {
        assert_eq!(b.to_string().parse::<Boundary>().unwrap(), b);
    }
    assert_eq!("As_Interior".parse::<Boundary>().unwrap(), Boundary::AsInterior);
    assert!("".parse::<Boundary>().is_err() && "refused".parse::<Boundary>().is_err());
}

#[test]
fn the_report_is_the_same_with_any_number_of_threads() {
    // More vertices than one thread takes at a time; every 50th face is missing.
    let mut m = builtin::irregular_tri(20_000, 2);
    let kept = m.faces.iter().enumerate().filter(|(f, _)| f % 50 != 0);
    m.faces = Faces::from_lists(kept.map(|(_, face)| face));
    m.positions.extend_from_within(..100);
    let json = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let report = pool.build().unwrap().install(|| refuse(&m));
        serde_json::to_string(&report).unwrap()
    };
    let one = json(1);
    assert!(one.contains("100 duplicate positions") && one.contains("low-valence"));
    assert_eq!(one, json(2));
    assert_eq!(one, json(5));
}
