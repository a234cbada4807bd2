//! Sizes whose logarithm is normal.

use super::scalar::Size;

/// A normal distribution of the logarithm of a size in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogNormal {
    /// Mean of ln s.
    pub mean_ln: f64,
    /// Variance of ln s.
    pub variance_ln: f64,
}

impl LogNormal {
    /// Median (m) and variance (m²) of the size.
    pub fn size(&self) -> Size {
        let median = libm::exp(self.mean_ln);
        Size { mean: median, variance: median * median * self.variance_ln }
    }

    /// What it and an independent one say together.
    pub(super) fn and(&self, other: &Self) -> Self {
        let (own, others) = (1.0 / self.variance_ln, 1.0 / other.variance_ln);
        let variance_ln = 1.0 / (own + others);
        Self { mean_ln: (own * self.mean_ln + others * other.mean_ln) * variance_ln, variance_ln }
    }
}
