//! Tables and figures that more than one program makes.

pub mod comparison;
pub mod complex_spectrum;
pub mod histories;
pub mod page;
pub mod splitting;
pub mod style;
pub mod sweep;
