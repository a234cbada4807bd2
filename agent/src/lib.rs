//! Simulated agents: ego vehicles and roadside units.
//!
//! The pipeline, all of it pure: [`scenario`] (what the file says) → [`world`] (ground truth as a
//! function of time) → [`sensor`] (what an agent sees of it, with [`noise`] and [`pose_error`], stamped by its
//! [`clock`]) → [`sending`] (what of it is sent, and when) → [`link`] (when that arrives). The same (scenario, seed, time) gives the same bits in every process: transcendental
//! functions come from `libm`, random numbers from [`random`].

pub mod clock;
pub mod link;
pub mod noise;
pub mod outbox;
pub mod pose_error;
pub mod random;
pub mod scenario;
pub mod sending;
pub mod sensor;
#[cfg(feature = "net")]
pub mod shell;
pub mod truth;
pub mod world;
