//! Line plots, scatter plots and histograms on linear or logarithmic axes: how they are drawn.

use super::axis::{Axis, Scale, Tick};
use super::canvas::{ARROW_LENGTH, Anchor, CAP_HEIGHT, Canvas, Colour, Dash, Marker, Point, Rect, text_width, way_out};
use super::frame::{self, FRAME_COLOUR, FRAME_WIDTH, Slot, TEXT_COLOUR};
use super::series::{Band, Bars, Line, PALETTE, Rule, Series, palette};

/// Once the colours are used up, the next round of series is dashed, then dotted, then both.
const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::Dotted, Dash::DashDotted];

const GRID_COLOUR: Colour = Colour(228, 228, 228);
const BAND_COLOUR: Colour = Colour(226, 238, 246);

// Lengths in points.
const LINE_WIDTH: f64 = 1.3;
const BOLD: f64 = 2.0;
const RULE_WIDTH: f64 = 0.9;
const GRID_WIDTH: f64 = 0.5;
const MARKER_RADIUS: f64 = 2.4;
const BOLD_MARKER: f64 = 1.3;
/// Markers on a line whose points are closer than this on average are thinned out to [`MARKER_GAP`]; where there are more
/// than [`FEW`] lines, than so many times more.
const MARKER_DENSE: f64 = 7.0;
const FEW: f64 = 3.0;
const MARKER_GAP: f64 = 36.0;
/// Around a plot without axes.
const BARE: f64 = 5.0;
const LEGEND_GAP: f64 = 10.0;
const LEGEND_KEY: f64 = 24.0;
const LEGEND_PITCH: f64 = 13.5;
const LEGEND_SIZE: f64 = 9.0;
const RULE_LABEL_SIZE: f64 = 9.0;
const RULE_LABEL_ROOM: f64 = 18.0;
/// How far a vertical line's leader reaches from the frame up to its label.
const RULE_LEADER: f64 = 6.0;

/// One pair of axes with what is drawn between them. The legend stands to the right of the frame, so that it
/// never covers data.
///
/// ```
/// use limitlab_experiments::report::{Figure, LinePlot, Scale, Series};
///
/// let errors = (0..60).map(|k| 0.8_f64.powi(k));
/// let plot = LinePlot {
///     x_label: "iteration".into(),
///     y_label: "largest vertex error".into(),
///     y_scale: Scale::Log,
///     series: vec![Series::history("jacobi, ω = 0.8", errors)],
///     ..LinePlot::default()
/// };
/// let image = Figure::new(plot).render()?;
/// assert_eq!((image.width, image.height), (1800, 1140));
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinePlot {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub x_scale: Scale,
    pub y_scale: Scale,
    /// What the x axis shows; all of the data unless told. Lines end at the frame.
    pub x_range: Option<(f64, f64)>,
    pub y_range: Option<(f64, f64)>,
    /// A unit of x is as long as a unit of y, as in a plot of complex eigenvalues; the frame becomes narrower or
    /// lower for it. For linear axes.
    pub equal_units: bool,
    /// No frame, ticks, grid and labels, and the drawing in the middle of its room: for shapes in the plane, where coordinates
    /// mean nothing.
    pub without_axes: bool,
    pub series: Vec<Series>,
    /// What the legend says of an arrowhead, if a series goes on, has a point at +∞ or ends outside the range that was asked for.
    pub arrows: String,
    pub vertical_lines: Vec<Rule>,
    pub horizontal_lines: Vec<Rule>,
    pub bands: Vec<Band>,
    pub bars: Vec<Bars>,
}

/// How a series or a set of bars looks once the automatic choices are made.
struct Look {
    colour: Colour,
    dash: Option<Dash>,
    marker: Option<Marker>,
    /// In points.
    width: f64,
    radius: f64,
}

/// The sample beside a name in the legend.
enum Key {
    Line(Look),
    Arrow,
    Rule(Dash, Colour),
    Patch(Colour),
}

impl LinePlot {
    /// The x axis: the range asked for, or one around all data.
    pub(super) fn x_axis(&self) -> Axis {
        if let Some(range) = self.x_range {
            return Axis::over(self.x_scale, range);
        }
        let points = self.series.iter().flat_map(|s| &s.points).map(|p| p.0);
        let rules = self.vertical_lines.iter().map(|r| r.at);
        let bands = self.bands.iter().flat_map(|b| [b.from, b.to]);
        let bars = self.bars.iter().flat_map(|b| b.edges.iter().copied());
        Axis::around(self.x_scale, points.chain(rules).chain(bands).chain(bars))
    }

