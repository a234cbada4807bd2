//! The filter stays sound for all finite input: no covariance becomes indefinite, no value becomes NaN.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::class::Class;
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::filter::size_priors::SizePriors;
use v2x_fusion_hub::filter::{Estimate, Filter, ImmState, State};
use v2x_fusion_hub::values::Measurement;

const UPDATES: u32 = 1_000_000;

fn unit(rng: &mut ChaCha8Rng) -> f64 {
    (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0
}

/// A number between the two, evenly on a logarithmic scale.
fn log_uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * libm::pow(high / low, unit(rng))
}

fn signed(rng: &mut ChaCha8Rng, magnitude: f64) -> f64 {
    magnitude * (2.0 * unit(rng) - 1.0)
}

fn covariance(rng: &mut ChaCha8Rng) -> Covariance2 {
    let (sx, sy) = (log_uniform(rng, 1e-3, 70.0), log_uniform(rng, 1e-3, 70.0));
    let rho = signed(rng, 0.999);
    Covariance2 { xx: sx * sx, xy: rho * sx * sy, yy: sy * sy }
}

/// Any report that validation accepts, near or far from the last one.
fn measurement(rng: &mut ChaCha8Rng, class: Class, origin: f64) -> Measurement {
    let reach = log_uniform(rng, 1e-2, 1e4);
    let velocity = (unit(rng) < 0.2).then(|| Velocity {
        x: signed(rng, 150.0),
        y: signed(rng, 150.0),
        covariance: covariance(rng),
    });
    Measurement {
        class,
        position: [origin + signed(rng, reach), -origin + signed(rng, reach)],
        r: covariance(rng),
        size: [log_uniform(rng, 1e-3, 65.0), log_uniform(rng, 1e-3, 65.0)],
        relative_variance: [log_uniform(rng, 1e-6, 1e3), log_uniform(rng, 1e-6, 1e3)],
        yaw: signed(rng, std::f64::consts::PI),
        yaw_variance: log_uniform(rng, 1e-8, 49.0),
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity,
        is_track: unit(rng) < 0.1,
        since_last_s: f64::INFINITY,
    }
}

/// Every variance positive and finite, and the covariance of position and velocity positive definite.
fn assert_sound(estimate: &Estimate, step: u32) {
    use nalgebra::Matrix4;
    let mut p = Matrix4::zeros();
    for (value, (row, column)) in estimate.covariance.into_iter().zip(v2x_common::fused::KINEMATIC_INDEX) {
        p[(row, column)] = value;
        p[(column, row)] = value;
    }
    // Scaled to unit diagonal: variances may differ by ten orders of magnitude.
    let sigma = p.diagonal().map(libm::sqrt);
    let scaled = Matrix4::from_fn(|row, column| p[(row, column)] / (sigma[row] * sigma[column]));
    assert!(scaled.cholesky().is_some(), "step {step}: {p}");
    let means = [
        estimate.position,
        estimate.velocity,
        [estimate.width.mean, estimate.depth.mean],
        [estimate.heading.mean; 2],
    ];
    assert!(means.as_flattened().iter().all(|mean| mean.is_finite()), "step {step}: {estimate:?}");
    let variances = [estimate.width.variance, estimate.depth.variance, estimate.heading.variance];
    assert!(variances.iter().all(|v| *v > 0.0 && v.is_finite()), "step {step}: {estimate:?}");
}

/// A million steps of every length and every kind of report.
fn stays_sound<F: Filter>(classes: &[Class], origin: f64) {
    let rng = &mut ChaCha8Rng::seed_from_u64(20_261_122);
    let mut at = Timestamp::EPOCH;
    let mut state = F::initial(at, &measurement(rng, classes[0], origin));
    for step in 0..UPDATES {
        let class = classes[step as usize % classes.len()];
        let dt_s = if unit(rng) < 0.1 { 0.0 } else { log_uniform(rng, 1e-6, 1.5) };
        at += Span::from_secs_f64(dt_s);
        state.predict(at, class);
        assert!(state.rough_position().1 > 0.0, "step {step}");
        state.update(&measurement(rng, class, origin));
        if step % 101 == 0 {
            assert_sound(&state.estimate(class, &SizePriors::default().of_track(None)), step);
        }
    }
}

#[test]
fn constant_velocity_stays_positive_definite_over_a_million_updates() {
    stays_sound::<State>(&[Class::Car], 0.0);
}

#[test]
fn constant_velocity_stays_positive_definite_far_from_the_origin_and_for_standing_objects() {
    stays_sound::<State>(&[Class::TrafficCone, Class::Adult, Class::Unknown], 9e7);
}

#[test]
fn the_interacting_models_stay_positive_definite_over_a_million_updates() {
    stays_sound::<ImmState>(&[Class::Car, Class::Adult, Class::TrafficCone, Class::Unknown], 0.0);
}
