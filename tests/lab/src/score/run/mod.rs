//! The score of a simulated or recorded run.

mod agent;
pub(crate) mod error;
pub(crate) mod fused;
pub(crate) mod scored_run;
pub(crate) mod simulated;
pub(crate) mod summary;
mod window;

#[cfg(test)]
pub(crate) mod test_run;
#[cfg(test)]
mod tests;
