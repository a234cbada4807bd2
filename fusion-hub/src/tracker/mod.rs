//! The tracker: which detection is of which track, what initiates tracks and what deletes them.
//!
//! A frame goes through three stages: [`predict`] (the tracks that it can concern, at its capture time), [`assign`]
//! (which detection is of which), [`update`] (evidence for each track, new tracks). Registration, the search for
//! duplicates and the like read the result, [`Assigned`].

mod assign;
mod config;
mod instant;
mod occupied;
mod predict;
mod store;
#[expect(clippy::module_inception, reason = "the tracker of the layer of the tracker")]
mod tracker;
mod update;
mod whereabouts;

pub use assign::Innovations;
pub use config::{Hypotheses, Lifetimes, ParticleCount, TrackerConfig};
pub(crate) use store::TrackStore;
pub(crate) use tracker::{Assigned, Horizons, Tracker};
#[cfg(test)]
pub(crate) use {occupied::listed as occupied_listed, update::listed as update_listed};
