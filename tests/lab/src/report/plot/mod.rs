//! Pictures: of a run from above, and of figures.

pub(crate) mod bev;
pub(crate) mod curves;
pub(crate) mod dots;
mod pdf;
pub(crate) mod scene;
pub(crate) mod sheet;
mod svg;
mod ticks;
