//! Overlap against shapely.

use v2x_common::geometry::BevBox;
use v2x_fusion_hub::values::overlap::{giou, iou};

#[derive(serde::Deserialize)]
struct Case {
    a: [f64; 5],
    b: [f64; 5],
    iou: f64,
    giou: f64,
}

#[test]
fn overlap_equals_shapelys() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("overlap.json")).unwrap();
    assert!(cases.len() >= 200);
    let bev = |[x, y, w, d, yaw]: [f64; 5]| BevBox { x, y, w, d, yaw };
    for case in &cases {
        let (a, b) = (bev(case.a), bev(case.b));
        for (ours, theirs) in [
            (iou(&a, &b), case.iou),
            (iou(&b, &a), case.iou),
            (giou(&a, &b), case.giou),
            (giou(&b, &a), case.giou),
        ] {
            assert!((ours - theirs).abs() < 1e-9, "{ours}, expected {theirs}: {a:?} {b:?}");
        }
    }
}
