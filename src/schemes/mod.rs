//! Subdivision schemes, one file each: the refinement step, limit and tangent masks of one vertex star, and for the
//! schemes of the form A = H·M the [definition](Scheme) from which the assembler makes rows. The two are written down
//! independently of each other, and tests hold one against the other. This room knows nothing of global systems.
//!
//! | file | scheme | faces | keeps its vertices |
//! |---|---|---|---|
//! | [`catmull_clark`] | Catmull & Clark 1978 | any polygons, quads after a step | no |
//! | [`loop_scheme`] | Loop 1987 | triangles | no |
//! | [`doo_sabin`] | Doo & Sabin 1978, and the first step of Zheng & Cai 2005; systems of Nasri and of Zheng & Cai | any polygons | no |
//! | [`sqrt3`] | Kobbelt 2000 | triangles | no |
//! | [`mid_edge`] | Peters & Reif 1997 | any polygons | no |
//! | [`unified_sqrt3`] | Lin & Luo, α per vertex | triangles | where α = 1 |
//! | [`blend`] | the same blend of any scheme above that keeps the numbers of its vertices | as of the scheme | where α = 1 |
//! | [`butterfly`] | modified Butterfly, Zorin, Schröder & Sweldens 1996 | triangles | yes |
//! | [`kobbelt`] | interpolatory quads, Kobbelt 1996 | quads, closed | yes |
//! | [`labsik_greiner`] | interpolatory √3, Labsik & Greiner 2000 | triangles | yes |
//!
//! All but [`kobbelt`] take open and creased meshes too: edges with one face and tagged ones are [sharp](crate::mesh::features), their curves
//! cubic B-splines, quadratic ones under the dual schemes, or interpolated by cubics. All refuse a boundary that is treated as
//! interior with an
//! [`Error::Open`](crate::Error::Open). A step takes time and memory
//! proportional to the mesh, with flat arrays only, in parallel: every new point is gathered from the old ones, with
//! the same result for any number of threads; new faces, and their topology, come from index arithmetic on half-edges.
//!
//! ```
//! use limitlab::mesh::{Faces, Mesh, Surface};
//! use limitlab::schemes::Refinement;
//! let points = [[1., 1., 1.], [-1., -1., 1.], [-1., 1., -1.], [1., -1., -1.]];
//! let faces = Faces::from_lists([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
//! let tetrahedron = Surface::new(Mesh::new(points.map(Into::into).to_vec(), faces))?;
//! let scheme: Refinement = "loop".parse()?;
//! let refined = scheme.refine_n(&tetrahedron, 2)?;
//! assert_eq!((refined.len(), refined.faces.len()), (34, 64));
//! # Ok::<(), limitlab::Error>(())
//! ```

pub mod blend;
pub mod butterfly;
pub mod catmull_clark;
mod chaikin;
pub mod doo_sabin;
mod interpolatory;
pub mod kobbelt;
pub mod labsik_greiner;
pub(crate) mod local_limit;
pub mod loop_scheme;
pub mod mid_edge;
mod nasri;
mod refined;
mod refinement;
mod ring;
mod scheme;
mod sharp;
pub mod sqrt3;
pub(crate) mod star;
pub(crate) mod thirds;
pub mod unified_sqrt3;
mod zheng_cai;

pub use refinement::{Class, Refinement};
pub use scheme::{Masks, PaperNames, Scheme, SingularSet};
pub use star::Tangents;
