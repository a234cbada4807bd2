//! Sizes, standard deviations, classes, impossible values, and frames that are refused.

use super::crossing::{Frame, assert_only, each, findings_of, findings_where, found, noise};
use serde_json::json;
use v2x_fusion_hub::diagnosis::{Code, Finding};

#[test]
fn swapped_sizes_are_named() {
    let swapped = found(|frame| each(frame, |one| (one.w, one.d) = (one.d, one.w)));
    assert_only(&swapped, Code::SizesSwapped, "sizes = \"w-along\"");
}

#[test]
fn sizes_that_differ_from_those_of_another_agent_by_a_factor_are_told_and_those_of_near_sides_are_not() {
    let times = |factor: f64| {
        found(move |frame| each(frame, |one| (one.w, one.d) = (factor * one.w, factor * one.d)))
    };
    for factor in [1.35, 0.7] {
        let found = times(factor);
        let [one] = &found[..] else { panic!("{found:#?}") };
        // With two agents it is unknown which one is wrong.
        assert!(one.is_fault() && one.code == Code::Sizes && one.agent.is_none(), "{one}");
        assert!(one.says.contains("of south are") && one.says.contains("by north"), "{one}");
    }
    for factor in [0.9, 1.0, 1.12] {
        assert_eq!(times(factor), []);
    }
}

#[test]
fn assumed_standard_deviations_that_are_too_large_are_a_note_and_too_small_ones_a_fault() {
    let assumed = |sigma_m: f64| {
        let settings = format!("[report_defaults]\nsigma_position_m = {sigma_m}");
        findings_of(&settings, |frame| each(frame, |one| one.sigma_m = None), |_| None)
    };
    let large = assumed(3.0);
    assert!(large.iter().all(|one| !one.is_fault()), "{large:#?}");
    assert!(large.iter().any(|one| one.code == Code::SigmaTooLarge), "{large:#?}");
    assert_only(&assumed(0.04), Code::SigmaTooSmall, "the assumed standard deviations");
}

#[test]
fn frames_that_cannot_be_read_are_not_also_missing_by_their_numbers() {
    let found = found(|frame| {
        if frame.sequence % 4 != 0 {
            frame.more = json!({ "speed": 8.0 });
        }
    });
    assert_only(&found, Code::FramesRefused, "unknown field `speed`");
    assert!(found.iter().all(|one| one.code != Code::Gaps), "{found:#?}");
}

#[test]
fn missing_and_false_standard_deviations_are_reported() {
    let missing = found(|frame| each(frame, |one| one.sigma_m = None));
    assert!(missing.iter().any(|one| one.code == Code::SigmaMissing && !one.is_fault()), "{missing:#?}");
    let set = "[agents.north]\nsigma_position_m = 0.35";
    let set = findings_of(set, |frame| each(frame, |one| one.sigma_m = None), |_| None);
    assert!(set.iter().all(|one| one.code != Code::SigmaMissing), "the settings say it: {set:#?}");
    let small = found(|frame| each(frame, |one| one.sigma_m = Some(0.05)));
    assert_only(&small, Code::SigmaTooSmall, "too small, by a factor of");
    let large = found(|frame| each(frame, |one| one.sigma_m = Some(3.0)));
    assert_only(&large, Code::SigmaTooLarge, "too large, by a factor of");
}

#[test]
fn an_agent_whose_frames_are_all_empty_is_a_note_and_one_that_sees_something_at_times_is_none() {
    let empty = found(|frame| frame.detections.clear());
    let notes: Vec<_> = empty.iter().filter(|one| one.code == Code::SeesNothing).collect();
    let [note] = notes[..] else { panic!("{empty:#?}") };
    assert!(!note.is_fault() && note.to_string().starts_with("north: none of its "), "{note}");
    let at_times = found(|frame| {
        if frame.sequence % 40 != 0 {
            frame.detections.clear();
        }
    });
    assert!(at_times.iter().all(|one| one.code != Code::SeesNothing), "{at_times:#?}");
}

#[test]
fn a_pose_that_wanders_is_named_with_its_size() {
    let parked = |frame: &mut Frame| {
        let seed = frame.sequence * 2 + u64::from(frame.agent == "north");
        for (n, one) in frame.detections.iter_mut().enumerate() {
            let row = n as f64;
            (one.x, one.y, one.yaw) = (
                7.0 * row - 35.0 + 0.2 * noise(seed, n as u64, 0),
                9.0 - 18.0 * (row % 2.0) + 0.2 * noise(seed, n as u64, 1),
                0.0,
            );
        }
    };
    let wanders = |by_m: f64| {
        let edit = move |frame: &mut Frame| {
            let t = 1e-3 * frame.captured_ms as f64;
            // Slowly, as a bad localization does.
            let off = [by_m * libm::sin(0.6 * t), by_m * libm::cos(0.5 * t)];
            each(frame, |one| (one.x, one.y) = (one.x + off[0], one.y + off[1]));
        };
        findings_where("", |_| {}, parked, edit, |_| None)
    };
    let findings = wanders(1.4);
    let one = findings.iter().find(|one| one.code == Code::PoseWanders);
    let one = one.unwrap_or_else(|| panic!("{findings:#?}"));
    assert!(one.is_fault() && one.agent.is_some_and(|agent| agent.as_str() == "north"), "{one}");
    let sound = wanders(0.0);
    assert!(sound.iter().all(|one| one.code != Code::PoseWanders), "{sound:#?}");
}

