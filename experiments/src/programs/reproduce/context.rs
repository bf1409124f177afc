//! Context of a run of `reproduce`: sources of meshes, the folder of results, the reports they are compared with.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::cli::{self, Printer, STAND_IN_NOISE};
use crate::report::{Animation, Figure, Format, Provenance, Table, compare};
use crate::studies::histories;
use glam::DVec3;
use limitlab::Result;
use limitlab::assemble::LimitSystem;
use limitlab::error::Error;
use limitlab::mesh::noise::{Noise, add_noise};
use limitlab::mesh::validate::{Boundary, Validation};
use limitlab::mesh::{Surface, builtin, io};
use limitlab::output::create_dir;
use limitlab::schemes::Scheme;
use limitlab::solvers::Recorded;

use serde_json::{Value as Json, json};

use crate::programs::reproduce::claims::Record;
use crate::programs::reproduce::corpus::{List, Model};

use crate::programs::reproduce::pages;

/// One table or figure.
pub struct Item {
    /// As in `--only ID`, and the stem of its files.
    pub id: &'static str,
    pub title: &'static str,
    /// What heads its section of the index; none of what the index begins with.
    pub question: Option<Question>,
    pub run: fn(&mut Context) -> Result<()>,
}

/// What an item asks, and its answer in a line, which holds on all meshes and names the claims that decide it.
pub struct Question {
    pub asks: &'static str,
    pub answer: &'static str,
}

/// The folder of the results on stand-ins, within the report folder.
pub const BUILT_IN: &str = "built-in";

/// A run of the program.
pub struct Context {
    root: PathBuf,
    models: Option<PathBuf>,
    pub quick: bool,
    /// Whether tables of wall-clock times are made.
    times: bool,
    check: Option<PathBuf>,
    formats: Vec<Format>,
    differences: Vec<String>,
    pub printer: Printer,
    /// The ledger of claims, once it is computed.
    pub ledger: Vec<Record>,
    /// What was made since it was last taken.
    pub made: Made,
    /// The ID of the item at work.
    item: Option<&'static str>,
    /// Tables that the item at work has made, and the files of its pictures that pages can show.
    tables: Vec<Table>,
    pictures: Vec<String>,
}

/// How much an item made.
#[derive(Default)]
pub struct Made {
    tables: usize,
    rows: usize,
    figures: usize,
    /// Pages of words: the ledger, the findings.
    pub pages: usize,
}

impl std::ops::AddAssign<&Made> for Made {
    fn add_assign(&mut self, more: &Made) {
        self.tables += more.tables;
        self.rows += more.rows;
        self.figures += more.figures;
        self.pages += more.pages;
    }
}

impl fmt::Display for Made {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = if self.rows == 1 { "1 row".into() } else { format!("{} rows", self.rows) };
        let parts = [
            (self.tables, format!("table of {rows}"), format!("tables of {rows}")),
            (self.figures, "figure".into(), "figures".into()),
            (self.pages, "page".into(), "pages".into()),
        ];
        let said: Vec<String> = parts
            .into_iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, one, several)| format!("{count} {}", if count == 1 { one } else { several }))
            .collect();
        if said.is_empty() { f.write_str("nothing") } else { f.write_str(&said.join(", ")) }
    }
}

/// A mesh with its name for the tables.
pub struct Subject {
    pub name: String,
    pub surface: Surface,
}

impl Subject {
    /// A built-in mesh as it is.
    ///
    /// # Errors
    /// If there is no such mesh.
    pub fn built_in(name: &str) -> Result<Self> {
        Ok(Subject { name: name.to_owned(), surface: Surface::new(builtin::builtin(name)?)? })
    }

    /// The limit system under `scheme`.
    ///
    /// # Errors
    /// As [`LimitSystem::new`], with the mesh's name.
    pub fn system(&self, scheme: Scheme) -> Result<LimitSystem> {
        LimitSystem::new(&self.surface, scheme).map_err(|e| Error::mesh(&self.name, e.to_string()))
    }

