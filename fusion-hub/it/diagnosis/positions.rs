//! Positions in another frame, or that disagree with those of another agent.

use super::crossing::{Frame, assert_only, each, findings_of, found};
use serde_json::json;
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_fusion_hub::diagnosis::{Code, Finding};

#[test]
fn degrees_of_longitude_and_latitude_are_named() {
    let geodetic = found(|frame| {
        each(frame, |one| (one.x, one.y) = (11.575 + one.x / 74_400.0, 48.137 + one.y / 111_200.0));
    });
    assert_only(&geodetic, Code::Geodetic, "frame = \"wgs84\"");
}

#[test]
fn exchanged_longitudes_and_latitudes_are_named_with_the_line_that_reads_them() {
    let degrees = |frame: &mut Frame| {
        each(frame, |one| (one.x, one.y) = (11.575 + one.x / 74_400.0, 48.137 + one.y / 111_200.0));
    };
    let settings = |frame: &str, latitude: f64, longitude: f64| {
        format!(
            "[agents.north]\nframe = \"{frame}\"\norigin = {{ latitude_deg = {latitude}, longitude_deg = {longitude} }}"
        )
    };
    let no_pose = |frame: &mut Frame| frame.more = json!({ "sensor_pose": null });
    let right = |frame: &mut Frame| {
        degrees(frame);
        no_pose(frame);
    };
    let exchanged = |frame: &mut Frame| {
        right(frame);
        each(frame, |one| (one.x, one.y) = (one.y, one.x));
    };
    let with_pose = |frame: &mut Frame| {
        exchanged(frame);
        frame.more = json!({ "sensor_pose": { "x": 48.1372, "y": 11.5752, "yaw": -1.8 } });
    };
    let found = |settings: &str, edit: &dyn Fn(&mut Frame)| findings_of(settings, edit, |_| None);
    assert_eq!(found(&settings("wgs84", 48.137, 11.575), &right), []);
    assert_eq!(found(&settings("wgs84-lat-lon", 48.137, 11.575), &exchanged), []);
    // What is dropped leaves nothing that could differ: no detector hangs.
    let dropped = found(&settings("wgs84", 48.137, 11.575), &exchanged);
    assert!(dropped.iter().all(|one| one.code != Code::Repetition), "{dropped:#?}");
    let words = "frame = \"wgs84-lat-lon\"` under `[hub.agents.north]";
    assert_only(&found(&settings("wgs84", 48.137, 11.575), &exchanged), Code::Geodetic, words);
    // The origin is the one that is exchanged.
    assert_only(
        &found(&settings("wgs84", 11.575, 48.137), &right),
        Code::Geodetic,
        "exchange `latitude_deg`",
    );
    assert_only(
        &found(&settings("wgs84-lat-lon", 48.137, 11.575), &right),
        Code::Geodetic,
        "frame = \"wgs84\"",
    );
    assert_only(&found(&settings("wgs84", 48.137, 11.575), &with_pose), Code::FramesRefused, "are exchanged");
    let metres = found(&settings("wgs84", 48.137, 11.575), &no_pose);
    assert_only(&metres, Code::Geodetic, "are these degrees?");
}

#[test]
fn positions_from_the_sensor_mirrored_and_swapped_ones_are_named() {
    let relative = |frame: &mut Frame, sign: f64| {
        let pose = frame.pose;
        each(frame, |one| {
            let bearing = pose.bearing_to(one.x, one.y);
            let range = pose.distance_to(one.x, one.y);
            (one.x, one.y) = (range * libm::cos(bearing), sign * range * libm::sin(bearing));
            one.yaw = wrap_angle(one.yaw - pose.yaw);
        });
    };
    let has = |findings: Vec<Finding>, code: Code, words: &str| {
        let is_it =
            |one: &Finding| one.code == code && one.agent.is_some_and(|agent| agent.as_str() == "north");
        assert!(findings.iter().any(|one| is_it(one) && one.to_string().contains(words)), "{findings:#?}");
    };
    has(found(|frame| relative(frame, 1.0)), Code::SensorFrame, "frame = \"ego\"");
    has(found(|frame| relative(frame, -1.0)), Code::SensorFrame, "y to the right");
    has(
        found(|frame| each(frame, |one| (one.x, one.y) = (one.y, one.x))),
        Code::Axes,
        "x is north and y is east",
    );
    has(found(|frame| each(frame, |one| one.y = -one.y)), Code::Axes, "y points south");
}

