//! One object's whole state under constant velocity.

use super::size_evidence::SizeEvidence;
use super::size_priors::TrackSizePriors;
use super::{
    Course, Filter, Heading, Kinematic, Motion, MotionParams, PoseEstimate, Size, smoothing,
    weight_against_track,
};
use crate::values::PredictedMeasurement;
use crate::values::{Measurement, PositionInnovation};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::geometry::wrap_angle;
use v2x_common::time::Timestamp;

/// Standard deviation of the turn rate, which a random-walk heading does not estimate, rad/s: everyday traffic.
const TURN_RATE: f64 = 0.2;

/// The state [x y vx vy w d θ] of one object at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Time of the state.
    pub at: Timestamp,
    /// Position and velocity.
    pub kinematic: Kinematic,
    /// Width, m.
    pub width: Size,
    /// Depth, m.
    pub depth: Size,
    /// Heading, rad.
    pub heading: Heading,
}

impl State {
    /// Updates by a track of its sender. Its error has an unknown correlation with those of the sender's earlier ones:
    /// covariance intersection (Julier & Uhlmann 1997) is consistent for any correlation.
    fn intersect(&mut self, z: &Measurement) -> PositionInnovation {
        let innovation = self.kinematic.innovation(z.position, &z.r);
        let weight = weight_against_track(&self.kinematic.pp, z);
        let of_report = 1.0 / (1.0 - weight);
        self.kinematic.inflate(1.0 / weight);
        self.kinematic.update_position(z.position, &z.r.scaled(of_report));
        if let Some(Velocity { x, y, covariance }) = z.velocity {
            let covariance = covariance.scaled(of_report);
            self.kinematic.update_velocity(&Velocity { x, y, covariance });
        }
        self.width.intersect(z.size[0], z.relative_variance[0]);
        self.depth.intersect(z.size[1], z.relative_variance[1]);
        self.heading.intersect(z.yaw, z.yaw_variance);
        innovation
    }
}

impl Filter for State {
    #[inline]
    fn initial(at: Timestamp, z: &Measurement) -> Self {
        let sigma_velocity = MotionParams::of(z.class).sigma_velocity_mps;
        Self {
            at,
            kinematic: Kinematic::initial(z.position, z.r, sigma_velocity, z.velocity.as_ref()),
            width: Size::initial(z.size[0], z.relative_variance[0]),
            depth: Size::initial(z.size[1], z.relative_variance[1]),
            heading: Heading::initial(z.yaw, z.yaw_variance),
        }
    }

    #[inline]
    fn at(&self) -> Timestamp {
        self.at
    }

    #[inline(always)]
    fn predict(&mut self, to: Timestamp, class: Class) {
        let dt_s = (to - self.at).as_secs_f64();
        self.at = to;
        if dt_s == 0.0 {
            return;
        }
        let motion = MotionParams::of(class);
        self.kinematic.predict(dt_s, motion.accel_psd);
        self.width.predict(dt_s, motion.size_diffusion);
        self.depth.predict(dt_s, motion.size_diffusion);
        self.heading.predict(dt_s, motion.yaw_diffusion);
    }

    fn smoothed(&self, class: Class, later: &Self) -> Self {
        if later.at == self.at {
            return *later;
        }
        let predicted = self.predicted(later.at, class);
        Self {
            at: self.at,
            kinematic: smoothing::kinematic(
                &self.kinematic,
                (predicted.at - self.at).as_secs_f64(),
                (&predicted.kinematic, &later.kinematic),
            ),
            width: smoothing::size(&self.width, &predicted.width, &later.width),
            depth: smoothing::size(&self.depth, &predicted.depth, &later.depth),
            heading: smoothing::heading(&self.heading, &predicted.heading, &later.heading),
        }
    }

    #[inline(always)]
    fn update(&mut self, z: &Measurement) -> PositionInnovation {
        if z.is_track {
            return self.intersect(z);
        }
        let innovation = self.kinematic.update_position(z.position, &z.r);
        if let Some(velocity) = &z.velocity {
            self.kinematic.update_velocity(velocity);
        }
        self.width.update(z.size[0], z.relative_variance[0]);
        self.depth.update(z.size[1], z.relative_variance[1]);
        self.heading.update(z.yaw, z.yaw_variance);
        innovation
    }

    #[inline]
    fn place_at(&self, to: Timestamp, class: Class) -> ([f64; 2], f64) {
        let mut kinematic = self.kinematic;
        kinematic.predict((to - self.at).as_secs_f64(), MotionParams::of(class).accel_psd);
        (kinematic.position, kinematic.pp.max_sigma())
    }

    #[inline]
    fn rough_position(&self) -> ([f64; 2], f64) {
        (self.kinematic.position, self.kinematic.pp.max_sigma())
    }

    #[inline]
    fn position_variance(&self) -> f64 {
        let Covariance2 { xx, yy, .. } = self.kinematic.pp;
        xx + yy
    }

    fn predicted_measurement(&self, class: Class) -> PredictedMeasurement {
        PredictedMeasurement {
            class,
            position: self.kinematic.position,
            position_covariance: self.kinematic.pp,
            gate_covariance: self.kinematic.pp,
            size: [self.width.mean, self.depth.mean],
            size_variance: [self.width.variance, self.depth.variance],
            yaw: self.heading.mean,
            yaw_variance: self.heading.variance,
            report_probability: 0.5,
            by_positions: None,
        }
    }

    #[inline]
    fn heading(&self) -> (f64, f64) {
        (self.heading.mean, self.heading.variance)
    }

