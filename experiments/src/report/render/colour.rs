//! Colour maps in which equal steps of the data look like equal steps, and the scales that assign them.

use super::super::axis::{Axis, Scale};
use super::super::canvas::Colour;
use limitlab::{Error, Result};

/// Colours from the least number to the greatest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark violet to yellow, ever lighter: magnitudes. Through ten colours of matplotlib's viridis (van der Walt
    /// and Smith 2015).
    #[default]
    Sequential,
    /// Blue through light grey to red, both ends equally dark: signed data on a range that is symmetric about 0.
    /// Through the ends and the middle of Moreland's map (2009).
    Diverging,
}

/// Colours a map is tabulated at.
pub(super) const STEPS: usize = 256;

const VIRIDIS: [[u8; 3]; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [109, 205, 89],
    [180, 222, 44],
    [253, 231, 37],
];

const BLUE_RED: [[u8; 3]; 3] = [[59, 76, 192], [221, 221, 221], [180, 4, 38]];

impl ColourMap {
    /// The colour at `t` from 0 to 1: linear between control points in Oklab (Ottosson 2020), where distances
    /// are about as large as they look. Outside, the colour of the nearer end.
    pub fn colour(self, t: f64) -> Colour {
        let points: &[[u8; 3]] = match self {
            ColourMap::Sequential => &VIRIDIS,
            ColourMap::Diverging => &BLUE_RED,
        };
        let at = t.clamp(0.0, 1.0) * (points.len() - 1) as f64;
        let piece = (at as usize).min(points.len() - 2);
        let part = at - piece as f64;
        let (a, b) = (oklab(points[piece]), oklab(points[piece + 1]));
        let between: [f64; 3] = std::array::from_fn(|k| a[k] + part * (b[k] - a[k]));
        let [r, g, b] = from_oklab(between);
        Colour(r, g, b)
    }

    /// The map at [`STEPS`] equal steps.
    pub(super) fn table(self) -> Vec<Colour> {
        (0..STEPS).map(|i| self.colour(i as f64 / (STEPS - 1) as f64)).collect()
    }
}

