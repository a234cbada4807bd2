//! Evidence: the detection or missed detection of one track in one frame.

use serde::{Deserialize, Serialize};
use v2x_common::time::Timestamp;

/// Where a frame is held in the frame store, until it is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameSlot(pub(crate) u32);

impl FrameSlot {
    /// As an index.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// In place of a detection's index: the frame holds no detection of the track.
const MISSED: u16 = u16::MAX;

/// The evidence of one frame about one track: a detection that was associated with it, or a missed detection.
///
/// A missed detection counts only where the track was in the sensor's field of view. That is decided when the evidence
/// is evaluated, with the state of that moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evidence {
    /// Capture time of the frame.
    pub captured_at: Timestamp,
    /// The frame.
    pub frame: FrameSlot,
    index: u16,
}

impl Evidence {
    /// The detection at this index of a frame.
    pub const fn detection(captured_at: Timestamp, frame: FrameSlot, index: u16) -> Self {
        Self { captured_at, frame, index }
    }

    /// A frame without a detection of the track.
    pub const fn missed(captured_at: Timestamp, frame: FrameSlot) -> Self {
        Self { captured_at, frame, index: MISSED }
    }

    /// Whether it is a detection.
    #[inline(always)]
    pub const fn is_detection(&self) -> bool {
        self.index != MISSED
    }

    /// Index of the detection in its frame; beyond all detections for a missed one.
    #[inline(always)]
    pub const fn index(&self) -> u16 {
        self.index
    }
}
