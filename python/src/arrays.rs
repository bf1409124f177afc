//! Arrays of NumPy into points, faces and marks, each by one copy, and back without one.

use glam::DVec3;
use limitlab::mesh::Faces;
use limitlab::solvers::{Errors, Recorded};
use numpy::ndarray::Array2;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Points, or other rows of numbers.
pub type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// The points of a contiguous (n, 3) array, as they lie there.
pub fn points<'a>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [DVec3]> {
    let refused = || PyValueError::new_err("points are a contiguous array of shape (n, 3)");
    if array.as_array().ncols() != 3 {
        return Err(refused());
    }
    Ok(bytemuck::cast_slice(array.as_slice().map_err(|_| refused())?))
}

/// As [`points`], one for each of `n` vertices.
pub fn points_of<'a>(array: &'a PyReadonlyArray2<'_, f64>, n: usize, what: &str) -> PyResult<&'a [DVec3]> {
    let points = points(array)?;
    require_length(points.len(), n, what)?;
    Ok(points)
}

/// Refuses an array that has not one entry a vertex.
pub fn require_length(found: usize, n: usize, what: &str) -> PyResult<()> {
    if found == n {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what}: {found} entries, and the mesh has {n} vertices: one each is needed")))
}

/// What has one entry a vertex, if it is there.
pub fn of_vertices<T: Element + Copy>(
    array: Option<&PyReadonlyArray1<'_, T>>,
    n: usize,
    what: &str,
) -> PyResult<Option<Vec<T>>> {
    let Some(array) = array else { return Ok(None) };
    let values: Vec<T> = array.as_array().iter().copied().collect();
    require_length(values.len(), n, what)?;
    Ok(Some(values))
}

/// Faces of `size` corners each, or from `offsets`.
pub fn faces(corners: &Bound<'_, PyAny>, size: usize, offsets: Option<&PyReadonlyArray1<'_, i64>>) -> PyResult<Faces> {
    let corners = if let Ok(array) = corners.cast::<PyArray1<i32>>() {
        short_indices(array.readonly().as_slice()?)?
    } else if let Ok(array) = corners.cast::<PyArray1<i64>>() {
        indices(array.readonly().as_slice()?)?
    } else {
        return Err(PyTypeError::new_err("the corners of faces are an array of int32 or int64"));
    };
    if u32::try_from(corners.len()).is_err() {
        return Err(PyValueError::new_err("faces with more corners than 32-bit indices name"));
    }
    let Some(offsets) = offsets else {
        if size == 0 || !corners.len().is_multiple_of(size) {
            return Err(PyValueError::new_err(format!("{} corners make no whole faces of {size}", corners.len())));
        }
        return Ok(Faces::of_size(size, corners));
    };
    let offsets = indices(offsets.as_slice()?)?;
    let ends = (offsets.first(), offsets.last().map(|&end| end as usize));
    if ends != (Some(&0), Some(corners.len())) || !offsets.is_sorted() {
        let what = format!("offsets of faces ascend from 0 to the number of corners, {}", corners.len());
        return Err(PyValueError::new_err(what));
    }
    Ok(Faces::from_parts(offsets, corners))
}

/// Indices of vertices; whether these exist is for the validator.
pub fn indices(values: &[i64]) -> PyResult<Vec<u32>> {
    // Seen all at once, which is many times faster than one by one.
    if values.iter().fold(0, |all, &v| all | v) >> 32 != 0 {
        let negative = values.iter().find(|&&v| u32::try_from(v).is_err());
        return Err(no_index(negative.copied().unwrap_or_default()));
    }
    Ok(values.iter().map(|&v| v as u32).collect())
}

fn short_indices(values: &[i32]) -> PyResult<Vec<u32>> {
    if values.iter().fold(0, |all, &v| all | v) < 0 {
        return Err(no_index(values.iter().find(|&&v| v < 0).copied().unwrap_or_default().into()));
    }
    Ok(bytemuck::cast_slice(values).to_vec())
}

fn no_index(v: i64) -> PyErr {
    PyValueError::new_err(format!("{v} is no index of a vertex: they are numbered from 0"))
}

/// (n, 3), in the memory of the points.
pub fn array_of(py: Python<'_>, points: Vec<DVec3>) -> Rows<'_> {
    let n = points.len();
    rows(py, n, 3, bytemuck::allocation::cast_vec(points))
}

/// (n, width), in the memory of the numbers, of which there are n·width.
pub fn rows(py: Python<'_>, n: usize, width: usize, numbers: Vec<f64>) -> Rows<'_> {
    debug_assert_eq!(numbers.len(), n * width);
    Array2::from_shape_vec((n, width), numbers).unwrap_or_default().into_pyarray(py)
}

/// (k, 3): iteration, maximum and mean error, in units of length of `unit`.
pub fn history<'py>(py: Python<'py>, history: &[Recorded], unit: f64) -> Rows<'py> {
    let row = |at: &Recorded| {
        let Errors { max, mean } = at.errors * unit;
        [at.iteration as f64, max, mean]
    };
    rows(py, history.len(), 3, history.iter().flat_map(row).collect())
}

/// Numbers of vertices, in their memory.
pub fn index_array(py: Python<'_>, indices: Vec<u32>) -> Bound<'_, PyArray1<i32>> {
    bytemuck::allocation::cast_vec::<u32, i32>(indices).into_pyarray(py)
}

/// (corners, number of corners of each face) or (corners, offsets).
pub fn face_arrays<'py>(py: Python<'py>, faces: &Faces) -> PyResult<(Bound<'py, PyArray1<i32>>, Bound<'py, PyAny>)> {
    let corners = index_array(py, faces.corners().to_vec());
    let second = match faces.uniform_size() {
        Some(size) => size.into_pyobject(py)?.into_any(),
        None => index_array(py, faces.offsets().to_vec()).into_any(),
    };
    Ok((corners, second))
}
