//! Which way an object points: a reported heading may be right, turned by half a turn, by a quarter (where width and depth
//! are exchanged), or worthless.
//!
//! One of these is chosen for each report, by the heading and the size of the track. Which end of the axis is the front
//! is decided apart, by what agents report and by the motion. The course of the motion is that of a filter of positions
//! alone: where reported headings contradict it for long, they do not count any more, and heading never overrules positions.

mod contradiction;
mod hypotheses;
mod outcome;

pub(super) use hypotheses::{Held, first_read};
pub(crate) use outcome::Read;
pub(super) use outcome::{Action, Path};

use crate::filter::{Course, Filter, Kinematic, MotionParams};
use crate::values::{ExpectedPlace, HeadingLaw, Measurement, PositionInnovation};
use contradiction::{Beside, Contradiction, Verdict, single};
use hypotheses::{Hypothesis, NEAR, NO_AXIS, choose, taken};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use v2x_common::class::{Class, ClassGroup};
use v2x_common::detection::HeadingKind;
use v2x_common::geometry::{angle_difference, wrap_angle};
use v2x_common::time::{Span, Timestamp};

/// Variance of a report that says nothing of a heading, rad², which must not add up.
const NO_REPORT_VARIANCE: f64 = 1e6;

/// The course counts from this speed on, m/s (of people and animals from the second one on), and from so many standard deviations
/// of it.
const LEAST_SPEED_MPS: [f64; 2] = [1.0, 0.5];
const LEAST_SPEED_SIGMAS: f64 = 4.0;
/// It stands where its speed is no more than so many standard deviations of it, or 1 m/s, and that is no more than this, m/s.
const STANDS_SIGMAS: f64 = 2.0;
const KNOWN_TO_STAND_MPS: f64 = 1.5;
/// Of an object whose heading nobody reports, from this speed on, once positions alone predict it better than the filter.
const LEAST_SPEED_UNKNOWN_MPS: f64 = 0.3;
/// Standard deviation of the angle between a body and its course, rad.
const SLIP: f64 = 0.1;

/// The course is held against the heading no more often than this.
const WEIGHED_EVERY: Span = Span::from_millis(40);

/// ln π: the axes are uniform over half a turn.
const LN_PI: f64 = 1.144_729_885_849_400_2;

/// Weight of a report's evidence of the front: reports of one object err alike.
const REPORT_WEIGHT: f64 = 0.1;
/// What motion can bring about at most. All reports together count as one that errs independently.
const MOST_BY_MOTION: f64 = 5.0;
/// It moves forwards where its course is off its heading by less, rad: a quarter turn, but for rounding.
const FORWARDS: f64 = 1.57;
/// Evidence of motion in a second, at the speed at which it counts in full, m/s.
const MOTION_PER_S: f64 = 30.0;
const FULL_SPEED_MPS: [f64; 2] = [1.5, 0.5];
/// The most that a single report says of motion, for it may be of another object: that is less likely where it comes so soon, s, after
/// the report before.
const MOST_AT_ONCE: f64 = 1.0;
const MOST_AT_ONCE_SOON: f64 = 3.0;
const SOON_S: f64 = 0.25;
/// The track turns round where the evidence is against its front by this much.
const TURN_ROUND: f64 = -1.0;

/// A reversed report leaves the front undecided for so many reports.
const CONFLICT_KEPT: f32 = 0.98;
/// Reversed reports, each counting less with every later one, from which on the front may be undecided.
const IN_CONFLICT: f32 = 1.5;
/// Where the front is known less, ln odds, every report that leaves it open counts in full.
const LEAST_FRONT: f64 = 0.5;
/// ln odds by motion from which on the front is decided.
const DECIDED: f64 = 3.0;

