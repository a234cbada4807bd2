//! Means and standard deviations, merged by adding sums.

/// Number, sum and sum of squares of some values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    n: u64,
    sum: f64,
    sum_of_squares: f64,
}

impl Moments {
    /// Adds a value, if there is one.
    pub fn add(&mut self, value: Option<f64>) {
        if let Some(value) = value {
            self.n += 1;
            self.sum += value;
            self.sum_of_squares += value * value;
        }
    }

    /// Adds all values of another. The same order of additions gives the same bits.
    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
    }

    /// Number of values.
    pub const fn n(&self) -> u64 {
        self.n
    }

    /// Sum of the values.
    pub const fn sum(&self) -> f64 {
        self.sum
    }

    /// The mean; `None` without values.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }

    /// The standard deviation of a sample, divided by n − 1; `None` with fewer than two values.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn standard_deviation(&self) -> Option<f64> {
        let n = self.n as f64;
        // Rounding must not make the variance of equal values negative.
        let squares = (self.sum_of_squares - self.sum * self.sum / n).max(0.0);
        (self.n > 1).then(|| libm::sqrt(squares / (n - 1.0)))
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        values.into_iter().for_each(|value| moments.add(Some(value)));
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_of_a_sample() {
        let mut moments: Moments = [2.0, 4.0].into_iter().collect();
        moments.merge(&[4.0, 4.0, 5.0, 5.0, 7.0, 9.0].into_iter().collect());
        assert_eq!(moments.mean(), Some(5.0));
        assert!((moments.standard_deviation().unwrap() - libm::sqrt(32.0 / 7.0)).abs() < 1e-12);
        assert_eq!(Moments::default().mean(), None);
        assert_eq!([1.0].into_iter().collect::<Moments>().standard_deviation(), None);
    }
}
