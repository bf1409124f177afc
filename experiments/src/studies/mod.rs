//! Tables and figures that more than one program makes.

pub mod splitting;
pub mod sweep;