/// What is known for and against reported headings, at most.
const MOST_UNRELIABLE: f64 = 4.0;
/// Below this variance, rad², a heading within one standard deviation is evidence for it: π/2e, but for rounding.
const WELL_KNOWN: f64 = 0.57;
/// Evidence against them counts in full after so long, s.
const INDEPENDENT_AFTER_S: f64 = 0.35;
/// The filter is in doubt from here on, ln; most evidence of one report; and how far its heading is then off the course (χ²).
const IN_DOUBT: f32 = 5.0;
const MOST_DOUBT_BY_ONE: [f64; 2] = [-3.0, 6.0];
const OFF_COURSE: f64 = 9.0;
/// Distances (χ²) and ratio of determinants together below which there is no evidence of doubt: 1, but for rounding.
const CERTAINLY_NONE: f64 = 0.999;
/// A heading that differs from that of the filter by more than this, rad, is held against the course at once: on a bend, the course lags.
const ODD: f64 = 0.2;
/// Where positions alone expect the object is a second hypothesis from here on, ln.
const IN_QUESTION: f32 = 2.5;
/// Most evidence of one report.
const MOST_BY_ONE: [f64; 2] = [-2.0, 6.0];

/// Until positions know the velocity better than this share of what is assumed of its class, the heading does not say alone where
/// the object will be.
const VELOCITY_KNOWN: f64 = 0.5;

/// What is known of an object's orientation beside its filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    /// Position and velocity by positions alone.
    path: Kinematic,
    at: Timestamp,
    /// When the course was last held against the heading.
    weighed_at: Timestamp,
    /// ln odds that the front is where the filter has it, by reports and by motion.
    by_reports: f32,
    by_motion: f32,
    /// Reversed reports of late.
    conflict: f32,
    /// ln odds that reported headings are worthless.
    unreliable: f32,
    /// How much better positions alone have predicted positions of late than the filter, ln; at least 0.
    doubt: f32,
    /// How far its reported headings contradict each other while it stands.
    contradiction: Contradiction,
}

impl Orientation {
    /// After a first report.
    pub(super) fn initial(at: Timestamp, z: &Measurement, front_odds_ln: f64) -> Self {
        let is_known = z.heading == HeadingKind::Known;
        let sigma = MotionParams::of(z.class).sigma_velocity_mps;
        Self {
            path: Kinematic::initial(z.position, z.r, sigma, z.velocity.as_ref()),
            at,
            weighed_at: at,
            by_reports: if is_known { single(3.0 * REPORT_WEIGHT * front_odds_ln) } else { 0.0 },
            by_motion: 0.0,
            conflict: if is_known { 0.0 } else { 2.0 * IN_CONFLICT },
            unreliable: single(-MOST_UNRELIABLE),
            doubt: 0.0,
            contradiction: Contradiction::initial(z.yaw_variance),
        }
    }

