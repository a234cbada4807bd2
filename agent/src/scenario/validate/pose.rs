//! What was typed of an agent's pose: how well it says to know it, and how wrong it is.

use v2x_common::geometry::Pose;
use v2x_common::sensor::{Accuracy, SensorKind};

use super::super::ScenarioError;
use super::super::typed::{TypedAccuracy, TypedPoseError};
use super::Field;
use super::agent::MIN_SIGMA;
use crate::pose_error::PoseError;

/// What an agent of a kind declares where nothing else is told: position (m), heading (degrees), clock (ms).
const fn default_accuracy(kind: SensorKind) -> (f64, f64, f64) {
    match kind {
        // A GNSS receiver in a street, and a clock set over the cellular network.
        SensorKind::Vehicle => (0.5, 0.5, 50.0),
        // Surveyed, with a GNSS clock.
        SensorKind::RoadsideUnit => (0.02, 0.02, 1e-3),
    }
}

impl Field<'_> {
    pub(super) fn accuracy(
        &self,
        typed: &TypedAccuracy,
        kind: SensorKind,
    ) -> Result<Accuracy, ScenarioError> {
        let (position_m, yaw_deg, clock_ms) = default_accuracy(kind);
        let position_m = typed.position_m.unwrap_or(position_m);
        self.number("position_m", position_m, (MIN_SIGMA..=20.0).contains(&position_m), "0.001 to 20")?;
        let yaw_deg = typed.yaw_deg.unwrap_or(yaw_deg);
        self.number("yaw_deg", yaw_deg, (MIN_SIGMA..=180.0).contains(&yaw_deg), "0.001 to 180")?;
        let clock_ms = typed.clock_ms.unwrap_or(clock_ms);
        self.number("clock_ms", clock_ms, (1e-6..=60_000.0).contains(&clock_ms), "0.000001 to 60000")?;
        Ok(Accuracy { position_m, yaw_rad: yaw_deg.to_radians(), clock_s: clock_ms / 1e3 })
    }

    pub(super) fn pose_error(&self, typed: &TypedPoseError) -> Result<PoseError, ScenarioError> {
        let sigma = |name, value: Option<f64>, most: f64| {
            let value = value.unwrap_or(0.0);
            self.number(name, value, (0.0..=most).contains(&value), &format!("0 to {most}"))
        };
        let bias = |name, value: Option<f64>, most: f64| {
            let value = value.unwrap_or(0.0);
            self.number(name, value, value.abs() <= most, &format!("-{most} to {most}"))
        };
        Ok(PoseError {
            position_m: sigma("position_m", typed.position_m, 20.0)?,
            yaw_rad: sigma("yaw_deg", typed.yaw_deg, 180.0)?.to_radians(),
            correlation_s: sigma("correlation_s", typed.correlation_s, 3600.0)?,
            bias: Pose {
                x: bias("bias_x_m", typed.bias_x_m, 100.0)?,
                y: bias("bias_y_m", typed.bias_y_m, 100.0)?,
                yaw: bias("bias_yaw_deg", typed.bias_yaw_deg, 180.0)?.to_radians(),
            },
        })
    }
}
