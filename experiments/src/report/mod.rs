//! Reports: tables (CSV, Markdown, JSON), their comparison with committed ones, and plots (PNG, SVG, PDF).
//!
//! This room takes plain columns and named series; it calls no solver and knows nothing of how a number came
//! about. What it writes is the same, byte for byte, for the same input on the same machine.
//!
//! - [`table`]: a [`Table`] of typed columns and its three forms;
//! - [`mod@fitted`]: a table in the width of a terminal;
//! - [`columns`]: the columns of a table with what each holds of a record;
//! - [`mod@compare`]: a fresh table held against a committed CSV file, within each column's tolerance;
//! - [`figure`]: a grid of panels, drawn as a list of shapes in points and written as an [`Image`] (drawn three times
//!   finer than it is written, so that every line is anti-aliased), as SVG or as PDF;
//! - [`series`] and [`plot`]: line plots, scatter plots and histograms on linear or logarithmic axes, legend
//!   beside the data;
//! - [`sparsity`]: the pattern of a sparse matrix;
//! - [`render`]: pictures of meshes, points and vectors;
//! - [`png`]: images and their files;
//! - [`provenance`]: what made a file, as every format says it;
//! - [`page`]: one HTML file with interactive plots and a view of surfaces;
//! - [`index`]: the page that leads into a folder of reports, by questions.

mod axis;
mod bitmap;
mod canvas;
pub mod columns;
pub mod compare;
pub mod figure;
pub mod fitted;
mod frame;
mod glyphs;
pub mod index;
mod number;
pub mod page;
mod pdf;
pub mod plot;
pub mod png;
pub mod provenance;
pub mod render;
pub mod series;
pub mod sparsity;
mod svg;
pub mod table;

pub use axis::Scale;
pub use canvas::{Colour, Dash, Marker};
pub use columns::Columns;
pub use compare::compare;
pub use figure::{Figure, Format, Panel};
pub use fitted::fitted;
pub use number::readable;
pub use plot::LinePlot;
pub use png::{Animation, Image};
pub use provenance::Provenance;
pub use render::{ColourMap, ColourScale, Finish, Paint, Picture, Points, ShadedMesh, Stroke, Vectors, View};
pub use series::{Rule, Series, Style, marker, palette};
pub use sparsity::SparsityPlot;
pub use table::{Cell, Column, Table};
