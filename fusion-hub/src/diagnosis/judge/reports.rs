//! What the engine refuses, drops and learns of one agent.

use super::super::finding::{Code, Finding};
use super::super::window::Counts;
use super::one::{MIN_VALUES, One};
use super::remedy::remedy;
use super::{units, writing};
use crate::engine::{Label, Refusal, StampFault};
use crate::learning::LearntSensorReport;
use v2x_common::time::Span;

/// Refusals of one reason are reported from this number and this share of the frames on.
const MIN_REFUSED: u64 = 3;
const REFUSED_SHARE: f64 = 0.02;
/// Refusals that are reported as two processes of one name.
const REPORTED_ELSEWHERE: [&str; 2] = ["duplicate", "held_off"];
/// What only follows from a stamp that never changes.
const OF_ONE_STAMP: [&str; 4] = ["wrong_time_unit", "too_late", "too_early", "out_of_sequence"];
/// Of an agent that the settings leave out.
const LEFT_OUT: &str = "not_listened_to";
/// Detections that are odd are a fault from so many on, and from such a share on; fewer are worth a note.
const MIN_ODD: u64 = 3;
const ODD_SHARE: f64 = 0.02;
/// The cause of a value that is a number.
const OUT_OF_RANGE: &str = "out of range";
/// Innovations that were gathered in less say little: at first tracks are not known well.
const INNOVATIONS_FOR: Span = Span::from_millis(8_000);
/// Factors on stated standard deviations are reported outside this range.
const FACTOR: (f64, f64) = (0.5, 2.0);
/// The same of normalised innovations squared for each degree of freedom, where nothing is learnt.
const NIS: (f64, f64) = (0.25, 4.0);
/// Positions with such standard deviations say nothing of where something is on a road, m.
const USELESS_M: f64 = 12.0;
/// What positions scatter by is so many times further off than what is learnt.
const FURTHER: f64 = 2.5;
/// The range of `sigma_position_m` in the settings.
const SIGMA_SETTABLE_M: (f64, f64) = (1e-3, 70.0);
/// A pose that wanders by so much makes what is fused worse, m.
const GRAVE_POSE_M: f64 = 0.5;
/// Empty frames that are worth a note.
const MIN_EMPTY: u64 = 30;
/// Innovations that say anything.
const MIN_INNOVATIONS: u64 = 100;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let mut findings = refused(one);
    findings.extend(left_out(one));
    // Where positions should be degrees and are none, that says it better.
    if writing::off_origin(one).is_none() {
        findings.extend(dropped(one));
    }
    findings.extend(unknown_classes(one));
    findings.extend(description(one));
    findings.extend(stated_errors(one));
    findings.extend(wandering_pose(one));
    findings.extend(nothing_seen(one));
    findings
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn refused(one: &One<'_>) -> Vec<Finding> {
    let survey = one.survey;
    let refused: u64 = survey.refused.values().map(|(count, _)| count).sum();
    // What is refused before it is decoded is no observation.
    let heard = survey.arrivals.frames;
    let frames = heard.max(refused);
    // Of times from another epoch nothing more is to be said.
    let stands = survey.arrivals.is_one_stamp() || survey.arrivals.counts_from_1980();
    let is_reported = |reason: &str, count: u64| {
        count >= MIN_REFUSED
            && count as f64 >= REFUSED_SHARE * frames as f64
            && !REPORTED_ELSEWHERE.contains(&reason)
            && reason != LEFT_OUT
            && !(stands && OF_ONE_STAMP.contains(&reason))
    };
    let reported = survey.refused.iter().filter(|(reason, (count, _))| is_reported(reason, *count));
    reported.map(|(reason, (count, last))| {
        let code = match *reason {
            "wrong_time_unit" => Code::TimeUnit,
            "queue_full" => Code::Overload,
            _ => Code::FramesRefused,
        };
        let says = match code {
            Code::Overload => format!(
                "{count} of its frames were dropped for lack of time ({reason}): they wait longer than the hub takes, and {heard} \
                 were read"
            ),
            _ => format!("{count} of {frames} frames are refused ({reason}); the newest: {last}"),
        };
        let (says, change) = time_unit(one, last, (*count, frames)).unwrap_or_else(|| (says, remedy(reason, last)));
        one.fault(code, says, change)
    })
    .collect()
}

