//! Headings from motion, for rows without one.

use v2x_common::geometry::Pose;

/// Positions nearer than this to each other show no direction, m.
const STEP_M: f64 = 0.3;

/// Gives each pose without a heading (NaN) that of the motion around it: it keeps its heading while it stands, and has the
/// first one before it moves; 0 if it never moves.
pub(super) fn fill(poses: &mut [Pose]) {
    if poses.iter().all(|pose| !pose.yaw.is_nan()) {
        return;
    }
    let (mut from, mut heading) = (0, None);
    for here in 1..poses.len() {
        let (dx, dy) = (poses[here].x - poses[from].x, poses[here].y - poses[from].y);
        if libm::hypot(dx, dy) >= STEP_M {
            heading = Some(libm::atan2(dy, dx));
            set(&mut poses[from..here], heading);
            from = here;
        }
    }
    set(&mut poses[from..], heading);
}

fn set(poses: &mut [Pose], heading: Option<f64>) {
    let missing = poses.iter_mut().filter(|pose| pose.yaw.is_nan());
    missing.for_each(|pose| pose.yaw = heading.unwrap_or(0.0));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(places: &[(f64, f64)]) -> Vec<f64> {
        let mut poses: Vec<_> = places.iter().map(|(x, y)| Pose { x: *x, y: *y, yaw: f64::NAN }).collect();
        fill(&mut poses);
        poses.iter().map(|pose| pose.yaw).collect()
    }

    #[test]
    fn a_missing_heading_is_that_of_the_motion_and_kept_while_standing() {
        let north = std::f64::consts::FRAC_PI_2;
        let places = [(0.0, 0.0), (0.0, 0.01), (0.0, 1.0), (0.0, 2.0), (0.02, 2.0)];
        assert_eq!(filled(&places), [north; 5]);
        assert_eq!(filled(&[(1.0, 1.0), (1.0, 1.1)]), [0.0, 0.0]);
    }
}
