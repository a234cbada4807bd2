//! Piecewise linear interpolation as numpy does it, and means over the beginning of a list.

/// `numpy.interp`: the value at `x` of the line through the points (`xs`, `ys`), which have rising `xs`. Of points with equal
/// `x` the last one holds. Left of them it is the first value, right of them `right`.
pub(super) fn interpolated(x: f64, (xs, ys): (&[f64], &[f64]), right: f64) -> f64 {
    let after = xs.partition_point(|one| *one <= x);
    let Some(before) = after.checked_sub(1) else { return ys.first().copied().unwrap_or(right) };
    if after == xs.len() {
        return if x > xs[before] { right } else { ys[before] };
    }
    if xs[before] >= x {
        return ys[before];
    }
    let slope = (ys[after] - ys[before]) / (xs[after] - xs[before]);
    slope * (x - xs[before]) + ys[before]
}

/// The mean of the values up to each one that are known; 0 before the first known one, and 1 everywhere where none is
/// (`cummean` of nuscenes-devkit).
pub(super) fn cumulative_means(values: impl Iterator<Item = Option<f64>>) -> Vec<f64> {
    let (mut sum, mut n) = (0.0, 0.0);
    let mut means: Vec<f64> = values
        .map(|value| {
            if let Some(value) = value {
                sum += value;
                n += 1.0;
            }
            if n > 0.0 { sum / n } else { 0.0 }
        })
        .collect();
    if n == 0.0 {
        means.fill(1.0);
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_joined_by_lines_and_the_last_of_equal_ones_holds() {
        let points: (&[f64], &[f64]) = (&[0.0, 1.0, 1.0, 3.0], &[5.0, 6.0, 8.0, 4.0]);
        let at = |x| interpolated(x, points, -1.0);
        assert_eq!([-1.0, 0.5, 1.0, 2.0, 3.0, 3.1].map(at), [5.0, 5.5, 8.0, 6.0, 4.0, -1.0]);
    }

    #[test]
    fn unknown_values_are_left_out_of_means() {
        let means = cumulative_means([None, Some(2.0), None, Some(4.0)].into_iter());
        assert_eq!(means, [0.0, 2.0, 2.0, 3.0]);
        assert_eq!(cumulative_means([None, None].into_iter()), [1.0, 1.0]);
    }
}
