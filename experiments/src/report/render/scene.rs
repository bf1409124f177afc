//! Scene of a picture for the rasteriser: arrays checked, cut into triangles, projected.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use super::camera::Camera;
use super::{Finish, Paint, Picture, Points, ShadedMesh, Shading, Stroke, Vectors};
use crate::report::canvas::Colour;
use limitlab::mesh::{Faces, Mesh, Topology};
use limitlab::{Error, Result};

/// Parts of a pixel that corners of triangles are rounded to: their coverage is then exact.
pub(super) const GRID: i64 = 256;

/// Pixels beyond which exact coverage could overflow.
const FARTHEST: f64 = 1e6;

/// A projected corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// In 1/[`GRID`] pixels.
    pub x: i64,
    pub y: i64,
    pub depth: f64,
    pub weight: f64,
}

/// Three corners of a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub corners: [u32; 3],
    pub face: u32,
    pub material: u32,
}

/// What the faces of a surface have in common.
#[derive(Clone, Debug)]
pub(super) struct Material {
    pub colour: Colour,
    pub back: Option<Colour>,
    pub finish: Finish,
    pub is_flat: bool,
    pub dye: Dye,
}

/// Where the colour of a place comes from.
#[derive(Clone, Debug)]
pub(super) enum Dye {
    /// The material.
    One,
    /// The face.
    Faces,
    /// The place on the scale, by this table.
    Table(Vec<Colour>),
}

/// A ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub x: f64,
    pub y: f64,
    pub depth: f64,
    /// In pixels.
    pub radius: f64,
    /// How much the depth falls over one radius.
    pub bulge: f64,
    pub colour: Colour,
}

/// A line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// x, y in pixels, depth.
    pub ends: [DVec3; 2],
    /// How much nearer than the surface it counts.
    pub offset: f64,
    /// Half its width in pixels.
    pub half_width: f64,
    pub colour: Colour,
}

/// Everything in a picture, in pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Scene {
    pub vertices: Vec<Vertex>,
    /// With x to the right, y up, z to the eye; zero where there is none.
    pub normals: Vec<DVec3>,
    /// On the colour scale, from 0 to 1.
    pub places: Vec<f32>,
    pub triangles: Vec<Triangle>,
    pub face_normals: Vec<DVec3>,
    /// Where a surface has a colour a face, else black.
    pub face_colours: Vec<Colour>,
    pub materials: Vec<Material>,
    pub balls: Vec<Ball>,
    pub segments: Vec<Segment>,
}

/// A line counts as nearer than the surface by so many pixels' length: a surface is known at pixel centres only.
const LINE_OFFSET: f64 = 2.0;

impl Scene {
    /// Projects the picture to `size` pixels with `pixels_per_point`.
    ///
    /// # Errors
    /// What cannot be drawn: coordinates, normals or scalars that are not finite, a face with a vertex that is not
    /// there, points behind the eye or far outside, with their place.
    ///
    /// # Panics
    /// If a list has not one entry a vertex, face or tail.
    pub fn new(picture: &Picture, size: (u32, u32), pixels_per_point: f64) -> Result<Self> {
        for (s, surface) in picture.surfaces.iter().enumerate() {
            check(surface).map_err(|what| cannot_draw(&format!("surface {s}, {what}")))?;
        }
        let lists = picture.points.iter().map(|p| &p.positions);
        let lists = lists.chain(picture.vectors.iter().flat_map(|v| [&v.tails, &v.vectors]));
        for list in lists {
            if let Some(i) = list.iter().position(|p| !p.is_finite()) {
                return Err(cannot_draw(&format!("point or vector {i} is not finite: {}", list[i])));
            }
        }
        let camera = match &picture.framed {
            Some(points) => Camera::framing(&picture.view, points, size)?,
            None => Camera::framing(&picture.view, &everything(picture), size)?,
        };
        let mut scene = Scene::default();
        for surface in &picture.surfaces {
            scene.add_surface(surface, &camera, pixels_per_point)?;
        }
        for points in &picture.points {
            scene.add_balls(points, &camera, pixels_per_point)?;
        }
        for vectors in &picture.vectors {
            for arrow in arrows(vectors, &camera, pixels_per_point)? {
                scene.add_surface(&arrow, &camera, pixels_per_point)?;
            }
        }
        Ok(scene)
    }

