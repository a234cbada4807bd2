//! Positions of another time than that of their stamp.

use super::crossing::{Detection, Frame, findings_where, found, noise, world};
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// What drives along a road: where it began, and its speed (m, m/s); what stands has none.
type Lane = [(f64, f64)];

/// The road at a time (s), with errors of its own.
fn on_road(frame: &mut Frame, lanes: &[&Lane], t: f64) {
    let seed = frame.sequence * 2 + u64::from(frame.agent == "north");
    let template = Detection {
        class: "car",
        x: 0.0,
        y: 0.0,
        w: 1.8,
        d: 4.5,
        yaw: 0.0,
        sigma_m: Some(0.3),
        velocity: None,
    };
    frame.detections.clear();
    for (lane, cars) in lanes.iter().enumerate() {
        for (n, (begun_m, speed_mps)) in cars.iter().enumerate() {
            let error = |which: u64| 0.3 * noise(seed, 20 * lane as u64 + n as u64, which);
            let x = begun_m + speed_mps * t;
            // A lane begins again at its end.
            let x = if *speed_mps > 0.0 { (x + 60.0).rem_euclid(120.0) - 60.0 } else { x };
            let mut car = template.clone();
            (car.x, car.y) = (x + error(0), 4.0 * lane as f64 - 8.0 + error(1));
            frame.detections.push(car);
        }
    }
}

/// What is found where north's positions are of so many seconds later than its stamps.
fn predicted_on_road(lanes: &[&Lane], by_s: f64) -> Vec<Finding> {
    let time = |frame: &Frame| 1e-3 * frame.captured_ms as f64;
    findings_where(
        "",
        |_| {},
        |frame| on_road(frame, lanes, time(frame)),
        |frame| on_road(frame, lanes, time(frame) + by_s),
        |_| None,
    )
}

fn predicted(k: i64) -> Vec<Finding> {
    found(move |frame| frame.detections = world(frame.sequence.cast_signed() - 1 + k, "north").detections)
}

/// Speeds and what stands.
const FAST: &Lane = &[(0.0, 12.0), (35.0, 12.0), (80.0, 12.0)];
const SLOW: &Lane = &[(10.0, 7.0), (47.0, 7.0), (95.0, 7.0)];
const PARKED: &Lane = &[(-40.0, 0.0), (-26.0, 0.0), (3.0, 0.0), (12.0, 0.0), (40.0, 0.0)];

const NONE: &Lane = &[];

/// The only fault: a time, and no shift; it is said of one of both whose are ahead by so many ms, of two whoever that is.
#[track_caller]
fn assert_time(findings: &[Finding], by_s: f64, name: &str) {
    let faults: Vec<_> = findings.iter().filter(|one| one.is_fault()).collect();
    let [one] = faults[..] else { panic!("{name} {by_s}: {findings:#?}") };
    let said = one.says.strip_prefix("the objects of south lie ").unwrap_or_else(|| panic!("{one}"));
    let said_ms: f64 =
        said.split(' ').next().and_then(|ms| ms.parse().ok()).unwrap_or_else(|| panic!("{one}"));
    assert!((said_ms - 1e3 * by_s.abs()).abs() < 60.0, "{name} {by_s}: {one}");
    let side = if by_s > 0.0 {
        "of their motion behind those of north"
    } else {
        "of their motion ahead of those of north"
    };
    assert!(
        one.code == Code::Offset && said.contains(side) && !said.contains("m east"),
        "{name} {by_s}: {one}"
    );
    assert!(one.change.contains("predicted to a later time than `captured_at`"), "{one}");
    assert!(
        one.change.contains("north") && one.change.contains("south"),
        "of two nobody knows which one: {one}"
    );
}

#[test]
fn positions_of_another_time_than_their_stamp_are_told_as_a_time_and_not_as_a_shift_of_place() {
    for k in [3, 5, 8, -3, -5] {
        assert_time(&predicted(k), 0.1 * k as f64, "a crossing");
    }
    for by_s in [0.5, -0.5, 0.3] {
        assert_time(&predicted_on_road(&[FAST, SLOW], by_s), by_s, "one way at two speeds");
        assert_time(
            &predicted_on_road(&[FAST, SLOW, PARKED], by_s),
            by_s,
            "one way at two speeds, and parked cars",
        );
        assert_time(
            &predicted_on_road(&[FAST, NONE, PARKED], by_s),
            by_s,
            "one way at one speed, and parked cars",
        );
    }
}

#[test]
fn where_all_drives_one_way_at_one_speed_a_shift_and_a_time_are_both_said() {
    for by_s in [0.5, -0.5, 0.3] {
        let findings = predicted_on_road(&[FAST, FAST], by_s);
        let offsets: Vec<_> = findings.iter().filter(|one| one.code == Code::Offset).collect();
        let [one] = offsets[..] else { panic!("{by_s}: {findings:#?}") };
        for words in [
            "m east",
            "of their motion",
            "a shift of place and a time are the same",
            "predicted to a later time",
            "surveyed",
        ] {
            assert!(one.to_string().contains(words), "{by_s}, {words:?}: {one}");
        }
    }
}

#[test]
fn shifts_of_place_of_what_drives_two_ways_or_stands_are_no_times() {
    let shifted = |lanes: &'static [&'static Lane], by_m: [f64; 2]| {
        let time = |frame: &Frame| 1e-3 * frame.captured_ms as f64;
        let moved = move |frame: &mut Frame| {
            on_road(frame, lanes, time(frame));
            frame.detections.iter_mut().for_each(|one| (one.x, one.y) = (one.x + by_m[0], one.y + by_m[1]));
        };
        findings_where("", |_| {}, |frame| on_road(frame, lanes, time(frame)), moved, |_| None)
    };
    for (lanes, by_m) in [(&[FAST, SLOW, PARKED][..], [4.0, 0.0]), (&[FAST, SLOW][..], [0.0, 2.0])] {
        let findings = shifted(lanes, by_m);
        let offsets: Vec<_> = findings.iter().filter(|one| one.code == Code::Offset).collect();
        let [one] = offsets[..] else { panic!("{by_m:?}: {findings:#?}") };
        assert!(
            one.is_fault() && one.says.contains("m east") && !one.says.contains("of their motion"),
            "{by_m:?}: {one}"
        );
    }
    // Nothing between them: whatever moves and stands.
    for lanes in [&[FAST, SLOW, PARKED][..], &[FAST, FAST], &[FAST, PARKED]] {
        let findings = predicted_on_road(lanes, 0.0);
        assert!(findings.iter().all(|one| one.code != Code::Offset), "{findings:#?}");
    }
}
