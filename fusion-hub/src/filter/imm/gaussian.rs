//! Normal distributions of the leading 3, 4 or 5 components of (x, y, θ, v, ω).

use super::likelihood::{Factored, Likelihood, Symmetric};
use crate::filter::Course;
use crate::values::{Real, arrays};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use v2x_common::covariance::Covariance2;
use v2x_common::detection::MAX_SPEED_MPS;
use v2x_common::geometry::angle_difference;

/// Index of the heading.
pub(super) const YAW: usize = 2;
/// Index of the speed.
pub(super) const SPEED: usize = 3;
/// Index of the turn rate.
pub(super) const TURN: usize = 4;

/// Mean and covariance; the covariance's lower triangle by rows, so that a leading block comes first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "R: Serialize", deserialize = "R: Deserialize<'de>"))]
pub(super) struct Gaussian<const N: usize, const T: usize, R = f64> {
    #[serde(with = "arrays")]
    pub(super) mean: [R; N],
    #[serde(with = "arrays")]
    pub(super) covariance: [R; T],
}

/// Speed and turn rate of what is about to move, independent of each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Mean speed, m/s.
    pub(super) speed: f64,
    /// Variance of the speed, m²/s².
    pub(super) speed_variance: f64,
    /// Variance of the turn rate about 0, rad²/s².
    pub(super) turn_variance: f64,
}

/// See [`apart`], m.
const MAX_APART_M: f64 = 1000.0;

/// One turn in a second, rad/s.
const MAX_TURN_RATE: f64 = TAU;

/// (x, y, θ).
pub(super) type Still<R = f64> = Gaussian<3, 6, R>;
/// (x, y, θ, v).
pub(super) type Smooth<R = f64> = Gaussian<4, 10, R>;
/// (x, y, θ, v, ω).
pub(super) type Full<R = f64> = Gaussian<5, 15, R>;

/// Where row and column of a symmetric matrix are stored.
pub(super) const fn at(row: usize, column: usize) -> usize {
    if row < column { column * (column + 1) / 2 + row } else { row * (row + 1) / 2 + column }
}

/// How far two models of one object are apart (m), limited so that f64 can represent an ellipse of that length.
///
/// A report that moves them further from each other is 1 km off, and no gate lets it pass.
#[inline(always)]
pub(super) fn apart<R: Real>(deviation: R) -> R {
    let most = deviation.same(MAX_APART_M);
    if R::all(deviation.abs().is_at_most(most)) {
        return deviation;
    }
    deviation.map(|deviation| deviation.clamp(-MAX_APART_M, MAX_APART_M))
}

/// An angle that is at most one turn off brought into [-π, π]; any other is reduced by the general formula.
#[inline(always)]
pub(super) fn wrapped<R: Real>(angle: R) -> R {
    if R::all(angle.abs().is_at_most(angle.same(PI))) { angle } else { angle.map(wrapped_one) }
}

fn wrapped_one(angle: f64) -> f64 {
    if angle.abs() <= PI {
        angle
    } else if angle.abs() <= TAU {
        angle - TAU.copysign(angle)
    } else {
        angle_difference(angle, 0.0)
    }
}

impl<const N: usize, const T: usize, R: Real> Gaussian<N, T, R> {
    #[inline(always)]
    fn entry(&self, row: usize, column: usize) -> R {
        self.covariance[at(row, column)]
    }

    /// The leading components alone.
    #[inline(always)]
    pub(super) fn narrowed<const M: usize, const U: usize>(&self) -> Gaussian<M, U, R> {
        let mut narrow = Gaussian { mean: [self.mean[0]; M], covariance: [self.covariance[0]; U] };
        narrow.mean.copy_from_slice(&self.mean[..M]);
        narrow.covariance.copy_from_slice(&self.covariance[..U]);
        narrow
    }

    /// Another one where a condition holds.
    #[inline(always)]
    pub(super) fn unless(mut self, condition: R::Truth, other: &Self) -> Self {
        for (own, other) in self.mean.iter_mut().zip(&other.mean) {
            *own = R::choose(condition, *other, *own);
        }
        for (own, other) in self.covariance.iter_mut().zip(&other.covariance) {
            *own = R::choose(condition, *other, *own);
        }
        self
    }

    /// Keeps the heading in [-π, π].
    #[inline(always)]
    pub(super) fn wrap(&mut self) {
        self.mean[YAW] = wrapped(self.mean[YAW]);
    }

