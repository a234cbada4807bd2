//! What an agent declares about its sensor: field of view, detection probability, clutter, errors of sizes.

use crate::class::Class;
use crate::geometry::{BevBox, Pose};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The carrier of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// A vehicle: it drives, and is itself an object that other agents detect.
    Vehicle,
    /// A roadside unit: it stands, and its pose is surveyed.
    RoadsideUnit,
}

impl SensorKind {
    /// The name in JSON and TOML.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle",
            Self::RoadsideUnit => "roadside-unit",
        }
    }
}

/// The annular sector in which a sensor detects objects, relative to its pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldOfView {
    /// Smallest range, m. Nearer is the blind zone, which contains the carrier's own body.
    #[serde(default)]
    pub range_min_m: f64,
    /// Largest range, m.
    pub range_max_m: f64,
    /// Direction of the sector's middle, relative to the sensor's heading, rad.
    #[serde(default)]
    pub azimuth_rad: f64,
    /// Full width of the sector, rad; 2π all around.
    #[serde(default = "full_turn")]
    pub width_rad: f64,
}

fn full_turn() -> f64 {
    2.0 * PI
}

impl FieldOfView {
    /// All around, from `range_min_m` to `range_max_m`.
    pub const fn omnidirectional(range_min_m: f64, range_max_m: f64) -> Self {
        Self { range_min_m, range_max_m, azimuth_rad: 0.0, width_rad: 2.0 * PI }
    }

    /// Whether a point (m) is in the field of view of a sensor at `pose`.
    pub fn contains(&self, pose: &Pose, x: f64, y: f64) -> bool {
        self.contains_within(pose, x, y, 0.0)
    }

    /// Whether the point (m) is at least `margin_m` inside of every border of the field of view.
    pub fn contains_within(&self, pose: &Pose, x: f64, y: f64, margin_m: f64) -> bool {
        let range = pose.distance_to(x, y);
        if range < self.range_min_m + margin_m || range > self.range_max_m - margin_m {
            return false;
        }
        if self.width_rad >= 2.0 * PI {
            return true;
        }
        let off_axis = (crate::geometry::wrap_angle(pose.bearing_to(x, y) - self.azimuth_rad)).abs();
        let slack = self.width_rad / 2.0 - off_axis;
        // Distance to the sector's straight border, where that border is the nearest.
        slack >= 0.0 && (slack >= PI / 2.0 || range * libm::sin(slack) >= margin_m)
    }

    /// Area, m².
    pub fn area_m2(&self) -> f64 {
        let ring = self.range_max_m * self.range_max_m - self.range_min_m * self.range_min_m;
        ring * self.width_rad.min(2.0 * PI) / 2.0
    }
}

/// Multiplicative size noise: measured = factor × true, factor from a normal of mean 1 truncated below
/// (eq. 5-6 of the paper, with its soft clipping).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SizeNoiseLaw {
    /// Standard deviation of the normal before truncation.
    pub sigma: f64,
    /// Smallest factor.
    pub lower: f64,
}

/// The body of a vehicle agent around its pose, with which it reports itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Class of the vehicle.
    pub class: Class,
    /// Width, m.
    pub w: f64,
    /// Depth, m.
    pub d: f64,
}

impl Body {
    /// The body as a box, centred on the pose.
    pub fn at(&self, pose: &Pose) -> BevBox {
        BevBox { x: pose.x, y: pose.y, w: self.w, d: self.d, yaw: pose.yaw }
    }
}

/// Accuracy of an agent's pose and clock (1 σ).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accuracy {
    /// Of the pose's position, m.
    pub position_m: f64,
    /// Of the pose's heading, rad.
    pub yaw_rad: f64,
    /// Of the clock, s.
    pub clock_s: f64,
}

/// What an agent publishes about its sensor, at its start and every second (`…/agent/{agent}/sensor`).
///
/// Of an agent without description the hub learns what it can.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorDescription {
    /// Increases when the description changes; detection frames name the revision that holds for them.
    pub revision: u32,
    /// The carrier of the sensor.
    pub kind: SensorKind,
    /// Where it detects objects.
    pub field_of_view: FieldOfView,
    /// Probability that an object in the field of view is reported in a frame.
    pub detection_probability: f64,
    /// Expected false reports in a frame, per m² of the field of view.
    pub clutter_per_m2: f64,
    /// Law of the errors of sizes, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_noise: Option<SizeNoiseLaw>,
    /// The vehicle's body; `None` for a roadside unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<Body>,
    /// Accuracy of pose and clock.
    pub accuracy: Accuracy,
    /// Frames per second.
    pub rate_hz: f64,
}

/// A number in a sensor description that is not finite or outside of its limits.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("sensor description: {field} is {value}, expected {expected}")]
pub struct InvalidDescription {
    /// The field's name.
    pub field: &'static str,
    /// The value found, in SI units.
    pub value: f64,
    /// The allowed range.
    pub expected: &'static str,
}

