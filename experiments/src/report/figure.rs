//! Panels arranged in a grid and rendered to an image.

use super::axis::{Axis, Scale};
use super::canvas::{Canvas, Rect};
use super::frame::{BARE_RIGHT, Slot, TITLE_SIZE, draw_fitted, title_room, title_size};
use super::plot::LinePlot;
use super::png::Image;
use super::provenance::Provenance;
use super::render::{ColourScale, Picture, bar};
use super::sparsity::SparsityPlot;
use limitlab::output::write_file;
use limitlab::{Error, Result, names};
use std::path::Path;
use std::str::FromStr;

const MARGIN: f64 = 6.0;
const FIGURE_TITLE_SIZE: f64 = 12.0;
/// A frame smaller than this shows nothing.
const LEAST_FRAME: f64 = 40.0;

/// One panel of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Panel {
    Lines(LinePlot),
    Sparsity(SparsityPlot),
    Picture(Picture),
}

impl From<LinePlot> for Panel {
    fn from(plot: LinePlot) -> Self {
        Panel::Lines(plot)
    }
}

impl From<SparsityPlot> for Panel {
    fn from(plot: SparsityPlot) -> Self {
        Panel::Sparsity(plot)
    }
}

impl From<Picture> for Panel {
    fn from(picture: Picture) -> Self {
        Panel::Picture(picture)
    }
}

impl Panel {
    fn title(&self) -> &str {
        match self {
            Panel::Lines(plot) => &plot.title,
            Panel::Sparsity(plot) => &plot.caption,
            Panel::Picture(picture) => &picture.caption,
        }
    }

    fn x_axis(&self) -> Axis {
        match self {
            Panel::Lines(plot) => plot.x_axis(),
            Panel::Sparsity(plot) => plot.axis(),
            // A picture has no axes.
            Panel::Picture(_) => Axis::over(Scale::Linear, (0.0, 1.0)),
        }
    }

    fn top(&self) -> f64 {
        match self {
            Panel::Lines(plot) => plot.top(),
            Panel::Sparsity(plot) => title_room(&plot.caption),
            Panel::Picture(picture) => picture.top(),
        }
    }

    fn bottom(&self, labelled: bool) -> f64 {
        match self {
            Panel::Lines(plot) => plot.bottom(labelled),
            Panel::Sparsity(plot) => plot.bottom(),
            Panel::Picture(picture) => picture.bottom(),
        }
    }

    fn left(&self, height: f64) -> f64 {
        match self {
            Panel::Lines(plot) => plot.left(height),
            Panel::Sparsity(plot) => plot.left(height),
            Panel::Picture(picture) => picture.left(),
        }
    }

    fn right(&self) -> f64 {
        match self {
            Panel::Lines(plot) => plot.right(),
            Panel::Sparsity(_) => BARE_RIGHT,
            Panel::Picture(picture) => picture.right(),
        }
    }

    /// Whether the caller chose the range of x.
    fn has_x_range(&self) -> bool {
        match self {
            Panel::Lines(plot) => plot.x_range.is_some(),
            Panel::Sparsity(_) | Panel::Picture(_) => true,
        }
    }

    fn draw(&self, canvas: &mut Canvas, slot: &Slot) -> Result<()> {
        match self {
            Panel::Lines(plot) => plot.draw(canvas, slot),
            Panel::Sparsity(plot) => plot.draw(canvas, slot),
            Panel::Picture(picture) => picture.draw(canvas, slot)?,
        }
        Ok(())
    }
}

/// What a figure is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// An image of 216 pixels an inch.
    Png,
    Svg,
    Pdf,
}

impl Format {
    const ALL: [Format; 3] = [Format::Png, Format::Svg, Format::Pdf];

    /// The name on the command line, and the end of the names of files.
    pub fn name(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Svg => "svg",
            Format::Pdf => "pdf",
        }
    }

    /// The format that the ending of a name tells.
    ///
    /// # Errors
    /// [`Error::Parse`] for another ending.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let known = Format::ALL.into_iter().find(|format| format.name() == ending);
        known.ok_or_else(|| Error::parse(path, None, "the name of a picture ends in .png, .svg or .pdf"))
    }
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        names::find("figure format", name, &Format::ALL.map(|format| (format.name(), format)), &[])
    }
}