    /// Covariance of the position, m².
    #[inline(always)]
    pub(super) fn position_covariance(&self) -> Symmetric<R> {
        Symmetric { xx: self.covariance[0], xy: self.covariance[1], yy: self.covariance[2] }
    }

    /// Keeps speed and turn rate within what a body can do, and so within what f64 can subtract.
    ///
    /// Only absurd reports, or covariance intersection of what is never measured, lead there.
    #[inline(always)]
    pub(super) fn limit(&mut self) {
        for (component, most) in [(SPEED, MAX_SPEED_MPS), (TURN, MAX_TURN_RATE)] {
            if component >= N {
                return;
            }
            let mean = self.mean[component];
            if !R::all(mean.abs().is_at_most(mean.same(most))) {
                self.mean[component] = mean.map(|mean| mean.clamp(-most, most));
            }
            let variance = self.entry(component, component);
            if !R::all(variance.is_at_most(variance.same(most * most))) {
                let factor =
                    |variance: f64| if variance > most * most { most / libm::sqrt(variance) } else { 1.0 };
                let factor = variance.map(factor);
                for other in 0..N {
                    self.covariance[at(component, other)] *= factor;
                }
                self.covariance[at(component, component)] *= factor;
            }
        }
    }

    /// Updates by position, then by heading. Their errors are independent of each other.
    #[inline(always)]
    pub(super) fn update_pose(&mut self, z: &PoseReport<R>) -> Likelihood<R> {
        let mut likelihood = self.update_position(z.position, &z.r);
        likelihood.also(self.update_yaw(z.yaw, z.yaw_variance));
        likelihood
    }

    #[inline(always)]
    fn update_position(&mut self, z: [R; 2], r: &Symmetric<R>) -> Likelihood<R> {
        let s = Factored::of(&self.position_covariance().plus(r));
        let innovation = s.split([z[0] - self.mean[0], z[1] - self.mean[1]]);
        let mut cross = [z; N];
        let mut gain = [z; N];
        for i in 0..N {
            cross[i] = s.split([self.entry(i, 0), self.entry(i, 1)]);
            self.mean[i] += s.product(cross[i], innovation);
            gain[i] = s.solve(cross[i]);
        }
        for row in 2..N {
            for column in 2..=row {
                self.covariance[at(row, column)] -= s.product(cross[row], cross[column]);
            }
            // P (I − K)ᵀ = P S⁻¹ R: no cancellation where the measurement is far more accurate than the state.
            self.covariance[at(row, 0)] = gain[row][0] * r.xx + gain[row][1] * r.xy;
            self.covariance[at(row, 1)] = gain[row][0] * r.xy + gain[row][1] * r.yy;
        }
        self.covariance[0] = gain[0][0] * r.xx + gain[0][1] * r.xy;
        self.covariance[1] =
            (gain[0][0] * r.xy + gain[0][1] * r.yy + gain[1][0] * r.xx + gain[1][1] * r.xy) / 2.0;
        self.covariance[2] = gain[1][0] * r.xy + gain[1][1] * r.yy;
        s.likelihood(innovation)
    }

    #[inline(always)]
    fn update_yaw(&mut self, z: R, variance: R) -> Likelihood<R> {
        let s = self.entry(YAW, YAW) + variance;
        let innovation = wrapped(z - self.mean[YAW]);
        let kept = variance / s;
        let mut cross = [s; N];
        let mut gain = [s; N];
        for i in 0..N {
            cross[i] = self.entry(i, YAW);
            self.mean[i] += cross[i] * (innovation / s);
            gain[i] = cross[i] / s;
        }
        for (row, gain) in gain.iter().enumerate() {
            for (column, cross) in cross.iter().enumerate().take(row + 1) {
                if row == YAW || column == YAW {
                    self.covariance[at(row, column)] *= kept;
                } else {
                    self.covariance[at(row, column)] -= *gain * *cross;
                }
            }
        }
        self.wrap();
        Likelihood { mahalanobis2: innovation * innovation / s, determinant: s }
    }
}

/// A reported position and heading.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseReport<R = f64> {
    /// m.
    pub(super) position: [R; 2],
    /// m².
    pub(super) r: Symmetric<R>,
    /// rad in [-π, π].
    pub(super) yaw: R,
    /// rad².
    pub(super) yaw_variance: R,
}

