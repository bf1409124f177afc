//! Mesh validation: all defects at once, each with its place, and remarks on what is merely odd.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Serialize, Serializer, ser::SerializeStruct};

pub use super::boundary::Boundary;
pub use super::defect::{Defect, DefectKind};
use super::incidence::{Incidence, next_in, prev_in};
use super::origin::Numbers;
use super::repair::repair;
use super::topology::{NONE, Topology, join};
use super::{Faces, Mesh, degenerate};
use crate::error::counted;
use crate::parallel;

/// Vertices or corners of one task.
const CHUNK: usize = 4096;

/// The size and shape of a mesh whose indices are good.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// The number of vertices, isolated ones included.
    pub vertices: usize,
    /// The number of edges, each counted once whatever its number of face sides.
    pub edges: usize,
    /// The number of faces.
    pub faces: usize,
    /// Isolated vertices are not components here.
    pub components: usize,
    /// V − E + F, isolated vertices included.
    pub euler_characteristic: i64,
    /// The number of edges with a single face side.
    pub boundary_edges: usize,
    /// `None` where an edge with more than two sides, or a misoriented one, leaves the loops undefined.
    pub boundary_loops: Option<usize>,
    /// The number of edges at a vertex, isolated vertices aside; 0 and 0 for a mesh without faces.
    pub min_valence: usize,
    /// The greatest of these numbers; the former is the least.
    pub max_valence: usize,
    /// Corners of the largest face.
    pub max_face_size: usize,
}

/// How to mend an orientation that is not consistent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Orientation {
    /// How many faces to turn round, the fewest: in every component the smaller side of the two.
    pub faces_to_flip: usize,
    /// The first of them.
    pub first: Option<u32>,
    /// Components of faces that cannot be oriented at all, such as a Möbius band.
    pub unorientable_components: usize,
}

/// The whole report. [`Serialize`] gives the JSON of `--defects`.
#[derive(Clone, Debug)]
pub struct Validation {
    /// All defects, in the order of [`DefectKind`] and, within a kind, of the file.
    pub defects: Vec<Defect>,
    /// Oddities that real closed models have and that no method minds: duplicate positions, zero-area faces,
    /// faces on the same positions; and the boundary, where it is treated as interior.
    pub remarks: Vec<String>,
    /// Absent if a face names a vertex that does not exist.
    pub counts: Option<Counts>,
    /// Present if an edge has its two faces in the same direction.
    pub orientation: Option<Orientation>,
    /// Whether [`repair`] leaves no defects. False where there are none.
    pub is_repairable: bool,
    /// Absent if a face names a vertex that does not exist.
    pub(super) topology: Option<Topology>,
}

impl Serialize for Validation {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut report = serializer.serialize_struct("Validation", 7)?;
        report.serialize_field("valid", &self.is_valid())?;
        report.serialize_field("totals", &self.totals())?;
        report.serialize_field("defects", &self.defects)?;
        report.serialize_field("remarks", &self.remarks)?;
        report.serialize_field("counts", &self.counts)?;
        report.serialize_field("orientation", &self.orientation)?;
        report.serialize_field("repairable", &self.is_repairable)?;
        report.end()
    }
}

impl Validation {
    /// Whether there are no defects; remarks do not count.
    pub fn is_valid(&self) -> bool {
        self.defects.is_empty()
    }

    /// How many defects there are of every kind that occurs.
    pub fn totals(&self) -> BTreeMap<DefectKind, usize> {
        let mut totals = BTreeMap::new();
        for group in self.groups() {
            totals.insert(group[0].kind, group.len());
        }
        totals
    }

    fn groups(&self) -> impl Iterator<Item = &[Defect]> {
        self.defects.chunk_by(|a, b| a.kind == b.kind)
    }

    /// All kinds of defects in one line, each with its count and first place, and what to do about the first
    /// kind; for a valid mesh `no defects`.
    pub fn summary_line(&self) -> String {
        let Some(first) = self.defects.first() else {
            return "no defects".into();
        };
        let groups: Vec<String> = self
            .groups()
            .map(|group| {
                let title = group[0].kind.title(group.len());
                let place = group[0].to_string();
                match group {
                    _ if place.is_empty() => title,
                    [_] => format!("{title} ({place})"),
                    _ => format!("{title} (first: {place})"),
                }
            })
            .collect();
        format!("{}; {}", groups.join("; "), self.advice(first.kind))
    }

