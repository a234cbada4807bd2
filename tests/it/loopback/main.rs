//! The loopback kit as other projects use it in their tests, without the feature `lab` and without our programs.
//!
//! `cargo test -p v2x-lab --no-default-features --features loopback --test loopback`

mod delays;
mod descriptions;
mod endings;
mod guide;
mod lists;
mod mistakes;

use std::time::Duration;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::id::FrameId;

/// Time limit for one event on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A large Δmax: a pause of a busy machine of less than 20 s must not fail a test.
const PATIENT_HUB: &str = "delta_max_ms = 20000\ncoast_ms = 20000\nbirths = \"at-once\"";

/// The entry of a frame in the first fused frame that contains it.
fn inclusion(fused: &FusedFrame, frame: FrameId) -> Option<Inclusion> {
    fused.includes.iter().find(|inclusion| inclusion.frame == frame).copied()
}
