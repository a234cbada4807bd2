//! Bytes of fused objects: with all contributors, some and none, and as a list by what changes.
//!
//! ```console
//! $ cargo run --release -p v2x-lab --example list_sizes
//! ```
//!
//! Objects: 100 cars on the rings of a roundabout, all of them seen by all agents at 10 Hz, and 1000 of which each agent sees
//! the nearest 50; a list every 50 ms for 1 s after the first 2 s. Changes: a list of 200 objects of which 20 differ from the
//! key frame by 1 m. Streams: half a minute of shipped scenarios in virtual time, lists as a live hub publishes them, key
//! frames included.

use std::process::ExitCode;
use v2x_agent::scenario::Scenario;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::id::HubId;
use v2x_common::lists::{DeltaFrame, DeltaSource, Tolerance};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::{Engine, EngineConfig, PublishMode};
use v2x_fusion_hub::hub::HubSettings;
use v2x_fusion_hub::values::ContributorLimit;
use v2x_lab::VirtualRun;
use v2x_lab::workload::{Load, Workload};

const START: Timestamp = Timestamp::from_nanos(1_790_000_000_000_000_000);
const PUBLISH_INTERVAL: Span = Span::from_millis(50);
const ON_UPDATE: PublishMode =
    PublishMode::OnUpdate { tick: Span::from_millis(100), min_interval: Span::from_millis(2) };
const LIMITS: [(&str, ContributorLimit); 3] =
    [("all", ContributorLimit::All), ("4", ContributorLimit::Newest(4)), ("none", ContributorLimit::NONE)];
const SCENARIOS: [(&str, &str); 3] = [
    ("crossing", include_str!("../../../deploy/scenarios/crossing.toml")),
    ("ten-agents", include_str!("../../../deploy/scenarios/ten-agents.toml")),
    ("highway", include_str!("../../../deploy/scenarios/highway.toml")),
];

