//! Projection to the image plane: views by name or by angles, orthographic and perspective, framing of given points.

use glam::DVec3;

use limitlab::{Error, Result};

/// How lines of sight run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All parallel: lengths across the line of sight are true everywhere.
    Orthographic,
    /// Through one point, the picture's shorter side seen under this angle, in degrees between 0 and 180.
    Perspective { angle: f64 },
}

/// Where the eye looks from; how far it stands follows from what is framed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From what is seen to the eye, of any length.
    pub toward_eye: DVec3,
    /// What points upward in the picture, as far as it is across the line of sight.
    pub up: DVec3,
    pub projection: Projection,
}

/// Names of views, with the azimuth and the elevation of the eye in degrees.
const NAMES: [(&str, f64, f64); 7] = [
    ("front", 0.0, 0.0),
    ("back", 180.0, 0.0),
    ("left", -90.0, 0.0),
    ("right", 90.0, 0.0),
    ("top", 0.0, 90.0),
    ("bottom", 0.0, -90.0),
    ("oblique", 30.0, 25.0),
];

impl View {
    /// The eye at `azimuth` degrees around the axis `up`, counter-clockwise from the front, and `elevation` degrees
    /// above the horizon; orthographic. The front is the side of +z, or of −y if `up` is nearer to the z axis.
    pub fn around(up: DVec3, azimuth: f64, elevation: f64) -> Self {
        let up = up.normalize_or(DVec3::Y);
        let front = if up.z.abs() > up.y.abs() { DVec3::NEG_Y } else { DVec3::Z };
        let front = front.reject_from_normalized(up).normalize_or(DVec3::X);
        let side = up.cross(front);
        let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation.to_radians().sin_cos();
        let horizontal = cos_a * front + sin_a * side;
        View {
            toward_eye: cos_e * horizontal + sin_e * up,
            up: cos_e * up - sin_e * horizontal,
            projection: Projection::Orthographic,
        }
    }

    /// A view by name, with y upward: `front`, `back`, `left`, `right`, `top`, `bottom`, `oblique`.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another name.
    pub fn named(name: &str) -> Result<Self> {
        let found = NAMES.iter().find(|(known, _, _)| *known == name);
        found.map(|&(_, azimuth, elevation)| View::around(DVec3::Y, azimuth, elevation)).ok_or_else(|| {
            let known = NAMES.map(|(name, _, _)| name).join(", ");
            Error::Unknown(format!("unknown view \"{name}\": choose one of {known}"))
        })
    }

    /// The same view with this perspective angle, in degrees.
    pub fn perspective(mut self, angle: f64) -> Self {
        self.projection = Projection::Perspective { angle };
        self
    }
}

/// A place in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projected {
    /// Pixels from the left edge.
    pub x: f64,
    /// Pixels from the top edge.
    pub y: f64,
    /// How far from the eye, as a number that is linear across the picture of a plane and grows with distance.
    pub depth: f64,
    /// What makes attributes linear across the picture: 1, or one over the distance from the eye.
    pub weight: f64,
}

/// A view that frames something in a picture of given size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    right: DVec3,
    up: DVec3,
    /// From what is seen to the eye.
    back: DVec3,
    /// The point on the line of sight through the middle of the picture, along `right` and `up`.
    centre: (f64, f64),
    /// Where the eye stands along `back`; for parallel lines of sight only an origin of depths.
    eye: f64,
    /// Pixels a unit of length (at distance 1 in perspective).
    scale: f64,
    is_perspective: bool,
    middle: (f64, f64),
}

/// The part of the picture that is left free on each side.
const MARGIN: f64 = 0.03;

