//! Numbers on the wire: fixed point, correlations, probabilities.

use super::error::WireError;
use super::sigma;
use crate::covariance::Covariance2;
use crate::geometry::wrap_angle;

/// Resolution of positions and sizes, m, and of velocities, m/s.
pub(super) const MILLI: f64 = 1e-3;
/// Resolution of headings, rad.
const YAW_STEP_RAD: f64 = 1e-4;

/// Cold: nearly every value fits.
#[cold]
pub(super) const fn not_encodable(field: &'static str, value: f64) -> WireError {
    WireError::NotEncodable { field, value }
}

/// The largest number below a half.
const ALMOST_HALF: f64 = 0.5_f64.next_down();

/// The nearest whole number, halves away from zero; saturates.
///
/// Adding exactly a half could round up a number just below it.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates, as documented")]
fn round(value: f64) -> i64 {
    (value + ALMOST_HALF.copysign(value)) as i64
}

/// A value in whole steps, as an integer type of the wire.
#[inline]
pub(super) fn fixed<T: TryFrom<i64>>(field: &'static str, value: f64, step: f64) -> Result<T, WireError> {
    let steps = value / step;
    let is_exact = steps.abs() <= 9e15;
    match T::try_from(round(steps)) {
        Ok(steps) if is_exact => Ok(steps),
        _ => Err(not_encodable(field, value)),
    }
}

/// The value of whole steps.
#[inline]
pub(super) fn unfixed(steps: impl Into<f64>, step: f64) -> f64 {
    steps.into() * step
}

/// A limit of validation in mm or mm/s.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, positive limits")]
pub(super) const fn milli(limit: f64) -> u64 {
    (limit * 1000.0) as u64
}

/// Half a turn in steps, rounded; as this many steps the other way it is nearly the same direction.
const HALF_TURN_STEPS: i16 = 31_416;

/// A heading in steps; of the two numbers for (nearly) half a turn always the positive one.
#[inline]
pub(super) fn yaw_steps(field: &'static str, yaw_rad: f64) -> Result<i16, WireError> {
    let steps: i16 = fixed(field, wrap_angle(yaw_rad), YAW_STEP_RAD)?;
    Ok(if steps == -HALF_TURN_STEPS { HALF_TURN_STEPS } else { steps })
}

/// The heading of steps, rad in (-π, π].
#[inline]
pub(super) fn yaw(steps: i16) -> f64 {
    wrap_angle(unfixed(steps, YAW_STEP_RAD))
}

/// A coordinate in whole millimetres since the origin of the map frame: 1e8 m fit, and f64 keeps them exact.
#[expect(clippy::cast_precision_loss, reason = "bounded to 2^53 by validation of the value")]
#[inline]
pub(super) fn millimetres(steps: i64) -> f64 {
    steps as f64 * MILLI
}

/// The byte of a standard deviation in m or m/s.
#[inline]
pub(super) fn metric_sigma(field: &'static str, variance: f64) -> Result<u8, WireError> {
    sigma::METRIC.byte(field, variance)
}

/// The variance of a byte, m² or m²/s².
#[inline]
pub(super) fn metric_variance(byte: u8) -> f64 {
    sigma::METRIC.variance(byte)
}

/// The byte of a standard deviation in rad.
#[inline]
pub(super) fn yaw_sigma(field: &'static str, variance: f64) -> Result<u8, WireError> {
    sigma::ANGULAR.byte(field, variance)
}

/// The variance of a byte, rad².
#[inline]
pub(super) fn yaw_variance(byte: u8) -> f64 {
    sigma::ANGULAR.variance(byte)
}

/// A correlation, rounded toward zero to 1/128: the claimed dependence is never larger than the actual one.
///
/// `root` is the square root of the two variances' product.
#[inline]
pub(super) fn correlation_byte(field: &'static str, covariance: f64, root: f64) -> Result<i8, WireError> {
    if !covariance.is_finite() {
        return Err(not_encodable(field, covariance));
    }
    if root <= 0.0 {
        return Ok(0);
    }
    let steps = covariance / root * 128.0;
    // The small addition keeps a decoded value on its own byte although the quotient rounds.
    let guarded = steps + 1e-9_f64.copysign(steps);
    #[expect(clippy::cast_possible_truncation, reason = "rounds toward zero, and saturates")]
    Ok((guarded as i8).max(-127))
}

/// The correlation of a byte.
#[inline]
pub(super) fn correlation(byte: i8) -> f64 {
    f64::from(byte.max(-127)) / 128.0
}

/// A 2×2 covariance as two standard deviations and a correlation, a signed byte.
#[inline]
pub(super) fn covariance_bytes(field: &'static str, covariance: &Covariance2) -> Result<[u8; 3], WireError> {
    let Covariance2 { xx, xy, yy } = *covariance;
    let (sx, sy) = (metric_sigma(field, xx)?, metric_sigma(field, yy)?);
    Ok([sx, sy, correlation_byte(field, xy, (xx * yy).sqrt())?.cast_unsigned()])
}

/// The covariance of two standard deviations and a correlation.
#[inline]
pub(super) fn covariance([sx, sy, rho]: [u8; 3]) -> Covariance2 {
    let (xx, yy) = (metric_variance(sx), metric_variance(sy));
    Covariance2 { xx, xy: correlation(rho.cast_signed()) * (xx * yy).sqrt(), yy }
}

/// A probability as a byte.
#[inline]
pub(super) fn probability_byte(field: &'static str, value: f64) -> Result<u8, WireError> {
    if (0.0..=1.0).contains(&value) {
        fixed(field, value * 255.0, 1.0)
    } else {
        Err(not_encodable(field, value))
    }
}

/// The probability of a byte.
#[inline]
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
            let back = metric_variance(byte).sqrt();
            assert!(back >= sigma * (1.0 - 1e-9) && back <= sigma * 1.045, "{sigma} became {back}");
        }
    }

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for byte in 0..=255 {
            assert_eq!(metric_sigma("s", metric_variance(byte)), Ok(byte));
            assert_eq!(yaw_sigma("s", yaw_variance(byte)), Ok(byte));
            assert_eq!(probability_byte("p", probability(byte)), Ok(byte));
        }
        for byte in -127..=127 {
            assert_eq!(correlation_byte("r", correlation(byte) * 0.06, (0.3f64 * 0.012).sqrt()), Ok(byte));
        }
    }

    #[test]
    fn halves_are_rounded_away_from_zero_and_nothing_else_is() {
        let at = |value: f64| [value.next_down(), value, value.next_up()];
        let powers = (0..53).map(|exponent| libm::ldexp(1.0, exponent));
        let values =
            (0..5000).map(f64::from).chain(powers).flat_map(|whole| [whole, whole + 0.5]).flat_map(at);
        for value in values.flat_map(|value| [value, -value]) {
            assert_eq!(round(value) as f64, libm::round(value), "{value:e}");
        }
    }

    #[test]
    fn values_that_the_wire_cannot_represent_are_errors() {
        assert!(metric_sigma("s", 100.0 * 100.0).is_err());
        assert!(metric_sigma("s", f64::NAN).is_err());
        assert!(correlation_byte("r", f64::NAN, 1.0).is_err());
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
