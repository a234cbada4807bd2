//! How position, heading, speed and turn rate of one model develop over time.

use super::displacement::Displacement;
use super::gaussian::{Full, SPEED, Still, TURN, YAW, at};
use crate::values::{Real, share_lost};

/// Decay of a manoeuvre's turn rate: to 0.6 of it in 0.5 s, 1/s.
const TURN_DECAY: f64 = 1.021_651_247_531_981_4;

/// What is left over of the variance that a turn rate at rest gains within 0.5 s: 1 − 0.6².
const TURN_GAINED: f64 = 0.64;

/// Diffusion of what stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// On each axis, m²/s.
    position: f64,
    /// rad²/s.
    yaw: f64,
}

/// Noise of what moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drive {
    /// Spectral density of the acceleration along the heading, m²/s³.
    acceleration: f64,
    /// Diffusion across the heading, m²/s.
    lateral: f64,
    /// Diffusion on each axis, m²/s.
    position: f64,
    /// Diffusion of the heading, rad²/s.
    yaw: f64,
    /// Spectral density of the turn rate's change, rad²/s³.
    turn: f64,
    /// Variance of the turn rate where it is no part of the state, rad²/s².
    pub(super) turn_variance: f64,
}

/// A variance per second from a standard deviation that half a second brings about.
const fn density(sigma: f64) -> f64 {
    sigma * sigma / 0.5
}

const fn radians(degrees: f64) -> f64 {
    degrees * std::f64::consts::PI / 180.0
}

impl Rest {
    /// From what half a second brings about: m, degrees.
    pub(super) const fn per_half_second(position_m: f64, yaw_deg: f64) -> Self {
        Self { position: density(position_m), yaw: density(radians(yaw_deg)) }
    }

    #[inline(always)]
    pub(super) fn diffuse<R: Real>(&self, state: &mut Still<R>, duration_s: R) {
        state.covariance[at(0, 0)] += duration_s * self.position;
        state.covariance[at(1, 1)] += duration_s * self.position;
        state.covariance[at(YAW, YAW)] += duration_s * self.yaw;
    }
}

impl Drive {
    /// From the table's acceleration (m/s²), turn rate (rad/s), lateral and position steps (m) and heading
    /// step (degrees) of half a second.
    ///
    /// The turn rate decays within 0.07 s (0.001 of it is left after 0.5 s): it moves the heading by 0.75
    /// of a second times itself, and is no part of the state.
    pub(super) const fn smooth(sa: f64, so: f64, sl: f64, qp: f64, qy_deg: f64) -> Self {
        let yaw = density(radians(qy_deg)) + density(0.75 * so);
        Self {
            acceleration: sa * sa * 0.5,
            lateral: density(sl),
            position: density(qp),
            yaw,
            turn: 0.0,
            turn_variance: so * so,
        }
    }

    /// The same for a turn rate that lasts: an Ornstein-Uhlenbeck process.
    pub(super) const fn manoeuvre(sa: f64, so: f64, sl: f64, qp: f64, qy_deg: f64) -> Self {
        Self {
            acceleration: sa * sa * 0.5,
            lateral: density(sl),
            position: density(qp),
            yaw: density(radians(qy_deg)),
            turn: 2.0 * TURN_DECAY * so * so / TURN_GAINED,
            turn_variance: 0.0,
        }
    }
}

/// A step in time, and what follows from its length alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<R = f64> {
    dt_s: R,
    pub(super) duration_s: R,
    /// Share of the turn rate that is left.
    left: R,
    /// ∫ of the decaying turn rate over the step, s.
    turned: R,
    /// The same, averaged over the step: how far the mean heading is ahead, s.
    ahead: R,
    /// Distance from the rear axle to the centre, m.
    pub(super) lever_m: R,
    /// Of a turn rate driven by unit noise: variance of the heading, covariance, variance of the rate.
    turn_noise: [R; 3],
}

