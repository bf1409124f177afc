//! Rows of A at darts and at semi-sharp edges and vertices, from the local matrices of refinement.
//!
//! The star of a vertex is refined from itself alone, by one matrix S_k at level k, which depends on what sharpness is left
//! there. So the row at the vertex is `r · S_{K−1} ⋯ S_0`, where r is the row of what is sharp for ever, once nothing else
//! is sharp any more: the smooth row, ⅙(1, 4, 1) along a curve, 1 at a corner, and at a dart the left eigenvector of S for
//! the eigenvalue 1, which repeated products give.
//!
//! Conventions are OpenSubdiv's: sharpness falls by 1 with each step; the point of an edge of sharpness s is
//! `(1 − min(s, 1))·smooth + min(s, 1)·midpoint`; a vertex whose rule changes takes `w·old + (1 − w)·new`, w being the mean
//! of the sharpnesses that vanish in the step, 1 at the most.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::mesh::Surface;
use crate::mesh::features::{Features, SHARP};
use crate::mesh::incidence::{next_in, prev_in};

/// How a star is refined, under the schemes that have rules for darts and semi-sharp edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StarRule {
    CatmullClark,
    Loop,
}

/// The edges and faces about a vertex, face j between the edges j and j + 1.
#[derive(Clone, Debug)]
pub(crate) struct Star {
    /// Of the edges, counter-clockwise; [`SHARP`] and more is for ever.
    pub(crate) edges: Vec<f64>,
    /// Of the vertex itself.
    pub(crate) vertex: f64,
    /// Corners of each face.
    pub(crate) sizes: Vec<usize>,
}

/// A row of A at the centre of a star.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StarRow {
    /// At the vertex.
    pub(crate) own: f64,
    /// At the other ends of the edges.
    pub(crate) edges: Vec<f64>,
    /// At each corner of a face that is on no edge of the vertex.
    pub(crate) faces: Vec<f64>,
}

/// The star of a vertex of a mesh, with the numbers of its vertices.
pub(crate) struct StarOf {
    pub(crate) vertex: usize,
    pub(crate) star: Star,
    /// The other ends of its edges.
    ends: Vec<u32>,
    /// The corners of each face that are on none of its edges.
    others: Vec<Vec<u32>>,
}

/// What a vertex follows in one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StepRule {
    Smooth,
    Dart,
    Crease,
    Corner,
}

/// Products beyond which a left eigenvector is not followed: the second eigenvalue of a star is below 0.7, but where hundreds
/// of faces meet.
const PRODUCTS: usize = 4000;

/// Sharpness after some steps.
fn left(sharpness: f64, steps: usize) -> f64 {
    if sharpness >= SHARP { sharpness } else { (sharpness - steps as f64).max(0.0) }
}

impl Star {
    /// That of a dart of valence `n` among faces of one size, from its sharp edge on.
    pub(crate) fn dart(n: usize, size: usize) -> Self {
        let edges = (0..n).map(|j| if j == 0 { SHARP } else { 0.0 }).collect();
        Star { edges, vertex: 0.0, sizes: vec![size; n] }
    }

    fn rule(&self, steps: usize) -> StepRule {
        let sharp = self.edges.iter().filter(|&&s| left(s, steps) > 0.0).count();
        match sharp {
            _ if left(self.vertex, steps) > 0.0 => StepRule::Corner,
            0 => StepRule::Smooth,
            1 => StepRule::Dart,
            2 => StepRule::Crease,
            _ => StepRule::Corner,
        }
    }

    /// The two sharp edges of a crease.
    fn crease(&self, steps: usize) -> Vec<usize> {
        (0..self.edges.len()).filter(|&j| left(self.edges[j], steps) > 0.0).collect()
    }

    /// The row of A at the vertex. A star on a boundary has an edge more than faces. O(K·n) for n edges, K steps, the greatest
    /// semi-sharpness; at a dart some tens of products more.
    pub(crate) fn row(&self, rule: StarRule) -> StarRow {
        let all = self.edges.iter().chain([&self.vertex]);
        let greatest = all.copied().filter(|&s| s < SHARP).fold(0.0, f64::max);
        // At a dart among polygons, one step makes all faces quads.
        let uniform = if rule == StarRule::Loop { 3 } else { 4 };
        let regular = self.sizes.iter().all(|&size| size == uniform);
        let steps = (greatest.ceil() as usize).max(usize::from(!regular));
        let mut row = self.limit(rule, steps);
        for k in (0..steps).rev() {
            row = self.before(rule, k, &row);
        }
        row
    }

