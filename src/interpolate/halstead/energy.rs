//! Thin-plate and membrane energies of a Catmull-Clark surface as quadratic forms.
//!
//! A quad of the mesh refined once is the unit square of a parameter plane. Over it the energies are
//! ∫ S_uu² + 2S_uv² + S_vv² and ∫ S_u² + S_v², summed over the coordinates. On a regular patch (bicubic B-spline, 16
//! control points) they are exact: tensor products of the Gram matrices of the cubic B-spline's derivatives.
//!
//! **Boundaries and creases.** The rules of curves and corners refine a spline whose control polygons go on straight
//! beyond the sharp edge: the point that follows a, b there is 2b − a, so that the second derivative across vanishes.
//! Put into the four pieces of the B-spline, this gives those of a natural end, and the patch is a tensor product as
//! any other, with fewer points. Nothing lies beyond: a crease adds the energies of its two sides, and none of the angle
//! between them. A patch is regular where four faces meet at each smooth corner, two at one on a curve, on the
//! side of the face, and one at one that rests.
//!
//! **What is approximated.** A face of the second refinement with an extraordinary corner is split once more, and
//! three of its quarters are regular and counted exactly; the fourth, beside the extraordinary vertex, is left out
//! (1/16 of a unit square's area). It cannot be counted in this parametrisation: the halves of ever smaller rings have
//! thin-plate energies that grow like (4λ²)^k, λ > ½ the subdominant eigenvalue of valences above 4.

use std::sync::Arc;

use glam::DVec3;

use super::LEVELS;
use super::elements::{self, Elements};
use crate::assemble::Csr;
use crate::assemble::csr::Pattern;
use crate::error::short;
use crate::memory::require;
use crate::mesh::features::{Features, Rule};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::topology::NONE;
use crate::mesh::{Surface, Topology};
use crate::schemes::Refinement;
use crate::schemes::star::require_curves;
use crate::{Error, Result};

/// How much of each energy the fairness holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// The factor of ∫ S_uu² + 2S_uv² + S_vv²: finite, 0 or more.
    pub thin_plate: f64,
    /// The factor of ∫ S_u² + S_v²: finite; positive in [`fit`](super::fit()), so that its system is regular.
    pub membrane: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Weights { thin_plate: 1.0, membrane: 1.0 }
    }
}

impl Weights {
    /// # Errors
    /// Weights that are negative, not finite, or without a membrane part, which makes the minimum unique.
    pub(in crate::interpolate) fn check(self) -> Result<()> {
        let valid = |w: f64| w >= 0.0 && w.is_finite();
        if valid(self.thin_plate) && valid(self.membrane) && self.membrane > 0.0 {
            return Ok(());
        }
        Err(Error::Computation(format!(
            "the fairness weights {} (thin plate) and {} (membrane) must be finite, none negative, and the second \
             positive",
            short(self.thin_plate),
            short(self.membrane)
        )))
    }
}

/// The two energies: squared mesh units, for a unit square of parameters a quad of the first refinement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// ∫ S_uu² + 2S_uv² + S_vv², the second-order energy, unweighted.
    pub thin_plate: f64,
    /// ∫ S_u² + S_v², the first-order energy, unweighted.
    pub membrane: f64,
}

impl Energies {
    /// The fairness: both, weighted.
    pub fn weighted(&self, weights: Weights) -> f64 {
        weights.thin_plate * self.thin_plate + weights.membrane * self.membrane
    }
}

/// The energies of all surfaces over the connectivity of one mesh.
#[derive(Clone, Debug)]
pub struct Fairness {
    /// The mesh refined [`LEVELS`] times: the connectivity, and the positions of the plain surface.
    pub fine: Surface,
    pub(super) elements: Elements,
}

