//! Rows at darts and semi-sharp vertices, which are neither those of a curve nor rows of H·M.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::mesh::features::{Features, Rule};
use crate::mesh::incidence::{next_in, prev_in};
use crate::schemes::Scheme;
use crate::schemes::local_limit::{Star, StarRow};

/// The star of a vertex with its sharpness and the numbers of its vertices.
pub(super) struct StarOf {
    vertex: usize,
    star: Star,
    /// The other ends of its edges.
    ends: Vec<u32>,
    /// The corners of each face that are on none of its edges.
    others: Vec<Vec<u32>>,
}

impl StarOf {
    pub(super) fn new(surface: &Surface, features: &Features, vertex: usize) -> Self {
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

    /// The row of A.
    pub(super) fn row(&self, scheme: Scheme, rule: Rule) -> Result<StarRow> {
        match scheme.star_rule() {
            Some(star_rule) => Ok(self.star.row(star_rule)),
            None if rule == Rule::Dart => Err(Error::Dart {
                vertex: self.vertex,
                scheme: scheme.name(),
                advice: "make it a corner, or lead the crease on to a boundary, a corner or another crease",
            }),
            None => Err(Error::SemiSharp { vertex: self.vertex, scheme: scheme.name() }),
        }
    }

    /// Column and entry of the row, in order.
    fn entries(&self, row: &StarRow) -> Vec<(u32, f64)> {
        let mut all = vec![(self.vertex as u32, row.own)];
        all.extend(self.ends.iter().copied().zip(row.edges.iter().copied()));
        for (others, &a) in self.others.iter().zip(&row.faces) {
            all.extend(others.iter().map(|&v| (v, a)));
        }
        all.sort_unstable_by_key(|entry| entry.0);
        all.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 += if same { next.1 } else { 0.0 };
            same
        });
        all.retain(|entry| entry.1 != 0.0);
        all
    }
}

/// The rows at darts and semi-sharp vertices, over all columns. With S, the smooth vertices, they are solved together: A is
/// not similar to a symmetric matrix where there are some.
#[derive(Clone, Debug)]
pub struct StarRows {
    /// Ascending; row k is that of `vertices[k]`.
    vertices: Vec<u32>,
    offsets: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl StarRows {
    /// Those of a surface that are interpolated; `None` if there are none. O(corners) of their stars, in each as the greatest
    /// semi-sharpness, or some tens at a dart.
    ///
    /// # Errors
    /// Any, under a scheme that has no rule for them.
    pub(crate) fn new(surface: &Surface, scheme: Scheme, interpolated: Option<&[bool]>) -> Result<Option<Self>> {
        let Some(features) = surface.features() else { return Ok(None) };
        let mut vertices = Vec::new();
        let (mut offsets, mut entries) = (vec![0], Vec::new());
        for (v, &rule) in features.rules().iter().enumerate() {
            if !matches!(rule, Rule::Dart | Rule::SemiSharp) || interpolated.is_some_and(|marks| !marks[v]) {
                continue;
            }
            let star = StarOf::new(surface, features, v);
            entries.extend(star.entries(&star.row(scheme, rule)?));
            vertices.push(v as u32);
            offsets.push(entries.len());
        }
        Ok(if vertices.is_empty() { None } else { Some(StarRows { vertices, offsets, entries }) })
    }

    /// The vertices, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The entries of row k.
    pub fn row(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.entries[self.offsets[k]..self.offsets[k + 1]].iter().map(|&(j, a)| (j as usize, a))
    }

    /// (A x) at these vertices.
    pub fn product(&self, x: &[DVec3]) -> Vec<DVec3> {
        let row = |k| self.row(k).fold(DVec3::ZERO, |sum, (j, a)| sum + a * x[j]);
        (0..self.vertices.len()).map(row).collect()
    }
}
