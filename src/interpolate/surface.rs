//! From a control mesh to the surface that is looked at: refinement by the scheme's own rules, given normals and
//! shape handles, limit points, surface normals.

use glam::DVec3;

use super::normals::{Rotation, rotate_rings};
use super::zheng_cai::{Constraints, FirstRefinement};
use crate::mesh::{Mesh, Topology};
use crate::schemes::doo_sabin::{self, Rule};
use crate::schemes::{Class, Refinement, Scheme};
use crate::{Error, Result};

/// What is wanted of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct Request<'a> {
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
pub struct Surface {
    pub mesh: Mesh,
    /// One a vertex if they were wanted; zero where the surface has none.
    pub normals: Option<Vec<DVec3>>,
    /// How many given normals were not met already: rings turned, or faces given another plane.
    pub normals_set: usize,
    /// Interpolated vertices whose type-V face has no average normal ([`FirstRefinement::not_flattened`]).
    pub not_flattened: Vec<u32>,
}

/// Makes the surface of a control mesh found for `scheme`. `points` are the given points; `topology` gives that of
/// `control`, where it is needed.
///
/// Catmull-Clark, Loop and √3: original vertices keep their numbers; given normals are met by turned rings
/// ([`rotate_rings`]), which need two levels or more. Nasri and Zheng-Cai: the first level is the scheme's own first
/// refinement, whose type-V faces Zheng-Cai corrects always and Nasri if normals or handles are given; all further
/// ones are Doo-Sabin. Mid-edge: plain refinement. Time and memory are those of the refinements.
///
/// # Errors
/// Too few levels for normals or handles, handles under a primal scheme, either under mid-edge; those of
/// [`rotate_rings`], [`FirstRefinement::new`] and the refinement.
///
/// # Panics
/// If a list has not one entry a vertex, or `topology` gives another than that of `control`.
pub fn surface<'a>(
    control: Mesh,
    topology: impl Fn() -> &'a Topology,
    scheme: Scheme,
    points: &[DVec3],
    request: &Request,
) -> Result<Surface> {
    let given = &request.constraints;
    let rule = scheme.first_rule();
    let mut surface = match rule {
        None => primal(control, scheme.refinement(), request)?,
        Some(_) if request.levels == 0 => {
            if given.normals.is_some() || given.handles.is_some() {
                return Err(too_few("normals and shape handles act on", 1));
            }
            Surface::plain(control)
        }
        Some(rule) => {
            let corrected = rule == Rule::ZhengCai || given.normals.is_some() || given.handles.is_some();
            if corrected {
                let first = FirstRefinement::new(&control, topology(), rule, points, given)?;
                Surface {
                    mesh: first.surface(request.levels)?,
                    normals: None,
                    normals_set: given.normals.map_or(0, |n| n.iter().flatten().count()),
                    not_flattened: first.not_flattened,
                }
            } else {
                Surface::plain(Refinement::DooSabin.refine_n(&control, request.levels)?)
            }
        }
    };
    if request.limit || request.normals {
        let own;
        let at = if request.levels == 0 {
            topology()
        } else {
            own = Topology::new(&surface.mesh.faces, surface.mesh.len());
            &own
        };
        let mesh = &surface.mesh;
        // The first step of a control mesh is by its own rule.
        let rule = match rule {
            Some(rule) if request.levels == 0 => Some(rule),
            Some(_) => Some(Rule::DooSabin),
            None => None,
        };
        let scheme = scheme.refinement();
        if request.normals {
            surface.normals = Some(match rule {
                Some(rule) => doo_sabin::limit_normals(rule, mesh, at)?,
                None => scheme.limit_normals(mesh, at)?,
            });
        }
        if request.limit {
            surface.mesh.positions = match rule {
                Some(rule) => doo_sabin::limit_positions(rule, mesh, at)?,
                None => scheme.limit_positions(mesh, at)?,
            };
        }
    }
    Ok(surface)
}

impl Surface {
    /// A mesh with nothing else to tell.
    pub fn plain(mesh: Mesh) -> Self {
        Surface { mesh, normals: None, normals_set: 0, not_flattened: Vec::new() }
    }
}

fn primal(control: Mesh, scheme: Refinement, request: &Request) -> Result<Surface> {
    let given = &request.constraints;
    if given.handles.is_some() {
        return Err(Error::Computation(format!(
            "shape handles scale the type-V faces of Doo-Sabin surfaces, and {scheme} has none: use --scheme zheng-cai \
             or nasri"
        )));
    }
    let Some(normals) = given.normals else {
        // A control mesh that stays is not copied: it may be as large as memory allows.
        let stays = request.levels == 0;
        return Ok(Surface::plain(if stays { control } else { scheme.refine_n(&control, request.levels)? }));
    };
    if scheme.class() != Class::Primal {
        return Err(Error::Computation(format!(
            "given normals turn the rings of vertices that stay, or tilt the faces of Doo-Sabin surfaces, and {scheme} has \
             neither: use --scheme zheng-cai, nasri or catmull-clark"
        )));
    }
    let needed = request.rotation.levels + 1;
    if request.levels < needed {
        return Err(too_few("given normals turn the rings of", needed));
    }
    let rotated = rotate_rings(&control, scheme, normals, request.rotation)?;
    let further = request.levels - rotated.refinements;
    let mesh = if further == 0 { rotated.mesh } else { scheme.refine_n(&rotated.mesh, further)? };
    Ok(Surface { normals_set: rotated.turned.len(), ..Surface::plain(mesh) })
}

fn too_few(what: &str, levels: usize) -> Error {
    Error::Computation(format!("{what} a refined mesh: use --subdivide {levels} or more"))
}
