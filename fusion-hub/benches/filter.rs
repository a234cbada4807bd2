//! One track's filter: a step of 10 ms and a report, under constant velocity and under all four models; and its size.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::filter::imm::{Imm, Inflation};
use v2x_fusion_hub::filter::size_evidence::{LogNormal, SizeEvidence};
use v2x_fusion_hub::filter::{Filter, State};
use v2x_fusion_hub::values::Measurement;

const TRACKS: usize = 100;
const SPEED_MPS: f64 = 8.0;
const DT_S: f64 = 0.01;

/// A car that drives east.
fn report(step: u32) -> Measurement {
    Measurement {
        class: Class::Car,
        position: [SPEED_MPS * DT_S * f64::from(step), 0.1],
        r: Covariance2 { xx: 0.09, xy: 0.01, yy: 0.16 },
        size: [1.8, 4.5],
        relative_variance: [0.04; 2],
        yaw: 0.02,
        yaw_variance: 0.0025,
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity: None,
        is_track: false,
        since_last_s: f64::INFINITY,
    }
}

/// The structured constant-velocity filter, on a hundred tracks in turn as a frame brings them.
fn cv(criterion: &mut Criterion) {
    let mut tracks = vec![State::initial(Timestamp::EPOCH, &report(0)); TRACKS];
    let mut at = Timestamp::EPOCH;
    let mut group = criterion.benchmark_group("cv");
    group.throughput(Throughput::Elements(TRACKS as u64));
    group.bench_function("predict and update, 100 tracks", |bencher| {
        bencher.iter(|| {
            at += Span::from_millis(10);
            for track in &mut tracks {
                track.predict(at, Class::Car);
                track.update(black_box(&report(1)));
            }
        });
    });
    group.finish();
}

fn imm(criterion: &mut Criterion) {
    let mut track = Imm::initial(&report(0));
    for step in 1..100 {
        track.predict(DT_S, Class::Car, 4.5);
        track.update(&report(step), Inflation::NONE);
    }
    let z = report(100);
    let mut group = criterion.benchmark_group("imm");
    group.bench_function("predict and update", |bencher| {
        bencher.iter(|| {
            let mut track = black_box(track);
            track.predict(black_box(DT_S), Class::Car, 4.5);
            track.update(black_box(&z), Inflation::NONE);
            track
        });
    });
    group.bench_function("predict", |bencher| {
        bencher.iter(|| {
            let mut track = black_box(track);
            track.predict(black_box(DT_S), Class::Car, 4.5);
            track
        });
    });
    group.bench_function("predict 0.5 s", |bencher| {
        bencher.iter(|| {
            let mut track = black_box(track);
            track.predict(black_box(0.5), Class::Car, 4.5);
            track
        });
    });
    group.bench_function("moments", |bencher| bencher.iter(|| black_box(&track).moments()));
    group.bench_function("innovation", |bencher| {
        bencher.iter(|| black_box(&track).innovation(black_box(z.position), &z.r));
    });
    group.finish();
    sizes(criterion);
}

/// Twenty reports of a car's width: adding them, and the estimate.
fn sizes(criterion: &mut Criterion) {
    let mut evidence = SizeEvidence::initial(1.9, 0.5, 0.1);
    (1..20).for_each(|step| evidence.update(1.2 + 0.1 * f64::from(step), 0.5, 0.1));
    let prior = LogNormal { mean_ln: 0.6, variance_ln: 0.01 };
    criterion.bench_function("size estimate", |bencher| {
        bencher.iter(|| black_box(&evidence).estimate(Some(black_box(&prior))));
    });
}

criterion_group!(benches, cv, imm);
criterion_main!(benches);
