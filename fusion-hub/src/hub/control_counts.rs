//! What became of everything that is not a detection frame.

use super::control_queue::QueueState;
use serde::{Deserialize, Serialize};
use v2x_common::net::queue::QueueCounts;

/// Sensor descriptions, liveliness tokens and queries. `received` is the sum of all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControlCounts {
    /// All that came.
    pub received: u64,
    /// Sensor descriptions taken in.
    pub descriptions: u64,
    /// Sensor descriptions refused; the agents' `descriptions_refused` say whose.
    pub descriptions_refused: u64,
    /// Sensor descriptions of agents to which the hub does not listen (`only_agents`).
    pub descriptions_left_out: u64,
    /// Liveliness tokens of agents that came or went.
    pub liveliness: u64,
    /// Queries answered.
    pub queries: u64,
    /// Queries that another hub of this name answers: the one that publishes, or the one that stands by.
    pub queries_of_others: u64,
    /// Queries with more than 4 kB of payload, parameters and attachment, which are not answered.
    #[serde(default)]
    pub queries_refused: u64,
    /// Those that wait.
    pub waiting: u64,
    /// Those that were dropped from a full queue.
    pub dropped: u64,
}

impl ControlCounts {
    /// With what the queue says.
    pub(super) const fn with(self, QueueState { items, queries_refused }: QueueState) -> Self {
        let QueueCounts { received, waiting, dropped } = items;
        Self { received, queries_refused, waiting, dropped, ..self }
    }

    /// Those of which it is known what became of them.
    pub const fn accounted(&self) -> u64 {
        self.descriptions
            + self.descriptions_refused
            + self.descriptions_left_out
            + self.liveliness
            + self.queries
            + self.queries_of_others
            + self.queries_refused
            + self.waiting
            + self.dropped
    }
}
