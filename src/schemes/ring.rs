//! The rules of interpolatory schemes at extraordinary vertices: a new point is a blend of the vertex and its ring,
//! with a mask that is symmetric about an edge, or about the middle of a triangle, and a circulant of three harmonics.

use glam::{DVec2, DVec3};

use super::star::{CHUNK, Circle, Harmonics, next_in_triangle, prev_in_triangle, twin};
use crate::mesh::{Mesh, Surface, Topology};
use crate::parallel;

/// Up to this valence, the ring is walked once a new point: n² steps a vertex. Beyond, once a vertex.
const WALKED: usize = 16;

/// The valence of regular vertices.
const REGULAR: u8 = 6;

/// Where the new point of a corner lies, which is what its mask is symmetric about.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// On the edge that leaves the corner.
    Edge,
    /// In the corner's triangle.
    Triangle,
}

/// The rule of a scheme at vertices of valence n ≥ 3, n ≠ 6.
pub(super) struct RingRule {
    pub place: Place,
    /// The weight of the vertex, and those of its neighbours in circular order: from the one on the edge; or the two
    /// of the triangle first.
    pub mask: fn(usize) -> (f64, Vec<f64>),
    /// Of the harmonics 0, 1, 2 of the mask of the neighbours, times n.
    pub amplitudes: fn(usize) -> [f64; 3],
}

/// Up to this valence, as many steps are walked as at this one, so that a processor foresees their number; what a ring
/// has too few neighbours for has weight 0.
const USUAL: usize = 8;

/// The weights of a symmetric mask: the vertex, then pairs of neighbours from the axis on. A neighbour on the axis is a
/// pair by itself, of half the weight each.
type Half = [f64; WALKED / 2 + 2];

/// What the points at extraordinary vertices are computed from.
pub(super) struct Rings<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    rule: RingRule,
    /// Of every vertex that is smooth, or the greatest number where that does not fit. A byte each, so that they stay in a cache.
    valences: Vec<u8>,
    /// By valence, up to [`WALKED`].
    masks: Vec<Half>,
    /// The vertices of larger valence, ascending.
    wide: Vec<Wide>,
}

impl<'a> Rings<'a> {
    pub(super) fn new(surface: &'a Surface, rule: RingRule) -> Self {
        let (mesh, topology) = (surface.mesh(), surface.topology());
        // Sharp vertices have no whole ring: they count as regular.
        let features = surface.features();
        let valence = |v: usize| match features.is_none_or(|f| f.is_smooth(v)) {
            true => topology.incidence.face_count(v),
            false => REGULAR.into(),
        };
        let mut valences = parallel::collect(mesh.len(), |v| valence(v).min(u8::MAX.into()) as u8);
        for c in features.filter(|f| f.is_midway()).into_iter().flat_map(|f| f.sharp_sides(topology)) {
            // With what is put beyond the sharp edges, a ring of six: a vertex of the step before.
            valences[mesh.faces.corners()[prev_in_triangle(c)] as usize] = REGULAR;
        }
        let half = |n: usize| {
            let mut half = Half::default();
            if n >= 3 {
                let (center, ring) = (rule.mask)(n);
                half[0] = center;
                let pairs = match rule.place {
                    Place::Edge => &ring[..=n / 2],
                    Place::Triangle => &ring[1..=n.div_ceil(2)],
                };
                half[1..=pairs.len()].copy_from_slice(pairs);
                // Opposite to an edge lies a neighbour if n is even, to a triangle if it is odd.
                if n.is_multiple_of(2) == (rule.place == Place::Edge) {
                    half[pairs.len()] *= 0.5;
                }
            }
            half
        };
        Rings {
            mesh,
            topology,
            valences,
            masks: (0..=WALKED).map(half).collect(),
            wide: parallel::flat_map(mesh.len(), CHUNK, |range| {
                range.filter(|&v| valence(v) > WALKED).map(|v| Wide::new(surface, v, &rule)).collect()
            }),
            rule,
        }
    }

    /// Whether the vertex of corner `c` is smooth and extraordinary.
    #[inline]
    pub(super) fn is_extraordinary(&self, c: u32) -> bool {
        self.valences[self.mesh.faces.corners()[c as usize] as usize] != REGULAR
    }

