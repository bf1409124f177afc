//! Interactive pages: one HTML file with its style, its script and its data, for browsers without a network.
//!
//! A [`Page`] is put into the page as JSON, in which long arrays are [packed](Packed) as little-endian bytes in base64. Its own
//! content security policy forbids it to load anything; names from outside reach it as text, never as HTML. What draws
//! are `plot.js` (SVG) and `view.js` (WebGL 2), without a library.

mod thinned;

use std::path::Path;

use glam::DVec3;
use serde::Serialize;
use serde_json::Value;

use limitlab::mesh::Faces;
use limitlab::output::write_file;
use limitlab::{Error, Result};

use super::canvas::Dash;
use super::provenance::Provenance;
use super::series::Style;
use super::svg::escaped;
use super::{Colour, ColourMap};
pub use thinned::Thinned;

/// No page has as many bytes: what fills one up is chosen so.
pub const LIMIT: usize = 5_000_000;

const FRAME: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPTS: [&str; 3] = [include_str!("plot.js"), include_str!("view.js"), include_str!("page.js")];
/// Colours that the script puts between equal steps of the error.
const COLOURS: usize = 64;

/// What a page shows of one system.
#[derive(Debug, Serialize)]
pub struct Page {
    pub title: String,
    /// The lines below the title.
    pub about: Vec<String>,
    /// What errors and the tolerance are measured in.
    pub unit: &'static str,
    pub tolerance: f64,
    /// The methods that iterate.
    pub curves: Vec<Curve>,
    /// All methods, as in `compare-solvers --json`.
    pub rows: Value,
    /// Methods that were not run, and why.
    pub refused: Option<String>,
    pub sweep: Vec<Sweep>,
    pub spectra: Vec<Eigenvalues>,
    /// Of a system that has a mesh.
    pub view: Option<View>,
}

/// The line of a method: six digits of its colour, its dashes.
#[derive(Debug, Serialize)]
pub struct Look {
    colour: String,
    dash: Dash,
}

impl From<Style> for Look {
    fn from(style: Style) -> Self {
        Look { colour: hex(style.colour), dash: style.dash }
    }
}

/// A method's errors over its iterations.
#[derive(Debug, Serialize)]
pub struct Curve {
    pub name: String,
    pub look: Look,
    pub outcome: &'static str,
    pub iterations: usize,
    /// The iterations whose errors follow, ascending: u32.
    pub at: Packed,
    /// f64.
    pub max: Packed,
    /// The errors at the vertices of the [`View`].
    pub frames: Option<Frames>,
}

/// Errors at all vertices that are shown, of some iterates.
#[derive(Debug, Serialize)]
pub struct Frames {
    /// The iterations, ascending: u32.
    pub at: Packed,
    /// One byte a vertex and iterate: from 0 to 255 over the logarithms of [`View::range`].
    pub errors: Packed,
}

/// A method over ω.
#[derive(Debug, Serialize)]
pub struct Sweep {
    pub method: &'static str,
    pub look: Look,
    /// Where its rate is best, and beyond which it diverges, if theory tells.
    pub optimal: Option<f64>,
    pub critical: Option<f64>,
    pub runs: Vec<Run>,
}

/// A method at one ω. What is not finite is not known.
#[derive(Debug, Serialize)]
pub struct Run {
    pub omega: f64,
    pub outcome: &'static str,
    pub iterations: usize,
    pub predicted: f64,
    pub measured: Option<f64>,
}

/// The spectrum of one matrix.
#[derive(Debug, Serialize)]
pub struct Eigenvalues {
    pub matrix: &'static str,
    /// The least real part and the greatest.
    pub ends: [f64; 2],
    /// What is proven of them.
    pub bounds: [f64; 2],
    /// Up to how many unknowns all are computed.
    pub most: usize,
    /// Real and imaginary parts of all, if they were: f64.
    pub all: Option<[Packed; 2]>,
}

/// Surfaces to be turned about, coloured by errors.
#[derive(Debug, Serialize)]
pub struct View {
    /// What was done to show it, in sentences.
    pub about: String,
    /// The errors of the first and of the last colour.
    pub range: [f64; 2],
    pub given: Solid,
    /// The points of the control mesh, whose faces are those of the given one: f32.
    pub cage: Option<Packed>,
    pub limit: Option<Solid>,
}

/// A mesh with its sharp edges.
#[derive(Debug, Serialize)]
pub struct Solid {
    /// Three coordinates a vertex, about the middle of the given points, over half the diagonal of their box: f32.
    pub points: Packed,
    /// The corners of all faces, the last one of each with its highest bit set: u32.
    pub corners: Packed,
    /// Two ends an edge: u32.
    pub creases: Packed,
    /// The given vertex whose error a vertex shows: u32. Its own, if there is none.
    pub shown_by: Option<Packed>,
}

/// Numbers as little-endian bytes in base64.
#[derive(Debug, PartialEq, Serialize)]
pub struct Packed(String);

