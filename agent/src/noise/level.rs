//! The paper's three levels of noise.

use v2x_common::sensor::SizeNoiseLaw;

use super::model::NoiseModel;

/// Growth of the position's σ with range, m per m (paper, section II).
const POSITION_PER_M: f64 = 0.01;
/// Growth of the heading's σ with range, degrees per m (paper, section II).
const YAW_DEG_PER_M: f64 = 0.1;
/// Smallest size factor; the paper names none, 0.05 to 0.1 fits its tables (deploy/docs/methods.md).
pub const DEFAULT_SIZE_LOWER: f64 = 0.1;

/// The paper's three levels of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseLevel {
    /// 0.2 m, 0.2°, sizes 20 %.
    N1,
    /// 0.5 m, 5°, sizes 50 %.
    N2,
    /// 1 m, 10°, sizes 100 %.
    N3,
}

impl NoiseLevel {
    /// The level's name in scenario files.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "N1" => Some(Self::N1),
            "N2" => Some(Self::N2),
            "N3" => Some(Self::N3),
            _ => None,
        }
    }

    /// The level's numbers (paper, table I).
    pub fn model(self) -> NoiseModel {
        let (position_m, yaw_deg, size) = match self {
            Self::N1 => (0.2, 0.2, 0.2),
            Self::N2 => (0.5, 5.0, 0.5),
            Self::N3 => (1.0, 10.0, 1.0),
        };
        NoiseModel {
            position_m,
            position_per_m: POSITION_PER_M,
            yaw_rad: f64::to_radians(yaw_deg),
            yaw_rad_per_m: f64::to_radians(YAW_DEG_PER_M),
            size: SizeNoiseLaw { sigma: size, lower: DEFAULT_SIZE_LOWER },
        }
    }
}