#[test]
fn positions_in_a_sensors_frame_without_a_pose_are_a_note_that_this_cannot_be_determined() {
    let relative = |only: usize| {
        found(move |frame| {
            let pose = frame.pose;
            each(frame, |one| {
                let (sin, cos) = libm::sincos(pose.yaw);
                let (x, y) = (one.x - pose.x, one.y - pose.y);
                (one.x, one.y, one.yaw) =
                    (x * cos + y * sin, y * cos - x * sin, wrap_angle(one.yaw - pose.yaw));
            });
            frame.detections.truncate(only);
            frame.more = json!({ "sensor_pose": null });
        })
    };
    // Of all objects, and of one alone.
    for only in [usize::MAX, 1] {
        let findings = relative(only);
        let note = findings.iter().find(|one| one.code == Code::SensorFrame);
        let note = note.unwrap_or_else(|| panic!("{only}: {findings:#?}"));
        assert!(!note.is_fault() && note.says.contains("north gives no `sensor_pose`"), "{note}");
        assert!(
            note.change.contains("`frame = \"sensor\"`") && note.change.contains("[hub.agents.north]"),
            "{note}"
        );
    }
    // Who sees the same gives none either, and is right.
    let right = found(|frame| frame.more = json!({ "sensor_pose": null }));
    assert_eq!(right, []);
}

#[test]
fn a_shift_and_a_turn_between_agents_are_reported_in_metres_and_degrees() {
    let shifted = found(|frame| each(frame, |one| (one.x, one.y) = (one.x + 2.0, one.y - 3.0)));
    let offset: Vec<_> = shifted.iter().filter(|one| one.code == Code::Offset).collect();
    let [one] = offset[..] else { panic!("{shifted:#?}") };
    // With two agents it is unknown which one is wrong.
    assert_eq!(one.agent, None);
    assert!(
        one.says.contains("objects of south lie -2.0") || one.says.contains("objects of south lie -1.9"),
        "{one}"
    );
    let turned = found(|frame| {
        let pose = frame.pose;
        let (sin, cos) = libm::sincos(0.12);
        each(frame, |one| {
            let (x, y) = (one.x - pose.x, one.y - pose.y);
            (one.x, one.y) = (pose.x + x * cos - y * sin, pose.y + x * sin + y * cos);
            one.yaw = wrap_angle(one.yaw + 0.12);
        });
    });
    assert!(
        turned.iter().any(|one| one.code == Code::Offset && one.says.contains("turned by")),
        "{turned:#?}"
    );
}

/// The places in a frame that was mapped by another pose than that of the sensor.
#[test]
fn positions_from_the_sensors_place_along_the_maps_axes_are_named() {
    let found = found(|frame| {
        let Pose { x, y, .. } = frame.pose;
        each(frame, |one| (one.x, one.y) = (one.x - x, one.y - y));
    });
    assert_only(&found, Code::SensorFrame, "relative to the place of its sensor, along the axes of the map");
}

#[test]
fn a_pose_in_degrees_is_named_and_one_of_a_whole_turn_is_not() {
    let with_yaw = |write: fn(f64) -> f64| {
        found(move |frame| {
            let Pose { x, y, yaw } = frame.pose;
            frame.more = json!({ "sensor_pose": { "x": x, "y": y, "yaw": write(yaw) } });
        })
    };
    assert_only(&with_yaw(f64::to_degrees), Code::SensorPose, "it is in degrees");
    assert_eq!(with_yaw(|yaw| yaw.rem_euclid(std::f64::consts::TAU)), []);
}

fn mapped_by(frame: &mut Frame, wrong: Pose) {
    let right = frame.pose;
    each(frame, |one| {
        let (bearing, range) = (right.bearing_to(one.x, one.y), right.distance_to(one.x, one.y));
        (one.x, one.y) = wrong.offset(range * libm::cos(bearing), range * libm::sin(bearing));
        one.yaw = wrap_angle(one.yaw + wrong.yaw - right.yaw);
    });
    frame.pose = wrong;
}