    /// Reads a report of an object by an agent whose headings err like this.
    pub(super) fn read<F: Filter>(
        &mut self,
        at: Timestamp,
        z: &Measurement,
        held: &Held<'_, F>,
        headings: &HeadingLaw,
    ) -> Read {
        let dt_s = (at - self.at).as_secs_f64();
        self.at = at;
        self.path.predict(dt_s, MotionParams::of(held.class).accel_psd);
        let by_positions = self.path.update_position(z.position, &z.r);
        if let Some(velocity) = &z.velocity {
            self.path.update_velocity(velocity);
        }
        let z = &Measurement { since_last_s: z.since_last_s.max(dt_s.abs()), ..*z };
        if held.class.is_immobile() {
            return Read { z: *z, first: Action::Nothing, by_positions, discount: 0.0 };
        }
        let since = at - self.weighed_at;
        let is_due = since.abs() >= WEIGHED_EVERY;
        if is_due {
            self.weighed_at = at;
        }
        let since_s = since.as_secs_f64();
        if z.heading == HeadingKind::Unknown {
            let course = self.course(held.class);
            if let Some(course) = course.as_ref().filter(|_| is_due) {
                self.weigh_motion(held, course, since_s);
            }
            let z = self.without_heading(z, course.as_ref());
            return Read { z, first: Action::Nothing, by_positions, discount: 0.0 };
        }
        let odds_ln = if z.heading == HeadingKind::Axis { 0.0 } else { headings.front_odds_ln() };
        let chosen = choose(z, held, odds_ln);
        let was_unreliable = self.unreliable > 0.0;
        let is_odd = chosen.cost > NEAR && axis_difference(chosen.yaw, held.state.heading().0).abs() > ODD;
        let course = if is_due || is_odd || was_unreliable { self.course(held.class) } else { None };
        if let Some(course) = course.as_ref().filter(|_| is_due) {
            self.weigh_reliability(chosen.yaw, z.yaw_variance, course, since_s);
        }
        if self.unreliable > 0.0 {
            let first = match course {
                Some(course) if !was_unreliable => Action::Redirect(course),
                _ => Action::Nothing,
            };
            return Read { z: self.without_heading(z, course.as_ref()), first, by_positions, discount: 0.0 };
        }
        self.weigh_front(&chosen, odds_ln);
        if let Some(course) = course.as_ref().filter(|_| is_due) {
            self.weigh_motion(held, course, since_s);
        }
        let mut z = taken(z, &chosen);
        let first = if walks(held.class) || self.moves(held.class) {
            Action::Nothing
        } else {
            self.weigh_standing(&mut z, held.state.heading(), headings.standing())
        };
        if is_odd && course.as_ref().is_some_and(|course| is_worse(&z, held.state.heading().0, course)) {
            // Of several agents one may err for good: the others' headings stay.
            z.yaw_variance = NO_REPORT_VARIANCE;
        }
        let mut read = Read { z, first, by_positions, discount: 0.0 };
        if first == Action::Nothing && f64::from(self.by_reports + self.by_motion) < TURN_ROUND {
            self.by_reports = -self.by_reports;
            self.by_motion = -self.by_motion;
            read.z.yaw = wrap_angle(read.z.yaw + PI);
            read.first = Action::TurnRound;
        }
        read
    }

    /// Holds the filter, which is bound to the heading, against positions alone: by what each predicted. Where the filter is
    /// much worse for some time and its heading is off the course, positions count: the path that the object is set to.
    pub(super) fn overrule(
        &mut self,
        (read, class): (&Read, Class),
        by_filter: &PositionInnovation,
        heading: impl FnOnce() -> (f64, f64),
    ) -> Option<Path> {
        let by_positions = &read.by_positions;
        let apart = by_filter.mahalanobis2 - by_positions.mahalanobis2;
        // The logarithm is below its argument less 1: nearly always there is no doubt, and this adds none.
        if self.doubt == 0.0 && apart + by_filter.determinant / by_positions.determinant < CERTAINLY_NONE {
            return None;
        }
        let ln_ratio = libm::logf(single(by_filter.determinant / by_positions.determinant));
        let [least, most] = MOST_DOUBT_BY_ONE;
        let evidence = (apart + f64::from(ln_ratio)) / 2.0;
        let evidence = evidence.clamp(least, most);
        self.doubt = (self.doubt + single(evidence)).max(0.0);
        if self.doubt < IN_DOUBT || self.unreliable > 0.0 {
            return None;
        }
        let course = if read.z.yaw_variance >= NO_REPORT_VARIANCE {
            // No heading is lost: whichever way it moves, positions know better.
            self.any_course(LEAST_SPEED_UNKNOWN_MPS)?
        } else {
            let course = self.course(class)?;
            let (yaw, variance) = heading();
            let off = axis_difference(yaw, course.yaw);
            let expected = variance + course.yaw_variance + SLIP * SLIP;
            if off * off <= OFF_COURSE * expected {
                return None;
            }
            self.unreliable = single(MOST_UNRELIABLE / 2.0);
            course
        };
        self.doubt = 0.0;
        Some(Path { position: self.path.position, covariance: self.path.pp, course })
    }

