//! Each diagnosis is provoked by what it names, and sound agents provoke none. Frames go through the hub's core as JSON.

use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::{Core, HubSettings};

const START_MS: i64 = 1_790_000_000_000;
const DURATION_MS: i64 = 24_000;

/// A frame of one agent, before it is written.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) agent: &'static str,
    pub(crate) captured_ms: i64,
    /// From capture to arrival.
    pub(crate) delay_ms: i64,
    pub(crate) sequence: u64,
    pub(crate) epoch: u64,
    pub(crate) pose: Pose,
    pub(crate) detections: Vec<Detection>,
    pub(crate) is_lost: bool,
    /// Added to the written frame last.
    pub(crate) more: Value,
}

#[derive(Clone, Debug)]
pub(crate) struct Detection {
    pub(crate) class: &'static str,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) w: f64,
    pub(crate) d: f64,
    pub(crate) yaw: f64,
    pub(crate) sigma_m: Option<f64>,
}

/// Two cameras over a crossing. `edit` makes the second one's frames wrong.
pub(crate) fn world(k: i64, agent: &'static str) -> Frame {
    let pose = match agent {
        "north" => Pose { x: 12.0, y: 26.0, yaw: -1.8 },
        _ => Pose { x: -25.0, y: -14.0, yaw: 0.5 },
    };
    let t = 0.1 * k as f64;
    let mut cars = Vec::new();
    for n in 0..3 {
        // Each lane is a line of cars that begins again at its end.
        let along = |speed: f64| (26.0 * f64::from(n) + speed * t).rem_euclid(78.0) - 39.0;
        cars.push((along(9.0), -2.0, 0.0));
        cars.push((-along(8.0), 2.0, std::f64::consts::PI));
        cars.push((-2.0, -along(7.0), -FRAC_PI_2));
        cars.push((2.0, along(10.0), FRAC_PI_2));
    }
    let seed = k.unsigned_abs() * 2 + u64::from(agent == "north");
    let detections = cars.iter().enumerate().filter(|(n, _)| noise(seed, *n as u64, 9) < 1.6);
    let detections = detections.map(|(n, &(x, y, yaw))| {
        let error = |which: u64, sigma: f64| sigma * noise(seed, n as u64, which);
        Detection {
            class: "car",
            x: x + error(0, 0.3),
            y: y + error(1, 0.3),
            w: 1.8 + error(2, 0.1),
            d: 4.5 + error(3, 0.2),
            yaw: wrap_angle(yaw + error(4, 0.05)),
            sigma_m: Some(0.3),
        }
    });
    Frame {
        agent,
        captured_ms: 100 * k + if agent == "north" { 20 } else { 0 },
        delay_ms: 20 + k % 7,
        sequence: k.unsigned_abs() + 1,
        epoch: 1,
        pose,
        detections: detections.collect(),
        is_lost: false,
        more: json!({}),
    }
}

/// About standard normal, the same in each run: the sum of twelve uniform numbers of a hash.
pub(crate) fn noise(seed: u64, n: u64, which: u64) -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (n << 32) ^ (which << 56) ^ 0x51;
    let mut sum = -6.0;
    for _ in 0..12 {
        state ^= state >> 33;
        state = state.wrapping_mul(0xff51_afd7_ed55_8ccd);
        state ^= state >> 29;
        sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum
}

impl Frame {
    fn json(&self) -> Vec<u8> {
        let detections = self.detections.iter().map(|one| {
            let mut json =
                json!({ "class": one.class, "x": one.x, "y": one.y, "w": one.w, "d": one.d, "yaw": one.yaw });
            if let Some(sigma) = one.sigma_m {
                json["sigma"] = json!({ "x": sigma, "y": sigma, "w": 0.1, "d": 0.2, "yaw": 0.05 });
            }
            json
        });
        let detections: Vec<_> = detections.collect();
        let Pose { x, y, yaw } = self.pose;
        let mut json = json!({
            "captured_at": (START_MS + self.captured_ms) * 1000, "sequence": self.sequence, "epoch": self.epoch,
            "sensor_pose": { "x": x, "y": y, "yaw": yaw }, "detections": detections,
        });
        for (key, value) in self.more.as_object().into_iter().flatten() {
            json[key] = value.clone();
        }
        json.to_string().into_bytes()
    }
}

