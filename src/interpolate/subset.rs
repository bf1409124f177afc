//! Interpolation of some of the vertices: the rows of the others are V_j = P_j (Zheng-Cai §2), for every scheme.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use crate::assemble::csr::Pattern;
use crate::assemble::{Csr, LimitSystem};
use crate::solvers::{Method, Solution, Step, Stop, run_watched};
use crate::{Error, Result};

/// The principal submatrix of a limit system on the interpolated vertices S.
///
/// It has the factors H_S and M_SS. H^½MH^½ is symmetric, so by interlacing the eigenvalues of A_SS lie between the
/// extreme ones of A, and the same holds for D⁻¹A: the proven bounds carry over, and a system that is never singular
/// stays so. (Row sums are at most 1 here.)
#[derive(Clone, Debug)]
pub struct Restriction {
    /// A_SS with its factors H_S and M_SS; the bounds are those of the whole A.
    pub system: LimitSystem,
    /// The interpolated vertices, ascending: row k of the system belongs to `vertices[k]`.
    pub vertices: Vec<u32>,
}

/// Not interpolated.
const ABSENT: u32 = u32::MAX;

impl Restriction {
    /// Rows and columns of the vertices marked in `interpolated`. O(entries).
    ///
    /// # Errors
    /// No vertex is marked.
    ///
    /// # Panics
    /// If there is not one mark a vertex.
    pub fn new(full: &LimitSystem, interpolated: &[bool]) -> Result<Self> {
        assert_eq!(interpolated.len(), full.len(), "one mark a vertex");
        let marked = |&v: &u32| interpolated[v as usize];
        let vertices: Vec<u32> = (0..full.len() as u32).filter(marked).collect();
        if vertices.is_empty() {
            return Err(nothing());
        }
        let mut place = vec![ABSENT; full.len()];
        for (k, &v) in vertices.iter().enumerate() {
            place[v as usize] = k as u32;
        }
        let mut offsets = vec![0u32];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for &v in &vertices {
            for (j, m) in full.m.row(v as usize) {
                if place[j] != ABSENT {
                    columns.push(place[j]);
                    values.push(m);
                }
            }
            offsets.push(columns.len() as u32);
        }
        let h: Vec<f64> = vertices.iter().map(|&v| full.h[v as usize]).collect();
        let m = Csr::new(Arc::new(Pattern::new(offsets, columns)), values);
        let a = m.scale_rows(&h);
        Ok(Restriction { system: LimitSystem { diagonal: a.diagonal(), bounds: full.bounds, h, m, a }, vertices })
    }

    /// A vertex order of the whole mesh as an order of the rows here.
    ///
    /// # Panics
    /// If `order` names a vertex that the mesh lacks.
    pub fn order(&self, order: &[u32]) -> Vec<u32> {
        let mut place = vec![ABSENT; order.len()];
        for (k, &v) in self.vertices.iter().enumerate() {
            place[v as usize] = k as u32;
        }
        let rows = order.iter().map(|&v| place[v as usize]);
        rows.filter(|&k| k != ABSENT).collect()
    }

    /// Solves A_SS V_S = P_S − A_SC P_C for V_S, with V_C = P_C; the solution holds all vertices. `order` of the
    /// set-up is one of rows ([`order`](Self::order)).
    ///
    /// The unknown is X = V_S − P_S, with A_SS X = (P − A P)_S =: E, and the methods start from their right-hand
    /// side. So the start here is V = P + E: what one PIA step makes of V = P. The errors are those of V; the watch
    /// sees X.
    ///
    /// # Panics
    /// As [`run_watched`], and if `full` is not the system that was restricted.
    pub fn solve(
        &self,
        full: &LimitSystem,
        points: &[DVec3],
        method: Method,
        stop: &Stop,
        watch: &mut dyn FnMut(&Step) -> ControlFlow<()>,
    ) -> Solution {
        assert_eq!(points.len(), full.len(), "one point a vertex");
        let differences: Vec<DVec3> =
            (self.vertices.iter()).map(|&v| points[v as usize] - full.a.row_times(v as usize, points)).collect();
        let mut solution = run_watched(&self.system, &differences, method, stop, watch);
        let mut control = points.to_vec();
        for (&v, x) in self.vertices.iter().zip(&solution.points) {
            control[v as usize] += *x;
        }
        solution.points = control;
        solution
    }
}

pub(super) fn nothing() -> Error {
    Error::Computation("no vertex is to be interpolated: name at least one".into())
}
