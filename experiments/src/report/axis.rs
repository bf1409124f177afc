//! Axes: from data to a position along the frame, ticks, and tick labels as a paper prints them.

/// How an axis maps numbers to lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    #[default]
    Linear,
    /// By the decimal logarithm; numbers ≤ 0 have no place.
    Log,
}

/// The part of a linear range that is left free on each side of the data.
const LINEAR_MARGIN: f64 = 0.03;

/// A linear axis of data ≥ 0 begins at 0 if the least value is below this part of the greatest.
const STARTS_AT_ZERO: f64 = 0.3;

/// A logarithmic axis over at least so many decades ends at powers of ten and labels these alone.
const WHOLE_DECADES: f64 = 2.0;

/// The part of a shorter logarithmic range that is left free on each side.
const LOG_MARGIN: f64 = 0.05;

/// Numbers on a linear axis from here on, or with steps below [`FINEST_PLAIN_STEP`], are written as 2×10⁵.
const LARGEST_PLAIN: f64 = 1e5;
const FINEST_PLAIN_STEP: f64 = 1e-4;

/// Data that differ by less than this part of their size are drawn as one value: the rest is rounding.
const FLAT: f64 = 1e-9;

/// Larger numbers are left out like infinities; their differences overflow.
const BEYOND: f64 = 1e300;

/// An axis over the range from `lo` to `hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    pub scale: Scale,
    pub lo: f64,
    pub hi: f64,
}

/// A mark on an axis; a minor one has no label.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// Where on the axis: 0 at `lo`, 1 at `hi`.
    pub at: f64,
    pub label: Option<String>,
}

impl Axis {
    /// The axis over a range that the caller chose.
    ///
    /// # Panics
    /// If the range is empty, not finite, or not positive on a logarithmic axis.
    pub fn over(scale: Scale, (lo, hi): (f64, f64)) -> Self {
        assert!(lo.is_finite() && hi.is_finite() && lo < hi, "an axis needs lo < hi, not {lo} and {hi}");
        assert!(scale == Scale::Linear || lo > 0.0, "a logarithmic axis begins above 0, not at {lo}");
        Axis { scale, lo, hi }
    }

    /// The axis that shows all `values` that have a place on it.
    pub fn around(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let has_place = |v: &f64| v.abs() < BEYOND && (scale == Scale::Linear || *v > 0.0);
        let (lo, hi) =
            values.filter(has_place).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if lo > hi {
            // nothing to show
            return Axis { scale, lo: 0.1, hi: 1.0 };
        }
        match scale {
            Scale::Linear => {
                let size = lo.abs().max(hi.abs());
                let spread = if hi - lo > FLAT * size { hi - lo } else { size.max(1.0) };
                let from_zero = lo >= 0.0 && lo <= STARTS_AT_ZERO * hi;
                Axis {
                    scale,
                    lo: if from_zero { 0.0 } else { lo - LINEAR_MARGIN * spread },
                    hi: hi + LINEAR_MARGIN * spread,
                }
            }
            Scale::Log => {
                let (a, b) = (lo.log10(), hi.log10());
                let (a, b) = if b - a >= WHOLE_DECADES {
                    ((a + 1e-9).floor(), (b - 1e-9).ceil())
                } else {
                    let margin = LOG_MARGIN * (b - a).max(1.0);
                    (a - margin, b + margin)
                };
                // The smallest doubles have no power of ten below them.
                Axis { scale, lo: 10_f64.powf(a).max(f64::MIN_POSITIVE), hi: 10_f64.powf(b).min(f64::MAX) }
            }
        }
    }

