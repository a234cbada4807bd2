//! Headings against the motion of what is seen.

use super::super::finding::{Code, Finding};
use super::super::headings::{Headings, Unfit, Verdict};
use super::super::writing::Writing;
use super::one::{MIN_VALUES, One, is_share};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::RangeInclusive;
use v2x_common::conventions::{AngleUnit, TurnDirection, YawConvention, YawOrigin};
use v2x_common::geometry::wrap_angle;

/// Share of headings beyond a whole turn from which they are no radians: radians that are not wrapped exceed a turn rarely,
/// and by little.
const DEGREES_SHARE: f64 = 0.3;
/// The largest heading of radians that are not wrapped, rad.
const MOST_RADIANS: f64 = 15.0;
/// Degrees that are not wrapped exceed a turn rarely; where more do, what moves must show that they are degrees.
const BEYOND_360_SHARE: f64 = 0.5;
/// Headings are turned by a constant angle from this on, rad; and it is a quarter or a half turn within this.
const TURNED_RAD: f64 = 0.15;
const QUARTER_WITHIN_RAD: f64 = 0.35;

pub(super) fn findings(one: &One<'_>) -> Option<Finding> {
    let unit = degrees(one).or_else(|| radians(one)).or_else(|| no_angles(one));
    unit.or_else(|| turned(one)).or_else(|| unfit(one))
}

fn degrees(one: &One<'_>) -> Option<Finding> {
    let Writing { headings, yaw, .. } = &one.survey.writing;
    // All that is to be changed at once: what moves shows where they count from, and in which direction.
    let verdict = one.survey.headings_in_other_unit.verdict();
    let is_degrees = yaw.unit == AngleUnit::Rad
        && is_share(headings.beyond_a_turn, headings.n, DEGREES_SHARE)
        && headings.largest >= MOST_RADIANS
        && (verdict.is_some() || !is_share(headings.beyond_360, headings.n, BEYOND_360_SHARE));
    is_degrees.then(|| {
        let read = YawConvention { unit: AngleUnit::Deg, ..*yaw };
        let Conventions { found, other } = Conventions::of(&one.survey.headings_in_other_unit, &read);
        let more = match (found, verdict) {
            (Some(found), _) if found != read => {
                format!("; against the motion of what it sees they are {}", in_words(found))
            }
            (None, Some(Verdict::Turned(by) | Verdict::Clockwise(by))) => {
                format!(
                    "; they are also turned, by {:+.0}° against the motion of what it sees",
                    by.to_degrees()
                )
            }
            _ => String::new(),
        };
        let largest = headings.largest;
        let says =
            format!("its headings (yaw, up to {largest:.0}) are degrees, and are read as radians{more}");
        let setting = yaw_setting(one, found.unwrap_or(read));
        let send = match more.is_empty() {
            true => one.words("Send radians", "Write radians in the column yaw"),
            false => one.words(
                "Send radians, counter-clockwise from east (x)",
                "Write radians, counter-clockwise from east (x), in the column yaw",
            ),
        };
        let rest = match (verdict, other) {
            (None, _) => {
                ". Whether they also grow clockwise, or from north, shows once several things move".to_owned()
            }
            (_, Some(other)) => format!(
                ". All traffic is along one road: there headings {} look the same, which is {}",
                in_words(other),
                yaw_setting(one, other)
            ),
            _ => String::new(),
        };
        one.fault(Code::Degrees, says, format!("{send}, or write {setting}{rest}"))
    })
}

/// Headings that the settings call degrees, and that are radians.
fn radians(one: &One<'_>) -> Option<Finding> {
    let Writing { headings, yaw, .. } = &one.survey.writing;
    let may_be = yaw.unit == AngleUnit::Deg && headings.n >= MIN_VALUES && headings.may_be_radians();
    let verdict = one.survey.headings_in_other_unit.verdict().filter(|_| may_be)?;
    // All that moves may go nearly along x: then they are right as they are.
    if matches!(one.survey.headings.verdict(), Some(Verdict::Turned(by)) if by.abs() < TURNED_RAD) {
        return None;
    }
    let read = YawConvention { unit: AngleUnit::Rad, ..*yaw };
    let found = Conventions::of(&one.survey.headings_in_other_unit, &read).found.unwrap_or(read);
    let more = match verdict {
        Verdict::Turned(by) if by.abs() < QUARTER_WITHIN_RAD => String::new(),
        _ => format!("; against the motion of what it sees they are {}", in_words(found)),
    };
    let says = format!(
        "its headings (yaw, up to {:.1}) are radians, and are read as degrees, as its settings say{more}",
        headings.largest.to_degrees()
    );
    let change = match found == YawConvention::default() {
        true => format!("Remove `yaw` {}", one.table()),
        false => format!("Write {} in place of what is there", yaw_setting(one, found)),
    };
    Some(one.fault(Code::Degrees, says, change))
}

