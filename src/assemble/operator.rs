//! Matrix-free operator: A, M and D⁻¹A of a [`LimitSystem`](super::LimitSystem) from connectivity alone.

use std::ops::Range;
use std::sync::OnceLock;

use glam::DVec3;

use super::bounds::SpectralBounds;
use super::build::{RowOrder, RowSource};
use super::face_sums::{Others, Polygons};
use super::kernel::{Stencil, runs};
use super::neighbours::Neighbours;
use super::system::{check, require_one_block};
use super::weights::{Point, RowShape};
use crate::error::Result;
use crate::mesh::order::Numbering;
use crate::mesh::{Faces, Incidence, Surface, Topology};
use crate::parallel;
use crate::schemes::{Masks, Scheme};

/// A = H·M without stored entries: a row knows its neighbours, and its weights follow from valence and face size.
///
/// Per vertex of valence 4 among quads, a sweep over A reads 8 neighbours of 2 bytes (as distances from the row,
/// where the vertex order keeps them below 2¹⁵; else 4 bytes), 4 bytes for where they start and 1 for the kind of
/// row: 21 bytes (37) against the 9·(8 + 4) + 4 = 112 of the explicit matrix. To this come the arrays of points:
/// 24 bytes a vertex each, 16 in single precision. Among faces of several sizes, or of more than 4 corners, each face is
/// summed once a sweep: a row reads the sums of its n faces, 4 bytes for which face each, and the sweep the 4 bytes of
/// every corner beside. No weight is stored; a face of m corners costs O(m), not O(m²).
#[derive(Clone, Debug)]
pub struct Operator {
    pub(super) stencil: Stencil,
    /// h by valence.
    h: Vec<f64>,
    /// h and a_ii by row, of use to some methods only: made when first asked for.
    weights: OnceLock<Vec<f64>>,
    diagonal: OnceLock<Vec<f64>>,
    /// Of use to sweeps in place only.
    others: OnceLock<Others>,
    bounds: SpectralBounds,
    usual_lambda_min: f64,
}

impl Operator {
    /// The operator of `scheme` on a mesh. O(corners), in parallel.
    ///
    /// # Errors
    /// As [`LimitSystem::new`](super::LimitSystem::new); more than 2³² − 1 neighbours.
    pub fn new(surface: &Surface, scheme: Scheme) -> Result<Self> {
        Self::in_order(surface, scheme, None)
    }

    /// As [`new`](Self::new), with the rows in another order: the k-th is that of the vertex at place k, and its
    /// neighbours are rows too.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// # Panics
    /// If the numbering is of another number of vertices.
    pub fn in_order(surface: &Surface, scheme: Scheme, numbering: Option<&Numbering>) -> Result<Self> {
        check(surface, scheme)?;
        require_one_block(surface)?;
        let open = if surface.is_closed() { None } else { Some(surface.topology()) };
        let order = RowOrder::Given(numbering);
        Ok(Self::build(surface.faces(), (surface.incidence(), open), scheme, (order, None))?.0)
    }