    fn y_axis(&self) -> Axis {
        if let Some(range) = self.y_range {
            return Axis::over(self.y_scale, range);
        }
        let points = self.series.iter().flat_map(|s| &s.points).map(|p| p.1);
        let rules = self.horizontal_lines.iter().map(|r| r.at);
        let bars = self.bars.iter().flat_map(|b| b.heights.iter().copied());
        let foot = (!self.bars.is_empty()).then_some(0.0);
        Axis::around(self.y_scale, points.chain(rules).chain(bars).chain(foot))
    }

    fn look(&self, index: usize) -> Look {
        let series = &self.series[index];
        Look {
            colour: series.colour.unwrap_or(palette(index)),
            dash: match series.line {
                Line::Auto => Some(DASHES[index / PALETTE.len() % DASHES.len()]),
                Line::Of(dash) => Some(dash),
                Line::None => None,
            },
            marker: series.marker,
            width: LINE_WIDTH * if series.bold { BOLD } else { 1.0 },
            radius: MARKER_RADIUS * if series.bold { BOLD_MARKER } else { 1.0 },
        }
    }

    /// Whether a line ends outside the range that was asked for.
    fn leaves(&self, series: &Series) -> bool {
        let is_beyond = |range: Option<(f64, f64)>, at| range.is_some_and(|(lo, hi)| !(lo..=hi).contains(&at));
        let last = series.points.iter().rev().find(|p| p.0.is_finite() && p.1.is_finite());
        let has_left = last.is_some_and(|p| is_beyond(self.x_range, p.0) || is_beyond(self.y_range, p.1));
        series.line != Line::None && has_left
    }

    fn bar_colour(&self, index: usize) -> Colour {
        let colour = self.bars[index].colour;
        colour.unwrap_or(palette(self.series.len() + index))
    }

    fn legend(&self) -> Vec<(&str, Key)> {
        let series = self.series.iter().enumerate();
        let series = series.map(|(i, s)| (s.name.as_str(), Key::Line(self.look(i))));
        let has_arrow = |s: &Series| s.goes_on || s.points.iter().any(|p| p.1 == f64::INFINITY) || self.leaves(s);
        let arrows = self.series.iter().any(has_arrow).then_some((self.arrows.as_str(), Key::Arrow));
        let bars = self.bars.iter().enumerate();
        let bars = bars.map(|(i, b)| (b.name.as_str(), Key::Patch(self.bar_colour(i))));
        let rules = self.horizontal_lines.iter();
        let rules = rules.map(|r| (r.label.as_str(), Key::Rule(r.dash, r.colour)));
        let bands = self.bands.iter();
        let bands = bands.map(|b| (b.label.as_str(), Key::Patch(BAND_COLOUR)));
        let all = series.chain(arrows).chain(bars).chain(rules).chain(bands);
        all.filter(|(name, _)| !name.is_empty()).collect()
    }

    /// Whether room for labels of vertical lines is needed above the frame.
    fn has_rule_labels(&self) -> bool {
        self.vertical_lines.iter().any(|r| !r.label.is_empty())
    }

    /// The room above the frame, in points.
    pub(super) fn top(&self) -> f64 {
        let labels = if self.has_rule_labels() { RULE_LABEL_ROOM } else { 0.0 };
        frame::title_room(&self.title) + labels
    }

    /// The room below the frame, with or without the x axis's labels.
    pub(super) fn bottom(&self, labelled: bool) -> f64 {
        if self.without_axes { BARE } else { frame::x_axis_room(&self.x_label, labelled) }
    }

    /// The room to the left of a frame of this height.
    pub(super) fn left(&self, height: f64) -> f64 {
        if self.without_axes {
            return BARE;
        }
        frame::y_axis_room(&self.y_label, &frame::y_ticks(self.y_axis(), height))
    }

