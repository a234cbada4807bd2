//! Headings in other units, of another origin or sense.

use super::crossing::{Frame, assert_only, each, findings_of, found};
use std::f64::consts::FRAC_PI_2;
use v2x_common::geometry::wrap_angle;
use v2x_fusion_hub::diagnosis::Code;

#[test]
fn headings_in_degrees_are_named_with_the_line_that_says_so() {
    let degrees = |frame: &mut Frame| each(frame, |one| one.yaw = one.yaw.to_degrees().rem_euclid(360.0));
    assert_only(&found(degrees), Code::Degrees, "`yaw = { unit = \"deg\" }` under `[hub.agents.north]`");
    let declared = findings_of("[agents.north]\nyaw = { unit = \"deg\" }", degrees, |_| None);
    assert_eq!(declared, [], "a hub whose settings declare it finds nothing");
}

#[test]
fn headings_and_a_pose_in_degrees_are_one_finding_as_one_line_reads_both() {
    let found = found(|frame| {
        frame.pose.yaw = frame.pose.yaw.to_degrees();
        each(frame, |one| one.yaw = one.yaw.to_degrees());
    });
    assert_only(&found, Code::Degrees, "unit = \"deg\"");
}

#[test]
fn a_compass_and_other_origins_of_headings_are_named_with_the_line_that_says_so() {
    let compass = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(FRAC_PI_2 - one.yaw));
    assert_only(&found(compass), Code::HeadingsMirrored, "yaw = { from = \"north\", turn = \"cw\" }");
    let north = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(one.yaw - FRAC_PI_2));
    assert_only(&found(north), Code::HeadingsRotated, "yaw = { from = \"north\" }");
    let back = |frame: &mut Frame| each(frame, |one| one.yaw = wrap_angle(one.yaw + 2.0 * FRAC_PI_2));
    assert_only(&found(back), Code::HeadingsReversed, "180°");
}

#[test]
fn compass_headings_in_degrees_are_named_with_all_that_has_to_change_at_once() {
    let conventions = [
        ("turn = \"cw\"", (0.0, -1.0)),
        ("from = \"north\"", (FRAC_PI_2, 1.0)),
        ("from = \"north\", turn = \"cw\"", (FRAC_PI_2, -1.0)),
    ];
    for (words, (north, turn)) in conventions {
        // direction = turn · written + north
        let write = |frame: &mut Frame| {
            each(frame, |one| one.yaw = (turn * (one.yaw - north)).to_degrees().rem_euclid(360.0));
        };
        let setting = format!("yaw = {{ unit = \"deg\", {words} }}");
        assert_only(&found(write), Code::Degrees, &format!("`{setting}` under `[hub.agents.north]`"));
        let declared = findings_of(&format!("[agents.north]\n{setting}"), write, |_| None);
        assert_eq!(declared, []);
    }
}

