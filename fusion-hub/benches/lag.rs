//! The cost of publishing 100 objects that three agents report at 10 Hz, without and with a lag.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::{Hypotheses, MotionModel};

const N_OBJECTS: u32 = 100;
const AGENTS: [&str; 3] = ["a", "b", "c"];
const N_FRAMES: u32 = 90;
/// Between two frames of any agents.
const STEP: Span = Span::from_millis(33);

fn frame(step: u32, captured_at: Timestamp) -> DetectionFrame {
    let id = AgentId::new(AGENTS[step as usize % AGENTS.len()]).expect("a legal name");
    let t = (captured_at - Timestamp::EPOCH).as_secs_f64();
    let covariance = BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.1, dd: 0.6, yaw: 0.01 };
    let detection = |object: u32| Detection {
        class: Class::Car,
        score: 0.9,
        bev: BevBox { x: 8.0 * t, y: 20.0 * f64::from(object), w: 1.8, d: 4.5, yaw: 0.0 },
        covariance,
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    };
    let id = FrameId { agent: id, epoch: 1, sequence: u64::from(step) };
    DetectionFrame {
        detections: (0..N_OBJECTS).map(detection).collect(),
        ..DetectionFrame::empty(id, captured_at)
    }
}

fn publish(criterion: &mut Criterion, name: &str, motion: MotionModel, lag: Span) {
    let config = EngineConfig::new(HubId::new("hub").expect("a legal name"), 1);
    let mut engine = Engine::new(config.with_tracking(|tracking| {
        tracking.motion = motion;
        tracking.tracker.hypotheses = Hypotheses::with_lag(lag);
    }));
    let mut now = Timestamp::EPOCH;
    for step in 0..N_FRAMES {
        engine.handle_frame(&frame(step, now), now);
        engine.fused(now);
        now += STEP;
    }
    assert_eq!(engine.fused(now).objects.len(), N_OBJECTS as usize);
    let name = format!("publish/{name}, {N_OBJECTS} objects, lag {} ms", lag.as_millis_f64());
    criterion.bench_function(&name, |bencher| bencher.iter(|| black_box(engine.fused(now).objects.len())));
}

fn lag(criterion: &mut Criterion) {
    for lag_ms in [0, 500, 1000] {
        publish(criterion, "cv", MotionModel::Cv, Span::from_millis(lag_ms));
        publish(criterion, "imm", MotionModel::Imm, Span::from_millis(lag_ms));
    }
}

criterion_group!(benches, lag);
criterion_main!(benches);