    /// Its name and points.
    pub fn points(&self) -> (&str, &[DVec3]) {
        (&self.name, self.surface.positions())
    }

    /// Whether the scheme is defined on the mesh's faces.
    pub fn suits(&self, scheme: Scheme) -> bool {
        scheme.first_unsuitable_face(self.surface.faces()).is_none()
    }
}

impl Context {
    pub fn new(
        root: &Path,
        models: Option<&Path>,
        quick: bool,
        times: bool,
        check: Option<&Path>,
        formats: &[Format],
        printer: Printer,
    ) -> Result<Self> {
        if let Some(folder) = models
            && !folder.join("closed").is_dir()
        {
            return Err(Error::Unknown(format!(
                "{}: no folder closed/ in it; --meshes names the folder with the models' folders closed/ and open/",
                folder.display()
            )));
        }
        if let Some(folder) = check
            && !folder.is_dir()
        {
            return Err(Error::Unknown(format!("{}: no such folder; --check names a report folder", folder.display())));
        }
        let context = Context {
            root: root.to_path_buf(),
            models: models.map(Path::to_path_buf),
            quick,
            times,
            check: check.map(Path::to_path_buf),
            formats: formats.to_vec(),
            differences: Vec::new(),
            printer,
            ledger: Vec::new(),
            made: Made::default(),
            item: None,
            tables: Vec::new(),
            pictures: Vec::new(),
        };
        create_dir(&context.folder())?;
        Ok(context)
    }

    /// Whether the real models are at hand.
    pub fn real(&self) -> bool {
        self.models.is_some()
    }

    /// Where this run's results go.
    pub fn folder(&self) -> PathBuf {
        self.within(&self.root)
    }

    fn within(&self, root: &Path) -> PathBuf {
        if self.real() { root.to_path_buf() } else { root.join(BUILT_IN) }
    }

    /// What the tables say about their meshes.
    pub fn note_on_meshes(&self) -> String {
        if self.real() {
            "Meshes: real models, named by their files (PSB m… are models of the Princeton Shape Benchmark), in file \
             coordinates."
                .into()
        } else {
            format!(
                "Meshes: built-in stand-ins, not the paper's models, with noise {STAND_IN_NOISE} (amplitude × mean \
                 edge length : seed); run with --meshes DIR for the models."
            )
        }
    }

    /// What a picture calls a mesh of [`subject`](Self::subject), [`list`](Self::list) or [`subjects`](Self::subjects).
    pub fn caption(&self, subject: &Subject) -> String {
        if self.real() {
            subject.name.clone()
        } else {
            format!("{} with noise {}", subject.name, STAND_IN_NOISE.amplitude)
        }
    }

    /// A real model.
    ///
    /// # Errors
    /// If it is missing, or invalid under its treatment of the boundary.
    pub fn model(&self, model: &Model) -> Result<Subject> {
        self.read(model.file, model.boundary)
    }

    /// A model as a MESH of the other programs: its file, or its stand-in and the noise of stand-ins.
    pub fn argument(&self, model: &Model) -> (String, Option<Noise>) {
        match &self.models {
            Some(folder) => (folder.join(model.file).display().to_string(), None),
            None => (model.stand_in.to_owned(), Some(STAND_IN_NOISE)),
        }
    }

