//! Two tracks of one object: found by what frames report, and made one.
//!
//! An outlying detection begins a track of its own beside the one that it belongs to, and from then on the
//! two share the object's detections. A frame that sees two real objects mostly reports both; a frame that
//! sees one object with two tracks reports one. A sequential probability ratio test (Wald 1945) over such
//! frames decides. A track that has hardly a chance of being reported, since its object seems to be gone, is no
//! witness: it must not take over the object that has come in its place.

use crate::agents::AgentSlot;
use crate::frames::FrameSlot;
use std::collections::HashMap;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Natural logarithm of the odds from which on two tracks are one: 1000 to 1.
const MERGE_AT: f64 = 6.907_755_278_982_137;
/// The longest memory in favour of two objects: as much.
const DISTINCT_AT_MOST: f64 = -MERGE_AT;
/// Share of frames in which two tracks of one object are both reported: clutter beside it.
const BOTH_REPORTED_OF_ONE: f64 = 0.02;
/// Of being reported, so that nothing is divided by zero.
const LEAST_PROBABILITY: f64 = 1e-9;
/// How long a pair that no longer competes is remembered.
const MEMORY: Span = Span::from_millis(30_000);

/// Most testimonies held; beyond it new pairs stay two.
const MAX_TESTIMONIES: usize = 1 << 18;

/// Two tracks, the older first.
type Pair = (TrackId, TrackId);

/// What a frame says of two tracks that compete for its reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    one_reported: f64,
    both_reported: f64,
}

impl Weights {
    /// Where the frame reports the two tracks with these probabilities: that there is such an object, and that it is
    /// detected.
    pub fn of(report_probabilities: [f64; 2]) -> Self {
        let [p, q] = report_probabilities.map(|probability| probability.clamp(LEAST_PROBABILITY, 0.999));
        let at_least_one = 1.0 - (1.0 - p) * (1.0 - q);
        let both_of_two = p * q / at_least_one;
        Self {
            // Whatever a sensor claims, one report never speaks for two objects, nor two for one.
            one_reported: libm::log((1.0 - BOTH_REPORTED_OF_ONE) / (1.0 - both_of_two)).max(0.0),
            both_reported: libm::log(BOTH_REPORTED_OF_ONE / both_of_two).min(0.0),
        }
    }
}

/// All agents' evidence on a pair.
#[derive(Clone, Copy, Debug, Default)]
struct Verdict {
    log_odds: f64,
    /// Agents that mostly report both.
    vetoes: u32,
    noted_at: Timestamp,
}

/// Evidence on pairs of tracks that compete for reports.
#[derive(Debug, Default)]
pub struct Duplicates {
    verdicts: HashMap<Pair, Verdict>,
    /// Each agent's log-odds of one object.
    testimonies: HashMap<(Pair, AgentSlot), f64>,
    /// What frames of the newest instant have added to testimonies.
    newest: Vec<Noted>,
}

/// What a frame has added to an agent's log-odds of one object.
#[derive(Clone, Copy, Debug)]
struct Noted {
    frame: FrameSlot,
    at: Timestamp,
    of: (Pair, AgentSlot),
    added: f64,
}

impl Duplicates {
    /// Takes in what a frame of this agent says of two tracks that compete for its reports, both in its view.
    /// Returns the pair, the older first, if it is now one object to all that tell.
    ///
    /// An agent that mostly reports both has a veto: to others one of two objects may be hidden behind the
    /// other, frame after frame.
    pub fn note(
        &mut self,
        (a, b): Pair,
        both_reported: bool,
        (agent, weights): (AgentSlot, &Weights),
        (frame, at): (FrameSlot, Timestamp),
    ) -> Option<Pair> {
        let pair = (a.min(b), a.max(b));
        if self.testimonies.len() >= MAX_TESTIMONIES && !self.testimonies.contains_key(&(pair, agent)) {
            return None;
        }
        let before = self.testimonies.entry((pair, agent)).or_default();
        let evidence = if both_reported { weights.both_reported } else { weights.one_reported };
        let added = (*before + evidence).max(DISTINCT_AT_MOST) - *before;
        if self.newest.first().is_some_and(|noted| noted.at != at) {
            self.newest.clear();
        }
        self.newest.push(Noted { frame, at, of: (pair, agent), added });
        self.add(added, (pair, agent));
        let verdict = self.verdicts.entry(pair).or_default();
        verdict.noted_at = verdict.noted_at.max(at);
        (verdict.vetoes == 0 && verdict.log_odds >= MERGE_AT).then_some(pair)
    }

    /// Takes back what a frame of the newest instant has said: it is associated again, and may say something else.
    pub fn retract(&mut self, frame: (FrameSlot, Timestamp)) {
        let taken_back: Vec<Noted> =
            self.newest.extract_if(.., |noted| (noted.frame, noted.at) == frame).collect();
        for Noted { of, added, .. } in taken_back {
            self.add(-added, of);
        }
    }

