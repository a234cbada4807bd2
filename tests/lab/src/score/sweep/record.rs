//! The results of one run of one method.

use crate::score::frame_errors::ErrorSums;
use serde::{Deserialize, Serialize};
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// Errors are stored by stretches of this length. Confidence intervals are made of them.
pub(crate) const BLOCK: Span = Span::from_millis(5000);

/// Percentages at which distributions are stored.
pub(crate) const PERCENTS: [u32; 23] =
    [1, 2, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85, 90, 95, 98, 99];

/// Which objects count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Subset {
    /// All objects that count.
    All,
    /// Objects that stay within 1 m of their first position.
    Static,
    /// All other objects.
    Moving,
    /// Objects faster than 3 m/s at the time.
    Fast,
}

impl Subset {
    /// All subsets.
    pub(crate) const ALL: [Self; 4] = [Self::All, Self::Static, Self::Moving, Self::Fast];

    /// The name in rows.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Static => "static",
            Self::Moving => "moving",
            Self::Fast => "fast",
        }
    }
}

/// Errors over a stretch of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Errors {
    /// Objects found, once for each fused frame.
    pub found: u64,
    /// Objects not found.
    pub missed: u64,
    /// Estimates of no object, and repeated ones.
    pub false_: u64,
    /// Sum of distances, m.
    pub ate_m: f64,
    /// Sum of errors of dimensions, m.
    pub ade_m: f64,
    /// Sum of errors of headings, degrees.
    pub aoe_deg: f64,
}

impl Errors {
    /// Adds a frame.
    pub(crate) fn add_frame(&mut self, sums: &ErrorSums) {
        let [ate_m, ade_m, aoe_deg] = sums.all;
        self.add(&Self { ade_m, aoe_deg, ate_m, ..Self::of_translations(sums) });
    }

    /// Counts and translation errors of a frame.
    pub(crate) fn of_translations(sums: &ErrorSums) -> Self {
        let ErrorSums { all: [ate_m, ..], true_positives, false_positives, missed, .. } = *sums;
        Self { found: true_positives, missed, false_: false_positives, ate_m, ..Self::default() }
    }

    /// Adds another stretch.
    pub(crate) fn add(&mut self, other: &Self) {
        self.found += other.found;
        self.missed += other.missed;
        self.false_ += other.false_;
        self.ate_m += other.ate_m;
        self.ade_m += other.ade_m;
        self.aoe_deg += other.aoe_deg;
    }
}

/// Matched by position instead of provenance, in a part of the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ByPosition {
    /// By distance within the match radius, only sums of `ate_m` and counts.
    pub errors: Errors,
    /// Sum of GOSPA, m.
    pub gospa_m: f64,
    /// Frames in the sum.
    pub frames: u64,
}

/// Frames of the agents other than the first that arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrameCounts {
    /// All arrived frames.
    pub arrived: u64,
    /// Of them, with a stamp earlier than that of a frame that arrived before, of any agent that the hub listens to.
    pub late: u64,
    /// Accepted or refused by the hub. Live, a few more arrive after the end.
    pub handled: u64,
    /// Accepted out of sequence: the hub rolled back for them.
    pub rolled_back: u64,
    /// Refused by the hub, for any reason.
    pub refused: u64,
    /// Of the first agent's frames: refused.
    pub refused_of_first: u64,
}

impl FrameCounts {
    /// Adds another agent's, or another run's.
    pub(crate) const fn add(&mut self, other: &Self) {
        self.arrived += other.arrived;
        self.late += other.late;
        self.handled += other.handled;
        self.rolled_back += other.rolled_back;
        self.refused += other.refused;
        self.refused_of_first += other.refused_of_first;
    }
}

/// The agent whose frames are examined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reference {
    /// The agent that the others are compared with.
    pub agent: AgentId,
    /// Whether the hub accepts no other agent.
    pub is_alone: bool,
}

