//! What a frame tells each track, and what begins with it.

use super::{MAX_TRACKS, Tracker};
use crate::agents::Agents;
use crate::filter::Filter;
use crate::frames::{FrameSlot, LOOK, Piece};
use crate::track::{Records, Track};
use v2x_common::id::TrackId;

impl<F: Filter> Tracker<F> {
    /// Gives every expected track its report, or the look that it was not reported in.
    pub(super) fn add_evidence(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let frame = self.frames.get(slot);
        let captured_at = frame.captured_at;
        for (col, place) in self.places.iter().enumerate() {
            let track = &mut self.tracks[*place];
            let predicted = &self.predicted[col];
            if let Some(index) = self.reports[col] {
                let piece = Piece { captured_at, frame: slot, index };
                let may_move_birth =
                    track.oldest().is_some_and(|oldest| records.frames.is_before(&piece, oldest));
                track.insert(piece, Some(predicted), &records);
                if may_move_birth {
                    hold_against(track, &piece, self.instant.taken_back(), &records);
                }
            } else if let Some(look) = &frame.look
                && look.may_cover(self.expected[col].position)
                && track.born_at() <= captured_at
            {
                track.insert(Piece { captured_at, frame: slot, index: LOOK }, Some(predicted), &records);
            }
        }
    }

    pub(super) fn give_births(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        let captured_at = self.frames.get(slot).captured_at;
        for (index, holders) in &self.births {
            if self.tracks.len() >= MAX_TRACKS || self.next_counter == u32::MAX {
                self.counts.births_refused += 1;
                continue;
            }
            let birth = Piece { captured_at, frame: slot, index: *index };
            let id = self.instant.take_name(&birth).unwrap_or_else(|| {
                self.next_counter += 1;
                TrackId::new(self.config.lineage, self.next_counter - 1)
            });
            let mut track = Track::new(id, birth, self.spare.pop(), &records);
            track.holders = *holders;
            hold_against(&mut track, &birth, self.instant.taken_back(), &records);
            self.tracks.push(track);
        }
    }
}

/// Holds against a track, which now begins at `birth`, every look from then on that it does not know of. A look
/// before the birth is no evidence; should the birth move, it is held against the track then. Nor is a frame that is
/// still to be associated again.
fn hold_against<F: Filter>(
    track: &mut Track<F>,
    birth: &Piece,
    taken_back: &[FrameSlot],
    records: &Records<'_>,
) {
    for (slot, frame) in records.frames.since(birth.captured_at) {
        let Some(look) = &frame.look else { continue };
        if slot == birth.frame || taken_back.contains(&slot) || track.has_evidence_of(frame.captured_at, slot)
        {
            continue;
        }
        // Roughly is enough: whether it was in view is decided when the evidence is evaluated.
        if look.may_cover(track.latest().state.neighbourhood().0) {
            let piece = Piece { captured_at: frame.captured_at, frame: slot, index: LOOK };
            track.insert(piece, None, records);
        }
    }
}
