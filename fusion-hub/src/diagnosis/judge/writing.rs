//! Units and axes of an agent's positions, and what it says of its errors.

use super::super::finding::{Code, Finding};
use super::super::views::WrongView;
use super::super::writing::DEGREES_APART;
use super::one::{MIN_VALUES, One, is_share};
use v2x_common::conventions::AngleUnit;
use v2x_common::reported::OffPlaces;

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

pub(super) fn findings(one: &One<'_>) -> Vec<Finding> {
    let all = [
        geodetic(one).or_else(|| one_spot(one)).or_else(|| flat(one)),
        off_origin(one),
        sigma_missing(one),
        far_from_sensor(one),
        field_of_view(one),
        twins(one),
        turned_pose(one),
    ];
    all.into_iter().flatten().collect()
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

/// Headings of the sensor's pose beyond a whole turn: degrees, which are read as radians.
fn turned_pose(one: &One<'_>) -> Option<Finding> {
    let writing = &one.survey.writing;
    (writing.turned_poses >= MIN_VALUES && writing.yaw.unit == AngleUnit::Rad).then(|| {
        let says = format!(
            "the yaw of its {} is {:.1}, which is more than a whole turn of radians: it is in degrees",
            one.words("`sensor_pose`", "sensor_yaw"),
            writing.turned_pose_rad
        );
        let change = one.words(
            "Send it in radians, counter-clockwise from east, as headings are",
            "Write it in radians, counter-clockwise from east, as headings are",
        );
        one.fault(Code::SensorPose, says, change)
    })
}

/// Positions that no sensor at its pose can have seen.
pub(super) fn far_from_sensor(one: &One<'_>) -> Option<Finding> {
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

/// A described view in which its detections are not, or of which they use the least part.
fn field_of_view(one: &One<'_>) -> Option<Finding> {
    let view = one.around.engine.agents().record(&one.agent)?.description?.field_of_view;
    let wrong = one.survey.views.wrong(&view)?;
    let declared = format!(
        "{:.0} to {:.0} m, over {:.0}° about {:.0}° left of its heading",
        view.range_min_m,
        view.range_max_m,
        view.width_rad.to_degrees(),
        view.azimuth_rad.to_degrees()
    );
    match wrong {
        WrongView::Outside { n, of, by_range } => {
            let says = format!(
                "{n} of {of} detections are outside of the field of view that it describes ({declared}), most of them {}",
                if by_range { "too far away" } else { "in another direction" }
            );
            let change = format!(
                "Correct {} in its sensor description, or the yaw of {}: what others see there and it does not is not counted as missed, and \
                 what it does not see where it says it looks is",
                if by_range {
                    "`range_max_m` (m)"
                } else {
                    "`azimuth_rad` and `width_rad` (the full width, rad, not degrees)"
                },
                one.words("`sensor_pose`", "sensor_yaw")
            );
            Some(one.fault(Code::FieldOfView, says, change))
        }
        WrongView::TooFar { within_m } => {
            let says = format!(
                "it describes a field of view of {declared}, and 19 of 20 detections are within {within_m:.0} m"
            );
            let change = "`range_max_m` of its sensor description is in metres, and as far as it detects: objects beyond that are gone soon, because \
                          they count as missed";
            Some(one.note(Code::FieldOfView, says, change))
        }
    }
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
            "Either the origin is the wrong way round, or the positions are: look up the place. If it is the origin, exchange `latitude_deg` and \
             `longitude_deg` {}. If it is the positions, {} the {first} as x and the {second} as y, or write {setting}",
            one.table(),
            one.words("send", "write")
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