impl Fairness {
    /// Refines a mesh and lists the elements of the forms: which vertices a spline takes, and one small matrix for all
    /// that look alike. Time and memory O(16·corners), 2 KB a vertex; O(n³) beside for each vertex of a great valence n.
    ///
    /// # Errors
    /// A boundary that is treated as interior, a dart, a semi-sharp edge or vertex; a mesh that is too large for memory or for
    /// 32-bit numbers.
    pub fn new(surface: &Surface) -> Result<Self> {
        require_curves(surface, "fair interpolation")?;
        Refinement::CatmullClark.check_size(surface, LEVELS)?;
        // The levels in between are asked which vertex a new one is near.
        let mut fine = surface.clone();
        let mut owner: Vec<u32> = (0..surface.len() as u32).collect();
        for _ in 0..LEVELS {
            owner = elements::owners(&fine, owner);
            fine = Refinement::CatmullClark.refined(&fine)?;
        }
        let elements = Elements::new(surface, &fine, owner)?;
        Ok(Fairness { fine, elements })
    }

    /// The two quadratic forms, thin plate and membrane, as sparse matrices on one pattern, symmetric and positive
    /// semi-definite. Some 10 KB a vertex, and ten times as much meanwhile.
    ///
    /// # Errors
    /// More entries than memory has room for, or than 32-bit numbers count.
    pub fn forms(&self) -> Result<[Csr; 2]> {
        let fine = &self.fine;
        let masks = StepMasks::new(fine);
        let grams: Vec<[Gram; 2]> = (0..16).map(patch_grams).collect();
        let mut triplets = Vec::with_capacity(entries(fine, &masks)?);
        for_each_patch(fine, &masks, |part| {
            match part {
                Part::Whole(patch) => {
                    let [thin_plate, membrane] = &grams[patch.sharp];
                    for (i, row) in patch.points() {
                        for (j, column) in patch.points() {
                            triplets.push((row, column, [WHOLE * thin_plate[i][j], membrane[i][j]]));
                        }
                    }
                }
                Part::Quarter(sharp, local) => {
                    for &(row, ref own) in local {
                        for &(column, ref other) in local {
                            let form = |gram: &Gram| pulled_back(gram, own, other);
                            let [thin_plate, membrane] = &grams[sharp];
                            triplets.push((row, column, [QUARTER * form(thin_plate), form(membrane)]));
                        }
                    }
                }
            }
            Ok(())
        })?;
        Ok(sum_triplets(fine.len(), &triplets))
    }

    /// The energies of a surface, from its control points at the fine level. In parallel, the same for any number of threads.
    ///
    /// # Panics
    /// If there is not one point a fine vertex.
    pub fn energies(&self, points: &[DVec3]) -> Energies {
        assert_eq!(points.len(), self.fine.len(), "one point a fine vertex");
        let [thin_plate, membrane] = self.elements.energies(&self.elements.there(points));
        Energies { thin_plate, membrane }
    }

    /// K x, half the gradient of the weighted energies, at the control points x of the fine level.
    ///
    /// # Panics
    /// As [`energies`](Self::energies).
    pub fn gradient(&self, points: &[DVec3], weights: Weights) -> Vec<DVec3> {
        assert_eq!(points.len(), self.fine.len(), "one point a fine vertex");
        let forms = self.elements.weighted(weights);
        let mut product = vec![DVec3::ZERO; points.len()];
        self.elements.apply(&forms, &self.elements.there(points), &mut product, &|_, _: &[DVec3], _: &mut [DVec3]| ());
        self.elements.back(&product)
    }

    /// The energies of the surface of a control mesh with the given mesh's own connectivity.
    ///
    /// # Errors
    /// As the refinement.
    ///
    /// # Panics
    /// If the connectivity is another.
    pub fn energies_of(&self, control: &Surface) -> Result<Energies> {
        let fine = Refinement::CatmullClark.refine_n(control, LEVELS)?;
        Ok(self.energies(&fine.positions))
    }
}