    fn rough_size(&self) -> ([f64; 2], [f64; 2]) {
        ([self.width.mean, self.depth.mean], [self.width.variance, self.depth.variance])
    }

    fn turn_round(&mut self) {
        self.heading.mean = wrap_angle(self.heading.mean + PI);
    }

    /// Positions are not bound to the heading: there is nothing to be set.
    fn move_to(&mut self, _: [f64; 2], _: &Covariance2) {}

    fn widen_position(&mut self, variance: f64) {
        self.kinematic.pp.xx += variance;
        self.kinematic.pp.yy += variance;
    }

    fn turn_to(&mut self, yaw: f64, variance: f64) {
        self.heading = Heading { mean: yaw, variance };
    }

    fn redirect(&mut self, course: &Course) {
        self.heading = Heading { mean: course.yaw, variance: course.yaw_variance };
    }

    #[inline]
    fn motion(&self) -> Motion {
        let Kinematic { velocity, vv, pv, .. } = self.kinematic;
        let ([xx, yy], [x_vy, y_vx]) = (pv.along, pv.across);
        Motion {
            velocity,
            covariance: vv,
            with_position: Covariance2 { xx, xy: (x_vy + y_vx) / 2.0, yy },
            turn_rate: self.turn_rate(),
            turn_rate_variance: TURN_RATE * TURN_RATE,
        }
    }

    #[inline]
    fn turn_rate(&self) -> f64 {
        0.0
    }

    fn size_evidence(&self) -> Option<&[SizeEvidence; 2]> {
        None
    }

    #[inline]
    fn pose(&self) -> PoseEstimate {
        PoseEstimate {
            position: self.kinematic.position,
            velocity: self.kinematic.velocity,
            covariance: self.kinematic.covariance(),
            heading: self.heading,
        }
    }

    #[inline]
    fn sizes(&self, _: Class, _: &TrackSizePriors<'_>) -> [Size; 2] {
        [self.width, self.depth]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::covariance::Covariance2;
    use v2x_common::time::Span;

    fn report(is_track: bool) -> Measurement {
        Measurement {
            class: Class::Car,
            position: [1.0, 2.0],
            r: Covariance2 { xx: 0.09, xy: 0.03, yy: 0.16 },
            size: [1.8, 4.5],
            relative_variance: [0.01, 0.01],
            yaw: 0.3,
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: Some(Velocity { x: 3.0, y: 0.0, covariance: Covariance2::isotropic(0.4) }),
            is_track,
            since_last_s: f64::INFINITY,
        }
    }

    /// The state after repeated updates by one measurement at one time.
    fn after_repeats(is_track: bool) -> State {
        let z = report(is_track);
        let mut state = State::initial(Timestamp::EPOCH, &z);
        for _ in 0..50 {
            state.update(&z);
        }
        state
    }

    #[test]
    fn fifty_reports_of_one_foreign_track_count_as_one() {
        let z = report(true);
        let repeated = after_repeats(true);
        let p = repeated.kinematic.pp;
        assert!(p.xx >= 0.98 * z.r.xx && p.yy >= 0.98 * z.r.yy, "{p:?}");
        assert!(repeated.kinematic.vv.xx >= 0.98 * 0.15, "{:?}", repeated.kinematic.vv);
        assert!((repeated.heading.variance - 0.01).abs() < 1e-12);
        // Independent detections, in contrast, average out.
        assert!(after_repeats(false).kinematic.pp.xx < 0.03 * z.r.xx);
    }

    #[test]
    fn a_more_accurate_foreign_track_replaces_the_state() {
        let vague = Measurement { r: Covariance2::isotropic(10.0), yaw_variance: 4.0, ..report(false) };
        let mut state = State::initial(Timestamp::EPOCH, &vague);
        state.update(&Measurement { position: [9.0, 2.0], yaw: 1.0, ..report(true) });
        assert!((state.kinematic.position[0] - 9.0).abs() < 0.2, "{:?}", state.kinematic);
        assert!((state.heading.mean - 1.0).abs() < 1e-12 && state.kinematic.pp.xx < 0.2);
    }

    #[test]
    fn a_place_at_another_time_is_that_of_the_predicted_state() {
        let mut state = State::initial(Timestamp::EPOCH, &report(false));
        let to = Timestamp::EPOCH + Span::from_millis(700);
        let (position, sigma_m) = state.place_at(to, Class::Car);
        state.predict(to, Class::Car);
        assert_eq!((position, sigma_m), state.rough_position());
        assert!(sigma_m > 0.0 && position != [1.0, 2.0]);
    }

    #[test]
    fn motion_is_the_velocity_with_its_covariances_and_an_everyday_turn_rate() {
        let mut state = State::initial(Timestamp::EPOCH, &report(false));
        state.predict(Timestamp::EPOCH + Span::from_millis(700), Class::Car);
        state.update(&report(false));
        let Motion { velocity, covariance, with_position, turn_rate, turn_rate_variance } = state.motion();
        let [_, _, x_vx, x_vy, _, y_vx, y_vy, vxx, vxy, vyy] = state.kinematic.covariance();
        assert_eq!((velocity, turn_rate), (state.kinematic.velocity, 0.0));
        assert_eq!(covariance, Covariance2 { xx: vxx, xy: vxy, yy: vyy });
        assert_eq!((with_position.xx, with_position.yy), (x_vx, y_vy));
        assert!((with_position.xy - 0.5 * (x_vy + y_vx)).abs() < 1e-15 && x_vy != 0.0);
        assert!((turn_rate_variance - 0.04).abs() < 1e-15);
    }
}
