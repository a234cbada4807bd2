//! Boxes: sizes, and velocities.

use super::super::finding::{Code, Finding};
use super::super::sizes::WrongSizes;
use super::super::speeds::WrongSpeeds;
use super::super::velocities::{Found, Reading};
use super::one::{One, is_share};
use super::units;

/// Share of vehicles that are wider than long from which width and depth are swapped.
const SWAPPED_SHARE: f64 = 0.8;
/// Names of factors, each within such a share of it.
const WITHIN: f64 = 0.15;
/// Reported speeds are nothing from this part of the true ones down.
const NOTHING: f64 = 0.02;

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let sizes = swapped_sizes(one).or_else(|| sizes(one));
    // How many times too fast they are says more than that one of two units explains them.
    let is_of_unit =
        |found: &Found| matches!(found.reading, Reading::KilometresPerHour | Reading::MilesPerHour);
    let velocities = match one.survey.velocities.found() {
        Some(found) if is_of_unit(&found) => speeds(one).or_else(|| velocities(one)),
        _ => velocities(one).or_else(|| speeds(one)),
    };
    [sizes, velocities].into_iter().flatten().collect()
}

fn swapped_sizes(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    is_share(writing.wide_vehicles, writing.vehicles, SWAPPED_SHARE).then(|| {
        let says = format!(
            "{} of {} detections of vehicles are wider than long",
            writing.wide_vehicles, writing.vehicles
        );
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

/// Vehicles of another size than vehicles have.
fn sizes(one: &One<'_>) -> Option<Finding> {
    let WrongSizes { of_vehicles, factors, mean_m, n } = one.survey.sizes.wrong()?;
    let factor = libm::sqrt(factors[0] * factors[1]);
    let what = if of_vehicles { "vehicles" } else { "people and two-wheelers" };
    let guess = match (factor, units::of_sizes(factor, of_vehicles)) {
        (factor, _) if is_near(factor, 0.5) => {
            "half as large as vehicles are: halves of boxes (extents)".to_owned()
        }
        (factor, _) if is_near(factor, 2.0) => "twice as large as vehicles are".to_owned(),
        (factor, Some(unit)) => format!("{factor:.0} times as large as such are: {}", unit.name),
        (factor, None) if factor < 1.0 => format!("too small for {what}"),
        _ => format!("too large for {what}"),
    };
    let says = format!(
        "its {what} are {:.2} m wide and {:.2} m long in the mean ({n} detections), {guess}",
        mean_m[0], mean_m[1]
    );
    let change = format!(
        "{} the whole width and length in metres; where they are not known, {}",
        one.words("Send `w` and `d`:", "Write in the columns w and d"),
        one.words("leave both out", "leave both empty")
    );
    Some(one.fault(Code::Sizes, says, change))
}

fn is_near(factor: f64, expected: f64) -> bool {
    (factor / expected - 1.0).abs() <= WITHIN
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
        Reading::Polar | Reading::PolarDegrees => (
            "speeds and directions of motion",
            ": x is the speed times the cosine of the direction, y the speed times its sine",
        ),
    };
    let says = format!("its velocities are {what}: so {explained} of {n} are where its next frames see them");
    let send = one.words("Send `velocity` in m/s", "Write the columns vx and vy in m/s");
    Some(one.fault(Code::Velocities, says, format!("{send}, x east and y north in the map frame{also}")))
}

/// Speeds that are wrong by a factor, whatever it is.
fn speeds(one: &One<'_>) -> Option<Finding> {
    let WrongSpeeds { factor, n } = one.survey.speeds.wrong()?;
    let per_frame = one.survey.arrivals.rate_hz().is_some_and(|rate_hz| is_near(factor * rate_hz, 1.0));
    let as_seen = format!("by where {n} detections of what moves were a moment before and after");
    let (says, send) = if factor.abs() < NOTHING {
        (
            format!("its velocities are zero, also of what moves, {as_seen}"),
            one.words(
                "Send `velocity` (m/s, x east and y north in the map frame) where it is measured, and leave it out where it is not",
                "Write the columns vx and vy (m/s, x east and y north in the map frame) where they are measured, and leave them empty where they are \
                 not",
            ),
        )
    } else {
        let units = [
            (3.6, ": km/h"),
            (1.0 / 0.447_04, ": miles per hour"),
            (1.0 / 0.3048, ": feet per second"),
            (1.943_8, ": knots"),
        ];
        let off = |(unit, _): &(f64, &str)| (factor / unit - 1.0).abs();
        let unit =
            units.into_iter().filter(|unit| off(unit) <= WITHIN).min_by(|a, b| off(a).total_cmp(&off(b)));
        let unit = if per_frame { ": metres in each frame" } else { unit.map_or("", |(_, name)| name) };
        (
            format!("its velocities are {factor:.2} times as large as what it sees moves{unit}, {as_seen}"),
            one.words(
                "Send `velocity` in m/s, x east and y north in the map frame",
                "Write the columns vx and vy in m/s, x east and y north in the map frame",
            ),
        )
    };
    Some(one.fault(Code::Velocities, says, send))
}
