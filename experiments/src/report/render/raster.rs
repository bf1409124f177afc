//! Rasterisation: the triangle, ball or line that is seen in every pixel.
//!
//! Corners lie on a grid of 1/256 pixel, so that the coverage of a pixel's centre is decided exactly in integers:
//! triangles that share an edge neither leave a gap nor draw a pixel twice (a centre on an edge belongs to the
//! triangle to the right of it or below). Of what covers a centre the nearest is seen, of equals the first.
//!
//! Bands of rows are independent. A band first notes the nearest triangle of each pixel, and of some rows beyond;
//! shades each pixel once; then draws lines. A point of a line is hidden if all nine pixels around it show
//! something nearer by more than an offset; a pixel within the line's width has the line's colour if the nearest
//! point of the line is not hidden, so that lines have their full width along silhouettes.

use glam::DVec3;
use rayon::prelude::*;

use super::scene::{Ball, Dye, GRID, Scene, Segment, Triangle, Vertex};
use super::shade::shade;
use crate::report::canvas::Colour;
use crate::report::png::Image;

/// Rows of a band.
const BAND: usize = 64;

pub(super) const BACKGROUND: u8 = 255;

/// Nothing is seen here.
const NOTHING: u32 = u32::MAX;

/// Draws the scene on white. Time: vertices + triangles + pixels; memory beside the scene and the image: two
/// numbers a triangle, one band of depths a thread.
pub(super) fn draw(scene: &Scene, width: u32, height: u32) -> Image {
    let (columns, rows) = (width as usize, height as usize);
    let mut rgb = vec![BACKGROUND; 3 * columns * rows];
    let widest = scene.segments.iter().map(|s| s.half_width).fold(0.0, f64::max);
    // The point of a line that a pixel asks for is so far away, and asks its own neighbours.
    let halo = if scene.segments.is_empty() { 0 } else { widest.ceil() as usize + 2 };
    let bands = rows.div_ceil(BAND);
    let reach = halo as f64;
    let triangles = Bins::new(bands, scene.triangles.len(), |t| {
        let y = scene.triangles[t].corners.map(|v| scene.vertices[v as usize].y as f64 / GRID as f64);
        let (lo, hi) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
        (lo - reach, hi + reach)
    });
    let balls = Bins::new(bands, scene.balls.len(), |b| {
        let ball = &scene.balls[b];
        (ball.y - ball.radius - reach, ball.y + ball.radius + reach)
    });
    let segments = Bins::new(bands, scene.segments.len(), |s| {
        let Segment { ends: [a, b], half_width, .. } = scene.segments[s];
        (a.y.min(b.y) - half_width, a.y.max(b.y) + half_width)
    });
    rgb.par_chunks_mut(3 * columns * BAND).enumerate().for_each(|(index, pixels)| {
        let first = index * BAND;
        let top = first.saturating_sub(halo);
        let bottom = (first + BAND + halo).min(rows);
        let mut band = Band {
            columns,
            rows,
            top,
            bottom,
            depths: vec![f64::INFINITY; columns * (bottom - top)],
            seen: vec![NOTHING; columns * (bottom - top)],
        };
        for &t in triangles.of(index) {
            let corners = scene.triangles[t as usize].corners;
            band.triangle(corners.map(|v| scene.vertices[v as usize]), t);
        }
        let count = scene.triangles.len() as u32;
        for &b in balls.of(index) {
            band.ball(&scene.balls[b as usize], count + b);
        }
        band.shade(scene, first, pixels);
        for &s in segments.of(index) {
            band.segment(&scene.segments[s as usize], first, pixels);
        }
    });
    Image { width, height, rgb }
}

/// The items that touch each band, ascending.
struct Bins {
    offsets: Vec<u32>,
    items: Vec<u32>,
}

