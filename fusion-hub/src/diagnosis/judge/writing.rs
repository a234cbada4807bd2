//! Units, axes and orders of an agent's numbers.

use super::super::finding::{Code, Finding};
use super::super::headings::{Headings, Verdict};
use super::super::velocities::{Found, Reading};
use super::super::writing::{DEGREES_APART, Writing};
use super::one::{MIN_VALUES, One};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::RangeInclusive;
use v2x_common::conventions::{AngleUnit, TurnDirection, YawConvention, YawOrigin};
use v2x_common::geometry::wrap_angle;
use v2x_common::reported::OffPlaces;

/// Share of headings beyond a whole turn from which they are no radians: radians that are not wrapped exceed a turn rarely,
/// and by little.
const DEGREES_SHARE: f64 = 0.3;
/// The largest heading of radians that are not wrapped, rad.
const MOST_RADIANS: f64 = 15.0;
/// Degrees that are not wrapped exceed a turn rarely; where more do, what moves must show that they are degrees.
const BEYOND_360_SHARE: f64 = 0.5;
/// Share of vehicles that are wider than long from which width and depth are swapped.
const SWAPPED_SHARE: f64 = 0.8;
/// Share of detections without standard deviations from which this is reported.
const MISSING_SHARE: f64 = 0.5;
/// Share of the frames with several objects in which these are at one place, as degrees are.
const AT_ONE_PLACE: f64 = 0.95;
/// Positions off the stated origin are reported from so many, and from such a share on.
const MIN_OFF: u64 = 3;
const OFF_SHARE: f64 = 0.02;
/// One or two objects in degrees move by less and by more: 500 m, and 2 m.
const FEW_OBJECTS_APART: f64 = 0.005;
const FEW_OBJECTS_MOVE: f64 = 2e-5;
/// Objects that move along a line lie within less of it, and along it over more, m.
const THIN_M: f64 = 0.5;
const LONG_M: f64 = 10.0;
/// Vehicles that lie within others are reported from this share on.
const TWINS_SHARE: f64 = 0.1;
/// No sensor's detections are further from it in the mean, m.
const FURTHEST_MEAN_M: f64 = 500.0;
/// Headings are turned by a constant angle from this on, rad; and it is a quarter or a half turn within this.
const TURNED_RAD: f64 = 0.15;
const QUARTER_WITHIN_RAD: f64 = 0.35;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let degrees = degrees(one).or_else(|| no_angles(one));
    let headings = if degrees.is_some() { None } else { headings(one) };
    // Boxes whose heading is a quarter turn off may be boxes with swapped sizes, and the other way round: both are reported.
    let all = [
        degrees,
        headings,
        swapped_sizes(one),
        velocities(one),
        geodetic(one).or_else(|| one_spot(one)).or_else(|| flat(one)),
        off_origin(one),
        sigma_missing(one),
        far_from_sensor(one),
        twins(one),
    ];
    all.into_iter().flatten().collect()
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn is_share(part: u64, of: u64, least: f64) -> bool {
    of >= MIN_VALUES && part as f64 >= least * of as f64
}

