//! The papers' whole pipelines, built on the rooms above. This room knows no plotting.

pub mod pia;
