//! Meshes: files and built-in ones, valid surfaces with their creases, and what is refined of them.

use std::path::PathBuf;

use glam::DVec3;
use limitlab::error::{Error, Result};
use limitlab::interpolate::limit_points;
use limitlab::mesh::features::{SHARP, Tags, creases_by_angle};
use limitlab::mesh::file_tags::Subdivision;
use limitlab::mesh::frame::Frame;
use limitlab::mesh::io::{self, WriteOptions};
use limitlab::mesh::noise::{Noise, add_noise};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::weld::seams;
use limitlab::mesh::{Mesh, Surface, builtin};
use limitlab::schemes::{Refinement, Scheme};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{array_of, face_arrays, faces, index_array, indices, points, points_of, require_length};
use crate::errors::{of_defects, raised};

/// A valid mesh, open or closed, with what is sharp on it.
#[pyclass(frozen, name = "Surface")]
pub struct PySurface {
    /// Its positions are given in `frame`.
    pub surface: Surface,
    /// Where the caller's own points lie.
    pub frame: Frame,
}

/// (corners, size, offsets) of faces.
type FaceParts<'py> = (Bound<'py, PyAny>, usize, Option<PyReadonlyArray1<'py, i64>>);
/// Edges as (k, 2), and their sharpness.
type Creases<'py> = (PyReadonlyArray2<'py, i64>, PyReadonlyArray1<'py, f64>);
/// Vertices, and their sharpness.
type Corners<'py> = (PyReadonlyArray1<'py, i64>, PyReadonlyArray1<'py, f64>);

/// The points in their frame, and that.
pub fn placed(py: Python<'_>, mut points: Vec<DVec3>) -> PyResult<(Vec<DVec3>, Frame)> {
    if let Some(v) = points.iter().position(|p| !p.is_finite()) {
        return Err(PyValueError::new_err(format!("vertex {v}: a coordinate is not finite")));
    }
    let framed = py.detach(|| {
        let frame = Frame::of(&points)?;
        frame.enter(&mut points);
        Ok(frame)
    });
    match framed {
        Ok(frame) => Ok((points, frame)),
        Err(v) => {
            let v: usize = v;
            Err(PyValueError::new_err(format!(
                "vertex {v}: a coordinate is more than 10^300 times smaller than the largest, and doubles cannot hold both: \
                 correct it, or set it to 0"
            )))
        }
    }
}

fn tags(boundary: Boundary, creases: Option<&Creases<'_>>, corners: Option<&Corners<'_>>) -> PyResult<Tags> {
    let mut tags = Tags { boundary, ..Tags::default() };
    if let Some((edges, sharpness)) = creases {
        let (ends, sharpness) = (indices(edges.as_slice()?)?, sharpness.as_slice()?);
        if ends.len() != 2 * sharpness.len() {
            return Err(PyValueError::new_err("creases are two vertices and a sharpness each"));
        }
        tags.creases = ends.chunks_exact(2).map(|ends| [ends[0], ends[1]]).zip(sharpness.iter().copied()).collect();
    }
    if let Some((vertices, sharpness)) = corners {
        let (vertices, sharpness) = (indices(vertices.as_slice()?)?, sharpness.as_slice()?);
        if vertices.len() != sharpness.len() {
            return Err(PyValueError::new_err("corners are a vertex and a sharpness each"));
        }
        tags.corners = vertices.into_iter().zip(sharpness.iter().copied()).collect();
    }
    Ok(tags)
}

