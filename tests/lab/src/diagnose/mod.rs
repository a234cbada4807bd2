//! What may be wrong with an input: statistics of its sensors, and warnings in words.

pub(crate) mod offset;
pub(crate) mod survey;
pub(crate) mod warnings;
