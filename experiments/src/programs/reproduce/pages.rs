//! Pages of a folder of reports: its index by questions, and tables with their pictures and the way back.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::report::index::{self, Link, Section, anchor, gallery, link};
use crate::report::table::{CsvFile, write_page};
use crate::report::{Provenance, Table};
use limitlab::Result;
use limitlab::error::Error;

use crate::programs::reproduce::claims::{self, FINDINGS, LEDGER, PAPER, Tally, links::linked};
use crate::programs::reproduce::context::{BUILT_IN, Item};

/// The index of a folder.
pub const INDEX: &str = "README.md";

/// What stands first on every page but the index.
fn way_back(files: &[(&str, String)]) -> String {
    let links = files.iter().map(|(text, file)| Link { text: (*text).into(), file: file.clone() });
    let all = Link { text: "All reports".into(), file: INDEX.into() };
    [all].into_iter().chain(links).map(|l| link(&l)).collect::<Vec<_>>().join(" · ")
}

/// A page of words as it is written: with the way back under its heading, and its claims as links. `files` hold the same
/// for programs.
pub fn of_words(page: &str, files: &[(&str, String)]) -> String {
    let (heading, rest) = page.split_once('\n').unwrap_or((page, ""));
    linked(&format!("{heading}\n\n{}\n{rest}", way_back(files)))
}

/// Writes the tables of an item, each with its pictures among `pictures`, all that the item made.
///
/// # Errors
/// If a file cannot be written.
pub fn write_tables(
    folder: &Path,
    item: &Item,
    tables: &[Table],
    pictures: &[String],
    provenance: &Provenance,
) -> Result<()> {
    for table in tables {
        let mut page = table.clone();
        page.notes.insert(0, way_back(&[("as CSV", format!("{}.csv", table.id))]));
        let own = pictures_of(&table.id, tables, pictures);
        let shown = gallery(&own.map(|file| picture(item, file)).collect::<Vec<_>>());
        if !shown.is_empty() {
            page.note(shown);
        }
        table.write_with_page(folder, &linked(&page.to_markdown()), provenance)?;
    }
    Ok(())
}

/// The pictures that the page of a table shows: those named after it; if there are none, those named after no table.
fn pictures_of<'a>(id: &str, tables: &[Table], pictures: &'a [String]) -> impl Iterator<Item = &'a String> {
    let named_after = |file: &str, id: &str| file.strip_prefix(id).is_some_and(|rest| rest.starts_with(['-', '.']));
    let has_own = pictures.iter().any(|file| named_after(file, id));
    pictures.iter().filter(move |file| match has_own {
        true => named_after(file, id),
        false => tables.iter().all(|table| !named_after(file, &table.id)),
    })
}

fn picture(item: &Item, file: &str) -> Link {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let rest = stem.strip_prefix(item.id).unwrap_or(stem).trim_start_matches('-').replace('-', " ");
    let text = if rest.is_empty() { item.title.to_owned() } else { format!("{}: {rest}", item.title) };
    Link { text, file: file.to_owned() }
}

/// Writes the index of what is in the folder, the results of earlier runs too. `root` is the report folder.
///
/// # Errors
/// If a file cannot be read or written.
pub fn write_index(root: &Path, folder: &Path, items: &[Item], provenance: &Provenance) -> Result<()> {
    let files = listing(folder)?;
    let there = |name: &str| files.iter().any(|file| file == name);
    let mut sections = Vec::new();
    for item in items {
        let own = files.iter().filter(|file| belongs(file, item.id));
        let (Some(question), true) = (&item.question, own.clone().next().is_some()) else {
            continue;
        };
        let mut section = Section {
            question: question.asks.into(),
            answer: question.answer.into(),
            tables: Vec::new(),
            pictures: Vec::new(),
        };
        for file in own {
            if file.ends_with(".md") {
                section.tables.push(Link { text: heading(&folder.join(file))?, file: file.clone() });
            } else if file.ends_with(".png")
                || file.strip_suffix("svg").is_some_and(|stem| !there(&format!("{stem}png")))
            {
                section.pictures.push(picture(item, file));
            }
        }
        sections.push(section);
    }
    if folder == root {
        sections.extend(measured(folder, &files)?);
    }
    let page = index::index("Reports", &introduction(root, folder, &files)?, &sections);
    write_page(&folder.join(INDEX), &linked(&page), provenance)
}

