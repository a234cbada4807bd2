//! What is nearly a fault and is none: for each kind of finding that has no such test beside the one that provokes it.

use super::crossing::{Frame, each, findings_of, found, noise, world};
use serde_json::json;
use std::f64::consts::TAU;
use v2x_fusion_hub::diagnosis::Code;

/// Makes frames unusual.
type Edit = fn(&mut Frame);

/// None of these codes is found, for each of these edits of what north sends.
#[track_caller]
fn assert_none(cases: &[(&str, &[Code], Edit)]) {
    for (name, codes, edit) in cases {
        let found = found(edit);
        assert!(found.iter().all(|one| !codes.contains(&one.code)), "{name}: {found:#?}");
    }
}

/// Writes detections with these fields in place of their own.
fn write(frame: &mut Frame, fields: impl Fn(usize) -> serde_json::Value) {
    let detections = frame.detections.iter().enumerate().map(|(n, one)| {
        let mut json = json!({
            "class": one.class, "x": one.x, "y": one.y, "w": one.w, "d": one.d, "yaw": one.yaw,
            "sigma": { "x": 0.3, "y": 0.3, "w": 0.1, "d": 0.2, "yaw": 0.05 },
        });
        for (key, value) in fields(n).as_object().into_iter().flatten() {
            json[key] = value.clone();
        }
        json
    });
    frame.more = json!({ "detections": detections.collect::<Vec<_>>() });
}

#[test]
fn values_at_the_end_of_their_range_and_what_is_left_out_are_not_impossible() {
    let impossible: &[Code] = &[Code::ImpossibleDetections, Code::FramesRefused, Code::Sizes];
    assert_none(&[
        ("sizes are not given", impossible, |frame| write(frame, |_| json!({ "w": null, "d": null }))),
        ("scores of 0 and 1", impossible, |frame| write(frame, |n| json!({ "score": (n % 2) as f64 }))),
        ("small and large things", impossible, |frame| {
            write(frame, |n| match n % 6 {
                0 => json!({ "class": "pedestrian", "w": 0.3, "d": 0.3 }),
                1 => json!({ "class": "bus", "w": 2.55, "d": 18.7 }),
                _ => json!({}),
            });
        }),
        ("late, and not too late", impossible, |frame| frame.delay_ms += 350),
    ]);
}

#[test]
fn names_that_other_detectors_use_are_no_unknown_classes() {
    assert_none(&[("names of data sets", &[Code::UnknownClasses], |frame| {
        const NAMES: [&str; 6] = ["Car", "car", "vehicle.car", "passenger_car", "minivan", "Truck"];
        frame.detections.iter_mut().enumerate().for_each(|(n, one)| one.class = NAMES[n % NAMES.len()]);
    })]);
}

#[test]
fn headings_of_a_whole_turn_and_a_few_boxes_that_are_the_wrong_way_round_are_right() {
    let headings: &[Code] = &[
        Code::Degrees,
        Code::HeadingsRotated,
        Code::HeadingsMirrored,
        Code::HeadingsReversed,
        Code::HeadingsUnfit,
    ];
    assert_none(&[
        ("from 0 to a whole turn", headings, |frame| each(frame, |one| one.yaw = one.yaw.rem_euclid(TAU))),
        ("one of eight is the wrong way round", &[Code::SizesSwapped], |frame| {
            let n = frame.sequence as usize;
            for one in frame.detections.iter_mut().skip(n % 8).step_by(8) {
                (one.w, one.d) = (one.d, one.w);
            }
        }),
        ("as wide as long", &[Code::SizesSwapped], |frame| {
            each(frame, |one| one.w = one.d - 0.1 * libm::sin(one.x).abs());
        }),
    ]);
}

