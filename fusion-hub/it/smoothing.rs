//! Smoothing reduces the error, with a consistent covariance: filtered and smoothed states of the same runs
//! against the truth.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::fused::KINEMATIC_INDEX;
use v2x_common::geometry::angle_difference;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::filter::size_priors::SizePriors;
use v2x_fusion_hub::filter::{Estimate, Filter, ImmState, MotionParams, State};
use v2x_fusion_hub::values::Measurement;

const RUNS: u32 = 1000;
/// Reports before the smoothed state, and after it.
const BEFORE: usize = 12;
const AFTER: usize = 10;
const STEP: Span = Span::from_millis(100);
const SIGMA_M: f64 = 0.5;
const SIGMA_YAW: f64 = 0.05;

/// A standard normal draw (Box & Muller 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let mut unit = || (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0;
    let (u, v) = (unit(), unit());
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(2.0 * std::f64::consts::PI * v)
}

#[derive(Clone, Copy, Debug)]
struct Truth {
    position: [f64; 2],
    velocity: [f64; 2],
    yaw: f64,
}

impl Truth {
    fn measured(&self, rng: &mut ChaCha8Rng) -> Measurement {
        let position = self.position.map(|at| at + SIGMA_M * normal(rng));
        Measurement {
            class: Class::Car,
            position,
            r: Covariance2::isotropic(SIGMA_M),
            size: [1.8, 4.5],
            relative_variance: [0.04; 2],
            yaw: self.yaw + SIGMA_YAW * normal(rng),
            yaw_variance: SIGMA_YAW * SIGMA_YAW,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        }
    }
}

/// Sums over runs of squared position errors (m²) and of normalised squared errors.
#[derive(Debug, Default)]
struct Sums {
    squared_m2: f64,
    kinematic: f64,
    position: f64,
    heading: f64,
}

impl Sums {
    fn add(&mut self, estimate: &Estimate, truth: &Truth) {
        use nalgebra::{Matrix4, Vector4};
        let mut covariance = Matrix4::zeros();
        for (value, (row, column)) in estimate.covariance.into_iter().zip(KINEMATIC_INDEX) {
            covariance[(row, column)] = value;
            covariance[(column, row)] = value;
        }
        let [x, y] = std::array::from_fn(|axis| estimate.position[axis] - truth.position[axis]);
        let [vx, vy] = std::array::from_fn(|axis| estimate.velocity[axis] - truth.velocity[axis]);
        let error = Vector4::new(x, y, vx, vy);
        let turn = angle_difference(estimate.heading.mean, truth.yaw);
        let position = covariance.fixed_view::<2, 2>(0, 0).into_owned();
        self.squared_m2 += x * x + y * y;
        self.kinematic += error.dot(&covariance.cholesky().expect("positive definite").solve(&error));
        let error = error.fixed_rows::<2>(0).into_owned();
        self.position += error.dot(&position.cholesky().expect("positive definite").solve(&error));
        self.heading += turn * turn / estimate.heading.variance;
    }
}

/// Filtered and smoothed, of runs whose truth `drive` makes.
fn both<F: Filter>(seed: u64, drive: impl Fn(&mut ChaCha8Rng) -> Vec<Truth>) -> [Sums; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut filtered, mut smoothed) = (Sums::default(), Sums::default());
    let estimate = |state: &F| state.estimate(Class::Car, &SizePriors::default().of_track(None));
    for _ in 0..RUNS {
        let truth = drive(&mut rng);
        let mut at = Timestamp::EPOCH;
        let mut states = vec![F::initial(at, &truth[0].measured(&mut rng))];
        for (place, truth) in truth.iter().enumerate().skip(1) {
            at += STEP;
            let mut state = states[place - 1].predicted(at, Class::Car);
            state.update(&truth.measured(&mut rng));
            states.push(state);
        }
        filtered.add(&estimate(&states[BEFORE]), &truth[BEFORE]);
        let last = states[BEFORE + AFTER];
        let back = states[BEFORE..BEFORE + AFTER].iter().rev();
        let state = back.fold(last, |later, state| state.smoothed(Class::Car, &later));
        assert_eq!(state.at(), states[BEFORE].at());
        smoothed.add(&estimate(&state), &truth[BEFORE]);
    }
    [filtered, smoothed]
}

