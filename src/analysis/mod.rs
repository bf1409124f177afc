//! Why a method converges, stalls or fails: spectra, predicted and observed rates, ω sweeps.
//! This room knows no plotting.

pub mod comparison;
pub mod dense;
pub mod lanczos;
pub mod predict;
pub mod rate;
pub mod spectrum;
pub mod splitting;
pub mod sweep;

pub use spectrum::{Extremes, Spectrum};
