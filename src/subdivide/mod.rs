//! Subdivision schemes, one file each: the refinement step, and where there are any the limit and tangent masks
//! of one vertex star. This room knows nothing of global systems: it is what their rows are held against.
//!
//! | file | scheme | faces | keeps its vertices |
//! |---|---|---|---|
//! | [`catmull_clark`] | Catmull & Clark 1978 | any polygons, quads after a step | no |
//! | [`loop_scheme`] | Loop 1987 | triangles | no |
//! | [`doo_sabin`] | Doo & Sabin 1978, and the first step of Zheng & Cai 2005 | any polygons | no |
//! | [`sqrt3`] | Kobbelt 2000 | triangles | no |
//! | [`unified_sqrt3`] | Lin & Luo, α per vertex | triangles | where α = 1 |
//! | [`butterfly`] | modified Butterfly, Zorin, Schröder & Sweldens 1996 | triangles | yes |
//! | [`labsik_greiner`] | interpolatory √3, Labsik & Greiner 2000 | triangles | yes |
//!
//! Meshes are closed: an open one is refused with an [`Error::Mesh`]. A step takes time and memory
//! proportional to the mesh, with flat arrays only, in parallel: every new point is gathered from the old ones, with
//! the same result for any number of threads; new faces, and their topology, come from index arithmetic on half-edges.
//!
//! ```
//! use limitlab::mesh::{Faces, Mesh};
//! use limitlab::subdivide::Refinement;
//! let points = [[1., 1., 1.], [-1., -1., 1.], [-1., 1., -1.], [1., -1., -1.]];
//! let faces = Faces::from_lists([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
//! let tetrahedron = Mesh::new(points.map(Into::into).to_vec(), faces);
//! let scheme: Refinement = "loop".parse()?;
//! let refined = scheme.refine_n(&tetrahedron, 2)?;
//! assert_eq!((refined.len(), refined.faces.len()), (34, 64));
//! # Ok::<(), limitlab::Error>(())
//! ```

pub mod butterfly;
pub mod catmull_clark;
pub mod doo_sabin;
mod interpolatory;
pub mod labsik_greiner;
pub mod loop_scheme;
mod refined;
mod ring;
pub mod sqrt3;
mod star;
pub mod unified_sqrt3;

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use crate::memory::require;
use crate::mesh::{Mesh, Topology};
use crate::{Error, Result};

pub use star::Tangents;

/// A stationary refinement that needs nothing but the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refinement {
    CatmullClark,
    Loop,
    DooSabin,
    Sqrt3,
    Butterfly,
    LabsikGreiner,
}