    /// The row once only that is sharp which is so for ever, on regular faces.
    fn limit(&self, rule: StarRule, steps: usize) -> StarRow {
        let n = self.edges.len();
        let mut row = StarRow { own: 0.0, edges: vec![0.0; n], faces: vec![0.0; self.sizes.len()] };
        let x = n as f64;
        match self.rule(steps) {
            StepRule::Corner => row.own = 1.0,
            StepRule::Crease => {
                row.own = 2.0 / 3.0;
                self.crease(steps).into_iter().for_each(|j| row.edges[j] = 1.0 / 6.0);
            }
            StepRule::Smooth => match rule {
                StarRule::CatmullClark => {
                    row.own = x / (x + 5.0);
                    row.edges.fill(4.0 / (x * (x + 5.0)));
                    row.faces.fill(1.0 / (x * (x + 5.0)));
                }
                StarRule::Loop => {
                    let part = loop_part(x);
                    row.own = 0.375 / (0.375 + part);
                    row.edges.fill((1.0 - row.own) / x);
                }
            },
            StepRule::Dart => {
                row.own = 1.0;
                for _ in 0..PRODUCTS {
                    let next = self.before(rule, steps.max(1), &row);
                    let change = row.distance(&next);
                    row = next;
                    if change <= 1e-17 {
                        break;
                    }
                }
            }
        }
        row
    }

    /// The row before step k of one that comes after it: the product with S_k. From the first step on all faces are regular.
    fn before(&self, rule: StarRule, k: usize, row: &StarRow) -> StarRow {
        let (n, m) = (self.edges.len(), self.sizes.len());
        let closed = n == m;
        let x = n as f64;
        let mut out = StarRow { own: 0.0, edges: vec![0.0; n], faces: vec![0.0; m] };
        // Weights of the new face points.
        let mut centres = row.faces.clone();
        for (j, &c) in row.edges.iter().enumerate() {
            let sharp = left(self.edges[j], k).min(1.0);
            out.own += 0.5 * sharp * c;
            out.edges[j] += 0.5 * sharp * c;
            let smooth = (1.0 - sharp) * c;
            if smooth == 0.0 {
                continue;
            }
            let (next, prev) = ((j + 1) % n, (j + n - 1) % n);
            match rule {
                StarRule::CatmullClark => {
                    out.own += 0.25 * smooth;
                    out.edges[j] += 0.25 * smooth;
                    centres[j] += 0.25 * smooth;
                    centres[prev] += 0.25 * smooth;
                }
                StarRule::Loop => {
                    out.own += 0.375 * smooth;
                    out.edges[j] += 0.375 * smooth;
                    out.edges[next] += 0.125 * smooth;
                    out.edges[prev] += 0.125 * smooth;
                }
            }
        }
        for (weight, steps) in self.blend(k) {
            let c = weight * row.own;
            match self.rule(steps) {
                _ if c == 0.0 => {}
                StepRule::Corner => out.own += c,
                StepRule::Crease => {
                    out.own += 0.75 * c;
                    self.crease(steps).into_iter().for_each(|j| out.edges[j] += 0.125 * c);
                }
                StepRule::Smooth | StepRule::Dart => match rule {
                    StarRule::CatmullClark => {
                        out.own += c * (x - 2.0) / x;
                        out.edges.iter_mut().for_each(|e| *e += c / (x * x));
                        centres.iter_mut().for_each(|f| *f += c / (x * x));
                    }
                    StarRule::Loop => {
                        let part = loop_part(x);
                        out.own += (1.0 - part) * c;
                        out.edges.iter_mut().for_each(|e| *e += part * c / x);
                    }
                },
            }
        }
        debug_assert!(closed || row.faces.iter().all(|&f| f == 0.0), "curves do not look into their faces");
        if rule == StarRule::CatmullClark {
            for (j, &c) in centres.iter().enumerate() {
                let size = if k == 0 { self.sizes[j] } else { 4 };
                let part = c / size as f64;
                out.own += part;
                out.edges[j] += part;
                out.edges[(j + 1) % n] += part;
                out.faces[j] += part;
            }
        }
        out
    }