fn main() -> ExitCode {
    match report() {
        Ok(text) => {
            #[expect(clippy::print_stdout, reason = "a program whose purpose is this table")]
            {
                print!("{text}");
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            #[expect(clippy::print_stderr, reason = "a program's own error")]
            {
                eprintln!("list_sizes: {error}");
            }
            ExitCode::FAILURE
        }
    }
}

fn report() -> anyhow::Result<String> {
    let mut text = String::from("agents  objects  contributors  B an object  and its share of the frame\n");
    let place = |agents| Load { agents, objects: 100, rate_hz: 10, view: None, late_share: 0.0, seed: 1 };
    let town = Load { objects: 1000, view: Some(50), ..place(200) };
    for load in [place(10), place(50), place(200), town] {
        for (name, limit) in LIMITS {
            let Sizes { objects, object_bytes, frame_bytes } = sizes(load, limit)?;
            let (object, share) = (object_bytes / objects, frame_bytes / objects);
            text += &format!(
                "{:>6}  {:>7}  {name:<12}  {object:>11.1}  {share:>11.1}\n",
                load.agents, load.objects
            );
        }
    }
    text += &changes()?;
    text += "\nscenario    lists  objects  full B/list  without contributors, agents  by what changes  of objects sent\n";
    for (name, scenario) in SCENARIOS {
        text += &stream(name, scenario)?;
    }
    Ok(text)
}

#[derive(Default)]
struct Sizes {
    objects: f64,
    object_bytes: f64,
    frame_bytes: f64,
}

/// Of the lists of a load.
fn sizes(load: Load, contributors: ContributorLimit) -> anyhow::Result<Sizes> {
    let mut workload = Workload::new(load, START);
    let mut engine = Engine::new(EngineConfig { contributors, ..EngineConfig::new(HubId::new("hub")?, 1) });
    for agent in workload.agents() {
        engine.handle_description(agent, workload.description())?;
    }
    let (mut sizes, mut due) = (Sizes::default(), START + Span::from_millis(2000));
    for arrival in workload.arrivals_before(START + Span::from_millis(3000))? {
        while due <= arrival.received_at {
            let frame = engine.fused(due);
            let objects = frame.objects.clone();
            let bare = FusedFrame { objects: Vec::new(), ..frame.clone() };
            let (whole, head) = (bytes(frame)?, bytes(&bare)?);
            sizes.objects += count(objects.len());
            sizes.object_bytes += count(whole - head);
            sizes.frame_bytes += count(whole);
            due += PUBLISH_INTERVAL;
        }
        let frame = wire::detections::decode(&arrival.bytes)?;
        let _ = engine.handle_frame(&frame, arrival.received_at);
    }
    Ok(sizes)
}

/// A tenth of a list changes: against the list without contributors and agents, and against the whole one of 200 agents.
fn changes() -> anyhow::Result<String> {
    let mut workload = Workload::new(
        Load { agents: 200, objects: 200, rate_hz: 10, view: None, late_share: 0.0, seed: 1 },
        START,
    );
    let mut engine = Engine::new(EngineConfig::new(HubId::new("hub")?, 1));
    for arrival in workload.arrivals_before(START + Span::from_millis(2000))? {
        let _ = engine.handle_frame(&wire::detections::decode(&arrival.bytes)?, arrival.received_at);
    }
    let whole = engine.fused(START + Span::from_millis(2000)).clone();
    let key = plain(&whole);
    let mut list = key.clone();
    list.objects.iter_mut().step_by(10).for_each(|object| object.bev.x += 1.0);
    let delta = DeltaFrame::between(&key, &list, &Tolerance::HUB);
    let (delta_bytes, plain_bytes, whole_bytes) = (delta_len(&delta)?, bytes(&key)?, bytes(&whole)?);
    let less = |than: usize| 100.0 * (1.0 - count(delta_bytes) / count(than));
    Ok(format!(
        "\n{} of {} objects changed: {delta_bytes} B; -{:.1} % of {plain_bytes} B without contributors and agents, -{:.1} % of {whole_bytes} B with them\n",
        delta.changed.len(),
        list.objects.len(),
        less(plain_bytes),
        less(whole_bytes),
    ))
}

/// Half a minute of a scenario.
fn stream(name: &str, scenario: &str) -> anyhow::Result<String> {
    let scenario = Scenario::from_toml(scenario)?;
    let duration = Span::from_millis(30_000);
    let settings = HubSettings { publish: ON_UPDATE, ..HubSettings::default() };
    let run = VirtualRun { scenario: &scenario, seed: 1, start: START, duration, settings: &settings };
    let log = run.run(Engine::new(EngineConfig::new(HubId::new("hub")?, 1)))?;
    let mut source = DeltaSource::new(Tolerance::HUB);
    let (mut whole, mut lists, mut updates, mut sent, mut objects) = (0, 0, 0, 0, 0);
    for received in &log.fused {
        let list = plain(&received.frame);
        whole += bytes(&received.frame)?;
        let list_bytes = bytes(&list)?;
        lists += list_bytes;
        objects += list.objects.len();
        if let Some(delta) = source.delta(&list) {
            updates += delta_len(&delta)?;
            sent += delta.changed.len();
        } else {
            updates += list_bytes;
            sent += list.objects.len();
            let mut buffer = Vec::new();
            wire::fused::encode(&list, &mut buffer)?;
            source.set_key(wire::fused::decode(&buffer)?);
        }
    }
    let n = count(log.fused.len());
    let less = 100.0 * (1.0 - count(updates) / count(whole));
    Ok(format!(
        "{name:<11} {:>5} {:>8.1} {:>12.0} {:>29.0} {:>9.0} (-{less:.0} %) {:>13.1} %\n",
        log.fused.len(),
        count(objects) / n,
        count(whole) / n,
        count(lists) / n,
        count(updates) / n,
        100.0 * count(sent) / count(objects),
    ))
}

fn plain(frame: &FusedFrame) -> FusedFrame {
    let objects = frame.objects.iter().map(FusedObject::without_contributors).collect();
    FusedFrame { objects, ..frame.without_lists() }
}

fn bytes(frame: &FusedFrame) -> Result<usize, WireError> {
    let mut buffer = Vec::new();
    wire::fused::encode(frame, &mut buffer)?;
    Ok(buffer.len())
}

fn delta_len(delta: &DeltaFrame) -> Result<usize, WireError> {
    let mut buffer = Vec::new();
    wire::delta::encode(delta, &mut buffer)?;
    Ok(buffer.len())
}

#[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
const fn count(n: usize) -> f64 {
    n as f64
}
