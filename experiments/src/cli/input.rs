//! MESH arguments: files or built-in names, noise, scheme, validation.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use glam::DVec3;
use serde_json::{Value, json};

use super::{CommonFlags, StopFlags, advice, print_results};
use crate::report::Provenance;
use crate::report::provenance::Source;
use limitlab::assemble::Stages;
use limitlab::error::{Error, Result, counted, short};
use limitlab::interpolate::solver::require_memory;
use limitlab::mesh::attributes::Attributes;
use limitlab::mesh::features::{Features, Rule, SHARP, Tags, creases_by_angle};
use limitlab::mesh::file_tags::{FileTags, Subdivision};
use limitlab::mesh::frame::Frame;
use limitlab::mesh::io::{self, Format, Loaded, has_mesh_ending};
use limitlab::mesh::noise::{Noise, move_vertices};
use limitlab::mesh::origin::{Numbers, Origin};
use limitlab::mesh::repair::{Repair, Repaired, repair};
use limitlab::mesh::usd::StageMetadata;
use limitlab::mesh::validate::{Boundary, validate};
use limitlab::mesh::weld::{seams, weld};
use limitlab::mesh::{Mesh, Surface, bounding_box, builtin, vertex_data};
use limitlab::schemes::Scheme;
use limitlab::solvers::Stop;

/// How a mesh is read and prepared.
#[derive(Args, Clone, Debug, Default)]
pub struct MeshFlags {
    /// Scheme: catmull-clark, loop, sqrt3, nasri, zheng-cai or mid-edge; loop on triangles, else catmull-clark, unless told
    #[arg(long, value_name = "NAME")]
    pub scheme: Option<Scheme>,
    /// Move every vertex by a Gaussian of standard deviation A × the mean edge length, from SEED (1 unless told)
    #[arg(long, value_name = "A[:SEED]")]
    pub noise: Option<Noise>,
    /// An open mesh: edge-and-corner (boundary edges are sharp, vertices with one face are corners) unless told here or in
    /// the file, edge-only (the curve is smooth there), as-interior (boundary vertices as interior ones: loop, sqrt3 and mid-edge only) or refuse
    #[arg(long, value_name = "RULE")]
    pub boundary: Option<Boundary>,
    /// The format of a mesh on standard input or output, whose name is -: obj, off, ply or usda; of input stl or
    /// gltf (both .glb and .gltf), too
    #[arg(long, value_name = "NAME")]
    pub format: Option<Format>,
    /// Make one vertex of those at the same position: seams are closed; the control mesh keeps the file's vertices
    #[arg(long)]
    pub weld: bool,
    /// Mend what can be mended without moving a vertex: drop vertices of no face, repeated corners and doubled faces, turn
    /// faces to agree, cut edges with more than two faces and vertices between sheets; says what it did. The control mesh
    /// keeps the file's vertices; copies of those that were cut come after them
    #[arg(long)]
    pub repair: bool,
    /// Sharp edges, beside those of the mesh file (.usda, .obj): a file with lines `a b sharpness`, vertices numbered from
    /// 0; 10 and more is sharp for ever, less is taken 1 at each level (semi-sharp: catmull-clark and loop)
    #[arg(long, value_name = "FILE")]
    pub creases: Option<PathBuf>,
    /// Sharp vertices, beside those of the mesh file (.usda, .obj): a file with lines `vertex sharpness`
    #[arg(long, value_name = "FILE")]
    pub corners: Option<PathBuf>,
    /// Make edges sharp whose faces meet at more than this angle between their normals, in degrees
    #[arg(long, value_name = "DEG", value_parser = angle)]
    pub crease_angle: Option<f64>,
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
    /// Its positions are given in [`frame`](Self::frame).
    pub surface: Surface,
    /// Where the file's own points lie: all lengths of this mesh times [`Frame::scale`] are in mesh units.
    pub frame: Frame,
    pub scheme: Scheme,
    /// CRC-32 of the bytes of the file, or of the label of a built-in mesh.
    pub checksum: u32,
    /// What is sharp, by the file and by the flags. The rule of the boundary is to refuse it where there is none.
    pub tags: Tags,
    /// What the file says of its faces beyond what is computed with.
    pub attributes: Attributes,
    /// What the file says of all coordinates in it.
    pub stage: StageMetadata,
    /// Where the vertices of the file went, with --weld and --repair.
    pub origin: Option<Origin>,
    /// What was mended, with --repair.
    pub repairs: Vec<Repair>,
    /// Reading the file or making the built-in mesh.
    pub read_seconds: f64,
    /// Validation and topology.
    pub check_seconds: f64,
}

