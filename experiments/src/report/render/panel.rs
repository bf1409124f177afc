//! Panel of a rendered picture: caption, image.

use super::super::canvas::{Canvas, Colour};
use super::super::frame::{self, Slot};
use super::super::png::Image;
use super::scene::Scene;
use super::{Picture, raster};
use limitlab::Result;

// Lengths in points.
/// Left and right of a picture, and below it.
const GAP: f64 = 5.0;
/// Around a picture that shows a part of what is there.
const WINDOW_WIDTH: f64 = 0.6;
const WINDOW_COLOUR: Colour = Colour(130, 130, 130);

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

    pub(in super::super) fn right(&self) -> f64 {
        GAP
    }

    /// What reaches beyond the picture is cut at its outline.
    pub(in super::super) fn draw(&self, canvas: &mut Canvas, slot: &Slot) -> Result<()> {
        let frame = slot.frame;
        let mut is_cut = false;
        canvas.image(frame, |width, height, pixels_per_point| {
            let scene = Scene::new(self, (width, height), pixels_per_point)?;
            let image = raster::draw(&scene, width, height);
            is_cut = reaches_its_edge(&image);
            Ok(image)
        })?;
        if is_cut {
            canvas.outline(frame, WINDOW_WIDTH, WINDOW_COLOUR);
        }
        frame::draw_title(canvas, frame, &self.caption, frame::title_room(&self.caption), slot.title_size);
        Ok(())
    }
}

/// Whether anything is seen in the outermost rows and columns.
fn reaches_its_edge(image: &Image) -> bool {
    let is_seen = |x: u32, y: u32| image.pixel(x, y) != [raster::BACKGROUND; 3];
    let (right, bottom) = (image.width - 1, image.height - 1);
    (0..image.width).any(|x| is_seen(x, 0) || is_seen(x, bottom))
        || (0..image.height).any(|y| is_seen(0, y) || is_seen(right, y))
}
