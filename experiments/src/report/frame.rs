//! Frames of panels: colours and sizes that all panels share, room for titles and axes, and how these are drawn.

use super::axis::{Axis, Tick};
use super::canvas::{Anchor, CAP_HEIGHT, Canvas, Colour, Point, Rect, text_width};

// What all panels share; lengths in points.
pub(super) const TEXT_COLOUR: Colour = Colour(20, 20, 20);
pub(super) const FRAME_COLOUR: Colour = Colour(60, 60, 60);
pub(super) const FRAME_WIDTH: f64 = 0.8;
pub(super) const TITLE_SIZE: f64 = 10.5;
pub(super) const LABEL_SIZE: f64 = 10.0;
pub(super) const TICK_SIZE: f64 = 9.0;
/// The room to the right of a frame without legend: half a tick label.
pub(super) const BARE_RIGHT: f64 = 14.0;
const TICK_LENGTH: f64 = 4.0;
const MINOR_TICK_LENGTH: f64 = 2.2;
const TICK_GAP: f64 = 3.5;
/// Least distances from tick label to tick label.
const X_TICK_PITCH: f64 = 46.0;
const Y_TICK_PITCH: f64 = 24.0;

/// Where a panel stands in its figure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slot {
    /// Around the data.
    pub frame: Rect,
    /// The room to the left of the frame that the panels of a column share.
    pub left: f64,
    /// The panel's own x axis, or the one that the panels of a column share.
    pub x_axis: Axis,
    /// Whether the x axis carries its labels here.
    pub labelled: bool,
    /// The size of the titles of all panels.
    pub title_size: f64,
}

/// Room for a panel's title, above whatever else stands over the frame.
pub(super) fn title_room(title: &str) -> f64 {
    if title.is_empty() { 4.0 } else { 20.0 }
}

/// Room for tick labels and label of an x axis.
pub(super) fn x_axis_room(label: &str, labelled: bool) -> f64 {
    match (labelled, label.is_empty()) {
        (false, _) => TICK_LENGTH + 4.0,
        (true, true) => TICK_LENGTH + TICK_GAP + TICK_SIZE + 2.0,
        (true, false) => TICK_LENGTH + TICK_GAP + TICK_SIZE + 6.0 + LABEL_SIZE + 2.0,
    }
}

/// Room for tick labels and label of a y axis.
pub(super) fn y_axis_room(label: &str, ticks: &[Tick]) -> f64 {
    let room = if label.is_empty() { 0.0 } else { LABEL_SIZE + 7.0 };
    room + widest_label(ticks) + TICK_GAP + TICK_LENGTH
}

fn widest_label(ticks: &[Tick]) -> f64 {
    let labels = ticks.iter().filter_map(|t| t.label.as_deref());
    labels.map(|label| text_width(label, TICK_SIZE)).fold(0.0, f64::max)
}

/// Ticks of an x axis of this length.
pub(super) fn x_ticks(axis: Axis, length: f64) -> Vec<Tick> {
    axis.ticks((length / X_TICK_PITCH) as usize)
}

/// Ticks of a y axis of this length.
pub(super) fn y_ticks(axis: Axis, length: f64) -> Vec<Tick> {
    axis.ticks((length / Y_TICK_PITCH) as usize)
}

/// Ticks below the frame, and their labels and the axis's if `labelled`.
pub(super) fn draw_x_axis(canvas: &mut Canvas, frame: Rect, ticks: &[Tick], label: &str, labelled: bool) {
    let baseline = frame.bottom + TICK_LENGTH + TICK_GAP + CAP_HEIGHT * TICK_SIZE;
    for tick in ticks {
        let at = frame.left + tick.at * frame.width();
        let reach = (frame.bottom, frame.bottom + tick_length(tick));
        canvas.upright(at, reach, FRAME_WIDTH, FRAME_COLOUR);
        if let Some(label) = tick.label.as_deref().filter(|_| labelled) {
            let place = (at, baseline);
            canvas.text(label, place, TICK_SIZE, Anchor::Middle, false, TEXT_COLOUR);
        }
    }
    if labelled {
        let place = (frame.centre().0, baseline + 6.0 + LABEL_SIZE);
        canvas.text(label, place, LABEL_SIZE, Anchor::Middle, false, TEXT_COLOUR);
    }
}