impl<R: Real> Step<R> {
    /// A decaying turn rate is the same process backwards in time (it is stationary), but for the sign
    /// of what it integrates to.
    #[inline(always)]
    pub(super) fn of(dt_s: R, lever_m: R) -> Self {
        let duration_s = dt_s.abs();
        let constant = |value: f64| dt_s.same(value);
        let sign = constant(1.0).copysign(dt_s);
        let rate = TURN_DECAY;
        let lost = share_lost(duration_s * rate);
        let left = constant(1.0) - lost;
        let turned = lost / rate;
        let ahead = (duration_s - turned) / (duration_s * rate);
        let rate_variance = lost * (constant(2.0) - lost) / (2.0 * rate);
        let yaw_variance = (duration_s - turned * 2.0 + rate_variance) / (rate * rate);
        let turn_noise = [yaw_variance, sign * turned * turned / 2.0, rate_variance];
        Self { dt_s, duration_s, left, turned: sign * turned, ahead: sign * ahead, lever_m, turn_noise }
    }
}

/// The state after a step.
#[inline(always)]
pub(super) fn moved<R: Real>(state: &Full<R>, step: &Step<R>, drive: &Drive) -> Full<R> {
    let lever = step.lever_m;
    let displacement = Displacement::of(state, step.dt_s, lever * step.turned, step.ahead);
    let Displacement { mean, covariance: spread, cross, .. } = &displacement;
    let mut next = *state;
    next.mean[0] += mean.re;
    next.mean[1] += mean.im;
    next.mean[YAW] += step.turned * state.mean[TURN];
    next.mean[TURN] *= step.left;
    let old = &state.covariance;
    let c = &mut next.covariance;
    c[at(0, 0)] += cross[0].re * 2.0 + spread.xx;
    c[at(1, 0)] += cross[0].im + cross[1].re + spread.xy;
    c[at(1, 1)] += cross[1].im * 2.0 + spread.yy;
    for axis in 0..2 {
        let part = |s: usize| if axis == 0 { cross[s].re } else { cross[s].im };
        c[at(SPEED, axis)] = old[at(SPEED, axis)] + part(SPEED);
        let turn = old[at(TURN, axis)] + part(TURN);
        c[at(YAW, axis)] = old[at(YAW, axis)] + part(YAW) + step.turned * turn;
        c[at(TURN, axis)] = step.left * turn;
    }
    let yaw_turn = old[at(TURN, YAW)] + step.turned * old[at(TURN, TURN)];
    c[at(YAW, YAW)] += step.turned * (old[at(TURN, YAW)] + yaw_turn);
    c[at(SPEED, YAW)] += step.turned * old[at(TURN, SPEED)];
    c[at(TURN, YAW)] = step.left * yaw_turn;
    c[at(TURN, SPEED)] *= step.left;
    c[at(TURN, TURN)] *= step.left * step.left;
    add_noise(&mut next, step, drive, &displacement);
    next.wrap();
    next
}

/// Covariance of the state before a step (rows) with the state after it (columns).
pub(super) fn cross_covariance(state: &Full, step: &Step) -> [[f64; 5]; 5] {
    let Displacement { cross, .. } =
        Displacement::of(state, step.dt_s, step.lever_m * step.turned, step.ahead);
    std::array::from_fn(|row| {
        let [x, y, yaw, speed, turn] = std::array::from_fn(|column| state.covariance[at(row, column)]);
        [x + cross[row].re, y + cross[row].im, yaw + step.turned * turn, speed, step.left * turn]
    })
}

