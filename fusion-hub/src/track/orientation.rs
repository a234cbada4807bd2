//! Which way an object points: a reported heading may be right, turned by half a turn, by a quarter (where width and depth
//! are exchanged), or worthless.
//!
//! One of these is chosen for each report, by the heading and the size of the track. Which end of the axis is the front
//! is decided apart, by what agents report and by the motion. The course of the motion is that of a filter of positions
//! alone: where reported headings contradict it for long, they do not count any more, and heading never overrules positions.

use crate::filter::{Course, Kinematic, MotionParams, Shape};
use crate::values::Measurement;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use v2x_common::class::Class;
use v2x_common::detection::HeadingKind;
use v2x_common::geometry::{angle_difference, wrap_angle};
use v2x_common::time::Timestamp;

/// Probability that a report has width and depth exchanged.
const SWAPPED: f64 = 0.0025;
/// A report within this squared distance (χ²) is as reported: nothing else is considered.
const NEAR: f64 = 4.0;
/// Upper limit of the cost of a size.
const SIZE_CAP: f64 = 12.0;
/// Variance of a heading of which nothing is known, rad².
const UNKNOWN_VARIANCE: f64 = 9.0;

/// The course counts from this speed on, m/s, and from so many standard deviations of it.
const LEAST_SPEED_MPS: f64 = 1.0;
const LEAST_SPEED_SIGMAS: f64 = 4.0;
/// Standard deviation of the angle between a body and its course, rad.
const SLIP: f64 = 0.1;

/// Weight of a report's evidence of the front: reports of one object err alike.
const REPORT_WEIGHT: f64 = 0.1;
/// What motion can bring about at most. All reports together count as one that errs independently.
const MOST_BY_MOTION: f64 = 5.0;
/// Evidence of motion in a second, at the speed at which it counts in full, m/s.
const MOTION_PER_S: f64 = 10.0;
const FULL_SPEED_MPS: f64 = 1.5;
/// A single report is no evidence of motion for longer than this, s: it may be of another object.
const MOST_AT_ONCE_S: f64 = 0.1;
/// The track turns round where the evidence is against its front by this much.
const TURN_ROUND: f64 = -1.0;

/// A reversed report leaves the front undecided for so many reports.
const CONFLICT_KEPT: f32 = 0.98;
/// Reversed reports, each counting less with every later one, from which on the front may be undecided.
const IN_CONFLICT: f32 = 0.9;
/// ln odds from which on the front is decided.
const DECIDED: f64 = 3.0;

/// What is known for and against reported headings, at most.
const MOST_UNRELIABLE: f64 = 4.0;
/// Evidence against them counts in full after so long, s.
const INDEPENDENT_AFTER_S: f64 = 0.35;
/// Most evidence of one report.
const MOST_BY_ONE: [f64; 2] = [-2.0, 3.0];

/// What is known of an object's orientation beside its filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Position and velocity by positions alone.
    path: Kinematic,
    at: Timestamp,
    /// ln odds that the front is where the filter has it, by reports and by motion.
    by_reports: f32,
    by_motion: f32,
    /// Reversed reports of late.
    conflict: f32,
    /// ln odds that reported headings are worthless.
    unreliable: f32,
}

/// What a report does to the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Read {
    /// The measurement as it is taken.
    pub(super) z: Measurement,
    /// What is done to the state first.
    pub(super) first: Action,
}

/// What is done to the state before it is updated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// Nothing.
    Nothing,
    /// It is turned round: the front is at the other end.
    TurnRound,
    /// It is set to its course.
    Redirect(Course),
}

/// One way to read a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hypothesis {
    cost: f64,
    yaw: f64,
    is_reversed: bool,
    is_swapped: bool,
}

impl Orientation {
    /// After a first report.
    pub(super) fn initial(at: Timestamp, z: &Measurement, reversed: f64) -> Self {
        let sigma = MotionParams::of(z.class).sigma_velocity_mps;
        Self {
            path: Kinematic::initial(z.position, z.r, sigma, z.velocity.as_ref()),
            at,
            by_reports: single(3.0 * report_weight(reversed)),
            by_motion: 0.0,
            conflict: 0.0,
            unreliable: single(-MOST_UNRELIABLE),
        }
    }

