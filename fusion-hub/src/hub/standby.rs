//! What a hub that stands by while another hub of its name publishes knows of the two.

use super::settings::HubSettings;
use crate::engine::PublishMode;
use crate::standby::Role;
use v2x_common::fused::FusedFrame;
use v2x_common::time::Timestamp;

/// What a hub that stands by knows of the other one.
pub(super) struct Standby {
    pub(super) role: Role,
    /// The newest list of the other hub, and when it came.
    pub(super) newest: Option<(FusedFrame, Timestamp)>,
    pub(super) compared_at: Timestamp,
    pub(super) takeovers: u64,
    pub(super) yielded: u64,
}

impl Standby {
    /// Of a hub that starts, where its settings say that it stands by.
    pub(super) fn of(settings: &HubSettings, now: Timestamp) -> Option<Self> {
        let interval = match settings.publish {
            PublishMode::OnUpdate { tick, .. } => tick,
            PublishMode::Fixed { interval } => interval,
        };
        settings.standby.then(|| Self {
            role: Role::new(settings.engine.lineage, interval, now),
            newest: None,
            compared_at: Timestamp::MIN,
            takeovers: 0,
            yielded: 0,
        })
    }
}