impl Bins {
    /// A counting sort; `extent` gives the least and the greatest y of an item in pixels.
    fn new(bands: usize, items: usize, extent: impl Fn(usize) -> (f64, f64) + Sync) -> Self {
        let band = |y: f64| (y / BAND as f64).floor().clamp(-1.0, bands as f64) as i64;
        let range = |item: usize| {
            let (lo, hi) = extent(item);
            (band(lo).max(0) as usize, (band(hi) + 1).clamp(0, bands as i64) as usize)
        };
        let ranges: Vec<(u32, u32)> = (0..items)
            .into_par_iter()
            .map(|i| {
                let (lo, hi) = range(i);
                (lo as u32, hi as u32)
            })
            .collect();
        let mut offsets = vec![0_u32; bands + 1];
        for &(lo, hi) in &ranges {
            for b in lo..hi {
                offsets[b as usize + 1] += 1;
            }
        }
        for b in 0..bands {
            offsets[b + 1] += offsets[b];
        }
        let mut next = offsets.clone();
        let mut sorted = vec![0_u32; offsets[bands] as usize];
        for (i, &(lo, hi)) in ranges.iter().enumerate() {
            for b in lo..hi {
                let slot = &mut next[b as usize];
                sorted[*slot as usize] = i as u32;
                *slot += 1;
            }
        }
        Bins { offsets, items: sorted }
    }

    fn of(&self, band: usize) -> &[u32] {
        &self.items[self.offsets[band] as usize..self.offsets[band + 1] as usize]
    }
}

/// Rows `top..bottom` of the picture.
struct Band {
    columns: usize,
    /// Of the whole picture.
    rows: usize,
    top: usize,
    bottom: usize,
    depths: Vec<f64>,
    /// A triangle, or a ball after all triangles.
    seen: Vec<u32>,
}

