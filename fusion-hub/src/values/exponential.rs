//! The exponential near 1: between two frames little decays, and a few terms of its series are exact.

use super::Real;

/// Below this the first term left out is less than 2e-14 of the result.
const SMALL: f64 = 0.02;

/// 1 − e^(−x) for x ≥ 0.
#[inline(always)]
pub(crate) fn share_lost<R: Real>(x: R) -> R {
    if R::all(x.is_below(x.same(SMALL))) { by_series(x) } else { x.map(of_any) }
}

fn of_any(x: f64) -> f64 {
    if x < SMALL { by_series(x) } else { -libm::expm1(-x) }
}

#[inline(always)]
fn by_series<R: Real>(x: R) -> R {
    let x2 = x * x;
    let constant = |value: f64| x.same(value);
    let low = constant(1.0) - x / 2.0;
    let middle = constant(1.0 / 6.0) - x * (1.0 / 24.0);
    let high = constant(1.0 / 120.0) - x * (1.0 / 720.0);
    x * (low + x2 * (middle + x2 * high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_lost_is_the_exponential_on_both_sides_of_the_series_end() {
        for x in [0.0, 1e-9, 1e-4, 0.005, 0.019_999, 0.02, 0.3, 50.0] {
            assert!((share_lost(x) + libm::expm1(-x)).abs() <= 1e-13 * x, "{x}");
        }
    }
}
