//! Creases, corners and boundaries: which rule every vertex of an open or creased mesh follows, and the curves along which
//! sharp edges run.
//!
//! Conventions are those of OpenSubdiv and USD. Boundary edges are sharp, and so are edges and vertices that are tagged
//! with a sharpness of [`SHARP`] or more. With k sharp edges, a vertex is smooth (k = 0), a *dart* (1), on a *crease* (2) or a
//! *corner* (3 and more, or tagged itself). Of less sharpness, edges and vertices are *semi-sharp*: each step of refinement
//! takes 1 of it.

use glam::DVec3;
use rayon::slice::ParallelSliceMut;

use super::boundary::Boundary;
use super::incidence::next_in;
use super::{Faces, Incidence, Surface, Topology};
use crate::error::{Error, Result, short};
use crate::parallel;

/// From this sharpness on, an edge or vertex is sharp at every level of refinement.
pub const SHARP: f64 = 10.0;
/// Vertices of one task.
const CHUNK: usize = 4096;

/// What is sharp beside the boundary, and what the boundary is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tags {
    /// What boundary edges are.
    pub boundary: Boundary,
    /// Sharp edges by their ends, with their sharpness. Of an edge that is named twice the greater one counts.
    pub creases: Vec<([u32; 2], f64)>,
    /// Sharp vertices with their sharpness.
    pub corners: Vec<(u32, f64)>,
}

/// The rule that a vertex follows at every level of refinement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Rule {
    /// No sharp edge.
    #[default]
    Smooth,
    /// One edge that is sharp for ever ends here.
    Dart,
    /// Two sharp edges: a point of a curve.
    Crease,
    /// It rests.
    Corner,
    /// Smooth in the end, but for some levels not: an edge is semi-sharp, or the vertex itself.
    SemiSharp,
}

/// Sharp edges from one vertex to the next, each inner vertex a [`Rule::Crease`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Curve {
    /// In order. Of a curve that is not closed, the first and the last are no creases: corners, or darts.
    pub vertices: Vec<u32>,
    /// Whether the last vertex is joined to the first, which is a crease too.
    pub closed: bool,
}

/// Rules and curves of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    rules: Vec<Rule>,
    sharp: Vec<u32>,
    creased: usize,
    curves: Vec<Curve>,
    is_midway: bool,
    /// By half-edge, as in `sharp`, and by vertex.
    semi_sharp: Vec<(u32, f64)>,
    semi_sharp_vertices: Vec<(u32, f64)>,
}

