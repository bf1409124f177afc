//! Tangents of the schemes that keep their vertices: masks on the rings of the mesh refined until extraordinary
//! vertices are far enough apart.

use glam::{DVec2, DVec3};

use super::star::{Tangents, next_in_triangle, require_triangles, twin};
use crate::Result;
use crate::mesh::Surface;

pub(super) const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// The weights of the regular (valence 6) tangent mask, cosine and sine, in the first of six sectors: at i steps along
/// the sector's axis, then j to the left. Those of the next sector are turned by 60°.
///
/// It is the left eigenvector of the subdominant eigenvalue: the derivative at the vertex of the limit of data on the
/// lattice. With those of polynomials that the scheme reproduces it is exact.
pub(super) struct RegularMask {
    pub weights: &'static [(usize, usize, [f64; 2])],
}

/// The limit points of all vertices: the vertices themselves.
pub(super) fn vertices(name: &'static str, surface: &Surface) -> Result<Vec<DVec3>> {
    let mesh = surface.mesh();
    require_triangles(surface, name)?;
    Ok(mesh.positions.clone())
}

/// The tangents at the vertices 0 to `originals` − 1 of a triangle mesh, in which they are the only vertices
/// that may be extraordinary (valence other than 6), and are apart by as many edges as the mask reaches, and so far from sharp
/// edges that do not end at them. Sharp vertices have none.
///
/// At an extraordinary vertex the rule of both schemes maps the ring to the ring by a circulant, so the first harmonic
/// of the ring is the mask.
pub(super) fn tangents(surface: &Surface, originals: usize, mask: &RegularMask) -> Vec<Tangents> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let corners = mesh.faces.corners();
    let end = |c: u32| mesh.positions[corners[next_in_triangle(c)] as usize];
    let turned = |c: u32, times: usize| {
        (0..times).fold(c, |c, _| {
            let next = topology.counter_clockwise(&mesh.faces, c);
            next.expect("a smooth vertex has no last corner")
        })
    };
    // On through the regular vertex at the end of `c`, and 60° to the left of that.
    let straight = |c: u32| turned(twin(topology, c), 3);
    let left = |c: u32| turned(twin(topology, c), 4);
    let mut found = Vec::with_capacity(originals);
    let mut ring: Vec<DVec3> = Vec::new();
    let mut star = Vec::new();
    for v in 0..originals {
        if surface.features().is_some_and(|f| !f.is_smooth(v)) {
            found.push(Tangents::default());
            continue;
        }
        topology.star(&mesh.faces, v, &mut star);
        let center = mesh.positions[v];
        if star.len() != 6 {
            ring.clear();
            ring.extend(star.iter().map(|&c| end(c) - center));
            found.push(Tangents::of_ring(&ring));
            continue;
        }
        let mut pair = Tangents::default();
        for (s, &spoke) in star.iter().enumerate() {
            let turn = DVec2::from_angle(std::f64::consts::FRAC_PI_3 * s as f64);
            for &(i, j, weights) in mask.weights {
                let along = (1..i).fold(spoke, |c, _| straight(c));
                let at = match j {
                    0 => along,
                    _ => (1..j).fold(left(along), |c, _| straight(c)),
                };
                pair.add(turn.rotate(DVec2::from_array(weights)), end(at) - center);
            }
        }
        found.push(pair);
    }
    found
}
