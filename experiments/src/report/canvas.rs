//! Strokes, markers and text on a canvas, in points (1/72 inch) from the top left, as a list of shapes.
//!
//! What is drawn is kept, so that one drawing can be written in several formats: see [`super::bitmap`], [`super::svg`] and
//! [`super::pdf`].

use super::glyphs;
use super::png::Image;
use limitlab::Result;
use serde::Serialize;

/// A colour of red, green and blue, each from 0 to 255.
pub use plotters::style::RGBColor as Colour;

const WHITE: Colour = Colour(255, 255, 255);

/// Pixels of an image a point: 216 dots an inch.
pub(super) const PIXELS_PER_POINT: u32 = 3;

/// Pixels drawn for each pixel of an image, in both directions.
pub(super) const SUPERSAMPLING: u32 = 3;

/// Drawn pixels a point.
pub(super) const SCALE: f64 = (PIXELS_PER_POINT * SUPERSAMPLING) as f64;

/// The height of digits and capitals in ems.
pub(super) const CAP_HEIGHT: f64 = 0.73;

/// The length of an arrowhead in points.
pub(super) const ARROW_LENGTH: f64 = 6.5;

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

    /// The smallest one that covers both.
    pub fn around(self, other: Rect) -> Rect {
        Rect {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    /// Whether they share more than their edges, but for rounding.
    fn overlaps(&self, other: &Rect) -> bool {
        const ROUNDING: f64 = 1e-6;
        self.left.max(other.left) + ROUNDING < self.right.min(other.right)
            && self.top.max(other.top) + ROUNDING < self.bottom.min(other.bottom)
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
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
    /// Smaller, and without the rim that parts others from their neighbours.
    Dot,
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

/// What is drawn, one over the other.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    Rectangle {
        area: Rect,
        colour: Colour,
    },
    /// Polylines whose ends are cut square and whose joints are round.
    Lines {
        paths: Vec<Vec<Point>>,
        width: f64,
        colour: Colour,
    },
    Polygon {
        corners: Vec<Point>,
        colour: Colour,
    },
    Disc {
        centre: Point,
        radius: f64,
        colour: Colour,
    },
    /// Text of one size from `at` on, a point of its baseline, to the right or upward.
    Text {
        text: String,
        at: Point,
        size: f64,
        upright: bool,
        colour: Colour,
    },
    /// An image of [`SCALE`] pixels a point with this corner at the top left.
    Image {
        corner: Point,
        image: Image,
    },
}

/// A page of shapes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Canvas {
    /// In points.
    pub width: u32,
    pub height: u32,
    pub shapes: Vec<Shape>,
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
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    runs(text).iter().map(|run| glyphs::width(run.text, size * run.size)).sum()
}

impl Canvas {
    /// An empty page of this size.
    pub fn new(width: u32, height: u32) -> Self {
        Canvas { width, height, shapes: Vec::new() }
    }