    /// As [`in_order`](Self::in_order), on the renumbered faces where a surface has such inside; a numbering is one of
    /// those vertices. Also the numbering that was made, if one was.
    ///
    /// The rows of vertices that are not marked `free` are *fixed*: zero, (A x)_i = 0. For x that vanishes there, the other
    /// rows are those of the principal submatrix A_SS, whose eigenvalues keep to the bounds by interlacing. On an open or
    /// creased mesh all vertices that are not smooth must be fixed: at the others every face and edge is there.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(crate) fn inside(
        surface: &Surface,
        scheme: Scheme,
        order: RowOrder,
        free: Option<&[bool]>,
    ) -> Result<(Self, Option<Numbering>)> {
        let rows = (order, free);
        match surface.renumbered() {
            Some(inside) => {
                check(surface, scheme)?;
                Self::build(&inside.faces, (&inside.incidence, None), scheme, rows)
            }
            None => Self::of_file(surface, scheme, rows),
        }
    }

    /// As [`inside`](Self::inside), of the vertices of the surface, however they are numbered inside.
    pub(super) fn with_fixed(
        surface: &Surface,
        scheme: Scheme,
        (numbering, free): (Option<&Numbering>, Option<&[bool]>),
    ) -> Result<Self> {
        Ok(Self::of_file(surface, scheme, (RowOrder::Given(numbering), free))?.0)
    }

    fn of_file(
        surface: &Surface,
        scheme: Scheme,
        rows: (RowOrder, Option<&[bool]>),
    ) -> Result<(Self, Option<Numbering>)> {
        check(surface, scheme)?;
        let is_whole = surface.is_closed() || surface.features().is_some();
        let open = if is_whole { None } else { Some(surface.topology()) };
        Self::build(surface.faces(), (surface.incidence(), open), scheme, rows)
    }

    fn build(
        faces: &Faces,
        sides: (&Incidence, Option<&Topology>),
        scheme: Scheme,
        (order, free): (RowOrder, Option<&[bool]>),
    ) -> Result<(Self, Option<Numbering>)> {
        let closed = sides.1.is_none();
        let source = RowSource::new(faces, sides, scheme, free);
        let (made, neighbours) = source.in_order(&order)?;
        let numbering = match order {
            RowOrder::Given(numbering) => numbering,
            RowOrder::Kinds | RowOrder::Fronts => made.as_ref(),
        };
        let there = numbering.map(|numbering| numbering.there(&source.shapes));
        let shapes = there.as_deref().unwrap_or(&source.shapes);
        let h: Vec<f64> = (0..=source.greatest_valence()).map(|n| scheme.h(n.max(1) as usize)).collect();
        let polygons = Polygons::new(faces, sides.0, scheme, numbering, shapes);
        let offsets = source.offsets(shapes)?;
        let runs = runs(shapes);
        let codes = source.codes(numbering.zip(neighbours.as_ref()), offsets, runs);
        let double = source.rings();
        let kinds = parallel::collect(shapes.len(), |i| shapes[i].kind());
        let stencil = Stencil { codes, kinds, single: double.single(), double, polygons };
        // The rows of a run are alike, but for the sizes of faces that are summed: there the extremes tell all.
        let extremes = parallel::collect(stencil.codes.runs().len(), |k| {
            let run = stencil.codes.run(k);
            let n = shapes[run.start].valence();
            let [least, greatest] = stencil.extremes(run);
            [(n, least), (n, greatest)]
        });
        let (occurring, diagonal): (Vec<u32>, Vec<f64>) = extremes.into_iter().flatten().filter(|e| e.0 > 0).unzip();
        let triangles = faces.uniform_size() == Some(3);
        let bounds = if closed {
            SpectralBounds::closed(scheme, &occurring, triangles, &diagonal)
        } else {
            SpectralBounds::gershgorin(&diagonal)
        };
        let operator = Operator {
            stencil,
            h,
            weights: OnceLock::new(),
            diagonal: OnceLock::new(),
            others: OnceLock::new(),
            bounds,
            usual_lambda_min: usual_lambda_min(scheme, faces, shapes),
        };
        Ok((operator, made))
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.stencil.codes.rows()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The diagonal of H.
    pub fn weights(&self) -> &[f64] {
        self.weights.get_or_init(|| self.by_row(|i| self.weight(i)))
    }

    /// diag A.
    pub fn diagonal(&self) -> &[f64] {
        self.diagonal.get_or_init(|| self.by_row(|i| self.stencil.diagonal(i)))
    }

    fn by_row(&self, value: impl Fn(usize) -> f64 + Send + Sync) -> Vec<f64> {
        parallel::collect(self.len(), value)
    }

    /// h_i.
    pub(super) fn weight(&self, i: usize) -> f64 {
        self.h[self.stencil.valence(i)]
    }

    /// What valences and face sizes prove about the spectrum of A.
    pub fn bounds(&self) -> SpectralBounds {
        self.bounds
    }

    /// What the scheme's [λ_min usually is](Scheme::usual_lambda_min); on a mesh that is regular but for few vertices, which
    /// then hardly ever lie together, a hundredth less than on a [regular](Scheme::regular_symbol) one, if that is more.
    pub fn usual_lambda_min(&self) -> f64 {
        self.usual_lambda_min
    }

    /// (A x)_i. O(neighbours), and O(corners of the faces at `i`) where faces are summed.
    #[inline]
    pub fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
        self.stencil.row(i, (x, 0))
    }

    /// (A x)_i, where `points` holds x from vertex `start` on, as far as the row [reaches](Self::reach).
    ///
    /// # Panics
    /// If the row reaches beyond the points.
    #[inline]
    pub fn row_within<P: Point>(&self, i: usize, points: (&[P], usize)) -> P {
        self.stencil.row(i, points)
    }

    /// Whether sweeps in place keep the [sums over faces](Self::all_sums) up with the iterate, by [`row_by_sums`](Self::row_by_sums)
    /// and [`follow`](Self::follow): where there is one sum a face.
    pub fn sums_follow(&self) -> bool {
        self.stencil.polygons.follow_rows()
    }

    /// As [`row_within`](Self::row_within), where `sum(f)` is that of the points of a face: O(neighbours).
    ///
    /// # Panics
    /// If the row reaches beyond the points.
    #[inline]
    pub fn row_by_sums(&self, i: usize, points: (&[DVec3], usize), sum: impl Fn(usize) -> DVec3) -> DVec3 {
        self.stencil.row_by(i, points, |i| self.stencil.polygons.total(i, &sum))
    }

    /// Calls `add(f, part)` for what is to be added to the sum of each face at `i` where x_i changes by `change`. O(faces).
    ///
    /// # Panics
    /// Unless sums [follow](Self::sums_follow).
    #[inline]
    pub fn follow(&self, i: usize, change: DVec3, add: impl FnMut(usize, DVec3)) {
        let polygons = &self.stencil.polygons;
        let others = self.others.get_or_init(|| polygons.others(&self.stencil.kinds));
        polygons.follow(others, i, change, add);
    }

    /// (M x)_i = (A x)_i / h_i.
    pub fn symmetric_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.weight(i)
    }

    /// (D⁻¹A x)_i, D = diag A.
    pub fn jacobi_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.stencil.diagonal(i)
    }

    /// Calls `visit(j, a_ij)` for every neighbour j ≠ i of vertex `i`; a vertex that is joined to `i` more than once
    /// comes as often, with a part of the entry each time. As [`row`](Self::row) in cost.
    pub fn neighbours(&self, i: usize, visit: impl FnMut(usize, f64)) {
        self.stencil.entries(i, visit);
    }

    /// The sums over faces that the rows of one sweep share; none where all faces are triangles, or quads.
    pub fn all_sums<P: Point>(&self, x: &[P], sums: &mut Vec<P>) {
        self.stencil.polygons.all_sums(x, sums);
    }

    /// Which of all sums are those of faces whose first corner is in `rows`. These start, and end, at a multiple of
    /// [`BLOCK`](super::face_sums::BLOCK), or end at the last row. A row needs the sums of rows no further before it
    /// than it [reaches](Self::reach), and none of later rows.
    pub fn sums_of(&self, rows: Range<usize>) -> Range<usize> {
        self.stencil.polygons.sums_of(rows)
    }

    /// The sums from number `first` on, of whole faces. `window` holds x from vertex `start` on, as far as these
    /// [reach](Self::reach).
    ///
    /// # Panics
    /// If a face reaches beyond the window.
    pub fn sums<P: Point>(&self, first: usize, window: (&[P], usize), sums: &mut [P]) {
        self.stencil.polygons.sum(first, window, sums);
    }

    /// `out[k]` becomes (A x)_i of the k-th row i of `rows`. `window` holds x from vertex `start` on, as far as the rows
    /// [reach](Self::reach), and `sums` those of [all faces](Self::all_sums), or from a number on [those of the
    /// rows](Self::sums_of).
    ///
    /// # Panics
    /// If a row reaches beyond the window, or `out` has not one place a row.
    pub fn product<P: Point>(&self, rows: Range<usize>, window: (&[P], usize), sums: (&[P], usize), out: &mut [P]) {
        self.stencil.product(rows, window, sums, out);
    }

    /// The greatest distance in the vertex order between a row and its neighbours.
    pub fn reach(&self) -> usize {
        let s = &self.stencil;
        s.codes.reach().max(s.polygons.reach())
    }

    /// Bytes of the operator itself that one sweep over A reads.
    pub fn sweep_bytes(&self) -> usize {
        let s = &self.stencil;
        let code = match s.codes.neighbours() {
            Neighbours::Near(_) => 2,
            Neighbours::Far(_) => 4,
        };
        5 * self.len() + code * self.entries() + s.polygons.bytes()
    }

    /// Neighbours of all rows together, but for those by faces that are summed.
    pub fn entries(&self) -> usize {
        self.stencil.codes.offsets().last().map_or(0, |&end| end as usize)
    }
}

