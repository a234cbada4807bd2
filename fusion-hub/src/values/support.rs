//! How well the agents support that a track is of a real object, apart from its existence probability.
//!
//! The frames of one agent are no independent evidence: a false detection persists (a bush is taken for a car in every
//! frame), and so does an occlusion. So the mean of an agent's evidence over about a second counts, once, and not its
//! sum; and what one agent's silence can cost is bounded.

use super::{AgentSlot, ScoreEvidence};
use serde::{Deserialize, Serialize};
use v2x_common::time::Timestamp;

/// Agents whose support is held; that of others only where they detect what one of these does not.
const MAX_AGENTS: usize = 6;
/// An agent that has not observed a track for this long makes room for another one, s.
const FORGOTTEN_AFTER_S: f32 = 3.0;
/// An agent's evidence is averaged over this time, s; over longer, but at most so long, where detections are all that there is and
/// each is less probable than [`MOST_PROBABILITY`]: there the mean of so many frames scatters more, and says less.
const AVERAGED_OVER_S: f32 = 1.0;
const AVERAGED_OVER_AT_MOST_S: f32 = 5.0;
/// And over no less than so many times between its frames, of at most so long together: one frame in which a slow sensor misses an object
/// says no more than one of a fast one does.
const FRAMES_AT_LEAST: f32 = 3.0;
const THESE_AT_MOST_S: f32 = 8.0;
/// A false object is detected with this share of the probability of a real one.
const GHOST_SHARE: f64 = 0.4;
/// ln of a real object's share over that of a false one: what a detection is worth.
const LN_ODDS_OF_DETECTION: f64 = 0.916_290_731_874_155;
/// The same of a detection by a sensor that describes itself: the silence of several others does not outweigh it.
const LN_ODDS_OF_KNOWN_DETECTION: f64 = 5.0;
/// Objects differ, and one that is hard to see is missed more often than the mean: no miss says more than at this probability of a
/// detection.
const MOST_PROBABILITY: f64 = 0.8;
/// What a real object has in advance.
const IN_ADVANCE: f32 = 0.0;
/// Weight of an agent's evidence at its first frame.
const LEAST_WEIGHT: f32 = 0.3;
/// What a trusted agent's evidence is worth more at most, and no more than by itself: what is detected as seldom as false objects are
/// gains nothing.
const TRUST: f32 = 0.5;
/// The most that one agent's silence can cost.
const MOST_AGAINST: f32 = -1.2;

/// What one agent has shown of a track, in 16 bytes: checkpoints hold many of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct AgentSupport {
    /// Mean evidence, ln.
    mean: f32,
    /// For how long it has observed it, s.
    observed_s: f32,
    /// Its last frame, ms after an epoch of its own; the difference of two is right for three weeks.
    at_ms: u32,
    agent: AgentSlot,
    /// Whether its last frame held the object; `None` for a free place.
    last: Option<bool>,
    /// Whether what the agent detects is nearly always real.
    is_trusted: bool,
}

/// What the agents have shown of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Support {
    agents: [AgentSupport; MAX_AGENTS],
}

/// Milliseconds, modulo 2³².
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "modulo 2^32 is intended")]
fn milliseconds(at: Timestamp) -> u32 {
    at.as_nanos().div_euclid(1_000_000) as u32
}

/// From an earlier time to a later one, s.
#[expect(clippy::cast_precision_loss, reason = "single precision is enough")]
fn passed_s(from_ms: u32, to_ms: u32) -> f32 {
    to_ms.wrapping_sub(from_ms).cast_signed() as f32 * 1e-3
}

/// A frame that could hold a detection of an object.
#[derive(Clone, Copy, Debug)]
pub struct SupportFrame {
    /// The agent.
    pub agent: AgentSlot,
    /// Capture time.
    pub at: Timestamp,
    /// Probability of a detection.
    pub probability: f64,
    /// Whether its scores say something.
    pub has_scores: bool,
    /// Whether what it detects is nearly always real.
    pub is_trusted: bool,
}

