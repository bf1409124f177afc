//! Floating-point coordinates near one: an exact change of scale and origin of a set of points.
//!
//! Limits of subdivision surfaces are affine: A maps c + s·P' to c + s·(A P'), as its rows sum to 1. So everything may
//! be computed where squares of lengths neither overflow nor vanish, and where the last digits of the coordinates are
//! far below their differences.

use std::ops::Range;

use glam::DVec3;

use super::bounding_box;
use crate::parallel;

/// The largest coordinate of points that need no other scale: their squares, and those of a 10⁻³⁰th of them, are far
/// from the ends of the range of doubles.
const ORDINARY: Range<f64> = f64::from_bits((1023 - 100) << 52)..f64::from_bits((1023 + 100) << 52);
/// Points are taken from a centre where it is this many times as far as they reach. Nearer, rounding takes three
/// digits at most, and ordinary meshes stay as they are.
const FAR: f64 = 1024.0;

/// The change of coordinates P = c + s·P', s a power of two. For the points it was made of, [`there`](Self::there) is
/// exact: [`back`](Self::back) gives them again, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    centre: DVec3,
    scale: f64,
}

impl Frame {
    /// P = P': centre 0, scale 1.
    pub const IDENTITY: Frame = Frame { centre: DVec3::ZERO, scale: 1.0 };

    /// The frame in which finite `points` have an ordinary size and origin: the identity for most. O(n).
    ///
    /// The centre is not zero only along axes where it is far, and where all points lie between its half and its
    /// double: then p − c has no rounding error (Sterbenz 1974). The scale is 1 where coordinates are ordinary, else
    /// the largest power of two within them.
    ///
    /// # Errors
    /// The first point that would not be exact: a coordinate some 10³⁰⁰ times smaller than the largest.
    pub fn of(points: &[DVec3]) -> Result<Frame, usize> {
        let Some((lo, hi)) = bounding_box(points) else {
            return Ok(Frame::IDENTITY);
        };
        let reach = (0.5 * hi - 0.5 * lo).max_element();
        let centre = |axis: usize| {
            let (lo, hi) = (lo[axis], hi[axis]);
            let middle = 0.5 * lo + 0.5 * hi;
            let within = (0.5 * middle).min(2.0 * middle) <= lo && hi <= (0.5 * middle).max(2.0 * middle);
            if within && middle.abs() >= FAR * reach { middle } else { 0.0 }
        };
        Frame::around(DVec3::new(centre(0), centre(1), centre(2)), points, (lo, hi))
    }

    /// As [`of`](Self::of), without another origin: for data that are no places, whose sums need not stay where they are.
    ///
    /// # Errors
    /// As there.
    pub fn of_size(points: &[DVec3]) -> Result<Frame, usize> {
        bounding_box(points).map_or(Ok(Frame::IDENTITY), |ends| Frame::around(DVec3::ZERO, points, ends))
    }

    fn around(centre: DVec3, points: &[DVec3], (lo, hi): (DVec3, DVec3)) -> Result<Frame, usize> {
        let largest = (lo - centre).abs().max((hi - centre).abs()).max_element();
        let scale = if largest == 0.0 || ORDINARY.contains(&largest) { 1.0 } else { magnitude(largest) };
        let frame = Frame { centre, scale };
        if scale == 1.0 {
            return Ok(frame);
        }
        match parallel::find_first(points.len(), |v| frame.back(frame.there(points[v])) != points[v]) {
            None => Ok(frame),
            Some(vertex) => Err(vertex),
        }
    }

    /// Whether P = P': centre 0, scale 1.
    pub fn is_identity(&self) -> bool {
        *self == Frame::IDENTITY
    }

    /// s: lengths here are s times those in the frame.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// P' = (P − c)/s.
    pub fn there(&self, p: DVec3) -> DVec3 {
        (p - self.centre) / self.scale
    }

    /// P = c + s·P'.
    pub fn back(&self, p: DVec3) -> DVec3 {
        self.centre + self.scale * p
    }

    /// [`there`](Self::there) for all of `points`, in place; nothing is touched under the identity.
    pub fn enter(&self, points: &mut [DVec3]) {
        self.map(points, |p| self.there(p));
    }

    /// [`back`](Self::back) for all of `points`, in place; nothing is touched under the identity.
    pub fn leave(&self, points: &mut [DVec3]) {
        self.map(points, |p| self.back(p));
    }

    fn map(&self, points: &mut [DVec3], to: impl Fn(DVec3) -> DVec3 + Sync) {
        if !self.is_identity() {
            parallel::change(points, |_, p| *p = to(*p));
        }
    }
}

/// The largest power of two that is no larger than a positive, finite `x`; at least the smallest normal number, so
/// that it divides without rounding.
pub(crate) fn magnitude(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits(x.to_bits() & EXPONENT).max(f64::MIN_POSITIVE)
}

/// `v` with a largest coordinate between one and two, exactly; zero stays.
pub(crate) fn of_order_one(v: DVec3) -> DVec3 {
    v / magnitude(v.abs().max_element())
}

/// `v` of length one, however long or short it is; `None` for zero and for what is not finite.
pub(crate) fn direction(v: DVec3) -> Option<DVec3> {
    (v != DVec3::ZERO && v.is_finite()).then(|| of_order_one(v).normalize())
}

