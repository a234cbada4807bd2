//! The published estimate of an agent's errors.

use super::model::Bias;
use serde::{Deserialize, Serialize};
use v2x_common::id::AgentId;

/// Which of an agent's errors the shared objects show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Observable {
    /// Position, in every direction.
    pub position: bool,
    /// Heading.
    pub yaw: bool,
    /// Clock.
    pub clock: bool,
}

/// The estimate of one agent's clock and pose errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentRegistration {
    /// The agent.
    pub agent: AgentId,
    /// The estimate.
    pub bias: Bias,
    /// Its standard deviations.
    pub sigma: Bias,
    /// Its covariance, in the order and units of [`Bias`].
    pub covariance: [[f64; 4]; 4],
    /// The correction of the agent's frames.
    pub applied: Bias,
    /// Which errors are observable.
    pub observable: Observable,
    /// All shared objects move alike: a clock error and a pose error have the same effect.
    pub confounded: bool,
    /// It is a reference for others: its declared errors are small enough.
    pub is_reference: bool,
    /// It shares objects, but no chain of such leads to a reference: only differences are known.
    pub relative_only: bool,
    /// Its error exceeds the declared accuracy.
    pub exceeds_declared: bool,
    /// The part of the declared variance that is independent in each frame.
    pub white_share: f64,
    /// Differences formed from its reports.
    pub pairs: u64,
}
