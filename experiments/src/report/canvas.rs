//! Strokes, markers and text on a bitmap, in points (1/72 inch) from the top left.
//!
//! The bitmap is drawn at [`SUPERSAMPLING`] times the final resolution and then averaged, because the backend
//! fills without smoothing and places everything at whole pixels.

use super::png::Image;
use limitlab::{Error, Result};
use plotters::backend::BitMapBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{BitMapElement, Circle, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, IntoFont, WHITE, register_font};
use std::fmt::Display;
use std::sync::Once;

/// A colour of red, green and blue, each from 0 to 255.
pub use plotters::style::RGBColor as Colour;

/// Pixels of the final image a point: 216 dots an inch.
pub(super) const PIXELS_PER_POINT: u32 = 3;

/// Pixels drawn for each pixel of the final image, in both directions.
pub(super) const SUPERSAMPLING: u32 = 3;

/// Drawn pixels a point.
const SCALE: f64 = (PIXELS_PER_POINT * SUPERSAMPLING) as f64;

const FONT: &str = "limitlab-sans";

/// The backend takes the distance from ascent to descent as the size of a font; DejaVu Sans has
/// (1901 + 483) / 2048 of an em there.
const HEIGHT_PER_EM: f64 = 2384.0 / 2048.0;

/// The height of digits and capitals in ems.
pub(super) const CAP_HEIGHT: f64 = 0.73;

/// Size of a subscript or superscript, and how far it is lowered or raised, in ems of the text.
const SCRIPT_SIZE: f64 = 0.72;
const SUBSCRIPT_DROP: f64 = 0.16;
const SUPERSCRIPT_RISE: f64 = 0.36;

/// A place on the canvas in points: x to the right, y down.
pub(super) type Point = (f64, f64);

/// A rectangle on the canvas, in points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn centre(&self) -> Point {
        ((self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0)
    }

    pub fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// The part of the segment from `a` to `b` inside (Liang and Barsky 1984).
    fn clip(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (speed, room) in
            [(-dx, a.0 - self.left), (dx, self.right - a.0), (-dy, a.1 - self.top), (dy, self.bottom - a.1)]
        {
            if speed == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if speed < 0.0 {
                enter = enter.max(room / speed);
            } else {
                leave = leave.min(room / speed);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (enter < leave).then(|| {
            // The ends themselves stay exact, so that pieces join up.
            let from = if enter > 0.0 { at(enter) } else { a };
            let to = if leave < 1.0 { at(leave) } else { b };
            (from, to)
        })
    }
}

/// How a line is broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dash {
    #[default]
    Solid,
    Dashed,
    DashDotted,
    Dotted,
}

impl Dash {
    /// Lengths of line and gap in turn, in multiples of the line's width.
    fn pattern(self) -> &'static [f64] {
        match self {
            Dash::Solid => &[],
            Dash::Dashed => &[4.5, 2.2],
            Dash::DashDotted => &[5.0, 2.0, 1.2, 2.0],
            Dash::Dotted => &[1.2, 1.8],
        }
    }
}

/// The mark at a data point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Diamond,
    Triangle,
    InvertedTriangle,
    Cross,
    Plus,
}

/// Which point of a text is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A bitmap to draw on.
pub(super) struct Canvas<'a> {
    area: DrawingArea<BitMapBackend<'a>, Shift>,
}

/// Draws an image of `width`×`height` points.
pub(super) fn paint(width: u32, height: u32, draw: impl FnOnce(&Canvas<'_>) -> Result<()>) -> Result<Image> {
    let scale = PIXELS_PER_POINT * SUPERSAMPLING;
    let (width, height) = (width * scale, height * scale);
    let mut rgb = vec![u8::MAX; 3 * width as usize * height as usize];
    {
        let area = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
        let canvas = Canvas { area };
        draw(&canvas)?;
        drawn(canvas.area.present())?;
    }
    Ok(Image { width, height, rgb }.reduced(SUPERSAMPLING))
}

fn drawn<T, E: Display>(result: std::result::Result<T, E>) -> Result<T> {
    result.map_err(|e| Error::Computation(format!("cannot draw the picture: {e}")))
}

/// The font whose em is `size` points.
fn font(size: f64) -> FontDesc<'static> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        let parsed = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(parsed.is_ok(), "the embedded font is a font");
    });
    (FontFamily::Name(FONT), size * SCALE * HEIGHT_PER_EM).into_font()
}

/// A piece of text of one size: its size and its rise in ems of the whole.
struct Run<'t> {
    text: &'t str,
    size: f64,
    rise: f64,
}