/// Halving the parameters' sides: second derivatives ×4, their squares ×16, areas ×¼; the first energy stays. Twice for
/// quarters of faces.
pub(in crate::interpolate) const WHOLE: f64 = 4.0;
pub(super) const QUARTER: f64 = 16.0;

/// One entry of WᵀGW, from two columns of W.
pub(super) fn pulled_back(gram: &Gram, own: &[f64; 16], other: &[f64; 16]) -> f64 {
    // Most vertices matter to few points.
    let rows = own.iter().zip(gram).filter(|row| *row.0 != 0.0);
    rows.map(|(a, g)| a * other.iter().zip(g).map(|(b, g)| b * g).sum::<f64>()).sum()
}

/// A part of the surface that is a bicubic spline.
enum Part<'a> {
    /// Over a fine face.
    Whole(&'a Patch),
    /// Over a quarter of one with these sharp sides, in terms of the fine vertices that matter: each with its weights in
    /// the control points.
    Quarter(usize, &'a [Weighted]),
}

/// A fine vertex with its weights in the control points of a patch.
pub(super) type Weighted = (u32, [f64; 16]);

/// Visits the patches over the fine faces, and where a face has none those over its quarters.
fn for_each_patch(fine: &Surface, masks: &StepMasks, mut visit: impl FnMut(Part) -> Result<()>) -> Result<()> {
    let mut local = Vec::new();
    for f in 0..fine.faces().len() {
        if let Some(patch) = regular_patch(fine, f) {
            visit(Part::Whole(&patch))?;
            continue;
        }
        for c in fine.faces().range(f) {
            local.clear();
            if let Some(sharp) = masks.quarter(c as u32, &mut local) {
                visit(Part::Quarter(sharp, &local))?;
            }
        }
    }
    Ok(())
}

/// The number of entries of all patches: few enough for 32-bit numbers, and memory has room for them.
fn entries(fine: &Surface, masks: &StepMasks) -> Result<usize> {
    /// A triplet, its place among those of a row, and its part of a sum.
    const BYTES: u64 = 24 + 8 + 8;
    const ADVICE: &str = "use a coarser mesh, or one of smaller valences";
    let what = || format!("the matrix of the energy of {} control points", fine.len());
    let mut entries = 0u64;
    for_each_patch(fine, masks, |part| {
        let points = match part {
            Part::Whole(patch) => patch.points().count(),
            Part::Quarter(_, local) => local.len(),
        };
        entries += points.pow(2) as u64;
        if entries <= u64::from(u32::MAX) {
            return Ok(());
        }
        Err(Error::TooLarge { what: format!("{} has more than 2³² − 1 entries", what()), advice: ADVICE })
    })?;
    require(BYTES * entries, what, ADVICE)?;
    Ok(entries as usize)
}

pub(super) type Gram = [[f64; 16]; 16];

/// The cubic B-spline's four pieces on [0, 1] as coefficients of 1, t, t², t³.
const PIECES: [[f64; 4]; 4] = [
    [1.0 / 6.0, -0.5, 0.5, -1.0 / 6.0],
    [4.0 / 6.0, 0.0, -1.0, 0.5],
    [1.0 / 6.0, 0.5, 0.5, -0.5],
    [0.0, 0.0, 0.0, 1.0 / 6.0],
];

/// The pieces where the spline ends naturally before the first point, after the last one, or goes on: the point beyond
/// such an end is put in as 2b − a, and its own piece is 0.
fn pieces(ends: [bool; 2]) -> [[f64; 4]; 4] {
    let mut pieces = PIECES;
    for (_, [beyond, last, before]) in ends.into_iter().zip([[0, 1, 2], [3, 2, 1]]).filter(|end| end.0) {
        let part = std::mem::take(&mut pieces[beyond]);
        for (point, times) in [(last, 2.0), (before, -1.0)] {
            pieces[point].iter_mut().zip(part).for_each(|(coefficient, p)| *coefficient += times * p);
        }
    }
    pieces
}

/// ∫₀¹ of products of the `order`-th derivatives of the pieces.
fn line_gram(order: usize, ends: [bool; 2]) -> [[f64; 4]; 4] {
    let derivative = |mut p: [f64; 4]| {
        for _ in 0..order {
            p = [p[1], 2.0 * p[2], 3.0 * p[3], 0.0];
        }
        p
    };
    let pieces = pieces(ends).map(derivative);
    let integral = |p: &[f64; 4], q: &[f64; 4]| {
        let mut sum = 0.0;
        for (i, a) in p.iter().enumerate() {
            for (j, b) in q.iter().enumerate() {
                sum += a * b / (i + j + 1) as f64;
            }
        }
        sum
    };
    pieces.map(|p| pieces.map(|q| integral(&p, &q)))
}

/// The two energies of a unit patch with these [sharp sides](Patch::sharp).
pub(super) fn patch_grams(sharp: usize) -> [Gram; 2] {
    let [below, after, above, before] = std::array::from_fn(|side| sharp >> side & 1 == 1);
    let [u, v] = [[before, after], [below, above]].map(|ends| [0, 1, 2].map(|order| line_gram(order, ends)));
    let form = |entry: &dyn Fn([usize; 2], [usize; 2]) -> f64| -> Gram {
        let place = |a: usize| [a / 4, a % 4];
        std::array::from_fn(|a| std::array::from_fn(|b| entry(place(a), place(b))))
    };
    [
        form(&|[i, j], [k, l]| u[2][i][k] * v[0][j][l] + 2.0 * u[1][i][k] * v[1][j][l] + u[0][i][k] * v[2][j][l]),
        form(&|[i, j], [k, l]| u[1][i][k] * v[0][j][l] + u[0][i][k] * v[1][j][l]),
    ]
}

/// For corner k of a face, the numbers of its vertex and of the three points around it outside the face: backwards
/// along u, diagonally, backwards along v, in the frame whose u is the corner's leaving edge.
const PLACES: [[usize; 4]; 4] =
    [[4 + 1, 1, 0, 4], [8 + 1, 8, 12, 12 + 1], [8 + 2, 12 + 2, 12 + 3, 8 + 3], [4 + 2, 4 + 3, 3, 2]];

/// The control points of a bicubic spline over a face.
pub(super) struct Patch {
    /// Point (i, j) of u and v has number 4i + j; [`NONE`] beyond sharp sides.
    points: [u32; 16],
    /// Bit k: side k is sharp; u goes along side 0, from corner 0 to 1.
    pub(super) sharp: usize,
}

impl Patch {
    /// The numbers of those that there are, with their vertices.
    pub(super) fn points(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.points.iter().copied().enumerate().filter(|point| point.1 != NONE)
    }
}

/// The faces about a vertex as far as no sharp edge lies between them.
#[derive(Clone, Copy)]
pub(super) struct Sectors<'a> {
    pub(super) surface: &'a Surface,
}

