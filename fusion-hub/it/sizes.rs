//! Sizes of agents that say little of their errors.

use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::hub::{Core, HubSettings};

const START_MS: i64 = 1_790_000_000_000;

/// Width and depth that a hub publishes of a car after three seconds; `size` writes that part of each report.
fn published(settings: &str, size: impl Fn(i64) -> String) -> (f64, f64) {
    let table = settings.parse().expect("a table");
    let mut core = Core::new(HubSettings::from_table(table).expect("settings"), Engine::new);
    let cam = AgentId::new("cam").expect("a name");
    let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(START_MS + ms);
    for k in 0..30 {
        let stamp = (START_MS + 100 * k) * 1000;
        let car = format!(r#"{{"class": "car", "x": {}, "y": 3, "yaw": 0{}}}"#, k, size(k));
        let json = format!(r#"{{"captured_at": {stamp}, "detections": [{car}]}}"#);
        core.handle_frame(cam, at(100 * k + 20), &Body::Json(json.as_bytes()));
    }
    let [car] = &core.fused(at(2_930)).objects[..] else { panic!("one car") };
    (car.bev.w, car.bev.d)
}

#[track_caller]
fn assert_size((w, d): (f64, f64), expected: (f64, f64), within: f64) {
    assert!((w / expected.0 - 1.0).abs() < within && (d / expected.1 - 1.0).abs() < within, "{w} x {d}");
}

#[test]
fn exact_sizes_whose_errors_nobody_states_are_published_as_they_are() {
    let exact = |_| r#", "w": 1.8, "d": 4.5"#.to_owned();
    assert_size(published("", exact), (1.8, 4.5), 2e-3);
    assert_size(published("method = \"ours-no-size-prior\"", exact), (1.8, 4.5), 1e-3);
    let long = |_| r#", "w": 2.0, "d": 5.2"#.to_owned();
    assert_size(published("method = \"ours-no-size-prior\"", long), (2.0, 5.2), 1e-3);
}

#[test]
fn an_object_without_sizes_has_the_typical_one_of_its_class() {
    assert_size(published("", |_| String::new()), (1.8, 4.5), 2e-3);
}

#[test]
fn sizes_that_scatter_as_a_stated_sigma_in_metres_are_published_nearly_without_bias() {
    // 20 % off to both sides, with errors of about that size stated in metres.
    let noisy = |k: i64| {
        let factor = 1.0 + if k % 2 == 0 { 0.2 } else { -0.2 };
        let (w, d) = (1.8 * factor, 4.5 * factor);
        format!(r#", "w": {w}, "d": {d}, "sigma": {{"w": 0.3, "d": 0.9}}"#)
    };
    assert_size(published("method = \"ours-no-size-prior\"", noisy), (1.8, 4.5), 0.09);
}

#[test]
fn sizes_that_scatter_less_than_is_assumed_are_not_shrunk() {
    // Up to 5 % off, and 20 % are assumed.
    let noisy = |k: i64| {
        let factor = 1.0 + 0.05 * [1.0, -1.0, 0.4, -0.4][usize::try_from(k % 4).unwrap()];
        format!(r#", "w": {}, "d": {}"#, 1.8 * factor, 4.5 * factor)
    };
    assert_size(published("", noisy), (1.8, 4.5), 5e-3);
    // The same where the assumption is twice as large.
    let assumed = "[report_defaults]\nsigma_size_relative = 0.4";
    assert_size(published(assumed, noisy), (1.8, 4.5), 5e-3);
}
