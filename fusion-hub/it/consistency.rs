//! Consistent covariance: with truth and noise drawn from the filter's own model, the normalised estimation error
//! squared follows its χ² distribution (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::angle_difference;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::filter::{Filter, MotionParams, State};
use v2x_fusion_hub::values::Measurement;

const RUNS: u32 = 2000;
const STEPS: u32 = 15;

/// A standard normal draw (Box & Muller 1958).
pub(super) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let mut unit = || (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0;
    let (u, v) = (unit(), unit());
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(2.0 * std::f64::consts::PI * v)
}

/// The truth: x, y, vx, vy and the heading.
struct Truth {
    position: [f64; 2],
    velocity: [f64; 2],
    yaw: f64,
}

impl Truth {
    fn drawn(motion: &MotionParams, rng: &mut ChaCha8Rng) -> Self {
        let velocity = [normal(rng), normal(rng)].map(|draw| draw * motion.sigma_velocity_mps);
        Self { position: [100.0, -50.0], velocity, yaw: 3.0 }
    }

    /// One step of the constant-velocity model with white acceleration, exactly: velocity and position noise
    /// have covariance q·[[T³/3, T²/2], [T²/2, T]].
    fn advance(&mut self, dt: f64, motion: &MotionParams, rng: &mut ChaCha8Rng) {
        for axis in 0..2 {
            let (a, b) = (normal(rng), normal(rng));
            let velocity_noise = libm::sqrt(motion.accel_psd * dt) * a;
            let position_noise = dt * (velocity_noise / 2.0 + libm::sqrt(motion.accel_psd * dt / 12.0) * b);
            self.position[axis] += dt * self.velocity[axis] + position_noise;
            self.velocity[axis] += velocity_noise;
        }
        self.yaw += libm::sqrt(motion.yaw_diffusion * dt) * normal(rng);
    }

    fn measured(&self, rng: &mut ChaCha8Rng) -> Measurement {
        let r = Covariance2 { xx: 0.25, xy: 0.12, yy: 0.16 };
        let (a, b) = (normal(rng), normal(rng));
        let dx = 0.5 * a;
        let dy = 0.12 / 0.5 * a + libm::sqrt(0.16 - 0.12 * 0.12 / 0.25) * b;
        Measurement {
            class: Class::Car,
            position: [self.position[0] + dx, self.position[1] + dy],
            r,
            size: [1.8, 4.5],
            relative_variance: [0.04, 0.04],
            yaw: self.yaw + 0.1 * normal(rng),
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        }
    }
}

/// Squared error of (x, y, vx, vy) and of the heading, each over its covariance.
fn nees(state: &State, truth: &Truth) -> (f64, f64) {
    use nalgebra::{Matrix4, Vector4};
    let mut covariance = Matrix4::zeros();
    for (value, (row, column)) in
        state.kinematic.covariance().into_iter().zip(v2x_common::fused::KINEMATIC_INDEX)
    {
        covariance[(row, column)] = value;
        covariance[(column, row)] = value;
    }
    let error = Vector4::new(
        state.kinematic.position[0] - truth.position[0],
        state.kinematic.position[1] - truth.position[1],
        state.kinematic.velocity[0] - truth.velocity[0],
        state.kinematic.velocity[1] - truth.velocity[1],
    );
    let solved = covariance.cholesky().expect("positive definite").solve(&error);
    let turn = angle_difference(state.heading.mean, truth.yaw);
    (error.dot(&solved), turn * turn / state.heading.variance)
}

#[test]
fn the_nees_follows_its_chi_squared_distribution() {
    let motion = MotionParams::of(Class::Car);
    let mut rng = ChaCha8Rng::seed_from_u64(20_261_122);
    let (mut kinematic, mut heading) = (0.0, 0.0);
    for _ in 0..RUNS {
        let mut truth = Truth::drawn(&motion, &mut rng);
        let mut at = Timestamp::EPOCH;
        let mut state = State::initial(at, &truth.measured(&mut rng));
        for step in 0..STEPS {
            let dt = Span::from_millis(if step % 3 == 0 { 40 } else { 110 });
            at += dt;
            truth.advance(dt.as_secs_f64(), &motion, &mut rng);
            state.predict(at, Class::Car);
            state.update(&truth.measured(&mut rng));
        }
        let (of_kinematic, of_heading) = nees(&state, &truth);
        kinematic += of_kinematic;
        heading += of_heading;
    }
    // Sums of χ² with 4 · 2000 and 2000 degrees of freedom: the central 95 %.
    assert!((7753.9..=8249.8).contains(&kinematic), "position and velocity: {kinematic}");
    assert!((1877.9..=2125.8).contains(&heading), "heading: {heading}");
}

#[test]
fn the_nis_of_an_agent_that_states_half_its_error_is_larger() {
    let (consistent, overconfident) = nis_of_correct_and_biased(false);
    // Below 1: these cars keep their speed better than the model assumes.
    assert!((0.5..1.2).contains(&consistent), "{consistent}");
    assert!(overconfident > 1.8 * consistent, "{overconfident} against {consistent}");
}

#[test]
fn an_accuracy_that_is_false_by_a_factor_is_learnt() {
    let (_, without) = nis_of_correct_and_biased(false);
    let (consistent, learnt) = nis_of_correct_and_biased(true);
    assert!((0.5..1.2).contains(&consistent), "{consistent}");
    assert!(learnt < 0.75 * without, "{learnt} with learning, {without} without");
}

/// NIS per degree of freedom of an agent that states its accuracy, and of one that states half its error.
fn nis_of_correct_and_biased(learning: bool) -> (f64, f64) {
    use crate::world::{SIGMA_M, agent, at, config, detection, frame};
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut engine = Engine::new(config().with_tracking(|tracking| tracking.learning = learning));
    for k in 0..400_u32 {
        let ms = 50 * i64::from(k);
        for (name, true_sigma) in [("correct", SIGMA_M), ("biased", 2.0 * SIGMA_M)] {
            let errors = [0, 1, 2]
                .map(|object| (object, (true_sigma * normal(&mut rng), true_sigma * normal(&mut rng))));
            let detections = errors.map(|(object, error)| detection(object, at(ms), error)).to_vec();
            engine.handle_frame(&frame(agent(name), u64::from(k), ms, detections), at(ms));
        }
    }
    let nis = |name| engine.agents().record(&agent(name)).and_then(|record| record.statistics.nis_per_dof());
    (nis("correct").expect("measured"), nis("biased").expect("measured"))
}
