//! The status of the hub itself, and its display where a monitor watches.

use super::Hub;
use crate::engine::PublishMode;
use crate::hub::agent_statuses::agent_statuses;
use crate::hub::health::Verdict;
use crate::hub::monitor::Snapshot;
use crate::hub::recorder::RecordingStatus;
use crate::hub::status::{HubStatus, memory_bytes};
use v2x_common::clock;
use v2x_common::net::zenoh_breakers;
use v2x_common::net::zenoh_refusals::zenoh_refusals;
use v2x_common::time::Timestamp;

impl Hub {
    pub(super) fn status(&self) -> HubStatus {
        let counts = self.core.engine().counts();
        HubStatus {
            hub: self.settings.engine.hub,
            network: self.network_id,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            lineage: self.settings.engine.lineage,
            started_at: self.started_at.as_micros(),
            now: clock::now().as_micros(),
            clock_step_ms: self.system_clock.step.as_millis_f64(),
            locators: self.locators.clone(),
            tracks: counts.tracks,
            objects: self.objects,
            frames_published: self.frames_published,
            publish_errors: self.publish_errors,
            dropped_overload: self.dropped(),
            control: self.control.with(self.network.control.counts()),
            refused_beyond_limit: self.core.engine().agents().refused_beyond_limit(),
            refused_unnamed: self.network.unnamed.samples(),
            invalid_names: self.network.unnamed.names(),
            alive_beyond_limit: self.roster.beyond_limit(),
            births_refused: counts.births_refused,
            merges: counts.merges,
            objects_withheld: self.objects_withheld,
            delta_frames_published: self.partial_lists.delta_frames(),
            tile_frames_published: self.partial_lists.tile_frames(),
            latency_ms: self.timing.latency_ms(),
            compute_ms: self.timing.compute_ms(),
            publish_ms: self.timing.publish_ms(),
            memory_bytes: memory_bytes(),
            refused_by_zenoh: zenoh_refusals(),
            sessions: self.access.sessions(),
            broken_by: zenoh_breakers::breakers(),
            writings: self.settings.writings(),
            verdict: Verdict::of(self.health.findings()),
            judged_since: self.core.survey().judged_since().map(Timestamp::as_micros),
            findings: self.health.findings().to_vec(),
            standby: self.standby_status(),
            agents: agent_statuses(&self.core, &self.roster),
            recording: self.journal.recorder().map(RecordingStatus::of),
        }
    }

    /// Shows itself where somebody watches; whether its session is open.
    pub(super) fn show(&self, is_joined: bool) {
        let Some(monitor) = &self.monitor else { return };
        let [latency, compute, publish] = self.timing.totals();
        monitor.show(Snapshot {
            status: self.status(),
            latency,
            compute,
            publish,
            candidates: self.core.engine().counts().candidates,
            shown_at: clock::now(),
            is_joined,
            listed_at: self.listed_at.max(self.followed_at()),
            list_interval: match self.settings.publish {
                PublishMode::OnUpdate { tick, .. } => tick,
                PublishMode::Fixed { interval } => interval,
            },
        });
    }
}