impl SensorDescription {
    /// Checks that every number is finite and within its limits. The error is of the first that is not.
    pub fn validate(&self) -> Result<(), InvalidDescription> {
        let check = |field, value: f64, ok: bool, expected| {
            if ok && value.is_finite() { Ok(()) } else { Err(InvalidDescription { field, value, expected }) }
        };
        let fov = &self.field_of_view;
        check("field_of_view.range_min_m", fov.range_min_m, fov.range_min_m >= 0.0, "0 or more")?;
        check(
            "field_of_view.range_max_m",
            fov.range_max_m,
            fov.range_max_m > fov.range_min_m && fov.range_max_m <= 10_000.0,
            "more than range_min_m, at most 10000",
        )?;
        check("field_of_view.azimuth_rad", fov.azimuth_rad, fov.azimuth_rad.abs() <= 2.0 * PI, "-2π to 2π")?;
        let width_ok = fov.width_rad > 0.0 && fov.width_rad <= 2.0 * PI + 1e-9;
        check("field_of_view.width_rad", fov.width_rad, width_ok, "more than 0, at most 2π")?;
        let p = self.detection_probability;
        check("detection_probability", p, p > 0.0 && p <= 1.0, "more than 0, at most 1")?;
        check("clutter_per_m2", self.clutter_per_m2, self.clutter_per_m2 >= 0.0, "0 or more")?;
        if let Some(law) = self.size_noise {
            check("size_noise.sigma", law.sigma, (1e-3..=10.0).contains(&law.sigma), "0.001 to 10")?;
            check("size_noise.lower", law.lower, (0.0..1.0).contains(&law.lower), "0 to below 1")?;
        }
        if let Some(body) = self.body {
            check("body.w", body.w, body.w > 0.0 && body.w < 65.0, "more than 0, less than 65")?;
            check("body.d", body.d, body.d > 0.0 && body.d < 65.0, "more than 0, less than 65")?;
        }
        check("accuracy.position_m", self.accuracy.position_m, self.accuracy.position_m >= 0.0, "0 or more")?;
        check("accuracy.yaw_rad", self.accuracy.yaw_rad, self.accuracy.yaw_rad >= 0.0, "0 or more")?;
        check("accuracy.clock_s", self.accuracy.clock_s, self.accuracy.clock_s >= 0.0, "0 or more")?;
        let rate = self.rate_hz;
        check("rate_hz", rate, rate > 0.0 && rate <= 1000.0, "more than 0, at most 1000")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn description() -> SensorDescription {
        SensorDescription {
            revision: 1,
            kind: SensorKind::RoadsideUnit,
            field_of_view: FieldOfView::omnidirectional(0.0, 60.0),
            detection_probability: 0.95,
            clutter_per_m2: 1e-5,
            size_noise: None,
            body: None,
            accuracy: Accuracy { position_m: 0.02, yaw_rad: 3.5e-4, clock_s: 1e-6 },
            rate_hz: 10.0,
        }
    }

    #[test]
    fn a_sector_contains_points_ahead_and_none_behind() {
        let fov = FieldOfView { range_min_m: 1.0, range_max_m: 50.0, azimuth_rad: 0.0, width_rad: PI / 2.0 };
        let pose = Pose { x: 0.0, y: 0.0, yaw: PI / 2.0 };
        assert!(fov.contains(&pose, 0.0, 20.0));
        assert!(!fov.contains(&pose, 20.0, 0.0));
        assert!(!fov.contains(&pose, 0.0, 0.5));
        assert!(!fov.contains(&pose, 0.0, 50.1));
        // 20 m ahead and 18 m to the side: 1.4 m from the border at 45°.
        assert!(fov.contains_within(&pose, 18.0, 20.0, 1.0));
        assert!(!fov.contains_within(&pose, 18.0, 20.0, 2.0));
    }

    #[test]
    fn the_area_is_that_of_the_ring_sector() {
        let fov = FieldOfView { range_min_m: 0.0, range_max_m: 2.0, azimuth_rad: 0.0, width_rad: PI };
        assert!((fov.area_m2() - 2.0 * PI).abs() < 1e-12);
    }

    #[test]
    fn numbers_beyond_their_limits_are_refused_by_name() {
        let mut bad = description();
        bad.detection_probability = 1.5;
        assert_eq!(bad.validate().unwrap_err().field, "detection_probability");
        let mut bad = description();
        bad.field_of_view.range_max_m = f64::NAN;
        assert_eq!(bad.validate().unwrap_err().field, "field_of_view.range_max_m");
        assert!(description().validate().is_ok());
    }

    #[test]
    fn every_number_must_be_finite() {
        type Spoil = fn(&mut SensorDescription, f64);
        let law = SizeNoiseLaw { sigma: 0.2, lower: 0.1 };
        let fields: [(&str, Spoil); 14] = [
            ("field_of_view.range_min_m", |d, value| d.field_of_view.range_min_m = value),
            ("field_of_view.range_max_m", |d, value| d.field_of_view.range_max_m = value),
            ("field_of_view.azimuth_rad", |d, value| d.field_of_view.azimuth_rad = value),
            ("field_of_view.width_rad", |d, value| d.field_of_view.width_rad = value),
            ("detection_probability", |d, value| d.detection_probability = value),
            ("clutter_per_m2", |d, value| d.clutter_per_m2 = value),
            ("size_noise.sigma", |d, value| d.size_noise.as_mut().unwrap().sigma = value),
            ("size_noise.lower", |d, value| d.size_noise.as_mut().unwrap().lower = value),
            ("body.w", |d, value| d.body.as_mut().unwrap().w = value),
            ("body.d", |d, value| d.body.as_mut().unwrap().d = value),
            ("accuracy.position_m", |d, value| d.accuracy.position_m = value),
            ("accuracy.yaw_rad", |d, value| d.accuracy.yaw_rad = value),
            ("accuracy.clock_s", |d, value| d.accuracy.clock_s = value),
            ("rate_hz", |d, value| d.rate_hz = value),
        ];
        for (field, spoil) in fields {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let body = Some(Body { class: Class::Car, w: 1.8, d: 4.5 });
                let mut bad = SensorDescription { size_noise: Some(law), body, ..description() };
                spoil(&mut bad, value);
                assert!(bad.validate().is_err_and(|error| error.field == field), "{field} = {value}");
            }
        }
    }
}