    /// Whether a boundary that is [refused](Boundary::Refuse) is all that is wrong, vertices of valence 2 aside, which an
    /// open mesh may have.
    pub fn is_open_only(&self) -> bool {
        let least = self.counts.as_ref().map_or(0, |c| c.min_valence);
        let kinds = self.totals();
        kinds.contains_key(&DefectKind::BoundaryEdge)
            && kinds.keys().all(|kind| matches!(kind, DefectKind::BoundaryEdge | DefectKind::LowValence))
            && least >= Boundary::EdgeAndCorner.least_valence()
    }

    fn advice(&self, kind: DefectKind) -> String {
        match kind {
            DefectKind::NoVertices => "give a mesh with vertices and faces".into(),
            DefectKind::NoFaces => "give a mesh with faces: a point cloud has no limit surface".into(),
            DefectKind::IndexOutOfRange => {
                "correct the face or add the missing vertices (vertices are numbered from 0 here)".into()
            }
            DefectKind::TooFewCorners => "remove such faces".into(),
            DefectKind::RepeatedVertex => "remove the repetitions, or the faces".into(),
            DefectKind::NonFiniteCoordinate => "give finite coordinates".into(),
            DefectKind::NonManifoldEdge => "delete the extra faces, or split the mesh along such edges".into(),
            DefectKind::InconsistentOrientation => match &self.orientation {
                Some(o) if o.unorientable_components > 0 => {
                    "the surface cannot be oriented (a Möbius band or Klein bottle): no turning of faces helps".into()
                }
                Some(Orientation { faces_to_flip, first: Some(first), .. }) => format!(
                    "turn {} round (first: face {first}) to orient the mesh consistently",
                    counted(*faces_to_flip, "face")
                ),
                _ => "orient the faces consistently".into(),
            },
            DefectKind::NonManifoldVertex => "split such a vertex into one for each umbrella of faces".into(),
            DefectKind::IsolatedVertex => "remove vertices that no face uses".into(),
            DefectKind::LowValence => "give such vertices three edges or more, or remove them".into(),
            DefectKind::BoundaryEdge => "close the holes or stitch the faces".into(),
        }
    }
}

/// Looks for every defect of `mesh`. `lines` are the 1-based lines of the vertices and of the faces in the file.
///
/// Time is linear in the corners for bounded valences and face sizes, but for the sorts that find duplicate
/// positions and faces; vertices are examined in parallel and reported in the same order with any number of
/// threads. A mesh with defects is repaired to see whether that helps, which takes some times as long.
///
/// ```
/// use limitlab::mesh::{Faces, Mesh, validate::{validate, Boundary}};
/// use glam::DVec3;
/// let triangle = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], Faces::from_lists([[0, 1, 2]]));
/// let report = validate(&triangle, None, Boundary::Refuse);
/// assert!(report.summary_line().contains("3 boundary edges (first: face 0, vertices 0 and 1)"));
/// ```
pub fn validate(mesh: &Mesh, lines: Option<(&[u32], &[u32])>, boundary: Boundary) -> Validation {
    let mut report = examine(mesh, boundary);
    if !report.is_valid() {
        report.is_repairable = repair(mesh).is_some_and(|repaired| examine(&repaired.mesh, boundary).is_valid());
    }
    if let Some((vertex_lines, face_lines)) = lines {
        for d in &mut report.defects {
            let line = match (d.face, d.vertex) {
                (Some(f), _) => face_lines.get(f as usize),
                (None, Some(v)) => vertex_lines.get(v as usize),
                (None, None) => None,
            };
            d.line = line.copied();
            let other = d.other_face.and_then(|f| face_lines.get(f as usize));
            d.other_line = other.copied();
        }
    }
    report
}

