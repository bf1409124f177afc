//! Library of the programs: flags and MESH names, tables and figures, studies that several of them print.
//!
//! | room | holds | must not know |
//! |---|---|---|
//! | [`report`] | tables, comparison of tables, plots, pictures of meshes | how the numbers were computed |
//! | [`cli`] | flags, MESH names, exit status, progress | formulas |
//! | [`studies`] | tables and figures that more than one program makes | – |
//! | [`programs`] | the programs: parse, call the library, write | – |

#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod cli;
pub mod programs;
pub mod report;
pub mod studies;
