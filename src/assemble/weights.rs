//! Weights of the rows of the matrix-free [`Operator`](super::Operator) by kind and valence, in double and in single
//! precision, and the points that they multiply.

use std::ops::{Add, AddAssign, Sub};

use glam::{DVec3, Vec3A};

/// What an operator acts on: three right-hand sides of one vertex, interleaved, in doubles (24 bytes) or singles
/// (16 bytes, one vector register); or a single one, for eigenvectors.
pub trait Point: Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + AddAssign {
    /// The neutral element of the sum.
    const ZERO: Self;
    /// A weight as the kernel multiplies by it.
    type Weight: Weight;

    /// The point, or number, times a weight.
    fn times(self, w: Self::Weight) -> Self;
}

/// A weight in one of the two precisions.
pub trait Weight: Copy + Send + Sync {
    /// Rounded to this precision.
    fn of(w: f64) -> Self;
    /// Of the weights by valence in both precisions, those in this one.
    fn by_valence<'a>(
        double: &'a WeightsByValence<f64>,
        single: &'a WeightsByValence<Vec3A>,
    ) -> &'a WeightsByValence<Self>;
    /// Of pairs in both precisions, those in this one.
    fn pairs<'a>(double: &'a [[f64; 2]], single: &'a [[Vec3A; 2]]) -> &'a [[Self; 2]];
}

impl Weight for f64 {
    #[inline(always)]
    fn of(w: f64) -> f64 {
        w
    }
    #[inline(always)]
    fn by_valence<'a>(
        double: &'a WeightsByValence<f64>,
        _single: &'a WeightsByValence<Vec3A>,
    ) -> &'a WeightsByValence<f64> {
        double
    }
    #[inline(always)]
    fn pairs<'a>(double: &'a [[f64; 2]], _single: &'a [[Vec3A; 2]]) -> &'a [[f64; 2]] {
        double
    }
}

/// Single precision, the weight in every lane, so that a loop need not spread it.
impl Weight for Vec3A {
    #[inline(always)]
    fn of(w: f64) -> Vec3A {
        Vec3A::splat(w as f32)
    }
    #[inline(always)]
    fn by_valence<'a>(
        _double: &'a WeightsByValence<f64>,
        single: &'a WeightsByValence<Vec3A>,
    ) -> &'a WeightsByValence<Vec3A> {
        single
    }
    #[inline(always)]
    fn pairs<'a>(_double: &'a [[f64; 2]], single: &'a [[Vec3A; 2]]) -> &'a [[Vec3A; 2]] {
        single
    }
}

impl Point for DVec3 {
    const ZERO: Self = DVec3::ZERO;
    type Weight = f64;

    #[inline(always)]
    fn times(self, w: f64) -> Self {
        w * self
    }
}

impl Point for f64 {
    const ZERO: Self = 0.0;
    type Weight = f64;

    #[inline(always)]
    fn times(self, w: f64) -> Self {
        w * self
    }
}

impl Point for Vec3A {
    const ZERO: Self = Vec3A::ZERO;
    type Weight = Vec3A;

    #[inline(always)]
    fn times(self, w: Vec3A) -> Self {
        w * self
    }
}

/// The weights of a row around a vertex of valence n whose faces are all of one kind, times h(n).
#[derive(Clone, Copy, Debug)]
pub struct RowWeights<W> {
    /// At the vertex itself.
    pub(super) own: W,
    /// At each edge neighbour.
    pub(super) edge: W,
    /// At the opposite corner of each quad; at what the faces add to the row of M, where these are summed.
    pub(super) across: W,
}

/// [`RowWeights`]s by valence, for the three [`RowKind`]s of rows.
#[derive(Clone, Debug, Default)]
pub struct WeightsByValence<W> {
    pub(super) quads: Vec<RowWeights<W>>,
    pub(super) edges: Vec<RowWeights<W>>,
    pub(super) polygons: Vec<RowWeights<W>>,
}

impl<W> RowWeights<W> {
    pub(super) fn new(own: W, edge: W, across: W) -> Self {
        RowWeights { own, edge, across }
    }
}

impl<W: Copy> RowWeights<W> {
    #[inline(always)]
    pub(super) fn value<P: Point<Weight = W>>(&self, own: P, edge: P, across: P) -> P {
        own.times(self.own) + edge.times(self.edge) + across.times(self.across)
    }

    #[inline(always)]
    pub(super) fn value_alone<P: Point<Weight = W>>(&self, own: P, across: P) -> P {
        own.times(self.own) + across.times(self.across)
    }

    #[inline(always)]
    pub(super) fn value_of_edges<P: Point<Weight = W>>(&self, own: P, edge: P) -> P {
        own.times(self.own) + edge.times(self.edge)
    }
}

impl WeightsByValence<f64> {
    pub(super) fn single(&self) -> WeightsByValence<Vec3A> {
        let single = |rings: &[RowWeights<f64>]| {
            rings
                .iter()
                .map(|r| {
                    RowWeights::new(
                        <Vec3A as Weight>::of(r.own),
                        <Vec3A as Weight>::of(r.edge),
                        <Vec3A as Weight>::of(r.across),
                    )
                })
                .collect()
        };
        WeightsByValence { quads: single(&self.quads), edges: single(&self.edges), polygons: single(&self.polygons) }
    }
}

/// What a row is made of; its weights follow from the valence n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RowKind {
    /// Quads only: n edge neighbours, then n opposite corners.
    Quads,
    /// Triangles only, or a scheme that knows edges only: n edge neighbours.
    Edges,
    /// Anything else: n edge neighbours, if edges have a weight, and the sums over n faces.
    Polygons,
}

/// The kind and the valence of a row in one number, so that one look-up brings both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RowShape(u32);

impl RowShape {
    /// # Panics
    /// If the valence is 2³⁰ or more.
    pub(super) fn new(kind: RowKind, valence: u32) -> Self {
        assert!(valence < 1 << 30, "a valence below 2³⁰");
        RowShape(valence << 2 | kind as u32)
    }

    pub(super) fn kind(self) -> RowKind {
        match self.0 & 3 {
            0 => RowKind::Quads,
            1 => RowKind::Edges,
            _ => RowKind::Polygons,
        }
    }

    pub(super) fn valence(self) -> u32 {
        self.0 >> 2
    }
}
