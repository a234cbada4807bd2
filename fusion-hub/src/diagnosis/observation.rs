//! A frame as a survey sees it.

use v2x_common::detection::DetectionFrame;
use v2x_common::reported::Reported;
use v2x_common::time::Timestamp;

/// A frame as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// With its detections in the map frame.
    pub frame: &'a DetectionFrame,
    /// How it was written.
    pub reported: &'a Reported,
    /// When it arrived, by the receiver's clock.
    pub received_at: Timestamp,
}