/// Lightness, green to red, blue to yellow.
fn oklab(rgb: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(|c| {
        let c = f64::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
    let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
    let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

fn from_oklab([lightness, a, b]: [f64; 3]) -> [u8; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ];
    linear.map(|c| {
        let c = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (255.0 * c).round() as u8 // saturates
    })
}

/// Numbers to colours, with the label of their colour bar.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourScale {
    pub label: String,
    pub map: ColourMap,
    pub scale: Scale,
    /// What the ends of the map stand for; numbers beyond have the colour of the end.
    pub range: (f64, f64),
}

impl ColourScale {
    /// Magnitudes on a linear scale.
    pub fn linear(label: impl Into<String>, range: (f64, f64)) -> Self {
        ColourScale { label: label.into(), map: ColourMap::Sequential, scale: Scale::Linear, range }
    }

    /// Magnitudes on a logarithmic scale, where 0 has the colour of the least.
    pub fn logarithmic(label: impl Into<String>, range: (f64, f64)) -> Self {
        ColourScale { scale: Scale::Log, ..ColourScale::linear(label, range) }
    }

    /// Signed numbers from −`size` to `size`.
    pub fn signed(label: impl Into<String>, size: f64) -> Self {
        ColourScale { map: ColourMap::Diverging, ..ColourScale::linear(label, (-size, size)) }
    }

    /// Where numbers lie on the scale, from 0 to 1. What has no place on a logarithmic axis is below all that has.
    ///
    /// # Errors
    /// A range that is empty, not finite, or reaches 0 on a logarithmic scale.
    pub(super) fn place(&self) -> Result<impl Fn(f64) -> f64> {
        let axis = self.axis()?;
        Ok(move |value| axis.position(value).unwrap_or(0.0).clamp(0.0, 1.0))
    }

    /// The colours of numbers, red, green and blue each, as a picture shows them without light.
    ///
    /// # Errors
    /// As a picture with this scale.
    pub fn colours(&self, values: &[f64]) -> Result<Vec<[u8; 3]>> {
        let place = self.place()?;
        let colour = |&value: &f64| {
            let Colour(r, g, b) = self.map.colour(place(value));
            [r, g, b]
        };
        Ok(values.iter().map(colour).collect())
    }

    /// The axis of the colour bar.
    ///
    /// # Errors
    /// A range that is empty, not finite, or reaches 0 on a logarithmic scale.
    pub(super) fn axis(&self) -> Result<Axis> {
        let (lo, hi) = self.range;
        let is_range = lo.is_finite() && hi.is_finite() && lo < hi;
        if !is_range || (self.scale == Scale::Log && lo <= 0.0) {
            return Err(Error::Computation(format!(
                "the colours of \"{}\" cannot run from {lo} to {hi}: give a finite range with lo < hi, above 0 on a \
                 logarithmic scale",
                self.label
            )));
        }
        Ok(Axis::over(self.scale, self.range))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lab(Colour(r, g, b): Colour) -> [f64; 3] {
        oklab([r, g, b])
    }

    #[test]
    fn oklab_of_white_and_back() {
        let white = oklab([255; 3]);
        assert!((white[0] - 1.0).abs() < 1e-6 && white[1].abs() < 1e-6 && white[2].abs() < 1e-6);
        for rgb in [[0, 0, 0], [12, 200, 77], [255, 0, 1], [128, 128, 128]] {
            assert_eq!(from_oklab(oklab(rgb)), rgb);
        }
    }

    #[test]
    fn sequential_steps_look_equal_and_get_lighter() {
        let table = ColourMap::Sequential.table();
        assert_eq!((table[0], table[STEPS - 1]), (Colour(68, 1, 84), Colour(253, 231, 37)));
        // Over sixteenths of the map, wide enough that rounding to whole bytes does not count.
        let colours: Vec<[f64; 3]> = (0..=16).map(|i| lab(ColourMap::Sequential.colour(f64::from(i) / 16.0))).collect();
        let steps: Vec<f64> = colours
            .windows(2)
            .map(|w| {
                assert!(w[1][0] > w[0][0] + 0.02, "lighter by a visible step");
                (0..3).map(|k| (w[1][k] - w[0][k]).powi(2)).sum::<f64>().sqrt()
            })
            .collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        assert!(steps.iter().all(|s| (0.6..1.6).contains(&(s / mean))), "{steps:?}");
    }

    #[test]
    fn diverging_ends_are_equally_dark_about_a_light_middle() {
        let at = |t| lab(ColourMap::Diverging.colour(t));
        assert_eq!(ColourMap::Diverging.colour(0.5), Colour(221, 221, 221));
        assert!((at(0.0)[0] - at(1.0)[0]).abs() < 0.03);
        for i in 0..8 {
            let (a, b) = (f64::from(i) / 16.0, f64::from(i + 1) / 16.0);
            assert!(at(a)[0] < at(b)[0] && at(1.0 - a)[0] < at(1.0 - b)[0]);
        }
    }

    #[test]
    fn beyond_the_ends_is_the_end() {
        for map in [ColourMap::Sequential, ColourMap::Diverging] {
            assert_eq!(map.colour(-3.0), map.colour(0.0));
            assert_eq!(map.colour(7.0), map.colour(1.0));
        }
    }

    #[test]
    fn colours_of_numbers_are_those_of_their_places() {
        let [low, middle, high] = [0.0, 0.5, 1.0].map(|t| {
            let Colour(r, g, b) = ColourMap::Sequential.colour(t);
            [r, g, b]
        });
        let scale = ColourScale::logarithmic("a", (1e-4, 1.0));
        assert_eq!(scale.colours(&[0.0, 1e-9, 1e-4, 1e-2, 1.0, 7.0]).unwrap(), [low, low, low, middle, high, high]);
        assert_eq!(ColourScale::signed("a", 2.0).colours(&[0.0]).unwrap(), [[221; 3]]);
    }

    #[test]
    fn ranges_without_numbers_are_refused() {
        for scale in [
            ColourScale::linear("a", (1.0, 1.0)),
            ColourScale::linear("a", (0.0, f64::NAN)),
            ColourScale::logarithmic("a", (0.0, 1.0)),
            ColourScale::signed("a", 0.0),
        ] {
            let message = scale.axis().expect_err("no range").to_string();
            assert!(message.contains("the colours of \"a\""), "{message}");
        }
        assert!(ColourScale::logarithmic("a", (1e-9, 1.0)).axis().is_ok());
    }
}
