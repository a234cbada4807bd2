//! The paper's tables and figures, ours beside them.

pub mod figures;
pub mod files;
pub mod gain;
pub mod html;
pub mod kind;
pub mod latex;
pub mod published;
pub mod results;
pub mod rows;
pub mod study;
pub mod text;