    /// Reads a report of an object of this class and shape, by an agent that reverses headings with a probability.
    pub(super) fn read(&mut self, at: Timestamp, z: &Measurement, shape: &Shape, reversed: f64) -> Read {
        let dt_s = (at - self.at).as_secs_f64();
        self.at = at;
        self.path.predict(dt_s, MotionParams::of(shape.class).accel_psd);
        self.path.update_position(z.position, &z.r);
        if let Some(velocity) = &z.velocity {
            self.path.update_velocity(velocity);
        }
        if !shape.class.has_front() {
            return Read { z: *z, first: Action::Nothing };
        }
        let course = self.course();
        if z.heading == HeadingKind::Unknown {
            return Read { z: self.without_heading(z, course.as_ref()), first: Action::Nothing };
        }
        let reversed = if z.heading == HeadingKind::Axis { 0.5 } else { reversed };
        let chosen = choose(z, shape, reversed);
        let was_unreliable = self.unreliable > 0.0;
        if let Some(course) = &course {
            self.weigh_reliability(chosen.yaw, z.yaw_variance, course, dt_s);
        }
        if self.unreliable > 0.0 {
            let first = match course {
                Some(course) if !was_unreliable => Action::Redirect(course),
                _ => Action::Nothing,
            };
            return Read { z: self.without_heading(z, course.as_ref()), first };
        }
        self.weigh_front(&chosen, reversed, shape.yaw, course.as_ref().map(|course| (course, dt_s)));
        let mut read = Read { z: taken(z, &chosen), first: Action::Nothing };
        if f64::from(self.by_reports + self.by_motion) < TURN_ROUND {
            self.by_reports = -self.by_reports;
            self.by_motion = -self.by_motion;
            read.z.yaw = wrap_angle(read.z.yaw + PI);
            read.first = Action::TurnRound;
        }
        read
    }

    /// The course, where the object moves for certain.
    fn course(&self) -> Option<Course> {
        let [vx, vy] = self.path.velocity;
        let speed2 = vx * vx + vy * vy;
        let variance = self.path.vv.xx.max(self.path.vv.yy);
        let is_certain = speed2 > LEAST_SPEED_MPS * LEAST_SPEED_MPS
            && speed2 > LEAST_SPEED_SIGMAS * LEAST_SPEED_SIGMAS * variance;
        is_certain.then(|| Course {
            yaw: libm::atan2(vy, vx),
            yaw_variance: variance / speed2,
            speed: libm::sqrt(speed2),
            speed_variance: variance,
        })
    }

    /// A report with the course in place of its heading; with none where there is no course.
    fn without_heading(&self, z: &Measurement, course: Option<&Course>) -> Measurement {
        let (yaw, yaw_variance) = match course {
            Some(course) => (course.yaw, course.yaw_variance + SLIP * SLIP),
            None => (z.yaw, UNKNOWN_VARIANCE),
        };
        Measurement { yaw, yaw_variance, ..*z }
    }

    /// Holds a heading's axis against the course.
    fn weigh_reliability(&mut self, yaw: f64, variance: f64, course: &Course, dt_s: f64) {
        let off = axis_difference(yaw, course.yaw);
        let expected = variance + course.yaw_variance + SLIP * SLIP;
        // ln of the density of any axis, 1/π, over the normal one.
        let evidence = -libm::log(PI) + libm::log(TAU * expected) / 2.0 + off * off / (2.0 * expected);
        let [least, most] = MOST_BY_ONE;
        let weight = (dt_s.abs() / INDEPENDENT_AFTER_S).min(1.0);
        let unreliable = f64::from(self.unreliable) + weight * evidence.clamp(least, most);
        self.unreliable = single(unreliable.clamp(-MOST_UNRELIABLE, MOST_UNRELIABLE));
    }

    fn weigh_front(
        &mut self,
        chosen: &Hypothesis,
        reversed: f64,
        front: f64,
        motion: Option<(&Course, f64)>,
    ) {
        let weight = report_weight(reversed);
        let for_front = if chosen.is_reversed { -weight } else { weight };
        // What a better agent has reported is not lost.
        let before = f64::from(self.by_reports);
        let most = (weight / REPORT_WEIGHT).abs().max(before.abs());
        self.by_reports = single((before + for_front).clamp(-most, most));
        self.conflict = CONFLICT_KEPT * self.conflict + f32::from(u8::from(chosen.is_reversed));
        if let Some((course, dt_s)) = motion {
            let along = libm::cos(angle_difference(front, course.yaw));
            let full = ((course.speed - LEAST_SPEED_MPS) / FULL_SPEED_MPS).clamp(0.0, 1.0);
            let evidence = MOTION_PER_S * dt_s.abs().min(MOST_AT_ONCE_S) * full * along;
            let by_motion = f64::from(self.by_motion) + evidence;
            self.by_motion = single(by_motion.clamp(-MOST_BY_MOTION, MOST_BY_MOTION));
        }
    }

    /// What is known of the heading, and the probability that the front is at the other end.
    pub fn heading(&self) -> (HeadingKind, f64) {
        let front = f64::from(self.by_reports + self.by_motion);
        if self.conflict > IN_CONFLICT && front < DECIDED {
            (HeadingKind::Axis, 1.0 / (1.0 + libm::exp(front.abs())))
        } else {
            (HeadingKind::Known, 0.0)
        }
    }
}

/// In single precision, which is enough for evidence.
#[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
const fn single(evidence: f64) -> f32 {
    evidence as f32
}

