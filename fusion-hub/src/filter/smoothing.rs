//! Smoothing of the constant-velocity filter: exactly (Rauch, Tung & Striebel 1965).

use super::retrodiction::{Later, Square, retrodicted};
use super::{Cross, Heading, Kinematic, Size};
use v2x_common::covariance::Covariance2;
use v2x_common::fused::KINEMATIC_INDEX;
use v2x_common::geometry::{angle_difference, wrap_angle};

/// The smoothed position and velocity, given those `predicted` for a time `dt_s` later and the smoothed ones of that time.
pub(super) fn kinematic(
    filtered: &Kinematic,
    dt_s: f64,
    (predicted, later): (&Kinematic, &Kinematic),
) -> Kinematic {
    let covariance = dense(filtered);
    // P Fᵀ with x' = x + T v.
    let cross = covariance.map(|[x, y, vx, vy]| [x + dt_s * vx, y + dt_s * vy, vx, vy]);
    let (was, is) = (mean(predicted), mean(later));
    let shift: [f64; 4] = std::array::from_fn(|i| is[i] - was[i]);
    let known = Later { predicted: &dense(predicted), shift: &shift, covariance: &dense(later) };
    let Some((shift, covariance)) = retrodicted(&covariance, &cross, known) else { return *filtered };
    let [x, y, vx, vy] = mean(filtered);
    let block = |first: usize| Covariance2 {
        xx: covariance[first][first],
        xy: covariance[first][first + 1],
        yy: covariance[first + 1][first + 1],
    };
    Kinematic {
        position: [x + shift[0], y + shift[1]],
        velocity: [vx + shift[2], vy + shift[3]],
        pp: block(0),
        pv: Cross {
            along: [covariance[0][2], covariance[1][3]],
            across: [covariance[0][3], covariance[1][2]],
        },
        vv: block(2),
    }
}

fn mean(state: &Kinematic) -> [f64; 4] {
    let ([x, y], [vx, vy]) = (state.position, state.velocity);
    [x, y, vx, vy]
}

fn dense(state: &Kinematic) -> Square<4> {
    let mut dense = [[0.0; 4]; 4];
    for (entry, (row, column)) in state.covariance().into_iter().zip(KINEMATIC_INDEX) {
        dense[row][column] = entry;
        dense[column][row] = entry;
    }
    dense
}

/// Mean shift and variance of a random walk.
fn walk(variance: f64, predicted: f64, (shift, later): (f64, f64)) -> (f64, f64) {
    // A constant that is known exactly stays.
    let gain = if predicted > 0.0 { variance / predicted } else { 0.0 };
    (gain * shift, variance * (1.0 - gain) + gain * gain * later)
}

/// The smoothed size.
pub(super) fn size(filtered: &Size, predicted: &Size, later: &Size) -> Size {
    let known = (later.mean - predicted.mean, later.variance);
    let (shift, variance) = walk(filtered.variance, predicted.variance, known);
    Size { mean: filtered.mean + shift, variance }
}

