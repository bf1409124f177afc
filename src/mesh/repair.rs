//! Repair of meshes that are not manifold or not oriented: what can be mended without moving a vertex.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::topology::{NONE, Topology};
use super::validate::visit_orientations;
use super::{Faces, Mesh};
use crate::error::counted;

/// What was done to a mesh, in the order in which it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RepairKind {
    /// Faces that named a vertex more than once, and name it once now, where they did first.
    RepeatedCorners,
    /// Faces dropped that have fewer than three vertices.
    TooFewCorners,
    /// Faces dropped that go round the vertices of another one, in either direction.
    DoubledFaces,
    /// Faces turned round, the fewest in every component.
    TurnedFaces,
    /// Edges with more than two faces, which were cut: every face has a side of its own there.
    NonManifoldEdges,
    /// Edges cut because their component has one side only, as a Möbius band.
    OneSidedEdges,
    /// Vertices added: one for every umbrella but the first at a vertex, on the same point.
    SplitVertices,
    /// Vertices of no face, left out.
    IsolatedVertices,
}

/// One kind of repair, with its place. Vertices and faces are those of the mesh that was repaired, from 0.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Repair {
    /// What was done.
    pub kind: RepairKind,
    /// How often.
    pub count: usize,
    /// The first face it was done to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face: Option<u32>,
    /// The first vertex it was done to, or the ends of the first edge.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertices: Vec<u32>,
}

/// A repaired mesh, and where its parts come from.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// The vertices that are left in their order, then those that were added; faces that are left in their order.
    pub mesh: Mesh,
    /// The face of the original of every face.
    pub faces: Vec<u32>,
    /// The corner of the original of every corner.
    pub corners: Vec<u32>,
    /// What was done; empty where nothing was to be done.
    pub repairs: Vec<Repair>,
}

impl Repair {
    /// Whether sheets were cut apart: they lie on each other then, with boundaries that no [welding](super::weld) may
    /// close.
    pub fn is_cut(&self) -> bool {
        matches!(self.kind, RepairKind::NonManifoldEdges | RepairKind::OneSidedEdges)
    }
}

/// `3 faces turned round to agree with their neighbours (first: face 7)`.
impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (one, done) = match self.kind {
            RepairKind::RepeatedCorners => ("face", "left with each of its vertices once"),
            RepairKind::TooFewCorners => ("face", "with fewer than three vertices dropped"),
            RepairKind::DoubledFaces => ("face", "on the vertices of another dropped"),
            RepairKind::TurnedFaces => ("face", "turned round to agree with the neighbours"),
            RepairKind::NonManifoldEdges => ("edge", "with more than two faces cut into a side for each"),
            RepairKind::OneSidedEdges => ("edge", "of a surface with one side cut"),
            RepairKind::SplitVertices => ("vertex", "added, one for each further sheet at a vertex"),
            RepairKind::IsolatedVertices => ("vertex", "of no face left out"),
        };
        write!(f, "{} {done}", counted(self.count, one))?;
        match (self.face, &self.vertices[..]) {
            (Some(face), _) => write!(f, " (first: face {face})"),
            (None, [a, b]) => write!(f, " (first: vertices {a} and {b})"),
            (None, [v]) => write!(f, " (first: vertex {v})"),
            _ => Ok(()),
        }
    }
}

/// Faces while they are mended, with where they come from.
struct Work {
    faces: Faces,
    from: Vec<u32>,
    corners: Vec<u32>,
}

impl Work {
    fn with_capacity(corners: usize) -> Self {
        Work { faces: Faces::with_capacity(corners), from: Vec::new(), corners: Vec::with_capacity(corners) }
    }

    /// Adds a face of the corners of the original.
    fn push(&mut self, mesh: &Mesh, face: u32, corners: &[u32]) {
        let vertices: Vec<u32> = corners.iter().map(|&c| mesh.faces.corners()[c as usize]).collect();
        self.faces.push(&vertices);
        self.from.push(face);
        self.corners.extend_from_slice(corners);
    }
}