impl Sectors<'_> {
    fn is_smooth(self, side: u32) -> bool {
        self.surface.features().is_none_or(|features| !features.is_sharp(self.surface.topology(), side))
    }

    fn prev(self, c: u32) -> u32 {
        self.surface.incidence().prev(self.surface.faces(), c)
    }

    fn next(self, c: u32) -> u32 {
        self.surface.incidence().next(self.surface.faces(), c)
    }

    pub(super) fn counter_clockwise(self, c: u32) -> Option<u32> {
        self.surface.topology().counter_clockwise(self.surface.faces(), c).filter(|_| self.is_smooth(self.prev(c)))
    }

    pub(super) fn clockwise(self, c: u32) -> Option<u32> {
        self.surface.topology().clockwise(self.surface.faces(), c).filter(|_| self.is_smooth(c))
    }

    pub(super) fn rule(self, c: u32) -> Rule {
        let v = self.surface.faces().corners()[c as usize] as usize;
        self.surface.features().map_or(Rule::Smooth, |features| features.rules()[v])
    }

    /// Whether the surface is a spline at a corner.
    pub(super) fn is_regular(self, c: u32) -> bool {
        let rule = self.rule(c);
        match (self.counter_clockwise(c), self.clockwise(c)) {
            (Some(_), Some(_)) => {
                let v = self.surface.faces().corners()[c as usize] as usize;
                rule == Rule::Smooth && self.surface.incidence().face_count(v) == 4
            }
            (Some(beside), None) => rule == Rule::Crease && self.counter_clockwise(beside).is_none(),
            (None, Some(below)) => rule == Rule::Crease && self.clockwise(below).is_none(),
            (None, None) => rule == Rule::Corner,
        }
    }
}

