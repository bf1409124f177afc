//! MESH arguments: files or built-in names, noise, scheme, validation.

use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};

use super::CommonFlags;
use crate::assemble::{LimitSystem, Scheme};
use crate::error::{Error, Result};
use crate::interpolate::automatic::{Renumbered, renumbered, require_memory};
use crate::mesh::io::{self, Loaded};
use crate::mesh::noise::{Noise, add_noise};
use crate::mesh::validate::{Boundary, Validation, validate};
use crate::mesh::{Mesh, Topology, builtin};

/// How a mesh is read and prepared.
#[derive(Args, Clone, Debug)]
pub struct MeshFlags {
    /// Scheme: catmull-clark, loop, sqrt3, nasri or zheng-cai; loop on triangles, else catmull-clark, unless told
    #[arg(long, value_name = "NAME")]
    pub scheme: Option<Scheme>,
    /// Move every vertex by a Gaussian of standard deviation A × the mean edge length, from SEED (1 unless told)
    #[arg(long, value_name = "A[:SEED]")]
    pub noise: Option<Noise>,
    /// An open mesh: refuse it, or treat boundary vertices as interior (loop and sqrt3 only)
    #[arg(long, value_name = "refuse|as-interior", default_value_t = Boundary::Refuse)]
    pub boundary: Boundary,
    /// Print the whole report on the mesh's defects as JSON and stop
    #[arg(long)]
    pub defects: bool,
}

/// A valid mesh and the scheme that is meant.
pub struct Input {
    /// As the user named it.
    pub name: String,
    /// The name, with the noise if there is any: for tables and plots.
    pub label: String,
    pub mesh: Mesh,
    topology: OnceLock<Topology>,
    renumbered: Option<(Renumbered, Topology)>,
    pub scheme: Scheme,
    /// Reading the file or making the built-in mesh.
    pub read_seconds: f64,
    /// Validation and topology.
    pub check_seconds: f64,
}

/// The noise that built-in meshes carry where they stand in for real ones.
pub const STAND_IN_NOISE: Noise = Noise { amplitude: 0.1, seed: 1 };

/// Endings that mark a MESH argument as a file.
const ENDINGS: [&str; 3] = ["obj", "off", "ply"];

