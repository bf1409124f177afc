//! Letters of the embedded font, DejaVu Sans: advances and outlines.

use std::sync::LazyLock;

use super::canvas::Point;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// The font itself, whose em is [`units`] long.
static FACE: LazyLock<Face<'static>> = LazyLock::new(|| match Face::parse(dejavu::sans::regular(), 0) {
    Ok(face) => face,
    Err(e) => panic!("the embedded font is a font: {e}"),
});

/// The length of the em in the units of outlines and advances.
pub(super) fn units() -> f64 {
    f64::from(FACE.units_per_em())
}

/// A piece of an outline, in units of the font, y upward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Move(Point),
    Line(Point),
    /// A parabola: its control point, its end.
    Curve(Point, Point),
    Close,
}

/// The letters of `text` with the places where they begin, in units of the font, and the place of its end. A character that
/// the font lacks is its box for what is missing.
pub(super) fn letters(text: &str) -> (Vec<(GlyphId, f64)>, f64) {
    let mut at = 0.0;
    let place = |c: char| {
        let glyph = FACE.glyph_index(c).unwrap_or(GlyphId(0));
        let begin = at;
        at += f64::from(FACE.glyph_hor_advance(glyph).unwrap_or(0));
        (glyph, begin)
    };
    (text.chars().map(place).collect(), at)
}

/// The advance of `text` whose em is `size` points, in points.
pub(super) fn width(text: &str, size: f64) -> f64 {
    letters(text).1 * size / units()
}

/// The outline of a letter; nothing for a space.
pub(super) fn outline(glyph: GlyphId) -> Vec<Piece> {
    struct Pieces(Vec<Piece>);
    impl OutlineBuilder for Pieces {
        fn move_to(&mut self, x: f32, y: f32) {
            self.0.push(Piece::Move((x.into(), y.into())));
        }
        fn line_to(&mut self, x: f32, y: f32) {
            self.0.push(Piece::Line((x.into(), y.into())));
        }
        fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
            self.0.push(Piece::Curve((x1.into(), y1.into()), (x.into(), y.into())));
        }
        fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, _: f32, _: f32) {
            unreachable!("a TrueType font has parabolas only");
        }
        fn close(&mut self) {
            self.0.push(Piece::Close);
        }
    }
    let mut pieces = Pieces(Vec::new());
    FACE.outline_glyph(glyph, &mut pieces);
    pieces.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_the_advances_of_the_font() {
        // DejaVu Sans: every digit 1303 of 2048, a space 651.
        assert_eq!(units(), 2048.0);
        assert_eq!(width("07", 2048.0), 2606.0);
        let (letters, end) = letters("1 1");
        assert_eq!((letters[0].1, letters[1].1, letters[2].1, end), (0.0, 1303.0, 1954.0, 3257.0));
        assert_eq!(letters[0].0, letters[2].0);
    }

    #[test]
    fn outlines_stand_on_the_baseline() {
        let (letters, _) = letters("I ");
        let pieces = outline(letters[0].0);
        // A bar from the baseline to the height of capitals, 1493.
        let heights: Vec<f64> = pieces
            .iter()
            .filter_map(|p| if let Piece::Move(p) | Piece::Line(p) = p { Some(p.1) } else { None })
            .collect();
        assert_eq!(heights.iter().copied().fold(f64::INFINITY, f64::min), 0.0);
        assert_eq!(heights.iter().copied().fold(0.0, f64::max), 1493.0);
        assert_eq!(pieces.last(), Some(&Piece::Close));
        assert!(outline(letters[1].0).is_empty());
    }
}