impl<const N: usize, const T: usize> Gaussian<N, T> {
    /// Heading (rad) and its variance (rad²).
    pub(super) fn heading(&self) -> (f64, f64) {
        (self.mean[YAW], self.entry(YAW, YAW))
    }

    /// The same object with its front at the other end: heading by half a turn, speed with the other sign.
    pub(super) fn turn_round(&mut self) {
        self.mean[YAW] = wrapped(self.mean[YAW] + PI);
        if SPEED < N {
            self.mean[SPEED] = -self.mean[SPEED];
            for other in (0..N).filter(|other| *other != SPEED) {
                self.covariance[at(SPEED, other)] = -self.covariance[at(SPEED, other)];
            }
        }
    }

    /// With a heading (rad) of this variance (rad²), correlated with nothing.
    pub(super) fn turn_to(&mut self, yaw: f64, variance: f64) {
        self.mean[YAW] = yaw;
        self.set_alone(YAW, variance);
    }

    /// With heading and speed of a course, correlated with nothing.
    pub(super) fn redirect(&mut self, course: &Course) {
        self.turn_to(course.yaw, course.yaw_variance);
        if SPEED < N {
            self.mean[SPEED] = course.speed;
            self.set_alone(SPEED, course.speed_variance);
        }
        if TURN < N {
            self.mean[TURN] = 0.0;
            self.set_alone(TURN, self.entry(TURN, TURN));
        }
    }

    /// At a position with this covariance (m, m²), correlated with nothing else.
    pub(super) fn move_to(&mut self, [x, y]: [f64; 2], covariance: &Covariance2) {
        (self.mean[0], self.mean[1]) = (x, y);
        self.set_alone(0, covariance.xx);
        self.set_alone(1, covariance.yy);
        self.covariance[at(1, 0)] = covariance.xy;
    }

    pub(super) fn widen_position(&mut self, variance: f64) {
        self.covariance[at(0, 0)] += variance;
        self.covariance[at(1, 1)] += variance;
    }

    /// A component with this variance that is correlated with no other one.
    fn set_alone(&mut self, component: usize, variance: f64) {
        for other in 0..N {
            self.covariance[at(component, other)] = 0.0;
        }
        self.covariance[at(component, component)] = variance;
    }

    pub(super) fn inflate(&mut self, factor: f64) {
        self.covariance = self.covariance.map(|entry| entry * factor);
    }
}

impl<R: Real> Still<R> {
    /// With a motion that is not correlated with it.
    #[inline(always)]
    pub(super) fn with_motion(&self, motion: &Motion) -> Full<R> {
        let [x, y, yaw] = self.mean;
        let mut covariance = [x.same(0.0); 15];
        covariance[..6].copy_from_slice(&self.covariance);
        covariance[at(SPEED, SPEED)] = x.same(motion.speed_variance);
        covariance[at(TURN, TURN)] = x.same(motion.turn_variance);
        Full { mean: [x, y, yaw, x.same(motion.speed), x.same(0.0)], covariance }
    }
}