    /// The room to the right of the frame: the legend's.
    pub(super) fn right(&self) -> f64 {
        let legend = self.legend();
        let widest = legend.iter().map(|(name, _)| text_width(name, LEGEND_SIZE)).reduce(f64::max);
        let none = if self.without_axes { BARE } else { frame::BARE_RIGHT };
        widest.map_or(none, |w| LEGEND_GAP + LEGEND_KEY + 6.0 + w + 4.0)
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, slot: &Slot) {
        let (x, y) = (slot.x_axis, self.y_axis());
        let aspect = (x.hi - x.lo) / (y.hi - y.lo);
        let frame = match (self.equal_units, self.without_axes) {
            (false, _) => slot.frame,
            (true, false) => with_aspect(slot.frame, aspect),
            (true, true) => in_the_middle(slot.frame, with_aspect(slot.frame, aspect)),
        };
        if self.without_axes {
            self.draw_series(canvas, frame, x, y);
            self.draw_legend(canvas, slot.frame);
            return frame::draw_title(canvas, slot.frame, &self.title, self.top(), slot.title_size);
        }
        let x_ticks = frame::x_ticks(x, frame.width());
        let y_ticks = frame::y_ticks(y, frame.height());
        self.draw_bands(canvas, frame, x);
        draw_grid(canvas, frame, &x_ticks, &y_ticks);
        self.draw_bars(canvas, frame, x, y);
        self.draw_rules(canvas, frame, x, y);
        self.draw_series(canvas, frame, x, y);
        canvas.outline(frame, FRAME_WIDTH, FRAME_COLOUR);
        frame::draw_x_axis(canvas, frame, &x_ticks, &self.x_label, slot.labelled);
        frame::draw_y_axis(canvas, frame, slot.left, &y_ticks, &self.y_label);
        self.draw_rule_labels(canvas, frame, x);
        self.draw_legend(canvas, frame);
        frame::draw_title(canvas, frame, &self.title, self.top(), slot.title_size);
    }

    fn draw_bands(&self, canvas: &mut Canvas, frame: Rect, x: Axis) {
        for band in &self.bands {
            let (Some(a), Some(b)) = (x.position(band.from), x.position(band.to)) else {
                continue;
            };
            let (left, right) = (a.min(b).clamp(0.0, 1.0), a.max(b).clamp(0.0, 1.0));
            let area =
                Rect { left: frame.left + left * frame.width(), right: frame.left + right * frame.width(), ..frame };
            if left < right {
                canvas.fill(area, BAND_COLOUR);
            }
        }
    }

    fn draw_bars(&self, canvas: &mut Canvas, frame: Rect, x: Axis, y: Axis) {
        const PARTING: f64 = 0.3;
        for (index, bars) in self.bars.iter().enumerate() {
            assert_eq!(bars.edges.len(), bars.heights.len() + 1, "edges around bars");
            let foot = y.position(0.0).unwrap_or(0.0).clamp(0.0, 1.0);
            for (edges, &height) in bars.edges.windows(2).zip(&bars.heights) {
                let places = (x.position(edges[0]), x.position(edges[1]), y.position(height));
                let (Some(a), Some(b), Some(h)) = places else {
                    continue; // nothing to see on a logarithmic axis
                };
                let (a, b, h) = (a.clamp(0.0, 1.0), b.clamp(0.0, 1.0), h.clamp(0.0, 1.0));
                let bar = Rect {
                    left: frame.left + a * frame.width() + PARTING,
                    right: frame.left + b * frame.width() - PARTING,
                    top: frame.bottom - h.max(foot) * frame.height(),
                    bottom: frame.bottom - h.min(foot) * frame.height(),
                };
                if bar.left < bar.right && bar.top < bar.bottom {
                    canvas.fill(bar, self.bar_colour(index));
                }
            }
        }
    }

    fn draw_rules(&self, canvas: &mut Canvas, frame: Rect, x: Axis, y: Axis) {
        for rule in &self.vertical_lines {
            if let Some(at) = x.position(rule.at) {
                let at = frame.left + at * frame.width();
                let line = [(at, frame.bottom), (at, frame.top)];
                canvas.stroke(&line, frame, RULE_WIDTH, rule.dash, rule.colour);
            }
        }
        for rule in &self.horizontal_lines {
            if let Some(at) = y.position(rule.at) {
                let at = frame.bottom - at * frame.height();
                let line = [(frame.left, at), (frame.right, at)];
                canvas.stroke(&line, frame, RULE_WIDTH, rule.dash, rule.colour);
            }
        }
    }