impl SupportFrame {
    /// The time over which its evidence is averaged, s.
    #[expect(clippy::cast_possible_truncation, reason = "single precision is enough")]
    fn averaged_over_s(&self) -> f32 {
        if self.has_scores {
            return AVERAGED_OVER_S;
        }
        let rarer = (MOST_PROBABILITY / self.probability) as f32;
        (AVERAGED_OVER_S * rarer * rarer).clamp(AVERAGED_OVER_S, AVERAGED_OVER_AT_MOST_S)
    }
}

impl Support {
    /// Whether the agent's last frame held the object; `None` before its first one.
    pub fn last(&self, agent: AgentSlot) -> Option<bool> {
        self.agents.iter().find(|known| known.agent == agent && known.last.is_some())?.last
    }

    /// Notes a detection, with the evidence of its score.
    pub fn note_detection(&mut self, frame: SupportFrame, score: ScoreEvidence) {
        self.note(&frame, (true, score.ln() + LN_ODDS_OF_DETECTION));
    }

    /// Notes a frame that covered the object and held no detection of it, where that has this probability (of a
    /// detection).
    pub fn note_missed(&mut self, frame: SupportFrame) {
        let probability = frame.probability.min(MOST_PROBABILITY);
        let evidence = libm::log((1.0 - probability) / (1.0 - GHOST_SHARE * probability));
        self.note(&frame, (false, evidence));
    }

    /// Notes a detection by a sensor whose detections are known to be real: existence holds its misses.
    pub fn note_known_detection(&mut self, agent: AgentSlot, at: Timestamp) {
        let frame = SupportFrame { agent, at, probability: 1.0, has_scores: true, is_trusted: false };
        self.note(&frame, (true, LN_ODDS_OF_KNOWN_DETECTION));
    }

    fn note(&mut self, frame: &SupportFrame, (is_detected, evidence): (bool, f64)) {
        let SupportFrame { agent, at, is_trusted, .. } = *frame;
        let at_ms = milliseconds(at);
        let Some(known) = self.place_for(agent, at_ms, is_detected) else { return };
        #[expect(clippy::cast_possible_truncation, reason = "single precision is enough")]
        let evidence = evidence as f32;
        let last = Some(is_detected);
        if known.last.is_none() || known.agent != agent {
            *known = AgentSupport { mean: evidence, observed_s: 0.0, at_ms, agent, last, is_trusted };
            return;
        }
        let dt_s = passed_s(known.at_ms, at_ms);
        if dt_s > 0.0 {
            let over_s = frame.averaged_over_s().max((FRAMES_AT_LEAST * dt_s).min(THESE_AT_MOST_S));
            let held_s = known.observed_s.min(over_s);
            known.mean += (evidence - known.mean) * (dt_s / (held_s + dt_s));
            known.observed_s += dt_s;
            known.at_ms = at_ms;
        }
        (known.last, known.is_trusted) = (last, is_trusted);
    }

    /// The place of an agent; else a free one, or that of an agent that has not observed the track for long; for a detection also that
    /// of the one whose silence says most: many that see nothing do not hide one that does.
    fn place_for(&mut self, agent: AgentSlot, at_ms: u32, is_detected: bool) -> Option<&mut AgentSupport> {
        let is_it = |known: &AgentSupport| known.agent == agent && known.last.is_some();
        let is_free =
            |known: &AgentSupport| known.last.is_none() || passed_s(known.at_ms, at_ms) > FORGOTTEN_AFTER_S;
        let silent = || {
            let silent =
                (0..MAX_AGENTS).filter(|place| is_detected && self.agents[*place].last == Some(false));
            silent.min_by(|a, b| self.agents[*a].mean.total_cmp(&self.agents[*b].mean))
        };
        let place = self.agents.iter().position(is_it);
        let place = place.or_else(|| self.agents.iter().position(is_free)).or_else(silent)?;
        Some(&mut self.agents[place])
    }

