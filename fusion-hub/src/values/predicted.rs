//! What a track predicts that a frame measures of it.

use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;

/// The predicted measurement of a track at the time of a frame: the moments that association needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedMeasurement {
    /// Class of the track.
    pub class: Class,
    /// Position, m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub position_covariance: Covariance2,
    /// Covariance of the position for gating, m²: at least as wide.
    pub gate_covariance: Covariance2,
    /// Width and depth, m.
    pub size: [f64; 2],
    /// Variances of width and depth, m².
    pub size_variance: [f64; 2],
    /// Heading, rad.
    pub yaw: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
    /// Probability that the frame holds a detection of the track; one half where it is unknown.
    pub report_probability: f64,
    /// Where positions alone expect it, as long as they know its velocity worse than its heading seems to.
    pub by_positions: Option<ExpectedPlace>,
}

/// Where an object is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedPlace {
    /// Position, m.
    pub position: [f64; 2],
    /// Its covariance, m².
    pub covariance: Covariance2,
}

impl ExpectedPlace {
    /// An object does not move along its heading, but so that positions alone expect it, with this probability; and -2 ln of it.
    pub const SHARE: f64 = 0.02;
    /// See [`Self::SHARE`].
    pub const COST: f64 = 7.8;
}

impl PredictedMeasurement {
    /// Adds a variance (m²) to the position along each axis.
    #[inline(always)]
    pub fn widen_position(&mut self, variance: f64) {
        for covariance in [&mut self.position_covariance, &mut self.gate_covariance] {
            covariance.xx += variance;
            covariance.yy += variance;
        }
        if let Some(place) = &mut self.by_positions {
            place.covariance.xx += variance;
            place.covariance.yy += variance;
        }
    }
}
