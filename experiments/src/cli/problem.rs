//! Linear systems named on the command line: that of a mesh, or one that a folder holds.

use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};

use super::input::{all_fields, file_mesh, file_values, plain};
use super::{CommonFlags, Input, MeshFlags, StopFlags};
use crate::report::provenance;
use limitlab::assemble::matrix_market::{self, is_missing};
use limitlab::assemble::{GeneralSystem, LimitSystem, Stages};
use limitlab::error::{Error, Result};
use limitlab::interpolate::{Watch, interpolate_watched, solve_stored};
use limitlab::mesh::features::Rule;
use limitlab::mesh::frame::Frame;
use limitlab::mesh::order::Order;
use limitlab::mesh::origin::Origin;
use limitlab::mesh::{Mesh, Surface, diagonal};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Solution, Stop};

/// What a program's results are about, in words and in JSON: a mesh under a scheme, or a folder.
pub struct Subject {
    /// As the user named it.
    pub name: String,
    /// What titles call it: the mesh with its noise and its scheme, or the folder.
    pub title: String,
    /// How large it is, in words.
    pub size: String,
    /// As it was given, for the provenance of files about it.
    pub source: provenance::Source,
    /// What errors are measured in.
    pub unit: &'static str,
    /// The end of the names of files.
    stem: String,
    head: Value,
}

impl Subject {
    /// The title of a picture, with no more of a path than the name of the file.
    pub fn caption(&self) -> String {
        match Path::new(&self.name).file_name() {
            Some(file) => self.title.replacen(&self.name, &file.to_string_lossy(), 1),
            None => self.title.clone(),
        }
    }

    /// A stem for file names, after the program's `prefix`.
    pub fn stem(&self, prefix: &str) -> String {
        format!("{prefix}{}", self.stem)
    }

    /// The JSON object of the program: what every program tells of a mesh or a system, and `fields`.
    ///
    /// # Panics
    /// If `fields` is not an object.
    pub fn json(&self, fields: Value) -> Value {
        all_fields(self.head.clone(), fields)
    }
}

impl Input {
    /// The size of the mesh in words, and that of its stages where there are several.
    fn size(&self) -> String {
        let whole = self.source().size;
        let Some(features) = self.surface.features() else { return whole };
        if features.has_stars() {
            let [darts, semi_sharp] = [Rule::Dart, Rule::SemiSharp].map(|rule| features.count(rule));
            return format!(
                "{whole}; the system of all vertices, {darts} darts and {semi_sharp} semi-sharp ones among them"
            );
        }
        let [smooth, curves, corners] = [Rule::Smooth, Rule::Crease, Rule::Corner].map(|rule| features.count(rule));
        format!("{whole}; the system of the {smooth} smooth vertices, after {curves} on curves and {corners} corners")
    }

    /// What results on this mesh are about.
    pub fn subject(&self) -> Subject {
        Subject {
            name: self.name.clone(),
            title: format!("{} under {}", self.label, self.scheme),
            size: self.size(),
            source: self.source(),
            unit: "mesh units",
            stem: self.stem(""),
            head: self.json(json!({})),
        }
    }
}

/// A system of anybody, as a folder holds it, with its points.
pub struct Given {
    pub subject: Subject,
    pub system: LimitSystem,
    /// In their [frame](Frame::of_size).
    pub points: Vec<DVec3>,
    frame: Frame,
}

impl Given {
    /// When iterations on this system stop.
    ///
    /// # Errors
    /// A relative tolerance where all points coincide.
    pub fn stop(&self, flags: &StopFlags) -> Result<Stop> {
        let rule = flags.rule(diagonal(&self.points), self.frame.scale());
        rule.map_err(|what| Error::mesh(&self.subject.name, what))
    }
}