    /// The rules that the vertex follows in step k, each by the number of steps after which it would hold, and its weight.
    fn blend(&self, k: usize) -> Vec<(f64, usize)> {
        let same = self.rule(k) == self.rule(k + 1)
            && (self.rule(k) != StepRule::Crease || self.crease(k) == self.crease(k + 1));
        if same {
            return vec![(1.0, k)];
        }
        let all = self.edges.iter().chain([&self.vertex]);
        let vanishing: Vec<f64> = all.map(|&s| left(s, k)).filter(|&s| s > 0.0 && s <= 1.0).collect();
        let old = (vanishing.iter().sum::<f64>() / vanishing.len().max(1) as f64).min(1.0);
        vec![(old, k), (1.0 - old, k + 1)]
    }
}

impl StarOf {
    pub(crate) fn new(surface: &Surface, features: &Features, vertex: usize) -> Self {
        let (faces, topology) = (surface.faces(), surface.topology());
        let corners = faces.corners();
        let mut at = Vec::new();
        let closed = topology.star(faces, vertex, &mut at);
        let range = |c: u32| faces.range(topology.incidence.face_of(c));
        let sharpness = |side: u32| features.sharpness(topology.twin(side).map_or(side, |twin| twin.min(side)));
        let (mut edges, mut ends) = (Vec::new(), Vec::new());
        let (mut sizes, mut others) = (Vec::new(), Vec::new());
        for &c in &at {
            let here = range(c);
            edges.push(sharpness(c));
            ends.push(corners[next_in(&here, c) as usize]);
            sizes.push(here.len());
            let on_edges = [c, next_in(&here, c), prev_in(&here, c)];
            let rest = here.filter(|&d| !on_edges.contains(&(d as u32)));
            others.push(rest.map(|d| corners[d]).collect());
        }
        if let (false, Some(&last)) = (closed, at.last()) {
            let into = prev_in(&range(last), last);
            edges.push(sharpness(into));
            ends.push(corners[into as usize]);
        }
        let own = features.vertex_sharpness(vertex as u32);
        StarOf { vertex, star: Star { edges, vertex: own, sizes }, ends, others }
    }

    /// Column and entry of a row, the vertex itself first; those of two edges to one vertex apart.
    pub(crate) fn entries<'a>(&'a self, row: &'a StarRow) -> impl Iterator<Item = (u32, f64)> + 'a {
        let edges = self.ends.iter().copied().zip(row.edges.iter().copied());
        let faces = self.others.iter().zip(&row.faces);
        let faces = faces.flat_map(|(others, &a)| others.iter().map(move |&v| (v, a)));
        std::iter::once((self.vertex as u32, row.own)).chain(edges).chain(faces)
    }

    /// Where a step takes the vertex; `smooth` is where it would go if all edges and itself were smooth.
    pub(super) fn vertex_point(&self, point: impl Fn(usize) -> DVec3, smooth: DVec3) -> DVec3 {
        let own = point(self.vertex);
        let by_rule = |steps: usize| match self.star.rule(steps) {
            StepRule::Corner => own,
            StepRule::Crease => {
                let along = self.star.crease(steps).into_iter().map(|j| point(self.ends[j] as usize));
                0.75 * own + 0.125 * along.sum::<DVec3>()
            }
            StepRule::Smooth | StepRule::Dart => smooth,
        };
        self.star.blend(0).into_iter().map(|(weight, steps)| weight * by_rule(steps)).sum()
    }
}

impl StarRow {
    fn distance(&self, other: &StarRow) -> f64 {
        let own = (self.own - other.own).abs();
        let pairs = self.edges.iter().zip(&other.edges).chain(self.faces.iter().zip(&other.faces));
        pairs.map(|(a, b)| (a - b).abs()).fold(own, f64::max)
    }
}

