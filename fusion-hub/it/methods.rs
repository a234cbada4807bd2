//! Methods other than ours in the engine.

use crate::world::{agent, at, config, description, detection, frame};
use v2x_common::class::Class;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::baselines::Rule;
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::{
    AdmittedFrame, FrameOutcome, Fusion, FusionMethod, MAX_WINDOW_BOXES, ObjectList, PRESETS, TrackCounts,
    WindowConfig, preset,
};
use v2x_fusion_hub::values::AgentNames;

fn one_car(name: &str, sequence: u64, captured_ms: i64, error_m: f64) -> DetectionFrame {
    let car = detection(0, at(captured_ms), (error_m, 0.0));
    frame(agent(name), sequence, captured_ms, vec![car])
}

fn after(method: &str, frames: &[(i64, DetectionFrame)], now_ms: i64) -> FusedFrame {
    let mut engine = Engine::new(config().with_preset(preset(method).expect("a preset of the hub")));
    for (arrival_ms, frame) in frames {
        assert!(matches!(engine.handle_frame(frame, at(*arrival_ms)), Disposition::Accepted { .. }));
    }
    engine.fused(at(now_ms)).clone()
}

fn agents_in(object: &FusedObject) -> Vec<String> {
    object.contributors.iter().map(|used| used.frame.agent.to_string()).collect()
}

#[test]
fn least_squares_fuses_what_lies_within_its_window_of_100_ms() {
    for (delay_ms, n_contributors) in [(90, 2), (110, 1)] {
        let frames = [(0, one_car("b", 0, -delay_ms, 0.0)), (0, one_car("a", 0, 0, 0.0))];
        let fused = after("csba-wls", &frames, 10);
        assert_eq!(fused.objects.len(), 1);
        assert_eq!(agents_in(&fused.objects[0]).len(), n_contributors, "{delay_ms} ms apart");
        assert_eq!(fused.objects[0].last_measured_at, at(0));
    }
}

#[test]
fn without_memory_an_agents_newest_frame_is_all_there_is_of_it() {
    let frames = [(0, one_car("a", 1, 0, 0.5)), (5, one_car("a", 0, -50, 9.0))];
    let fused = after("csba-wls", &frames, 10);
    assert_eq!((fused.objects.len(), fused.objects[0].bev.x), (1, 0.5));
    assert_eq!(fused.objects[0].contributors[0].frame.sequence, 1);
}

#[test]
fn a_list_ends_when_it_is_older_than_objects_are_kept() {
    let frames = [(0, one_car("a", 0, 0, 0.0))];
    assert_eq!(after("wbf", &frames, 1500).objects.len(), 1);
    assert_eq!(after("wbf", &frames, 1501).objects.len(), 0);
}

#[test]
fn the_main_agent_comes_first_whatever_its_name() {
    let single = |main_agent| {
        let window = WindowConfig { main_agent, ..WindowConfig::new(Rule::Single(0)) };
        let mut engine = Engine::new(EngineConfig { fusion: Fusion::Window(window), ..config() });
        engine.handle_frame(&one_car("a", 0, 0, 0.0), at(0));
        engine.handle_frame(&one_car("b", 0, 0, 1.0), at(0));
        engine.fused(at(0)).objects.iter().flat_map(agents_in).collect::<Vec<_>>()
    };
    assert_eq!(single(None), ["a"]);
    assert_eq!(single(Some(agent("b"))), ["b"]);
    assert_eq!(single(Some(agent("c"))), [""; 0], "nobody stands in for a silent main agent");
}

#[test]
fn every_method_publishes_a_car_that_two_agents_report() {
    for method in PRESETS.iter().map(|preset| preset.key) {
        let frames = [(0, one_car("a", 0, 0, 0.1)), (0, one_car("b", 0, 0, -0.1))];
        let lag_ms = preset(method).unwrap().fusion().lag().as_nanos() / 1_000_000;
        let fused = after(method, &frames, lag_ms);
        // Suppression by ties publishes it twice.
        let n = if method == "psa" { 2 } else { 1 };
        assert_eq!(fused.objects.len(), n, "{method}");
        for FusedObject { bev, class, kinematic_covariance: covariance, .. } in &fused.objects {
            assert!(bev.x.abs() <= 0.1 && *class == Class::Car, "{method}");
            assert!(covariance[0] > 0.0 && covariance[0] <= 0.0901, "{method}: {covariance:?}");
        }
    }
}

