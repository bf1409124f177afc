//! Data of a plot: named points, rules, bands and bars.

use super::canvas::{Colour, Dash, Marker};

/// The colours of Okabe and Ito (2008), told apart with any colour vision; their yellow is too faint on white.
pub(super) const PALETTE: [Colour; 7] = [
    Colour(0, 114, 178),   // blue
    Colour(213, 94, 0),    // vermilion
    Colour(0, 158, 115),   // bluish green
    Colour(204, 121, 167), // reddish purple
    Colour(230, 159, 0),   // orange
    Colour(86, 180, 233),  // sky blue
    Colour(0, 0, 0),
];

const MARKERS: [Marker; 7] = [
    Marker::Circle,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::InvertedTriangle,
    Marker::Cross,
    Marker::Plus,
];

const RULE_COLOUR: Colour = Colour(90, 90, 90);

/// How the points of a [`Series`] are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Line {
    /// Solid for the first seven series of a plot, then dashed, dotted, dash-dotted.
    #[default]
    Auto,
    Of(Dash),
    None,
}

/// How something looks that is the same thing in several plots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    pub colour: Colour,
    pub dash: Dash,
    pub marker: Marker,
}

/// Named points, joined by a line or not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// What the legend says; a series without a name is not in the legend. `_{…}` and `^{…}` set subscripts and
    /// superscripts, here and in every other text of a plot.
    pub name: String,
    /// In data units. A point that is not finite, or not positive on a logarithmic axis, breaks the line; one whose y is
    /// +∞ has an arrowhead at the upper edge.
    pub points: Vec<(f64, f64)>,
    /// The line goes on beyond its last point, as that of a method which diverged: it ends in an arrowhead. So does one that
    /// leaves the frame.
    pub goes_on: bool,
    pub line: Line,
    /// Where points are dense along a line, only some of them carry their marker.
    pub marker: Option<Marker>,
    /// By turns from a palette unless told.
    pub colour: Option<Colour>,
    /// A line twice as wide and larger markers: what the plot is about, among others.
    pub bold: bool,
}

impl Series {
    /// Points joined by a line.
    pub fn line(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Series { name: name.into(), points: points.into_iter().collect(), ..Series::default() }
    }

    /// A history over its index: (0, h₀), (1, h₁), …
    pub fn history(name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let indexed = values.into_iter().enumerate();
        Series::line(name, indexed.map(|(i, v)| (i as f64, v)))
    }

    /// The line on which a function is `level`, given on a grid: at (`x[k]`, `y[j]`) it is `values[j·n + k]`, n the length of `x`.
    /// Straight through each cell, linear along its sides; where all four are crossed, by the mean of the corners.
    ///
    /// # Panics
    /// If there is not one value a point of the grid.
    pub fn contour(name: impl Into<String>, x: &[f64], y: &[f64], values: &[f64], level: f64) -> Self {
        assert_eq!(values.len(), x.len() * y.len(), "one value a point");
        let n = x.len();
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (j, y) in y.windows(2).enumerate() {
            for (k, x) in x.windows(2).enumerate() {
                let corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])];
                let above =
                    [j * n + k, j * n + k + 1, (j + 1) * n + k + 1, (j + 1) * n + k].map(|at| values[at] - level);
                // Where the sides from each corner to the next are crossed.
                let crossed: Vec<(f64, f64)> = (0..4)
                    .filter(|&c| (above[c] > 0.0) != (above[(c + 1) % 4] > 0.0))
                    .map(|c| {
                        let ((x, y), (to_x, to_y)) = (corners[c], corners[(c + 1) % 4]);
                        let part = above[c] / (above[c] - above[(c + 1) % 4]);
                        (x + part * (to_x - x), y + part * (to_y - y))
                    })
                    .collect();
                // Of four the first two are joined where the corner between them is cut off.
                let cuts_off = (above[1] > 0.0) != (above.iter().sum::<f64>() > 0.0);
                let pairs: &[[usize; 2]] = match crossed.len() {
                    0 => &[],
                    2 => &[[0, 1]],
                    _ if cuts_off => &[[0, 1], [2, 3]],
                    _ => &[[3, 0], [1, 2]],
                };
                // What is not finite parts one piece from the next.
                points.extend(pairs.iter().flat_map(|&[a, b]| [crossed[a], crossed[b], (f64::NAN, f64::NAN)]));
            }
        }
        Series::line(name, points)
    }

    /// Circles that are not joined.
    pub fn scatter(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Series { line: Line::None, marker: Some(Marker::Circle), ..Series::line(name, points) }
    }

    /// Points that are many and lie close: an eigenvalue each.
    pub fn cloud(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Series::scatter(name, points).marker(Marker::Dot)
    }

    /// The same series with this marker.
    pub fn marker(mut self, marker: Marker) -> Self {
        self.marker = Some(marker);
        self
    }

    /// The same series with this line.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.line = Line::Of(dash);
        self
    }

    /// The same series in this style.
    pub fn style(self, style: Style) -> Self {
        self.colour(style.colour).dash(style.dash).marker(style.marker)
    }

    /// The same series in this colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = Some(colour);
        self
    }
}

/// The `index`-th colour of the palette, by turns: for series that belong together, such as a prediction and its
/// measurement.
pub fn palette(index: usize) -> Colour {
    PALETTE[index % PALETTE.len()]
}

/// The `index`-th marker, by turns.
pub fn marker(index: usize) -> Marker {
    MARKERS[index % MARKERS.len()]
}

