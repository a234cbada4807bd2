//! Where a sensor has detected anything of late.

use crate::values::{SeenPlaces, SensorAxes};
use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// What was detected so long ago is forgotten, and after twice as long at the latest: a sensor is turned, a lorry parks before it.
const KEPT: Span = Span::from_millis(60_000);

/// Places of two spans of time, the one that runs and the one before.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct RecentPlaces {
    /// The span that runs, counted from the epoch of timestamps.
    span: i64,
    now: SeenPlaces,
    before: SeenPlaces,
}

impl RecentPlaces {
    /// Notes a detection at a place (m). Frames come in order of capture.
    pub(super) fn note(&mut self, at: Timestamp, axes: &SensorAxes, place: [f64; 2]) {
        let span = at.as_nanos().div_euclid(KEPT.as_nanos());
        if span != self.span {
            self.before = if span == self.span + 1 { self.now } else { SeenPlaces::default() };
            self.now = SeenPlaces::default();
            self.span = span;
        }
        self.now.note(axes, place);
    }

    /// Where anything was detected of late.
    pub(super) fn seen(&self) -> SeenPlaces {
        self.now.or(&self.before)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> (&'static str, String) {
    ("learning.places_kept_s", KEPT.as_secs_f64().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::geometry::Pose;

    #[test]
    fn a_place_is_forgotten_where_nothing_was_detected_for_two_minutes_and_not_within_one() {
        let pose = Pose { x: 0.0, y: 0.0, yaw: 0.0 };
        let at = |s: i64| Timestamp::EPOCH + Span::from_millis(1000 * s);
        let (here, there) = ([20.0, 0.0], [-60.0, 0.0]);
        let axes = SensorAxes::of(&pose);
        let mut places = RecentPlaces::default();
        places.note(at(1000), &axes, here);
        for (s, is_kept) in [(1001, true), (1055, true), (1125, false)] {
            places.note(at(s), &axes, there);
            assert_eq!(places.seen().from_pose(&pose).hold(here), is_kept, "{s} s");
            assert!(places.seen().from_pose(&pose).hold(there));
        }
        places.note(at(5000), &axes, here);
        assert!(!places.seen().from_pose(&pose).hold(there), "a long silence forgets all");
    }
}
