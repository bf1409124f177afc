//! Smooth shapes in place of the papers' models: a trefoil knot, a sphere with bumps.

use glam::DVec3;

use limitlab::Result;
use limitlab::mesh::{Mesh, Surface, builtin};

use crate::programs::reproduce::context::Subject;

/// What is shown where a model is not at hand. The tables have noisy meshes in its place, which excite all eigenvectors and
/// look crumpled.
#[derive(Clone, Copy)]
pub enum StandIn {
    /// A torus of this name as a tube along a trefoil knot.
    Knot(&'static str),
    /// A sphere of this name with bumps.
    Bumps(&'static str),
    /// The mesh of this name as it is.
    Plain(&'static str),
}

impl StandIn {
    /// The mesh in its shape.
    ///
    /// # Errors
    /// If there is no mesh of the name.
    pub fn subject(self) -> Result<Subject> {
        let (name, mesh, place): (_, _, fn(DVec3) -> DVec3) = match self {
            StandIn::Knot(mesh) => (format!("knot of {mesh}"), mesh, on_knot),
            StandIn::Bumps(mesh) => (format!("{mesh} with bumps"), mesh, with_bumps),
            StandIn::Plain(mesh) => (mesh.to_owned(), mesh, |p| p),
        };
        let Mesh { positions, faces, .. } = builtin::builtin(mesh)?;
        let positions = positions.into_iter().map(place).collect();
        Ok(Subject { name, surface: Surface::new(Mesh::new(positions, faces))? })
    }
}

/// Where a point of the torus of radii 2 and 1 about the z axis goes: around the knot that winds twice about the axis of
/// that torus, thrice about its tube. Its normals there frame the knot, and close.
fn on_knot(p: DVec3) -> DVec3 {
    const TUBE: f64 = 0.5;
    let (around, tube) = (p.y.atan2(p.x), p.z.atan2(p.x.hypot(p.y) - 2.0));
    let ((sin2, cos2), (sin3, cos3)) = ((2.0 * around).sin_cos(), (3.0 * around).sin_cos());
    let normal = DVec3::new(cos3 * cos2, cos3 * sin2, sin3);
    let centre = DVec3::new(2.0 * cos2, 2.0 * sin2, 0.0) + normal;
    let radius = 2.0 + cos3;
    let tangent =
        DVec3::new(-3.0 * sin3 * cos2 - 2.0 * radius * sin2, -3.0 * sin3 * sin2 + 2.0 * radius * cos2, 3.0 * cos3);
    let (sin, cos) = tube.sin_cos();
    centre + TUBE * (cos * normal + sin * normal.cross(tangent.normalize()))
}

fn with_bumps(p: DVec3) -> DVec3 {
    let d = p.normalize();
    (1.0 + 0.2 * (4.5 * d.x + 0.6).sin() * (4.5 * d.y).sin() + 0.08 * (5.0 * d.z + 0.4).sin()) * d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_turned_outwards() {
        // Six times the volume, by the divergence theorem.
        let volume = |mesh: &Mesh| -> f64 {
            let p = |v: u32| mesh.positions[v as usize];
            let fan =
                |face: &[u32]| -> f64 { face.windows(2).skip(1).map(|w| p(face[0]).dot(p(w[0]).cross(p(w[1])))).sum() };
            mesh.faces.iter().map(fan).sum::<f64>() / 6.0
        };
        let knot = StandIn::Knot("tri-torus:400x40").subject().unwrap();
        // Pappus: the section times the way of its centre, here by differences.
        let way: f64 = {
            let centre = |k: i32| {
                let t = f64::from(k) * std::f64::consts::TAU / 4000.0;
                let ((s2, c2), (s3, c3)) = ((2.0 * t).sin_cos(), (3.0 * t).sin_cos());
                DVec3::new((2.0 + c3) * c2, (2.0 + c3) * s2, s3)
            };
            (0..4000).map(|k| centre(k).distance(centre(k + 1))).sum()
        };
        let expected = std::f64::consts::PI * 0.25 * way;
        let found = volume(knot.surface.mesh());
        assert!((found / expected - 1.0).abs() < 0.02, "{found} instead of {expected}");
        assert!(volume(StandIn::Bumps("icosphere:3").subject().unwrap().surface.mesh()) > 3.0);
    }
}
