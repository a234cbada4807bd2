//! The program `v2x` as a user runs it.

mod by_hand;
mod certs;
mod check;
mod closed_output;
mod configuration;
mod demo;
mod documents;
mod faults;
mod full_router;
mod mistakes;
mod monitoring;
mod pinned;
mod proxy;
mod recording;
mod replay;
mod runs;
mod shells;
mod sumo;
mod watch;
mod web;
mod world;
mod world_formats;

/// Reads the list of processes from `/proc`.
#[cfg(target_os = "linux")]
mod endings;

mod support;
