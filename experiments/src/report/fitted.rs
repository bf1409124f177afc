//! Layout of a table for a terminal: the columns that matter in its width, else a block a row.

use super::table::Table;

/// Between two columns, and between the parts of a block's lines.
const GAP: &str = "  ";

/// The table in lines of at most `width` characters, unless a single word is longer: its title, its notes, and its rows.
/// Columns that are empty throughout are left out; where the rest does not fit, [details](super::Column::detail) are, the last
/// first, and are named; where that is not enough, every row is a block with all that it has.
pub fn fitted(table: &Table, width: usize) -> String {
    let mut lines = wrapped(table.title.split_whitespace(), width, "");
    lines.push(String::new());
    body(table, width, &mut lines);
    lines.join("\n") + "\n"
}

fn body(table: &Table, width: usize, lines: &mut Vec<String>) {
    for note in &table.notes {
        lines.extend(wrapped(note.split_whitespace(), width, ""));
        lines.push(String::new());
    }
    if let Some(summary) = &table.summary {
        body(summary, width, lines);
        lines.push(String::new());
    }
    let cells = table.cells();
    let mut shown: Vec<usize> =
        (0..table.columns.len()).filter(|&c| cells.iter().any(|row| !row[c].is_empty())).collect();
    let widths: Vec<usize> = (0..table.columns.len())
        .map(|c| cells.iter().map(|row| &row[c]).chain([&table.columns[c].name]).map(|s| length(s)).fold(0, usize::max))
        .collect();
    let needed =
        |shown: &[usize]| shown.iter().map(|&c| widths[c]).sum::<usize>() + GAP.len() * shown.len().saturating_sub(1);
    let mut left_out = Vec::new();
    while needed(&shown) > width
        && let Some(last) = shown.iter().rposition(|&c| table.columns[c].is_detail)
    {
        left_out.insert(0, table.columns[shown.remove(last)].name.as_str());
    }
    if needed(&shown) > width {
        return blocks(table, &cells, width, lines);
    }
    let line = |cells: &[&str]| {
        let parts = shown.iter().zip(cells).map(|(&c, cell)| {
            let space = " ".repeat(widths[c] - length(cell));
            if table.is_numeric(c) { format!("{space}{cell}") } else { format!("{cell}{space}") }
        });
        parts.collect::<Vec<_>>().join(GAP).trim_end().to_owned()
    };
    let rules: Vec<String> = widths.iter().map(|&width| "─".repeat(width)).collect();
    lines.push(line(&shown.iter().map(|&c| table.columns[c].name.as_str()).collect::<Vec<_>>()));
    lines.push(line(&shown.iter().map(|&c| rules[c].as_str()).collect::<Vec<_>>()));
    lines.extend(cells.iter().map(|row| line(&shown.iter().map(|&c| row[c].as_str()).collect::<Vec<_>>())));
    if !left_out.is_empty() {
        lines.push(String::new());
        let note = format!("{}.csv has these columns too: {}", table.id, left_out.join(", "));
        lines.extend(wrapped(note.split_whitespace(), width, ""));
    }
}

/// A block a row: its keys, then names and values as many to a line as fit.
fn blocks(table: &Table, cells: &[Vec<String>], width: usize, lines: &mut Vec<String>) {
    for (k, row) in cells.iter().enumerate() {
        if k > 0 {
            lines.push(String::new());
        }
        let (keys, others): (Vec<_>, Vec<_>) =
            table.columns.iter().zip(row).filter(|(_, cell)| !cell.is_empty()).partition(|(column, _)| column.is_key());
        let keys: Vec<&str> = keys.into_iter().map(|(_, cell)| cell.as_str()).collect();
        lines.extend(wrapped(keys.join(", ").split_whitespace(), width, ""));
        let parts: Vec<String> = others.into_iter().map(|(column, cell)| format!("{} {cell}", column.name)).collect();
        // A part is one word here: it is not broken, and stands a gap away from the next.
        lines.extend(wrapped(parts.iter().map(String::as_str), width, GAP));
    }
}

/// Words in lines of at most `width` characters, if no word is longer; with a `margin` they stand apart by it too, else by
/// a blank.
fn wrapped<'a>(words: impl Iterator<Item = &'a str>, width: usize, margin: &str) -> Vec<String> {
    let between = if margin.is_empty() { " " } else { margin };
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        match lines.last_mut() {
            Some(line) if length(line) + between.len() + length(word) <= width => {
                line.push_str(between);
                line.push_str(word);
            }
            _ => lines.push(format!("{margin}{word}")),
        }
    }
    lines
}

fn length(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::super::table::{Cell, Column};
    use super::*;

    fn rates() -> Table {
        let mut table = Table::new(
            "rates",
            "Rates",
            vec![
                Column::key("method"),
                Column::count("iterations"),
                Column::text("remark"),
                Column::number("rate", 0.0, 3).detail(),
                Column::time("seconds").detail(),
            ],
        );
        table.note("Start V = P; the rest of this note is longer than forty characters.");
        table.push(vec!["jacobi".into(), 46_usize.into(), Cell::Empty, 0.641123.into(), 0.25.into()]);
        table.push(vec!["pcg-ssor in order".into(), 7_usize.into(), Cell::Empty, Cell::Empty, 1.5.into()]);
        table
    }

    #[test]
    fn all_columns_stand_side_by_side_where_there_is_room() {
        let expected = "\
Rates

Start V = P; the rest of this note is longer than forty characters.

method             iterations   rate  seconds
─────────────────  ──────────  ─────  ───────
jacobi                     46  0.641    0.250
pcg-ssor in order           7            1.50
";
        for width in [80, 200] {
            assert_eq!(fitted(&rates(), width), expected);
        }
    }

    #[test]
    fn details_go_first_and_are_named() {
        let expected = "\
Rates

Start V = P; the rest of this note is
longer than forty characters.

method             iterations   rate
─────────────────  ──────────  ─────
jacobi                     46  0.641
pcg-ssor in order           7

rates.csv has these columns too: seconds
";
        assert_eq!(fitted(&rates(), 40), expected);
        let narrow = fitted(&rates(), 30);
        assert!(narrow.ends_with("order           7\n\nrates.csv has these columns\ntoo: rate, seconds\n"), "{narrow}");
    }

    #[test]
    fn what_does_not_fit_is_a_block_a_row() {
        let expected = "\
jacobi
  iterations 46  rate 0.641
  seconds 0.250

pcg-ssor in order
  iterations 7  seconds 1.50
";
        assert!(fitted(&rates(), 28).ends_with(expected), "{}", fitted(&rates(), 28));
    }

    #[test]
    fn no_line_is_wider_than_the_terminal() {
        // At every width, for the layout changes where a column just fits.
        for width in 28..=80 {
            let text = fitted(&rates(), width);
            assert!(text.lines().all(|line| length(line) <= width), "{width}:\n{text}");
        }
    }

    #[test]
    fn a_summary_stands_above_the_rows() {
        let mut table = rates();
        let mut summary = Table::new("", "", vec![Column::text("median")]);
        summary.push(vec![26.5.into()]);
        table.summary = Some(Box::new(summary));
        let text = fitted(&table, 80);
        assert!(text.contains("characters.\n\nmedian\n──────\n  26.5\n\nmethod "), "{text}");
    }
}
