//! Plane geometry of the map frame: metres, x east, y north; yaw in radians, counter-clockwise from x.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// An angle in radians brought into (-π, π].
///
/// Of a number that is not finite the result is not finite.
#[inline]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    // Most angles are in the interval already. Near its open end the quotient below can round to a whole turn.
    const SURELY_ABOVE_MINUS_PI: f64 = -(PI - 1e-6);
    if angle_rad > SURELY_ABOVE_MINUS_PI && angle_rad <= PI {
        // Negative zero becomes zero, as by the subtraction below.
        return angle_rad + 0.0;
    }
    wrap_by_turns(angle_rad)
}

fn wrap_by_turns(angle_rad: f64) -> f64 {
    let wrapped = angle_rad - TAU * libm::ceil((angle_rad - PI) / TAU);
    // Rounding of the quotient can leave the result one turn or one ulp outside of the interval.
    if wrapped <= -PI {
        wrapped + TAU
    } else if wrapped > PI {
        wrapped - TAU
    } else {
        wrapped
    }
}

/// The signed turn from `from` to `to` in (-π, π], radians.
pub fn angle_difference(to: f64, from: f64) -> f64 {
    wrap_angle(to - from)
}

/// Position (m) and heading (rad) in the map frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// East, m.
    pub x: f64,
    /// North, m.
    pub y: f64,
    /// Counter-clockwise from x, rad.
    #[serde(default)]
    pub yaw: f64,
}

impl Pose {
    /// Distance in the plane to a point, m.
    pub fn distance_to(&self, x: f64, y: f64) -> f64 {
        libm::sqrt((x - self.x) * (x - self.x) + (y - self.y) * (y - self.y))
    }

    /// Direction to a point, relative to the heading, rad in (-π, π].
    pub fn bearing_to(&self, x: f64, y: f64) -> f64 {
        angle_difference(libm::atan2(y - self.y, x - self.x), self.yaw)
    }

    /// A point given ahead (m) and to the left (m) of this pose, in the map frame.
    pub fn offset(&self, ahead: f64, left: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.yaw);
        (self.x + ahead * cos - left * sin, self.y + ahead * sin + left * cos)
    }
}

/// A bird's-eye-view box as in eq. (1) of the paper: z = [x y w d θ].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BevBox {
    /// Centre, east, m.
    pub x: f64,
    /// Centre, north, m.
    pub y: f64,
    /// Width: extent across the heading, m.
    pub w: f64,
    /// Depth: extent along the heading, m.
    pub d: f64,
    /// Heading θ, rad in (-π, π].
    pub yaw: f64,
}

impl BevBox {
    /// The four corners (m), counter-clockwise from the front left one.
    pub fn corners(&self) -> [(f64, f64); 4] {
        let pose = self.pose();
        let (ahead, left) = (self.d / 2.0, self.w / 2.0);
        [
            pose.offset(ahead, left),
            pose.offset(-ahead, left),
            pose.offset(-ahead, -left),
            pose.offset(ahead, -left),
        ]
    }

    /// Whether the point (m) is in the box or on its edge.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let (sin, cos) = libm::sincos(self.yaw);
        let (dx, dy) = (x - self.x, y - self.y);
        (dx * cos + dy * sin).abs() <= self.d / 2.0 && (dy * cos - dx * sin).abs() <= self.w / 2.0
    }

    /// Centre and heading.
    pub fn pose(&self) -> Pose {
        Pose { x: self.x, y: self.y, yaw: self.yaw }
    }

    /// Radius of the circle around the box, m.
    pub fn circumradius(&self) -> f64 {
        libm::sqrt(self.w * self.w + self.d * self.d) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn wraps_the_ends_of_the_interval() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert_eq!(wrap_angle(3.0 * PI), PI);
        assert_eq!(wrap_angle(0.0), 0.0);
        assert!(wrap_angle(f64::NAN).is_nan());
    }

    #[test]
    fn the_fast_path_gives_the_same_bits_as_the_general_one() {
        let in_steps = (-31_420..=31_420).map(|steps| f64::from(steps) * 1e-4);
        let ends = [PI, -PI, 1e-6 - PI, 0.0, -0.0, f64::MIN_POSITIVE, 5e-324];
        let angles = in_steps.chain(ends).flat_map(|angle| [angle, angle.next_up(), angle.next_down()]);
        for angle in angles {
            assert_eq!(wrap_angle(angle).to_bits(), wrap_by_turns(angle).to_bits(), "{angle:e}");
        }
    }

    #[test]
    fn a_difference_of_angles_is_the_shorter_turn() {
        let turn = angle_difference(-PI + 0.1, PI - 0.1);
        assert!((turn - 0.2).abs() < 1e-12, "{turn}");
    }

    #[test]
    fn corners_run_counter_clockwise_from_the_front_left() {
        let bev = BevBox { x: 1.0, y: 2.0, w: 2.0, d: 4.0, yaw: 0.0 };
        assert_eq!(bev.corners(), [(3.0, 3.0), (-1.0, 3.0), (-1.0, 1.0), (3.0, 1.0)]);
        assert!(bev.contains(3.0, 3.0) && !bev.contains(3.1, 2.0));
    }

    #[test]
    fn bearing_is_relative_to_the_heading() {
        let pose = Pose { x: 0.0, y: 0.0, yaw: PI / 2.0 };
        assert!((pose.bearing_to(1.0, 0.0) + PI / 2.0).abs() < 1e-12);
        assert_eq!(pose.distance_to(3.0, 4.0), 5.0);
    }

    proptest! {
        #[test]
        fn a_wrapped_angle_is_in_range_and_the_same_direction(angle in -1e6..1e6f64) {
            let wrapped = wrap_angle(angle);
            prop_assert!(wrapped > -PI && wrapped <= PI);
            prop_assert!((libm::sin(wrapped) - libm::sin(angle)).abs() < 1e-8);
            prop_assert!((libm::cos(wrapped) - libm::cos(angle)).abs() < 1e-8);
        }
    }
}