/// Panels in rows, all frames of one size and in line with each other.
///
/// Sizes are in points; a point is 3 pixels of the image, so that a figure 600 points wide, with its text of 9 to
/// 10 points, prints at 216 dots an inch. Rendering takes 243 bytes a square point (60 MB at 600×400), and as much again
/// for pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Above all panels; none if empty.
    pub title: String,
    pub width: u32,
    pub height: u32,
    /// Panels in a row.
    pub columns: usize,
    /// Panels of a column have one x axis, labelled at the lowest only: the range that some of them ask for, or
    /// else the one that shows the data of all. Panels of another scale do not take part.
    pub share_x: bool,
    /// Drawn beside the panels, whose pictures have their colours from it.
    pub colour_bar: Option<ColourScale>,
    pub panels: Vec<Panel>,
}

impl Figure {
    /// The height that a title takes, in points.
    pub const TITLE_ROOM: u32 = 22;

    /// A single panel, 600×380 points.
    pub fn new(panel: impl Into<Panel>) -> Self {
        Figure { width: 600, height: 380, ..Figure::row([panel]) }
    }

    /// Panels one above the other that share their x axis, 600 points wide and 220 high each.
    pub fn stack<P: Into<Panel>>(panels: impl IntoIterator<Item = P>) -> Self {
        let panels: Vec<Panel> = panels.into_iter().map(Into::into).collect();
        let height = 220 * panels.len() as u32;
        Figure { width: 600, height, columns: 1, share_x: true, ..Figure::row(panels) }
    }

    /// Panels side by side, 300×320 points each.
    pub fn row<P: Into<Panel>>(panels: impl IntoIterator<Item = P>) -> Self {
        let panels: Vec<Panel> = panels.into_iter().map(Into::into).collect();
        Figure {
            title: String::new(),
            width: 300 * panels.len() as u32,
            height: 320,
            columns: panels.len(),
            share_x: false,
            colour_bar: None,
            panels,
        }
    }

    /// The same figure with this title.
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// The same figure under this title, higher by its room.
    pub fn headed(self, title: impl Into<String>) -> Self {
        Figure { height: self.height + Self::TITLE_ROOM, ..self.title(title) }
    }

    /// Draws the figure. The same figure gives the same image.
    ///
    /// # Errors
    /// [`Error::Computation`] if the panels' texts leave no room for the data.
    ///
    /// # Panics
    /// If a range is empty, not finite, or reaches 0 on a logarithmic axis, or bars lack an edge.
    pub fn render(&self) -> Result<Image> {
        self.drawing()?.to_image()
    }

    /// Writes the files `STEM.png`, `STEM.svg` and `STEM.pdf`, as far as they are asked for, which say what made them.
    ///
    /// # Errors
    /// As [`render`](Self::render), and [`Error::Io`] if a file cannot be written.
    ///
    /// # Panics
    /// As [`render`](Self::render).
    pub fn write(&self, folder: &Path, stem: &str, formats: &[Format], provenance: &Provenance) -> Result<()> {
        let drawing = self.drawing()?;
        formats.iter().try_for_each(|&format| {
            let path = folder.join(format!("{stem}.{}", format.name()));
            write_drawing(&drawing, &path, format, provenance)
        })
    }

    /// Writes one file in the format that the ending of its name tells.
    ///
    /// # Errors
    /// As [`Format::of`] and [`write`](Self::write).
    ///
    /// # Panics
    /// As [`render`](Self::render).
    pub fn save(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        write_drawing(&self.drawing()?, path, Format::of(path)?, provenance)
    }

    /// What of its texts cannot be read: those that were cut or reach over the edge, and pairs that cover each other.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    ///
    /// # Panics
    /// As [`render`](Self::render).
    pub fn illegible(&self) -> Result<Vec<String>> {
        Ok(self.drawing()?.illegible())
    }

    fn drawing(&self) -> Result<Canvas> {
        let mut canvas = Canvas::new(self.width, self.height);
        if !self.title.is_empty() {
            let width = f64::from(self.width);
            let place = (width / 2.0, MARGIN + FIGURE_TITLE_SIZE);
            draw_fitted(&mut canvas, &self.title, place, FIGURE_TITLE_SIZE, width - 2.0 * MARGIN);
        }
        let slots = self.slots()?;
        for (panel, slot) in self.panels.iter().zip(&slots) {
            panel.draw(&mut canvas, slot)?;
        }
        let frames = slots.into_iter().map(|slot| slot.frame);
        if let (Some(scale), Some(frames)) = (&self.colour_bar, frames.reduce(Rect::around)) {
            bar::draw(&mut canvas, frames, scale)?;
        }
        Ok(canvas)
    }