impl<R: Real> Smooth<R> {
    /// With a turn rate about 0 of this variance (rad²/s²).
    #[inline(always)]
    pub(super) fn with_turn(&self, variance: f64) -> Full<R> {
        let [x, y, yaw, speed] = self.mean;
        let mut covariance = [x.same(0.0); 15];
        covariance[..10].copy_from_slice(&self.covariance);
        covariance[at(TURN, TURN)] = x.same(variance);
        Full { mean: [x, y, yaw, speed, x.same(0.0)], covariance }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    pub(in super::super) type Dense = SMatrix<f64, 5, 5>;

    pub(in super::super) fn dense(state: &Full) -> Dense {
        Dense::from_fn(|row, column| state.covariance[at(row, column)])
    }

    /// A covariance from its factor.
    pub(in super::super) fn any_state() -> impl Strategy<Value = Full> {
        (prop::array::uniform5(-2.0..2.0f64), prop::collection::vec(-1.0..1.0f64, 25)).prop_map(
            |(mean, factor)| {
                let factor = Dense::from_row_slice(&factor);
                let full = factor * factor.transpose() + Dense::identity() * 0.01;
                let mut covariance = [0.0; 15];
                for row in 0..5 {
                    for column in 0..=row {
                        covariance[at(row, column)] = full[(row, column)];
                    }
                }
                Full { mean, covariance }
            },
        )
    }

    proptest! {
        #[test]
        fn the_update_equals_the_dense_kalman_update(
            state in any_state(),
            z in [-2.0..2.0f64, -2.0..2.0, -1.0..1.0],
            sigmas in [0.01..3.0f64, 0.01..3.0, 0.01..3.0],
            rho in -0.95..0.95f64,
        ) {
            let [sx, sy, sigma_yaw] = sigmas;
            let r = Covariance2 { xx: sx * sx, xy: rho * sx * sy, yy: sy * sy };
            let mut updated = state;
            let report =
                PoseReport { position: [z[0], z[1]], r: r.into(), yaw: z[2], yaw_variance: sigma_yaw * sigma_yaw };
            let likelihood = updated.update_pose(&report);
            let noise = SMatrix::<f64, 3, 3>::new(r.xx, r.xy, 0., r.xy, r.yy, 0., 0., 0., sigma_yaw * sigma_yaw);
            let h = SMatrix::<f64, 3, 5>::identity();
            let p = dense(&state);
            let s = h * p * h.transpose() + noise;
            let gain = p * h.transpose() * s.try_inverse().unwrap();
            let innovation = SVector::<f64, 3>::from(z) - h * SVector::from(state.mean);
            let kept = Dense::identity() - gain * h;
            let joseph = kept * p * kept.transpose() + gain * noise * gain.transpose();
            let mean = SVector::from(state.mean) + gain * innovation;
            // One after the other, the heading is wrapped after the position has turned it.
            let mut turned = state;
            turned.update_position([z[0], z[1]], &r.into());
            prop_assume!((z[2] - turned.mean[YAW]).abs() < PI && mean[2].abs() < PI);
            prop_assert!((mean - SVector::from(updated.mean)).abs().max() < 1e-7);
            prop_assert!((joseph - dense(&updated)).abs().max() < 1e-7);
            let m2 = (innovation.transpose() * s.try_inverse().unwrap() * innovation)[0];
            prop_assert!((likelihood.mahalanobis2 - m2).abs() < 1e-6 * (1.0 + m2));
            prop_assert!((likelihood.determinant / s.determinant() - 1.0).abs() < 1e-6);
        }

    }

    #[test]
    fn speed_and_turn_rate_are_kept_within_what_a_body_can_do() {
        let mut covariance = [0.0; 15];
        for (i, variance) in
            [1.0, 1.0, 0.1, 4.0 * MAX_SPEED_MPS * MAX_SPEED_MPS, 20.0].into_iter().enumerate()
        {
            covariance[at(i, i)] = variance;
        }
        covariance[at(SPEED, 0)] = 30.0;
        covariance[at(TURN, SPEED)] = 2.0;
        covariance[at(TURN, 0)] = 0.2;
        let mut state = Full { mean: [1.0, 2.0, 0.3, 400.0, -9.0], covariance };
        state.limit();
        assert_eq!(state.mean, [1.0, 2.0, 0.3, MAX_SPEED_MPS, -MAX_TURN_RATE]);
        // Half the standard deviation, with the same correlations; what is within the limits stays.
        let expected = [
            ((SPEED, SPEED), MAX_SPEED_MPS * MAX_SPEED_MPS),
            ((SPEED, 0), 15.0),
            ((TURN, SPEED), 1.0),
            ((TURN, TURN), 20.0),
            ((TURN, 0), 0.2),
            ((0, 0), 1.0),
        ];
        for ((row, column), expected) in expected {
            let found = state.covariance[at(row, column)];
            assert!((found - expected).abs() < 1e-9 * expected, "{row} {column}: {found}");
        }
    }

    #[test]
    fn an_angle_of_up_to_two_turns_is_brought_within_half_a_turn() {
        for turns in [-2.0, -1.0, 0.0, 1.0, 2.0] {
            for angle in [-3.0, -0.4, 0.0, 1.5, 3.1] {
                assert!((wrapped(angle + turns * TAU) - angle).abs() < 1e-12, "{turns} {angle}");
            }
        }
    }

    #[test]
    fn a_heading_stays_within_half_a_turn() {
        let mut still = Still { mean: [0.0, 0.0, PI + 0.5], covariance: [1.0, 0.0, 1.0, 0.0, 0.0, 1.0] };
        still.wrap();
        assert!((still.mean[YAW] - (0.5 - PI)).abs() < 1e-12);
    }
}
