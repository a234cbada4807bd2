//! Whether two tracks are of one object: a sequential probability ratio test (Wald 1945).
//!
//! An outlying detection initiates a second track beside that of its object, and from then on the two share the object's
//! detections. A frame that covers two objects mostly holds a detection of each; a frame that covers one object with two
//! tracks holds one. A track that is unlikely to be detected, since its object seems to be gone, adds no evidence: it
//! must not take over an object that has come to its place.

use crate::track::FrameSlot;
use crate::values::AgentSlot;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Natural logarithm of the odds from which on two tracks are one: 1000 to 1.
const MERGE_AT: f64 = 6.907_755_278_982_137;
/// The most that can be remembered in favour of two objects: as much.
const DISTINCT_AT_MOST: f64 = -MERGE_AT;
/// Share of frames with a detection of each of two tracks of one object: clutter beside it.
const BOTH_DETECTED_OF_ONE: f64 = 0.02;
/// Least probability of a detection: nothing is divided by zero.
const LEAST_PROBABILITY: f64 = 1e-9;
/// How long a pair that no longer competes is remembered.
const MEMORY: Span = Span::from_millis(30_000);

/// Most log-odds held; beyond it new pairs are not tested.
const MAX_LOG_ODDS: usize = 1 << 18;

/// Two tracks, the older first.
type Pair = (TrackId, TrackId);

/// The log-likelihood ratios of one object over two, for what a frame holds of two competing tracks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weights {
    one_detected: f64,
    both_detected: f64,
}

impl Weights {
    /// Where the frame holds a detection of each track with these probabilities: of existence times of detection.
    pub(super) fn of(detection_probabilities: [f64; 2]) -> Self {
        let [p, q] = detection_probabilities.map(|probability| probability.clamp(LEAST_PROBABILITY, 0.999));
        let at_least_one = 1.0 - (1.0 - p) * (1.0 - q);
        let both_of_two = p * q / at_least_one;
        Self {
            // For any declared sensor, one detection is no evidence for two objects, nor two for one.
            one_detected: libm::log((1.0 - BOTH_DETECTED_OF_ONE) / (1.0 - both_of_two)).max(0.0),
            both_detected: libm::log(BOTH_DETECTED_OF_ONE / both_of_two).min(0.0),
        }
    }
}

/// Two tracks that compete for a detection of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CompetingPair {
    /// Their ids.
    pub(super) tracks: [TrackId; 2],
    /// Whether the frame holds a detection of each.
    pub(super) both_detected: bool,
    /// The evidence of the frame.
    pub(super) weights: Weights,
}

/// The frame that holds a detection of one or both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Witness {
    pub(super) agent: AgentSlot,
    pub(super) frame: FrameSlot,
    pub(super) captured_at: Timestamp,
}

/// The evidence of all agents on a pair.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Evidence {
    log_odds: f64,
    /// Agents whose own log-odds are for two objects.
    vetoes: u32,
    noted_at: Timestamp,
}

/// The tests of all pairs of tracks that compete for detections.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct SequentialTest {
    evidence: HashMap<Pair, Evidence>,
    /// The log-odds of one object by each agent.
    log_odds: HashMap<(Pair, AgentSlot), f64>,
    /// What frames of the newest instant have added to log-odds.
    newest: Vec<Noted>,
}

/// What a frame has added to an agent's log-odds of one object.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Noted {
    frame: FrameSlot,
    at: Timestamp,
    of: (Pair, AgentSlot),
    added: f64,
}

impl SequentialTest {
    /// Adds the evidence of a frame about two competing tracks, both covered. The pair, the older track first, if it is one
    /// object by now.
    ///
    /// An agent that mostly detects both has a veto: to other agents one of two objects may be occluded by the other in
    /// every frame.
    pub(super) fn note(&mut self, competing: &CompetingPair, witness: &Witness) -> Option<Pair> {
        let CompetingPair { tracks: [a, b], both_detected, weights } = *competing;
        let Witness { agent, frame, captured_at: at } = *witness;
        let pair = (a.min(b), a.max(b));
        if self.log_odds.len() >= MAX_LOG_ODDS && !self.log_odds.contains_key(&(pair, agent)) {
            return None;
        }
        let before = self.log_odds.entry((pair, agent)).or_default();
        let evidence = if both_detected { weights.both_detected } else { weights.one_detected };
        let added = (*before + evidence).max(DISTINCT_AT_MOST) - *before;
        if self.newest.first().is_some_and(|noted| noted.at != at) {
            self.newest.clear();
        }
        self.newest.push(Noted { frame, at, of: (pair, agent), added });
        self.add(added, (pair, agent));
        let known = self.evidence.entry(pair).or_default();
        known.noted_at = known.noted_at.max(at);
        (known.vetoes == 0 && known.log_odds >= MERGE_AT).then_some(pair)
    }

