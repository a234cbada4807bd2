//! Fixed work to count instructions of: `kernels NAME REPETITIONS`. `.ci/bench.py` runs it under callgrind.
//!
//! Unlike a time, a count of instructions is the same on a busy machine. Each kernel does the same work in every
//! repetition, so that the difference of two runs is free of the start of the program.

use std::process::ExitCode;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::preset;

/// A kernel: what is done once in each repetition.
type Kernel = fn();

const KERNELS: [(&str, Kernel); 5] = [
    ("codec", codec),
    ("engine-imm", || engine(config())),
    ("engine-cv", || engine(of_preset("ours-cv"))),
    ("engine-csba-wls", || engine(of_preset("csba-wls"))),
    ("engine-lag", || engine(of_preset("ours-lag-0.5s"))),
];

const N_AGENTS: u32 = 4;
const N_OBJECTS: u32 = 40;
/// Rounds in which each agent sends a frame.
const N_ROUNDS: u32 = 20;
const ROUND: Span = Span::from_millis(100);
/// Every fourth agent's frames arrive so much later.
const LATE: Span = Span::from_millis(150);
const SIGMA_M: f64 = 0.3;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_default();
    let n_repetitions: u32 = args.next().and_then(|count| count.parse().ok()).unwrap_or(1);
    // `cargo bench` starts it too, with words of its own: then each kernel runs once.
    let chosen = KERNELS.iter().filter(|(known, _)| *known == name || name.starts_with("--"));
    let mut n_chosen = 0;
    for (_, kernel) in chosen {
        n_chosen += 1;
        (0..n_repetitions).for_each(|_| kernel());
    }
    if n_chosen > 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A pseudo-random number from -1 to 1: a hash of its arguments.
fn noise(object: u32, round: u32, axis: u32) -> f64 {
    let mut hash =
        object.wrapping_mul(0x9e37_79b9) ^ round.wrapping_mul(0x85eb_ca6b) ^ axis.wrapping_mul(0xc2b2_ae35);
    hash = (hash ^ (hash >> 16)).wrapping_mul(0x7feb_352d);
    hash = (hash ^ (hash >> 15)).wrapping_mul(0x846c_a68b);
    f64::from(hash >> 8) / f64::from(1_u32 << 23) - 1.0
}

/// An agent's report of an object that drives east on a lane of its own.
fn detection(object: u32, round: u32, agent: u32) -> Detection {
    let t_s = f64::from(round) * ROUND.as_secs_f64();
    let error_m = |axis| SIGMA_M * noise(object, round, 4 * agent + axis);
    let bev = BevBox {
        x: 20.0 * f64::from(object % 8) + 5.0 * t_s + error_m(0),
        y: 12.0 * f64::from(object / 8) + error_m(1),
        w: 1.9 + 0.3 * error_m(2),
        d: 4.6 + 0.3 * error_m(3),
        yaw: 0.02 * error_m(1),
    };
    let variance = SIGMA_M * SIGMA_M;
    let covariance = BoxCovariance {
        position: Covariance2 { xx: variance, xy: 0.0, yy: variance },
        ww: 0.01,
        dd: 0.01,
        yaw: 0.001,
    };
    Detection {
        class: Class::Car,
        score: 0.9,
        bev,
        covariance,
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

fn frame(agent: u32, round: u32) -> DetectionFrame {
    let id = AgentId::new(&format!("agent-{agent}")).expect("a legal name");
    let phase = Span::from_millis(i64::from(25 * agent));
    let since_start = Span::from_millis(i64::from(round) * 100);
    DetectionFrame {
        id: FrameId { agent: id, epoch: 1, sequence: u64::from(round) },
        captured_at: Timestamp::EPOCH + Span::from_millis(1_000_000) + phase + since_start,
        sensor_pose: Some(Pose { x: 80.0, y: 30.0, yaw: 0.0 }),
        sensor_revision: 0,
        map_frame: None,
        detections: (0..N_OBJECTS).map(|object| detection(object, round, agent)).collect(),
    }
}

/// Two seconds of frames, encoded and decoded.
fn codec() {
    let mut bytes = Vec::new();
    for round in 0..N_ROUNDS {
        let frame = frame(0, round);
        for _ in 0..N_AGENTS {
            bytes.clear();
            wire::detections::encode(&frame, &mut bytes).expect("a valid frame");
            let decoded = wire::detections::decode(&bytes).expect("what was encoded");
            assert_eq!(decoded.detections.len(), frame.detections.len());
        }
    }
}

fn of_preset(key: &str) -> EngineConfig {
    config().with_preset(preset(key).expect("a preset of the hub"))
}

fn config() -> EngineConfig {
    EngineConfig::new(HubId::new("hub").expect("a legal name"), 1)
}

/// Two seconds of a hub of this configuration: every fourth frame is late, and each round is published.
fn engine(config: EngineConfig) {
    let mut engine = Engine::new(config);
    let mut arrivals: Vec<_> = (0..N_ROUNDS)
        .flat_map(|round| (0..N_AGENTS).map(move |agent| (agent, frame(agent, round))))
        .map(|(agent, frame)| (frame.captured_at + if agent == 3 { LATE } else { Span::ZERO }, frame))
        .collect();
    arrivals.sort_by_key(|(received_at, _)| *received_at);
    for (idx, (received_at, frame)) in arrivals.iter().enumerate() {
        engine.handle_frame(frame, *received_at);
        if idx % 4 == 3 {
            engine.fused(*received_at);
        }
    }
    let n_objects = engine.fused(arrivals.last().map_or(Timestamp::EPOCH, |(at, _)| *at)).objects.len();
    assert!(n_objects >= N_OBJECTS as usize / 2, "{n_objects} objects");
}
