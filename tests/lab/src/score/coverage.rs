//! Coverage: the true objects that an agent is expected to report, those in its field of view for the last second.
//!
//! An object is covered if its centre was in the field of view at the time itself and at every full 100 ms (of Unix
//! time) of the second before it. That second is rounded outwards: the rule is strict by up to one step. A vehicle agent
//! reports itself, so the fused list is expected to contain it. No agent senses itself: agents' own objects are in no
//! field of view and are no common objects. Their fused positions come from the agent's pose and are good to centimetres,
//! which would make fusion look better than it is.

use crate::data::truth::{Observer, Truth};
use std::collections::BTreeMap;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::geometry::Pose;
use v2x_common::time::{Span, Timestamp};

/// How long an object must have been in view until it counts.
pub(crate) const HOLD: Span = Span::from_millis(1000);
/// Step of the checks within that time.
pub(crate) const STEP: Span = Span::from_millis(100);

/// The world at one time, with the coverage of each agent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct View {
    /// Every object of the world, by id.
    pub objects: Vec<TrueObject>,
    /// Per observer, the objects in view for the last second, by id.
    pub held: Vec<Vec<ObjectId>>,
    /// Per observer, the pose of its sensor.
    pub poses: Vec<Option<Pose>>,
}

/// Computes coverage, and caches the steps.
#[derive(Debug)]
pub(crate) struct Coverage<'a> {
    truth: Truth<'a>,
    observers: &'a [Observer],
    steps: BTreeMap<Timestamp, Vec<Vec<ObjectId>>>,
}

impl<'a> Coverage<'a> {
    /// With an empty cache.
    pub(crate) const fn new(truth: Truth<'a>, observers: &'a [Observer]) -> Self {
        Self { truth, observers, steps: BTreeMap::new() }
    }

    /// The observers.
    pub(crate) const fn observers(&self) -> &'a [Observer] {
        self.observers
    }

    /// The world and the agents' coverage at a time.
    pub(crate) fn at(&mut self, at: Timestamp) -> View {
        let objects = self.truth.objects(at);
        let poses: Vec<_> = self.observers.iter().map(|o| (self.truth.agent_pose)(&o.agent, at)).collect();
        let mut held = in_view(self.observers, &poses, &objects);
        let mut step = (at - HOLD).floor_to(STEP);
        while step <= at {
            let (truth, observers) = (self.truth, self.observers);
            let seen = self.steps.entry(step).or_insert_with(|| {
                let poses: Vec<_> = observers.iter().map(|o| (truth.agent_pose)(&o.agent, step)).collect();
                in_view(observers, &poses, &truth.objects(step))
            });
            for (held, seen) in held.iter_mut().zip(seen) {
                held.retain(|id| seen.binary_search(id).is_ok());
            }
            step += STEP;
        }
        View { objects, held, poses }
    }

    /// Whether the fused list is expected to contain the object: some agent covers it, or is it.
    pub(crate) fn is_covered(&self, view: &View, id: ObjectId) -> bool {
        self.is_observer(id) || view.held.iter().any(|held| held.binary_search(&id).is_ok())
    }

    /// Whether every agent covers the object.
    pub(crate) fn is_common(&self, view: &View, id: ObjectId) -> bool {
        !self.is_observer(id) && view.held.iter().all(|held| held.binary_search(&id).is_ok())
    }

    /// Whether the point (m) is in every agent's field of view at the view's time.
    pub(crate) fn all_see(&self, view: &View, x: f64, y: f64) -> bool {
        self.observers
            .iter()
            .zip(&view.poses)
            .all(|(o, pose)| pose.is_some_and(|pose| o.field_of_view.contains(&pose, x, y)))
    }

    /// Whether the object is an agent.
    pub(crate) fn is_observer(&self, id: ObjectId) -> bool {
        self.observers.iter().any(|observer| observer.itself == Some(id))
    }
}

