//! Assumptions and mode of registration.

use serde::{Deserialize, Serialize};
use v2x_common::sensor::Accuracy;
use v2x_common::time::Span;

/// Correlation time of an agent's errors, s. Clocks and poses drift within minutes.
pub const MEMORY_S: f64 = 60.0;
/// Reports further apart in time are not compared: half a period at 3 Hz.
pub const LONGEST_GAP: Span = Span::from_millis(150);
/// Most shared objects of one frame that are compared: more add little information about an error common to the frame.
pub const MAX_SHARED_OF_FRAME: usize = 8;
/// Reports of a track after which its velocity is used.
pub const REPORTS_FOR_VELOCITY: u32 = 5;
/// An agent that declares at most this is a reference: it has been surveyed (0.1 m, 0.1°, 1 ms).
pub const REFERENCE: Accuracy =
    Accuracy { position_m: 0.1, yaw_rad: 0.1 / 57.295_779_513_082_32, clock_s: 1e-3 };

/// What is done about agents' clock and pose errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Registration {
    /// Nothing.
    Off,
    /// They are estimated and published.
    Estimate,
    /// They are estimated, and corrected where they are observable and significant.
    #[default]
    Correct,
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("registration.memory_s", MEMORY_S.to_string()),
        ("registration.longest_gap_s", LONGEST_GAP.as_secs_f64().to_string()),
        ("registration.shared_of_frame", MAX_SHARED_OF_FRAME.to_string()),
        ("registration.reports_for_velocity", REPORTS_FOR_VELOCITY.to_string()),
        ("registration.reference", format!("{REFERENCE:?}")),
    ]
}
