//! Odd frames that are no fault, settings on purpose, and faults that another fault hid.

use crate::diagnosis::crossing::{Detection, Frame, each, findings_of, found, noise, run, world};
use serde_json::json;
use std::f64::consts::FRAC_PI_2;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::{Core, HubSettings};

fn of_code(findings: &[Finding], code: Code) -> Option<&Finding> {
    findings.iter().find(|one| one.code == code)
}

#[track_caller]
fn has_no_fault(findings: &[Finding]) {
    assert!(findings.iter().all(|one| !one.is_fault()), "{findings:#?}");
}

#[test]
fn one_odd_detection_of_a_thousand_is_a_note() {
    let impossible = found(|frame| {
        if frame.sequence == 180 {
            frame.detections[0].w = -1.0;
        }
    });
    has_no_fault(&impossible);
    let unknown = found(|frame| {
        if frame.sequence == 180 {
            frame.detections[0].class = "Fahrzeug";
        }
    });
    has_no_fault(&unknown);
    let one = of_code(&unknown, Code::UnknownClasses).expect("a note");
    assert!(one.says.starts_with("1 of "), "{one}");
}

#[test]
fn counts_are_of_the_last_ten_seconds_and_the_most_frequent_class_is_the_one_to_map() {
    let findings = found(|frame| {
        let (is_early, n) = (frame.captured_ms < 8_000, frame.sequence);
        let names = move |k: usize| match k {
            _ if is_early => "Anfang",
            0 if n % 10 == 0 => "Anhaenger",
            _ => "Zug",
        };
        frame.detections.iter_mut().enumerate().for_each(|(k, one)| one.class = names(k));
    });
    let one = of_code(&findings, Code::UnknownClasses).expect("unknown classes");
    assert!(
        one.is_fault() && one.change.contains("{ \"Zug\" = \"CLASS\", \"Anhaenger\" = \"CLASS\" }"),
        "{one}"
    );
    assert!(!one.says.contains("Anfang") && one.says.contains("\"Anhaenger\""), "{one}");
    let number = |words: &str| words.split(' ').next().and_then(|word| word.parse::<u64>().ok());
    let parts = one.says.split_once('(').map(|(_, list)| list.split(['"', ' ', ',', ')']));
    let sum: u64 = parts.into_iter().flatten().filter_map(|word| word.parse::<u64>().ok()).sum();
    assert_eq!(number(&one.says), Some(sum), "{one}");
    let impossible = found(|frame| {
        if frame.captured_ms < 8_000 { frame.detections[0].d = -1.0 } else { frame.detections[0].w = -1.0 }
    });
    let one = of_code(&impossible, Code::ImpossibleDetections).expect("impossible ones");
    assert!(one.is_fault() && one.says.contains("w out of range") && !one.says.contains("d out of"), "{one}");
}

#[test]
fn an_agent_that_is_left_out_on_purpose_is_a_note() {
    let findings = findings_of("only_agents = [\"south\"]", |_| {}, |_| None);
    has_no_fault(&findings);
    let one = of_code(&findings, Code::FramesRefused).expect("a note");
    assert!(one.says.contains("left out") && one.change.contains("only_agents"), "{one}");
}

/// One car, or several, in place of all that `north` sees.
fn only(cars: &'static dyn Fn(&Frame) -> Vec<(f64, f64)>) -> impl Fn(&mut Frame) {
    move |frame: &mut Frame| {
        let car = |(x, y): (f64, f64)| Detection {
            class: "car",
            x,
            y,
            w: 1.8,
            d: 4.5,
            yaw: 0.0,
            sigma_m: Some(0.3),
            velocity: None,
        };
        frame.detections = cars(frame).into_iter().map(car).collect();
    }
}