/// Headings of which many are beyond a turn by whatever unit they are read.
fn no_angles(one: &One<'_>) -> Option<Finding> {
    // Wrapped to a turn, or to half a turn either way.
    const TENTHS: RangeInclusive<f64> = 1_790.0..=3_600.5;
    const HUNDREDTHS: RangeInclusive<f64> = 17_900.0..=36_000.5;
    let Writing { headings, yaw, .. } = &one.survey.writing;
    let (beyond, written, unit) = match yaw.unit {
        AngleUnit::Rad => (headings.beyond_360, headings.largest, "radians"),
        AngleUnit::Deg => (headings.beyond_a_turn, headings.largest.to_degrees(), "degrees"),
    };
    if !is_share(beyond, headings.n, BEYOND_360_SHARE) {
        return None;
    }
    let guess = match written {
        written if TENTHS.contains(&written) => "tenths of a degree, as in messages of ETSI",
        written if HUNDREDTHS.contains(&written) => "hundredths of a degree",
        // Turns that nobody takes away.
        _ => return None,
    };
    let says = format!("its headings (yaw, up to {written:.0}) are {guess}, and are read as {unit}");
    let setting = yaw_setting(one, YawConvention { unit: AngleUnit::Deg, ..*yaw });
    let change = match yaw.unit {
        AngleUnit::Rad => format!("Send radians, or degrees and write {setting}"),
        AngleUnit::Deg => "Send degrees, as its settings say".to_owned(),
    };
    Some(one.fault(Code::Degrees, says, change))
}

/// By which conventions headings agree with the motion of what is seen.
struct Conventions {
    found: Option<YawConvention>,
    /// As well, where all traffic is along one road.
    other: Option<YawConvention>,
}

impl Conventions {
    /// Of headings that are read by this convention.
    fn of(headings: &Headings, read_by: &YawConvention) -> Self {
        let verdict = headings.verdict();
        let plain = verdict.and_then(|verdict| convention_of(read_by, verdict));
        let other = verdict.and_then(|verdict| headings.other_verdict(verdict));
        let other = other.and_then(|verdict| convention_of(read_by, verdict));
        match plain {
            Some(_) => Self { found: plain, other },
            None => Self { found: other, other: None },
        }
    }
}

/// A convention of headings in words.
fn in_words(yaw: YawConvention) -> &'static str {
    match (yaw.from, yaw.turn) {
        (YawOrigin::East, TurnDirection::Ccw) => "counter-clockwise from east",
        (YawOrigin::East, TurnDirection::Cw) => "clockwise from east",
        (YawOrigin::North, TurnDirection::Ccw) => "counter-clockwise from north",
        (YawOrigin::North, TurnDirection::Cw) => "clockwise from north",
    }
}

/// The line for a convention of headings, with all that it says: a second line would be an error, a part lose the rest.
fn yaw_setting(one: &One<'_>, yaw: YawConvention) -> String {
    let mut parts = Vec::new();
    if yaw.unit == AngleUnit::Deg {
        parts.push("unit = \"deg\"");
    }
    if yaw.from == YawOrigin::North {
        parts.push("from = \"north\"");
    }
    if yaw.turn == TurnDirection::Cw {
        parts.push("turn = \"cw\"");
    }
    match parts.is_empty() {
        true => format!("no `yaw` {}", one.table()),
        false => {
            // A report of 0.05 that was right in radians would then be 0.05°.
            let sigmas = match yaw.unit == AngleUnit::Deg && one.survey.writing.yaw.unit != AngleUnit::Deg {
                true => one.words(
                    " (their standard deviations are then degrees, too)",
                    " (the column st is then in degrees, too)",
                ),
                false => "",
            };
            one.setting(&format!("yaw = {{ {} }}", parts.join(", "))) + sigmas
        }
    }
}

fn turned(one: &One<'_>) -> Option<Finding> {
    let verdict = one.survey.headings.verdict()?;
    let Conventions { found, other } = Conventions::of(&one.survey.headings, &one.survey.writing.yaw);
    let setting = found.map(|yaw| yaw_setting(one, yaw));
    let or_setting = setting.map(|setting| format!(", or write {setting}")).unwrap_or_default();
    let degrees = |angle: f64| angle.to_degrees();
    Some(match verdict {
        Verdict::Clockwise(east) => {
            let says = format!(
                "its headings grow clockwise, as they are read: what moves east has {:.0}°, what moves north {:.0}°",
                degrees(east),
                degrees(wrap_angle(east - FRAC_PI_2))
            );
            let send = one.words("Send them", "Write them in the column yaw");
            let change = format!("{send} counter-clockwise from east (x){or_setting}");
            one.fault(Code::HeadingsMirrored, says, change)
        }
        Verdict::Turned(by) if by.abs() < TURNED_RAD + one.survey.headings.lag_rad() => return None,
        Verdict::Turned(by) if PI - by.abs() < QUARTER_WITHIN_RAD => one.fault(
            Code::HeadingsReversed,
            "its headings point backwards: opposite to the motion of what it sees".to_owned(),
            match found.or(other).filter(|_| one.survey.headings.other_verdict(verdict).is_some()) {
                Some(yaw) => format!(
                    "Turn them by 180°. All traffic is along one road: where they grow clockwise, write {}",
                    yaw_setting(one, yaw)
                ),
                None => "Turn them by 180°".to_owned(),
            },
        ),
        Verdict::Turned(by) => one.fault(
            Code::HeadingsRotated,
            format!("its headings are turned by {:+.0}° against the motion of what it sees", degrees(by)),
            format!(
                "Turn them by {:+.0}°{or_setting}; is its own heading right, or the mounting of its sensor?",
                -degrees(by)
            ),
        ),
    })
}

