//! The paper's evaluation protocol: true boxes → noise → methods → counting (METHODS.md 0).
//!
//! Reads as a pipeline of pure functions: [`scene`] → [`observe`] (with the [`noise`], under
//! [`conditions`]) → a [`contender`] (a [`method`] in an [`engine_run`]) → [`prediction`] → [`instant`] →
//! [`counting`] → [`score`]; [`run`] does it for many scenes, trials and experiments, and [`tracked`] asks who is who over time.

pub mod answers;
pub mod conditions;
pub mod contender;
pub mod counting;
pub mod engine_run;
pub mod instant;
pub mod method;
pub mod moments;
pub mod noise;
pub mod observe;
pub(crate) mod parallel;
pub mod prediction;
pub mod run;
pub mod scene;
pub mod score;
pub mod tracked;

#[cfg(test)]
pub(crate) mod testing;
