//! A frame of a log.

use v2x_common::detection::DetectionFrame;
use v2x_common::reported::Reported;
use v2x_common::time::Timestamp;

/// A frame with its time of arrival.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// By the clock of the log.
    pub received_at: Timestamp,
    /// The frame.
    pub frame: DetectionFrame,
    /// How it was written.
    pub reported: Reported,
}
