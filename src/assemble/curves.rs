//! Curves of open and creased meshes: rows (w, 1 − 2w, w) along sharp edges, solved exactly by elimination.

use glam::DVec3;
use limitlab_factorizations::dense::small_symmetric_eigenvalues;
use nalgebra::DMatrix;

use super::stars::row_at;
use crate::error::Result;
use crate::mesh::Surface;
use crate::mesh::features::Rule;
use crate::schemes::Scheme;
use crate::schemes::local_limit::StarOf;

/// The tridiagonal systems of all curves: `w_i x_{i−1} + (1 − 2w_i) x_i + w_i x_{i+1} = p_i`, between vertices that are known, or
/// round a closed curve. w is the scheme's [`curve_weight`](Scheme::curve_weight), less where semi-sharp edges end on the
/// curve, or the vertex itself is semi-sharp.
///
/// The diagonal dominates by 1 − 4w, so that elimination without pivoting is stable. Of one weight the inverse decays along
/// a curve by the factor |ρ| a vertex, ρ² + ((1 − 2w)/w) ρ + 1 = 0: 2 − √3 for w = 1/6, 3 − 2√2 for w = 1/8.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// w where nothing is semi-sharp.
    weight: f64,
    chains: Vec<Chain>,
}

/// A row of unknown points.
#[derive(Clone, Debug)]
struct Chain {
    /// The unknown ones; not of a closed curve the known ones at both ends beside.
    vertices: Vec<u32>,
    closed: bool,
    /// Of the unknown ones: w_i.
    weights: Vec<f64>,
    /// Of elimination, from the first unknown point, or from the second of a closed curve: c_i with c_0 = 0 and
    /// c_i = w_i/(1 − 2w_i − w_i c_{i−1}).
    factors: Vec<f64>,
    /// Of a closed curve: what the others are without right-hand side where the first is 1.
    response: Vec<f64>,
}

impl Chain {
    fn new(vertices: Vec<u32>, closed: bool, weight: &impl Fn(u32) -> f64) -> Self {
        let unknown = if closed { &vertices[..] } else { &vertices[1..vertices.len() - 1] };
        let weights: Vec<f64> = unknown.iter().map(|&v| weight(v)).collect();
        let mut last = 0.0;
        let factors = weights[usize::from(closed)..].iter().map(|&w| {
            last = w / (1.0 - 2.0 * w - w * last);
            last
        });
        let factors = factors.collect();
        let mut chain = Chain { vertices, closed, weights, factors, response: Vec::new() };
        if closed {
            let mut response = vec![DVec3::ZERO; chain.weights.len() - 1];
            let places: Vec<u32> = (0..response.len() as u32).collect();
            chain.eliminate(DVec3::X, &places, DVec3::X, &mut response);
            chain.response = response.iter().map(|x| x.x).collect();
        }
        chain
    }

    fn unknowns(&self) -> usize {
        self.weights.len()
    }

    /// The points at `places` between two that are known: all unknown ones, or all but the first.
    fn eliminate(&self, before: DVec3, places: &[u32], after: DVec3, points: &mut [DVec3]) {
        let weights = &self.weights[usize::from(self.closed)..];
        let mut last = before;
        for ((&v, &w), &factor) in places.iter().zip(weights).zip(&self.factors) {
            // y_i = (p_i − w y_{i−1})/(1 − 2w − w c_{i−1}), and the divisor is w/c_i, or 1 where w is 0.
            let p = &mut points[v as usize];
            if w > 0.0 {
                *p = (*p - w * last) * (factor / w);
            }
            last = *p;
        }
        let mut last = after;
        for (&v, &factor) in places.iter().zip(&self.factors).rev() {
            let p = &mut points[v as usize];
            *p -= factor * last;
            last = *p;
        }
    }

    fn solve(&self, points: &mut [DVec3]) {
        if !self.closed {
            if let [first, inner @ .., last] = self.vertices.as_slice() {
                self.eliminate(points[*first as usize], inner, points[*last as usize], points);
            }
            return;
        }
        // x = y + x_0 z, where y is the solution with zero at the first vertex, and z the response to it.
        let [first, others @ ..] = self.vertices.as_slice() else { return };
        self.eliminate(DVec3::ZERO, others, DVec3::ZERO, points);
        let sum = |ends: Option<(f64, f64)>| ends.map_or(0.0, |(a, b)| a + b);
        let z = sum(self.response.first().copied().zip(self.response.last().copied()));
        let beside = others.first().zip(others.last());
        let y = beside.map_or(DVec3::ZERO, |(&a, &b)| points[a as usize] + points[b as usize]);
        let w = self.weights[0];
        let own = (points[*first as usize] - w * y) / (1.0 - 2.0 * w + w * z);
        points[*first as usize] = own;
        for (&v, &z) in others.iter().zip(&self.response) {
            points[v as usize] += z * own;
        }
    }
}