/// The part of the neighbours in Loop's vertex rule.
fn loop_part(n: f64) -> f64 {
    0.625 - (0.375 + 0.25 * (TAU / n).cos()).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn star(edges: &[f64], size: usize) -> Star {
        Star { edges: edges.to_vec(), vertex: 0.0, sizes: vec![size; edges.len()] }
    }

    fn close(a: &[f64], b: &[f64]) {
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-15, "{a} for {b}");
        }
    }

    /// The closed forms of left eigenvectors at darts.
    #[test]
    fn darts_have_their_exact_rows() {
        let row = star(&[10.0, 0.0, 0.0], 4).row(StarRule::CatmullClark);
        close(&[row.own], &[81.0 / 200.0]);
        close(&row.edges, &[0.2, 0.15, 0.15]);
        close(&row.faces, &[11.0 / 400.0, 1.0 / 25.0, 11.0 / 400.0]);
        let row = star(&[10.0, 0.0, 0.0, 0.0], 4).row(StarRule::CatmullClark);
        close(&[row.own], &[752.0 / 1608.0]);
        close(&row.edges, &[210.0, 160.0, 180.0, 160.0].map(|x| x / 1608.0));
        close(&row.faces, &[29.0, 44.0, 44.0, 29.0].map(|x| x / 1608.0));
        let row = star(&[10.0, 0.0, 0.0], 3).row(StarRule::Loop);
        close(&[row.own], &[16.0 / 37.0]);
        close(&row.edges, &[9.0, 6.0, 6.0].map(|x| x / 37.0));
        let row = star(&[10.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3).row(StarRule::Loop);
        close(&[row.own], &[110.0 / 213.0]);
        let expected = [7.0 / 71.0, 29.0 / 426.0, 35.0 / 426.0, 6.0 / 71.0, 35.0 / 426.0, 29.0 / 426.0];
        close(&row.edges, &expected);
    }

    /// On a regular vertex with one sharpness s on two opposite edges: θ·smooth + (1 − θ)·crease, θ = 2^−⌊s⌋ (1 − frac(s)/2).
    #[test]
    fn straight_semi_sharp_creases_blend_the_smooth_row_and_that_of_the_curve() {
        for s in [0.3f64, 0.5, 1.0, 1.7, 2.0, 3.25, 9.5] {
            let theta = 0.5f64.powf(s.floor()) * (1.0 - 0.5 * s.fract());
            let row = star(&[s, 0.0, s, 0.0], 4).row(StarRule::CatmullClark);
            let blend = |smooth: f64, crease: f64| theta * smooth + (1.0 - theta) * crease;
            close(&[row.own], &[blend(16.0 / 36.0, 2.0 / 3.0)]);
            let (along, across) = (blend(4.0 / 36.0, 1.0 / 6.0), blend(4.0 / 36.0, 0.0));
            close(&row.edges, &[along, across, along, across]);
            close(&row.faces, &[theta / 36.0; 4]);
            let row = star(&[s, 0.0, 0.0, s, 0.0, 0.0], 3).row(StarRule::Loop);
            close(&[row.own], &[blend(0.5, 2.0 / 3.0)]);
            let (along, across) = (blend(1.0 / 12.0, 1.0 / 6.0), theta / 12.0);
            close(&row.edges, &[along, across, across, along, across, across]);
        }
    }

    /// Where a semi-sharp edge meets a boundary: (θ'/6, 1 − θ'/3, θ'/6) along it.
    #[test]
    fn semi_sharp_corners_stay_on_their_curve() {
        for s in [0.4f64, 1.0, 2.6] {
            let theta = 0.5f64.powf(s.floor()) * (1.0 - 0.5 * s.fract());
            let star = Star { edges: vec![10.0, s, 10.0], vertex: 0.0, sizes: vec![4, 4] };
            let row = star.row(StarRule::CatmullClark);
            close(&[row.own], &[1.0 - theta / 3.0]);
            close(&row.edges, &[theta / 6.0, 0.0, theta / 6.0]);
            close(&row.faces, &[0.0, 0.0]);
        }
    }

    #[test]
    fn rows_sum_to_one_and_smooth_ones_are_those_of_the_scheme() {
        for (sizes, edges) in [(vec![3, 5, 4, 7], vec![0.0; 4]), (vec![4, 6, 3], vec![1.3, 0.0, 10.0])] {
            let star = Star { edges, vertex: 0.7, sizes: sizes.clone() };
            let row = star.row(StarRule::CatmullClark);
            let faces: f64 = row.faces.iter().zip(&sizes).map(|(f, &size)| (size - 3) as f64 * f).sum();
            assert!((row.own + row.edges.iter().sum::<f64>() + faces - 1.0).abs() < 1e-14);
        }
        // A pentagon beside quads, all smooth: 1/(n(n+5))·(n² v + Σ 2e + Σ_F (4/m) Σ_F).
        let star = Star { edges: vec![0.0; 3], vertex: 0.0, sizes: vec![5, 4, 4] };
        let row = star.row(StarRule::CatmullClark);
        close(&[row.own], &[(9.0 - 3.0 + 0.8 + 1.0 + 1.0) / 24.0]);
        close(&row.faces, &[0.8 / 24.0, 1.0 / 24.0, 1.0 / 24.0]);
    }
}