/// A mesh after --weld and --repair.
struct Mended {
    mesh: Mesh,
    origin: Option<Origin>,
    repairs: Vec<Repair>,
    numbers: Numbers,
}

/// What stands for standard input and output where a file may be named.
pub const STANDARD_STREAM: &str = "-";

/// The noise that built-in meshes carry where they stand in for real ones.
pub const STAND_IN_NOISE: Noise = Noise { amplitude: 0.1, seed: 1 };

/// An angle between normals.
fn angle(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (0.0..=180.0).contains(&x) => Ok(x),
        _ => Err("an angle from 0 to 180 is needed".into()),
    }
}

/// The size of a length in words.
fn one_digit(x: f64) -> String {
    short(format!("{x:.0e}").parse().unwrap_or(x))
}

impl MeshFlags {
    /// Built-in meshes where none is named, with the noise of real ones unless the user chose another.
    pub fn or_built_in(&mut self, names: &mut Vec<String>, built_in: &[&str]) {
        if names.is_empty() {
            names.extend(built_in.iter().map(|name| (*name).to_owned()));
            self.noise.get_or_insert(STAND_IN_NOISE);
        }
    }

    /// Reads the file or standard input, or makes the built-in mesh, called `name`.
    ///
    /// # Errors
    /// As the readers; standard input without its format; an unknown name lists the built-in ones.
    pub fn load(&self, name: &str) -> Result<Loaded> {
        let path = Path::new(name);
        if name == STANDARD_STREAM {
            let what = "it has no name that tells the format: give --format obj, off, ply, usda, stl or gltf";
            let format = self.format.ok_or_else(|| Error::mesh("standard input", what))?;
            return io::read_from(std::io::stdin().lock(), format, Path::new("standard input"));
        }
        if path.is_dir() {
            let what = "it is a folder, and a mesh is needed: a file, or a built-in name (a folder is a system if it holds \
                        M.mtx and P.mtx; compare-solvers, sweep-omega and spectrum take it)";
            return Err(Error::mesh(name, what));
        }
        if has_mesh_ending(path) || path.exists() {
            return io::read(path);
        }
        if path.components().count() > 1 {
            // No built-in mesh is called so, and a list of them is no help.
            let what = "there is no such file";
            return Err(Error::io(path, "read", std::io::Error::new(std::io::ErrorKind::NotFound, what)));
        }
        Ok(Loaded {
            name: name.to_owned(),
            mesh: builtin::builtin(name)?,
            lines: None,
            normals: None,
            tags: FileTags::default(),
            attributes: Attributes::default(),
            subdivision: None,
            stage: StageMetadata::default(),
            checksum: None,
            remarks: Vec::new(),
        })
    }

    /// With `--defects`, prints what the validator says of the meshes, as their points were given: the report on one, or
    /// `{"results": […]}` of several. Whether that was asked for, and the program has nothing else to do.
    ///
    /// # Errors
    /// As [`load`](Self::load); if standard output cannot be written.
    pub fn print_defects<N: AsRef<str>>(
        &self,
        names: &[N],
        common: &CommonFlags,
        provenance: &Provenance,
    ) -> Result<bool> {
        if !self.defects {
            return Ok(false);
        }
        let mut results = Vec::with_capacity(names.len());
        for name in names {
            let loaded = self.loaded(name.as_ref(), common)?;
            results.push(json!(validate(&loaded.mesh, in_lines(&loaded.lines), self.rule(&loaded.tags))));
        }
        print_results(results, provenance)?;
        Ok(true)
    }

    /// A mesh that has been read and that memory can hold.
    fn loaded(&self, name: &str, common: &CommonFlags) -> Result<Loaded> {
        let loaded = self.load(name)?;
        for remark in &loaded.remarks {
            common.remark(format_args!("{}: {remark}", loaded.name));
        }
        require_memory(&loaded.mesh).map_err(|e| Error::mesh(&loaded.name, e.to_string()))?;
        Ok(loaded)
    }

