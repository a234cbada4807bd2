//! Standard deviations as bytes of a logarithmic scale, found without a root or a search.
//!
//! Definition: the byte of a variance is the smallest whose standard deviation is not below the variance's
//! square root. Every step of that is monotone, so for each byte there is a largest variance; these limits
//! are worked out, exactly, when the program is compiled.

use super::error::WireError;

/// Ratio of neighbouring standard deviations, the 255th root of 70 000: the steps span 1 mm to 70 m, or
/// 0.1 mrad to 7 rad. They end at the limits of validation, so that rounding up never leaves these.
const RATIO: f64 = 1.044_721_144_087_336_7;

const fn steps() -> [f64; 256] {
    let mut steps = [1.0; 256];
    let mut i = 1;
    while i < 256 {
        steps[i] = steps[i - 1] * RATIO;
        i += 1;
    }
    steps
}

/// The standard deviation of every byte, relative to the smallest.
static STEPS: [f64; 256] = steps();

/// Keeps a decoded value on its own byte although the square root rounds.
const GUARD: f64 = 1.0 - 1e-12;

/// A bucket is what shares sign, exponent and four bits of mantissa. It spans a 16th at most, variances of
/// neighbouring bytes lie an 11th apart: no two bytes end in one bucket.
const BUCKET_SHIFT: u32 = 48;
/// 32.3 octaves of variance, 16 buckets each, and the ends.
const N_BUCKETS: usize = 520;

/// 256 standard deviations from a smallest one.
pub(super) struct Scale {
    smallest: f64,
    variances: [f64; 256],
    /// The largest variance of each byte.
    limits: [f64; 256],
    first_bucket: u64,
    /// The byte of the smallest variance in each bucket.
    bytes: [u8; N_BUCKETS],
}

/// Positions and sizes (m) and velocities (m/s).
pub(super) static METRIC: Scale = Scale::new(1e-3);
/// Headings, rad.
pub(super) static ANGULAR: Scale = Scale::new(1e-4);

impl Scale {
    const fn new(smallest: f64) -> Self {
        let (mut variances, mut limits) = ([0.0; 256], [0.0; 256]);
        let mut byte = 0;
        while byte < 256 {
            let sigma = smallest * steps()[byte];
            variances[byte] = sigma * sigma;
            limits[byte] = largest_square(largest_sigma(steps()[byte], smallest));
            byte += 1;
        }
        let first_bucket = limits[0].to_bits() >> BUCKET_SHIFT;
        Self { smallest, variances, limits, first_bucket, bytes: first_bytes(&limits, first_bucket) }
    }

    /// The variance of a byte.
    #[inline]
    pub(super) fn variance(&self, byte: u8) -> f64 {
        self.variances[usize::from(byte)]
    }

    /// The smallest byte whose standard deviation is not below that of the variance.
    #[inline]
    pub(super) fn byte(&self, field: &'static str, variance: f64) -> Result<u8, WireError> {
        let bucket = (variance.to_bits() >> BUCKET_SHIFT).wrapping_sub(self.first_bucket);
        let first = usize::try_from(bucket).ok().and_then(|bucket| self.bytes.get(bucket));
        if let Some(&first) = first {
            let byte = u16::from(first) + u16::from(variance > self.limits[usize::from(first)]);
            if let Ok(byte) = u8::try_from(byte) {
                return Ok(byte);
            }
        }
        self.byte_by_definition(field, variance)
    }

    /// The same for every input, also for those that are no variance or beyond the scale.
    #[cold]
    fn byte_by_definition(&self, field: &'static str, variance: f64) -> Result<u8, WireError> {
        let sigma = variance.sqrt();
        let relative = sigma / self.smallest * GUARD;
        if relative.is_nan() {
            return Err(WireError::NotEncodable { field, value: variance });
        }
        let byte = STEPS.partition_point(|step| *step < relative);
        u8::try_from(byte).map_err(|_| WireError::NotEncodable { field, value: sigma })
    }
}