    fn add_surface(&mut self, surface: &ShadedMesh, camera: &Camera, pixels: f64) -> Result<()> {
        let mesh = &surface.mesh;
        let projected = (mesh.positions.par_iter().enumerate())
            .map(|(v, &p)| project(camera, p, &|| format!("vertex {v}")))
            .collect::<Result<Vec<DVec4>>>()?;
        if let Some(stroke) = surface.edges {
            self.add_edges(&mesh.faces, &projected, camera, stroke, pixels);
        }
        let Some(paint) = &surface.paint else {
            return Ok(());
        };
        let (cut, extra) = cut_about_centroids(mesh, matches!(paint, Paint::Scalars { .. }));
        let centroids = (extra.par_iter())
            .map(|&p| project(camera, p, &|| "the middle of a face".into()))
            .collect::<Result<Vec<DVec4>>>()?;
        let first_vertex = self.vertices.len() as u32;
        let first_face = self.face_normals.len() as u32;
        self.vertices.extend(projected.iter().chain(&centroids).map(snap));
        let areas: Vec<DVec3> = (mesh.faces.iter()).map(|f| area_vector(&mesh.positions, f)).collect();
        let unit = |v: &DVec3| camera.turned(*v).normalize_or_zero();
        let is_flat = match &surface.shading {
            Shading::Flat => true,
            Shading::Smooth => {
                self.normals.resize(first_vertex as usize, DVec3::ZERO);
                let sums = vertex_normals(mesh, &areas);
                self.normals.extend(sums.iter().map(unit));
                false
            }
            Shading::Normals(normals) => {
                self.normals.resize(first_vertex as usize, DVec3::ZERO);
                self.normals.extend(normals.iter().map(unit));
                false
            }
        };
        let (mut colour, mut dye) = (super::SURFACE_COLOUR, Dye::One);
        match paint {
            Paint::Colour(c) => colour = *c,
            Paint::Faces(colours) => {
                self.face_colours.resize(first_face as usize, colour);
                self.face_colours.extend_from_slice(colours);
                dye = Dye::Faces;
            }
            Paint::Scalars { values, scale } => {
                let place = scale.place()?;
                self.places.resize(first_vertex as usize, 0.0);
                self.places.extend(values.iter().map(|&value| place(value) as f32));
                dye = Dye::Table(scale.map.table());
            }
        }
        let material = self.materials.len() as u32;
        self.materials.push(Material { colour, back: surface.back, finish: surface.finish, is_flat, dye });
        let mut next_centroid = mesh.len() as u32;
        for (f, face) in mesh.faces.iter().enumerate() {
            let mut add = |corners: [u32; 3]| {
                self.triangles.push(Triangle {
                    corners: corners.map(|v| first_vertex + v),
                    face: first_face + f as u32,
                    material,
                });
            };
            if cut(face) {
                for (&a, &b) in face.iter().zip(face.iter().cycle().skip(1)) {
                    add([next_centroid, a, b]);
                }
                next_centroid += 1;
                continue;
            }
            match *face {
                [a, b, c] => add([a, b, c]),
                [a, b, c, d] if cuts_first_diagonal(&mesh.positions, face, areas[f]) => {
                    add([a, b, c]);
                    add([a, c, d]);
                }
                [a, b, c, d] => {
                    add([b, c, d]);
                    add([b, d, a]);
                }
                _ => {}
            }
        }
        // Normals and places in the middle of a face are the means of its corners.
        for face in mesh.faces.iter().filter(|face| cut(face)) {
            let corners = || face.iter().map(|&v| (first_vertex + v) as usize);
            if !is_flat {
                let sum: DVec3 = corners().map(|v| self.normals[v]).sum();
                self.normals.push(sum.normalize_or_zero());
            }
            if matches!(paint, Paint::Scalars { .. }) {
                let sum: f32 = corners().map(|v| self.places[v]).sum();
                self.places.push(sum / face.len() as f32);
            }
        }
        self.face_normals.extend(areas.iter().map(unit));
        Ok(())
    }

