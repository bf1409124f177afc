//! Command line shared by the programs: flags, MESH names, exit status, progress. This room knows no formulas.

pub mod advice;
mod input;
mod json;
mod monitor;
mod problem;
mod process;
mod progress;
mod provenance;

pub use input::{Input, MeshFlags, STAND_IN_NOISE, STANDARD_STREAM};
use json::print_json;
pub use monitor::MonitorFlags;
pub use problem::{Given, Matrix, Problem, Subject};
pub use process::{exit, say};
pub use progress::Progress;
pub use provenance::{MANIFEST, object_text, parse, print_object, provenance};

use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use crate::report::{Figure, Format, Provenance, Table, fitted};
use limitlab::error::{Error, Result};
use limitlab::solvers::Stop;

/// Version and commit, as `--version` says them.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("LIMITLAB_COMMIT"), ")");

/// Exit status 0 of most programs.
pub const DONE: &str = "done";

/// Exit status 0 of programs whose rows are results whatever came of them.
pub const DONE_ANYHOW: &str = "done, also where a method did not converge, which is a result";

/// The end of a program's help: examples, the exit statuses, what else to read.
pub fn ending(examples: &[&str], done: &str, more: Option<&str>) -> String {
    let examples: String = examples.iter().map(|example| format!("  {example}\n")).collect();
    let more = more.map_or_else(String::new, |more| format!("\n\n{more}"));
    format!(
        "Examples:\n{examples}\nExit status: 0 {done}; 1 the input or the computation failed, and one line \"error: …\" says what \
         to do; 2 bad arguments.{more}"
    )
}

/// The end of the help of programs that take a method.
pub const WHICH_METHOD: &str = "Which method for which mesh: docs/methods.md, ten lines with their evidence.";

/// Flags of every program: threads and silence.
#[derive(Args, Clone, Debug)]
pub struct CommonFlags {
    /// Number of threads, at most and unless told one a processor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// No remarks and no progress on standard error
    #[arg(long)]
    pub quiet: bool,
}

impl CommonFlags {
    /// Prepares the process for work: addresses, signals, then threads, whose number joins the provenance.
    ///
    /// # Errors
    /// If threads were started before.
    pub fn apply(&self, provenance: Provenance) -> Result<Provenance> {
        process::share_addresses();
        process::heed_signals();
        process::start_threads(self.threads, |text| self.remark(text))?;
        Ok(Provenance { threads: Some(rayon::current_num_threads()), ..provenance })
    }

    /// Says at the end which files were replaced, if any.
    pub fn remark_on_replaced(&self) {
        match limitlab::output::replaced().as_slice() {
            [] => {}
            [one] => self.remark(format_args!("replaced: {}", one.display())),
            all @ [first, ..] => {
                self.remark(format_args!("replaced: {} files, the first {}", all.len(), first.display()));
            }
        }
    }

    /// Tells the user something on standard error, unless asked to be quiet.
    pub fn remark(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            say(text);
        }
    }
}

/// When iterations stop.
#[derive(Args, Clone, Debug)]
pub struct StopFlags {
    /// Stop at max_i ‖p_i − (A v)_i‖ ≤ T·L, L the diagonal of the bounding box
    #[arg(long, value_name = "T", default_value = "1e-10", value_parser = positive)]
    pub tol: f64,
    /// Stop at max_i ‖p_i − (A v)_i‖ ≤ T, in the units of the mesh
    #[arg(long, value_name = "T", value_parser = positive, conflicts_with = "tol")]
    pub tol_absolute: Option<f64>,
    /// Iterations at most
    #[arg(long, value_name = "K", default_value_t = StopFlags::default().max_iter)]
    pub max_iter: usize,
}

impl Default for StopFlags {
    fn default() -> Self {
        StopFlags { tol: 1e-10, tol_absolute: None, max_iter: 10_000 }
    }
}

impl StopFlags {
    /// The tolerance as titles say it.
    pub fn words(&self) -> String {
        match self.tol_absolute {
            Some(tolerance) => format!("to {tolerance:e}"),
            None => format!("to {:e} of the diagonal", self.tol),
        }
    }

