//! Tables and figures that more than one program makes.

pub mod comparison;
pub mod complex_spectrum;
pub mod error_maps;
pub mod histories;
pub mod iteration_matrix;
pub mod modes;
pub mod page;
pub mod pictures;
pub mod splitting;
pub mod style;
pub mod sweep;
pub mod trajectories;
