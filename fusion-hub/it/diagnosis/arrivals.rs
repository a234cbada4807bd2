//! Two processes of one name, missing and rare frames, idle agents, overload, and refused descriptions.

use super::crossing::{
    DURATION_MS, Frame, assert_only, each, findings_of, findings_with, found, noise, run, world,
};
use serde_json::json;
use v2x_common::id::AgentId;
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::{Core, HubSettings};

#[test]
fn two_processes_with_one_name_are_noticed_with_epochs_and_without() {
    let second = |k: i64, epoch: u64| {
        let mut frame = world(k, "south");
        frame.agent = "north";
        frame.captured_ms += 40;
        frame.epoch = epoch;
        Some(frame)
    };
    assert_only(&findings_of("", |_| {}, |k| second(k, 2)), Code::TwoProcesses, "two starts of this agent");
    let same = findings_of("", |frame| frame.sequence += 1_000_000, |k| second(k, 1));
    assert!(same.iter().any(|one| one.code == Code::TwoProcesses && one.says.contains("jumps")), "{same:#?}");
    // Started again once is no second process.
    let restarted = found(|frame| frame.epoch = if frame.captured_ms > 15_000 { 2 } else { 1 });
    assert_eq!(restarted, []);
}

/// Makes frames wrong.
type Edit = fn(&mut Frame);

/// Minimal JSON: neither an epoch nor a sequence number.
fn minimal(frame: &mut Frame) {
    frame.more = json!({ "epoch": null, "sequence": null, "sensor_pose": null });
}

#[test]
fn two_processes_with_one_name_are_noticed_in_minimal_json_by_what_their_frames_show() {
    // The second one sees other objects, or none, or the same ones elsewhere, at the same rate or half of it.
    let elsewhere = |frame: &mut Frame| each(frame, |one| one.x += 6.0);
    let others = |frame: &mut Frame| {
        frame.detections.iter_mut().for_each(|one| (one.x, one.y) = (one.y + 60.0, one.x));
    };
    let none = |frame: &mut Frame| frame.detections.clear();
    let seconds: [(&str, Edit, i64); 4] =
        [("elsewhere", elsewhere, 1), ("others", others, 1), ("none", none, 1), ("half", others, 2)];
    for (name, write, each_k) in seconds {
        for phase_ms in [0, 13, 50, 90] {
            let second = |k: i64| {
                let mut frame = world(k, "north");
                frame.captured_ms += phase_ms;
                write(&mut frame);
                minimal(&mut frame);
                (k % each_k == 0).then_some(frame)
            };
            let findings = findings_of("", minimal, second);
            let is_it = |one: &Finding| one.code == Code::TwoProcesses && one.is_fault();
            assert!(findings.iter().any(is_it), "{name} at {phase_ms} ms: {findings:#?}");
        }
    }
}

#[test]
fn one_process_of_minimal_json_is_not_taken_for_two_whatever_its_link_and_its_detector_do() {
    let cases: [(&str, Edit); 6] = [
        ("sound", |_| {}),
        ("jitter that changes the order", |frame| frame.delay_ms += frame.captured_ms * 37 % 311),
        ("one object that flickers", |frame| {
            let is_seen = noise(frame.captured_ms.unsigned_abs(), 0, 3) > 0.0;
            frame.detections.truncate(usize::from(is_seen));
        }),
        ("objects that flicker", |frame| {
            let at = frame.captured_ms.unsigned_abs();
            frame.detections.retain(|one| noise(at, one.x.to_bits(), 4) > 0.0);
        }),
        ("large errors", |frame| {
            let at = frame.captured_ms.unsigned_abs();
            each(frame, |one| (one.x, one.y) = (one.x + 4.0 * noise(at, one.y.to_bits(), 5), one.y));
        }),
        ("half of the frames are lost", |frame| frame.is_lost = noise(frame.sequence, 1, 6) > 0.0),
    ];
    for (name, write) in cases {
        let findings = findings_of(
            "",
            |frame| {
                minimal(frame);
                write(frame);
            },
            |_| None,
        );
        assert!(findings.iter().all(|one| one.code != Code::TwoProcesses), "{name}: {findings:#?}");
    }
    // Started again, it goes on elsewhere.
    let restarted = found(|frame| {
        minimal(frame);
        if frame.captured_ms > 15_000 {
            each(frame, |one| one.x += 30.0);
        }
    });
    assert!(restarted.iter().all(|one| one.code != Code::TwoProcesses), "{restarted:#?}");
}

