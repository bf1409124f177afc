//! Why a method converges, stalls or fails: spectra, predicted and observed rates, ω sweeps.
//! This room knows no plotting.

pub mod a_priori;
pub mod certificate;
pub mod comparison;
pub mod dense;
pub mod dirichlet_neumann;
pub mod eigen;
pub mod failed;
pub mod interval;
pub mod lanczos;
pub mod lines;
pub mod order_study;
pub mod own;
pub mod predict;
pub mod rate;
pub mod singularity;
pub mod spectral_radius;
pub mod spectrum;
pub mod splitting;
pub mod sweep;
pub mod tridiagonal;
pub mod valence_study;

pub use spectrum::{Extremes, Spectrum};