#[test]
fn errors_that_are_stated_half_as_large_again_or_a_third_too_small_are_right_enough() {
    assert_none(&[
        ("0.45 m", &[Code::SigmaTooLarge, Code::SigmaTooSmall], |frame| {
            each(frame, |one| one.sigma_m = Some(0.45));
        }),
        ("0.2 m", &[Code::SigmaTooLarge, Code::SigmaTooSmall], |frame| {
            each(frame, |one| one.sigma_m = Some(0.2));
        }),
    ]);
}

#[test]
fn few_lost_frames_a_link_that_varies_by_tenths_and_empty_frames_are_no_fault_of_an_agent() {
    assert_none(&[
        ("3 % are lost", &[Code::Gaps], |frame| frame.is_lost = frame.sequence % 33 == 7),
        ("up to 0.15 s", &[Code::Jitter, Code::StampsJitter, Code::LinkSlow], |frame| {
            frame.delay_ms += (frame.sequence * 7_919 % 150).cast_signed();
        }),
        ("nothing is there", &[Code::Silent], |frame| frame.detections.clear()),
    ]);
}

#[test]
fn cars_beside_each_other_and_people_close_together_are_neither_twins_nor_another_unit() {
    assert_none(&[
        ("two lanes, a car's width and a half apart", &[Code::Twins, Code::LengthUnit], |frame| {
            let (seed, cars) = (frame.sequence, frame.detections.clone());
            for (n, car) in cars.into_iter().enumerate() {
                let (sin, cos) = libm::sincos(car.yaw);
                let by_m = 2.7 + 0.2 * noise(seed, n as u64, 13);
                frame.detections.push(super::crossing::Detection {
                    x: car.x - by_m * sin,
                    y: car.y + by_m * cos,
                    ..car
                });
            }
        }),
        ("a group of people", &[Code::Twins, Code::LengthUnit, Code::Geodetic], |frame| {
            let (seed, person) = (frame.sequence, frame.detections[0].clone());
            let people = (0..4_u64).map(|n| {
                let error = |which: u64| 0.1 * noise(seed, n, which);
                super::crossing::Detection {
                    class: "pedestrian",
                    x: 10.0 + 0.5 * (n % 2) as f64 + error(14),
                    y: 9.0 + 0.5 * (n / 2) as f64 + error(15),
                    w: 0.6,
                    d: 0.6,
                    ..person.clone()
                }
            });
            frame.detections = people.collect();
        }),
    ]);
}

#[test]
fn a_long_view_is_not_far_from_its_sensor_nor_far_away() {
    assert_none(&[("400 m away", &[Code::FarFromSensor, Code::FarAway], |frame| {
        frame.pose.x += 300.0;
        frame.pose.y += 250.0;
    })]);
}

#[test]
fn a_delay_of_two_tenths_of_a_second_that_all_frames_have_is_no_clock_that_is_off() {
    let clocks: &[Code] = &[Code::ClockAhead, Code::ClockBehind, Code::ClockBehindOrLinkSlow];
    assert_none(&[
        ("late by 0.2 s", clocks, |frame| frame.delay_ms += 200),
        ("stamped at arrival", clocks, |frame| frame.delay_ms = 0),
    ]);
}

#[test]
fn a_shift_by_a_hands_breadth_is_no_other_frame() {
    let places: &[Code] = &[
        Code::SensorFrame,
        Code::Axes,
        Code::SensorPose,
        Code::NothingShared,
        Code::Offset,
        Code::LengthUnit,
    ];
    assert_none(&[("0.1 m", places, |frame| {
        each(frame, |one| (one.x, one.y) = (one.x + 0.08, one.y - 0.06));
    })]);
}

#[test]
fn a_frame_that_is_delivered_twice_is_no_part_and_no_repetition() {
    let again = |k| {
        let mut frame = world(k, "north");
        frame.delay_ms += 3;
        Some(frame)
    };
    // That it is sent twice is told of its number.
    let found = findings_of("", |_| {}, again);
    let is_told = |code: Code| [Code::PartialFrames, Code::Repetition].contains(&code);
    assert!(found.iter().all(|one| !is_told(one.code)), "{found:#?}");
}