impl Features {
    /// Those of faces whose boundary edges have the half-edges `boundary`; `None` if all vertices are smooth, or are treated as
    /// such. O(N), and O(k log k) for k sharp edges.
    ///
    /// # Errors
    /// [`Error::Tag`]: a sharpness that is negative or not a number; an edge or a vertex that does not exist; any tag where
    /// the boundary is treated as interior.
    pub fn new(faces: &Faces, incidence: &Incidence, boundary: &[u32], tags: &Tags) -> Result<Option<Self>> {
        let (mut sharp, mut semi_sharp) = (Vec::new(), Vec::new());
        for &(ends, sharpness) in &tags.creases {
            let edge = || format!("edge {}\u{2013}{}", ends[0], ends[1]);
            let side = incidence.half_edge(faces, ends);
            let side = side.ok_or_else(|| Error::Tag(format!("{} does not exist", edge())))?;
            checked(sharpness).map_err(|what| Error::Tag(format!("{} {what}", edge())))?;
            // The other side too, where there is one.
            let side = side.min(incidence.half_edge(faces, [ends[1], ends[0]]).unwrap_or(side));
            if sharpness >= SHARP {
                sharp.push(side);
            } else if sharpness > 0.0 {
                semi_sharp.push((side, sharpness));
            }
        }
        let n = incidence.vertices();
        let (mut resting, mut semi_sharp_vertices) = (Vec::new(), Vec::new());
        for &(v, sharpness) in &tags.corners {
            if v as usize >= n {
                return Err(Error::Tag(format!("vertex {v} does not exist: there are {n}")));
            }
            checked(sharpness).map_err(|what| Error::Tag(format!("vertex {v} {what}")))?;
            if sharpness >= SHARP {
                resting.push(v);
            } else if sharpness > 0.0 {
                semi_sharp_vertices.push((v, sharpness));
            }
        }
        let tagged =
            !(sharp.is_empty() && resting.is_empty() && semi_sharp.is_empty() && semi_sharp_vertices.is_empty());
        match tags.boundary {
            Boundary::AsInterior if tagged => {
                let what =
                    "sharp edges and vertices, and a boundary that is treated as interior, contradict each other";
                return Err(Error::Tag(what.into()));
            }
            Boundary::AsInterior => return Ok(None),
            Boundary::EdgeAndCorner | Boundary::EdgeOnly | Boundary::Refuse => {}
        }
        sharp.extend_from_slice(boundary);
        sharp.sort_unstable();
        sharp.dedup();
        if sharp.is_empty() && !tagged {
            return Ok(None);
        }
        semi_sharp.retain(|(side, _)| sharp.binary_search(side).is_err());
        for list in [&mut semi_sharp, &mut semi_sharp_vertices] {
            // Of several the greatest.
            list.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
            list.dedup_by_key(|entry| entry.0);
        }
        let corners = faces.corners();
        let pairs = pairs(faces, incidence, &sharp);
        let mut rules = vec![Rule::Smooth; n];
        for at in pairs.chunk_by(|a, b| a[0] == b[0]) {
            rules[at[0][0] as usize] = match at.len() {
                1 => Rule::Dart,
                2 => Rule::Crease,
                _ => Rule::Corner,
            };
        }
        if tags.boundary == Boundary::EdgeAndCorner {
            for &c in boundary {
                let v = corners[c as usize] as usize;
                if incidence.face_count(v) == 1 {
                    rules[v] = Rule::Corner;
                }
            }
        }
        for v in resting {
            rules[v as usize] = Rule::Corner;
        }
        set_semi_sharp(&mut rules, faces, incidence, &semi_sharp, &semi_sharp_vertices);
        let curves = curves(&pairs, &rules);
        let creased = sharp.len() - boundary.len();
        Ok(Some(Features { rules, sharp, creased, curves, is_midway: false, semi_sharp, semi_sharp_vertices }))
    }

    /// Those of the mesh after a step that splits every sharp edge in as many parts, from its faces and topology: old
    /// vertices come first and keep their rules, new ones on sharp edges are creases, and what is semi-sharp has lost 1; all
    /// others are smooth. `None` if nothing is sharp any more. `pieces(c, put)` puts the half-edges of the finer mesh along
    /// half-edge `c`, in this order. O(N), and O(k log k) for k sharp edges.
    pub(crate) fn refined(
        &self,
        faces: &Faces,
        topology: &Topology,
        coarse: &Topology,
        pieces: impl Fn(u32, &mut Vec<u32>),
    ) -> Option<Self> {
        let (mut along, mut back) = (Vec::new(), Vec::new());
        let mut first_sides = |c: u32, put: &mut Vec<u32>| {
            along.clear();
            back.clear();
            pieces(c, &mut along);
            match coarse.twin(c) {
                Some(t) => pieces(t, &mut back),
                None => back.extend(along.iter().rev()),
            }
            // The twin's, in the order of this side.
            put.extend(along.iter().zip(back.iter().rev()).map(|(&a, &b)| a.min(b)));
        };
        let mut sharp: Vec<u32> = Vec::with_capacity(2 * self.sharp.len());
        for &c in &self.sharp {
            first_sides(c, &mut sharp);
        }
        let parts = sharp.len() / self.sharp.len().max(1);
        sharp.par_sort_unstable();
        let left = |list: &[(u32, f64)]| -> Vec<(u32, f64)> {
            list.iter().map(|&(k, s)| (k, s - 1.0)).filter(|entry| entry.1 > 0.0).collect()
        };
        let mut semi_sharp: Vec<(u32, f64)> = Vec::new();
        let mut parts_of = Vec::new();
        for (c, s) in left(&self.semi_sharp) {
            parts_of.clear();
            first_sides(c, &mut parts_of);
            semi_sharp.extend(parts_of.iter().map(|&c| (c, s)));
        }
        semi_sharp.sort_unstable_by_key(|entry| entry.0);
        let semi_sharp_vertices = left(&self.semi_sharp_vertices);
        let incidence = &topology.incidence;
        let pairs = pairs(faces, incidence, &sharp);
        let mut rules = self.rules.clone();
        rules.resize(incidence.vertices(), Rule::Smooth);
        if self.is_semi_sharp() {
            let smooth = |_, rule: &mut Rule| *rule = if *rule == Rule::SemiSharp { Rule::Smooth } else { *rule };
            parallel::change(&mut rules, smooth);
            set_semi_sharp(&mut rules, faces, incidence, &semi_sharp, &semi_sharp_vertices);
        }
        for pair in pairs.iter().filter(|pair| pair[0] as usize >= self.rules.len()) {
            rules[pair[0] as usize] = Rule::Crease;
        }
        if sharp.is_empty() && parallel::all(rules.len(), |v| rules[v] == Rule::Smooth) {
            return None;
        }
        let curves = curves(&pairs, &rules);
        Some(Features {
            rules,
            sharp,
            creased: parts * self.creased,
            curves,
            // Of two steps that split edges in three, the first leaves sharp ones whole.
            is_midway: parts == 1,
            semi_sharp,
            semi_sharp_vertices,
        })
    }

