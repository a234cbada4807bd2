//! Properties of a sensor, and how it is started.

use v2x_common::id::{AgentId, MapFrame};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorKind};
use v2x_common::time::Timestamp;

use crate::clock::ClockError;
use crate::detector::Profile;
use crate::noise::NoiseModel;
use crate::pose_error::PoseError;
use crate::timing::{Phase, Rate};

/// The sensor of one agent, with its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorConfig {
    /// The agent that carries it.
    pub agent: AgentId,
    /// Vehicle or roadside unit.
    pub kind: SensorKind,
    /// The coordinate frame that its frames name; `None`: the hub's.
    pub map_frame: Option<MapFrame>,
    /// Captures per second.
    pub rate: Rate,
    /// First capture after the start of the scenario.
    pub phase: Phase,
    /// Error of the agent's clock.
    pub clock: ClockError,
    /// Error of the agent's pose, which all parts of a frame have in common. `None`: only a vehicle's report of
    /// itself has an error, independent in each frame, by the declared accuracy.
    pub pose_error: Option<PoseError>,
    /// How the detector errs beside the noise of its measurements.
    pub profile: Profile,
    /// Errors of detections.
    pub noise: NoiseModel,
    /// Where it detects.
    pub field_of_view: FieldOfView,
    /// Probability that an object in the field of view is detected in a frame.
    pub detection_probability: f64,
    /// Mean number of false detections in a frame.
    pub clutter_per_frame: f64,
    /// Declared accuracy of the agent's pose and clock (1 σ), whether it is true or not.
    pub accuracy: Accuracy,
}

/// Why there is no such sensor.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SensorError {
    /// The world has no agent of this name.
    #[error("the world has no agent {0}")]
    NoSuchAgent(AgentId),
    /// A number that is outside of its limits.
    #[error("{field} is {value}, expected {expected}")]
    Value {
        /// The field's name.
        field: &'static str,
        /// The value found.
        value: f64,
        /// The allowed range.
        expected: &'static str,
    },
}

impl SensorConfig {
    /// Checks the numbers without which no frame can be drawn. What a scenario file says is in narrower limits.
    pub fn validate(&self) -> Result<(), SensorError> {
        let check = |field, value: f64, range: std::ops::RangeInclusive<f64>, expected| {
            if range.contains(&value) { Ok(()) } else { Err(SensorError::Value { field, value, expected }) }
        };
        let (fov, noise, not_negative) = (&self.field_of_view, &self.noise, "0 or more, finite");
        check("field_of_view.range_min_m", fov.range_min_m, 0.0..=f64::MAX, not_negative)?;
        check("field_of_view.range_max_m", fov.range_max_m, 0.0..=f64::MAX, not_negative)?;
        check("field_of_view.width_rad", fov.width_rad, 0.0..=f64::MAX, not_negative)?;
        check("detection_probability", self.detection_probability, 0.0..=1.0, "0 to 1")?;
        check("clutter_per_frame", self.clutter_per_frame, 0.0..=100.0, "0 to 100")?;
        check("noise.position_m", noise.position_m, 0.0..=f64::MAX, not_negative)?;
        check("noise.position_per_m", noise.position_per_m, 0.0..=f64::MAX, not_negative)?;
        check("noise.yaw_rad", noise.yaw_rad, 0.0..=f64::MAX, not_negative)?;
        check("noise.yaw_rad_per_m", noise.yaw_rad_per_m, 0.0..=f64::MAX, not_negative)?;
        check("noise.size.sigma", noise.size.sigma, 0.0..=10.0, "0 to 10")?;
        check("noise.size.lower", noise.size.lower, 0.0..=1.0, "0 to 1")
    }
}

/// One start of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boot {
    /// The run's seed, the same for all agents.
    pub seed: u64,
    /// The agent's boot epoch: a label of its frames, which changes no draw.
    pub epoch: u64,
    /// The time at which scenario time is 0, true Unix time.
    pub start: Timestamp,
}