/// Whether a name ends as mesh files do.
pub(super) fn has_mesh_ending(path: &Path) -> bool {
    path.extension().is_some_and(|e| ENDINGS.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

impl MeshFlags {
    /// Gives built-in meshes that stand in for real ones their noise, unless the user chose another.
    pub fn default_noise(&mut self) {
        self.noise.get_or_insert(STAND_IN_NOISE);
    }

    /// Reads the file, or makes the built-in mesh, called `name`.
    ///
    /// # Errors
    /// As the readers; an unknown name lists the built-in ones.
    pub fn load(&self, name: &str) -> Result<Loaded> {
        let path = Path::new(name);
        if has_mesh_ending(path) || path.exists() {
            return io::read(path);
        }
        Ok(Loaded {
            name: name.to_owned(),
            mesh: builtin::builtin(name)?,
            lines: None,
            normals: None,
            remarks: Vec::new(),
        })
    }

    /// Loads, moves and validates one mesh, and settles the scheme. `None` if `--defects` was asked for: the report
    /// has been printed.
    ///
    /// # Errors
    /// As [`load`](Self::load); a mesh with defects, with their counts and first places.
    pub fn input(&self, name: &str, common: &CommonFlags) -> Result<Option<Input>> {
        let start = Instant::now();
        let mut loaded = self.load(name)?;
        let read_seconds = start.elapsed().as_secs_f64();
        for remark in &loaded.remarks {
            common.remark(format_args!("{name}: {remark}"));
        }
        require_memory(&loaded.mesh).map_err(|e| Error::mesh(name, e.to_string()))?;
        let start = Instant::now();
        if let Some(noise) = self.noise {
            add_noise(&mut loaded.mesh, noise.amplitude, noise.seed);
        }
        let (report, renumbered) = self.report(&loaded);
        if self.defects {
            let json = serde_json::to_string_pretty(&report).map_err(|e| Error::Computation(format!("{name}: {e}")))?;
            super::print(&json)?;
            return Ok(None);
        }
        for remark in &report.remarks {
            common.remark(format_args!("{name}: {remark}"));
        }
        let found = report.into_topology(name)?;
        let (topology, renumbered) = match renumbered {
            Some(renumbered) => (OnceLock::new(), Some((renumbered, found))),
            None => (OnceLock::from(found), None),
        };
        let mesh = loaded.mesh;
        let scheme = self.scheme.unwrap_or_else(|| {
            let scheme = Scheme::default_for(&mesh.faces);
            common.remark(format_args!("{name}: scheme {scheme} (choose with --scheme)"));
            scheme
        });
        let label = match self.noise {
            Some(noise) => format!("{name} --noise {noise}"),
            None => name.to_owned(),
        };
        Ok(Some(Input {
            name: name.to_owned(),
            label,
            mesh,
            topology,
            renumbered,
            scheme,
            read_seconds,
            check_seconds: start.elapsed().as_secs_f64(),
        }))
    }

    /// The validator's report on a loaded mesh, or on this mesh renumbered.
    fn report(&self, loaded: &Loaded) -> (Validation, Option<Renumbered>) {
        let mesh = &loaded.mesh;
        if let Some(moved) = renumbered(mesh) {
            // Looking for what is not there is many times faster on a renumbered copy. What is there needs the
            // file's own numbers.
            let report = validate(&moved.mesh, None, self.boundary);
            if report.is_valid() && report.remarks.is_empty() {
                return (report, Some(moved));
            }
        }
        let lines = loaded.lines.as_ref().map(|l| (l.vertices.as_slice(), l.faces.as_slice()));
        (validate(mesh, lines, self.boundary), None)
    }
}

impl Input {
    /// The topology of the mesh; found when it is first asked for, if the validator looked at a renumbered mesh.
    pub fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| Topology::new(&self.mesh.faces, self.mesh.len()))
    }

    /// The mesh along a space-filling curve and the topology of that, where the file is scattered.
    pub fn renumbered(&self) -> Option<(&Renumbered, &Topology)> {
        self.renumbered.as_ref().map(|(mesh, topology)| (mesh, topology))
    }

    /// A stem for file names: the program's `prefix`, the mesh's own name without folder and ending, the scheme.
    pub fn stem(&self, prefix: &str) -> String {
        let path = Path::new(&self.name);
        let name = if has_mesh_ending(path) { path.file_stem() } else { path.file_name() };
        let name = name.unwrap_or_default().to_string_lossy();
        let plain: String = name.chars().map(|c| if c.is_alphanumeric() || c == '_' { c } else { '-' }).collect();
        format!("{prefix}-{plain}-{}", self.scheme)
    }

    /// The JSON object of one mesh: what every program tells of it, and `fields`.
    ///
    /// # Panics
    /// If `fields` is not an object.
    pub fn json(&self, fields: Value) -> Value {
        let mut object = json!({
            "mesh": self.name,
            "scheme": self.scheme.name(),
            "vertices": self.mesh.len(),
            "faces": self.mesh.faces.len(),
        });
        let (Value::Object(all), Value::Object(more)) = (&mut object, fields) else {
            panic!("the fields of a JSON object")
        };
        all.extend(more);
        object
    }

    /// Assembles the limit system.
    ///
    /// # Errors
    /// As [`LimitSystem::new`], with the mesh's name.
    pub fn system(&self) -> Result<LimitSystem> {
        LimitSystem::new(&self.mesh, self.topology(), self.scheme).map_err(|e| self.named(e))
    }

    /// An error of a computation with the mesh's name.
    pub fn named(&self, error: Error) -> Error {
        Error::mesh(&self.name, error.to_string())
    }
}
