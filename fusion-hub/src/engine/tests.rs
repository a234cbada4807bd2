//! What the engine admits, refuses and counts.

use super::*;
use crate::fusion::{Births, LateFrames};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId, MapFrame};
use v2x_common::time::{Span, Timestamp};

fn frame(agent: &str, sequence: u64, captured_ms: i64) -> DetectionFrame {
    let id = FrameId { agent: AgentId::new(agent).unwrap(), epoch: 1, sequence };
    DetectionFrame::empty(id, at(captured_ms))
}

fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(1_000_000 + ms)
}

fn config() -> EngineConfig {
    EngineConfig::new(HubId::new("hub").unwrap(), 1)
}

/// Of sensors that report nothing false: the first detection counts.
fn engine() -> Engine {
    Engine::new(config().with_tracking(|tracking| tracking.births = Births::AtOnce))
}

/// Whether a frame is out of sequence, or why it is refused.
fn admit(engine: &mut Engine, frame: &DetectionFrame, now: Timestamp) -> Result<bool, Refusal> {
    match engine.handle_frame(frame, now) {
        Disposition::Accepted { out_of_sequence } => Ok(out_of_sequence),
        Disposition::Refused(refusal) => Err(refusal),
    }
}

#[test]
fn age_is_measured_against_the_hubs_clock_at_both_ends() {
    let mut engine = engine();
    assert_eq!(admit(&mut engine, &frame("a", 0, 0), at(500)), Ok(false));
    assert!(matches!(admit(&mut engine, &frame("a", 1, 0), at(501)), Err(Refusal::TooLate { .. })));
    assert_eq!(admit(&mut engine, &frame("a", 2, 1001), at(501)), Ok(false));
    assert!(matches!(admit(&mut engine, &frame("a", 3, 1002), at(501)), Err(Refusal::TooEarly { .. })));
    let statistics = &engine.agents().record(&AgentId::new("a").unwrap()).unwrap().statistics;
    let refused = (statistics.refused["too_late"], statistics.refused["too_early"]);
    assert_eq!((statistics.accepted, refused), (2, (1, 1)));
}

#[test]
fn a_frame_is_accepted_once_and_again_only_in_a_new_epoch() {
    let mut engine = engine();
    assert_eq!(admit(&mut engine, &frame("a", 7, 0), at(10)), Ok(false));
    assert!(matches!(admit(&mut engine, &frame("a", 7, 0), at(10)), Err(Refusal::Duplicate { .. })));
    let mut rebooted = frame("a", 7, 20);
    rebooted.id.epoch = 2;
    assert_eq!(admit(&mut engine, &rebooted, at(30)), Ok(false));
    assert_eq!(admit(&mut engine, &frame("b", 7, 0), at(30)), Ok(true));
}

#[test]
fn another_map_frame_is_a_fault_that_is_refused_by_name() {
    let map_frame = Some(MapFrame::new("EPSG:32632").unwrap());
    let mut engine = Engine::new(EngineConfig { map_frame, ..config() });
    let mut foreign = frame("a", 0, 0);
    foreign.map_frame = Some(MapFrame::new("EPSG:25833").unwrap());
    let message = admit(&mut engine, &foreign, at(0)).unwrap_err().to_string();
    assert!(message.contains("EPSG:25833") && message.contains("EPSG:32632"), "{message}");
    assert_eq!(admit(&mut engine, &frame("a", 1, 0), at(0)), Ok(false));
    let same = DetectionFrame { map_frame, ..frame("a", 2, 0) };
    assert_eq!(admit(&mut engine, &same, at(0)), Ok(false));
}

#[test]
fn the_first_named_map_frame_holds_where_the_hub_names_none() {
    let named = |name: &str, sequence| {
        let mut frame = frame("a", sequence, 0);
        frame.map_frame = Some(MapFrame::new(name).unwrap());
        frame
    };
    let mut engine = engine();
    assert_eq!(admit(&mut engine, &named("EPSG:32632", 0), at(0)), Ok(false));
    let refused = admit(&mut engine, &named("EPSG:25833", 1), at(0));
    assert!(matches!(refused, Err(Refusal::MapFrameMismatch { .. })));
    assert_eq!(engine.fused(at(0)).map_frame, Some(MapFrame::new("EPSG:32632").unwrap()));
}

#[test]
fn a_map_frame_that_somebody_spoofs_first_gives_way_to_one_on_which_more_agents_agree() {
    let named = |agent: &str, name: &str, sequence| {
        let mut frame = frame(agent, sequence, 0);
        frame.map_frame = Some(MapFrame::new(name).unwrap());
        frame
    };
    let mut engine = engine();
    assert_eq!(admit(&mut engine, &named("spoof", "nowhere", 0), at(0)), Ok(false));
    admit(&mut engine, &named("ego", "munich", 0), at(0)).unwrap_err();
    assert_eq!(admit(&mut engine, &named("rsu", "munich", 0), at(0)), Ok(false));
    assert_eq!(admit(&mut engine, &named("ego", "munich", 1), at(0)), Ok(false));
    let refused = admit(&mut engine, &named("spoof", "nowhere", 1), at(0));
    assert!(matches!(refused, Err(Refusal::MapFrameMismatch { .. })));
}

