//! Index page of a folder of reports.

use limitlab::Result;
use limitlab::output::write_file;
use std::fmt::Write as _;
use std::path::Path;

/// Width of a picture on the page, in pixels of the screen.
const THUMBNAIL_WIDTH: u32 = 420;

/// One table, figure or claim on the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// As in `--only ID`.
    pub id: String,
    pub title: String,
    /// Names of its files, relative to the page; the PNG ones are shown.
    pub files: Vec<String>,
    /// Which meshes it ran on, in a few words.
    pub meshes: String,
}

/// Writes the page `README.md` into the folder `dir`: a heading, an introduction, one list item an entry.
///
/// # Errors
/// [`Error::Io`](limitlab::Error::Io) if it cannot be written.
pub fn write_index(dir: &Path, title: &str, introduction: &str, entries: &[Entry]) -> Result<()> {
    let page = index(title, introduction, entries);
    write_file(&dir.join("README.md"), |out| out.write_all(page.as_bytes()))
}

fn index(title: &str, introduction: &str, entries: &[Entry]) -> String {
    let mut page = format!("# {title}\n\n{introduction}\n\n");
    for entry in entries {
        let links: Vec<String> = entry.files.iter().map(|file| format!("[{file}]({})", address(file))).collect();
        let _ = writeln!(page, "- **{}** (`{}`), {}: {}", entry.title, entry.id, entry.meshes, links.join(", "));
        for picture in entry.files.iter().filter(|file| file.ends_with(".png")) {
            let source = address(picture);
            let _ = writeln!(
                page,
                "\n  <a href=\"{source}\"><img src=\"{source}\" width=\"{THUMBNAIL_WIDTH}\" alt=\"{source}\"></a>\n"
            );
        }
    }
    page
}

/// A file name as an address: what would end a link is encoded.
fn address(file: &str) -> String {
    let mut out = String::with_capacity(file.len());
    for c in file.chars() {
        match c {
            ' ' | '(' | ')' | '"' | '<' | '>' | '%' | '#' | '?' => {
                let _ = write!(out, "%{:02X}", c as u32);
            }
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_linked_and_pictures_are_shown() {
        let dir = tempfile::tempdir().unwrap();
        let entries = [
            Entry {
                id: "sweep".into(),
                title: "Sweep over ω".into(),
                files: vec!["sweep.md".into(), "sweep (a).png".into()],
                meshes: "torus:16x16".into(),
            },
            Entry {
                id: "claims".into(),
                title: "Claims".into(),
                files: vec!["claims.csv".into()],
                meshes: "all".into(),
            },
        ];
        write_index(dir.path(), "Reports", "On built-in meshes.", &entries).unwrap();
        let page = std::fs::read_to_string(dir.path().join("README.md")).unwrap();
        let expected = "# Reports

On built-in meshes.

- **Sweep over ω** (`sweep`), torus:16x16: [sweep.md](sweep.md), [sweep (a).png](sweep%20%28a%29.png)

  <a href=\"sweep%20%28a%29.png\"><img src=\"sweep%20%28a%29.png\" width=\"420\" alt=\"sweep%20%28a%29.png\"></a>

- **Claims** (`claims`), all: [claims.csv](claims.csv)
";
        assert_eq!(page, expected);
    }
}
