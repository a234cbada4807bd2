//! Numbers with fewer digits.

/// A number with as many digits as `scale` has zeros: shorter, and still finer than a pixel.
pub(super) fn rounded(value: f64, scale: f64) -> f64 {
    (value * scale).round() / scale
}
