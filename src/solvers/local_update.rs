//! Local edits: after a few points have moved, the control points are brought up to date by work around them only.
//!
//! The inverse of A decays geometrically from ring to ring ([`decay`]; on a regular quad grid by 2 − √3 = 0.268 a
//! ring under Catmull-Clark), so that a change of size δ is below a tolerance t after about log(δ/t)/log(1/0.268)
//! rings, however large the mesh is. Vertices whose residual is above a threshold are relaxed one at a time
//! (Gauss-Southwell; each such step lowers the energy of the symmetric system), and the threshold falls to the
//! tolerance by steps, so that large residuals go first. Where the first of these steps tell that the work would come
//! near that of a whole solution, all is solved anew.
//!
//! On open and creased meshes the curves are solved anew by each edit that moves one of their points, exactly and in O(|C|);
//! what that changes beside them is relaxed. Moving a smooth point moves no curve.

use std::collections::VecDeque;

use glam::DVec3;

use super::iteration::Stop;
use super::mixed;
use super::system::Rows;
use crate::assemble::{Operator, StagedOperator};
use crate::parallel;

/// From one threshold to the next. Tuned: 0.3 to 0.03 differ by less than a tenth.
const FALL: f64 = 0.1;
/// The work up to a threshold grows like the area that is reached, times the number of thresholds: with the third
/// power of these. It is foretold after this many.
const FORETOLD: i32 = 2;
/// Relaxations a vertex of the mesh that take as long as solving anew. Tuned on a million vertices.
const WORTH: f64 = 0.5;
/// So many times the work foretold is done before all is solved anew after all.
const SAFEGUARD: f64 = 2.0;
/// Iterations of a whole solution at most.
const MOST: usize = 10_000;
/// Marks of a vertex.
const QUEUED: u8 = 1;
const TOUCHED: u8 = 2;
const FIXED: u8 = 4;

/// Points, their control points, and the residual between them, kept up to date through edits.
pub struct Editor<'a> {
    operator: &'a Operator,
    /// With curves: these, and room for their points.
    staged: Option<(&'a StagedOperator, Vec<DVec3>)>,
    points: Vec<DVec3>,
    control: Vec<DVec3>,
    /// P − A V; of no meaning at fixed vertices.
    residual: Vec<DVec3>,
    queue: VecDeque<u32>,
    /// [`QUEUED`], [`TOUCHED`], [`FIXED`].
    marks: Vec<u8>,
    /// Vertices whose residual this edit has changed.
    touched: Vec<u32>,
}

/// What an edit took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edit {
    /// Control points moved, each time counted.
    pub relaxations: usize,
    /// Vertices whose residual changed.
    pub touched: usize,
    /// The largest residual among these, at most the tolerance unless the limit of relaxations came first.
    pub max_error: f64,
    /// Whether the whole mesh was solved anew.
    pub anew: bool,
}

impl<'a> Editor<'a> {
    /// Takes a solution V = `control` for P = `points`. One sweep over A; three arrays of N points and one of N
    /// marks.
    ///
    /// # Panics
    /// If there is not one point a vertex in both.
    pub fn new(operator: &'a Operator, points: Vec<DVec3>, control: Vec<DVec3>) -> Self {
        Self::made(operator, None, points, control)
    }

