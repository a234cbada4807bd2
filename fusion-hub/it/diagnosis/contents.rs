//! Sizes, standard deviations, classes, impossible values, and frames that are refused.

use super::crossing::{assert_only, each, findings_of, found};
use serde_json::json;
use v2x_fusion_hub::diagnosis::Code;

#[test]
fn swapped_sizes_are_named() {
    let swapped = found(|frame| each(frame, |one| (one.w, one.d) = (one.d, one.w)));
    assert_only(&swapped, Code::SizesSwapped, "sizes = \"w-along\"");
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
fn unknown_classes_impossible_values_and_refusals_are_reported_with_their_names() {
    let ufo = found(|frame| each(frame, |one| one.class = "Fahrzeug"));
    assert_only(&ufo, Code::UnknownClasses, "classes = { \"Fahrzeug\" = \"CLASS\" }");
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
