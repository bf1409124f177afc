//! Pictures of meshes without a GPU: surfaces, points and vectors through a z-buffer, as panels of a
//! [`Figure`](super::Figure).
//!
//! A [`Picture`] is plain arrays and a [`View`]. The camera frames what is shown by itself. Everything is drawn
//! at the resolution of the figure's canvas, three times finer than the image, and averaged with it, so that edges
//! and lines are smooth. Bands of rows are drawn in parallel; each pixel depends on the scene alone, so the bytes
//! do not depend on the number of threads.
//!
//! - [`camera`]: views by name or angle, orthographic or perspective, automatic framing;
//! - [`colour`]: perceptually uniform maps, sequential and diverging, and their scales;
//! - `scene`: checks the arrays, cuts polygons into triangles, projects; `raster`: which triangle is seen in a
//!   pixel, hidden lines; `shade`: light and reflection lines; `panel`: caption; `bar`: colour bar.
//!
//! ```
//! use limitlab::mesh::builtin::builtin;
//! use limitlab_experiments::report::{Figure, Picture, ShadedMesh, View};
//!
//! let mesh = builtin("torus:16x8")?;
//! let picture = Picture::new("a torus", View::named("oblique")?).surface(ShadedMesh::flat(mesh).edges(0.4));
//! let image = Figure::row([picture]).render()?;
//! assert_eq!((image.width, image.height), (900, 960));
//! # Ok::<(), limitlab::Error>(())
//! ```

pub(super) mod bar;
pub mod camera;
pub mod colour;
mod panel;
mod raster;
mod scene;
mod shade;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::canvas::Colour;
pub use camera::{Projection, View};
pub use colour::{ColourMap, ColourScale};
use limitlab::mesh::Mesh;

/// How normals come about.
#[derive(Clone, Debug, PartialEq)]
pub enum Shading {
    /// One normal a face: its area vector.
    Flat,
    /// One normal a vertex, the sum of the area vectors around it, interpolated across faces.
    Smooth,
    /// One given normal a vertex, interpolated across faces; where it is zero, that of the face.
    Normals(Vec<DVec3>),
}

/// What a surface is painted with.
#[derive(Clone, Debug, PartialEq)]
pub enum Paint {
    Colour(Colour),
    /// One colour a face.
    Faces(Vec<Colour>),
    /// One number a vertex; places on the scale are interpolated across faces.
    Scalars {
        values: Vec<f64>,
        scale: ColourScale,
    },
}

/// How the surface answers light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Finish {
    /// A key light from the upper left with a highlight, a weak one from below, and dark rims: forms and ripples.
    #[default]
    Matte,
    /// Reflections of parallel strips of light: they bend where normals turn, and break where these jump.
    ReflectionLines,
}

/// Lines of one colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// In points of the figure.
    pub width: f64,
    pub colour: Colour,
}

/// A polygon mesh to be seen.
///
/// Triangles are drawn as they are, quads across the diagonal that turns neither half over (the shorter one if
/// both do not), larger faces about their centroid, which is right where all of the face is seen from there. A quad
/// painted with scalars is cut about its centroid too, so that no diagonal shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadedMesh {
    pub mesh: Mesh,
    pub shading: Shading,
    /// None shows edges only, and hides nothing.
    pub paint: Option<Paint>,
    /// The colour of sides whose corners run clockwise; that of the front unless told.
    pub back: Option<Colour>,
    pub finish: Finish,
    /// The edges of the faces where they are not hidden.
    pub edges: Option<Stroke>,
}

/// The colour of surfaces unless told.
pub const SURFACE_COLOUR: Colour = Colour(168, 190, 214);

const EDGE_COLOUR: Colour = Colour(30, 30, 40);
const MAP_EDGE_COLOUR: Colour = Colour(125, 125, 130);

impl ShadedMesh {
    /// Faces with one normal each.
    pub fn flat(mesh: Mesh) -> Self {
        ShadedMesh {
            mesh,
            shading: Shading::Flat,
            paint: Some(Paint::Colour(SURFACE_COLOUR)),
            back: None,
            finish: Finish::Matte,
            edges: None,
        }
    }

    /// Normals that are averaged at the vertices.
    pub fn smooth(mesh: Mesh) -> Self {
        ShadedMesh { shading: Shading::Smooth, ..ShadedMesh::flat(mesh) }
    }

    /// Given normals, such as those of a limit surface.
    pub fn with_normals(mesh: Mesh, normals: Vec<DVec3>) -> Self {
        ShadedMesh { shading: Shading::Normals(normals), ..ShadedMesh::flat(mesh) }
    }

    /// Edges alone, that nothing of this mesh hides.
    pub fn wireframe(mesh: Mesh, width: f64) -> Self {
        ShadedMesh { paint: None, ..ShadedMesh::flat(mesh).edges(width) }
    }

    /// The same surface with edges of this width, in points: dark ones, and grey ones on the colours of numbers, whose darkest
    /// they are told from.
    pub fn edges(mut self, width: f64) -> Self {
        let is_map = matches!(self.paint, Some(Paint::Scalars { .. }));
        self.edges = Some(Stroke { width, colour: if is_map { MAP_EDGE_COLOUR } else { EDGE_COLOUR } });
        self
    }

    /// The same surface in this colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.paint = Some(Paint::Colour(colour));
        self
    }

    /// The same surface with one number a vertex painted on it.
    pub fn scalars(mut self, values: Vec<f64>, scale: ColourScale) -> Self {
        self.paint = Some(Paint::Scalars { values, scale });
        self
    }

    /// The same surface with this finish.
    pub fn finish(mut self, finish: Finish) -> Self {
        self.finish = finish;
        self
    }
}

/// Balls of one size, half sunk where they stand on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    pub positions: Vec<DVec3>,
    /// In points of the figure, whatever the distance.
    pub radius: f64,
    pub colour: Colour,
}

/// Arrows.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// Where each starts.
    pub tails: Vec<DVec3>,
    /// One for each tail; one of length 0 is left out.
    pub vectors: Vec<DVec3>,
    /// Of the shaft, in points of the figure.
    pub width: f64,
    pub colour: Colour,
}

/// A panel with meshes, points and vectors seen from somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Above the picture.
    pub caption: String,
    pub view: View,
    /// What the camera frames; everything in the picture unless told. With the same points, pictures of one size
    /// show the same scale and place. A picture that something reaches out of has an outline.
    pub framed: Option<Vec<DVec3>>,
    pub surfaces: Vec<ShadedMesh>,
    pub points: Vec<Points>,
    pub vectors: Vec<Vectors>,
}

impl Picture {
    /// Nothing yet.
    pub fn new(caption: impl Into<String>, view: View) -> Self {
        Picture {
            caption: caption.into(),
            view,
            framed: None,
            surfaces: Vec::new(),
            points: Vec::new(),
            vectors: Vec::new(),
        }
    }

    /// The same picture with one more surface.
    pub fn surface(mut self, surface: ShadedMesh) -> Self {
        self.surfaces.push(surface);
        self
    }

    /// The same picture with points.
    pub fn points(mut self, points: Points) -> Self {
        self.points.push(points);
        self
    }

    /// The same picture with arrows.
    pub fn vectors(mut self, vectors: Vectors) -> Self {
        self.vectors.push(vectors);
        self
    }

    /// The same picture framing these points.
    pub fn frame(mut self, points: &[DVec3]) -> Self {
        self.framed = Some(points.to_vec());
        self
    }
}