const fn first_bytes(limits: &[f64; 256], first_bucket: u64) -> [u8; N_BUCKETS] {
    let mut bytes = [0; N_BUCKETS];
    let (mut bucket, mut byte) = (0, 0);
    while bucket < N_BUCKETS {
        let lowest = f64::from_bits((first_bucket + bucket as u64) << BUCKET_SHIFT);
        let byte_before = byte;
        while byte < u8::MAX && limits[byte as usize] < lowest {
            byte += 1;
        }
        assert!(byte - byte_before <= 1, "two bytes end in one bucket");
        bytes[bucket] = byte;
        bucket += 1;
    }
    assert!(byte == u8::MAX, "the buckets do not reach the last byte");
    bytes
}

/// The largest standard deviation that, relative to the smallest and guarded, is not above the step.
const fn largest_sigma(step: f64, smallest: f64) -> f64 {
    let mut sigma = step * smallest / GUARD;
    while sigma / smallest * GUARD > step {
        sigma = sigma.next_down();
    }
    while sigma.next_up() / smallest * GUARD <= step {
        sigma = sigma.next_up();
    }
    sigma
}

/// The largest number whose rounded square root is not above `root`, a normal number.
///
/// It is the last one below the square of the midpoint between `root` and its successor. That square is odd
/// in its last of more than 53 bits: no number lies on it.
const fn largest_square(root: f64) -> f64 {
    const FRACTION_BITS: u32 = f64::MANTISSA_DIGITS - 1;
    let fraction = root.to_bits() & ((1 << FRACTION_BITS) - 1);
    let exponent = (root.to_bits() >> FRACTION_BITS) as i64 - 1075;
    let midpoint = 2 * (fraction | 1 << FRACTION_BITS) + 1;
    let square = (midpoint as u128) * (midpoint as u128);
    let excess_bits = u128::BITS - square.leading_zeros() - f64::MANTISSA_DIGITS;
    let exponent = 2 * (exponent - 1) + excess_bits as i64 + 1075;
    f64::from_bits(
        (exponent as u64) << FRACTION_BITS | (square >> excess_bits) as u64 & ((1 << FRACTION_BITS) - 1),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn assert_as_defined(scale: &Scale, variance: f64) {
        let (byte, defined) = (scale.byte("s", variance), scale.byte_by_definition("s", variance));
        // NaN is not equal to itself, also not in an error.
        assert_eq!(format!("{byte:?}"), format!("{defined:?}"), "{variance:e}");
    }

    fn assert_as_defined_around(scale: &Scale, variance: f64) {
        let bits = variance.to_bits();
        (bits.saturating_sub(8)..=bits.saturating_add(8))
            .for_each(|bits| assert_as_defined(scale, f64::from_bits(bits)));
    }

    #[test]
    fn bytes_are_as_defined_around_every_limit_variance_and_bucket() {
        for scale in [&METRIC, &ANGULAR] {
            for variance in scale.limits.into_iter().chain(scale.variances) {
                assert_as_defined_around(scale, variance);
            }
            for bucket in 0..=u64::from(u16::MAX) {
                assert_as_defined_around(scale, f64::from_bits(bucket << BUCKET_SHIFT));
            }
        }
    }

    #[test]
    fn a_limit_is_the_last_variance_of_its_byte() {
        for scale in [&METRIC, &ANGULAR] {
            for (byte, limit) in (0..=u8::MAX).zip(scale.limits) {
                assert_eq!(scale.byte_by_definition("s", limit), Ok(byte));
                let above = scale.byte_by_definition("s", limit.next_up());
                assert_eq!(above.ok(), byte.checked_add(1));
            }
        }
    }

    proptest! {
        #[test]
        fn bytes_are_as_defined_for_any_bits(bits in any::<u64>()) {
            assert_as_defined(&METRIC, f64::from_bits(bits));
            assert_as_defined(&ANGULAR, f64::from_bits(bits));
        }

        #[test]
        fn bytes_are_as_defined_for_sensible_variances(log in -21.0..10.0f64) {
            assert_as_defined(&METRIC, libm::exp(log));
            assert_as_defined(&ANGULAR, libm::exp(log));
        }
    }
}
