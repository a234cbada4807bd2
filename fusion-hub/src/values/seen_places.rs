//! Where about itself a sensor has detected anything: its silence says something there, and little elsewhere.
//!
//! A sensor that describes nothing may see one street of several, or not round a corner. A circle about it, as far as it detects,
//! is too much: what others report behind a wall it would take from them.

use serde::{Deserialize, Serialize};
use v2x_common::geometry::Pose;

/// Cells of a map about the sensor, along each axis, and their size, m.
const CELLS: usize = 32;
const CELL_M: f64 = 12.0;
/// A detection shows that a place so near, along an axis, is seen, m.
const NEAR_M: f64 = 12.0;
/// How probable it is that a place is in view where nothing was ever detected.
const SEES_ELSEWHERE: f64 = 0.3;

/// A map of a sensor's surroundings, in its own frame: whether it has detected anything in a cell. What lies outside belongs to the cell
/// at the border.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeenPlaces {
    rows: [u32; CELLS],
}

/// The cell that a coordinate (m) is in.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the cells")]
fn cell(coordinate: f64) -> usize {
    (coordinate / CELL_M + (CELLS / 2) as f64).clamp(0.0, (CELLS - 1) as f64) as usize
}

/// A sensor's own frame at one time: computed once for all places that are looked up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorAxes {
    origin: [f64; 2],
    sin: f64,
    cos: f64,
}

impl SensorAxes {
    /// Of a sensor with this pose.
    pub fn of(pose: &Pose) -> Self {
        let (sin, cos) = libm::sincos(pose.yaw);
        Self { origin: [pose.x, pose.y], sin, cos }
    }

    /// A place in the map frame (m) as the sensor has it, m.
    #[inline]
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self { origin, sin, cos } = self;
        let (dx, dy) = (x - origin[0], y - origin[1]);
        [cos * dx + sin * dy, cos * dy - sin * dx]
    }
}

/// What a sensor has seen, from where it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenFrom {
    places: SeenPlaces,
    axes: SensorAxes,
}

impl SeenFrom {
    /// How probable it is that a place (m) is in view.
    pub fn probability(&self, place: [f64; 2]) -> f64 {
        if self.hold(place) { 1.0 } else { SEES_ELSEWHERE }
    }

    /// Whether something was detected about a place, m.
    #[inline]
    pub fn hold(&self, place: [f64; 2]) -> bool {
        let [x, y] = self.axes.place(place);
        self.places.rows[cell(y)] >> cell(x) & 1 == 1
    }
}

impl SeenPlaces {
    /// Notes that a sensor has detected something at a place (m).
    #[inline]
    pub fn note(&mut self, axes: &SensorAxes, place: [f64; 2]) {
        let [x, y] = axes.place(place);
        let (first, last) = (cell(x - NEAR_M), cell(x + NEAR_M));
        let columns = u32::MAX >> (CELLS - 1 - (last - first)) << first;
        self.rows[cell(y - NEAR_M)..=cell(y + NEAR_M)].iter_mut().for_each(|row| *row |= columns);
    }

    /// As a sensor with this pose has it.
    pub fn from_pose(self, pose: &Pose) -> SeenFrom {
        SeenFrom { places: self, axes: SensorAxes::of(pose) }
    }

    /// What one or the other holds.
    #[must_use]
    pub fn or(mut self, other: &Self) -> Self {
        self.rows.iter_mut().zip(other.rows).for_each(|(row, other)| *row |= other);
        self
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> (&'static str, String) {
    (
        "seen_places",
        format!("{CELLS} cells of {CELL_M} m, within {NEAR_M} m; elsewhere in view with {SEES_ELSEWHERE}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    /// What is seen from a pose after a detection.
    fn after(pose: &Pose, place: [f64; 2]) -> SeenPlaces {
        let mut seen = SeenPlaces::default();
        seen.note(&SensorAxes::of(pose), place);
        seen
    }

    #[test]
    fn a_place_is_seen_about_a_detection_and_not_a_street_away() {
        let pose = Pose { x: 100.0, y: -40.0, yaw: 0.0 };
        let nothing = SeenPlaces::default().from_pose(&pose);
        assert_eq!(nothing.probability([120.0, -40.0]), SEES_ELSEWHERE);
        let seen = after(&pose, [120.0, -40.0]).from_pose(&pose);
        assert!(seen.hold([120.0, -40.0]) && seen.hold([125.0, -36.0]));
        assert!(!seen.hold([120.0, -4.0]) && !seen.hold([80.0, -40.0]));
        assert_eq!(seen.probability([120.0, -40.0]), 1.0);
    }

    #[test]
    fn places_move_and_turn_with_the_sensor() {
        let seen = after(&Pose { x: 0.0, y: 0.0, yaw: 0.0 }, [30.0, 0.0]);
        // 30 m ahead, wherever it is and looks.
        let elsewhere = seen.from_pose(&Pose { x: 500.0, y: 500.0, yaw: FRAC_PI_2 });
        assert!(elsewhere.hold([500.0, 530.0]) && !elsewhere.hold([530.0, 500.0]));
    }

    proptest! {
        #[test]
        fn what_is_within_a_few_metres_of_a_detection_is_seen_at_any_distance(
            sensor in ([-300.0..300.0_f64, -300.0..300.0], -3.2..3.2_f64),
            place in [-1e4..1e4_f64, -1e4..1e4],
            off in [-8.0..8.0_f64, -8.0..8.0],
        ) {
            let pose = Pose { x: sensor.0[0], y: sensor.0[1], yaw: sensor.1 };
            let seen = after(&pose, place).from_pose(&pose);
            prop_assert!(seen.hold([place[0] + off[0], place[1] + off[1]]));
        }
    }
}
