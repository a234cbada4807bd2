//! A track as of an earlier time, by all evidence up to the newest: the fixed-interval smoother of its state, and of
//! its existence.

use super::application::apply;
use super::context::TrackContext;
use super::contributors::Contributors;
use super::track::Track;
use crate::filter::Filter;
use crate::values::{Existence, Persistence};
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

/// A track as of an earlier time.
#[derive(Clone, Copy, Debug)]
pub struct SmoothedTrack<F> {
    /// The smoothed state.
    pub state: F,
    /// The probability that the object existed then. A detection that revived a track counts as of the same object, like
    /// the track's id.
    pub existence: f64,
    /// Whether it was rather of a real object than of a false one, by then.
    pub is_supported: bool,
    /// Mean time between frames of the agent that had detected it last by then, s.
    pub interval_s: f64,
    /// Capture time of its newest detection by then.
    pub last_measured_at: Timestamp,
}

/// Smooths tracks, one after the other, with the same buffers.
#[derive(Debug)]
pub struct FixedLagSmoother<F> {
    /// The filtered state before each later prediction, with the class whose motion parameters it has.
    states: Vec<(F, Class)>,
    /// The filtered existence before each later prediction, the length of that, and what bounds it.
    existences: Vec<(Existence, Span, Persistence)>,
    contributors: Contributors,
}

impl<F> Default for FixedLagSmoother<F> {
    fn default() -> Self {
        Self { states: Vec::new(), existences: Vec::new(), contributors: Contributors::NONE }
    }
}

impl<F: Filter> FixedLagSmoother<F> {
    /// The track as of a time that its history reaches back to; `None` where its first detection is later. Late items
    /// must have been replayed.
    ///
    /// The filter runs forward from that time through all later evidence, and the smoother comes back from the last.
    pub fn smooth(
        &mut self,
        track: &Track<F>,
        at: Timestamp,
        context: &TrackContext<'_>,
    ) -> Option<SmoothedTrack<F>> {
        if track.initiated_at() > at {
            return None;
        }
        let [until, after] = track.split_at(at);
        let mut estimate = track.filtered_at(at, context);
        self.contributors.clear();
        self.contributors.note_until(at, track.folded(), context.agents);
        self.contributors.note_until(at, track.contributors(), context.agents);
        for item in until.filter(|item| context.frames.held(item).is_some()) {
            self.contributors.note(item, context.frames.get(item.frame), context.agents);
        }
        let last_measured_at = self.contributors.last_measured_at().max(estimate.state.at());
        let (is_supported, interval_s) = (estimate.support.is_for_a_real_object(), estimate.interval_s);
        estimate.predict(at, context.synchronous);
        estimate.survive_to(at);
        self.states.clear();
        self.existences.clear();
        for item in after {
            let (state, class) = (estimate.state, estimate.motion_class());
            let (existence, since, bounds) = (estimate.existence, estimate.at, estimate.persistence);
            apply(&mut estimate, (item, context.frames.held(item)), None, context);
            if estimate.state.at() != state.at() {
                self.states.push((state, class));
            }
            if estimate.at != since {
                self.existences.push((existence, estimate.at - since, bounds));
            }
        }
        let states = self.states.iter().rev();
        let state = states.fold(estimate.state, |later, (state, class)| state.smoothed(*class, &later));
        let existences = self.existences.iter().rev();
        let existence = existences
            .fold(estimate.existence.probability(), |later, (existence, dt, bounds)| {
                existence.existed(*dt, bounds, later)
            });
        Some(SmoothedTrack { state, existence, is_supported, interval_s, last_measured_at })
    }

    /// The newest detection of each agent by then, of the track smoothed last.
    pub fn contributors(&self) -> &Contributors {
        &self.contributors
    }
}