/// The unit of stamps that are read by the wrong one, by the format that they are in.
fn time_unit(one: &One<'_>, refusal: &Refusal, (count, frames): (u64, u64)) -> Option<(String, String)> {
    let Refusal::WrongTimeUnit { cause, .. } = refusal else { return None };
    let is_json = one.survey.writing.is_json;
    let unit = match (cause, is_json) {
        (StampFault::Thousandth, true) | (StampFault::Millionth, false) => "milliseconds",
        (StampFault::Thousandth, false) => "microseconds",
        (StampFault::Millionth, true) | (StampFault::Billionth, false) => "seconds",
        (StampFault::Billionth, true) | (StampFault::OtherEpoch, _) => return None,
    };
    let (format, wanted, how) = match is_json {
        true => ("JSON", "whole microseconds", "time.time_ns() // 1000"),
        false => ("the compact format", "nanoseconds", "time.time_ns()"),
    };
    let says = format!(
        "its `captured_at` is in {unit}, and {format} wants {wanted} since 1970: {count} of {frames} frames are refused \
         (wrong_time_unit)"
    );
    Some((says, format!("Send {wanted} since 1970 (Python: `{how}`)")))
}

/// An agent that is there, and that the hub's settings leave out on purpose.
fn left_out(one: &One<'_>) -> Option<Finding> {
    let (count, _) = one.survey.refused.get(LEFT_OUT)?;
    let says = format!("{count} frames of it are left out ({LEFT_OUT}), as the hub's settings say");
    let change = "If it is to take part, name it in `only_agents` of the hub's configuration";
    Some(one.note(Code::FramesRefused, says, change))
}

/// What the engine has counted of it in this window.
fn since(one: &One<'_>) -> Option<Counts> {
    let record = one.around.engine.agents().record(&one.agent)?;
    // A window is judged some seconds after its end, when its pairs are compared: the engine counts on meanwhile.
    let after = one.survey.after.clone().unwrap_or_else(|| Counts::of(record));
    Some(after.since(&one.survey.before))
}

/// The most frequent ones first.
fn sorted<T: Ord>(counts: impl Iterator<Item = (T, u64)>) -> Vec<(T, u64)> {
    let mut counts: Vec<_> = counts.collect();
    counts.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    counts
}

/// Detections of one kind that are odd: a single one of many makes no network worse.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn odd(one: &One<'_>, code: Code, count: u64, (says, change): (String, String)) -> Finding {
    let all = one.survey.writing.detections;
    let is_grave = count >= MIN_ODD && count as f64 >= ODD_SHARE * all as f64;
    if is_grave { one.fault(code, says, change) } else { one.note(code, says, change) }
}

/// So many of all detections. Of an agent that was away for a while more is counted than this window has seen.
fn some_of(count: u64, all: u64) -> String {
    if count <= all { format!("{count} of {all} detections") } else { format!("{count} detections") }
}

/// What to do about impossible values, by field and cause. Whoever writes other units or axes has places that are too far away.
fn advice(dropped: &[((Label, Label), u64)]) -> &'static str {
    if dropped.iter().all(|((_, cause), _)| *cause != OUT_OF_RANGE) && !dropped.is_empty() {
        return "What is not known is left out, or null: NaN and infinity are no numbers";
    }
    let has = |fields: &[&str]| {
        let is_out = |(field, cause): &(Label, Label)| fields.contains(&&**field) && *cause == OUT_OF_RANGE;
        dropped.iter().any(|(cause, _)| is_out(cause))
    };
    if has(&["x", "y"]) {
        return "Longitudes, pixels or projected coordinates instead of metres in the map frame give such values";
    }
    if has(&["w", "d"]) {
        return "`w` and `d` are the whole width and length in metres: negative ones, or such as coordinates, are of corners (x1, y1, x2, y2), large ones of another unit \
                or of an image; where they are not known, leave both out";
    }
    if has(&["variance of x", "variance of y", "variance of w", "variance of d"]) {
        return "`sigma` has standard deviations in metres, larger than zero: centimetres, squares of them or zeros give such values; where \
                none is known, leave it out";
    }
    if has(&["score"]) {
        return "`score` is from 0 to 1: divide per cent by 100; a logit is none";
    }
    "Correct the fields that are named"
}

fn dropped(one: &One<'_>) -> Option<Finding> {
    let record = one.around.engine.agents().record(&one.agent)?;
    let dropped = sorted(since(one)?.dropped.into_iter());
    let count: u64 = dropped.iter().map(|(_, count)| count).sum();
    (count > 0).then(|| {
        let causes: Vec<_> =
            dropped.iter().map(|((field, cause), count)| format!("{field} {cause}: {count}")).collect();
        let last = record.statistics.dropped.last.as_ref();
        let last = last.map(|last| format!("; the newest: {last}")).unwrap_or_default();
        let says = format!(
            "{} have impossible values and are dropped ({}){last}",
            some_of(count, one.survey.writing.detections),
            causes.join(", ")
        );
        odd(
            one,
            Code::ImpossibleDetections,
            count,
            (says, format!("The rest of their frames is used. {}", advice(&dropped))),
        )
    })
}

