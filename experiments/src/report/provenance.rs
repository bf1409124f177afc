//! Provenance of results: which program, command, options and mesh made a file, in the words that every format repeats.

use serde_json::{Map, Value, json};

/// What made a file. What is not known is left out.
///
/// ```
/// use limitlab_experiments::report::Provenance;
///
/// let made = Provenance { program: "spectrum".into(), command: "spectrum cube".into(), ..Provenance::default() };
/// assert_eq!(made.lines(), ["program: limitlab spectrum", "command: spectrum cube"]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    pub program: String,
    pub version: String,
    /// As a shell takes it.
    pub command: String,
    /// Every option with its value, its default where nobody named it; `null` where there is neither.
    pub options: Map<String, Value>,
    pub threads: Option<usize>,
    /// The commit that the program was built from, and when it was started: none in files that are the same whenever they
    /// are made.
    pub run: Option<Run>,
    /// The mesh or the system, of a file that is about one.
    pub source: Option<Source>,
}

/// One run among those of the same command.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    pub commit: String,
    /// UTC, as RFC 3339 writes it.
    pub date: String,
}

/// A mesh or a system as it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// As the user named it, with the noise if there is any.
    pub name: String,
    /// In words.
    pub size: String,
    /// CRC-32 of the bytes of the files, or of the name of what is built in.
    pub checksum: u32,
}

impl Source {
    /// The checksum with its name.
    pub fn hash(&self) -> String {
        format!("crc32:{:08x}", self.checksum)
    }
}

impl Provenance {
    /// The same of a file about this mesh.
    pub fn about(&self, source: &Source) -> Self {
        Provenance { source: Some(source.clone()), ..self.clone() }
    }

    /// `name: value`, a line each, without line ends.
    pub fn lines(&self) -> Vec<String> {
        let set = |(name, value): (&String, &Value)| Some(format!("{name}={}", shown(value)?));
        let options: Vec<String> = self.options.iter().filter_map(set).collect();
        let source =
            self.source.as_ref().map(|source| format!("{}, {}, {}", quoted(&source.name), source.size, source.hash()));
        let run = self.run.as_ref();
        let all = [
            ("program", Some(format!("limitlab {} {}", self.program, self.version))),
            ("command", Some(self.command.clone())),
            ("options", Some(options.join(" "))),
            ("input", source),
            ("threads", self.threads.map(|threads| threads.to_string())),
            ("commit", run.map(|run| run.commit.clone())),
            ("date", run.map(|run| run.date.clone())),
        ];
        let known = all.into_iter().filter_map(|(name, value)| Some((name, value.filter(|v| !v.is_empty())?)));
        known.map(|(name, value)| format!("{name}: {}", value.trim_end())).collect()
    }

    /// The lines as comments of a text file, each after `sign`.
    pub fn comments(&self, sign: &str) -> String {
        self.lines().iter().map(|line| format!("{sign} {line}\n")).collect()
    }

    /// The foot of a page in Markdown.
    pub fn footer(&self) -> String {
        format!("\n---\n\n{}", self.comments("   "))
    }

    /// The fields of a JSON object.
    pub fn fields(&self) -> Value {
        let run = self.run.as_ref();
        json!({
            "program": self.program,
            "version": self.version,
            "command": self.command,
            "options": self.options,
            "threads": self.threads,
            "provenance": { "commit": run.map(|run| &run.commit), "date": run.map(|run| &run.date) },
        })
    }
}

/// The value of an option, as a shell takes it; none if it is not set.
fn shown(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::String(text) => Some(quoted(text)),
        Value::Array(values) if values.is_empty() => None,
        Value::Array(values) => Some(values.iter().filter_map(shown).collect::<Vec<_>>().join(",")),
        other => Some(other.to_string()),
    }
}

/// One word as a shell takes it, in quotes where it needs them; what is no text is escaped as bash reads it (`$'\n'`).
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_@%+=:,./-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else if word.chars().any(char::is_control) {
        let escaped = |c: char| match c {
            '\t' | '\n' | '\r' | '\'' | '\\' => c.escape_default().to_string(),
            c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
            c => c.into(),
        };
        format!("$'{}'", word.chars().map(escaped).collect::<String>())
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_as_a_shell_takes_them() {
        for (word, expected) in [
            ("torus:8x6", "torus:8x6"),
            ("ω", "ω"),
            ("", "''"),
            ("my mesh.off", "'my mesh.off'"),
            ("a'b", r"'a'\''b'"),
            ("#x", "'#x'"),
            ("end\\", "'end\\'"),
            ("a\nb'\\", r"$'a\nb\'\\'"),
            ("a\u{1b}b\u{85}", r"$'a\u001bb\u0085'"),
            ("~/x", "'~/x'"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }

    #[test]
    fn what_is_not_known_is_left_out_and_no_line_has_an_end_in_it() {
        let mut made =
            Provenance { program: "p".into(), version: "1.2".into(), command: "p cube".into(), ..Default::default() };
        assert_eq!(made.lines(), ["program: limitlab p 1.2", "command: p cube"]);
        let Value::Object(options) = json!({ "tol": "1e-10", "json": false, "noise": null, "input": ["a\nb", "c"] })
        else {
            unreachable!("an object")
        };
        made.options = options;
        made.threads = Some(2);
        made.run = Some(Run { commit: "unknown".into(), date: "2026-01-02T03:04:05Z".into() });
        let made = made.about(&Source { name: "x y".into(), size: "8 vertices".into(), checksum: 0xab });
        assert_eq!(
            made.lines()[2..],
            [
                r"options: input=$'a\nb',c json=false tol=1e-10",
                "input: 'x y', 8 vertices, crc32:000000ab",
                "threads: 2",
                "commit: unknown",
                "date: 2026-01-02T03:04:05Z"
            ]
        );
        assert!(made.footer().lines().skip(3).all(|line| line.starts_with("    ")));
    }
}
