//! A run of two agents and four objects, for tests.

use crate::data::fixture::{agent, at_ms, parked, predicted};
use crate::data::run_log::{ReceivedDetections, ReceivedFused, RunLog};
use crate::data::simulation::AgentFacts;
use crate::data::truth::Truth;
use crate::score::percentiles::Percentiles;
use crate::score::run::error::ScoreError;
use crate::score::run::scored_run::{RunFacts, ScoredRun, score};
use v2x_agent::truth::{Identities, ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::{AgentHealth, FusedFrame, FusedObject};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId, TrackId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};

const EGO: u32 = 1;
const COMMON: u32 = 2;
const OF_EGO: u32 = 3;
const UNSEEN: u32 = 4;

/// The ego vehicle is at the origin with a range of 50 m, the roadside unit at (30, 0) with a range of 60 m.
pub(crate) fn world(_: Timestamp, out: &mut Vec<TrueObject>) {
    let places = [(UNSEEN, 200.0, 0.0), (EGO, 0.0, 0.0), (COMMON, 10.0, 5.0), (OF_EGO, -40.0, 0.0)];
    out.extend(places.map(|(id, x, y)| parked(id, x, y)));
}

pub(crate) fn pose(of: &AgentId, _: Timestamp) -> Option<Pose> {
    match of.as_str() {
        "ego" => Some(Pose::default()),
        "rsu" => Some(Pose { x: 30.0, y: 0.0, yaw: 0.0 }),
        _ => None,
    }
}

fn description(kind: SensorKind, range_max_m: f64) -> SensorDescription {
    SensorDescription {
        revision: 1,
        kind,
        field_of_view: FieldOfView::omnidirectional(2.0, range_max_m),
        detection_probability: 0.95,
        clutter_per_m2: 1e-5,
        size_noise: None,
        body: None,
        accuracy: Accuracy { position_m: 0.02, yaw_rad: 0.0, clock_s: 0.0 },
        rate_hz: 10.0,
    }
}

fn detections(name: &str, ms: i64, seen: &[(Option<u32>, f64, f64)]) -> ReceivedDetections {
    let detection = |&(_, x, y): &(_, f64, f64)| Detection {
        class: Class::Car,
        score: 1.0,
        bev: predicted(x, y),
        covariance: BoxCovariance { position: Covariance2::isotropic(0.6), ww: 0.1, dd: 0.1, yaw: 0.01 },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    };
    let sequence = u64::try_from(ms / 100).unwrap();
    let frame = DetectionFrame {
        id: FrameId { agent: agent(name), epoch: 1, sequence },
        captured_at: at_ms(ms),
        sensor_pose: None,
        sensor_revision: 1,
        map_frame: None,
        detections: seen.iter().map(detection).collect(),
    };
    let objects = seen.iter().map(|(identity, ..)| identity.map(ObjectId)).collect();
    ReceivedDetections {
        received_at: at_ms(ms + 20),
        frame,
        identities: Identities { epoch: 1, sequence, objects },
    }
}

fn fused(ms: i64, objects: &[(u32, f64, f64)]) -> ReceivedFused {
    let object = |&(track, x, y): &(u32, f64, f64)| FusedObject {
        track: TrackId::new(1, track),
        class: Class::Car,
        class_probabilities: vec![(Class::Car, 1.0)],
        class_conflict: 0.0,
        bev: BevBox { yaw: 0.1, ..predicted(x, y) },
        velocity: (0.0, 0.0),
        kinematic_covariance: [0.02, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 1.0, 0.0, 1.0],
        ww: 0.1,
        dd: 0.1,
        yaw_variance: 0.01,
        heading: v2x_common::detection::HeadingKind::Known,
        existence: 0.99,
        age: Span::from_millis(ms),
        last_measured_at: at_ms(ms),
        contributors: vec![],
    };
    let frame = FusedFrame {
        hub: HubId::new("hub").unwrap(),
        lineage: 1,
        sequence: 0,
        fused_at: at_ms(ms),
        map_frame: None,
        objects: objects.iter().map(object).collect(),
        agents: vec![AgentHealth {
            agent: agent("ego"),
            epoch: 1,
            newest_captured_at: at_ms(ms),
            accepted: 48,
            refused: 2,
            out_of_sequence: 5,
        }],
        includes: vec![],
    };
    ReceivedFused { received_at: at_ms(ms + 1), frame }
}

/// Five seconds. Scoring starts at 2.22 s: the roadside unit starts 200 ms later than the ego vehicle.
pub(crate) fn run() -> (RunLog, RunFacts) {
    let mut log = RunLog::default();
    for ms in (0..5_000).step_by(100) {
        // Two objects with errors of 0.4 m and 0.8 m, clutter in the ego vehicle's view only, and itself, which is
        // ignored.
        let seen = [
            (Some(OF_EGO), -40.8, 0.0),
            (None, -45.0, 0.0),
            (Some(COMMON), 10.4, 5.0),
            (Some(EGO), 0.0, 0.01),
        ];
        log.detections.push(detections("ego", ms, &seen));
        if ms >= 200 {
            log.detections.push(detections("rsu", ms, &[(Some(COMMON), 10.0, 5.5), (Some(EGO), 0.0, 0.2)]));
        }
        // All three covered objects, the uncovered one, and from 4 s on a false object in every agent's view.
        let mut objects = vec![(1, 0.0, 0.0), (2, 10.0, 5.1), (3, -40.0, 0.2), (4, 200.0, 1.0)];
        objects.extend((ms >= 4_000).then_some((5, 20.0, -20.0)));
        log.fused.push(fused(ms, &objects));
    }
    log.descriptions.insert(agent("ego"), description(SensorKind::Vehicle, 50.0));
    log.descriptions.insert(agent("rsu"), description(SensorKind::RoadsideUnit, 60.0));
    let facts = |name, itself: Option<u32>| AgentFacts {
        id: agent(name),
        itself: itself.map(ObjectId),
        frames_sent: Some(50),
    };
    let facts = RunFacts {
        scenario: "four objects".to_owned(),
        seed: 1,
        duration_s: 5.0,
        processes: 4,
        agents: vec![facts("ego", Some(EGO)), facts("rsu", None)],
        latency_ms: None,
        compute_ms: Percentiles::of(vec![0.2]),
    };
    (log, facts)
}

pub(crate) fn scored(log: &RunLog, facts: &RunFacts) -> Result<ScoredRun, ScoreError> {
    score(log, Truth { objects_at: &world, agent_pose: &pose }, facts)
}
