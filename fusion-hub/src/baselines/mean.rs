//! The weighted mean of reports.

use crate::values::Measurement;
use v2x_common::covariance::Covariance2;

/// The mean box: coordinates and sizes by component, the heading as the direction of the summed unit vectors.
/// The variances are those of a mean of independent errors.
///
/// # Panics
/// Where there is nothing to take the mean of.
pub(super) fn mean(weighted: &[(&Measurement, f64)]) -> Measurement {
    let total: f64 = weighted.iter().map(|(_, weight)| weight).sum();
    let mut mean = *weighted.first().expect("a mean is of something").0;
    let (mut position, mut size, mut heading) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let (mut r, mut yaw_variance, mut size_variance) = (Covariance2::default(), 0.0, [0.0; 2]);
    for (z, weight) in weighted {
        let share = weight / total;
        let (sin, cos) = libm::sincos(z.yaw);
        for axis in 0..2 {
            position[axis] += share * z.position[axis];
            size[axis] += share * z.size[axis];
            size_variance[axis] += share * share * z.relative_variance[axis] * z.size[axis] * z.size[axis];
        }
        heading = [heading[0] + share * cos, heading[1] + share * sin];
        let squared = z.r.scaled(share * share);
        r = Covariance2 { xx: r.xx + squared.xx, xy: r.xy + squared.xy, yy: r.yy + squared.yy };
        yaw_variance += share * share * z.yaw_variance;
    }
    mean.position = position;
    mean.size = size;
    mean.yaw = libm::atan2(heading[1], heading[0]);
    mean.r = r;
    mean.yaw_variance = yaw_variance;
    mean.relative_variance = std::array::from_fn(|axis| size_variance[axis] / (size[axis] * size[axis]));
    mean.velocity = None;
    mean
}

#[cfg(test)]
mod tests {
    use super::super::testing::{close, report, sized};
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn headings_are_averaged_across_the_half_turn() {
        let (a, b) = (sized(report(0.0, 0.0), [2.0, 4.0], 3.0), sized(report(2.0, 1.0), [1.0, 6.0], -3.0));
        let z = mean(&[(&a.z, 1.0), (&b.z, 1.0)]);
        assert!(close(z.yaw.abs(), PI));
        assert_eq!((z.position, z.size), ([1.0, 0.5], [1.5, 5.0]));
        assert!(close(z.r.xx, 0.125) && close(z.yaw_variance, 0.005));
    }

    #[test]
    fn weights_count() {
        let z = mean(&[(&report(0.0, 0.0).z, 3.0), (&report(4.0, 0.0).z, 1.0)]);
        assert_eq!(z.position, [1.0, 0.0]);
    }
}
