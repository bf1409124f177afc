//! The refinements: each is a [`RefinementRules`] in a file of its own, and this is the list.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use super::{butterfly, catmull_clark, doo_sabin, labsik_greiner, loop_scheme, mid_edge, sqrt3};
use crate::memory::require;
use crate::mesh::features::Features;
use crate::mesh::{Mesh, Surface, Topology};
use crate::names;
use crate::{Error, Result};

/// What a refinement does with the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Vertices stay, under their numbers, and move.
    Primal,
    /// Vertices become faces.
    Dual,
    /// Vertices stay where they are.
    Interpolatory,
}

/// How large a mesh is. Edges are counted as on a closed one: half of those on a boundary are missing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub(super) vertices: u64,
    pub(super) faces: u64,
    pub(super) corners: u64,
    /// Whether there are sharp edges or vertices.
    pub(super) has_features: bool,
}

impl Size {
    pub(super) fn edges(&self) -> u64 {
        self.corners / 2
    }

    /// After the split of every triangle in four.
    pub(super) fn in_four(self) -> Self {
        let (vertices, faces, corners) = (self.vertices + self.edges(), 4 * self.faces, 4 * self.corners);
        Size { vertices, faces, corners, ..self }
    }

    /// After the split of every triangle in three.
    pub(super) fn in_three(self) -> Self {
        let (vertices, faces, corners) = (self.vertices + self.faces, 3 * self.faces, 3 * self.corners);
        Size { vertices, faces, corners, ..self }
    }

    /// After a step that makes a vertex of every corner, and a face of every face, edge and vertex.
    pub(super) fn dual(self) -> Self {
        let faces = self.faces + self.edges() + self.vertices;
        Size { vertices: self.corners, faces, corners: 4 * self.corners, ..self }
    }
}

/// What is sharp on the refined mesh of a surface, with its topology; `None` if nothing is.
type RefinedFeatures = fn(&Surface, &Mesh, &Topology) -> Result<Option<Features>>;

/// All that defines a refinement.
pub(super) struct RefinementRules {
    pub(super) name: &'static str,
    pub(super) class: Class,
    pub(super) needs_triangles: bool,
    /// Refuses what has no rules, before any work.
    pub(super) check: fn(&Surface) -> Result<()>,
    pub(super) refine: fn(&Surface) -> Result<Mesh>,
    /// Of a mesh and what `refine` made of it.
    pub(super) refined_topology: fn(&Surface, &Mesh) -> Topology,
    pub(super) refined_features: RefinedFeatures,
    pub(super) size: fn(Size) -> Size,
    pub(super) limit_positions: fn(&Surface) -> Result<Vec<DVec3>>,
    pub(super) limit_normals: fn(&Surface) -> Result<Vec<DVec3>>,
}

/// A stationary refinement that needs nothing but the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refinement {
    /// Catmull & Clark 1978, on polygons of any size; quads after a step.
    CatmullClark,
    /// Loop 1987, on triangles, with Loop's own weights at extraordinary vertices.
    Loop,
    /// Doo & Sabin 1978, on polygons of any size.
    DooSabin,
    /// √3, Kobbelt 2000, on triangles.
    Sqrt3,
    /// Modified Butterfly, Zorin, Schröder & Sweldens 1996, on triangles.
    Butterfly,
    /// Interpolatory √3, Labsik & Greiner 2000, on triangles.
    LabsikGreiner,
    /// Mid-edge, Peters & Reif 1997, on polygons of any size. With sharp edges a step is two at once.
    MidEdge,
}

