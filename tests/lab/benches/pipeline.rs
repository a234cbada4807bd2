//! The whole pipeline without I/O over one second of simulated time, from input bytes to output bytes.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use v2x_common::id::HubId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::MotionModel;
use v2x_lab::workload::{Arrival, Load, Workload};

const PUBLISH_INTERVAL: Span = Span::from_millis(50);

/// Ingests the frames and publishes at 20 Hz. Returns the number of published bytes.
fn run(engine: &mut Engine, arrivals: &[Arrival], begin: Timestamp) -> usize {
    let mut due = begin + PUBLISH_INTERVAL;
    let (mut encoded, mut published) = (Vec::new(), 0);
    for arrival in arrivals {
        while due <= arrival.received_at {
            encoded.clear();
            wire::fused::encode(engine.fused(due), &mut encoded).expect("the wire holds ordinary objects");
            published += encoded.len();
            due += PUBLISH_INTERVAL;
        }
        let frame = wire::detections::decode(&arrival.bytes).expect("encoded by the workload");
        engine.handle_frame(&frame, arrival.received_at);
    }
    published
}

fn pipeline(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pipeline, 100 objects");
    group.sample_size(10);
    let cases = [
        ("cv, 10 agents", MotionModel::Cv, 10, 0.0),
        ("cv, 50 agents, a fifth late", MotionModel::Cv, 50, 0.2),
        ("imm, 10 agents", MotionModel::Imm, 10, 0.0),
    ];
    for (name, motion, agents, late_share) in cases {
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
        let warm = start + Span::from_millis(2000);
        let mut workload =
            Workload::new(Load { agents, rate_hz: 10, objects: 100, view: None, late_share, seed: 1 }, start);
        let mut arrivals_before = |until| workload.arrivals_before(until).expect("ordinary frames");
        let (first, measured) = (arrivals_before(warm), arrivals_before(warm + Span::from_millis(1000)));
        let config = EngineConfig::new(HubId::new("hub").expect("a legal name"), 1);
        let warm_engine = || {
            let mut engine = Engine::new(config.with_tracking(|tracking| tracking.motion = motion));
            run(&mut engine, &first, start);
            engine
        };
        group.throughput(Throughput::Elements(measured.iter().map(|arrival| arrival.n_detections).sum()));
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                warm_engine,
                |engine| run(engine, &measured, warm),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, pipeline);
criterion_main!(benches);