/// What is found with these settings where the frames of `north` are edited; `extra` gives further frames.
pub(crate) fn findings_of(
    settings: &str,
    edit: impl Fn(&mut Frame),
    extra: impl Fn(i64) -> Option<Frame>,
) -> Vec<Finding> {
    findings_with(settings, |_| {}, edit, extra)
}

/// The same; `describe` is called once a second.
fn findings_with(
    settings: &str,
    describe: impl Fn(&mut Core),
    edit: impl Fn(&mut Frame),
    extra: impl Fn(i64) -> Option<Frame>,
) -> Vec<Finding> {
    let table = settings.parse().expect("a table");
    let mut core = Core::new(HubSettings::from_table(table).expect("settings"), Engine::new);
    let mut frames: Vec<_> = (0..DURATION_MS / 100)
        .flat_map(|k| {
            let mut north = world(k, "north");
            edit(&mut north);
            [Some(world(k, "south")), Some(north), extra(k)]
        })
        .flatten()
        .filter(|frame| !frame.is_lost)
        .collect();
    frames.sort_by_key(|frame| frame.captured_ms + frame.delay_ms);
    let alive: BTreeSet<_> = ["north", "south"].map(|name| AgentId::new(name).expect("a name")).into();
    let tokens = Tokens { alive, ..Tokens::default() };
    run(&mut core, frames, &tokens, describe)
}

/// What a core finds in frames in their order of arrival; `describe` is called once a second.
pub(crate) fn run(
    core: &mut Core,
    frames: Vec<Frame>,
    tokens: &Tokens,
    describe: impl Fn(&mut Core),
) -> Vec<Finding> {
    let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(START_MS + ms);
    let (mut next_list, mut next_look) = (0, 0);
    for frame in frames {
        let now = frame.captured_ms + frame.delay_ms;
        while next_list <= now {
            core.fused(at(next_list));
            next_list += 50;
        }
        while next_look <= now {
            describe(core);
            core.look(tokens, at(next_look));
            next_look += 1000;
        }
        core.handle_frame(AgentId::new(frame.agent).expect("a name"), at(now), &Body::Json(&frame.json()));
    }
    core.findings().to_vec()
}

pub(crate) fn found(edit: impl Fn(&mut Frame)) -> Vec<Finding> {
    findings_of("", edit, |_| None)
}

pub(crate) fn each(frame: &mut Frame, edit: impl Fn(&mut Detection)) {
    frame.detections.iter_mut().for_each(edit);
}

/// The only fault, and it is north's.
#[track_caller]
fn assert_only(findings: &[Finding], code: Code, words: &str) {
    let faults: Vec<_> = findings.iter().filter(|one| one.is_fault()).collect();
    let [one] = faults[..] else { panic!("one fault, {code:?}, not {findings:#?}") };
    assert_eq!(
        (one.code, one.agent.map(|agent| agent.to_string())),
        (code, Some("north".to_owned())),
        "{one}"
    );
    assert!(one.to_string().contains(words), "{words:?} is not in {one}");
}

#[test]
fn sound_agents_have_no_finding() {
    assert_eq!(found(|_| {}), []);
}

#[test]
fn headings_in_degrees_are_named_with_the_line_that_says_so() {
    let degrees = |frame: &mut Frame| each(frame, |one| one.yaw = one.yaw.to_degrees().rem_euclid(360.0));
    assert_only(&found(degrees), Code::Degrees, "`yaw = { unit = \"deg\" }` under `[hub.agents.north]`");
    let told = findings_of("[agents.north]\nyaw = { unit = \"deg\" }", degrees, |_| None);
    assert_eq!(told, [], "a hub that is told so finds nothing");
}

