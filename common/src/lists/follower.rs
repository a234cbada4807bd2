//! A list that follows a hub's by its key frames and what changes between them.

use super::delta::{DeltaFrame, ListUpdate, extrapolated};
use crate::fused::FusedFrame;
use crate::id::HubId;
use std::collections::BTreeMap;
use std::fmt;

/// Which frame of which run of which hub.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameNumber {
    /// The hub.
    pub hub: HubId,
    /// The hub's lineage.
    pub lineage: u32,
    /// Number in this lineage.
    pub sequence: u64,
}

impl FrameNumber {
    pub(super) const fn of(frame: &FusedFrame) -> Self {
        Self { hub: frame.hub, lineage: frame.lineage, sequence: frame.sequence }
    }

    const fn of_delta(delta: &DeltaFrame) -> Self {
        Self { hub: delta.hub, lineage: delta.lineage, sequence: delta.sequence }
    }

    pub(super) fn is_of_run(&self, other: &Self) -> bool {
        (self.hub, self.lineage) == (other.hub, other.lineage)
    }
}

impl fmt::Display for FrameNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} ({:08x})", self.sequence, self.hub, self.lineage)
    }
}

/// Why a message does not move a followed list on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FollowError {
    /// A delta frame came before any key frame. The next one comes within a second.
    #[error("delta frame {delta} came before its key frame {key_sequence}")]
    NoKey {
        /// The delta frame.
        delta: FrameNumber,
        /// Number of the key frame that it is relative to.
        key_sequence: u64,
    },
    /// A delta frame is relative to another key frame than the newest one, which was lost or is of another hub.
    #[error("delta frame {delta} is relative to key frame {key_sequence}, the newest one is {held}")]
    OtherKey {
        /// The delta frame.
        delta: FrameNumber,
        /// Number of the key frame that it is relative to.
        key_sequence: u64,
        /// The newest key frame.
        held: FrameNumber,
    },
    /// A message is not newer than the list.
    #[error("frame {frame} is not newer than the list, which is of frame {}", .held.sequence)]
    NotNewer {
        /// The message.
        frame: FrameNumber,
        /// The list's frame.
        held: FrameNumber,
    },
}

/// A hub's list as key frames and delta frames give it: within [`Tolerance`](super::Tolerance) of the whole one, and within
/// the resolution of the codec.
///
/// For one hub. Messages may be lost or come twice. After an error the list is as it was.
#[derive(Clone, Debug, Default)]
pub struct DeltaFollower {
    key: Option<FusedFrame>,
    list: Option<FusedFrame>,
}

impl DeltaFollower {
    /// Takes in a message; the list as of its time. Objects are by track id, without contributors; `last_measured_at` of an
    /// object is that of its last transmission, at most a second before.
    ///
    /// # Errors
    /// Where the message is not newer than the list, or its key frame is missing.
    pub fn handle(&mut self, update: ListUpdate) -> Result<&FusedFrame, FollowError> {
        match update {
            ListUpdate::Key(frame) => {
                self.check_newer(FrameNumber::of(&frame))?;
                self.key = Some(frame.clone());
                Ok(self.list.insert(frame))
            }
            ListUpdate::Delta(delta) => {
                let frame = self.list_of(delta)?;
                Ok(self.list.insert(frame))
            }
        }
    }

    /// The newest list; `None` before the first key frame.
    pub const fn list(&self) -> Option<&FusedFrame> {
        self.list.as_ref()
    }

    fn check_newer(&self, frame: FrameNumber) -> Result<(), FollowError> {
        let Some(held) = self.list.as_ref().map(FrameNumber::of) else { return Ok(()) };
        if held.is_of_run(&frame) && frame.sequence <= held.sequence {
            return Err(FollowError::NotNewer { frame, held });
        }
        Ok(())
    }

    fn list_of(&self, delta: DeltaFrame) -> Result<FusedFrame, FollowError> {
        let (number, key_sequence) = (FrameNumber::of_delta(&delta), delta.key_sequence);
        let Some(key) = &self.key else { return Err(FollowError::NoKey { delta: number, key_sequence }) };
        let held = FrameNumber::of(key);
        if held != (FrameNumber { sequence: key_sequence, ..number }) {
            return Err(FollowError::OtherKey { delta: number, key_sequence, held });
        }
        self.check_newer(number)?;
        let elapsed = delta.fused_at - key.fused_at;
        let known = key.objects.iter().map(|object| (object.track, extrapolated(object, elapsed)));
        let mut objects: BTreeMap<_, _> = known.collect();
        for track in &delta.gone {
            objects.remove(track);
        }
        objects.extend(delta.changed.into_iter().map(|object| (object.track, object)));
        Ok(FusedFrame {
            sequence: delta.sequence,
            fused_at: delta.fused_at,
            map_frame: delta.map_frame,
            objects: objects.into_values().collect(),
            ..key.without_lists()
        })
    }
}