    /// The shortest axis of this scale that covers both.
    pub fn union(self, other: Axis) -> Axis {
        Axis { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi), ..self }
    }

    /// Where `value` lies: 0 at `lo`, 1 at `hi`, outside beyond; `None` if it has no place on the axis.
    pub fn position(&self, value: f64) -> Option<f64> {
        let at = match self.scale {
            // Halved, since the width of the widest range overflows.
            Scale::Linear => (value / 2.0 - self.lo / 2.0) / (self.hi / 2.0 - self.lo / 2.0),
            Scale::Log if value <= 0.0 => return None,
            Scale::Log => (value.log10() - self.lo.log10()) / (self.hi.log10() - self.lo.log10()),
        };
        at.is_finite().then_some(at)
    }

    /// Ticks from `lo` to `hi` with at most `most` labels (but at least room for 2 is assumed).
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        let most = most.max(2);
        match self.scale {
            Scale::Linear => self.linear_ticks(most),
            Scale::Log => self.log_ticks(most),
        }
    }

    fn tick(&self, value: f64, label: Option<String>) -> Option<Tick> {
        let at = self.position(value)?;
        (-1e-9..=1.0 + 1e-9).contains(&at).then_some(Tick { at, label })
    }

    fn linear_ticks(&self, most: usize) -> Vec<Tick> {
        let least = (self.hi / 2.0 - self.lo / 2.0) / most as f64 * 2.0;
        let ticks = self.multiples(Step::at_least(least));
        if ticks.is_empty() {
            // A step of 5 may jump over a range that two steps of 2 divide.
            return self.multiples(Step::at_least(0.5 * least));
        }
        ticks
    }

    /// The multiples of a step within the range.
    fn multiples(&self, step: Step) -> Vec<Tick> {
        let size = step.value();
        let (first, last) = ((self.lo / size - 1e-9).ceil() as i64, (self.hi / size + 1e-9).floor() as i64);
        let largest = self.lo.abs().max(self.hi.abs());
        (first..=last).filter_map(|i| self.tick(step.multiple(i), Some(step.label(i, largest)))).collect()
    }

    fn log_ticks(&self, most: usize) -> Vec<Tick> {
        let (a, b) = (self.lo.log10(), self.hi.log10());
        let (first, last) = ((a - 1e-9).ceil() as i32, (b + 1e-9).floor() as i32);
        if b - a >= WHOLE_DECADES {
            let decades = (last - first + 1).max(1) as usize;
            let stride = decades.div_ceil(most) as i32;
            let mut ticks = Vec::new();
            for k in first - 1..=last {
                let label = (k.rem_euclid(stride) == 0).then(|| power_of_ten(k));
                ticks.extend(self.tick(decimal(1, k), label));
                if stride == 1 {
                    ticks.extend((2..10).filter_map(|m| self.tick(decimal(m, k), None)));
                }
            }
            return ticks;
        }
        // Less than two decades: label the most of {1…9}, {1, 2, 5} or {1} times a power that fits.
        let labelled = |multiples: &[i64]| -> Vec<Tick> {
            let is_plain = self.lo >= 0.9e-3 && self.hi < LARGEST_PLAIN;
            (first - 1..=last)
                .flat_map(|k| (1..10).map(move |m| (m, k)))
                .filter_map(|(m, k)| {
                    let label = multiples.contains(&m).then(|| match (is_plain, m) {
                        (true, _) => format!("{}", decimal(m, k)),
                        (false, 1) => power_of_ten(k),
                        (false, _) => format!("{m}×{}", power_of_ten(k)),
                    });
                    self.tick(decimal(m, k), label)
                })
                .collect()
        };
        let labels = |ticks: &[Tick]| ticks.iter().filter(|t| t.label.is_some()).count();
        let choices: [&[i64]; 3] = [&[1, 2, 3, 4, 5, 6, 7, 8, 9], &[1, 2, 5], &[1]];
        choices
            .into_iter()
            .map(labelled)
            .find(|ticks| (2..=most).contains(&labels(ticks)))
            // Less than a third of a decade: no round multiple twice, so count evenly.
            .unwrap_or_else(|| self.linear_ticks(most))
    }
}

/// A step of 1, 2 or 5 times a power of ten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Step {
    digit: i64,
    exponent: i32,
}

impl Step {
    /// The smallest step that is not below `size` > 0.
    fn at_least(size: f64) -> Step {
        let exponent = size.log10().floor() as i32;
        let (digit, exponent) = [(1, exponent), (2, exponent), (5, exponent)]
            .into_iter()
            .find(|&(m, k)| decimal(m, k) >= size * (1.0 - 1e-9))
            .unwrap_or((1, exponent + 1));
        Step { digit, exponent }
    }

    fn value(self) -> f64 {
        decimal(self.digit, self.exponent)
    }

    /// `i` steps, to the nearest double: no sum of rounding errors.
    fn multiple(self, i: i64) -> f64 {
        decimal(i * self.digit, self.exponent)
    }