    /// Writes `text` with its baseline through `at`, to the right, or upward if `upright`.
    pub fn text(&mut self, text: &str, at: Point, size: f64, anchor: Anchor, upright: bool, colour: Colour) {
        let width = text_width(text, size);
        let mut along = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -width / 2.0,
            Anchor::End => -width,
        };
        for run in runs(text) {
            let (em, rise) = (size * run.size, size * run.rise);
            let at = if upright { (at.0 - rise, at.1 - along) } else { (at.0 + along, at.1 - rise) };
            self.shapes.push(Shape::Text { text: run.text.to_owned(), at, size: em, upright, colour });
            along += glyphs::width(run.text, em);
        }
    }

    /// What cannot be read: texts that were cut or reach over the edge of the page, and pairs that cover each other.
    pub fn illegible(&self) -> Vec<String> {
        let page = Rect { left: 0.0, top: 0.0, right: self.width.into(), bottom: self.height.into() };
        let texts: Vec<(&str, Rect)> = self.shapes.iter().filter_map(text_box).collect();
        let outside = texts.iter().filter(|(_, area)| page.around(*area) != page);
        let mut found: Vec<String> = outside.map(|(text, _)| format!("\"{text}\" reaches over the edge")).collect();
        let cut = texts.iter().filter(|(text, _)| text.contains('…'));
        found.extend(cut.map(|(text, _)| format!("\"{text}\" is cut")));
        for (i, (text, area)) in texts.iter().enumerate() {
            let over = texts[..i].iter().filter(|(_, other)| area.overlaps(other));
            found.extend(over.map(|(other, _)| format!("\"{text}\" covers \"{other}\"")));
        }
        found
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, area: Rect, colour: Colour) {
        self.shapes.push(Shape::Rectangle { area, colour });
    }

    /// A straight upright line, its middle at `x`, that ends square at `from` and `to`.
    pub fn upright(&mut self, x: f64, (from, to): (f64, f64), width: f64, colour: Colour) {
        self.fill(Rect { left: x - width / 2.0, right: x + width / 2.0, top: from, bottom: to }, colour);
    }

    /// A straight level line, its middle at `y`, that ends square at `from` and `to`.
    pub fn level(&mut self, y: f64, (from, to): (f64, f64), width: f64, colour: Colour) {
        self.fill(Rect { left: from, right: to, top: y - width / 2.0, bottom: y + width / 2.0 }, colour);
    }

    /// Fills a rectangle with an image, made for its width and height in drawn pixels and the drawn pixels a point.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn image(&mut self, area: Rect, make: impl FnOnce(u32, u32, f64) -> Result<Image>) -> Result<()> {
        let pixel = |length: f64| (length * SCALE).round();
        let (left, top) = (pixel(area.left), pixel(area.top));
        let size = |from: f64, to: f64| (pixel(to) - from).max(1.0) as u32;
        let image = make(size(left, area.right), size(top, area.bottom), SCALE)?;
        self.shapes.push(Shape::Image { corner: (left / SCALE, top / SCALE), image });
        Ok(())
    }

    /// Draws the outline of a rectangle, its middle on the rectangle's edge.
    pub fn outline(&mut self, rect: Rect, width: f64, colour: Colour) {
        let h = width / 2.0;
        for y in [rect.top, rect.bottom] {
            self.level(y, (rect.left - h, rect.right + h), width, colour);
        }
        for x in [rect.left, rect.right] {
            self.upright(x, (rect.top - h, rect.bottom + h), width, colour);
        }
    }

    /// Draws the polyline through `path` as far as it lies in `window`. Dashes have their lengths along the line
    /// on paper, whatever the spacing of its points.
    pub fn stroke(&mut self, path: &[Point], window: Rect, width: f64, dash: Dash, colour: Colour) {
        let visible = clipped(path, window);
        let paths: Vec<_> = visible.iter().flat_map(|piece| dashed(piece, dash.pattern(), width)).collect();
        if !paths.is_empty() {
            self.shapes.push(Shape::Lines { paths, width, colour });
        }
    }

    /// Draws an arrowhead with its tip at `to`, in the direction from `from`.
    pub fn arrowhead(&mut self, (from, to): (Point, Point), colour: Colour) {
        const HALF_WIDTH: f64 = 2.7;
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        if length > 0.0 {
            let (ux, uy) = (dx / length, dy / length);
            let corner = |side: f64| (to.0 - ARROW_LENGTH * ux - side * uy, to.1 - ARROW_LENGTH * uy + side * ux);
            self.shapes.push(Shape::Polygon { corners: vec![to, corner(HALF_WIDTH), corner(-HALF_WIDTH)], colour });
        }
    }

    /// Draws a marker of about `radius` points with a thin white rim that parts it from its neighbours.
    pub fn marker(&mut self, at: Point, marker: Marker, radius: f64, colour: Colour) {
        const RIM: f64 = 0.5;
        match marker {
            Marker::Cross | Marker::Plus => {
                let r = radius * if marker == Marker::Cross { 1.0 } else { 1.35 };
                let arms = if marker == Marker::Cross { [(r, r), (r, -r)] } else { [(r, 0.0), (0.0, r)] };
                let arm = |(dx, dy)| vec![(at.0 - dx, at.1 - dy), (at.0 + dx, at.1 + dy)];
                self.shapes.push(Shape::Lines { paths: arms.map(arm).to_vec(), width: 0.5 * radius, colour });
            }
            // Rims would cover what lies close by.
            Marker::Dot => self.shape(at, marker, 0.6 * radius, colour),
            _ => {
                self.shape(at, marker, radius + RIM, WHITE);
                self.shape(at, marker, radius, colour);
            }
        }
    }

    /// Fills a closed marker. The sizes give all shapes about the same area.
    fn shape(&mut self, at: Point, marker: Marker, radius: f64, colour: Colour) {
        let corners: &[Point] = match marker {
            Marker::Square => &[(-0.87, -0.87), (0.87, -0.87), (0.87, 0.87), (-0.87, 0.87)],
            Marker::Diamond => &[(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0)],
            Marker::Triangle => &[(0.0, -1.25), (1.15, 0.75), (-1.15, 0.75)],
            Marker::InvertedTriangle => &[(0.0, 1.25), (1.15, -0.75), (-1.15, -0.75)],
            Marker::Circle | Marker::Dot | Marker::Cross | Marker::Plus => {
                return self.shapes.push(Shape::Disc { centre: at, radius, colour });
            }
        };
        let corners = corners.iter().map(|c| (at.0 + radius * c.0, at.1 + radius * c.1)).collect();
        self.shapes.push(Shape::Polygon { corners, colour });
    }
}

