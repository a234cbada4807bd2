//! The same evidence gives the same bits in any order of arrival.

use crate::world::{agent, at, config, description, detection, engine, engine_of_particles, frame};
use proptest::prelude::*;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::{Disposition, Refusal};
use v2x_fusion_hub::fusion::preset;

/// One frame: which objects are detected, and with what errors.
#[derive(Clone, Debug)]
struct Report {
    agent: usize,
    captured_ms: i64,
    detected: Vec<Option<(f64, f64)>>,
}

const AGENTS: [&str; 3] = ["ego", "rsu", "van"];
const N_OBJECTS: usize = 4;
/// All frames lie within Δmax of the moment at which the last one arrives.
const NOW_MS: i64 = 490;

fn reports() -> impl Strategy<Value = Vec<Report>> {
    // Errors within 1 σ: in every order of arrival, true pairs are within the gate.
    let detected =
        prop::collection::vec(prop::option::weighted(0.8, (-0.3..0.3f64, -0.3..0.3f64)), N_OBJECTS);
    let report = (0..AGENTS.len(), 0..NOW_MS, detected);
    let report = report.prop_map(|(agent, captured_ms, detected)| Report { agent, captured_ms, detected });
    prop::collection::vec(report, 1..24)
}

fn frames(reports: &[Report]) -> Vec<DetectionFrame> {
    let frame_of = |(sequence, report): (u64, &Report)| {
        let detected = (0..).zip(&report.detected);
        let detections =
            detected.filter_map(|(object, error)| Some(detection(object, at(report.captured_ms), (*error)?)));
        frame(agent(AGENTS[report.agent]), sequence, report.captured_ms, detections.collect())
    };
    (0..).zip(reports).map(frame_of).collect()
}

fn run<'a>(frames: impl IntoIterator<Item = &'a DetectionFrame>) -> (Engine, Vec<FusedObject>) {
    run_on(engine(), frames)
}

fn run_on<'a>(
    mut engine: Engine,
    frames: impl IntoIterator<Item = &'a DetectionFrame>,
) -> (Engine, Vec<FusedObject>) {
    for name in AGENTS {
        engine.handle_description(agent(name), description(1e-5)).expect("a valid description");
    }
    for frame in frames {
        let disposition = engine.handle_frame(frame, at(NOW_MS));
        assert!(matches!(disposition, Disposition::Accepted { .. }), "{disposition:?}");
    }
    let mut objects = engine.fused(at(NOW_MS)).objects.clone();
    objects.sort_by(|a, b| a.bev.y.total_cmp(&b.bev.y));
    (engine, objects)
}

