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