/// Splits `ω_{opt}` and `x^{2}` into runs; an underscore or caret without brace is itself.
fn runs(text: &str) -> Vec<Run<'_>> {
    let plain = |text| Run { text, size: 1.0, rise: 0.0 };
    let mut found = Vec::new();
    let mut rest = text;
    loop {
        let start = [rest.find("_{"), rest.find("^{")].into_iter().flatten().min();
        let end = start.and_then(|s| rest[s..].find('}').map(|e| s + e));
        let (Some(start), Some(end)) = (start, end) else {
            if !rest.is_empty() {
                found.push(plain(rest));
            }
            return found;
        };
        if start > 0 {
            found.push(plain(&rest[..start]));
        }
        found.push(Run {
            text: &rest[start + 2..end],
            size: SCRIPT_SIZE,
            rise: if rest[start..].starts_with('_') { -SUBSCRIPT_DROP } else { SUPERSCRIPT_RISE },
        });
        rest = &rest[end + 1..];
    }
}

/// The advance of `text` at `size` points, in points.
pub(super) fn text_width(text: &str, size: f64) -> Result<f64> {
    let mut width = 0.0;
    for run in runs(text) {
        let ((left, _), (right, _)) = drawn(font(size * run.size).layout_box(run.text))?;
        width += f64::from(right - left) / SCALE;
    }
    Ok(width)
}

fn pixel((x, y): Point) -> (i32, i32) {
    ((x * SCALE).round() as i32, (y * SCALE).round() as i32)
}

