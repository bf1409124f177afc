//! Gaussian noise on positions: smooth symmetric meshes excite few eigenvectors, noisy ones all.

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use rand::{Rng, SeedableRng};

use super::frame::distance;
use super::incidence::next_in;
use super::{Faces, Mesh, Surface, Topology};
use crate::error::short;
use crate::{Error, Result};

/// A Gaussian displacement of all vertices: `--noise A[:SEED]`, seed 1 unless told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The standard deviation of each coordinate, in mean edge lengths; 0 or more.
    pub amplitude: f64,
    /// The seed of the generator; the same seed gives the same displacements.
    pub seed: u64,
}

impl FromStr for Noise {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (amplitude, seed) = text.split_once(':').unwrap_or((text, "1"));
        match (amplitude.parse(), seed.parse()) {
            (Ok(amplitude), Ok(seed)) if (0.0..f64::INFINITY).contains(&amplitude) => Ok(Noise { amplitude, seed }),
            _ => Err(Error::Unknown(format!(
                "noise `{text}`: write A[:SEED] with a number A from 0 and a whole number SEED, such as 0.1:7"
            ))),
        }
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", short(self.amplitude), self.seed)
    }
}

/// The mean length of the edges, each counted once; 0 without edges.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub fn mean_edge_length(mesh: &Mesh) -> f64 {
    mean_length(&mesh.positions, &mesh.faces, &Topology::new(&mesh.faces, mesh.len()))
}

fn mean_length(positions: &[DVec3], faces: &Faces, topology: &Topology) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for c in topology.edge_sides() {
        let range = faces.range(topology.incidence.face_of(c));
        let [a, b] = [c, next_in(&range, c)].map(|c| positions[faces.corners()[c as usize] as usize]);
        sum += distance(a, b);
        count += 1;
    }
    if count == 0 { 0.0 } else { sum / f64::from(count) }
}

/// Adds to every coordinate a Gaussian of mean 0 and standard deviation `amplitude` × the mean edge length. The
/// k-th vertex takes the k-th four words of the generator (ChaCha8; Box and Muller 1958), whatever the mesh.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub fn add_noise(mesh: &mut Mesh, amplitude: f64, seed: u64) {
    let deviation = amplitude * mean_edge_length(mesh);
    displace(&mut mesh.positions, deviation, seed);
}

/// As [`add_noise`], on a valid mesh. Points may come to lie beyond the largest double.
pub fn move_vertices(surface: &mut Surface, amplitude: f64, seed: u64) {
    let deviation = amplitude * mean_length(surface.positions(), surface.faces(), surface.topology());
    displace(surface.positions_mut(), deviation, seed);
}

fn displace(points: &mut [DVec3], deviation: f64, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Strictly between 0 and 1.
    let mut uniform = || ((rng.next_u64() >> 12) as f64 + 0.5) / (1u64 << 52) as f64;
    for p in points {
        let mut pair = || {
            let (radius, angle) = ((-2.0 * uniform().ln()).sqrt(), TAU * uniform());
            (radius * angle.cos(), radius * angle.sin())
        };
        let ((x, y), (z, _)) = (pair(), pair());
        *p += deviation * DVec3::new(x, y, z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;

    #[test]
    fn the_mean_counts_every_edge_once_on_an_open_mesh_too() {
        // Two right triangles on a common hypotenuse: four sides of length 1, one of length √2.
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let mesh = Mesh::new(positions, Faces::from_lists([[0, 1, 2], [0, 2, 3]]));
        let expected = (4.0 + 2f64.sqrt()) / 5.0;
        assert!((mean_edge_length(&mesh) - expected).abs() < 4.0 * f64::EPSILON);
        assert_eq!(mean_edge_length(&builtin::cube()), 2.0);
        assert_eq!(mean_edge_length(&Mesh::new(vec![DVec3::X], Faces::default())), 0.0);
        for size in [2f64.powi(-700), 2f64.powi(700)] {
            let mut cube = builtin::cube();
            cube.positions.iter_mut().for_each(|p| *p *= size);
            assert_eq!(mean_edge_length(&cube), 2.0 * size);
            assert_eq!(cube.diagonal(), size * builtin::cube().diagonal());
        }
    }

    #[test]
    fn moments_are_those_of_a_gaussian() {
        let base = builtin::torus(200, 150);
        let mut noisy = base.clone();
        let amplitude = 0.3;
        add_noise(&mut noisy, amplitude, 5);
        let deviation = amplitude * mean_edge_length(&base);
        let z: Vec<f64> = (noisy.positions.iter())
            .zip(&base.positions)
            .flat_map(|(p, q)| ((*p - *q) / deviation).to_array())
            .collect();
        let n = z.len() as f64;
        let moment = |k: i32| z.iter().map(|x| x.powi(k)).sum::<f64>() / n;
        // The k-th sample moment has variance (E x²ᵏ − (E xᵏ)²)/n: 1, 2, 15, 96 for k = 1 to 4. Five standard
        // deviations.
        for (k, mean, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            let bound = 5.0 * f64::sqrt(variance / n);
            assert!((moment(k) - mean).abs() < bound, "moment {k}: {}", moment(k));
        }
        // The three coordinates of a vertex, and vertices in a row, are not correlated.
        for lag in 1..7 {
            let products = z.windows(lag + 1).map(|w| w[0] * w[lag]);
            assert!((products.sum::<f64>() / n).abs() < 5.0 / n.sqrt(), "lag {lag}");
        }
    }

    #[test]
    fn noise_depends_on_the_seed_and_the_vertex_alone() {
        let moved = |mut mesh: Mesh, seed| {
            let before = mesh.positions.clone();
            let length = mean_edge_length(&mesh);
            add_noise(&mut mesh, 0.1, seed);
            let shift = |(p, q): (&DVec3, DVec3)| (*p - q) / length;
            mesh.positions.iter().zip(before).map(shift).collect::<Vec<_>>()
        };
        let (small, large) = (moved(builtin::cube(), 3), moved(builtin::icosahedron(), 3));
        for (p, q) in small.iter().zip(&large) {
            assert!(p.distance(*q) < 1e-14);
        }
        assert_ne!(moved(builtin::cube(), 3), moved(builtin::cube(), 4));
        assert_eq!(moved(builtin::cube(), 3), moved(builtin::cube(), 3));
        let mut still = builtin::cube();
        add_noise(&mut still, 0.0, 3);
        assert_eq!(still, builtin::cube());
    }

    #[test]
    fn the_option_is_read_and_written() {
        let read = |text: &str| text.parse::<Noise>();
        let noise = |amplitude, seed| Noise { amplitude, seed };
        assert_eq!(read("0.1").unwrap(), noise(0.1, 1));
        assert_eq!(read("1e-3:99").unwrap(), noise(1e-3, 99));
        assert_eq!(read("0").unwrap(), noise(0.0, 1));
        for n in [noise(0.1, 1), noise(0.25, u64::MAX), noise(1e160, 2)] {
            assert!(n.to_string().len() < 30, "{n}");
            assert_eq!(read(&n.to_string()).unwrap(), n);
        }
        for bad in ["", "-0.1", "nan", "inf", "0.1:", "0.1:x", "0.1:1:2", "0.1:-1", ":3"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