#[test]
fn unknown_classes_impossible_values_and_refusals_are_reported_with_their_names() {
    let ufo = found(|frame| each(frame, |one| one.class = "Fahrzeug"));
    assert_only(&ufo, Code::UnknownClasses, "classes = { \"Fahrzeug\" = \"CLASS\" }");
    let labels = found(|frame| {
        frame
            .detections
            .iter_mut()
            .enumerate()
            .for_each(|(n, one)| one.class = ["car 0.71", "car 0.83", "car 0.95"][n % 3]);
    });
    assert_only(&labels, Code::UnknownClasses, "the class alone");
    let corners = found(|frame| each(frame, |one| (one.w, one.d) = (-one.w, -one.d)));
    assert_only(&corners, Code::ImpossibleDetections, "are of corners");
    let impossible = found(|frame| frame.detections[0].w = -1.0);
    assert_only(&impossible, Code::ImpossibleDetections, "w out of range");
    assert!(!impossible[0].change.contains("Longitudes"), "a width is no place: {}", impossible[0]);
    let refused = found(|frame| frame.more = json!({ "theta": 1 }));
    assert_only(&refused, Code::FramesRefused, "theta");
    let late = found(|frame| frame.delay_ms += 5000);
    assert!(
        late.iter().any(|one| one.code == Code::FramesRefused && one.says.contains("too_late")),
        "{late:#?}"
    );
}

/// What is found of north alone, which sees one car as the shipped client does: without errors, sizes and headings.
fn of_one_car(place: impl Fn(f64) -> [f64; 2]) -> Vec<Finding> {
    let only_north = |frame: &mut Frame| frame.is_lost = frame.agent == "south";
    let one_car = move |frame: &mut Frame| {
        let [x, y] = place(1e-3 * frame.captured_ms as f64);
        frame.more = json!({ "sequence": null, "sensor_pose": null, "detections": [{ "class": "car", "x": x, "y": y }] });
    };
    findings_where("", |_| {}, only_north, one_car, |_| None)
}

#[test]
fn what_drives_at_one_metre_a_second_is_not_said_to_stand_and_what_stands_is_no_fault() {
    for speed_mps in [0.7, 1.0, 1.4, 3.0] {
        let found = of_one_car(|t| [10.0 + speed_mps * t, 5.0]);
        assert!(found.iter().all(|one| !one.to_string().contains("stands")), "{speed_mps} m/s: {found:#?}");
    }
    let scattered = |t: f64| [10.0 + 0.05 * libm::sin(70.0 * t * t), 5.0 + 0.05 * libm::cos(90.0 * t * t)];
    let found = of_one_car(scattered);
    // How far off its places are, nobody can say: nothing is wrong with what it states.
    assert!(found.iter().all(|one| !one.is_fault() || one.code == Code::Silent), "{found:#?}");
}

#[test]
fn each_vehicle_reported_twice_is_a_note() {
    let twice = found(|frame| {
        let again = frame.detections.iter().map(|one| {
            let mut one = one.clone();
            (one.x, one.y) = (one.x + 0.4, one.y + 0.3);
            one
        });
        let again: Vec<_> = again.collect();
        frame.detections.extend(again);
    });
    let note = twice.iter().find(|one| one.code == Code::Twins);
    assert!(note.is_some_and(|one| !one.is_fault() && one.says.contains("within another one")), "{twice:#?}");
}

#[test]
fn sizes_that_no_vehicles_have_are_named_and_those_of_small_and_large_ones_are_not() {
    let times =
        |w: f64, d: f64| found(move |frame| each(frame, |one| (one.w, one.d) = (w * one.w, d * one.d)));
    for ((w, d), words) in [
        ((0.5, 0.5), "halves of boxes"),
        ((2.0, 2.0), "twice as large"),
        ((10.0, 10.0), "decimetres"),
        ((1.0 / 0.3048, 1.0 / 0.3048), "feet"),
        ((0.55, 0.22), "too small"),
    ] {
        assert_only(&times(w, d), Code::Sizes, words);
    }
    // Microcars, visible parts of cars, lorries that are called cars, and margins.
    for (w, d) in [(0.8, 0.6), (0.6, 1.0), (1.0, 0.5), (1.35, 1.8), (1.2, 1.2), (0.85, 0.85)] {
        let found = times(w, d);
        assert!(found.iter().all(|one| one.code != Code::Sizes), "{w} × {d}: {found:#?}");
    }
    // One quadricycle that is parked there all day, among others or alone.
    let one = |only: usize| {
        found(move |frame| {
            frame.detections.truncate(only);
            (frame.detections[0].w, frame.detections[0].d) = (0.9, 2.2);
        })
    };
    for only in [1, usize::MAX] {
        let found = one(only);
        assert!(found.iter().all(|one| one.code != Code::Sizes), "{only}: {found:#?}");
    }
}
