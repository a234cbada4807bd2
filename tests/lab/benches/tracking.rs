//! The metrics of one method on the whole synthetic data set: 150 scenes of 40 keyframes.

use criterion::{Criterion, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use v2x_agent::random::{standard_normal, unit};
use v2x_lab::synthetic;
use v2x_lab::tracking::amota::NuscenesScore;
use v2x_lab::tracking::clear::Clear;
use v2x_lab::tracking::hota::{Hota, ZERO_M};
use v2x_lab::tracking::identity::Identity;
use v2x_lab::tracking::{GATE_M, Instant, ReportedBox, Sequence};
use v2x_lab::{Keyframe, Scene, TrueBox};

/// Estimates with 10 % misses, errors of 0.5 m, different scores and some new track ids.
fn reported(scene: &Scene, rng: &mut ChaCha8Rng) -> Sequence {
    let instant = |(number, keyframe): (u64, &Keyframe)| {
        let reported = |truth: &TrueBox| {
            let mut bev = truth.bev;
            bev.x += 0.5 * standard_normal(rng);
            bev.y += 0.5 * standard_normal(rng);
            let generation = (number + u64::from(truth.id.0)) / 15;
            let track = 1000 * generation + u64::from(truth.id.0);
            (unit(rng) < 0.9).then(|| ReportedBox { track, class: truth.class, score: unit(rng), bev })
        };
        Instant {
            truth: keyframe.objects.clone(),
            reported: keyframe.objects.iter().filter_map(reported).collect(),
        }
    };
    Sequence::new((0..).zip(&scene.keyframes).map(instant).collect()).expect("every object once")
}

fn tracking(criterion: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let scenes: Vec<Sequence> = synthetic::scenes().iter().map(|scene| reported(scene, &mut rng)).collect();
    let mut group = criterion.benchmark_group("tracking metrics, 150 scenes");
    group.sample_size(10);
    group.bench_function("CLEAR MOT", |bencher| {
        bencher.iter(|| {
            let mut sum = Clear::default();
            scenes.iter().for_each(|scene| sum.merge(&Clear::of(scene, GATE_M)));
            sum.mota()
        });
    });
    group.bench_function("identity", |bencher| {
        bencher.iter(|| {
            let mut sum = Identity::default();
            scenes.iter().for_each(|scene| sum.merge(&Identity::of(scene, GATE_M)));
            sum.idf1()
        });
    });
    group.bench_function("HOTA", |bencher| {
        bencher.iter(|| {
            let mut sum = Hota::default();
            scenes.iter().for_each(|scene| sum.merge(&Hota::of(scene, ZERO_M)));
            sum.score()
        });
    });
    group.bench_function("nuScenes", |bencher| bencher.iter(|| NuscenesScore::of(&scenes).amota()));
    group.finish();
}

criterion_group!(benches, tracking);
criterion_main!(benches);
