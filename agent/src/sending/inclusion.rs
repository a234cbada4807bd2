//! Which objects a frame tells of: rules after ETSI TS 103 324 (collective perception service).
//!
//! The rules need the sender's own tracks. The simulation takes the sender's tracker as perfect: it knows which
//! detection is of which object, and how that object truly moves. A false detection is to it an object seen for the
//! first time.

use std::collections::BTreeMap;

use v2x_common::class::Class;
use v2x_common::time::Span;

use crate::truth::{ObjectId, TrueObject};

/// Whoever was told of that long ago is told of again; so is a frame that tells of nobody.
pub const LONGEST_SILENCE: Span = Span::from_millis(1000);
/// Pedestrians and cyclists are told of again after that.
const LONGEST_SILENCE_OF_PEOPLE: Span = Span::from_millis(500);
/// A vehicle that moved farther since it was told of, m, is told of again.
const MOVED_M: f64 = 4.0;
/// One that changed its speed by more, m/s.
const SPEED_CHANGE_MPS: f64 = 0.5;
/// One that turned by this or more, rad.
const TURN_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Capture times are rounded down to the nanosecond: ten tenths of a second shall be a second.
const ROUNDING: Span = Span::from_micros(1);

/// What a detection is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sighting {
    /// The sender itself: stands in each frame that is sent, and makes none be sent.
    Own,
    /// An object of the world, as it truly is.
    Object(TrueObject),
    /// Nothing: clutter of this class.
    Phantom(Class),
}

/// One sender's memory of whom it told of. Fed with its frames in their order.
#[derive(Clone, Debug, Default)]
pub struct InclusionRules {
    /// Everything but pedestrians and cyclists, as last told of.
    told: BTreeMap<ObjectId, (Span, TrueObject)>,
    /// When each pedestrian or cyclist was last seen.
    people: BTreeMap<ObjectId, Span>,
    people_told_at: Option<Span>,
    sent_at: Option<Span>,
}

impl InclusionRules {
    /// Which of the sightings the frame that was captured at `t` (since the scenario's start) tells of; `None` where
    /// it is not sent at all.
    pub fn choose(&mut self, t: Span, sightings: &[Sighting]) -> Option<Vec<bool>> {
        self.forget(t);
        let are_people_told = self.are_people_due(t, sightings);
        let included: Vec<bool> = sightings
            .iter()
            .map(|sighting| match sighting {
                Sighting::Own => true,
                _ if sighting.is_of_people() => are_people_told,
                Sighting::Phantom(_) => true,
                Sighting::Object(object) => self.is_due(t, object),
            })
            .collect();
        self.see_people(t, sightings);
        let tells_of_any =
            sightings.iter().zip(&included).any(|(sighting, is_in)| *is_in && *sighting != Sighting::Own);
        if !tells_of_any && !is_over(LONGEST_SILENCE, t, self.sent_at) {
            return None;
        }
        self.remember(t, sightings, &included);
        Some(included)
    }

    fn is_due(&self, t: Span, object: &TrueObject) -> bool {
        let Some((at, told)) = self.told.get(&object.id) else { return true };
        let moved_m = libm::hypot(object.bev.x - told.bev.x, object.bev.y - told.bev.y);
        let turned = v2x_common::geometry::angle_difference(object.bev.yaw, told.bev.yaw).abs();
        moved_m > MOVED_M
            || (speed_mps(object) - speed_mps(told)).abs() > SPEED_CHANGE_MPS
            || turned >= TURN_RAD
            || is_over(LONGEST_SILENCE, t, Some(*at))
    }

    /// All or none of them: at a new one, or after a while.
    fn are_people_due(&self, t: Span, sightings: &[Sighting]) -> bool {
        let is_new = |sighting: &Sighting| match sighting {
            Sighting::Object(object) => !self.people.contains_key(&object.id),
            _ => true,
        };
        is_over(LONGEST_SILENCE_OF_PEOPLE, t, self.people_told_at)
            || sightings.iter().filter(|sighting| sighting.is_of_people()).any(is_new)
    }

    /// A track that got no detection for so long has ended.
    fn forget(&mut self, t: Span) {
        self.told.retain(|_, (at, _)| !is_over(LONGEST_SILENCE, t, Some(*at)));
        self.people.retain(|_, seen_at| !is_over(LONGEST_SILENCE, t, Some(*seen_at)));
    }

    fn see_people(&mut self, t: Span, sightings: &[Sighting]) {
        for sighting in sightings.iter().filter(|sighting| sighting.is_of_people()) {
            if let Sighting::Object(object) = sighting {
                self.people.insert(object.id, t);
            }
        }
    }

    fn remember(&mut self, t: Span, sightings: &[Sighting], included: &[bool]) {
        self.sent_at = Some(t);
        for (sighting, is_in) in sightings.iter().zip(included) {
            match sighting {
                _ if !*is_in => {}
                _ if sighting.is_of_people() => self.people_told_at = Some(t),
                Sighting::Object(object) => drop(self.told.insert(object.id, (t, *object))),
                Sighting::Own | Sighting::Phantom(_) => {}
            }
        }
    }
}

