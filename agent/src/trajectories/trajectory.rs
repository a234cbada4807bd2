//! The way of one object between its recorded places.

use v2x_common::geometry::{Pose, angle_difference, wrap_angle};
use v2x_common::time::Span;

/// A recorded place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Since the beginning of the recording.
    pub t: Span,
    /// Where the object was.
    pub pose: Pose,
}

/// Where an object is, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position and heading.
    pub pose: Pose,
    /// East and north, m/s.
    pub velocity: (f64, f64),
}

/// Recorded places in order of time, no two at one time.
///
/// Between two of them the position is on the straight line at constant speed, and the heading turns the shorter way at a
/// constant rate. The object is there from its first place to its last, and not within gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    samples: Vec<Sample>,
    /// In a longer time without a place the object is absent.
    max_gap: Span,
}

impl Trajectory {
    /// Through these places, which are sorted; of places at one time the first counts.
    pub fn new(mut samples: Vec<Sample>, max_gap: Span) -> Self {
        samples.sort_by_key(|sample| sample.t);
        samples.dedup_by_key(|sample| sample.t);
        Self { samples, max_gap }
    }

    /// The recorded places, by time.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Where the object is at a time; `None` where it is not there.
    pub fn at(&self, t: Span) -> Option<State> {
        let after = self.samples.partition_point(|sample| sample.t <= t);
        let from = *self.samples[..after].last()?;
        let Some(to) = self.samples.get(after).filter(|to| to.t - from.t <= self.max_gap) else {
            return (from.t == t).then(|| State { pose: from.pose, velocity: self.velocity_before(after) });
        };
        let (since_s, step_s) = ((t - from.t).as_secs_f64(), (to.t - from.t).as_secs_f64());
        Some(State { pose: between(&from.pose, &to.pose, since_s / step_s), velocity: velocity(&from, to) })
    }

    /// Intervals without a place that are longer than the object stays without one.
    pub fn n_gaps(&self) -> usize {
        self.samples.windows(2).filter(|pair| pair[1].t - pair[0].t > self.max_gap).count()
    }

    /// The velocity at the end of an interval; zero where there is none.
    fn velocity_before(&self, after: usize) -> (f64, f64) {
        let before = after.checked_sub(2).and_then(|from| self.samples.get(from..after));
        match before {
            Some([from, to]) if to.t - from.t <= self.max_gap => velocity(from, to),
            _ => (0.0, 0.0),
        }
    }
}

fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    Pose {
        x: from.x + share * (to.x - from.x),
        y: from.y + share * (to.y - from.y),
        yaw: wrap_angle(from.yaw + share * angle_difference(to.yaw, from.yaw)),
    }
}

fn velocity(from: &Sample, to: &Sample) -> (f64, f64) {
    let step_s = (to.t - from.t).as_secs_f64();
    ((to.pose.x - from.pose.x) / step_s, (to.pose.y - from.pose.y) / step_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const GAP: Span = Span::from_millis(2000);

    fn sample(millis: i64, x: f64, y: f64, yaw: f64) -> Sample {
        Sample { t: Span::from_millis(millis), pose: Pose { x, y, yaw } }
    }

    fn at(trajectory: &Trajectory, millis: i64) -> Option<State> {
        trajectory.at(Span::from_millis(millis))
    }

    #[test]
    fn an_object_is_there_from_its_first_place_to_its_last() {
        let trajectory =
            Trajectory::new(vec![sample(1000, 0.0, 0.0, 0.0), sample(2000, 10.0, 0.0, 0.0)], GAP);
        assert_eq!(at(&trajectory, 999), None);
        assert_eq!(at(&trajectory, 2001), None);
        let middle = at(&trajectory, 1500).unwrap();
        assert_eq!((middle.pose.x, middle.velocity), (5.0, (10.0, 0.0)));
        assert_eq!(
            at(&trajectory, 2000).unwrap().velocity,
            (10.0, 0.0),
            "it does not stop at its last place"
        );
    }

    #[test]
    fn a_heading_turns_the_shorter_way_over_the_cut() {
        let trajectory =
            Trajectory::new(vec![sample(0, 0.0, 0.0, PI - 0.1), sample(1000, 0.0, 0.0, -PI + 0.1)], GAP);
        let yaw = at(&trajectory, 500).unwrap().pose.yaw;
        assert!((yaw.abs() - PI).abs() < 1e-12, "{yaw}");
    }

    #[test]
    fn an_object_is_absent_within_a_long_gap_and_present_at_its_ends() {
        let samples = vec![
            sample(0, 0.0, 0.0, 0.0),
            sample(1000, 1.0, 0.0, 0.0),
            sample(4000, 4.0, 0.0, 0.0),
            sample(5000, 5.0, 0.0, 0.0),
        ];
        let trajectory = Trajectory::new(samples, GAP);
        assert_eq!(trajectory.n_gaps(), 1);
        assert_eq!(at(&trajectory, 1000).unwrap().velocity, (1.0, 0.0));
        assert_eq!((at(&trajectory, 1001), at(&trajectory, 3999)), (None, None));
        assert_eq!(at(&trajectory, 4000).unwrap().pose.x, 4.0);
    }

    fn places() -> impl Strategy<Value = Vec<Sample>> {
        let place = (1..2000i64, -1e3..1e3f64, -1e3..1e3f64, -PI..PI);
        prop::collection::vec(place, 2..12).prop_map(|places| {
            let mut t = 0;
            let sample = |(step, x, y, yaw)| {
                t += step;
                sample(t, x, y, yaw)
            };
            places.into_iter().map(sample).collect()
        })
    }

    proptest! {
        #[test]
        fn every_recorded_place_is_on_the_way(samples in places()) {
            let trajectory = Trajectory::new(samples.clone(), GAP);
            for sample in samples {
                let state = trajectory.at(sample.t).unwrap();
                prop_assert!(state.pose.distance_to(sample.pose.x, sample.pose.y) < 1e-9);
                prop_assert!(angle_difference(state.pose.yaw, sample.pose.yaw).abs() < 1e-12);
            }
        }

        #[test]
        fn between_places_position_and_heading_are_between_theirs(samples in places(), share in 0.0..1.0f64) {
            let trajectory = Trajectory::new(samples.clone(), GAP);
            for pair in samples.windows(2) {
                let [from, to] = [pair[0], pair[1]];
                let t = from.t + Span::from_secs_f64(share * (to.t - from.t).as_secs_f64());
                let State { pose, velocity } = trajectory.at(t).unwrap();
                let length = from.pose.distance_to(to.pose.x, to.pose.y);
                let detour = from.pose.distance_to(pose.x, pose.y) + pose.distance_to(to.pose.x, to.pose.y);
                prop_assert!((detour - length).abs() < 1e-6, "on the straight line");
                let turn = angle_difference(to.pose.yaw, from.pose.yaw).abs();
                let turned = angle_difference(pose.yaw, from.pose.yaw).abs();
                prop_assert!(turned <= turn + 1e-9 && turn <= PI, "the shorter way");
                let left_s = (to.t - t).as_secs_f64();
                let reached = (pose.x + left_s * velocity.0, pose.y + left_s * velocity.1);
                prop_assert!(libm::hypot(reached.0 - to.pose.x, reached.1 - to.pose.y) < 1e-6, "its velocity leads there");
            }
        }

        #[test]
        fn the_order_of_the_places_does_not_matter(samples in places()) {
            let reversed = samples.iter().rev().copied().collect();
            prop_assert_eq!(Trajectory::new(reversed, GAP), Trajectory::new(samples, GAP));
        }
    }
}
