//! Which objects a frame includes: rules after ETSI TS 103 324 (collective perception service).
//!
//! The rules need the sender's own tracks. The simulation assumes a perfect tracker: it knows which detection is of
//! which object, and how that object truly moves. A false detection counts as an object detected for the first time.

use std::collections::BTreeMap;

use v2x_common::class::Class;
use v2x_common::time::Span;

use crate::truth::{ObjectId, TrueObject};

/// An object that was last included that long ago is included again; a frame without any is sent after that time.
pub const LONGEST_SILENCE: Span = Span::from_millis(1000);
/// Pedestrians and cyclists are included again after that time.
const LONGEST_SILENCE_OF_PEOPLE: Span = Span::from_millis(500);
/// A vehicle is included again when it has moved by more than this since it was last included, m.
const MOVED_M: f64 = 4.0;
/// The same for a change of speed, m/s.
const SPEED_CHANGE_MPS: f64 = 0.5;
/// The same for a turn by this or more, rad.
const TURN_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Capture times are rounded down to the nanosecond: ten frames of 0.1 s must count as a second.
const ROUNDING: Span = Span::from_micros(1);

/// What a detection is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Subject {
    /// The sender itself: included in each frame that is sent; it alone is no reason to send a frame.
    Own,
    /// An object of the world, in its true state.
    Object(TrueObject),
    /// A false detection of this class.
    Clutter(Class),
}

/// What one sender has included in its frames so far. Takes its frames in their order.
#[derive(Clone, Debug, Default)]
pub(super) struct InclusionRules {
    /// All objects but pedestrians and cyclists, as they were last included.
    included: BTreeMap<ObjectId, (Span, TrueObject)>,
    /// When each pedestrian or cyclist was last detected.
    people: BTreeMap<ObjectId, Span>,
    people_included_at: Option<Span>,
    sent_at: Option<Span>,
}

impl InclusionRules {
    /// Which of the detections the frame that was captured at `t` (since the scenario's start) includes; `None` where
    /// it is not sent at all.
    pub(super) fn choose(&mut self, t: Span, subjects: &[Subject]) -> Option<Vec<bool>> {
        self.forget(t);
        let are_people_included = self.are_people_due(t, subjects);
        let is_included: Vec<bool> = subjects
            .iter()
            .map(|subject| match subject {
                Subject::Own => true,
                _ if subject.is_of_people() => are_people_included,
                Subject::Clutter(_) => true,
                Subject::Object(object) => self.is_due(t, object),
            })
            .collect();
        self.note_people(t, subjects);
        let includes_any =
            subjects.iter().zip(&is_included).any(|(subject, is_in)| *is_in && *subject != Subject::Own);
        if !includes_any && !is_over(LONGEST_SILENCE, t, self.sent_at) {
            return None;
        }
        self.remember(t, subjects, &is_included);
        Some(is_included)
    }

    fn is_due(&self, t: Span, object: &TrueObject) -> bool {
        let Some((at, last)) = self.included.get(&object.id) else { return true };
        let moved_m = libm::hypot(object.bev.x - last.bev.x, object.bev.y - last.bev.y);
        let turned = v2x_common::geometry::angle_difference(object.bev.yaw, last.bev.yaw).abs();
        moved_m > MOVED_M
            || (speed_mps(object) - speed_mps(last)).abs() > SPEED_CHANGE_MPS
            || turned >= TURN_RAD
            || is_over(LONGEST_SILENCE, t, Some(*at))
    }

    /// All of them or none: when there is a new one, or after [`LONGEST_SILENCE_OF_PEOPLE`].
    fn are_people_due(&self, t: Span, subjects: &[Subject]) -> bool {
        let is_new = |subject: &Subject| match subject {
            Subject::Object(object) => !self.people.contains_key(&object.id),
            _ => true,
        };
        is_over(LONGEST_SILENCE_OF_PEOPLE, t, self.people_included_at)
            || subjects.iter().filter(|subject| subject.is_of_people()).any(is_new)
    }

    /// The sender deletes a track that had no detection for that long.
    fn forget(&mut self, t: Span) {
        self.included.retain(|_, (at, _)| !is_over(LONGEST_SILENCE, t, Some(*at)));
        self.people.retain(|_, detected_at| !is_over(LONGEST_SILENCE, t, Some(*detected_at)));
    }

    fn note_people(&mut self, t: Span, subjects: &[Subject]) {
        for subject in subjects.iter().filter(|subject| subject.is_of_people()) {
            if let Subject::Object(object) = subject {
                self.people.insert(object.id, t);
            }
        }
    }

    fn remember(&mut self, t: Span, subjects: &[Subject], is_included: &[bool]) {
        self.sent_at = Some(t);
        for (subject, is_in) in subjects.iter().zip(is_included) {
            match subject {
                _ if !*is_in => {}
                _ if subject.is_of_people() => self.people_included_at = Some(t),
                Subject::Object(object) => drop(self.included.insert(object.id, (t, *object))),
                Subject::Own | Subject::Clutter(_) => {}
            }
        }
    }
}

impl Subject {
    /// Whether it is of a pedestrian or cyclist.
    fn is_of_people(&self) -> bool {
        let class = match self {
            Self::Own => return false,
            Self::Object(object) => object.class,
            Self::Clutter(class) => *class,
        };
        class.is_pedestrian() || class == Class::Bicycle
    }
}

