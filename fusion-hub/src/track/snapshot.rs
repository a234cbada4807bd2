//! The estimate of a track after some of its evidence.

use super::orientation::{Action, Held, Orientation, Read, axis_difference, first_read};
use crate::filter::Filter;
use crate::values::AgentSlot;
use crate::values::{ClassShares, Coverage};
use crate::values::{
    DetectionModel, ExpectedPlace, HeadingLaw, LastingError, Measurement, PoseDetection, PositionInnovation,
    ScoreEvidence, ScoreModel, SharedError, Support, SupportFrame, Turn, Widened,
};
use crate::values::{Existence, Persistence};
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

/// An object counts as covered if it lies inside the field of view by this many standard deviations of its position.
const VIEW_MARGIN_SIGMAS: f64 = 3.0;
/// And by this much more, m: the borders of a sensor's coverage are uncertain.
const VIEW_MARGIN_M: f64 = 0.5;
/// Different classes that are counted for one track.
const MAX_CLASSES: usize = 4;
/// Where one in so many detections is of a class that moves, the object may.
const ONE_IN_MOVES: u32 = 5;
/// An object stands that is slower by a standard deviation, m/s: of one whose reports wander with a pose no more is known.
const STANDS_BELOW_MPS: f64 = 1.5;

/// State, existence and class after the evidence up to one moment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot<F> {
    /// State at the last detection.
    pub state: F,
    /// Existence at the last evidence.
    pub existence: Existence,
    /// Time of the last evidence.
    pub at: Timestamp,
    /// Time of the first detection.
    pub initiated_at: Timestamp,
    /// Number of detections.
    pub n_reports: u32,
    /// Mean time between detections of it by the agent that detected it last, s.
    pub interval_s: f64,
    /// What bounds its existence.
    pub persistence: Persistence,
    /// What is known of its orientation beside the state.
    pub orientation: Orientation,
    /// What the agents have shown of it.
    pub support: Support,
    /// What of its error of position comes from the pose of an agent.
    pub shared_error: SharedError,
    /// What lasts of the errors that it holds.
    pub lasting: LastingError,
    class: Class,
    /// Whether the class selects the motion parameters.
    class_motion: bool,
    counts: [(Class, u32); MAX_CLASSES],
}

/// A frame's evidence of existence of one track.
#[derive(Clone, Copy, Debug)]
pub struct FrameEvidence<'a> {
    /// Capture time.
    pub at: Timestamp,
    /// The agent.
    pub agent: AgentSlot,
    /// How its frame is read.
    pub model: &'a DetectionModel,
}

impl FrameEvidence<'_> {
    /// As one that holds a detection with this probability.
    fn for_support(&self, probability: f64) -> SupportFrame {
        let Self { agent, at, model } = *self;
        let has_scores = model.scores != ScoreModel::Ignored;
        SupportFrame { agent, at, probability, has_scores, is_trusted: model.is_trusted }
    }

    /// As a detection with this variance (m²) of what its sensor's pose adds.
    pub(super) fn of_pose(&self, variance: f64) -> PoseDetection {
        PoseDetection { agent: self.agent, at: self.at, variance, interval_s: self.model.interval_s }
    }
}

/// A detection's evidence of existence of one track.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReportEvidence {
    /// Detection probability over clutter density, m²; ∞ without clutter.
    pub over_clutter: f64,
    /// The evidence of its score.
    pub score: ScoreEvidence,
    /// Distance from the sensor, m; 0 where that is not known.
    pub range_m: f64,
}

