//! A table of typed columns, written as CSV, Markdown or JSON.

use super::number::{csv_number, readable};
use super::provenance::Provenance;
use limitlab::output::write_file;
use limitlab::{Error, Result};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Significant digits of a duration in Markdown; no timing is known better.
const TIME_DIGITS: usize = 3;

/// Differences up to this count as equal unless [`Column::floor`] says otherwise: an error of 1e-13 in units of
/// a mesh of size 1 is rounding, and rounding differs between machines by more than any relative tolerance.
pub const ROUNDING_FLOOR: f64 = 1e-12;

/// What a column holds, and thereby how it is written and compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Identifies the row, together with the other key columns. Compared as text.
    Key,
    /// Words, verdicts, and integers that must agree exactly. Compared as text.
    Text,
    /// Integers that may differ by 1, as iteration counts do between machines.
    Count,
    /// Real numbers.
    Number {
        /// Largest |a − b| / max(|a|, |b|) that counts as equal.
        tolerance: f64,
        /// Largest |a − b| that counts as equal whatever the tolerance.
        floor: f64,
        /// Significant digits in Markdown.
        digits: usize,
    },
    /// Durations in seconds: never compared.
    Time,
    /// Free text, with measured numbers in it perhaps: never compared.
    Remark,
}

/// A column: its name in snake_case, which is the CSV header and the JSON field, and its kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    pub kind: Kind,
    /// Whether a terminal that is too narrow for all columns does without this one.
    pub(super) is_detail: bool,
}

impl Column {
    fn new(name: impl Into<String>, kind: Kind) -> Self {
        Column { name: name.into(), kind, is_detail: false }
    }

    /// A column of [`Kind::Key`].
    pub fn key(name: impl Into<String>) -> Self {
        Column::new(name, Kind::Key)
    }

    /// A column of [`Kind::Text`].
    pub fn text(name: impl Into<String>) -> Self {
        Column::new(name, Kind::Text)
    }

    /// A column of [`Kind::Count`].
    pub fn count(name: impl Into<String>) -> Self {
        Column::new(name, Kind::Count)
    }

    /// A column of [`Kind::Number`] with the relative `tolerance` of comparisons, the floor
    /// [`ROUNDING_FLOOR`], and `digits` significant digits in Markdown.
    pub fn number(name: impl Into<String>, tolerance: f64, digits: usize) -> Self {
        Column::new(name, Kind::Number { tolerance, floor: ROUNDING_FLOOR, digits })
    }

    /// A column of [`Kind::Time`].
    pub fn time(name: impl Into<String>) -> Self {
        Column::new(name, Kind::Time)
    }

    /// A column of [`Kind::Remark`].
    pub fn remark(name: impl Into<String>) -> Self {
        Column::new(name, Kind::Remark)
    }

    /// The same column as a detail, which a narrow terminal does without.
    pub fn detail(mut self) -> Self {
        self.is_detail = true;
        self
    }

    /// Whether it identifies rows.
    pub(super) fn is_key(&self) -> bool {
        self.kind == Kind::Key
    }

    /// The same column with another absolute floor; columns of other kinds have none and stay as they are.
    pub fn floor(mut self, absolute: f64) -> Self {
        if let Kind::Number { floor, .. } = &mut self.kind {
            *floor = absolute;
        }
        self
    }
}

/// One entry of a table. Any kind of column takes any cell: `diverged` may stand where a number is expected.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    Text(String),
    Integer(i64),
    Float(f64),
    Empty,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl From<i64> for Cell {
    fn from(value: i64) -> Self {
        Cell::Integer(value)
    }
}

impl From<u32> for Cell {
    fn from(value: u32) -> Self {
        Cell::Integer(value.into())
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Cell::Integer(value as i64)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Cell::Float(value)
    }
}

/// `None` is an empty cell.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Cell::Empty, Into::into)
    }
}

