//! Evaluation of the surface of a control mesh: refinement by the scheme's own rules, given normals and
//! shape handles, limit points, surface normals.

use glam::DVec3;

use super::limit_points;
use super::normals::{Rotation, rotate_rings};
use super::zheng_cai::{Constraints, FirstRefinement};
use crate::mesh::Surface;
use crate::schemes::doo_sabin::{self, CornerRule};
use crate::schemes::{Class, Refinement, Scheme};
use crate::{Error, Result};

/// What is wanted of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceOptions<'a> {
    /// Refinements of the control mesh.
    pub levels: usize,
    /// Push the vertices of the last level to their limit points.
    pub limit: bool,
    /// Compute the unit normals of the limit surface at them.
    pub normals: bool,
    /// Given normals, shape handles and the interpolated vertices. Handles are for the Doo-Sabin schemes.
    pub constraints: Constraints<'a>,
    /// How given normals are met by the primal schemes.
    pub rotation: Rotation,
}

/// The refined mesh.
#[derive(Clone, Debug)]
pub struct SurfaceMesh {
    /// The mesh after the refinements asked for, its vertices at their limit points if these were wanted.
    pub surface: Surface,
    /// One a vertex if they were wanted; zero where the surface has none.
    pub normals: Option<Vec<DVec3>>,
    /// How many given normals were not met already: rings turned, or faces given another plane.
    pub normals_set: usize,
    /// Interpolated vertices whose type-V face has no average normal ([`FirstRefinement::not_flattened`]).
    pub not_flattened: Vec<u32>,
}

/// Refuses, before a system is solved, what [`surface`] would refuse for its scheme and its faces.
///
/// # Errors
/// Too few levels for normals or handles, handles under a primal scheme, either under mid-edge; a normal or a handle at a vertex
/// that is not smooth; what the refinement has no rules for.
///
/// # Panics
/// If a list has not one entry a vertex.
pub fn check(surface: &Surface, scheme: Scheme, request: &SurfaceOptions) -> Result<()> {
    let given = &request.constraints;
    given.check(surface.len())?;
    given.check_smooth(surface)?;
    let refinement = scheme.refinement();
    match scheme.first_rule() {
        Some(_) if request.levels == 0 && (given.normals.is_some() || given.handles.is_some()) => {
            return Err(too_few("normals and shape handles act on", 1));
        }
        Some(_) => {}
        None if given.handles.is_some() => {
            return Err(Error::NotOffered {
                what: format!("shape handles scale the type-V faces of Doo-Sabin surfaces, and {refinement} has none"),
                schemes: &["zheng-cai", "nasri"],
            });
        }
        None if given.normals.is_some() => {
            if refinement.class() != Class::Primal {
                return Err(Error::NotOffered {
                    what: format!(
                        "given normals turn the rings of vertices that stay, or tilt the faces of Doo-Sabin surfaces, and \
                         {refinement} has neither"
                    ),
                    schemes: &["zheng-cai", "nasri", "catmull-clark"],
                });
            }
            let needed = request.rotation.levels + 1;
            if request.levels < needed {
                return Err(too_few("given normals turn the rings of", needed));
            }
        }
        None => {}
    }
    if request.levels > 0 || request.normals { refinement.check(surface) } else { Ok(()) }
}

/// Makes the surface of a control mesh found for `scheme`. `points` are the given points.
///
/// Catmull-Clark, Loop and √3: original vertices keep their numbers; given normals are met by turned rings
/// ([`rotate_rings`]), which need two levels or more. Nasri and Zheng-Cai: the first level is the scheme's own first
/// refinement, whose type-V faces Zheng-Cai corrects always and Nasri where a normal or a handle other than 1 is given; all further
/// ones are Doo-Sabin. Mid-edge: plain refinement. Time and memory are those of the refinements.
///
/// # Errors
/// Those of [`check`], [`rotate_rings`], [`FirstRefinement::new`] and the refinement.
///
/// # Panics
/// If a list has not one entry a vertex.
pub fn surface(control: Surface, scheme: Scheme, points: &[DVec3], request: &SurfaceOptions) -> Result<SurfaceMesh> {
    check(&control, scheme, request)?;
    let given = &request.constraints;
    let wants_limits = request.limit || request.normals;
    let rule = scheme.first_rule();
    let mut made = match rule {
        None => primal(control, scheme.refinement(), request)?,
        Some(_) if request.levels == 0 => SurfaceMesh::plain(control),
        Some(rule) => {
            let corrected = rule == CornerRule::ZhengCai || given.normals.is_some() || given.handles.is_some();
            if corrected {
                let first = FirstRefinement::new(&control, rule, points, given)?;
                SurfaceMesh {
                    surface: refine(Refinement::DooSabin, first.surface, request.levels - 1, wants_limits)?,
                    normals: None,
                    normals_set: given.normals.map_or(0, |n| n.iter().flatten().count()),
                    not_flattened: first.not_flattened,
                }
            } else {
                SurfaceMesh::plain(refine(Refinement::DooSabin, control, request.levels, wants_limits)?)
            }
        }
    };
    if wants_limits {
        // The first step of a control mesh is by its own rule.
        let rule = match rule {
            Some(rule) if request.levels == 0 => Some(rule),
            Some(_) => Some(CornerRule::DooSabin),
            None => None,
        };
        let (system, scheme) = (scheme, scheme.refinement());
        let fine = &made.surface;
        if request.normals {
            made.normals = Some(match rule {
                Some(rule) => doo_sabin::limit_normals(rule, fine)?,
                None => scheme.limit_normals(fine)?,
            });
        }
        if request.limit {
            let limits = match rule {
                Some(rule) => doo_sabin::limit_positions(rule, fine)?,
                // By the rows of A also where a refinement has no rules for sharp edges.
                None if fine.features().is_some() => limit_points(fine, system)?,
                None => scheme.limit_positions(fine)?,
            };
            made.surface.positions_mut().copy_from_slice(&limits);
        }
    }
    Ok(made)
}

impl SurfaceMesh {
    /// A surface with nothing else to tell.
    pub fn plain(surface: Surface) -> Self {
        SurfaceMesh { surface, normals: None, normals_set: 0, not_flattened: Vec::new() }
    }
}

/// The last topology by index arithmetic if it is needed, or sharp edges are to be carried over.
fn refine(scheme: Refinement, control: Surface, levels: usize, topology: bool) -> Result<Surface> {
    // A control mesh that stays is not copied: it may be as large as memory allows.
    match levels {
        0 => Ok(control),
        _ if topology || control.features().is_some() => scheme.refined_n(&control, levels),
        _ => Ok(Surface::of_valid(scheme.refine_n(&control, levels)?)),
    }
}

fn primal(control: Surface, scheme: Refinement, request: &SurfaceOptions) -> Result<SurfaceMesh> {
    let wants_limits = request.limit || request.normals;
    let Some(normals) = request.constraints.normals else {
        return Ok(SurfaceMesh::plain(refine(scheme, control, request.levels, wants_limits)?));
    };
    let rotated = rotate_rings(&control, scheme, normals, request.rotation)?;
    let further = request.levels - rotated.refinements;
    let surface = refine(scheme, rotated.surface, further, wants_limits)?;
    Ok(SurfaceMesh { normals_set: rotated.turned.len(), ..SurfaceMesh::plain(surface) })
}

fn too_few(what: &'static str, needed: usize) -> Error {
    Error::TooFewLevels { what, needed }
}