impl<F: Filter> Snapshot<F> {
    /// After the first detection. Without `class_motion` every object has the motion parameters of a car.
    pub fn initial(
        frame: &FrameEvidence<'_>,
        z: &Measurement,
        score: ScoreEvidence,
        class_motion: bool,
    ) -> Self {
        let at = frame.at;
        let (z, front_odds_ln) = match frame.model.headings {
            HeadingLaw::AsReported => (*z, 0.0),
            HeadingLaw::Mixture { front_odds_ln, .. } => {
                (first_read(z, &frame.model.headings), front_odds_ln)
            }
        };
        let z = &z;
        let probability = frame.model.profile.probability(0.0, z.class.group());
        let mut support = Support::default();
        if frame.model.keeps_support {
            support.note_detection(frame.for_support(probability), score);
        } else {
            support.note_known_detection(frame.agent, at);
        }
        let mut counts = [(Class::Unknown, 0); MAX_CLASSES];
        counts[0] = (z.class, 1);
        Self {
            state: F::initial(at, &Measurement { class: motion_class(z.class, class_motion), ..*z }),
            existence: Existence::from_odds(frame.model.birth_odds * score.factor())
                .within(&frame.model.persistence),
            at,
            initiated_at: at,
            n_reports: 1,
            interval_s: frame.model.detection_interval_s(probability),
            persistence: frame.model.persistence,
            orientation: Orientation::initial(at, z, front_odds_ln),
            support,
            shared_error: SharedError::initial(&frame.of_pose(0.0)),
            lasting: LastingError::initial(&frame.model.errors, at, frame.model.interval_s),
            class: z.class,
            class_motion,
            counts,
        }
    }

    /// The state at another time, later or earlier. Within `synchronous` of the state it is the state.
    #[inline]
    pub fn state_at(&self, at: Timestamp, synchronous: Span) -> F {
        if (at - self.state.at()).abs() <= synchronous {
            return self.state;
        }
        self.state.predicted(at, self.motion_class())
    }

    /// Where positions alone expect the object at another time.
    pub fn expected_by_positions(&self, at: Timestamp) -> ExpectedPlace {
        self.orientation.by_positions(at, self.motion_class())
    }

    /// Whether it is known to stand, by positions alone.
    pub fn stands(&self) -> bool {
        let (speed, sigma) = self.orientation.speed_by_positions();
        speed + sigma < STANDS_BELOW_MPS
    }

    /// The probability that it still exists at another time.
    pub fn existence_at(&self, at: Timestamp) -> f64 {
        self.existence.survived(at - self.at, &self.persistence).probability()
    }

    /// Whether it is rather a real object than clutter, and than a false object that an agent sees persistently.
    pub fn is_rather_real(&self) -> bool {
        !self.existence.is_unlikely() && self.support.is_for_a_real_object()
    }

    /// The same without anything that rests on what was taken for real before: to learn from.
    pub fn is_rather_real_by_itself(&self) -> bool {
        !self.existence.is_unlikely() && self.support.is_for_a_real_object_by_itself()
    }

    /// Before the update by a detection at the state's own time, or taken as simultaneous: what lasts of the errors of those who
    /// know best where the object is has wandered since.
    #[inline(always)]
    pub(super) fn let_errors_wander(&mut self, frame: &FrameEvidence<'_>) {
        let wandered = self.lasting.take_in(&frame.model.errors, frame.at, frame.model.interval_s);
        if wandered > 0.0 {
            self.state.widen_position(wandered);
        }
    }

    /// After that: by how much (variance along an axis, m²) a report counts for less, as its agent's errors last more.
    #[inline(always)]
    pub(super) fn discount(&self, frame: &FrameEvidence<'_>, z: &Measurement) -> f64 {
        self.lasting.discount(&frame.model.errors, frame.model.interval_s, (z.r.xx + z.r.yy) / 2.0)
    }

    /// Before the update by a detection at the state's own time, or taken as simultaneous: how the detection is read.
    #[inline(always)]
    pub(super) fn read(&mut self, frame: &FrameEvidence<'_>, z: &Measurement) -> Read {
        self.survive_to(frame.at);
        // Of each agent: others may report the object at the same time.
        let z = &Measurement { since_last_s: frame.model.interval_s, ..*z };
        if frame.model.headings == HeadingLaw::AsReported {
            return Read::as_reported(z);
        }
        let held = Held { state: &self.state, class: self.motion_class() };
        let mut read = self.orientation.read(frame.at, z, &held, &frame.model.headings);
        if frame.model.headings.lasts() {
            let turn = Turn {
                rate: self.state.turn_rate(),
                off: axis_difference(read.z.yaw, self.state.heading().0),
            };
            let model = &frame.model;
            read.z.yaw_variance += model.headings.by_lasting(z.yaw_variance, model.interval_s, &turn);
        }
        match read.first {
            Action::Nothing => {}
            Action::TurnRound => self.state.turn_round(),
            Action::Redirect(course) => self.state.redirect(&course),
            Action::TurnTo(yaw, variance) => self.state.turn_to(yaw, variance),
        }
        read
    }

