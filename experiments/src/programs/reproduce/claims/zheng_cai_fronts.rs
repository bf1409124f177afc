//! Why fronts take the most sweeps: powers of their iteration matrices follow a symbol, and not the spectral radius.

use limitlab::Result;
use limitlab::analysis::iteration_matrix::IterationMatrix;
use limitlab::analysis::torus_symbol::{Colouring, eigenvalues, front_radius};
use limitlab::mesh::order::Order;
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;
use limitlab::solvers::method::SOR_OMEGA;

use super::finding::Evidence;
use crate::programs::reproduce::context::Subject;

/// The torus of the table `orders`, where a wave does not cross so many sweeps.
const SIDE: usize = 24;
const POWER: usize = 12;

/// Breadth first and colour by colour on a regular torus under Catmull-Clark, at ω = 1.1: radius, symbol, rate of powers.
///
/// # Errors
/// Those of the computations.
pub fn evidence() -> Result<Vec<Evidence>> {
    let scheme = Scheme::CatmullClark;
    let subject = Subject::built_in(&format!("torus:{SIDE}x{SIDE}"))?;
    let system = subject.system(scheme)?;
    let colouring = Colouring::usual(scheme);
    let front = Order::Bfs.order(subject.surface.mesh(), subject.surface.incidence());
    let colours = colouring.order([SIDE; 2]);
    let sor = |order| Method::Sor { omega: SOR_OMEGA, order: Some(order) };
    let of = |order| -> Result<[f64; 3]> {
        let t = IterationMatrix::new(&system, sor(order))?;
        let rho = t.eigenvalues()?.first().map_or(0.0, |z| z.norm());
        let power = t.powers(POWER, 0.0)?.last().and_then(|norms| norms[0]).unwrap_or(f64::NAN);
        Ok([rho, power.powf(1.0 / POWER as f64), power / rho.powi(POWER as i32)])
    };
    let [rho, rate, hump] = of(&front)?;
    let [rho_colours, rate_colours, hump_colours] = of(&colours)?;
    let symbol = front_radius(scheme, SOR_OMEGA, [8 * SIDE; 2]);
    let blocks = eigenvalues(scheme, [SIDE; 2], sor(&colours), &colouring)?.first().map_or(f64::NAN, |z| z.norm());
    Ok(vec![
        Evidence::below("radius of a front on the regular torus, SOR(1.1)", rho, rho_colours),
        Evidence::shown("symbol of a front there, max |T̂|", symbol),
        Evidence::at_least("rate of a front there, ‖T^12‖^(1/12), over the symbol", rate / symbol, 0.97),
        Evidence::shown("hump of a front there, ‖T^12‖/ρ^12", hump),
        Evidence::shown("radius by colours there", rho_colours),
        Evidence::at_most(
            "deviation of the radius by colours from that of the blocks",
            (blocks - rho_colours).abs(),
            1e-9,
        ),
        Evidence::at_most("rate by colours there, over the symbol of a front", rate_colours / symbol, 0.85),
        Evidence::shown("hump by colours there", hump_colours),
    ])
}
