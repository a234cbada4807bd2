//! Which objects of a frame other agents report, too, at about the same time.

use super::Tracker;
use crate::filter::Filter;
use crate::frames::{FrameSlot, Piece, StoredFrame};
use crate::registration::{LONGEST_GAP, MAX_SHARED_OF_FRAME, REPORTS_FOR_VELOCITY, Shared, Sighting, Source};
use crate::track::Track;

impl<F: Filter> Tracker<F> {
    /// Finds for each report of a tracked object one that another agent made of it. Of two agents each report is compared
    /// once, so that no error is counted twice.
    pub(super) fn find_shared(&mut self, slot: FrameSlot) {
        self.shared.clear();
        let StoredFrame { captured_at, source, id, .. } = self.frames.get(slot);
        let (captured_at, Some(source)) = (*captured_at, *source) else { return };
        let n = self.places.len();
        // Where there are more than are compared, each frame begins with others.
        let offset = usize::try_from(id.sequence).unwrap_or(0).wrapping_mul(MAX_SHARED_OF_FRAME);
        for step in 0..n {
            let col = (offset % n + step) % n;
            let Some(index) = self.reports[col] else { continue };
            let track = &self.tracks[self.places[col]];
            if !track.holders.leads() || track.latest().n_reports < REPORTS_FOR_VELOCITY {
                continue;
            }
            let piece = Piece { captured_at, frame: slot, index };
            let Some(own) = self.frames.sighting(&piece) else { continue };
            let Some((other, partner)) = self.partner_of(track, &source, &piece) else { continue };
            let motion = self.predicted[col].motion();
            self.frames.note_compared(&piece, partner.source.slot);
            self.frames.note_compared(&other, source.slot);
            self.shared.push(Shared { own, partner, motion });
            if self.shared.len() == MAX_SHARED_OF_FRAME {
                break;
            }
        }
    }

    /// The report of somebody else that says most: one of a reference, where the sender is none (and the other way
    /// round), then the nearest in time, then the first.
    fn partner_of(&self, track: &Track<F>, own: &Source, piece: &Piece) -> Option<(Piece, Sighting)> {
        let mut best = None;
        for other in track.reports_about(piece.captured_at, LONGEST_GAP) {
            let Some(source) = self.frames.get(other.frame).source else { continue };
            let is_used =
                || self.frames.was_compared(other, own.slot) || self.frames.was_compared(piece, source.slot);
            if source.slot == own.slot || is_used() {
                continue;
            }
            let gap = (other.captured_at - piece.captured_at).abs();
            let order = (source.is_reference == own.is_reference, gap);
            let is_own_work = || self.frames.held(other).is_some_and(|held| !held.is_track);
            if best.is_none_or(|(known, _)| order < known) && is_own_work() {
                best = Some((order, *other));
            }
        }
        let (_, other) = best?;
        Some((other, self.frames.sighting(&other)?))
    }
}