/// The report without lines.
fn examine(mesh: &Mesh, boundary: Boundary) -> Validation {
    let mut report = Validation {
        defects: Vec::new(),
        remarks: Vec::new(),
        counts: None,
        orientation: None,
        is_repairable: false,
        topology: None,
    };
    if mesh.is_empty() {
        report.defects.push(Defect::new(DefectKind::NoVertices));
    }
    if mesh.faces.is_empty() {
        report.defects.push(Defect::new(DefectKind::NoFaces));
    }
    let corners = mesh.faces.corners();
    let indices_are_good = parallel::all(corners.len(), |c| (corners[c] as usize) < mesh.len());
    let incidence = indices_are_good.then(|| Arc::new(Incidence::new(&mesh.faces, mesh.len())));
    let ((defects, isolated), remarks) = rayon::join(
        || examine_faces(mesh),
        || {
            let Some(incidence) = &incidence else { return Vec::new() };
            let topology = || examine_topology(mesh, Arc::clone(incidence), boundary, &mut report);
            let all = (&mesh.faces, &**incidence);
            rayon::join(topology, || degenerate::remarks(&mesh.positions, all, &Numbers::default(), false)).1
        },
    );
    report.remarks.extend(remarks);
    report.defects.extend(defects);
    if let Some(counts) = &mut report.counts {
        counts.components -= isolated;
    }
    report.defects.sort_by_key(|d| d.kind);
    report
}

/// Defects of faces and positions by themselves, and vertices of no face, with their number.
fn examine_faces(mesh: &Mesh) -> (Vec<Defect>, usize) {
    let n = mesh.len();
    let mut defects = Vec::new();
    // The face that named a vertex last.
    let mut named_by = vec![NONE; n];
    for (f, face) in mesh.faces.iter().enumerate() {
        if face.len() < 3 {
            defects.push(Defect { count: Some(face.len() as u32), ..Defect::at_face(DefectKind::TooFewCorners, f) });
        }
        let mut repeated = None;
        for &v in face {
            match named_by.get_mut(v as usize) {
                Some(last) => {
                    if *last == f as u32 && repeated.is_none() {
                        repeated = Some(v);
                    }
                    *last = f as u32;
                }
                None => defects.push(Defect {
                    vertex: Some(v),
                    count: Some(n as u32),
                    ..Defect::at_face(DefectKind::IndexOutOfRange, f)
                }),
            }
        }
        if repeated.is_some() {
            defects.push(Defect { vertex: repeated, ..Defect::at_face(DefectKind::RepeatedVertex, f) });
        }
    }
    let isolated = named_by.iter().filter(|&&f| f == NONE).count();
    // Without any face that defect says it all.
    if !mesh.faces.is_empty() {
        for (v, _) in named_by.iter().enumerate().filter(|&(_, &f)| f == NONE) {
            defects.push(Defect::at_vertex(DefectKind::IsolatedVertex, v as u32));
        }
    }
    for (v, p) in mesh.positions.iter().enumerate() {
        if !p.is_finite() {
            defects.push(Defect::at_vertex(DefectKind::NonFiniteCoordinate, v as u32));
        }
    }
    (defects, isolated)
}

