//! Two cameras over a crossing, and what a core finds in their frames, which go through it as JSON.

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

pub(super) const START_MS: i64 = 1_790_000_000_000;
pub(super) const DURATION_MS: i64 = 24_000;

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
    /// What is said of all headings.
    pub(crate) heading: Option<&'static str>,
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
    /// As reported, m/s.
    pub(crate) velocity: Option<[f64; 2]>,
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
            velocity: None,
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
        heading: None,
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
    pub(super) fn json(&self) -> Vec<u8> {
        let detections = self.detections.iter().map(|one| {
            let mut json =
                json!({ "class": one.class, "x": one.x, "y": one.y, "w": one.w, "d": one.d, "yaw": one.yaw });
            if let Some(sigma) = one.sigma_m {
                json["sigma"] = json!({ "x": sigma, "y": sigma, "w": 0.1, "d": 0.2, "yaw": 0.05 });
            }
            if let Some(heading) = self.heading {
                json["heading"] = json!(heading);
            }
            if let Some([x, y]) = one.velocity {
                json["velocity"] = json!({ "x": x, "y": y, "sigma_x": 0.5, "sigma_y": 0.5 });
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
pub(super) fn findings_with(
    settings: &str,
    describe: impl Fn(&mut Core),
    edit: impl Fn(&mut Frame),
    extra: impl Fn(i64) -> Option<Frame>,
) -> Vec<Finding> {
    findings_where(settings, describe, |_| {}, edit, extra)
}

/// The same where the world that both see is another one.
pub(super) fn findings_where(
    settings: &str,
    describe: impl Fn(&mut Core),
    world_of: impl Fn(&mut Frame),
    edit: impl Fn(&mut Frame),
    extra: impl Fn(i64) -> Option<Frame>,
) -> Vec<Finding> {
    let table = settings.parse().expect("a table");
    let mut core = Core::new(HubSettings::from_table(table).expect("settings"), Engine::new);
    let seen = |k: i64, agent| {
        let mut frame = world(k, agent);
        world_of(&mut frame);
        frame
    };
    let mut frames: Vec<_> = (0..DURATION_MS / 100)
        .flat_map(|k| {
            let mut north = seen(k, "north");
            edit(&mut north);
            [Some(seen(k, "south")), Some(north), extra(k)]
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
    let (mut next_list, mut next_diagnosis) = (0, 0);
    for frame in frames {
        let now = frame.captured_ms + frame.delay_ms;
        while next_list <= now {
            core.fused(at(next_list));
            next_list += 50;
        }
        while next_diagnosis <= now {
            describe(core);
            core.diagnose(tokens, at(next_diagnosis));
            next_diagnosis += 1000;
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
pub(super) fn assert_only(findings: &[Finding], code: Code, words: &str) {
    let faults: Vec<_> = findings.iter().filter(|one| one.is_fault()).collect();
    let [one] = faults[..] else { panic!("one fault, {code:?}, not {findings:#?}") };
    assert_eq!(
        (one.code, one.agent.map(|agent| agent.to_string())),
        (code, Some("north".to_owned())),
        "{one}"
    );
    assert!(one.to_string().contains(words), "{words:?} is not in {one}");
}
