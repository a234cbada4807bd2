//! Of frames of one instant the sharpest is associated first, whichever arrives first.
//!
//! What a blurred report was of is seen better once a sharp one has said where everything stands. So the reports of
//! a blurred frame are taken back when a much sharper one of the same instant comes after it, and associated again.

use super::{MAX_SPARE, Tracker};
use crate::agents::Agents;
use crate::filter::Filter;
use crate::frames::FrameSlot;
use crate::particles::versions;

/// A frame is much sharper than one with so many times its mean variance: twice the standard deviation. Sensors of a
/// kind never make each other's frames be associated again.
const SHARPER: f64 = 4.0;

impl<F: Filter> Tracker<F> {
    /// Associates blurred frames of the same instant again, unless something newer builds on them.
    pub(super) fn reconsider(&mut self, slot: FrameSlot, agents: &Agents) {
        let captured_at = self.frames.get(slot).captured_at;
        let others = || self.frames.since(captured_at).map(|(other, _)| other).filter(|other| *other != slot);
        if others().next().is_none() {
            return;
        }
        if self.frames.since(captured_at).any(|(_, frame)| frame.captured_at > captured_at) {
            return;
        }
        let Some(sharp) = self.spread(slot) else { return };
        let is_blurred =
            |other: &FrameSlot| self.spread(*other).is_some_and(|spread| spread > SHARPER * sharp);
        let blurred: Vec<FrameSlot> = others().filter(is_blurred).collect();
        for other in blurred {
            self.take_back(other, agents);
            self.measurements.clear();
            self.measurements.extend(self.frames.measurements(other));
            self.expect_tracks(other, agents);
            self.associate(other);
            self.add_evidence(other, agents);
            self.give_births(other, agents);
            if self.particles.is_some() {
                versions::order(&mut self.tracks, &mut self.spare);
            }
        }
        self.spare.truncate(MAX_SPARE);
    }

    /// Mean variance of a frame's positions along an axis, m².
    fn spread(&self, slot: FrameSlot) -> Option<f64> {
        let variances = self.frames.measurements(slot).map(|z| (z.r.xx + z.r.yy) / 2.0);
        let (sum, count) = variances.fold((0.0, 0.0), |(sum, count), variance| (sum + variance, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }

    /// As if the frame had never been associated.
    fn take_back(&mut self, slot: FrameSlot, agents: &Agents) {
        let records = Self::records(&self.config, &self.frames, agents);
        for track in &mut self.tracks {
            track.take_back(slot, &records);
        }
        let mut kept = 0;
        for place in 0..self.tracks.len() {
            if !self.tracks[place].is_without_reports() {
                self.tracks.swap(kept, place);
                kept += 1;
            }
        }
        self.spare.extend(self.tracks.drain(kept..));
    }
}
