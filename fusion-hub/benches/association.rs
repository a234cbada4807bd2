//! Association of one frame with as many tracks as it has detections, at 100 m² an object.
//!
//! The frames change from call to call: a processor's branch prediction would adapt to one small frame.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_fusion_hub::association::{AssociationConfig, AssociationCost, Associator};
use v2x_fusion_hub::values::Measurement;
use v2x_fusion_hub::values::PredictedMeasurement;

/// Of reports and of tracks, m.
const SIGMA_M: f64 = 0.5;
/// In all frames together, at least.
const OBJECTS: u64 = 10_000;
const AREA_PER_OBJECT_M2: f64 = 100.0;

fn uniform(random: &mut ChaCha8Rng) -> f64 {
    f64::from(random.next_u32()) / 4_294_967_296.0
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - uniform(random)));
    radius * libm::cos(TAU * uniform(random))
}

/// Cars at random, each with a track and a report, both lists shuffled against each other.
fn scene(count: usize, seed: u64) -> (Vec<Measurement>, Vec<PredictedMeasurement>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    #[expect(clippy::cast_precision_loss, reason = "counts are small")]
    let side = libm::sqrt(AREA_PER_OBJECT_M2 * count as f64);
    let mut measurements = Vec::new();
    let mut tracks = Vec::new();
    for _ in 0..count {
        let position = [side * uniform(&mut random), side * uniform(&mut random)];
        let yaw = TAU * uniform(&mut random) - PI;
        let mut near = |at: f64, sigma: f64| at + sigma * normal(&mut random);
        measurements.push(Measurement {
            class: Class::Car,
            position: [near(position[0], SIGMA_M), near(position[1], SIGMA_M)],
            r: Covariance2::isotropic(SIGMA_M),
            size: [near(1.8, 0.36), near(4.5, 0.9)],
            relative_variance: [0.04; 2],
            yaw: near(yaw, 0.1),
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        });
        tracks.push(PredictedMeasurement {
            class: Class::Car,
            position: [near(position[0], SIGMA_M), near(position[1], SIGMA_M)],
            position_covariance: Covariance2::isotropic(SIGMA_M),
            gate_covariance: Covariance2::isotropic(SIGMA_M),
            size: [1.8, 4.5],
            size_variance: [0.01, 0.04],
            yaw,
            yaw_variance: 0.005,
            report_probability: 0.5,
            by_positions: None,
        });
    }
    for place in (1..count).rev() {
        tracks.swap(place, random.next_u32() as usize % (place + 1));
    }
    (measurements, tracks)
}

fn association(criterion: &mut Criterion) {
    let costs = [
        ("csba", AssociationCost::Csba),
        ("likelihood", AssociationCost::Likelihood),
        ("iou", AssociationCost::Iou),
        ("euclidean", AssociationCost::Euclidean),
    ];
    for (name, cost) in costs {
        let mut group = criterion.benchmark_group(format!("association/{name}"));
        for count in [10, 100, 500, 2000, 10_000] {
            let scenes: Vec<_> =
                (0..(OBJECTS / count as u64).max(1)).map(|seed| scene(count, seed)).collect();
            let mut frames = scenes.iter().cycle();
            let config = AssociationConfig { cost, ..AssociationConfig::default() };
            let mut associator = Associator::default();
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(BenchmarkId::from_parameter(count), |bencher| {
                bencher.iter(|| {
                    let (measurements, tracks) = frames.next().expect("they go round");
                    associator.associate(black_box(measurements), black_box(tracks), &config);
                    black_box(associator.track_of().len())
                });
            });
        }
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = association
}
criterion_main!(benches);
