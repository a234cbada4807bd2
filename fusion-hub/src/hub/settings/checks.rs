//! The ranges of what is assumed, for all agents and for single ones.

use crate::fusion::SettingsError;
use crate::fusion::table::within;
use crate::values::SensingDefaults;
use v2x_common::wire::json::ReportDefaults;

pub(super) fn check_sensing(sensing: &SensingDefaults) -> Result<(), SettingsError> {
    within("sensing.detection_probability", sensing.detection_probability, 0.01..=1.0, "0.01 to 1")?;
    within("sensing.clutter_per_m2", sensing.clutter_per_m2, 0.0..=10.0, "0 to 10")?;
    within("sensing.births_per_m2_s", sensing.births_per_m2_s, 1e-12..=10.0, "1e-12 to 10")
}

pub(super) fn check_report_defaults(defaults: &ReportDefaults) -> Result<(), SettingsError> {
    let ReportDefaults {
        sigma_position_m,
        sigma_position_per_m,
        sigma_yaw_rad,
        sigma_size_relative,
        sigma_typical_size_relative,
        ..
    } = *defaults;
    within("report_defaults.sigma_position_m", sigma_position_m, 1e-3..=70.0, "0.001 to 70")?;
    within("report_defaults.sigma_position_per_m", sigma_position_per_m, 0.0..=1.0, "0 to 1")?;
    within("report_defaults.sigma_yaw_rad", sigma_yaw_rad, 1e-4..=7.0, "0.0001 to 7")?;
    within("report_defaults.sigma_size_relative", sigma_size_relative, 1e-3..=1.0, "0.001 to 1")?;
    let typical = sigma_typical_size_relative;
    within("report_defaults.sigma_typical_size_relative", typical, 1e-3..=1.0, "0.001 to 1")
}