    /// Where positions alone expect the object at a time, until they know its velocity well and the filter predicts it as well.
    pub(crate) fn expected(&self, at: Timestamp, class: Class) -> Option<ExpectedPlace> {
        let motion = MotionParams::of(class);
        let limit = VELOCITY_KNOWN * motion.sigma_velocity_mps;
        if self.path.vv.xx.max(self.path.vv.yy) <= limit * limit && self.doubt < IN_QUESTION {
            return None;
        }
        Some(self.by_positions(at, class))
    }

    /// Where positions alone expect the object at a time.
    pub(crate) fn by_positions(&self, at: Timestamp, class: Class) -> ExpectedPlace {
        let mut path = self.path;
        path.predict((at - self.at).as_secs_f64(), MotionParams::of(class).accel_psd);
        ExpectedPlace { position: path.position, covariance: path.pp }
    }

    /// Its speed by positions alone, and the standard deviation of the velocity along an axis, m/s.
    pub(crate) fn speed_by_positions(&self) -> (f64, f64) {
        let [vx, vy] = self.path.velocity;
        (libm::hypot(vx, vy), libm::sqrt(self.path.vv.xx.max(self.path.vv.yy)))
    }

    /// The course, where an object of a class moves for certain.
    fn course(&self, class: Class) -> Option<Course> {
        self.moves(class).then(|| self.any_course(0.0)).flatten()
    }

    /// Whether an object of a class moves for certain, by positions alone.
    fn moves(&self, class: Class) -> bool {
        let [vx, vy] = self.path.velocity;
        let least_mps = LEAST_SPEED_MPS[usize::from(walks(class))];
        let variance = self.path.vv.xx.max(self.path.vv.yy);
        vx * vx + vy * vy > (least_mps * least_mps).max(LEAST_SPEED_SIGMAS * LEAST_SPEED_SIGMAS * variance)
    }

    /// The course from a speed on, m/s.
    fn any_course(&self, least_mps: f64) -> Option<Course> {
        let [vx, vy] = self.path.velocity;
        let speed2 = vx * vx + vy * vy;
        let variance = self.path.vv.xx.max(self.path.vv.yy);
        (speed2 > least_mps * least_mps).then(|| Course {
            yaw: libm::atan2(vy, vx),
            yaw_variance: variance / speed2,
            speed: libm::sqrt(speed2),
            speed_variance: variance,
        })
    }

    /// Whether it stands as far as positions alone can tell.
    fn stands(&self) -> bool {
        let [vx, vy] = self.path.velocity;
        let variance = self.path.vv.xx.max(self.path.vv.yy);
        variance <= KNOWN_TO_STAND_MPS * KNOWN_TO_STAND_MPS
            && vx * vx + vy * vy <= (STANDS_SIGMAS * STANDS_SIGMAS * variance).max(1.0)
    }

    /// A report with the course in place of its heading; with none where there is no course.
    fn without_heading(&self, z: &Measurement, course: Option<&Course>) -> Measurement {
        let (yaw, yaw_variance) = match course {
            Some(course) => (course.yaw, course.yaw_variance + SLIP * SLIP),
            None => (z.yaw, NO_REPORT_VARIANCE),
        };
        Measurement { yaw, yaw_variance, ..*z }
    }

    /// Holds a heading's axis against the course.
    fn weigh_reliability(&mut self, yaw: f64, variance: f64, course: &Course, dt_s: f64) {
        let off = axis_difference(yaw, course.yaw);
        let expected = variance + course.yaw_variance + SLIP * SLIP;
        // Nearly always nothing can be more certain than it is: within one standard deviation, the evidence is for the heading.
        let is_certain = f64::from(self.unreliable) <= -MOST_UNRELIABLE;
        if is_certain && expected < WELL_KNOWN && off * off <= expected {
            return;
        }
        // ln of the density of any axis, 1/π, over the normal one.
        let evidence = libm::log(TAU * expected) / 2.0 - LN_PI + off * off / (2.0 * expected);
        let [least, most] = MOST_BY_ONE;
        let weight = (dt_s.abs() / INDEPENDENT_AFTER_S).min(1.0);
        let unreliable = f64::from(self.unreliable) + weight * evidence.clamp(least, most);
        self.unreliable = single(unreliable.clamp(-MOST_UNRELIABLE, MOST_UNRELIABLE));
    }

