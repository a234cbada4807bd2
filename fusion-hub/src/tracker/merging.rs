//! Tracks of one object: found, and made one.

use super::associate::track_of;
use super::{MAX_SPARE, Tracker};
use crate::agents::Agents;
use crate::duplicates::Weights;
use crate::filter::Filter;
use crate::frames::FrameSlot;
use crate::particles::versions;

/// A track that could have more of a frame's reports than this tells nothing about duplicates.
const MAX_RIVALS: usize = 8;

impl<F: Filter> Tracker<F> {
    /// Finds tracks that frames have shown to be of one object.
    ///
    /// Two tracks compete where a report of one could have been of the other. How far they are apart does not
    /// matter: two tracks that share one object's reports, each taking the nearer ones, push each other away
    /// further than their own covariances would allow.
    pub(super) fn find_duplicates(&mut self, slot: FrameSlot) {
        let frame = self.frames.get(slot);
        let Some(look) = frame.look.as_ref().filter(|_| self.config.resolve_duplicates) else { return };
        let (associator, places) = (&self.associator, &self.places);
        let id_of = |col: usize| self.tracks[places[col]].id;
        let track_of = track_of(associator, self.particles.as_ref());
        for (col, own) in self.reports.iter().take(associator.n_expected()).enumerate() {
            let candidates = associator.candidates_of(col);
            if candidates.len() > MAX_RIVALS || !self.tracks[places[col]].holders.leads() {
                continue;
            }
            for report in candidates {
                let Some(rival) = track_of[*report as usize] else { continue };
                let rival = rival as usize;
                // Where each could have had the other's report, the pair is met twice.
                let is_mutual =
                    || own.is_some_and(|own| associator.candidates_of(rival).contains(&u32::from(own)));
                if rival == col || (rival < col && is_mutual()) {
                    continue;
                }
                if own.is_none() && !look.covers(self.expected[col].position, 0.0) {
                    continue;
                }
                let weights = Weights::of([col, rival].map(|col| self.expected[col].report_probability));
                let (pair, witness) = ((id_of(col), id_of(rival)), (frame.agent, &weights));
                let merge = self.duplicates.note(pair, own.is_some(), witness, (slot, frame.captured_at));
                self.merges_due.extend(merge);
            }
        }
    }

    pub(super) fn merge(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        for (older, younger) in &self.merges_due {
            self.instant.forget([*older, *younger]);
            if self.particles.is_some() {
                versions::keep_leading(&mut self.tracks, *older);
                versions::keep_leading(&mut self.tracks, *younger);
            }
            let places = [older, younger].map(|id| self.tracks.binary_search_by_key(id, |track| track.id));
            if let [Ok(older), Ok(younger)] = places {
                let absorbed = self.tracks.remove(younger);
                if records.remembers_folded {
                    let merged_at = self.frames.get(slot).captured_at;
                    self.former.note(&self.tracks[older], &absorbed, merged_at);
                }
                self.tracks[older].absorb(&absorbed, &records);
                self.counts.merges += 1;
                if self.spare.len() < MAX_SPARE {
                    self.spare.push(absorbed);
                }
            }
        }
    }
}