impl Refinement {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Refinement; 6] = [
        Refinement::CatmullClark,
        Refinement::Loop,
        Refinement::DooSabin,
        Refinement::Sqrt3,
        Refinement::Butterfly,
        Refinement::LabsikGreiner,
    ];

    /// The name on the command line, which `parse` reads back.
    pub fn name(self) -> &'static str {
        match self {
            Refinement::CatmullClark => "catmull-clark",
            Refinement::Loop => "loop",
            Refinement::DooSabin => "doo-sabin",
            Refinement::Sqrt3 => "sqrt3",
            Refinement::Butterfly => "butterfly",
            Refinement::LabsikGreiner => "labsik-greiner",
        }
    }

    /// One step. The scheme's own `refine` says how the result is numbered and what it refuses.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a mesh that is not a closed manifold or, where the scheme needs triangles, has
    /// another face.
    ///
    /// # Panics
    /// If `topology` is not that of `mesh`.
    pub fn refine(self, mesh: &Mesh, topology: &Topology) -> Result<Mesh> {
        match self {
            Refinement::CatmullClark => catmull_clark::refine(mesh, topology),
            Refinement::Loop => loop_scheme::refine(mesh, topology),
            Refinement::DooSabin => doo_sabin::refine(mesh, topology),
            Refinement::Sqrt3 => sqrt3::refine(mesh, topology),
            Refinement::Butterfly => butterfly::refine(mesh, topology),
            Refinement::LabsikGreiner => labsik_greiner::refine(mesh, topology),
        }
    }

    /// The topology of `refined`, which is what [`refine`](Self::refine) made of `mesh`. Equal to [`Topology::new`] of
    /// its faces, at a fraction of the cost: index arithmetic on the coarse topology gives it.
    ///
    /// # Panics
    /// If the three do not belong together.
    ///
    /// ```
    /// use limitlab::mesh::{Topology, builtin};
    /// use limitlab::subdivide::Refinement;
    /// let mesh = builtin::builtin("cube")?;
    /// let topology = Topology::new(&mesh.faces, mesh.len());
    /// let refined = Refinement::CatmullClark.refine(&mesh, &topology)?;
    /// let finer = Refinement::CatmullClark.refined_topology(&mesh, &topology, &refined);
    /// assert_eq!(finer, Topology::new(&refined.faces, refined.len()));
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn refined_topology(self, mesh: &Mesh, topology: &Topology, refined: &Mesh) -> Topology {
        match self {
            Refinement::CatmullClark => catmull_clark::refined_topology(mesh, topology, refined),
            Refinement::Loop | Refinement::Butterfly => loop_scheme::refined_topology(topology, refined),
            Refinement::DooSabin => doo_sabin::refined_topology(mesh, topology, refined),
            Refinement::Sqrt3 | Refinement::LabsikGreiner => sqrt3::refined_topology(mesh, topology, refined),
        }
    }

    /// Refuses, before the work, `levels` steps whose meshes have more corners than 32-bit indices name, or for which
    /// memory has no room. O(levels).
    ///
    /// # Errors
    /// [`Error::Computation`] or [`Error::Memory`] with the numbers of faces and vertices.
    pub fn check_size(self, mesh: &Mesh, levels: usize) -> Result<()> {
        let count = |n: usize| n as u64;
        let (mut vertices, mut faces, mut corners) =
            (count(mesh.len()), count(mesh.faces.len()), count(mesh.faces.corners().len()));
        let mut bytes = 0u64;
        for _ in 0..levels {
            let edges = corners / 2;
            // Before a step the coarse mesh and its topology are there, after it the fine mesh.
            let coarse = 24 * vertices + 24 * corners;
            (vertices, faces, corners) = match self {
                Refinement::CatmullClark => (vertices + edges + faces, corners, 4 * corners),
                Refinement::Loop | Refinement::Butterfly => (vertices + edges, 4 * faces, 4 * corners),
                Refinement::DooSabin => (corners, faces + edges + vertices, 4 * corners),
                Refinement::Sqrt3 | Refinement::LabsikGreiner => (vertices + faces, 3 * faces, 3 * corners),
            };
            bytes = coarse + 24 * vertices + 4 * faces + 4 * corners;
            if corners > u64::from(u32::MAX) {
                break;
            }
        }
        let what = || format!("the surface after {levels} refinements with {faces} faces and {vertices} vertices");
        if corners > u64::from(u32::MAX) {
            return Err(Error::Computation(format!(
                "a surface after {levels} refinements has {faces} faces or more, which 32-bit indices do not reach: \
                 refine fewer levels"
            )));
        }
        require(bytes, what, "refine fewer levels")?;
        Ok(())
    }

    /// `levels` steps; none gives a copy. The topology of each level comes from that of the level before.
    ///
    /// # Errors
    /// As [`check_size`](Self::check_size) and [`refine`](Self::refine).
    ///
    /// # Panics
    /// If a face names a vertex that is not there (the validator reports such faces before).
    pub fn refine_n(self, mesh: &Mesh, levels: usize) -> Result<Mesh> {
        self.check_size(mesh, levels)?;
        let mut topology = Topology::new(&mesh.faces, mesh.len());
        let mut coarse = None;
        for level in 1..=levels {
            let mesh = coarse.as_ref().unwrap_or(mesh);
            let refined = self.refine(mesh, &topology)?;
            if level < levels {
                topology = self.refined_topology(mesh, &topology, &refined);
            }
            coarse = Some(refined);
        }
        Ok(coarse.unwrap_or_else(|| mesh.clone()))
    }

    /// The limit points of all vertices; under Doo-Sabin the centroids of their type-V faces, under the
    /// interpolatory schemes the vertices themselves.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    ///
    /// # Panics
    /// If `topology` is not that of `mesh`.
    pub fn limit_positions(self, mesh: &Mesh, topology: &Topology) -> Result<Vec<DVec3>> {
        match self {
            Refinement::CatmullClark => catmull_clark::limit_positions(mesh, topology),
            Refinement::Loop => loop_scheme::limit_positions(mesh, topology),
            Refinement::DooSabin => doo_sabin::limit_positions(doo_sabin::Rule::DooSabin, mesh, topology),
            Refinement::Sqrt3 => sqrt3::limit_positions(mesh, topology),
            Refinement::Butterfly | Refinement::LabsikGreiner => {
                star::require_triangles(mesh, topology, self.name())?;
                Ok(mesh.positions.clone())
            }
        }
    }

    /// The unit normals of the limit surface at the [`limit_positions`](Self::limit_positions); zero where
    /// [`Tangents::normal`] is.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    ///
    /// # Panics
    /// If `topology` is not that of `mesh`.
    pub fn limit_normals(self, mesh: &Mesh, topology: &Topology) -> Result<Vec<DVec3>> {
        match self {
            Refinement::CatmullClark => catmull_clark::limit_normals(mesh, topology),
            Refinement::Loop => loop_scheme::limit_normals(mesh, topology),
            Refinement::DooSabin => doo_sabin::limit_normals(doo_sabin::Rule::DooSabin, mesh, topology),
            Refinement::Sqrt3 => sqrt3::limit_normals(mesh, topology),
            Refinement::Butterfly => butterfly::limit_normals(mesh, topology),
            Refinement::LabsikGreiner => labsik_greiner::limit_normals(mesh, topology),
        }
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
        let found = Refinement::ALL.into_iter().find(|r| r.name() == name);
        found.ok_or_else(|| {
            let known = Refinement::ALL.map(Refinement::name).join(", ");
            Error::Unknown(format!("unknown refinement {name:?}: choose one of {known}"))
        })
    }
}