#[test]
fn what_is_parked_near_the_origin_is_no_longitude_and_latitude() {
    fn mm(frame: &Frame, which: u64) -> f64 {
        1e-3 * noise(frame.sequence, 1, which)
    }
    let parked = found(only(&|frame| vec![(12.0 + mm(frame, 0), 5.0 + mm(frame, 1))]));
    assert_eq!(of_code(&parked, Code::Geodetic), None, "one car");
    let settling = found(only(&|frame| {
        let error = 0.004 * libm::exp(-(frame.captured_ms.rem_euclid(10_000) as f64) / 3_000.0);
        vec![(12.0 + error, 5.0 - error)]
    }));
    assert_eq!(of_code(&settling, Code::Geodetic), None, "an estimate that settles");
    let twice =
        found(only(&|frame| vec![(12.0 + mm(frame, 0), 5.0), (12.0 + mm(frame, 2), 5.0 + mm(frame, 3))]));
    assert_eq!(of_code(&twice, Code::Geodetic), None, "one car with two boxes");
}

#[test]
fn one_car_that_moves_in_degrees_is_reported() {
    let moving = found(only(&|frame| {
        let along = 9.0 * (frame.captured_ms as f64) * 1e-3 + 0.3 * noise(frame.sequence, 1, 0);
        vec![(11.575 + along / 74_400.0, 48.137 + 0.3 * noise(frame.sequence, 1, 1) / 111_200.0)]
    }));
    assert!(of_code(&moving, Code::Geodetic).is_some_and(Finding::is_fault), "{moving:#?}");
}

#[test]
fn degrees_that_are_not_wrapped_are_degrees() {
    let degrees = |turns: fn(u64) -> f64| {
        found(move |frame| {
            let more = 360.0 * turns(frame.sequence);
            each(frame, |one| one.yaw = one.yaw.to_degrees().rem_euclid(360.0) + more);
        })
    };
    for (turns, words) in [
        ((|n| f64::from(u8::from(n % 20 == 0))) as fn(u64) -> f64, "one in twenty beyond a turn"),
        (|n| (n % 3) as f64, "two turns"),
        (|_| 2.0, "all of them"),
    ] {
        let findings = degrees(turns);
        let one = of_code(&findings, Code::Degrees);
        let one = one.unwrap_or_else(|| panic!("{words}: {findings:#?}"));
        assert!(one.change.contains("yaw = { unit = \"deg\" }"), "{words}: {one}");
    }
    // What is neither is not called degrees.
    let milli = found(|frame| each(frame, |one| one.yaw = 1000.0 * one.yaw.rem_euclid(4.0 * FRAC_PI_2)));
    assert_eq!(of_code(&milli, Code::Degrees), None, "{milli:#?}");
}

#[test]
fn swapped_sizes_are_reported_behind_an_unknown_class() {
    let findings = found(|frame| {
        each(frame, |one| (one.class, one.w, one.d) = ("Fahrzeug", one.d, one.w));
    });
    for code in [Code::UnknownClasses, Code::SizesSwapped] {
        assert!(of_code(&findings, code).is_some_and(Finding::is_fault), "{code:?}: {findings:#?}");
    }
}

#[test]
fn standard_deviations_are_judged_after_some_seconds_and_with_a_number() {
    let large = |frame: &mut Frame| each(frame, |one| one.sigma_m = Some(3.0));
    let until = |ms: i64| {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let frames = (0..ms / 100).flat_map(|k| {
            let mut north = world(k, "north");
            large(&mut north);
            [world(k, "south"), north]
        });
        let mut frames: Vec<_> = frames.collect();
        frames.sort_by_key(|frame| frame.captured_ms + frame.delay_ms);
        run(&mut core, frames, &Tokens::default(), |_| {})
    };
    for ms in [2_500, 4_500] {
        assert_eq!(of_code(&until(ms), Code::SigmaTooLarge), None, "after {ms} ms");
    }
    let findings = until(24_000);
    let one = of_code(&findings, Code::SigmaTooLarge).expect("too large");
    assert!(
        one.change.contains("times as large ones: 0.") && one.change.contains("instead of 3.00 m"),
        "{one}"
    );
    let assumed = findings_of(
        "[report_defaults]\nsigma_position_m = 3",
        |frame| {
            frame.more = json!({});
            each(frame, |one| one.sigma_m = None);
        },
        |_| None,
    );
    let one = of_code(&assumed, Code::SigmaTooLarge).expect("too large");
    assert!(one.change.contains("sigma_position_m = 0."), "{one}");
}