#[test]
fn capture_times_that_go_back_and_forth_and_a_rate_twice_the_declared_one_are_notes() {
    let second = |k: i64| {
        let mut frame = world(k, "north");
        (frame.captured_ms, frame.delay_ms) = (frame.captured_ms - 150, frame.delay_ms + 200);
        minimal(&mut frame);
        Some(frame)
    };
    let findings = findings_of("", minimal, second);
    let note = findings.iter().find(|one| one.code == Code::TwoProcesses);
    assert!(note.is_some_and(|one| one.says.contains("back and forth")), "{findings:#?}");
    let twice = |k: i64| {
        let mut frame = world(k, "north");
        frame.captured_ms += 50;
        each(&mut frame, |one| (one.x, one.y) = (one.x + 0.2, one.y));
        minimal(&mut frame);
        Some(frame)
    };
    let north = AgentId::new("north").unwrap();
    let description = r#"{"revision": 0, "kind": "roadside-unit", "accuracy": {"position_m": 0, "yaw_rad": 0, "clock_s": 0},
        "field_of_view": {"range_max_m": 80}, "detection_probability": 0.9, "clutter_per_m2": 0.0, "rate_hz": 10}"#;
    let describe =
        |core: &mut Core| drop(core.handle_description(north, &Body::Json(description.as_bytes())));
    let findings = findings_with("", describe, minimal, twice);
    assert!(
        findings.iter().any(|one| one.says.contains("declares 10.0 frames a second, and 20")),
        "{findings:#?}"
    );
    let findings = findings_with("", describe, minimal, |_| None);
    assert!(findings.iter().all(|one| one.code != Code::TwoProcesses), "{findings:#?}");
}

#[test]
fn gaps_jitter_and_silence_are_reported() {
    let lossy = found(|frame| frame.is_lost = frame.sequence % 5 < 2);
    assert_only(&lossy, Code::Gaps, "missing by their sequence numbers");
    let jittery = found(|frame| frame.delay_ms += if frame.sequence % 3 == 0 { 400 } else { 0 });
    assert!(jittery.iter().any(|one| one.code == Code::Jitter && !one.is_fault()), "{jittery:#?}");
    let silent = found(|frame| frame.is_lost = true);
    assert_only(&silent, Code::Silent, "v2x/NETWORK/agent/north/detections");
}

#[test]
fn an_agent_whose_vehicle_is_not_in_the_world_is_idle_and_not_silent() {
    let idle = |is_there: fn(i64) -> bool| {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let frames = (0..DURATION_MS / 100).flat_map(|k| [world(k, "south"), world(k, "north")]);
        let frames = frames.filter(|frame| frame.agent == "south" || is_there(frame.captured_ms));
        let mut frames: Vec<_> = frames.collect();
        frames.sort_by_key(|frame| frame.captured_ms + frame.delay_ms);
        let [north, south] = ["north", "south"].map(|name| AgentId::new(name).expect("a name"));
        let tokens = Tokens { alive: [north, south].into(), idle: [(north, "veh 7".to_owned())].into() };
        run(&mut core, frames, &tokens, |_| {})
    };
    for is_there in [(|_| false) as fn(i64) -> bool, |ms| !(4_000..9_000).contains(&(ms % 10_000))] {
        let findings = idle(is_there);
        let [one] = &findings[..] else { panic!("{findings:#?}") };
        assert_eq!((one.code, one.is_fault()), (Code::Idle, false));
        assert!(one.says.contains("it rides on veh 7, which is not in the world now"), "{one}");
    }
}

#[test]
fn an_agent_that_waits_for_nothing_is_not_idle() {
    for is_silent in [false, true] {
        let found = found(|frame| frame.is_lost = is_silent);
        assert!(found.iter().all(|one| one.code != Code::Idle), "{found:#?}");
    }
}

