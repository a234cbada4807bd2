//! Error and timing against a parameter of a scenario.

pub(crate) mod figures;
pub(crate) mod files;
pub(crate) mod results;
pub(crate) mod rows;
pub(crate) mod text;
mod verdict;
