//! Frames that say again what was said before, and those of the hub itself.

use super::crossing::{
    Detection, Frame, START_MS, assert_only, each, findings_of, findings_where, found, noise, run, world,
};
use serde_json::json;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::{Core, HubSettings};

#[test]
fn a_result_that_is_sent_several_times_under_new_stamps_is_told() {
    for times in [2, 3, 5] {
        let findings = found(|frame| {
            let k = frame.sequence.cast_signed() - 1;
            frame.detections = world(k - k % times, "north").detections;
        });
        assert_only(&findings, Code::Repetition, "each result comes several times");
    }
}

#[test]
fn a_detector_that_hangs_is_a_note() {
    let findings = found(|frame| frame.detections = world(0, "north").detections);
    let one = findings.iter().find(|one| one.code == Code::Repetition);
    let one = one.unwrap_or_else(|| panic!("{findings:#?}"));
    assert!(!one.is_fault() && one.says.contains("its detector may hang"), "{one}");
    assert!(findings.iter().all(|one| one.code != Code::SigmaTooLarge), "{findings:#?}");
}

#[test]
fn exact_reports_of_what_stands_and_of_something_that_passes_at_times_are_no_fault() {
    let exact = |frame: &mut Frame| {
        let k = frame.sequence.cast_signed() - 1;
        let car = |x: f64, y: f64| Detection {
            class: "car",
            x,
            y,
            w: 1.8,
            d: 4.5,
            yaw: 0.0,
            sigma_m: Some(0.01),
            velocity: None,
        };
        frame.detections = (0..6).map(|n| car(8.0 * f64::from(n) - 20.0, 9.0)).collect();
        // Two seconds of every eight.
        if k % 80 < 20 {
            frame.detections.push(car((k % 80) as f64 - 10.0, -2.0));
        }
    };
    let findings = findings_where("", |_| {}, exact, |_| {}, |_| None);
    assert!(findings.iter().all(|one| one.code != Code::Repetition || !one.is_fault()), "{findings:#?}");
}

#[test]
fn one_message_for_each_object_of_a_time_is_told_as_such() {
    // All but the first object of north's frames come in messages of their own.
    let mut core = Core::new(HubSettings::default(), Engine::new);
    let mut frames = Vec::new();
    for k in 0..240 {
        frames.push(world(k, "south"));
        let whole = world(k, "north");
        for (n, one) in whole.detections.iter().enumerate() {
            let delay_ms = whole.delay_ms + i64::try_from(n).unwrap() / 4;
            frames.push(Frame { detections: vec![one.clone()], delay_ms, ..whole.clone() });
        }
    }
    frames.sort_by_key(|frame| frame.captured_ms + frame.delay_ms);
    let alive = ["north", "south"].map(|name| AgentId::new(name).unwrap()).into();
    let findings = run(&mut core, frames, &Tokens { alive, ..Tokens::default() }, |_| {});
    assert_only(&findings, Code::PartialFrames, "a part of what was seen at one time");
}

#[test]
fn one_message_for_each_object_is_told_also_where_each_has_a_number_of_its_own() {
    let findings = |n_parts: usize| {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let (mut frames, mut sequence) = (Vec::new(), 0);
        for k in 0..240 {
            frames.push(world(k, "south"));
            let whole = world(k, "north");
            let per_part = whole.detections.len().div_ceil(n_parts).max(1);
            for (n, some) in whole.detections.chunks(per_part).enumerate() {
                sequence += 1;
                let delay_ms = whole.delay_ms + i64::try_from(n).unwrap() / 4;
                frames.push(Frame { detections: some.to_vec(), delay_ms, sequence, ..whole.clone() });
            }
        }
        frames.sort_by_key(|frame| frame.captured_ms + frame.delay_ms);
        let alive = ["north", "south"].map(|name| AgentId::new(name).unwrap()).into();
        run(&mut core, frames, &Tokens { alive, ..Tokens::default() }, |_| {})
    };
    for n_parts in [2, 12] {
        assert_only(&findings(n_parts), Code::PartialFrames, "is taken for all of it");
    }
    assert_eq!(findings(1), []);
}

