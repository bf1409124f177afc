//! The one error type of the library: each message is a single line that names the place and a way out.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::mesh::validate::Validation;

/// What data or the machine can do to a computation. Broken contracts of the library panic instead.
///
/// Both formats are the one line, so that a `main` that returns an error prints what a person can use.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused: opening, reading, writing, renaming.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb phrase: "read", "create the folder".
        action: &'static str,
        /// The operating system's own error.
        source: std::io::Error,
    },
    /// A file's text or bytes are not what its format says, at a line where there is one.
    #[error("{}{}: {what}", path.display(), at_line(*line))]
    Parse {
        /// The file.
        path: PathBuf,
        /// The line, from 1; `None` where the place is not a line.
        line: Option<usize>,
        /// What is wrong there, as the rest of the message.
        what: String,
    },
    /// A mesh with defects: all of them.
    #[error("{}", .0.summary_line())]
    Defects(Box<Validation>),
    /// The first face that is no triangle, under a scheme that is defined on these alone.
    #[error("face {face} has {corners} corners, and {scheme} is defined on triangles only; triangulate the mesh")]
    NotTriangles {
        /// The number of the face, from 0.
        face: usize,
        /// How many corners it has.
        corners: usize,
        /// The scheme or the refinement by name.
        scheme: &'static str,
    },
    /// A boundary that is treated as interior, where whole faces around every vertex are needed.
    #[error(
        "{}, and {scheme} needs whole faces around every vertex; close the holes, or take the boundary as edge-and-corner",
        counted(*edges, "boundary edge")
    )]
    Open {
        /// The number of boundary edges.
        edges: usize,
        /// The scheme by name, or what else needs a closed mesh.
        scheme: &'static str,
    },
    /// A sharp edge or vertex that the mesh does not have, or whose sharpness is none.
    #[error("{0}")]
    Tag(String),
    /// A vertex at which one sharp edge ends.
    #[error("vertex {vertex} is a dart, the end of one sharp edge, and {scheme} has no row for it; {advice}")]
    Dart {
        /// The number of the vertex, from 0.
        vertex: usize,
        /// The scheme or the work by name.
        scheme: &'static str,
        /// A way out, as an imperative.
        advice: &'static str,
    },
    /// A method that needs A = H·M with a symmetric M, on a mesh with darts or semi-sharp vertices.
    #[error(
        "vertex {vertex} is a dart or semi-sharp, so that no diagonal makes the matrix symmetric, as {method} needs it; use auto, {}",
        one_of(others)
    )]
    Unsymmetric {
        /// The first such vertex, from 0.
        vertex: usize,
        /// The method by name.
        method: &'static str,
        /// Those that need none, by name.
        others: Vec<&'static str>,
    },
    /// A vertex that is semi-sharp, or at a semi-sharp edge.
    #[error(
        "vertex {vertex} is semi-sharp, or ends a semi-sharp edge, and {scheme} has no rule for it; give it the sharpness 0, or 10 and more"
    )]
    SemiSharp {
        /// The number of the vertex, from 0.
        vertex: usize,
        /// The scheme by name.
        scheme: &'static str,
    },
    /// Sharp edges or vertices, where all vertices must be smooth.
    #[error("{what} needs a mesh without creases, corners and boundaries")]
    Creased {
        /// What needs it.
        what: &'static str,
    },
    /// A result that 32-bit indices do not reach.
    #[error("{what}, which 32-bit indices do not reach; {advice}")]
    TooLarge {
        /// The result and its size, as a clause.
        what: String,
        /// A way out, as an imperative.
        advice: &'static str,
    },
    /// What is asked of a scheme that has nothing of the kind, and the schemes that have.
    #[error("{what}: use {}", one_of(schemes))]
    NotOffered {
        /// Why not.
        what: String,
        /// By name.
        schemes: &'static [&'static str],
    },
    /// Normals or shape handles, which act on a refined surface.
    #[error("{what} a surface after {needed} refinements or more")]
    TooFewLevels {
        /// What acts on the surface, with its verb, as the start of the message.
        what: &'static str,
        /// The least number of refinements.
        needed: usize,
    },
    /// A mesh that was read but cannot be used, by name, or given data about its vertices.
    #[error("{mesh}: {what}")]
    Mesh {
        /// The name of the mesh, or of the data about its vertices.
        mesh: String,
        /// What is wrong, with the place and a way out.
        what: String,
    },
    /// A computation that needs more memory than is available: found before the work.
    #[error("{what} needs {} of memory, of which {} are available; {advice}", megabytes(*needed), megabytes(*available))]
    Memory {
        /// The computation, as the subject of a sentence.
        what: String,
        /// Bytes.
        needed: u64,
        /// Bytes.
        available: u64,
        /// A way out, as an imperative.
        advice: &'static str,
    },
    /// A matrix of somebody else that cannot be taken over: not square, unsorted, too large, not symmetric, no positive
    /// diagonal.
    #[error("{0}")]
    Matrix(String),
    /// A computation that has no result to give.
    #[error("{0}")]
    Computation(String),
    /// A name or number that means nothing here: an unknown built-in mesh, method, scheme.
    #[error("{0}")]
    Unknown(String),
}

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Dart`] with the ways out that every mesh has.
    pub(crate) fn dart(vertex: usize, scheme: &'static str) -> Self {
        let advice = "make it a corner, or lead the crease on to a boundary, a corner or another crease";
        Error::Dart { vertex, scheme, advice }
    }

    /// An [`Error::Io`] about `path`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Error::Io { path: path.to_path_buf(), action, source }
    }

    /// An [`Error::Parse`] at a 1-based `line` of `path`; `None` where the place is not a line.
    pub fn parse(path: &Path, line: Option<usize>, what: impl Into<String>) -> Self {
        Error::Parse { path: path.to_path_buf(), line, what: what.into() }
    }

    /// An [`Error::Mesh`] about the mesh called `mesh`.
    pub fn mesh(mesh: impl Into<String>, what: impl Into<String>) -> Self {
        Error::Mesh { mesh: mesh.into(), what: what.into() }
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// A number in a message: its shortest digits, with an exponent where they would be many.
pub fn short(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-5..1e15).contains(&x.abs());
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// `1 face`, `2 faces`, `3 vertices`.
pub fn counted(count: usize, one: &str) -> String {
    match (count, one) {
        (1, _) => format!("1 {one}"),
        (_, "vertex") => format!("{count} vertices"),
        _ => format!("{count} {one}s"),
    }
}

/// `a, b or c`.
pub fn one_of(names: &[&str]) -> String {
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// A number of bytes with its unit.
fn megabytes(bytes: u64) -> String {
    if bytes < 10_000_000_000 { format!("{} MB", bytes / 1_000_000) } else { format!("{} GB", bytes / 1_000_000_000) }
}

fn at_line(line: Option<usize>) -> String {
    line.map_or_else(String::new, |l| format!(", line {l}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_not_many() {
        for (count, one, text) in [(1, "face", "1 face"), (0, "face", "0 faces"), (2, "vertex", "2 vertices")] {
            assert_eq!(counted(count, one), text);
        }
        assert_eq!(counted(1, "vertex"), "1 vertex");
    }

    #[test]
    fn numbers_are_short_and_exact() {
        for (x, text) in [
            (0.0, "0"),
            (0.05, "0.05"),
            (-1250.0, "-1250"),
            (1e300, "1e300"),
            (-1e-13, "-1e-13"),
            (f64::MAX, "1.7976931348623157e308"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}