/// The smoothed heading.
pub(super) fn heading(filtered: &Heading, predicted: &Heading, later: &Heading) -> Heading {
    let known = (angle_difference(later.mean, predicted.mean), later.variance);
    let (shift, variance) = walk(filtered.variance, predicted.variance, known);
    Heading { mean: wrap_angle(filtered.mean + shift), variance }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Filter, MotionParams, State};
    use crate::values::Measurement;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;
    use std::f64::consts::PI;
    use v2x_common::class::Class;
    use v2x_common::time::{Span, Timestamp};

    const CLASS: Class = Class::Car;

    fn report(position: [f64; 2], sigmas: [f64; 2], yaw: f64) -> Measurement {
        let [sx, sy] = sigmas;
        Measurement {
            class: CLASS,
            position,
            r: Covariance2 { xx: sx * sx, xy: 0.3 * sx * sy, yy: sy * sy },
            size: [1.8, 4.5],
            relative_variance: [0.04; 2],
            yaw,
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        }
    }

    fn filtered(reports: &[(i64, Measurement)]) -> Vec<State> {
        let mut at = Timestamp::EPOCH;
        let mut states = vec![State::initial(at, &reports[0].1)];
        for (gap_ms, z) in &reports[1..] {
            at += Span::from_millis(*gap_ms);
            let mut state = states[states.len() - 1].predicted(at, CLASS);
            state.update(z);
            states.push(state);
        }
        states
    }

    fn smoothed_all(mut states: Vec<State>) -> Vec<State> {
        for place in (0..states.len() - 1).rev() {
            states[place] = states[place].smoothed(CLASS, &states[place + 1]);
        }
        states
    }

    /// All states at once, by weighted least squares over the prior, every step and every report: the oracle,
    /// without any recursion.
    struct Batch {
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
    }

    impl Batch {
        fn of(reports: &[(i64, Measurement)]) -> Self {
            let motion = MotionParams::of(CLASS);
            let n = 4 * reports.len();
            let (mut information, mut evidence) = (DMatrix::zeros(n, n), DVector::zeros(n));
            let mut add = |rows: DMatrix<f64>, value: DVector<f64>, covariance: DMatrix<f64>| {
                let weight = covariance.try_inverse().unwrap();
                information += rows.transpose() * &weight * &rows;
                evidence += rows.transpose() * weight * value;
            };
            for (place, (gap_ms, z)) in reports.iter().enumerate() {
                let block = |columns: &DMatrix<f64>, at: usize| {
                    let mut rows = DMatrix::zeros(columns.nrows(), n);
                    rows.view_mut((0, 4 * at), columns.shape()).copy_from(columns);
                    rows
                };
                let whole = DMatrix::identity(4, 4);
                let r = DMatrix::from_row_slice(2, 2, &[z.r.xx, z.r.xy, z.r.xy, z.r.yy]);
                let position = whole.rows(0, 2).into_owned();
                add(block(&position, place), DVector::from_row_slice(&z.position), r);
                if place == 0 {
                    let velocity = whole.rows(2, 2).into_owned();
                    let prior =
                        DMatrix::identity(2, 2) * (motion.sigma_velocity_mps * motion.sigma_velocity_mps);
                    add(block(&velocity, 0), DVector::zeros(2), prior);
                    continue;
                }
                let dt = 1e-3 * *gap_ms as f64;
                let (mut f, mut q) = (whole.clone(), whole.clone());
                for axis in 0..2 {
                    f[(axis, axis + 2)] = dt;
                    q[(axis, axis)] = motion.accel_psd * dt * dt * dt / 3.0;
                    q[(axis, axis + 2)] = motion.accel_psd * dt * dt / 2.0;
                    q[(axis + 2, axis)] = q[(axis, axis + 2)];
                    q[(axis + 2, axis + 2)] = motion.accel_psd * dt;
                }
                add(block(&whole, place) - block(&f, place - 1), DVector::zeros(4), q);
            }
            let covariance = information.try_inverse().unwrap();
            Self { mean: &covariance * evidence, covariance }
        }
    }

    proptest! {
        #[test]
        fn smoothed_states_equal_least_squares_over_all_reports(
            reports in prop::collection::vec(
                (50..600i64, ([-5.0..5.0f64, -5.0..5.0], [0.2..2.0f64, 0.2..2.0])), 2..8),
        ) {
            let reports: Vec<_> =
                reports.into_iter().map(|(gap, (at, sigmas))| (gap, report(at, sigmas, 0.0))).collect();
            let batch = Batch::of(&reports);
            for (place, state) in smoothed_all(filtered(&reports)).iter().enumerate() {
                let found = DVector::from_row_slice(&mean(&state.kinematic));
                let expected = batch.mean.rows(4 * place, 4);
                prop_assert!((&found - expected).abs().max() < 1e-9 * (1.0 + expected.abs().max()));
                let covariance = dense(&state.kinematic);
                let found = DMatrix::from_fn(4, 4, |row, column| covariance[row][column]);
                let expected = batch.covariance.view((4 * place, 4 * place), (4, 4));
                prop_assert!((&found - expected).abs().max() < 1e-9 * (1.0 + expected.abs().max()));
            }
        }
    }

    #[test]
    fn headings_are_smoothed_across_pi() {
        let at = |yaw: f64| report([0.0; 2], [0.5; 2], yaw);
        let near = smoothed_all(filtered(&[(0, at(-0.1)), (300, at(0.1)), (300, at(0.15))]));
        let seam = smoothed_all(filtered(&[(0, at(PI - 0.1)), (300, at(0.1 - PI)), (300, at(0.15 - PI))]));
        for (near, seam) in near.iter().zip(&seam) {
            let off = angle_difference(seam.heading.mean, near.heading.mean + PI);
            assert!(off.abs() < 1e-12, "{near:?} {seam:?}");
            assert!((near.heading.variance - seam.heading.variance).abs() < 1e-15);
        }
        assert!(near[0].heading.variance < 0.01);
    }

    #[test]
    fn a_later_state_of_the_same_time_replaces_the_state() {
        let states = filtered(&[(0, report([0.0; 2], [0.5; 2], 0.0)), (0, report([1.0; 2], [0.5; 2], 0.1))]);
        assert_eq!(states[0].smoothed(CLASS, &states[1]), states[1]);
    }
}