    /// The rule for points of this extent, in units of `scale`; or what is wrong.
    ///
    /// # Errors
    /// A relative tolerance where all points coincide.
    pub fn rule(&self, extent: f64, scale: f64) -> std::result::Result<Stop, &'static str> {
        let tolerance = match self.tol_absolute {
            Some(tolerance) => (tolerance / scale).min(f64::MAX),
            None if extent > 0.0 => self.tol * extent,
            None => {
                return Err(
                    "all points coincide, so no tolerance can be relative to their extent: give --tol-absolute",
                );
            }
        };
        Ok(Stop { tolerance, max_iterations: self.max_iter })
    }
}

/// What figures are written as.
#[derive(Args, Clone, Debug)]
pub struct FigureFlags {
    /// Write figures as these, separated by commas: png, svg, pdf
    #[arg(long, value_name = "FORMAT,…", default_value = "png")]
    figure: List<Format>,
}

impl FigureFlags {
    /// The formats that are asked for.
    pub fn formats(&self) -> &[Format] {
        &self.figure.0
    }
}

/// What becomes of files that are there already.
#[derive(Args, Clone, Copy, Debug)]
pub struct ReplaceFlags {
    /// Refuse, before the work, to replace a file that is there. Unless told, files are replaced, and a remark says which
    #[arg(long, conflicts_with = "force")]
    no_clobber: bool,
    /// Replace read-only files too
    #[arg(long)]
    force: bool,
}

impl ReplaceFlags {
    /// Does before the work what was asked for the file of this name, if there is one.
    ///
    /// # Errors
    /// A file that this run has written for another mesh; one that would be replaced, with --no-clobber; one that is not
    /// ours, with --force.
    pub fn settle(&self, path: &Path) -> Result<()> {
        let refuse = |what| Err(Error::io(path, "write", std::io::Error::new(ErrorKind::AlreadyExists, what)));
        match path.is_file() {
            true if limitlab::output::is_complete(path) => refuse(
                "it holds the results on another mesh of this run whose file is called the same: run the program once for \
                 each, with folders of their own (--out)",
            ),
            true if self.no_clobber => refuse("it is there already: name another place, or leave out --no-clobber"),
            true if self.force => limitlab::output::allow_replacing(path),
            _ => Ok(()),
        }
    }

    /// As [`settle`](Self::settle), for all tables and figures of these names in a folder.
    ///
    /// # Errors
    /// As [`settle`](Self::settle).
    pub fn settle_all<S: AsRef<str>>(&self, folder: &Path, stems: impl IntoIterator<Item = S>) -> Result<()> {
        const ENDS: [&str; 8] = [".csv", ".md", "-history.csv", "-vertices.csv", ".ply", ".png", ".svg", ".pdf"];
        let mut stems = stems.into_iter();
        stems.try_for_each(|stem| {
            ENDS.iter().try_for_each(|end| self.settle(&folder.join(stem.as_ref().to_owned() + end)))
        })
    }
}

/// Where results go.
#[derive(Args, Clone, Debug)]
pub struct OutputFlags {
    /// Folder for the tables (CSV, Markdown) and figures
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    figures: FigureFlags,
    #[command(flatten)]
    pub replace: ReplaceFlags,
}

impl OutputFlags {
    /// Does what was asked for tables and figures that have these names already: before the work.
    ///
    /// # Errors
    /// As [`ReplaceFlags::settle`].
    pub fn settle<S: AsRef<str>>(&self, stems: impl IntoIterator<Item = S>) -> Result<()> {
        self.replace.settle_all(&self.out, stems)
    }

    /// Creates the folder: before the work, so that a place that cannot be written is told at once.
    ///
    /// # Errors
    /// If the folder cannot be created.
    pub fn prepare(&self) -> Result<()> {
        limitlab::output::create_dir(&self.out)
    }

    /// Writes a figure there in every format that is asked for.
    ///
    /// # Errors
    /// As [`Figure::write`].
    pub fn figure(&self, stem: &str, figure: &Figure, provenance: &Provenance) -> Result<()> {
        figure.write(&self.out, stem, self.figures.formats(), provenance)
    }
}

/// A `value_parser`: a file to write, which is never standard output.
pub fn file(name: &str) -> std::result::Result<PathBuf, String> {
    match name == STANDARD_STREAM {
        true => Err("a file is needed: only results in text go to standard output (a file of this name is ./-)".into()),
        false => Ok(name.into()),
    }
}

