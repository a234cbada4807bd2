//! What is learnt of one agent.

use super::class_counts::ClassCounts;
use super::clutter_counts::{ClutterCounts, circle_m2};
use super::detection_counts::{DetectionCounts, ProfilePrior, Share};
use super::epoch::{EPOCH, Epoch};
use super::heading_counts::HeadingCounts;
use super::innovation_counts::InnovationCounts;
use super::pose_counts::PoseCounts;
use super::reading::LearntSensor;
use super::recent_places::RecentPlaces;
use super::report::{Counted, LearntSensorReport};
use super::score_counts::ScoreCounts;
use super::sensor_statistics::SensorStatistics;
use crate::values::{PositionErrors, RANGE_BINS, range_bin};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// What was seen counts less with time, s.
const MEMORY_S: f64 = 120.0;
/// And what was seen in the last seconds alone, s.
const RECENT_S: f64 = 5.0;
/// A frame is read by what had been learnt so long before Δmax before its capture: maintenance is not immediate, and clocks
/// of agents may be a little ahead.
pub(super) const SETTLED: Span = Span::from_millis(500);
/// An agent is known well by so many frames of objects.
const KNOWN_WELL_FRAMES: f64 = 2000.0;
/// An agent that has not detected anything for so long may be dead.
const DETECTS_FOR: Span = Span::from_millis(5000);

/// The epoch by whose begin what a frame is read by must have been learnt.
pub(super) fn settled_before(captured_at: Timestamp, delta_max: Span) -> Epoch {
    Epoch::of(captured_at - delta_max - SETTLED)
}

/// What is learnt of one agent.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct AgentLearning {
    pub(super) name: Option<AgentId>,
    /// What is assumed or declared.
    pub(super) prior: ProfilePrior,
    pub(super) is_described: bool,
    pub(super) counts: DetectionCounts,
    pub(super) clutter: ClutterCounts,
    /// What is assumed or declared: false detections of a frame per m², and the area of the view, m².
    pub(super) clutter_before: f64,
    pub(super) declared_area_m2: Option<f64>,
    pub(super) statistics: SensorStatistics,
    pub(super) places: RecentPlaces,
    pub(super) headings: HeadingCounts,
    pub(super) classes: ClassCounts,
    pub(super) scores: ScoreCounts,
    pub(super) innovations: InnovationCounts,
    pub(super) pose: PoseCounts,
    /// Whether its pose was ever found to wander.
    has_wandered: bool,
    /// When it last detected anything.
    pub(super) detected_at: Option<Timestamp>,
    /// What was learnt by the begin of an epoch, in order.
    learnt: VecDeque<(Epoch, LearntSensor)>,
}

impl AgentLearning {
    /// Of an agent that has shown nothing yet.
    pub(super) fn of(name: AgentId) -> Self {
        Self { name: Some(name), ..Self::default() }
    }

    /// What had been learnt by the begin of an epoch.
    pub(super) fn as_of(&self, epoch: Epoch) -> Option<&LearntSensor> {
        let known = self.learnt.partition_point(|(by, _)| *by <= epoch);
        known.checked_sub(1).map(|place| &self.learnt[place].1)
    }

    /// Lets what was counted fade, after a time, s.
    pub(super) fn fade(&mut self, passed_s: f64) {
        let factor = libm::exp(-passed_s / MEMORY_S);
        self.counts.scale(factor, libm::exp(-passed_s / RECENT_S));
        self.clutter.scale(factor);
        self.statistics.scale(factor);
        self.headings.scale(factor);
        self.classes.scale(factor);
        self.scores.scale(factor);
        self.innovations.scale(factor);
        self.pose.scale(factor);
    }

    /// Whether more evidence changes little.
    pub(super) fn is_known_well(&self) -> bool {
        self.counts.total().all >= KNOWN_WELL_FRAMES && !self.innovations.are_few()
    }