    /// Panels in a row, at least 1 and no more than there are.
    fn columns(&self) -> usize {
        self.columns.clamp(1, self.panels.len().max(1))
    }

    /// Whether a panel carries the labels of its x axis: the last of a column does.
    fn is_labelled(&self, index: usize) -> bool {
        !self.share_x || index + self.columns() >= self.panels.len()
    }

    fn x_axis(&self, index: usize) -> Axis {
        let own = self.panels[index].x_axis();
        if !self.share_x {
            return own;
        }
        let column = || {
            let panels = self.panels.iter().skip(index % self.columns());
            panels
                .step_by(self.columns())
                .map(|panel| (panel.x_axis(), panel.has_x_range()))
                .filter(|(axis, _)| axis.scale == own.scale)
        };
        let chosen = column().any(|(_, chosen)| chosen);
        column().filter(|&(_, c)| c == chosen).map(|(axis, _)| axis).reduce(Axis::union).unwrap_or(own)
    }

    /// Lays the panels out: all frames of one size, between the widest texts of each row and column.
    fn slots(&self) -> Result<Vec<Slot>> {
        let columns = self.columns();
        let rows = self.panels.len().div_ceil(columns).max(1);
        let (mut above, mut below) = (vec![0.0_f64; rows], vec![0.0_f64; rows]);
        for (index, panel) in self.panels.iter().enumerate() {
            let row = index / columns;
            above[row] = above[row].max(panel.top());
            below[row] = below[row].max(panel.bottom(self.is_labelled(index)));
        }
        let title = if self.title.is_empty() { 0.0 } else { f64::from(Self::TITLE_ROOM) };
        let used = title + 2.0 * MARGIN + above.iter().chain(&below).sum::<f64>();
        let height = (f64::from(self.height) - used) / rows as f64;

        // The ticks of a y axis, and so the width of their labels, depend on the height.
        let (mut before, mut after) = (vec![0.0_f64; columns], vec![0.0_f64; columns]);
        for (index, panel) in self.panels.iter().enumerate() {
            let column = index % columns;
            before[column] = before[column].max(panel.left(height.max(LEAST_FRAME)));
            after[column] = after[column].max(panel.right());
        }
        let bar = self.colour_bar.as_ref().map_or(Ok(0.0), bar::room)?;
        let used = 2.0 * MARGIN + bar + before.iter().chain(&after).sum::<f64>();
        let width = (f64::from(self.width) - used) / columns as f64;
        if width < LEAST_FRAME || height < LEAST_FRAME {
            return Err(Error::Computation(format!(
                "a figure of {}×{} points leaves its panels no room beside titles, labels and legends; \
                 make it larger or its names shorter",
                self.width, self.height
            )));
        }

        let sizes = self.panels.iter().map(|panel| title_size(panel.title(), width));
        let title_size = sizes.fold(TITLE_SIZE, f64::min);
        let slot = |index: usize| {
            let (row, column) = (index / columns, index % columns);
            let left = MARGIN + before[..=column].iter().chain(&after[..column]).sum::<f64>() + column as f64 * width;
            let top = MARGIN + title + above[..=row].iter().chain(&below[..row]).sum::<f64>() + row as f64 * height;
            Slot {
                frame: Rect { left, top, right: left + width, bottom: top + height },
                left: before[column],
                x_axis: self.x_axis(index),
                labelled: self.is_labelled(index),
                title_size,
            }
        };
        Ok((0..self.panels.len()).map(slot).collect())
    }
}

fn write_drawing(drawing: &Canvas, path: &Path, format: Format, provenance: &Provenance) -> Result<()> {
    match format {
        Format::Png => drawing.to_image()?.save(path, provenance),
        Format::Svg => write_bytes(path, drawing.to_svg(provenance)?.as_bytes()),
        Format::Pdf => write_bytes(path, &drawing.to_pdf(provenance)),
    }
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_file(path, |out| out.write_all(bytes))
}

#[cfg(test)]
#[path = "figure_tests.rs"]
mod tests;
