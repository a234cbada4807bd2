//! What others know of tracks and agents, for what is published.

use crate::track::Contributors;
use crate::values::{AgentSlot, ClassLaw};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// What others know of tracks and agents.
#[derive(Clone, Copy)]
pub(crate) struct Readings<'a> {
    /// Whether a track is not published, because an older one is at its place.
    pub(crate) hidden: &'a dyn Fn(TrackId) -> bool,
    /// Variance (m²) of the part of an agent's errors of position that lasts.
    pub(crate) lasting: &'a dyn Fn(AgentSlot) -> f64,
    /// How an agent's classes err; `None` where the shares of reported classes are published.
    pub(crate) class_law: Option<&'a dyn Fn(AgentSlot) -> ClassLaw>,
}

/// Agents whose errors that last are in an estimate: those that have detected the object within this time.
const LASTING_FOR: Span = Span::from_millis(1000);
/// Correlation of the lasting errors of two agents about one object (0.3 to 0.8 on recorded data): both see its near side.
const ALIKE: f64 = 0.5;

/// The variance (m²) of an estimate's error that lasts: of the mean of the agents' errors.
pub(super) fn lasting_variance(contributors: &Contributors, readings: &Readings<'_>, now: Timestamp) -> f64 {
    let recent = contributors.iter().filter(|newest| newest.captured_at() >= now - LASTING_FOR);
    let (mut count, mut variances, mut sigmas) = (0.0, 0.0, 0.0);
    for newest in recent {
        let variance = (readings.lasting)(newest.agent());
        count += 1.0;
        variances += variance;
        sigmas += libm::sqrt(variance);
    }
    if variances == 0.0 {
        return 0.0;
    }
    (ALIKE * sigmas * sigmas + (1.0 - ALIKE) * variances) / (count * count)
}
