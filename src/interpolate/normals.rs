//! Given normals on a subdivision surface by rotated 1-rings (Thall §2.5).
//!
//! After two refinements the 1-rings of the original vertices are disjoint. The limit point and normal of a vertex
//! depend on its 1-ring alone and turn with it, so a rotation of the ring about the limit point sets the normal and
//! moves neither that limit point nor those of other original vertices. What the paper does for Catmull-Clark holds
//! for Loop and √3 word for word.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};

use super::thall::angle;
use super::zheng_cai::Constraints;
use crate::error::short;
use crate::mesh::Surface;
use crate::mesh::frame::direction;
use crate::schemes::{Class, Refinement};
use crate::{Error, Result};

/// When and how far rings are turned. Angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Rings are turned where the normal is off by more than this.
    pub threshold: f64,
    /// A turned ring stops this far from the given normal: 0 interpolates it, more is the minimal rotation within a
    /// tolerance that the paper suggests against ripples.
    pub tolerance: f64,
    /// Turn in equal parts at this many successive levels, the first after two refinements; at least 1.
    pub levels: usize,
}

impl Default for Rotation {
    fn default() -> Self {
        Rotation { threshold: 0.0, tolerance: 0.0, levels: 1 }
    }
}

/// A refined control mesh with turned rings.
#[derive(Clone, Debug)]
pub struct Rotated {
    /// The original vertices come first, as in every refinement by a primal scheme.
    pub surface: Surface,
    /// How many refinements lie between the control mesh and this one: `levels` + 1.
    pub refinements: usize,
    /// The vertices whose rings were turned, with the whole angle of each.
    pub turned: Vec<(u32, f64)>,
}

/// The largest angle to a given normal that has a definite axis of rotation: beyond, the normal is opposite.
const OPPOSITE: f64 = PI - 1e-6;

/// Checks one optional normal a vertex and makes it a unit vector.
///
/// # Errors
/// A normal of length zero or with a coordinate that is not finite, with its vertex.
pub fn unit_normals(normals: &[Option<DVec3>]) -> Result<Vec<Option<DVec3>>> {
    let unit = |(v, normal): (usize, &Option<DVec3>)| match *normal {
        None => Ok(None),
        Some(n) => direction(n).map(Some).ok_or_else(|| {
            let [x, y, z] = n.to_array().map(short);
            let what =
                format!("vertex {v}: ({x}, {y}, {z}) has no direction: give a finite vector other than zero, or none");
            Error::mesh("normals", what)
        }),
    };
    normals.iter().enumerate().map(unit).collect()
}

/// Refines `control` until the rings of its vertices are disjoint and turns those whose normal is off. `normals`
/// gives one normal a vertex of `control`, any length, or none. Time and memory are those of the refinements.
///
/// # Errors
/// A given normal without direction; one opposite to the surface's, where the axis of the turn is not defined; a
/// vertex where the surface has no normal, or that is not smooth; what the scheme refuses. All name the vertex.
///
/// # Panics
/// If the scheme is not [primal](Class::Primal), `normals` has not one entry a vertex, or
/// `rotation.levels` is 0.
pub fn rotate_rings(
    control: &Surface,
    scheme: Refinement,
    normals: &[Option<DVec3>],
    rotation: Rotation,
) -> Result<Rotated> {
    assert_eq!(scheme.class(), Class::Primal, "a refinement that keeps its vertices and moves them");
    assert_eq!(normals.len(), control.len(), "one entry a vertex");
    assert!(rotation.levels > 0, "at least one level");
    let wanted = unit_normals(normals)?;
    Constraints { normals: Some(normals), ..Constraints::default() }.check_smooth(control)?;
    scheme.check_size(control, rotation.levels + 1)?;
    let mut surface = scheme.refined(control)?;
    let mut turned: Vec<(u32, f64)> = Vec::new();
    for level in 0..rotation.levels {
        surface = scheme.refined(&surface)?;
        let limits = scheme.limit_positions(&surface)?;
        let found = scheme.limit_normals(&surface)?;
        if level == 0 {
            turned = deviating(&wanted, &found, &rotation)?;
        }
        let part = 1.0 / (rotation.levels - level) as f64;
        for &(v, _) in &turned {
            let v = v as usize;
            let (Some(target), from) = (wanted[v], found[v]) else {
                continue;
            };
            let Some(axis) = from.cross(target).try_normalize() else {
                continue;
            };
            let turn = part * (angle(from, target) - rotation.tolerance);
            rotate_ring(&mut surface, v, limits[v], DQuat::from_axis_angle(axis, turn));
        }
    }
    Ok(Rotated { surface, refinements: rotation.levels + 1, turned })
}

/// The vertices whose normal is off by more than allowed, with the angle to turn.
fn deviating(wanted: &[Option<DVec3>], found: &[DVec3], rotation: &Rotation) -> Result<Vec<(u32, f64)>> {
    let mut turned = Vec::new();
    for (v, target) in wanted.iter().enumerate() {
        let Some(target) = *target else { continue };
        if found[v] == DVec3::ZERO {
            return Err(Error::mesh(
                "normals",
                format!(
                    "vertex {v}: the surface has no normal there (its ring lies in a line or a point): give none, or move its neighbours"
                ),
            ));
        }
        let off = angle(found[v], target);
        if off > OPPOSITE {
            return Err(Error::mesh(
                "normals",
                format!("vertex {v}: the given normal is opposite to the surface's: turn it round, or all faces"),
            ));
        }
        if off > rotation.threshold.max(rotation.tolerance) {
            turned.push((v as u32, off - rotation.tolerance));
        }
    }
    Ok(turned)
}

/// Turns `v` and all vertices of its faces about `center`.
fn rotate_ring(surface: &mut Surface, v: usize, center: DVec3, by: DQuat) {
    let (faces, incidence) = (surface.faces(), surface.incidence());
    let mut ring = vec![v as u32];
    for &c in incidence.corners_at(v) {
        let face = faces.face(incidence.face_of(c));
        let place = face.iter().position(|&w| w as usize == v);
        // All but the corner itself and the one before it, which the neighbouring face brings.
        ring.extend((1..face.len() - 1).map(|step| face[(place.unwrap_or(0) + step) % face.len()]));
    }
    let points = surface.positions_mut();
    for w in ring {
        let point = &mut points[w as usize];
        *point = center + by * (*point - center);
    }
}