/// Makes a manifold of `mesh`, consistently oriented, without moving a vertex: vertices that faces name again and doubled
/// faces are dropped, faces are turned to agree, edges with more than two faces are cut as those of Guéziec, Taubin,
/// Lazarus and Horn, *Cutting and stitching* (2001), are, and so are edges along which a surface with one side disagrees; a
/// vertex becomes one for each umbrella, and vertices of no face are left out. Sheets that were cut apart have boundaries
/// there, which are sharp curves through the same points, as subdivision tools take such edges. `None` if a face names a
/// vertex that is not there.
///
/// Coordinates that are not finite, and valences below three, stay. A valid mesh comes back as it was, and so does a
/// repaired one. O(C log C) for C corners.
///
/// ```
/// use limitlab::mesh::repair::{RepairKind, repair};
/// use limitlab::mesh::{Faces, Mesh};
/// use glam::DVec3;
/// // The second of two triangles runs against the first.
/// let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE];
/// let repaired = repair(&Mesh::new(points, Faces::from_lists([[0, 1, 2], [1, 2, 3]]))).unwrap();
/// assert_eq!(repaired.mesh.faces.face(1), [1, 3, 2]);
/// assert_eq!((repaired.repairs[0].kind, repaired.repairs[0].face), (RepairKind::TurnedFaces, Some(1)));
/// ```
pub fn repair(mesh: &Mesh) -> Option<Repaired> {
    let n = mesh.len();
    if mesh.faces.corners().iter().any(|&v| v as usize >= n) {
        return None;
    }
    let mut repairs = Vec::new();
    let simple = without_repetitions(mesh, &mut repairs);
    let single = without_doubles(mesh, simple, &mut repairs);
    let agreeing = turned(mesh, single, &mut repairs);
    let Work { mut faces, from, corners } = agreeing;
    let mut positions = mesh.positions.clone();
    split(&mut faces, &mut positions, &mut repairs);

    let mut place = vec![NONE; positions.len()];
    faces.corners().iter().for_each(|&v| place[v as usize] = v);
    let isolated: Vec<u32> = (0..positions.len() as u32).filter(|&v| place[v as usize] == NONE).collect();
    if let Some(&first) = isolated.first() {
        repairs.push(Repair {
            kind: RepairKind::IsolatedVertices,
            count: isolated.len(),
            face: None,
            vertices: vec![first],
        });
        let mut kept = Vec::with_capacity(positions.len() - isolated.len());
        for (place, p) in place.iter_mut().zip(positions).filter(|(place, _)| **place != NONE) {
            *place = kept.len() as u32;
            kept.push(p);
        }
        positions = kept;
        faces.corners_mut().iter_mut().for_each(|v| *v = place[*v as usize]);
    }
    Some(Repaired { mesh: Mesh::new(positions, faces), faces: from, corners, repairs })
}

/// Notes what was done to some faces, if any.
fn note(repairs: &mut Vec<Repair>, kind: RepairKind, faces: &[u32]) {
    let repair = |&first| Repair { kind, count: faces.len(), face: Some(first), vertices: Vec::new() };
    repairs.extend(faces.iter().min().map(repair));
}

/// Faces with each vertex once.
fn without_repetitions(mesh: &Mesh, repairs: &mut Vec<Repair>) -> Work {
    let mut work = Work::with_capacity(mesh.faces.corners().len());
    let (mut repeated, mut lost) = (Vec::new(), Vec::new());
    // The face that named a vertex last.
    let mut named_by = vec![NONE; mesh.len()];
    let mut corners = Vec::new();
    for f in 0..mesh.faces.len() as u32 {
        let range = mesh.faces.range(f as usize);
        let size = range.len();
        corners.clear();
        corners.extend((range.start as u32..range.end as u32).filter(|&c| {
            let last = &mut named_by[mesh.faces.corners()[c as usize] as usize];
            std::mem::replace(last, f) != f
        }));
        if corners.len() < 3 {
            lost.push(f);
            continue;
        }
        if corners.len() < size {
            repeated.push(f);
        }
        work.push(mesh, f, &corners);
    }
    note(repairs, RepairKind::RepeatedCorners, &repeated);
    note(repairs, RepairKind::TooFewCorners, &lost);
    work
}

/// The vertices of a face from the least on, in the direction of its lesser neighbour.
fn cycle(face: &[u32]) -> Vec<u32> {
    let n = face.len();
    let start = (0..n).min_by_key(|&k| face[k]).unwrap_or(0);
    let step = if face[(start + 1) % n] <= face[(start + n - 1) % n] { 1 } else { n - 1 };
    (0..n).map(|k| face[(start + k * step) % n]).collect()
}