    /// The label of `i` steps on an axis whose numbers reach `largest` in size.
    fn label(self, i: i64, largest: f64) -> String {
        let value = self.multiple(i);
        if i == 0 {
            return "0".to_owned();
        }
        let text = if largest < LARGEST_PLAIN && self.value() >= FINEST_PLAIN_STEP {
            let decimals = (-self.exponent).max(0) as usize;
            format!("{value:.decimals$}")
        } else {
            // One power for the whole axis.
            let power = (largest.log10() + 1e-9).floor() as i32;
            let decimals = (power - self.exponent).max(0) as usize;
            let mantissa = value / decimal(1, power);
            format!("{mantissa:.decimals$}×{}", power_of_ten(power))
        };
        text.replace('-', "−")
    }
}

/// The double nearest to m·10ᵏ.
fn decimal(m: i64, k: i32) -> f64 {
    // A literal is rounded correctly, a product with a power is not.
    format!("{m}e{k}").parse().unwrap_or(f64::NAN)
}

/// `10⁻⁸` for −8.
pub(super) fn power_of_ten(exponent: i32) -> String {
    let superscript = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        // ⁴ to ⁹ stand in a row.
        _ => char::from_u32('⁴' as u32 + (c as u32 - '4' as u32)).unwrap_or(c),
    };
    let exponent = exponent.to_string();
    "10".chars().chain(exponent.chars().map(superscript)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(scale: Scale, range: (f64, f64), most: usize) -> Vec<String> {
        let ticks = Axis::over(scale, range).ticks(most);
        ticks.into_iter().filter_map(|t| t.label).collect()
    }

    #[test]
    fn powers_have_superscripts() {
        assert_eq!(power_of_ten(-8), "10⁻⁸");
        assert_eq!(power_of_ten(0), "10⁰");
        assert_eq!(power_of_ten(1234567890), "10¹²³⁴⁵⁶⁷⁸⁹⁰");
    }

    #[test]
    fn linear_labels_are_plain_decimals() {
        assert_eq!(labels(Scale::Linear, (0.0, 1.2), 8), ["0", "0.2", "0.4", "0.6", "0.8", "1.0", "1.2"]);
        assert_eq!(labels(Scale::Linear, (-1.0, 1.0), 5), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(labels(Scale::Linear, (3.0, 203.0), 5), ["50", "100", "150", "200"]);
        assert_eq!(labels(Scale::Linear, (0.98, 1.02), 5), ["0.98", "0.99", "1.00", "1.01", "1.02"]);
    }

    #[test]
    fn large_and_fine_linear_labels_share_a_power() {
        assert_eq!(labels(Scale::Linear, (0.0, 1_048_576.0), 4), ["0", "0.5×10⁶", "1.0×10⁶"]);
        assert_eq!(labels(Scale::Linear, (0.0, 4e-5), 5), ["0", "1×10⁻⁵", "2×10⁻⁵", "3×10⁻⁵", "4×10⁻⁵"]);
    }

    #[test]
    fn log_labels_are_powers_of_ten() {
        assert_eq!(
            labels(Scale::Log, (1e-8, 1.0), 9),
            ["10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]
        );
        assert_eq!(
            labels(Scale::Log, (1e-12, 1e6), 10),
            ["10⁻¹²", "10⁻¹⁰", "10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²", "10⁰", "10²", "10⁴", "10⁶"]
        );
    }

    #[test]
    fn short_log_ranges_label_multiples() {
        assert_eq!(labels(Scale::Log, (8.0, 300.0), 8), ["10", "20", "50", "100", "200"]);
        assert_eq!(labels(Scale::Log, (1.5e-6, 2.5e-5), 8), ["2×10⁻⁶", "5×10⁻⁶", "10⁻⁵", "2×10⁻⁵"]);
        assert_eq!(labels(Scale::Log, (0.32, 0.38), 4), ["0.32", "0.34", "0.36", "0.38"]);
    }

    #[test]
    fn ranges_fit_the_data() {
        let axis = |scale, values: &[f64]| {
            let axis = Axis::around(scale, values.iter().copied());
            (axis.lo, axis.hi)
        };
        assert_eq!(axis(Scale::Linear, &[0.0, 100.0]), (0.0, 103.0));
        assert_eq!(axis(Scale::Linear, &[-100.0, 100.0]), (-106.0, 106.0));
        let (lo, hi) = axis(Scale::Log, &[3e-12, 0.0, -1.0, f64::NAN, 2e5, f64::INFINITY]);
        assert!((lo / 1e-12 - 1.0).abs() < 1e-12 && (hi / 1e6 - 1.0).abs() < 1e-12);
        // A power of ten is an end of its own.
        let (lo, hi) = axis(Scale::Log, &[1e-10, 1.0]);
        assert!((lo / 1e-10 - 1.0).abs() < 1e-12 && (hi - 1.0).abs() < 1e-12);
        let (lo, hi) = axis(Scale::Linear, &[5.0]);
        assert!(lo < 5.0 && 5.0 < hi);
        // Rounding is not shown as if it were something.
        let (lo, hi) = axis(Scale::Linear, &[0.3, 0.1 + 0.2]);
        assert!(hi - lo > 0.01);
        assert_eq!(axis(Scale::Linear, &[1.0, 100.0, -1e306]), (0.0, 102.97));
        assert_eq!(axis(Scale::Log, &[-1.0, f64::NAN]), (0.1, 1.0));
    }

    #[test]
    fn margins_and_whole_ends_begin_where_they_say() {
        let axis = |scale, lo: f64, hi: f64| {
            let axis = Axis::around(scale, [lo, hi].into_iter());
            (axis.lo, axis.hi)
        };
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| {
            assert!((a - c).abs() < 1e-12 * b && (b - d).abs() < 1e-12 * b, "({a}, {b}) instead of ({c}, {d})");
        };
        // From 0 if the least is less than three tenths of the greatest.
        near(axis(Scale::Linear, 29.0, 100.0), (0.0, 100.0 + 0.03 * 71.0));
        near(axis(Scale::Linear, 31.0, 100.0), (31.0 - 0.03 * 69.0, 100.0 + 0.03 * 69.0));
        // Two decades end at powers of ten; less has a margin of a twentieth, of a decade at the least.
        near(axis(Scale::Log, 1.0, 100.0), (1.0, 100.0));
        near(axis(Scale::Log, 2.0, 250.0), (1.0, 1000.0));
        near(axis(Scale::Log, 2.0, 4.0), (2.0 * 10f64.powf(-0.05), 4.0 * 10f64.powf(0.05)));
        let decades = 50f64.log10();
        near(axis(Scale::Log, 1.0, 50.0), (10f64.powf(-0.05 * decades), 50.0 * 10f64.powf(0.05 * decades)));
    }

    #[test]
    fn what_has_no_place_is_dropped() {
        let axis = Axis::over(Scale::Log, (1e-4, 1.0));
        assert_eq!(axis.position(0.0), None);
        assert_eq!(axis.position(-1.0), None);
        assert_eq!(axis.position(f64::NAN), None);
        assert_eq!(axis.position(f64::INFINITY), None);
        assert!((axis.position(1e-2).unwrap() - 0.5).abs() < 1e-12);
        assert!(axis.position(1e-8).unwrap() < 0.0);
    }

    #[test]
    fn a_range_that_five_jumps_over_has_ticks() {
        for (lo, hi) in [(238.77, 238.77 + 4.4e8), (144.286, 144.286 + 4.74e5)] {
            assert!(!Axis::over(Scale::Linear, (lo, hi)).ticks(2).is_empty());
        }
    }

    proptest! {
        #[test]
        fn ticks_are_few_ordered_and_inside(
            lo in -300.0..300.0_f64,
            span in 1e-3..40.0_f64,
            most in 2..12_usize,
            log: bool,
        ) {
            let (scale, range) = if log {
                (Scale::Log, (10_f64.powf(lo / 2.0), 10_f64.powf(lo / 2.0 + span)))
            } else {
                (Scale::Linear, (lo, lo + 10_f64.powf(span - 20.0).max(lo.abs() * 1e-6)))
            };
            let ticks = Axis::over(scale, range).ticks(most);
            let count = ticks.iter().filter(|t| t.label.is_some()).count();
            prop_assert!((1..=most + 1).contains(&count), "{count} of {most}: {ticks:?}");
            prop_assert!(ticks.is_sorted_by(|a, b| a.at < b.at), "{ticks:?}");
            prop_assert!(ticks.iter().all(|t| (-1e-6..=1.0 + 1e-6).contains(&t.at)));
            let mut labels: Vec<_> = ticks.iter().filter_map(|t| t.label.as_ref()).collect();
            labels.sort();
            labels.dedup();
            prop_assert_eq!(labels.len(), count, "labels differ: {:?}", ticks);
        }
    }
}
