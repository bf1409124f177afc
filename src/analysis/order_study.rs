//! Vertex orders of Gauss-Seidel and SOR compared (Zheng-Cai §5): rates and counts over many orders, and the
//! greedy sweep that always relaxes the largest residual.
//!
//! Measured with [`order_study`] (20 random orders) on `torus:24x24`, `quad-sphere:3`, `irregular-quad:500`,
//! `tri-torus:24x24`, `icosphere:2`, `irregular-tri:500`, each with noise 0.1, under the schemes that fit, at ω = 1 and
//! 1.1, to 1e-10 of the diagonal:
//!
//! - The order changes the count by up to a half, never by orders of magnitude: 27 to 34 sweeps of Gauss-Seidel on the
//!   Catmull-Clark torus, 18 to 28 at ω = 1.1 (ρ from 0.34 to 0.52).
//! - Orders that advance as a front (breadth first, reverse Cuthill-McKee, the row by row file order of a grid) take the
//!   most sweeps on regular meshes; a small ρ does not help them (breadth first on that torus: 0.34, yet 27 sweeps), as
//!   the error is first carried along the front: the error matrix is far from normal, and its powers follow the
//!   [symbol of the front](super::torus_symbol::front).
//! - Colour by colour is the least or within three sweeps of it, and may run in parallel. A file order that comes from
//!   subdivision (old vertices, then edges, then faces) acts like one and is as good or a little better.
//! - Random orders spread by at most three sweeps and are about as good as colour by colour, but on quads with
//!   Catmull-Clark.
//! - Largest residual first, at ω = 1, takes from 4 % more to 20 % fewer updates than the best of the orders (7.2 N
//!   against 9 N for Zheng-Cai), and each costs a heap operation for every neighbour.
//!
//! So: multicolour, unless memory order decides the time of a sweep; then a space-filling order within it.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use glam::DVec3;

use super::spectral_radius::sweep_radius;
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::mesh::Surface;
use crate::mesh::order::Order;
use crate::parallel;
use crate::solvers::gauss_seidel::Sor;
use crate::solvers::system::sweep;
use crate::solvers::{Outcome, Stop, System, solve};

/// One order, or the summary of the random ones, at one ω.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderRow {
    /// The order as on the command line, such as `random:3`; `greedy` for Gauss-Southwell.
    pub order: String,
    /// The relaxation factor; 1 is Gauss-Seidel.
    pub omega: f64,
    /// The spectral radius of the error matrix; `None` for the greedy method, which has none.
    pub rho: Option<f64>,
    /// How the run from V = P ended.
    pub outcome: Outcome,
    /// Sweeps; for the greedy method, updates over N.
    pub iterations: f64,
    /// max_i ‖p_i − (A v)_i‖₂ at the end, in mesh units.
    pub max_error: f64,
}

/// The orders that do not depend on chance.
pub const ORDERS: [Order; 7] =
    [Order::File, Order::Reverse, Order::Bfs, Order::Rcm, Order::Morton, Order::Valence, Order::Multicolour];

/// SOR at each ω in each of [`ORDERS`] and in `random` random orders (seeds 1, 2, …), then Gauss-Southwell once.
///
/// In parallel over the rows. Each costs a spectral radius (some hundred sweeps, dense for small systems) and a run.
///
/// # Errors
/// If a spectral radius cannot be computed.
pub fn order_study(
    surface: &Surface,
    system: &LimitSystem,
    omegas: &[f64],
    random: u64,
    stop: &Stop,
) -> Result<Vec<OrderRow>> {
    let mesh = surface.mesh();
    let orders: Vec<Order> = ORDERS.into_iter().chain((1..=random).map(Order::Random)).collect();
    let jobs: Vec<(f64, Order)> =
        omegas.iter().flat_map(|&omega| orders.iter().map(move |&order| (omega, order))).collect();
    let points = &mesh.positions;
    let rows: Result<Vec<OrderRow>> = parallel::try_map(&jobs, |&(omega, order)| {
        let vertices = order.order(mesh, surface.incidence());
        let zero = vec![DVec3::ZERO; system.len()];
        let rho = sweep_radius(system, |x| {
            sweep(system, &zero, omega, vertices.iter().map(|&i| i as usize), x);
        })?;
        let mut method = Sor::new(system, points, omega, Some(&vertices));
        let report = solve(&mut method, stop, &mut |_| ControlFlow::Continue(()));
        Ok(OrderRow {
            order: order.to_string(),
            omega,
            rho: Some(rho),
            outcome: report.outcome,
            iterations: report.iterations as f64,
            max_error: report.last().max,
        })
    });
    let mut rows = rows?;
    let greedy = gauss_southwell(system, points, stop);
    rows.push(OrderRow {
        order: "greedy".into(),
        omega: 1.0,
        rho: None,
        outcome: greedy.outcome,
        iterations: greedy.updates as f64 / system.len().max(1) as f64,
        max_error: greedy.max_error,
    });
    Ok(rows)
}