#[test]
fn a_pose_of_the_wrong_sign_order_or_direction_is_named() {
    use std::f64::consts::{FRAC_PI_2, PI};
    type Wrong = fn(Pose) -> Pose;
    let cases: [(&str, Wrong); 7] = [
        ("x and y are the wrong way round", |Pose { x, y, yaw }| Pose { x: y, y: x, yaw }),
        ("x and y have the wrong sign", |Pose { x, y, yaw }| Pose { x: -x, y: -y, yaw }),
        ("x has the wrong sign", |Pose { x, y, yaw }| Pose { x: -x, y, yaw }),
        ("y has the wrong sign", |Pose { x, y, yaw }| Pose { x, y: -y, yaw }),
        ("yaw has the wrong sign", |Pose { x, y, yaw }| Pose { x, y, yaw: -yaw }),
        ("yaw counts from north", |Pose { x, y, yaw }| Pose { x, y, yaw: yaw - FRAC_PI_2 }),
        ("yaw points backwards", |Pose { x, y, yaw }| Pose { x, y, yaw: yaw + PI }),
    ];
    for (words, wrong) in cases {
        let findings = found(|frame| mapped_by(frame, wrong(frame.pose)));
        assert_only(&findings, Code::SensorPose, words);
    }
    let compass = found(|frame| {
        let Pose { x, y, yaw } = frame.pose;
        mapped_by(frame, Pose { x, y, yaw: FRAC_PI_2 - yaw });
    });
    assert_only(&compass, Code::SensorPose, "as a compass");
}

#[test]
fn positions_in_another_unit_of_length_are_named() {
    for (unit, per_m) in [("centimetres", 1e2), ("millimetres", 1e3), ("feet", 1.0 / 0.3048)] {
        let of_map = found(|frame| {
            each(frame, |one| (one.x, one.y) = (per_m * one.x, per_m * one.y));
        });
        assert_only(&of_map, Code::LengthUnit, unit);
        let about_sensor = found(|frame| {
            let pose = frame.pose;
            each(frame, |one| {
                (one.x, one.y) = (pose.x + per_m * (one.x - pose.x), pose.y + per_m * (one.y - pose.y));
            });
        });
        assert_only(&about_sensor, Code::LengthUnit, unit);
    }
    let all = found(|frame| {
        each(frame, |one| {
            [one.x, one.y, one.w, one.d] = [one.x, one.y, one.w, one.d].map(|value| 100.0 * value);
        });
    });
    assert_only(&all, Code::LengthUnit, "centimetres");
}

#[test]
fn agents_of_one_area_that_see_nothing_together_are_a_note_and_those_of_two_areas_are_none() {
    // A turn about the crossing that no known mistake explains.
    let turned = found(|frame| {
        let Pose { x, y, yaw } = frame.pose;
        let (sin, cos) = libm::sincos(0.8);
        mapped_by(frame, Pose { x: x * cos - y * sin, y: x * sin + y * cos, yaw: yaw + 0.8 });
    });
    let notes: Vec<_> = turned.iter().filter(|one| one.code == Code::NothingShared).collect();
    let [note] = notes[..] else { panic!("{turned:#?}") };
    assert!(!note.is_fault() && note.says.contains("north") && note.says.contains("south"), "{note}");
    let next = found(|frame| {
        let pose = frame.pose;
        mapped_by(frame, Pose { x: pose.x + 120.0, ..pose });
    });
    assert_eq!(next, []);
}

#[test]
fn positions_far_from_all_others_are_reported() {
    let utm = found(|frame| {
        each(frame, |one| (one.x, one.y) = (one.x + 691_000.0, one.y + 5_334_000.0));
        frame.pose = Pose { x: frame.pose.x + 691_000.0, y: frame.pose.y + 5_334_000.0, ..frame.pose };
    });
    assert_only(&utm, Code::FarAway, "UTM");
}

#[test]
fn pixels_are_further_from_the_sensor_than_any_sees() {
    let pixels = |one: &mut _| {
        let super::crossing::Detection { x, y, .. } = one;
        (*x, *y) = (960.0 + 24.0 * *x, 540.0 - 24.0 * *y);
    };
    assert_only(&found(|frame| each(frame, pixels)), Code::FarFromSensor, "not pixels or another unit");
}