#[test]
fn a_fault_of_the_system_clock_stops_neither_agents_that_follow_it_nor_others() {
    for step_ms in [-3_600_000, -5_000, 5_000, 3_600_000] {
        let mut engine = engine();
        assert_eq!(admit(&mut engine, &frame("follows", 0, 0), at(10)), Ok(false));
        let stepped = |sequence, ms| frame("follows", sequence, ms + step_ms);
        // Until the step is known its stamps are impossible.
        admit(&mut engine, &stepped(1, 100), at(110)).unwrap_err();
        engine.note_clock_step(Span::from_millis(step_ms));
        assert_eq!(admit(&mut engine, &stepped(2, 200), at(210)), Ok(false), "{step_ms}");
        assert_eq!(admit(&mut engine, &frame("other", 0, 205), at(215)), Ok(false));
        let list = engine.fused(at(220));
        assert_eq!(list.fused_at, at(220), "the hub's timeline goes on");
        let stamps: Vec<_> = list.includes.iter().map(|one| one.captured_at).collect();
        assert_eq!(stamps, [at(0), at(200 + step_ms), at(205)], "as the agents wrote them");
    }
}

#[test]
fn after_a_flood_of_names_an_agent_that_is_silent_for_good_makes_room_for_a_new_one() {
    let mut engine = engine();
    for agent in 0..MAX_AGENTS {
        admit(&mut engine, &frame(&format!("a{agent}"), 0, 0), at(0)).unwrap();
    }
    let refused = admit(&mut engine, &frame("z", 0, 50_000), at(50_000));
    assert!(matches!(refused, Err(Refusal::TooManyAgents { .. })));
    assert_eq!(admit(&mut engine, &frame("z", 1, 61_000), at(61_000)), Ok(false));
    assert_eq!(engine.agents().iter().count(), MAX_AGENTS);
}

#[test]
fn memory_is_bounded_against_a_flood_of_agents_and_frames() {
    let mut engine = engine();
    for agent in 0..MAX_AGENTS {
        admit(&mut engine, &frame(&format!("a{agent}"), 0, 0), at(0)).unwrap();
    }
    assert!(matches!(admit(&mut engine, &frame("z", 0, 0), at(0)), Err(Refusal::TooManyAgents { .. })));
    assert!(matches!(admit(&mut engine, &frame("y", 0, 0), at(0)), Err(Refusal::TooManyAgents { .. })));
    assert_eq!(engine.agents().refused_beyond_limit(), 2);
    for sequence in 1..MAX_FRAMES_WITHIN_DELTA_MAX as u64 {
        admit(&mut engine, &frame("a0", sequence, 0), at(0)).unwrap();
    }
    let one_more = frame("a0", 1 << 40, 0);
    assert!(matches!(admit(&mut engine, &one_more, at(0)), Err(Refusal::TooManyFrames { .. })));
    let later = frame("a0", 1 << 41, 600);
    assert_eq!(admit(&mut engine, &later, at(600)), Ok(false), "room again once Δmax has passed");
}

#[test]
fn spoofed_sequence_numbers_silence_an_agent_no_longer_than_delta_max() {
    let mut engine = engine();
    admit(&mut engine, &frame("ego", 0, 0), at(0)).unwrap();
    for forged in 1..=1000 {
        admit(&mut engine, &frame("ego", forged, 0), at(10)).unwrap();
    }
    let mut refused = 0;
    for sequence in 1..=100_u64 {
        let ms = i64::try_from(sequence).unwrap() * 100;
        refused += u64::from(admit(&mut engine, &frame("ego", sequence, ms), at(ms + 5)).is_err());
    }
    assert!(refused <= 5, "{refused} of 100 frames are taken for duplicates");
    let again = admit(&mut engine, &frame("ego", 100, 10_000), at(10_006));
    assert!(matches!(again, Err(Refusal::Duplicate { .. })), "{again:?}");
}

#[test]
fn a_flood_of_names_of_which_no_frame_is_ever_accepted_locks_nobody_out() {
    let mut engine = engine();
    admit(&mut engine, &frame("ego", 0, 0), at(0)).unwrap();
    let flood = |engine: &mut Engine, round: usize| {
        for name in 0..MAX_AGENTS + 100 {
            let name = AgentId::new(&format!("x{round}-{name}")).unwrap();
            engine.note_refusal(name, Refusal::NotListenedTo);
        }
    };
    flood(&mut engine, 0);
    assert_eq!(admit(&mut engine, &frame("late", 0, 10), at(10)), Ok(false));
    flood(&mut engine, 1);
    assert_eq!(admit(&mut engine, &frame("ego", 1, 20), at(20)), Ok(false));
    assert_eq!(admit(&mut engine, &frame("late", 1, 20), at(20)), Ok(false));
    let agents = engine.agents();
    assert_eq!(agents.iter().count(), MAX_AGENTS);
    let accepted = |name: &str| agents.record(&AgentId::new(name).unwrap()).unwrap().statistics.accepted;
    assert_eq!((accepted("ego"), accepted("late")), (2, 2));
}

