//! The blend of Lin & Luo (§4–5) for other schemes, which may be "treated in a similar way" (§7): of any that keeps the
//! vertices with their numbers and moves them, with the same α at all vertices.

use glam::DVec3;

use super::Refinement;
use super::refinement::Class;
use super::star::{centroid, refuse};
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

/// One step with Maillot and Stam's push-back (2001), as Lin & Luo tell it (§1): old vertices are moved back towards where they were,
/// P_i + (1−β)Δ_i, and what was put on edges and faces by the mean of what their ends or corners were moved, where the
/// [blend](refine) applies the scheme's own rule to it. 0 is the scheme itself, with 1 old vertices stay. Of √3, whose rule of
/// faces is the mean, and of the cubic B-spline both are the same. A step of the scheme in time and memory.
///
/// # Errors
/// Those of the scheme; a β outside [`ALPHA_RANGE`].
///
/// # Panics
/// If the scheme is not [primal](Class::Primal).
pub fn push_back(surface: &Surface, scheme: Refinement, beta: f64) -> Result<Mesh> {
    assert_eq!(scheme.class(), Class::Primal, "a refinement that keeps its vertices and moves them");
    if !ALPHA_RANGE.contains(&beta) {
        return refuse(format!("β = {beta}: push-back takes 0 (approximating) to 2, 1 interpolating"));
    }
    let (old, topology) = (surface.positions(), surface.topology());
    let mut fine = scheme.refine(surface)?;
    let moves = parallel::collect(old.len(), |v| beta * (old[v] - fine.positions[v]));
    let corners = surface.faces().corners();
    let of_edges = |shares: &mut Vec<DVec3>| {
        topology.edge_numbers().extend(shares, |c| {
            let end = topology.incidence.next(surface.faces(), c);
            0.5 * [c, end].map(|c| moves[corners[c as usize] as usize]).iter().sum::<DVec3>()
        });
    };
    let of_faces = |shares: &mut Vec<DVec3>| {
        parallel::extend(shares, surface.faces().len(), |_| |f| centroid(&moves, surface.faces().face(f)));
    };
    let mut shares = moves.clone();
    match scheme {
        Refinement::CatmullClark => {
            of_edges(&mut shares);
            of_faces(&mut shares);
        }
        Refinement::Loop => of_edges(&mut shares),
        Refinement::Sqrt3 => of_faces(&mut shares),
        // None of them is primal.
        Refinement::DooSabin | Refinement::Butterfly | Refinement::LabsikGreiner | Refinement::MidEdge => {}
    }
    parallel::change(&mut fine.positions, |v, point| *point += shares[v]);
    if beta == 1.0 {
        fine.positions[..old.len()].copy_from_slice(old);
    }
    Ok(fine)
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn pushing_back_is_the_blend_where_the_rule_is_a_mean() {
        let surface = Surface::new(builtin("irregular-tri:60").expect("a mesh")).expect("closed");
        for beta in [0.0, 0.4, 1.0] {
            let [blended, pushed] =
                [refine, push_back].map(|step| step(&surface, Refinement::Sqrt3, beta).expect("a step"));
            assert!(pushed.faces == blended.faces);
            assert!(pushed.positions.iter().zip(&blended.positions).all(|(a, b)| a.distance(*b) < 1e-14), "{beta}");
        }
        // Not so under Loop, where the means of two ends are not its rule of edges; old vertices stay under both.
        let [blended, pushed] = [refine, push_back].map(|step| step(&surface, Refinement::Loop, 1.0).expect("a step"));
        assert_eq!(pushed.positions[..60], blended.positions[..60]);
        assert!(pushed.positions.iter().zip(&blended.positions).any(|(a, b)| a.distance(*b) > 1e-3));
        let plain = Refinement::Loop.refine(&surface).expect("a step");
        assert_eq!(push_back(&surface, Refinement::Loop, 0.0).expect("a step").positions, plain.positions);
        assert!(push_back(&surface, Refinement::Loop, -0.1).is_err());
    }

    /// What varies in one direction only is refined as a curve: the cubic B-spline's displacement makes the four-point rule.
    #[test]
    fn pushed_back_catmull_clark_of_a_surface_of_translation_is_the_four_point_rule() {
        let (n, m) = (12usize, 9usize);
        let mut mesh = builtin(&format!("torus:{n}x{m}")).expect("a mesh");
        let wave = |k: usize| ((k * k) % 7) as f64;
        for (v, p) in mesh.positions.iter_mut().enumerate() {
            *p = DVec3::new(wave(v / m), 0.0, 0.0);
        }
        let surface = Surface::new(mesh).expect("closed");
        let fine = push_back(&surface, Refinement::CatmullClark, 1.0).expect("a step");
        let edges = surface.topology().edge_sides();
        for (e, c) in edges.enumerate() {
            let corners = surface.faces().corners();
            let next = surface.incidence().next(surface.faces(), c);
            let [a, b] = [c, next].map(|c| corners[c as usize] as usize / m);
            let at = |k: usize| wave(k % n);
            let expected = match (b + n - a) % n {
                0 => at(a),
                1 => (9.0 * (at(a) + at(b)) - at(a + n - 1) - at(b + 1)) / 16.0,
                _ => (9.0 * (at(a) + at(b)) - at(b + n - 1) - at(a + 1)) / 16.0,
            };
            assert!((fine.positions[n * m + e].x - expected).abs() < 1e-14, "edge {e}");
        }
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
