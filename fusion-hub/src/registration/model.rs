//! One object that two agents report, as an equation in both agents' errors.

use super::slot::RegistrationSlot;
use crate::filter::Motion;
use serde::{Deserialize, Serialize};
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::angle_difference;
use v2x_common::time::Timestamp;

/// An object's velocity changes by this much between two reports of it, m/s²: everyday braking.
const ACCELERATION: f64 = 1.0;
/// Headings of two reports differ by more where one of them is reversed.
const TURNED_ROUND_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// Headings with a smaller standard deviation than this, rad, are compared: a reversal of others is not detectable.
const SURE_YAW_RAD: f64 = 0.5;

/// By how much an agent errs, in the map frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bias {
    /// Its pose lies so far east of the true one, m.
    pub dx_m: f64,
    /// And so far north, m.
    pub dy_m: f64,
    /// And is turned counter-clockwise by this, rad.
    pub yaw_rad: f64,
    /// Its stamps are ahead of the time by this, s.
    pub clock_s: f64,
}

impl Bias {
    /// None.
    pub const ZERO: Self = Self { dx_m: 0.0, dy_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 };

    /// In the order of all matrices: dx, dy, yaw, clock.
    pub const fn from_array([dx_m, dy_m, yaw_rad, clock_s]: [f64; 4]) -> Self {
        Self { dx_m, dy_m, yaw_rad, clock_s }
    }

    /// No more of it than these standard deviations, in the order of [`Self::to_array`].
    pub(super) fn limited(self, sigmas: &[f64; 4]) -> Self {
        let Self { dx_m, dy_m, yaw_rad, clock_s } = self;
        let length = libm::hypot(dx_m, dy_m);
        let share = if length > sigmas[0] { sigmas[0] / length } else { 1.0 };
        Self {
            dx_m: share * dx_m,
            dy_m: share * dy_m,
            yaw_rad: yaw_rad.clamp(-sigmas[2], sigmas[2]),
            clock_s: clock_s.clamp(-sigmas[3], sigmas[3]),
        }
    }

    /// In the same order.
    pub const fn to_array(self) -> [f64; 4] {
        [self.dx_m, self.dy_m, self.yaw_rad, self.clock_s]
    }
}

/// A frame's agent, as registration needs it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Its slot.
    pub slot: RegistrationSlot,
    /// Whether it is a reference for others.
    pub is_reference: bool,
    /// Where the sensor was, as corrected, m.
    pub sensor: [f64; 2],
    /// The correction applied to the frame.
    pub applied: Bias,
}

/// A report of a track, as corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegistrationReport {
    /// The agent.
    pub source: Source,
    /// Capture time.
    pub captured_at: Timestamp,
    /// Position, m.
    pub position: [f64; 2],
    /// Its covariance, m².
    pub r: Covariance2,
    /// Heading, rad.
    pub yaw: f64,
    /// Its variance, rad².
    pub yaw_variance: f64,
}

/// Two agents' reports of one object at about one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedObject {
    /// The report that came last.
    pub own: RegistrationReport,
    /// The other one.
    pub partner: RegistrationReport,
    /// How the object moves.
    pub motion: Motion,
}

/// A difference d of two reports: d = h·(own errors, partner's errors) + noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Difference {
    /// Rows for x and y.
    pub(super) h: [[f64; 8]; 2],
    /// m.
    pub(super) position: [f64; 2],
    /// Covariance of the noise, m².
    pub(super) r: Covariance2,
    /// Covariance of the noise with the error of the velocity in `h`, m²/s.
    pub(super) with_velocity: Covariance2,
    /// Standard deviations that both clocks declare, s.
    pub(super) clocks: [f64; 2],
    /// Where headings can be compared.
    pub(super) heading: Option<Heading>,
}

/// The same of headings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Heading {
    pub(super) h: [f64; 8],
    /// rad.
    pub(super) difference: f64,
    /// rad².
    pub(super) variance: f64,
}

impl Difference {
    /// In units of the declared accuracies of both; applied corrections are added back. `clock_variance`, s², is the
    /// variance of the two clocks' difference: it multiplies the velocity's own error.
    pub(super) fn of(shared: &SharedObject, sigmas: &[f64; 8], clock_variance: f64) -> Self {
        let SharedObject { own, partner, motion } = shared;
        let gap_s = (own.captured_at - partner.captured_at).as_secs_f64();
        let [vx, vy] = motion.velocity;
        let lever = |of: &RegistrationReport, axis: usize| of.position[axis] - of.source.sensor[axis];
        let mut h = [
            [1.0, 0.0, -lever(own, 1), -vx, -1.0, 0.0, lever(partner, 1), vx],
            [0.0, 1.0, lever(own, 0), -vy, 0.0, -1.0, -lever(partner, 0), vy],
        ];
        let applied = joined(own.source.applied.to_array(), partner.source.applied.to_array());
        let position = [0, 1].map(|axis| {
            let apart = own.position[axis] - partner.position[axis] - motion.velocity[axis] * gap_s;
            apart + dot(&h[axis], &applied)
        });
        h.iter_mut().for_each(|row| scale(row, sigmas));
        let gap_variance = gap_s * gap_s + clock_variance;
        let swerve = ACCELERATION * gap_s * gap_s / 2.0;
        let (a, b, v) = (&own.r, &partner.r, &motion.covariance);
        let r = Covariance2 {
            xx: a.xx + b.xx + gap_variance * v.xx + swerve * swerve,
            xy: a.xy + b.xy + gap_variance * v.xy,
            yy: a.yy + b.yy + gap_variance * v.yy + swerve * swerve,
        };
        // The velocity was estimated from the partner's report where that came before: then their errors depend on each
        // other as position and velocity do after it, and a step of the gap makes of that what is predicted.
        let c = if gap_s >= 0.0 { motion.with_position } else { v.scaled(gap_s) };
        let clocks = [sigmas[3], sigmas[7]];
        let heading = Heading::of(shared, (gap_s, gap_variance), (sigmas, &applied));
        Self { h, position, r, with_velocity: c.scaled(-1.0), clocks, heading }
    }
}

