//! Errors of headings: how many are turned round, and how good the others of moving objects are.
//!
//! A mean hides both: boxes turned by 180° dominate it. So turned ones are a share, and the rest has its median.

use crate::score::errors::BoxError;
use crate::score::tracking::sequence::ratio;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;
use v2x_common::geometry::BevBox;

/// An object is moving above this speed, m/s.
const MOVING_MPS: f64 = 1.0;

/// The errors of matched boxes so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Headings {
    matched: u64,
    turned: u64,
    /// Absolute errors of moving objects, rad.
    moving_rad: Vec<f64>,
}

/// Errors of headings over all matched boxes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct HeadingScore {
    /// Share of the boxes whose heading errs by more than 90°.
    pub turned_share: Option<f64>,
    /// Matched boxes of objects above 1 m/s, by the truth's places in the second around.
    pub moving_boxes: u64,
    /// The same share of the moving ones.
    pub moving_turned_share: Option<f64>,
    /// Median heading error of the moving ones, turned ones included, degrees.
    pub moving_heading_median_deg: Option<f64>,
}

impl Headings {
    /// Adds a matched box. An object of unknown speed (m/s) is not taken as moving.
    pub(super) fn add(&mut self, estimate: &BevBox, truth: &BevBox, speed: Option<f64>) {
        let error_rad = BoxError::between(estimate, truth).yaw.abs();
        self.matched += 1;
        self.turned += u64::from(error_rad > FRAC_PI_2);
        if speed.is_some_and(|speed| speed > MOVING_MPS) {
            self.moving_rad.push(error_rad);
        }
    }

    /// The figures so far.
    pub(super) fn score(&self) -> HeadingScore {
        let mut sorted = self.moving_rad.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let turned = sorted.len() - sorted.partition_point(|error_rad| *error_rad <= FRAC_PI_2);
        let moving_boxes = sorted.len() as u64;
        HeadingScore {
            turned_share: ratio(self.turned, self.matched),
            moving_boxes,
            moving_turned_share: ratio(turned as u64, moving_boxes),
            moving_heading_median_deg: crate::score::percentiles::nearest_rank(&sorted, 50)
                .map(|error_rad| error_rad.to_degrees()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::predicted;

    fn turned_by(rad: f64) -> BevBox {
        BevBox { yaw: rad, ..predicted(0.0, 0.0) }
    }

    #[test]
    fn turned_boxes_are_a_share_and_the_median_is_of_moving_objects_only() {
        let mut headings = Headings::default();
        let (drives, stands) = (Some(1.1), Some(0.9));
        for (rad, speed) in [(0.1, drives), (-0.2, drives), (3.1, drives), (3.0, stands), (0.5, None)] {
            headings.add(&turned_by(rad), &turned_by(0.0), speed);
        }
        let score = headings.score();
        assert_eq!((score.turned_share, score.moving_boxes), (Some(2.0 / 5.0), 3));
        assert_eq!(score.moving_turned_share, Some(1.0 / 3.0));
        assert!((score.moving_heading_median_deg.unwrap() - 0.2_f64.to_degrees()).abs() < 1e-9, "{score:?}");
    }

    #[test]
    fn without_pairs_there_are_no_shares() {
        assert_eq!(Headings::default().score(), HeadingScore::default());
    }
}
