//! Figures: recorded traffic, a bird's-eye view of a run, curves and dot plots.

pub(crate) mod bev;
pub(crate) mod curves;
pub(crate) mod dots;
mod pdf;
pub(crate) mod recorded;
pub(crate) mod scene;
pub(crate) mod sheet;
mod svg;
mod ticks;
