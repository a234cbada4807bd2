//! The ways to read a heading that was reported: as it is, turned by half a turn, or by a quarter with width and depth exchanged.

use crate::filter::Filter;
use crate::values::{HeadingLaw, Measurement};
use std::f64::consts::{FRAC_PI_2, PI};
use v2x_common::class::{Class, ClassGroup};
use v2x_common::detection::HeadingKind;
use v2x_common::geometry::{angle_difference, wrap_angle};

/// Probability that a report has width and depth exchanged.
const SWAPPED: f64 = 0.0025;
/// A report within this squared distance (χ²) is as reported: nothing else is considered.
pub(super) const NEAR: f64 = 4.0;
/// Width and depth are not taken as exchanged where they then fit worse by more than this (χ²).
const NEARLY_ALIKE: f64 = 1.0;
/// Upper limit of the cost of a size.
const SIZE_CAP: f64 = 12.0;
/// Variance of a heading of which nothing is known, rad².
const UNKNOWN_VARIANCE: f64 = 9.0;
/// Of reports with a larger one not even the axis is known: half of the variance of any axis, rad².
pub(super) const NO_AXIS: f64 = PI * PI / 24.0;

/// What the filter holds of an object.
pub(in crate::track) struct Held<'a, F> {
    pub(in crate::track) state: &'a F,
    /// The class whose motion it has.
    pub(in crate::track) class: Class,
}

/// One way to read a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) cost: f64,
    pub(super) yaw: f64,
    pub(super) is_reversed: bool,
    is_swapped: bool,
}

/// A report as it is taken under a hypothesis.
pub(super) fn taken(z: &Measurement, chosen: &Hypothesis) -> Measurement {
    let mut read = Measurement { yaw: chosen.yaw, ..*z };
    if chosen.is_swapped {
        read = read.exchanged();
    }
    read
}

/// How a report's heading is read: the likeliest way.
pub(super) fn choose<F: Filter>(z: &Measurement, held: &Held<'_, F>, odds_ln: f64) -> Hypothesis {
    let (front, front_variance) = held.state.heading();
    let variance = z.yaw_variance + front_variance;
    let distance2 = |yaw: f64| {
        let off = angle_difference(yaw, front);
        off * off / variance
    };
    let as_reported =
        Hypothesis { cost: distance2(z.yaw), yaw: z.yaw, is_reversed: false, is_swapped: false };
    let reversed_cost = 2.0 * odds_ln;
    if as_reported.cost <= NEAR.min(reversed_cost) {
        return as_reported;
    }
    let turned = wrap_angle(z.yaw + PI);
    let back = Hypothesis {
        cost: distance2(turned) + reversed_cost,
        yaw: turned,
        is_reversed: true,
        is_swapped: false,
    };
    let mut best = if back.cost < as_reported.cost { back } else { as_reported };
    if is_four_wheeled(held.class) {
        let (size, variance) = held.state.rough_size();
        let own = z.size_distance2(size, variance).min(SIZE_CAP);
        let exchanged = z.exchanged().size_distance2(size, variance).min(SIZE_CAP);
        // Where the sizes say that they are not exchanged, it is the heading that is wrong.
        let may_be_exchanged = exchanged <= own + NEARLY_ALIKE;
        for quarter in [FRAC_PI_2, -FRAC_PI_2].into_iter().filter(|_| may_be_exchanged) {
            let yaw = wrap_angle(z.yaw + quarter);
            let cost = distance2(yaw) - 2.0 * libm::log(SWAPPED) + exchanged - own;
            if cost < best.cost {
                best = Hypothesis { cost, yaw, is_reversed: false, is_swapped: true };
            }
        }
    }
    best
}

fn is_four_wheeled(class: Class) -> bool {
    matches!(class.group(), ClassGroup::FourWheeled | ClassGroup::Unknown)
}

/// A first report: of a heading of which nothing is known, and of a vehicle that is clearly wider than long, which has
/// width and depth exchanged.
pub(in crate::track) fn first_read(z: &Measurement, headings: &HeadingLaw) -> Measurement {
    if z.heading == HeadingKind::Unknown {
        return Measurement { yaw_variance: z.yaw_variance.max(UNKNOWN_VARIANCE), ..*z };
    }
    let [w, d] = z.size;
    let [rw, rd] = z.relative_variance;
    let limit = 0.26 + 3.0 * libm::sqrt(rw + rd);
    if z.class.group() == ClassGroup::FourWheeled && libm::log(w / d) > limit {
        return Measurement { yaw: wrap_angle(z.yaw + FRAC_PI_2), ..z.exchanged() };
    }
    // Whether it stands is not known yet.
    let standing = z.yaw_variance * headings.standing();
    let is_worthless = headings.standing() > 1.0 && standing > NO_AXIS;
    let yaw_variance = if is_worthless { UNKNOWN_VARIANCE.max(z.yaw_variance) } else { standing };
    Measurement { yaw_variance, ..*z }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> (&'static str, String) {
    (
        "orientation.swapped",
        format!(
            "{SWAPPED}, as reported within {NEAR}, no axis beyond {NO_AXIS:.2}, size at most {SIZE_CAP}, alike within {NEARLY_ALIKE}"
        ),
    )
}