/// The detections of a frame with numbers of tracks.
fn with_tracks(frame: &mut Frame, track: impl Fn(usize, &Detection) -> u64) {
    let detections = frame.detections.iter().enumerate().map(|(n, one)| {
        json!({
            "class": one.class, "x": one.x, "y": one.y, "w": one.w, "d": one.d, "yaw": one.yaw,
            "sigma": { "x": 0.3, "y": 0.3, "yaw": 0.05 }, "source_track": track(n, one),
        })
    });
    frame.more = json!({ "detections": detections.collect::<Vec<_>>() });
}

#[test]
fn places_in_a_list_as_numbers_of_tracks_are_told_and_tracks_that_stay_with_objects_are_not() {
    let is_told =
        |found: &[Finding]| found.iter().any(|one| one.code == Code::SourceTracks && one.is_fault());
    let by_place = found(|frame| with_tracks(frame, |n, _| n as u64));
    assert!(is_told(&by_place), "{by_place:#?}");
    // Each lane has three cars, which are where they began and as far as they have driven.
    let by_car = found(|frame| {
        let t = 1e-3 * frame.captured_ms as f64;
        with_tracks(frame, |_, one| {
            let (sin, cos) = libm::sincos(one.yaw);
            let (lane, speed) = match (cos.abs() > 0.7, cos > 0.0, sin > 0.0) {
                (true, true, _) => (0, 9.0),
                (true, false, _) => (1, 8.0),
                (false, _, true) => (2, 10.0),
                (false, _, false) => (3, 7.0),
            };
            let begun_m = one.x * cos + one.y * sin + 39.0 - speed * t;
            10 * lane + libm::round(begun_m / 26.0).rem_euclid(3.0) as u64
        });
    });
    assert!(!is_told(&by_car), "{by_car:#?}");
}

#[test]
fn a_number_that_does_not_count_is_told_as_such() {
    let findings = found(|frame| frame.sequence = 0);
    assert_only(&findings, Code::PartialFrames, "`sequence` does not count");
}

/// The findings where a third agent sends the list of every tenth of a second, edited.
fn with_an_echo(edit: impl Fn(&mut Detection)) -> Vec<Finding> {
    let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(START_MS + ms);
    let agent = |name: &str| AgentId::new(name).expect("a name");
    let mut core = Core::new(HubSettings::default(), Engine::new);
    let tokens = Tokens { alive: ["north", "south"].map(agent).into(), ..Tokens::default() };
    for k in 0..240 {
        for name in ["south", "north"] {
            let frame = world(k, name);
            let arrival = at(frame.captured_ms + frame.delay_ms);
            core.handle_frame(agent(name), arrival, &Body::Json(&frame.json()));
        }
        let ms = 100 * k + 60;
        let objects = core.fused(at(ms)).objects.clone();
        let detections = objects.iter().map(|object| Detection {
            class: "car",
            x: object.bev.x,
            y: object.bev.y,
            w: object.bev.w,
            d: object.bev.d,
            yaw: object.bev.yaw,
            sigma_m: Some(0.3),
            velocity: None,
        });
        let mut echo =
            Frame { agent: "north", captured_ms: ms, detections: detections.collect(), ..world(k, "north") };
        each(&mut echo, &edit);
        if !echo.detections.is_empty() {
            core.handle_frame(agent("echo"), at(ms + 15), &Body::Json(&echo.json()));
        }
        if k % 10 == 9 {
            core.diagnose(&tokens, at(ms + 20));
        }
    }
    core.findings().to_vec()
}

#[test]
fn an_agent_that_publishes_the_hubs_own_objects_is_told_and_nobody_else_is_blamed() {
    let findings = with_an_echo(|_| {});
    let faults: Vec<_> = findings.iter().filter(|one| one.is_fault()).collect();
    let [one] = faults[..] else { panic!("{findings:#?}") };
    assert!(one.code == Code::Feedback && one.agent == Some(AgentId::new("echo").unwrap()), "{one}");
    // What is measured anew differs from any list.
    let measured = with_an_echo(|one| (one.x, one.y) = (one.x + 0.01, one.y - 0.01));
    assert!(measured.iter().all(|one| one.code != Code::Feedback), "{measured:#?}");
}