/// Defects of edges and vertices, the counts, and the topology itself.
fn examine_topology(mesh: &Mesh, incidence: Arc<Incidence>, boundary: Boundary, report: &mut Validation) {
    let faces = &mesh.faces;
    let topology = Topology::of(incidence, faces);
    let incidence = &topology.incidence;
    for edge in topology.irregular_edges().iter().filter(|e| !e.is_loop()) {
        let [first, last] = edge.half_edges.map(|c| incidence.face_of(c));
        report.defects.push(if edge.is_misoriented() {
            Defect {
                other_face: Some(last as u32),
                ..Defect::at_edge(DefectKind::InconsistentOrientation, first, edge.vertices)
            }
        } else {
            Defect { count: Some(edge.sides), ..Defect::at_edge(DefectKind::NonManifoldEdge, first, edge.vertices) }
        });
    }
    if topology.irregular_edges().iter().any(|e| e.is_misoriented()) {
        report.orientation = Some(examine_orientation(faces, &topology));
    }
    // Components are found one after the other, vertices in parallel.
    let ((min_valence, max_valence), components) = rayon::join(
        || examine_vertices(faces, &topology, boundary, &mut report.defects),
        || topology.components(faces).1,
    );
    let boundary_edges = topology.boundary_edges();
    let boundary_loops = topology
        .irregular_edges()
        .is_empty()
        .then(|| if boundary_edges == 0 { 0 } else { topology.boundary_loops(faces).len() });
    match boundary {
        Boundary::Refuse => {
            for &c in topology.boundary_half_edges() {
                let f = incidence.face_of(c);
                let end = faces.corners()[next_in(&faces.range(f), c) as usize];
                let ends = [faces.corners()[c as usize], end];
                let defect = Defect::at_edge(DefectKind::BoundaryEdge, f, ends);
                report.defects.push(defect);
            }
        }
        Boundary::AsInterior | Boundary::EdgeAndCorner | Boundary::EdgeOnly if boundary_edges > 0 => {
            report.remarks.push(boundary_remark(boundary_edges, boundary_loops, boundary));
        }
        Boundary::AsInterior | Boundary::EdgeAndCorner | Boundary::EdgeOnly => {}
    }
    report.counts = Some(Counts {
        vertices: mesh.len(),
        edges: topology.edges(),
        faces: faces.len(),
        components,
        euler_characteristic: topology.euler_characteristic(faces),
        boundary_edges,
        boundary_loops,
        min_valence,
        max_valence,
        max_face_size: faces.iter().map(<[u32]>::len).max().unwrap_or(0),
    });
    report.topology = Some(topology);
}

/// What to know of a boundary that is allowed.
pub(super) fn boundary_remark(edges: usize, loops: Option<usize>, boundary: Boundary) -> String {
    let edges = counted(edges, "boundary edge");
    let loops = loops.map_or_else(String::new, |l| format!(" in {}", counted(l, "loop")));
    let treatment = match boundary {
        Boundary::AsInterior => "boundary vertices are treated as interior",
        Boundary::EdgeAndCorner => "they are sharp, and vertices with one face are corners",
        Boundary::EdgeOnly => "they are sharp, and the curve is smooth at vertices with one face",
        Boundary::Refuse => "they are not allowed",
    };
    format!("{edges}{loops}: {treatment}")
}

/// Umbrellas and valences of all vertices, in parallel. Returns the least and the greatest valence.
fn examine_vertices(
    faces: &Faces,
    topology: &Topology,
    boundary: Boundary,
    defects: &mut Vec<Defect>,
) -> (usize, usize) {
    let incidence = &topology.incidence;
    let n = incidence.vertices();
    let is_closed = topology.is_closed();
    let least = if is_closed { 3 } else { boundary.least_valence() };
    let chunks = parallel::map(n, CHUNK, |range| {
        let mut link = Link::default();
        let mut found = Vec::new();
        let (mut min, mut max) = (usize::MAX, 0);
        for v in range {
            if incidence.face_count(v) == 0 {
                continue;
            }
            // One umbrella of edges with two sides each: the valence is the number of faces.
            let (valence, umbrellas) = if is_closed && topology.is_one_umbrella(faces, v) {
                (incidence.face_count(v), 1)
            } else {
                link.examine(faces, incidence, v)
            };
            min = min.min(valence);
            max = max.max(valence);
            let mut report = |kind, count: usize| {
                found.push(Defect { count: Some(count as u32), ..Defect::at_vertex(kind, v as u32) });
            };
            if umbrellas > 1 {
                report(DefectKind::NonManifoldVertex, umbrellas);
            }
            if valence < least {
                report(DefectKind::LowValence, valence);
            }
        }
        (found, min, max)
    });
    let (mut min, mut max) = (usize::MAX, 0);
    for (found, lo, hi) in chunks {
        defects.extend(found);
        min = min.min(lo);
        max = max.max(hi);
    }
    (min.min(max), max)
}

/// The surroundings of one vertex, whatever the orientation of its faces and the number of sides of its edges.
#[derive(Default)]
struct Link {
    /// Neighbour in the upper half, corner (counted at the vertex) in the lower.
    sides: Vec<u64>,
    /// A forest over the corners: those joined by an edge at the vertex have one root.
    parent: Vec<u32>,
}