fn is_over(silence: Span, t: Span, since: Option<Span>) -> bool {
    since.is_none_or(|since| t - since + ROUNDING >= silence)
}

fn speed_mps(object: &TrueObject) -> f64 {
    libm::hypot(object.velocity.0, object.velocity.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::geometry::BevBox;

    fn object(id: u32, class: Class) -> TrueObject {
        let bev = BevBox { x: 0.0, y: 0.0, w: 1.8, d: 4.5, yaw: 0.0 };
        TrueObject { id: ObjectId(id), class, bev, velocity: (0.0, 0.0) }
    }

    fn car() -> TrueObject {
        object(1, Class::Car)
    }

    fn person(id: u32) -> Subject {
        Subject::Object(object(id, Class::Adult))
    }

    /// Whether a sender that included the standing car at 0 includes `later` 100 ms after.
    fn is_included_again(later: TrueObject) -> bool {
        let mut rules = InclusionRules::default();
        assert_eq!(rules.choose(Span::ZERO, &[Subject::Object(car())]), Some(vec![true]));
        rules.choose(Span::from_millis(100), &[Subject::Object(later)]).is_some()
    }

    fn at(bev: impl FnOnce(&mut BevBox)) -> TrueObject {
        let mut car = car();
        bev(&mut car.bev);
        car
    }

    #[test]
    fn a_vehicle_is_included_when_new_and_not_again_while_its_state_is_the_same() {
        assert!(!is_included_again(car()));
        assert!(is_included_again(object(2, Class::Car)));
    }

    #[test]
    fn a_vehicle_is_included_again_when_it_moved_more_than_4_m() {
        assert!(!is_included_again(at(|bev| bev.x = 4.0)));
        assert!(is_included_again(at(|bev| (bev.x, bev.y) = (3.0, 3.0))));
    }

    #[test]
    fn a_vehicle_is_included_again_when_its_speed_changed_by_more_than_half_a_metre_a_second() {
        assert!(!is_included_again(TrueObject { velocity: (0.5, 0.0), ..car() }));
        assert!(is_included_again(TrueObject { velocity: (0.4, 0.4), ..car() }));
    }

    #[test]
    fn a_vehicle_is_included_again_when_it_turned_by_4_degrees() {
        assert!(!is_included_again(at(|bev| bev.yaw = -3.9_f64.to_radians())));
        assert!(is_included_again(at(|bev| bev.yaw = -4.0_f64.to_radians())));
    }

    #[test]
    fn a_vehicle_is_included_again_after_a_second_and_so_is_an_empty_frame() {
        let mut rules = InclusionRules::default();
        let frames = (0..21).filter(|n| {
            let chosen = rules.choose(Span::from_millis(100 * n), &[Subject::Object(car())]);
            chosen.is_some_and(|chosen| chosen == [true])
        });
        assert_eq!(frames.collect::<Vec<i64>>(), [0, 10, 20]);
        let mut rules = InclusionRules::default();
        let frames = (0..21).filter(|n| rules.choose(Span::from_millis(100 * n), &[]).is_some());
        assert_eq!(frames.collect::<Vec<i64>>(), [0, 10, 20]);
    }

    #[test]
    fn all_people_are_included_together_after_half_a_second() {
        let mut rules = InclusionRules::default();
        let subjects = [person(1), Subject::Object(object(2, Class::Bicycle))];
        let chosen = (0..11).map(|n| rules.choose(Span::from_millis(100 * n), &subjects));
        for (n, chosen) in chosen.enumerate() {
            assert_eq!(chosen, (n % 5 == 0).then(|| vec![true, true]), "frame {n}");
        }
    }

    #[test]
    fn a_new_person_causes_all_people_to_be_included_and_no_vehicle() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), Subject::Object(car())]);
        let subjects = [person(1), Subject::Object(car()), person(2)];
        assert_eq!(rules.choose(Span::from_millis(100), &subjects), Some(vec![true, false, true]));
        assert_eq!(rules.choose(Span::from_millis(200), &subjects), None);
    }

    #[test]
    fn a_moving_vehicle_does_not_cause_people_to_be_included() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), Subject::Object(car())]);
        let moved = Subject::Object(at(|bev| bev.x = 5.0));
        assert_eq!(rules.choose(Span::from_millis(100), &[person(1), moved]), Some(vec![false, true]));
    }

    #[test]
    fn a_person_missed_in_one_frame_is_not_new() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), person(2)]);
        assert_eq!(rules.choose(Span::from_millis(100), &[person(2)]), None);
        assert_eq!(rules.choose(Span::from_millis(200), &[person(1), person(2)]), None);
    }

    #[test]
    fn a_person_detected_in_every_frame_does_not_become_new_by_frames_without_people() {
        let mut rules = InclusionRules::default();
        for n in 0..40 {
            let chosen = rules.choose(Span::from_millis(100 * n), &[person(1)]);
            assert_eq!(chosen.is_some(), n % 5 == 0, "frame {n}");
        }
    }

    #[test]
    fn the_sender_is_included_in_each_frame_that_is_sent_and_causes_none_to_be_sent() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[Subject::Own]);
        assert_eq!(rules.choose(Span::from_millis(100), &[Subject::Own]), None);
        let with_clutter = [Subject::Own, Subject::Clutter(Class::TrafficCone)];
        assert_eq!(rules.choose(Span::from_millis(200), &with_clutter), Some(vec![true, true]));
    }
}