/// What `south` sees, published by `north` as well.
fn of_south(frame: &mut Frame) {
    let k = frame.captured_ms / 100;
    let south = world(k, "south");
    (frame.pose, frame.detections, frame.captured_ms) = (south.pose, south.detections, south.captured_ms);
    frame.delay_ms = south.delay_ms + 30;
}

#[test]
fn an_agent_that_publishes_what_another_one_does_is_named_whatever_its_stamp_and_pose() {
    assert_only(&found(of_south), Code::Copy, "what south has published");
    let own_pose = found(|frame| {
        let pose = frame.pose;
        of_south(frame);
        frame.pose = pose;
        frame.detections.reverse();
    });
    assert_only(&own_pose, Code::Copy, "leave it out");
    let rounded = found(|frame| {
        of_south(frame);
        each(frame, |one| [one.x, one.y] = [one.x, one.y].map(|at| (1e3 * at).round() / 1e3));
    });
    assert_only(&rounded, Code::Copy, "to the millimetre");
}

#[test]
fn two_agents_whose_reports_have_no_errors_are_no_copies() {
    let exact = |frame: &mut Frame| {
        let t = 1e-3 * frame.captured_ms as f64;
        let mut cars = Vec::new();
        for n in 0..3 {
            let along = |speed: f64| (26.0 * f64::from(n) + speed * t).rem_euclid(78.0) - 39.0;
            cars.push((along(9.0), -2.0, 0.0));
            cars.push((2.0, along(10.0), std::f64::consts::FRAC_PI_2));
        }
        let template = frame.detections[0].clone();
        let exact = cars.into_iter().map(|(x, y, yaw)| {
            let mut car = template.clone();
            (car.x, car.y, car.yaw, car.w, car.d) = (x, y, yaw, 1.8, 4.5);
            car
        });
        frame.detections = exact.collect();
    };
    // At the same ticks, with errors stated or not.
    for sigma_m in [Some(0.3), Some(0.005), None] {
        let found = findings_where(
            "",
            |_| {},
            |frame| {
                frame.captured_ms -= frame.captured_ms % 100;
                exact(frame);
                each(frame, |one| one.sigma_m = sigma_m);
            },
            |_| {},
            |_| None,
        );
        assert!(found.iter().all(|one| one.code != Code::Copy), "{sigma_m:?}: {found:#?}");
    }
}

/// Each car leaves the view at its lane's end: `lost` says what becomes of it, after so many seconds.
fn with_lost(lost: impl Fn(f64) -> bool) -> Vec<Finding> {
    let memory = std::cell::RefCell::new(Vec::<(i64, Detection)>::new());
    found(|frame| {
        let mut memory = memory.borrow_mut();
        // One car in two seconds is lost where it is.
        if frame.sequence % 20 == 10 {
            memory.push((frame.captured_ms, frame.detections[frame.sequence as usize / 20 % 8].clone()));
        }
        let kept = memory.iter().filter(|(at, _)| lost(1e-3 * (frame.captured_ms - at) as f64));
        let kept: Vec<_> = kept.map(|(_, one)| one.clone()).collect();
        if frame.sequence % 20 != 10 {
            frame.detections.extend(kept);
        }
    })
}

#[test]
fn a_list_of_tracks_that_never_forgets_is_told_as_such_and_a_tracker_that_keeps_what_is_missed_is_not() {
    let is_told =
        |found: &[Finding]| found.iter().any(|one| one.code == Code::StaleObjects && one.is_fault());
    let for_ever = with_lost(|_| true);
    assert!(is_told(&for_ever), "{for_ever:#?}");
    assert!(for_ever.iter().all(|one| one.code != Code::SigmaTooSmall), "no advice on sigma: {for_ever:#?}");
    for kept_s in [0.0, 1.0] {
        let found = with_lost(|passed_s| passed_s <= kept_s);
        assert!(!is_told(&found), "{kept_s} s: {found:#?}");
    }
}