fn in_view(observers: &[Observer], poses: &[Option<Pose>], objects: &[TrueObject]) -> Vec<Vec<ObjectId>> {
    let seen_by = |observer: &Observer, pose: &Pose| {
        objects
            .iter()
            .filter(|o| {
                observer.itself != Some(o.id) && observer.field_of_view.contains(pose, o.bev.x, o.bev.y)
            })
            .map(|o| o.id)
            .collect()
    };
    observers
        .iter()
        .zip(poses)
        .map(|(observer, pose)| pose.as_ref().map_or_else(Vec::new, |pose| seen_by(observer, pose)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{at_ms, observer, parked};

    #[test]
    fn an_object_counts_only_after_a_whole_second_in_view() {
        // Drives in at 10 m/s from x = 60; the field of view ends at 50 m: in view from t = 1 s.
        let objects_at = |at: Timestamp, out: &mut Vec<TrueObject>| {
            let seconds = (at - Timestamp::EPOCH).as_secs_f64();
            out.push(parked(1, 60.0 - 10.0 * seconds, 0.0));
        };
        let truth = Truth { objects_at: &objects_at, agent_pose: &|_, _| Some(Pose::default()) };
        let observers = [observer("rsu", 50.0, None)];
        let mut coverage = Coverage::new(truth, &observers);
        for (ms, expected) in [(500, false), (1_050, false), (1_990, false), (2_000, true), (2_060, true)] {
            let view = coverage.at(at_ms(ms));
            assert_eq!(coverage.is_covered(&view, ObjectId(1)), expected, "at {ms} ms");
        }
    }

    #[test]
    fn an_object_that_was_out_of_view_for_one_step_starts_again() {
        let objects_at = |at: Timestamp, out: &mut Vec<TrueObject>| {
            let x = if at == at_ms(5_000) { 51.0 } else { 20.0 };
            out.push(parked(1, x, 0.0));
        };
        let truth = Truth { objects_at: &objects_at, agent_pose: &|_, _| Some(Pose::default()) };
        let observers = [observer("rsu", 50.0, None)];
        let mut coverage = Coverage::new(truth, &observers);
        let mut covered = |ms| {
            let view = coverage.at(at_ms(ms));
            coverage.is_covered(&view, ObjectId(1))
        };
        assert_eq!([4_950, 5_050, 6_050, 6_150].map(&mut covered), [true, false, false, true]);
    }

    #[test]
    fn a_vehicle_covers_itself_but_is_no_common_object() {
        let objects_at = |_: Timestamp, out: &mut Vec<TrueObject>| {
            out.extend([parked(9, 30.0, 0.0), parked(1, 0.0, 0.0), parked(5, 70.0, 0.0)]);
        };
        let truth = Truth { objects_at: &objects_at, agent_pose: &|_, _| Some(Pose::default()) };
        let observers = [observer("ego", 50.0, Some(1)), observer("rsu", 80.0, None)];
        let mut coverage = Coverage::new(truth, &observers);
        let view = coverage.at(at_ms(3_000));
        assert_eq!(view.held, [vec![ObjectId(9)], vec![ObjectId(1), ObjectId(5), ObjectId(9)]]);
        let common: Vec<_> =
            [1, 5, 9].into_iter().filter(|id| coverage.is_common(&view, ObjectId(*id))).collect();
        assert_eq!(common, [9]);
        assert!(coverage.is_covered(&view, ObjectId(1)));
        assert!(coverage.all_see(&view, 49.0, 0.0) && !coverage.all_see(&view, 51.0, 0.0));
    }

    #[test]
    fn an_agent_without_a_pose_covers_no_object() {
        let objects_at = |_: Timestamp, out: &mut Vec<TrueObject>| out.push(parked(1, 0.0, 0.0));
        let truth = Truth { objects_at: &objects_at, agent_pose: &|_, _| None };
        let observers = [observer("rsu", 50.0, None)];
        let mut coverage = Coverage::new(truth, &observers);
        let view = coverage.at(at_ms(0));
        assert!(!coverage.is_covered(&view, ObjectId(1)) && !coverage.all_see(&view, 0.0, 0.0));
    }
}
