//! By how much an object may differ from what a consumer takes it for.

use crate::fused::{FusedObject, KINEMATIC_INDEX, KinematicCovariance};
use crate::geometry::angle_difference;
use crate::heading::HeadingKind;

/// By how much the objects of a followed list may differ from those of the whole one. Class and kind of heading are never
/// different.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Distance of the positions, m.
    pub position_m: f64,
    /// Difference of the velocities, m/s.
    pub velocity_mps: f64,
    /// Difference of width and of depth, m.
    pub size_m: f64,
    /// Difference of the headings, rad, where anything is known of them.
    pub yaw_rad: f64,
    /// Difference of each probability: of existence and of every class, and of the conflict about the class.
    pub probability: f64,
    /// Quotient of variances, at least 1: in no direction of (x, y, vx, vy) does the variance differ by more, nor do those of
    /// width, depth and heading.
    pub variance_factor: f64,
}

impl Tolerance {
    /// What a hub publishes by: a fraction of what its estimates err by themselves.
    pub const HUB: Self = Self {
        position_m: 0.2,
        velocity_mps: 0.5,
        size_m: 0.1,
        yaw_rad: 0.05,
        probability: 0.1,
        variance_factor: 4.0,
    };

    /// Whether an object may be taken for another.
    pub fn allows(&self, taken: &FusedObject, live: &FusedObject) -> bool {
        taken.class == live.class
            && taken.heading == live.heading
            && self.allows_state(taken, live)
            && self.allows_probabilities(taken, live)
            && self.allows_variances(taken, live)
    }

    fn allows_state(&self, taken: &FusedObject, live: &FusedObject) -> bool {
        let (a, b) = (&taken.bev, &live.bev);
        let turned = angle_difference(a.yaw, b.yaw).abs();
        let apart = libm::hypot(a.x - b.x, a.y - b.y);
        let faster = libm::hypot(taken.velocity.0 - live.velocity.0, taken.velocity.1 - live.velocity.1);
        apart <= self.position_m
            && faster <= self.velocity_mps
            && (a.w - b.w).abs() <= self.size_m
            && (a.d - b.d).abs() <= self.size_m
            && (turned <= self.yaw_rad || live.heading == HeadingKind::Unknown)
    }

    fn allows_probabilities(&self, taken: &FusedObject, live: &FusedObject) -> bool {
        let is_near = |a: f64, b: f64| (a - b).abs() <= self.probability;
        let probability = |object: &FusedObject, class| {
            object.classes().find(|(listed, _)| *listed == class).map_or(0.0, |(_, probability)| probability)
        };
        is_near(taken.existence, live.existence)
            && is_near(taken.class_conflict, live.class_conflict)
            && live.classes().all(|(class, value)| is_near(probability(taken, class), value))
            && taken.classes().all(|(class, value)| is_near(probability(live, class), value))
    }

    fn allows_variances(&self, taken: &FusedObject, live: &FusedObject) -> bool {
        let factor = self.variance_factor;
        let is_near = |a: f64, b: f64| a <= factor * b && b <= factor * a;
        is_near(taken.ww, live.ww)
            && is_near(taken.dd, live.dd)
            && is_near(taken.yaw_variance, live.yaw_variance)
            && is_below(&taken.kinematic_covariance, &live.kinematic_covariance, factor)
            && is_below(&live.kinematic_covariance, &taken.kinematic_covariance, factor)
    }
}

/// Whether in every direction the variance of the one is below that of the other times the factor: the difference of the
/// matrices is positive definite.
fn is_below(one: &KinematicCovariance, other: &KinematicCovariance, factor: f64) -> bool {
    let mut difference = [[0.0; 4]; 4];
    for ((row, column), (a, b)) in KINEMATIC_INDEX.into_iter().zip(one.iter().zip(other)) {
        difference[row][column] = factor * b - a;
        difference[column][row] = factor * b - a;
    }
    // Gauss's elimination: all pivots are positive.
    for k in 0..4 {
        let pivot_row = difference[k];
        if pivot_row[k].is_nan() || pivot_row[k] <= 0.0 {
            return false;
        }
        for row in &mut difference[k + 1..] {
            let factor = row[k] / pivot_row[k];
            for (value, above) in row.iter_mut().zip(pivot_row) {
                *value -= factor * above;
            }
        }
    }
    true
}