    /// Loads and validates one mesh, moves its points, and settles their frame and the scheme.
    ///
    /// # Errors
    /// As [`load`](Self::load); a mesh with defects, with their counts and first places; noise, or sizes side by side,
    /// that doubles cannot hold.
    pub fn input(&self, name: &str, common: &CommonFlags) -> Result<Input> {
        let start = Instant::now();
        let loaded = self.loaded(name, common)?;
        let read_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let Loaded { name, mesh, mut lines, tags, mut attributes, subdivision, stage, checksum, .. } = loaded;
        let name = &name[..];
        let rule = self.rule(&tags);
        let Mended { mesh, origin, repairs, numbers } =
            self.mended(name, mesh, &mut lines, &mut attributes, rule, common);
        let surface = Surface::examined(mesh, in_lines(&lines), rule).map_err(|mut report| {
            // What is repaired is valid; faces have their numbers yet.
            for defect in &mut report.defects {
                [&mut defect.vertex, &mut defect.other_vertex]
                    .into_iter()
                    .flatten()
                    .for_each(|v| *v = numbers.vertex(*v));
            }
            report.remarks.iter().for_each(|remark| common.remark(format_args!("{name}: {remark}")));
            Error::mesh(name, advice::of_defects(&report))
        })?;
        self.check_seams(name, &surface, &repairs, &numbers, common)?;
        let (mut surface, tags) = self.with_tags(name, surface, &tags, origin.as_ref())?;
        for remark in surface.remarks(&numbers) {
            common.remark(format_args!("{name}: {remark}"));
        }
        let frame = self.place(&mut surface).map_err(|(v, what)| {
            let line = lines.as_ref().map_or_else(String::new, |l| format!(", line {}", l.vertices[v]));
            let v = origin.as_ref().map_or(v as u32, |origin| origin.sources()[v]);
            Error::mesh(name, format!("vertex {v}{line}: {what}"))
        })?;
        let scheme = self.scheme.unwrap_or_else(|| {
            let scheme = Scheme::default_for(surface.faces());
            common.remark(format_args!("{name}: scheme {scheme} (choose with --scheme)"));
            scheme
        });
        if let Some(asked) = subdivision.filter(|&asked| asked != Subdivision::None && asked != scheme.subdivision()) {
            common.remark(format_args!("{name}: the file asks for {asked} (choose with --scheme)"));
        }
        let label = match self.noise {
            Some(noise) => format!("{name} --noise {noise}"),
            None => name.to_owned(),
        };
        Ok(Input {
            name: name.to_owned(),
            checksum: checksum.unwrap_or_else(|| crc32fast::hash(label.as_bytes())),
            label,
            surface,
            frame,
            scheme,
            tags,
            attributes,
            stage,
            origin,
            repairs,
            read_seconds,
            check_seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// Welds and repairs, as the flags say, unless a face names a vertex that is not there, which validation tells; repairs
    /// only if no defect is left then, so that errors are about the mesh as it was given.
    fn mended(
        &self,
        name: &str,
        file: Mesh,
        lines: &mut Option<io::Lines>,
        attributes: &mut Attributes,
        rule: Boundary,
        common: &CommonFlags,
    ) -> Mended {
        let n = file.len();
        let is_asked = self.weld || self.repair;
        if !is_asked || file.faces.corners().iter().any(|&v| v as usize >= n) {
            return Mended { mesh: file, origin: None, repairs: Vec::new(), numbers: Numbers::default() };
        }
        let welded = self.weld.then(|| weld(&file));
        if let Some(welded) = &welded {
            common.remark(format_args!(
                "{name}: {} at {}",
                counted(n, "vertex"),
                counted(welded.mesh.len(), "position")
            ));
        }
        // The first vertex at each position.
        let first = welded.as_ref().map(|welded| {
            let mut first = vec![0; welded.mesh.len()];
            (0..n).rev().for_each(|v| first[welded.place[v] as usize] = v as u32);
            first
        });
        let mesh = welded.as_ref().map_or(&file, |welded| &welded.mesh);
        let is_mended = |r: &Repaired| !r.repairs.is_empty() && validate(&r.mesh, None, rule).is_valid();
        let repaired = self.repair.then(|| repair(mesh)).flatten().filter(is_mended);
        let (mesh, kept, repairs) = match repaired {
            None => (welded.map_or_else(|| file.clone(), |welded| welded.mesh), None, Vec::new()),
            Some(Repaired { mesh, faces, corners, mut repairs }) => {
                if let Some(first) = &first {
                    repairs.iter_mut().for_each(|r| r.vertices.iter_mut().for_each(|v| *v = first[*v as usize]));
                }
                *attributes = attributes.of_corners(&faces, &corners);
                if let Some(lines) = lines {
                    lines.faces = faces.iter().map(|&f| lines.faces[f as usize]).collect();
                }
                (mesh, Some((faces, corners)), repairs)
            }
        };
        for repair in &repairs {
            common.remark(format_args!("{name}: repaired: {repair}"));
        }
        let origin = Origin::new(&file, &mesh, kept.as_ref().map(|(_, corners)| &corners[..]));
        if let Some(lines) = lines {
            // Every vertex of a repaired mesh has a face; a welded one may have defects to be told.
            let sources = if repairs.is_empty() { first.as_deref() } else { Some(origin.sources()) };
            if let Some(sources) = sources {
                lines.vertices = sources.iter().map(|&v| lines.vertices[v as usize]).collect();
            }
        }
        let numbers = match kept {
            None => Numbers { vertices: first, faces: None },
            Some((faces, _)) => Numbers { vertices: Some(origin.numbers()), faces: Some(faces) },
        };
        Mended { mesh, origin: Some(origin), repairs, numbers }
    }

    /// What boundary edges are: by the flag, by the file, or as the programs take them.
    fn rule(&self, of_file: &FileTags) -> Boundary {
        self.boundary.or(of_file.boundary).unwrap_or(Boundary::EdgeAndCorner)
    }

    /// Refuses a mesh of whose boundary nine tenths are a seam, unless the flag says that it is wanted, or sheets were cut
    /// apart: files say what boundaries are whether there are any or not.
    fn check_seams(
        &self,
        name: &str,
        surface: &Surface,
        repairs: &[Repair],
        numbers: &Numbers,
        common: &CommonFlags,
    ) -> Result<()> {
        if self.boundary.is_some() || repairs.iter().any(Repair::is_cut) {
            return Ok(());
        }
        let Some((edges, ends)) = seams(surface) else { return Ok(()) };
        let [a, b] = ends.map(|v| numbers.vertex(v));
        let all = surface.boundary_edges();
        let of = if edges == all { format!("all {all}") } else { format!("{edges} of {all}") };
        // Real openings have seams at their ends now and then.
        if 10 * edges < 9 * all {
            common.remark(format_args!(
                "{name}: {of} boundary edges lie on each other (first: vertices {a} and {b}): seams, which --weld closes"
            ));
            return Ok(());
        }
        let which = if self.weld { "" } else { "use --weld to make one of them, or " };
        Err(Error::mesh(
            name,
            format!(
                "{of} boundary edges lie on each other (first: vertices {a} and {b}): a seam of duplicate vertices \
                 at the same positions, no opening; {which}use --boundary edge-and-corner to keep it open"
            ),
        ))
    }

    /// The mesh with the sharp edges and vertices that its file and the flags ask for, and these.
    fn with_tags(
        &self,
        name: &str,
        surface: Surface,
        of_file: &FileTags,
        origin: Option<&Origin>,
    ) -> Result<(Surface, Tags)> {
        let rule = self.rule(of_file);
        let rule_there = if surface.is_closed() { Boundary::Refuse } else { rule };
        if of_file.is_empty() && self.creases.is_none() && self.corners.is_none() && self.crease_angle.is_none() {
            return Ok((surface, Tags { boundary: rule_there, ..Tags::default() }));
        }
        let mut tags = of_file.checked(Path::new(name), &surface, origin, rule)?;
        if let Some(path) = &self.creases {
            tags.creases.extend(vertex_data::creases(path, &surface, origin)?);
        }
        if let Some(degrees) = self.crease_angle {
            tags.creases.extend(creases_by_angle(&surface, degrees).into_iter().map(|ends| (ends, SHARP)));
        }
        if let Some(path) = &self.corners {
            tags.corners.extend(vertex_data::corners(path, &surface, origin)?);
        }
        let surface = surface.into_tagged(&tags).map_err(|e| Error::mesh(name, e.to_string()))?;
        Ok((surface, Tags { boundary: rule_there, ..tags }))
    }

    /// Adds the noise to the points of a valid mesh, and takes them to their frame; or a vertex, and what is wrong there.
    fn place(&self, surface: &mut Surface) -> std::result::Result<Frame, (usize, String)> {
        if let Some(noise) = self.noise {
            move_vertices(surface, noise.amplitude, noise.seed);
            if let Some(v) = surface.positions().iter().position(|p| !p.is_finite()) {
                return Err((v, format!("--noise {noise} moves it beyond the largest double: choose a smaller one")));
            }
        }
        let frame = Frame::of(surface.positions()).map_err(|v| {
            let what = "a coordinate is more than 10^300 times smaller than the largest of the mesh, and doubles cannot \
                        hold both: correct it, or set it to 0";
            (v, what.to_owned())
        })?;
        frame.enter(surface.positions_mut());
        Ok(frame)
    }
}

/// [`Input::file_mesh`] of its parts.
pub(super) fn file_mesh(surface: &Surface, frame: &Frame, origin: Option<&Origin>) -> Mesh {
    let mut points = surface.positions().to_vec();
    frame.leave(&mut points);
    match origin {
        Some(origin) => origin.written(&points),
        None => Mesh::new(points, surface.faces().clone()),
    }
}

/// [`Input::file_values`] of its parts.
pub(super) fn file_values(origin: Option<&Origin>, values: &[f64]) -> Vec<f64> {
    origin.map_or_else(|| values.to_vec(), |origin| origin.spread(values))
}

/// The lines of vertices and faces.
fn in_lines(lines: &Option<io::Lines>) -> Option<(&[u32], &[u32])> {
    lines.as_ref().map(|l| (l.vertices.as_slice(), l.faces.as_slice()))
}

/// A name with hyphens for what does not belong in the names of files.
pub(super) fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '_' { c } else { '-' }).collect()
}

/// One JSON object of the fields of two.
///
/// # Panics
/// If one is no object.
pub(super) fn all_fields(mut object: Value, fields: Value) -> Value {
    let (Value::Object(all), Value::Object(more)) = (&mut object, fields) else {
        panic!("the fields of a JSON object")
    };
    all.extend(more);
    object
}

impl Input {
    /// When iterations on this mesh stop; the tolerance is one in its frame.
    ///
    /// # Errors
    /// A relative tolerance where all points coincide.
    pub fn stop(&self, flags: &StopFlags) -> Result<Stop> {
        flags.rule(self.surface.diagonal(), self.frame.scale()).map_err(|what| Error::mesh(&self.name, what))
    }

