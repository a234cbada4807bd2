//! Error and timing against a parameter of a scenario.

pub mod figures;
pub mod files;
pub mod results;
pub mod rows;
pub mod text;
