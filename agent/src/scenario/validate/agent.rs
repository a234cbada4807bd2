//! One agent of a scenario.

use std::f64::consts::TAU;

use v2x_common::id::AgentId;
use v2x_common::sensor::{FieldOfView, SensorKind};

use super::field::Field;
use super::station::{Placing, Surroundings};
use super::{link, noise, pose, sending, station};
use crate::scenario::config::AgentConfig;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlAgent, TomlFieldOfView};
use crate::sending::SendingConfig;
use crate::sensor::SensorConfig;
use crate::timing::Rate;

const DEFAULT_RATE_HZ: f64 = 10.0;
const DEFAULT_RANGE_M: f64 = 60.0;
/// A vehicle's own body hides what is nearer.
const DEFAULT_VEHICLE_BLIND_ZONE_M: f64 = 2.5;
const DEFAULT_DETECTION_PROBABILITY: f64 = 0.95;

pub(super) fn agent(
    field: &Field<'_>,
    file: TomlAgent,
    surroundings: &Surroundings,
) -> Result<AgentConfig, ScenarioError> {
    let id = AgentId::new(&file.id);
    let id = id.map_err(|cause| field.child("id").error(format_args!("{:?}", file.id), cause))?;
    let kind = file.kind;
    let placing = Placing { pose: file.pose, route: file.route, ride: file.ride, waypoints: file.waypoints };
    let station = station::station(field, placing, kind, surroundings)?;
    let rate_hz = file.rate_hz.unwrap_or(DEFAULT_RATE_HZ);
    let rate = Rate::from_hz(rate_hz).ok_or_else(|| field.child("rate_hz").error(rate_hz, "0.1 to 1000"))?;
    let field_of_view = field_of_view(&field.child("field_of_view"), &file.field_of_view, kind)?;
    let noise = noise::noise(&field.child("noise"), file.noise, field_of_view.range_max_m)?;
    let p = file.detection_probability.unwrap_or(DEFAULT_DETECTION_PROBABILITY);
    field.number("detection_probability", p, (0.0..=1.0).contains(&p), "0 to 1")?;
    let clutter = file.clutter_per_frame.unwrap_or(file.profile.clutter_per_frame());
    field.number("clutter_per_frame", clutter, (0.0..=100.0).contains(&clutter), "0 to 100")?;
    let (link, links_pose_error) = link::link(&field.child("link"), file.link)?;
    let pose_error = file.pose_error.map(|error| pose::pose_error(&field.child("pose_error"), &error));
    let sensor = SensorConfig {
        agent: id,
        kind,
        map_frame: surroundings.map_frame,
        rate,
        phase: sending::phase(field, "phase_ms", file.phase_ms)?,
        clock: sending::clock(&field.child("clock"), &file.clock)?,
        pose_error: pose_error.transpose()?.or(links_pose_error),
        profile: file.profile,
        noise,
        field_of_view,
        detection_probability: p,
        clutter_per_frame: clutter,
        accuracy: pose::accuracy(&field.child("accuracy"), &file.accuracy, kind)?,
    };
    let sending = SendingConfig {
        sensing: sending::sensing(field, file.sensing_ms)?,
        transmit: sending::transmit(&field.child("transmit"), file.transmit)?,
        rule: sending::rule(file.send),
        link,
    };
    Ok(AgentConfig { station, sensor, sending })
}

fn field_of_view(
    field: &Field<'_>,
    file: &TomlFieldOfView,
    kind: SensorKind,
) -> Result<FieldOfView, ScenarioError> {
    let blind_zone_m = match kind {
        SensorKind::Vehicle => DEFAULT_VEHICLE_BLIND_ZONE_M,
        SensorKind::RoadsideUnit => 0.0,
    };
    let min = file.range_min_m.unwrap_or(blind_zone_m);
    let max = file.range_max_m.unwrap_or(DEFAULT_RANGE_M);
    field.number("range_min_m", min, min >= 0.0, "0 or more")?;
    field.number("range_max_m", max, max > min && max <= 1000.0, "more than range_min_m, at most 1000")?;
    let azimuth_deg = file.azimuth_deg.unwrap_or(0.0);
    field.number("azimuth_deg", azimuth_deg, azimuth_deg.abs() <= 360.0, "-360 to 360")?;
    let width_deg = file.width_deg.unwrap_or(360.0);
    field.number(
        "width_deg",
        width_deg,
        width_deg > 0.0 && width_deg <= 360.0,
        "more than 0, at most 360",
    )?;
    Ok(FieldOfView {
        range_min_m: min,
        range_max_m: max,
        azimuth_rad: azimuth_deg.to_radians(),
        width_rad: width_deg.to_radians().min(TAU),
    })
}