impl Canvas<'_> {
    /// Writes `text` with its baseline through `at`, to the right, or upward if `upright`.
    pub fn text(&self, text: &str, at: Point, size: f64, anchor: Anchor, upright: bool, colour: Colour) -> Result<()> {
        let width = text_width(text, size)?;
        let mut along = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -width / 2.0,
            Anchor::End => -width,
        };
        for run in runs(text) {
            let em = size * run.size;
            // The backend puts the baseline half the font's height below the anchor's top.
            let above = em * HEIGHT_PER_EM / 2.0 + size * run.rise;
            let (place, turn) = if upright {
                ((at.0 - above, at.1 - along), FontTransform::Rotate270)
            } else {
                ((at.0 + along, at.1 - above), FontTransform::None)
            };
            let style = font(em).transform(turn).color(&colour).pos(Pos::new(HPos::Left, VPos::Top));
            drawn(self.area.draw_text(run.text, &style, pixel(place)))?;
            along += text_width(run.text, em)?;
        }
        Ok(())
    }

    /// Fills a rectangle.
    pub fn fill(&self, rect: Rect, colour: Colour) -> Result<()> {
        let (x0, y0) = pixel((rect.left, rect.top));
        let (x1, y1) = pixel((rect.right, rect.bottom));
        // The backend includes the last row and column.
        let corners = [(x0, y0), ((x1 - 1).max(x0), (y1 - 1).max(y0))];
        drawn(self.area.draw(&Rectangle::new(corners, colour.filled())))
    }

    /// A straight upright line, its middle at `x`, that ends square at `from` and `to`.
    pub fn upright(&self, x: f64, (from, to): (f64, f64), width: f64, colour: Colour) -> Result<()> {
        let line = Rect { left: x - width / 2.0, right: x + width / 2.0, top: from, bottom: to };
        self.fill(line, colour)
    }

    /// A straight level line, its middle at `y`, that ends square at `from` and `to`.
    pub fn level(&self, y: f64, (from, to): (f64, f64), width: f64, colour: Colour) -> Result<()> {
        let line = Rect { left: from, right: to, top: y - width / 2.0, bottom: y + width / 2.0 };
        self.fill(line, colour)
    }

    /// Fills a rectangle with an image, made for its width and height in drawn pixels and the drawn pixels a point.
    pub fn image(&self, rect: Rect, make: impl FnOnce(u32, u32, f64) -> Result<Image>) -> Result<()> {
        let (x0, y0) = pixel((rect.left, rect.top));
        let (x1, y1) = pixel((rect.right, rect.bottom));
        let size = ((x1 - x0).max(1) as u32, (y1 - y0).max(1) as u32);
        let image = make(size.0, size.1, SCALE)?;
        match BitMapElement::with_owned_buffer((x0, y0), size, image.rgb) {
            Some(bitmap) => drawn(self.area.draw(&bitmap)),
            None => drawn(Err("an image of another size")),
        }
    }

    /// Draws the outline of a rectangle, its middle on the rectangle's edge.
    pub fn outline(&self, rect: Rect, width: f64, colour: Colour) -> Result<()> {
        let h = width / 2.0;
        for y in [rect.top, rect.bottom] {
            self.level(y, (rect.left - h, rect.right + h), width, colour)?;
        }
        for x in [rect.left, rect.right] {
            self.upright(x, (rect.top - h, rect.bottom + h), width, colour)?;
        }
        Ok(())
    }

    /// Draws the polyline through `path` as far as it lies in `window`. Dashes have their lengths along the line
    /// on paper, whatever the spacing of its points.
    pub fn stroke(&self, path: &[Point], window: Rect, width: f64, dash: Dash, colour: Colour) -> Result<()> {
        for piece in clipped(path, window) {
            for piece in dashed(&piece, dash.pattern(), width) {
                self.solid(&piece, width, colour)?;
            }
        }
        Ok(())
    }

    /// A solid polyline: one quadrilateral a segment, one disc a joint.
    fn solid(&self, path: &[Point], width: f64, colour: Colour) -> Result<()> {
        // The backend's shapes include their border pixels.
        let half = ((width * SCALE - 1.0) / 2.0).max(0.0);
        let px: Vec<Point> = path.iter().map(|&(x, y)| (x * SCALE, y * SCALE)).collect();
        for segment in px.windows(2) {
            let ((ax, ay), (bx, by)) = (segment[0], segment[1]);
            let (dx, dy) = (bx - ax, by - ay);
            let length = dx.hypot(dy);
            if length == 0.0 {
                continue;
            }
            let (nx, ny) = (-dy / length * half, dx / length * half);
            let corners = [(ax + nx, ay + ny), (bx + nx, by + ny), (bx - nx, by - ny), (ax - nx, ay - ny)];
            self.polygon(&corners, colour)?;
        }
        for &centre in px.iter().skip(1).take(px.len().saturating_sub(2)) {
            self.disc(centre, half, colour)?;
        }
        Ok(())
    }

    /// Fills the polygon with these corners in drawn pixels.
    fn polygon(&self, corners: &[Point], colour: Colour) -> Result<()> {
        let whole = |&(x, y): &Point| (x.round() as i32, y.round() as i32);
        let corners: Vec<_> = corners.iter().map(whole).collect();
        drawn(self.area.draw(&Polygon::new(corners, colour.filled())))
    }

    /// Fills a disc, in drawn pixels.
    fn disc(&self, (x, y): Point, radius: f64, colour: Colour) -> Result<()> {
        let centre = (x.round() as i32, y.round() as i32);
        let disc = Circle::new(centre, radius.round() as i32, colour.filled());
        drawn(self.area.draw(&disc))
    }

    /// Draws a marker of about `radius` points with a thin white rim that parts it from its neighbours.
    pub fn marker(&self, at: Point, marker: Marker, radius: f64, colour: Colour) -> Result<()> {
        const RIM: f64 = 0.5;
        match marker {
            Marker::Cross | Marker::Plus => {
                let r = radius * if marker == Marker::Cross { 1.0 } else { 1.35 };
                let arms = if marker == Marker::Cross { [(r, r), (r, -r)] } else { [(r, 0.0), (0.0, r)] };
                for (dx, dy) in arms {
                    let arm = [(at.0 - dx, at.1 - dy), (at.0 + dx, at.1 + dy)];
                    self.solid(&arm, 0.5 * radius, colour)?;
                }
                Ok(())
            }
            _ => {
                self.shape(at, marker, radius + RIM, WHITE)?;
                self.shape(at, marker, radius, colour)
            }
        }
    }

    /// Fills a closed marker. The sizes give all shapes about the same area.
    fn shape(&self, at: Point, marker: Marker, radius: f64, colour: Colour) -> Result<()> {
        let (x, y, r) = (at.0 * SCALE, at.1 * SCALE, radius * SCALE);
        let corners: &[Point] = match marker {
            Marker::Square => &[(-0.87, -0.87), (0.87, -0.87), (0.87, 0.87), (-0.87, 0.87)],
            Marker::Diamond => &[(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0)],
            Marker::Triangle => &[(0.0, -1.25), (1.15, 0.75), (-1.15, 0.75)],
            Marker::InvertedTriangle => &[(0.0, 1.25), (1.15, -0.75), (-1.15, -0.75)],
            Marker::Circle | Marker::Cross | Marker::Plus => {
                return self.disc((x, y), r, colour);
            }
        };
        let corners: Vec<Point> = corners.iter().map(|c| (x + r * c.0, y + r * c.1)).collect();
        self.polygon(&corners, colour)
    }
}

/// The parts of a polyline inside `window`.
fn clipped(path: &[Point], window: Rect) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for segment in path.windows(2) {
        let Some((a, b)) = window.clip(segment[0], segment[1]) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&a) => piece.push(b),
            _ => pieces.push(vec![a, b]),
        }
    }
    pieces
}

