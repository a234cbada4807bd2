//! One agent.

use serde::Deserialize;
use v2x_common::sensor::SensorKind;

use crate::detector::Profile;

use super::link::TomlLink;
use super::noise::TomlNoise;
use super::sending::{TomlPhase, TomlSend, TomlSensing, TomlTransmit};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlAgent {
    pub(in crate::scenario) id: String,
    pub(in crate::scenario) kind: SensorKind,
    pub(in crate::scenario) pose: Option<TomlPose>,
    pub(in crate::scenario) route: Option<String>,
    pub(in crate::scenario) ride: Option<String>,
    pub(in crate::scenario) waypoints: Option<Vec<[f64; 3]>>,
    pub(in crate::scenario) rate_hz: Option<f64>,
    pub(in crate::scenario) phase_ms: Option<TomlPhase>,
    #[serde(default)]
    pub(in crate::scenario) clock: TomlClock,
    pub(in crate::scenario) pose_error: Option<TomlPoseError>,
    #[serde(default)]
    pub(in crate::scenario) profile: Profile,
    pub(in crate::scenario) noise: Option<TomlNoise>,
    #[serde(default)]
    pub(in crate::scenario) field_of_view: TomlFieldOfView,
    pub(in crate::scenario) detection_probability: Option<f64>,
    pub(in crate::scenario) clutter_per_frame: Option<f64>,
    // The alias is its previous name.
    #[serde(alias = "self_report", default)]
    pub(in crate::scenario) accuracy: TomlAccuracy,
    pub(in crate::scenario) sensing_ms: Option<TomlSensing>,
    pub(in crate::scenario) transmit: Option<TomlTransmit>,
    pub(in crate::scenario) send: Option<TomlSend>,
    #[serde(default)]
    pub(in crate::scenario) link: TomlLink,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlPose {
    pub(in crate::scenario) x: f64,
    pub(in crate::scenario) y: f64,
    #[serde(default)]
    pub(in crate::scenario) yaw_deg: f64,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlFieldOfView {
    pub(in crate::scenario) range_min_m: Option<f64>,
    pub(in crate::scenario) range_max_m: Option<f64>,
    pub(in crate::scenario) azimuth_deg: Option<f64>,
    pub(in crate::scenario) width_deg: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlAccuracy {
    pub(in crate::scenario) position_m: Option<f64>,
    pub(in crate::scenario) yaw_deg: Option<f64>,
    pub(in crate::scenario) clock_ms: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlClock {
    pub(in crate::scenario) offset_ms: Option<f64>,
    pub(in crate::scenario) drift_ppm: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlPoseError {
    pub(in crate::scenario) position_m: Option<f64>,
    pub(in crate::scenario) yaw_deg: Option<f64>,
    pub(in crate::scenario) correlation_s: Option<f64>,
    pub(in crate::scenario) bias_x_m: Option<f64>,
    pub(in crate::scenario) bias_y_m: Option<f64>,
    pub(in crate::scenario) bias_yaw_deg: Option<f64>,
}
