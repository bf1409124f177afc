//! Options of single vertices: whether they are interpolated, normals, shape handles, α.

use crate::cli::Input;
use glam::DVec3;
use limitlab::Result;
use limitlab::error::Error;
use limitlab::interpolate::zheng_cai::Constraints;
use limitlab::mesh::vertex_data;

use super::arguments::ShapeFlags;

/// The flags about single vertices, one entry a vertex each.
pub struct VertexOptions {
    pub interpolated: Option<Vec<bool>>,
    pub normals: Option<Vec<Option<DVec3>>>,
    pub handles: Option<Vec<f64>>,
    pub alpha: Option<Vec<f64>>,
}

impl VertexOptions {
    pub fn read(flags: &ShapeFlags, input: &Input) -> Result<Self> {
        let n = input.file_len();
        let marks = flags.vertices.as_deref();
        let interpolated = marks.map(|t| vertex_data::vertex_marks(t, n)).transpose().map_err(|e| match e {
            Error::Unknown(what) => Error::Unknown(format!("--vertices: {what}")),
            other => other,
        })?;
        let interpolated = interpolated.map(|marks| input.joined(marks, false));
        let is_interpolated = |v: usize| interpolated.as_ref().is_none_or(|m| m[v]);
        let file = flags.normals.as_deref();
        let normals = file.map(|p| vertex_data::normals(p, n)).transpose()?;
        let mut normals = normals.map(|normals| input.joined(normals, None));
        let features = input.surface.features();
        let is_shaped = |v: usize| is_interpolated(v) && features.is_none_or(|features| features.is_smooth(v));
        if let Some(normals) = normals.as_mut().filter(|n| n.iter().all(Option::is_some)) {
            // A file with a normal for every vertex means those that can have one.
            for (v, normal) in normals.iter_mut().enumerate() {
                *normal = normal.filter(|_| is_shaped(v));
            }
        }
        // Those of the fairest surface are found from a surface with all at 1.
        let text = if flags.has_fair_handles() { Some("1") } else { flags.shape_handle.as_deref() };
        let handles = text.map(|t| vertex_data::numbers(t, n, 1.0)).transpose()?;
        let mut handles = handles.map(|handles| input.joined(handles, 1.0));
        if text.is_some_and(|t| t.parse::<f64>().is_ok()) {
            for (v, handle) in handles.iter_mut().flatten().enumerate() {
                *handle = if is_shaped(v) { *handle } else { 1.0 };
            }
        }
        let text = flags.alpha.as_deref();
        let alpha = text.map(|t| vertex_data::numbers(t, n, 0.0)).transpose()?;
        let mut alpha = alpha.map(|alpha| input.joined(alpha, 0.0));
        for (v, a) in alpha.iter_mut().flatten().enumerate() {
            if interpolated.as_ref().is_some_and(|m| m[v]) {
                *a = 1.0;
            }
        }
        Ok(VertexOptions { interpolated, normals, handles, alpha })
    }

    pub fn constraints(&self) -> Constraints<'_> {
        Constraints {
            interpolated: self.interpolated.as_deref(),
            normals: self.normals.as_deref(),
            handles: self.handles.as_deref(),
        }
    }
}
