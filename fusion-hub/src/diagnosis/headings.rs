//! An agent's headings against the directions in which the objects move.

use super::observation::Observation;
use std::collections::BTreeMap;
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::fused::FusedFrame;
use v2x_common::geometry::wrap_angle;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// An object's direction of motion is known from this speed on, m/s.
const MOVING_MPS: f64 = 3.0;
/// A detection is of the nearest object within this, m.
const NEAR_M: f64 = 2.0;
/// Those that are further away by less than this must move alike, m and m/s.
const CLEAR_M: f64 = 1.5;
const ALIKE_MPS: f64 = 3.0;
/// A list is used for frames captured within this of its time, so that a clock that is off by a second can be found.
const AT_ONE_TIME: Span = Span::from_millis(1_200);
/// Most objects of a list that are kept.
const MAX_OBJECTS: usize = 256;

/// An object of a list.
#[derive(Clone, Copy, Debug)]
struct Object {
    /// m.
    at: [f64; 2],
    /// m/s.
    velocity: [f64; 2],
    /// How fast its direction of motion turns, rad/s.
    turn_rate: f64,
}

/// The objects of the newest list, with their velocities.
#[derive(Clone, Debug, Default)]
pub(super) struct Moving {
    at: Option<Timestamp>,
    objects: Vec<Object>,
    /// The directions of motion of those that move, rad.
    directions: BTreeMap<TrackId, f64>,
}

impl Moving {
    pub(super) fn note(&mut self, list: &FusedFrame) {
        let passed_s =
            self.at.map(|at| (list.fused_at - at).as_secs_f64()).filter(|passed_s| *passed_s > 0.0);
        self.at = Some(list.fused_at);
        self.objects.clear();
        let before = std::mem::take(&mut self.directions);
        for object in list.objects.iter().take(MAX_OBJECTS) {
            let (vx, vy) = object.velocity;
            let mut turn_rate = 0.0;
            if libm::hypot(vx, vy) >= MOVING_MPS {
                let direction = libm::atan2(vy, vx);
                if let (Some(was), Some(passed_s)) = (before.get(&object.track), passed_s) {
                    turn_rate = wrap_angle(direction - was) / passed_s;
                }
                self.directions.insert(object.track, direction);
            }
            self.objects.push(Object { at: [object.bev.x, object.bev.y], velocity: [vx, vy], turn_rate });
        }
    }

    /// The time of the list that it has taken in last.
    pub(super) const fn at(&self) -> Option<Timestamp> {
        self.at
    }

    /// The velocity (m/s) of what is within some metres of a place at a time; `None` where there is nothing, or what is there moves differently.
    pub(super) fn velocity_at(
        &self,
        place: [f64; 2],
        captured_at: Timestamp,
        within_m: f64,
    ) -> Option<[f64; 2]> {
        self.object_at(place, captured_at, within_m).map(|object| object.velocity)
    }

    fn object_at(&self, [x, y]: [f64; 2], captured_at: Timestamp, within_m: f64) -> Option<&Object> {
        let since = captured_at - self.at?;
        if since.abs() > AT_ONE_TIME {
            return None;
        }
        let since_s = since.as_secs_f64();
        let most_m = within_m + CLEAR_M;
        let by_distance = || {
            self.objects.iter().filter_map(|object| {
                let Object { at, velocity, .. } = object;
                let (dx, dy) = (at[0] + velocity[0] * since_s - x, at[1] + velocity[1] * since_s - y);
                (dx.abs() <= most_m && dy.abs() <= most_m).then(|| (libm::sqrt(dx * dx + dy * dy), object))
            })
        };
        let (by_m, object) = by_distance().min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Where two agents disagree, one car is two objects, which move alike.
        let velocity = object.velocity;
        let moves_alike =
            |other: [f64; 2]| libm::hypot(other[0] - velocity[0], other[1] - velocity[1]) <= ALIKE_MPS;
        let is_clear = by_distance()
            .filter(|(other_m, _)| *other_m <= by_m + CLEAR_M)
            .all(|(_, other)| moves_alike(other.velocity));
        (by_m <= within_m && is_clear).then_some(object)
    }
}