    /// Adds to an agent's log-odds of one object; nothing, where the pair has been forgotten.
    fn add(&mut self, added: f64, of: (Pair, AgentSlot)) {
        let Some(testimony) = self.testimonies.get_mut(&of) else { return };
        let before = *testimony;
        *testimony += added;
        let verdict = self.verdicts.entry(of.0).or_default();
        verdict.log_odds += added;
        verdict.vetoes += u32::from(*testimony < 0.0);
        verdict.vetoes -= u32::from(before < 0.0);
    }

    /// Forgets pairs of which a track is gone, or that have not competed for long.
    pub fn forget(&mut self, now: Timestamp, lives: impl Fn(TrackId) -> bool) {
        self.verdicts.retain(|(older, younger), verdict| {
            now - verdict.noted_at <= MEMORY && lives(*older) && lives(*younger)
        });
        let verdicts = &self.verdicts;
        self.testimonies.retain(|(pair, _), _| verdicts.contains_key(pair));
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("duplicates.merge_at", MERGE_AT.to_string()),
        ("duplicates.both_reported_of_one", BOTH_REPORTED_OF_ONE.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agents::Agents;
    use v2x_common::id::AgentId;

    const PAIR: Pair = (TrackId(7), TrackId(3));
    const NOW: (FrameSlot, Timestamp) = (FrameSlot(0), Timestamp::EPOCH);

    /// Frames until the pair is merged, where each frame reports both tracks or one.
    fn merged_after(both_reported: impl IntoIterator<Item = bool>) -> Option<usize> {
        let mut duplicates = Duplicates::default();
        let weights = Weights::of([0.95; 2]);
        both_reported.into_iter().position(|both| {
            let merge = duplicates.note(PAIR, both, (AgentSlot::default(), &weights), NOW);
            assert!(merge.is_none_or(|pair| pair == (TrackId(3), TrackId(7))));
            merge.is_some()
        })
    }

    #[test]
    fn tracks_that_take_turns_are_one_object() {
        assert_eq!(merged_after([false; 3]), Some(2));
    }

    #[test]
    fn a_track_whose_object_seems_gone_does_not_take_over_another_one() {
        let mut duplicates = Duplicates::default();
        let weights = Weights::of([1e-3, 0.999]);
        for _ in 0..100 {
            let merge = duplicates.note(PAIR, false, (AgentSlot::default(), &weights), NOW);
            assert_eq!(merge, None);
        }
    }

    #[test]
    fn tracks_that_are_reported_together_stay_two_through_some_misses() {
        assert_eq!(merged_after([[true; 5].as_slice(), &[false; 3]].concat()), None);
    }

    #[test]
    fn two_objects_of_which_most_agents_see_only_one_stay_two() {
        let mut agents = Agents::default();
        let slots = ["rsu", "ego", "van"].map(|name| agents.slot_for(AgentId::new(name).unwrap()));
        let mut duplicates = Duplicates::default();
        let weights = Weights::of([0.95; 2]);
        for _ in 0..100 {
            for slot in slots {
                let both = slot == slots[0];
                assert_eq!(duplicates.note(PAIR, both, (slot, &weights), NOW), None);
            }
        }
    }

    #[test]
    fn what_is_taken_back_counts_for_nothing_and_against_nothing() {
        let weights = Weights::of([0.95; 2]);
        let later = (FrameSlot(1), Timestamp::EPOCH + Span::from_millis(1));
        for both_reported in [false, true] {
            let mut duplicates = Duplicates::default();
            let mut note = |both, at| {
                let merge = duplicates.note(PAIR, both, (AgentSlot::default(), &weights), at);
                duplicates.retract((FrameSlot(2), at.1));
                merge.is_some()
            };
            assert!(!note(false, NOW) && !note(false, NOW), "one short of a merger");
            for _ in 0..10 {
                let both = (AgentSlot::default(), &weights);
                assert_eq!(duplicates.note(PAIR, both_reported, both, later).is_some(), !both_reported);
                duplicates.retract(later);
            }
            assert!(duplicates.note(PAIR, false, (AgentSlot::default(), &weights), later).is_some());
        }
    }

    #[test]
    fn pairs_are_forgotten_with_their_tracks() {
        let mut duplicates = Duplicates::default();
        let weights = Weights::of([0.95; 2]);
        let note =
            |duplicates: &mut Duplicates| duplicates.note(PAIR, false, (AgentSlot::default(), &weights), NOW);
        note(&mut duplicates);
        note(&mut duplicates);
        duplicates.forget(Timestamp::EPOCH, |id| id != TrackId(7));
        assert_eq!(note(&mut duplicates), None, "the count begins anew");
    }
}
