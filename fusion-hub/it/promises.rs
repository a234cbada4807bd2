//! What the hub promises while it publishes, with delays, gaps, misses and faulty agents.

use crate::world::{SIGMA_M, agent, at, config, description, detection, engine, frame};
use proptest::prelude::*;
use v2x_common::covariance::Covariance2;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::fusion::{Births, preset};

fn is_accepted(disposition: &Disposition) -> bool {
    matches!(disposition, Disposition::Accepted { .. })
}

/// A parked car, 50 m from the next.
fn parked(object: u32, error: (f64, f64)) -> Detection {
    let bev = BevBox { x: error.0, y: 50.0 * f64::from(object) + error.1, w: 1.8, d: 4.5, yaw: 0.0 };
    Detection { bev, ..detection(object, at(0), (0.0, 0.0)) }
}

#[derive(Clone, Debug)]
struct Report {
    agent: usize,
    captured_ms: i64,
    delay_ms: i64,
    detected: Vec<Option<(f64, f64)>>,
}

const AGENTS: [&str; 3] = ["ego", "rsu", "van"];
/// One is less accurate: of frames of one instant its own are associated last.
const SIGMAS_M: [f64; 3] = [SIGMA_M, SIGMA_M, 4.0 * SIGMA_M];
const END_MS: i64 = 2400;

/// Few reports and many misses: tracks are deleted and initiated again.
fn sparse() -> impl Strategy<Value = Vec<Report>> {
    let detected = prop::collection::vec(prop::option::weighted(0.35, (-0.3..0.3f64, -0.3..0.3f64)), 2);
    let delay = prop_oneof![3 => 0..20i64, 1 => 0..480i64];
    let report = (0..AGENTS.len(), 0..END_MS - 500, delay, detected);
    let report = report.prop_map(|(agent, captured_ms, delay_ms, detected)| Report {
        agent,
        captured_ms,
        delay_ms,
        detected,
    });
    prop::collection::vec(report, 20..60)
}

/// Many frames, many at the same time, and history folded meanwhile.
fn dense() -> impl Strategy<Value = Vec<Report>> {
    let detected = prop::collection::vec(prop::option::weighted(0.7, (-0.3..0.3f64, -0.3..0.3f64)), 2);
    let report = (0..AGENTS.len(), 0..190i64, 0..490i64, detected);
    let report = report.prop_map(|(agent, step, delay_ms, detected)| Report {
        agent,
        captured_ms: 10 * step,
        delay_ms,
        detected,
    });
    prop::collection::vec(report, 100..260)
}

/// Frames with the time at which they arrive, ms.
fn frames(reports: &[Report]) -> Vec<(i64, DetectionFrame)> {
    let arrival = |(sequence, report): (u64, &Report)| {
        let detected = (0..).zip(&report.detected);
        let accuracy = Covariance2::isotropic(SIGMAS_M[report.agent]);
        let detected = detected.filter_map(|(object, error)| {
            let mut one = parked(object, (*error)?);
            one.covariance.position = accuracy;
            Some(one)
        });
        let sent = frame(agent(AGENTS[report.agent]), sequence, report.captured_ms, detected.collect());
        (report.captured_ms + report.delay_ms, sent)
    };
    (0..).zip(reports).map(arrival).collect()
}

/// The same frames without their delays.
fn in_time(reports: &[Report]) -> Vec<(i64, DetectionFrame)> {
    let in_time = |report: &Report| Report { delay_ms: 0, ..report.clone() };
    frames(&reports.iter().map(in_time).collect::<Vec<_>>())
}

