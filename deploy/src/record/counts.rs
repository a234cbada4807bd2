//! What has been received so far.

use serde_json::{Value, json};
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;

/// Counters of received samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub(crate) samples: u64,
    pub(crate) fused_frames: u64,
    pub(crate) detection_frames: u64,
    pub(crate) journal_batches: u64,
    pub(crate) objects: usize,
    pub(crate) unreadable: u64,
}

impl Counts {
    /// Counts an entry; true where it is a fused frame.
    pub(crate) fn add(&mut self, entry: &Entry) -> bool {
        self.samples += 1;
        match Topic::of(&entry.key) {
            Some(Topic::Fused(_) | Topic::Lagged(_) | Topic::Delta(_) | Topic::Tile(..)) => {
                self.fused_frames += 1;
                return true;
            }
            Some(Topic::Detections(_)) => self.detection_frames += 1,
            Some(Topic::Journal(_)) => self.journal_batches += 1,
            _ => {}
        }
        false
    }

    pub(crate) fn to_json(self, dropped: u64) -> Value {
        json!({
            "samples": self.samples,
            "fused_frames": self.fused_frames,
            "detection_frames": self.detection_frames,
            "journal_batches": self.journal_batches,
            "objects": self.objects,
            "unreadable": self.unreadable,
            "dropped": dropped,
        })
    }
}