impl Refinement {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Refinement; 7] = [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::DooSabin,
        Refinement::Sqrt3,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
        Refinement::MidEdge,
    ];

    fn rules(self) -> &'static RefinementRules {
        match self {
            Refinement::CatmullClark => &catmull_clark::RULES,
            Refinement::Loop => &loop_scheme::RULES,
            Refinement::DooSabin => &doo_sabin::RULES,
            Refinement::Sqrt3 => &sqrt3::RULES,
            Refinement::Butterfly => &butterfly::RULES,
            Refinement::LabsikGreiner => &labsik_greiner::RULES,
            Refinement::MidEdge => &mid_edge::RULES,
        }
    }

    /// The name on the command line, which `parse` reads back.
    pub fn name(self) -> &'static str {
        self.rules().name
    }

    /// What becomes of the vertices.
    pub fn class(self) -> Class {
        self.rules().class
    }

    /// Whether the refinement is defined on triangles only.
    pub fn needs_triangles(self) -> bool {
        self.rules().needs_triangles
    }

    /// Refuses, before any work, what a [step](Self::refine) refuses but for its size.
    ///
    /// # Errors
    /// As [`refine`](Self::refine), but for [`Error::TooLarge`].
    pub fn check(self, surface: &Surface) -> Result<()> {
        (self.rules().check)(surface)
    }

    /// One step: positions and faces. The scheme's own `refine` says how the result is numbered.
    ///
    /// # Errors
    /// [`Error::Open`] if the mesh has a boundary that is treated as interior; [`Error::NotOffered`] if it has sharp edges or
    /// [`Error::Open`] if the mesh has a boundary that is treated as interior; [`Error::Dart`] but under Catmull-Clark, Loop and
    /// Butterfly, [`Error::SemiSharp`] but under the first two; [`Error::NotTriangles`] where the scheme needs these;
    /// [`Error::TooLarge`].
    pub fn refine(self, surface: &Surface) -> Result<Mesh> {
        (self.rules().refine)(surface)
    }

    /// One step, with its topology: equal to [`Topology::new`] of its faces, at a fraction of the cost, as index
    /// arithmetic on the coarse one gives it; under Doo-Sabin and mid-edge of a mesh with sharp edges it is found from the faces. The
    /// refinement of a valid mesh is valid.
    ///
    /// Rules of vertices stay under primal and interpolatory schemes; the parts of a sharp edge are sharp, and the vertices
    /// between them are crease vertices. Of what is semi-sharp, 1 less is left.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    ///
    /// ```
    /// use limitlab::mesh::{Surface, Topology, builtin};
    /// use limitlab::schemes::Refinement;
    /// let cube = Surface::new(builtin::builtin("cube")?)?;
    /// let refined = Refinement::CatmullClark.refined(&cube)?;
    /// assert_eq!((refined.len(), refined.faces().len()), (8 + 12 + 6, 24));
    /// assert_eq!(*refined.topology(), Topology::new(refined.faces(), refined.len()));
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn refined(self, surface: &Surface) -> Result<Surface> {
        let refined = self.refine(surface)?;
        self.refined_surface(surface, refined)
    }

    /// `refined`, which is what a step made of the surface, or has the same faces.
    pub(crate) fn refined_surface(self, surface: &Surface, refined: Mesh) -> Result<Surface> {
        let topology = (self.rules().refined_topology)(surface, &refined);
        Ok(match surface.features() {
            Some(_) => {
                let features = (self.rules().refined_features)(surface, &refined, &topology)?;
                Surface::of_parts(refined, topology, surface.boundary(), features)
            }
            None => Surface::of_topology(refined, topology),
        })
    }

    /// Refuses, before the work, `levels` steps whose meshes have more corners than 32-bit indices name, or for which
    /// memory has no room. O(levels).
    ///
    /// # Errors
    /// [`Error::TooLarge`] or [`Error::Memory`] with the numbers of faces and vertices.
    pub fn check_size(self, surface: &Surface, levels: usize) -> Result<()> {
        let mesh = surface.mesh();
        let count = |n: usize| n as u64;
        let mut size = Size {
            vertices: count(mesh.len()),
            faces: count(mesh.faces.len()),
            corners: count(mesh.faces.corners().len()),
            has_features: surface.features().is_some(),
        };
        let mut bytes = 0u64;
        for _ in 0..levels {
            // Before a step the coarse mesh and its topology are there, after it the fine mesh.
            let coarse = 24 * size.vertices + 24 * size.corners;
            size = (self.rules().size)(size);
            bytes = coarse + 24 * size.vertices + 4 * size.faces + 4 * size.corners;
            if size.corners > u64::from(u32::MAX) {
                break;
            }
        }
        let Size { vertices, faces, corners, .. } = size;
        let what = || format!("the surface after {levels} refinements with {faces} faces and {vertices} vertices");
        if corners > u64::from(u32::MAX) {
            return Err(Error::TooLarge {
                what: format!("a surface after {levels} refinements has {faces} faces or more"),
                advice: "refine fewer levels",
            });
        }
        require(bytes, what, "refine fewer levels")?;
        Ok(())
    }

    /// `levels` steps; none gives a copy. The topology of each level comes from that of the level before.
    ///
    /// # Errors
    /// As [`check_size`](Self::check_size) and [`refine`](Self::refine).
    pub fn refine_n(self, surface: &Surface, levels: usize) -> Result<Mesh> {
        self.check_size(surface, levels)?;
        let Some(last) = levels.checked_sub(1) else {
            return Ok(surface.mesh().clone());
        };
        let mut coarse = None;
        for _ in 0..last {
            coarse = Some(self.refined(coarse.as_ref().unwrap_or(surface))?);
        }
        self.refine(coarse.as_ref().unwrap_or(surface))
    }

    /// As [`refine_n`](Self::refine_n), with the topology of the last level.
    ///
    /// # Errors
    /// As [`refine_n`](Self::refine_n).
    pub fn refined_n(self, surface: &Surface, levels: usize) -> Result<Surface> {
        self.check_size(surface, levels)?;
        (0..levels).try_fold(surface.clone(), |coarse, _| self.refined(&coarse))
    }

    /// The limit points of all vertices; under dual refinements the centroids of the faces that they become, under the
    /// interpolatory ones the vertices themselves. On curves of sharp edges (a + 4v + b)/6, and under dual ones (a + 6v + b)/8;
    /// corners rest.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    pub fn limit_positions(self, surface: &Surface) -> Result<Vec<DVec3>> {
        (self.rules().limit_positions)(surface)
    }

    /// The unit normals of the limit surface at the [`limit_positions`](Self::limit_positions); zero where
    /// [`Tangents::normal`](super::Tangents::normal) is, and where the surface has several or they are not computed: on
    /// creases, at darts, at corners but for those with one face, on a boundary beside four faces or more under Catmull-Clark,
    /// six under Loop and √3; at all sharp vertices under the interpolatory ones; under dual ones on creases, and at corners but
    /// for those on a boundary with two sharp edges.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    pub fn limit_normals(self, surface: &Surface) -> Result<Vec<DVec3>> {
        (self.rules().limit_normals)(surface)
    }
}

impl fmt::Display for Refinement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Refinement {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        names::find("refinement", name, &Refinement::ALL.map(|refinement| (refinement.name(), refinement)), &[])
    }
}
