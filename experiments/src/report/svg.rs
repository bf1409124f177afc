//! Scalable vector graphics of a drawing, text as outlines.
//!
//! A letter is an outline in units of the embedded font, defined once and placed wherever it is used: the text looks the
//! same in every viewer, whatever its fonts, and is read aloud by its label.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::canvas::{Canvas, PIXELS_PER_POINT, Point, SUPERSAMPLING, Shape};
use super::glyphs::{self, Piece};
use super::page::{base64, hex};
use super::provenance::Provenance;
use limitlab::{Error, Result};

impl Canvas {
    /// The drawing as SVG 1.1, with what made it as metadata; images are PNGs in it.
    ///
    /// # Errors
    /// Those of the PNG encoder; none are known.
    pub fn to_svg(&self, provenance: &Provenance) -> Result<String> {
        let mut letters = BTreeMap::new();
        let mut body = String::new();
        for shape in &self.shapes {
            let element = match shape {
                Shape::Rectangle { area, colour } => {
                    let [x, y, width, height] = [area.left, area.top, area.width(), area.height()].map(short);
                    let colour = hex(*colour);
                    format!(r##"<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="#{colour}"/>"##)
                }
                Shape::Lines { paths, width, colour } => {
                    let paths: String = paths.iter().map(|path| polyline(path)).collect();
                    format!(
                        r##"<path d="{paths}" fill="none" stroke="#{}" stroke-width="{}" stroke-linejoin="round"/>"##,
                        hex(*colour),
                        short(*width)
                    )
                }
                Shape::Polygon { corners, colour } => {
                    format!(r##"<path d="{}Z" fill="#{}"/>"##, polyline(corners), hex(*colour))
                }
                Shape::Disc { centre: (x, y), radius, colour } => {
                    let [x, y, radius] = [*x, *y, *radius].map(short);
                    format!(r##"<circle cx="{x}" cy="{y}" r="{radius}" fill="#{}"/>"##, hex(*colour))
                }
                Shape::Text { text, at: (x, y), size, upright, colour } => {
                    let turn = if *upright { " rotate(-90)" } else { "" };
                    let (places, _) = glyphs::letters(text);
                    let uses: String = places
                        .into_iter()
                        .map(|(glyph, at)| {
                            let outline = letters.entry(glyph.0).or_insert_with(|| outline(&glyphs::outline(glyph)));
                            if outline.is_empty() {
                                return String::new();
                            }
                            format!(r##"<use xlink:href="#letter-{}" x="{}"/>"##, glyph.0, short(at))
                        })
                        .collect();
                    let scale = size / glyphs::units();
                    format!(
                        r##"<g fill="#{}" role="img" aria-label="{}" transform="translate({} {}){turn} scale({scale:.7} -{scale:.7})">{uses}</g>"##,
                        hex(*colour),
                        escaped(text),
                        short(*x),
                        short(*y)
                    )
                }
                Shape::Image { corner: (x, y), image } => {
                    let image = image.reduced(SUPERSAMPLING);
                    let mut png = Vec::new();
                    let refused = |e| Error::Computation(format!("cannot write the picture: {e}"));
                    image.write_png(&mut png).map_err(refused)?;
                    let points = |pixels: u32| short(f64::from(pixels) / f64::from(PIXELS_PER_POINT));
                    format!(
                        r##"<image x="{}" y="{}" width="{}" height="{}" xlink:href="data:image/png;base64,{}"/>"##,
                        short(*x),
                        short(*y),
                        points(image.width),
                        points(image.height),
                        base64(&png)
                    )
                }
            };
            body.push_str(&element);
            body.push('\n');
        }
        letters.retain(|_, outline: &mut String| !outline.is_empty());
        let letters = letters.iter().fold(String::new(), |mut all, (glyph, outline)| {
            let _ = writeln!(all, r##"<path id="letter-{glyph}" d="{outline}"/>"##);
            all
        });
        let (width, height) = (self.width, self.height);
        let made: String = provenance.lines().iter().map(|line| escaped(line) + "\n").collect();
        Ok(format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" version=\"1.1\" \
             width=\"{width}pt\" height=\"{height}pt\" viewBox=\"0 0 {width} {height}\">\n<metadata>\n{made}</metadata>\n<defs>\n{letters}</defs>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{body}</svg>\n"
        ))
    }
}

/// At most three digits after the point.
fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn polyline(path: &[Point]) -> String {
    let command =
        |(k, &(x, y)): (usize, &Point)| format!("{}{} {}", if k == 0 { 'M' } else { 'L' }, short(x), short(y));
    path.iter().enumerate().map(command).collect()
}

fn outline(pieces: &[Piece]) -> String {
    let command = |piece: &Piece| match *piece {
        Piece::Move((x, y)) => format!("M{x} {y}"),
        Piece::Line((x, y)) => format!("L{x} {y}"),
        Piece::Curve((a, b), (x, y)) => format!("Q{a} {b} {x} {y}"),
        Piece::Close => "Z".into(),
    };
    pieces.iter().map(command).collect()
}

/// Text of an element, or the value of an attribute; what XML has no place for is a space.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(&c) => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
