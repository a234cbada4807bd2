//! Overlap of two boxes: separated by their circles, separated by an axis, crossing, and one within the other.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::values::overlap::{Footprint, giou, iou};

fn overlap(criterion: &mut Criterion) {
    let car = BevBox { x: 10.0, y: 20.0, w: 1.8, d: 4.5, yaw: 0.4 };
    let cases = [
        ("far", BevBox { x: 20.0, ..car }),
        ("apart", BevBox { x: 8.9, y: 21.9, yaw: 0.5, ..car }),
        ("crossing", BevBox { x: 10.4, y: 20.3, yaw: 1.3, ..car }),
        ("aligned", BevBox { x: 10.3, y: 20.2, yaw: 0.45, ..car }),
        ("within", BevBox { w: 0.5, d: 0.7, yaw: 1.0, ..car }),
    ];
    let mut group = criterion.benchmark_group("overlap");
    for (name, other) in cases {
        let footprints = (Footprint::of(&car), Footprint::of(&other));
        group.bench_function(format!("iou of footprints/{name}"), |bencher| {
            bencher.iter(|| black_box(&footprints.0).iou(black_box(&footprints.1)));
        });
        group.bench_function(format!("iou/{name}"), |bencher| {
            bencher.iter(|| iou(black_box(&car), black_box(&other)));
        });
        group.bench_function(format!("giou/{name}"), |bencher| {
            bencher.iter(|| giou(black_box(&car), black_box(&other)));
        });
    }
    group.finish();
}

criterion_group!(benches, overlap);
criterion_main!(benches);
