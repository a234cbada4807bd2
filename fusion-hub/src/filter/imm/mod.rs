//! Interacting multiple models: parked, stopped, smooth and manoeuvring, of one object.
//!
//! State (x, y, θ, v, ω): centre, heading, speed along it, turn rate. Mixing and mode probabilities are
//! those of Bar-Shalom, Li & Kirubarajan 2001, section 11.6.6; everything is continuous in time, so that
//! steps of 10 ms and of 0.5 s describe the same object. The parameters are those of deploy/docs/methods.md.

mod displacement;
mod gaussian;
mod lanes;
mod likelihood;
mod many;
mod mixing;
mod model;
mod motion;
mod output;
mod params;
mod passage;
mod smoothing;
mod transitions;
mod velocity;

pub(in crate::filter) use many::{Move, is_plain, moments_of_all, places_of, predict_some, update_some};
pub use output::{Moments, Place};

use crate::values::{Measurement, PositionInnovation, Real};
use gaussian::{Full, PoseReport, Smooth, Still};
use likelihood::{Likelihood, Symmetric, nearest};
use model::{MANOEUVRE, PARKED, SMOOTH, STOPPED};
use motion::Step;
use output::Kinematic;
use params::Params;
use passage::Passage;
use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::wrap_angle;

/// A model less probable than this after an update gets probability 0, until a transition from another one.
const NEGLIGIBLE: f64 = 1e-12;

/// Factors on covariances before they are combined, for covariance intersection (Julier & Uhlmann 1997).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inflation {
    /// On the track's own covariances.
    pub prior: f64,
    /// On the report's.
    pub report: f64,
}

impl Inflation {
    /// Track and report are independent: the Kalman update.
    pub const NONE: Self = Self { prior: 1.0, report: 1.0 };
}

/// One object under four models of motion; or several, one in each lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Imm<R = f64> {
    weights: [R; 4],
    parked: Still<R>,
    stopped: Still<R>,
    smooth: Smooth<R>,
    manoeuvre: Full<R>,
    /// The centre lies this far ahead of the point that follows the heading, m.
    lever_m: R,
}

impl Imm {
    /// The state after a first measurement; the class gives what was not measured.
    pub fn initial(z: &Measurement) -> Self {
        let params = Params::of(z.class);
        let birth = params.birth;
        let yaw = wrap_angle(z.yaw);
        let pose = Still {
            mean: [z.position[0], z.position[1], yaw],
            covariance: [z.r.xx, z.r.xy, z.r.yy, 0.0, 0.0, z.yaw_variance],
        };
        let mut initial = Self {
            weights: birth.weights,
            parked: pose,
            stopped: pose,
            smooth: pose.with_motion(&birth.motion).narrowed(),
            manoeuvre: pose.with_motion(&birth.unusual),
            lever_m: params.lever * z.size[1],
        };
        if z.velocity.is_some() {
            let mut likelihoods = [Likelihood::CERTAIN; 4];
            initial.update_velocity(z, 1.0, &mut likelihoods);
            initial.weigh(&likelihoods);
        }
        initial
    }

    /// Moves the state by `dt_s` seconds, also backwards; an object of `length_m` turns about its rear axle.
    ///
    /// Uncertainty and changes of model grow with the length of the step in either direction.
    pub fn predict(&mut self, dt_s: f64, class: Class, length_m: f64) {
        if dt_s == 0.0 {
            return;
        }
        let passage = Passage::of(dt_s, class, length_m);
        for _ in 0..passage.n_steps {
            self.pass(&passage);
        }
    }

