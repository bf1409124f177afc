//! Curves of open and creased meshes: rows (w, 1 − 2w, w) along sharp edges, solved exactly by elimination.

use glam::DVec3;

use crate::mesh::features::Features;
use crate::schemes::Scheme;

/// The tridiagonal systems of all curves: `w x_{i−1} + (1 − 2w) x_i + w x_{i+1} = p_i`, with w the scheme's
/// [`curve_weight`](Scheme::curve_weight), between vertices that are known, or round a closed curve.
///
/// The diagonal dominates by 1 − 4w, so that elimination without pivoting is stable; the inverse decays along a curve by
/// the factor |ρ| a vertex, ρ² + ((1 − 2w)/w) ρ + 1 = 0: 2 − √3 for w = 1/6, 3 − 2√2 for w = 1/8.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    weight: f64,
    /// ρ, negative.
    decay: f64,
    chains: Vec<Chain>,
    /// Of elimination: c_1 = w/d, c_i = w/(d − w c_{i−1}), d = 1 − 2w.
    factors: Vec<f64>,
}

/// A row of unknown points.
#[derive(Clone, Debug)]
struct Chain {
    /// The unknown ones; not of a closed curve the known ones at both ends beside.
    vertices: Vec<u32>,
    closed: bool,
}

impl Curves {
    /// The curves of `features`; vertices that are not marked in `interpolated` are known.
    pub(super) fn new(features: &Features, scheme: Scheme, interpolated: Option<&[bool]>) -> Self {
        let is_known = |v: &u32| interpolated.is_some_and(|marks| !marks[*v as usize]);
        let mut chains = Vec::new();
        for curve in features.curves() {
            let vertices = &curve.vertices;
            let first_known = vertices.iter().position(is_known);
            match (curve.closed, first_known) {
                (true, None) => chains.push(Chain { vertices: vertices.clone(), closed: true }),
                (true, Some(k)) => {
                    // Begun at a known vertex, which ends it too.
                    let turned: Vec<u32> = [&vertices[k..], &vertices[..=k]].concat();
                    cut(&turned, is_known, &mut chains);
                }
                (false, _) => cut(vertices, is_known, &mut chains),
            }
        }
        let weight = scheme.curve_weight();
        let diagonal = 1.0 - 2.0 * weight;
        let longest = chains.iter().map(|chain| chain.vertices.len()).max().unwrap_or(0);
        let mut factors = Vec::with_capacity(longest);
        let mut last = 0.0;
        for _ in 0..longest {
            last = weight / (diagonal - weight * last);
            factors.push(last);
        }
        let half = 0.5 * diagonal / weight;
        Curves { weight, decay: (half * half - 1.0).sqrt() - half, chains, factors }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.chains.is_empty()
    }

    /// The number of unknown points.
    pub fn len(&self) -> usize {
        self.chains.iter().map(Chain::unknowns).sum()
    }

    /// The points p of the vertices on curves become the control points; all others stay, and those at the ends of curves
    /// are their control points already. O(unknowns), without allocation.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn solve(&self, points: &mut [DVec3]) {
        for chain in &self.chains {
            match chain.closed {
                true => self.close(&chain.vertices, points),
                false => {
                    if let [first, inner @ .., last] = chain.vertices.as_slice() {
                        self.eliminate(points[*first as usize], inner, points[*last as usize], points);
                    }
                }
            }
        }
    }

    /// The points between two that are known.
    fn eliminate(&self, before: DVec3, inner: &[u32], after: DVec3, points: &mut [DVec3]) {
        let w = self.weight;
        let mut last = before;
        for (&v, factor) in inner.iter().zip(&self.factors) {
            // y_i = (p_i − w y_{i−1})/(d − w c_{i−1}), and the divisor is w/c_i.
            let p = &mut points[v as usize];
            *p = (*p - w * last) * (factor / w);
            last = *p;
        }
        let mut last = after;
        for (&v, &factor) in inner.iter().zip(&self.factors).rev() {
            let p = &mut points[v as usize];
            *p -= factor * last;
            last = *p;
        }
    }

    /// Round a closed curve: x = y + x_0 z, where y is the solution with zero at the first vertex, and
    /// z_i = (ρ^i + ρ^(k−i))/(1 + ρ^k) the one without right-hand side that is 1 there.
    fn close(&self, vertices: &[u32], points: &mut [DVec3]) {
        let [first, others @ ..] = vertices else { return };
        let (w, k) = (self.weight, vertices.len() as i32);
        self.eliminate(DVec3::ZERO, others, DVec3::ZERO, points);
        let z = |i: i32| (self.decay.powi(i) + self.decay.powi(k - i)) / (1.0 + self.decay.powi(k));
        let beside = others.first().zip(others.last());
        let y = beside.map_or(DVec3::ZERO, |(&a, &b)| points[a as usize] + points[b as usize]);
        let own = &mut points[*first as usize];
        *own = (*own - w * y) / (1.0 - 2.0 * w + 2.0 * w * z(1));
        let own = *own;
        for (i, &v) in (1..).zip(others) {
            points[v as usize] += z(i) * own;
        }
    }

    /// Calls `visit(v, [a, b])` for every unknown and its two neighbours along the curve.
    pub fn rows(&self, mut visit: impl FnMut(usize, [usize; 2])) {
        for chain in &self.chains {
            let at = |i: usize| chain.vertices[i % chain.vertices.len()] as usize;
            let n = chain.vertices.len();
            let unknown = if chain.closed { 0..n } else { 1..n - 1 };
            for i in unknown {
                visit(at(i), [at(i + n - 1), at(i + 1)]);
            }
        }
    }

    /// w.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The eigenvalues of all curves: `1 − 2w(1 − cos φ)` with φ = jπ/(k + 1), j = 1…k, between known ends, and 2πj/k,
    /// j = 0…k − 1, round closed ones. Unsorted.
    pub fn eigenvalues(&self) -> Vec<f64> {
        use std::f64::consts::{PI, TAU};
        let mut all = Vec::with_capacity(self.len());
        for chain in &self.chains {
            let k = chain.unknowns();
            let angle = |j: usize| match chain.closed {
                true => TAU * j as f64 / k as f64,
                false => PI * (j + 1) as f64 / (k + 1) as f64,
            };
            all.extend((0..k).map(|j| 1.0 - 2.0 * self.weight * (1.0 - angle(j).cos())));
        }
        all
    }
}

impl Chain {
    fn unknowns(&self) -> usize {
        if self.closed { self.vertices.len() } else { self.vertices.len() - 2 }
    }
}

/// The parts between known vertices that have unknown ones; the ends are known.
fn cut(vertices: &[u32], is_known: impl Fn(&u32) -> bool, chains: &mut Vec<Chain>) {
    let mut start = 0;
    for end in 1..vertices.len() {
        if end + 1 == vertices.len() || is_known(&vertices[end]) {
            if end > start + 1 {
                chains.push(Chain { vertices: vertices[start..=end].to_vec(), closed: false });
            }
            start = end;
        }
    }
}
