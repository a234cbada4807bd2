//! A hub's status, as JSON.

use crate::diagnosis::{Finding, Transport};
use crate::hub::control_counts::ControlCounts;
use crate::hub::health::Verdict;
use crate::hub::recorder::RecordingStatus;
use crate::hub::unnamed::InvalidName;
use crate::learning::LearntSensorReport;
use crate::registration::{AgentRegistration, Bias};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::net::zenoh_breakers::Breaker;
use v2x_common::net::zenoh_peers::Sessions;
use v2x_common::net::zenoh_refusals::ZenohRefusals;
use v2x_common::sensor::SensorDescription;
use v2x_common::wire::Writing;

/// The answer to a query of `v2x/{network}/hub/{hub}/status`. Times are µs since the Unix epoch.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HubStatus {
    /// Which hub.
    pub hub: HubId,
    /// In which network.
    pub network: NetworkId,
    /// How agents write their frames, where the hub's configuration says so.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub writings: BTreeMap<AgentId, Writing>,
    /// Version of the program.
    pub version: String,
    /// New at every start.
    pub lineage: u32,
    /// When it started, µs.
    pub started_at: i64,
    /// When it answered, µs.
    pub now: i64,
    /// How far the system's clock is ahead of the hub's, since somebody set it, ms. The hub's own time goes on.
    #[serde(default)]
    pub clock_step_ms: f64,
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
    /// Samples dropped from a full queue.
    pub dropped_overload: u64,
    /// Everything that arrived beside detection frames, and what became of it.
    #[serde(default)]
    pub control: ControlCounts,
    /// Frames and descriptions of agents beyond the hub's limit of agents.
    pub refused_beyond_limit: u64,
    /// Samples under keys without a valid agent name.
    pub refused_unnamed: u64,
    /// These names, at most 32, each with the reason.
    #[serde(default)]
    pub invalid_names: Vec<InvalidName>,
    /// Liveliness tokens that appeared when there was no room for another agent.
    #[serde(default)]
    pub alive_beyond_limit: u64,
    /// Objects that were not tracked for lack of room.
    pub births_refused: u64,
    /// Tracks that were merged into an older one of the same object.
    pub merges: u64,
    /// Objects left out of a fused frame because the wire has no room for their values.
    pub objects_withheld: u64,
    /// Key frames and delta frames put, in either codec: only while somebody subscribes.
    #[serde(default)]
    pub delta_frames_published: u64,
    /// Frames of tiles put, in either codec: only while somebody subscribes.
    #[serde(default)]
    pub tile_frames_published: u64,
    /// Frame received → first fused frame put that contains it, in the last minute, ms.
    pub latency_ms: Quantiles,
    /// The part of it in which the hub worked, in the last minute, ms.
    pub compute_ms: Quantiles,
    /// What fused frames take to be made and put, in the last minute, ms: the next one waits for twice as long.
    #[serde(default)]
    pub publish_ms: Quantiles,
    /// Resident memory, bytes; where the system reports it.
    pub memory_bytes: Option<u64>,
    /// The hub's own recording, where it writes one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<RecordingStatus>,
    /// Of a hub that stands by while another hub of its name publishes: which of the two does, and what has happened.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standby: Option<StandbyStatus>,
    /// Healthy or degraded.
    #[serde(default)]
    pub verdict: Verdict,
    /// Beginning of the ten seconds by which the agents were judged last, µs; `None` before the first ones are over.
    #[serde(default)]
    pub judged_since: Option<i64>,
    /// What is probably wrong, the worst first, in sentences that say what to change.
    #[serde(default)]
    pub findings: Vec<Finding>,
    /// What Zenoh has refused: handshakes, and messages that the access control denies.
    #[serde(default)]
    pub refused_by_zenoh: ZenohRefusals,
    /// Who is connected: agents, consumers, routers.
    #[serde(default)]
    pub sessions: Sessions,
    /// By whose messages Zenoh's code was broken, the newest last; also before this process began again by itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken_by: Vec<Breaker>,
    /// Every agent of which the hub has received anything, by name.
    pub agents: Vec<AgentStatus>,
}

/// The status of one of two hubs of a name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StandbyStatus {
    /// Whether it is this one that publishes.
    pub publishes: bool,
    /// The lineage of the hub that it follows.
    pub follows: Option<u32>,
    /// When it heard another hub last, µs.
    pub heard_at: Option<i64>,
    /// How often it began to publish.
    pub takeovers: u64,
    /// How often it stopped, because another hub published.
    pub yielded: u64,
    /// How many of its tracks have an id that another hub gave.
    pub named_by_another: usize,
}

