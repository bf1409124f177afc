//! Portable document format of a drawing: one page of its size, text as outlines, images as they are.

use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect as Box, Ref, TextStr};

use super::canvas::{Canvas, Colour, Point, SUPERSAMPLING, Shape};
use super::glyphs::{self, Piece};
use super::provenance::Provenance;

/// Of zlib, from 0 to 10.
const COMPRESSION: u8 = 8;

const CATALOG: Ref = Ref::new(1);
const PAGES: Ref = Ref::new(2);
const PAGE: Ref = Ref::new(3);
const CONTENT: Ref = Ref::new(4);
const ABOUT: Ref = Ref::new(5);
const FIRST_IMAGE: i32 = 6;

impl Canvas {
    /// The drawing as PDF 1.7, whose subject is what made it. No other date, so that the same drawing gives the same bytes.
    pub fn to_pdf(&self, provenance: &Provenance) -> Vec<u8> {
        let (width, height) = (self.width as f32, self.height as f32);
        let mut pdf = Pdf::new();
        pdf.catalog(CATALOG).pages(PAGES);
        pdf.pages(PAGES).kids([PAGE]).count(1);
        pdf.document_info(ABOUT).subject(TextStr(&provenance.lines().join("; ")));
        let mut content = Content::new();
        // From here on points from the top left.
        content.transform([1.0, 0.0, 0.0, -1.0, 0.0, height]);
        content.set_line_join(LineJoinStyle::RoundJoin);
        let mut images: Vec<(String, Ref)> = Vec::new();
        for shape in &self.shapes {
            match shape {
                Shape::Rectangle { area, colour } => {
                    fill(&mut content, *colour);
                    let [x, y, width, height] = [area.left, area.top, area.width(), area.height()].map(|v| v as f32);
                    content.rect(x, y, width, height).fill_nonzero();
                }
                Shape::Lines { paths, width, colour } => {
                    let [r, g, b] = parts(*colour);
                    content.set_stroke_rgb(r, g, b).set_line_width(*width as f32);
                    paths.iter().for_each(|path| polyline(&mut content, path));
                    content.stroke();
                }
                Shape::Polygon { corners, colour } => {
                    fill(&mut content, *colour);
                    polyline(&mut content, corners);
                    content.fill_nonzero();
                }
                Shape::Disc { centre, radius, colour } => {
                    fill(&mut content, *colour);
                    disc(&mut content, *centre, *radius);
                    content.fill_nonzero();
                }
                Shape::Text { text, at, size, upright, colour } => {
                    fill(&mut content, *colour);
                    let scale = (size / glyphs::units()) as f32;
                    let turn = if *upright { [0.0, -scale, -scale, 0.0] } else { [scale, 0.0, 0.0, -scale] };
                    content.save_state();
                    content.transform([turn[0], turn[1], turn[2], turn[3], at.0 as f32, at.1 as f32]);
                    let mut along = 0.0;
                    for (glyph, begin) in glyphs::letters(text).0 {
                        // In steps, so that a letter has the same bytes wherever it stands, and is packed once.
                        content.transform([1.0, 0.0, 0.0, 1.0, (begin - along) as f32, 0.0]);
                        along = begin;
                        outline(&mut content, &glyphs::outline(glyph));
                    }
                    content.restore_state();
                }
                Shape::Image { corner, image } => {
                    let name = format!("I{}", images.len());
                    let id = Ref::new(FIRST_IMAGE + images.len() as i32);
                    let image = image.reduced(SUPERSAMPLING);
                    let packed = miniz_oxide::deflate::compress_to_vec_zlib(&image.rgb, COMPRESSION);
                    let mut object = pdf.image_xobject(id, &packed);
                    object.filter(Filter::FlateDecode);
                    object.width(image.width as i32).height(image.height as i32);
                    object.color_space().device_rgb();
                    object.bits_per_component(8);
                    object.finish();
                    let points = |pixels: u32| pixels as f32 / super::canvas::PIXELS_PER_POINT as f32;
                    let (width, height) = (points(image.width), points(image.height));
                    content.save_state();
                    content.transform([width, 0.0, 0.0, -height, corner.0 as f32, corner.1 as f32 + height]);
                    content.x_object(Name(name.as_bytes()));
                    content.restore_state();
                    images.push((name, id));
                }
            }
        }
        let packed = miniz_oxide::deflate::compress_to_vec_zlib(&content.finish(), COMPRESSION);
        pdf.stream(CONTENT, &packed).filter(Filter::FlateDecode);
        let mut page = pdf.page(PAGE);
        page.media_box(Box::new(0.0, 0.0, width, height)).parent(PAGES).contents(CONTENT);
        let mut resources = page.resources();
        let mut named = resources.x_objects();
        for (name, id) in &images {
            named.pair(Name(name.as_bytes()), *id);
        }
        named.finish();
        resources.finish();
        page.finish();
        pdf.finish()
    }
}

fn parts(Colour(r, g, b): Colour) -> [f32; 3] {
    [r, g, b].map(|part| f32::from(part) / 255.0)
}

fn fill(content: &mut Content, colour: Colour) {
    let [r, g, b] = parts(colour);
    content.set_fill_rgb(r, g, b);
}

fn polyline(content: &mut Content, path: &[Point]) {
    for (k, &(x, y)) in path.iter().enumerate() {
        if k == 0 {
            content.move_to(x as f32, y as f32);
        } else {
            content.line_to(x as f32, y as f32);
        }
    }
}

/// Four cubic curves that differ from the circle by 0.03 % of its radius.
fn disc(content: &mut Content, (x, y): Point, radius: f64) {
    const HANDLE: f64 = 0.552_284_75;
    let point = |a: f64, b: f64| ((x + radius * a) as f32, (y + radius * b) as f32);
    let (x0, y0) = point(1.0, 0.0);
    content.move_to(x0, y0);
    for (cos, sin) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
        let (x1, y1) = point(cos - HANDLE * sin, sin + HANDLE * cos);
        let (x2, y2) = point(HANDLE * cos - sin, HANDLE * sin + cos);
        let (x3, y3) = point(-sin, cos);
        content.cubic_to(x1, y1, x2, y2, x3, y3);
    }
    content.close_path();
}

/// The letter filled; PDF has cubic curves only.
fn outline(content: &mut Content, pieces: &[Piece]) {
    let mut from = (0.0, 0.0);
    for piece in pieces {
        match *piece {
            Piece::Move(to) => {
                content.move_to(to.0 as f32, to.1 as f32);
                from = to;
            }
            Piece::Line(to) => {
                content.line_to(to.0 as f32, to.1 as f32);
                from = to;
            }
            Piece::Curve(control, to) => {
                let third = |end: Point| {
                    let part = |e: f64, c: f64| ((e + 2.0 * c) / 3.0) as f32;
                    (part(end.0, control.0), part(end.1, control.1))
                };
                let ((x1, y1), (x2, y2)) = (third(from), third(to));
                content.cubic_to(x1, y1, x2, y2, to.0 as f32, to.1 as f32);
                from = to;
            }
            Piece::Close => {
                content.close_path();
            }
        }
    }
    if !pieces.is_empty() {
        content.fill_nonzero();
    }
}