#[test]
fn a_full_queue_of_an_agent_is_overload_with_what_to_do() {
    let north = AgentId::new("north").unwrap();
    let overloaded = findings_with("", |core| core.note_queue_full(north, 20), |_| {}, |_| None);
    assert_only(&overloaded, Code::Overload, "lack of time");
    // Of many agents it is one finding.
    let all = ["north", "south", "east", "west"].map(|name| AgentId::new(name).unwrap());
    let of_all = |core: &mut Core| all.iter().for_each(|agent| core.note_queue_full(*agent, 20));
    let findings = findings_with("", of_all, |_| {}, |_| None);
    let [one] = &findings[..] else { panic!("{findings:#?}") };
    assert!(one.code == Code::Overload && one.says.contains("4 agents (east, north, south, west)"), "{one}");
    // What waits too long for that hub arrives too late.
    let late = |frame: &mut Frame| frame.delay_ms += if frame.sequence.is_multiple_of(2) { 3_000 } else { 0 };
    let findings = findings_with("", of_all, late, |_| None);
    assert!(findings.iter().all(|one| one.code != Code::FramesRefused), "{findings:#?}");
    let findings = findings_with("", |_| {}, late, |_| None);
    assert!(findings.iter().any(|one| one.code == Code::FramesRefused), "{findings:#?}");
}

#[test]
fn a_described_view_that_is_not_that_of_the_detections_is_named_with_the_field_to_correct() {
    let north = AgentId::new("north").unwrap();
    let seen_with = |view: &str| {
        let text = format!(
            r#"{{"revision": 0, "kind": "roadside-unit", "accuracy": {{"position_m": 0, "yaw_rad": 0, "clock_s": 0}}, "field_of_view": {view},
                "detection_probability": 0.9, "clutter_per_m2": 0.0, "rate_hz": 10}}"#
        );
        let describe = |core: &mut Core| drop(core.handle_description(north, &Body::Json(text.as_bytes())));
        let found = findings_with("", describe, |_| {}, |_| None);
        found.into_iter().filter(|one| one.code == Code::FieldOfView).collect::<Vec<_>>()
    };
    for (view, field) in [
        (r#"{"range_max_m": 7}"#, "`range_max_m`"),
        (r#"{"range_max_m": 80, "width_rad": 0.5}"#, "`width_rad`"),
        (r#"{"range_max_m": 80, "width_rad": 2.5, "azimuth_rad": 3.14}"#, "`azimuth_rad`"),
    ] {
        let found = seen_with(view);
        assert!(
            found.len() == 1 && found[0].is_fault() && found[0].change.contains(field),
            "{view}: {found:#?}"
        );
    }
    let far = seen_with(r#"{"range_max_m": 8000}"#);
    assert!(far.len() == 1 && !far[0].is_fault() && far[0].says.contains("19 of 20"), "{far:#?}");
    // All that it sees, and with a margin.
    for view in
        [r#"{"range_max_m": 80}"#, r#"{"range_max_m": 250}"#, r#"{"range_max_m": 80, "width_rad": 4.5}"#]
    {
        assert_eq!(seen_with(view), [], "{view}");
    }
}

#[test]
fn a_refused_description_and_a_rate_below_the_declared_one_are_reported() {
    let north = AgentId::new("north").unwrap();
    let described = |json: &str| {
        findings_with(
            "",
            |core| drop(core.handle_description(north, &Body::Json(json.as_bytes()))),
            |_| {},
            |_| None,
        )
    };
    let text = |probability: f64, rate_hz: f64| {
        format!(
            r#"{{"revision": 0, "kind": "roadside-unit", "accuracy": {{"position_m": 0, "yaw_rad": 0, "clock_s": 0}}, "field_of_view": {{"range_min_m": 0, "range_max_m": 80, "azimuth_rad": 0, "width_rad": 6.283}},
                "detection_probability": {probability}, "clutter_per_m2": 0.0, "rate_hz": {rate_hz}}}"#
        )
    };
    assert_only(&described(&text(7.0, 10.0)), Code::DescriptionRefused, "detection_probability");
    let slow = described(&text(0.9, 30.0));
    assert!(slow.iter().any(|one| one.code == Code::RateLow && !one.is_fault()), "{slow:#?}");
    let sound = described(&text(0.9, 10.0));
    assert!(sound.iter().all(|one| one.code != Code::RateLow && !one.is_fault()), "{sound:#?}");
}