/// Twice the area of (a, b, p), positive if they turn clockwise on the screen.
fn edge(a: (i64, i64), b: (i64, i64), p: (i64, i64)) -> i64 {
    (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
}

/// Grid coordinate of a pixel's centre.
fn centre(pixel: usize) -> i64 {
    pixel as i64 * GRID + GRID / 2
}

/// The pixels whose centres lie from `lo` to `hi` on the grid, within `window`.
fn pixels_between(lo: i64, hi: i64, window: std::ops::Range<usize>) -> std::ops::Range<usize> {
    let first = (lo - GRID / 2).div_euclid(GRID).max(window.start as i64);
    let last = (hi - GRID / 2).div_euclid(GRID).min(window.end as i64 - 1);
    if last < first { 0..0 } else { first as usize..last as usize + 1 }
}

impl Band {
    fn index(&self, x: usize, y: usize) -> usize {
        (y - self.top) * self.columns + x
    }

    fn triangle(&mut self, corners: [Vertex; 3], id: u32) {
        let mut p = corners.map(|v| (v.x, v.y));
        let mut depth = corners.map(|v| v.depth);
        let mut area = edge(p[0], p[1], p[2]);
        if area == 0 {
            return;
        }
        if area < 0 {
            p.swap(1, 2);
            depth.swap(1, 2);
            area = -area;
        }
        let ys = pixels_between(p[0].1.min(p[1].1).min(p[2].1), p[0].1.max(p[1].1).max(p[2].1), self.top..self.bottom);
        let xs = pixels_between(p[0].0.min(p[1].0).min(p[2].0), p[0].0.max(p[1].0).max(p[2].0), 0..self.columns);
        if xs.is_empty() || ys.is_empty() {
            return;
        }
        // Side k is opposite to corner k. A centre on a side is inside where that is a left or a top side.
        let sides = [(p[1], p[2]), (p[2], p[0]), (p[0], p[1])];
        let bias = sides.map(|(a, b)| {
            let is_left_or_top = b.1 < a.1 || (b.1 == a.1 && b.0 > a.0);
            i64::from(!is_left_or_top)
        });
        let step_x = sides.map(|(a, b)| -(b.1 - a.1) * GRID);
        let step_y = sides.map(|(a, b)| (b.0 - a.0) * GRID);
        let corner = (centre(xs.start), centre(ys.start));
        let mut row = sides.map(|(a, b)| edge(a, b, corner));
        let scale = depth.map(|d| d / area as f64);
        for y in ys {
            let mut at = row;
            let start = self.index(xs.start, y);
            let end = start + xs.len();
            let pixels = self.depths[start..end].iter_mut().zip(&mut self.seen[start..end]);
            for (nearest, seen) in pixels {
                if at[0] >= bias[0] && at[1] >= bias[1] && at[2] >= bias[2] {
                    let depth = at[0] as f64 * scale[0] + at[1] as f64 * scale[1] + at[2] as f64 * scale[2];
                    if depth < *nearest {
                        (*nearest, *seen) = (depth, id);
                    }
                }
                for k in 0..3 {
                    at[k] += step_x[k];
                }
            }
            for k in 0..3 {
                row[k] += step_y[k];
            }
        }
    }

    fn ball(&mut self, ball: &Ball, id: u32) {
        let grid = |v: f64| (v * GRID as f64).round() as i64;
        let ys = pixels_between(grid(ball.y - ball.radius), grid(ball.y + ball.radius), self.top..self.bottom);
        let xs = pixels_between(grid(ball.x - ball.radius), grid(ball.x + ball.radius), 0..self.columns);
        for y in ys {
            for x in xs.clone() {
                let Some(height) = ball_height(ball, x, y) else {
                    continue;
                };
                let depth = ball.depth - ball.bulge * height;
                let at = self.index(x, y);
                if depth < self.depths[at] {
                    self.depths[at] = depth;
                    self.seen[at] = id;
                }
            }
        }
    }

    /// Colours the rows from `first` on.
    fn shade(&self, scene: &Scene, first: usize, pixels: &mut [u8]) {
        let start = (first - self.top) * self.columns;
        for (i, pixel) in pixels.chunks_exact_mut(3).enumerate() {
            let seen = self.seen[start + i];
            if seen == NOTHING {
                continue;
            }
            let (x, y) = (i % self.columns, first + i / self.columns);
            let colour = match scene.triangles.get(seen as usize) {
                Some(triangle) => triangle_colour(scene, triangle, x, y),
                None => ball_colour(&scene.balls[seen as usize - scene.triangles.len()], x, y),
            };
            pixel.copy_from_slice(&colour);
        }
    }

    /// Draws the part of a line in the rows from `first` on.
    fn segment(&self, segment: &Segment, first: usize, pixels: &mut [u8]) {
        let [a, b] = segment.ends;
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let squared = dx * dx + dy * dy;
        // At least the pixel that the line runs through.
        let half = segment.half_width.max(0.5);
        let rows = pixels.len() / (3 * self.columns);
        let low = |v: f64| (v - half - 0.5).ceil().max(0.0) as usize;
        let high = |v: f64, end: usize| ((v + half - 0.5).floor() + 1.0).clamp(0.0, end as f64) as usize;
        for y in low(a.y.min(b.y)).max(first)..high(a.y.max(b.y), first + rows) {
            // Only where the line, as wide as it is, crosses this row.
            let (mut left, mut right) = (a.x.min(b.x), a.x.max(b.x));
            if dy.abs() > 1e-9 {
                let cross = |row: f64| a.x + dx * ((row - a.y) / dy).clamp(0.0, 1.0);
                let (p, q) = (cross(y as f64 + 0.5 - half), cross(y as f64 + 0.5 + half));
                (left, right) = (p.min(q), p.max(q));
            }
            for x in low(left)..high(right, self.columns) {
                let (px, py) = (x as f64 + 0.5 - a.x, y as f64 + 0.5 - a.y);
                let t = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
                let distance = (px - t * dx).powi(2) + (py - t * dy).powi(2);
                if distance <= half * half && self.shows(a.lerp(b, t), segment.offset) {
                    let Colour(r, g, b) = segment.colour;
                    let at = 3 * ((y - first) * self.columns + x);
                    pixels[at..at + 3].copy_from_slice(&[r, g, b]);
                }
            }
        }
    }

    /// Whether the point at (x, y) pixels is not behind all that is seen in the nine pixels around it.
    fn shows(&self, point: DVec3, offset: f64) -> bool {
        let (x, y) = (point.x.floor() as i64, point.y.floor() as i64);
        let depth = point.z - offset;
        for row in y - 1..=y + 1 {
            for column in x - 1..=x + 1 {
                let is_inside = (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
                if !is_inside {
                    // Nothing is known there, so nothing hides the line.
                    return true;
                }
                debug_assert!((self.top as i64..self.bottom as i64).contains(&row), "the halo is wide enough");
                if self.depths[self.index(column as usize, row as usize)] >= depth {
                    return true;
                }
            }
        }
        false
    }
}

/// The height of a ball over the plane of its centre, in radii.
fn ball_height(ball: &Ball, x: usize, y: usize) -> Option<f64> {
    let (dx, dy) = ball_place(ball, x, y);
    let square = 1.0 - dx * dx - dy * dy;
    (square >= 0.0).then(|| square.sqrt())
}

/// A pixel relative to a ball, in radii.
fn ball_place(ball: &Ball, x: usize, y: usize) -> (f64, f64) {
    ((x as f64 + 0.5 - ball.x) / ball.radius, (y as f64 + 0.5 - ball.y) / ball.radius)
}

fn ball_colour(ball: &Ball, x: usize, y: usize) -> [u8; 3] {
    let (dx, dy) = ball_place(ball, x, y);
    let normal = DVec3::new(dx, -dy, ball_height(ball, x, y).unwrap_or(0.0));
    shade(normal, ball.colour, super::Finish::Matte, false)
}

fn triangle_colour(scene: &Scene, triangle: &Triangle, x: usize, y: usize) -> [u8; 3] {
    let material = &scene.materials[triangle.material as usize];
    let vertices = triangle.corners.map(|v| scene.vertices[v as usize]);
    let p = vertices.map(|v| (v.x, v.y));
    // Seen from outside, corners turn counter-clockwise, which is a negative area with y downward.
    let is_front = edge(p[0], p[1], p[2]) < 0;
    let at = (centre(x), centre(y));
    // Barycentric coordinates on the surface: those in the picture, times the weights.
    let parts = [
        edge(p[1], p[2], at) as f64 * vertices[0].weight,
        edge(p[2], p[0], at) as f64 * vertices[1].weight,
        edge(p[0], p[1], at) as f64 * vertices[2].weight,
    ];
    let sum = parts[0] + parts[1] + parts[2];
    let mixed = |values: [f64; 3]| (parts[0] * values[0] + parts[1] * values[1] + parts[2] * values[2]) / sum;

    let mut normal = scene.face_normals[triangle.face as usize];
    if !material.is_flat {
        let corners = triangle.corners.map(|v| scene.normals[v as usize]);
        if corners.iter().all(|n| *n != DVec3::ZERO) {
            let mean = (parts[0] * corners[0] + parts[1] * corners[1] + parts[2] * corners[2]) / sum;
            normal = mean.try_normalize().unwrap_or(normal);
        }
    }
    if !is_front {
        normal = -normal;
    }
    if normal.z < 0.0 {
        // Interpolated past the rim.
        normal.z = 0.0;
        normal = normal.normalize_or(DVec3::Z);
    }
    let (mut colour, mut is_scale) = match &material.dye {
        Dye::One => (material.colour, false),
        Dye::Faces => (scene.face_colours[triangle.face as usize], false),
        Dye::Table(table) => {
            let place = mixed(triangle.corners.map(|v| f64::from(scene.places[v as usize])));
            let last = table.len() - 1;
            (table[((place * last as f64).round() as usize).min(last)], true)
        }
    };
    if let (false, Some(back)) = (is_front, material.back) {
        (colour, is_scale) = (back, false);
    }
    shade(normal, colour, material.finish, is_scale)
}