/// The patch over face `f` of a mesh of quads if it is a bicubic spline.
pub(super) fn regular_patch(surface: &Surface, f: usize) -> Option<Patch> {
    let faces = surface.faces();
    let corners = faces.corners();
    let sectors = Sectors { surface };
    let range = |c: u32| faces.range(surface.topology().incidence.face_of(c));
    let mut patch = Patch { points: [NONE; 16], sharp: 0 };
    for (side, (c, places)) in faces.range(f).zip(&PLACES).enumerate() {
        let c = c as u32;
        if !sectors.is_regular(c) {
            return None;
        }
        let (beside, below) = (sectors.counter_clockwise(c), sectors.clockwise(c));
        patch.points[places[0]] = corners[c as usize];
        if let Some(c) = beside {
            patch.points[places[1]] = corners[prev_in(&range(c), c) as usize];
        }
        if let Some(c) = below {
            patch.points[places[3]] = corners[next_in(&range(c), c) as usize];
            if let Some(c) = sectors.clockwise(c).filter(|_| beside.is_some()) {
                patch.points[places[2]] = corners[next_in(&range(c), next_in(&range(c), c)) as usize];
            }
        } else {
            patch.sharp |= 1 << side;
        }
    }
    Some(patch)
}

/// Vertices with their weights.
pub(in crate::interpolate) type Row = Vec<(u32, f64)>;

/// The rules of vertices on curves and at corners as masks of single vertices.
pub(super) struct SharpMasks<'a> {
    features: Option<&'a Features>,
    /// The neighbours along the curve of the vertices on one; [`NONE`] of others.
    along: Vec<[u32; 2]>,
}

impl<'a> SharpMasks<'a> {
    /// O(N).
    pub(super) fn new(surface: &'a Surface) -> Self {
        let features = surface.features();
        let mut along = Vec::new();
        if let Some(features) = features {
            along.resize(surface.len(), [NONE; 2]);
            features.for_each_crease(|v, ends| along[v] = ends.map(|end| end as u32));
        }
        SharpMasks { features, along }
    }

    /// `w a + (1 − 2w) v + w b` on a curve with the neighbours a and b, v at a corner; none at a smooth vertex.
    pub(super) fn of(&self, v: usize, w: f64) -> Option<Row> {
        match self.features?.rules()[v] {
            Rule::Crease => {
                let [a, b] = self.along[v];
                Some(vec![(a, w), (v as u32, 1.0 - 2.0 * w), (b, w)])
            }
            Rule::Corner => Some(vec![(v as u32, 1.0)]),
            Rule::Smooth | Rule::Dart | Rule::SemiSharp => None,
        }
    }

    fn is_sharp(&self, topology: &Topology, c: u32) -> bool {
        self.features.is_some_and(|features| features.is_sharp(topology, c))
    }
}

/// The Catmull-Clark step of a quad mesh as masks of single new vertices.
pub(super) struct StepMasks<'a> {
    surface: &'a Surface,
    sharp: SharpMasks<'a>,
}