impl Camera {
    /// The camera nearest to all `points` that shows every one of them in `width`×`height` pixels.
    ///
    /// # Errors
    /// No points, one that is not finite, a direction of view without length, an angle out of its range.
    pub fn framing(view: &View, points: &[DVec3], (width, height): (u32, u32)) -> Result<Self> {
        let refuse = |what: String| Err(Error::Computation(format!("cannot place the camera: {what}")));
        let back = view.toward_eye.normalize_or_zero();
        let up = view.up.reject_from(back).normalize_or_zero();
        if !back.is_normalized() || !up.is_normalized() {
            return refuse(format!(
                "the eye in direction {} with {} upward is no view; give two finite directions that are not parallel",
                view.toward_eye, view.up
            ));
        }
        let right = up.cross(back);
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            return refuse(format!("point {i} is not finite: {}", points[i]));
        }
        if points.is_empty() {
            return refuse("there are no points to show".into());
        }
        let (half_width, half_height) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        let tangent = match view.projection {
            Projection::Orthographic => 0.0,
            Projection::Perspective { angle } if angle > 0.0 && angle < 180.0 => (angle / 2.0).to_radians().tan(),
            Projection::Perspective { angle } => {
                return refuse(format!("a perspective of {angle} degrees; it must lie between 0 and 180"));
            }
        };
        // Tangents of the half angles within the margin.
        let shown = 1.0 - 2.0 * MARGIN;
        let shorter = half_width.min(half_height);
        let reach = (shown * tangent * half_width / shorter, shown * tangent * half_height / shorter);
        // The planes through the sides of the picture touch the points: with the eye at (c, e), |x − c| ≤ (e − z)t
        // is c + et ≥ x + zt and et − c ≥ zt − x.
        let mut bounds = [f64::NEG_INFINITY; 4];
        let mut nearest = f64::NEG_INFINITY;
        let mut farthest = f64::INFINITY;
        for p in points {
            let (x, y, z) = (p.dot(right), p.dot(up), p.dot(back));
            let ends = [x + reach.0 * z, reach.0 * z - x, y + reach.1 * z, reach.1 * z - y];
            for (bound, end) in bounds.iter_mut().zip(ends) {
                *bound = bound.max(end);
            }
            nearest = nearest.max(z);
            farthest = farthest.min(z);
        }
        let centre = ((bounds[0] - bounds[1]) / 2.0, (bounds[2] - bounds[3]) / 2.0);
        let half = ((bounds[0] + bounds[1]) / 2.0, (bounds[2] + bounds[3]) / 2.0);
        // A single point, or points along one line of sight, have no size of their own.
        let size = |extent: f64| if extent > 0.0 { extent } else { 1.0 };
        let deep = size(nearest - farthest);
        let camera = Camera {
            right,
            up,
            back,
            centre,
            eye: 0.0,
            scale: 0.0,
            is_perspective: tangent > 0.0,
            middle: (half_width, half_height),
        };
        if camera.is_perspective {
            let eye = (half.0 / reach.0).max(half.1 / reach.1);
            Ok(Camera { eye: eye.max(nearest + 1e-3 * deep), scale: shorter / tangent, ..camera })
        } else {
            let scale = shown * (half_width / half.0.max(0.0)).min(half_height / half.1.max(0.0));
            Ok(Camera { eye: nearest, scale: if scale.is_finite() { scale } else { shown * shorter / deep }, ..camera })
        }
    }

    /// Where `p` is seen; `None` at the eye and behind it.
    pub fn project(&self, p: DVec3) -> Option<Projected> {
        let (x, y) = (p.dot(self.right) - self.centre.0, p.dot(self.up) - self.centre.1);
        let distance = self.eye - p.dot(self.back);
        let (weight, depth) = if self.is_perspective {
            if distance <= 0.0 {
                return None;
            }
            (1.0 / distance, -1.0 / distance)
        } else {
            (1.0, distance)
        };
        Some(Projected {
            x: self.middle.0 + self.scale * weight * x,
            y: self.middle.1 - self.scale * weight * y,
            depth,
            weight,
        })
    }

    /// `direction` with x to the right, y upward, z to the eye.
    pub fn turned(&self, direction: DVec3) -> DVec3 {
        DVec3::new(direction.dot(self.right), direction.dot(self.up), direction.dot(self.back))
    }

    /// The length of a pixel at the place of weight `weight`.
    pub fn pixel_length(&self, weight: f64) -> f64 {
        1.0 / (self.scale * weight)
    }

    /// By how much a depth falls where something comes nearer by `length`, to first order.
    pub fn nearer(&self, weight: f64, length: f64) -> f64 {
        if self.is_perspective { length * weight * weight } else { length }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: (u32, u32) = (300, 200);

    fn cube() -> Vec<DVec3> {
        (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect()
    }

    #[test]
    fn the_front_view_looks_along_minus_z() {
        let view = View::named("front").unwrap();
        let camera = Camera::framing(&view, &cube(), SIZE).unwrap();
        let scale = 200.0 * (1.0 - 2.0 * MARGIN);
        let near = camera.project(DVec3::new(1.0, 1.0, 1.0)).unwrap();
        let far = camera.project(DVec3::new(0.0, 0.0, 0.0)).unwrap();
        // y = 1 at the top, x = 1 to the right of the middle; z = 1 is nearer by one unit.
        assert!((near.x - (150.0 + scale / 2.0)).abs() < 1e-9, "{near:?}");
        assert!((near.y - (100.0 - scale / 2.0)).abs() < 1e-9, "{near:?}");
        assert!((far.x - (150.0 - scale / 2.0)).abs() < 1e-9, "{far:?}");
        assert!((far.depth - near.depth - 1.0).abs() < 1e-12);
        assert!((camera.pixel_length(1.0) * scale - 1.0).abs() < 1e-12);
    }

    #[test]
    fn named_views_look_from_where_they_say() {
        let toward = |name| View::named(name).unwrap().toward_eye;
        for (name, eye) in [
            ("front", DVec3::Z),
            ("back", DVec3::NEG_Z),
            ("left", DVec3::NEG_X),
            ("right", DVec3::X),
            ("top", DVec3::Y),
            ("bottom", DVec3::NEG_Y),
        ] {
            assert!((toward(name) - eye).length() < 1e-12, "{name}");
        }
        assert!(toward("oblique").min_element() > 0.0);
        let error = View::named("nowhere").unwrap_err().to_string();
        assert!(error.contains("front, back") && !error.contains('\n'), "{error}");
        // Blender's way: z upward, the front at −y, the right at +x.
        let front = View::around(DVec3::Z, 0.0, 0.0).toward_eye;
        assert!((front - DVec3::NEG_Y).length() < 1e-12);
        assert!((View::around(DVec3::Z, 90.0, 0.0).toward_eye - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn perspective_divides_by_the_distance() {
        // A square of side 2 at z = 0, the eye on the z axis, 90° over 200 pixels: within the margin the half
        // height 1 is seen under tan = 0.94, so the eye is at 1/0.94 and a unit there is 100·0.94 pixels.
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let view = View::named("front").unwrap().perspective(90.0);
        let camera = Camera::framing(&view, &square, (200, 200)).unwrap();
        let shown = 1.0 - 2.0 * MARGIN;
        let corner = camera.project(square[2]).unwrap();
        assert!((corner.x - (100.0 + 100.0 * shown)).abs() < 1e-9, "{corner:?}");
        assert!((corner.weight - shown).abs() < 1e-12);
        // Twice as far, half as large.
        let far = camera.project(DVec3::new(1.0, 0.0, -1.0 / shown)).unwrap();
        assert!((far.x - (100.0 + 50.0 * shown)).abs() < 1e-9, "{far:?}");
        assert!(far.depth > corner.depth);
        assert_eq!(camera.project(DVec3::new(0.0, 0.0, 1.0 / shown + 1e-9)), None);
        // The step of depth for a step of length, against a difference quotient.
        let step = 1e-6;
        let nearer = camera.project(DVec3::new(0.0, 0.0, step)).unwrap();
        let here = camera.project(DVec3::ZERO).unwrap();
        let quotient = (here.depth - nearer.depth) / step;
        assert!((camera.nearer(here.weight, 1.0) / quotient - 1.0).abs() < 1e-5);
    }

    #[test]
    fn nothing_to_frame_is_an_error() {
        let view = View::named("front").unwrap();
        let message = |view: &View, points: &[DVec3]| Camera::framing(view, points, SIZE).unwrap_err().to_string();
        assert!(message(&view, &[]).contains("no points"));
        let broken = [DVec3::ZERO, DVec3::new(0.0, f64::NAN, 0.0)];
        assert!(message(&view, &broken).contains("point 1 is not finite"));
        assert!(message(&view.perspective(180.0), &cube()).contains("180 degrees"));
        let along = View { up: 2.0 * view.toward_eye, ..view };
        assert!(message(&along, &cube()).contains("not parallel"));
        // A single point is in the middle.
        for view in [view, view.perspective(40.0)] {
            let camera = Camera::framing(&view, &[DVec3::ONE], SIZE).unwrap();
            let seen = camera.project(DVec3::ONE).unwrap();
            assert_eq!((seen.x, seen.y), (150.0, 100.0));
        }
    }

    proptest! {
        #[test]
        fn framing_shows_all_points_and_wastes_nothing(
            points in prop::collection::vec(prop::array::uniform3(-50.0..50.0_f64), 4..40),
            azimuth in -180.0..180.0_f64,
            elevation in -90.0..90.0_f64,
            angle in prop::option::of(5.0..120.0_f64),
        ) {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
            let mut view = View::around(DVec3::Y, azimuth, elevation);
            if let Some(angle) = angle {
                view = view.perspective(angle);
            }
            let camera = Camera::framing(&view, &points, SIZE).unwrap();
            let (w, h) = (f64::from(SIZE.0), f64::from(SIZE.1));
            let (mut widest, mut highest) = (0.0_f64, 0.0_f64);
            for &p in &points {
                let seen = camera.project(p).expect("in front of the eye");
                widest = widest.max((seen.x - w / 2.0).abs());
                highest = highest.max((seen.y - h / 2.0).abs());
            }
            let shown = 1.0 - 2.0 * MARGIN;
            prop_assert!(widest <= shown * w / 2.0 + 1e-6 && highest <= shown * h / 2.0 + 1e-6);
            // One direction is full to the margin, unless the eye was kept off the nearest point.
            let full = widest > shown * w / 2.0 - 1e-3 || highest > shown * h / 2.0 - 1e-3;
            prop_assert!(full || angle.is_some());
        }
    }
}