/// Sums over detections of moving objects; an angle is counted as the direction that it points to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Headings {
    n: u64,
    /// Heading less direction of motion.
    less: [f64; 2],
    /// Heading and direction of motion together.
    sum: [f64; 2],
    /// Twice the direction of motion: long where all traffic is along one axis.
    axis: [f64; 2],
    /// Heading alone.
    heading: [f64; 2],
    /// Twice what `less` counts: long where headings are those of axes.
    axis_less: [f64; 2],
    /// Headings that point against the motion.
    against: u64,
    /// Rates of turn, rad/s.
    turn_rates: f64,
}

/// What headings are that go with the motion of what is seen in no way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unfit {
    /// They are about the same, rad, whatever moves in which direction.
    Constant(f64),
    /// They are along the motion, and such a share of them against it.
    Axes(f64),
    /// Nothing is known of them but that they do not fit.
    Unrelated,
}

/// What the sums say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// The headings are the directions of motion, turned by a constant angle, rad.
    Turned(f64),
    /// They grow clockwise; the heading of what moves east, rad.
    Clockwise(f64),
}

/// Fewest detections that say anything.
const MIN_DETECTIONS: u64 = 15;
/// Directions of motion are of a list before the frame, and of a filter that follows a turn, s.
const LAG_S: f64 = 0.7;
/// Least mean of unit vectors that agree.
const AGREE: f64 = 0.85;
/// Fewest detections that show that headings are unfit, and most of a mean of unit vectors then: what is right but for a few
/// objects that reverse, or are taken for others, has a larger one.
const MIN_UNFIT: u64 = 40;
const UNFIT: f64 = 0.7;
/// The same of headings of which nothing else is known.
const MIN_UNRELATED: u64 = 80;
const UNRELATED: f64 = 0.4;
/// Least mean of unit vectors of headings that are all one.
const ONE: f64 = 0.98;
/// Headings of axes point against the motion from this share on: few detectors take so many fronts for backs.
const MIN_AGAINST: f64 = 0.2;
/// And are along it within this, rad.
const ALONG_RAD: f64 = 0.15;

impl Headings {
    pub(super) fn note(&mut self, seen: &Observation<'_>, moving: &Moving) {
        self.note_as(seen, moving, |_, one| one.bev.yaw);
    }

    /// As if they were given in degrees in place of radians, or the other way round.
    pub(super) fn note_in_other_unit(&mut self, seen: &Observation<'_>, moving: &Moving) {
        let in_other = &seen.reported.in_other_unit;
        self.note_as(seen, moving, |n, _| in_other.get(n).copied().unwrap_or(f64::NAN));
    }

    fn note_as(
        &mut self,
        seen: &Observation<'_>,
        moving: &Moving,
        heading: impl Fn(usize, &Detection) -> f64,
    ) {
        let known = seen.frame.detections.iter().enumerate();
        let known = known.filter(|(_, one)| one.heading == HeadingKind::Known && one.class.has_front());
        for (n, one) in known {
            let yaw = heading(n, one);
            if yaw.is_nan() {
                continue;
            }
            let object = moving.object_at([one.bev.x, one.bev.y], seen.frame.captured_at, NEAR_M);
            let Some(Object { velocity: [vx, vy], turn_rate, .. }) = object else { continue };
            if libm::hypot(*vx, *vy) >= MOVING_MPS {
                self.add(yaw, libm::atan2(*vy, *vx));
                self.turn_rates += turn_rate;
            }
        }
    }