/// [`Operator::usual_lambda_min`]: single vertices of another valence hardly move λ_min, several next to each other do.
fn usual_lambda_min(scheme: Scheme, faces: &Faces, shapes: &[RowShape]) -> f64 {
    /// The most irregular vertices, in parts of all.
    const FEW: f64 = 0.01;
    /// Of the least value of the symbol.
    const PART: f64 = 0.99;
    let (size, valence) = if scheme.needs_triangles() { (3, 6) } else { (4, 4) };
    let usual = scheme.usual_lambda_min();
    if faces.uniform_size() != Some(size) {
        return usual;
    }
    // Fixed rows have none.
    let irregular = parallel::map(shapes.len(), 8192, |range| {
        shapes[range].iter().map(|shape| shape.valence()).filter(|&n| n != valence && n != 0).count()
    });
    let is_regular = irregular.iter().sum::<usize>() as f64 <= FEW * shapes.len() as f64;
    if is_regular { usual.max(PART * scheme.regular_symbol().0) } else { usual }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::breadth_first::in_fronts;
    use crate::mesh::builtin::builtin;

    #[test]
    fn fixed_rows_are_zero_and_the_others_as_they_were() {
        for name in ["irregular-poly:200", "irregular-tri:200", "torus:8x9", "prism:40"] {
            let surface = Surface::new(builtin(name).unwrap()).unwrap();
            let n = surface.len();
            let free: Vec<bool> = (0..n).map(|v| v % 3 != 1).collect();
            let x: Vec<DVec3> = (0..n).map(|v| DVec3::new((v * v % 17) as f64, 1.0, v as f64)).collect();
            let fronts = in_fronts(surface.faces(), surface.incidence());
            for scheme in Scheme::ALL.into_iter().filter(|s| s.first_unsuitable_face(surface.faces()).is_none()) {
                let full = Operator::new(&surface, scheme).unwrap();
                let row = |v: usize| if free[v] { full.row(v, &x) } else { DVec3::ZERO };
                let expected: Vec<DVec3> = (0..n).map(row).collect();
                let (mut sums, mut image) = (Vec::new(), vec![DVec3::ONE; n]);
                for order in [None, Some(&fronts)] {
                    let fixed = Operator::inside(&surface, scheme, RowOrder::Given(order), Some(&free)).unwrap().0;
                    let there = |values: &[DVec3]| order.map_or(values.to_vec(), |order| order.there(values));
                    let (x, expected) = (there(&x), there(&expected));
                    fixed.all_sums(&x, &mut sums);
                    fixed.product(0..n, (&x, 0), (&sums, 0), &mut image);
                    for i in 0..n {
                        let off = image[i].distance(expected[i]).max(fixed.row(i, &x).distance(expected[i]));
                        assert!(off <= 1e-12 * n as f64, "{name}, {scheme}, row {i}: {off:e}");
                    }
                    assert!(fixed.bounds().lambda_min >= full.bounds().lambda_min - 1e-15);
                }
            }
        }
    }
}