#[test]
fn a_compass_and_other_origins_of_headings_are_named_with_the_line_that_says_so() {
    let compass = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(FRAC_PI_2 - one.yaw));
    assert_only(&found(compass), Code::HeadingsMirrored, "yaw = { from = \"north\", turn = \"cw\" }");
    let north = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(one.yaw - FRAC_PI_2));
    assert_only(&found(north), Code::HeadingsRotated, "yaw = { from = \"north\" }");
    let back = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(one.yaw + 2.0 * FRAC_PI_2));
    assert_only(&found(back), Code::HeadingsReversed, "180°");
}

#[test]
fn swapped_sizes_are_named() {
    let swapped = found(|frame| each(frame, |one| (one.w, one.d) = (one.d, one.w)));
    assert_only(&swapped, Code::SizesSwapped, "sizes = \"w-along\"");
}

#[test]
fn degrees_of_longitude_and_latitude_are_named() {
    let geodetic = found(|frame| {
        each(frame, |one| (one.x, one.y) = (11.575 + one.x / 74_400.0, 48.137 + one.y / 111_200.0));
    });
    assert_only(&geodetic, Code::Geodetic, "frame = \"wgs84\"");
}

#[test]
fn positions_from_the_sensor_mirrored_and_swapped_ones_are_named() {
    let relative = |frame: &mut Frame, sign: f64| {
        let pose = frame.pose;
        each(frame, |one| {
            let bearing = pose.bearing_to(one.x, one.y);
            let range = pose.distance_to(one.x, one.y);
            (one.x, one.y) = (range * libm::cos(bearing), sign * range * libm::sin(bearing));
            one.yaw = wrap_angle(one.yaw - pose.yaw);
        });
    };
    let has = |findings: Vec<Finding>, code: Code, words: &str| {
        let is_it =
            |one: &Finding| one.code == code && one.agent.is_some_and(|agent| agent.as_str() == "north");
        assert!(findings.iter().any(|one| is_it(one) && one.to_string().contains(words)), "{findings:#?}");
    };
    has(found(|frame| relative(frame, 1.0)), Code::SensorFrame, "frame = \"ego\"");
    has(found(|frame| relative(frame, -1.0)), Code::SensorFrame, "y to the right");
    has(
        found(|frame| each(frame, |one| (one.x, one.y) = (one.y, one.x))),
        Code::Axes,
        "x is north and y is east",
    );
    has(found(|frame| each(frame, |one| one.y = -one.y)), Code::Axes, "y points south");
}

#[test]
fn positions_in_a_sensors_frame_without_a_pose_are_told_as_what_cannot_be_told() {
    let relative = |only: usize| {
        found(move |frame| {
            let pose = frame.pose;
            each(frame, |one| {
                let (sin, cos) = libm::sincos(pose.yaw);
                let (x, y) = (one.x - pose.x, one.y - pose.y);
                (one.x, one.y, one.yaw) =
                    (x * cos + y * sin, y * cos - x * sin, wrap_angle(one.yaw - pose.yaw));
            });
            frame.detections.truncate(only);
            frame.more = json!({ "sensor_pose": null });
        })
    };
    // Of all objects, and of one alone.
    for only in [usize::MAX, 1] {
        let findings = relative(only);
        let told = findings.iter().find(|one| one.code == Code::SensorFrame);
        let told = told.unwrap_or_else(|| panic!("{only}: {findings:#?}"));
        assert!(!told.is_fault() && told.says.contains("north gives no `sensor_pose`"), "{told}");
        assert!(
            told.change.contains("`frame = \"sensor\"`") && told.change.contains("[hub.agents.north]"),
            "{told}"
        );
    }
    // Who sees the same gives none either, and is right.
    let right = found(|frame| frame.more = json!({ "sensor_pose": null }));
    assert_eq!(right, []);
}