/// The objects at the end, but for their numbers, of a hub that publishes every so many ms.
fn run(mut frames: Vec<(i64, DetectionFrame)>, every_ms: i64, method: &str) -> Vec<FusedObject> {
    frames.sort_by_key(|(arrival, frame)| (*arrival, frame.captured_at, frame.id));
    let mut engine = Engine::new(config().with_preset(preset(method).expect("a preset of the hub")));
    for name in AGENTS {
        engine.handle_description(agent(name), description(1e-5)).expect("a valid description");
    }
    let mut due = 0;
    for (received_ms, frame) in &frames {
        while due <= *received_ms {
            engine.fused(at(due));
            due += every_ms;
        }
        assert!(is_accepted(&engine.handle_frame(frame, at(*received_ms))));
    }
    // After the last arrival: hub time never goes back.
    let mut objects = engine.fused(at(END_MS)).objects.clone();
    objects.sort_by(|a, b| a.bev.y.total_cmp(&b.bev.y));
    objects.iter_mut().for_each(|object| object.track = Default::default());
    objects
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn delays_and_the_rate_of_publishing_change_no_result(
        reports in sparse(), every_ms in prop::sample::select(vec![2i64, 50, 190])
    ) {
        prop_assert_eq!(run(in_time(&reports), 100, "ours"), run(frames(&reports), every_ms, "ours"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    #[test]
    fn delays_and_the_rate_of_publishing_change_no_result_with_many_frames_at_one_time(
        reports in dense(),
        every_ms in prop::sample::select(vec![7i64, 50, 190, 3000]),
        method in prop::sample::select(vec!["ours", "unikf-paper"]),
    ) {
        prop_assert_eq!(run(in_time(&reports), 100, method), run(frames(&reports), every_ms, method));
    }
}

#[test]
fn late_data_keeps_a_track_as_data_in_time_does() {
    let run = |arrivals: [(&str, i64, i64); 3]| {
        let mut engine = engine();
        for (sequence, (name, captured_ms, now_ms)) in (0..).zip(arrivals) {
            let sent = frame(agent(name), sequence, captured_ms, vec![parked(0, (0.0, 0.0))]);
            assert!(is_accepted(&engine.handle_frame(&sent, at(now_ms))));
            engine.fused(at(now_ms));
        }
        engine.fused(at(1750)).objects.iter().map(|object| (object.track, object.age)).collect::<Vec<_>>()
    };
    let in_time = run([("a", 0, 0), ("b", 1300, 1300), ("a", 1700, 1700)]);
    assert_eq!(run([("a", 0, 0), ("a", 1700, 1700), ("b", 1300, 1700)]), in_time);
}

#[test]
fn a_missed_detection_outside_the_final_coverage_has_no_effect() {
    for step in 0..200 {
        let x = 219.0 + 0.01 * f64::from(step);
        let far = |x| vec![parked(1, (x, 0.0))];
        let frames = [
            frame(agent("ego"), 0, 0, far(x)),
            frame(agent("ego"), 1, 100, far(x + 0.4)),
            frame(agent("rsu"), 0, 150, vec![]),
        ];
        let run = |order: [usize; 3]| {
            let mut engine = engine();
            engine.handle_description(agent("rsu"), description(1e-5)).expect("a valid description");
            for place in order {
                engine.handle_frame(&frames[place], at(200));
            }
            engine.fused(at(333)).objects.clone()
        };
        assert_eq!(run([0, 1, 2]), run([0, 2, 1]), "at {x} m");
    }
}

#[test]
fn two_objects_that_are_always_reported_together_stay_two_for_any_stated_accuracy() {
    // Their bodies overlap: without the exclusion of bodies it is the evidence of the frames alone that decides.
    let mut engine = Engine::new(config().with_tracking(|tracking| tracking.tracker.exclusion = false));
    let mut modest = description(1e-6);
    modest.detection_probability = 0.01;
    engine.handle_description(agent("cam"), modest).expect("a valid description");
    for (sequence, ms) in (0..).zip((0..5000).step_by(100)) {
        let two = vec![parked(0, (0.0, 0.0)), parked(0, (0.0, 1.2))];
        engine.handle_frame(&frame(agent("cam"), sequence, ms, two), at(ms));
        engine.fused(at(ms));
    }
    assert_eq!(engine.counts().merges, 0);
}

#[test]
fn the_literal_method_lists_only_measurements_that_it_still_holds() {
    let mut engine = Engine::new(config().with_preset(preset("unikf-literal").unwrap()));
    for (sequence, ms) in (0..).zip((0..=400).step_by(100)) {
        let detected = vec![detection(0, at(ms), (0.0, 0.0))];
        engine.handle_frame(&frame(agent("ego"), sequence, ms, detected), at(490));
    }
    let late = frame(agent("rsu"), 0, 150, vec![detection(0, at(150), (0.0, 0.0))]);
    engine.handle_frame(&late, at(490));
    let object = engine.fused(at(490)).objects[0].clone();
    assert_eq!(object.last_measured_at, at(150));
    assert!(object.contributors.iter().all(|measurement| measurement.frame.sequence <= 1), "{object:?}");
}

#[test]
fn foreign_tracks_without_velocity_are_published_with_a_consistent_velocity_covariance() {
    for method in ["ours", "unikf-paper"] {
        for n_agents in [1u32, 3, 10] {
            let config = config().with_preset(preset(method).expect("a preset of the hub"));
            let mut engine = Engine::new(config.with_tracking(|tracking| tracking.births = Births::AtOnce));
            for k in 0..20 * n_agents {
                let ms = i64::from(100 * k / n_agents);
                let foreign = Detection { source_track: Some(7), ..detection(0, at(ms), (0.0, 0.0)) };
                let name = format!("a{}", k % n_agents);
                engine.handle_frame(&frame(agent(&name), u64::from(k), ms, vec![foreign]), at(ms));
                assert_eq!(
                    engine.fused(at(ms + 5)).objects.len(),
                    1,
                    "{method:?}, {n_agents} agents, {ms} ms"
                );
            }
            let object = engine.fused(at(2000)).objects[0].clone();
            // The car drives at 10 m/s: the published velocity covariance must include that.
            let sigmas = (object.velocity.0 - 10.0) / libm::sqrt(object.kinematic_covariance[7]);
            assert!(sigmas.abs() < 3.0, "{method:?}, {n_agents} agents: {object:?}");
        }
    }
}

#[test]
fn sizes_are_learnt_from_objects_and_not_from_clutter() {
    let size_of_a_car = |after_clutter: bool| {
        let mut engine = engine();
        engine.handle_description(agent("bad"), description(1.0)).expect("a valid description");
        let lorry = |x, y| {
            let mut lorry = parked(0, (x, y));
            (lorry.bev.w, lorry.bev.d) = (4.0, 12.0);
            (lorry.covariance.ww, lorry.covariance.dd) = (1e-4, 1e-4);
            lorry
        };
        for k in 0..if after_clutter { 30_u32 } else { 0 } {
            let clutter = (0..50)
                .map(|i| lorry(20.0 * f64::from(i) + 7.0 * f64::from(k), 1000.0 + 31.0 * f64::from(k)));
            let ms = 100 * i64::from(k);
            engine.handle_frame(&frame(agent("bad"), u64::from(k), ms, clutter.collect()), at(ms));
            assert!(engine.fused(at(ms)).objects.is_empty(), "clutter is not published");
        }
        engine.fused(at(20_000));
        let mut car = parked(0, (0.0, 0.0));
        (car.covariance.ww, car.covariance.dd) = (0.29, 1.8);
        engine.handle_frame(&frame(agent("good"), 0, 20_000, vec![car]), at(20_000));
        engine.fused(at(20_000)).objects[0].bev
    };
    assert_eq!(size_of_a_car(true), size_of_a_car(false));
}

#[test]
fn a_fault_of_an_agents_clock_and_a_flood_of_huge_frames_do_not_silence_others() {
    let mut engine = engine();
    let place = |i: u32| (10.0 * f64::from(i % 64), 10.0 * f64::from(i / 64));
    let huge: Vec<_> = (0..4096).map(|i| parked(0, place(i))).collect();
    let correct = |ms: i64| frame(agent("correct"), ms.unsigned_abs(), ms, vec![parked(0, (0.0, 0.0))]);
    for ms in 0..100_i64 {
        engine.handle_frame(&frame(agent("bad"), ms.unsigned_abs(), 499 + ms / 10, huge.clone()), at(ms));
        if ms % 10 == 0 {
            assert!(is_accepted(&engine.handle_frame(&correct(ms), at(ms))), "{ms} ms");
        }
    }
    let refused = &engine.agents().record(&agent("bad")).expect("known").statistics.refused;
    assert!(refused["too_many_detections"] > 0, "{refused:?}");
}

#[test]
fn thousands_of_reports_in_one_place_are_accepted() {
    let mut engine = engine();
    engine.handle_description(agent("bad"), description(1e-5)).expect("a valid description");
    let mut vague = parked(0, (0.0, 0.0));
    vague.covariance.position = Covariance2::isotropic(60.0 * SIGMA_M);
    let pile: Vec<_> = (0..600)
        .map(|i| {
            let mut report = vague;
            report.bev.x = 0.01 * f64::from(i);
            report
        })
        .collect();
    for k in 0..3 {
        let sent = frame(agent("bad"), k, 100 * i64::try_from(k).expect("test input"), pile.clone());
        assert!(is_accepted(&engine.handle_frame(&sent, sent.captured_at)));
    }
    assert!(engine.counts().tracks >= 600);
}

#[test]
fn a_less_accurate_frame_does_not_merge_objects_that_a_more_accurate_one_separates() {
    let row = |ys: &[f64], sigma_m| -> Vec<Detection> {
        let detected = ys.iter().map(|y| parked(0, (0.0, *y)));
        let mut detected: Vec<_> = detected.collect();
        detected.iter_mut().for_each(|one| one.covariance.position = Covariance2::isotropic(sigma_m));
        detected
    };
    // Two cars are known when a third one comes to the end of the row. The less accurate sensor reports all three 2 m
    // off, where their neighbours are, or nearly.
    let accurate = frame(agent("precise"), 5, 500, row(&[0.0, 2.5, 6.5], 0.1));
    let inaccurate = frame(agent("coarse"), 0, 500, row(&[-2.0, 0.5, 4.5], 1.5));
    for order in [[&accurate, &inaccurate], [&inaccurate, &accurate]] {
        let mut engine = engine();
        engine.handle_description(agent("precise"), description(0.0)).expect("a valid description");
        engine.handle_description(agent("coarse"), description(0.0)).expect("a valid description");
        for (sequence, ms) in (0..).zip((0..500).step_by(100)) {
            engine.handle_frame(&frame(agent("precise"), sequence, ms, row(&[0.0, 2.5], 0.1)), at(ms));
        }
        order.iter().for_each(|frame| assert!(is_accepted(&engine.handle_frame(frame, at(500)))));
        let objects = &engine.fused(at(500)).objects;
        assert_eq!(objects.len(), 3, "{objects:?}");
        assert!(objects.iter().all(|object| object.contributors.len() == 2), "{objects:?}");
    }
}
