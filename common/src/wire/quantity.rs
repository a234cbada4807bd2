//! Numbers on the wire: fixed point, and logarithmic bytes for standard deviations.

use super::WireError;
use crate::covariance::Covariance2;
use crate::geometry::wrap_angle;

/// Resolution of positions and sizes, m, and of velocities, m/s.
pub(super) const MILLI: f64 = 1e-3;
/// Resolution of headings, rad.
const YAW_STEP_RAD: f64 = 1e-4;
/// Smallest standard deviation of positions, sizes (m) and velocities (m/s).
const SIGMA_MIN: f64 = 1e-3;
/// Smallest standard deviation of headings, rad.
const SIGMA_YAW_MIN_RAD: f64 = 1e-4;
/// Ratio of neighbouring standard deviations, the 255th root of 70 000: the steps span 1 mm to 70 m, or
/// 0.1 mrad to 7 rad. They end at the limits of validation, so that rounding up never leaves these.
const SIGMA_RATIO: f64 = 1.044_721_144_087_336_7;

const fn sigma_scale() -> [f64; 256] {
    let mut scale = [1.0; 256];
    let mut i = 1;
    while i < 256 {
        scale[i] = scale[i - 1] * SIGMA_RATIO;
        i += 1;
    }
    scale
}

static SIGMA_SCALE: [f64; 256] = sigma_scale();

/// A value in whole steps, as an integer type of the wire.
pub(super) fn fixed<T: TryFrom<i64>>(field: &'static str, value: f64, step: f64) -> Result<T, WireError> {
    let steps = libm::round(value / step);
    if steps.abs() > 9e15 || steps.is_nan() {
        return Err(WireError::NotEncodable { field, value });
    }
    #[expect(clippy::cast_possible_truncation, reason = "below 2^53, checked above")]
    T::try_from(steps as i64).map_err(|_| WireError::NotEncodable { field, value })
}

/// The value of whole steps.
pub(super) fn unfixed(steps: impl Into<f64>, step: f64) -> f64 {
    steps.into() * step
}

/// Half a turn in steps, rounded; as this many steps the other way it is nearly the same direction.
const HALF_TURN_STEPS: i16 = 31_416;

/// A heading in steps; of the two numbers for (nearly) half a turn always the positive one.
pub(super) fn yaw_steps(field: &'static str, yaw_rad: f64) -> Result<i16, WireError> {
    let steps: i16 = fixed(field, wrap_angle(yaw_rad), YAW_STEP_RAD)?;
    Ok(if steps == -HALF_TURN_STEPS { HALF_TURN_STEPS } else { steps })
}

/// The heading of steps, rad in (-π, π].
pub(super) fn yaw(steps: i16) -> f64 {
    wrap_angle(unfixed(steps, YAW_STEP_RAD))
}

/// A coordinate in whole millimetres since the origin of the map frame: 1e8 m fit, and f64 keeps them exact.
#[expect(clippy::cast_precision_loss, reason = "bounded to 2^53 by validation of the value")]
pub(super) fn millimetres(steps: i64) -> f64 {
    steps as f64 * MILLI
}

/// The smallest byte whose standard deviation is not below that of the variance.
pub(super) fn sigma_byte(field: &'static str, variance: f64, smallest: f64) -> Result<u8, WireError> {
    let sigma = libm::sqrt(variance);
    // The guard keeps a decoded value on its own byte although the square root rounds.
    let relative = sigma / smallest * (1.0 - 1e-12);
    if relative.is_nan() {
        return Err(WireError::NotEncodable { field, value: variance });
    }
    let byte = SIGMA_SCALE.partition_point(|step| *step < relative);
    u8::try_from(byte).map_err(|_| WireError::NotEncodable { field, value: sigma })
}

/// The variance of a byte.
pub(super) fn variance(byte: u8, smallest: f64) -> f64 {
    let sigma = smallest * SIGMA_SCALE[usize::from(byte)];
    sigma * sigma
}

/// The byte of a standard deviation in m or m/s.
pub(super) fn metric_sigma(field: &'static str, variance: f64) -> Result<u8, WireError> {
    sigma_byte(field, variance, SIGMA_MIN)
}

/// The variance of a byte, m² or m²/s².
pub(super) fn metric_variance(byte: u8) -> f64 {
    variance(byte, SIGMA_MIN)
}

/// The byte of a standard deviation in rad.
pub(super) fn yaw_sigma(field: &'static str, variance: f64) -> Result<u8, WireError> {
    sigma_byte(field, variance, SIGMA_YAW_MIN_RAD)
}

