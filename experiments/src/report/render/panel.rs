//! Panel of a rendered picture: caption, image, colour bar.

use super::super::canvas::{Anchor, CAP_HEIGHT, Canvas, Colour, Rect, text_width};
use super::super::frame::{self, FRAME_COLOUR, FRAME_WIDTH, LABEL_SIZE, Slot, TEXT_COLOUR, TICK_SIZE};
use super::super::png::Image;
use super::scene::Scene;
use super::{ColourScale, Picture, raster};
use limitlab::Result;

// Lengths in points.
/// Left and right of a picture, and below it.
const GAP: f64 = 5.0;
const BAR_GAP: f64 = 8.0;
const BAR_WIDTH: f64 = 10.0;
const TICK_LENGTH: f64 = 3.0;
const TICK_GAP: f64 = 3.0;
/// Least distance from tick label to tick label.
const TICK_PITCH: f64 = 15.0;
/// A bar longer than this tells no more.
const LONGEST_BAR: f64 = 220.0;

impl Picture {
    pub(in super::super) fn top(&self) -> f64 {
        frame::title_room(&self.caption)
    }

    pub(in super::super) fn bottom(&self) -> f64 {
        GAP
    }

    pub(in super::super) fn left(&self) -> f64 {
        GAP
    }

    pub(in super::super) fn right(&self) -> Result<f64> {
        let Some(scale) = &self.colour_bar else {
            return Ok(GAP);
        };
        let mut widest = 0.0_f64;
        for tick in scale.axis()?.ticks((LONGEST_BAR / TICK_PITCH) as usize) {
            let label = tick.label.unwrap_or_default();
            widest = widest.max(text_width(&label, TICK_SIZE));
        }
        Ok(BAR_GAP + BAR_WIDTH + TICK_LENGTH + TICK_GAP + widest + 6.0 + LABEL_SIZE + GAP)
    }

    pub(in super::super) fn draw(&self, canvas: &mut Canvas, slot: &Slot) -> Result<()> {
        let frame = slot.frame;
        canvas.image(frame, |width, height, pixels_per_point| {
            let scene = Scene::new(self, (width, height), pixels_per_point)?;
            Ok(raster::draw(&scene, width, height))
        })?;
        if let Some(scale) = &self.colour_bar {
            draw_bar(canvas, frame, scale)?;
        }
        frame::draw_title(canvas, frame, &self.caption, frame::title_room(&self.caption));
        Ok(())
    }
}

/// The bar to the right of `frame`: the colours from the least number, at the bottom, to the greatest.
fn draw_bar(canvas: &mut Canvas, frame: Rect, scale: &ColourScale) -> Result<()> {
    let axis = scale.axis()?;
    let length = (0.8 * frame.height()).min(LONGEST_BAR);
    let left = frame.right + BAR_GAP;
    let bar = Rect {
        left,
        right: left + BAR_WIDTH,
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