    fn draw_series(&self, canvas: &mut Canvas, frame: Rect, x: Axis, y: Axis) {
        let place = |&(px, py): &(f64, f64)| -> Option<Point> {
            let (px, py) = (x.position(px)?, y.position(py)?);
            Some((frame.left + px * frame.width(), frame.bottom - py * frame.height()))
        };
        let drawn: Vec<(&Series, Look, Vec<Option<Point>>)> = (self.series.iter().enumerate())
            .map(|(index, series)| (series, self.look(index), series.points.iter().map(place).collect()))
            .collect();
        let mut arrows = vec![Vec::new(); drawn.len()];
        for ((series, look, places), arrows) in drawn.iter().zip(&mut arrows) {
            if let Some(dash) = look.dash {
                let mut last = None;
                for piece in places.split(Option::is_none) {
                    let piece: Vec<Point> = piece.iter().copied().flatten().collect();
                    canvas.stroke(&piece, frame, look.width, dash, look.colour);
                    arrows.extend(way_out(&piece, frame));
                    if let [.., from, to] = piece[..] {
                        last = Some((from, to));
                    }
                }
                arrows.extend(last.filter(|end| series.goes_on && frame.contains(end.1)));
            }
            let tops = series.points.iter().filter(|p| p.1 == f64::INFINITY).filter_map(|p| x.position(p.0));
            let tops = tops.map(|at| (frame.left + at * frame.width(), frame.top)).filter(|&top| frame.contains(top));
            arrows.extend(tops.map(|top| ((top.0, frame.bottom), top)));
        }
        // Over all lines, so that none hides where another one ends; and none on the arrowhead of its own line.
        for (index, ((_, look, places), arrows)) in drawn.iter().zip(&arrows).enumerate() {
            let Some(marker) = look.marker else { continue };
            let is_free = |p: &Point| {
                let far = |to: Point| (to.0 - p.0).hypot(to.1 - p.1) > ARROW_LENGTH + look.radius;
                frame.contains(*p) && arrows.iter().all(|&(_, to)| far(to))
            };
            let mut visible: Vec<Point> = places.iter().copied().flatten().filter(is_free).collect();
            if look.dash.is_some() {
                let crowd = (self.series.len() as f64 / FEW).max(1.0);
                visible = thinned(visible, index, crowd * MARKER_DENSE);
            }
            for at in visible {
                canvas.marker(at, marker, look.radius, look.colour);
            }
        }
        for ((_, look, _), arrows) in drawn.iter().zip(arrows) {
            for arrow in arrows {
                canvas.arrowhead(arrow, look.colour);
            }
        }
    }

    /// Labels of vertical lines above the frame, moved apart where they would collide, each with a leader to
    /// its line.
    fn draw_rule_labels(&self, canvas: &mut Canvas, frame: Rect, x: Axis) {
        let labelled = self.vertical_lines.iter().filter(|r| !r.label.is_empty());
        let mut labels: Vec<(f64, f64, &Rule)> = Vec::new();
        for rule in labelled {
            if let Some(at) = x.position(rule.at).filter(|at| (0.0..=1.0).contains(at)) {
                let width = text_width(&rule.label, RULE_LABEL_SIZE);
                labels.push((frame.left + at * frame.width(), width, rule));
            }
        }
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let wanted: Vec<(f64, f64)> = labels.iter().map(|l| (l.0, l.1)).collect();
        let centres = moved_apart(&wanted, frame.left, frame.right);
        for (&(at, _, rule), centre) in labels.iter().zip(centres) {
            let leader = [(at, frame.top), (centre, frame.top - RULE_LEADER)];
            let above = Rect { top: frame.top - RULE_LEADER, bottom: frame.top, ..frame };
            canvas.stroke(&leader, above, RULE_WIDTH * 0.7, Dash::Solid, rule.colour);
            let place = (centre, frame.top - RULE_LEADER - 3.5);
            let text = &rule.label;
            canvas.text(text, place, RULE_LABEL_SIZE, Anchor::Middle, false, rule.colour);
        }
    }