/// How far the rows of random orders spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The relaxation factor of these rows.
    pub omega: f64,
    /// The number of random orders, at least 1.
    pub runs: usize,
    /// Least, mean, greatest.
    pub rho: [f64; 3],
    /// Sweeps: least, mean, greatest.
    pub iterations: [f64; 3],
}

/// The spread of the random orders among `rows` at one ω; `None` if there are none.
pub fn random_spread(rows: &[OrderRow], omega: f64) -> Option<Spread> {
    let random = || rows.iter().filter(move |r| r.order.starts_with("random:") && r.omega == omega);
    let runs = random().count();
    if runs == 0 {
        return None;
    }
    let of = |value: &dyn Fn(&OrderRow) -> f64| {
        let (mut least, mut sum, mut greatest) = (f64::INFINITY, 0.0, f64::NEG_INFINITY);
        for x in random().map(value) {
            least = least.min(x);
            sum += x;
            greatest = greatest.max(x);
        }
        [least, sum / runs as f64, greatest]
    };
    Some(Spread { omega, runs, rho: of(&|r| r.rho.unwrap_or(f64::NAN)), iterations: of(&|r| r.iterations) })
}

/// The result of a greedy run.
#[derive(Clone, Debug, PartialEq)]
pub struct Greedy {
    /// The control points V at the end.
    pub points: Vec<DVec3>,
    /// Updates of single vertices.
    pub updates: usize,
    /// Converged, diverged, or stopped by the limit on updates.
    pub outcome: Outcome,
    /// Of the true residual at the end.
    pub max_error: f64,
}

/// A residual with its vertex and the number of changes that it had seen.
struct Candidate {
    size: f64,
    vertex: u32,
    version: u32,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        // Ties by the smaller vertex, so that the run is determined.
        self.size.total_cmp(&other.size).then(other.vertex.cmp(&self.vertex))
    }
}

/// Gauss-Southwell: relaxes the vertex of largest ‖e_i‖₂ until that is within the tolerance, from V = P (Southwell
/// 1946). Residuals are kept up to date, O(row · log N) an update; `max_iterations` counts N updates as one.
///
/// # Panics
/// If there is not one point a vertex.
pub fn gauss_southwell(system: &LimitSystem, points: &[DVec3], stop: &Stop) -> Greedy {
    assert_eq!(points.len(), system.len(), "one point a vertex");
    let n = system.len();
    let mut x = points.to_vec();
    let mut e: Vec<DVec3> = (0..n).map(|i| points[i] - system.row(i, &x)).collect();
    let mut version = vec![0u32; n];
    let mut heap: BinaryHeap<Candidate> =
        (0..n).map(|i| Candidate { size: e[i].length(), vertex: i as u32, version: 0 }).collect();
    let most = stop.max_iterations.saturating_mul(n);
    let mut updates = 0;
    let outcome = loop {
        let Some(top) = heap.pop() else {
            break Outcome::Converged;
        };
        let i = top.vertex as usize;
        if top.version != version[i] {
            continue;
        }
        if top.size <= stop.tolerance {
            break Outcome::Converged;
        }
        if !top.size.is_finite() {
            break Outcome::Diverged;
        }
        if updates == most {
            break Outcome::MaxIterations;
        }
        updates += 1;
        let step = e[i] / system.diagonal[i];
        x[i] += step;
        // Column i of A = H M: h_j m_ij.
        for (j, m) in system.m.row(i) {
            e[j] -= system.h[j] * m * step;
            version[j] = version[j].wrapping_add(1);
            heap.push(Candidate { size: e[j].length(), vertex: j as u32, version: version[j] });
        }
        // Outdated candidates are dropped before they outnumber the vertices by far.
        if heap.len() > 16 * n.max(64) {
            heap.retain(|c| c.version == version[c.vertex as usize]);
        }
    };
    let max_error = (0..n).map(|i| (points[i] - system.row(i, &x)).length()).fold(0.0, f64::max);
    Greedy { points: x, updates, outcome, max_error }
}