/// What a step makes a vertex of.
#[derive(Clone, Copy)]
enum New {
    Vertex(u32),
    /// By one of its half-edges.
    Edge(u32),
    Face(usize),
}

impl<'a> StepMasks<'a> {
    pub(super) fn new(surface: &'a Surface) -> Self {
        StepMasks { surface, sharp: SharpMasks::new(surface) }
    }

    /// Calls `add` with the old vertices and weights of a new vertex. A vertex may come more than once.
    fn mask(&self, new: New, add: &mut impl FnMut(u32, f64)) {
        let (faces, topology) = (self.surface.faces(), self.surface.topology());
        let incidence = &topology.incidence;
        let corners = faces.corners();
        let mut face = |f: usize, weight: f64| {
            for &x in faces.face(f) {
                add(x, weight / faces.face(f).len() as f64);
            }
        };
        match new {
            New::Face(f) => face(f, 1.0),
            New::Edge(c) if self.sharp.is_sharp(topology, c) => {
                [c, incidence.next(faces, c)].into_iter().for_each(|c| add(corners[c as usize], 0.5));
            }
            New::Edge(c) => {
                let sides = [Some(c), topology.twin(c)];
                for c in sides.into_iter().flatten() {
                    face(incidence.face_of(c), 0.25);
                }
                for c in sides.into_iter().flatten() {
                    add(corners[c as usize], 0.25);
                }
            }
            New::Vertex(v) => {
                if let Some(mask) = self.sharp.of(v as usize, 0.125) {
                    return mask.into_iter().for_each(|(x, weight)| add(x, weight));
                }
                let star = incidence.corners_at(v as usize);
                let n = star.len() as f64;
                for &c in star {
                    face(incidence.face_of(c), 1.0 / (n * n));
                }
                for &c in star {
                    add(corners[incidence.next(faces, c) as usize], 1.0 / (n * n));
                }
                add(v, (n - 2.0) / n);
            }
        }
    }

    /// The quarter of a face at corner `c`, where it is a bicubic spline: its sharp sides, u along the half-edge that leaves
    /// the corner, and its control points in terms of old vertices, each that matters with its weights in the 16. They
    /// are added to `local`, whose order stays.
    pub(super) fn quarter(&self, c: u32, local: &mut Vec<Weighted>) -> Option<usize> {
        let sectors = Sectors { surface: self.surface };
        if !sectors.is_regular(c) {
            return None;
        }
        let (faces, topology) = (self.surface.faces(), self.surface.topology());
        let vertex = |c: u32| New::Vertex(faces.corners()[c as usize]);
        let face = |c: u32| New::Face(topology.incidence.face_of(c));
        let (next, prev) = (sectors.next(c), sectors.prev(c));
        let opposite = sectors.next(next);
        let mut points = [None; 16];
        let mut place = |i: usize, j: usize, new: New| points[4 * i + j] = Some(new);
        place(1, 1, vertex(c));
        place(2, 1, New::Edge(c));
        place(3, 1, vertex(next));
        place(1, 2, New::Edge(prev));
        place(1, 3, vertex(prev));
        place(2, 2, face(c));
        place(3, 2, New::Edge(next));
        place(2, 3, New::Edge(opposite));
        place(3, 3, vertex(opposite));
        let mut sharp = 0;
        // The corner of the face across the leaving side, and of that across the entering one, at the same vertex.
        let (below, beside) = (sectors.clockwise(c), sectors.counter_clockwise(c));
        match below {
            Some(c) => {
                place(1, 0, New::Edge(c));
                place(2, 0, face(c));
                // Its entering side is the shared one; the one before that enters the far end.
                place(3, 0, New::Edge(sectors.prev(sectors.prev(c))));
            }
            None => sharp |= 1,
        }
        match beside {
            Some(c) => {
                place(0, 1, New::Edge(sectors.prev(c)));
                place(0, 2, face(c));
                place(0, 3, New::Edge(sectors.next(c)));
            }
            None => sharp |= 1 << 3,
        }
        if let (Some(below), Some(_)) = (below, beside) {
            place(0, 0, face(sectors.clockwise(below)?));
        }
        for (k, new) in points.into_iter().enumerate() {
            let Some(new) = new else { continue };
            self.mask(new, &mut |x, weight| {
                // Some twenty vertices: looking through them beats any table.
                match local.iter_mut().find(|(y, _)| *y == x) {
                    Some((_, weights)) => weights[k] += weight,
                    None => {
                        let mut weights = [0.0; 16];
                        weights[k] = weight;
                        local.push((x, weights));
                    }
                }
            });
        }
        Some(sharp)
    }
}

