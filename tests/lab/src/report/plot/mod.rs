//! Figures: recorded traffic, bird's-eye views, curves and dot plots.

pub(crate) mod bev;
pub(crate) mod comparison;
pub(crate) mod curves;
pub(crate) mod dots;
mod pdf;
pub(crate) mod recorded;
pub(crate) mod scene;
pub(crate) mod sheet;
mod svg;
mod ticks;