    /// Calls `visit(v, [a, b])` for every crease vertex and its two neighbours along the curve.
    pub(crate) fn for_each_crease(&self, mut visit: impl FnMut(usize, [usize; 2])) {
        for Curve { vertices, closed } in &self.curves {
            let n = vertices.len();
            let at = |i: usize| vertices[i % n] as usize;
            let inner = if *closed { 0..n } else { 1..n - 1 };
            for i in inner {
                visit(at(i), [at(i + n - 1), at(i + 1)]);
            }
        }
    }

    /// The vertices that follow a rule, ascending.
    pub(crate) fn with_rule(&self, rule: Rule) -> Vec<usize> {
        parallel::flat_map(self.rules.len(), CHUNK, |range| range.filter(|&v| self.rules[v] == rule).collect())
    }

    /// The rule of every vertex.
    pub fn rules(&self) -> &[Rule] {
        &self.rules
    }

    /// Whether a vertex is smooth.
    pub fn is_smooth(&self, v: usize) -> bool {
        self.rules[v] == Rule::Smooth
    }

    /// One half-edge of each sharp edge, ascending: the only one, or that of the smaller index.
    pub fn sharp_half_edges(&self) -> &[u32] {
        &self.sharp
    }

    /// Both half-edges of each sharp edge, or the one that it has.
    pub(crate) fn sharp_sides<'a>(&'a self, topology: &'a Topology) -> impl Iterator<Item = u32> + 'a {
        self.sharp.iter().flat_map(|&c| std::iter::once(c).chain(topology.twin(c)))
    }

    /// Whether the edge of half-edge `c` is sharp. O(log k) for k sharp edges.
    pub(crate) fn is_sharp(&self, topology: &Topology, c: u32) -> bool {
        let first = topology.twin(c).map_or(c, |t| t.min(c));
        self.sharp.binary_search(&first).is_ok()
    }

    /// The semi-sharp edges, as [`sharp_half_edges`](Self::sharp_half_edges), with their sharpness.
    pub fn semi_sharp_edges(&self) -> &[(u32, f64)] {
        &self.semi_sharp
    }

    /// The semi-sharp vertices, ascending, with their sharpness.
    pub fn semi_sharp_vertices(&self) -> &[(u32, f64)] {
        &self.semi_sharp_vertices
    }

    /// The sharpness of the edge with this half-edge, of the two the smaller one; [`SHARP`] if it is sharp for ever.
    pub fn sharpness(&self, side: u32) -> f64 {
        if self.sharp.binary_search(&side).is_ok() {
            return SHARP;
        }
        let found = self.semi_sharp.binary_search_by_key(&side, |s| s.0);
        found.map_or(0.0, |at| self.semi_sharp[at].1)
    }