impl Reference {
    /// Whether the frames of this agent are examined. Those of the reference are examined only if it is alone.
    pub(crate) fn examines(&self, agent: &AgentId) -> bool {
        self.is_alone || *agent != self.agent
    }
}

/// One run of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    /// By stretch of [`BLOCK`] and [`Subset`].
    pub blocks: Vec<[Errors; 4]>,
    /// Matched by position.
    #[serde(rename = "geometric")]
    pub by_position: ByPosition,
    /// Sum over the frames that are matched by position, and their number, of the mean position NEES over its 2 degrees of
    /// freedom: the NEES/2 of runs.
    pub nees: (f64, u64),
    /// Sum and number of normalised innovations squared over their degrees of freedom, all agents.
    pub nis: (f64, u64),
    /// Of the other agents' frames.
    #[serde(rename = "fates")]
    pub frames: FrameCounts,
    /// Mean time of the other agents' frames from capture to the hub, ms.
    pub delay_ms: Option<f64>,
    /// Bytes of detections that arrived, of all agents that the hub listens to, each second.
    pub bytes_per_s: f64,
    /// Age of information of found objects at `fused_at`, ms, at [`PERCENTS`].
    pub age_ms: Vec<f64>,
    /// Age of the other agents' newest detection in them, ms, where there is one.
    pub other_age_ms: Vec<f64>,
    /// From capture to the detector's result, which is when a frame can be sent, ms. Of the other agents' frames, or of the
    /// first agent's where it is alone, as the following.
    pub capture_to_send_ms: Vec<f64>,
    /// From there to the hub.
    pub send_to_arrive_ms: Vec<f64>,
    /// From there to the fused frame that first contains it.
    pub arrive_to_fused_ms: Vec<f64>,
    /// From there to a consumer.
    pub fused_to_consumed_ms: Vec<f64>,
    /// Processor time of the hub over time; `None` in virtual time.
    pub cpu_share: Option<f64>,
}

/// The hub's statistics of one agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AgentStatistics {
    /// Whether it is the first agent.
    pub is_first: bool,
    /// Frames accepted.
    pub accepted: u64,
    /// Of them, out of sequence.
    pub out_of_sequence: u64,
    /// Frames refused.
    pub refused: u64,
    /// Mean normalised innovation squared over its degrees of freedom.
    pub nis_per_dof: Option<f64>,
}

impl Record {
    /// Adds the hub's statistics of an agent. Innovations weigh by frames.
    pub(crate) fn add_statistics(&mut self, agent: &AgentStatistics) {
        if let Some(nis) = agent.nis_per_dof {
            self.nis = (self.nis.0 + nis * agent.accepted as f64, self.nis.1 + agent.accepted);
        }
        if agent.is_first {
            self.frames.refused_of_first += agent.refused;
        } else {
            self.frames.handled += agent.accepted + agent.refused;
            self.frames.rolled_back += agent.out_of_sequence;
            self.frames.refused += agent.refused;
        }
    }
}

/// Values at [`PERCENTS`], by nearest rank; empty where there are none.
pub(crate) fn distribution(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    // Rounded to the microsecond.
    let at = |percent: &u32| crate::score::percentiles::nearest_rank(&values, *percent as usize);
    PERCENTS.iter().filter_map(at).map(|value| libm::round(value * 1e3) / 1e3).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_has_a_value_at_every_percentage_or_none() {
        let values = distribution((0..1000).rev().map(f64::from).collect());
        assert_eq!(values.len(), PERCENTS.len());
        assert_eq!((values[0], values[11], values[22]), (9.0, 499.0, 989.0));
        assert!(distribution(Vec::new()).is_empty());
    }

    #[test]
    fn a_record_is_read_as_stored() {
        let errors = Errors { found: 3, ate_m: 0.1 + 0.2, ..Errors::default() };
        let record = Record { blocks: vec![[errors; 4]], cpu_share: Some(0.25), ..Record::default() };
        let text = serde_json::to_string(&record).unwrap();
        assert_eq!(serde_json::from_str::<Record>(&text).unwrap(), record);
    }
}
