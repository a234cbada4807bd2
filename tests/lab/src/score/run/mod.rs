//! How a simulated or recorded run did.

mod agent;
pub mod error;
pub mod fused;
pub mod scored_run;
pub mod simulated;
pub mod summary;
mod window;

#[cfg(test)]
pub(crate) mod test_run;
#[cfg(test)]
mod tests;
