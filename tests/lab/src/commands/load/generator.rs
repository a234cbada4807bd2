//! Many agents of one process.

use crate::data::workload::{Arrival, Load, Workload};
use anyhow::{Context, anyhow};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::detection::DetectionFrame;
use v2x_common::geometry::Pose;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::keys::Keys;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, ENCODING_POSTCARD};
use zenoh::Session;
use zenoh::qos::{CongestionControl, Priority};

/// Agents that see the same objects.
const AGENTS_OF_GROUP: u32 = 5;
/// Groups stand this far from each other, m, in rows of so many.
const GROUP_SPACING_M: f64 = 400.0;
const GROUPS_OF_ROW: u32 = 16;

/// How much is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoadSize {
    pub(super) agents: u32,
    /// Of each agent.
    pub(super) rate_hz: u32,
    /// In view of each agent.
    pub(super) objects: u32,
    pub(super) seed: u64,
}

/// What was sent.
#[derive(Debug, Default)]
pub(super) struct Sent {
    frames: AtomicU64,
    detections: AtomicU64,
}

/// What was sent up to a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct SentCounts {
    pub(super) frames: u64,
    pub(super) detections: u64,
}

impl Sent {
    pub(super) fn counts(&self) -> SentCounts {
        SentCounts {
            frames: self.frames.load(Ordering::Relaxed),
            detections: self.detections.load(Ordering::Relaxed),
        }
    }
}

/// Frames in the order in which they are sent.
pub(super) struct Generator {
    arrivals: Vec<(u32, Arrival)>,
    description: Vec<u8>,
    agents: u32,
}

/// The centre of a group, m.
fn centre_of(group: u32) -> [f64; 2] {
    [group % GROUPS_OF_ROW, group / GROUPS_OF_ROW].map(|place| GROUP_SPACING_M * f64::from(place))
}

fn agent_of(group: u32, number: u32) -> anyhow::Result<AgentId> {
    Ok(AgentId::new(&format!("load-{:04}", group * AGENTS_OF_GROUP + number))?)
}

/// The names of all agents.
pub(super) fn agents(count: u32) -> anyhow::Result<Vec<AgentId>> {
    (0..count).map(|number| agent_of(number / AGENTS_OF_GROUP, number % AGENTS_OF_GROUP)).collect()
}

/// An agent's session, or the only one.
fn session_of<'a>(sessions: &'a [Session], agent: &AgentId) -> anyhow::Result<&'a Session> {
    let number =
        agent.as_str().rsplit('-').next().and_then(|number| number.parse::<usize>().ok()).unwrap_or(0);
    sessions.get(number).or(sessions.first()).context("no session")
}

impl Generator {
    /// Everything that is sent in a time, made beforehand: the generator is not to be what is measured.
    pub(super) fn new(size: &LoadSize, run_for: Duration) -> anyhow::Result<Self> {
        let start = Timestamp::EPOCH + Span::from_millis(1000);
        let until = start + Span::from_secs_f64(run_for.as_secs_f64());
        let n_groups = size.agents.div_ceil(AGENTS_OF_GROUP);
        let mut arrivals = Vec::new();
        let mut description = Vec::new();
        for group in 0..n_groups {
            let agents = AGENTS_OF_GROUP.min(size.agents - group * AGENTS_OF_GROUP);
            let seed = size.seed.wrapping_add(group.into());
            let LoadSize { rate_hz, objects, .. } = *size;
            let load = Load { agents, rate_hz, objects, view: None, late_share: 0.0, seed };
            let mut workload = Workload::new(load, start);
            let of_group = workload.arrivals_before(until)?;
            arrivals.extend(of_group.into_iter().map(|arrival| (group, arrival)));
            description.clear();
            let mut described = workload.description();
            described.field_of_view.range_max_m = GROUP_SPACING_M / 2.0;
            wire::sensor::encode(&described, &mut description)?;
        }
        // Phases of groups are spread.
        let spacing = 200_000_000 / i64::from(size.rate_hz);
        let shift = |group: u32| Span::from_nanos(i64::from(group) * spacing / i64::from(n_groups.max(1)));
        for (group, arrival) in &mut arrivals {
            arrival.received_at = Timestamp::EPOCH + (arrival.received_at + shift(*group) - start);
        }
        arrivals.sort_by_key(|(_, arrival)| arrival.received_at);
        Ok(Self { arrivals, description, agents: size.agents })
    }

    /// Sends everything at its time; by one session, or by one for each agent.
    pub(super) async fn run(
        self,
        sessions: Vec<Session>,
        keys: Keys,
        sent: Arc<Sent>,
        end: CancellationToken,
    ) -> anyhow::Result<()> {
        for number in 0..self.agents {
            let agent = agent_of(number / AGENTS_OF_GROUP, number % AGENTS_OF_GROUP)?;
            put(session_of(&sessions, &agent)?, keys.sensor(&agent), &self.description).await?;
        }
        let start = clock::now();
        let mut bytes = Vec::new();
        for (group, arrival) in &self.arrivals {
            let due = start + (arrival.received_at - Timestamp::EPOCH);
            let wait = due - clock::now();
            if wait > Span::from_millis(1) {
                tokio::time::sleep(wait.to_duration()).await;
            }
            if end.is_cancelled() {
                break;
            }
            let frame = at_its_place(&wire::detections::decode(&arrival.bytes)?, *group)?;
            bytes.clear();
            wire::detections::encode(&frame, &mut bytes)?;
            let session = session_of(&sessions, &frame.id.agent)?;
            put(session, keys.detections(&frame.id.agent), &bytes).await?;
            sent.frames.fetch_add(1, Ordering::Relaxed);
            sent.detections.fetch_add(arrival.n_detections, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// A frame of a group's own, captured now.
fn at_its_place(frame: &DetectionFrame, group: u32) -> anyhow::Result<DetectionFrame> {
    let [x, y] = centre_of(group);
    let number: u32 = frame.id.agent.as_str().rsplit('-').next().unwrap_or_default().parse()?;
    let mut moved = DetectionFrame {
        id: FrameId { agent: agent_of(group, number)?, ..frame.id },
        captured_at: clock::now(),
        sensor_pose: Some(Pose { x, y, yaw: 0.0 }),
        ..frame.clone()
    };
    for detection in &mut moved.detections {
        detection.bev.x += x;
        detection.bev.y += y;
    }
    Ok(moved)
}

async fn put(session: &Session, key: String, bytes: &[u8]) -> anyhow::Result<()> {
    session
        .put(key, bytes)
        .encoding(ENCODING_POSTCARD)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::DataHigh)
        .express(true)
        .await
        .map_err(|error| anyhow!("{error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_agent_sends_at_its_rate_at_the_place_of_its_group() {
        let size = LoadSize { agents: 12, rate_hz: 10, objects: 7, seed: 3 };
        let generator = Generator::new(&size, Duration::from_secs(2)).unwrap();
        let mut counts = std::collections::BTreeMap::new();
        for (group, arrival) in &generator.arrivals {
            let frame = at_its_place(&wire::detections::decode(&arrival.bytes).unwrap(), *group).unwrap();
            frame.validate().unwrap();
            *counts.entry(frame.id.agent).or_insert(0) += 1;
            let [x, y] = centre_of(*group);
            assert!(frame.detections.iter().all(|one| libm::hypot(one.bev.x - x, one.bev.y - y) < 100.0));
        }
        assert_eq!(counts.len(), 12);
        assert!(counts.values().all(|n| (19..=20).contains(n)), "{counts:?}");
        assert!(generator.arrivals.is_sorted_by_key(|(_, arrival)| arrival.received_at));
    }
}