impl Packed {
    /// The bytes of numbers one after the other.
    ///
    /// ```
    /// use limitlab_experiments::report::page::Packed;
    /// let packed = Packed::new([1u32, 258].map(u32::to_le_bytes));
    /// assert_eq!(packed.as_str(), "AQAAAAIBAAA=");
    /// ```
    pub fn new<const K: usize>(numbers: impl IntoIterator<Item = [u8; K]>) -> Self {
        let bytes: Vec<u8> = numbers.into_iter().flatten().collect();
        Packed(base64(&bytes))
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// RFC 4648, with padding.
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let group = (0..3).fold(0u32, |sum, k| sum << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        for k in 0..4 {
            let digit = (group >> (18 - 6 * k)) & 63;
            text.push(if k <= three.len() { char::from(DIGITS[digit as usize]) } else { '=' });
        }
    }
    text
}

/// Six digits.
pub(super) fn hex(Colour(red, green, blue): Colour) -> String {
    format!("{red:02x}{green:02x}{blue:02x}")
}

/// Where a page has the points of a mesh: its middle, and the length that becomes 1.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub middle: DVec3,
    pub unit: f64,
}

impl Place {
    /// The coordinates there: f32.
    pub fn packed(self, points: impl IntoIterator<Item = DVec3>) -> Packed {
        let coordinates = |p: DVec3| ((p - self.middle) / self.unit).as_vec3().to_array();
        Packed::new(points.into_iter().flat_map(coordinates).map(f32::to_le_bytes))
    }
}

impl Solid {
    pub fn new(points: Packed, faces: &Faces, creases: &[[u32; 2]]) -> Self {
        const LAST: u32 = 1 << 31;
        let flagged = |face: &[u32]| -> Vec<u32> {
            face.iter().enumerate().map(|(k, &v)| if k + 1 == face.len() { v | LAST } else { v }).collect()
        };
        Solid {
            points,
            corners: Packed::new(faces.iter().flat_map(flagged).map(u32::to_le_bytes)),
            creases: Packed::new(creases.iter().flatten().map(|v| v.to_le_bytes())),
            shown_by: None,
        }
    }
}

impl Page {
    /// The whole file.
    ///
    /// # Errors
    /// Data that JSON cannot hold; there are none.
    pub fn to_html(&self, provenance: &Provenance) -> Result<String> {
        let json = serde_json::to_string(self).map_err(|e| Error::Computation(format!("JSON: {e}")))?;
        // Within strings only: nothing in the data can end the element that they are in.
        let island = json.replace('<', "\\u003c");
        let colours: Vec<String> =
            (0..COLOURS).map(|k| hex(ColourMap::Sequential.colour(k as f64 / (COLOURS - 1) as f64))).collect();
        Ok(FRAME
            .replace("/*STYLE*/", STYLE)
            .replace("/*SCRIPT*/", &SCRIPTS.concat().replace("/*COLOURS*/", &colours.concat()))
            .replace("/*DATA*/", &island)
            .replace("<!--PROVENANCE-->", &metadata(provenance)))
    }

    /// Writes the file.
    ///
    /// # Errors
    /// As [`write_file`].
    pub fn write(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        let html = self.to_html(provenance)?;
        write_file(path, |out| out.write_all(html.as_bytes()))
    }
}

/// What made the page, for who reads its source.
fn metadata(provenance: &Provenance) -> String {
    let meta = |line: &String| {
        let (name, content) = line.split_once(": ").unwrap_or(("description", line));
        format!(r#"<meta name="{name}" content="{}">"#, escaped(content))
    };
    provenance.lines().iter().map(meta).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let cases = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let coded = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (text, code) in cases.iter().zip(coded) {
            assert_eq!(base64(text.as_bytes()), code);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xbf]), "+/+/");
    }

    #[test]
    fn names_from_outside_stay_text_and_the_file_names_no_address() {
        let hostile = "</script><script>alert(1)</script><!-- /*DATA*/ \u{2028} \" \\ & 'x'";
        let page = Page {
            title: hostile.into(),
            about: vec![hostile.into()],
            unit: "mesh units",
            tolerance: 1e-10,
            curves: Vec::new(),
            rows: serde_json::json!([{ "method": hostile, "detail": null }]),
            refused: Some(hostile.into()),
            sweep: Vec::new(),
            spectra: Vec::new(),
            view: None,
        };
        let html = page.to_html(&Provenance::default()).unwrap();
        // The island, the script, and their ends.
        assert_eq!((html.matches("<script").count(), html.matches("</script").count()), (2, 2));
        assert!(!html.contains("<!-- /*DATA*/") && !html.contains("/*STYLE*/") && !html.contains("/*COLOURS*/"));
        let island = html.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
        let data: Value = serde_json::from_str(island).unwrap();
        assert_eq!((&data["title"], &data["rows"][0]["method"]), (&hostile.into(), &hostile.into()));
        assert!(html.contains("default-src 'none'"));
        let elsewhere = html.replace("http://www.w3.org/2000/svg", "").replace("url(#", "").to_lowercase();
        for address in ["http:", "https", "//www", "@import", "url(", "src=", "href="] {
            assert!(!elsewhere.contains(address), "{address}");
        }
    }
}
