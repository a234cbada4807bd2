//! Where an agent's detections are relative to its sensor: what its description says of its field of view is compared with that.

use super::observation::Observation;
use v2x_common::geometry::wrap_angle;
use v2x_common::sensor::FieldOfView;

/// Every so manyth frame is looked at, and so many detections of it and of a window.
const EVERY: u64 = 4;
const MAX_OF_FRAME: usize = 24;
const MAX_SEEN: usize = 600;
/// Fewest that say anything.
const MIN_SEEN: usize = 60;
/// A view is declared with some margin: within such a share of its range, m, and rad.
const RANGE_SHARE: f64 = 1.15;
const RANGE_M: f64 = 3.0;
const AZIMUTH_RAD: f64 = 0.15;
/// Of all detections so many are outside of a view that is wrong.
const OUTSIDE: f64 = 0.3;
/// Nothing is seen so far away, m; and what is seen is within such a part of the range.
const FAR_M: f64 = 1_000.0;
const NEAR_SHARE: f64 = 0.1;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Views {
    frames: u64,
    /// Range, m, and direction relative to the sensor's heading, rad.
    seen: Vec<[f64; 2]>,
}

/// A field of view that is not the one of what is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum WrongView {
    /// So many of so many detections are outside, of which most are too far away, or else in another direction.
    Outside { n: usize, of: usize, by_range: bool },
    /// Nearly everything is within such a range, m.
    TooFar { within_m: f64 },
}

impl Views {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let Some(pose) = seen.frame.sensor_pose else { return };
        self.frames += 1;
        if !self.frames.is_multiple_of(EVERY) || self.seen.len() >= MAX_SEEN {
            return;
        }
        let places = seen.frame.detections.iter().take(MAX_OF_FRAME).map(|one| (one.bev.x, one.bev.y));
        self.seen.extend(places.map(|(x, y)| [pose.distance_to(x, y), pose.bearing_to(x, y)]));
    }

    /// What is wrong with a declared view; `None` where nothing is, or too little was seen.
    #[expect(clippy::cast_precision_loss, reason = "some hundred")]
    pub(super) fn wrong(&self, view: &FieldOfView) -> Option<WrongView> {
        // Its own body is nearer.
        let seen: Vec<_> = self.seen.iter().filter(|[range_m, _]| *range_m >= view.range_min_m).collect();
        let of = seen.len();
        if of < MIN_SEEN {
            return None;
        }
        let is_too_far = |range_m: f64| range_m > RANGE_SHARE * view.range_max_m + RANGE_M;
        let half_rad = view.width_rad / 2.0 + AZIMUTH_RAD;
        let is_beside = |direction: f64| wrap_angle(direction - view.azimuth_rad).abs() > half_rad;
        let n_too_far = seen.iter().filter(|[range_m, _]| is_too_far(*range_m)).count();
        let n_outside =
            seen.iter().filter(|[range_m, direction]| is_too_far(*range_m) || is_beside(*direction)).count();
        if n_outside as f64 >= OUTSIDE * of as f64 {
            return Some(WrongView::Outside { n: n_outside, of, by_range: 2 * n_too_far > n_outside });
        }
        let mut ranges: Vec<_> = seen.iter().map(|[range_m, _]| *range_m).collect();
        ranges.sort_by(f64::total_cmp);
        let within_m = ranges[of * 19 / 20];
        let is_never_so_far = view.range_max_m >= FAR_M && within_m <= NEAR_SHARE * view.range_max_m;
        is_never_so_far.then_some(WrongView::TooFar { within_m })
    }
}
