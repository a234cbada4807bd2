//! Scores of the test run.

use crate::data::fixture::{agent, at_ms};
use crate::score::run::error::ScoreError;
use crate::score::run::scored_run::RunFacts;
use crate::score::run::summary::{Summary, Verdict};
use crate::score::run::test_run::{run, scored};
use v2x_agent::truth::ObjectId;
use v2x_common::id::TrackId;
use v2x_common::sensor::SensorKind;

fn assert_close(value: Option<f64>, expected: f64) {
    assert!(value.is_some_and(|value| (value - expected).abs() < 1e-9), "{value:?} is not {expected}");
}

#[test]
fn covered_objects_and_common_objects_are_scored_separately() {
    let (log, facts) = run();
    let Summary { fused, agents, match_radius_m, scored_s, .. } = scored(&log, &facts).unwrap().summary;
    assert_close(Some(match_radius_m), 2.4);
    assert_close(Some(scored_s), 4.9 - 2.22);
    // 27 frames from 2.3 s to 4.9 s, the last 10 with a false object.
    assert_eq!(fused.metrics.frames, 27);
    assert_close(fused.metrics.ate_m, 0.1);
    assert_close(fused.metrics.aoe_deg, 0.1f64.to_degrees());
    assert_close(fused.metrics.precision, (17.0 + 10.0 * 0.75) / 27.0);
    assert_close(fused.metrics.recall, 1.0);
    assert_close(fused.common.ate_m, 0.1);
    assert_close(fused.common.nees_position, 0.25);
    assert_close(fused.common.precision, (17.0 + 10.0 * 0.5) / 27.0);
    assert_eq!((fused.common.true_positives, fused.common.false_positives), (27, 10));
    let [ego, rsu] = &agents[..] else { panic!("{agents:?}") };
    assert_close(ego.metrics.ate_m, 0.6);
    assert_close(ego.metrics.precision, 2.0 / 3.0);
    assert_close(ego.metrics.recall, 1.0);
    assert_close(ego.common.ate_m, 0.4);
    assert_close(ego.common.precision, 1.0);
    assert_close(rsu.metrics.ate_m, 0.35);
    assert_close(rsu.common.ate_m, 0.5);
    assert_eq!((ego.kind, rsu.kind), (SensorKind::Vehicle, SensorKind::RoadsideUnit));
}

#[test]
fn a_run_passes_if_fusion_is_better_than_every_agent() {
    let (log, facts) = run();
    let summary = scored(&log, &facts).unwrap().summary;
    assert_eq!(summary.verdict, Verdict { passed: true, reasons: vec![] });
    assert_close(summary.ate_ratio_to_best_agent, 0.25);
}

#[test]
fn the_summary_holds_accepted_and_refused_frames_of_each_agent() {
    let (log, facts) = run();
    let summary = scored(&log, &facts).unwrap().summary;
    let [ego, rsu] = &summary.agents[..] else { panic!() };
    assert_eq!((ego.frames_sent, ego.frames_received), (Some(50), Some(50)));
    assert_eq!((ego.frames_refused, ego.frames_late), (Some(2), Some(5)));
    assert_eq!((rsu.frames_sent, rsu.frames_received), (Some(50), None));
}

#[test]
fn a_track_that_changes_is_counted_once_per_change() {
    let (mut log, facts) = run();
    for received in &mut log.fused[40..] {
        received.frame.objects[1].track = TrackId::new(1, 99);
    }
    let tracks = scored(&log, &facts).unwrap().summary.fused.tracks;
    assert_eq!((tracks.objects, tracks.id_switches), (3, 1));
    assert_close(tracks.ids_per_object, 4.0 / 3.0);
}

#[test]
fn a_lost_object_costs_recall_and_no_error() {
    let (mut log, facts) = run();
    log.fused.iter_mut().for_each(|received| drop(received.frame.objects.remove(2)));
    let fused = scored(&log, &facts).unwrap().summary.fused;
    assert_close(fused.metrics.recall, 2.0 / 3.0);
    assert_close(fused.metrics.ate_m, 0.05);
    assert_close(fused.common.recall, 1.0);
}

#[test]
fn the_median_frame_has_the_median_error() {
    let (mut log, facts) = run();
    for (place, received) in log.fused.iter_mut().enumerate() {
        // Errors fall from frame to frame: the middle one of 27 is the 14th, place 23 + 13.
        received.frame.objects[1].bev.y = 6.0 - 0.01 * f64::from(u32::try_from(place).unwrap());
    }
    assert_eq!(scored(&log, &facts).unwrap().median_frame(), Some(36));
}

#[test]
fn raw_errors_are_not_cut_off_at_the_match_radius() {
    let (mut log, facts) = run();
    log.detections.iter_mut().for_each(|received| received.frame.detections[0].bev.x += 100.0);
    let summary = scored(&log, &facts).unwrap().summary;
    assert_close(summary.agents[1].common.ate_m, libm::hypot(100.0, 0.5));
}

#[test]
fn runs_that_cannot_be_scored_are_errors_with_a_reason() {
    let (log, facts) = run();
    let mut silent = log.clone();
    silent.detections.retain(|received| received.frame.id.agent != agent("rsu"));
    assert_eq!(scored(&silent, &facts), Err(ScoreError::NoDetections(agent("rsu"))));
    let mut short = log.clone();
    short.fused.truncate(20);
    assert_eq!(scored(&short, &facts), Err(ScoreError::NoFusedFrames { start: at_ms(2_220) }));
    let mut undescribed = log.clone();
    undescribed.descriptions.remove(&agent("ego"));
    assert_eq!(scored(&undescribed, &facts), Err(ScoreError::NoDescription(agent("ego"))));
    let mut foreign = log.clone();
    foreign.detections.iter_mut().for_each(|received| received.identities.objects[0] = Some(ObjectId(77)));
    assert!(matches!(scored(&foreign, &facts), Err(ScoreError::NotInTruth { object: ObjectId(77), .. })));
    let mut shorter = log;
    shorter.detections.iter_mut().for_each(|received| received.identities.objects.truncate(1));
    assert!(matches!(scored(&shorter, &facts), Err(ScoreError::Identities { identities: 1, .. })));
    let no_agents = RunFacts { agents: vec![], ..facts };
    assert_eq!(scored(&shorter, &no_agents), Err(ScoreError::NoAgents));
}
