//! False detections that stay: of a wall, a sign, a bush.

use super::reports::{Detector, ObjectReport};
use crate::random::{chance, poisson, standard_normal, uniform, unit};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::sensor::FieldOfView;

/// False objects last for this long, s.
const LASTING_S: f64 = 2.0;
/// σ of the place of a false box from frame to frame, m.
const JITTER_M: f64 = 0.2;

impl Detector {
    /// The first frame of the span of time, as long as false objects last, that a frame is in. False objects stand about the
    /// place where the sensor is then.
    pub fn ghosts_since(&self, frame: u64) -> u64 {
        frame - frame % self.ghost_frames()
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive, and casts saturate"
    )]
    fn ghost_frames(&self) -> u64 {
        (libm::round(LASTING_S * self.rate_hz()) as u64).max(1)
    }

    /// The false detections of a frame, `per_frame` on average. `sensor` is the true pose in the first frame of their span
    /// ([`Self::ghosts_since`]); `draws` gives the draws of the span, then those of the frame.
    pub fn ghosts(
        &self,
        per_frame: f64,
        (field_of_view, sensor): (&FieldOfView, &Pose),
        [mut of_span, mut of_frame]: [ChaCha8Rng; 2],
    ) -> Vec<ObjectReport> {
        let presence = self.profile().ghost_presence;
        let count = poisson(&mut of_span, per_frame / presence);
        let mut ghosts = Vec::new();
        for _ in 0..count {
            let ghost = self.ghost((field_of_view, sensor), &mut of_span);
            let [x, y, yaw] = [0, 1, 2].map(|_| standard_normal(&mut of_frame));
            if chance(&mut of_frame, presence) {
                let bev = BevBox {
                    x: ghost.bev.x + JITTER_M * x,
                    y: ghost.bev.y + JITTER_M * y,
                    yaw: wrap_angle(ghost.bev.yaw + 0.1 * yaw),
                    ..ghost.bev
                };
                ghosts.push(ObjectReport { bev, ..ghost });
            }
        }
        ghosts
    }

    fn ghost(&self, (fov, sensor): (&FieldOfView, &Pose), rng: &mut ChaCha8Rng) -> ObjectReport {
        let (near2, far2) = (fov.range_min_m * fov.range_min_m, fov.range_max_m * fov.range_max_m);
        let range_m = libm::sqrt(uniform(rng, near2, far2));
        let bearing = fov.azimuth_rad + (unit(rng) - 0.5) * fov.width_rad;
        let (sin, cos) = libm::sincos(bearing);
        let (x, y) = sensor.offset(range_m * cos, range_m * sin);
        let class = if chance(rng, 0.7) { Class::Car } else { Class::Adult };
        let (w, d) = class.typical_size();
        let score = self.false_score(standard_normal(rng));
        ObjectReport {
            class,
            score,
            bev: BevBox { x, y, w, d, yaw: wrap_angle(uniform(rng, -PI, TAU - PI)) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Profile;
    use crate::random::{Purpose, keyed_rng};

    fn of_frame(detector: &Detector, frame: u64) -> Vec<ObjectReport> {
        let rng = |number, purpose| keyed_rng(1, None, number, purpose);
        let span = rng(detector.ghosts_since(frame), Purpose::Clutter);
        let view = FieldOfView::omnidirectional(0.0, 60.0);
        detector.ghosts(4.0, (&view, &Pose::default()), [span, rng(frame, Purpose::Order)])
    }

    #[test]
    fn false_objects_have_their_number_and_stay_for_seconds() {
        let detector = Detector::new(Profile::Lidar.errors().unwrap(), 10.0, 1.0);
        let frames: Vec<_> = (0..4000).map(|frame| of_frame(&detector, frame)).collect();
        let n: usize = frames.iter().map(Vec::len).sum();
        let mean = n as f64 / 4000.0;
        assert!((mean - 4.0).abs() < 0.3, "{mean}");
        let is_there_again = |ghost: &&ObjectReport, next: &[ObjectReport]| {
            next.iter().any(|one| one.bev.pose().distance_to(ghost.bev.x, ghost.bev.y) < 1.5)
        };
        let again: usize = frames
            .windows(2)
            .map(|pair| pair[0].iter().filter(|ghost| is_there_again(ghost, &pair[1])).count())
            .sum();
        let share = again as f64 / n as f64;
        // 0.7, but for the last frame of twenty.
        assert!((share - 0.665).abs() < 0.05, "{share}");
    }
}