    /// The number of vertices of the file.
    pub fn file_len(&self) -> usize {
        self.origin.as_ref().map_or(self.surface.len(), Origin::vertices)
    }

    /// Values of the file's vertices as values of the surface's: of those that were made one the first that is not `absent`,
    /// and the same for all that one became.
    ///
    /// # Panics
    /// If there is not one a vertex of the file.
    pub fn joined<T: Clone + PartialEq>(&self, values: Vec<T>, absent: T) -> Vec<T> {
        assert_eq!(values.len(), self.file_len(), "one value a vertex of the file");
        let Some(origin) = &self.origin else { return values };
        let mut joined = vec![absent.clone(); self.surface.len()];
        for (v, value) in (0..).zip(values) {
            for there in origin.of_vertex(v) {
                let slot = &mut joined[there as usize];
                if *slot == absent {
                    *slot = value.clone();
                }
            }
        }
        joined
    }

    /// The points as they were given, with their noise: in mesh units.
    pub fn given_points(&self) -> Cow<'_, [DVec3]> {
        let mut points = Cow::Borrowed(self.surface.positions());
        if !self.frame.is_identity() {
            self.frame.leave(points.to_mut());
        }
        points
    }

    /// The mesh as it was given, with its noise, in mesh units and in the vertices that are written for those of the file.
    pub fn file_mesh(&self) -> Mesh {
        file_mesh(&self.surface, &self.frame, self.origin.as_ref())
    }