/// Of faces on one cycle of vertices the first, unless two are a closed surface by themselves.
fn without_doubles(mesh: &Mesh, work: Work, repairs: &mut Vec<Repair>) -> Work {
    let topology = Topology::new(&work.faces, mesh.len());
    let mut first: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
    // Two faces on one cycle have all edges in common: where no other face is at any of these they are twins on each.
    let is_double = |f: usize| {
        let has_twins = work.faces.range(f).all(|c| topology.twin(c as u32).is_some());
        !has_twins && *first.entry(cycle(work.faces.face(f))).or_insert(f as u32) != f as u32
    };
    let is_doubled: Vec<bool> = (0..work.faces.len()).map(is_double).collect();
    let doubled: Vec<u32> = (0..work.faces.len()).filter(|&f| is_doubled[f]).map(|f| work.from[f]).collect();
    note(repairs, RepairKind::DoubledFaces, &doubled);
    if doubled.is_empty() {
        return work;
    }
    let mut kept = Work::with_capacity(work.corners.len());
    for f in (0..work.faces.len()).filter(|&f| !is_doubled[f]) {
        kept.push(mesh, work.from[f], &work.corners[work.faces.range(f)]);
    }
    kept
}

/// Faces that agree with their neighbours, as far as there are two sides.
fn turned(mesh: &Mesh, work: Work, repairs: &mut Vec<Repair>) -> Work {
    let topology = Topology::new(&work.faces, mesh.len());
    let mut turns = Vec::new();
    visit_orientations(&work.faces, &topology, |component| turns.extend(component.fewest()));
    if turns.is_empty() {
        return work;
    }
    let mut is_turned = vec![false; work.faces.len()];
    turns.iter().for_each(|&f| is_turned[f as usize] = true);
    let from: Vec<u32> = turns.iter().map(|&f| work.from[f as usize]).collect();
    note(repairs, RepairKind::TurnedFaces, &from);
    let mut agreeing = Work::with_capacity(work.corners.len());
    for (f, &turned) in is_turned.iter().enumerate() {
        let mut corners = work.corners[work.faces.range(f)].to_vec();
        if turned {
            corners[1..].reverse();
        }
        agreeing.push(mesh, work.from[f], &corners);
    }
    agreeing
}

