//! What is counted of one agent.

use super::refusal::Refusal;
use crate::fusion::Innovations;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use v2x_common::detection::InvalidValue;
use v2x_common::time::{Span, Timestamp};
use v2x_common::unmapped_names::UnmappedNames;

/// The name of a reason or a field: a constant of the code, or read from a saved state.
pub type Label = Cow<'static, str>;

/// Counts of one agent since the start, and its recent innovations.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AgentStatistics {
    /// Frames accepted.
    pub accepted: u64,
    /// Accepted frames that were captured within ε_s of the newest accepted before.
    pub synchronous: u64,
    /// Accepted frames that were captured before the newest accepted before by more than ε_s.
    pub out_of_sequence: u64,
    /// Accepted frames that were captured in the future by the hub's clock.
    pub ahead_of_time: u64,
    /// How often its clock was ahead of the hub's and was set back.
    pub clock_set_back: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<Label, u64>,
    /// The newest refusal.
    #[serde(skip)]
    pub last_refusal: Option<Refusal>,
    /// Impossible detections of accepted frames.
    pub dropped: DroppedDetections,
    /// Detections whose class name was not known.
    pub unmapped_classes: UnmappedNames,
    /// Sensor descriptions refused.
    pub descriptions_refused: u64,
    /// The newest refusal of one.
    #[serde(skip)]
    pub last_refused_description: Option<Refusal>,
    /// Innovations of all its detections.
    pub innovations: Innovations,
    recent: RecentInnovations,
}

/// Impossible detections that were dropped while their frames were used.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DroppedDetections {
    /// Their number by the first impossible field and the cause: `not finite` or `out of range`.
    pub by_cause: BTreeMap<(Label, Label), u64>,
    /// The newest.
    #[serde(skip)]
    pub last: Option<InvalidValue>,
}

impl DroppedDetections {
    /// Counts one.
    pub fn note(&mut self, invalid: InvalidValue) {
        *self.by_cause.entry((invalid.field.into(), invalid.cause().into())).or_default() += 1;
        self.last = Some(invalid);
    }

    pub(super) fn merge(&mut self, other: Self) {
        for (cause, count) in other.by_cause {
            *self.by_cause.entry(cause).or_default() += count;
        }
        self.last = other.last.or_else(|| self.last.take());
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.by_cause.values().sum()
    }
}

impl AgentStatistics {
    /// Frames refused, for any reason.
    pub fn refused_total(&self) -> u64 {
        self.refused.values().sum()
    }

    /// Mean normalised innovation squared of its positions for each degree of freedom, since the start: 1 where the
    /// agent's stated covariance and the tracks' are consistent, more where it states too small ones. Only innovations
    /// within the gate are associated and counted, so even consistent agents stay slightly below.
    pub fn nis_per_dof(&self) -> Option<f64> {
        per_dof(&self.innovations)
    }

    /// The same over the last minute before `now`: a fault shows, however long the hub has run.
    pub fn recent_nis_per_dof(&self, now: Timestamp) -> Option<f64> {
        per_dof(&self.recent.total(now))
    }

    pub(super) fn note_refusals(&mut self, refusal: Refusal, count: u64) {
        *self.refused.entry(refusal.reason().into()).or_default() += count;
        self.last_refusal = Some(refusal);
    }

    pub(super) fn note_innovations(&mut self, innovations: &Innovations, now: Timestamp) {
        add(&mut self.innovations, innovations);
        self.recent.note(innovations, now);
    }
}

fn per_dof(innovations: &Innovations) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
    (innovations.count > 0).then(|| innovations.nis_sum / (2.0 * innovations.count as f64))
}

fn add(sum: &mut Innovations, other: &Innovations) {
    sum.nis_sum += other.nis_sum;
    sum.count += other.count;
}

/// Innovations are summed up over this long.
const BUCKET: Span = Span::from_millis(10_000);
/// So many sums are kept: a minute.
const N_BUCKETS: usize = 6;

/// Innovations of the last minute, in a ring of sums.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct RecentInnovations {
    /// By the number of their time modulo [`N_BUCKETS`], with that number.
    buckets: [(i64, Innovations); N_BUCKETS],
}

impl RecentInnovations {
    fn note(&mut self, innovations: &Innovations, now: Timestamp) {
        let number = bucket_number(now);
        let place = usize::try_from(number.rem_euclid(N_BUCKETS as i64)).unwrap_or(0);
        let bucket = &mut self.buckets[place];
        if bucket.0 != number {
            *bucket = (number, Innovations::default());
        }
        add(&mut bucket.1, innovations);
    }

    fn total(&self, now: Timestamp) -> Innovations {
        let newest = bucket_number(now);
        let is_recent = |number: i64| number > newest - N_BUCKETS as i64 && number <= newest;
        let mut total = Innovations::default();
        self.buckets
            .iter()
            .filter(|(number, _)| is_recent(*number))
            .for_each(|(_, sum)| add(&mut total, sum));
        total
    }
}

const fn bucket_number(at: Timestamp) -> i64 {
    at.as_nanos().div_euclid(BUCKET.as_nanos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_after_a_day_shows_in_the_recent_nis() {
        let mut statistics = AgentStatistics::default();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000);
        let second = |second: i64| start + Span::from_millis(1000 * second);
        let day = 86_400;
        for k in 0..day {
            statistics.note_innovations(&Innovations { nis_sum: 20.0, count: 10 }, second(k));
        }
        for k in day..day + 60 {
            statistics.note_innovations(&Innovations { nis_sum: 400.0, count: 10 }, second(k));
        }
        assert!(statistics.nis_per_dof().is_some_and(|nis| nis < 1.1));
        assert!(statistics.recent_nis_per_dof(second(day + 59)).is_some_and(|nis| nis > 15.0));
        assert_eq!(statistics.recent_nis_per_dof(second(day + 200)), None, "nothing was detected recently");
    }
}
