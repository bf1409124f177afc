//! The blend of Lin & Luo (§4–5) for other schemes, which may be "treated in a similar way" (§7): of any that keeps the
//! vertices with their numbers and moves them, with the same α at all vertices.

use super::Refinement;
use super::refinement::Class;
use super::star::refuse;
use super::unified_sqrt3::ALPHA_RANGE;
use crate::Result;
use crate::mesh::{Mesh, Surface};
use crate::parallel;

/// One step. With Δ_i the displacement of vertex i by `scheme`, an old vertex becomes P_i + (1−α)Δ_i, and new vertices are
/// those that the scheme makes of P − αΔ: 0 is the scheme itself, with 1 old vertices stay. Of √3 it is
/// [`unified_sqrt3`](super::unified_sqrt3), of the cubic B-spline the four-point scheme. Two steps of the scheme in time
/// and memory.
///
/// # Errors
/// Those of the scheme; an α outside [`ALPHA_RANGE`].
///
/// # Panics
/// If the scheme is not [primal](Class::Primal).
///
/// ```
/// use limitlab::mesh::{Surface, builtin::builtin};
/// use limitlab::schemes::{Refinement, blend};
/// let surface = Surface::new(builtin("icosahedron")?)?;
/// let fine = blend::refine(&surface, Refinement::Loop, 1.0)?;
/// assert_eq!(fine.positions[..12], *surface.positions());
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn refine(surface: &Surface, scheme: Refinement, alpha: f64) -> Result<Mesh> {
    assert_eq!(scheme.class(), Class::Primal, "a refinement that keeps its vertices and moves them");
    if !ALPHA_RANGE.contains(&alpha) {
        return refuse(format!("α = {alpha}: the blend takes 0 (approximating) to 2, 1 interpolating"));
    }
    let old = surface.positions();
    let moved = scheme.refine(surface)?.positions;
    let shares = parallel::collect(old.len(), |v| old[v] - alpha * (moved[v] - old[v]));
    let mut fine = scheme.refine(&surface.with_positions(shares))?;
    for (v, point) in fine.positions[..old.len()].iter_mut().enumerate() {
        *point = old[v] + (1.0 - alpha) * (moved[v] - old[v]);
    }
    Ok(fine)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::builtin::builtin;
    use crate::mesh::random::random_points;
    use crate::schemes::unified_sqrt3;

    #[test]
    fn of_sqrt3_it_is_the_unified_scheme() {
        let surface = Surface::new(builtin("irregular-tri:60").expect("a mesh")).expect("closed");
        for alpha in [0.0, 0.3, 1.0, 1.7] {
            let (expected, _) = unified_sqrt3::refine(&surface, &vec![alpha; surface.len()]).expect("a step");
            let found = refine(&surface, Refinement::Sqrt3, alpha).expect("a step");
            assert!(found.faces == expected.faces);
            for (a, b) in found.positions.iter().zip(&expected.positions) {
                assert!(a.distance(*b) < 1e-14);
            }
        }
        assert!(refine(&surface, Refinement::Loop, 2.5).is_err());
    }

    /// By hand on a regular mesh, α = 1: Δ is −⅜ and 1/16 at each neighbour, the rule of an edge ⅜, ⅜, ⅛, ⅛.
    #[test]
    fn of_loop_the_interpolating_edge_rule_has_the_weights_61_and_16_in_128() {
        let surface = Surface::new(builtin("tri-torus:12x12").expect("a mesh")).expect("closed");
        let zero = surface.with_positions(vec![DVec3::ZERO; surface.len()]);
        let (a, neighbour) = (0, surface.faces().face(0)[1] as usize);
        assert_eq!(surface.faces().face(0)[0], 0);
        let at = |v: usize| {
            let mut unit = zero.clone();
            unit.positions_mut()[v] = DVec3::X;
            refine(&unit, Refinement::Loop, 1.0).expect("a step")
        };
        // The vertex of edge 0–1 is the one that both ends weigh most.
        let (from_a, from_b) = (at(a), at(neighbour));
        let of_edge = |fine: &Mesh, v: usize| fine.positions[v].x;
        let edge = (surface.len()..from_a.len()).find(|&v| {
            (of_edge(&from_a, v) - 61.0 / 128.0).abs() < 1e-15 && (of_edge(&from_b, v) - 61.0 / 128.0).abs() < 1e-15
        });
        let edge = edge.expect("a vertex with these weights");
        let weights: Vec<f64> = (0..surface.len()).map(|v| of_edge(&at(v), edge)).collect();
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert_eq!(weights.iter().filter(|w| (**w - 0.125).abs() < 1e-15).count(), 2);
        // What a step of random points keeps.
        let random = surface.with_positions(random_points(surface.len(), 1));
        assert_eq!(refine(&random, Refinement::Loop, 1.0).expect("a step").positions[..144], *random.positions());
    }
}
