//! Clocks that are off, slow links, and stamps in another unit.

use super::crossing::{
    DURATION_MS, Frame, START_MS, assert_only, each, findings_of, found, noise, run, world,
};
use serde_json::json;
use v2x_fusion_hub::Engine;
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::{Core, HubSettings};

#[test]
fn a_clock_that_is_behind_is_distinguished_from_a_slow_link() {
    let behind = found(|frame| {
        frame.captured_ms -= 300;
        frame.delay_ms += 300;
    });
    assert_only(&behind, Code::ClockBehind, "time_offset_ms = ");
    let words = behind[0].to_string();
    let by_ms: f64 = words
        .split("time_offset_ms = ")
        .nth(1)
        .and_then(|rest| rest.split('`').next())
        .unwrap()
        .parse()
        .unwrap();
    assert!((by_ms - 300.0).abs() < 30.0, "{words}");
    let slow = found(|frame| frame.delay_ms += 300);
    assert!(slow.iter().all(|one| !one.is_fault()), "{slow:#?}");
    assert!(slow.iter().any(|one| one.code == Code::LinkSlow), "{slow:#?}");
    let ahead = found(|frame| {
        frame.captured_ms += 150;
        frame.delay_ms -= 150;
    });
    assert_only(&ahead, Code::ClockAhead, "time_offset_ms = -1");
}

#[test]
fn advice_on_a_clock_counts_the_offset_that_is_set_already_and_converges() {
    for (set_ms, least, most) in [(100, 270.0, 330.0), (-50, 270.0, 330.0), (450, 270.0, 390.0)] {
        let settings = format!("[agents.north]\ntime_offset_ms = {set_ms}");
        let edit = |frame: &mut Frame| {
            if frame.agent == "north" {
                frame.captured_ms -= 300;
                frame.delay_ms += 300;
            }
        };
        let found = findings_of(&settings, edit, |_| None);
        let words = found.iter().find(|one| one.is_fault()).map(ToString::to_string).unwrap_or_default();
        let advised = words.split("time_offset_ms = ").nth(1).and_then(|rest| rest.split('`').next());
        let advised_ms: f64 = advised.and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
        assert!((least..=most).contains(&advised_ms), "{set_ms}: {words}");
        assert!(words.contains(&format!("in place of {set_ms}")), "{words}");
    }
    let right = findings_of(
        "[agents.north]\ntime_offset_ms = 300",
        |frame| {
            if frame.agent == "north" {
                frame.captured_ms -= 300;
                frame.delay_ms += 300;
            }
        },
        |_| None,
    );
    assert!(right.iter().all(|one| !one.is_fault()), "{right:#?}");
}

/// By more than Δmax: every frame is refused, or too late over a link that varies.
#[test]
fn a_clock_that_is_off_by_more_than_half_a_second_is_a_fault_of_the_agent_whatever_its_link_does() {
    let by = |offset_ms: i64, jitter_ms: i64| {
        found(move |frame| {
            let late = if jitter_ms > 0 { frame.captured_ms / 100 * 37 % jitter_ms } else { 0 };
            frame.captured_ms += offset_ms;
            frame.delay_ms += late - offset_ms;
        })
    };
    for jitter_ms in [0, 90, 400] {
        for offset_ms in [600, 2_000, 3_600_000, -600, -2_000, -3_600_000] {
            let found = by(offset_ms, jitter_ms);
            let codes: &[Code] = match offset_ms > 0 {
                true => &[Code::ClockAhead],
                false => &[Code::ClockBehind, Code::ClockBehindOrLinkSlow],
            };
            let is_reported = |one: &Finding| {
                one.is_fault()
                    && codes.contains(&one.code)
                    && one.agent.is_some_and(|agent| agent.as_str() == "north")
            };
            assert!(found.iter().any(is_reported), "{offset_ms} ms, jitter {jitter_ms} ms: {found:#?}");
        }
    }
}

#[test]
fn one_stamp_for_all_frames_is_one_finding_and_not_two_about_clocks_and_processes() {
    for numbered in [false, true] {
        let findings = found(|frame| {
            let sequence = numbered.then_some(frame.sequence);
            frame.more = json!({ "captured_at": START_MS * 1000, "sequence": sequence, "epoch": null });
        });
        assert_only(&findings, Code::OneStamp, "`captured_at` is the same in all its frames");
        assert_eq!(findings.len(), 1, "{findings:#?}");
    }
}

#[test]
fn stamps_that_count_from_1980_are_named_and_those_of_another_day_are_a_clock() {
    let behind = |by_s: i64| {
        found(move |frame| {
            frame.more = json!({ "captured_at": (START_MS + frame.captured_ms - 1000 * by_s) * 1000 });
        })
    };
    assert_only(&behind(315_964_800 - 18), Code::TimeUnit, "counts from 1980, as GPS does");
    let of_last_week = behind(7 * 86_400);
    assert!(of_last_week.iter().all(|one| one.code != Code::TimeUnit), "{of_last_week:#?}");
}