#[test]
fn a_shift_and_a_turn_between_agents_are_told_in_metres_and_degrees() {
    let shifted = found(|frame| each(frame, |one| (one.x, one.y) = (one.x + 2.0, one.y - 3.0)));
    let offset: Vec<_> = shifted.iter().filter(|one| one.code == Code::Offset).collect();
    let [one] = offset[..] else { panic!("{shifted:#?}") };
    // Of two agents nobody knows which one is wrong.
    assert_eq!(one.agent, None);
    assert!(
        one.says.contains("objects of south lie -2.0") || one.says.contains("objects of south lie -1.9"),
        "{one}"
    );
    let turned = found(|frame| {
        let pose = frame.pose;
        let (sin, cos) = libm::sincos(0.12);
        each(frame, |one| {
            let (x, y) = (one.x - pose.x, one.y - pose.y);
            (one.x, one.y) = (pose.x + x * cos - y * sin, pose.y + x * sin + y * cos);
            one.yaw = wrap_angle(one.yaw + 0.12);
        });
    });
    assert!(
        turned.iter().any(|one| one.code == Code::Offset && one.says.contains("turned by")),
        "{turned:#?}"
    );
}

#[test]
fn a_clock_that_is_behind_is_told_from_a_slow_link() {
    let behind = found(|frame| {
        frame.captured_ms -= 300;
        frame.delay_ms += 300;
    });
    assert_only(&behind, Code::ClockBehind, "time_offset_ms = ");
    let words = behind[0].to_string();
    let by_ms: f64 = words
        .split("time_offset_ms = ")
        .nth(1)
        .and_then(|rest| rest.split('`').next())
        .unwrap()
        .parse()
        .unwrap();
    assert!((by_ms - 300.0).abs() < 30.0, "{words}");
    let slow = found(|frame| frame.delay_ms += 300);
    assert!(slow.iter().all(|one| !one.is_fault()), "{slow:#?}");
    assert!(slow.iter().any(|one| one.code == Code::LinkSlow), "{slow:#?}");
    let ahead = found(|frame| {
        frame.captured_ms += 150;
        frame.delay_ms -= 150;
    });
    assert_only(&ahead, Code::ClockAhead, "time_offset_ms = -1");
}

/// By more than Δmax: every frame is refused, or too late over a link that varies.
#[test]
fn a_clock_that_is_off_by_more_than_half_a_second_is_a_fault_of_the_agent_whatever_its_link_does() {
    let by = |offset_ms: i64, jitter_ms: i64| {
        found(move |frame| {
            let late = if jitter_ms > 0 { frame.captured_ms / 100 * 37 % jitter_ms } else { 0 };
            frame.captured_ms += offset_ms;
            frame.delay_ms += late - offset_ms;
        })
    };
    for jitter_ms in [0, 90, 400] {
        for offset_ms in [600, 2_000, 3_600_000, -600, -2_000, -3_600_000] {
            let found = by(offset_ms, jitter_ms);
            let codes: &[Code] = match offset_ms > 0 {
                true => &[Code::ClockAhead],
                false => &[Code::ClockBehind, Code::ClockBehindOrLinkSlow],
            };
            let is_told = |one: &Finding| {
                one.is_fault()
                    && codes.contains(&one.code)
                    && one.agent.is_some_and(|agent| agent.as_str() == "north")
            };
            assert!(found.iter().any(is_told), "{offset_ms} ms, jitter {jitter_ms} ms: {found:#?}");
        }
    }
}

#[test]
fn stamps_of_another_unit_are_named() {
    let seconds =
        found(|frame| frame.more = json!({ "captured_at": (START_MS + frame.captured_ms) as f64 * 1e-3 }));
    assert_only(&seconds, Code::TimeUnit, "time.time_ns() // 1000");
    let millis = found(|frame| frame.more = json!({ "captured_at": START_MS + frame.captured_ms }));
    assert_only(&millis, Code::TimeUnit, "milliseconds");
}