#[test]
fn kilometres_and_a_height_as_y_are_named() {
    let kilometres = found(|frame| each(frame, |one| (one.x, one.y) = (1e-3 * one.x, 1e-3 * one.y)));
    assert_only(&kilometres, Code::LengthUnit, "several vehicles within a metre");
    let height = found(|frame| each(frame, |one| one.y = 0.8 + 0.01 * one.yaw));
    let note = height.iter().find(|one| one.code == Code::Axes);
    assert!(
        note.is_some_and(|one| !one.is_fault() && one.says.starts_with("all its positions have y")),
        "{height:#?}"
    );
}

/// North's positions, so many times as far from its sensor or from the map's origin.
fn scaled(times: f64, is_about_sensor: bool) -> Vec<Finding> {
    found(move |frame| {
        let centre = if is_about_sensor { frame.pose } else { Pose { x: 0.0, y: 0.0, yaw: 0.0 } };
        each(frame, |one| {
            (one.x, one.y) = (centre.x + times * (one.x - centre.x), centre.y + times * (one.y - centre.y));
        });
    })
}

#[test]
fn positions_that_are_a_little_too_far_apart_are_named_with_the_factor_and_yards_by_name() {
    for is_about_sensor in [true, false] {
        let yards = scaled(1.0 / 0.9144, is_about_sensor);
        assert_only(&yards, Code::LengthUnit, "in yards");
        for (times, words) in [(1.07, "1.07 times as far apart"), (0.93, "times as far apart")] {
            let found = scaled(times, is_about_sensor);
            let [one] = &found[..] else { panic!("{times}: {found:#?}") };
            // Of two nobody knows which one is wrong.
            assert_eq!((one.code, one.agent), (Code::LengthUnit, None), "{one}");
            assert!(
                one.is_fault() && (one.says.contains(words) || one.says.contains("south are 0.93")),
                "{times}: {one}"
            );
        }
        for times in [1.01, 0.99, 1.02] {
            let found = scaled(times, is_about_sensor);
            assert!(found.iter().all(|one| one.code != Code::LengthUnit), "{times}: {found:#?}");
        }
    }
}

#[test]
fn objects_that_are_reported_where_the_sensor_sees_them_first_and_shifts_are_no_unit() {
    let found_of = |edit: &dyn Fn(&mut Frame)| {
        let found = found(edit);
        assert!(found.iter().all(|one| one.code != Code::LengthUnit), "{found:#?}");
        found
    };
    // 0.8 m nearer than the middle.
    found_of(&|frame| {
        let pose = frame.pose;
        each(frame, |one| {
            let range_m = pose.distance_to(one.x, one.y);
            let part = (range_m - 0.8) / range_m;
            (one.x, one.y) = (pose.x + part * (one.x - pose.x), pose.y + part * (one.y - pose.y));
        });
    });
    found_of(&|frame| each(frame, |one| (one.x, one.y) = (one.x + 1.5, one.y - 1.0)));
    found_of(&|frame| frame.captured_ms -= 200);
    // The middles of their fronts, and of their backs.
    for part in [0.5, -0.5] {
        let found = found_of(&move |frame| {
            each(frame, |one| {
                (one.x, one.y) =
                    (one.x + part * one.d * libm::cos(one.yaw), one.y + part * one.d * libm::sin(one.yaw));
            });
        });
        assert!(found.iter().any(|one| one.change.contains("front or rear")), "{part}: {found:#?}");
    }
    // Few objects, near each other.
    found_of(&|frame| {
        frame.detections.retain(|one| libm::hypot(one.x - 10.0, one.y) < 9.0);
        each(frame, |one| one.x = 10.0 + 1.06 * (one.x - 10.0));
    });
}

#[test]
fn a_pose_that_is_kilometres_from_what_the_agent_sees_is_named() {
    for (x, y) in [(2_000.0, 0.0), (0.0, -700.0), (4.4e6, 5.3e6)] {
        let found = found(|frame| (frame.pose.x, frame.pose.y) = (frame.pose.x + x, frame.pose.y + y));
        assert_only(&found, Code::FarFromSensor, "`sensor_pose`");
    }
}
