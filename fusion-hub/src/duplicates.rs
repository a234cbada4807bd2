//! Two tracks of one object: found by what frames report, and made one.
//!
//! An outlying detection begins a track of its own beside the one that it belongs to, and from then on the
//! two share the object's detections. A frame that sees two real objects mostly reports both; a frame that
//! sees one object with two tracks reports one. A sequential probability ratio test (Wald 1945) over such
//! frames decides.

use crate::association::Expected;
use crate::filter::Measurement;
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, TrackId};

/// Natural logarithm of the odds from which on two tracks are one: 1000 to 1.
const MERGE_AT: f64 = 6.907_755_278_982_137;
/// The longest memory in favour of two objects: as much.
const DISTINCT_AT_MOST: f64 = -MERGE_AT;
/// Share of frames in which two tracks of one object are both reported: clutter beside it.
const BOTH_REPORTED_OF_ONE: f64 = 0.02;

/// Evidence on pairs of tracks that compete for reports.
#[derive(Debug, Default)]
pub struct Duplicates {
    /// Each agent's log-odds of one object, by ids, the older first.
    pairs: BTreeMap<(TrackId, TrackId), Vec<(AgentId, f64)>>,
}

/// A track in the eyes of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Its number.
    pub id: TrackId,
    /// Where it was expected.
    pub expected: &'a Expected,
    /// The report of it in this frame, which had it in view.
    pub report: Option<&'a Measurement>,
}

impl Seen<'_> {
    fn x(&self) -> f64 {
        self.expected.state.kinematic.position[0]
    }
}

