//! Bending ∫ κ₁² + κ₂² dA of any surface, from points on it and its normals there: what surfaces of different schemes can be
//! compared by, which have no parameters in common. Their thin-plate energies ([`halstead`](super::halstead)) are integrals
//! over parameters.
//!
//! The normal's derivative is the shape operator, so that ∫ κ₁² + κ₂² dA = ∫ |∇N|² dA. N taken linear on a triangle, its part is
//! ½ Σ cot(γ_k) |N_i − N_j|² over the sides ij with the opposite angles γ_k, that is
//! Σ (e_i·e_j)(N_i − N_j)²/(4A) with the sides e. No unit of length has a part in it: a sphere has 8π.

use glam::DVec3;

use crate::mesh::Mesh;

/// The bending of a mesh whose vertices lie on a smooth surface, with the unit normals there. Faces of more than three corners
/// are cut as fans. Within O(h²) of the surface's where that has bounded curvature; at a point without any (of the interpolatory
/// schemes everywhere) a finite number that may grow as the mesh becomes finer. A zero normal, which stands for none, leaves
/// out its triangles; so does a triangle without area. O(corners).
///
/// # Panics
/// If there is not one normal a vertex.
///
/// ```
/// use limitlab::interpolate::bending::bending;
/// use limitlab::mesh::builtin::builtin;
/// let sphere = builtin("icosphere:4")?;
/// let found = bending(&sphere, &sphere.positions);
/// assert!((found / (8.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn bending(mesh: &Mesh, normals: &[DVec3]) -> f64 {
    assert_eq!(normals.len(), mesh.len(), "one normal a vertex");
    let triangle = |corners: [u32; 3]| {
        let [points, normals] = [&mesh.positions[..], normals].map(|values| corners.map(|v| values[v as usize]));
        let sides: [DVec3; 3] = std::array::from_fn(|k| points[(k + 1) % 3] - points[k]);
        let doubled = sides[0].cross(sides[1]).length();
        if doubled == 0.0 || normals.contains(&DVec3::ZERO) {
            return 0.0;
        }
        // The angle at corner k lies between the sides that leave and enter it, opposite to side k + 1.
        let part = |k: usize| {
            let difference = normals[(k + 2) % 3] - normals[(k + 1) % 3];
            -sides[k].dot(sides[(k + 2) % 3]) / doubled * difference.length_squared()
        };
        0.5 * (part(0) + part(1) + part(2))
    };
    let fan = |face: &[u32]| face[1..].windows(2).map(|pair| triangle([face[0], pair[0], pair[1]])).sum::<f64>();
    mesh.faces.iter().map(fan).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::mesh::builtin::builtin;

    /// Of a torus with radii R and r it is 4π²c²/√(c² − 1), c = R/r: 4 ∫H² − 2 ∫K, and ∫K vanishes.
    #[test]
    fn of_a_torus_it_is_the_closed_form() {
        let mut torus = builtin("torus:96x96").expect("a mesh");
        let middle = |p: &DVec3| 2.0 * DVec3::new(p.x, p.y, 0.0).normalize();
        let mut normals: Vec<DVec3> = torus.positions.iter().map(|p| p - middle(p)).collect();
        torus.positions.iter_mut().for_each(|p| *p *= 7.0);
        let expected = 16.0 * PI * PI / 3f64.sqrt();
        let found = bending(&torus, &normals);
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
        // Neither the side that is outside nor a normal that is not there adds anything.
        normals.iter_mut().for_each(|n| *n = -*n);
        assert_eq!(bending(&torus, &normals), found);
        normals.fill(DVec3::ZERO);
        assert_eq!(bending(&torus, &normals), 0.0);
    }
}