    /// After the update of the state by a detection as it was read.
    #[inline(always)]
    pub(super) fn finish(
        &mut self,
        frame: &FrameEvidence<'_>,
        read: &Read,
        innovation: &PositionInnovation,
        report: impl FnOnce() -> ReportEvidence,
    ) {
        let FrameEvidence { at, agent, model } = *frame;
        let is_unlikely = self.existence.is_unlikely();
        let ReportEvidence { mut over_clutter, score, range_m } = report();
        let probability = model.profile.probability(range_m, self.class.group());
        let mut innovation = innovation;
        if model.headings != HeadingLaw::AsReported {
            self.overrule_heading(read, innovation);
            // It may be the object that does not move along its heading.
            if innovation.mahalanobis2 > ExpectedPlace::COST
                && read.by_positions.minus_two_ln() + ExpectedPlace::COST < innovation.minus_two_ln()
            {
                innovation = &read.by_positions;
                over_clutter *= ExpectedPlace::SHARE;
            }
        }
        if model.keeps_support {
            if is_unlikely && model.scores == ScoreModel::Ignored {
                // It may be of a new object. Low scores, however, are of the same clutter.
                self.support = Support::default();
            }
            over_clutter *= model.profile.detected_again(probability, self.support.last(agent));
            self.support.note_detection(frame.for_support(probability), score);
        } else {
            self.support.note_known_detection(agent, at);
        }
        let lasting_too;
        if read.discount > 0.0 {
            lasting_too = innovation.with_less_noise(read.discount - model.errors.lasting);
            innovation = &lasting_too;
        }
        self.existence = self.existence.reported(innovation, over_clutter).within(&model.persistence);
        if is_unlikely {
            let birth_odds = model.birth_odds * score.factor();
            self.existence = self.existence.or_initiated(birth_odds).within(&model.persistence);
        }
        self.n_reports += 1;
        self.interval_s = model.detection_interval_s(probability);
        self.persistence = model.persistence;
        self.count_class(read.z.class);
    }

    /// Where positions have long contradicted the heading, they count.
    fn overrule_heading(&mut self, read: &Read, innovation: &PositionInnovation) {
        let class = self.motion_class();
        if !class.is_immobile()
            && let Some(path) = self.orientation.overrule((read, class), innovation, || self.state.heading())
        {
            self.state.move_to(path.position, &path.covariance);
            self.state.redirect(&path.course);
        }
    }

    /// Before an update by a detection whose sensor's pose adds this variance (m²) to its error: what the poses of two agents
    /// add is no noise.
    #[inline(always)]
    pub(super) fn reconcile_poses(&mut self, frame: &FrameEvidence<'_>, variance: f64, z: &mut Measurement) {
        let Self { shared_error, state, .. } = self;
        let averaged = || (z.r.xx + z.r.yy) / state.position_variance();
        let widened = shared_error.take_in(&frame.of_pose(variance), averaged);
        if widened != Widened::NONE {
            self.state.widen_position(widened.estimate);
            z.r.xx += widened.measurement;
            z.r.yy += widened.measurement;
        }
    }

    /// Moves the state to another time. Within `synchronous` of it, it stays.
    #[inline(always)]
    pub fn predict(&mut self, at: Timestamp, synchronous: Span) {
        if (at - self.state.at()).abs() > synchronous {
            self.state.predict(at, self.motion_class());
        }
    }