/// Symmetric matrices on one pattern from triplets (row, column, values), equal places summed in their order.
fn sum_triplets<const K: usize>(n: usize, triplets: &[(u32, u32, [f64; K])]) -> [Csr; K] {
    let mut starts = vec![0usize; n + 1];
    for t in triplets {
        starts[t.0 as usize + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut slots = starts.clone();
    let mut by_row = vec![(0u32, 0u32); triplets.len()];
    for (index, t) in triplets.iter().enumerate() {
        let slot = &mut slots[t.0 as usize];
        by_row[*slot] = (t.1, index as u32);
        *slot += 1;
    }
    let mut offsets = vec![0u32];
    let mut columns = Vec::new();
    let mut values: [Vec<f64>; K] = std::array::from_fn(|_| Vec::new());
    for i in 0..n {
        let row = &mut by_row[starts[i]..starts[i + 1]];
        row.sort_unstable();
        for same in row.chunk_by(|a, b| a.0 == b.0) {
            columns.push(same[0].0);
            for (k, values) in values.iter_mut().enumerate() {
                values.push(same.iter().map(|s| triplets[s.1 as usize].2[k]).sum());
            }
        }
        offsets.push(columns.len() as u32);
    }
    let pattern = Arc::new(Pattern::new(offsets, columns));
    values.map(|values| Csr::new(Arc::clone(&pattern), values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::random::random_creased;
    use crate::mesh::{builtin, noise};

    fn energy(gram: &Gram, f: impl Fn(f64, f64) -> f64) -> f64 {
        let x: Vec<f64> = (0..16).map(|a| f((a / 4) as f64, (a % 4) as f64)).collect();
        (0..16).flat_map(|a| (0..16).map(move |b| (a, b))).map(|(a, b)| x[a] * gram[a][b] * x[b]).sum()
    }

    #[test]
    fn patch_energies_of_polynomials_in_closed_form() {
        let [thin, membrane] = patch_grams(0);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        // Splines reproduce linear functions from their values: u + 2v has the gradient (1, 2).
        near(energy(&membrane, |u, v| u + 2.0 * v), 5.0);
        near(energy(&thin, |u, v| 3.0 + u + 2.0 * v), 0.0);
        // Control values u² give u² + ⅓: S_uu = 2; uv gives uv: S_uv = 1.
        near(energy(&thin, |u, _| u * u), 4.0);
        near(energy(&thin, |u, v| u * v), 2.0);
        // ∫ (2t)² over the unit patch between grid values 1 and 2.
        near(energy(&membrane, |_, v| v * v), 28.0 / 3.0);
    }

    /// Autocorrelations of the cubic B-spline and its derivatives: values of the B-spline of degree 7.
    #[test]
    fn line_grams_sum_to_the_known_autocorrelations() {
        let known = [
            [2416.0 / 5040.0, 1191.0 / 5040.0, 120.0 / 5040.0, 1.0 / 5040.0],
            [2.0 / 3.0, -1.0 / 8.0, -1.0 / 5.0, -1.0 / 120.0],
            [8.0 / 3.0, -3.0 / 2.0, 0.0, 1.0 / 6.0],
        ];
        for (order, known) in known.iter().enumerate() {
            let gram = line_gram(order, [false; 2]);
            for (shift, expected) in known.iter().enumerate() {
                let sum: f64 = (0..4 - shift).map(|i| gram[i][i + shift]).sum();
                assert!((sum - expected).abs() < 1e-14, "{order} {shift}");
            }
        }
    }

    /// The spline that ends before the first point is the one with a point put on the line through the first two.
    #[test]
    fn natural_ends_are_those_of_points_put_on_straight() {
        for sharp in 0..16 {
            let sides: [bool; 4] = std::array::from_fn(|side| sharp >> side & 1 == 1);
            let [thin, membrane] = patch_grams(sharp);
            let beyond = |at: i32, [first, last]: [bool; 2]| match at {
                0 if first => [(1, 2.0), (2, -1.0)],
                3 if last => [(2, 2.0), (1, -1.0)],
                at => [(at, 1.0), (at, 0.0)],
            };
            let value = |i: i32, j: i32| ((3 * i * i + 5 * j + i * j * j) % 7) as f64;
            let put_on = |u: f64, v: f64| -> f64 {
                let (along_u, along_v) =
                    (beyond(u as i32, [sides[3], sides[1]]), beyond(v as i32, [sides[0], sides[2]]));
                along_u.iter().map(|&(i, a)| along_v.iter().map(|&(j, b)| a * b * value(i, j)).sum::<f64>()).sum()
            };
            for (gram, whole) in [&thin, &membrane].into_iter().zip(&patch_grams(0)) {
                let (found, expected) = (energy(gram, |u, v| value(u as i32, v as i32)), energy(whole, put_on));
                assert!((found - expected).abs() < 1e-12 * expected, "{sharp:04b}: {found} {expected}");
            }
        }
    }

    /// The form on the fine control points is the plain sum over all regular patches one level further, however the
    /// faces lie: the rules of boundaries, curves and corners refine what the patches beside them are.
    #[test]
    fn the_form_is_the_sum_over_the_regular_patches_of_the_next_level() {
        let mut surfaces = Vec::new();
        for name in ["torus:4x5", "cube", "icosahedron", "irregular-poly:30", "star:7"] {
            let mut mesh = builtin::builtin(name).expect("a built-in mesh");
            noise::add_noise(&mut mesh, 0.1, 5);
            surfaces.extend((0..12).filter_map(|seed| Some(random_creased(&mesh, seed)?.0)));
            surfaces.push(Surface::new(mesh).expect("closed"));
        }
        let sharp = |surface: &&Surface| surface.features().is_some_and(|features| !features.curves().is_empty());
        assert!(surfaces.iter().filter(sharp).count() > 20);
        let grams: Vec<[Gram; 2]> = (0..16).map(patch_grams).collect();
        for (number, surface) in surfaces.iter().enumerate() {
            let fairness = Fairness::new(surface).expect("no darts");
            let finer = Refinement::CatmullClark.refined_n(surface, LEVELS + 1).expect("no darts");
            let mut expected = [0.0; 2];
            let mut patches = 0;
            for f in 0..finer.faces().len() {
                let Some(patch) = regular_patch(&finer, f) else {
                    continue;
                };
                patches += 1;
                let at = |v: u32| finer.positions()[v as usize];
                for (sum, gram) in expected.iter_mut().zip(&grams[patch.sharp]) {
                    for (a, v) in patch.points() {
                        for (b, w) in patch.points() {
                            *sum += gram[a][b] * at(v).dot(at(w));
                        }
                    }
                }
            }
            let found = fairness.energies_of(surface).expect("no darts");
            assert!(patches > finer.faces().len() / 2);
            assert!((found.thin_plate / (16.0 * expected[0]) - 1.0).abs() < 1e-11, "{number}");
            assert!((found.membrane / expected[1] - 1.0).abs() < 1e-11, "{number}");
        }
    }
}
