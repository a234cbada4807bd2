//! Another unit of length than the metre, by what an agent reports alone: by sizes, speeds and what it says of its errors.

use super::super::finding::{Code, Finding};
use super::super::paces::WrongPaces;
use super::one::One;
use super::writing::far_from_sensor;

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    pub(super) name: &'static str,
    /// So many are a metre.
    per_m: f64,
}

const UNITS: [Unit; 4] = [
    Unit { name: "feet", per_m: 1.0 / 0.3048 },
    Unit { name: "decimetres", per_m: 10.0 },
    Unit { name: "centimetres", per_m: 100.0 },
    Unit { name: "millimetres", per_m: 1000.0 },
];
/// Sizes of vehicles are within such a factor of a unit; of people and two-wheelers, of whom boxes differ more; and what is said of
/// errors, of which less is known.
const VEHICLES: f64 = 1.2;
const OTHERS: f64 = 1.7;
const SIGMAS: f64 = 2.5;
/// Speeds are within such a factor: in between there may be two. Of feet they are those of a motorway.
const SPEEDS: f64 = 3.0;

/// Images are no wider or higher.
const MOST_PIXELS: f64 = 8_192.0;
/// The middle of an image is so far from its corner, as a part of what is seen.
const OFF_ORIGIN: f64 = 0.25;

fn nearest(factor: f64, within: f64) -> impl Iterator<Item = Unit> {
    UNITS.into_iter().filter(move |unit| factor <= unit.per_m * within && unit.per_m <= factor * within)
}

/// The unit of things that are so many times too large; `None` of none.
pub(super) fn of_sizes(factor: f64, of_vehicles: bool) -> Option<Unit> {
    nearest(factor, if of_vehicles { VEHICLES } else { OTHERS }).next()
}

/// The unit of standard deviations that are so many times what the positions scatter by; `None` of none. Few times as much is no unit.
pub(super) fn of_sigmas(times: f64) -> Option<Unit> {
    nearest(times, SIGMAS).find(|unit| unit.per_m >= 100.0)
}

/// Whether its positions can be those of an image: these are about its middle, and a map's are about its origin.
fn may_be_image(one: &One<'_>) -> bool {
    let extent = one.survey.writing.extent;
    extent.is_some_and(|axes| {
        axes.iter().all(|(least, most)| {
            let (middle, spread) = (f64::midpoint(*least, *most), most - least);
            *most <= MOST_PIXELS && middle >= OFF_ORIGIN * spread
        })
    })
}

/// Everything that it sees is too fast for metres.
pub(super) fn too_fast(one: &One<'_>) -> Option<Finding> {
    let WrongPaces { speed_mps, factor, n } = one.survey.paces.wrong()?;
    let sizes = one.survey.sizes.wrong();
    let by_size =
        sizes.and_then(|sizes| of_sizes(libm::sqrt(sizes.factors[0] * sizes.factors[1]), sizes.of_vehicles));
    let by_speed: Vec<_> =
        nearest(factor, SPEEDS).filter(|unit| unit.per_m >= 10.0).map(|unit| unit.name).collect();
    let is_image = by_size.is_none() && may_be_image(one);
    // That nothing is seen so far away is the surer sign.
    if is_image && far_from_sensor(one).is_some() {
        return None;
    }
    let (what, unit) = match (by_size, &by_speed[..]) {
        (Some(unit), _) => ("positions and sizes", unit.name.to_owned()),
        (None, []) => ("positions", "another unit than metres".to_owned()),
        (None, _) if is_image => ("positions", "pixels of an image, or another unit than metres".to_owned()),
        (None, names) => ("positions", format!("{}, as it looks", names.join(" or "))),
    };
    let size = sizes.filter(|_| by_size.is_some()).map(|sizes| {
        let whose = if sizes.of_vehicles { "its vehicles" } else { "people and two-wheelers" };
        let [w, d] = sizes.mean_m;
        format!("{whose} would be {w:.1} m wide and {d:.1} m long in the mean, and ")
    });
    let says = format!(
        "its {what} are in {unit}, and are read as metres: {}what moves would have {speed_mps:.0} m/s ({:.0} km/h) in the middle of {n} \
         detections",
        size.unwrap_or_default(),
        3.6 * speed_mps
    );
    let change = format!(
        "{} metres, also for sizes, standard deviations and {}. If the unit is right: are x and y pixels, and are its times those of capture?",
        one.words("Send `x` and `y` in", "Write in the columns x and y"),
        one.words("the place in `sensor_pose`", "sensor_x and sensor_y")
    );
    Some(one.fault(Code::LengthUnit, says, change))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_has_the_name_of_the_unit_that_it_is_near() {
        let of_vehicles = |factor: f64| of_sizes(factor, true).map(|unit| unit.name);
        assert_eq!(
            [1.8, 3.3, 5.0, 9.0, 30.0, 104.0, 1000.0].map(of_vehicles),
            [None, Some("feet"), None, Some("decimetres"), None, Some("centimetres"), Some("millimetres")]
        );
        let of_sigmas = |times: f64| of_sigmas(times).map(|unit| unit.name);
        assert_eq!(
            [3.0, 12.0, 60.0, 1500.0].map(of_sigmas),
            [None, None, Some("centimetres"), Some("millimetres")]
        );
    }
}
