//! The kit for other projects' tests, as they would use it: without the laboratory and without a program of ours.
//!
//! `cargo test -p v2x-lab --no-default-features --features loopback --test loopback`

mod delays;
mod descriptions;
mod endings;
mod guide;
mod mistakes;

use std::time::Duration;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::id::FrameId;

/// How long any one event may take on a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(60);

/// A wide Δmax: no test is about what a busy machine holds up by less than 20 s.
const PATIENT_HUB: &str = "delta_max_ms = 20000\ncoast_ms = 20000";

/// What the hub says of a frame where this is the first fused frame that contains it.
fn inclusion(fused: &FusedFrame, frame: FrameId) -> Option<Inclusion> {
    fused.includes.iter().find(|inclusion| inclusion.frame == frame).copied()
}
