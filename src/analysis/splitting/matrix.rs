//! The splitting matrix of a star, read off from the refinement rules, and its Fourier blocks.

use std::f64::consts::TAU;

use glam::DVec3;
use nalgebra::{Complex, DMatrix};

use super::scheme::{LocalScheme, Round};
use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// The square matrix S with S·V the control points about the middle after one round of refinement, V those before,
/// both in the order of [`Layout`](super::star::Layout): middle, then orbit by orbit, n sectors each.
#[derive(Clone, Debug)]
pub struct SplittingMatrix {
    /// The scheme whose refinement it is.
    pub scheme: LocalScheme,
    /// Sectors n about the middle vertex or face.
    pub valence: usize,
    /// Rings of control points that it acts on.
    pub rings: usize,
    /// S itself, dense and N × N; every row has the sum 1.
    pub entries: DMatrix<f64>,
}

impl SplittingMatrix {
    /// The matrix on the fewest rings on which it closes: 2n+1 rows for Catmull-Clark, n+1 for Loop and √3, n for
    /// Doo-Sabin, 6n+1 for the blend.
    ///
    /// # Errors
    /// As [`on_rings`](Self::on_rings).
    pub fn new(scheme: LocalScheme, valence: usize) -> Result<Self> {
        Self::on_rings(scheme, valence, scheme.least_rings())
    }

    /// The matrix on `rings` rings, N rows: the refinement function of [`schemes`](crate::schemes) is applied to
    /// unit vectors, three at a time as coordinates. ⌈N/3⌉ refinements, O(N²) time and memory.
    ///
    /// The star is closed far away by a vertex at NaN. What comes out as NaN depends on it, and so the matrix
    /// is finite exactly if the rings determine their own refinement: nothing about supports is assumed.
    ///
    /// # Errors
    /// [`Error::Unknown`] for a valence outside [`VALENCES`](super::VALENCES), [`Error::Computation`] if the matrix
    /// does not close on so few rings.
    ///
    /// # Panics
    /// If `rings` is 0.
    pub fn on_rings(scheme: LocalScheme, valence: usize, rings: usize) -> Result<Self> {
        assert!(rings > 0, "a star has at least one ring");
        let entries = rows(scheme, valence, rings, rings)?;
        Ok(SplittingMatrix { scheme, valence, rings, entries })
    }

    /// The number of control points N.
    pub fn size(&self) -> usize {
        self.entries.nrows()
    }

    /// The Fourier block of frequency `k`, B_k\[o, p\] = Σ_d S\[(o,0),(p,d)\] e^{2πikd/n} over orbits o, p: S maps
    /// x_(p,s) = x̂_p e^{2πiks/n} to the same with B_k x̂. Frequency 0 has the middle as its first row. The eigenvalues
    /// of S are those of all blocks 0 ≤ k < n; block n−k is the conjugate of block k.
    pub fn block(&self, k: usize) -> DMatrix<Complex<f64>> {
        let n = self.valence;
        let centre = self.scheme.layout().centre();
        let orbits = (self.size() - centre) / n;
        let own = if k == 0 { centre } else { 0 };
        let unit: Vec<Complex<f64>> = (0..n).map(|d| Complex::cis(TAU * ((k * d) % n) as f64 / n as f64)).collect();
        // The first position of an orbit; the middle, where it takes part, is an orbit of one.
        let start = |o: usize| if o < own { 0 } else { centre + (o - own) * n };
        DMatrix::from_fn(own + orbits, own + orbits, |o, p| {
            let row = start(o);
            if p < own {
                return self.entries[(row, 0)].into();
            }
            unit.iter().enumerate().map(|(d, z)| z * self.entries[(row, start(p) + d)]).sum()
        })
    }

    /// The largest deviation from S[(o,s),(p,t)] = S[(o,0),(p,t−s)], which the blocks rely on: rounding.
    pub fn circulance(&self) -> f64 {
        let (n, centre) = (self.valence, self.scheme.layout().centre());
        // The same position, `turn` sectors back.
        let back = |i: usize, turn: usize| {
            if i < centre {
                return i;
            }
            let (orbit, sector) = ((i - centre) / n, (i - centre) % n);
            centre + orbit * n + (sector + n - turn) % n
        };
        let mut worst = 0.0_f64;
        for row in 0..self.size() {
            let turn = if row < centre { 1 } else { (row - centre) % n };
            for column in 0..self.size() {
                let twin = self.entries[(back(row, turn), back(column, turn))];
                worst = worst.max((self.entries[(row, column)] - twin).abs());
            }
        }
        worst
    }
}

/// What leads from the positions of `rings` rings to those of `reach` rings after one round, as of
/// [`SplittingMatrix::on_rings`].
pub(super) fn rows(scheme: LocalScheme, valence: usize, rings: usize, reach: usize) -> Result<DMatrix<f64>> {
    LocalScheme::require_valence(valence)?;
    let layout = scheme.layout();
    let size = layout.len(valence, rings);
    let mut points = vec![DVec3::ZERO; size + 1];
    let mesh = Mesh::new(points.clone(), layout.closed(valence, rings));
    let mut round = Round::new(scheme, mesh, valence, reach)?;
    let mut entries = DMatrix::zeros(layout.len(valence, reach), size);
    for first in (0..size).step_by(3) {
        let columns = 3.min(size - first);
        points.fill(DVec3::ZERO);
        points[size] = DVec3::NAN;
        for axis in 0..columns {
            points[first + axis][axis] = 1.0;
        }
        for (row, point) in round.apply(&points)?.into_iter().enumerate() {
            if !point.is_finite() {
                return Err(Error::Computation(format!(
                    "the splitting matrix of {scheme} does not close on {rings} rings: take {} or more",
                    scheme.least_rings()
                )));
            }
            for axis in 0..columns {
                entries[(row, first + axis)] = point[axis];
            }
        }
    }
    Ok(entries)
}