/// Publishes one object at the number of frames that it has received.
#[derive(Debug, Default)]
struct Counter(u32);

impl FusionMethod for Counter {
    fn handle_frame(&mut self, admitted: &AdmittedFrame<'_>) -> FrameOutcome<'_> {
        let z = admitted.sensor.measurement(&admitted.frame.detections[0]);
        assert_eq!(z.size, [1.8, 4.5]);
        self.0 += 1;
        FrameOutcome::default()
    }

    fn write_objects(&mut self, now: Timestamp, _: &AgentNames, objects: &mut ObjectList<'_>) {
        let bev = BevBox { x: f64::from(self.0), y: 0.0, w: 1.0, d: 1.0, yaw: 0.0 };
        let object = FusedObject::from_box(TrackId::new(1, 0), Class::Car, bev);
        objects.push(FusedObject { last_measured_at: now, ..object });
    }

    fn counts(&self) -> TrackCounts {
        TrackCounts { tracks: 1, ..TrackCounts::default() }
    }
}

#[test]
fn a_method_of_your_own_gets_admitted_frames_and_is_published() {
    let mut engine = Engine::with_fusion(config(), Box::new(Counter::default()));
    engine.handle_description(agent("a"), description(0.0)).expect("a valid description");
    assert!(matches!(engine.handle_frame(&one_car("a", 0, 0, 0.0), at(0)), Disposition::Accepted { .. }));
    let too_old = engine.handle_frame(&one_car("b", 0, -900, 0.0), at(0));
    assert!(matches!(too_old, Disposition::Refused(_)));
    let fused = engine.fused(at(1));
    assert_eq!((fused.objects.len(), fused.objects[0].bev.x), (1, 1.0));
    assert_eq!((fused.includes.len(), fused.agents.len()), (1, 2));
    assert_eq!(engine.fused(at(2)).objects.len(), 1, "each list begins empty");
}

#[test]
fn an_empty_frame_from_the_future_does_not_empty_the_list_of_a_single_frame_rule() {
    let mut engine = Engine::new(config().with_preset(preset("csba-wls").unwrap()));
    engine.handle_frame(&one_car("honest", 0, -50, 0.0), at(0));
    let ahead = DetectionFrame { detections: Vec::new(), ..one_car("ahead", 0, 300, 0.0) };
    assert!(matches!(engine.handle_frame(&ahead, at(0)), Disposition::Accepted { .. }));
    assert_eq!(engine.fused(at(1)).objects.len(), 1);
}

#[test]
fn a_single_frame_rule_is_bounded_and_leaves_out_the_longest_frames_first() {
    let crowd = |name: &str, n: u32| {
        let mut frame = one_car(name, 0, 0, 0.0);
        let car = frame.detections[0];
        frame.detections = (0..n)
            .map(|k| {
                let mut detection = car;
                detection.bev.x = 10.0 * f64::from(k % 60);
                detection.bev.y = 10.0 * f64::from(k / 60);
                detection
            })
            .collect();
        frame
    };
    for preset in PRESETS.iter().filter(|preset| matches!(preset.fusion(), Fusion::Window(_))) {
        let mut engine = Engine::new(config().with_preset(preset));
        let mut sent = 0;
        for k in 0..17 {
            engine.handle_frame(&crowd(&format!("crowd{k}"), 4096), at(0));
            sent += 4096;
        }
        engine.handle_frame(&crowd("modest", 20), at(0));
        let n_objects = engine.fused(at(1)).objects.len();
        assert!((1..=MAX_WINDOW_BOXES).contains(&n_objects), "{}: {n_objects}", preset.key);
        let refused = engine.counts().births_refused;
        assert!(
            refused >= (sent - MAX_WINDOW_BOXES) as u64 - 4096,
            "{}: {refused} boxes counted",
            preset.key
        );
        engine.handle_frame(&crowd("later", 1), at(2));
        engine.fused(at(3));
        assert_eq!(engine.counts().births_refused, refused, "{}: a frame is counted once", preset.key);
    }
}