#[pymethods]
impl PySurface {
    #[new]
    #[pyo3(signature = (vertices, faces, boundary, creases=None, corners=None, crease_angle=None))]
    fn new(
        py: Python<'_>,
        vertices: Option<PyReadonlyArray2<'_, f64>>,
        faces: FaceParts<'_>,
        boundary: Option<&str>,
        creases: Option<Creases<'_>>,
        corners: Option<Corners<'_>>,
        crease_angle: Option<f64>,
    ) -> PyResult<Self> {
        let asked: Option<Boundary> = boundary.map(str::parse).transpose().map_err(|e| raised(py, e))?;
        let boundary = asked.unwrap_or(Boundary::EdgeAndCorner);
        let faces = crate::arrays::faces(&faces.0, faces.1, faces.2.as_ref())?;
        let positions = match &vertices {
            Some(vertices) => points(vertices)?.to_vec(),
            // For who has faces alone: their places do not matter.
            None => vec![DVec3::ZERO; faces.corners().iter().max().map_or(0, |&v| v as usize + 1)],
        };
        let mut tags = tags(boundary, creases.as_ref(), corners.as_ref())?;
        let examined = py.detach(|| Surface::examined(Mesh::new(positions, faces), None, boundary));
        let mut surface = examined.map_err(|report| of_defects(py, &report))?;
        if vertices.is_some() && asked.is_none() {
            check_seams(&surface).map_err(|e| raised(py, e))?;
        }
        if let Some(degrees) = crease_angle {
            if !(0.0..=180.0).contains(&degrees) {
                return Err(PyValueError::new_err(format!(
                    "crease_angle={degrees}: an angle from 0 to 180 degrees is needed"
                )));
            }
            tags.creases.extend(creases_by_angle(&surface, degrees).into_iter().map(|ends| (ends, SHARP)));
        }
        if !(tags.creases.is_empty() && tags.corners.is_empty()) {
            surface = surface.into_tagged(&tags).map_err(|e| raised(py, e))?;
        }
        let frame = match Frame::of(surface.positions()) {
            Ok(frame) => frame,
            Err(_) => placed(py, surface.positions().to_vec())?.1,
        };
        frame.enter(surface.positions_mut());
        Ok(PySurface { surface, frame })
    }

    fn __len__(&self) -> usize {
        self.surface.len()
    }

    /// The scheme by name; without one Loop's on triangles, else Catmull-Clark.
    fn scheme(&self, py: Python<'_>, name: Option<&str>) -> PyResult<&'static str> {
        Ok(self.scheme_of(py, name)?.name())
    }

    /// As `_limitlab.read` has meshes: after `levels` steps of a refinement.
    fn refined<'py>(&self, py: Python<'py>, refinement: &str, levels: usize) -> PyResult<Bound<'py, PyDict>> {
        let refinement = refinement_of(py, refinement)?;
        let refined = py.detach(|| refinement.refined_n(&self.surface, levels)).map_err(|e| raised(py, e))?;
        self.described(py, refined)
    }

    /// The limit points of the vertices, (n, 3).
    fn limit_points<'py>(&self, py: Python<'py>, scheme: Option<&str>) -> PyResult<crate::arrays::Rows<'py>> {
        let scheme = self.scheme_of(py, scheme)?;
        let mut limits = py.detach(|| limit_points(&self.surface, scheme)).map_err(|e| raised(py, e))?;
        self.frame.leave(&mut limits);
        Ok(array_of(py, limits))
    }

    /// The unit normals of the limit surface at the limit points, (n, 3); zero where it has none.
    fn limit_normals<'py>(&self, py: Python<'py>, refinement: &str) -> PyResult<crate::arrays::Rows<'py>> {
        let refinement = refinement_of(py, refinement)?;
        let normals = py.detach(|| refinement.limit_normals(&self.surface)).map_err(|e| raised(py, e))?;
        Ok(array_of(py, normals))
    }
}

impl PySurface {
    pub fn scheme_of(&self, py: Python<'_>, name: Option<&str>) -> PyResult<Scheme> {
        match name {
            Some(name) => name.parse().map_err(|e| raised(py, e)),
            None => Ok(Scheme::default_for(self.surface.faces())),
        }
    }

    /// A surface of this frame as a dictionary of arrays.
    pub fn described<'py>(&self, py: Python<'py>, mut surface: Surface) -> PyResult<Bound<'py, PyDict>> {
        self.frame.leave(surface.positions_mut());
        let tags = surface.tags();
        let rule = if surface.is_closed() { None } else { Some(tags.boundary) };
        described(py, surface.into_mesh(), &tags, rule)
    }
}

/// Refuses a mesh of whose boundary nine tenths are a seam of duplicate vertices, no opening.
fn check_seams(surface: &Surface) -> Result<()> {
    let all = surface.boundary_edges();
    match seams(surface).filter(|(edges, _)| 10 * edges >= 9 * all) {
        None => Ok(()),
        Some((edges, [a, b])) => Err(Error::mesh(
            "a seam",
            format!(
                "{edges} of {all} boundary edges lie on each other (first: vertices {a} and {b}), where vertices were \
                 duplicated at the same positions; make one of them, or say boundary=\"edge-and-corner\" to keep the seam open"
            ),
        )),
    }
}

fn refinement_of(py: Python<'_>, name: &str) -> PyResult<Refinement> {
    let of_scheme = || name.parse::<Scheme>().map(Scheme::refinement);
    name.parse::<Refinement>().or_else(|e| of_scheme().map_err(|_| e)).map_err(|e| raised(py, e))
}

