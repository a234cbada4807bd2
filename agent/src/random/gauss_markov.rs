//! A Gauss-Markov process (Ornstein-Uhlenbeck: stationary, autocorrelation e^(-|t|/τ)) that can be computed for any frame
//! without those before it.
//!
//! Knots stand 14 τ apart, where the correlation that is neglected is e^-14 < 1e-6; they are independent draws. Between two
//! knots the process is filled in by halves, each middle drawn given its two neighbours by the exact conditional law (the
//! process is Markov). So a frame costs log2(14 τ · rate) draws, and not the thousands of a moving average with the same
//! precision; its variance is short of 1 by less than e^-28.

/// Between two knots, in correlation times.
const KNOT_SPACING: f64 = 14.0;

/// `N` independent Gauss-Markov processes of mean 0 and variance 1, over frame numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GaussMarkov<const N: usize> {
    /// τ, in frames; with 0 all frames are independent.
    pub(crate) correlation_frames: f64,
}

impl<const N: usize> GaussMarkov<N> {
    /// The processes at frame `n`; `draw` gives the independent standard normal draws of a frame number.
    pub(crate) fn at(&self, n: u64, draw: &impl Fn(u64) -> [f64; N]) -> [f64; N] {
        let mut length = self.knot_spacing();
        let mut left = n - n % length;
        if left == n {
            return draw(n);
        }
        // Beyond the last frame number there are no frames: any draw serves as the value there.
        let (mut before, mut after) = (draw(left), draw(left.wrapping_add(length)));
        loop {
            length /= 2;
            let middle = left + length;
            let here = self.between((&before, &after), length, &draw(middle));
            if middle == n {
                return here;
            }
            if n < middle {
                after = here;
            } else {
                (left, before) = (middle, here);
            }
        }
    }

    /// Frames between two knots, a power of two so that halving ends at each frame.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive, and casts saturate"
    )]
    pub(crate) fn knot_spacing(&self) -> u64 {
        let frames = libm::ceil(KNOT_SPACING * self.correlation_frames) as u64;
        frames.clamp(1, 1 << 48).next_power_of_two()
    }

    /// The middle between two values that are `half` frames away on either side: with ρ = e^(-half/τ) its mean is
    /// (before + after) ρ / (1 + ρ²) and its variance (1 - ρ²) / (1 + ρ²).
    fn between(&self, (before, after): (&[f64; N], &[f64; N]), half: u64, draw: &[f64; N]) -> [f64; N] {
        let exponent = -(half as f64) / self.correlation_frames;
        let rho = libm::exp(exponent);
        // 1 - ρ² without cancellation where ρ is almost 1.
        let lost = -libm::expm1(2.0 * exponent);
        let (weight, sigma) = (rho / (1.0 + rho * rho), libm::sqrt(lost / (1.0 + rho * rho)));
        std::array::from_fn(|axis| weight * (before[axis] + after[axis]) + sigma * draw[axis])
    }
}