/// Ticks to the left of the frame, their labels, and at the outer edge of the `room` there the axis's label, made
/// smaller if it is longer than the axis.
pub(super) fn draw_y_axis(canvas: &mut Canvas, frame: Rect, room: f64, ticks: &[Tick], label: &str) {
    for tick in ticks {
        let at = frame.bottom - tick.at * frame.height();
        let reach = (frame.left - tick_length(tick), frame.left);
        canvas.level(at, reach, FRAME_WIDTH, FRAME_COLOUR);
        if let Some(label) = &tick.label {
            let right = frame.left - TICK_LENGTH - TICK_GAP;
            let place = (right, at + CAP_HEIGHT / 2.0 * TICK_SIZE);
            canvas.text(label, place, TICK_SIZE, Anchor::End, false, TEXT_COLOUR);
        }
    }
    let length = text_width(label, LABEL_SIZE).max(1.0);
    let size = LABEL_SIZE * (frame.height() / length).min(1.0);
    let place = (frame.left - room + LABEL_SIZE, frame.centre().1);
    canvas.text(label, place, size, Anchor::Middle, true, TEXT_COLOUR);
}

fn tick_length(tick: &Tick) -> f64 {
    if tick.label.is_some() { TICK_LENGTH } else { MINOR_TICK_LENGTH }
}

/// A title is made smaller down to this part of its size, then cut in its middle.
const LEAST_TITLE: f64 = 0.8;
/// Between the titles of neighbours, beside the room between their frames.
const TITLE_GAP: f64 = 6.0;

/// The size of a panel's title in a frame of this width.
pub(super) fn title_size(title: &str, width: f64) -> f64 {
    fitted(title, TITLE_SIZE, width - TITLE_GAP).1
}

/// The title at the top of the `room` above the frame, no larger than `size`.
pub(super) fn draw_title(canvas: &mut Canvas, frame: Rect, title: &str, room: f64, size: f64) {
    let place = (frame.centre().0, frame.top - room + 2.0 + TITLE_SIZE);
    let title = cut(title, size, frame.width() - TITLE_GAP);
    canvas.text(&title, place, size, Anchor::Middle, false, TEXT_COLOUR);
}

/// Text about `place` that is no wider than `width`: smaller, or with an ellipsis in its middle, where it has to be.
pub(super) fn draw_fitted(canvas: &mut Canvas, text: &str, place: Point, size: f64, width: f64) {
    let (text, size) = fitted(text, size, width);
    canvas.text(&text, place, size, Anchor::Middle, false, TEXT_COLOUR);
}

fn fitted(text: &str, size: f64, width: f64) -> (String, f64) {
    let full = text_width(text, size).max(1.0);
    let size = size * (width / full).clamp(LEAST_TITLE, 1.0);
    (cut(text, size, width), size)
}

/// The text of this size, without its middle where it is wider than `width`.
fn cut(text: &str, size: f64, width: f64) -> String {
    let letters: Vec<char> = text.chars().collect();
    // The start says less than the end, where the name of a file and what was done to it are.
    let without = |kept: usize| -> String {
        let head = kept / 3;
        letters[..head].iter().chain(&['…']).chain(&letters[letters.len() - (kept - head)..]).collect()
    };
    let fits = |text: &str| text_width(text, size) <= width * (1.0 + 1e-9);
    if fits(text) {
        return text.to_owned();
    }
    let kept = (0..letters.len()).rev().find(|&kept| fits(&without(kept))).unwrap_or(0);
    without(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_titles_are_made_smaller_then_cut_in_their_middle() {
        let text = "a title of some length, noise 0.1";
        let full = text_width(text, 10.0);
        assert_eq!(fitted(text, 10.0, full), (text.to_owned(), 10.0));
        let (smaller, size) = fitted(text, 10.0, 0.9 * full);
        assert_eq!(smaller, text);
        assert!((size - 9.0).abs() < 1e-9, "{size}");
        for part in [0.7, 0.4, 0.1] {
            let (cut, size) = fitted(text, 10.0, part * full);
            let (head, tail) = cut.split_once('…').unwrap();
            assert!(text.starts_with(head) && text.ends_with(tail), "{cut}");
            let width = text_width(&cut, size);
            assert_eq!(size, 8.0);
            assert!(width <= part * full && width > part * full - 10.0, "{cut}");
        }
    }
}