/// The distance of two points, which no square beyond the range of doubles spoils.
pub(crate) fn distance(a: DVec3, b: DVec3) -> f64 {
    let scale = magnitude(a.abs().max(b.abs()).max_element());
    scale * (a / scale).distance(b / scale)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn exact(frame: &Frame, points: &[DVec3]) {
        for &p in points {
            assert_eq!(frame.back(frame.there(p)), p, "{frame:?}");
        }
    }

    #[test]
    fn ordinary_points_stay_as_they_are() {
        let points = |size: f64, at: DVec3| [at, at + size * DVec3::X, at + size * DVec3::new(-0.3, 0.7, 0.5)];
        for (size, at) in [(1.0, DVec3::ZERO), (1e-12, DVec3::ZERO), (1e20, DVec3::ZERO), (1.0, DVec3::splat(5e2))] {
            assert_eq!(Frame::of(&points(size, at)), Ok(Frame::IDENTITY), "{size:e} at {at}");
        }
        assert_eq!(Frame::of(&[]), Ok(Frame::IDENTITY));
        assert_eq!(Frame::of(&[DVec3::ZERO]), Ok(Frame::IDENTITY));
    }

    #[test]
    fn far_axes_alone_are_centred() {
        let points = [DVec3::new(1e7, 0.0, -5e6), DVec3::new(1e7 + 1.0, 1.0, -5e6)];
        let frame = Frame::of(&points).unwrap();
        assert_eq!(frame.scale(), 1.0);
        assert_eq!(points.map(|p| frame.there(p)), [DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.5, 1.0, 0.0)]);
        exact(&frame, &points);
        // A wall as wide as it is far away.
        let wide = [DVec3::new(1e7, 0.0, 0.0), DVec3::new(1e7, 1e7, 1.0)];
        assert_eq!(Frame::of(&wide), Ok(Frame::IDENTITY));
        // One point only: the centre.
        let single = [DVec3::new(1e300, 1e-300, 0.0)];
        let frame = Frame::of(&single).unwrap();
        assert_eq!(frame.there(single[0]), DVec3::ZERO);
    }

    #[test]
    fn a_span_beyond_doubles_names_the_first_point_lost() {
        let points = [DVec3::X * 1e200, DVec3::ZERO, DVec3::Y * 1e-200, DVec3::Y * 1.5e-200];
        assert_eq!(Frame::of(&points), Err(2));
        // Beside ordinary sizes nothing is lost, whatever is small.
        assert_eq!(Frame::of(&[DVec3::X, DVec3::Y * 1e-300]), Ok(Frame::IDENTITY));
    }

    #[test]
    fn directions_do_not_depend_on_length() {
        let unit = direction(DVec3::new(1.0, -2.0, 3.0)).unwrap();
        assert_eq!(unit, DVec3::new(1.0, -2.0, 3.0).normalize());
        for power in [-1000, -500, 500, 1000] {
            assert_eq!(direction(2f64.powi(power) * DVec3::new(1.0, -2.0, 3.0)), Some(unit), "2^{power}");
        }
        assert!(direction(DVec3::splat(5e-324)).unwrap().distance(DVec3::splat(1.0 / 3f64.sqrt())) < 1e-15);
        assert_eq!(direction(f64::MAX * DVec3::X), Some(DVec3::X));
        for none in [DVec3::ZERO, DVec3::X * f64::INFINITY, DVec3::new(1.0, f64::NAN, 0.0)] {
            assert_eq!(direction(none), None);
        }
    }

    proptest! {
        /// Every frame gives its points again, and its points are of order one or untouched.
        #[test]
        fn there_and_back_is_exact(
            power in -1060i32..1000,
            // Of the offset against the size, a power of two, by axis.
            far in [-5i32..50, -5i32..50, -5i32..50],
            points in prop::collection::vec([-1.0f64..1.0, -1.0..1.0, -1.0..1.0], 1..20),
        ) {
            let size = 2f64.powi(power / 2) * 2f64.powi(power - power / 2);
            let at = DVec3::from(far.map(|k| 2f64.powi(k) - 2f64.powi(-5)));
            let points: Vec<DVec3> = points.into_iter().map(|p| size * (at + DVec3::from(p))).collect();
            prop_assume!(points.iter().all(|p| p.is_finite()));
            if let Ok(frame) = Frame::of(&points) {
                for &p in &points {
                    prop_assert_eq!(frame.back(frame.there(p)), p);
                    let largest = frame.there(p).abs().max_element();
                    prop_assert!(frame.scale() == 1.0 && largest < ORDINARY.end || largest < 2.0);
                }
                // In their frame the points are ordinary. (Where they differ by their last digit alone, what is left of
                // them has a centre of its own.)
                let again: Vec<DVec3> = points.iter().map(|&p| frame.there(p)).collect();
                let second = Frame::of(&again);
                prop_assert!(second.is_ok());
                for (frame, p) in second.iter().flat_map(|frame| again.iter().map(move |&p| (frame, p))) {
                    prop_assert_eq!(frame.back(frame.there(p)), p);
                }
            }
        }
    }
}