#[test]
fn stamps_of_another_unit_are_named() {
    let seconds =
        found(|frame| frame.more = json!({ "captured_at": (START_MS + frame.captured_ms) as f64 * 1e-3 }));
    assert_only(&seconds, Code::TimeUnit, "time.time_ns() // 1000");
    let millis = found(|frame| frame.more = json!({ "captured_at": START_MS + frame.captured_ms }));
    assert_only(
        &millis,
        Code::TimeUnit,
        "`captured_at` is in milliseconds, and JSON wants whole microseconds since 1970",
    );
    assert_only(&millis, Code::TimeUnit, "time.time_ns() // 1000");
    // What only follows from it is not said beside it.
    assert_eq!(millis.len(), 1, "{millis:#?}");
    assert!(!millis[0].to_string().contains("nanoseconds"), "{}", millis[0]);
}

/// Stamps that are off by so much in the mean, and scatter by so much, ms, over a link that varies up to so much.
fn scattered(mean_ms: f64, sigma_ms: f64, link_ms: i64) -> Vec<Finding> {
    found(move |frame| {
        let off_ms = (mean_ms + sigma_ms * noise(frame.sequence, 0, 11)) as i64;
        let late_ms =
            if link_ms > 0 { (frame.sequence * 7_919 % 1_000).cast_signed() * link_ms / 1_000 } else { 0 };
        (frame.captured_ms, frame.delay_ms) = (frame.captured_ms + off_ms, frame.delay_ms + late_ms - off_ms);
    })
}

#[test]
fn stamps_that_scatter_are_told_to_jitter_with_what_to_do_and_no_offset_that_would_not_mend_them() {
    for (mean_ms, sigma_ms, link_ms) in [
        (0.0, 80.0, 0),
        (0.0, 40.0, 0),
        (0.0, 25.0, 0),
        (30.0, 15.0, 0),
        (60.0, 60.0, 0),
        (150.0, 80.0, 0),
        (0.0, 60.0, 40),
    ] {
        let findings = scattered(mean_ms, sigma_ms, link_ms);
        assert_only(&findings, Code::StampsJitter, "its stamps jitter by ");
        let one = findings.iter().find(|one| one.is_fault()).unwrap();
        let said_ms: f64 =
            one.says["its stamps jitter by ".len()..].split(' ').next().unwrap().parse().unwrap();
        assert!((said_ms - sigma_ms).abs() < 0.2 * sigma_ms + 3.0, "{sigma_ms}: {one}");
        assert!(one.change.contains("Stamp each frame") && !one.change.contains("time_offset_ms ="), "{one}");
        assert_eq!(one.says.contains("In the mean they are ahead"), mean_ms >= 30.0, "{one}");
    }
}

#[test]
fn a_clock_that_is_ahead_over_an_irregular_link_is_told_its_offset_and_no_jitter_of_stamps() {
    for link_ms in [0, 60, 200] {
        let findings = scattered(150.0, 0.0, link_ms);
        assert_only(&findings, Code::ClockAhead, "time_offset_ms = -1");
    }
    // Far ahead, with a little jitter beside it.
    let findings = scattered(400.0, 12.0, 0);
    assert_only(&findings, Code::ClockAhead, "time_offset_ms = -4");
    // Late stamps, and a link that is irregular: nothing is ahead.
    for (sigma_ms, link_ms) in [(3.0, 0), (0.0, 90)] {
        let findings = scattered(0.0, sigma_ms, link_ms);
        assert!(findings.iter().all(|one| !one.is_fault()), "{findings:#?}");
    }
}

#[test]
fn predictions_stamped_with_the_time_that_they_are_of_are_no_clock_that_is_ahead() {
    let findings = found(|frame| {
        let k = frame.sequence.cast_signed() - 1;
        let later = world(k + 2, "north");
        (frame.captured_ms, frame.delay_ms) = (later.captured_ms, frame.delay_ms - 200);
        frame.detections = later.detections;
    });
    let one = findings.iter().find(|one| one.code == Code::ClockAhead);
    let one = one.unwrap_or_else(|| panic!("{findings:#?}"));
    assert!(!one.is_fault() && one.says.contains("it sends predictions"), "{one}");
}

/// Nobody else is there by whom it could be told later which of both it is.
#[test]
fn a_clock_behind_of_a_lone_agent_is_told_in_the_same_check_as_its_other_faults() {
    let alone = |edit: &dyn Fn(&mut Frame)| {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let frames = (0..DURATION_MS / 100).map(|k| {
            let mut frame = world(k, "north");
            edit(&mut frame);
            frame
        });
        let findings = run(&mut core, frames.collect(), &Tokens::default(), |_| {});
        let faults = findings.iter().filter(|one| one.is_fault());
        faults.map(|one| one.code).collect::<Vec<_>>()
    };
    let late = |frame: &mut Frame| {
        frame.captured_ms -= 300;
        frame.delay_ms = 300;
    };
    type Spoil = fn(&mut Frame);
    let faults: [(Code, Spoil); 3] = [
        (Code::Degrees, |frame| each(frame, |one| one.yaw = one.yaw.to_degrees())),
        (Code::SizesSwapped, |frame| each(frame, |one| std::mem::swap(&mut one.w, &mut one.d))),
        (Code::Geodetic, |frame| {
            each(frame, |one| (one.x, one.y) = (11.575 + one.x / 74_400.0, 48.137 + one.y / 111_200.0));
        }),
    ];
    for (code, fault) in faults {
        let both = alone(&|frame| {
            fault(frame);
            late(frame);
        });
        assert!(both.contains(&code) && both.contains(&Code::ClockBehindOrLinkSlow), "{code:?}: {both:?}");
        let found = alone(&fault);
        assert!(!found.contains(&Code::ClockBehindOrLinkSlow), "{code:?}: {found:?}");
    }
}