    /// The new point of corner `c` by the rule of its vertex, which is extraordinary.
    #[inline]
    pub(super) fn point(&self, c: u32) -> DVec3 {
        let v = self.mesh.faces.corners()[c as usize];
        let n = usize::from(self.valences[v as usize]);
        if n > WALKED {
            let found = self.wide.partition_point(|w| w.vertex < v);
            return self.wide[found].point(c);
        }
        let weights = &self.masks[n];
        let center = weights[0] * self.mesh.positions[v as usize];
        match self.rule.place {
            Place::Edge => self.about_edge(center, c, n, weights),
            Place::Triangle => self.about_triangle(center, c, n, weights),
        }
    }

    /// The vertex of corner `c`.
    #[inline]
    fn at(&self, c: usize) -> DVec3 {
        self.mesh.positions[self.mesh.faces.corners()[c] as usize]
    }

    /// Adds the neighbours, from the edge of `c` on both ways.
    #[inline]
    fn about_edge(&self, center: DVec3, c: u32, n: usize, weights: &Half) -> DVec3 {
        // The sides to cross next: one that enters the vertex, one that leaves it.
        let (mut left, mut right) = (prev_in_triangle(c) as u32, c);
        let mut point = center + weights[1] * self.at(next_in_triangle(c));
        for weight in &weights[2..2 + n.max(USUAL) / 2] {
            let (leaving, entering) = (twin(self.topology, left), twin(self.topology, right));
            let before = prev_in_triangle(entering);
            point += *weight * (self.at(next_in_triangle(leaving)) + self.at(before));
            left = prev_in_triangle(leaving) as u32;
            right = next_in_triangle(entering) as u32;
        }
        point
    }

    /// Adds the neighbours, from the triangle of `c` on both ways.
    #[inline]
    fn about_triangle(&self, center: DVec3, c: u32, n: usize, weights: &Half) -> DVec3 {
        let before = prev_in_triangle(c);
        // The sides to cross next: one that enters the vertex, one that leaves it.
        let (mut left, mut right) = (before as u32, c);
        let mut point = center + weights[1] * (self.at(before) + self.at(next_in_triangle(c)));
        for weight in &weights[2..1 + n.max(USUAL).div_ceil(2)] {
            let (leaving, entering) = (twin(self.topology, left), twin(self.topology, right));
            left = prev_in_triangle(leaving) as u32;
            point += *weight * (self.at(left as usize) + self.at(prev_in_triangle(entering)));
            right = next_in_triangle(entering) as u32;
        }
        point
    }
}

/// A vertex of large valence: its n products of mask and ring cost O(n).
struct Wide {
    vertex: u32,
    center: DVec3,
    amplitudes: [f64; 3],
    harmonics: Harmonics,
    circle: Vec<DVec2>,
    /// The corners of the star, ascending, with their places on the circle.
    places: Vec<(u32, u32)>,
}

impl Wide {
    fn new(surface: &Surface, v: usize, rule: &RingRule) -> Self {
        let (mesh, topology) = (surface.mesh(), surface.topology());
        let mut star = Vec::new();
        topology.star(&mesh.faces, v, &mut star);
        let n = star.len();
        // Between the neighbours lie the middles of the triangles.
        let (stride, first) = match rule.place {
            Place::Edge => (1, 0),
            Place::Triangle => (2, 1),
        };
        let circle = Circle::default().of(stride * n).to_vec();
        let neighbor = |&c: &u32| mesh.faces.corners()[next_in_triangle(c)] as usize;
        let points = star.iter().map(|c| mesh.positions[neighbor(c)]);
        let harmonics = Harmonics::of(points, &circle, stride);
        let places = (first..).step_by(stride);
        let mut places: Vec<(u32, u32)> = star.into_iter().zip(places).collect();
        places.sort_unstable();
        Wide {
            vertex: v as u32,
            center: (rule.mask)(n).0 * mesh.positions[v],
            amplitudes: (rule.amplitudes)(n),
            harmonics,
            circle,
            places,
        }
    }

    /// The new point of corner `c` of the vertex.
    fn point(&self, c: u32) -> DVec3 {
        let found = self.places.partition_point(|p| p.0 < c);
        let place = self.places[found].1 as usize;
        self.center + self.harmonics.at(&self.circle, place, self.amplitudes)
    }
}
