//! The χ² distribution, for the band of a sum of squares.
//!
//! P(k/2, x/2) by its series or its continued fraction (Press et al., Numerical Recipes, section 6.2), inverted by
//! bisection: exact to about 1e-10 from one degree of freedom to tens of millions.

/// Relative precision of what is summed.
const EPSILON: f64 = 1e-15;
/// Instead of dividing by zero (Lentz's method).
const TINY: f64 = 1e-300;

/// The value below which a share `probability` in (0, 1) of the χ² with `dof` > 0 degrees of freedom lies.
pub(super) fn quantile(probability: f64, dof: f64) -> f64 {
    // More than ten standard deviations above the mean: beyond any requested quantile.
    let (mut low, mut high) = (0.0, dof + 10.0 * libm::sqrt(2.0 * dof) + 50.0);
    while high - low > 1e-12 * high {
        let middle = 0.5 * (low + high);
        if below(middle, dof) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The share that lies below `x` > 0.
fn below(x: f64, dof: f64) -> f64 {
    let (a, x) = (0.5 * dof, 0.5 * x);
    let scale = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 { scale * series(a, x) } else { 1.0 - scale * continued_fraction(a, x) }
}

/// Σ xⁿ / (a (a + 1) … (a + n)).
fn series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    while term > sum * EPSILON {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum
}

/// 1 / (x + 1 − a − 1 (1 − a) / (x + 3 − a − 2 (2 − a) / …)), by Lentz's method.
fn continued_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1.0 / TINY, 1.0 / b);
    let (mut fraction, mut n) = (d, 0.0);
    loop {
        n += 1.0;
        let numerator = -n * (n - a);
        b += 2.0;
        d = away_from_zero(numerator * d + b);
        c = away_from_zero(b + numerator / c);
        d = 1.0 / d;
        fraction *= d * c;
        if (d * c - 1.0).abs() < EPSILON {
            return fraction;
        }
    }
}

fn away_from_zero(value: f64) -> f64 {
    if value.abs() < TINY { TINY } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_two_degrees_of_freedom_it_is_an_exponential() {
        for probability in [1e-6, 0.025, 0.5, 0.975, 0.999] {
            let expected = -2.0 * libm::log1p(-probability);
            assert!((quantile(probability, 2.0) / expected - 1.0).abs() < 1e-9, "{probability}");
        }
    }

    #[test]
    fn with_millions_of_degrees_of_freedom_it_is_normal() {
        let dof = 4e6;
        let deviations = (quantile(0.975, dof) - dof) / libm::sqrt(2.0 * dof);
        // Cornish-Fisher: z + (z² − 1) √2 / (3 √k) …, z = 1.959 964.
        assert!((deviations - (1.959_964 + 2.841_459 * 0.471_405 / 2e3)).abs() < 1e-5, "{deviations}");
    }
}