    fn add_edges(&mut self, faces: &Faces, projected: &[DVec4], camera: &Camera, stroke: Stroke, pixels: f64) {
        let topology = Topology::new(faces, projected.len());
        let corners = faces.corners();
        for c in topology.edge_sides() {
            let range = faces.range(topology.incidence.face_of(c));
            let next = limitlab::mesh::incidence::next_in(&range, c);
            let ends = [c, next].map(|c| projected[corners[c as usize] as usize]);
            let weight = ends[0].w.max(ends[1].w);
            self.segments.push(Segment {
                ends: ends.map(|e| e.truncate()),
                offset: camera.nearer(weight, LINE_OFFSET * camera.pixel_length(weight)),
                half_width: stroke.width * pixels / 2.0,
                colour: stroke.colour,
            });
        }
    }

    fn add_balls(&mut self, points: &Points, camera: &Camera, pixels: f64) -> Result<()> {
        let radius = points.radius * pixels;
        for (i, &p) in points.positions.iter().enumerate() {
            let at = project(camera, p, &|| format!("point {i}"))?;
            self.balls.push(Ball {
                x: at.x,
                y: at.y,
                depth: at.z,
                radius,
                bulge: camera.nearer(at.w, radius * camera.pixel_length(at.w)),
                colour: points.colour,
            });
        }
        Ok(())
    }
}

/// x, y in pixels, depth, weight.
type DVec4 = glam::DVec4;

fn cannot_draw(what: &str) -> Error {
    Error::Computation(format!("cannot draw the picture: {what}"))
}

fn project(camera: &Camera, p: DVec3, name: &dyn Fn() -> String) -> Result<DVec4> {
    let Some(seen) = camera.project(p) else {
        return Err(cannot_draw(&format!(
            "{} at {p} is behind the eye; frame it too, or look with parallel lines of sight",
            name()
        )));
    };
    if seen.x.abs().max(seen.y.abs()) > FARTHEST {
        return Err(cannot_draw(&format!(
            "{} at {p} is more than {FARTHEST} pixels outside the picture; frame more of the scene",
            name()
        )));
    }
    Ok(DVec4::new(seen.x, seen.y, seen.depth, seen.weight))
}

fn snap(p: &DVec4) -> Vertex {
    Vertex { x: (p.x * GRID as f64).round() as i64, y: (p.y * GRID as f64).round() as i64, depth: p.z, weight: p.w }
}

/// What is wrong with a surface, if anything.
fn check(surface: &ShadedMesh) -> std::result::Result<(), String> {
    let Mesh { positions, faces } = &surface.mesh;
    if let Some(v) = positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("vertex {v} is not finite: {}", positions[v]));
    }
    let is_missing = |&c: &u32| c as usize >= positions.len();
    if let Some(f) = faces.iter().position(|face| face.iter().any(is_missing)) {
        return Err(format!("face {f} names a vertex that is not there: there are {}", positions.len()));
    }
    if let Shading::Normals(normals) = &surface.shading {
        assert!(normals.len() == positions.len(), "one normal for each vertex");
        if let Some(v) = normals.iter().position(|n| !n.is_finite()) {
            return Err(format!("the normal of vertex {v} is not finite: {}", normals[v]));
        }
    }
    match &surface.paint {
        Some(Paint::Scalars { values, .. }) => {
            assert!(values.len() == positions.len(), "one number for each vertex");
            if let Some(v) = values.iter().position(|x| x.is_nan()) {
                return Err(format!("the number of vertex {v} is not one (NaN)"));
            }
        }
        Some(Paint::Faces(colours)) => {
            assert!(colours.len() == faces.len(), "one colour for each face");
        }
        Some(Paint::Colour(_)) | None => {}
    }
    Ok(())
}

fn everything(picture: &Picture) -> Vec<DVec3> {
    let mut all = Vec::new();
    for surface in &picture.surfaces {
        all.extend_from_slice(&surface.mesh.positions);
    }
    for points in &picture.points {
        all.extend_from_slice(&points.positions);
    }
    for vectors in &picture.vectors {
        all.extend_from_slice(&vectors.tails);
        all.extend(vectors.tails.iter().zip(&vectors.vectors).map(|(&t, &v)| t + v));
    }
    all
}