/// A system with its points, whatever it comes from: a MESH, or a SYSTEM_DIR with M.mtx, H.mtx and P.mtx.
pub struct Problem {
    pub subject: Subject,
    source: Source,
    /// In units of [`scale`](Self::scale), as the tolerance of `stop` is: the right-hand side, and the start.
    points: Vec<DVec3>,
    start: Vec<DVec3>,
    pub stop: Stop,
    /// The order of in-place sweeps.
    pub order: Vec<u32>,
    /// Lengths in the units of the files are this many times those here.
    pub scale: f64,
    frame: Frame,
    /// Where the vertices of the file went, with --weld and --repair.
    origin: Option<Origin>,
}

/// Where a system comes from.
enum Source {
    Mesh(Surface, Scheme, Box<Stages>),
    /// With darts or semi-sharp vertices, and the first of these.
    Unsymmetric(Surface, Scheme, Box<GeneralSystem>, usize),
    Folder(Box<LimitSystem>),
}

/// The system of a problem.
pub enum Matrix<'a> {
    /// Of an open or creased mesh, that of its smooth vertices.
    Symmetric(&'a LimitSystem),
    /// Of all vertices of a mesh, where no diagonal makes it symmetric, and a vertex that is to blame.
    General(&'a GeneralSystem, usize),
}

impl Problem {
    /// The system.
    pub fn matrix(&self) -> Matrix<'_> {
        match &self.source {
            Source::Mesh(_, _, stages) => Matrix::Symmetric(stages.block()),
            Source::Unsymmetric(_, _, system, vertex) => Matrix::General(system, *vertex),
            Source::Folder(system) => Matrix::Symmetric(system),
        }
    }

    /// The mesh that the system is of, in units of [`scale`](Self::scale), its scheme, and the vertex of each row; `None` if
    /// the k-th row is that of vertex k.
    pub fn mesh(&self) -> Option<(&Surface, Scheme, Option<&[u32]>)> {
        match &self.source {
            Source::Mesh(surface, scheme, stages) => Some((surface, *scheme, stages.vertices())),
            Source::Unsymmetric(surface, scheme, ..) => Some((surface, *scheme, None)),
            Source::Folder(_) => None,
        }
    }

    /// As [`Input::file_mesh`]; `None` of a system without a mesh.
    pub fn file_mesh(&self) -> Option<Mesh> {
        self.mesh().map(|(surface, ..)| file_mesh(surface, &self.frame, self.origin.as_ref()))
    }

    /// As [`Input::file_values`].
    pub fn file_values(&self, values: &[f64]) -> Vec<f64> {
        file_values(self.origin.as_ref(), values)
    }

    /// The right-hand side, and the start of iterations.
    pub fn data(&self) -> (&[DVec3], &[DVec3]) {
        (&self.points, &self.start)
    }

    /// By `auto`, watched: the whole chain on a mesh, conjugate gradients and LDLᵀ on a system without one.
    ///
    /// # Errors
    /// As [`interpolate_watched`].
    pub fn auto(&self, watch: &mut Watch) -> Result<Solution> {
        match &self.source {
            Source::Mesh(surface, scheme, _) | Source::Unsymmetric(surface, scheme, ..) => {
                interpolate_watched(surface, *scheme, &self.stop.into(), watch)
            }
            Source::Folder(system) => Ok(solve_stored(system, &self.points, &self.stop, watch)),
        }
    }

    /// The diagonal of the bounding box of the points.
    pub fn diagonal(&self) -> f64 {
        match &self.source {
            Source::Mesh(surface, ..) | Source::Unsymmetric(surface, ..) => surface.diagonal(),
            Source::Folder(_) => diagonal(&self.points),
        }
    }
}

