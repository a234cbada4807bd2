//! Of frames of one instant the sharpest is associated first, whichever arrives first.
//!
//! What a blurred report was of is seen better once a sharp one has said where everything stands. So the reports of
//! a blurred frame are taken back when a much sharper one of the same instant comes after it, and associated again.
//! All that the frame has said is taken back with them: what it told of duplicates, and, with association particles,
//! how it weighed them. Particles are drawn again by every frame, which cannot be undone for one of several; so these
//! go back to where they were before the instant, and all its frames are associated anew, the blurred ones last.
//! Only tracks that were made one stay so.

use super::Tracker;
use crate::agents::Agents;
use crate::filter::Filter;
use crate::frames::FrameSlot;
use crate::particles::versions;
use crate::track::Track;

/// A frame is much sharper than one with so many times its mean variance: twice the standard deviation. Sensors of a
/// kind never make each other's frames be associated again.
const SHARPER: f64 = 4.0;

impl<F: Filter> Tracker<F> {
    /// Takes note of the time of a frame that has just been stored.
    pub(super) fn begin_instant(&mut self, slot: FrameSlot) {
        let captured_at = self.frames.get(slot).captured_at;
        let is_first = self.frames.since(captured_at).nth(1).is_none();
        self.instant.begin(captured_at, is_first && self.config.reconsider, &mut self.spare);
    }

    /// The frames of the same instant that are much more blurred; none, where something newer builds on them, or
    /// particles cannot go back.
    pub(super) fn blurred_before(&self, slot: FrameSlot) -> Vec<FrameSlot> {
        let can_go_back = self.particles.is_none() || self.instant.is_whole();
        let captured_at = self.frames.get(slot).captured_at;
        let since = || self.frames.since(captured_at);
        let is_alone = since().nth(1).is_none();
        if !self.config.reconsider || !can_go_back || is_alone {
            return Vec::new();
        }
        if since().any(|(_, frame)| frame.captured_at > captured_at) {
            return Vec::new();
        }
        let Some(sharp) = self.spread(slot) else { return Vec::new() };
        let is_blurred =
            |other: &FrameSlot| self.spread(*other).is_some_and(|spread| spread > SHARPER * sharp);
        since().map(|(other, _)| other).filter(is_blurred).collect()
    }

    /// After a frame has been taken in: associates blurred ones of the same instant again.
    pub(super) fn reconsider(&mut self, (slot, blurred): (FrameSlot, Vec<FrameSlot>), agents: &Agents) {
        let captured_at = self.frames.get(slot).captured_at;
        let again: Vec<FrameSlot> = match self.particles {
            None => blurred,
            Some(_) => {
                let others = self.frames.since(captured_at).map(|(other, _)| other);
                others.filter(|other| !blurred.contains(other)).chain(blurred.iter().copied()).collect()
            }
        };
        again.iter().for_each(|frame| self.duplicates.retract((*frame, captured_at)));
        if !again.contains(&slot) {
            self.find_duplicates(slot);
        }
        versions::order(&mut self.tracks, &mut self.spare);
        self.take_back(&again, agents);
        while let Some(frame) = self.instant.next_taken_back() {
            self.take_in(frame, agents);
            self.find_duplicates(frame);
            versions::order(&mut self.tracks, &mut self.spare);
        }
    }

    /// Mean variance of a frame's positions along an axis, m².
    fn spread(&self, slot: FrameSlot) -> Option<f64> {
        let variances = self.frames.measurements(slot).map(|z| (z.r.xx + z.r.yy) / 2.0);
        let (sum, count) = variances.fold((0.0, 0.0), |(sum, count), variance| (sum + variance, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }

    /// As if these frames had never been associated.
    fn take_back(&mut self, frames: &[FrameSlot], agents: &Agents) {
        self.instant.take_back(frames.iter().copied(), &self.tracks);
        self.instant.restore(&mut self.tracks, &mut self.spare);
        let records = Self::records(&self.config, &self.frames, agents);
        for track in &mut self.tracks {
            frames.iter().for_each(|frame| track.take_back(*frame, &records));
        }
        let is_empty = |track: &mut Track<F>| track.is_without_reports();
        self.spare.extend(self.tracks.extract_if(.., is_empty));
        self.instant.forget_names_of(&self.tracks);
    }
}