impl Cell {
    /// The cell as CSV holds it: 10 significant digits, without trailing zeros.
    pub(super) fn csv(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Integer(value) => value.to_string(),
            Cell::Float(value) => csv_number(*value),
            Cell::Empty => String::new(),
        }
    }

    /// The cell for people. A number that has fewer digits than its column, a whole one as a rule, has no zeros after them.
    fn shown(&self, kind: Kind) -> String {
        match (self, kind) {
            (Cell::Float(value), Kind::Number { digits, .. }) => {
                let (all, rounded) = (self.csv(), readable(*value, digits));
                if value.is_finite() && all.len() < rounded.len() { all } else { rounded }
            }
            (Cell::Float(value), Kind::Time) => readable(*value, TIME_DIGITS),
            _ => self.csv().replace(['\n', '\r'], " "),
        }
    }

    fn json(&self) -> serde_json::Value {
        match self {
            Cell::Text(text) => text.as_str().into(),
            Cell::Integer(value) => (*value).into(),
            // serde_json would do the same without a word; the contract asks for it, so it is said here.
            Cell::Float(value) if !value.is_finite() => serde_json::Value::Null,
            Cell::Float(value) => (*value).into(),
            Cell::Empty => serde_json::Value::Null,
        }
    }
}

/// A titled table: what a program found out, ready to be written or compared.
///
/// ```
/// use limitlab_experiments::report::{Column, Table};
///
/// let mut table = Table::new("rates", "Observed rates", vec![
///     Column::key("mesh"),
///     Column::count("iterations"),
///     Column::number("rho", 1e-6, 4),
/// ]);
/// table.push(vec!["torus:8x8".into(), 57_usize.into(), (1.0 / 6.0).into()]);
/// assert_eq!(table.to_csv(), "mesh,iterations,rho\ntorus:8x8,57,0.1666666667\n");
/// assert!(table.to_markdown().contains("| torus:8x8 |         57 | 0.1667 |"));
/// assert_eq!(table.to_json()[0]["iterations"], 57);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The stem of the file names, in kebab-case.
    pub id: String,
    pub title: String,
    /// Paragraphs between the title and the table: which meshes, which norm, what deviates.
    pub notes: Vec<String>,
    /// What stands above the rows where they are many: a table made of them, in Markdown and on terminals only.
    pub summary: Option<Box<Table>>,
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without notes or rows.
    pub fn new(id: impl Into<String>, title: impl Into<String>, columns: Vec<Column>) -> Self {
        Table { id: id.into(), title: title.into(), notes: Vec::new(), summary: None, columns, rows: Vec::new() }
    }

    /// Adds a paragraph under the title.
    pub fn note(&mut self, paragraph: impl Into<String>) {
        self.notes.push(paragraph.into());
    }

    /// Appends a row.
    ///
    /// # Panics
    /// If the row does not have one cell a column.
    pub fn push(&mut self, row: Vec<Cell>) {
        assert_eq!(row.len(), self.columns.len(), "one cell a column");
        self.rows.push(row);
    }

    /// The cells of each row as CSV holds them.
    pub(super) fn csv_rows(&self) -> impl Iterator<Item = Vec<String>> + '_ {
        self.rows.iter().map(|row| row.iter().map(Cell::csv).collect())
    }

    /// Writes a header line of column names, then the rows, quoted where RFC 4180 asks for it. A float has 10
    /// significant digits; those that are not finite are `NaN`, `inf` and `-inf`.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_csv(&self, out: &mut dyn Write) -> io::Result<()> {
        // What begins as a comment would is quoted.
        let mut writer = csv::WriterBuilder::new().comment(Some(COMMENT)).from_writer(out);
        writer.write_record(self.columns.iter().map(|c| &c.name))?;
        for row in self.csv_rows() {
            writer.write_record(row)?;
        }
        writer.flush()
    }

    /// What [`write_csv`](Table::write_csv) writes.
    ///
    /// # Panics
    /// If a row does not have one cell a column.
    pub fn to_csv(&self) -> String {
        let mut bytes = Vec::new();
        self.write_csv(&mut bytes).expect("rows have one cell a column");
        String::from_utf8(bytes).expect("all cells are UTF-8")
    }

    /// The cells of each row for people.
    pub(super) fn cells(&self) -> Vec<Vec<String>> {
        let row = |row: &Vec<Cell>| row.iter().zip(&self.columns).map(|(cell, c)| cell.shown(c.kind)).collect();
        self.rows.iter().map(row).collect()
    }

    /// A heading, the notes, the summary if there is one, and a pipe table with columns of one width, numbers to the right.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n", self.title);
        self.write_body(&mut text);
        text
    }

    /// All but the heading.
    fn write_body(&self, text: &mut String) {
        for note in &self.notes {
            let _ = write!(text, "{note}\n\n");
        }
        if let Some(summary) = &self.summary {
            summary.write_body(text);
            text.push('\n');
        }
        let body: Vec<Vec<String>> =
            self.cells().iter().map(|row| row.iter().map(|cell| escaped(cell)).collect()).collect();
        let header: Vec<String> = self.columns.iter().map(|c| escaped(&c.name)).collect();
        // Three characters hold the shortest rule, `--:`.
        let width = |column: usize| {
            let cells = body.iter().map(|row| &row[column]);
            let widest = cells.chain([&header[column]]).map(|s| s.chars().count());
            widest.fold(3, usize::max)
        };
        let widths: Vec<usize> = (0..header.len()).map(width).collect();
        let right: Vec<bool> = (0..header.len()).map(|c| self.is_numeric(c)).collect();

        let line = |text: &mut String, cells: &[String]| {
            for ((cell, &width), &right) in cells.iter().zip(&widths).zip(&right) {
                let _ = if right { write!(text, "| {cell:>width$} ") } else { write!(text, "| {cell:<width$} ") };
            }
            text.push_str("|\n");
        };
        line(text, &header);
        for (&width, &right) in widths.iter().zip(&right) {
            let end = if right { ":" } else { "-" };
            let _ = write!(text, "| {}{end} ", "-".repeat(width - 1));
        }
        text.push_str("|\n");
        for row in &body {
            line(text, row);
        }
    }

    /// Whether a column reads as numbers, to be aligned on the right.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        match self.columns[column].kind {
            Kind::Count | Kind::Number { .. } | Kind::Time => true,
            Kind::Key | Kind::Text | Kind::Remark => {
                let mut cells = self.rows.iter().map(|row| &row[column]);
                !self.rows.is_empty() && cells.all(|c| matches!(c, Cell::Integer(_) | Cell::Float(_)))
            }
        }
    }

    /// An array with one object a row, its fields named after the columns. Empty cells and numbers that are not
    /// finite are `null`.
    pub fn to_json(&self) -> serde_json::Value {
        let object = |row: &Vec<Cell>| -> serde_json::Value {
            let fields = self.columns.iter().zip(row);
            let fields = fields.map(|(column, cell)| (column.name.clone(), cell.json()));
            serde_json::Value::Object(fields.collect())
        };
        self.rows.iter().map(object).collect()
    }

    /// Writes `<id>.csv` and `<id>.md` into the folder `dir` and returns their names there. Both say what made them: CSV in
    /// lines before the header that begin with `#`, which pandas passes over with `comment="#"`.
    ///
    /// # Errors
    /// [`Error::Io`] if one of them cannot be written.
    pub fn write(&self, dir: &Path, provenance: &Provenance) -> Result<Vec<PathBuf>> {
        self.write_with_page(dir, &self.to_markdown(), provenance)
    }

    /// As [`write`](Table::write), with `page` for the Markdown file.
    ///
    /// # Errors
    /// As [`write`](Table::write).
    pub fn write_with_page(&self, dir: &Path, page: &str, provenance: &Provenance) -> Result<Vec<PathBuf>> {
        let (csv, markdown) = (format!("{}.csv", self.id), format!("{}.md", self.id));
        self.write_csv_file(&dir.join(&csv), provenance)?;
        write_page(&dir.join(&markdown), page, provenance)?;
        Ok(vec![csv.into(), markdown.into()])
    }

    /// Writes the CSV file alone, to `path`.
    ///
    /// # Errors
    /// As [`write`](Table::write).
    pub fn write_csv_file(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        write_file(path, |out| {
            out.write_all(provenance.comments("#").as_bytes())?;
            self.write_csv(out)
        })
    }
}