    /// As [`new`](Self::new), on an open or creased mesh. The curves are solved here, so that `control` need not hold them.
    ///
    /// # Panics
    /// As [`new`](Self::new).
    ///
    /// ```
    /// use glam::DVec3;
    /// use limitlab::assemble::StagedOperator;
    /// use limitlab::interpolate::{Interpolator, limit_points};
    /// use limitlab::mesh::{Surface, builtin, features::Tags};
    /// use limitlab::schemes::Scheme;
    /// use limitlab::solvers::{Stop, local_update::Editor};
    ///
    /// let cube = Surface::new(builtin::builtin("quad-sphere:3")?)?;
    /// let corner = cube.tagged(&Tags { corners: vec![(0, 10.0)], ..Tags::default() })?;
    /// let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
    /// let mut control = Vec::new();
    /// Interpolator::new(&corner, Scheme::CatmullClark, None)?.solve(corner.positions(), &mut control, &stop);
    /// let operator = StagedOperator::new(&corner, Scheme::CatmullClark)?;
    /// let mut editor = Editor::staged(&operator, corner.positions().to_vec(), control);
    /// editor.edit(&[(0, DVec3::new(0.0, 0.0, 2.0))], 1e-10, usize::MAX);
    /// let limits = limit_points(&corner.with_positions(editor.control().to_vec()), Scheme::CatmullClark)?;
    /// assert_eq!(limits[0], DVec3::new(0.0, 0.0, 2.0));
    /// assert!(limits[1].distance(corner.positions()[1]) < 1e-9);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn staged(operator: &'a StagedOperator, points: Vec<DVec3>, control: Vec<DVec3>) -> Self {
        Self::made(operator.operator(), Some((operator, points.clone())), points, control)
    }

    fn made(
        operator: &'a Operator,
        staged: Option<(&'a StagedOperator, Vec<DVec3>)>,
        points: Vec<DVec3>,
        control: Vec<DVec3>,
    ) -> Self {
        let n = operator.len();
        assert!(points.len() == n && control.len() == n, "one point a vertex");
        let mut editor = Editor {
            operator,
            staged,
            points,
            control,
            residual: vec![DVec3::ZERO; n],
            queue: VecDeque::new(),
            marks: vec![0; n],
            touched: Vec::new(),
        };
        if let Some((staged, _)) = editor.staged {
            staged.fixed().iter().for_each(|&c| editor.marks[c as usize] = FIXED);
        }
        editor.evaluate();
        editor.solve_curves();
        for &v in &editor.touched {
            editor.marks[v as usize] = 0;
        }
        editor.touched.clear();
        editor
    }

    /// P − A V of all vertices.
    fn evaluate(&mut self) {
        Rows::new(self.points.len()).residual(
            self.operator,
            &self.points,
            &self.control,
            &mut self.residual,
            |_, e, out, _| *out = e,
        );
    }

    /// The points P as they are now.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The control points V.
    pub fn control(&self) -> &[DVec3] {
        &self.control
    }

    /// Moves the points of some vertices to new places and relaxes until no residual that the edit has changed is
    /// longer than `tolerance` (absolute, in mesh units), or after `most` relaxations. Residuals elsewhere stay as
    /// the solution given left them. O(vertices touched), whatever N is, unless all is solved anew by
    /// [`mixed::solve`].
    ///
    /// # Panics
    /// If a vertex does not exist, or unless `tolerance` > 0.
    pub fn edit(&mut self, moves: &[(u32, DVec3)], tolerance: f64, most: usize) -> Edit {
        assert!(tolerance > 0.0, "a positive tolerance");
        for &v in &self.touched {
            self.marks[v as usize] = 0;
        }
        self.touched.clear();
        let mut on_curves = false;
        for &(v, p) in moves {
            let i = v as usize;
            self.residual[i] += p - self.points[i];
            self.points[i] = p;
            self.touch(i);
            on_curves |= self.marks[i] & FIXED != 0;
        }
        if on_curves {
            self.solve_curves();
        }
        let largest = self.max_error();
        let mut relaxations = 0;
        let mut threshold = largest;
        let thresholds = (tolerance / largest).ln() / FALL.ln();
        let mut anew = false;
        for step in 1.. {
            if relaxations >= most || threshold <= tolerance {
                break;
            }
            threshold = (FALL * threshold).max(tolerance);
            // At first the share that these steps have in work that is just worth while; then a safeguard.
            let worth = WORTH * self.points.len() as f64;
            let worth = if step <= FORETOLD {
                worth * (f64::from(FORETOLD) / thresholds).min(1.0).powi(3)
            } else {
                SAFEGUARD * worth
            };
            let limit = if anew { most } else { most.min(worth as usize) };
            for k in 0..self.touched.len() {
                self.enqueue(self.touched[k] as usize, threshold);
            }
            while let Some(v) = self.queue.pop_front() {
                let i = v as usize;
                self.marks[i] &= !QUEUED;
                if self.residual[i].length_squared() > threshold * threshold && relaxations < limit {
                    relaxations += 1;
                    self.relax(i, threshold);
                }
            }
            if relaxations >= limit && limit < most {
                anew = true;
                self.solve_all(tolerance);
                // What mixed precision leaves above the tolerance, if anything, is relaxed.
                threshold = self.max_error();
            }
        }
        Edit { relaxations, touched: self.touched.len(), max_error: self.max_error(), anew }
    }

    /// The largest residual among the vertices touched.
    fn max_error(&self) -> f64 {
        let squares = self.touched.iter().map(|&v| self.residual[v as usize].length_squared());
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Brings the control points of curves and corners up to date, and the residuals beside them.
    fn solve_curves(&mut self) {
        let Some((staged, mut known)) = self.staged.take() else { return };
        staged.fixed().iter().for_each(|&c| known[c as usize] = self.points[c as usize]);
        staged.curves().solve(&mut known);
        for (k, &c) in staged.fixed().iter().enumerate() {
            let change = known[c as usize] - self.control[c as usize];
            self.control[c as usize] = known[c as usize];
            if change != DVec3::ZERO {
                for &(i, a) in staged.column(k) {
                    self.residual[i as usize] -= a * change;
                    self.touch(i as usize);
                }
            }
        }
        self.staged = Some((staged, known));
    }

    fn solve_all(&mut self, tolerance: f64) {
        let stop = Stop { tolerance, max_iterations: MOST };
        match &self.staged {
            None => self.control = mixed::solve(self.operator, &self.points, &stop).0,
            Some((staged, _)) => {
                // What is missing vanishes on the curves.
                staged.fixed().iter().for_each(|&c| self.residual[c as usize] = DVec3::ZERO);
                let missing = mixed::solve(self.operator, &self.residual, &stop).0;
                parallel::change(&mut self.control, |i, v| *v += missing[i]);
            }
        }
        self.evaluate();
        (0..self.points.len()).for_each(|i| self.touch(i));
    }

    fn touch(&mut self, i: usize) {
        if self.marks[i] & (TOUCHED | FIXED) == 0 {
            self.marks[i] |= TOUCHED;
            self.touched.push(i as u32);
        }
    }

    fn enqueue(&mut self, i: usize, threshold: f64) {
        if self.residual[i].length_squared() > threshold * threshold && self.marks[i] & (QUEUED | FIXED) == 0 {
            self.marks[i] |= QUEUED;
            self.queue.push_back(i as u32);
        }
    }

    /// One step of Gauss-Seidel at vertex `i`: its residual vanishes, those of its neighbours change.
    fn relax(&mut self, i: usize, threshold: f64) {
        let operator = self.operator;
        let step = self.residual[i] / operator.diagonal()[i];
        self.control[i] += step;
        self.residual[i] = DVec3::ZERO;
        let h = operator.weights();
        let over_h = step / h[i];
        operator.neighbours(i, |j, a_ij| {
            // M is symmetric: a_ji = h_j a_ij / h_i.
            self.residual[j] -= (h[j] * a_ij) * over_h;
            self.touch(j);
            self.enqueue(j, threshold);
        });
    }
}

/// The largest entry of column `vertex` of A⁻¹ in each ring of neighbours around it, ring 0 being the vertex itself,
/// as far as entries are above `tolerance`.
///
/// # Panics
/// If the vertex does not exist, or unless `tolerance` > 0.
pub fn decay(operator: &Operator, vertex: usize, tolerance: f64) -> Vec<f64> {
    let n = operator.len();
    let zero = vec![DVec3::ZERO; n];
    let mut editor = Editor::new(operator, zero.clone(), zero);
    // Residuals count 1/λ_min-fold at the worst; two more digits cover that for λ_min > 0.01.
    editor.edit(&[(vertex as u32, DVec3::X)], 0.01 * tolerance, usize::MAX);
    let mut rings = Vec::new();
    let mut seen = vec![false; n];
    seen[vertex] = true;
    let mut ring = vec![vertex];
    while !ring.is_empty() {
        let largest = ring.iter().map(|&v| editor.control[v].x.abs()).fold(0.0, f64::max);
        if largest <= tolerance {
            break;
        }
        rings.push(largest);
        let mut next = Vec::new();
        for &v in &ring {
            operator.neighbours(v, |w, _| {
                if !std::mem::replace(&mut seen[w], true) {
                    next.push(w);
                }
            });
        }
        ring = next;
    }
    rings
}
