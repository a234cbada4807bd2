//! Figures: recorded traffic, bird's-eye views, curves and dot plots.

pub(crate) mod bev;
mod classes;
pub(crate) mod comparison;
pub(crate) mod curves;
pub(crate) mod dots;
pub(crate) mod figure_parts;
mod labels;
mod legend;
pub(crate) mod marker;
mod pdf;
pub(crate) mod recorded;
pub(crate) mod recorded_scene;
pub(crate) mod scene;
pub(crate) mod sheet;
mod svg;
mod ticks;
