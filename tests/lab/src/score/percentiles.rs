//! Percentiles by nearest rank.

use serde::{Deserialize, Serialize};

/// Three percentiles of one quantity, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// The median.
    pub p50: f64,
    /// 95 % of the values are at most this.
    pub p95: f64,
    /// 99 % of the values are at most this.
    pub p99: f64,
}

impl Percentiles {
    /// The percentiles of these values; `None` without values.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let rank = |percent| nearest_rank(&values, percent).copied();
        Some(Self { p50: rank(50)?, p95: rank(95)?, p99: rank(99)? })
    }
}

/// The smallest of the sorted values that at least `percent` % of them do not exceed; `None` without values. `percent` is
/// 1 to 100.
pub(crate) fn nearest_rank<T>(sorted: &[T], percent: usize) -> Option<&T> {
    let rank = (sorted.len() * percent).div_ceil(100);
    sorted.get(rank.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_is_rounded_up() {
        let sorted = [15, 20, 35, 40, 50];
        let at = |percent| *nearest_rank(&sorted, percent).unwrap();
        assert_eq!([5, 30, 40, 50, 100].map(at), [15, 20, 20, 35, 50]);
    }

    #[test]
    fn values_need_not_be_sorted_and_one_value_is_all_percentiles() {
        let hundred = (1..=100u8).rev().map(f64::from).collect();
        assert_eq!(Percentiles::of(hundred), Some(Percentiles { p50: 50.0, p95: 95.0, p99: 99.0 }));
        assert_eq!(Percentiles::of(vec![7.0]), Some(Percentiles { p50: 7.0, p95: 7.0, p99: 7.0 }));
    }

    #[test]
    fn no_values_have_no_percentiles() {
        assert_eq!(Percentiles::of(vec![]), None);
    }
}
