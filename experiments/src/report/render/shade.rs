//! Shading: the colour of a pixel from a normal and a colour.
//!
//! Everything is in the camera's axes (x right, y up, z to the eye) and treats the line of sight as z. The constants
//! are tuned by eye; the key light grazes what faces the eye, because that is where ripples hide.

use std::f64::consts::PI;

use glam::DVec3;

use super::Finish;
use crate::report::canvas::Colour;

/// Directions to the lights; made unit vectors where used.
const KEY: DVec3 = DVec3::new(-0.52, 0.60, 0.61);
const FILL: DVec3 = DVec3::new(0.70, -0.35, 0.62);

const AMBIENT: f64 = 0.36;
const KEY_STRENGTH: f64 = 0.74;
const FILL_STRENGTH: f64 = 0.20;
const HIGHLIGHT: f64 = 0.26;
const SHININESS: i32 = 48;

/// Facing the eye by less than this, a surface darkens towards its rim, down to this part.
const RIM_WIDTH: f64 = 0.35;
const RIM_DARKEST: f64 = 0.55;

/// A painted surface keeps at least this part of its colour, so that the colour bar can be read off it.
const PAINT_DARKEST: f64 = 0.62;

/// Strips of light, all horizontal, from straight below to straight above.
const STRIPS: f64 = 19.0;

/// The colour under light, of a place whose unit normal `n` is turned to the eye's side.
pub(super) fn shade(n: DVec3, colour: Colour, finish: Finish, is_scale: bool) -> [u8; 3] {
    let rim = (n.z / RIM_WIDTH).clamp(0.0, 1.0);
    let rim = RIM_DARKEST + (1.0 - RIM_DARKEST) * rim * (2.0 - rim);
    let key = KEY.normalize();
    let diffuse = AMBIENT + KEY_STRENGTH * n.dot(key).max(0.0) + FILL_STRENGTH * n.dot(FILL.normalize()).max(0.0);
    let (strength, highlight) = match finish {
        Finish::Matte if is_scale => {
            let lit = PAINT_DARKEST + (1.0 - PAINT_DARKEST) * (diffuse * rim).min(1.0);
            (lit, 0.0)
        }
        Finish::Matte => {
            let half = (key + DVec3::Z).normalize();
            (diffuse * rim, HIGHLIGHT * n.dot(half).max(0.0).powi(SHININESS))
        }
        Finish::ReflectionLines => {
            // How steeply the reflected line of sight rises.
            let reflected = 2.0 * n.z * n - DVec3::Z;
            let rise = reflected.y.clamp(-1.0, 1.0).asin() / PI;
            let is_bright = (STRIPS * rise).rem_euclid(2.0) < 1.0;
            (if is_bright { 1.08 } else { 0.28 } * rim, 0.0)
        }
    };
    let Colour(r, g, b) = colour;
    [r, g, b].map(|c| {
        let c = f64::from(c) * strength;
        (c + (255.0 - c) * highlight).round() as u8 // saturates
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: Colour = Colour(150, 150, 150);

    #[test]
    fn what_faces_the_key_light_is_brightest() {
        let at = |n: DVec3| shade(n.normalize(), GREY, Finish::Matte, false)[0];
        let lit = at(KEY);
        for n in [DVec3::Z, DVec3::new(0.5, -0.5, 0.7), DVec3::new(0.9, 0.0, 0.1)] {
            assert!(at(n) < lit, "{n}");
        }
        // A ripple of two degrees on what faces the eye shows in whole steps of grey.
        let tilt = 2.0_f64.to_radians();
        let (up, down) = (at(DVec3::new(0.0, tilt, 1.0)), at(DVec3::new(0.0, -tilt, 1.0)));
        assert!(up >= down + 3, "{up} {down}");
    }

    #[test]
    fn paint_stays_near_its_colour_bar() {
        for n in [DVec3::Z, KEY, DVec3::new(0.0, -1.0, 0.05)] {
            let shown = shade(n.normalize(), Colour(200, 100, 50), Finish::Matte, true);
            for (c, full) in shown.into_iter().zip([200.0, 100.0, 50.0]) {
                let part = f64::from(c) / full;
                assert!((PAINT_DARKEST - 0.01..=1.0).contains(&part), "{n} {part}");
            }
        }
    }

    #[test]
    fn reflection_lines_alternate() {
        let at = |degrees: f64| {
            let (y, z) = degrees.to_radians().sin_cos();
            shade(DVec3::new(0.0, y, z), GREY, Finish::ReflectionLines, false)[0] > 100
        };
        // The reflection turns twice as fast as the normal: a strip is 180/STRIPS/2 degrees wide.
        let width = 90.0 / STRIPS;
        assert!(at(0.5 * width) && !at(1.5 * width) && at(2.5 * width));
        assert!(!at(-0.5 * width) && at(-1.5 * width));
    }
}