fn unknown_classes(one: &One<'_>) -> Option<Finding> {
    let unmapped = since(one)?.unmapped;
    let count = unmapped.total();
    (count > 0).then(|| {
        let says = format!(
            "{} are of classes that are not known ({})",
            some_of(count, one.survey.writing.detections),
            unmapped.in_words()
        );
        let (setting, which) = unmapped.setting();
        let change = if unmapped.have_scores() {
            format!(
                "They are fused as `unknown`. {} the class alone, such as \"car\", and the number beside it as the score, from 0 to 1",
                one.words("Send as `class`", "Write in the column class")
            )
        } else {
            format!("They are fused as `unknown`. Write {}, with {which}", one.setting(&setting))
        };
        odd(one, Code::UnknownClasses, count, (says, change))
    })
}

fn description(one: &One<'_>) -> Option<Finding> {
    let count = since(one)?.descriptions_refused;
    let record = one.around.engine.agents().record(&one.agent)?;
    (count > 0).then(|| {
        let last = record.statistics.last_refused_description.as_ref();
        let last = last.map(ToString::to_string).unwrap_or_default();
        let says = format!("its sensor description is refused ({count} times): {last}");
        let change = "Without it nothing is known of its field of view. The format is in \
                      `common/schemas/sensor-description.schema.json`";
        one.fault(Code::DescriptionRefused, says, change)
    })
}

/// An agent that says nothing of its pose, and with whose pose all that stands moves.
fn wandering_pose(one: &One<'_>) -> Option<Finding> {
    let by_m = one.around.engine.learnt(&one.agent)?.pose_sigma_m;
    (by_m > 0.0).then(|| {
        let says = format!(
            "its pose wanders by {} m (standard deviation): what stands moves in its reports, all at once",
            number(by_m)
        );
        let change = one.words(
            "The hub has learnt it, and lets others decide where objects are. Is its localization right? Poses belong to the time of \
             capture, not to that of sending; what is known of their accuracy goes into its sensor description",
            "The method has learnt it, and lets others decide where objects are. Are poses those of the time of capture? What is known of their \
             accuracy is given by --accuracy",
        );
        if by_m >= GRAVE_POSE_M {
            one.fault(Code::PoseWanders, says, change)
        } else {
            one.note(Code::PoseWanders, says, change)
        }
    })
}

/// An agent whose frames are all empty.
fn nothing_seen(one: &One<'_>) -> Option<Finding> {
    let frames = one.survey.arrivals.frames;
    (frames >= MIN_EMPTY && one.survey.writing.detections == 0).then(|| {
        let says = format!("none of its {frames} frames holds a detection");
        let change = "Where nothing is there, this is right. Otherwise look at its detector: its threshold of scores, and whether the list \
                      `detections` is filled";
        one.note(Code::SeesNothing, says, change)
    })
}

/// With two decimals, and with two significant digits where these would be zeros.
fn number(value: f64) -> String {
    const DECIMALS: [usize; 7] = [2, 3, 4, 5, 6, 7, 8];
    let says_enough = |text: &String| text.trim_start_matches(['-', '0', '.']).len() >= 2;
    let shown = DECIMALS.into_iter().map(|decimals| format!("{value:.decimals$}")).find(says_enough);
    shown.unwrap_or_else(|| format!("{value:.2}"))
}

/// The nearest value that the setting of a standard deviation takes, m.
fn settable(sigma_m: f64) -> f64 {
    sigma_m.clamp(SIGMA_SETTABLE_M.0, SIGMA_SETTABLE_M.1)
}

/// What is learnt of stated standard deviations is bounded: where the positions scatter by much less yet, or by much more, this is how far
/// they are off.
fn far_off(one: &One<'_>, learnt: Option<f64>) -> Option<Finding> {
    let (mean_m, sigma_m) = (one.survey.writing.mean_sigma_m()?, one.survey.scatter.sigma_m()?);
    let by_scatter = sigma_m / mean_m;
    let is_of_centimetres = by_scatter < 1.0 && units::of_sigmas(1.0 / by_scatter).is_some();
    let (factor, is_further) = match learnt {
        Some(factor) if factor > 1.0 => (factor, by_scatter > FURTHER * factor),
        Some(factor) => (factor, by_scatter < factor / FURTHER),
        // Errors that last do not show in what scatters: but no sensor that is of use errs so.
        None => (by_scatter, mean_m >= USELESS_M && is_of_centimetres),
    };
    is_further.then(|| {
        let (code, word, times) = match factor > 1.0 {
            true => (Code::SigmaTooSmall, "small", by_scatter),
            false => (Code::SigmaTooLarge, "large", 1.0 / by_scatter),
        };
        let unit = units::of_sigmas(times).filter(|_| factor < 1.0);
        let unit = unit.map(|unit| format!(", as numbers in {} are", unit.name)).unwrap_or_default();
        let says = format!(
            "the stated standard deviations of its positions are too {word}, by a factor of about {times:.0}{unit}: from frame to frame they \
             scatter by {} m, and {} m are stated in the mean",
            number(sigma_m),
            number(mean_m)
        );
        let change = format!(
            "{} metres: about {} m instead of {} m, and more where its errors last longer than a frame",
            one.words("Send `sigma` in", "Write in the columns sx and sy"),
            number(sigma_m),
            number(mean_m)
        );
        one.fault(code, says, change)
    })
}