/// Writes a page in Markdown, with what made it at its foot.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_page(path: &Path, page: &str, provenance: &Provenance) -> Result<()> {
    write_file(path, |out| {
        out.write_all(page.as_bytes())?;
        out.write_all(provenance.footer().as_bytes())
    })
}

/// What begins a line of CSV that is no row.
const COMMENT: u8 = b'#';

/// A CSV file as text: what [`Table::write_csv`] wrote, read back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CsvFile {
    pub header: Vec<String>,
    /// Every row is as long as the header.
    pub rows: Vec<Vec<String>>,
}

impl CsvFile {
    /// Reads a whole file.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Parse`] with the line if a row is not as long as the header
    /// or is not UTF-8.
    pub fn read(path: &Path) -> Result<CsvFile> {
        let file = std::fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
        let mut reader = csv::ReaderBuilder::new().comment(Some(COMMENT)).from_reader(file);
        let header = reader.headers().map_err(|e| csv_error(path, e))?;
        let header = header.iter().map(str::to_owned).collect();
        let rows = reader
            .records()
            .map(|record| {
                let record = record.map_err(|e| csv_error(path, e))?;
                Ok(record.iter().map(str::to_owned).collect())
            })
            .collect::<Result<_>>()?;
        Ok(CsvFile { header, rows })
    }
}

