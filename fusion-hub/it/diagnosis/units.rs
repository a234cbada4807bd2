//! Units of length, as one agent shows them where nobody else sees the same, and in what it says of its errors.

use super::crossing::{Detection, Frame, each, findings_where, found};
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// What is found in the frames of north alone.
fn alone(edit: impl Fn(&mut Frame)) -> Vec<Finding> {
    let only_north = |frame: &mut Frame| frame.is_lost = frame.agent == "south";
    let mut found = findings_where("", |_| {}, only_north, edit, |_| None);
    found.retain(|one| one.agent.is_some_and(|agent| agent.as_str() == "north"));
    found
}

#[track_caller]
fn one_of_length(found: &[Finding], words: &str) {
    let faults: Vec<_> = found.iter().filter(|one| one.is_fault()).collect();
    let [one] = faults[..] else { panic!("one fault, not {found:#?}") };
    assert!(one.code == Code::LengthUnit && one.says.contains(words), "{words}: {one}");
}

fn times(one: &mut Detection, place: f64, size: f64) {
    (one.x, one.y, one.w, one.d) = (place * one.x, place * one.y, size * one.w, size * one.d);
    one.sigma_m = one.sigma_m.map(|sigma_m| (place * sigma_m).min(60.0));
}

#[test]
fn positions_of_a_lone_agent_in_another_unit_are_named_by_the_speed_and_the_size_of_what_it_sees() {
    for (per_m, unit) in [(10.0, "decimetres"), (100.0, "centimetres"), (1000.0, "millimetres")] {
        one_of_length(&alone(|frame| each(frame, |one| times(one, per_m, per_m))), unit);
        one_of_length(&alone(|frame| each(frame, |one| times(one, per_m, 1.0))), unit);
    }
    // Metres, also of what drives on a motorway.
    for faster in [1.0, 3.5] {
        let found = alone(|frame| each(frame, |one| times(one, faster, 1.0)));
        assert!(found.iter().all(|one| one.code != Code::LengthUnit), "× {faster}: {found:#?}");
    }
}

#[test]
fn people_of_seven_metres_are_in_decimetres_and_generous_boxes_of_people_are_not() {
    let people = |size: f64| {
        alone(move |frame| {
            each(frame, |one| (one.class, one.w, one.d) = ("pedestrian", 0.7 * size, 0.7 * size));
        })
    };
    let large = people(10.0);
    assert!(large.iter().any(|one| one.code == Code::Sizes && one.says.contains("decimetres")), "{large:#?}");
    for size in [0.5, 1.0, 2.5] {
        let found = people(size);
        assert!(found.iter().all(|one| one.code != Code::Sizes), "× {size}: {found:#?}");
    }
}

#[test]
fn standard_deviations_in_centimetres_are_said_to_be_a_hundred_times_too_large_and_large_ones_keep_their_factor()
 {
    let stated = |sigma_m: f64| found(move |frame| each(frame, |one| one.sigma_m = Some(sigma_m)));
    for found in [stated(30.0), alone(|frame| each(frame, |one| one.sigma_m = Some(30.0)))] {
        let one = found.iter().find(|one| one.code == Code::SigmaTooLarge);
        let one = one.unwrap_or_else(|| panic!("{found:#?}"));
        assert!(one.says.contains("centimetres") && one.change.contains("metres: about 0."), "{one}");
    }
    let large = stated(1.5);
    let one = large.iter().find(|one| one.code == Code::SigmaTooLarge);
    let one = one.unwrap_or_else(|| panic!("{large:#?}"));
    assert!(!one.says.contains("metres are"), "{one}");
    let sound = stated(0.3);
    assert_eq!(sound, []);
}
