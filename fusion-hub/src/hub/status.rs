//! What a hub tells of itself, as JSON.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::sensor::SensorDescription;

/// The answer to a query of `v2x/{network}/hub/{hub}/status`. Times are µs since the Unix epoch.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HubStatus {
    /// Which hub.
    pub hub: HubId,
    /// In which network.
    pub network: NetworkId,
    /// Version of the program.
    pub version: String,
    /// New at every start.
    pub lineage: u32,
    /// When it started, µs.
    pub started_at: i64,
    /// When it answered, µs.
    pub now: i64,
    /// Endpoints at which it listens.
    pub locators: Vec<String>,
    /// Tracks, published or not.
    pub tracks: usize,
    /// Objects in the newest fused frame.
    pub objects: usize,
    /// Fused frames put.
    pub frames_published: u64,
    /// Fused frames that could not be encoded or put.
    pub publish_errors: u64,
    /// Samples that were pushed out of the full queue unread.
    pub dropped_overload: u64,
    /// Frames of agents beyond the number that the hub keeps books on.
    pub refused_beyond_limit: u64,
    /// Samples under keys in which no legal agent name stands.
    pub refused_unnamed: u64,
    /// Objects that were not tracked for lack of room.
    pub births_refused: u64,
    /// Tracks that were merged into an older one of the same object.
    pub merges: u64,
    /// Objects left out of a fused frame because the wire has no room for their values.
    pub objects_withheld: u64,
    /// Frame received → first fused frame put that contains it, ms.
    pub latency_ms: Quantiles,
    /// The part of it in which the hub worked, ms.
    pub compute_ms: Quantiles,
    /// Resident memory, bytes; where the system tells.
    pub memory_bytes: Option<u64>,
    /// Every agent that was ever heard of, by name.
    pub agents: Vec<AgentStatus>,
}

/// How one agent fares.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AgentStatus {
    /// Which agent.
    pub id: AgentId,
    /// Whether it holds its liveliness token.
    pub alive: bool,
    /// Frames accepted.
    pub accepted: u64,
    /// Frames accepted that were measured within ε_s of the newest accepted before.
    pub synchronous: u64,
    /// Frames accepted that were older than the newest accepted before by more than ε_s.
    pub out_of_sequence: u64,
    /// Frames accepted that were measured in the future by the hub's clock.
    pub ahead_of_time: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<String, u64>,
    /// The newest refusal in words.
    pub last_refusal: Option<String>,
    /// Detections whose class name was not known.
    pub unmapped_classes: u64,
    /// Sensor descriptions refused.
    pub descriptions_refused: u64,
    /// Mean normalised innovation squared of its positions for each degree of freedom: 1 where its reported
    /// covariance is honest, more where it claims to be better than it is.
    pub nis_per_dof: Option<f64>,
    /// Capture time of its newest accepted frame, µs.
    pub newest_captured_at: Option<i64>,
    /// Its sensor description, once it has sent one.
    pub sensor: Option<SensorDescription>,
}

/// Quantiles of a span of time; `None` where nothing was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median.
    pub p50: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// 99th percentile.
    pub p99: Option<f64>,
    /// Longest.
    pub max: Option<f64>,
    /// How many were measured.
    pub count: u64,
}

/// Resident memory of this process, bytes, where the system tells.
pub(super) fn memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