/// The status of one agent.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AgentStatus {
    /// Which agent.
    pub id: AgentId,
    /// Whether it holds its liveliness token, or has sent anything in the last five seconds.
    pub alive: bool,
    /// What it rides on, while that is not in the world: it sends nothing then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub idle: Option<String>,
    /// Frames accepted.
    pub accepted: u64,
    /// Frames accepted that were measured within ε_s of the newest accepted before.
    pub synchronous: u64,
    /// Frames accepted that were older than the newest accepted before by more than ε_s.
    pub out_of_sequence: u64,
    /// Frames accepted that were measured in the future by the hub's clock.
    pub ahead_of_time: u64,
    /// How often its clock was ahead of the hub's and was set back.
    #[serde(default)]
    pub clock_set_back: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<String, u64>,
    /// The newest refusal in words.
    pub last_refusal: Option<String>,
    /// Impossible detections of accepted frames, which were dropped, by field and cause.
    #[serde(default)]
    pub dropped_detections: BTreeMap<String, u64>,
    /// The newest of them in words.
    #[serde(default)]
    pub last_dropped: Option<String>,
    /// Detections whose class name was not known.
    pub unmapped_classes: u64,
    /// These class names, at most 32, each with its number of detections.
    #[serde(default)]
    pub unmapped_names: BTreeMap<String, u64>,
    /// Sensor descriptions refused.
    pub descriptions_refused: u64,
    /// Mean normalised innovation squared of its positions for each degree of freedom, in the last minute: 1 where its
    /// reported covariance is consistent, more where it is too small.
    pub nis_per_dof: Option<f64>,
    /// The estimate of its clock and pose errors, where it describes its accuracy and registration is not off.
    #[serde(default)]
    pub registration: Option<RegistrationStatus>,
    /// What is learnt of its sensor, to be held against `sensor`; of a method that learns.
    #[serde(default)]
    pub learnt: Option<LearntSensorReport>,
    /// How its frames have arrived in the last seconds.
    #[serde(default)]
    pub transport: Option<Transport>,
    /// Capture time of its newest accepted frame, as corrected, µs.
    pub newest_captured_at: Option<i64>,
    /// Its sensor description, once it has sent one.
    pub sensor: Option<SensorDescription>,
}

impl AgentStatus {
    /// An agent that is alive but has sent nothing yet.
    pub(super) fn silent(id: AgentId) -> Self {
        Self {
            id,
            alive: true,
            idle: None,
            accepted: 0,
            synchronous: 0,
            out_of_sequence: 0,
            ahead_of_time: 0,
            clock_set_back: 0,
            refused: BTreeMap::new(),
            last_refusal: None,
            dropped_detections: BTreeMap::new(),
            last_dropped: None,
            unmapped_classes: 0,
            unmapped_names: BTreeMap::new(),
            descriptions_refused: 0,
            nis_per_dof: None,
            registration: None,
            learnt: None,
            transport: None,
            newest_captured_at: None,
            sensor: None,
        }
    }
}

/// By how much an agent's clock and pose err, as its shared objects show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegistrationStatus {
    /// Its pose lies so far east of the true one.
    pub dx_m: f64,
    /// And so far north.
    pub dy_m: f64,
    /// And is turned counter-clockwise by this.
    pub dyaw_deg: f64,
    /// Its stamps are ahead of the time by this.
    pub clock_ms: f64,
    /// Standard deviation of `dx_m`.
    pub dx_sigma_m: f64,
    /// Standard deviation of `dy_m`.
    pub dy_sigma_m: f64,
    /// Standard deviation of `dyaw_deg`.
    pub dyaw_sigma_deg: f64,
    /// Standard deviation of `clock_ms`.
    pub clock_sigma_ms: f64,
    /// Covariance of all four, in the order and units above.
    pub covariance: [[f64; 4]; 4],
    /// Correction of its frames, east.
    pub applied_dx_m: f64,
    /// Correction of its frames, north.
    pub applied_dy_m: f64,
    /// Correction of its frames, counter-clockwise.
    pub applied_dyaw_deg: f64,
    /// Correction of its stamps.
    pub applied_clock_ms: f64,
    /// Whether shared objects show its position.
    pub position_observable: bool,
    /// Whether shared objects show its heading.
    pub yaw_observable: bool,
    /// Whether shared objects show its clock.
    pub clock_observable: bool,
    /// All shared objects move alike: a clock error and a pose error have the same effect.
    pub confounded: bool,
    /// It is a reference for others: its declared errors are small enough.
    pub reference: bool,
    /// No chain of shared objects leads to a reference: only differences to others are known.
    pub relative_only: bool,
    /// Its error exceeds the declared accuracy.
    pub exceeds_declared: bool,
    /// The part of the declared variance that is independent in each frame.
    pub white_share: f64,
    /// Shared objects that it was compared by.
    pub pairs: u64,
}