/// Evidence of a report for the front, ln odds.
fn report_weight(reversed: f64) -> f64 {
    REPORT_WEIGHT * libm::log((1.0 - reversed) / reversed)
}

/// The difference of two axes, rad in [-π/2, π/2].
fn axis_difference(a: f64, b: f64) -> f64 {
    let off = angle_difference(a, b);
    if off > FRAC_PI_2 {
        off - PI
    } else if off < -FRAC_PI_2 {
        off + PI
    } else {
        off
    }
}

/// A report as it is taken under a hypothesis.
fn taken(z: &Measurement, chosen: &Hypothesis) -> Measurement {
    let mut read = Measurement { yaw: chosen.yaw, ..*z };
    if chosen.is_swapped {
        read = exchanged(&read);
    }
    read
}

/// With width and depth exchanged.
fn exchanged(z: &Measurement) -> Measurement {
    Measurement {
        size: [z.size[1], z.size[0]],
        relative_variance: [z.relative_variance[1], z.relative_variance[0]],
        size_law: [z.size_law[1], z.size_law[0]],
        ..*z
    }
}

/// How a report's heading is read: the likeliest way.
fn choose(z: &Measurement, shape: &Shape, reversed: f64) -> Hypothesis {
    let variance = z.yaw_variance + shape.yaw_variance;
    let distance2 = |yaw: f64| {
        let off = angle_difference(yaw, shape.yaw);
        off * off / variance
    };
    let as_reported =
        Hypothesis { cost: distance2(z.yaw), yaw: z.yaw, is_reversed: false, is_swapped: false };
    let reversed_cost = -2.0 * libm::log(reversed / (1.0 - reversed));
    if as_reported.cost <= NEAR.min(reversed_cost) {
        return as_reported;
    }
    let turned = wrap_angle(z.yaw + PI);
    let back = Hypothesis {
        cost: distance2(turned) + reversed_cost,
        yaw: turned,
        is_reversed: true,
        is_swapped: false,
    };
    let mut best = if back.cost < as_reported.cost { back } else { as_reported };
    if is_four_wheeled(shape.class) {
        let size = size_distance2(z, shape).min(SIZE_CAP);
        let size_exchanged = size_distance2(&exchanged(z), shape).min(SIZE_CAP);
        for quarter in [FRAC_PI_2, -FRAC_PI_2] {
            let yaw = wrap_angle(z.yaw + quarter);
            let cost = distance2(yaw) - 2.0 * libm::log(SWAPPED) + size_exchanged - size;
            if cost < best.cost {
                best = Hypothesis { cost, yaw, is_reversed: false, is_swapped: true };
            }
        }
    }
    best
}

fn is_four_wheeled(class: Class) -> bool {
    !(class.is_immobile() || class.is_pedestrian() || class.is_two_wheeler() || class == Class::Animal)
}

/// Squared distance of the sizes.
fn size_distance2(z: &Measurement, shape: &Shape) -> f64 {
    let of_axis = |axis: usize| {
        let middle = (z.size[axis] + shape.size[axis]) / 2.0;
        let difference = z.size[axis] - shape.size[axis];
        difference * difference / (z.relative_variance[axis] * middle * middle + shape.size_variance[axis])
    };
    of_axis(0) + of_axis(1)
}

/// A first report of a vehicle that is clearly wider than long has width and depth exchanged.
pub(super) fn first_read(z: &Measurement) -> Measurement {
    let [w, d] = z.size;
    let [rw, rd] = z.relative_variance;
    let limit = 0.26 + 3.0 * libm::sqrt(rw + rd);
    if is_four_wheeled(z.class) && z.class != Class::Unknown && libm::log(w / d) > limit {
        return Measurement { yaw: wrap_angle(z.yaw + FRAC_PI_2), ..exchanged(z) };
    }
    *z
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("orientation.swapped", format!("{SWAPPED}, as reported within {NEAR}, size at most {SIZE_CAP}")),
        ("orientation.course", format!("{LEAST_SPEED_MPS} m/s, {LEAST_SPEED_SIGMAS} sigma, slip {SLIP}")),
        (
            "orientation.front",
            format!(
                "reports {REPORT_WEIGHT}, motion {MOTION_PER_S}/s at {FULL_SPEED_MPS} m/s beyond that, {MOST_AT_ONCE_S} s at once, {MOST_BY_MOTION} at most, turned below {TURN_ROUND}"
            ),
        ),
        ("orientation.conflict", format!("{CONFLICT_KEPT} kept, beyond {IN_CONFLICT}, decided at {DECIDED}")),
        (
            "orientation.unreliable",
            format!("{MOST_UNRELIABLE} at most, {MOST_BY_ONE:?} by one in {INDEPENDENT_AFTER_S} s"),
        ),
    ]
}