    /// Updates by a measurement made at the state's time; returns the innovation.
    pub fn update(&mut self, z: &Measurement, inflation: Inflation) -> PositionInnovation {
        if inflation.prior != 1.0 {
            self.inflate(inflation.prior);
        }
        let r = Symmetric::from(z.r).scaled(inflation.report);
        let innovation = self.innovation(z.position, &r.into());
        let yaw_variance = z.yaw_variance * inflation.report;
        let mut likelihoods =
            self.update_pose(&PoseReport { position: z.position, r, yaw: wrap_angle(z.yaw), yaw_variance });
        self.update_velocity(z, inflation.report, &mut likelihoods);
        if inflation != Inflation::NONE && z.velocity.is_none() {
            // Positions with dependent errors are evidence by their distances alone. By the determinants, which do not
            // shrink, the narrower models would win at high rates; without any evidence the weights of birth would stay.
            likelihoods.iter_mut().for_each(|likelihood| likelihood.determinant = 1.0);
        }
        self.settle(&likelihoods);
        innovation
    }

    fn inflate(&mut self, factor: f64) {
        self.parked.inflate(factor);
        self.stopped.inflate(factor);
        self.smooth.inflate(factor);
        self.manoeuvre.inflate(factor);
    }

    fn update_velocity(&mut self, z: &Measurement, factor: f64, likelihoods: &mut [Likelihood; 4]) {
        let Some(report) = z.velocity else { return };
        let r = Symmetric::from(report.covariance).scaled(factor);
        let value = [report.x, report.y];
        let mut smooth = self.smooth.with_turn(0.0);
        let still = velocity::still_velocity(value, &r);
        likelihoods[PARKED].also(still);
        likelihoods[STOPPED].also(still);
        likelihoods[SMOOTH].also(velocity::update_velocity(&mut smooth, self.lever_m, value, &r));
        likelihoods[MANOEUVRE].also(velocity::update_velocity(&mut self.manoeuvre, self.lever_m, value, &r));
        self.smooth = smooth.narrowed();
    }

    /// The innovation of a position with covariance `r` (m²), without an update: by the mixture's mean
    /// and covariance.
    pub fn innovation(&self, z: [f64; 2], r: &Covariance2) -> PositionInnovation {
        let Place { position: [x, y], position_covariance, .. } = self.place();
        let s = Symmetric::from(position_covariance).plus(&Symmetric::from(*r));
        PositionInnovation::new([z[0] - x, z[1] - y], &s.into())
    }

    /// The manoeuvring model's position (m) and its larger standard deviation along an axis (m): the widest.
    pub fn neighbourhood(&self) -> ([f64; 2], f64) {
        let [x, y, ..] = self.manoeuvre.mean;
        ([x, y], Covariance2::from(self.manoeuvre.position_covariance()).max_sigma())
    }

    /// The variances of the position along both axes together, m²: the mean of the models.
    pub fn position_variance(&self) -> f64 {
        let variance = |covariance: Symmetric| {
            let Covariance2 { xx, yy, .. } = covariance.into();
            xx + yy
        };
        let [parked, stopped, smooth, manoeuvre] = self.weights;
        parked * variance(self.parked.position_covariance())
            + stopped * variance(self.stopped.position_covariance())
            + smooth * variance(self.smooth.position_covariance())
            + manoeuvre * variance(self.manoeuvre.position_covariance())
    }

    /// Position and heading, all models together.
    pub fn place(&self) -> Place {
        output::place(&self.places()).into()
    }

    /// Heading of the likeliest model (rad), and its variance (rad²).
    pub fn heading(&self) -> (f64, f64) {
        match output::likeliest(&self.weights) {
            PARKED => self.parked.heading(),
            STOPPED => self.stopped.heading(),
            SMOOTH => self.smooth.heading(),
            _ => self.manoeuvre.heading(),
        }
    }

    /// Turns the object round: the front is at the other end, and it moves backwards if it moved forwards.
    pub fn turn_round(&mut self) {
        self.parked.turn_round();
        self.stopped.turn_round();
        self.smooth.turn_round();
        self.manoeuvre.turn_round();
    }

