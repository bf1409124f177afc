//! Pictures of a mesh: as it was given, its cage and its limit surface; maps of numbers at its vertices, on sheets and as
//! PLY files for viewers.

use std::path::Path;

use glam::DVec3;

use crate::report::{Colour, ColourScale, Figure, Picture, Points, Provenance, ShadedMesh, View};
use limitlab::Result;
use limitlab::error::counted;
use limitlab::interpolate::surface::{SurfaceMesh, SurfaceOptions, surface};
use limitlab::mesh::ply::{Scalars, write_painted_to};
use limitlab::mesh::{Mesh, Surface, bounding_box, diagonal};
use limitlab::output::write_file;
use limitlab::schemes::Scheme;

/// Colours of meshes as they were given, of control meshes, of given points on a surface.
pub const GIVEN: Colour = Colour(236, 224, 200);
pub const CONTROL: Colour = Colour(206, 220, 206);
pub const POINT: Colour = Colour(200, 60, 30);
/// Widths of edges in points.
pub const FINE_EDGE: f64 = 0.2;
pub const FINEST_EDGE: f64 = 0.12;
const EDGE: f64 = 0.35;
/// Vertices beyond which edges would hide the faces.
const MOST_WITH_EDGES: usize = 50_000;
/// Vertices beyond which dots would hide the surface.
const MOST_DOTS: usize = 2000;
/// Corners that a surface is refined to, at most, and refinements.
const MOST_REFINED: usize = 400_000;
const MOST_LEVELS: usize = 5;
/// Panels of maps in a row.
const IN_A_ROW: usize = 3;
/// Maps in a picture, at most, each of which takes 17 MB of memory: a PLY file has all.
pub const MOST_MAPS: usize = 12;

/// A mesh with flat faces and its edges.
pub fn cage(mesh: &Mesh, colour: Colour) -> ShadedMesh {
    let shaded = ShadedMesh::flat(mesh.clone()).colour(colour);
    match mesh.len() {
        0..600 => shaded.edges(EDGE),
        600..3000 => shaded.edges(FINE_EDGE),
        3000..MOST_WITH_EDGES => shaded.edges(FINEST_EDGE),
        _ => shaded,
    }
}

/// Panels in rows of `columns`, each `width`×`height` points.
pub fn sheet(columns: usize, (width, height): (u32, u32), panels: Vec<Picture>) -> Figure {
    let rows = panels.len().div_ceil(columns);
    Figure { width: width * columns as u32, height: height * rows as u32, columns, ..Figure::row(panels) }
}

/// The view of a model, whose axes differ.
pub fn view(up: DVec3, azimuth: f64, elevation: f64) -> View {
    View::around(up, azimuth, elevation).perspective(20.0)
}

/// The view, y upward, from a side that shows the most of numbers at the vertices, as far as faces look there; the one
/// from the front, right and above unless another shows a fifth more.
fn view_of(mesh: &Mesh, values: &[f64]) -> View {
    let area = |face: &[u32]| -> DVec3 {
        let at = |k: usize| mesh.positions[face[k % face.len()] as usize];
        (1..face.len()).map(|k| (at(k) - at(0)).cross(at(k + 1) - at(0))).sum()
    };
    // Faces may be turned inward.
    let (least, greatest) = bounding_box(&mesh.positions).unwrap_or_default();
    let middle = 0.5 * (least + greatest);
    let volume = |face: &[u32]| area(face).dot(mesh.positions[face[0] as usize] - middle);
    let outward = mesh.faces.iter().map(volume).sum::<f64>().signum();
    let shown = |view: &View| -> f64 {
        let on_face = |face: &[u32]| {
            let weight: f64 = face.iter().map(|&v| values[v as usize].abs()).sum();
            weight / face.len() as f64 * (outward * area(face).dot(view.toward_eye)).max(0.0)
        };
        mesh.faces.iter().map(on_face).sum()
    };
    let sides = [25.0, -25.0]
        .into_iter()
        .flat_map(|elevation| [30.0, 120.0, 210.0, 300.0].map(|azimuth| View::around(DVec3::Y, azimuth, elevation)));
    let mut best = View::around(DVec3::Y, 30.0, 25.0);
    let mut most = 1.2 * shown(&best);
    for side in sides {
        let here = shown(&side);
        if here > most {
            (best, most) = (side, here);
        }
    }
    best
}

