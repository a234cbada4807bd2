//! The pose and clock of an agent: declared accuracy and actual error of the pose.

use v2x_common::geometry::Pose;
use v2x_common::sensor::{Accuracy, SensorKind};

use super::field::Field;
use crate::pose_error::PoseError;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlAccuracy, TomlPoseError};

/// Smallest σ that a scenario may ask for, in m, degrees and as a share of sizes: the wire has no zero.
pub(super) const MIN_SIGMA: f64 = 0.001;

/// The default declaration of a kind of agent: position (m), heading (degrees), clock (ms).
const fn default_accuracy(kind: SensorKind) -> (f64, f64, f64) {
    match kind {
        // A GNSS receiver in a street, and a clock set over the cellular network.
        SensorKind::Vehicle => (0.5, 0.5, 50.0),
        // Surveyed, with a GNSS clock.
        SensorKind::RoadsideUnit => (0.02, 0.02, 1e-3),
    }
}

pub(super) fn accuracy(
    field: &Field<'_>,
    file: &TomlAccuracy,
    kind: SensorKind,
) -> Result<Accuracy, ScenarioError> {
    let (position_m, yaw_deg, clock_ms) = default_accuracy(kind);
    let position_m = file.position_m.unwrap_or(position_m);
    field.number("position_m", position_m, (MIN_SIGMA..=20.0).contains(&position_m), "0.001 to 20")?;
    let yaw_deg = file.yaw_deg.unwrap_or(yaw_deg);
    field.number("yaw_deg", yaw_deg, (MIN_SIGMA..=180.0).contains(&yaw_deg), "0.001 to 180")?;
    let clock_ms = file.clock_ms.unwrap_or(clock_ms);
    field.number("clock_ms", clock_ms, (1e-6..=60_000.0).contains(&clock_ms), "0.000001 to 60000")?;
    Ok(Accuracy { position_m, yaw_rad: yaw_deg.to_radians(), clock_s: clock_ms / 1e3 })
}

pub(super) fn pose_error(field: &Field<'_>, file: &TomlPoseError) -> Result<PoseError, ScenarioError> {
    let sigma = |name, value: Option<f64>, most: f64| {
        let value = value.unwrap_or(0.0);
        field.number(name, value, (0.0..=most).contains(&value), &format!("0 to {most}"))
    };
    let bias = |name, value: Option<f64>, most: f64| {
        let value = value.unwrap_or(0.0);
        field.number(name, value, value.abs() <= most, &format!("-{most} to {most}"))
    };
    Ok(PoseError {
        position_m: sigma("position_m", file.position_m, 20.0)?,
        yaw_rad: sigma("yaw_deg", file.yaw_deg, 180.0)?.to_radians(),
        correlation_s: sigma("correlation_s", file.correlation_s, 3600.0)?,
        bias: Pose {
            x: bias("bias_x_m", file.bias_x_m, 100.0)?,
            y: bias("bias_y_m", file.bias_y_m, 100.0)?,
            yaw: bias("bias_yaw_deg", file.bias_yaw_deg, 180.0)?.to_radians(),
        },
    })
}