/// A `value_parser`: a positive, finite number.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("a positive number is needed".into()),
    }
}

/// A grid `A:B:STEP` with both ends, as a `value_parser`.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid(pub Vec<f64>);

/// Points of a grid at most: more is a slip of the step.
const MOST_POINTS: f64 = 100_000.0;

impl std::str::FromStr for Grid {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let numbers: Vec<f64> = text
            .split(':')
            .map(str::parse)
            .collect::<std::result::Result<_, _>>()
            .map_err(|_| "a grid is A:B:STEP, three numbers")?;
        let &[from, to, step] = numbers.as_slice() else {
            return Err("a grid is A:B:STEP, three numbers".into());
        };
        // Both ends belong to the grid, though (b − a)/step may round below a whole number.
        let steps = ((to - from) / step + 1e-9).floor();
        if !(step > 0.0 && from <= to && from > 0.0 && steps < MOST_POINTS) {
            return Err("a grid A:B:STEP needs 0 < A ≤ B, a positive STEP and fewer than 100000 points".into());
        }
        let at = |k: usize| if k == 0 { from } else { fifteen_digits(from + k as f64 * step) };
        Ok(Grid((0..=steps as usize).map(at).collect()))
    }
}

/// What was meant by a sum of numbers that were typed: 0.05 + 15·0.05 is 0.8.
fn fifteen_digits(x: f64) -> f64 {
    format!("{x:.14e}").parse().unwrap_or(x)
}

/// A comma-separated list, as a `value_parser`.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T>(pub Vec<T>);

impl<T: std::str::FromStr> std::str::FromStr for List<T>
where
    T::Err: std::fmt::Display,
{
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        text.split(',')
            .map(|item| item.trim().parse().map_err(|e: T::Err| e.to_string()))
            .collect::<std::result::Result<_, _>>()
            .map(List)
    }
}

impl<T: PartialEq> List<T> {
    /// Without what was named before.
    #[must_use]
    pub fn each_once(self) -> Self {
        let mut first: Vec<T> = Vec::with_capacity(self.0.len());
        for item in self.0 {
            if !first.contains(&item) {
                first.push(item);
            }
        }
        List(first)
    }
}

/// Prints to standard output.
///
/// # Errors
/// As [`write_standard`].
pub fn print(text: &str) -> Result<()> {
    write_standard(|out| {
        out.write_all(text.as_bytes())?;
        out.write_all(b"\n")
    })
}

/// Writes to standard output what `fill` gives. A reader that has gone away is no failure: the rest is not wanted.
///
/// # Errors
/// Any other failure to write.
pub fn write_standard(fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    match fill(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("standard output".as_ref(), "write", e)),
        _ => Ok(()),
    }
}

/// Prints a table to standard output: in the width of a terminal, else as Markdown.
///
/// # Errors
/// As [`print()`].
pub fn print_table(table: &Table) -> Result<()> {
    match console::Term::stdout().size_checked() {
        Some((_, columns)) => print(&fitted(table, columns.into())),
        None => print(&table.to_markdown()),
    }
}

/// Ends a program that took meshes: with `--json` prints the object of one mesh, or `{"results": […]}` of several;
/// else says where the files are.
///
/// # Errors
/// If standard output cannot be written.
pub fn finish(results: Vec<Value>, output: &OutputFlags, common: &CommonFlags, provenance: &Provenance) -> Result<()> {
    common.remark(format_args!("tables and plots: {}", output.out.display()));
    common.remark_on_replaced();
    if !output.json {
        return Ok(());
    }
    print_results(results, provenance)
}

/// Prints the object of one mesh, or `{"results": […]}` of several.
fn print_results(mut results: Vec<Value>, provenance: &Provenance) -> Result<()> {
    let object = if results.len() == 1 { results.remove(0) } else { json!({ "results": results }) };
    print_object(object, provenance)
}

/// What a program of several tables prints on standard output: each as soon as it is there, with `--json`
/// one object with all of them at the end, or nothing.
pub enum Printer {
    /// Tables and pages as they come.
    Pages,
    /// The object of all tables.
    Json(Vec<Value>),
    /// Neither: the program ends with words of its own.
    Silent,
}

