use super::*;
use crate::fixture::{agent, at_ms, parked, predicted};
use crate::run_log::{ReceivedDetections, ReceivedFused};
use v2x_agent::truth::{Identities, TrueObject};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{FrameId, HubId, TrackId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};

const EGO: u32 = 1;
const COMMON: u32 = 2;
const OF_EGO: u32 = 3;
const UNSEEN: u32 = 4;

/// The ego vehicle stands at the origin and sees 50 m, the roadside unit at (30, 0) and sees 60 m.
fn world(_: Timestamp, out: &mut Vec<TrueObject>) {
    let places = [(UNSEEN, 200.0, 0.0), (EGO, 0.0, 0.0), (COMMON, 10.0, 5.0), (OF_EGO, -40.0, 0.0)];
    out.extend(places.map(|(id, x, y)| parked(id, x, y)));
}

fn pose(of: &AgentId, _: Timestamp) -> Option<Pose> {
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
        bev: BevBox { yaw: 0.1, ..predicted(x, y) },
        velocity: (0.0, 0.0),
        kinematic_covariance: [0.02, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 1.0, 0.0, 1.0],
        ww: 0.1,
        dd: 0.1,
        yaw_variance: 0.01,
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

/// Five seconds. Scoring starts at 2.22 s, for the roadside unit comes 200 ms later than the ego vehicle.
fn run() -> (RunLog, RunFacts) {
    let mut log = RunLog::default();
    for ms in (0..5_000).step_by(100) {
        // Two objects 0.4 m and 0.8 m off, clutter where only the ego vehicle sees, and itself, which
        // counts neither way.
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
        // All three covered objects, the unseen one, and from 4 s on a ghost where everybody sees.
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

fn scored(log: &RunLog, facts: &RunFacts) -> Result<ScoredRun, ScoreError> {
    score(log, Truth { objects_at: &world, agent_pose: &pose }, facts)
}

fn assert_close(value: Option<f64>, expected: f64) {
    assert!(value.is_some_and(|value| (value - expected).abs() < 1e-9), "{value:?} is not {expected}");
}

#[test]
fn scores_all_covered_objects_and_the_common_ones_apart() {
    let (log, facts) = run();
    let Summary { fused, agents, match_radius_m, scored_s, .. } = scored(&log, &facts).unwrap().summary;
    assert_close(Some(match_radius_m), 2.4);
    assert_close(Some(scored_s), 4.9 - 2.22);
    // 27 frames from 2.3 s to 4.9 s, the last 10 with a ghost.
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
fn passes_where_fusion_beats_every_agent() {
    let (log, facts) = run();
    let summary = scored(&log, &facts).unwrap().summary;
    assert_eq!(summary.verdict, Verdict { passed: true, reasons: vec![] });
    assert_close(summary.ate_ratio_to_best_agent, 0.25);
}

#[test]
fn the_hub_tells_how_each_agents_frames_fared() {
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
fn the_median_frame_is_the_one_in_the_middle_by_error() {
    let (mut log, facts) = run();
    for (place, received) in log.fused.iter_mut().enumerate() {
        // Errors fall from frame to frame: the middle one of 27 is the 14th, place 23 + 13.
        received.frame.objects[1].bev.y = 6.0 - 0.01 * f64::from(u32::try_from(place).unwrap());
    }
    assert_eq!(scored(&log, &facts).unwrap().median_frame(), Some(36));
}

#[test]
fn the_typical_moment_shows_truth_fused_list_and_each_agents_nearest_frame() {
    let (mut log, facts) = run();
    // 23 ms after its neighbours' capture; the agents' frame before it is nearer than the one after.
    log.fused.iter_mut().for_each(|received| received.frame.fused_at += Span::from_millis(23));
    let scored = scored(&log, &facts).unwrap();
    let truth = Truth { objects_at: &world, agent_pose: &pose };
    let scene = crate::plot::scene::typical_moment(&scored, &log, truth).unwrap();
    assert_eq!(
        scene.truth.iter().map(|truth| truth.is_covered).collect::<Vec<_>>(),
        [true, true, true, false]
    );
    assert_eq!(scene.agents.iter().map(|agent| agent.detections.len()).collect::<Vec<_>>(), [4, 2]);
    assert!(scene.agents.iter().all(|agent| agent.offset == Some(Span::from_millis(-23))));
    assert!(scene.fused.len() >= 4 && scene.subtitle.contains("0.10 m"), "{}", scene.subtitle);
}

#[test]
fn raw_errors_are_not_cut_off_at_the_match_radius() {
    let (mut log, facts) = run();
    log.detections.iter_mut().for_each(|received| received.frame.detections[0].bev.x += 100.0);
    let summary = scored(&log, &facts).unwrap().summary;
    assert_close(summary.agents[1].common.ate_m, libm::hypot(100.0, 0.5));
}

#[test]
fn runs_that_cannot_be_scored_say_why() {
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
    let nobody = RunFacts { agents: vec![], ..facts };
    assert_eq!(scored(&shorter, &nobody), Err(ScoreError::NoAgents));
}