/// The convention by which headings would be right that are read by another one; `None` where no convention says so.
///
/// They are read as h = t·raw + f, and are h = s·direction + k. So the direction is t·s·raw − s·(k − f).
fn convention_of(read_by: &YawConvention, verdict: Verdict) -> Option<YawConvention> {
    let (s, k) = match verdict {
        Verdict::Turned(k) => (1.0, k),
        Verdict::Clockwise(k) => (-1.0, k),
    };
    let f = if read_by.from == YawOrigin::North { FRAC_PI_2 } else { 0.0 };
    let offset = wrap_angle(-s * (k - f));
    let from = [(0.0, YawOrigin::East), (FRAC_PI_2, YawOrigin::North)];
    let from = from.into_iter().find(|(angle, _)| (offset - angle).abs() < QUARTER_WITHIN_RAD)?.1;
    let is_turned_round = s < 0.0;
    let turn = match (read_by.turn, is_turned_round) {
        (TurnDirection::Ccw, false) | (TurnDirection::Cw, true) => TurnDirection::Ccw,
        _ => TurnDirection::Cw,
    };
    Some(YawConvention { unit: read_by.unit, from, turn })
}

/// Headings that go with the motion of what is seen in no way.
fn unfit(one: &One<'_>) -> Option<Finding> {
    let or_unknown = one.words(
        "leave `yaw` out, or send `\"heading\": \"unknown\"` with each detection",
        "leave the column yaw empty, or write unknown in a column heading",
    );
    let as_axes =
        one.words("Send `\"heading\": \"axis\"` with each detection", "Write axis in a column heading");
    let unfit = one.survey.headings.unfit()?;
    let (says, change) = match unfit {
        Unfit::Constant(yaw) => (
            format!(
                "its headings are always about {:.2} rad ({:.0}°), in whatever direction what it sees moves",
                yaw,
                yaw.to_degrees()
            ),
            format!("Where its detector has no headings, {or_unknown}. {as_axes} where they are those of boxes without a front"),
        ),
        Unfit::Axes(against) => (
            format!(
                "its headings are those of axes: {:.0} % of what moves goes backwards by them, and the rest forwards",
                100.0 * against
            ),
            format!("{as_axes}: then a front is not taken for a back"),
        ),
        Unfit::Unrelated => (
            "its headings have nothing to do with the motion of what it sees, by whatever origin and direction they count".to_owned(),
            format!("`yaw` is where an object's front points to, in radians: no bearing, no share of a turn. Where that is not known, {or_unknown}"),
        ),
    };
    // What is always the same, and what is turned half of the time, can be nothing else.
    Some(match unfit {
        Unfit::Unrelated => one.note(Code::HeadingsUnfit, says, change),
        Unfit::Constant(_) | Unfit::Axes(_) => one.fault(Code::HeadingsUnfit, says, change),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_whatever_convention_headings_are_read_by_the_right_one_is_found() {
        let all = [YawOrigin::East, YawOrigin::North].into_iter().flat_map(|from| {
            [TurnDirection::Ccw, TurnDirection::Cw].map(|turn| YawConvention {
                unit: AngleUnit::Deg,
                from,
                turn,
            })
        });
        let all: Vec<_> = all.collect();
        let parts = |one: &YawConvention| {
            let f = if one.from == YawOrigin::North { FRAC_PI_2 } else { 0.0 };
            (if one.turn == TurnDirection::Cw { -1.0 } else { 1.0 }, f)
        };
        for (written, read) in all.iter().flat_map(|written| all.iter().map(move |read| (written, read))) {
            // direction = t·raw + f as it is written; h = t'·raw + f' as it is read.
            let ((t, f), (t_read, f_read)) = (parts(written), parts(read));
            let s = t * t_read;
            let k = wrap_angle(f_read - s * f);
            let verdict = if s > 0.0 { Verdict::Turned(k) } else { Verdict::Clockwise(k) };
            assert_eq!(convention_of(read, verdict), Some(*written), "{written:?} read by {read:?}");
        }
        assert_eq!(convention_of(&YawConvention::default(), Verdict::Turned(0.8)), None);
    }
}
