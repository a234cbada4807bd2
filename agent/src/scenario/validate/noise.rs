//! The measurement noise of an agent.

use std::f64::consts::PI;

use v2x_common::sensor::SizeNoiseLaw;

use super::field::Field;
use super::pose::MIN_SIGMA;
use crate::noise::{DEFAULT_SIZE_LOWER, NoiseLevel, NoiseModel};
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlNoise, TomlNoiseNumbers};

/// Largest σ of a position at the end of the field of view, m: what is reported stays far below the wire's limit.
const MAX_POSITION_SIGMA_M: f64 = 20.0;

pub(super) fn noise(
    field: &Field<'_>,
    file: Option<TomlNoise>,
    range_max_m: f64,
) -> Result<NoiseModel, ScenarioError> {
    let model = match file {
        None => NoiseLevel::N1.model(),
        Some(TomlNoise::Level(level)) => level.model(),
        Some(TomlNoise::Numbers(numbers)) => noise_numbers(field, &numbers)?,
    };
    let sigma_m = model.position_sigma_m(range_max_m);
    if sigma_m > MAX_POSITION_SIGMA_M {
        let expected = format_args!("at most {MAX_POSITION_SIGMA_M} m there").to_string();
        return Err(field.error(format_args!("{sigma_m} m (σ of a position at range_max_m)"), expected));
    }
    let sigma_rad = model.yaw_sigma_rad(range_max_m);
    if sigma_rad > PI {
        let sigma_deg = sigma_rad.to_degrees();
        return Err(field.error(format_args!("{sigma_deg}° (σ of a heading at range_max_m)"), "at most 180°"));
    }
    Ok(model)
}

fn noise_numbers(field: &Field<'_>, file: &TomlNoiseNumbers) -> Result<NoiseModel, ScenarioError> {
    let sigma = |name, value| field.number(name, value, value >= MIN_SIGMA, "0.001 or more");
    let growth = |name, value: f64| field.number(name, value, (0.0..=0.5).contains(&value), "0 to 0.5");
    let size = field.number("size", file.size, (MIN_SIGMA..=3.0).contains(&file.size), "0.001 to 3")?;
    let lower = file.size_lower.unwrap_or(DEFAULT_SIZE_LOWER);
    field.number("size_lower", lower, (0.01..1.0).contains(&lower), "0.01 to below 1")?;
    Ok(NoiseModel {
        position_m: sigma("position_m", file.position_m)?,
        position_per_m: growth("position_per_m", file.position_per_m)?,
        yaw_rad: sigma("yaw_deg", file.yaw_deg)?.to_radians(),
        yaw_rad_per_m: growth("yaw_deg_per_m", file.yaw_deg_per_m)?.to_radians(),
        size: SizeNoiseLaw { sigma: size, lower },
    })
}