    /// Applies a missed detection; no effect where the object was not covered. `predicted` is the state at that time, if it is
    /// known.
    pub fn add_missed_detection(
        &mut self,
        frame: &FrameEvidence<'_>,
        coverage: &Coverage,
        (predicted, synchronous): (Option<&F>, Span),
    ) {
        let FrameEvidence { at, agent, model } = *frame;
        // At the least existence there is, only a detection changes it.
        if self.existence.is_least() {
            return;
        }
        let (state, motion_class) = (predicted.unwrap_or(&self.state), self.motion_class());
        let is_synchronous = predicted.is_some() || (at - state.at()).abs() <= synchronous;
        let (position, sigma_m) = state.place_at(if is_synchronous { state.at() } else { at }, motion_class);
        if coverage.covers(position, VIEW_MARGIN_SIGMAS * sigma_m + VIEW_MARGIN_M) {
            self.survive_to(at);
            let mut probability = coverage.detection_probability(position, self.class.group());
            if model.keeps_support {
                let given = coverage.profile.given(probability, self.support.last(agent));
                self.support.note_missed(frame.for_support(probability));
                probability = given;
            }
            self.existence = self.existence.missed(1.0 - probability);
        }
    }

    /// Predicts the existence to another time: the object may have gone meanwhile.
    #[inline(always)]
    pub fn survive_to(&mut self, at: Timestamp) {
        self.existence = self.existence.survived(at - self.at, &self.persistence);
        self.at = at;
    }

    #[inline(always)]
    fn count_class(&mut self, class: Class) {
        // Nearly always all detections agree.
        if self.counts[0].0 == class && self.class == class {
            self.counts[0].1 = self.counts[0].1.saturating_add(1);
            return;
        }
        let place = self.counts.iter().position(|(known, count)| *known == class || *count == 0);
        // With all places taken, a further class is not counted.
        if let Some(place) = place {
            self.counts[place] = (class, self.counts[place].1.saturating_add(1));
            if self.class != class {
                self.class = self.most_reported();
            }
        }
    }

    /// The most reported class; a known one before `unknown`, among equals the one reported first.
    pub fn class(&self) -> Class {
        self.class
    }

    /// The class whose motion parameters it has.
    #[inline]
    pub fn motion_class(&self) -> Class {
        let is_disputed = self.class.is_immobile() && self.counts[1].1 > 0;
        motion_class(if is_disputed { self.class_that_moves() } else { self.class }, self.class_motion)
    }

    /// What a part of the reports says to be of a class that moves may move, whatever the others say: a thing that is said to
    /// move only loses accuracy, and one that moves nevertheless is lost.
    #[cold]
    fn class_that_moves(&self) -> Class {
        let moves = |class: Class| class != Class::Unknown && !class.is_immobile();
        let total: u32 = self.counts.iter().map(|(_, count)| count).sum();
        let often = |count: u32| count >= total / ONE_IN_MOVES;
        let mut best = (self.class, 0);
        for (class, count) in self.counts {
            if moves(class) && often(count) && count > best.1 {
                best = (class, count);
            }
        }
        best.0
    }

    fn most_reported(&self) -> Class {
        let weight = |(class, count): (Class, u32)| (class != Class::Unknown && count > 0, count);
        let mut best = self.counts[0];
        for count_class in self.counts {
            if weight(count_class) > weight(best) {
                best = count_class;
            }
        }
        best.0
    }

    /// Every reported class with its share of the detections, most reported first.
    pub fn class_shares(&self) -> ClassShares {
        let mut counts = self.counts;
        let best = self.class();
        counts.sort_by_key(|(class, count)| (*class != best, std::cmp::Reverse(*count), *class));
        let total: u32 = counts.iter().map(|(_, count)| count).sum();
        let mut shares = ClassShares::default();
        for (class, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            shares.push(class, f64::from(count) / f64::from(total));
        }
        shares
    }
}

/// The class whose motion parameters an object has.
fn motion_class(class: Class, class_motion: bool) -> Class {
    if class_motion { class } else { Class::Car }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("track.one_in_moves", ONE_IN_MOVES.to_string()),
        ("track.stands_below_mps", STANDS_BELOW_MPS.to_string()),
    ]
}