fn stated_errors(one: &One<'_>) -> Option<Finding> {
    let engine = one.around.engine;
    let record = engine.agents().record(&one.agent)?;
    let arrivals = &one.survey.arrivals;
    let is_enough = record.statistics.innovations.count >= MIN_INNOVATIONS
        && arrivals.frames >= MIN_VALUES
        && arrivals.lasted() >= INNOVATIONS_FOR;
    let is_default = 2 * one.survey.writing.without_sigma > one.survey.writing.detections;
    if !is_enough {
        // Reports that say next to nothing begin no track, and so there are no innovations.
        return if is_default { None } else { far_off(one, None) };
    }
    let mean_m = one.survey.writing.mean_sigma_m();
    // What may last for good, and so far as anybody knows does, is not stated too large.
    let with_lasting = |learnt: LearntSensorReport| match mean_m {
        Some(mean_m) if learnt.sigma_factor < 1.0 => {
            libm::hypot(learnt.sigma_factor, learnt.lasting_sigma_m / mean_m)
        }
        _ => learnt.sigma_factor,
    };
    let learnt = engine.learnt(&one.agent).filter(|learnt| learnt.sigma_factor != 1.0).map(with_lasting);
    let by_nis = || {
        let nis = record.statistics.recent_nis_per_dof(engine.now())?;
        (!(NIS.0..=NIS.1).contains(&nis)).then(|| libm::sqrt(nis))
    };
    let factor = learnt.or_else(by_nis).filter(|factor| !(FACTOR.0..=FACTOR.1).contains(factor));
    // Of an agent alone whose reports say next to nothing nothing is learnt.
    if let Some(found) = far_off(one, factor).filter(|_| !is_default) {
        return Some(found);
    }
    let factor = factor?;
    let whose = if is_default { "assumed" } else { "stated" };
    let (code, word, times) = match factor > 1.0 {
        true => (Code::SigmaTooSmall, "small", factor),
        false => (Code::SigmaTooLarge, "large", 1.0 / factor),
    };
    let says =
        format!("the {whose} standard deviations of its positions are too {word}, by a factor of {times:.1}");
    let change = match (is_default, mean_m) {
        (true, Some(mean_m)) => {
            format!(
                "Write {}",
                one.setting(&format!("sigma_position_m = {}", number(settable(factor * mean_m))))
            )
        }
        (true, None) => format!("Write {}, as large as its errors are", one.setting("sigma_position_m = …")),
        (false, mean_m) => {
            let mean = mean_m.map(|mean_m| {
                format!(": {} m instead of {} m in the mean", number(factor * mean_m), number(mean_m))
            });
            format!(
                "{} {} times as large ones{}; {} corrects them as far as it has learnt them",
                one.words("Send", "Write in the columns sx and sy"),
                number(factor),
                mean.unwrap_or_default(),
                one.words("the hub", "the method")
            )
        }
    };
    let found = one.fault(code, says, change);
    // What nobody states is assumed large on purpose: that is no fault of the agent, and costs little.
    Some(if is_default && code == Code::SigmaTooLarge { found.as_note() } else { found })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_have_two_digits_that_say_something() {
        for (value, shown) in [
            (3.0, "3.00"),
            (12.345, "12.35"),
            (0.35, "0.35"),
            (0.0504, "0.050"),
            (0.0036, "0.0036"),
            (0.000_18, "0.00018"),
            (0.0, "0.00"),
        ] {
            assert_eq!(number(value), shown);
        }
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!([1e-5, 0.2, 1e3].map(settable), [1e-3, 0.2, 70.0]);
    }

    #[test]
    fn only_places_that_are_too_far_away_are_asked_about_degrees_and_pixels() {
        let of = |field: &'static str, cause: &'static str| advice(&[((field.into(), cause.into()), 3)]);
        for field in ["x", "y"] {
            assert!(of(field, "out of range").contains("pixels"), "{field}");
            assert!(!of(field, "not finite").contains("pixels"), "{field}");
        }
        for field in ["score", "w", "d", "variance of x", "velocity x"] {
            assert!(!of(field, "out of range").contains("pixels"), "{field}");
        }
    }

    #[test]
    fn a_part_is_never_larger_than_the_whole() {
        assert_eq!([some_of(3, 9), some_of(12, 9)], ["3 of 9 detections", "12 detections"]);
    }
}