#[test]
fn missing_and_false_standard_deviations_are_told() {
    let missing = found(|frame| each(frame, |one| one.sigma_m = None));
    assert!(missing.iter().any(|one| one.code == Code::SigmaMissing && !one.is_fault()), "{missing:#?}");
    let set = "[agents.north]\nsigma_position_m = 0.35";
    let set = findings_of(set, |frame| each(frame, |one| one.sigma_m = None), |_| None);
    assert!(set.iter().all(|one| one.code != Code::SigmaMissing), "the settings say it: {set:#?}");
    let small = found(|frame| each(frame, |one| one.sigma_m = Some(0.05)));
    assert_only(&small, Code::SigmaTooSmall, "too small, by a factor of");
    let large = found(|frame| each(frame, |one| one.sigma_m = Some(3.0)));
    assert_only(&large, Code::SigmaTooLarge, "too large, by a factor of");
}

#[test]
fn unknown_classes_impossible_values_and_refusals_are_told_with_their_names() {
    let ufo = found(|frame| each(frame, |one| one.class = "Fahrzeug"));
    assert_only(&ufo, Code::UnknownClasses, "classes = { \"Fahrzeug\" = \"car\" }");
    let impossible = found(|frame| frame.detections[0].w = -1.0);
    assert_only(&impossible, Code::ImpossibleDetections, "w out of range");
    let refused = found(|frame| frame.more = json!({ "theta": 1 }));
    assert_only(&refused, Code::FramesRefused, "theta");
    let late = found(|frame| frame.delay_ms += 5000);
    assert!(
        late.iter().any(|one| one.code == Code::FramesRefused && one.says.contains("too_late")),
        "{late:#?}"
    );
}

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

#[test]
fn gaps_rates_jitter_and_silence_are_told() {
    let lossy = found(|frame| frame.is_lost = frame.sequence % 5 < 2);
    assert_only(&lossy, Code::Gaps, "missing by their sequence numbers");
    let jittery = found(|frame| frame.delay_ms += if frame.sequence % 3 == 0 { 400 } else { 0 });
    assert!(jittery.iter().any(|one| one.code == Code::Jitter && !one.is_fault()), "{jittery:#?}");
    let silent = found(|frame| frame.is_lost = true);
    assert_only(&silent, Code::Silent, "v2x/NETWORK/agent/NAME/detections");
}

#[test]
fn compass_headings_in_degrees_are_named_with_all_that_has_to_change_at_once() {
    let conventions = [
        ("turn = \"cw\"", (0.0, -1.0)),
        ("from = \"north\"", (FRAC_PI_2, 1.0)),
        ("from = \"north\", turn = \"cw\"", (FRAC_PI_2, -1.0)),
    ];
    for (words, (north, turn)) in conventions {
        // direction = turn · written + north
        let write = |frame: &mut Frame| {
            each(frame, |one| one.yaw = (turn * (one.yaw - north)).to_degrees().rem_euclid(360.0));
        };
        let setting = format!("yaw = {{ unit = \"deg\", {words} }}");
        assert_only(&found(write), Code::Degrees, &format!("`{setting}` under `[hub.agents.north]`"));
        let told = findings_of(&format!("[agents.north]\n{setting}"), write, |_| None);
        assert_eq!(told, []);
    }
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
}

#[test]
fn positions_far_from_everybody_are_told() {
    let utm = found(|frame| {
        each(frame, |one| (one.x, one.y) = (one.x + 691_000.0, one.y + 5_334_000.0));
        frame.pose = Pose { x: frame.pose.x + 691_000.0, y: frame.pose.y + 5_334_000.0, ..frame.pose };
    });
    assert_only(&utm, Code::FarAway, "UTM");
}

#[test]
fn a_refused_description_and_a_rate_below_the_declared_one_are_told() {
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