/// A text with the rectangle that its capitals fill.
fn text_box(shape: &Shape) -> Option<(&str, Rect)> {
    let Shape::Text { text, at: (x, y), size, upright, .. } = shape else { return None };
    let (along, across) = (glyphs::width(text, *size), CAP_HEIGHT * size);
    let area = if *upright {
        Rect { left: x - across, right: *x, top: y - along, bottom: *y }
    } else {
        Rect { left: *x, right: x + along, top: y - across, bottom: *y }
    };
    Some((text, area))
}

/// Where a polyline leaves `window` for good: the last segment inside, cut at the edge; `None` if it ends inside or never
/// was there.
pub(super) fn way_out(path: &[Point], window: Rect) -> Option<(Point, Point)> {
    let pieces = clipped(path, window);
    let piece = pieces.last()?;
    let &[.., from, to] = piece.as_slice() else { return None };
    (path.last() != Some(&to)).then_some((from, to))
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
    fn texts_outside_or_on_each_other_cannot_be_read() {
        let page = |texts: &[(&str, Point, bool)]| {
            let mut canvas = Canvas::new(100, 50);
            for &(text, at, upright) in texts {
                canvas.text(text, at, 10.0, Anchor::Start, upright, Colour(0, 0, 0));
            }
            canvas.illegible()
        };
        // Seven points high, subscripts beside; an upright one ends where the level one begins.
        let high = 10.0 * CAP_HEIGHT;
        assert_eq!(page(&[("λ_{1} x^{2}", (20.0, 20.0), false), ("07", (20.0, 22.0 + high), false)]), [""; 0]);
        assert_eq!(page(&[("07", (20.0, 40.0), true), ("07", (20.0, 40.0), false)]), [""; 0]);
        assert_eq!(page(&[("a", (20.0, 20.0), false), ("b", (22.0, 24.0), false)]), ["\"b\" covers \"a\""]);
        assert_eq!(page(&[("w…e", (20.0, 20.0), false)]), ["\"w…e\" is cut"]);
        assert_eq!(page(&[("wide", (90.0, 20.0), false)]), ["\"wide\" reaches over the edge"]);
        assert_eq!(page(&[("wide", (20.0, high - 1.0), false)]), ["\"wide\" reaches over the edge"]);
        assert_eq!(page(&[("wide", (20.0, 10.0), true)]), ["\"wide\" reaches over the edge"]);
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
    fn a_line_that_leaves_for_good_does_so_somewhere() {
        // Through the right side, after an excursion through the top.
        let path = [(5.0, 5.0), (5.0, -5.0), (6.0, 5.0), (12.0, 5.0), (12.0, 7.0)];
        assert_eq!(way_out(&path, WINDOW), Some(((6.0, 5.0), (10.0, 5.0))));
        assert_eq!(way_out(&path[..3], WINDOW), None);
        assert_eq!(way_out(&[(11.0, 0.0), (12.0, 0.0)], WINDOW), None);
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
        let mut canvas = Canvas::new(40, 20);
        canvas.stroke(&line, window, 1.5, Dash::Solid, black);
        let image = canvas.to_image().unwrap();
        let final_px = |points: u32| points * PIXELS_PER_POINT;
        let ink: f64 = (0..image.height).map(|y| 1.0 - f64::from(image.pixel(final_px(20), y)[0]) / 255.0).sum();
        let expected = 1.5 * f64::from(PIXELS_PER_POINT);
        assert!((ink - expected).abs() < 0.4, "{ink}");
        assert_eq!(image.pixel(final_px(5) - 2, final_px(10)), [255; 3]);
        assert_eq!(image.pixel(final_px(5) + 2, final_px(10)), [0; 3]);
    }
}