/// `3.8×10⁻²`, as the report's texts are marked up.
pub fn power(x: f64) -> String {
    let text = format!("{x:.1e}");
    match text.split_once('e') {
        Some((digits, exponent)) => format!("{digits}×10^{{{}}}", exponent.replace('-', "−")),
        None => text,
    }
}

/// The width of a bar of colours with its numbers, about.
const BAR: u32 = 60;

/// As [`sheet`], with the bar of colours that pictures of numbers share beside them.
pub fn maps(columns: usize, size: (u32, u32), scale: ColourScale, pictures: Vec<Picture>) -> Figure {
    let figure = sheet(columns, size, pictures);
    Figure { width: figure.width + BAR, colour_bar: Some(scale), ..figure }
}

/// Numbers at the vertices of a mesh under names.
pub struct Maps<'a> {
    pub mesh: &'a Mesh,
    pub scalars: Vec<Scalars>,
    /// What is 1 on the scale of colours, for each.
    pub units: Vec<f64>,
    pub scale: ColourScale,
}

/// What of a mesh is framed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Framed {
    /// All of it, from where the last of the maps has its greatest numbers in view.
    Whole,
    /// Where the numbers of each map are, from a side of its own.
    Near,
}

impl Maps<'_> {
    /// In units of the scale.
    fn painted(&self, map: usize) -> Vec<f64> {
        self.scalars[map].values.iter().map(|x| x / self.units[map]).collect()
    }

    /// A sheet of all that have a caption.
    pub fn figure(&self, title: String, captions: impl Iterator<Item = String>, framed: Framed) -> Figure {
        let last = view_of(self.mesh, &self.painted(self.scalars.len() - 1)).perspective(20.0);
        let picture = |(map, caption): (usize, String)| {
            let values = self.painted(map);
            let (view, points) = match framed {
                Framed::Whole => (last, self.mesh.positions.clone()),
                // Lines of sight are parallel: what is not framed may lie behind an eye.
                Framed::Near => (view_of(self.mesh, &values), near_peak(&self.mesh.positions, &values)),
            };
            let shaded = ShadedMesh::smooth(self.mesh.clone()).scalars(values, self.scale.clone());
            let shaded = match points.len() {
                0..600 => shaded.edges(FINE_EDGE),
                600..3000 => shaded.edges(FINEST_EDGE),
                _ => shaded,
            };
            Picture::new(caption, view).surface(shaded).frame(&points)
        };
        let pictures: Vec<Picture> = captions.enumerate().map(picture).collect();
        maps(IN_A_ROW.min(pictures.len()), (200, 190), self.scale.clone(), pictures).headed(title)
    }

    /// A PLY file with all as properties of the vertices, in the colours of `shown` of them.
    ///
    /// # Errors
    /// As a picture with the scale; if the file cannot be written.
    pub fn write_ply(&self, path: &Path, shown: usize, made: &Provenance) -> Result<()> {
        let colours = self.scale.colours(&self.painted(shown))?;
        write_file(path, |out| write_painted_to(out, self.mesh, &colours, &self.scalars, &made.lines()))
    }
}

/// The points around that of the greatest number, as far as numbers are a hundredth of it, and no fewer than those within an
/// eighth of the whole.
fn near_peak(points: &[DVec3], values: &[f64]) -> Vec<DVec3> {
    let peak = peak(values);
    let distance = |v: usize| points[v].distance(points[peak]);
    let is_seen = |&v: &usize| values[v].abs() > 0.01 * values[peak].abs();
    let reach = (0..points.len()).filter(is_seen).map(distance).fold(0.125 * diagonal(points), f64::max);
    (0..points.len()).filter(|&v| distance(v) <= reach).map(|v| points[v]).collect()
}