    /// Holds a report of what stands against the heading (rad) that it has and its variance (rad²), where the agent's headings are
    /// known to have so many times their variance.
    fn weigh_standing(&mut self, z: &mut Measurement, (front, own): (f64, f64), times: f64) -> Action {
        let off = axis_difference(z.yaw, front);
        let report = Beside { off, declared: z.yaw_variance, own, times };
        let verdict =
            if self.stands() { self.contradiction.note(&report) } else { self.contradiction.judge(&report) };
        z.yaw_variance *= times;
        if verdict != Verdict::Counts || (times > 1.0 && z.yaw_variance > NO_AXIS) {
            z.yaw_variance = NO_REPORT_VARIANCE;
        }
        match verdict {
            Verdict::TurnsBy(turn, variance) => Action::TurnTo(wrap_angle(front + turn), variance),
            Verdict::Counts | Verdict::IsNoNews => Action::Nothing,
        }
    }

    /// Holds the front against a report.
    fn weigh_front(&mut self, chosen: &Hypothesis, odds_ln: f64) {
        let weight = REPORT_WEIGHT * odds_ln;
        let for_front = if chosen.is_reversed { -weight } else { weight };
        // What a better agent has reported is not lost.
        let before = f64::from(self.by_reports);
        let most = odds_ln.abs().max(before.abs());
        self.by_reports = single((before + for_front).clamp(-most, most));
        let is_open = chosen.is_reversed || odds_ln == 0.0;
        // Against a better agent, it is no conflict.
        let against = if is_open {
            (odds_ln.abs().max(LEAST_FRONT) / before.abs().max(LEAST_FRONT)).min(1.0)
        } else {
            0.0
        };
        self.conflict = CONFLICT_KEPT * self.conflict + single(against * against);
    }

    /// Holds the front against the course.
    fn weigh_motion<F: Filter>(&mut self, held: &Held<'_, F>, course: &Course, dt_s: f64) {
        let off = angle_difference(held.state.heading().0, course.yaw);
        if f64::from(self.by_motion) >= MOST_BY_MOTION && off.abs() < FORWARDS {
            return;
        }
        let along = libm::cos(off);
        let [least_mps, full_mps] =
            [LEAST_SPEED_MPS, FULL_SPEED_MPS].map(|of| of[usize::from(walks(held.class))]);
        let full = ((course.speed - least_mps) / full_mps).clamp(0.0, 1.0);
        let most = if dt_s.abs() <= SOON_S { MOST_AT_ONCE_SOON } else { MOST_AT_ONCE };
        let evidence = (MOTION_PER_S * dt_s.abs()).min(most) * full * along;
        let by_motion = f64::from(self.by_motion) + evidence;
        self.by_motion = single(by_motion.clamp(-MOST_BY_MOTION, MOST_BY_MOTION));
    }

    /// What is known of the heading, and its variance beyond that of the filter, rad².
    pub fn heading(&self, class: Class) -> (HeadingKind, f64) {
        let contradiction = if !self.moves(class) { self.contradiction.variance() } else { 0.0 };
        let (kind, reversed) = self.front();
        let kind = if contradiction > NO_AXIS { HeadingKind::Unknown } else { kind };
        // The expected square of the error if the front may be at the other end.
        (kind, contradiction + PI * PI * reversed * (1.0 - reversed))
    }