    /// The sharpness of a vertex by itself: [`SHARP`] at a corner.
    pub fn vertex_sharpness(&self, v: u32) -> f64 {
        if self.rules[v as usize] == Rule::Corner {
            return SHARP;
        }
        let found = self.semi_sharp_vertices.binary_search_by_key(&v, |s| s.0);
        found.map_or(0.0, |at| self.semi_sharp_vertices[at].1)
    }

    /// The vertices that are semi-sharp themselves, or at the ends of semi-sharp edges, ascending.
    pub(crate) fn at_semi_sharp(&self, surface: &Surface) -> Vec<u32> {
        let mut all = touched(surface.faces(), surface.incidence(), &self.semi_sharp, &self.semi_sharp_vertices);
        all.sort_unstable();
        all.dedup();
        all
    }

    /// By vertex: whether the first step of refinement takes it by the rule of creases or of corners: two sharp or semi-sharp
    /// edges or more, or a sharpness of its own. At darts, and where one edge is semi-sharp, it does not.
    pub(crate) fn held_at_first(&self, surface: &Surface) -> Vec<bool> {
        let (faces, incidence) = (surface.faces(), surface.incidence());
        let corners = faces.corners();
        let mut edges = vec![0u8; self.rules.len()];
        for &c in self.sharp.iter().chain(self.semi_sharp.iter().map(|(c, _)| c)) {
            for v in [corners[c as usize], corners[incidence.next(faces, c) as usize]] {
                let count = &mut edges[v as usize];
                *count = (*count + 1).min(2);
            }
        }
        let mut held: Vec<bool> =
            edges.iter().zip(&self.rules).map(|(&count, &rule)| count == 2 || rule == Rule::Corner).collect();
        self.semi_sharp_vertices.iter().for_each(|&(v, _)| held[v as usize] = true);
        held
    }

    /// The number of sharp edges with two faces.
    pub fn creased_edges(&self) -> usize {
        self.creased
    }

    /// The curves that have inner vertices.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// Whether any edge or vertex is semi-sharp.
    pub fn is_semi_sharp(&self) -> bool {
        !self.semi_sharp.is_empty() || !self.semi_sharp_vertices.is_empty()
    }

    /// Whether there are darts, or semi-sharp vertices beside curves.
    pub fn has_stars(&self) -> bool {
        self.is_semi_sharp() || !parallel::all(self.rules.len(), |v| self.rules[v] != Rule::Dart)
    }

    /// Whether the mesh comes of the first of two steps of a √3 refinement, of which the second splits the sharp edges in
    /// three. Systems take every mesh as one that is given, which is not.
    pub fn is_midway(&self) -> bool {
        self.is_midway
    }

    /// How many vertices follow a rule.
    pub fn count(&self, rule: Rule) -> usize {
        let counts =
            parallel::map(self.rules.len(), CHUNK, |range| self.rules[range].iter().filter(|&&r| r == rule).count());
        counts.into_iter().sum()
    }
}

/// The ends of semi-sharp edges, and semi-sharp vertices, in any order.
fn touched(faces: &Faces, incidence: &Incidence, edges: &[(u32, f64)], vertices: &[(u32, f64)]) -> Vec<u32> {
    let corners = faces.corners();
    let ends = |&(c, _): &(u32, f64)| [corners[c as usize], corners[incidence.next(faces, c) as usize]];
    edges.iter().flat_map(ends).chain(vertices.iter().map(|entry| entry.0)).collect()
}

/// What semi-sharp edges and vertices make of smooth ones.
fn set_semi_sharp(
    rules: &mut [Rule],
    faces: &Faces,
    incidence: &Incidence,
    edges: &[(u32, f64)],
    vertices: &[(u32, f64)],
) {
    for v in touched(faces, incidence, edges, vertices) {
        let rule = &mut rules[v as usize];
        if *rule == Rule::Smooth {
            *rule = Rule::SemiSharp;
        }
    }
}

/// What is wrong with a sharpness, as the rest of a sentence.
pub(super) fn checked(sharpness: f64) -> std::result::Result<(), String> {
    match sharpness >= 0.0 {
        true => Ok(()),
        false => Err(format!("has the sharpness {}: a number from 0 on is needed", short(sharpness))),
    }
}

