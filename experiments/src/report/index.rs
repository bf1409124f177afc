//! Index page of a folder of reports: a section a question, with its answer, its tables and small pictures.

use std::fmt::Write as _;

/// Width of a picture among others, in pixels of the screen.
const THUMBNAIL_WIDTH: u32 = 240;

/// A file with the words that stand for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    pub text: String,
    /// Its name, relative to the page.
    pub file: String,
}

/// What was asked, and what came out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    pub question: String,
    /// Markdown, a line.
    pub answer: String,
    /// Pages of tables.
    pub tables: Vec<Link>,
    pub pictures: Vec<Link>,
}

/// The page: a heading, an introduction in Markdown, the sections.
pub fn index(title: &str, introduction: &str, sections: &[Section]) -> String {
    let mut page = format!("# {title}\n\n{introduction}\n");
    for section in sections {
        let _ = write!(page, "\n## {}\n\n{}\n", section.question, section.answer);
        let tables: Vec<String> = section.tables.iter().map(link).collect();
        for part in [tables.join(" · "), gallery(&section.pictures)] {
            if !part.is_empty() {
                let _ = write!(page, "\n{part}\n");
            }
        }
    }
    page
}

/// A file as a link in Markdown.
pub fn link(to: &Link) -> String {
    format!("[{}]({})", to.text, address(&to.file))
}

/// Small pictures side by side, as many as fit in a row, each a link to itself: one paragraph of Markdown, empty without any.
pub fn gallery(pictures: &[Link]) -> String {
    let picture = |Link { text, file }: &Link| {
        let source = address(file);
        let words = text.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;");
        format!("<a href=\"{source}\"><img src=\"{source}\" width=\"{THUMBNAIL_WIDTH}\" alt=\"{words}\"></a>")
    };
    pictures.iter().map(picture).collect::<Vec<_>>().join("\n")
}

/// The place of a heading within its page, as renderers of Markdown name it.
pub fn anchor(heading: &str) -> String {
    let lower = heading.to_lowercase().replace(' ', "-");
    lower.chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '_')).collect()
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
    fn questions_have_answers_tables_and_pictures_in_a_row() {
        let to = |text: &str, file: &str| Link { text: text.into(), file: file.into() };
        let sections = [
            Section {
                question: "Which ω?".into(),
                answer: "The predicted one.".into(),
                tables: vec![to("Sweep", "sweep.md"), to("Summary", "sweep--all.md")],
                pictures: vec![to("a \"b\" < c", "sweep (a).png"), to("d", "d.png")],
            },
            Section {
                question: "Why?".into(),
                answer: "By theorem.".into(),
                tables: vec![to("Proof", "proof.md")],
                pictures: vec![],
            },
        ];
        let expected = "# Reports

On built-in meshes.

## Which ω?

The predicted one.

[Sweep](sweep.md) · [Summary](sweep--all.md)

<a href=\"sweep%20%28a%29.png\"><img src=\"sweep%20%28a%29.png\" width=\"240\" alt=\"a &quot;b&quot; &lt; c\"></a>
<a href=\"d.png\"><img src=\"d.png\" width=\"240\" alt=\"d\"></a>

## Why?

By theorem.

[Proof](proof.md)
";
        assert_eq!(index("Reports", "On built-in meshes.", &sections), expected);
    }

    #[test]
    fn anchors_are_those_of_renderers() {
        assert_eq!(anchor("4. \"e^{k+1} < e^k\" depends on the norm"), "4-ek1--ek-depends-on-the-norm");
        assert_eq!(anchor("2. Thall's ω = ½ always converges"), "2-thalls-ω--½-always-converges");
    }
}
