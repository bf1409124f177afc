//! The mid-edge scheme (Peters & Reif 1997, "the simplest subdivision scheme for smoothing polyhedra") on any
//! polygon mesh: the new vertices are the midpoints of the edges, and there is a new face in every old face, and one about
//! every old vertex.
//!
//! The face about a vertex v of valence n has the corners (v + v_j)/2, and each further step joins the midpoints of its
//! sides: its centroid ½v + ½ mean v_j stays, and the first harmonic of its corners shrinks by cos(π/n).
//!
//! A step makes of n edges round a curve n again, so that sharp edges have no rule for one alone. Two steps are one of
//! Doo-Sabin's kind, with ½v + ¼(u + w) in the corner of a face between u and w, and twice as many points on curves: Chaikin's.
//! On open and creased meshes a step is two at once.

use glam::DVec3;

use super::doo_sabin::{CornerRule, refine_by};
use super::refined::{self, Of, set_rows};
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::scheme::{Definition, PaperNames, QUADRATIC, SingularSet};
use super::star::{Tangents, blend_with_neighbors, require_curves, require_room, ring_tangents, stars, twin};
use super::{chaikin, doo_sabin};
use crate::Result;
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// h(n) = 1/(2n), d(n) = n, w = 1: A = ½(I + D⁻¹Adj) with the adjacency matrix of the edges and their numbers D.
///
/// `xᵀMx = Σ_i n_i x_i² + 2 Σ_ij x_i x_j = Σ_ij (x_i + x_j)²` over the edges, so λ_min(A) ≥ 0, and A is singular exactly
/// where x_j = −x_i along every edge of a component is possible: on bipartite ones, of any valence. (Every closed mesh of
/// quads without a handle is one.) On a curve, where a quad mesh is continued by reflection, 2b − v, the row ½v + ⅛Σv_j becomes
/// that of quadratic B-splines, ⅛(a + 6v + b). On meshes of triangles λ_min(A) is 0.25 to 0.27, on irregular polygons 0.038 to 0.045
/// (`spectrum` on tori, spheres, irregular meshes of 500 to 20 000 vertices and two models).
pub(super) const DEFINITION: Definition = Definition {
    name: "mid-edge",
    paper_names: PaperNames::OURS,
    h: |n| 0.5 / n as f64,
    vertex_weight: |n| n as f64,
    edge_weight: 1.0,
    circulant: None,
    needs_triangles: false,
    lambda_min_at: |_, _| 0.0,
    usual_lambda_min: 0.24,
    singular: SingularSet::Bipartite { valence: None },
    // ½ + ¼(cos θ + cos φ).
    regular_symbol: (0.0, 0.5),
    refinement: Refinement::MidEdge,
    first_rule: None,
    curve_weight: QUADRATIC,
    star_rule: None,
};

const NAME: &str = "mid-edge";

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: NAME,
    class: Class::Dual,
    needs_triangles: false,
    check: |surface| require_curves(surface, NAME),
    refine,
    refined_topology,
    refined_features: chaikin::refined_features,
    size: |c| match c.has_features {
        true => c.dual(),
        false => Size { vertices: c.edges(), faces: c.faces + c.vertices, corners: 2 * c.corners, ..c },
    },
    limit_positions,
    limit_normals,
};

/// One step.
///
/// Vertices: the midpoints of the edges, by their first half-edges. Faces: those of the old faces, whose corner c lies on
/// the edge of the old corner c, then those of the old vertices, counter-clockwise.
///
/// Of an open or creased mesh two steps at once: [`refine_by`] with [`CornerRule::MidEdge`].
///
/// # Errors
/// As [`refine_by`].
///
/// ```
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::mid_edge;
/// let cube = Surface::new(builtin::builtin("cube")?)?;
/// let cuboctahedron = mid_edge::refine(&cube)?;
/// assert_eq!((cuboctahedron.len(), cuboctahedron.faces.len()), (12, 6 + 8));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn refine(surface: &Surface) -> Result<Mesh> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_curves(surface, NAME)?;
    if surface.features().is_some() {
        return refine_by(CornerRule::MidEdge, surface);
    }
    require_room(mesh, 2)?;
    let edges = topology.edge_numbers();
    let positions = refined::points(surface, &edges, &[Of::Edges], &|surface, edges| {
        let (topology, old) = (surface.topology(), surface.faces().corners());
        let mut positions = large(Vec::with_capacity(topology.edges()));
        edges.extend(&mut positions, |c| {
            let [v, w] = [c, twin(topology, c)].map(|c| surface.positions()[old[c as usize] as usize]);
            0.5 * v + 0.5 * w
        });
        positions
    });
    let count = mesh.faces.corners().len();
    let mut corners = large(vec![0; 2 * count]);
    let (of_faces, of_vertices) = corners.split_at_mut(count);
    let stars = stars(surface);
    set_rows(of_faces, |c| [edges.of(c)]);
    set_rows(of_vertices, |p| [edges.of(stars[p as usize])]);
    let mut offsets = large(Vec::with_capacity(mesh.faces.len() + mesh.len() + 1));
    offsets.push(0);
    parallel::extend(&mut offsets, mesh.faces.len(), |_| |f| mesh.faces.range(f).end as u32);
    let ends = &topology.incidence.offsets()[1..];
    parallel::extend(&mut offsets, ends.len(), |_| |v| count as u32 + ends[v]);
    Ok(Mesh::new(positions, Faces::from_parts(offsets, corners)))
}

/// The topology of `refined`, which is what [`refine`] made of the surface.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    match surface.features() {
        None => refined::of_midpoints(surface, refined),
        Some(_) => doo_sabin::refined_topology(surface, refined),
    }
}

/// The limit mask of a vertex of valence `n`: ½ at the vertex, 1/(2n) at each neighbour.
pub fn limit_mask(n: usize) -> [f64; 2] {
    [0.5, 0.5 / n as f64]
}

/// The limit points of all vertices: the centroids of their faces after a step, which all further ones keep; on curves
/// (a + 6v + b)/8 with the neighbours a and b along the curve; corners rest.
///
/// # Errors
/// As [`refine`], but for the size.
pub fn limit_positions(surface: &Surface) -> Result<Vec<DVec3>> {
    require_curves(surface, NAME)?;
    match surface.features() {
        None => Ok(blend_with_neighbors(surface, limit_mask)),
        Some(_) => doo_sabin::limit_positions(CornerRule::MidEdge, surface),
    }
}

/// The unit normals of the limit surface at the [`limit_positions`]; zero where [`Tangents::normal`] is, and at sharp vertices
/// as under [Doo-Sabin](doo_sabin::limit_normals). cos(2πj/n) and
/// sin(2πj/n) on the neighbours are the left eigenvectors of a step of their face, for the pair cos(π/n)e^{±iπ/n}.
///
/// At valence 3 its square ¼ is an eigenvalue of the surroundings too: they approach the tangent plane like 1/m with the
/// number m of steps, and the face itself lies in it.
///
/// # Errors
/// As [`limit_positions`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    require_curves(surface, NAME)?;
    match surface.features() {
        None => Ok(ring_tangents(surface).iter().map(Tangents::normal).collect()),
        Some(_) => doo_sabin::limit_normals(CornerRule::MidEdge, surface),
    }
}