impl Printer {
    pub fn new(json: bool) -> Self {
        if json { Printer::Json(Vec::new()) } else { Printer::Pages }
    }

    /// A table.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub fn table(&mut self, table: &Table) -> Result<()> {
        match self {
            Printer::Pages => return print_table(table),
            Printer::Json(tables) => {
                tables.push(json!({ "id": table.id, "title": table.title, "rows": table.to_json() }));
            }
            Printer::Silent => {}
        }
        Ok(())
    }

    /// A page for people, which the JSON object lacks.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn page(&self, text: &str) -> Result<()> {
        match self {
            Printer::Pages => print(text),
            Printer::Json(_) | Printer::Silent => Ok(()),
        }
    }

    /// The end: with `--json` prints the object of `fields` and `tables`.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    ///
    /// # Panics
    /// If `fields` is not an object.
    pub fn finish(self, mut fields: Value, provenance: &Provenance) -> Result<()> {
        let Printer::Json(tables) = self else {
            return Ok(());
        };
        fields["tables"] = tables.into();
        print_object(fields, provenance)
    }
}

/// A number for JSON: `null` if it is not finite.
pub fn number(x: f64) -> Value {
    serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_both_ends_and_round_numbers() {
        let grid: Grid = "0.05:1.2:0.05".parse().expect("a grid");
        assert_eq!(grid.0.len(), 24);
        assert_eq!((grid.0[0], grid.0[15], grid.0[23]), (0.05, 0.8, 1.2));
        for (text, points) in [
            ("1e-13:3e-13:1e-13", [1e-13, 2e-13, 3e-13]),
            ("1e-300:3e-300:1e-300", [1e-300, 2e-300, 3e-300]),
            ("1e297:3e297:1e297", [1e297, 2e297, 3e297]),
        ] {
            assert_eq!(text.parse::<Grid>().expect("a grid").0, points, "{text}");
        }
        assert_eq!("0.5:0.5:1".parse::<Grid>().expect("one point").0, [0.5]);
        for bad in ["", "1", "1:2", "1:2:0", "2:1:0.1", "a:b:c", "0:1:0.1", "1:2:1e-9", "1:nan:1"] {
            assert!(bad.parse::<Grid>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_grid_ends_before_its_end_if_the_step_does_not_divide_it() {
        for (text, expected) in [("0.5:1:0.3", vec![0.5, 0.8]), ("1:2.9:1", vec![1.0, 2.0]), ("1:1.9:1", vec![1.0])] {
            assert_eq!(text.parse::<Grid>().expect("a grid").0, expected, "{text}");
        }
    }

    #[test]
    fn a_tolerance_is_relative_to_the_mesh_unless_it_is_absolute() {
        let flags = MeshFlags::default();
        let common = CommonFlags { threads: None, quiet: true };
        let cube = flags.input("cube", &common).expect("valid");
        let stop = |tol_absolute| {
            cube.stop(&StopFlags { tol: 1e-3, tol_absolute, max_iter: 7 }).expect("a cube has an extent")
        };
        // The diagonal of [−1, 1]³ is √12.
        assert!((stop(None).tolerance - 1e-3 * 12f64.sqrt()).abs() < 1e-18);
        assert_eq!(stop(Some(1e-3)).tolerance, 1e-3);
        let words = |tol_absolute| StopFlags { tol_absolute, ..StopFlags::default() }.words();
        assert_eq!((words(None), words(Some(0.5))), ("to 1e-10 of the diagonal".into(), "to 5e-1".into()));
        assert_eq!(stop(None).max_iterations, 7);
    }

    #[test]
    fn a_list_names_the_item_that_is_wrong() {
        let list: List<u32> = "3, 4,5".parse().expect("three numbers");
        assert_eq!(list.0, [3, 4, 5]);
        assert_eq!("5,3,5,4,3".parse::<List<u32>>().expect("numbers").each_once().0, [5, 3, 4]);
        assert!("3,x".parse::<List<u32>>().is_err());
    }

    #[test]
    fn json_numbers_that_are_not_finite_are_null() {
        assert_eq!(number(f64::NAN), Value::Null);
        assert_eq!(number(f64::INFINITY), Value::Null);
        assert_eq!(number(0.5).to_string(), "0.5");
    }
}