    fn draw_legend(&self, canvas: &mut Canvas, frame: Rect) {
        let legend = self.legend();
        let pitch = LEGEND_PITCH.min(frame.height() / legend.len().max(1) as f64);
        let size = LEGEND_SIZE.min(0.75 * pitch);
        let left = frame.right + LEGEND_GAP;
        for (row, (name, key)) in legend.into_iter().enumerate() {
            let middle = frame.top + (row as f64 + 0.5) * pitch;
            let line = [(left, middle), (left + LEGEND_KEY, middle)];
            let area =
                Rect { left, right: left + LEGEND_KEY, top: middle - 0.32 * pitch, bottom: middle + 0.32 * pitch };
            match key {
                Key::Line(look) => {
                    if let Some(dash) = look.dash {
                        canvas.stroke(&line, area, look.width, dash, look.colour);
                    }
                    if let Some(marker) = look.marker {
                        canvas.marker(area.centre(), marker, look.radius, look.colour);
                    }
                }
                Key::Arrow => {
                    let centre = area.centre();
                    canvas.arrowhead(((centre.0, area.bottom), (centre.0, area.top + 1.0)), FRAME_COLOUR);
                }
                Key::Rule(dash, colour) => canvas.stroke(&line, area, RULE_WIDTH, dash, colour),
                Key::Patch(colour) => canvas.fill(area, colour),
            }
            let place = (area.right + 6.0, middle + CAP_HEIGHT / 2.0 * size);
            canvas.text(name, place, size, Anchor::Start, false, TEXT_COLOUR);
        }
    }
}

/// The largest part of `frame` whose width is `aspect` times its height, at the top left, where the axis labels
/// and the neighbouring frames are.
fn with_aspect(frame: Rect, aspect: f64) -> Rect {
    let width = frame.width().min(aspect * frame.height());
    Rect { right: frame.left + width, bottom: frame.top + width / aspect, ..frame }
}

/// The rectangle moved to the middle of `room`.
fn in_the_middle(room: Rect, Rect { left, top, right, bottom }: Rect) -> Rect {
    let (dx, dy) = ((room.right - right) / 2.0, (room.bottom - bottom) / 2.0);
    Rect { left: left + dx, top: top + dy, right: right + dx, bottom: bottom + dy }
}

fn draw_grid(canvas: &mut Canvas, frame: Rect, x: &[Tick], y: &[Tick]) {
    for tick in x.iter().filter(|t| t.label.is_some()) {
        let at = frame.left + tick.at * frame.width();
        canvas.upright(at, (frame.top, frame.bottom), GRID_WIDTH, GRID_COLOUR);
    }
    for tick in y.iter().filter(|t| t.label.is_some()) {
        let at = frame.bottom - tick.at * frame.height();
        canvas.level(at, (frame.left, frame.right), GRID_WIDTH, GRID_COLOUR);
    }
}

/// The places that carry a marker: all of them, or, where they are closer than `dense`, some at equal distances along the
/// line. The first one depends on the series, so that the markers of neighbouring curves do not coincide.
fn thinned(places: Vec<Point>, series: usize, dense: f64) -> Vec<Point> {
    let step = |w: &[Point]| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1);
    let length: f64 = places.windows(2).map(step).sum();
    if length >= dense * places.len().saturating_sub(1) as f64 {
        return places;
    }
    // Golden-section offsets keep any number of series apart.
    let offset = (series as f64 * 0.618_034).fract();
    let mut next = offset * MARKER_GAP;
    let mut walked = 0.0;
    let mut kept = Vec::new();
    for (i, &at) in places.iter().enumerate() {
        if i > 0 {
            walked += step(&places[i - 1..=i]);
        }
        if walked >= next {
            kept.push(at);
            next = walked + MARKER_GAP;
        }
    }
    if kept.is_empty() {
        // A line without its marker is that of nobody.
        kept.extend(places.last());
    }
    kept
}

