//! The papers' whole methods: from given points, normals and handles to a surface.
//!
//! | file | method |
//! |---|---|
//! | [`thall`] | Thall's iteration by local masks, his error metrics and attributes |
//! | [`normals`] | given normals: Thall's rotation of 1-rings, for every primal scheme |
//!
//! This room builds on meshes, subdivision, assembly, solvers and analysis, and knows no plotting.

pub mod normals;
pub mod thall;