    /// Sets the position with its covariance (m, m²).
    pub fn move_to(&mut self, position: [f64; 2], covariance: &Covariance2) {
        self.parked.move_to(position, covariance);
        self.stopped.move_to(position, covariance);
        self.smooth.move_to(position, covariance);
        self.manoeuvre.move_to(position, covariance);
    }

    /// Adds a variance (m²) to the position along each axis.
    pub fn widen_position(&mut self, variance: f64) {
        self.parked.widen_position(variance);
        self.stopped.widen_position(variance);
        self.smooth.widen_position(variance);
        self.manoeuvre.widen_position(variance);
    }

    /// Sets the heading (rad) with its variance (rad²); what is correlated with it is not any more.
    pub fn turn_to(&mut self, yaw: f64, variance: f64) {
        self.parked.turn_to(yaw, variance);
        self.stopped.turn_to(yaw, variance);
        self.smooth.turn_to(yaw, variance);
        self.manoeuvre.turn_to(yaw, variance);
    }

    /// Sets heading and speed to a course, and takes it for moving: half smooth, half manoeuvring.
    pub fn redirect(&mut self, course: &super::Course) {
        self.parked.redirect(course);
        self.stopped.redirect(course);
        self.smooth.redirect(course);
        self.manoeuvre.redirect(course);
        self.weights = [0.0, 0.0, 0.5, 0.5];
    }

    /// Probabilities of being parked, stopped, in smooth motion and manoeuvring; they sum to 1.
    pub fn model_probabilities(&self) -> [f64; 4] {
        self.weights
    }

    /// Mean and covariance of position, velocity and heading, all models together.
    pub fn moments(&self) -> Moments {
        output::moments(&self.kinematics(), &self.places())
    }

    /// Mean of the turn rate, all models together, rad/s.
    #[inline]
    pub fn turn_rate(&self) -> f64 {
        // Only the manoeuvring model turns.
        self.weights[MANOEUVRE] * self.manoeuvre.mean[gaussian::TURN]
    }

    /// Mean and covariance of the velocity and of the turn rate, all models together.
    pub fn motion(&self) -> super::Motion {
        let Moments { velocity, covariance, .. } = self.moments();
        let [_, _, x_vx, x_vy, _, y_vx, y_vy, vxx, vxy, vyy] = covariance;
        let (share, rate) = (self.weights[MANOEUVRE], self.manoeuvre.mean[gaussian::TURN]);
        let spread = self.manoeuvre.covariance[gaussian::at(gaussian::TURN, gaussian::TURN)];
        super::Motion {
            velocity,
            covariance: Covariance2 { xx: vxx, xy: vxy, yy: vyy },
            with_position: Covariance2 { xx: x_vx, xy: (x_vy + y_vx) / 2.0, yy: y_vy },
            turn_rate: self.turn_rate(),
            turn_rate_variance: share * (spread + (1.0 - share) * rate * rate),
        }
    }
}

/// What one object and several have in common: outputs, update and prediction.
impl<R: Real> Imm<R> {
    #[inline(always)]
    fn places(&self) -> [(R, Still<R>); 4] {
        let [parked, stopped, smooth, manoeuvre] = self.weights;
        [
            (parked, self.parked),
            (stopped, self.stopped),
            (smooth, self.smooth.narrowed()),
            (manoeuvre, self.manoeuvre.narrowed()),
        ]
    }

    #[inline(always)]
    fn kinematics(&self) -> [Kinematic<R>; 4] {
        [
            Kinematic::standing(&self.parked),
            Kinematic::standing(&self.stopped),
            Kinematic::moving(&self.smooth.with_turn(0.0), self.lever_m),
            Kinematic::moving(&self.manoeuvre, self.lever_m),
        ]
    }

    /// Updates each model by a position and a heading.
    #[inline(always)]
    fn update_pose(&mut self, z: &PoseReport<R>) -> [Likelihood<R>; 4] {
        [
            self.parked.update_pose(z),
            self.stopped.update_pose(z),
            self.smooth.update_pose(z),
            self.manoeuvre.update_pose(z),
        ]
    }

