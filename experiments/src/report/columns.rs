//! Columns defined once: name, kind, and what each holds of a record.

use super::table::{Cell, Column, Table};

/// What a column holds of a record.
type Accessor<'a, R> = Box<dyn Fn(&R) -> Cell + 'a>;

/// The columns of a table whose rows are made from records of type `R`: name, kind and accessor of a column stand
/// together, so that nothing is paired by its position. CSV, Markdown and JSON follow from the [`Table`].
///
/// ```
/// use limitlab_experiments::report::{Column, Columns};
///
/// let columns = Columns::<(&str, f64)>::new()
///     .col(Column::key("mesh"), |r| r.0)
///     .col(Column::number("rho", 1e-6, 4), |r| r.1);
/// let table = columns.table("rates", "Observed rates", &[("torus:8x8", 1.0 / 6.0)]);
/// assert_eq!(table.to_csv(), "mesh,rho\ntorus:8x8,0.1666666667\n");
/// ```
pub struct Columns<'a, R> {
    columns: Vec<Column>,
    accessors: Vec<Accessor<'a, R>>,
}

impl<R> Default for Columns<'_, R> {
    fn default() -> Self {
        Columns { columns: Vec::new(), accessors: Vec::new() }
    }
}

impl<'a, R> Columns<'a, R> {
    /// No columns yet.
    pub fn new() -> Self {
        Columns::default()
    }

    /// One column more, to the right.
    #[must_use]
    pub fn col<C: Into<Cell>>(mut self, column: Column, cell: impl Fn(&R) -> C + 'a) -> Self {
        self.columns.push(column);
        self.accessors.push(Box::new(move |record| cell(record).into()));
        self
    }

    /// A table of these columns with a row a record.
    pub fn table<'r>(
        &self,
        id: impl Into<String>,
        title: impl Into<String>,
        records: impl IntoIterator<Item = &'r R>,
    ) -> Table
    where
        R: 'r,
    {
        let mut table = Table::new(id, title, self.columns.clone());
        table.rows.extend(records.into_iter().map(|r| self.row(r)));
        table
    }

    /// The cells of one record, for a [`Table::push`] where rows come one by one.
    pub fn row(&self, record: &R) -> Vec<Cell> {
        self.accessors.iter().map(|cell| cell(record)).collect()
    }
}
