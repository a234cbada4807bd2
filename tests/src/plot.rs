//! Pictures of a run.

pub mod bev;
pub mod scene;
mod svg;
