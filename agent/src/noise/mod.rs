//! Measurement noise of a sensor: standard deviations that grow with range, and the laws of the errors.

mod law;
mod level;
mod measurement;
mod model;

pub use level::{DEFAULT_SIZE_LOWER, NoiseLevel};
pub use measurement::MeasurementNoise;
pub use model::NoiseModel;
