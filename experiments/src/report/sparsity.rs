//! Sparsity plot: the pattern of a sparse matrix.

use super::axis::{Axis, Scale};
use super::canvas::{Canvas, Colour, Rect};
use super::frame::{self, FRAME_COLOUR, FRAME_WIDTH, Slot};

/// A larger matrix is shown as at most so many blocks in each direction, about a pixel of the image each: larger ones would
/// make scattered entries look dense.
const MOST_BLOCKS: usize = 640;

/// Grey levels of the emptiest and the fullest block that hold an entry at all.
const LIGHTEST: f64 = 150.0;
const DARKEST: f64 = 0.0;

/// Where a square matrix has entries: one dark dot an entry, or, for large matrices, one a square block of
/// entries, the darker the more it holds (by the square root of the count, so that single diagonals stay visible).
///
/// ```
/// use limitlab_experiments::report::{Figure, SparsityPlot};
///
/// let tridiagonal = (0..9_u32).flat_map(|i| [(i, i), (i, i + 1), (i + 1, i)]);
/// let plot = SparsityPlot::new("file order, bandwidth 1", 10, tridiagonal);
/// let image = Figure::row([plot]).render()?;
/// assert_eq!(image.width, 900);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SparsityPlot {
    /// Above the picture, such as `file order, bandwidth 1234`.
    pub caption: String,
    dimension: usize,
    /// Rows and columns of the matrix in a block.
    block: usize,
    /// Blocks in each direction.
    blocks: usize,
    /// Entries in each block, row by row.
    counts: Vec<u32>,
}

impl SparsityPlot {
    /// Counts the entries (row, column), numbered from 0, of a matrix with `dimension` rows. Cost: one pass; at
    /// most 1.6 MB.
    ///
    /// # Panics
    /// If an entry is outside the matrix.
    pub fn new(caption: impl Into<String>, dimension: usize, entries: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let block = dimension.div_ceil(MOST_BLOCKS).max(1);
        let blocks = dimension.div_ceil(block);
        let mut counts = vec![0_u32; blocks * blocks];
        for (row, column) in entries {
            let (row, column) = (row as usize, column as usize);
            assert!(row < dimension && column < dimension, "entry ({row}, {column}) is inside the matrix");
            let count = &mut counts[row / block * blocks + column / block];
            *count = count.saturating_add(1);
        }
        SparsityPlot { caption: caption.into(), dimension, block, blocks, counts }
    }

    /// Rows, and columns, of the matrix that a dot stands for.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Columns from the left, or rows from the top.
    pub(super) fn axis(&self) -> Axis {
        Axis::over(Scale::Linear, (0.0, self.dimension.max(1) as f64))
    }

    pub(super) fn bottom(&self) -> f64 {
        frame::x_axis_room("column", true)
    }

    pub(super) fn left(&self, height: f64) -> f64 {
        frame::y_axis_room("row", &frame::y_ticks(self.axis(), height / 2.0))
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, slot: &Slot) {
        // The largest square at the top of the room, in its middle.
        let room = slot.frame;
        let side = room.width().min(room.height());
        let left = room.centre().0 - side / 2.0;
        let frame = Rect { left, top: room.top, right: left + side, bottom: room.top + side };
        let fullest = f64::from(self.counts.iter().copied().max().unwrap_or(0));
        // The last block may be cut short; the frame ends where the matrix does.
        let size = side * self.block as f64 / self.dimension.max(1) as f64;
        let edge = |index: usize| (index as f64 * size).min(side);
        for (index, &count) in self.counts.iter().enumerate() {
            if count == 0 {
                continue;
            }
            let (row, column) = (index / self.blocks, index % self.blocks);
            let depth = (f64::from(count) / fullest).sqrt();
            let grey = (LIGHTEST + depth * (DARKEST - LIGHTEST)).round() as u8;
            let dot = Rect {
                left: frame.left + edge(column),
                right: frame.left + edge(column + 1),
                top: frame.top + edge(row),
                bottom: frame.top + edge(row + 1),
            };
            canvas.fill(dot, Colour(grey, grey, grey));
        }
        canvas.outline(frame, FRAME_WIDTH, FRAME_COLOUR);
        let x = frame::x_ticks(self.axis(), side);
        frame::draw_x_axis(canvas, frame, &x, "column", true);
        let mut y = frame::y_ticks(self.axis(), side / 2.0);
        for tick in &mut y {
            tick.at = 1.0 - tick.at; // rows count downward
        }
        frame::draw_y_axis(canvas, frame, frame::y_axis_room("row", &y), &y, "row");
        frame::draw_title(canvas, room, &self.caption, frame::title_room(&self.caption), slot.title_size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_matrices_have_a_block_an_entry() {
        let plot = SparsityPlot::new("", 3, [(0, 0), (2, 1), (2, 1)]);
        assert_eq!((plot.block, plot.blocks), (1, 3));
        assert_eq!(plot.counts, [1, 0, 0, 0, 0, 0, 0, 2, 0]);
    }

    #[test]
    fn large_matrices_are_summed_up() {
        let n = 1_000_003;
        let plot = SparsityPlot::new("", n, (0..n as u32).map(|i| (i, i)));
        assert!(plot.blocks <= MOST_BLOCKS);
        assert!(plot.block * plot.blocks >= n && plot.block * (plot.blocks - 1) < n);
        assert_eq!(plot.counts.iter().sum::<u32>() as usize, n);
        for (index, &count) in plot.counts.iter().enumerate() {
            let on_diagonal = index / plot.blocks == index % plot.blocks;
            assert_eq!(count > 0, on_diagonal);
        }
    }

    #[test]
    #[should_panic(expected = "inside the matrix")]
    fn an_entry_outside_is_a_broken_contract() {
        SparsityPlot::new("", 3, [(0, 3)]);
    }
}