impl Curves {
    /// The curves of a surface; vertices that are not marked in `interpolated` are known.
    ///
    /// # Errors
    /// A semi-sharp edge that ends on a curve, under a scheme that has no rule for it.
    pub(crate) fn new(surface: &Surface, scheme: Scheme, interpolated: Option<&[bool]>) -> Result<Self> {
        let plain = scheme.curve_weight();
        let Some(features) = surface.features() else { return Ok(Curves { weight: plain, chains: Vec::new() }) };
        let mut own = Vec::new();
        for v in features.at_semi_sharp(surface) {
            if features.rules()[v as usize] == Rule::Crease {
                let star = StarOf::new(surface, features, v as usize);
                own.push((v, row_at(&star, scheme, Rule::Crease)?.edges));
            }
        }
        let weight = |v: u32| {
            let found = own.binary_search_by_key(&v, |entry| entry.0);
            // The same at both neighbours along the curve, and nothing elsewhere.
            found.map_or(plain, |at| own[at].1.iter().copied().fold(0.0, f64::max))
        };
        let is_known = |v: &u32| interpolated.is_some_and(|marks| !marks[*v as usize]);
        let mut chains = Vec::new();
        for curve in features.curves() {
            let vertices = &curve.vertices;
            let first_known = vertices.iter().position(is_known);
            match (curve.closed, first_known) {
                (true, None) => chains.push(Chain::new(vertices.clone(), true, &weight)),
                (true, Some(k)) => {
                    // Begun at a known vertex, which ends it too.
                    let turned: Vec<u32> = [&vertices[k..], &vertices[..=k]].concat();
                    cut(&turned, is_known, &weight, &mut chains);
                }
                (false, _) => cut(vertices, is_known, &weight, &mut chains),
            }
        }
        Ok(Curves { weight: plain, chains })
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
        self.chains.iter().for_each(|chain| chain.solve(points));
    }

    /// Calls `visit(v, w, [a, b])` for every unknown, its weight and its two neighbours along the curve.
    pub fn rows(&self, mut visit: impl FnMut(usize, f64, [usize; 2])) {
        for chain in &self.chains {
            let at = |i: usize| chain.vertices[i % chain.vertices.len()] as usize;
            let n = chain.vertices.len();
            let first = usize::from(!chain.closed);
            for (i, &w) in (first..).zip(&chain.weights) {
                visit(at(i), w, [at(i + n - 1), at(i + 1)]);
            }
        }
    }

    /// w where nothing is semi-sharp.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The eigenvalues of all curves: `1 − 2w(1 − cos φ)` with φ = jπ/(k + 1), j = 1…k, between known ends, and 2πj/k,
    /// j = 0…k − 1, round closed ones; where weights differ, those of the similar symmetric matrix, O(k³). Unsorted.
    pub fn eigenvalues(&self) -> Vec<f64> {
        use std::f64::consts::{PI, TAU};
        let mut all = Vec::with_capacity(self.len());
        for chain in &self.chains {
            let k = chain.unknowns();
            if chain.weights.iter().any(|&w| w != chain.weights[0]) {
                all.extend(small_symmetric_eigenvalues(chain.symmetric()).iter());
                continue;
            }
            let angle = |j: usize| match chain.closed {
                true => TAU * j as f64 / k as f64,
                false => PI * (j + 1) as f64 / (k + 1) as f64,
            };
            all.extend((0..k).map(|j| 1.0 - 2.0 * chain.weights[0] * (1.0 - angle(j).cos())));
        }
        all
    }
}

impl Chain {
    /// diag(w)^−½ A diag(w)^½.
    fn symmetric(&self) -> DMatrix<f64> {
        let (k, w) = (self.unknowns(), &self.weights);
        let mut matrix = DMatrix::zeros(k, k);
        for i in 0..k {
            matrix[(i, i)] += 1.0 - 2.0 * w[i];
            let next = (i + 1) % k;
            if next > i || self.closed {
                let value = (w[i] * w[next]).sqrt();
                matrix[(i, next)] += value;
                matrix[(next, i)] += value;
            }
        }
        matrix
    }
}

/// The parts between known vertices that have unknown ones; the ends are known.
fn cut(vertices: &[u32], is_known: impl Fn(&u32) -> bool, weight: &impl Fn(u32) -> f64, chains: &mut Vec<Chain>) {
    let mut start = 0;
    for end in 1..vertices.len() {
        if end + 1 == vertices.len() || is_known(&vertices[end]) {
            if end > start + 1 {
                chains.push(Chain::new(vertices[start..=end].to_vec(), false, weight));
            }
            start = end;
        }
    }
}