impl Sighting {
    /// Whether it is of a pedestrian or cyclist.
    fn is_of_people(&self) -> bool {
        let class = match self {
            Self::Own => return false,
            Self::Object(object) => object.class,
            Self::Phantom(class) => *class,
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

    fn person(id: u32) -> Sighting {
        Sighting::Object(object(id, Class::Adult))
    }

    /// A sender that told of the standing car at 0, and what it says of `later` 100 ms after.
    fn told_again(later: TrueObject) -> bool {
        let mut rules = InclusionRules::default();
        assert_eq!(rules.choose(Span::ZERO, &[Sighting::Object(car())]), Some(vec![true]));
        rules.choose(Span::from_millis(100), &[Sighting::Object(later)]).is_some()
    }

    fn at(bev: impl FnOnce(&mut BevBox)) -> TrueObject {
        let mut car = car();
        bev(&mut car.bev);
        car
    }

    #[test]
    fn a_vehicle_is_told_of_when_new_and_not_again_while_nothing_happens() {
        assert!(!told_again(car()));
        assert!(told_again(object(2, Class::Car)));
    }

    #[test]
    fn a_vehicle_is_told_of_again_when_it_moved_more_than_4_m() {
        assert!(!told_again(at(|bev| bev.x = 4.0)));
        assert!(told_again(at(|bev| (bev.x, bev.y) = (3.0, 3.0))));
    }

    #[test]
    fn a_vehicle_is_told_of_again_when_its_speed_changed_by_more_than_half_a_metre_a_second() {
        assert!(!told_again(TrueObject { velocity: (0.5, 0.0), ..car() }));
        assert!(told_again(TrueObject { velocity: (0.4, 0.4), ..car() }));
    }

    #[test]
    fn a_vehicle_is_told_of_again_when_it_turned_by_4_degrees() {
        assert!(!told_again(at(|bev| bev.yaw = -3.9_f64.to_radians())));
        assert!(told_again(at(|bev| bev.yaw = -4.0_f64.to_radians())));
    }

    #[test]
    fn a_vehicle_is_told_of_again_after_a_second_and_so_is_an_empty_frame() {
        let mut rules = InclusionRules::default();
        let frames = (0..21).filter(|n| {
            let chosen = rules.choose(Span::from_millis(100 * n), &[Sighting::Object(car())]);
            chosen.is_some_and(|chosen| chosen == [true])
        });
        assert_eq!(frames.collect::<Vec<i64>>(), [0, 10, 20]);
        let mut rules = InclusionRules::default();
        let frames = (0..21).filter(|n| rules.choose(Span::from_millis(100 * n), &[]).is_some());
        assert_eq!(frames.collect::<Vec<i64>>(), [0, 10, 20]);
    }

    #[test]
    fn people_are_told_of_all_together_after_half_a_second() {
        let mut rules = InclusionRules::default();
        let sightings = [person(1), Sighting::Object(object(2, Class::Bicycle))];
        let chosen = (0..11).map(|n| rules.choose(Span::from_millis(100 * n), &sightings));
        for (n, chosen) in chosen.enumerate() {
            assert_eq!(chosen, (n % 5 == 0).then(|| vec![true, true]), "frame {n}");
        }
    }

    #[test]
    fn a_new_person_brings_all_of_them_and_no_vehicle() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), Sighting::Object(car())]);
        let sightings = [person(1), Sighting::Object(car()), person(2)];
        assert_eq!(rules.choose(Span::from_millis(100), &sightings), Some(vec![true, false, true]));
        assert_eq!(rules.choose(Span::from_millis(200), &sightings), None);
    }

    #[test]
    fn a_moving_vehicle_alone_leaves_people_out() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), Sighting::Object(car())]);
        let moved = Sighting::Object(at(|bev| bev.x = 5.0));
        assert_eq!(rules.choose(Span::from_millis(100), &[person(1), moved]), Some(vec![false, true]));
    }

    #[test]
    fn a_person_missed_for_a_moment_is_not_new() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[person(1), person(2)]);
        assert_eq!(rules.choose(Span::from_millis(100), &[person(2)]), None);
        assert_eq!(rules.choose(Span::from_millis(200), &[person(1), person(2)]), None);
    }

    #[test]
    fn a_person_seen_all_the_time_does_not_become_new_by_frames_that_leave_people_out() {
        let mut rules = InclusionRules::default();
        for n in 0..40 {
            let chosen = rules.choose(Span::from_millis(100 * n), &[person(1)]);
            assert_eq!(chosen.is_some(), n % 5 == 0, "frame {n}");
        }
    }

    #[test]
    fn the_sender_stands_in_each_frame_that_is_sent_and_makes_none_be_sent() {
        let mut rules = InclusionRules::default();
        rules.choose(Span::ZERO, &[Sighting::Own]);
        assert_eq!(rules.choose(Span::from_millis(100), &[Sighting::Own]), None);
        let with_clutter = [Sighting::Own, Sighting::Phantom(Class::TrafficCone)];
        assert_eq!(rules.choose(Span::from_millis(200), &with_clutter), Some(vec![true, true]));
    }
}
