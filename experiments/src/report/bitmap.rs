//! Rasterization of a drawing by plotters, smoothed.
//!
//! The bitmap is drawn at [`SUPERSAMPLING`] times the final resolution and then averaged, because the backend fills without
//! smoothing and places everything at whole pixels.

use super::canvas::{Canvas, Colour, PIXELS_PER_POINT, Point, Rect, SCALE, SUPERSAMPLING, Shape};
use super::png::Image;
use limitlab::{Error, Result};
use plotters::backend::BitMapBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{BitMapElement, Circle, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, IntoFont, register_font};
use std::fmt::Display;
use std::sync::Once;

const FONT: &str = "limitlab-sans";

/// The backend takes the distance from ascent to descent as the size of a font; DejaVu Sans has
/// (1901 + 483) / 2048 of an em there.
const HEIGHT_PER_EM: f64 = 2384.0 / 2048.0;

struct Bitmap<'b> {
    area: DrawingArea<BitMapBackend<'b>, Shift>,
}

impl Canvas {
    /// The drawing as an image of [`PIXELS_PER_POINT`] pixels a point.
    ///
    /// # Errors
    /// Those of the backend; none are known.
    pub fn to_image(&self) -> Result<Image> {
        let scale = PIXELS_PER_POINT * SUPERSAMPLING;
        let (width, height) = (self.width * scale, self.height * scale);
        let mut rgb = vec![u8::MAX; 3 * width as usize * height as usize];
        {
            let bitmap = Bitmap { area: BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area() };
            self.shapes.iter().try_for_each(|shape| bitmap.draw(shape))?;
            drawn(bitmap.area.present())?;
        }
        Ok(Image { width, height, rgb }.reduced(SUPERSAMPLING))
    }
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

fn pixel((x, y): Point) -> (i32, i32) {
    ((x * SCALE).round() as i32, (y * SCALE).round() as i32)
}

impl Bitmap<'_> {
    fn draw(&self, shape: &Shape) -> Result<()> {
        match shape {
            Shape::Rectangle { area, colour } => self.fill(*area, *colour),
            Shape::Lines { paths, width, colour } => paths.iter().try_for_each(|path| self.line(path, *width, *colour)),
            Shape::Polygon { corners, colour } => self.polygon(corners, *colour),
            Shape::Disc { centre, radius, colour } => self.disc(*centre, radius * SCALE, *colour),
            Shape::Text { text, at, size, upright, colour } => {
                // The backend puts the baseline half the font's height below the anchor's top.
                let above = size * HEIGHT_PER_EM / 2.0;
                let (place, turn) = if *upright {
                    ((at.0 - above, at.1), FontTransform::Rotate270)
                } else {
                    ((at.0, at.1 - above), FontTransform::None)
                };
                let style = font(*size).transform(turn).color(colour).pos(Pos::new(HPos::Left, VPos::Top));
                drawn(self.area.draw_text(text, &style, pixel(place)))
            }
            Shape::Image { corner, image } => {
                let size = (image.width, image.height);
                match BitMapElement::with_ref(pixel(*corner), size, &image.rgb) {
                    Some(bitmap) => drawn(self.area.draw(&bitmap)),
                    None => drawn(Err("an image of another size")),
                }
            }
        }
    }

    fn fill(&self, area: Rect, colour: Colour) -> Result<()> {
        let (x0, y0) = pixel((area.left, area.top));
        let (x1, y1) = pixel((area.right, area.bottom));
        // The backend includes the last row and column.
        let corners = [(x0, y0), ((x1 - 1).max(x0), (y1 - 1).max(y0))];
        drawn(self.area.draw(&Rectangle::new(corners, colour.filled())))
    }

    /// One quadrilateral a segment, one disc a joint.
    fn line(&self, path: &[Point], width: f64, colour: Colour) -> Result<()> {
        // The backend's shapes include their border pixels.
        let half = ((width * SCALE - 1.0) / 2.0).max(0.0);
        for segment in path.windows(2) {
            let ((ax, ay), (bx, by)) = (segment[0], segment[1]);
            let (dx, dy) = (bx - ax, by - ay);
            let length = dx.hypot(dy);
            if length == 0.0 {
                continue;
            }
            let (nx, ny) = (-dy / length * half / SCALE, dx / length * half / SCALE);
            let corners = [(ax + nx, ay + ny), (bx + nx, by + ny), (bx - nx, by - ny), (ax - nx, ay - ny)];
            self.polygon(&corners, colour)?;
        }
        path.iter().skip(1).take(path.len().saturating_sub(2)).try_for_each(|&joint| self.disc(joint, half, colour))
    }

    fn polygon(&self, corners: &[Point], colour: Colour) -> Result<()> {
        let corners: Vec<_> = corners.iter().map(|&corner| pixel(corner)).collect();
        drawn(self.area.draw(&Polygon::new(corners, colour.filled())))
    }

    /// A disc of this radius in drawn pixels.
    fn disc(&self, centre: Point, radius: f64, colour: Colour) -> Result<()> {
        let disc = Circle::new(pixel(centre), radius.round() as i32, colour.filled());
        drawn(self.area.draw(&disc))
    }
}