fn degrees(one: &One<'_>) -> Option<Finding> {
    let Writing { headings, yaw, .. } = &one.survey.writing;
    // All that is to be changed at once: what moves shows where they count from, and in which direction.
    let verdict = one.survey.headings_as_degrees.verdict();
    let is_degrees = yaw.unit == AngleUnit::Rad
        && is_share(headings.beyond_a_turn, headings.n, DEGREES_SHARE)
        && headings.largest >= MOST_RADIANS
        && (verdict.is_some() || !is_share(headings.beyond_360, headings.n, BEYOND_360_SHARE));
    is_degrees.then(|| {
        let read = YawConvention { unit: AngleUnit::Deg, ..*yaw };
        let Conventions { found, other } = Conventions::of(&one.survey.headings_as_degrees, &read);
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

/// Vehicles that lie within each other: a detector's boxes of one object, or objects that have gone and are sent on.
fn twins(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let (n, all) = (writing.twin_vehicles, writing.looked_at);
    is_share(n, all, TWINS_SHARE).then(|| {
        let says = format!("{n} of {all} vehicles lie within another one of the same frame, where there is room for one");
        let change = "Does its detector suppress what overlaps (NMS)? The hub takes them for one object as far as it can";
        one.note(Code::Twins, says, change)
    })
}

/// Positions that no sensor at its pose can have seen.
fn far_from_sensor(one: &One<'_>) -> Option<Finding> {
    let (range_m, n) = one.survey.writing.mean_range()?;
    (range_m > FURTHEST_MEAN_M && n >= MIN_VALUES).then(|| {
        let says = format!("its detections are {range_m:.0} m from its sensor in the mean, further than sensors see");
        let change = format!(
            "Are x and y metres in the map frame, and not pixels or another unit? Is {} in metres in the map frame, too?",
            one.words("`sensor_pose`", "the place in sensor_x and sensor_y")
        );
        one.fault(Code::FarFromSensor, says, change)
    })
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

fn headings(one: &One<'_>) -> Option<Finding> {
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

fn swapped_sizes(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    is_share(writing.wide_vehicles, writing.vehicles, SWAPPED_SHARE).then(|| {
        let says = format!("{} of {} vehicles are wider than long", writing.wide_vehicles, writing.vehicles);
        let change = if writing.sizes_swapped {
            format!("Remove `sizes` {}: it swaps what is right", one.table())
        } else {
            let setting = one.setting("sizes = \"w-along\"");
            let swap = one.words("swap them", "swap these columns");
            format!("w is across the heading and d along it: {swap}, or write {setting}")
        };
        one.fault(Code::SizesSwapped, says, change)
    })
}

fn velocities(one: &One<'_>) -> Option<Finding> {
    let Found { reading, n, explained } = one.survey.velocities.found()?;
    let (what, also) = match reading {
        Reading::KilometresPerHour => ("in km/h", ""),
        Reading::MilesPerHour => ("in miles per hour", ""),
        Reading::SensorAxes => ("along the axes of its sensor", ": turn them by the sensor's heading"),
        Reading::BoxAxes => ("along and across its boxes", ": turn them by each box's heading"),
        Reading::Relative => {
            ("relative to its sensor, which moves itself", ": add the sensor's own velocity")
        }
        Reading::Opposite => ("the other way round", ": what moves away from the origin has that sign"),
        Reading::Exchanged => ("the wrong way round in x and y", ""),
        Reading::Mirrored => ("mirrored: y points south", ""),
    };
    let says = format!("its velocities are {what}: so {explained} of {n} are where its next frames see them");
    let send = one.words("Send `velocity` in m/s", "Write the columns vx and vy in m/s");
    Some(one.fault(Code::Velocities, says, format!("{send}, x east and y north in the map frame{also}")))
}

fn geodetic(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let [x, y] = writing.extent?;
    let spread = writing.spread()?;
    // Boxes of several objects do not lie within each other. What one or two boxes near zero show is only reported
    // where they move, because what is parked stays at its place, too.
    let is_geodetic = writing.can_be_degrees()
        && match writing.several >= MIN_VALUES {
            true => {
                is_share(writing.several_at_one_place, writing.several, AT_ONE_PLACE)
                    && spread < DEGREES_APART
            }
            false => {
                spread < FEW_OBJECTS_APART
                    && writing.steady_motion().is_some_and(|moved| moved >= FEW_OBJECTS_MOVE)
            }
        };
    is_geodetic.then(|| {
        let says = format!(
            "all its objects lie at x {:.4} to {:.4} and y {:.4} to {:.4}, within centimetres: these are longitudes and \
             latitudes in degrees, not metres",
            x.0, x.1, y.0, y.1
        );
        let setting = one.setting("frame = \"wgs84\"");
        let send = one.words("Send", "Write in the columns x and y");
        let change = format!(
            "{send} metres in the map frame, or write {setting} with the map's `origin = {{ latitude_deg = …, longitude_deg = … }}` (x is \
             the longitude; where it is the latitude, `frame = \"wgs84-lat-lon\"`)"
        );
        one.fault(Code::Geodetic, says, change)
    })
}

/// Vehicles of which several lie where there is room for one.
fn one_spot(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let is_of_vehicles = 2 * writing.vehicles > writing.detections;
    let is_one_spot = is_of_vehicles && is_share(writing.several_in_one_spot, writing.several, AT_ONE_PLACE);
    is_one_spot.then(|| {
        let says = "its frames have several vehicles within a metre, where there is room for one: its positions are no metres, \
                    but kilometres, degrees, or shares of an image";
        one.fault(Code::LengthUnit, says.to_owned(), one.words("Send metres", "Write metres in the columns x and y"))
    })
}

/// Places of several objects that are all on one line along an axis.
fn flat(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let [x, y] = writing.extent?;
    let spread = [x, y].map(|(least, most)| most - least);
    let thin = usize::from(spread[1] < spread[0]);
    let is_flat = writing.several >= MIN_VALUES && spread[thin] < THIN_M && spread[1 - thin] > LONG_M;
    is_flat.then(|| {
        let (name, (least, most)) = (["x", "y"][thin], [x, y][thin]);
        let says = format!("all its positions have {name} from {least:.2} to {most:.2} m");
        let change = format!(
            "Where it sees one lane along an axis, this is right. Otherwise: is {name} a height or a distance? x is east, y is north"
        );
        one.note(Code::Axes, says, change)
    })
}

/// Positions that are no longitudes and latitudes near the origin that the settings state: all that is said of their values follows.
pub(super) fn off_origin(one: &One<'_>) -> Option<Finding> {
    let OffPlaces { n, exchanged, newest } = one.survey.writing.off_origin;
    // Of a log they are left out of the frames when it is read.
    let (detections, newest) = (one.survey.writing.detections.max(n), newest?);
    if n < MIN_OFF || !is_share(n, detections, OFF_SHARE) {
        return None;
    }
    let says = format!("{n} of {detections} positions are dropped; the newest: {newest}");
    let other = if newest.latitude_first { "wgs84" } else { "wgs84-lat-lon" };
    let change = if 2 * exchanged > n {
        let [first, second] = match newest.latitude_first {
            true => ["latitude", "longitude"],
            false => ["longitude", "latitude"],
        };
        let setting = one.setting(&format!("frame = \"{other}\""));
        format!(
            "{} the {first} as x and the {second} as y, or write {setting}. Where it is the origin that is the wrong way round, \
             exchange `latitude_deg` and `longitude_deg` there",
            one.words("Send", "Write")
        )
    } else {
        format!(
            "Is `origin` {} right, and are these degrees? Of metres in the map frame nothing is to be written: remove `frame` there",
            one.table()
        )
    };
    Some(one.fault(Code::Geodetic, says, change))
}

fn sigma_missing(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let is_missing = is_share(writing.without_sigma, writing.detections, MISSING_SHARE);
    (is_missing && !writing.sigma_is_set).then(|| {
        let says = format!(
            "{} of {} detections give no standard deviations: {} are in use",
            writing.without_sigma,
            writing.detections,
            one.words("the hub's defaults", "defaults")
        );
        let setting = one.setting("sigma_position_m = …");
        let send = one.words("Send `sigma` with each detection", "Fill the columns sx and sy (m)");
        one.note(Code::SigmaMissing, says, format!("{send}, or write {setting}"))
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
