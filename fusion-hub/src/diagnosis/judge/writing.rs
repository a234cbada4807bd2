//! Units, axes and orders of an agent's numbers.

use super::super::finding::{Code, Finding};
use super::super::headings::Verdict;
use super::one::{MIN_VALUES, One};
use std::f64::consts::{FRAC_PI_2, PI};

/// Share of headings beyond a whole turn from which they are no radians: radians that are not wrapped exceed a turn rarely,
/// and by little.
const DEGREES_SHARE: f64 = 0.3;
/// The largest heading of radians that are not wrapped, rad; and of degrees, with a margin for rounding.
const MOST_RADIANS: f64 = 15.0;
const MOST_DEGREES: f64 = 360.5;
/// Share of vehicles that are wider than long from which width and depth are swapped.
const SWAPPED_SHARE: f64 = 0.8;
/// Share of detections without standard deviations from which it is told.
const MISSING_SHARE: f64 = 0.5;
/// Headings are turned by a constant angle from this on, rad; and it is a quarter or a half turn within this.
const TURNED_RAD: f64 = 0.15;
const QUARTER_WITHIN_RAD: f64 = 0.35;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let degrees = degrees(one);
    let headings = if degrees.is_some() { None } else { headings(one) };
    // Boxes whose heading is a quarter turn off may be boxes with swapped sizes, and the other way round: both are told.
    [degrees, headings, swapped_sizes(one), geodetic(one), sigma_missing(one)].into_iter().flatten().collect()
}

#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn is_share(part: u64, of: u64, least: f64) -> bool {
    of >= MIN_VALUES && part as f64 >= least * of as f64
}

fn degrees(one: &One<'_>) -> Option<Finding> {
    let headings = &one.survey.writing.headings;
    let is_degrees = is_share(headings.beyond_a_turn, headings.n, DEGREES_SHARE)
        && (MOST_RADIANS..=MOST_DEGREES).contains(&headings.largest);
    is_degrees.then(|| {
        let says =
            format!("its headings (yaw, up to {:.0}) are degrees, and are read as radians", headings.largest);
        let setting = one.setting("yaw = { unit = \"deg\" }");
        one.fault(Code::Degrees, says, format!("Send radians, or write {setting}"))
    })
}

fn headings(one: &One<'_>) -> Option<Finding> {
    let degrees = |angle: f64| angle.to_degrees();
    Some(match one.survey.headings.verdict()? {
        Verdict::Clockwise(east) => {
            let is_compass = (east - FRAC_PI_2).abs() < QUARTER_WITHIN_RAD;
            let (from, setting) = if is_compass {
                ("north, as a compass does", "yaw = { from = \"north\", turn = \"cw\" }")
            } else {
                ("east", "yaw = { turn = \"cw\" }")
            };
            let says =
                format!("its headings grow clockwise from {from}: what moves east has {:.0}°", degrees(east));
            let change = format!("Send them counter-clockwise from east, or write {}", one.setting(setting));
            one.fault(Code::HeadingsMirrored, says, change)
        }
        Verdict::Turned(by) if by.abs() < TURNED_RAD => return None,
        Verdict::Turned(by) if PI - by.abs() < QUARTER_WITHIN_RAD => one.fault(
            Code::HeadingsReversed,
            "its headings point backwards: opposite to the motion of what it sees".to_owned(),
            "Turn them by 180°. Where all traffic is along one road they may also grow clockwise",
        ),
        Verdict::Turned(by) if (by.abs() - FRAC_PI_2).abs() < QUARTER_WITHIN_RAD => {
            let setting =
                one.setting(if by < 0.0 { "yaw = { from = \"north\" }" } else { "sizes = \"w-along\"" });
            one.fault(
                Code::HeadingsRotated,
                format!(
                    "its headings are a quarter turn ({:+.0}°) off the motion of what it sees",
                    degrees(by)
                ),
                format!("Headings are counted from east (x). Send them so, or write {setting}"),
            )
        }
        Verdict::Turned(by) => one.fault(
            Code::HeadingsRotated,
            format!("its headings are turned by {:+.0}° against the motion of what it sees", degrees(by)),
            "Turn them back; is its own heading right, or the mounting of its sensor?",
        ),
    })
}

fn swapped_sizes(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    is_share(writing.wide_vehicles, writing.vehicles, SWAPPED_SHARE).then(|| {
        let says = format!("{} of {} vehicles are wider than long", writing.wide_vehicles, writing.vehicles);
        let setting = one.setting("sizes = \"w-along\"");
        let change = format!("w is across the heading and d along it: swap them, or write {setting}");
        one.fault(Code::SizesSwapped, says, change)
    })
}

fn geodetic(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    let [x, y] = writing.extent?;
    let is_geodetic = writing.several >= MIN_VALUES
        && writing.several_at_one_place == writing.several
        && writing.can_be_degrees();
    is_geodetic.then(|| {
        let says = format!(
            "all its objects lie at x {:.4} to {:.4} and y {:.4} to {:.4}, within centimetres: these are longitudes and \
             latitudes in degrees, not metres",
            x.0, x.1, y.0, y.1
        );
        let setting = one.setting("frame = \"wgs84\"");
        let change = format!(
            "Send metres in the map frame, or write {setting} with the map's `origin = {{ latitude_deg = …, longitude_deg = … }}` (x is \
             the longitude)"
        );
        one.fault(Code::Geodetic, says, change)
    })
}

fn sigma_missing(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    is_share(writing.without_sigma, writing.detections, MISSING_SHARE).then(|| {
        let says = format!(
            "{} of {} detections give no standard deviations: the hub's defaults are in use",
            writing.without_sigma, writing.detections
        );
        let setting = one.setting("sigma_position_m = …");
        one.note(Code::SigmaMissing, says, format!("Send `sigma` with each detection, or write {setting}"))
    })
}
