//! Bar of the colours that the pictures of a figure share.

use super::super::canvas::{Anchor, CAP_HEIGHT, Canvas, Colour, Rect, text_width};
use super::super::frame::{FRAME_COLOUR, FRAME_WIDTH, LABEL_SIZE, TEXT_COLOUR, TICK_SIZE};
use super::super::png::Image;
use super::ColourScale;
use limitlab::Result;

// Lengths in points.
const GAP: f64 = 8.0;
const WIDTH: f64 = 10.0;
const TICK_LENGTH: f64 = 3.0;
const TICK_GAP: f64 = 3.0;
/// Least distance from tick label to tick label.
const TICK_PITCH: f64 = 15.0;
/// A bar longer than this tells no more.
const LONGEST: f64 = 220.0;

/// The room that the bar takes to the right of the panels, in points.
///
/// # Errors
/// A scale whose range is none.
pub(in super::super) fn room(scale: &ColourScale) -> Result<f64> {
    let mut widest = 0.0_f64;
    for tick in scale.axis()?.ticks((LONGEST / TICK_PITCH) as usize) {
        let label = tick.label.unwrap_or_default();
        widest = widest.max(text_width(&label, TICK_SIZE));
    }
    Ok(GAP + WIDTH + TICK_LENGTH + TICK_GAP + widest + 6.0 + LABEL_SIZE + 5.0)
}

/// The bar to the right of `frame`: the colours from the least number, at the bottom, to the greatest.
///
/// # Errors
/// As [`room`].
pub(in super::super) fn draw(canvas: &mut Canvas, frame: Rect, scale: &ColourScale) -> Result<()> {
    let axis = scale.axis()?;
    let length = (0.8 * frame.height()).min(LONGEST);
    let left = frame.right + GAP;
    let bar = Rect {
        left,
        right: left + WIDTH,
        top: frame.centre().1 - length / 2.0,
        bottom: frame.centre().1 + length / 2.0,
    };
    canvas.image(bar, |width, height, _| {
        let row = |y: u32| {
            let t = 1.0 - (f64::from(y) + 0.5) / f64::from(height);
            let Colour(r, g, b) = scale.map.colour(t);
            [r, g, b].repeat(width as usize)
        };
        Ok(Image { width, height, rgb: (0..height).flat_map(row).collect() })
    })?;
    canvas.outline(bar, FRAME_WIDTH, FRAME_COLOUR);
    let mut right = bar.right + TICK_LENGTH;
    for tick in axis.ticks((length / TICK_PITCH) as usize) {
        let Some(label) = &tick.label else { continue };
        let y = bar.bottom - tick.at * bar.height();
        let reach = (bar.right, bar.right + TICK_LENGTH);
        canvas.level(y, reach, FRAME_WIDTH, FRAME_COLOUR);
        let place = (bar.right + TICK_LENGTH + TICK_GAP, y + CAP_HEIGHT / 2.0 * TICK_SIZE);
        canvas.text(label, place, TICK_SIZE, Anchor::Start, false, TEXT_COLOUR);
        right = right.max(place.0 + text_width(label, TICK_SIZE));
    }
    let size = LABEL_SIZE * (frame.height() / text_width(&scale.label, LABEL_SIZE).max(1.0)).min(1.0);
    let place = (right + 6.0 + CAP_HEIGHT * LABEL_SIZE, bar.centre().1);
    canvas.text(&scale.label, place, size, Anchor::Middle, true, TEXT_COLOUR);
    Ok(())
}