/// Centres for labels of the wanted centres (ascending) and widths, between `lo` and `hi` and without overlap, as
/// near to the wanted ones as possible in the least-squares sense (pool adjacent violators).
fn moved_apart(labels: &[(f64, f64)], lo: f64, hi: f64) -> Vec<f64> {
    const PARTING: f64 = 8.0;
    // Without the room that the labels before it take, each centre has only to be no less than the one before.
    let mut offset = 0.0;
    let mut offsets = Vec::with_capacity(labels.len());
    for (i, &(_, width)) in labels.iter().enumerate() {
        if i > 0 {
            offset += (labels[i - 1].1 + width) / 2.0 + PARTING;
        }
        offsets.push(offset);
    }
    let mut pools: Vec<(f64, usize)> = Vec::new(); // mean and number of members
    for (&(wanted, _), &offset) in labels.iter().zip(&offsets) {
        let (mut mean, mut count) = (wanted - offset, 1);
        while let Some(&(before, members)) = pools.last().filter(|p| p.0 > mean) {
            mean = (mean * count as f64 + before * members as f64) / (count + members) as f64;
            count += members;
            pools.pop();
        }
        pools.push((mean, count));
    }
    let (Some(first), Some(last)) = (labels.first(), labels.last()) else {
        return Vec::new();
    };
    let least = lo + first.1 / 2.0;
    let most = (hi - last.1 / 2.0 - offset).max(least);
    let means = pools.into_iter().flat_map(|(mean, n)| std::iter::repeat_n(mean, n));
    let free = means.map(|mean| mean.clamp(least, most));
    free.zip(offsets).map(|(mean, offset)| mean + offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_moved_apart_no_further_than_needed() {
        let apart = |labels: &[(f64, f64)]| moved_apart(labels, 0.0, 200.0);
        assert!(apart(&[]).is_empty());
        assert_eq!(apart(&[(50.0, 20.0), (120.0, 20.0)]), [50.0, 120.0]);
        // Two of width 20 at one place: 28 apart, around it.
        assert_eq!(apart(&[(100.0, 20.0), (100.0, 20.0)]), [86.0, 114.0]);
        // Three of them stay around it: the middle one where it was.
        assert_eq!(apart(&[(100.0, 20.0), (100.0, 20.0), (100.0, 20.0)]), [72.0, 100.0, 128.0]);
        // Held inside.
        assert_eq!(apart(&[(0.0, 20.0)]), [10.0]);
        assert_eq!(apart(&[(195.0, 20.0), (199.0, 20.0)]), [162.0, 190.0]);
    }

    #[test]
    fn markers_are_thinned_only_where_dense() {
        let sparse: Vec<Point> = (0..10).map(|i| (20.0 * f64::from(i), 0.0)).collect();
        assert_eq!(thinned(sparse.clone(), 3, MARKER_DENSE), sparse);
        let dense: Vec<Point> = (0..=360).map(|i| (f64::from(i), 0.0)).collect();
        let kept = thinned(dense.clone(), 0, MARKER_DENSE);
        assert_eq!(kept.len(), 11);
        assert!(kept.windows(2).all(|w| w[1].0 - w[0].0 >= MARKER_GAP));
        assert_ne!(thinned(dense.clone(), 1, MARKER_DENSE)[0], kept[0]);
        // Whatever the series: a single point, a short line.
        for series in 0..20 {
            assert_eq!(thinned(vec![(3.0, 4.0)], series, 3.0 * MARKER_DENSE), [(3.0, 4.0)]);
            assert_eq!(thinned(dense[..5].to_vec(), series, MARKER_DENSE).len(), 1);
        }
    }

    #[test]
    fn bars_stand_on_zero() {
        let bars = |heights: Vec<f64>| {
            let bars = vec![Bars { name: String::new(), edges: vec![0.0, 1.0, 2.0], heights, colour: None }];
            LinePlot { bars, ..LinePlot::default() }.y_axis()
        };
        // A line through these would have an axis from 8 on, or up to −8.
        assert_eq!(bars(vec![8.0, 10.0]).lo, 0.0);
        assert!(bars(vec![-8.0, -10.0]).hi >= 0.0);
    }

    #[test]
    fn sixteen_series_look_different() {
        let plot = LinePlot {
            series: (0..16).map(|i| Series::history(format!("{i}"), [1.0])).collect(),
            ..LinePlot::default()
        };
        let looks: Vec<_> = (0..16).map(|i| plot.look(i)).map(|l| (l.colour.0, l.colour.1, l.dash)).collect();
        for (i, look) in looks.iter().enumerate() {
            assert!(!looks[..i].contains(look), "series {i} looks like another");
        }
        assert_eq!(plot.legend().len(), 16);
    }
}
