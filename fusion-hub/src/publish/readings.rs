//! What others know of tracks and agents, for what is published.

use crate::track::Contributors;
use crate::values::{AgentSlot, ClassLaw, SharedError};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// What others know of tracks and agents.
#[derive(Clone, Copy)]
pub(crate) struct Readings<'a> {
    /// Whether a track is not published, because an older one is at its place.
    pub(crate) hidden: &'a dyn Fn(TrackId) -> bool,
    /// What is known of each agent, by its slot; nothing of those beyond.
    pub(crate) agents: &'a [AgentReading],
    /// Whether what agents believe of classes is combined; else the shares of reported classes are published.
    pub(crate) combines_beliefs: bool,
}

/// What is known of one agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AgentReading {
    /// Variance (m²) of the part of its errors of position that lasts.
    pub(crate) lasting: f64,
    /// Variance (m²) along an axis of its pose.
    pub(crate) pose: f64,
    /// How its classes err.
    pub(crate) classes: ClassLaw,
}

impl Readings<'_> {
    fn lasting(&self, agent: AgentSlot) -> f64 {
        self.agents.get(agent.index()).map_or(0.0, |known| known.lasting)
    }

    fn pose(&self, agent: AgentSlot) -> f64 {
        self.agents.get(agent.index()).map_or(0.0, |known| known.pose)
    }

    /// How an agent's classes err.
    pub(super) fn class_law(&self, agent: AgentSlot) -> ClassLaw {
        self.agents.get(agent.index()).map_or(ClassLaw::UNKNOWN, |known| known.classes)
    }
}

/// Agents whose errors that last are in an estimate: those that have detected the object within this time.
const LASTING_FOR: Span = Span::from_millis(1000);
/// Correlation of the lasting errors of two agents about one object (0.3 to 0.8 on recorded data): both see its near side.
const ALIKE: f64 = 0.5;

/// The variance (m²) of an estimate's error that lasts: what it shares with the pose of the agent that decides where it is, and
/// the mean of the errors of the agents whose poses are as good.
pub(super) fn lasting_variance(
    contributors: &Contributors,
    shared: &SharedError,
    readings: &Readings<'_>,
    now: Timestamp,
) -> f64 {
    shared.variance + mean_of_lasting(contributors, shared, readings, now)
}

fn mean_of_lasting(
    contributors: &Contributors,
    shared: &SharedError,
    readings: &Readings<'_>,
    now: Timestamp,
) -> f64 {
    if readings.agents.iter().all(|known| known.lasting == 0.0) {
        return 0.0;
    }
    let recent = contributors.iter().filter(|newest| {
        newest.captured_at() >= now - LASTING_FOR && readings.pose(newest.agent()) <= shared.variance
    });
    let (mut count, mut variances, mut sigmas) = (0.0, 0.0, 0.0);
    for newest in recent {
        let variance = readings.lasting(newest.agent());
        count += 1.0;
        variances += variance;
        sigmas += libm::sqrt(variance);
    }
    if variances == 0.0 {
        return 0.0;
    }
    (ALIKE * sigmas * sigmas + (1.0 - ALIKE) * variances) / (count * count)
}