/// The lines of a dashed polyline; `pattern` is in multiples of `width`, and empty for a solid line.
fn dashed(path: &[Point], pattern: &[f64], width: f64) -> Vec<Vec<Point>> {
    if pattern.is_empty() {
        return vec![path.to_vec()];
    }
    let mut lines = Vec::new();
    let mut line: Vec<Point> = path.first().copied().into_iter().collect();
    let (mut index, mut left) = (0, pattern[0] * width); // even entries draw, odd ones skip
    for segment in path.windows(2) {
        let (a, b) = (segment[0], segment[1]);
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let mut walked = 0.0;
        while length - walked >= left {
            walked += left;
            let t = walked / length;
            let at = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            if index % 2 == 0 {
                line.push(at);
                lines.push(std::mem::take(&mut line));
            } else {
                line = vec![at];
            }
            index = (index + 1) % pattern.len();
            left = pattern[index] * width;
        }
        left -= length - walked;
        if index % 2 == 0 {
            line.push(b);
        }
    }
    if line.len() > 1 {
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Rect = Rect { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    fn length(path: &[Point]) -> f64 {
        let segments = path.windows(2);
        segments.map(|s| (s[1].0 - s[0].0).hypot(s[1].1 - s[0].1)).sum()
    }

    #[test]
    fn clipping_keeps_what_is_inside() {
        // In, out through the right side, back in through it, and a segment that never enters.
        let path = [(5.0, 5.0), (15.0, 5.0), (15.0, 7.0), (5.0, 7.0), (5.0, 20.0), (9.0, 20.0)];
        assert_eq!(clipped(&path, WINDOW), [vec![(5.0, 5.0), (10.0, 5.0)], vec![(10.0, 7.0), (5.0, 7.0), (5.0, 10.0)]]);
        // Across the corner.
        assert_eq!(clipped(&[(-1.0, 3.0), (3.0, -1.0)], WINDOW), [[(0.0, 2.0), (2.0, 0.0)]]);
    }

    #[test]
    fn dashes_do_not_depend_on_the_spacing_of_points() {
        // The same line of length 10 with 2 and with 1001 points; pattern 2 on, 1 off at width 1.
        let coarse = [(0.0, 0.0), (6.0, 8.0)];
        let fine: Vec<Point> = (0..=1000).map(|i| (0.006 * f64::from(i), 0.008 * f64::from(i))).collect();
        for path in [&coarse[..], &fine] {
            let lines = dashed(path, &[2.0, 1.0], 1.0);
            let lengths: Vec<f64> = lines.iter().map(|l| length(l)).collect();
            assert_eq!(lengths.len(), 4, "{lengths:?}");
            for (found, expected) in lengths.iter().zip([2.0, 2.0, 2.0, 1.0]) {
                assert!((found - expected).abs() < 1e-9, "{lengths:?}");
            }
        }
    }

    #[test]
    fn scripts_are_split_off() {
        let parts = |text| -> Vec<(String, bool)> {
            let runs = runs(text);
            runs.iter().map(|r| (r.text.to_owned(), r.rise == 0.0)).collect()
        };
        let own = |s: &str, plain| (s.to_owned(), plain);
        assert_eq!(parts("ω_{opt} = x^{2}"), [own("ω", true), own("opt", false), own(" = x", true), own("2", false)]);
        assert_eq!(parts("pcg_jacobi _{"), [own("pcg_jacobi _{", true)]);
        assert_eq!(parts(""), []);
    }

    #[test]
    fn a_line_is_as_wide_as_asked() {
        let window = Rect { left: 0.0, top: 0.0, right: 40.0, bottom: 20.0 };
        let line = [(5.0, 10.0), (35.0, 10.0)];
        let black = Colour(0, 0, 0);
        let draw = |canvas: &Canvas<'_>| canvas.stroke(&line, window, 1.5, Dash::Solid, black);
        let image = paint(40, 20, draw).unwrap();
        let final_px = |points: u32| points * PIXELS_PER_POINT;
        let ink: f64 = (0..image.height).map(|y| 1.0 - f64::from(image.pixel(final_px(20), y)[0]) / 255.0).sum();
        let expected = 1.5 * f64::from(PIXELS_PER_POINT);
        assert!((ink - expected).abs() < 0.4, "{ink}");
        assert_eq!(image.pixel(final_px(5) - 2, final_px(10)), [255; 3]);
        assert_eq!(image.pixel(final_px(5) + 2, final_px(10)), [0; 3]);
    }
}