/// The constant-velocity model's own: white acceleration, a random-walk heading.
fn model_drive(rng: &mut ChaCha8Rng) -> Vec<Truth> {
    let motion = MotionParams::of(Class::Car);
    let dt = STEP.as_secs_f64();
    let velocity = [normal(rng), normal(rng)].map(|draw| draw * motion.sigma_velocity_mps);
    let mut truth = Truth { position: [100.0, -50.0], velocity, yaw: 3.1 };
    let mut all = vec![truth];
    for _ in 0..BEFORE + AFTER {
        for axis in 0..2 {
            let (a, b) = (normal(rng), normal(rng));
            let velocity_noise = libm::sqrt(motion.accel_psd * dt) * a;
            let position_noise = dt * (velocity_noise / 2.0 + libm::sqrt(motion.accel_psd * dt / 12.0) * b);
            truth.position[axis] += dt * truth.velocity[axis] + position_noise;
            truth.velocity[axis] += velocity_noise;
        }
        truth.yaw += libm::sqrt(motion.yaw_diffusion * dt) * normal(rng);
        all.push(truth);
    }
    all
}

/// A body on a circle, or that stands.
fn steady_drive(speed: f64, turn_rate: f64) -> impl Fn(&mut ChaCha8Rng) -> Vec<Truth> {
    move |rng| {
        let heading = 2.0 * normal(rng);
        let mut position = [10.0, 20.0];
        let steps = 0..=u32::try_from(BEFORE + AFTER).expect("few");
        let dt = STEP.as_secs_f64();
        steps
            .map(|step| {
                let yaw = heading + turn_rate * dt * f64::from(step);
                let velocity = [speed * libm::cos(yaw), speed * libm::sin(yaw)];
                let truth = Truth { position, velocity, yaw };
                let half_way = yaw + turn_rate * dt / 2.0;
                position[0] += dt * speed * libm::cos(half_way);
                position[1] += dt * speed * libm::sin(half_way);
                truth
            })
            .collect()
    }
}

#[test]
fn under_its_own_model_the_smoothed_nees_follows_its_chi_squared_distribution() {
    let [filtered, smoothed] = both::<State>(20_261_122, model_drive);
    // Sums of χ² with 4 · 1000 and 1000 degrees of freedom: the central 95 %.
    assert!((3826.6..=4177.2).contains(&smoothed.kinematic), "{smoothed:?}");
    assert!((914.3..=1089.5).contains(&smoothed.heading), "{smoothed:?}");
    // Of 1000 runs each, so the ratio is known to some 4 %.
    assert!(smoothed.squared_m2 < 0.45 * filtered.squared_m2, "{smoothed:?} {filtered:?}");
}

#[test]
fn smoothing_the_interacting_models_reduces_the_error_with_a_consistent_covariance() {
    for (seed, speed, turn_rate) in
        [(1, 0.0, 0.0), (2, 8.0, 0.0), (3, 8.0, 0.3), (4, 14.0, -0.2), (5, 1.0, 0.0)]
    {
        let [filtered, smoothed] = both::<ImmState>(seed, steady_drive(speed, turn_rate));
        let gain = smoothed.squared_m2 / filtered.squared_m2;
        let nees = smoothed.position / f64::from(2 * RUNS);
        // Of 1000 runs each, so these are known to some 4 %; measured: 0.14 to 0.56.
        assert!(gain < 0.65, "{speed} m/s, {turn_rate} rad/s: {smoothed:?} {filtered:?}");
        // Below 1: these keep speed and turn rate better than the models assume.
        assert!((0.4..1.1).contains(&nees), "{speed} m/s, {turn_rate} rad/s: {smoothed:?}");
        let nees_heading = smoothed.heading / f64::from(RUNS);
        assert!((0.25..1.2).contains(&nees_heading), "{speed} m/s, {turn_rate} rad/s: {smoothed:?}");
    }
}