    /// Whether the track is rather of a real object than of a false one that an agent sees persistently.
    pub fn is_for_a_real_object(&self) -> bool {
        self.sum(|known| if known.is_trusted { known.mean.clamp(0.0, TRUST) } else { 0.0 }) >= 0.0
    }

    /// The same without anything that rests on what was taken for real before.
    pub fn is_for_a_real_object_by_itself(&self) -> bool {
        self.sum(|_| 0.0) >= 0.0
    }

    /// ln of the odds, with something more for each agent.
    fn sum(&self, more: impl Fn(&AgentSupport) -> f32) -> f32 {
        let of_agents = self.agents.iter().filter(|known| known.last.is_some()).map(|known| {
            let weight = (known.observed_s / AVERAGED_OVER_S).min(1.0);
            known.mean.max(MOST_AGAINST) * libm::sqrtf(weight).max(LEAST_WEIGHT) + more(known)
        });
        IN_ADVANCE + of_agents.sum::<f32>()
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        (
            "support.averaged_over_s",
            format!(
                "{AVERAGED_OVER_S}, {FRAMES_AT_LEAST} frames within {THESE_AT_MOST_S}, without scores to {AVERAGED_OVER_AT_MOST_S} below a probability of {MOST_PROBABILITY}"
            ),
        ),
        ("support.ghost_share", GHOST_SHARE.to_string()),
        ("support.known_detection", LN_ODDS_OF_KNOWN_DETECTION.to_string()),
        ("support.most_probability", MOST_PROBABILITY.to_string()),
        ("support.in_advance", IN_ADVANCE.to_string()),
        ("support.trust", TRUST.to_string()),
        ("support.most_against", MOST_AGAINST.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::{AgentNames, ScoreModel};
    use v2x_common::id::AgentId;
    use v2x_common::time::Span;

    fn agents() -> [AgentSlot; 2] {
        let mut names = AgentNames::default();
        ["a", "b"].map(|name| names.slot_for(AgentId::new(name).unwrap()))
    }

    fn at(frame: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(100 * frame)
    }

    fn could_hold(agent: AgentSlot, at: Timestamp, probability: f64) -> SupportFrame {
        SupportFrame { agent, at, probability, has_scores: true, is_trusted: false }
    }

    #[test]
    fn what_one_agent_reports_with_a_low_score_and_another_misses_is_no_real_object() {
        let [a, b] = agents();
        let scores = ScoreModel::logistic(-0.85, 2.0);
        let after = |score: f64, b_misses: bool| {
            let mut support = Support::default();
            for frame in 0..20 {
                support.note_detection(could_hold(a, at(frame), 0.9), scores.evidence(score));
                if b_misses {
                    support.note_missed(could_hold(b, at(frame), 0.9));
                }
            }
            support.is_for_a_real_object()
        };
        assert!(after(0.6, false) && after(0.6, true) && after(0.3, false));
        assert!(!after(0.15, true) && !after(0.15, false));
    }

    #[test]
    fn what_an_agent_without_scores_detects_again_and_again_outweighs_that_it_is_hidden_from_another() {
        let [a, b] = agents();
        let after = |is_trusted: bool| {
            let mut support = Support::default();
            for k in 0..30 {
                let of =
                    |agent: AgentSlot| SupportFrame { has_scores: false, ..could_hold(agent, at(k), 0.75) };
                support.note_detection(SupportFrame { is_trusted, ..of(a) }, ScoreEvidence::NONE);
                support.note_missed(of(b));
            }
            support
        };
        assert!(after(true).is_for_a_real_object() && !after(false).is_for_a_real_object());
        assert!(!after(true).is_for_a_real_object_by_itself(), "nobody's trust rests on itself");
    }

    #[test]
    fn a_single_miss_of_a_slow_sensor_does_not_hide_what_it_has_long_detected_and_a_few_do() {
        let [a, _] = agents();
        for seconds in [1, 2, 4] {
            let mut support = Support::default();
            let frame = |k: i64| could_hold(a, at(10 * seconds * k), 0.95);
            (0..8).for_each(|k| support.note_detection(frame(k), ScoreEvidence::NONE));
            support.note_missed(frame(8));
            assert!(support.is_for_a_real_object(), "{seconds} s");
            (9..12).for_each(|k| support.note_missed(frame(k)));
            assert!(!support.is_for_a_real_object(), "{seconds} s");
        }
    }

    #[test]
    fn silence_of_one_agent_costs_a_bounded_amount() {
        let [a, b] = agents();
        let scores = ScoreModel::logistic(-0.85, 2.0);
        let mut support = Support::default();
        for frame in 0..1000 {
            support.note_detection(could_hold(a, at(frame), 0.9), scores.evidence(0.5));
            support.note_missed(could_hold(b, at(frame), 0.999));
        }
        assert!(support.is_for_a_real_object());
    }

    #[test]
    fn silence_of_two_agents_does_not_outweigh_one_that_describes_its_sensor() {
        let mut names = AgentNames::default();
        let [known, b, c] = ["known", "b", "c"].map(|name| names.slot_for(AgentId::new(name).unwrap()));
        let mut support = Support::default();
        for frame in 0..100 {
            support.note_known_detection(known, at(frame));
            for silent in [b, c] {
                support.note_missed(could_hold(silent, at(frame), 0.9));
            }
            assert!(support.is_for_a_real_object(), "frame {frame}");
        }
    }

    #[test]
    fn more_silent_agents_than_are_held_do_not_hide_one_that_detects_the_object() {
        let mut names = AgentNames::default();
        let mut slot = |k: usize| names.slot_for(AgentId::new(&format!("a{k}")).unwrap());
        let silent: Vec<_> = (0..MAX_AGENTS + 2).map(&mut slot).collect();
        let seeing = slot(99);
        let mut support = Support::default();
        for frame in 0..50 {
            silent.iter().for_each(|agent| support.note_missed(could_hold(*agent, at(frame), 0.5)));
            support.note_known_detection(seeing, at(frame));
        }
        assert_eq!(support.last(seeing), Some(true));
        assert!(support.is_for_a_real_object());
    }

    #[test]
    fn a_miss_by_a_sensor_that_hardly_ever_misses_says_no_more_than_one_at_four_fifths() {
        let [a, _] = agents();
        let scores = ScoreModel::logistic(-0.85, 2.0);
        // Detected in every other frame only, at a middling score.
        let after = |probability: f64| {
            let mut support = Support::default();
            for frame in 0..20 {
                support.note_detection(could_hold(a, at(2 * frame), probability), scores.evidence(0.35));
                support.note_missed(could_hold(a, at(2 * frame + 1), probability));
            }
            support
        };
        assert_eq!(after(0.99), after(0.8));
        assert!(after(0.99).is_for_a_real_object());
        assert_ne!(after(0.5), after(0.8));
    }

    #[test]
    fn the_last_frame_of_each_agent_is_remembered() {
        let [a, b] = agents();
        let mut support = Support::default();
        support.note_detection(could_hold(a, at(0), 0.5), ScoreEvidence::NONE);
        assert_eq!((support.last(a), support.last(b)), (Some(true), None));
        support.note_missed(could_hold(a, at(1), 0.5));
        assert_eq!(support.last(a), Some(false));
    }

    #[test]
    fn without_scores_what_is_seldom_detected_is_not_taken_for_false_by_a_run_of_misses() {
        let [a, _] = agents();
        // Detected in the half of the frames, and then not for half a second.
        let after = |has_scores: bool| {
            let mut support = Support::default();
            let of = |k: i64| SupportFrame { has_scores, ..could_hold(a, at(k), 0.5) };
            for k in 0..105 {
                if k < 100 && k % 2 == 0 {
                    support.note_detection(of(k), ScoreEvidence::NONE);
                } else {
                    support.note_missed(of(k));
                }
            }
            support
        };
        assert!(after(false).is_for_a_real_object() && !after(true).is_for_a_real_object());
    }
}