    /// After an update of each model.
    #[inline(always)]
    fn settle(&mut self, likelihoods: &[Likelihood<R>; 4]) {
        self.smooth.limit();
        self.manoeuvre.limit();
        self.weigh(likelihoods);
    }

    /// Bayes' rule over the models.
    #[inline(always)]
    fn weigh(&mut self, likelihoods: &[Likelihood<R>; 4]) {
        let nearest = nearest(&self.weights, likelihoods);
        let zero = nearest.same(0.0);
        let mut posterior = self.weights;
        let mut sum = zero;
        for (weight, likelihood) in posterior.iter_mut().zip(likelihoods) {
            if R::all(weight.is_at_most(zero)) {
                continue;
            }
            let weighed = *weight * likelihood.relative_to(nearest);
            *weight = R::choose(zero.is_below(*weight), weighed, *weight);
            sum += *weight;
        }
        let negligible = sum * NEGLIGIBLE;
        let mut kept = zero;
        for weight in &mut posterior {
            *weight = R::choose(negligible.is_below(*weight), *weight, zero);
            kept += *weight;
        }
        for (weight, posterior) in self.weights.iter_mut().zip(posterior) {
            *weight = posterior / kept;
        }
    }

    #[inline(always)]
    fn pass(&mut self, passage: &Passage<R>) {
        let Passage { step, transitions, params, .. } = passage;
        self.lever_m = step.lever_m;
        if let Some(transitions) = transitions {
            self.mix(transitions, params);
        }
        self.advance(step, params);
    }

    #[inline(always)]
    fn mix(&mut self, transitions: &[[R; 4]; 4], params: &Params) {
        let sources = self.sources(params);
        let zero = self.lever_m.same(0.0);
        let mut into = [[zero; 4]; 4];
        let mut predicted = [zero; 4];
        for (from, weight) in self.weights.into_iter().enumerate() {
            for (to, probability) in transitions[from].into_iter().enumerate() {
                into[to][from] = weight * probability;
                predicted[to] += into[to][from];
            }
        }
        // Nothing returns to the parked model: it needs no mixing.
        self.stopped = mixing::mixed(&sources, STOPPED, &into[STOPPED], &self.stopped);
        self.smooth = mixing::mixed(&sources, SMOOTH, &into[SMOOTH], &self.smooth);
        self.manoeuvre = mixing::mixed(&sources, MANOEUVRE, &into[MANOEUVRE], &self.manoeuvre);
        self.weights = predicted;
    }

    /// Every model as one that is about to become another.
    #[inline(always)]
    fn sources(&self, params: &Params) -> [Full<R>; 4] {
        [
            self.parked.with_motion(&params.start),
            self.stopped.with_motion(&params.start),
            self.smooth.with_turn(params.smooth.turn_variance),
            self.manoeuvre,
        ]
    }

    #[inline(always)]
    fn advance(&mut self, step: &Step<R>, params: &Params) {
        for still in [&mut self.parked, &mut self.stopped] {
            params.still.diffuse(still, step.duration_s);
        }
        let zero = self.lever_m.same(0.0);
        // A model of weight 0 keeps its state.
        let has_none = |weight: R| weight.is_at_most(zero);
        let of_smooth = has_none(self.weights[SMOOTH]);
        if !R::all(of_smooth) {
            let moved = motion::moved(&self.smooth.with_turn(0.0), step, &params.smooth).narrowed();
            self.smooth = moved.unless(of_smooth, &self.smooth);
        }
        let of_manoeuvre = has_none(self.weights[MANOEUVRE]);
        if !R::all(of_manoeuvre) {
            let moved = motion::moved(&self.manoeuvre, step, &params.manoeuvre);
            self.manoeuvre = moved.unless(of_manoeuvre, &self.manoeuvre);
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    [params::listed(), transitions::listed()].concat()
}

#[cfg(test)]
mod tests;
