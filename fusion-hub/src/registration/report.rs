//! What is told of an agent's errors.

use super::model::Bias;
use v2x_common::id::AgentId;

/// Which of an agent's errors the shared objects show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observable {
    /// Position, in every direction.
    pub position: bool,
    /// Heading.
    pub yaw: bool,
    /// Clock.
    pub clock: bool,
}

/// What is believed of one agent's clock and pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentRegistration {
    /// Whose.
    pub agent: AgentId,
    /// The estimate.
    pub bias: Bias,
    /// Its standard deviations.
    pub sigma: Bias,
    /// Its covariance, in the order and units of [`Bias`].
    pub covariance: [[f64; 4]; 4],
    /// What is taken out of the agent's frames.
    pub applied: Bias,
    /// What can be seen.
    pub observable: Observable,
    /// All shared objects move alike: a clock that is ahead looks like a pose that lies behind.
    pub confounded: bool,
    /// It declares so little that others are measured by it.
    pub is_reference: bool,
    /// It shares objects, but no chain of such leads to a reference: only differences are known.
    pub relative_only: bool,
    /// It errs by more than it declares.
    pub exceeds_declared: bool,
    /// The part of the declared variance that is drawn anew in each frame.
    pub white_share: f64,
    /// Differences that its reports made.
    pub pairs: u64,
}
