//! Small objects, observers and times for the tests of this crate.

use crate::metrics::Metrics;
use crate::percentiles::Percentiles;
use crate::run_log::ReceivedFused;
use crate::summary::{AgentSummary, FusedSummary, Summary, TrackSummary, Verdict};
use crate::truth::Observer;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::{FieldOfView, SensorKind};
use v2x_common::time::{Span, Timestamp};

pub(crate) fn at_ms(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(ms)
}

pub(crate) fn agent(name: &str) -> AgentId {
    AgentId::new(name).unwrap()
}

pub(crate) fn observer(name: &str, range_max_m: f64, itself: Option<u32>) -> Observer {
    Observer {
        agent: agent(name),
        field_of_view: FieldOfView::omnidirectional(0.0, range_max_m),
        itself: itself.map(ObjectId),
    }
}

/// A car's box, heading east.
pub(crate) fn predicted(x: f64, y: f64) -> BevBox {
    BevBox { x, y, w: 2.0, d: 4.0, yaw: 0.0 }
}

/// A parked car, heading east.
pub(crate) fn parked(id: u32, x: f64, y: f64) -> TrueObject {
    TrueObject { id: ObjectId(id), class: Class::Car, bev: predicted(x, y), velocity: (0.0, 0.0) }
}

/// A fused frame without objects that includes frames captured at these times, ms.
pub(crate) fn fused(received_ms: i64, fused_ms: i64, captured_ms: &[i64]) -> ReceivedFused {
    let include = |(sequence, captured): (u64, &i64)| Inclusion {
        frame: FrameId { agent: agent("ego"), epoch: 1, sequence },
        captured_at: at_ms(*captured),
        received_at: at_ms(captured + 5),
    };
    let frame = FusedFrame {
        hub: HubId::new("hub").unwrap(),
        lineage: 1,
        sequence: 0,
        fused_at: at_ms(fused_ms),
        map_frame: None,
        objects: vec![],
        agents: vec![],
        includes: (0..).zip(captured_ms).map(include).collect(),
    };
    ReceivedFused { received_at: at_ms(received_ms), frame }
}

fn metrics(ate_m: f64) -> Metrics {
    Metrics {
        ate_m: Some(ate_m),
        ade_m: Some(ate_m),
        aoe_deg: Some(10.0 * ate_m),
        precision: Some(0.99),
        recall: Some(0.95),
        gospa_m: Some(2.0 * ate_m),
        nees_position: Some(1.1),
        true_positives: 950,
        false_positives: 9,
        false_negatives: 50,
        frames: 100,
        ..Metrics::default()
    }
}

/// A good run of two agents without `compute_ms`.
pub(crate) fn summary() -> Summary {
    let agent = |name, kind, ate_m| AgentSummary {
        id: agent(name),
        kind,
        metrics: metrics(ate_m + 0.1),
        common: metrics(ate_m),
        frames_sent: Some(200),
        frames_received: Some(198),
        frames_refused: Some(2),
        frames_late: Some(31),
    };
    let spans = |p50| Some(Percentiles { p50, p95: 2.0 * p50, p99: 3.0 * p50 });
    let tracks = TrackSummary { objects: 40, ids_per_object: Some(1.05), id_switches: 2 };
    Summary {
        verdict: Verdict { passed: true, reasons: vec![] },
        scenario: "crossing".to_owned(),
        seed: 7,
        processes: 4,
        duration_s: 20.0,
        scored_s: 17.5,
        match_radius_m: 2.4,
        fused: FusedSummary { metrics: metrics(0.25), common: metrics(0.176), tracks },
        agents: vec![agent("ego", SensorKind::Vehicle, 0.5), agent("rsu", SensorKind::RoadsideUnit, 0.4)],
        ate_ratio_to_best_agent: Some(0.44),
        latency_ms: spans(0.4),
        compute_ms: None,
        end_to_end_ms: spans(61.0),
        age_of_information_ms: spans(48.0),
    }
}
