//! Which objects are hidden by nearer ones.

use v2x_common::geometry::{BevBox, Pose, angle_difference};

/// For each object whether the line of sight from the sensor to its centre passes a nearer one: the angle under which that
/// appears, taken as the one of its circle of half its mean extent.
pub fn hidden(sensor: &Pose, objects: &[BevBox]) -> Vec<bool> {
    let seen: Vec<(f64, f64, f64)> = objects
        .iter()
        .map(|one| {
            let range_m = sensor.distance_to(one.x, one.y);
            let radius_m = (one.w + one.d) / 4.0;
            let half = if range_m > radius_m { libm::asin(radius_m / range_m) } else { 0.0 };
            (range_m, sensor.bearing_to(one.x, one.y), half)
        })
        .collect();
    let is_hidden = |(range_m, bearing, _): &(f64, f64, f64)| {
        seen.iter().any(|(nearer_m, other, half)| {
            nearer_m < range_m && angle_difference(*bearing, *other).abs() < *half
        })
    };
    seen.iter().map(is_hidden).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_behind_another_object_is_hidden_and_what_is_beside_it_is_not() {
        let car = |x, y| BevBox { x, y, w: 1.8, d: 4.5, yaw: 0.0 };
        let objects = [car(10.0, 0.0), car(30.0, 0.5), car(30.0, 10.0), car(-10.0, 0.0)];
        assert_eq!(hidden(&Pose::default(), &objects), [false, true, false, false]);
    }
}