impl MeshFlags {
    /// The system that the folder `name` holds; `None` if it is no folder, or one without M.mtx.
    ///
    /// # Errors
    /// As [`read_system`](matrix_market::read_system); flags that are about meshes; points that doubles cannot hold
    /// together.
    pub fn given(&self, name: &str) -> Result<Option<Given>> {
        let path = Path::new(name);
        if !path.is_dir() || is_missing(&path.join("M.mtx")) {
            return Ok(None);
        }
        let (system, mut points) = matrix_market::read_system(path)?;
        let refuse = |what: String| Err(Error::mesh(name, what));
        let flags = [
            ("--scheme", self.scheme.is_some()),
            ("--noise", self.noise.is_some()),
            ("--boundary", self.boundary.is_some()),
            ("--creases", self.creases.is_some()),
            ("--corners", self.corners.is_some()),
            ("--crease-angle", self.crease_angle.is_some()),
            ("--weld", self.weld),
            ("--repair", self.repair),
        ];
        if let Some((flag, _)) = flags.into_iter().find(|f| f.1) {
            return refuse(format!("{flag} is about a mesh, and this is a system without one: leave it out"));
        }
        let frame = match Frame::of_size(&points) {
            Ok(frame) => frame,
            Err(i) => {
                return refuse(format!(
                    "row {i} of P: a number is more than 10^300 times smaller than the largest, and doubles cannot hold \
                     both: correct it, or set it to 0"
                ));
            }
        };
        frame.enter(&mut points);
        let (n, entries) = (system.len(), system.a.values().len());
        let size = format!("{n} rows, {entries} entries");
        let source = provenance::Source { name: name.to_owned(), size: size.clone(), checksum: checksum(path)? };
        let whole = path.canonicalize().unwrap_or_else(|_| path.into());
        let subject = Subject {
            name: name.to_owned(),
            title: name.to_owned(),
            size,
            unit: "units of P",
            stem: format!("-{}", plain(&whole.file_name().unwrap_or_default().to_string_lossy())),
            head: json!({
                "mesh": null, "hash": source.hash(), "scheme": null, "vertices": n, "faces": null, "system": name, "entries": entries,
            }),
            source,
        };
        Ok(Some(Given { subject, system, points, frame }))
    }

    /// The system of a mesh as [`input`](Self::input) gives it, or of a folder as [`given`](Self::given) does.
    ///
    /// # Errors
    /// As these two; a relative tolerance where all points coincide; an order by a mesh that is not there.
    pub fn problem(&self, name: &str, stop: &StopFlags, order: Order, common: &CommonFlags) -> Result<Problem> {
        let Some(given) = self.given(name)? else { return of_mesh(self.input(name, common)?, stop, order) };
        let Some(numbers) = order.of_numbers(given.system.len()) else {
            return Err(Error::mesh(
                name,
                format!(
                    "the order {order} goes by a mesh, and this is a system without one: use file, reverse or random"
                ),
            ));
        };
        Ok(Problem {
            stop: given.stop(stop)?,
            order: numbers,
            scale: given.frame.scale(),
            frame: given.frame,
            origin: None,
            subject: given.subject,
            source: Source::Folder(Box::new(given.system)),
            start: given.points.clone(),
            points: given.points,
        })
    }
}

/// CRC-32 of the bytes of M.mtx, H.mtx if it is there, and P.mtx, one after the other.
fn checksum(folder: &Path) -> Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    for file in ["M.mtx", "H.mtx", "P.mtx"].map(|name| folder.join(name)).iter().filter(|file| !is_missing(file)) {
        hasher.update(&std::fs::read(file).map_err(|e| Error::io(file, "read", e))?);
    }
    Ok(hasher.finalize())
}

fn of_mesh(input: Input, stop: &StopFlags, order: Order) -> Result<Problem> {
    let stages = input.stages()?;
    let known = stages.known(input.surface.positions());
    let points = input.surface.positions();
    let all = order.order(input.surface.mesh(), input.surface.incidence());
    let (points, start, order) = match stages.stars() {
        // All vertices at once.
        Some(_) => (points.to_vec(), points.to_vec(), all),
        None => (stages.right_hand_side(&known), stages.restricted(&known), stages.order(&all)),
    };
    Ok(Problem {
        stop: input.stop(stop)?,
        subject: input.subject(),
        points,
        start,
        order,
        scale: input.frame.scale(),
        frame: input.frame,
        origin: input.origin,
        source: match stages.stars().map(|stars| stars.vertices()[0] as usize) {
            Some(vertex) => Source::Unsymmetric(input.surface, input.scheme, Box::new(stages.whole()), vertex),
            None => Source::Mesh(input.surface, input.scheme, Box::new(stages)),
        },
    })
}