    /// What is known of the front, and the probability that it is at the other end.
    fn front(&self) -> (HeadingKind, f64) {
        let front = f64::from(self.by_reports + self.by_motion);
        // Where reports contradict each other, only motion decides.
        if self.conflict <= IN_CONFLICT || f64::from(self.by_motion) >= DECIDED {
            return (HeadingKind::Known, 0.0);
        }
        let reversed_of_late = f64::from(self.conflict * (1.0 - CONFLICT_KEPT));
        let by_evidence = 1.0 / (1.0 + libm::exp(front.abs()));
        (HeadingKind::Axis, by_evidence.max(reversed_of_late).min(0.5))
    }
}

/// The difference of two axes, rad in [-π/2, π/2].
pub(super) fn axis_difference(a: f64, b: f64) -> f64 {
    let off = angle_difference(a, b);
    if off > FRAC_PI_2 {
        off - PI
    } else if off < -FRAC_PI_2 {
        off + PI
    } else {
        off
    }
}

/// Whether a report's heading is off the course of an object whose heading is nearer to it.
fn is_worse(z: &Measurement, heading: f64, course: &Course) -> bool {
    let off = axis_difference(z.yaw, course.yaw);
    let expected = z.yaw_variance + course.yaw_variance + SLIP * SLIP;
    off * off > OFF_COURSE * expected && axis_difference(heading, course.yaw).abs() < off.abs()
}

/// Whether objects of a class go at the pace of people.
fn walks(class: Class) -> bool {
    class.group() == ClassGroup::Pedestrian
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        hypotheses::listed(),
        contradiction::listed(),
        (
            "orientation.course",
            format!(
                "{LEAST_SPEED_MPS:?} m/s ({LEAST_SPEED_UNKNOWN_MPS} where unknown, velocity known at {VELOCITY_KNOWN}), {LEAST_SPEED_SIGMAS} sigma, stands within {STANDS_SIGMAS} of up to {KNOWN_TO_STAND_MPS} m/s, slip {SLIP}, every {} s",
                WEIGHED_EVERY.as_secs_f64()
            ),
        ),
        (
            "orientation.front",
            format!(
                "reports {REPORT_WEIGHT}, motion {MOTION_PER_S}/s at {FULL_SPEED_MPS:?} m/s beyond that, at once {MOST_AT_ONCE_SOON} within {SOON_S} s and {MOST_AT_ONCE} later, {MOST_BY_MOTION} at most, turned below {TURN_ROUND}"
            ),
        ),
        (
            "orientation.doubt",
            format!(
                "open from {IN_QUESTION}, {IN_DOUBT}, {MOST_DOUBT_BY_ONE:?} by one, off course {OFF_COURSE}, odd {ODD}"
            ),
        ),
        (
            "orientation.conflict",
            format!(
                "{CONFLICT_KEPT} kept, against {LEAST_FRONT} at least, beyond {IN_CONFLICT}, decided at {DECIDED}"
            ),
        ),
        (
            "orientation.unreliable",
            format!("{MOST_UNRELIABLE} at most, {MOST_BY_ONE:?} by one in {INDEPENDENT_AFTER_S} s"),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What they leave out would change nothing: the evidence of doubt is below 0, that for worthless headings, too, and a body
    /// that is less than a quarter turn off its course moves forwards.
    #[test]
    fn at_their_limits_the_short_cuts_leave_out_no_evidence() {
        for ratio in [1e-6, 0.1, 0.5, 0.9, CERTAINLY_NONE] {
            let apart = CERTAINLY_NONE - ratio;
            assert!(apart + f64::from(libm::logf(single(ratio))) < 0.0, "{ratio}");
        }
        for expected in [1e-6, 1e-3, 0.1, WELL_KNOWN] {
            assert!(libm::log(TAU * expected) / 2.0 - LN_PI + 0.5 <= 0.0, "{expected}");
        }
        assert!(libm::cos(FORWARDS) > 0.0);
    }
}
