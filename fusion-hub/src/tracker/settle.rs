//! What can no longer matter is forgotten.

use super::{MAX_SPARE, Tracker};
use crate::agents::Agents;
use crate::filter::Filter;
use v2x_common::time::{Span, Timestamp};

/// How often pairs of tracks that are gone are forgotten; ids never come back, so it only saves memory.
const FORGET_DUPLICATES_EVERY: Span = Span::from_millis(5000);

impl<F: Filter> Tracker<F> {
    /// Replays late data and forgets what can no longer matter: nothing older than the horizon is let in.
    ///
    /// Frames are kept for `slack` longer, so that tracks can be folded where it costs nothing.
    pub(crate) fn settle(&mut self, now: Timestamp, (horizon, slack): (Timestamp, Span), agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let gone = horizon - self.config.coast;
        self.gone_before = horizon.max(now - self.config.delta_max) - self.config.coast;
        let before = self.tracks.len();
        let mut kept = 0;
        for place in 0..before {
            let track = &mut self.tracks[place];
            track.replay(&records);
            track.fold(horizon, slack, &records);
            let last_measured_at = track.last_measured_at();
            track.forget_contributors(gone);
            // However dead it seems: late data can still be its own, and how often the hub publishes must not show.
            if last_measured_at >= gone {
                if kept < place {
                    self.tracks.swap(kept, place);
                }
                kept += 1;
            }
        }
        for dropped in self.tracks.drain(kept..) {
            if dropped.holders.leads() {
                self.publisher.note_gone(&dropped);
            }
            if self.spare.len() < MAX_SPARE {
                self.spare.push(dropped);
            }
        }
        self.instant.settle(gone, (horizon, slack), &records);
        self.former.settle(horizon, slack, &records);
        self.frames.forget_before(horizon - slack);
        if now - self.duplicates_forgotten_at > FORGET_DUPLICATES_EVERY {
            self.duplicates_forgotten_at = now;
            let tracks = &self.tracks;
            let lives = |id| tracks.binary_search_by_key(&id, |track| track.id).is_ok();
            self.duplicates.forget(now, lives);
        }
    }
}