impl Heading {
    fn of(
        shared: &SharedObject,
        (gap_s, gap_variance): (f64, f64),
        (sigmas, applied): (&[f64; 8], &[f64; 8]),
    ) -> Option<Self> {
        let SharedObject { own, partner, motion } = shared;
        let turn = motion.turn_rate;
        let variance = own.yaw_variance + partner.yaw_variance + gap_variance * motion.turn_rate_variance;
        if variance > SURE_YAW_RAD * SURE_YAW_RAD {
            return None;
        }
        let mut h = [0.0, 0.0, 1.0, -turn, 0.0, 0.0, -1.0, turn];
        let apart = angle_difference(own.yaw, partner.yaw) - turn * gap_s + dot(&h, applied);
        scale(&mut h, sigmas);
        (apart.abs() < TURNED_ROUND_RAD).then_some(Self { h, difference: apart, variance })
    }
}

/// One agent's four and another's.
pub(super) fn joined([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 8] {
    [a, b, c, d, e, f, g, h]
}

pub(super) fn dot(a: &[f64; 8], b: &[f64; 8]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn scale(row: &mut [f64; 8], sigmas: &[f64; 8]) {
    row.iter_mut().zip(sigmas).for_each(|(h, sigma)| *h *= sigma);
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("registration.acceleration", ACCELERATION.to_string()),
        ("registration.sure_yaw", format!("{SURE_YAW_RAD}, turned round beyond {TURNED_ROUND_RAD}")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::correct;
    use v2x_common::class::Class;
    use v2x_common::covariance::BoxCovariance;
    use v2x_common::detection::{Detection, DetectionFrame};
    use v2x_common::geometry::{BevBox, Pose, wrap_angle};
    use v2x_common::id::{AgentId, FrameId};
    use v2x_common::time::Span;

    /// m and rad/s: what is turning on a circle about the origin.
    const RADIUS_M: f64 = 60.0;
    const TURN: f64 = 0.2;

    /// Where the object truly is.
    fn truth(t: f64) -> Pose {
        let (sin, cos) = libm::sincos(TURN * t);
        let yaw = wrap_angle(TURN * t + std::f64::consts::FRAC_PI_2);
        Pose { x: RADIUS_M * cos, y: RADIUS_M * sin, yaw }
    }

    fn at(t: f64) -> Timestamp {
        Timestamp::EPOCH + Span::from_secs_f64(100.0 + t)
    }

    /// The report of an agent with this bias, without noise: detected from its true pose, reported about its estimated
    /// pose, stamped by its clock.
    fn reported(true_pose: Pose, t: f64, bias: &Bias) -> DetectionFrame {
        let object = truth(t);
        let (range, bearing) =
            (true_pose.distance_to(object.x, object.y), true_pose.bearing_to(object.x, object.y));
        let estimated = Pose {
            x: true_pose.x + bias.dx_m,
            y: true_pose.y + bias.dy_m,
            yaw: true_pose.yaw + bias.yaw_rad,
        };
        let (x, y) = estimated.offset(range * libm::cos(bearing), range * libm::sin(bearing));
        let yaw = wrap_angle(object.yaw - true_pose.yaw + estimated.yaw);
        let position = Covariance2 { xx: 0.09, xy: 0.03, yy: 0.04 };
        let detection = Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x, y, w: 1.8, d: 4.5, yaw },
            covariance: BoxCovariance { position, ww: 0.1, dd: 0.1, yaw: 0.01 },
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        };
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 1, sequence: 1 };
        DetectionFrame {
            sensor_pose: Some(estimated),
            detections: vec![detection],
            ..DetectionFrame::empty(id, at(t + bias.clock_s))
        }
    }

    fn report_of(frame: &DetectionFrame, slot: u8, applied: Bias) -> RegistrationReport {
        let (pose, detection) = (frame.sensor_pose.unwrap(), frame.detections[0]);
        let sensor = [pose.x, pose.y];
        RegistrationReport {
            source: Source { slot: RegistrationSlot(slot), is_reference: false, sensor, applied },
            captured_at: frame.captured_at,
            position: [detection.bev.x, detection.bev.y],
            r: detection.covariance.position,
            yaw: detection.bev.yaw,
            yaw_variance: detection.covariance.yaw,
        }
    }

    const OWN: Bias = Bias { dx_m: 0.3, dy_m: -0.4, yaw_rad: 0.009, clock_s: 0.05 };
    const OTHER: Bias = Bias { dx_m: -0.2, dy_m: 0.5, yaw_rad: -0.006, clock_s: -0.03 };
    const STAND: [Pose; 2] = [Pose { x: 10.0, y: 40.0, yaw: 0.7 }, Pose { x: 90.0, y: -20.0, yaw: -2.0 }];

    fn shared(own: RegistrationReport, partner: RegistrationReport, t: f64) -> SharedObject {
        let (sin, cos) = libm::sincos(TURN * t);
        let speed = RADIUS_M * TURN;
        let motion = Motion {
            velocity: [-speed * sin, speed * cos],
            covariance: Covariance2::isotropic(0.3),
            with_position: Covariance2::isotropic(0.1),
            turn_rate: TURN,
            turn_rate_variance: 0.01,
        };
        SharedObject { own, partner, motion }
    }

    /// d − h·b for the true errors: the residual of the linear model against a direct simulation.
    fn left(shared: &SharedObject) -> [f64; 3] {
        let one = Difference::of(shared, &[1.0; 8], 0.0);
        let truth = joined(OWN.to_array(), OTHER.to_array());
        let heading = one.heading.unwrap();
        let [x, y] = [0, 1].map(|axis| one.position[axis] - dot(&one.h[axis], &truth));
        [x, y, heading.difference - dot(&heading.h, &truth)]
    }

    #[test]
    fn the_linear_model_agrees_with_a_direct_simulation() {
        for gap_s in [0.0, 0.04, -0.04] {
            let own = report_of(&reported(STAND[0], 0.3, &OWN), 0, Bias::ZERO);
            let partner = report_of(&reported(STAND[1], 0.3 - gap_s, &OTHER), 1, Bias::ZERO);
            let [x, y, yaw] = left(&shared(own, partner, 0.3));
            // Errors are some 0.7 m; what is left is of second order, ½ v ω δ² and ψ v δ.
            assert!(x.abs().max(y.abs()) < 0.02 && yaw.abs() < 1e-9, "{x} {y} {yaw} at a gap of {gap_s}");
        }
    }

    #[test]
    fn applied_corrections_are_added_back_to_differences() {
        let applied = Bias { dx_m: 0.2, dy_m: -0.1, yaw_rad: 0.004, clock_s: 0.03 };
        let raw = reported(STAND[0], 0.3, &OWN);
        let mut corrected = raw.clone();
        correct(&raw, &applied, &mut corrected);
        let partner = report_of(&reported(STAND[1], 0.28, &OTHER), 1, Bias::ZERO);
        let [x, y, yaw] = left(&shared(report_of(&corrected, 0, applied), partner, 0.3));
        assert!(x.abs().max(y.abs()) < 0.02 && yaw.abs() < 1e-9, "{x} {y} {yaw}");
    }

    #[test]
    fn a_reversed_heading_is_not_compared() {
        let mut own = report_of(&reported(STAND[0], 0.3, &OWN), 0, Bias::ZERO);
        let partner = report_of(&reported(STAND[1], 0.3, &OTHER), 1, Bias::ZERO);
        own.yaw = wrap_angle(own.yaw + std::f64::consts::PI);
        assert_eq!(Difference::of(&shared(own, partner, 0.3), &[1.0; 8], 0.0).heading, None);
    }

    #[test]
    fn a_corrected_frame_equals_the_frame_without_errors() {
        let raw = reported(STAND[0], 0.3, &OWN);
        let mut corrected = DetectionFrame::empty(raw.id, raw.captured_at);
        correct(&raw, &OWN, &mut corrected).unwrap();
        let expected = reported(STAND[0], 0.3, &Bias::ZERO);
        assert_eq!((corrected.captured_at, corrected.id), (expected.captured_at, expected.id));
        let (pose, true_pose) = (corrected.sensor_pose.unwrap(), expected.sensor_pose.unwrap());
        assert!(
            pose.distance_to(true_pose.x, true_pose.y) < 1e-9 && (pose.yaw - true_pose.yaw).abs() < 1e-12
        );
        let (found, wanted) = (corrected.detections[0], expected.detections[0]);
        assert!((found.bev.x - wanted.bev.x).abs() < 1e-9 && (found.bev.y - wanted.bev.y).abs() < 1e-9);
        assert!((found.bev.yaw - wanted.bev.yaw).abs() < 1e-12);
        // Turned by −ψ: its size stays, its long axis turns.
        let (before, after) = (raw.detections[0].covariance.position, found.covariance.position);
        let axis = |c: &Covariance2| libm::atan2(2.0 * c.xy, c.xx - c.yy) / 2.0;
        assert!((axis(&after) - axis(&before) + OWN.yaw_rad).abs() < 1e-12);
        assert!((after.determinant() - before.determinant()).abs() < 1e-15);
    }
}
