//! **limitlab**: the sparse linear systems whose solution is the control mesh of a subdivision surface that
//! passes through given points.
//!
//! A subdivision scheme sends the control points `V` (N×3) to limit points `A V`; interpolation asks for the
//! `V` with `A V = P`. This crate assembles `A = H·M` for six schemes, solves the system by direct and
//! iterative methods, and explains the convergence by spectra and proven bounds.
//!
//! The rooms, each of which uses only the ones above it: [`error`], [`output`], [`mesh`], [`schemes`],
//! [`assemble`], [`solvers`], [`analysis`], [`interpolate`].

#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod analysis;
pub mod assemble;
pub mod error;
pub mod interpolate;
pub mod memory;
pub mod mesh;
pub mod names;
pub mod output;
mod pages;
mod parallel;
mod prefetch;
pub mod schemes;
pub mod solvers;
mod text;

pub use error::{Error, Result};

/// The README's example runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// So does the guide's.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide.md")]
struct Guide;
