//! The paper's tables and figures: computed values beside the paper's.

pub(crate) mod figures;
pub(crate) mod files;
pub(crate) mod gain;
pub(crate) mod html;
pub(crate) mod kind;
pub(crate) mod latex;
pub(crate) mod moment;
pub(crate) mod published;
pub(crate) mod results;
pub(crate) mod rows;
pub(crate) mod study;
pub(crate) mod text;
mod verdict;
