//! Baseline of the measurements: the best Chebyshev iteration that one writes by hand. Index-only in double precision,
//! vertices in file order, 32-bit neighbours; product, residual with its norm and update in one pass over the arrays: 132
//! bytes a vertex of valence 4 among quads. No single precision, no order, no passes that iterations share. It belongs to the
//! measurements, not to the library.

use glam::DVec3;
use limitlab::mesh::{Incidence, Mesh};
use limitlab::schemes::{Masks, Scheme};
use limitlab::solvers::chebyshev::Recurrence;
use rayon::prelude::*;

const CHUNK: usize = 4096;

/// A = H·M on a closed mesh of quads only, or of triangles only.
pub struct Plain {
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// By valence: the weights of the vertex, of edge neighbours, of opposite corners.
    weights: Vec<[f64; 3]>,
    /// Neighbours in each face: one on triangles, two on quads.
    per_face: usize,
}

impl Plain {
    /// `None` unless all faces are triangles or all are quads.
    pub fn new(mesh: &Mesh, scheme: Scheme) -> Option<Plain> {
        let size = mesh.faces.uniform_size().filter(|s| (3..=4).contains(s))?;
        let incidence = Incidence::new(&mesh.faces, mesh.len());
        let per_face = size - 2;
        let mut offsets = vec![0u32];
        let mut neighbours = Vec::with_capacity(per_face * mesh.faces.corners().len());
        let mut greatest = 0;
        for v in 0..mesh.len() {
            for step in 1..=per_face {
                for &c in incidence.corners_at(v) {
                    let face = mesh.faces.face(incidence.face_of(c));
                    neighbours.push(face[(c as usize % size + step) % size]);
                }
            }
            offsets.push(neighbours.len() as u32);
            greatest = greatest.max(incidence.face_count(v));
        }
        let face = |steps| {
            if scheme.edges_only() { 0.0 } else { scheme.face_weight(size, steps) }
        };
        let weights = (0..=greatest)
            .map(|n| {
                let n = n.max(1);
                let h = scheme.h(n);
                let own = scheme.vertex_weight(n) + n as f64 * face(0);
                [h * own, h * (scheme.edge_weight() + face(1) + face(size - 1)), h * face(2)]
            })
            .collect();
        Some(Plain { offsets, neighbours, weights, per_face })
    }

    fn row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        let row = &self.neighbours[self.offsets[i] as usize..self.offsets[i + 1] as usize];
        let n = row.len() / self.per_face;
        let (near, across) = row.split_at(n);
        let sum = |list: &[u32]| {
            let mut sum = DVec3::ZERO;
            for &j in list {
                sum += x[j as usize];
            }
            sum
        };
        let [own, edge, opposite] = self.weights[n];
        own * x[i] + edge * sum(near) + opposite * sum(across)
    }

    /// `other` becomes x + γ (x − other) + τ (p − A x); max ‖p − A x‖².
    fn step(&self, points: &[DVec3], x: &[DVec3], other: &mut [DVec3], (gamma, tau): (f64, f64)) -> f64 {
        let chunks = other.par_chunks_mut(CHUNK).enumerate().map(|(k, other)| {
            let mut largest = 0.0f64;
            for (i, other) in (k * CHUNK..).zip(other) {
                let (v, e) = (x[i], points[i] - self.row(i, x));
                largest = largest.max(e.length_squared());
                *other = v + gamma * (v - *other) + tau * e;
            }
            largest
        });
        chunks.reduce(|| 0.0, f64::max)
    }

    /// Control points, the number of iterations, and whether the tolerance was met.
    pub fn chebyshev(
        &self,
        points: &[DVec3],
        interval: (f64, f64),
        tolerance: f64,
        most: usize,
    ) -> (Vec<DVec3>, usize, bool) {
        let mut recurrence = Recurrence::new(interval);
        let mut x = points.to_vec();
        let mut other = points.to_vec();
        for iteration in 0.. {
            let largest = self.step(points, &x, &mut other, recurrence.coefficients());
            let converged = largest.sqrt() <= tolerance;
            if converged || iteration == most {
                return (x, iteration, converged);
            }
            std::mem::swap(&mut x, &mut other);
            recurrence.step();
        }
        unreachable!("the loop ends by its own conditions")
    }
}