impl Duplicates {
    /// Takes in one frame of this agent, whose sensor has this detection probability. Returns the pairs that
    /// turn out to be one object, the older track first.
    ///
    /// An agent that mostly reports both has a veto: to others one of two objects may be hidden behind the
    /// other, frame after frame.
    pub fn note_frame(
        &mut self,
        seen: &mut [Seen<'_>],
        (agent, detection_probability): (AgentId, f64),
        gate: f64,
    ) -> Vec<(TrackId, TrackId)> {
        let p = detection_probability.clamp(0.01, 0.999);
        let at_least_one = 1.0 - (1.0 - p) * (1.0 - p);
        let both_of_two = p * p / at_least_one;
        let for_one = libm::log((1.0 - BOTH_REPORTED_OF_ONE) / (1.0 - both_of_two));
        let for_two = libm::log(BOTH_REPORTED_OF_ONE / both_of_two);
        let mut merges = Vec::new();
        let reach = 2.0 * longest_reach(seen, gate);
        seen.sort_unstable_by(|a, b| a.x().total_cmp(&b.x()).then(a.id.cmp(&b.id)));
        for (place, a) in seen.iter().enumerate() {
            for b in seen[place + 1..].iter().take_while(|b| b.x() - a.x() <= reach) {
                if !compete(a, b, gate) {
                    continue;
                }
                let evidence = if a.report.is_some() && b.report.is_some() { for_two } else { for_one };
                let pair = (a.id.min(b.id), a.id.max(b.id));
                if note_evidence(self.pairs.entry(pair).or_default(), agent, evidence) {
                    merges.push(pair);
                }
            }
        }
        merges
    }

    /// Forgets pairs of which a track is gone.
    pub fn retain(&mut self, lives: impl Fn(TrackId) -> bool) {
        self.pairs.retain(|(older, younger), _| lives(*older) && lives(*younger));
    }
}

/// Adds an agent's evidence on a pair; true where it is now one object to all that tell.
fn note_evidence(pair: &mut Vec<(AgentId, f64)>, agent: AgentId, evidence: f64) -> bool {
    let place = pair.iter().position(|(other, _)| *other == agent).unwrap_or_else(|| {
        pair.push((agent, 0.0));
        pair.len() - 1
    });
    pair[place].1 = (pair[place].1 + evidence).max(DISTINCT_AT_MOST);
    let has_veto = pair.iter().any(|(_, odds)| *odds < 0.0);
    !has_veto && pair.iter().map(|(_, odds)| odds).sum::<f64>() >= MERGE_AT
}

/// How far along x a report can lie from a track that it could be of, at most.
fn longest_reach(seen: &[Seen<'_>], gate: f64) -> f64 {
    let of_tracks = seen.iter().map(|track| track.expected.state.kinematic.pp.xx).fold(0.0, f64::max);
    let of_reports = seen.iter().filter_map(|track| Some(track.report?.r.xx)).fold(0.0, f64::max);
    libm::sqrt(gate * (of_tracks + of_reports))
}

/// Whether a report of one track could have been of the other.
///
/// Not how far the tracks are apart: two tracks that share one object's reports, each taking the nearer ones,
/// push each other away further than their own covariances would allow.
fn compete(a: &Seen<'_>, b: &Seen<'_>, gate: f64) -> bool {
    let fits = |z: Option<&Measurement>, expected: &Expected| z.is_some_and(|z| expected.fits(z, gate));
    fits(a.report, b.expected) || fits(b.report, a.expected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::State;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;
    use v2x_common::time::Timestamp;

    fn agent(name: &str) -> AgentId {
        AgentId::new(name).unwrap()
    }

    fn report(x: f64) -> Measurement {
        Measurement {
            class: Class::Car,
            position: [x, 0.0],
            r: Covariance2::isotropic(0.5),
            size: [1.8, 4.5],
            relative_variance: [0.04, 0.04],
            yaw: 0.0,
            yaw_variance: 0.01,
            velocity: None,
        }
    }

    /// A track with a hundredfold better position than one report gives.
    fn expected(x: f64) -> Expected {
        let precise = Measurement { r: Covariance2::isotropic(0.05), ..report(x) };
        let (class, born_at) = (Class::Car, Timestamp::EPOCH);
        Expected { track: 0, class, state: State::born(born_at, &precise), born_at }
    }

    /// Frames until the pair is merged, where each frame reports the two tracks as told.
    fn merged_after(distance_m: f64, reports: impl IntoIterator<Item = (bool, bool)>) -> Option<usize> {
        let (a, b) = (expected(0.0), expected(distance_m));
        let (of_a, of_b) = (report(0.0), report(distance_m));
        let mut duplicates = Duplicates::default();
        reports.into_iter().position(|(first, second)| {
            let mut seen = [
                Seen { id: TrackId(7), expected: &a, report: first.then_some(&of_a) },
                Seen { id: TrackId(3), expected: &b, report: second.then_some(&of_b) },
            ];
            let merges = duplicates.note_frame(&mut seen, (agent("ego"), 0.95), 16.2);
            assert!(merges.is_empty() || merges == [(TrackId(3), TrackId(7))]);
            !merges.is_empty()
        })
    }

    #[test]
    fn tracks_that_take_turns_are_one_object() {
        assert_eq!(merged_after(1.0, [(true, false), (false, true), (true, false)]), Some(2));
    }

    #[test]
    fn tracks_that_are_reported_together_stay_two_through_some_misses() {
        let together = std::iter::repeat_n((true, true), 5);
        assert_eq!(merged_after(1.0, together.chain([(true, false); 3])), None);
    }

    #[test]
    fn two_objects_of_which_most_agents_see_only_one_stay_two() {
        let (a, b) = (expected(0.0), expected(1.0));
        let (of_a, of_b) = (report(0.0), report(1.0));
        let mut duplicates = Duplicates::default();
        for _ in 0..100 {
            for (name, sees_b) in [("rsu", true), ("ego", false), ("van", false)] {
                let mut seen = [
                    Seen { id: TrackId(1), expected: &a, report: Some(&of_a) },
                    Seen { id: TrackId(2), expected: &b, report: sees_b.then_some(&of_b) },
                ];
                assert_eq!(duplicates.note_frame(&mut seen, (agent(name), 0.95), 16.2), []);
            }
        }
    }

    #[test]
    fn tracks_out_of_each_others_gate_are_never_one() {
        assert_eq!(merged_after(4.0, [(true, false); 10]), None);
    }
}