#[test]
fn compass_headings_in_degrees_and_swapped_sizes_are_both_named_and_nothing_else_is_blamed_on_a_crossing_and_on_one_road()
 {
    let compass = |frame: &mut Frame| {
        each(frame, |one| {
            one.yaw = (FRAC_PI_2 - one.yaw).to_degrees().rem_euclid(360.0);
            (one.w, one.d) = (one.d, one.w);
        });
    };
    let is_on_road = |yaw: f64| libm::sin(yaw).abs() < 0.5;
    let one_road = |frame: &mut Frame| frame.detections.retain(|one| is_on_road(one.yaw));
    let constant_delay = |frame: &mut Frame| frame.delay_ms = 300;
    type Edit<'a> = &'a dyn Fn(&mut Frame);
    let cases: [(&str, Edit<'_>); 3] = [
        ("a crossing", &|_| {}),
        ("one road", &one_road),
        ("one road, and a slow link", &|frame| {
            one_road(frame);
            constant_delay(frame);
        }),
    ];
    for (name, scene) in cases {
        let found = findings_of(
            "",
            |frame| {
                scene(frame);
                compass(frame);
            },
            |_| None,
        );
        let faults: Vec<_> = found.iter().filter(|one| one.is_fault()).collect();
        let codes: Vec<_> = faults.iter().map(|one| one.code).collect();
        assert_eq!(codes, [Code::Degrees, Code::SizesSwapped], "{name}: {found:#?}");
        let line = "yaw = { unit = \"deg\", from = \"north\", turn = \"cw\" }` under `[hub.agents.north]";
        assert!(faults[0].change.contains(line), "{name}: {}", faults[0]);
        assert!(faults[1].change.contains("sizes = \"w-along\""), "{name}: {}", faults[1]);
    }
}

#[test]
fn on_a_roundabout_the_lag_of_what_turns_is_no_turn_of_the_headings_and_a_compass_is_still_found() {
    let on_a_roundabout = |write: fn(f64) -> f64| {
        findings_of(
            "",
            move |frame| {
                let t = 1e-3 * frame.captured_ms as f64;
                for (n, one) in frame.detections.iter_mut().enumerate() {
                    let radius_m = 13.0 + 4.0 * (n % 3) as f64;
                    let angle = std::f64::consts::TAU * n as f64 / 12.0 + 7.0 / radius_m * t;
                    (one.x, one.y) = (radius_m * libm::cos(angle), radius_m * libm::sin(angle));
                    one.yaw = wrap_angle(write(angle + FRAC_PI_2));
                }
            },
            |_| None,
        )
    };
    let of_headings = |findings: Vec<v2x_fusion_hub::diagnosis::Finding>| {
        let codes = findings.into_iter().map(|one| one.code);
        let headings = [Code::HeadingsMirrored, Code::HeadingsRotated, Code::HeadingsReversed];
        codes.filter(|code| headings.contains(code)).collect::<Vec<_>>()
    };
    assert_eq!(of_headings(on_a_roundabout(|yaw| yaw)), []);
    assert_eq!(of_headings(on_a_roundabout(|yaw| FRAC_PI_2 - yaw)), [Code::HeadingsMirrored]);
    assert_eq!(of_headings(on_a_roundabout(|yaw| yaw - FRAC_PI_2)), [Code::HeadingsRotated]);
}

#[test]
fn headings_in_tenths_and_hundredths_of_a_degree_are_no_angles() {
    for (parts, words) in [(10.0, "tenths of a degree"), (100.0, "hundredths of a degree")] {
        let findings =
            found(|frame| each(frame, |one| one.yaw = parts * one.yaw.to_degrees().rem_euclid(360.0)));
        assert_only(&findings, Code::Degrees, words);
        let settings = "[agents.north]\nyaw = { unit = \"deg\" }";
        let findings = findings_of(
            settings,
            |frame| each(frame, |one| one.yaw = parts * one.yaw.to_degrees().rem_euclid(360.0)),
            |_| None,
        );
        assert_only(&findings, Code::Degrees, words);
    }
}

#[test]
fn headings_that_are_always_the_same_and_those_of_axes_are_named_and_right_ones_of_a_road_are_not() {
    let always = |yaw: f64| found(move |frame| each(frame, |one| one.yaw = yaw));
    for yaw in [0.0, -1.0, FRAC_PI_2] {
        assert_only(&always(yaw), Code::HeadingsUnfit, "always about");
    }
    let folded = |from: f64| {
        found(move |frame| each(frame, |one| one.yaw = from + (one.yaw - from).rem_euclid(2.0 * FRAC_PI_2)))
    };
    // Noise about a boundary throws headings from one end to the other, as it does with real boxes.
    for from in [0.0, -FRAC_PI_2, 0.4] {
        assert_only(&folded(from), Code::HeadingsUnfit, "\"heading\": \"axis\"");
    }
    let declared = found(|frame| {
        frame.heading = Some("axis");
        each(frame, |one| one.yaw = one.yaw.rem_euclid(2.0 * FRAC_PI_2));
    });
    assert_eq!(declared, [], "axes that are called axes");
    // Headings are right where all that is seen goes one way, also always the same ones; and where one in ten is turned round.
    let one_way = found(|frame| {
        frame.detections.retain(|one| one.yaw.abs() < 0.5);
        each(frame, |one| one.yaw = 0.0);
    });
    assert_eq!(one_way, []);
    let some_back = found(|frame| {
        let n = frame.sequence;
        for (k, one) in (0..).zip(&mut frame.detections) {
            one.yaw += if (n + 3 * k) % 10 == 0 { 2.0 * FRAC_PI_2 } else { 0.0 };
        }
    });
    assert!(some_back.iter().all(|one| one.code != Code::HeadingsUnfit), "{some_back:#?}");
    // Of one car that passes it is too little.
    let sparse = found(|frame| {
        frame.detections.truncate(1);
        each(frame, |one| one.yaw = 0.0);
    });
    assert!(sparse.iter().all(|one| one.code != Code::HeadingsUnfit), "{sparse:#?}");
}

#[test]
fn headings_that_go_with_nothing_are_a_note() {
    let bearing = found(|frame| {
        let pose = frame.pose;
        each(frame, |one| one.yaw = libm::atan2(one.y - pose.y, one.x - pose.x));
    });
    let turns = found(|frame| each(frame, |one| one.yaw = (one.yaw / (4.0 * FRAC_PI_2)).rem_euclid(1.0)));
    for found in [bearing, turns] {
        let note =
            found.iter().find(|one| one.code == Code::HeadingsUnfit || one.code == Code::HeadingsRotated);
        assert!(
            note.is_some_and(|one| one.agent.is_some_and(|agent| agent.as_str() == "north")),
            "{found:#?}"
        );
    }
}

#[test]
fn radians_that_the_settings_call_degrees_are_named() {
    let settings = |yaw: &str| format!("[agents.north]\nyaw = {{ {yaw} }}");
    let radians = |yaw: &str, write: fn(f64) -> f64| {
        findings_of(&settings(yaw), |frame| each(frame, |one| one.yaw = wrap_angle(write(one.yaw))), |_| None)
    };
    let plain = radians("unit = \"deg\"", |yaw| yaw);
    assert_only(&plain, Code::Degrees, "Remove `yaw` under `[hub.agents.north]`");
    let compass = radians("unit = \"deg\", from = \"north\", turn = \"cw\"", |yaw| FRAC_PI_2 - yaw);
    assert_only(&compass, Code::Degrees, "yaw = { from = \"north\", turn = \"cw\" }");
    // Degrees of what all goes nearly east.
    let east = findings_of(
        &settings("unit = \"deg\""),
        |frame| {
            frame.detections.retain(|one| one.yaw.abs() < 0.1);
            each(frame, |one| one.yaw = one.yaw.to_degrees());
        },
        |_| None,
    );
    assert_eq!(east, []);
}
