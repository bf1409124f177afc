//! Convergence analysis: spectra, predicted and observed rates, singularity, ω sweeps.
//! This room knows no plotting.

pub mod a_priori;
pub mod comparison;
pub mod complex_spectrum;
pub mod custom_methods;
pub mod dense;
pub mod dirichlet_neumann;
pub mod failed;
pub mod inertia;
pub mod interval;
pub mod iteration_matrix;
pub mod lanczos;
pub mod line_preconditioner;
pub mod order_study;
pub mod predict;
pub mod pseudospectrum;
pub mod rate;
mod shift_invert;
pub mod singularity;
pub mod spectral_radius;
pub mod spectrum;
pub mod splitting;
pub mod subspace_iteration;
pub mod sweep;
pub mod symmetric;
pub mod torus_symbol;
pub mod trajectories;
pub mod tridiagonal;
pub mod valence_study;
pub mod young;

pub use spectrum::{Extremes, Spectrum};