    /// Takes back what a frame of the newest instant has added: it is associated again.
    pub(super) fn retract(&mut self, frame: FrameSlot, at: Timestamp) {
        let retracted: Vec<Noted> =
            self.newest.extract_if(.., |noted| (noted.frame, noted.at) == (frame, at)).collect();
        for Noted { of, added, .. } in retracted {
            self.add(-added, of);
        }
    }

    /// Adds to an agent's log-odds of one object; nothing, where the pair has been forgotten.
    fn add(&mut self, added: f64, of: (Pair, AgentSlot)) {
        let Some(log_odds) = self.log_odds.get_mut(&of) else { return };
        let before = *log_odds;
        *log_odds += added;
        let known = self.evidence.entry(of.0).or_default();
        known.log_odds += added;
        known.vetoes += u32::from(*log_odds < 0.0);
        known.vetoes -= u32::from(before < 0.0);
    }

    /// Forgets pairs of which a track was deleted, or that have not competed for long.
    pub(super) fn forget(&mut self, now: Timestamp, lives: impl Fn(TrackId) -> bool) {
        self.evidence.retain(|(older, younger), known| {
            now - known.noted_at <= MEMORY && lives(*older) && lives(*younger)
        });
        let evidence = &self.evidence;
        self.log_odds.retain(|(pair, _), _| evidence.contains_key(pair));
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("duplicates.merge_at", MERGE_AT.to_string()),
        ("duplicates.both_reported_of_one", BOTH_DETECTED_OF_ONE.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::AgentNames;
    use v2x_common::id::AgentId;

    const TRACKS: [TrackId; 2] = [TrackId(7), TrackId(3)];
    const LIKELY: [f64; 2] = [0.95; 2];

    fn witness(frame: u32) -> Witness {
        let captured_at = Timestamp::EPOCH + Span::from_millis(i64::from(frame));
        Witness { agent: AgentSlot::default(), frame: FrameSlot(frame), captured_at }
    }

    fn pair(both_detected: bool, probabilities: [f64; 2]) -> CompetingPair {
        CompetingPair { tracks: TRACKS, both_detected, weights: Weights::of(probabilities) }
    }

    /// Frames until the pair is one object, where each frame holds a detection of each track, or one detection.
    fn merged_after(both_detected: impl IntoIterator<Item = bool>) -> Option<usize> {
        let mut test = SequentialTest::default();
        both_detected.into_iter().position(|both| {
            let merge = test.note(&pair(both, LIKELY), &witness(0));
            assert!(merge.is_none_or(|pair| pair == (TrackId(3), TrackId(7))));
            merge.is_some()
        })
    }

    #[test]
    fn tracks_that_share_the_detections_of_an_object_are_one() {
        assert_eq!(merged_after([false; 3]), Some(2));
    }

    #[test]
    fn a_track_that_is_unlikely_to_be_detected_does_not_take_over_another_one() {
        let mut test = SequentialTest::default();
        for _ in 0..100 {
            assert_eq!(test.note(&pair(false, [1e-3, 0.999]), &witness(0)), None);
        }
    }

    #[test]
    fn tracks_that_were_detected_together_stay_two_through_some_missed_detections() {
        assert_eq!(merged_after([[true; 5].as_slice(), &[false; 3]].concat()), None);
    }

    #[test]
    fn two_objects_of_which_most_agents_detect_only_one_stay_two() {
        let mut agents = AgentNames::default();
        let slots = ["rsu", "ego", "van"].map(|name| agents.slot_for(AgentId::new(name).unwrap()));
        let mut test = SequentialTest::default();
        for _ in 0..100 {
            for agent in slots {
                let competing = pair(agent == slots[0], LIKELY);
                assert_eq!(test.note(&competing, &Witness { agent, ..witness(0) }), None);
            }
        }
    }

    #[test]
    fn a_retracted_frame_counts_neither_for_nor_against_a_merge() {
        for both_detected in [false, true] {
            let mut test = SequentialTest::default();
            for _ in 0..2 {
                assert_eq!(test.note(&pair(false, LIKELY), &witness(0)), None, "one short of a merge");
            }
            for _ in 0..10 {
                let found = test.note(&pair(both_detected, LIKELY), &witness(1));
                assert_eq!(found.is_some(), !both_detected);
                test.retract(witness(1).frame, witness(1).captured_at);
            }
            assert!(test.note(&pair(false, LIKELY), &witness(1)).is_some());
        }
    }

    #[test]
    fn pairs_are_forgotten_with_their_tracks() {
        let mut test = SequentialTest::default();
        test.note(&pair(false, LIKELY), &witness(0));
        test.note(&pair(false, LIKELY), &witness(0));
        test.forget(Timestamp::EPOCH, |id| id != TrackId(7));
        assert_eq!(test.note(&pair(false, LIKELY), &witness(0)), None, "the count begins again");
    }
}