    /// The files of a folder of models, by name.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn files(&self, below: &str) -> Result<Vec<String>> {
        let folder = self.models.as_ref().map_or_else(PathBuf::new, |folder| folder.join(below));
        let refused = |e| Error::io(&folder, "read", e);
        let mut files: Vec<String> = Vec::new();
        for entry in std::fs::read_dir(&folder).map_err(refused)? {
            let name = entry.map_err(refused)?.file_name();
            files.push(format!("{below}/{}", name.to_string_lossy()));
        }
        files.sort();
        Ok(files)
    }

    /// A model by its file.
    ///
    /// # Errors
    /// As [`model`](Self::model).
    pub fn read(&self, file: &str, boundary: Boundary) -> Result<Subject> {
        let Some(folder) = &self.models else {
            return Err(Error::Computation(format!("{file} is a real model: run with --meshes DIR")));
        };
        let loaded = io::read(&folder.join(file))?;
        let refuse = |report: Box<Validation>| Error::mesh(&loaded.name, report.summary_line());
        let surface = Surface::examined(loaded.mesh, None, boundary).map_err(refuse)?;
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Subject { name, surface })
    }

    /// A built-in mesh with the noise of stand-ins.
    ///
    /// # Errors
    /// If there is no such mesh.
    pub fn stand_in(&self, name: &str) -> Result<Subject> {
        let mut mesh = builtin::builtin(name)?;
        add_noise(&mut mesh, STAND_IN_NOISE.amplitude, STAND_IN_NOISE.seed);
        Ok(Subject { name: name.to_owned(), surface: Surface::new(mesh)? })
    }

    /// The real model where it is at hand, else its stand-in.
    ///
    /// # Errors
    /// As [`model`](Self::model).
    pub fn subject(&self, model: &Model) -> Result<Subject> {
        if self.real() { self.model(model) } else { self.stand_in(model.stand_in) }
    }

    /// The meshes of a list: the real models where they are at hand, else the built-in ones.
    ///
    /// # Errors
    /// As [`model`](Self::model).
    pub fn list<T: Copy>(&self, list: &List<T>) -> Result<Vec<(Subject, T)>> {
        if self.real() {
            list.models.iter().map(|(model, with)| Ok((self.model(model)?, *with))).collect()
        } else {
            list.built_in.iter().map(|(name, with)| Ok((self.stand_in(name)?, *with))).collect()
        }
    }

    /// All valid closed models in order of their names, or the stand-ins `otherwise`; none with more than `most`
    /// vertices.
    ///
    /// # Errors
    /// If a folder or file cannot be read, or a closed model is invalid.
    pub fn subjects(&self, otherwise: &[&str], most: usize) -> Result<Vec<Subject>> {
        if !self.real() {
            return otherwise
                .iter()
                .map(|name| self.stand_in(name))
                .filter(|s| s.as_ref().is_ok_and(|s| s.surface.len() <= most) || s.is_err())
                .collect();
        }
        let mut subjects = Vec::new();
        for file in self.files("closed")? {
            let subject = self.read(&file, Boundary::Refuse)?;
            if subject.surface.len() <= most {
                subjects.push(subject);
            }
        }
        Ok(subjects)
    }

    /// Runs an item, and writes its tables, whose pages show its pictures.
    ///
    /// # Errors
    /// Those of the item; a file that cannot be written.
    pub fn run(&mut self, item: &Item) -> Result<()> {
        self.item = Some(item.id);
        (item.run)(self)?;
        let (tables, pictures) = (std::mem::take(&mut self.tables), std::mem::take(&mut self.pictures));
        pages::write_tables(&self.folder(), item, &tables, &pictures, &self.provenance())?;
        self.item = None;
        Ok(())
    }

    /// The command that makes the files of the item at work again, or all of them, with the flags that results depend on: the
    /// same wherever, whenever and on however many threads it runs, as these files are.
    pub fn provenance(&self) -> Provenance {
        let flags = [("--meshes DIR", self.real()), ("--quick", self.quick)];
        let words = ["reproduce".to_owned()].into_iter();
        let words = words.chain(self.item.map(|id| format!("--only {id}")));
        let words = words.chain(flags.into_iter().filter(|flag| flag.1).map(|(flag, _)| flag.into()));
        Provenance {
            program: "reproduce".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            command: words.collect::<Vec<_>>().join(" "),
            ..Provenance::default()
        }
    }

    /// Takes a table to be written as CSV and as a page, prints it, and holds it against the one in `--check`.
    ///
    /// # Errors
    /// If that file cannot be read.
    pub fn table(&mut self, mut table: Table) -> Result<()> {
        table.notes.insert(0, self.note_on_meshes());
        self.printer.table(&table)?;
        self.note_table(&table);
        self.compare(&table)?;
        self.tables.push(table);
        Ok(())
    }

    /// Makes a table of wall-clock times where they are wanted: no run repeats them, so that a plain one leaves what is
    /// committed as it is.
    ///
    /// # Errors
    /// Those of `make`, and as [`table`](Self::table).
    pub fn times(&mut self, make: impl FnOnce(&Context) -> Result<Table>) -> Result<()> {
        if !self.times {
            return Ok(());
        }
        let table = make(self)?;
        self.table(table)
    }

    /// Counts a table that was made.
    pub fn note_table(&mut self, table: &Table) {
        self.made.tables += 1;
        self.made.rows += table.rows.len();
    }

    /// Holds a table against the one of the same name in `--check`.
    ///
    /// # Errors
    /// If that file cannot be read.
    pub fn compare(&mut self, table: &Table) -> Result<()> {
        if let Some(root) = &self.check {
            let committed = self.within(root).join(format!("{}.csv", table.id));
            for difference in compare(table, &committed)? {
                self.differences.push(difference.to_string());
            }
        }
        Ok(())
    }

    /// Writes a figure as `STEM.png`, or in the formats that are asked for.
    ///
    /// # Errors
    /// If it cannot be drawn or written.
    pub fn figure(&mut self, stem: &str, figure: &Figure) -> Result<()> {
        let shown = [Format::Png, Format::Svg].into_iter().find(|format| self.formats.contains(format));
        self.picture(stem, shown);
        debug_assert_eq!(figure.illegible()?, [""; 0], "{stem}");
        figure.write(&self.folder(), stem, &self.formats, &self.provenance())
    }

    /// Writes the histories that a figure of this stem shows as `STEM.csv`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn histories<'a>(
        &self,
        stem: &str,
        keys: [&str; 2],
        runs: impl IntoIterator<Item = ([String; 2], &'a [Recorded])>,
    ) -> Result<()> {
        histories::write(&self.folder().join(format!("{stem}.csv")), keys, runs, &self.provenance())
    }

    /// Writes figures of one size as an animation, `STEM.png`.
    ///
    /// # Errors
    /// If one cannot be drawn, or the file not written.
    pub fn animation(&mut self, stem: &str, figures: &[Figure]) -> Result<()> {
        self.picture(stem, Some(Format::Png));
        let animation =
            Animation { frames: figures.iter().map(Figure::render).collect::<Result<_>>()?, milliseconds: 700 };
        animation.save(&self.folder().join(format!("{stem}.png")), &self.provenance())
    }

    /// Counts a picture, and remembers it for the page of its table if there is a file that pages can show.
    fn picture(&mut self, stem: &str, shown: Option<Format>) {
        self.made.figures += 1;
        self.pictures.extend(shown.map(|format| format!("{stem}.{}", format.name())));
    }

    /// The page that leads to all results.
    pub fn index(&self) -> PathBuf {
        self.folder().join(pages::INDEX)
    }

    /// Writes the index of all results in the folder, those of earlier runs too.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn write_index(&self, items: &[Item]) -> Result<()> {
        pages::write_index(&self.root, &self.folder(), items, &self.provenance())
    }

    /// The end of a run: with `--json` its object, in which `claims` are those that were computed; then success, or what differs from
    /// `--check`.
    ///
    /// # Errors
    /// The first difference and their number; standard output that cannot be written.
    pub fn finish(self, claims: Json, provenance: &Provenance) -> Result<()> {
        let folder = self.folder();
        let fields = json!({
            "meshes": self.models.map_or("built-in".into(), |folder| folder.display().to_string()),
            "quick": self.quick,
            "folder": folder.display().to_string(),
            "claims": claims,
            "differences": self.differences,
        });
        self.printer.finish(fields, provenance)?;
        for difference in &self.differences {
            cli::say(format_args!("differs: {difference}"));
        }
        match self.differences.first() {
            None => Ok(()),
            Some(first) => Err(Error::Computation(format!(
                "{} differences from the committed reports, the first: {first}; if the change is meant, run \
                 reproduce again and commit its output",
                self.differences.len()
            ))),
        }
    }
}
