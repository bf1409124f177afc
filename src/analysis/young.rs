//! Young's theory of SOR: matrices consistently ordered, the eigenvalues of SOR from those of Jacobi, the best ω; and how far
//! limit systems are from it.
//!
//! An order is *consistent* with A if there are numbers γ with γ_j = γ_i + 1 where a_ij ≠ 0 and j is relaxed after i. Then the
//! eigenvalues λ of SOR(ω) and μ of J = I − D⁻¹A satisfy (λ + ω − 1)² = λ ω² μ². With real μ and μ̄ = ρ(J) < 1:
//! ρ(SOR(1)) = μ̄², the best ω is 2/(1 + √(1 − μ̄²)) and ρ = ω − 1 there, where the dominant two eigenvalues have met on the real axis
//! and leave it (Young 1971). Rings of odd length admit no such numbers, and on meshes every face whose corners couple has
//! one: the theory holds under mid-edge alone, on bipartite meshes, in some orders.

use std::collections::VecDeque;

use nalgebra::Complex;

use super::dense;
use super::spectral_radius::sweep_radius;
use crate::assemble::{Csr, LimitSystem};
use crate::error::Result;
use crate::solvers::Method;
use crate::solvers::method::error_step;

/// The ordering vector γ, 0 at the first row of each component; `None` if the order is not consistent with `a`. `order[k]` is
/// the row relaxed k-th; without it, that of the rows. O(entries).
///
/// # Panics
/// If `order` is not a permutation of the rows.
///
/// ```
/// use limitlab::analysis::young::ordering_vector;
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin, order::Order};
/// use limitlab::schemes::Scheme;
///
/// let surface = Surface::new(builtin::builtin("torus:6x6")?)?;
/// let order = Order::Multicolour.order(surface.mesh(), surface.incidence());
/// // Under mid-edge vertices couple along edges alone, and red before black is consistent …
/// let edges = LimitSystem::new(&surface, Scheme::MidEdge)?;
/// let red_black: Vec<u32> = (0..2).flat_map(|c| (0..36).filter(move |v| (v / 6 + v % 6) % 2 == c)).collect();
/// assert!(ordering_vector(&edges.a, Some(&red_black)).is_some());
/// // … row by row is not, for the rows close to rings; and where faces couple no order is.
/// assert!(ordering_vector(&edges.a, None).is_none());
/// let faces = LimitSystem::new(&surface, Scheme::CatmullClark)?;
/// assert!(ordering_vector(&faces.a, Some(&order)).is_none());
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn ordering_vector(a: &Csr, order: Option<&[u32]>) -> Option<Vec<i32>> {
    let n = a.len();
    let place: Vec<u32> = match order {
        Some(order) => crate::mesh::order::inverse(order),
        None => (0..n as u32).collect(),
    };
    assert_eq!(place.len(), n, "the order of all rows");
    let mut gamma: Vec<Option<i32>> = vec![None; n];
    let mut queue = VecDeque::new();
    for first in 0..n {
        if gamma[first].is_none() {
            gamma[first] = Some(0);
            queue.push_back(first);
        }
        while let Some(i) = queue.pop_front() {
            let here = gamma[i]?;
            for (j, _) in a.row(i).filter(|&(j, value)| j != i && value != 0.0) {
                let wanted = here + if place[j] > place[i] { 1 } else { -1 };
                match gamma[j] {
                    None => {
                        gamma[j] = Some(wanted);
                        queue.push_back(j);
                    }
                    Some(there) if there != wanted => return None,
                    Some(_) => {}
                }
            }
        }
    }
    gamma.into_iter().collect()
}

