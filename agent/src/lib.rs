//! Simulated agents: ego vehicles and roadside units.

pub mod truth;