/// Where numbers are largest; the first of those that are as large but for rounding.
pub fn peak(values: &[f64]) -> usize {
    let larger = |at: usize, v: usize| if values[v].abs() > values[at].abs() * (1.0 + 1e-6) { v } else { at };
    (0..values.len()).fold(0, larger)
}

/// The mesh that was given, its control mesh, and the limit surface of that with the points which it meets, side by side on one
/// scale. The surface is that of `request`, refined as far as is seen.
///
/// # Errors
/// As [`surface`].
pub fn interpolation(
    title: String,
    given: &Surface,
    control: Surface,
    scheme: Scheme,
    request: &SurfaceOptions,
) -> Result<Figure> {
    let points = given.positions();
    let framed: Vec<DVec3> = points.iter().chain(control.positions()).copied().collect();
    let view = view(DVec3::Y, 30.0, 25.0);
    let panel = |caption: String, shaded| Picture::new(caption, view).surface(shaded).frame(&framed);
    let counts = format!("given: {}, {}", counted(given.len(), "vertex"), counted(given.faces().len(), "face"));
    let mesh = panel(counts, cage(given.mesh(), GIVEN));
    let cage = panel("control mesh".into(), cage(control.mesh(), CONTROL));
    let size = given.faces().corners().len();
    let levels = (0..MOST_LEVELS).find(|k| size << (2 * k) >= MOST_REFINED).unwrap_or(MOST_LEVELS);
    let request = SurfaceOptions { levels: levels.max(request.levels), limit: true, normals: true, ..*request };
    let SurfaceMesh { surface, normals, .. } = surface(control, scheme, points, &request)?;
    let limit = ShadedMesh::with_normals(surface.into_mesh(), normals.unwrap_or_default());
    let mut limit = panel("limit surface, given points".into(), limit);
    if points.len() <= MOST_DOTS {
        let is_met = |v: usize| request.constraints.interpolated.is_none_or(|marks| marks[v]);
        let positions = (0..points.len()).filter(|&v| is_met(v)).map(|v| points[v]).collect();
        limit = limit.points(Points { positions, radius: 1.1, colour: POINT });
    }
    Ok(sheet(IN_A_ROW, (230, 240), vec![mesh, cage, limit]).headed(title))
}

#[cfg(test)]
mod tests {
    use super::*;
    use limitlab::mesh::{Faces, builtin::builtin};

    #[test]
    fn the_view_shows_where_numbers_are_on_faces_turned_either_way() {
        let mesh = builtin("icosphere:2").unwrap();
        let turned = mesh.faces.iter().map(|face| face.iter().rev().copied().collect::<Vec<u32>>());
        let turned = Mesh::new(mesh.positions.clone(), Faces::from_lists(turned));
        for side in [DVec3::NEG_Z, DVec3::NEG_X, DVec3::new(1.0, -1.0, 1.0).normalize()] {
            let values: Vec<f64> = mesh.positions.iter().map(|p| if p.dot(side) > 0.9 { -1.0 } else { 0.0 }).collect();
            for mesh in [&mesh, &turned] {
                assert!(view_of(mesh, &values).toward_eye.dot(side) > 0.6, "{side}");
            }
        }
        let even = vec![1.0; mesh.len()];
        assert_eq!(view_of(&mesh, &even), View::around(DVec3::Y, 30.0, 25.0));
    }

    #[test]
    fn a_mode_is_framed_with_what_is_around_it() {
        let mesh = builtin("icosphere:3").unwrap();
        let mut values = vec![0.0; mesh.len()];
        values[17] = -2.0;
        let peak = mesh.positions[17];
        // An eighth of the diagonal √12 of the bounding box.
        let near = near_peak(&mesh.positions, &values);
        let within = |reach: f64| mesh.positions.iter().filter(|p| p.distance(peak) <= reach).count();
        assert_eq!(near.len(), within(12f64.sqrt() / 8.0));
        assert!(near.len() > 1 && near.len() < mesh.len() / 4);
        values.fill(1.0);
        assert_eq!(near_peak(&mesh.positions, &values).len(), mesh.len());
    }
}