/// Gives every umbrella at a vertex a vertex of its own, where faces are neighbours if they alone share an edge, in
/// opposite directions.
fn split(faces: &mut Faces, positions: &mut Vec<DVec3>, repairs: &mut Vec<Repair>) {
    let topology = Topology::new(faces, positions.len());
    for kind in [RepairKind::NonManifoldEdges, RepairKind::OneSidedEdges] {
        let is_one_sided = kind == RepairKind::OneSidedEdges;
        let mut edges = topology.irregular_edges().iter().filter(|e| e.is_misoriented() == is_one_sided).peekable();
        if let Some(first) = edges.peek() {
            let vertices = first.vertices.to_vec();
            repairs.push(Repair { kind, count: edges.count(), face: None, vertices });
        }
    }
    let mut renamed: Vec<(u32, u32)> = Vec::new();
    let mut is_passed = vec![false; faces.corners().len()];
    let before = positions.len();
    let mut first_split = None;
    for v in 0..before {
        let mut umbrellas = 0;
        for &start in topology.incidence.corners_at(v) {
            if std::mem::replace(&mut is_passed[start as usize], true) {
                continue;
            }
            umbrellas += 1;
            let name = if umbrellas == 1 { v } else { positions.len() } as u32;
            if umbrellas > 1 {
                positions.push(positions[v]);
                first_split.get_or_insert(v as u32);
                renamed.push((start, name));
            }
            // All the way round, or to both ends.
            for step in [Topology::counter_clockwise, Topology::clockwise] {
                let mut at = start;
                while let Some(c) = step(&topology, faces, at).filter(|&c| !is_passed[c as usize]) {
                    is_passed[c as usize] = true;
                    if umbrellas > 1 {
                        renamed.push((c, name));
                    }
                    at = c;
                }
            }
        }
    }
    renamed.iter().for_each(|&(c, name)| faces.corners_mut()[c as usize] = name);
    if let Some(first) = first_split {
        let count = positions.len() - before;
        repairs.push(Repair { kind: RepairKind::SplitVertices, count, face: None, vertices: vec![first] });
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::super::io::WriteOptions;
    use super::super::origin::Origin;
    use super::super::validate::{Boundary, DefectKind, validate};
    use super::super::{builtin, obj};
    use super::*;

    fn mesh(vertices: usize, faces: &[&[u32]]) -> Mesh {
        let at = |k: usize| DVec3::new(k as f64, (k * k) as f64, (k * k * k) as f64);
        Mesh::new((0..vertices).map(at).collect(), Faces::from_lists(faces))
    }

    fn kinds(repaired: &Repaired) -> Vec<(RepairKind, usize)> {
        repaired.repairs.iter().map(|r| (r.kind, r.count)).collect()
    }

    #[test]
    fn each_kind_is_mended_and_told() {
        // Three triangles about one edge: each has a side of its own.
        let fins = repair(&mesh(5, &[&[0, 1, 2], &[1, 0, 3], &[0, 1, 4]])).unwrap();
        assert_eq!(kinds(&fins), [(RepairKind::NonManifoldEdges, 1), (RepairKind::SplitVertices, 4)]);
        assert_eq!((fins.mesh.len(), fins.repairs[0].vertices.as_slice()), (9, &[0, 1][..]));
        assert_eq!(
            fins.repairs[1].to_string(),
            "4 vertices added, one for each further sheet at a vertex (first: vertex 0)"
        );
        // Two triangles that meet in a vertex.
        let bow_tie = repair(&mesh(5, &[&[0, 1, 2], &[0, 3, 4]])).unwrap();
        assert_eq!(kinds(&bow_tie), [(RepairKind::SplitVertices, 1)]);
        assert_eq!(bow_tie.mesh.faces.face(1), [5, 3, 4]);
        // Repeated corners, a face that is nothing then, a double in the other direction, a vertex that goes with it.
        let doubled = repair(&mesh(6, &[&[0, 1, 1, 2, 0], &[3, 4, 3], &[2, 1, 3], &[1, 2, 3], &[3, 2, 1]])).unwrap();
        let expected = [
            (RepairKind::RepeatedCorners, 1),
            (RepairKind::TooFewCorners, 1),
            (RepairKind::DoubledFaces, 2),
            (RepairKind::IsolatedVertices, 2),
        ];
        assert_eq!(kinds(&doubled), expected);
        assert_eq!((doubled.faces.as_slice(), doubled.corners.as_slice()), (&[0, 2][..], &[0, 1, 3, 8, 9, 10][..]));
        assert_eq!((doubled.repairs[2].face, doubled.repairs[3].vertices.as_slice()), (Some(3), &[4][..]));
        // A face that runs against two others.
        let turned = repair(&mesh(5, &[&[0, 1, 2], &[2, 1, 3], &[2, 4, 3]])).unwrap();
        assert_eq!(kinds(&turned), [(RepairKind::TurnedFaces, 1)]);
        assert_eq!((turned.mesh.faces.face(2), &turned.corners[6..]), (&[2, 3, 4][..], &[6, 8, 7][..]));
        // A Möbius band of five triangles is cut once across.
        let band: Vec<[u32; 3]> = (0..5).map(|k| [k, (k + 1) % 5, (k + 2) % 5]).collect();
        let lists: Vec<&[u32]> = band.iter().map(|f| &f[..]).collect();
        let cut = repair(&mesh(5, &lists)).unwrap();
        assert_eq!(cut.repairs[1].kind, RepairKind::OneSidedEdges);
        assert!(cut.repairs[1].is_cut() && validate(&cut.mesh, None, Boundary::EdgeAndCorner).is_valid());
        // What is no mesh at all is left to the validator.
        assert_eq!(repair(&mesh(3, &[&[0, 1, 3]])), None);
        // A closed surface of two faces is no double.
        assert!(repair(&mesh(3, &[&[0, 1, 2], &[2, 1, 0]])).unwrap().repairs.is_empty());
    }

    #[test]
    fn a_valid_mesh_is_left_as_it_was() {
        for name in ["cube", "torus:5x4", "icosphere:1", "irregular-quad:30"] {
            let whole = builtin::builtin(name).unwrap();
            let open = Mesh::new(whole.positions.clone(), Faces::from_lists(whole.faces.iter().skip(1)));
            for given in [whole, open] {
                let repaired = repair(&given).unwrap();
                assert!(repaired.repairs.is_empty());
                assert_eq!(repaired.mesh, given);
                assert!(repaired.corners.iter().enumerate().all(|(k, &c)| k == c as usize));
            }
        }
    }

    /// What was damaged, by kinds of damage with a place each.
    fn damaged(base: usize, damage: &[(u8, prop::sample::Index, prop::sample::Index)]) -> Mesh {
        let name = ["cube", "octahedron", "torus:5x4", "icosphere:1"][base];
        let Mesh { mut positions, faces } = builtin::builtin(name).unwrap();
        let mut lists: Vec<Vec<u32>> = faces.iter().map(<[u32]>::to_vec).collect();
        for (kind, one, other) in damage {
            let f = one.index(lists.len());
            let v = other.index(positions.len()) as u32;
            match kind {
                0 => lists[f].reverse(),
                1 => lists.push(lists[f].clone()),
                2 => {
                    let turned = lists[f].iter().rev().copied().collect();
                    lists.insert(0, turned);
                }
                3 => {
                    let again = lists[f][0];
                    lists[f].push(again);
                }
                4 => {
                    let side = [lists[f][0], lists[f][1], positions.len() as u32];
                    positions.push(DVec3::splat(2.0 + positions.len() as f64));
                    lists.push(side.to_vec());
                }
                // Another vertex in its place: pinches, and faces that name it twice.
                5 => lists[f][0] = v,
                6 => positions.insert(positions.len(), DVec3::NEG_ONE),
                _ if lists.len() > 1 => drop(lists.remove(f)),
                _ => {}
            }
        }
        Mesh::new(positions, Faces::from_lists(lists))
    }

    proptest! {
        #[test]
        fn damaged_meshes_are_valid_afterwards_and_keep_their_numbers(
            base in 0..4usize,
            damage in prop::collection::vec(
                (0..8u8, any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..12,
            ),
        ) {
            let given = damaged(base, &damage);
            let repaired = repair(&given).unwrap();
            let report = validate(&repaired.mesh, None, Boundary::EdgeAndCorner);
            let left = |kind: &DefectKind| matches!(kind, DefectKind::LowValence | DefectKind::NoFaces | DefectKind::NoVertices);
            prop_assert!(report.totals().keys().all(left), "{}", report.summary_line());
            let before = validate(&given, None, Boundary::EdgeAndCorner);
            prop_assert_eq!(before.is_valid(), repaired.repairs.is_empty() && report.is_valid());
            prop_assert_eq!(before.is_repairable, !before.is_valid() && report.is_valid());
            let again = repair(&repaired.mesh).unwrap();
            prop_assert!(again.repairs.is_empty(), "{:?}", again.repairs);
            prop_assert_eq!(&again.mesh, &repaired.mesh);

            // Every face goes round the vertices of its original, in one direction or the other; none is moved.
            for (f, &from) in repaired.faces.iter().enumerate() {
                let mut original = given.faces.face(from as usize).to_vec();
                let mut seen = std::collections::HashSet::new();
                original.retain(|&v| seen.insert(v));
                let range = repaired.mesh.faces.range(f);
                let mut corners: Vec<u32> = range.clone().map(|c| given.faces.corners()[repaired.corners[c] as usize]).collect();
                for (c, &v) in range.zip(&corners) {
                    let there = repaired.mesh.positions[repaired.mesh.faces.corners()[c] as usize];
                    prop_assert_eq!(there, given.positions[v as usize]);
                }
                if corners != original {
                    corners[1..].reverse();
                }
                prop_assert_eq!(corners, original);
            }

            // In the numbering of the file.
            let origin = Origin::new(&given, &repaired.mesh, Some(&repaired.corners));
            let written = origin.written(&repaired.mesh.positions);
            prop_assert_eq!(&written.positions[..given.len()], &given.positions[..]);
            let places: Vec<_> = origin.places().collect();
            for (&there, (&name, &c)) in
                repaired.mesh.faces.corners().iter().zip(written.faces.corners().iter().zip(&repaired.corners))
            {
                prop_assert_eq!(places[name as usize], Some(there));
                let of_file = given.faces.corners()[c as usize];
                prop_assert!(name == of_file || name as usize >= given.len());
                prop_assert!(origin.of_vertex(of_file).any(|v| v == there));
                prop_assert!(origin.sources()[there as usize] <= of_file);
            }
            let all: usize = (0..given.len() as u32).map(|v| origin.of_vertex(v).count()).sum();
            prop_assert_eq!(all, repaired.mesh.len());
        }
    }

    #[test]
    fn attributes_follow_their_faces_and_corners() {
        let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 2 1\nvt 1\nvt 2\nvt 3\nvt 4\n";
        let text = format!("{points}g a\nf 1/1 2/2 3/3\ng b\nf 2/2 3/3 1/1\nusemtl c\nf 2/2 3/3 4/4\ns 1\n");
        let loaded = obj::read_bytes(text.as_bytes(), Path::new("a.obj")).unwrap();
        let repaired = repair(&loaded.mesh).unwrap();
        let attributes = loaded.attributes.of_corners(&repaired.faces, &repaired.corners);
        let origin = Origin::new(&loaded.mesh, &repaired.mesh, Some(&repaired.corners));
        let mut written = Vec::new();
        let options = WriteOptions { attributes: Some(&attributes), ..WriteOptions::default() };
        obj::write_control_to(&mut written, &origin.written(&repaired.mesh.positions), &options).unwrap();
        let expected = format!("{points}g a\nf 1/1 2/2 3/3\ng b\nusemtl c\nf 2/2 4/4 3/3\ns 1\n");
        assert_eq!(String::from_utf8(written).unwrap(), expected);
    }
}
