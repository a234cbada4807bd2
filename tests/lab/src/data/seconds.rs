//! Times in files: decimal seconds of any epoch, exact to the nanosecond.

use v2x_common::time::Timestamp;

const NANOS_PER_S: i64 = 1_000_000_000;
/// Digits behind the point that are read: far below a nanosecond.
const MAX_FRACTION: usize = 20;

/// A decimal number of seconds, rounded to the nearest nanosecond. It is not read as a float, which cannot represent the
/// microseconds of a Unix time well. `None` if it is no number, or 292 years or more.
pub(crate) fn parse(text: &str) -> Option<Timestamp> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i16>().ok()?),
        None => (text, 0),
    };
    let (is_negative, unsigned) = match mantissa.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    let is_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.len() + fraction.len() == 0 || !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    let fraction = &fraction[..fraction.len().min(MAX_FRACTION)];
    let digits = format!("{whole}{fraction}");
    let digits = digits.trim_start_matches('0');
    let magnitude = if digits.is_empty() { 0 } else { digits.parse::<i128>().ok()? };
    let shift = 9 + i64::from(exponent) - i64::try_from(fraction.len()).ok()?;
    let nanos = i64::try_from(scaled(magnitude, shift)?).ok()?;
    Some(Timestamp::from_nanos(if is_negative { -nanos } else { nanos }))
}

/// Times ten to the power of `shift`, rounded to the nearest whole number; `None` beyond 128 bits.
fn scaled(magnitude: i128, shift: i64) -> Option<i128> {
    if magnitude == 0 {
        return Some(0);
    }
    let power = 10_i128.checked_pow(u32::try_from(shift.unsigned_abs()).ok()?);
    match power {
        Some(power) if shift >= 0 => magnitude.checked_mul(power),
        Some(power) => Some((magnitude + power / 2) / power),
        // The divisor is larger than any number of 128 bits.
        None if shift < 0 => Some(0),
        None => None,
    }
}

/// A time in seconds, with all its digits.
pub(crate) fn text(at: Timestamp) -> String {
    let nanos = at.as_nanos();
    let sign = if nanos < 0 { "-" } else { "" };
    let (whole, rest) = (
        nanos.unsigned_abs() / NANOS_PER_S.unsigned_abs(),
        nanos.unsigned_abs() % NANOS_PER_S.unsigned_abs(),
    );
    if rest == 0 {
        return format!("{sign}{whole}");
    }
    format!("{sign}{whole}.{}", format!("{rest:09}").trim_end_matches('0'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn nanos(text: &str) -> Option<i64> {
        parse(text).map(Timestamp::as_nanos)
    }

    #[test]
    fn any_epoch_and_sign_is_read_to_the_nanosecond() {
        assert_eq!(nanos("1700000000.123456789"), Some(1_700_000_000_123_456_789));
        assert_eq!(nanos("-0.5"), Some(-500_000_000));
        assert_eq!(nanos("+12"), Some(12_000_000_000));
        assert_eq!(nanos(".1"), Some(100_000_000));
        assert_eq!(nanos("7."), Some(7_000_000_000));
    }

    #[test]
    fn printed_floats_are_parsed() {
        assert_eq!(nanos("1e-05"), Some(10_000));
        assert_eq!(nanos("1.7E9"), Some(1_700_000_000_000_000_000));
        assert_eq!(nanos("0.30000000000000004"), Some(300_000_000));
        assert_eq!(nanos("0.1000000000000000055511151231257827"), Some(100_000_000));
        assert_eq!(nanos("0.0000000006"), Some(1), "rounded to the nearest");
        assert_eq!(nanos("1e-300"), Some(0));
        assert_eq!(nanos("0e300"), Some(0));
    }

    #[test]
    fn invalid_times_are_errors() {
        for text in
            ["", ".", "-", "nan", "inf", "1,5", "1.5s", "0x10", "1e", "1e9.5", "--1", "1e12", "1e30000"]
        {
            assert_eq!(nanos(text), None, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn times_are_read_as_written(nanos in (i64::MIN + 1)..i64::MAX) {
            let at = Timestamp::from_nanos(nanos);
            prop_assert_eq!(parse(&text(at)), Some(at));
        }
    }
}