/// The variance of a byte, rad².
pub(super) fn yaw_variance(byte: u8) -> f64 {
    variance(byte, SIGMA_YAW_MIN_RAD)
}

/// A correlation, cut toward zero to 1/128: what is claimed of dependence is never more than is known.
pub(super) fn correlation_byte(
    field: &'static str,
    covariance: f64,
    (variance_a, variance_b): (f64, f64),
) -> Result<i8, WireError> {
    if !covariance.is_finite() {
        return Err(WireError::NotEncodable { field, value: covariance });
    }
    let product = libm::sqrt(variance_a * variance_b);
    if product <= 0.0 {
        return Ok(0);
    }
    let steps = covariance / product * 128.0;
    // The nudge keeps a decoded value on its own byte although the quotient rounds.
    let nudged = steps + libm::copysign(1e-9, steps);
    #[expect(clippy::cast_possible_truncation, reason = "clamped to ±127 before the cast")]
    let byte = libm::trunc(nudged).clamp(-127.0, 127.0) as i8;
    Ok(byte)
}

/// The correlation of a byte.
pub(super) fn correlation(byte: i8) -> f64 {
    f64::from(byte.max(-127)) / 128.0
}

/// A 2×2 covariance as two standard deviations and a correlation.
pub(super) fn covariance_bytes(
    field: &'static str,
    covariance: &Covariance2,
) -> Result<(u8, u8, i8), WireError> {
    let Covariance2 { xx, xy, yy } = *covariance;
    Ok((metric_sigma(field, xx)?, metric_sigma(field, yy)?, correlation_byte(field, xy, (xx, yy))?))
}

/// The covariance of two standard deviations and a correlation.
pub(super) fn covariance((sx, sy, rho): (u8, u8, i8)) -> Covariance2 {
    let (xx, yy) = (metric_variance(sx), metric_variance(sy));
    Covariance2 { xx, xy: correlation(rho) * libm::sqrt(xx * yy), yy }
}

/// A probability as a byte.
pub(super) fn probability_byte(field: &'static str, value: f64) -> Result<u8, WireError> {
    if (0.0..=1.0).contains(&value) {
        fixed(field, value * 255.0, 1.0)
    } else {
        Err(WireError::NotEncodable { field, value })
    }
}

/// The probability of a byte.
pub(super) fn probability(byte: u8) -> f64 {
    f64::from(byte) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standard_deviation_is_rounded_up_by_at_most_4_5_percent() {
        for i in 1..2000 {
            let sigma = 1.1e-3 * f64::from(i);
            let byte = metric_sigma("s", sigma * sigma).unwrap();
            let back = libm::sqrt(metric_variance(byte));
            assert!(back >= sigma * (1.0 - 1e-9) && back <= sigma * 1.045, "{sigma} became {back}");
        }
    }

    #[test]
    fn every_byte_comes_back_as_itself() {
        for byte in 0..=255 {
            assert_eq!(metric_sigma("s", metric_variance(byte)), Ok(byte));
            assert_eq!(yaw_sigma("s", yaw_variance(byte)), Ok(byte));
            assert_eq!(probability_byte("p", probability(byte)), Ok(byte));
        }
        for byte in -127..=127 {
            assert_eq!(correlation_byte("r", correlation(byte) * 0.06, (0.3, 0.012)), Ok(byte));
        }
    }

    #[test]
    fn what_has_no_room_is_an_error() {
        assert!(metric_sigma("s", 100.0 * 100.0).is_err());
        assert!(metric_sigma("s", f64::NAN).is_err());
        assert!(correlation_byte("r", f64::NAN, (1.0, 1.0)).is_err());
        assert!(fixed::<u16>("w", 66.0, MILLI).is_err());
        assert!(fixed::<i32>("x", f64::INFINITY, MILLI).is_err());
    }

    #[test]
    fn limits_of_validation_fit_on_the_wire() {
        use crate::detection::{MAX_SIGMA_M, MAX_SIGMA_YAW_RAD, MAX_SIZE_M};
        let variance_m2 = MAX_SIGMA_M * MAX_SIGMA_M;
        let variance_rad2 = MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD;
        assert_eq!(metric_sigma("s", variance_m2), Ok(255));
        assert_eq!(yaw_sigma("s", variance_rad2), Ok(255));
        assert!(metric_variance(255) <= variance_m2 && yaw_variance(255) <= variance_rad2);
        assert!(fixed::<u16>("w", MAX_SIZE_M, MILLI).is_ok());
    }
}
