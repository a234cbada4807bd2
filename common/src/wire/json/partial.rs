//! Detections as agents report them, with what they leave out.

use super::values::{covariance, variance};
use crate::class::Class;
use crate::conventions::Conversion;
use crate::covariance::{BoxCovariance, Velocity};
use crate::detection::{Detection, HeadingKind};
use crate::geometry::BevBox;
use serde::{Deserialize, Serialize};

/// Standard deviations that are assumed where a JSON frame has none. A hub has one set, and may have others for
/// single agents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportDefaults {
    /// Of x and of y, m; at the sensor, where it grows with the range.
    pub sigma_position_m: f64,
    /// Added for each metre between the sensor and the detection (the paper's σ₀ + k·d), where the sensor's pose is known.
    pub sigma_position_per_m: f64,
    /// Of a heading that was given without one, rad.
    pub sigma_yaw_rad: f64,
    /// Of a size that was given without one, relative to it.
    pub sigma_size_relative: f64,
    /// Of the class's typical size, relative to it, where no size was given.
    pub sigma_typical_size_relative: f64,
}

impl Default for ReportDefaults {
    fn default() -> Self {
        Self {
            sigma_position_m: 0.5,
            sigma_position_per_m: 0.0,
            sigma_yaw_rad: 0.175,
            sigma_size_relative: 0.2,
            sigma_typical_size_relative: 0.5,
        }
    }
}

/// Standard deviation of a heading of which nothing is known: uniform over the circle, π/√3 rad.
const SIGMA_YAW_UNKNOWN_RAD: f64 = 1.813_799_364_234_217_8;

/// A detection as an agent reports it, by the agent's own conventions: only class and position are required.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialDetection {
    /// Its class.
    pub class: Class,
    /// Position; m in the map frame, if the agent has no other convention.
    pub x: f64,
    /// The same, along the other axis.
    pub y: f64,
    /// Width, m.
    pub w: Option<f64>,
    /// Depth, m.
    pub d: Option<f64>,
    /// Heading, rad.
    pub yaw: Option<f64>,
    /// The detector's confidence, 0 to 1.
    pub score: Option<f64>,
    /// What is known of the heading.
    pub heading: Option<HeadingKind>,
    /// Standard deviations.
    pub sigma: PartialSigma,
    /// Measured velocity.
    pub velocity: Option<Velocity>,
    /// The sender's track number.
    pub source_track: Option<u64>,
}

/// Standard deviations of a [`PartialDetection`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartialSigma {
    /// Of x, m.
    pub x: Option<f64>,
    /// Of y, m; that of x where it is missing.
    pub y: Option<f64>,
    /// Correlation of x and y.
    pub rho: f64,
    /// Of the width, m.
    pub w: Option<f64>,
    /// Of the depth, m.
    pub d: Option<f64>,
    /// Of the heading, rad.
    pub yaw: Option<f64>,
}

impl PartialDetection {
    /// The detection in the map frame, with what is assumed of its agent where it leaves something out. It can have a value
    /// outside of its limits ([`Detection::validate`]).
    pub fn completed(&self, defaults: &ReportDefaults, conversion: &Conversion<'_>) -> Detection {
        let (typical_w, typical_d) = self.class.typical_size();
        let sigma = &self.sigma;
        let size = |given: Option<f64>, typical: f64, sigma: Option<f64>| {
            let relative = match given {
                Some(_) => defaults.sigma_size_relative,
                None => defaults.sigma_typical_size_relative,
            };
            let extent = given.unwrap_or(typical);
            (extent, sigma.unwrap_or(relative * extent))
        };
        let ((w, given_sigma_w), (d, given_sigma_d)) = conversion.sizes((self.w, sigma.w), (self.d, sigma.d));
        let (w, sigma_w) = size(w, typical_w, given_sigma_w);
        let (d, sigma_d) = size(d, typical_d, given_sigma_d);
        let sigma_yaw = match self.yaw {
            Some(_) => sigma.yaw.map_or(defaults.sigma_yaw_rad, |given| conversion.sigma_yaw(given)),
            None => SIGMA_YAW_UNKNOWN_RAD,
        };
        let sigma_x = sigma.x.unwrap_or_else(|| {
            let range_m = conversion.range_m(self.x, self.y).unwrap_or(0.0);
            defaults.sigma_position_m + defaults.sigma_position_per_m * range_m
        });
        let mut detection = Detection {
            class: self.class,
            score: self.score.unwrap_or(1.0),
            bev: BevBox { x: self.x, y: self.y, w, d, yaw: self.yaw.unwrap_or(0.0) },
            covariance: BoxCovariance {
                position: covariance(sigma_x, sigma.y.unwrap_or(sigma_x), sigma.rho),
                ww: variance(sigma_w),
                dd: variance(sigma_d),
                yaw: variance(sigma_yaw),
            },
            velocity: self.velocity,
            heading: self.heading.unwrap_or(match self.yaw {
                Some(_) => HeadingKind::Known,
                None => HeadingKind::Unknown,
            }),
            source_track: self.source_track,
        };
        conversion.apply(&mut detection);
        detection
    }
}
