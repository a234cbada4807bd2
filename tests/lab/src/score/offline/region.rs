//! Where the truth of a log is complete. Outside of it nothing counts, neither false objects nor misses.

/// The region of a truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Between two corners, m.
    Rectangle {
        /// South-west.
        min: [f64; 2],
        /// North-east.
        max: [f64; 2],
    },
    /// Within this of any sensor, where that was at the time, m.
    AroundSensors {
        /// The distance.
        radius_m: f64,
    },
}

impl Region {
    /// Whether a place is in it, by the sensors' places (m).
    pub(crate) fn contains(&self, at: [f64; 2], mut sensors: impl Iterator<Item = [f64; 2]>) -> bool {
        match self {
            Self::Rectangle { min, max } => (0..2).all(|axis| at[axis] >= min[axis] && at[axis] <= max[axis]),
            Self::AroundSensors { radius_m } => {
                sensors.any(|sensor| libm::hypot(at[0] - sensor[0], at[1] - sensor[1]) <= *radius_m)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_is_a_rectangle_or_what_is_near_any_sensor() {
        let rectangle = Region::Rectangle { min: [-1.0, 0.0], max: [1.0, 5.0] };
        let none = || [].into_iter();
        assert!(rectangle.contains([1.0, 5.0], none()) && !rectangle.contains([0.0, -0.1], none()));
        let around = Region::AroundSensors { radius_m: 5.0 };
        let sensors = || [[0.0, 0.0], [100.0, 0.0]].into_iter();
        assert!(around.contains([103.0, 4.0], sensors()) && !around.contains([50.0, 0.0], sensors()));
        assert!(!around.contains([0.0, 0.0], none()), "no sensor's place is known");
    }
}