/// White acceleration along the heading: q·[[T³/3, T²/2], [T²/2, T]]; diffusion across it and of all else.
#[inline(always)]
fn add_noise<R: Real>(state: &mut Full<R>, step: &Step<R>, drive: &Drive, displacement: &Displacement<R>) {
    let Displacement { direction, axis, .. } = displacement;
    let duration = step.duration_s;
    let along = duration * drive.acceleration * duration * duration / 3.0;
    let across = duration * drive.lateral;
    // Going back, noise of position and of speed are anticorrelated: the cross term takes dt's sign.
    let with_speed = step.dt_s * drive.acceleration * duration / 2.0;
    let isotropic = (along + across) / 2.0 + duration * drive.position;
    let directed = (along - across) / 2.0;
    let c = &mut state.covariance;
    c[at(0, 0)] += isotropic + directed * axis.re;
    c[at(1, 0)] += directed * axis.im;
    c[at(1, 1)] += isotropic - directed * axis.re;
    c[at(SPEED, 0)] += with_speed * direction.re;
    c[at(SPEED, 1)] += with_speed * direction.im;
    c[at(SPEED, SPEED)] += duration * drive.acceleration;
    let [yaw, yaw_turn, turn] = step.turn_noise;
    c[at(YAW, YAW)] += duration * drive.yaw + yaw * drive.turn;
    c[at(TURN, YAW)] += yaw_turn * drive.turn;
    c[at(TURN, TURN)] += turn * drive.turn;
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};
    use std::f64::consts::TAU;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        let mut uniform = || (f64::from(random.next_u32()) + 0.5) / 4_294_967_296.0;
        libm::sqrt(-2.0 * libm::log(uniform())) * libm::cos(TAU * uniform())
    }

    const QUIET: Drive =
        Drive { acceleration: 0.0, lateral: 0.0, position: 0.0, yaw: 0.0, turn: 0.0, turn_variance: 0.0 };

    /// Lower triangle of a factor of the covariance, by rows.
    const FACTOR: [f64; 15] =
        [0.5, 0.1, 0.4, 0.1, -0.2, 0.3, 0.5, 0.2, -0.3, 1.5, 0.02, 0.05, 0.1, 0.05, 0.2];

    fn state() -> Full {
        let mut covariance = [0.0; 15];
        for row in 0..5 {
            for column in 0..=row {
                covariance[at(row, column)] =
                    (0..=column).map(|k| FACTOR[at(row, k)] * FACTOR[at(column, k)]).sum();
            }
        }
        Full { mean: [1.0, -2.0, 0.8, 6.0, 0.3], covariance }
    }

    #[test]
    fn moments_after_a_step_are_those_of_many_samples() {
        let step = Step::of(0.5, 1.2);
        let state = state();
        let predicted = moved(&state, &step, &QUIET);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let count = 200_000;
        let (mut sum, mut products, mut crossed) = ([0.0; 5], [0.0; 15], [[0.0; 5]; 5]);
        for _ in 0..count {
            let unit: [f64; 5] = std::array::from_fn(|_| normal(&mut random));
            let [x, y, yaw, v, turn]: [f64; 5] = std::array::from_fn(|row| {
                state.mean[row] + (0..=row).map(|k| FACTOR[at(row, k)] * unit[k]).sum::<f64>()
            });
            let (sin, cos) = libm::sincos(yaw + step.ahead * turn);
            let (along, aside) = (step.dt_s * v, step.lever_m * step.turned * turn);
            let after = [
                x + along * cos - aside * sin,
                y + along * sin + aside * cos,
                yaw + step.turned * turn,
                v,
                step.left * turn,
            ];
            let off: [f64; 5] = std::array::from_fn(|i| after[i] - predicted.mean[i]);
            for row in 0..5 {
                let before = (0..=row).map(|k| FACTOR[at(row, k)] * unit[k]).sum::<f64>();
                for column in 0..5 {
                    crossed[row][column] += before * off[column] / f64::from(count);
                }
                sum[row] += off[row] / f64::from(count);
                for column in 0..=row {
                    products[at(row, column)] += off[row] * off[column] / f64::from(count);
                }
            }
        }
        let cross = cross_covariance(&state, &step);
        for row in 0..5 {
            let before = libm::sqrt(state.covariance[at(row, row)]);
            for column in 0..5 {
                let after = libm::sqrt(predicted.covariance[at(column, column)]);
                let off = crossed[row][column] - cross[row][column];
                assert!(off.abs() < 0.02 * before * after, "with what was before: {row} {column} {off}");
            }
            let sigma = |i: usize| libm::sqrt(predicted.covariance[at(i, i)]);
            // Five standard errors of a mean, and of a covariance of heavy tails.
            assert!(sum[row].abs() < 5.0 * sigma(row) / libm::sqrt(f64::from(count)), "{row} {sum:?}");
            for column in 0..=row {
                let off = products[at(row, column)] - predicted.covariance[at(row, column)];
                assert!(off.abs() < 0.02 * sigma(row) * sigma(column), "{row} {column} {off}");
            }
        }
    }

    #[test]
    fn noise_does_not_depend_on_how_a_step_is_split() {
        let drive = Drive::manoeuvre(3.0, 0.08, 0.3, 0.2, 1.5);
        // Only the heading's noise is nonlinear: the state itself is certain.
        let start = Full { mean: [0.0; 5], covariance: [0.0; 15] };
        for dt in [0.5, -0.5] {
            let whole = moved(&start, &Step::of(dt, 0.0), &drive);
            let part = Step::of(dt / 10.0, 0.0);
            let split = (0..10).fold(start, |state, _| moved(&state, &part, &drive));
            for entry in 0..15 {
                let (a, b) = (whole.covariance[entry], split.covariance[entry]);
                assert!((a - b).abs() < 0.02 * a.abs().max(0.01), "{dt} {entry}: {a} {b}");
            }
        }
    }

    #[test]
    fn a_thousandth_of_a_second_and_a_microsecond_cancel_nothing() {
        for dt in [1e-3, 1e-6, 1e-9] {
            let [yaw, yaw_turn, turn] = Step::of(dt, 0.0).turn_noise;
            assert!((turn / dt - 1.0).abs() < 0.01 && (yaw_turn / (dt * dt / 2.0) - 1.0).abs() < 0.01);
            // Of third order in time: where it cancels, the heading's own diffusion is 1e12 times larger.
            let expected = dt * dt * dt / 3.0;
            assert!((yaw - expected).abs() < 0.01 * expected + 1e-15 * dt, "{dt} {yaw}");
        }
    }

    #[test]
    fn a_steps_integrals_are_those_of_a_decaying_turn_rate() {
        for dt in [0.4, -0.4] {
            let step = Step::of(dt, 1.2);
            let decay = |t: f64| libm::exp(-TURN_DECAY * t);
            let turned = |t: f64| (1.0 - decay(t)) / TURN_DECAY;
            // The midpoint rule.
            let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
                let parts = 4000;
                let h = 0.4 / f64::from(parts);
                (0..parts).map(|k| f((f64::from(k) + 0.5) * h) * h).sum()
            };
            let sign = 1.0f64.copysign(dt);
            let expected = [
                (step.left, decay(0.4)),
                (step.turned, sign * integral(&decay)),
                (step.ahead, sign * integral(&turned) / 0.4),
                (step.turn_noise[0], integral(&|t| turned(t) * turned(t))),
                (step.turn_noise[1], sign * integral(&|t| turned(t) * decay(t))),
                (step.turn_noise[2], integral(&|t| decay(t) * decay(t))),
            ];
            for (place, (found, expected)) in expected.into_iter().enumerate() {
                assert!((found - expected).abs() < 1e-7, "{dt} {place}: {found} {expected}");
            }
        }
    }

    #[test]
    fn what_stands_diffuses_on_each_axis_and_in_its_heading() {
        let rest = Rest { position: 0.02, yaw: 0.3 };
        let mut still = Still { mean: [1.0, 2.0, 0.5], covariance: [1.0, 0.1, 2.0, 0.2, 0.3, 3.0] };
        rest.diffuse(&mut still, 0.5);
        assert_eq!(still.mean, [1.0, 2.0, 0.5]);
        for (found, expected) in still.covariance.into_iter().zip([1.01, 0.1, 2.01, 0.2, 0.3, 3.15]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn noise_of_position_is_of_acceleration_along_the_heading_and_of_diffusion_across_it() {
        let drive = Drive { acceleration: 6.0, lateral: 0.4, position: 0.1, ..QUIET };
        let start = Full { mean: [0.0; 5], covariance: [0.0; 15] };
        let after = moved(&start, &Step::of(0.5, 0.0), &drive).covariance;
        let (along, across) = (6.0 * 0.125 / 3.0, 0.4 * 0.5);
        let expected =
            [((0, 0), along + 0.05), ((1, 1), across + 0.05), ((1, 0), 0.0), ((SPEED, SPEED), 3.0)];
        for ((row, column), expected) in expected {
            assert!((after[at(row, column)] - expected).abs() < 1e-12, "{row} {column}: {after:?}");
        }
    }
}
