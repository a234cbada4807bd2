//! A summary for the tests of scores and reports.

use crate::data::fixture::{agent, predicted};
use crate::score::continuity::TrackSummary;
use crate::score::estimate::Estimate;
use crate::score::frame_metrics::Metrics;
use crate::score::percentiles::Percentiles;
use crate::score::run::summary::{AgentSummary, FusedSummary, Summary, Verdict};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::sensor::SensorKind;

/// A car, heading east; the standard deviation of its position is 0.5 m.
pub(crate) fn estimate(x: f64, y: f64) -> Estimate {
    Estimate { class: Class::Car, bev: predicted(x, y), position: Covariance2::isotropic(0.5) }
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
