//! Interpolation methods of the papers: surfaces from given points, normals and shape handles.
//!
//! | file | method |
//! |---|---|
//! | [`pia`] | progressive iterative interpolation as its authors ran it |
//! | [`thall`] | Thall's iteration by local masks, his error metrics and attributes |
//! | [`nearest`] | Maekawa, Matsumoto & Namiki's iteration by nearest points |
//! | [`normals`] | given normals: Thall's rotation of 1-rings, for every primal scheme |
//! | [`zheng_cai`] | Zheng & Cai's two phases: exact centroids, normals, shape handles |
//! | [`fair_refinement`] | the freedom that they leave: best shape handles, the fairest first refined mesh |
//! | [`nasri`] | Nasri's method, beside it |
//! | [`lin_luo`] | Lin & Luo's unified schemes for curves and √3 surfaces |
//! | [`mod@bending`] | the bending of surfaces of any scheme, by which they are compared |
//! | [`halstead`] | fair interpolation as a constrained least-squares problem, without a matrix; iterations watched by it |
//! | [`surface`] | from a control mesh to the surface: levels, limit points, normals |
//! | [`solver`] | the front door: the control mesh by any method, by `auto` unless told; once, or again for points that move |
//! | [`staged`] | curves, then smooth vertices, or some of them, by any method |
//!
//! This room builds on meshes, subdivision, assembly, solvers and analysis, and knows no plotting.

pub mod bending;
pub mod fair_refinement;
pub mod halstead;
pub mod lin_luo;
pub mod nasri;
pub mod nearest;
pub mod normals;
pub mod pia;
pub mod solver;
pub mod staged;
pub mod surface;
pub mod thall;
pub mod zheng_cai;

pub use solver::{
    Interpolator, Options, Tolerance, Watch, interpolate, interpolate_watched, limit_points, solve_stored,
};