fn csv_error(path: &Path, error: csv::Error) -> Error {
    let line = error.position().map(|p| p.line() as usize);
    match error.into_kind() {
        csv::ErrorKind::Io(source) => Error::io(path, "read", source),
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => Error::parse(
            path,
            line,
            format!("the row has {len} fields, the header {expected_len}; write the file anew"),
        ),
        csv::ErrorKind::Utf8 { .. } => Error::parse(path, line, "the row is not UTF-8; write the file anew"),
        kind => Error::parse(path, line, format!("{kind:?}; write the file anew")),
    }
}

/// `text` as the content of one Markdown table cell.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '|' | '\\' => out.extend(['\\', c]),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn awkward() -> Table {
        let mut table = Table::new(
            "awkward",
            "Awkward | cells",
            vec![
                Column::key("mesh"),
                Column::text("verdict"),
                Column::count("iterations"),
                Column::number("max_error", 1e-6, 4),
                Column::time("seconds"),
            ],
        );
        table.note("On built-in meshes.");
        table.push(vec!["a,b \"c\"".into(), "two\nlines".into(), 12_usize.into(), 8.13812e-4.into(), 0.123456.into()]);
        table.push(vec!["x|y\\z".into(), "".into(), Cell::Empty, f64::NAN.into(), Cell::Empty]);
        table
    }

    #[test]
    fn csv_comes_back_as_it_was_written() {
        let dir = tempfile::tempdir().unwrap();
        let table = awkward();
        let made = Provenance { command: "p '#x'".into(), ..Provenance::default() };
        let files = table.write(dir.path(), &made).unwrap();
        assert_eq!(files, [PathBuf::from("awkward.csv"), PathBuf::from("awkward.md")]);
        let read = CsvFile::read(&dir.path().join("awkward.csv")).unwrap();
        assert_eq!(read.header, ["mesh", "verdict", "iterations", "max_error", "seconds"]);
        assert_eq!(read.rows, table.csv_rows().collect::<Vec<_>>());
        assert_eq!(read.rows[0], ["a,b \"c\"", "two\nlines", "12", "0.000813812", "0.123456"]);
        assert_eq!(read.rows[1], ["x|y\\z", "", "", "NaN", ""]);
    }

    #[test]
    fn a_single_empty_cell_survives_csv() {
        let dir = tempfile::tempdir().unwrap();
        let mut table = Table::new("one", "One", vec![Column::text("only")]);
        table.push(vec![Cell::Empty]);
        table.push(vec!["x".into()]);
        table.write(dir.path(), &Provenance::default()).unwrap();
        let read = CsvFile::read(&dir.path().join("one.csv")).unwrap();
        assert_eq!(read.rows, [[""], ["x"]]);
    }

    #[test]
    fn a_short_row_is_named_by_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("short.csv");
        std::fs::write(&path, "a,b\n1,2\n3\n").unwrap();
        let message = CsvFile::read(&path).unwrap_err().to_string();
        assert!(message.contains("short.csv, line 3: the row has 1 fields, the header 2"), "{message}");
        assert!(!message.contains('\n'));
    }

    #[test]
    fn markdown_is_aligned_and_escaped() {
        let expected = "\
# Awkward | cells

On built-in meshes.

| mesh    | verdict   | iterations | max_error | seconds |
| ------- | --------- | ---------: | --------: | ------: |
| a,b \"c\" | two lines |         12 |  8.138e-4 |   0.123 |
| x\\|y\\\\z |           |            |       NaN |         |
";
        assert_eq!(awkward().to_markdown(), expected);
    }

    #[test]
    fn numbers_have_no_digits_that_say_nothing() {
        let mut table = Table::new("t", "T", vec![Column::number("x", 1e-6, 4)]);
        for x in [10.0, 0.8, 1.0 / 3.0, 1e6, -2.0, 123456.7, 1e-5] {
            table.push(vec![x.into()]);
        }
        let shown: Vec<String> = table.cells().into_iter().flatten().collect();
        assert_eq!(shown, ["10", "0.8", "0.3333", "1.000e6", "-2", "123457", "1e-5"]);
    }

    #[test]
    fn a_summary_stands_between_notes_and_rows() {
        let mut table = awkward();
        let mut summary = Table::new("s", "S", vec![Column::text("median")]);
        summary.note("Medians.");
        summary.push(vec![12.5.into()]);
        table.summary = Some(Box::new(summary));
        let page = table.to_markdown();
        let between = "On built-in meshes.\n\nMedians.\n\n| median |\n| -----: |\n|   12.5 |\n\n| mesh ";
        assert!(page.contains(between), "{page}");
        assert_eq!((table.to_csv(), table.to_json()), (awkward().to_csv(), awkward().to_json()));
    }

    #[test]
    fn integers_in_a_text_column_go_to_the_right() {
        let mut table = Table::new("t", "T", vec![Column::text("vertices"), Column::text("remark")]);
        table.push(vec![8_usize.into(), "x".into()]);
        assert!(table.to_markdown().contains("|        8 | x      |\n"), "{}", table.to_markdown());
    }

    #[test]
    fn json_has_null_for_what_is_no_number() {
        let json = awkward().to_json();
        assert_eq!(json[0]["max_error"], 8.13812e-4);
        assert_eq!(json[0]["iterations"], 12);
        assert!(json[1]["max_error"].is_null());
        assert!(json[1]["iterations"].is_null());
        assert_eq!(json[1]["verdict"], "");
        let infinite = Cell::Float(f64::INFINITY).json();
        assert!(infinite.is_null());
    }

    #[test]
    #[should_panic(expected = "one cell a column")]
    fn a_row_of_another_length_is_a_broken_contract() {
        awkward().push(vec![]);
    }
}