/// A mesh and its tags as a dictionary of arrays.
fn described<'py>(py: Python<'py>, mesh: Mesh, tags: &Tags, rule: Option<Boundary>) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("faces", face_arrays(py, &mesh.faces)?)?;
    found.set_item("vertices", array_of(py, mesh.positions))?;
    found.set_item("boundary", rule.map(Boundary::name))?;
    let (ends, sharpness): (Vec<[u32; 2]>, Vec<f64>) = tags.creases.iter().copied().unzip();
    found.set_item("creases", (index_array(py, ends.concat()), sharpness))?;
    let (vertices, sharpness): (Vec<u32>, Vec<f64>) = tags.corners.iter().copied().unzip();
    found.set_item("corners", (index_array(py, vertices), sharpness))?;
    Ok(found)
}

/// A mesh file as a dictionary of arrays.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let loaded = py.detach(|| io::read(&path)).map_err(|e| raised(py, e))?;
    let of_file = loaded.tags;
    let tags = Tags {
        boundary: of_file.boundary.unwrap_or_default(),
        creases: of_file.creases.iter().map(|tag| (tag.ends, tag.sharpness)).collect(),
        corners: of_file.corners.iter().map(|tag| (tag.vertex, tag.sharpness)).collect(),
    };
    let found = described(py, loaded.mesh, &tags, of_file.boundary)?;
    found.set_item("normals", loaded.normals.map(|normals| array_of(py, normals)))?;
    found.set_item("remarks", loaded.remarks)?;
    Ok(found)
}

/// A built-in mesh, with noise if there is any.
#[pyfunction]
pub fn mesh<'py>(py: Python<'py>, name: &str, noise: f64, seed: u64) -> PyResult<Bound<'py, PyDict>> {
    let noise: Noise = format!("{noise}:{seed}").parse().map_err(|e| raised(py, e))?;
    let made = py.detach(|| {
        let mut mesh = builtin::builtin(name)?;
        if noise.amplitude > 0.0 {
            add_noise(&mut mesh, noise.amplitude, noise.seed);
        }
        Ok(mesh)
    });
    described(py, made.map_err(|e| raised(py, e))?, &Tags::default(), None)
}

/// Writes a mesh with its normals and tags.
#[pyfunction]
#[pyo3(signature = (path, vertices, face_parts, normals, boundary, creases, corners, scheme, ascii, comments))]
#[allow(clippy::too_many_arguments)]
pub fn write(
    py: Python<'_>,
    path: PathBuf,
    vertices: PyReadonlyArray2<'_, f64>,
    face_parts: FaceParts<'_>,
    normals: Option<PyReadonlyArray2<'_, f64>>,
    boundary: Option<&str>,
    creases: Option<Creases<'_>>,
    corners: Option<Corners<'_>>,
    scheme: Option<&str>,
    ascii: bool,
    comments: Vec<String>,
) -> PyResult<()> {
    let boundary: Option<Boundary> = boundary.map(str::parse).transpose().map_err(|e| raised(py, e))?;
    let scheme: Option<Scheme> = scheme.map(str::parse).transpose().map_err(|e| raised(py, e))?;
    let mesh = Mesh::new(points(&vertices)?.to_vec(), faces(&face_parts.0, face_parts.1, face_parts.2.as_ref())?);
    let n = mesh.len();
    if let Some(v) = mesh.faces.corners().iter().find(|&&v| v as usize >= n) {
        return Err(PyValueError::new_err(format!("a face names vertex {v}, and there are {n}")));
    }
    let tags = tags(boundary.unwrap_or_default(), creases.as_ref(), corners.as_ref())?;
    let normals = normals.as_ref().map(|normals| points_of(normals, n, "normals")).transpose()?;
    let has_tags = boundary.is_some() || creases.is_some() || corners.is_some();
    for &v in tags.creases.iter().flat_map(|(ends, _)| ends).chain(tags.corners.iter().map(|(v, _)| v)) {
        require_length(n.max(v as usize + 1), n, "creases and corners")?;
    }
    let options = WriteOptions {
        normals,
        subdivision: scheme.map_or(Subdivision::None, Scheme::subdivision),
        tags: has_tags.then_some(&tags),
        ascii,
        comments: &comments,
        ..WriteOptions::default()
    };
    py.detach(|| io::write_control(&path, &mesh, &options)).map_err(|e| raised(py, e))
}
