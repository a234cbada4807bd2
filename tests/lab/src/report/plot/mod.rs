//! Pictures: of a run from above, and of figures.

pub mod bev;
pub mod curves;
pub mod dots;
mod pdf;
pub mod scene;
pub mod sheet;
mod svg;
mod ticks;
