//! How far estimates are from the truth, of a simulated world.

use super::rounding::rounded;
use serde::Serialize;
use v2x_agent::truth::TrueObject;

/// An estimate counts as one of the nearest true object within this distance, m.
pub(super) const RADIUS_M: f64 = 3.0;

/// The errors of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct Errors {
    /// Estimates with a true object within [`RADIUS_M`].
    matched: usize,
    /// All estimates.
    of: usize,
    /// Mean distance of those to their nearest true object, m.
    mean_m: Option<f64>,
}

impl Errors {
    /// Of estimates at these positions, m.
    pub(super) fn of(estimates: impl Iterator<Item = (f64, f64)>, truth: &[TrueObject]) -> Self {
        let mut errors = Self::default();
        let mut sum_m = 0.0;
        for (x, y) in estimates {
            errors.of += 1;
            let squared = |object: &TrueObject| {
                let (dx, dy) = (object.bev.x - x, object.bev.y - y);
                dx * dx + dy * dy
            };
            let nearest = truth.iter().map(squared).fold(f64::INFINITY, f64::min);
            if nearest <= RADIUS_M * RADIUS_M {
                errors.matched += 1;
                sum_m += nearest.sqrt();
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
        if errors.matched > 0 {
            errors.mean_m = Some(rounded(sum_m / errors.matched as f64, 1e4));
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_agent::truth::ObjectId;
    use v2x_common::class::Class;
    use v2x_common::geometry::BevBox;

    #[test]
    fn the_error_is_the_distance_to_the_nearest_true_object_within_the_radius() {
        let at = |x| TrueObject {
            id: ObjectId(1),
            class: Class::Car,
            bev: BevBox { x, ..BevBox::default() },
            velocity: (0.0, 0.0),
        };
        let truth = [at(0.0), at(10.0)];
        let errors = Errors::of([(0.0, 1.0), (9.5, 0.0), (5.0, 0.0)].into_iter(), &truth);
        assert_eq!(errors, Errors { matched: 2, of: 3, mean_m: Some(0.75) });
        assert_eq!(Errors::of([(5.0, 0.0)].into_iter(), &truth).mean_m, None);
        assert_eq!(Errors::of(std::iter::empty(), &[]), Errors::default());
    }
}
