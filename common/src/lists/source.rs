//! When a stream of what changes needs a key frame, and what has changed since the last one.

use super::delta::DeltaFrame;
use super::tolerance::Tolerance;
use crate::fused::FusedFrame;
use crate::time::Span;

/// Longest time between two key frames: a consumer that joins waits for no longer.
const KEY_INTERVAL: Span = Span::from_millis(1000);

/// The publisher's side of a list by what changes. Pure, except for its memory of the key frame.
#[derive(Clone, Debug)]
pub struct DeltaSource {
    tolerance: Tolerance,
    key: Option<FusedFrame>,
}

impl DeltaSource {
    /// Without a key frame yet. Followed lists are within the tolerance of the whole ones.
    pub const fn new(tolerance: Tolerance) -> Self {
        Self { tolerance, key: None }
    }

    /// What has changed; `None` where a key frame is due, which is then given to [`Self::set_key`].
    pub fn delta(&self, list: &FusedFrame) -> Option<DeltaFrame> {
        let key = self.key.as_ref().filter(|key| holds(key, list))?;
        let delta = DeltaFrame::between(key, list, &self.tolerance);
        // Where most has changed, a key frame costs as much, and makes the next ones short.
        let is_short = delta.changed.len() + delta.gone.len() <= list.objects.len() / 2;
        is_short.then_some(delta)
    }

    /// Begins anew from a key frame as its consumers have it: as the wire rounds it.
    pub fn set_key(&mut self, key: FusedFrame) {
        self.key = Some(key);
    }

    /// Nobody follows: whoever comes next begins with a key frame.
    pub fn forget(&mut self) {
        self.key = None;
    }
}

/// Whether a list can be relative to the key frame.
fn holds(key: &FusedFrame, list: &FusedFrame) -> bool {
    let elapsed = list.fused_at - key.fused_at;
    elapsed >= Span::ZERO
        && elapsed < KEY_INTERVAL
        && (key.hub, key.lineage, key.map_frame) == (list.hub, list.lineage, list.map_frame)
}