    /// In the units of people.
    pub(super) fn report(&self) -> LearntSensorReport {
        let Share { detected, all } = self.counts.total();
        let range_m = self.statistics.reach_m();
        LearntSensorReport::of(&Counted {
            observed_frames: all,
            detected_frames: detected,
            profile: self.counts.profile(self.prior, range_m.map_or(RANGE_BINS, range_bin)),
            overrules_declared: !self.declared_holds(),
            range_m,
            interval_s: self.statistics.interval_s(),
            scores: self.scores.model(),
            headings: &self.headings.law(self.is_described),
            variance_factor: self.innovations.variance_scale(),
            lasting_variance: self.innovations.lasting_variance() + self.innovations.unseen_variance(),
            pose_variance: self.pose.variance(),
            classes: self.classes.law(),
            groups: self
                .counts
                .of_groups()
                .map(|(group, Share { detected, all })| (group, [detected, all]))
                .collect(),
            false_per_frame: self.clutter.per_frame(),
            clutter_per_m2: self.clutter_density(),
            overrules_declared_clutter: !self.declared_clutter_holds(),
        })
    }

    /// The area of its view, m²; `None` until it is known.
    fn area_m2(&self) -> Option<f64> {
        self.declared_area_m2
            .or_else(|| self.statistics.reach_m().map(circle_m2))
            .filter(|area_m2| *area_m2 > 0.0)
    }

    /// Expected false detections in a frame, per m²; `None` until the area of its view is known.
    fn clutter_density(&self) -> Option<f64> {
        self.area_m2().map(|area_m2| self.clutter.density(self.clutter_before, area_m2))
    }

    fn declared_clutter_holds(&self) -> bool {
        let is_contradicted =
            || self.area_m2().is_some_and(|area_m2| self.clutter.contradict(self.clutter_before, area_m2));
        self.is_described && !is_contradicted()
    }

    fn declared_holds(&self) -> bool {
        self.is_described && !self.counts.contradict(self.prior.probability)
    }

    /// Whether its pose is found to wander for the first time: what the tracks made of its reports until then is in what is known of
    /// all others.
    pub(super) fn begins_to_wander(&mut self) -> bool {
        let wanders = !self.has_wandered && self.pose.variance() > 0.0;
        self.has_wandered |= wanders;
        wanders
    }

    /// Notes what is learnt by the begin of an epoch, and forgets what no frame is read by any more.
    pub(super) fn settle(&mut self, by: Epoch, delta_max: Span) {
        let reach_bin = self.statistics.reach_m().map_or(RANGE_BINS, range_bin);
        let holds = self.declared_holds();
        let learnt = LearntSensor {
            profile: (!holds).then(|| self.counts.profile(self.prior, reach_bin)),
            clutter_per_m2: self.clutter_density().filter(|_| !self.declared_clutter_holds()),
            is_trusted: self.clutter.is_trusted(),
            view_m: self.statistics.view_m(),
            seen: self.places.seen(),
            interval_s: self.statistics.interval_s(),
            headings: Some(self.headings.law(self.is_described)),
            errors: PositionErrors {
                scale: self.innovations.variance_scale(),
                lasting: self.innovations.lasting_variance(),
            },
            unseen: self.innovations.unseen_variance(),
            pose_variance: self.pose.variance(),
            classes: self.classes.law(),
            scores: self.scores.model(),
            detects: self.detected_at.is_some_and(|at| by.begin() - at < DETECTS_FOR),
        };
        let oldest = Epoch::of(by.begin() - delta_max - delta_max - SETTLED - EPOCH);
        while self.learnt.get(1).is_some_and(|(next, _)| *next <= oldest) {
            self.learnt.pop_front();
        }
        if self.learnt.back().is_none_or(|(_, last)| *last != learnt) {
            self.learnt.push_back((by, learnt));
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("learning.epoch_s", EPOCH.as_secs_f64().to_string()),
        ("learning.settled_s", SETTLED.as_secs_f64().to_string()),
        ("learning.memory_s", format!("{MEMORY_S}, of late {RECENT_S}")),
        ("learning.known_well_frames", KNOWN_WELL_FRAMES.to_string()),
        ("learning.detects_for_s", DETECTS_FOR.as_secs_f64().to_string()),
    ]
}
