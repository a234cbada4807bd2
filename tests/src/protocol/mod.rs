//! The paper's evaluation protocol: true boxes → noise → methods → counting (METHODS.md 0).
//!
//! Reads as a pipeline of pure functions: [`scene`] → [`observe`] (with the [`noise`]) → [`method`] →
//! [`counting`] → [`moments`]; [`run`] does it for many scenes, trials and levels of noise.

pub mod counting;
pub mod engine_run;
pub mod method;
pub mod moments;
pub mod noise;
pub mod observe;
pub mod run;
pub mod scene;

#[cfg(test)]
mod testing;