/// Everything but the track's number, which depends on the order of arrival.
fn assert_same_bits(left: &[FusedObject], right: &[FusedObject]) {
    let unnumbered = |objects: &[FusedObject]| -> Vec<FusedObject> {
        objects.iter().map(|object| FusedObject { track: Default::default(), ..object.clone() }).collect()
    };
    for (left, right) in unnumbered(left).iter().zip(&unnumbered(right)) {
        assert_eq!(left, right);
    }
    assert_eq!(left.len(), right.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn any_order_of_arrival_gives_the_same_objects_and_states(
        (reports, order) in reports().prop_flat_map(|reports| {
            let order = Just((0..reports.len()).collect::<Vec<_>>()).prop_shuffle();
            (Just(reports), order)
        })
    ) {
        let frames = frames(&reports);
        let (_, in_time) = run({
            let mut sorted: Vec<_> = frames.iter().collect();
            sorted.sort_by_key(|frame| (frame.captured_at, frame.id));
            sorted
        });
        let shuffled = || order.iter().map(|place| &frames[*place]);
        assert_same_bits(&in_time, &run(shuffled()).1);
        // Without competing pairs all particles agree.
        assert_same_bits(&in_time, &run_on(engine_of_particles(8), shuffled()).1);
    }

    #[test]
    fn duplicates_and_publishing_in_between_change_no_bit(
        (reports, order) in reports().prop_flat_map(|reports| {
            let order = Just((0..reports.len()).collect::<Vec<_>>()).prop_shuffle();
            (Just(reports), order)
        }),
        publishes in prop::collection::vec(any::<bool>(), 24),
        repeats in prop::collection::vec(any::<bool>(), 24),
    ) {
        let frames = frames(&reports);
        let (_, at_once) = run(order.iter().map(|place| &frames[*place]));
        let mut engine = engine();
        for name in AGENTS {
            engine.handle_description(agent(name), description(1e-5)).expect("a valid description");
        }
        for ((place, publish), repeat) in order.iter().zip(publishes).zip(repeats) {
            engine.handle_frame(&frames[*place], at(NOW_MS));
            if publish {
                engine.fused(at(NOW_MS));
            }
            if repeat {
                let again = engine.handle_frame(&frames[*place], at(NOW_MS));
                prop_assert!(matches!(again, Disposition::Refused(Refusal::Duplicate { .. })), "{again:?}");
            }
        }
        let mut step_by_step = engine.fused(at(NOW_MS)).objects.clone();
        step_by_step.sort_by(|a, b| a.bev.y.total_cmp(&b.bev.y));
        assert_same_bits(&at_once, &step_by_step);
    }

    #[test]
    fn permuted_detections_give_the_same_objects_and_states(
        reports in reports(), rotate in 0usize..N_OBJECTS
    ) {
        let frames = frames(&reports);
        let mut rotated = frames.clone();
        for frame in &mut rotated {
            let count = frame.detections.len().max(1);
            frame.detections.rotate_left(rotate % count);
        }
        let strip = |objects: Vec<FusedObject>| -> Vec<FusedObject> {
            objects.into_iter().map(|object| FusedObject { contributors: Vec::new(), ..object }).collect()
        };
        assert_same_bits(&strip(run(&frames).1), &strip(run(&rotated).1));
    }
}

#[test]
fn a_late_detection_gives_the_same_state_as_one_in_time() {
    let ego = |sequence, ms| frame(agent("ego"), sequence, ms, vec![detection(0, at(ms), (0.2, 0.1))]);
    let rsu = frame(agent("rsu"), 0, 100, vec![detection(0, at(100), (-0.3, 0.0))]);
    let egos: Vec<_> = (0..5).map(|k| ego(k, 100 * i64::try_from(k).expect("test input"))).collect();
    let (_, in_time) = run([&egos[0], &rsu, &egos[1], &egos[2], &egos[3], &egos[4]]);
    let (_, late) = run([&egos[0], &egos[1], &egos[2], &egos[3], &egos[4], &rsu]);
    let (_, without) = run(&egos);
    assert_same_bits(&in_time, &late);
    let variance = |objects: &[FusedObject]| objects[0].kinematic_covariance[0];
    assert!(variance(&late) < variance(&without));
}

#[test]
fn evidence_older_than_the_initiation_becomes_the_initiation() {
    let newer = frame(agent("ego"), 1, 200, vec![detection(0, at(200), (0.0, 0.0))]);
    let older = frame(agent("rsu"), 1, 100, vec![detection(0, at(100), (0.0, 0.0))]);
    let (_, objects) = run([&newer, &older]);
    assert_eq!(objects.len(), 1, "one object, not one for each order");
    assert_eq!(objects[0].age, at(NOW_MS) - at(100));
}

#[test]
fn the_age_of_a_frame_counts_from_the_newest_hub_time() {
    let mut engine = engine();
    let ego = |sequence, ms| frame(agent("ego"), sequence, ms, vec![detection(0, at(ms), (0.0, 0.0))]);
    engine.handle_frame(&ego(0, 0), at(0));
    engine.fused(at(700));
    // Received at 490, when it was within Δmax; the hub has since folded everything before 200.
    let waited = engine.handle_frame(&ego(1, 10), at(490));
    assert!(matches!(waited, Disposition::Refused(Refusal::TooLate { .. })), "{waited:?}");
}

#[test]
fn the_papers_literal_text_loses_measurements_newer_than_a_late_one() {
    let ego = |sequence: u64| {
        let ms = 100 * i64::try_from(sequence).expect("test input");
        frame(agent("ego"), sequence, ms, vec![detection(0, at(ms), (0.2, 0.1))])
    };
    let late = frame(agent("rsu"), 0, 150, vec![detection(0, at(150), (-0.3, 0.0))]);
    let run = |method: &str, frames: &[&DetectionFrame]| {
        let mut engine = Engine::new(config().with_preset(preset(method).expect("a preset of the hub")));
        frames.iter().for_each(|frame| {
            engine.handle_frame(frame, at(NOW_MS));
        });
        engine.fused(at(NOW_MS)).objects.clone()
    };
    let (early, newer) = ([ego(0), ego(1)], [ego(2), ego(3), ego(4)]);
    let in_order = [&early[0], &early[1], &newer[0], &newer[1], &newer[2], &late];
    let without_newer = [&early[0], &early[1], &late];
    let states = |objects: Vec<FusedObject>| objects.iter().map(|object| object.bev).collect::<Vec<_>>();
    assert_eq!(states(run("unikf-literal", &in_order)), states(run("unikf-literal", &without_newer)));
    assert_ne!(states(run("unikf-paper", &in_order)), states(run("unikf-paper", &without_newer)));
}
