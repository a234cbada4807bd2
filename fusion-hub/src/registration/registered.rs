//! The agents whose errors are estimated.

use super::decision::Decision;
use super::model::Bias;
use super::settings::REFERENCE;
#[cfg(test)]
use super::slot::MAX_REGISTERED;
use super::whiteness::Whiteness;
use crate::values::MOST_ACCURACY;
use serde::{Deserialize, Serialize};
use v2x_common::id::AgentId;
use v2x_common::sensor::Accuracy;
use v2x_common::time::Timestamp;

/// The record of one agent beside its errors.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct RegisteredAgent {
    pub(super) agent: AgentId,
    pub(super) accuracy: Accuracy,
    pub(super) whiteness: Whiteness,
    pub(super) decision: Decision,
    /// The correction of its frames.
    pub(super) applied: Bias,
    /// Differences that its reports made.
    pub(super) pairs: u64,
    /// Since when its errors are estimated, by the hub's clock.
    pub(super) since: Timestamp,
    /// When it last described itself or sent a frame, by the hub's clock.
    pub(super) heard_at: Timestamp,
}

impl RegisteredAgent {
    pub(super) fn new(agent: AgentId, accuracy: Accuracy, heard_at: Timestamp) -> Self {
        Self {
            agent,
            accuracy,
            whiteness: Whiteness::default(),
            decision: Decision::default(),
            applied: Bias::ZERO,
            pairs: 0,
            since: heard_at,
            heard_at,
        }
    }

    /// Standard deviations of dx and dy (m), yaw (rad) and clock (s), as declared; zero where it declares
    /// no error.
    pub(super) fn sigmas(&self) -> [f64; 4] {
        let Accuracy { position_m, yaw_rad, clock_s } = self.accuracy;
        let position_m = position_m.min(MOST_ACCURACY.position_m);
        [position_m, position_m, yaw_rad.min(MOST_ACCURACY.yaw_rad), clock_s.min(MOST_ACCURACY.clock_s)]
    }

    /// Whether it is a reference for others.
    pub(super) fn is_reference(&self) -> bool {
        let Accuracy { position_m, yaw_rad, clock_s } = self.accuracy;
        position_m <= REFERENCE.position_m && yaw_rad <= REFERENCE.yaw_rad && clock_s <= REFERENCE.clock_s
    }
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![("registration.most", format!("{MOST_ACCURACY:?}, {MAX_REGISTERED} agents"))]
}