#[test]
fn published_times_never_go_back_after_any_fault() {
    let mut engine = engine();
    assert_eq!(engine.fused(at(100)).fused_at, at(100));
    assert_eq!(engine.fused(at(50)).fused_at, at(100));
}

#[test]
fn an_agent_whose_clock_is_ahead_does_not_make_others_late() {
    let mut engine = Engine::new(EngineConfig { late_frames: LateFrames::Drop, ..config() });
    assert_eq!(admit(&mut engine, &frame("ahead", 0, 300), at(0)), Ok(false));
    assert_eq!(admit(&mut engine, &frame("honest", 0, -20), at(30)), Ok(false));
    assert!(matches!(
        admit(&mut engine, &frame("honest", 1, -60), at(30)),
        Err(Refusal::OutOfSequence { .. })
    ));
}

#[test]
fn frames_ahead_of_the_hubs_clock_are_counted_and_refusals_say_how_far_ahead() {
    let mut engine = engine();
    for (sequence, captured_ms) in [(0, -20), (1, 0), (2, 5), (3, 300)] {
        assert_eq!(admit(&mut engine, &frame("a", sequence, captured_ms), at(0)), Ok(false));
    }
    let refused = admit(&mut engine, &frame("a", 4, 700), at(0));
    assert_eq!(refused, Err(Refusal::TooEarly { ahead: Span::from_millis(700) }));
    let statistics = &engine.agents().record(&AgentId::new("a").unwrap()).unwrap().statistics;
    assert_eq!(statistics.ahead_of_time, 2);
}

#[test]
fn where_late_data_is_dropped_a_frame_may_be_older_than_the_newest_by_the_synchronous_span() {
    let mut engine = Engine::new(EngineConfig { late_frames: LateFrames::Drop, ..config() });
    assert_eq!(admit(&mut engine, &frame("a", 0, 0), at(0)), Ok(false));
    assert_eq!(admit(&mut engine, &frame("b", 0, -10), at(0)), Ok(false));
    let refused = admit(&mut engine, &frame("b", 1, -11), at(0));
    assert_eq!(refused, Err(Refusal::OutOfSequence { behind: Span::from_millis(11) }));
}

fn car(x: f64) -> Detection {
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox { x, y: 0.0, w: 1.8, d: 4.5, yaw: 0.0 },
        covariance: BoxCovariance { position: Covariance2::isotropic(0.09), ww: 0.04, dd: 0.04, yaw: 0.01 },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

#[test]
fn an_impossible_detection_is_dropped_and_counted_and_its_frame_is_used() {
    let mut engine = engine();
    let with = |sequence, detections| DetectionFrame { detections, ..frame("a", sequence, 0) };
    let before = with(0, (0..2).map(|k| car(30.0 * f64::from(k))).collect());
    assert_eq!(admit(&mut engine, &before, at(0)), Ok(false));
    let mut flat = car(9.0);
    flat.bev.w = 0.0;
    let mut indefinite = car(0.0);
    indefinite.covariance.position.xy = 1.0;
    let bad = [car(f64::NAN), car(f64::INFINITY), flat, indefinite];
    for (sequence, bad) in (1..).zip(bad) {
        assert_eq!(admit(&mut engine, &with(sequence, vec![bad, car(30.0)]), at(0)), Ok(false));
    }
    let objects = engine.fused(at(10)).objects.clone();
    assert_eq!(objects.iter().filter(|object| object.bev.x.is_finite()).count(), 2, "{objects:?}");
    let named = objects.iter().find(|object| object.bev.x > 20.0).unwrap().contributors[0];
    assert_eq!((named.frame.sequence, named.index), (4, 1), "the place in the frame as it was sent");
    let dropped = &engine.agents().record(&AgentId::new("a").unwrap()).unwrap().statistics.dropped;
    let expected = [
        (("covariance of x and y", "out of range"), 1),
        (("w", "out of range"), 1),
        (("x", "not finite"), 2),
    ];
    let expected = expected.map(|((field, cause), count)| ((field.into(), cause.into()), count));
    assert_eq!((dropped.by_cause.clone(), dropped.total()), (expected.into(), 4));
    let last = dropped.last.as_ref().unwrap().to_string();
    assert!(last.starts_with("covariance of x and y of detection 0 is 1"), "{last}");
}

#[test]
fn a_frame_is_refused_where_it_is_impossible_itself() {
    let mut engine = engine();
    let pose = v2x_common::geometry::Pose { x: f64::NAN, y: 0.0, yaw: 0.0 };
    let refused = admit(&mut engine, &DetectionFrame { sensor_pose: Some(pose), ..frame("a", 0, 0) }, at(0));
    let refused = refused.unwrap_err();
    assert_eq!(refused.reason(), "absurd_value");
    assert!(refused.to_string().contains("sensor_pose.x"), "{refused}");
}