/// Which faces are cut about their centroids, and these.
fn cut_about_centroids(mesh: &Mesh, is_painted: bool) -> (impl Fn(&[u32]) -> bool, Vec<DVec3>) {
    let cut = move |face: &[u32]| face.len() > if is_painted { 3 } else { 4 };
    let centroids = (mesh.faces.iter())
        .filter(|face| cut(face))
        .map(|face| {
            let sum: DVec3 = face.iter().map(|&v| mesh.positions[v as usize]).sum();
            sum / face.len() as f64
        })
        .collect();
    (cut, centroids)
}

/// ½ Σ v_i × v_{i+1} about the first corner: the area of the face's shadow in every direction (Newell).
fn area_vector(positions: &[DVec3], face: &[u32]) -> DVec3 {
    let Some(&first) = face.first() else {
        return DVec3::ZERO;
    };
    let from_first = |v: u32| positions[v as usize] - positions[first as usize];
    let sum: DVec3 = (face.windows(2)).map(|side| from_first(side[0]).cross(from_first(side[1]))).sum();
    0.5 * sum
}

fn vertex_normals(mesh: &Mesh, areas: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.len()];
    for (face, &area) in mesh.faces.iter().zip(areas) {
        for &v in face {
            sums[v as usize] += area;
        }
    }
    sums
}

/// Whether a quad is cut from its first to its third corner rather than from the second to the fourth: across the
/// diagonal whose halves both turn as the whole, or the shorter one.
fn cuts_first_diagonal(positions: &[DVec3], face: &[u32], area: DVec3) -> bool {
    let p = |i: usize| positions[face[i] as usize];
    let turns = |a: usize, b: usize, c: usize| (p(b) - p(a)).cross(p(c) - p(a)).dot(area) > 0.0;
    let first = turns(0, 1, 2) && turns(0, 2, 3);
    let second = turns(1, 2, 3) && turns(1, 3, 0);
    if first == second { p(0).distance_squared(p(2)) <= p(1).distance_squared(p(3)) } else { first }
}

/// Sides of a shaft and of a head.
const SIDES: usize = 12;
/// Radius and length of a head in widths of the shaft; the head is never longer than half the arrow.
const HEAD_RADIUS: f64 = 1.7;
const HEAD_LENGTH: f64 = 4.5;

/// Arrows as small meshes: a tube and a cone each.
fn arrows(vectors: &Vectors, camera: &Camera, pixels: f64) -> Result<Vec<ShadedMesh>> {
    assert!(vectors.tails.len() == vectors.vectors.len(), "one vector for each tail");
    let (mut tubes, mut cones) = (Mesh::new(Vec::new(), Faces::default()), Mesh::new(Vec::new(), Faces::default()));
    for (i, (&tail, &vector)) in vectors.tails.iter().zip(&vectors.vectors).enumerate() {
        let Some(axis) = vector.try_normalize() else {
            continue;
        };
        let weight = project(camera, tail, &|| format!("tail {i}"))?.w;
        let width = vectors.width * pixels * camera.pixel_length(weight);
        let head = (HEAD_LENGTH * width).min(vector.length() / 2.0);
        let neck = tail + vector - head * axis;
        let across = axis.any_orthonormal_pair();
        let ring = |center: DVec3, radius: f64| {
            (0..SIDES).map(move |k| {
                let (sin, cos) = (TAU * k as f64 / SIDES as f64).sin_cos();
                center + radius * (cos * across.0 + sin * across.1)
            })
        };
        let base = tubes.positions.len() as u32;
        tubes.positions.extend(ring(tail, width / 2.0).chain(ring(neck, width / 2.0)));
        let cone = cones.positions.len() as u32;
        cones.positions.extend(ring(neck, HEAD_RADIUS * width));
        cones.positions.push(tail + vector);
        let sides = SIDES as u32;
        for k in 0..sides {
            let next = (k + 1) % sides;
            tubes.faces.push(&[base + k, base + next, base + sides + next, base + sides + k]);
            cones.faces.push(&[cone + k, cone + next, cone + sides]);
        }
        let base_of_cone: Vec<u32> = (0..sides).rev().map(|k| cone + k).collect();
        cones.faces.push(&base_of_cone);
    }
    Ok(vec![ShadedMesh::smooth(tubes).colour(vectors.colour), ShadedMesh::flat(cones).colour(vectors.colour)])
}