/// The edges with two faces whose normals differ by more than `degrees`, by their ends. O(corners).
///
/// ```
/// use limitlab::mesh::{Surface, builtin, features::creases_by_angle};
/// let cube = Surface::new(builtin::builtin("cube")?)?;
/// assert_eq!(creases_by_angle(&cube, 60.0).len(), 12);
/// assert!(creases_by_angle(&cube, 95.0).is_empty());
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn creases_by_angle(surface: &Surface, degrees: f64) -> Vec<[u32; 2]> {
    let (faces, topology, points) = (surface.faces(), surface.topology(), surface.positions());
    let normals = parallel::collect(faces.len(), |f| {
        // Newell's: twice the area, of faces that are not flat too.
        let face = faces.face(f);
        let origin = points[face[0] as usize];
        let fan = face.windows(2).map(|w| (points[w[0] as usize] - origin).cross(points[w[1] as usize] - origin));
        fan.sum::<DVec3>()
    });
    let incidence = &topology.incidence;
    let corners = faces.corners();
    parallel::flat_map(corners.len(), CHUNK, |range| {
        let side = |c: u32| {
            let twin = topology.twin(c).filter(|&twin| c < twin)?;
            let [a, b] = [c, twin].map(|c| normals[incidence.face_of(c)]);
            let angle = a.cross(b).length().atan2(a.dot(b)).to_degrees();
            let is_sharp = a != DVec3::ZERO && b != DVec3::ZERO && angle > degrees;
            let end = next_in(&faces.range(incidence.face_of(c)), c);
            is_sharp.then(|| [corners[c as usize], corners[end as usize]])
        };
        range.filter_map(|c| side(c as u32)).collect()
    })
}

/// Both directions of every sharp edge by its ends, in order.
fn pairs(faces: &Faces, incidence: &Incidence, sharp: &[u32]) -> Vec<[u32; 2]> {
    let corners = faces.corners();
    let end = |c: u32| corners[incidence.next(faces, c) as usize];
    let mut pairs: Vec<[u32; 2]> =
        sharp.iter().flat_map(|&c| [[corners[c as usize], end(c)], [end(c), corners[c as usize]]]).collect();
    pairs.par_sort_unstable();
    pairs
}

/// The curves along sharp edges, of which `pairs` holds both directions, in order.
fn curves(pairs: &[[u32; 2]], rules: &[Rule]) -> Vec<Curve> {
    let mut places = vec![0u32; rules.len()];
    for (k, pair) in pairs.iter().enumerate().rev() {
        places[pair[0] as usize] = k as u32;
    }
    let is_crease = |v: u32| rules[v as usize] == Rule::Crease;
    let mut seen = vec![false; rules.len()];
    // On from `from` over the crease `v`, to the first vertex that is none, or was seen.
    let mut walk = |from: u32, v: u32, vertices: &mut Vec<u32>| {
        let (mut last, mut here) = (from, v);
        while is_crease(here) && !std::mem::replace(&mut seen[here as usize], true) {
            vertices.push(here);
            let place = places[here as usize] as usize;
            let [first, second] = [pairs[place][1], pairs[place + 1][1]];
            (last, here) = (here, if first == last { second } else { first });
        }
        here
    };
    let mut found = Vec::new();
    for &[end, v] in pairs.iter().filter(|pair| !is_crease(pair[0]) && is_crease(pair[1])) {
        let mut vertices = vec![end];
        let last = walk(end, v, &mut vertices);
        // Otherwise it was found from its other end.
        if vertices.len() > 1 {
            vertices.push(last);
            found.push(Curve { vertices, closed: false });
        }
    }
    for &[v, next] in pairs.iter().filter(|pair| is_crease(pair[0])) {
        let mut vertices = Vec::new();
        // Begun as if it came from the one neighbour, it goes on to the other.
        walk(next, v, &mut vertices);
        if !vertices.is_empty() {
            found.push(Curve { vertices, closed: true });
        }
    }
    found
}
