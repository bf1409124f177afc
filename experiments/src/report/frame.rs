//! Frames of panels: colours and sizes that all panels share, room for titles and axes, and how these are drawn.

use super::axis::{Axis, Tick};
use super::canvas::{Anchor, CAP_HEIGHT, Canvas, Colour, Rect, text_width};
use limitlab::Result;

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
pub(super) fn y_axis_room(label: &str, ticks: &[Tick]) -> Result<f64> {
    let room = if label.is_empty() { 0.0 } else { LABEL_SIZE + 7.0 };
    Ok(room + widest_label(ticks)? + TICK_GAP + TICK_LENGTH)
}

fn widest_label(ticks: &[Tick]) -> Result<f64> {
    let labels = ticks.iter().filter_map(|t| t.label.as_deref());
    let widths = labels.map(|label| text_width(label, TICK_SIZE));
    Ok(widths.collect::<Result<Vec<_>>>()?.into_iter().fold(0.0, f64::max))
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
pub(super) fn draw_x_axis(canvas: &Canvas<'_>, frame: Rect, ticks: &[Tick], label: &str, labelled: bool) -> Result<()> {
    let baseline = frame.bottom + TICK_LENGTH + TICK_GAP + CAP_HEIGHT * TICK_SIZE;
    for tick in ticks {
        let at = frame.left + tick.at * frame.width();
        let reach = (frame.bottom, frame.bottom + tick_length(tick));
        canvas.upright(at, reach, FRAME_WIDTH, FRAME_COLOUR)?;
        if let Some(label) = tick.label.as_deref().filter(|_| labelled) {
            let place = (at, baseline);
            canvas.text(label, place, TICK_SIZE, Anchor::Middle, false, TEXT_COLOUR)?;
        }
    }
    if labelled {
        let place = (frame.centre().0, baseline + 6.0 + LABEL_SIZE);
        canvas.text(label, place, LABEL_SIZE, Anchor::Middle, false, TEXT_COLOUR)?;
    }
    Ok(())
}

/// Ticks to the left of the frame, their labels, and at the outer edge of the `room` there the axis's label, made
/// smaller if it is longer than the axis.
pub(super) fn draw_y_axis(canvas: &Canvas<'_>, frame: Rect, room: f64, ticks: &[Tick], label: &str) -> Result<()> {
    for tick in ticks {
        let at = frame.bottom - tick.at * frame.height();
        let reach = (frame.left - tick_length(tick), frame.left);
        canvas.level(at, reach, FRAME_WIDTH, FRAME_COLOUR)?;
        if let Some(label) = &tick.label {
            let right = frame.left - TICK_LENGTH - TICK_GAP;
            let place = (right, at + CAP_HEIGHT / 2.0 * TICK_SIZE);
            canvas.text(label, place, TICK_SIZE, Anchor::End, false, TEXT_COLOUR)?;
        }
    }
    let length = text_width(label, LABEL_SIZE)?.max(1.0);
    let size = LABEL_SIZE * (frame.height() / length).min(1.0);
    let place = (frame.left - room + LABEL_SIZE, frame.centre().1);
    canvas.text(label, place, size, Anchor::Middle, true, TEXT_COLOUR)
}

fn tick_length(tick: &Tick) -> f64 {
    if tick.label.is_some() { TICK_LENGTH } else { MINOR_TICK_LENGTH }
}

/// The title at the top of the `room` above the frame.
pub(super) fn draw_title(canvas: &Canvas<'_>, frame: Rect, title: &str, room: f64) -> Result<()> {
    let place = (frame.centre().0, frame.top - room + 2.0 + TITLE_SIZE);
    canvas.text(title, place, TITLE_SIZE, Anchor::Middle, false, TEXT_COLOUR)
}