/// A line across the whole plot at one value of x or y. A vertical one has its label above the frame, a
/// horizontal one in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    pub at: f64,
    pub label: String,
    pub dash: Dash,
    pub colour: Colour,
}

impl Rule {
    /// A dashed grey line.
    pub fn new(at: f64, label: impl Into<String>) -> Self {
        Rule { at, label: label.into(), dash: Dash::Dashed, colour: RULE_COLOUR }
    }
}

/// A shaded range of x, such as the ω for which a method converges; its label is in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    pub from: f64,
    pub to: f64,
    pub label: String,
}

/// A bar over each interval between neighbouring edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    pub name: String,
    /// Ascending; one more than heights.
    pub edges: Vec<f64>,
    pub heights: Vec<f64>,
    pub colour: Option<Colour>,
}

impl Bars {
    /// Counts of `values` in `bins` intervals of one length between the least and the greatest. Values that are
    /// not finite are left out.
    ///
    /// ```
    /// use limitlab_experiments::report::series::Bars;
    ///
    /// let bars = Bars::histogram("eigenvalues", &[0.0, 0.1, 0.2, 1.0], 2);
    /// assert_eq!(bars.edges, [0.0, 0.5, 1.0]);
    /// assert_eq!(bars.heights, [3.0, 1.0]);
    /// ```
    ///
    /// # Panics
    /// If `bins` is 0.
    pub fn histogram(name: impl Into<String>, values: &[f64], bins: usize) -> Self {
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let lo = finite().fold(f64::INFINITY, f64::min);
        let hi = finite().fold(f64::NEG_INFINITY, f64::max);
        let range = match () {
            () if lo < hi => (lo, hi),
            () if lo == hi => (lo - 0.5, hi + 0.5),
            () => (0.0, 1.0),
        };
        Bars::histogram_over(name, values, bins, range)
    }

    /// As [`histogram`](Self::histogram), between the ends of a range, so that the bins of several plots are the same; what lies
    /// beyond an end counts in the bin there.
    ///
    /// # Panics
    /// If `bins` is 0.
    pub fn histogram_over(name: impl Into<String>, values: &[f64], bins: usize, (lo, hi): (f64, f64)) -> Self {
        assert!(bins > 0, "a histogram has bins");
        let mut heights = vec![0.0; bins];
        for v in values.iter().filter(|v| v.is_finite()) {
            // Saturates at 0.
            let bin = ((v - lo) / (hi - lo) * bins as f64) as usize;
            heights[bin.min(bins - 1)] += 1.0; // the greatest value belongs to the last bin
        }
        Bars {
            name: name.into(),
            edges: (0..=bins).map(|i| lo + (hi - lo) * i as f64 / bins as f64).collect(),
            heights,
            colour: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x² + y² = 1, and a saddle, xy = 0 around a corner of the grid.
    #[test]
    fn contours_are_where_the_function_is_the_level() {
        let grid: Vec<f64> = (0..=40).map(|k| -1.5 + 3.0 * f64::from(k) / 40.0).collect();
        let values: Vec<f64> = grid.iter().flat_map(|y| grid.iter().map(move |x| x * x + y * y)).collect();
        let circle = Series::contour("circle", &grid, &grid, &values, 1.0);
        let pieces: Vec<&[(f64, f64)]> = circle.points.split(|p| p.0.is_nan()).filter(|p| !p.is_empty()).collect();
        assert!(pieces.iter().all(|piece| piece.len() == 2));
        let length: f64 = pieces.iter().map(|p| (p[0].0 - p[1].0).hypot(p[0].1 - p[1].1)).sum();
        assert!((length - std::f64::consts::TAU).abs() < 0.01, "{length}");
        assert!(pieces.iter().copied().flatten().all(|p| (p.0.hypot(p.1) - 1.0).abs() < 1e-3));
        // The corners (0, 0) and (1, 1) are above, the middle is not.
        let saddle = Series::contour("saddle", &[0.0, 1.0], &[0.0, 1.0], &[1.0, -2.0, -2.0, 2.0], 0.0);
        let third = 1.0 / 3.0;
        let close = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1) < 1e-12;
        let wanted = [(0.0, third), (third, 0.0), (1.0, 0.5), (0.5, 1.0)];
        let found: Vec<(f64, f64)> = saddle.points.iter().copied().filter(|p| p.0.is_finite()).collect();
        assert!(found.len() == 4 && wanted.iter().all(|&w| found.iter().any(|&f| close(f, w))), "{found:?}");
        // Each has a piece of its own, first the one about (0, 0).
        assert!(close(found[0], (0.0, third)) == close(found[1], (third, 0.0)), "{found:?}");
    }

    #[test]
    fn histograms_count_every_finite_value() {
        let values = [0.25, 1.0, 0.0, f64::NAN, 0.5, 0.75, 1.0];
        let bars = Bars::histogram("h", &values, 4);
        assert_eq!(bars.edges, [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(bars.heights, [1.0, 1.0, 1.0, 3.0]);
        assert_eq!(Bars::histogram("h", &[2.0], 1).heights, [1.0]);
        assert_eq!(Bars::histogram("h", &[], 2).heights, [0.0, 0.0]);
        let over = Bars::histogram_over("h", &[-1.0, 0.25, 1.0, 1.0 + 1e-15, f64::NAN], 2, (0.0, 1.0));
        assert_eq!((over.edges, over.heights), (vec![0.0, 0.5, 1.0], vec![2.0, 2.0]));
    }
}