/// Each car is lost after some seconds; what the tracker says of it then, after so many seconds at its velocity.
fn with_predicted(lost: impl Fn(f64) -> bool) -> Vec<Finding> {
    let memory = std::cell::RefCell::new(Vec::<(i64, Detection)>::new());
    found(|frame| {
        let mut memory = memory.borrow_mut();
        let now = frame.captured_ms;
        for k in 0..18 {
            // It is seen for a second and a half beside everything else, and then only predicted.
            let (begins, passed) = (1_000 * (k + 1), (now - 1_000 * (k + 1)) as f64 * 1e-3);
            let scatter = |which: u64| 0.2 * noise(frame.sequence, 40 + k.unsigned_abs(), which);
            let seen = [100.0 + 9.0 * passed, 30.0 + 8.0 * k as f64];
            let mut one = frame.detections[0].clone();
            if (0.0..1.5).contains(&passed) {
                (one.x, one.y, one.yaw) = (seen[0] + scatter(0), seen[1] + scatter(1), 0.0);
                memory.retain(|(of, _)| *of != begins);
                memory.push((begins, one.clone()));
                frame.detections.push(one);
            } else if let Some((_, last)) =
                memory.iter().find(|(of, _)| *of == begins).filter(|_| lost(passed - 1.4))
            {
                (one.x, one.y, one.yaw) = (last.x + 9.3 * (passed - 1.4), last.y + 0.2 * (passed - 1.4), 0.0);
                frame.detections.push(one);
            }
        }
    })
}

#[test]
fn lost_objects_that_drive_on_for_ever_are_told_and_predictions_of_a_second_and_exact_ones_are_not() {
    let is_told = |found: &[Finding]| {
        found.iter().any(|one| one.code == Code::StaleObjects && one.says.contains("exactly straight"))
    };
    let for_ever = with_predicted(|_| true);
    assert!(is_told(&for_ever), "{for_ever:#?}");
    let missed = with_predicted(|passed_s| passed_s < 1.2);
    assert!(!is_told(&missed), "{missed:#?}");
    let exact = |frame: &mut Frame| {
        let t = 1e-3 * frame.captured_ms as f64;
        for (n, one) in frame.detections.iter_mut().enumerate() {
            let row = n as f64;
            (one.x, one.y, one.yaw) = ((6.0 + row) * (t - 12.0), 4.0 * row, 0.0);
        }
    };
    let exact = findings_where("", |_| {}, exact, |_| {}, |_| None);
    assert!(!is_told(&exact), "{exact:#?}");
}

#[test]
fn a_frame_that_is_sent_again_under_another_number_is_told_and_objects_of_one_time_are_not() {
    let is_told = |found: &[Finding]| {
        found.iter().any(|one| one.code == Code::Repetition && one.says.contains("under another number"))
    };
    let twice = |number: u64| {
        let again = move |k: i64| {
            let mut frame = world(k, "north");
            frame.sequence = number * frame.sequence + number - 1;
            frame.delay_ms += 3;
            (number > 1).then_some(frame)
        };
        findings_of("", move |frame| frame.sequence *= number, again)
    };
    let found = twice(2);
    assert!(is_told(&found), "{found:#?}");
    let found = twice(1);
    assert!(!is_told(&found), "{found:#?}");
}

#[test]
fn exact_reports_of_what_brakes_and_then_stands_are_nothing_that_was_lost() {
    let braking = |frame: &mut Frame| {
        let t = 1e-3 * frame.captured_ms as f64;
        for (n, one) in frame.detections.iter_mut().enumerate() {
            let (speed, brakes, row) = (12.0, 4.0, n as f64);
            // Each brakes a second after the one before.
            let since = (t - 4.0 - row).clamp(0.0, speed / brakes);
            let at = speed * t.min(4.0 + row) + speed * since - 0.5 * brakes * since * since;
            (one.x, one.y, one.yaw) = (at - 60.0, 4.0 * row, 0.0);
        }
    };
    let found = findings_where("", |_| {}, braking, |_| {}, |_| None);
    assert!(found.iter().all(|one| one.code != Code::StaleObjects), "{found:#?}");
}
