//! Characteristic maps (Reif 1995): the planar surface whose control net is the pair of right eigenvectors of
//! λ_1 = λ_2. A scheme is C¹ at the vertex if this map is regular and injective.

use std::f64::consts::TAU;

use glam::DVec2;

use super::matrix::SplittingMatrix;
use super::scheme::{LocalScheme, Round};
use super::star::Layout;
use crate::error::Result;
use crate::mesh::{Faces, Mesh};

/// A planar control net about one extraordinary vertex or face.
#[derive(Clone, Debug)]
pub struct Net {
    /// The scheme that refines it.
    pub scheme: LocalScheme,
    /// Sectors n about the middle vertex or face.
    pub valence: usize,
    /// Rings of control points about the middle.
    pub rings: usize,
    /// In the order of [`Layout`].
    pub points: Vec<DVec2>,
}

/// What [`Net::check`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// No face is folded or degenerate.
    pub regular: bool,
    /// Regular, and the outermost ring is a simple curve that goes around once. The reverse is not decided: a
    /// boundary that is not star-shaped counts as not injective.
    pub injective: bool,
    /// The least sine of an angle at a corner of a face: negative where the map is folded.
    pub least_sine: f64,
    /// Corners at which the sine is below [`LEAST_SINE`].
    pub folded_corners: usize,
    /// How often the outermost ring goes around the middle.
    pub winding: f64,
    /// Whether its direction from the middle turns counter-clockwise all the way.
    pub star_shaped: bool,
    /// How many corners of faces were looked at.
    pub samples: usize,
}

/// A corner of a smaller sine counts as degenerate: far above rounding, far below any angle of a regular map
/// (at valence 100 the angles at the middle have the sine 0.06).
pub const LEAST_SINE: f64 = 1e-6;

/// The control net of the characteristic map on `rings` rings: the right eigenvectors of the leading pair of
/// frequency 1. [`LocalScheme::map_rings`] is enough for a surface of more than one ring.
///
/// # Errors
/// As [`SplittingMatrix::on_rings`], and if the leading pair is complex.
pub fn characteristic_map(scheme: LocalScheme, valence: usize, rings: usize) -> Result<Net> {
    Ok(Net { scheme, valence, rings, points: SplittingMatrix::on_rings(scheme, valence, rings)?.characteristic_net()? })
}

impl Net {
    /// The faces of the net, counter-clockwise in the star.
    pub fn faces(&self) -> Faces {
        self.scheme.layout().faces(self.valence, self.rings)
    }

    /// The innermost rings alone.
    ///
    /// # Panics
    /// If the net has not so many.
    pub fn inner(&self, rings: usize) -> Net {
        assert!(rings <= self.rings, "the net has so many rings");
        Net { rings, points: self.points[..self.layout().len(self.valence, rings)].to_vec(), ..self.clone() }
    }

    /// The net after `rounds` rounds of refinement, as far as these rings determine it: 2r−1 rings from r, with √3
    /// 3r−3, and with α ≠ 0 3r−6. O(refined points).
    ///
    /// # Errors
    /// Those of the scheme's refinement.
    pub fn refine(&self, rounds: usize) -> Result<Net> {
        let mut net = self.clone();
        for _ in 0..rounds {
            net = net.refine_once()?;
        }
        Ok(net)
    }

    fn refine_once(&self) -> Result<Net> {
        let (layout, n) = (self.scheme.layout(), self.valence);
        let mut positions: Vec<glam::DVec3> = self.points.iter().map(|p| p.extend(0.0)).collect();
        positions.push(glam::DVec3::NAN);
        let mesh = Mesh::new(positions.clone(), layout.closed(n, self.rings));
        let reach = self.scheme.factor() * self.rings - 1;
        let refined = Round::new(self.scheme, mesh, n, reach)?.apply(&positions)?;
        // What depends on the vertex that closes the star is NaN: keep the rings within.
        let finite = refined.iter().take_while(|p| p.is_finite()).count();
        let rings = (0..=reach).rev().find(|&r| layout.len(n, r) <= finite);
        let rings = rings.unwrap_or(0);
        Ok(Net {
            rings,
            points: refined[..layout.len(n, rings)].iter().map(|p| p.truncate()).collect(),
            ..self.clone()
        })
    }

    /// Whether the piecewise linear (bilinear) map from the star to this net is regular and injective. Applied to a
    /// net refined a few times, which converges to the characteristic map and its derivatives away from the middle.
    ///
    /// *Sampling*: every corner of every face of the net. *Regular*: the sine of every corner's angle, counter-
    /// clockwise, exceeds [`LEAST_SINE`]; then triangles keep their orientation and quads are convex, so that the
    /// Jacobian is positive on all of each face. *Injective*: regular, and the outermost ring turns strictly
    /// counter-clockwise about the middle, once. It is then a simple curve with winding number 1 inside and 0
    /// outside; an orientation-preserving map covers each point as often as its boundary winds around it: once.
    pub fn check(&self) -> Check {
        let mut least_sine = f64::INFINITY;
        let (mut samples, mut folded_corners) = (0, 0);
        for face in self.faces().iter() {
            let m = face.len();
            for k in 0..m {
                let [before, here, after] = [(k + m - 1) % m, k, (k + 1) % m].map(|c| self.points[face[c] as usize]);
                let (out, back) = (after - here, before - here);
                let sine = out.perp_dot(back) / (out.length() * back.length());
                samples += 1;
                // Not a number where two points coincide.
                if sine.is_nan() || sine <= LEAST_SINE {
                    folded_corners += 1;
                }
                least_sine = if sine.is_nan() { least_sine.min(0.0) } else { least_sine.min(sine) };
            }
        }
        let ring = self.scheme.layout().boundary(self.valence, self.rings);
        let mut turn = 0.0;
        let mut star_shaped = true;
        for (k, &v) in ring.iter().enumerate() {
            let next = ring[(k + 1) % ring.len()];
            let angle = self.points[v as usize].angle_to(self.points[next as usize]);
            star_shaped &= angle > 0.0;
            turn += angle;
        }
        let winding = turn / TAU;
        let regular = folded_corners == 0;
        Check {
            regular,
            injective: regular && star_shaped && (winding - 1.0).abs() < 1e-6,
            least_sine,
            folded_corners,
            winding,
            star_shaped,
            samples,
        }
    }

    /// The isoparametric lines of the net, every `step`-th in each family, as polylines.
    pub fn lines(&self, step: usize) -> Vec<Vec<(f64, f64)>> {
        let point = |v: u32| {
            let p = self.points[v as usize];
            (p.x, p.y)
        };
        let lines = self.layout().lines(self.valence, self.rings, step);
        lines.into_iter().map(|line| line.into_iter().map(point).collect()).collect()
    }

    fn layout(&self) -> Layout {
        self.scheme.layout()
    }
}