    /// Numbers at the vertices of the surface for those of [`file_mesh`](Self::file_mesh).
    pub fn file_values(&self, values: &[f64]) -> Vec<f64> {
        file_values(self.origin.as_ref(), values)
    }

    /// What is sharp, in the vertices that are written for those of the file: on every face at the edge, and at every vertex
    /// there.
    pub fn file_tags(&self) -> Cow<'_, Tags> {
        let Some(origin) = &self.origin else { return Cow::Borrowed(&self.tags) };
        let place: Vec<Option<u32>> = origin.places().collect();
        let ordered = |[a, b]: [u32; 2]| if a < b { [a, b] } else { [b, a] };
        let mut sharp: Vec<_> = self.tags.creases.iter().map(|&(ends, sharpness)| (ordered(ends), sharpness)).collect();
        // Of an edge that is named twice the greater one counts, and comes first.
        sharp.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        sharp.dedup_by_key(|&mut (ends, _)| ends);
        let mut creases = Vec::new();
        if !sharp.is_empty() {
            for face in origin.faces().iter() {
                for (k, &a) in face.iter().enumerate() {
                    let ends = [a, face[(k + 1) % face.len()]];
                    let [Some(from), Some(to)] = ends.map(|v| place[v as usize]) else { continue };
                    let there = ordered([from, to]);
                    if let Ok(at) = sharp.binary_search_by_key(&there, |&(ends, _)| ends) {
                        creases.push((ordered(ends), sharp[at].1));
                    }
                }
            }
        }
        creases.sort_by_key(|&(ends, _)| ends);
        creases.dedup_by_key(|&mut (ends, _)| ends);
        let mut sharpness = vec![0.0_f64; self.surface.len()];
        for &(v, s) in &self.tags.corners {
            sharpness[v as usize] = s.max(sharpness[v as usize]);
        }
        let at = |v: usize| place[v].map_or(0.0, |there| sharpness[there as usize]);
        let corners = (0..place.len()).filter(|&v| at(v) > 0.0).map(|v| (v as u32, at(v))).collect();
        Cow::Owned(Tags { boundary: self.tags.boundary, creases, corners })
    }

    /// The largest coordinate of the given points, in mesh units.
    fn largest_coordinate(&self) -> f64 {
        let (lo, hi) = bounding_box(self.surface.positions()).unwrap_or_default();
        self.frame.back(lo).abs().max(self.frame.back(hi).abs()).max_element()
    }

    /// What to know of a tolerance, in mesh units, that the digits of the coordinates cannot hold, though it can be
    /// reached in the frame.
    pub fn remark_on_rounding(&self, tolerance: f64) -> Option<String> {
        let largest = self.largest_coordinate();
        let digit = largest - largest.next_down();
        // Control points may have a coordinate twice as large as the points.
        (!self.frame.is_identity() && tolerance < 2.0 * digit).then(|| {
            format!(
                "the points lie at {} ± {}: their last digit is {digit:.1e}, the tolerance {tolerance:.1e}; results are \
                 as near as these digits allow",
                one_digit(largest),
                one_digit(0.5 * self.frame.scale() * self.surface.diagonal())
            )
        })
    }

    /// A stem for file names: the program's `prefix`, the mesh's own name without folder and ending, the scheme.
    pub fn stem(&self, prefix: &str) -> String {
        let path = Path::new(&self.name);
        let name = if has_mesh_ending(path) { path.file_stem() } else { path.file_name() };
        let name = name.unwrap_or_default().to_string_lossy();
        format!("{prefix}-{}-{}", plain(&name), self.scheme)
    }

    /// The mesh as it was given, for the provenance of files about it.
    pub fn source(&self) -> Source {
        let (vertices, faces) = (self.surface.len(), self.surface.faces().len());
        let size = format!("{}, {}", counted(vertices, "vertex"), counted(faces, "face"));
        Source { name: self.label.clone(), size, checksum: self.checksum }
    }

    /// The JSON object of one mesh: what every program tells of it, and `fields`.
    ///
    /// # Panics
    /// If `fields` is not an object.
    pub fn json(&self, fields: Value) -> Value {
        let features = self.surface.features();
        let count = |rule| features.map_or(0, |f| f.count(rule));
        let head = json!({
            "mesh": self.name,
            "hash": self.source().hash(),
            "scheme": self.scheme.name(),
            "vertices": self.surface.len(),
            "faces": self.surface.faces().len(),
            "boundary": self.surface.boundary_edges(),
            "creases": features.map_or(0, Features::creased_edges),
            "corners": count(Rule::Corner),
            "darts": count(Rule::Dart),
            "semi_sharp": count(Rule::SemiSharp),
            "repair": self.repairs,
            "blocks": {
                "corners": count(Rule::Corner),
                "curves": count(Rule::Crease),
                "stars": count(Rule::Dart) + count(Rule::SemiSharp),
                "smooth": features.map_or(self.surface.len(), |f| f.count(Rule::Smooth)),
            },
        });
        all_fields(head, fields)
    }

    /// Assembles the limit system in its stages.
    ///
    /// # Errors
    /// As [`Stages::new`], with the mesh's name.
    pub fn stages(&self) -> Result<Stages> {
        Stages::new(&self.surface, self.scheme, None).map_err(|e| self.named(e))
    }

    /// An error of a computation with the mesh's name, and the flags that help.
    pub fn named(&self, error: Error) -> Error {
        let what = match error {
            Error::Mesh { what, .. } => what,
            error => advice::of_error(&error, &self.surface),
        };
        Error::mesh(&self.name, what)
    }
}
