//! Round numbers along an axis.

/// Equidistant round numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// The numbers, rising.
    pub(super) values: Vec<f64>,
    digits: usize,
}

/// About `n` round numbers from at most `low` to at least `high`.
pub(super) fn ticks(low: f64, high: f64, n: u32) -> Ticks {
    let rough = (high - low).max(f64::MIN_POSITIVE) / f64::from(n.max(1));
    let exponent = libm::floor(libm::log10(rough));
    let unit = libm::pow(10.0, exponent);
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * unit).find(|step| *step >= rough * 0.999_999);
    let step = step.unwrap_or(10.0 * unit);
    let (first, last) = (libm::floor(low / step + 1e-9), libm::ceil(high / step - 1e-9));
    let digits = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
    let count = (last - first).clamp(0.0, 1000.0) as u32;
    Ticks { values: (0..=count).map(|place| (first + f64::from(place)) * step).collect(), digits }
}

impl Ticks {
    /// A number with enough digits to distinguish it from its neighbours.
    pub(super) fn label(&self, value: f64) -> String {
        format!("{value:.*}", self.digits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_hold_the_range() {
        let labels = |low: f64, high: f64| {
            let ticks = ticks(low, high, 5);
            ticks.values.iter().map(|value| ticks.label(*value)).collect::<Vec<_>>()
        };
        assert_eq!(labels(0.0, 0.83), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.0, 22.0), ["0", "5", "10", "15", "20", "25"]);
        assert_eq!(labels(-3.0, 3.0), ["-4", "-2", "0", "2", "4"]);
        assert_eq!(labels(0.0, 0.05), ["0.00", "0.01", "0.02", "0.03", "0.04", "0.05"]);
    }
}