impl Link {
    /// The number of edges at `v`, each once, loops not counted, and the number of its umbrellas: the classes of
    /// its corners under sharing an edge at `v`, or a face.
    fn examine(&mut self, faces: &Faces, incidence: &Incidence, v: usize) -> (usize, usize) {
        let corners = incidence.corners_at(v);
        self.sides.clear();
        self.parent.clear();
        self.parent.extend(0..corners.len() as u32);
        let mut umbrellas = corners.len();
        for (k, &c) in corners.iter().enumerate() {
            let f = incidence.face_of(c);
            let range = faces.range(f);
            for side in [next_in(&range, c), prev_in(&range, c)] {
                let w = faces.corners()[side as usize];
                if w as usize != v {
                    self.sides.push(u64::from(w) << 32 | k as u64);
                }
            }
            // A face that passes the vertex twice is a repeated vertex, not a second umbrella.
            if k > 0 && incidence.face_of(corners[k - 1]) == f {
                umbrellas -= usize::from(join(&mut self.parent, k as u32 - 1, k as u32));
            }
        }
        self.sides.sort_unstable();
        let mut valence = 0;
        for edge in self.sides.chunk_by(|a, b| a >> 32 == b >> 32) {
            valence += 1;
            for pair in edge.windows(2) {
                umbrellas -= usize::from(join(&mut self.parent, pair[0] as u32, pair[1] as u32));
            }
        }
        (valence, umbrellas)
    }
}

/// What must be turned round to orient the mesh. Linear.
fn examine_orientation(faces: &Faces, topology: &Topology) -> Orientation {
    let mut verdict = Orientation { faces_to_flip: 0, first: None, unorientable_components: 0 };
    visit_orientations(faces, topology, |side| {
        if side.has_conflict {
            verdict.unorientable_components += 1;
            return;
        }
        verdict.faces_to_flip += side.fewest().count();
        verdict.first = verdict.first.into_iter().chain(side.fewest()).min();
    });
    verdict
}

/// A component of faces, and which of them run against its first.
pub(super) struct Sides<'a> {
    component: &'a [usize],
    turned: &'a [Option<bool>],
    /// Whether no turning makes all of them agree, as on a Möbius band.
    has_conflict: bool,
}

impl Sides<'_> {
    /// The faces of the smaller side of the two.
    pub fn fewest(&self) -> impl Iterator<Item = u32> + '_ {
        let ones = self.component.iter().filter(|&&f| self.turned[f] == Some(true)).count();
        let fewer = 2 * ones <= self.component.len();
        self.component.iter().filter(move |&&f| self.turned[f] == Some(fewer)).map(|&f| f as u32)
    }
}

/// Walks over all faces across edges with two sides, component by component, noting which run against the first of their
/// component. Linear.
pub(super) fn visit_orientations(faces: &Faces, topology: &Topology, mut visit: impl FnMut(Sides)) {
    let incidence = &topology.incidence;
    let mut same_direction = vec![NONE; faces.corners().len()];
    for edge in topology.irregular_edges().iter().filter(|e| e.is_misoriented()) {
        let [a, b] = edge.half_edges;
        same_direction[a as usize] = b;
        same_direction[b as usize] = a;
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    let mut component = Vec::new();
    for seed in 0..faces.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        component.clear();
        component.push(seed);
        let mut has_conflict = false;
        let mut next = 0;
        while next < component.len() {
            let f = component[next];
            next += 1;
            for c in faces.range(f) {
                let (across, flip) = match (topology.twin(c as u32), same_direction[c]) {
                    (Some(d), _) => (d, false),
                    (None, NONE) => continue,
                    (None, d) => (d, true),
                };
                let g = incidence.face_of(across);
                let wanted = turned[f].map(|t| t != flip);
                if turned[g].is_none() {
                    turned[g] = wanted;
                    component.push(g);
                } else {
                    has_conflict |= turned[g] != wanted;
                }
            }
        }
        visit(Sides { component: &component, turned: &turned, has_conflict });
    }
}

#[cfg(test)]
mod tests;
