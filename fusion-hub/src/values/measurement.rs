//! A detection as a filter takes it in.

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::detection::HeadingKind;

/// One report of one object: sizes debiased where the sensor declares a law, with variances relative to the
/// true size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Class of the detection.
    pub class: Class,
    /// Position, m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub r: Covariance2,
    /// Width and depth, m.
    pub size: [f64; 2],
    /// Variances of width and depth, relative to the squares of the true ones.
    pub relative_variance: [f64; 2],
    /// The law by which width and depth were measured, where it is declared.
    pub size_law: [Option<SizeLaw>; 2],
    /// Heading, rad.
    pub yaw: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
    /// What is known of the heading.
    pub heading: HeadingKind,
    /// Velocity, where it was measured.
    pub velocity: Option<Velocity>,
    /// Whether it is a track of the agent: its error then depends on earlier ones of that track.
    pub is_track: bool,
    /// Time since the report of the object before, s; infinite where it is not known.
    pub since_last_s: f64,
}

/// A sensor's declared law of size errors: reported = f · true, with f ~ N(1, σ²) cut off below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeLaw {
    /// σ² before the cut.
    pub variance: f64,
    /// Smallest factor.
    pub lower: f64,
    /// Mean factor, by which [`Measurement::size`] is divided.
    pub mean: f64,
    /// Squared coefficient of variation of the factor.
    pub relative_variance: f64,
}

/// Relative variance of a size up to which its law shifts it by less than 0.25 %.
const NEARLY_EXACT: f64 = 0.0025;

impl Measurement {
    /// The same with width and depth exchanged.
    pub fn exchanged(&self) -> Self {
        let swap = |[a, b]: [f64; 2]| [b, a];
        let [width_law, depth_law] = self.size_law;
        Self {
            size: swap(self.size),
            relative_variance: swap(self.relative_variance),
            size_law: [depth_law, width_law],
            ..*self
        }
    }

    /// Squared distance from a width and depth (m) with their variances (m²), χ² with 2 degrees of freedom.
    pub fn size_distance2(&self, size: [f64; 2], variance: [f64; 2]) -> f64 {
        let of_axis = |axis: usize| {
            let middle = (self.size[axis] + size[axis]) / 2.0;
            let difference = self.size[axis] - size[axis];
            difference * difference / (self.relative_variance[axis] * middle * middle + variance[axis])
        };
        of_axis(0) + of_axis(1)
    }

    /// Whether width (0) or depth (1) is to be averaged: its error is a share of the size, nobody declares its law, and it is not so
    /// accurate that the law does not matter.
    #[inline]
    pub fn is_averaged(&self, dimension: usize) -> bool {
        let is_coarse = self.relative_variance[dimension] > NEARLY_EXACT;
        is_coarse && self.size_law[dimension].is_none() && self.is_size_sigma_a_share()
    }

    /// Whether the standard deviations of width and depth are the same share of both: what a hub assumes where none is stated, and
    /// what a detector states whose errors grow with the size. Others are in metres.
    #[inline]
    fn is_size_sigma_a_share(&self) -> bool {
        /// Shares are held in single precision.
        const ROUNDING: f64 = 1e-5;
        let [width, depth] = self.relative_variance;
        (width - depth).abs() <= ROUNDING * depth
    }

    /// What was reported of width (0) or depth (1), m, with the variance of its factor before the cut, and the
    /// cut.
    #[inline]
    pub fn reported_size(&self, dimension: usize) -> (f64, f64, f64) {
        match &self.size_law[dimension] {
            Some(law) => (self.size[dimension] * law.mean, law.variance, law.lower),
            None => (self.size[dimension], self.relative_variance[dimension], 0.0),
        }
    }
}