/// The sections on what a clock measured, by other programs than this: files that begin with a stem.
fn measured(folder: &Path, files: &[String]) -> Result<Vec<Section>> {
    let apart = [("ten-million", "ten million vertices"), ("quiet-machine", "one iteration on a quieter machine")];
    let apart = apart.into_iter().filter(|(at, _)| folder.join(at).is_dir());
    let apart: String = apart.map(|(at, what)| format!("; [{what}]({at})")).collect();
    let all = [
        (
            "scaling",
            "How do time and memory grow with the mesh?",
            format!("As the program `scaling` measured them on one machine{apart}."),
            "Time and memory over growing meshes",
        ),
        (
            "peers",
            "How do other libraries do on the same system?",
            "As `benches/peers` measured them on one machine, in turn; every error is measured here.".into(),
            "Time and memory of limitlab and of other libraries",
        ),
    ];
    let mut sections = Vec::new();
    for (stem, question, answer, alt) in all {
        let own = || files.iter().filter(|file| file.starts_with(stem));
        let pages = own().filter(|file| file.ends_with(".md"));
        let tables: Vec<Link> = pages
            .map(|file| Ok(Link { text: heading(&folder.join(file))?, file: file.clone() }))
            .collect::<Result<_>>()?;
        let pictures = own().filter(|file| file.ends_with(".png"));
        let pictures = pictures.map(|file| Link { text: alt.into(), file: file.clone() }).collect();
        if !tables.is_empty() {
            sections.push(Section { question: question.into(), answer, tables, pictures });
        }
    }
    Ok(sections)
}

/// Findings, claims by verdict, and what else there is.
fn introduction(root: &Path, folder: &Path, files: &[String]) -> Result<String> {
    let there = |name: &str| files.iter().any(|file| file == name);
    let mut parts = Vec::new();
    let findings = format!("{}.md", FINDINGS.id);
    if there(&findings) {
        parts.push("What the papers left open or state wrongly, each with its proof or its counterexample:".into());
        let line = |title: &str| match title.split_once(". ") {
            Some((number, text)) => format!("{number}. [{text}]({findings}#{})", anchor(title)),
            None => title.into(),
        };
        parts.push(claims::findings::headings().map(line).collect::<Vec<_>>().join("\n"));
    }
    let paper = format!("{}.md", PAPER.id);
    if there(&paper) {
        parts.push(format!("All of it in the form of a short paper: [{}]({paper}).", PAPER.title));
    }
    let ledger = folder.join(format!("{}.csv", LEDGER.id));
    if ledger.is_file() {
        let tallies = claims::tallies_in(&CsvFile::read(&ledger)?);
        let count: usize = tallies.iter().map(|tally| tally.claims).sum();
        parts.push(format!("The papers' statements one by one, [{count} claims]({}.md):", LEDGER.id));
        let line = |Tally { verdict, claims, named }: &Tally| match named.as_slice() {
            [] => format!("- {claims} {verdict}"),
            _ => format!("- {claims} {verdict}: {}", named.join(", ")),
        };
        parts.push(tallies.iter().map(line).collect::<Vec<_>>().join("\n"));
    }
    let about = "Each table is a page here and a CSV file for programs, and `reproduce --only ID` makes one again, with the \
                 start of its file's name for the ID.";
    let other = if folder == root { Path::new(BUILT_IN).join(INDEX) } else { Path::new("..").join(INDEX) };
    let other = match (folder.join(&other).is_file(), folder == root) {
        (false, true) => " Meshes are the papers' own models.".into(),
        (false, false) => " Meshes are built-in stand-ins.".into(),
        (true, true) => format!(
            " Meshes are the papers' own models; [the same on built-in meshes]({}), which need no data.",
            other.display()
        ),
        (true, false) => {
            format!(" Meshes are built-in stand-ins; [the same on the papers' own models]({}).", other.display())
        }
    };
    parts.push(format!("{about}{other}"));
    Ok(parts.join("\n\n"))
}

/// The heading of a page.
fn heading(page: &Path) -> Result<String> {
    let refused = |e| Error::io(page, "read", e);
    let mut line = String::new();
    BufReader::new(File::open(page).map_err(refused)?).read_line(&mut line).map_err(refused)?;
    Ok(line.trim_start_matches('#').trim().to_owned())
}

/// Whether `file` is of the item `id`: its stem is the ID, or starts with it and two dashes.
fn belongs(file: &str, id: &str) -> bool {
    let stem = file.split('.').next().unwrap_or_default();
    stem == id || stem.strip_prefix(id).is_some_and(|r| r.starts_with("--"))
}

/// The names of the files in a folder, sorted, a summary (`ID.md`) before what it sums up (`ID--PART.md`).
fn listing(folder: &Path) -> Result<Vec<String>> {
    let refused = |e| Error::io(folder, "read", e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(refused)? {
        let entry = entry.map_err(refused)?;
        if entry.path().is_file() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort_by(|a, b| a.split('.').cmp(b.split('.')));
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_shows_its_own_pictures_or_those_of_none() {
        let tables = ["item", "item--a", "item--b"].map(|id| Table::new(id, "", vec![]));
        let shown = |id: &str, pictures: &[&str]| {
            let pictures: Vec<String> = pictures.iter().map(|&p| p.into()).collect();
            pictures_of(id, &tables[1..], &pictures).cloned().collect::<Vec<_>>()
        };
        let named = ["item--a.png", "item--a-map.png", "item--ab.svg", "item--c.png"];
        assert_eq!(shown("item--a", &named), ["item--a.png", "item--a-map.png"]);
        assert_eq!(shown("item--b", &named), ["item--ab.svg", "item--c.png"]);
        assert_eq!(shown("item--b", &[]), [""; 0]);
        // A summary shows all.
        assert_eq!(shown("item", &named), named);
    }
}