/// The two λ of (λ + ω − 1)² = λ ω² μ² for a pair ±μ of eigenvalues of J; both are 1 − ω for μ = 0, where one is meant.
///
/// ```
/// use limitlab::analysis::young::sor_pair;
///
/// // Gauss-Seidel: μ² and 0.
/// let [a, b] = sor_pair(0.8, 1.0);
/// assert!((a.re - 0.64).abs() < 1e-15 && b.norm() < 1e-15);
/// // Beyond the best ω, 1.25, the pair is complex and of modulus ω − 1.
/// assert!(sor_pair(0.8, 1.3).iter().all(|z| (z.norm() - 0.3).abs() < 1e-15 && z.im != 0.0));
/// ```
pub fn sor_pair(mu: f64, omega: f64) -> [Complex<f64>; 2] {
    // √λ = (ωμ ± √(ω²μ² − 4(ω − 1)))/2.
    let root = Complex::new(omega * omega * mu * mu - 4.0 * (omega - 1.0), 0.0).sqrt();
    [1.0, -1.0].map(|sign| {
        let half = (omega * mu + sign * root) * 0.5;
        half * half
    })
}

/// Young's best ω = 2/(1 + √(1 − μ̄²)); `None` unless μ̄ is below 1.
pub fn optimal_omega(jacobi_radius: f64) -> Option<f64> {
    let rest = 1.0 - jacobi_radius * jacobi_radius;
    (rest > 0.0).then(|| 2.0 / (1.0 + rest.sqrt()))
}

/// What Young's theory says of a system in an order, and what is so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Young {
    /// Whether the order is consistent with A.
    pub consistent: bool,
    /// ρ(J) of J = I − D⁻¹A; its square is said to be ρ of Gauss-Seidel.
    pub jacobi: f64,
    /// ρ of Gauss-Seidel.
    pub gauss_seidel: f64,
    /// The ω that is said to be the best; `None` where ρ(J) ≥ 1.
    pub omega: Option<f64>,
    /// ρ of SOR there, which is said to be ω − 1.
    pub rho: Option<f64>,
    /// The ω of least ρ, to about 10⁻³, and that ρ.
    pub best: (f64, f64),
}

impl Young {
    /// On a system small enough for [dense eigenvalues](dense::LARGEST), by some thirty spectral radii.
    ///
    /// # Errors
    /// If it is larger; if a computation does not converge.
    pub fn new(system: &LimitSystem, order: Option<&[u32]>) -> Result<Self> {
        let values = dense::eigenvalues(system)?.jacobi;
        let jacobi = values.iter().map(|x| (1.0 - x).abs()).fold(0.0, f64::max);
        let radius = |omega: f64| error_step(system, Method::Sor { omega, order }, |step| sweep_radius(system, step))?;
        let omega = optimal_omega(jacobi);
        Ok(Young {
            consistent: ordering_vector(&system.a, order).is_some(),
            jacobi,
            gauss_seidel: radius(1.0)?,
            omega,
            rho: omega.map(radius).transpose()?,
            best: best_omega(&radius)?,
        })
    }
}

/// The ω in (0, 2) of least radius, and that: the best of a grid, then golden sections about it.
///
/// # Errors
/// Those of `radius`.
pub fn best_omega(radius: &dyn Fn(f64) -> Result<f64>) -> Result<(f64, f64)> {
    const PART: f64 = 0.618_033_988_749_894_8;
    const GRID: usize = 19;
    const SECTIONS: usize = 11;
    let mut best = (f64::NAN, f64::INFINITY);
    let mut look = |omega: f64| -> Result<f64> {
        let rho = radius(omega)?;
        if rho < best.1 {
            best = (omega, rho);
        }
        Ok(rho)
    };
    let step = 2.0 / (GRID + 1) as f64;
    let (mut centre, mut least) = (1.0, f64::INFINITY);
    for k in 1..=GRID {
        let omega = 2.0 * k as f64 / (GRID + 1) as f64;
        let rho = look(omega)?;
        if rho < least {
            (centre, least) = (omega, rho);
        }
    }
    let (mut from, mut to) = (centre - step, centre + step);
    let probe = |from: f64, to: f64| [to - PART * (to - from), from + PART * (to - from)];
    let [left, right] = probe(from, to);
    let mut values = [look(left)?, look(right)?];
    for _ in 0..SECTIONS {
        let [left, right] = probe(from, to);
        if values[0] <= values[1] {
            to = right;
            values = [look(probe(from, to)[0])?, values[0]];
        } else {
            from = left;
            values = [values[1], look(probe(from, to)[1])?];
        }
    }
    Ok(best)
}
