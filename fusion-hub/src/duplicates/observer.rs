//! Reads assignments for tracks that compete for a detection.

use super::sequential_test::{CompetingPair, SequentialTest, Weights, Witness};
use crate::filter::Filter;
use crate::track::FrameSlot;
use crate::tracker::{Assigned, TrackStore};
use serde::{Deserialize, Serialize};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// A track with more candidates in a frame than this gives no evidence of duplicates.
const MAX_CANDIDATES: usize = 8;
/// How often pairs of deleted tracks are forgotten. Track ids never come back, so it only saves memory.
const FORGET_EVERY: Span = Span::from_millis(5000);

/// Finds tracks that frames show to be of one object.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Duplicates {
    test: SequentialTest,
    /// Pairs of one object, the older track first.
    found: Vec<(TrackId, TrackId)>,
    forgotten_at: Timestamp,
}

impl Default for Duplicates {
    fn default() -> Self {
        Self { test: SequentialTest::default(), found: Vec::new(), forgotten_at: Timestamp::MIN }
    }
}

impl Duplicates {
    /// Adds the evidence of an assignment.
    ///
    /// Two tracks compete where a detection of one could have been of the other. Their distance does not matter: two
    /// tracks that share the detections of one object, each taking the nearer ones, drift further apart than their
    /// covariances allow. Where one agent only sees people and another one only cones, neither frame holds both: tracks of
    /// classes that are seldom confused are one by their place and size alone (`exclusion`).
    pub(crate) fn observe<F: Filter>(&mut self, assigned: &Assigned<'_, F>) {
        let Some(coverage) = &assigned.frame.coverage else { return };
        let predicted = assigned.predictions.measurements();
        for place in 0..assigned.n_predicted() {
            let candidates = assigned.candidates_of(place);
            if candidates.len() > MAX_CANDIDATES || !assigned.track(place).holders.leads() {
                continue;
            }
            let own = assigned.assignment.detection(place);
            for candidate in candidates {
                let Some(rival) = assigned.track_of(*candidate) else { continue };
                // Where each could have had the other's detection, the pair is met twice.
                let is_mutual =
                    || own.is_some_and(|own| assigned.candidates_of(rival).contains(&u32::from(own)));
                if rival == place || (rival < place && is_mutual()) {
                    continue;
                }
                if assigned.are_of_unlike_classes(place, rival) {
                    continue;
                }
                if own.is_none() && !coverage.covers(predicted[place].position, 0.0) {
                    continue;
                }
                let tracks = [place, rival].map(|place| assigned.track(place).id);
                let weights = Weights::of([place, rival].map(|place| predicted[place].report_probability));
                let witness = Witness {
                    agent: assigned.frame.agent,
                    frame: assigned.slot,
                    captured_at: assigned.frame.captured_at,
                };
                let pair = CompetingPair { tracks, both_detected: own.is_some(), weights };
                self.found.extend(self.test.note(&pair, &witness));
            }
        }
    }

    /// Takes back what a frame of the newest instant has shown: it is associated again.
    pub(crate) fn retract(&mut self, frame: FrameSlot, captured_at: Timestamp) {
        self.test.retract(frame, captured_at);
    }

    /// The pairs of one object that were found since the last call, the older track first.
    pub(crate) fn take_found(&mut self, found: &mut Vec<(TrackId, TrackId)>) {
        found.clear();
        found.append(&mut self.found);
    }

    /// Forgets, from time to time, pairs of which a track was deleted.
    pub(crate) fn maintain<F: Filter>(&mut self, now: Timestamp, tracks: &TrackStore<F>) {
        if now - self.forgotten_at > FORGET_EVERY {
            self.forgotten_at = now;
            self.test.forget(now, |id| tracks.contains(id));
        }
    }
}