impl RegistrationStatus {
    /// In the units that people read.
    pub fn of(one: &AgentRegistration) -> Self {
        const UNITS: [f64; 4] = [1.0, 1.0, 180.0 / std::f64::consts::PI, 1e3];
        let read = |bias: &Bias| {
            let bias = bias.to_array();
            [0, 1, 2, 3].map(|k| bias[k] * UNITS[k])
        };
        let [dx_m, dy_m, dyaw_deg, clock_ms] = read(&one.bias);
        let [dx_sigma_m, dy_sigma_m, dyaw_sigma_deg, clock_sigma_ms] = read(&one.sigma);
        let [applied_dx_m, applied_dy_m, applied_dyaw_deg, applied_clock_ms] = read(&one.applied);
        let entry = |row: usize, column: usize| one.covariance[row][column] * UNITS[row] * UNITS[column];
        Self {
            dx_m,
            dy_m,
            dyaw_deg,
            clock_ms,
            dx_sigma_m,
            dy_sigma_m,
            dyaw_sigma_deg,
            clock_sigma_ms,
            covariance: [0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| entry(row, column))),
            applied_dx_m,
            applied_dy_m,
            applied_dyaw_deg,
            applied_clock_ms,
            position_observable: one.observable.position,
            yaw_observable: one.observable.yaw,
            clock_observable: one.observable.clock,
            confounded: one.confounded,
            reference: one.is_reference,
            relative_only: one.relative_only,
            exceeds_declared: one.exceeds_declared,
            white_share: one.white_share,
            pairs: one.pairs,
        }
    }

    /// One line of text: the estimate, and the correction. `None` where nothing was compared.
    pub fn in_words(&self) -> Option<String> {
        if self.reference || self.pairs == 0 {
            return None;
        }
        let mut parts = vec![format!(
            "position {:+.2} ± {:.2} m east, {:+.2} ± {:.2} m north; heading {:+.2} ± {:.2}°; clock {:+.0} ± {:.0} ms",
            self.dx_m,
            self.dx_sigma_m,
            self.dy_m,
            self.dy_sigma_m,
            self.dyaw_deg,
            self.dyaw_sigma_deg,
            self.clock_ms,
            self.clock_sigma_ms,
        )];
        let corrected = [
            (libm::hypot(self.applied_dx_m, self.applied_dy_m), "position", 2, " m"),
            (self.applied_dyaw_deg.abs(), "heading", 2, "°"),
            (self.applied_clock_ms.abs(), "clock", 0, " ms"),
        ];
        let corrected = corrected.into_iter().filter(|(by, ..)| *by > 0.0);
        parts.extend(
            corrected.map(|(by, what, digits, unit)| format!("{what} corrected by {by:.digits$}{unit}")),
        );
        let remarks = [
            (self.relative_only, "relative only: it shares no objects with a surveyed agent"),
            (self.confounded, "clock and position confounded: all shared objects move alike"),
            (self.exceeds_declared, "errs by more than it declares, which is as far as it is corrected"),
        ];
        parts.extend(remarks.into_iter().filter(|(holds, _)| *holds).map(|(_, remark)| remark.to_owned()));
        Some(parts.join("; "))
    }
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

/// Resident memory of this process, bytes, where the system reports it.
pub(super) fn memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::Observable;

    fn registration(applied: Bias) -> AgentRegistration {
        AgentRegistration {
            agent: AgentId::new("car").unwrap(),
            bias: Bias { dx_m: 0.3, dy_m: -0.4, yaw_rad: 0.01, clock_s: 0.05 },
            sigma: Bias { dx_m: 0.1, dy_m: 0.1, yaw_rad: 0.002, clock_s: 0.01 },
            covariance: [
                [0.01, 0.0, 0.0, 0.0005],
                [0.0, 0.01, 0.0, 0.0],
                [0.0, 0.0, 4e-6, 0.0],
                [0.0005, 0.0, 0.0, 1e-4],
            ],
            applied,
            observable: Observable { position: true, yaw: true, clock: true },
            confounded: false,
            is_reference: false,
            relative_only: false,
            exceeds_declared: false,
            white_share: 0.0,
            pairs: 100,
        }
    }

    #[test]
    fn registration_is_reported_in_metres_degrees_and_milliseconds() {
        let json = serde_json::to_value(RegistrationStatus::of(&registration(Bias::ZERO))).unwrap();
        let is_near = |field: &str, value: f64| (json[field].as_f64().unwrap() - value).abs() < 1e-3;
        assert!(is_near("dyaw_deg", 0.573) && is_near("clock_ms", 50.0) && is_near("clock_sigma_ms", 10.0));
        assert_eq!(json["covariance"][0][3], 0.5, "m·ms");
        assert_eq!((&json["applied_dx_m"], &json["relative_only"]), (&0.0.into(), &false.into()));
    }

    #[test]
    fn the_text_gives_the_estimate_and_the_correction_where_objects_were_compared() {
        let silent = AgentRegistration { pairs: 0, ..registration(Bias::ZERO) };
        assert_eq!(RegistrationStatus::of(&silent).in_words(), None);
        let estimated = RegistrationStatus::of(&registration(Bias::ZERO)).in_words().unwrap();
        assert!(estimated.contains("clock +50 ± 10 ms") && !estimated.contains("corrected"), "{estimated}");
        let corrected = registration(Bias { clock_s: 0.05, ..Bias::ZERO });
        let exceeding = AgentRegistration { exceeds_declared: true, ..corrected };
        let words = RegistrationStatus::of(&exceeding).in_words().unwrap();
        assert!(words.contains("; clock corrected by 50 ms; errs by more than it declares"), "{words}");
    }
}