    fn add(&mut self, yaw: f64, direction: f64) {
        self.n += 1;
        let add = |to: &mut [f64; 2], angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            *to = [to[0] + cos, to[1] + sin];
        };
        add(&mut self.less, yaw - direction);
        add(&mut self.sum, yaw + direction);
        add(&mut self.axis, 2.0 * direction);
        add(&mut self.heading, yaw);
        add(&mut self.axis_less, 2.0 * (yaw - direction));
        self.against += u64::from(libm::cos(yaw - direction) < 0.0);
    }

    /// By how much directions of motion may lag behind where all turn the same way, as on a roundabout, rad.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn lag_rad(&self) -> f64 {
        LAG_S * (self.turn_rates / (self.n as f64).max(1.0)).abs()
    }

    /// What they are where they agree with nothing, and enough was seen to say so.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn unfit(&self) -> Option<Unfit> {
        let share = |[x, y]: [f64; 2]| libm::hypot(x, y) / self.n as f64;
        let angle = |[x, y]: [f64; 2]| libm::atan2(y, x);
        if self.n < MIN_UNFIT || self.verdict().is_some() || share(self.less) > UNFIT {
            return None;
        }
        let against = self.against as f64 / self.n as f64;
        let are_along = share(self.axis_less) >= AGREE && (0.5 * angle(self.axis_less)).abs() <= ALONG_RAD;
        if share(self.heading) >= ONE {
            Some(Unfit::Constant(angle(self.heading)))
        } else if are_along && (MIN_AGAINST..=1.0 - MIN_AGAINST).contains(&against) {
            Some(Unfit::Axes(against))
        } else {
            let agrees = [self.less, self.sum, self.axis_less].into_iter().any(|sum| share(sum) > UNRELATED);
            (self.n >= MIN_UNRELATED && !agrees).then_some(Unfit::Unrelated)
        }
    }

    /// What a constant turn may be as well where all traffic is along one road: headings that grow clockwise.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn other_verdict(&self, verdict: Verdict) -> Option<Verdict> {
        let Verdict::Turned(by) = verdict else { return None };
        let [x, y] = self.axis;
        let is_one_road = libm::hypot(x, y) >= AGREE * self.n as f64;
        // heading = direction + by = −direction + by + twice the direction.
        is_one_road.then(|| Verdict::Clockwise(wrap_angle(by + libm::atan2(y, x))))
    }

    /// `None` where too few were seen, or they agree with nothing.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn verdict(&self) -> Option<Verdict> {
        if self.n < MIN_DETECTIONS {
            return None;
        }
        let share = |[x, y]: [f64; 2]| libm::hypot(x, y) / self.n as f64;
        let angle = |[x, y]: [f64; 2]| libm::atan2(y, x);
        if share(self.less) >= AGREE {
            Some(Verdict::Turned(angle(self.less)))
        } else if share(self.sum) >= AGREE && share(self.axis) < AGREE {
            Some(Verdict::Clockwise(angle(self.sum)))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Of traffic in these directions, with headings that are written so.
    fn verdict(directions: &[f64], written: impl Fn(f64) -> f64) -> Option<Verdict> {
        let mut headings = Headings::default();
        for k in 0..20 {
            let error = 0.2 * libm::sin(f64::from(k));
            directions.iter().for_each(|one| headings.add(written(*one) + error, *one));
        }
        headings.verdict()
    }

    const CROSSING: [f64; 4] = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];

    #[test]
    fn a_constant_turn_and_a_clockwise_sense_are_distinguished_where_roads_cross() {
        let is = |found: Option<Verdict>, expected: Verdict| match (found, expected) {
            (Some(Verdict::Turned(a)), Verdict::Turned(b))
            | (Some(Verdict::Clockwise(a)), Verdict::Clockwise(b)) => (a - b).abs() < 0.1,
            _ => false,
        };
        assert!(is(verdict(&CROSSING, |one| one), Verdict::Turned(0.0)));
        assert!(is(verdict(&CROSSING, |one| one - FRAC_PI_2), Verdict::Turned(-FRAC_PI_2)));
        assert!(is(verdict(&CROSSING, |one| FRAC_PI_2 - one), Verdict::Clockwise(FRAC_PI_2)), "a compass");
        assert!(is(verdict(&CROSSING, |one| -one), Verdict::Clockwise(0.0)));
    }

    #[test]
    fn along_one_road_clockwise_headings_are_a_constant_turn() {
        for along in [0.0, 0.3, FRAC_PI_2] {
            let mut headings = Headings::default();
            for _ in 0..20 {
                [along, along + PI].iter().for_each(|one| headings.add(FRAC_PI_2 - one, *one));
            }
            let verdict = headings.verdict().unwrap();
            let Some(Verdict::Clockwise(east)) = headings.other_verdict(verdict) else {
                panic!("{verdict:?}")
            };
            assert!(
                matches!(verdict, Verdict::Turned(_)) && wrap_angle(east - FRAC_PI_2).abs() < 1e-9,
                "{east}"
            );
        }
        let mut crossing = Headings::default();
        (0..20).for_each(|_| CROSSING.iter().for_each(|one| crossing.add(*one + 0.5, *one)));
        assert_eq!(crossing.other_verdict(crossing.verdict().unwrap()), None);
    }

    /// What headings are of no use for, of traffic in these directions.
    fn unfit(directions: &[f64], written: impl Fn(u32, f64) -> f64) -> Option<Unfit> {
        let mut headings = Headings::default();
        for k in 0..30 {
            let error = 0.2 * libm::sin(f64::from(k));
            directions.iter().for_each(|one| headings.add(written(k, *one) + error * f64::from(k % 2), *one));
        }
        headings.unfit()
    }

    #[test]
    fn headings_that_are_always_one_or_those_of_axes_or_of_chance_are_unfit_and_others_are_not() {
        assert!(matches!(unfit(&CROSSING, |_, _| 0.0), Some(Unfit::Constant(at)) if at.abs() < 0.1));
        assert!(
            matches!(unfit(&[0.0, PI], |_, _| -1.0), Some(Unfit::Constant(at)) if (at + 1.0).abs() < 0.1)
        );
        let folded = unfit(&CROSSING, |_, one| one.rem_euclid(PI));
        assert!(matches!(folded, Some(Unfit::Axes(against)) if (0.3..0.7).contains(&against)), "{folded:?}");
        let chance = unfit(&CROSSING, |k, _| 2.4 * f64::from(k));
        assert_eq!(chance, Some(Unfit::Unrelated));
        // Right, turned, of a compass; one of ten the other way; one of ten turned anyhow.
        assert_eq!(unfit(&CROSSING, |_, one| one), None);
        assert_eq!(unfit(&CROSSING, |_, one| one + 0.5), None);
        assert_eq!(unfit(&CROSSING, |_, one| FRAC_PI_2 - one), None);
        assert_eq!(unfit(&CROSSING, |k, one| if k % 10 == 0 { one + PI } else { one }), None);
        assert_eq!(unfit(&CROSSING, |k, one| if k % 10 == 0 { f64::from(k) } else { one }), None);
        // Of all that moves one way a constant heading can be right, or is turned.
        assert_eq!(unfit(&[0.0], |_, _| 0.0), None);
        assert_eq!(unfit(&[1.0], |_, _| 0.0), None);
        // One road, nine of ten of what drives there one way.
        let mostly = [[0.3; 9].as_slice(), &[0.3 + PI]].concat();
        assert_eq!(unfit(&mostly, |_, one| one), None);
    }

    #[test]
    fn headings_of_no_use_and_few_of_them_say_nothing() {
        assert_eq!(verdict(&CROSSING, |_| 0.0), None);
        let mut few = Headings::default();
        (0..10).for_each(|_| few.add(1.0, 0.0));
        assert_eq!(few.verdict(), None);
    }
}
