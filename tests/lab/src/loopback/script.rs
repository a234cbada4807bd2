//! Scripts of agents: actors that stand or move in a straight line, and detections of them with noise. No I/O.

use std::time::Duration;
use v2x_agent::random::{Purpose, keyed_rng, standard_normal, truncated_normal};
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Smallest reported σ, m and rad: with σ = 0, the hub would use one agent only.
const MIN_SIGMA: f64 = 0.01;

/// An object of the typical size of its class. It stands or moves in a straight line from the start of the network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actor {
    class: Class,
    from: Pose,
    velocity_mps: (f64, f64),
}

impl Actor {
    /// A standing actor at this position (m, map frame), heading east.
    pub const fn new(class: Class, x: f64, y: f64) -> Self {
        Self { class, from: Pose { x, y, yaw: 0.0 }, velocity_mps: (0.0, 0.0) }
    }

    /// A car at this position (m, map frame) at the start of the network.
    pub const fn car(x: f64, y: f64) -> Self {
        Self::new(Class::Car, x, y)
    }

    /// A pedestrian at this position (m, map frame) at the start of the network.
    pub const fn pedestrian(x: f64, y: f64) -> Self {
        Self::new(Class::Adult, x, y)
    }

    /// Sets the velocity east and north, m/s, and the heading to its direction.
    #[must_use]
    pub fn driving(mut self, vx: f64, vy: f64) -> Self {
        self.velocity_mps = (vx, vy);
        self.facing(libm::atan2(vy, vx))
    }

    /// Sets the heading, rad, counter-clockwise from east.
    #[must_use]
    pub fn facing(mut self, yaw: f64) -> Self {
        self.from.yaw = wrap_angle(yaw);
        self
    }

    /// Class of the actor.
    pub const fn class(&self) -> Class {
        self.class
    }

    /// The true state at a time after the start of the network.
    pub fn bev_at(&self, since_start: Span) -> BevBox {
        let t = since_start.as_secs_f64();
        let (vx, vy) = self.velocity_mps;
        let (w, d) = self.class.typical_size();
        BevBox { x: self.from.x + vx * t, y: self.from.y + vy * t, w, d, yaw: self.from.yaw }
    }

    /// A detection without error, with the σ of this noise. Change it as needed and send it with [`super::Agent::send`].
    pub fn detection(&self, since_start: Span, noise: Noise) -> Detection {
        Detection {
            class: self.class,
            score: 1.0,
            bev: self.bev_at(since_start),
            covariance: noise.covariance(),
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        }
    }
}

/// Errors of detections: σ of normal distributions. The reported σ is the same, but at least 0.01.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Position, along each axis, m.
    pub position_m: f64,
    /// Width and depth, m.
    pub size_m: f64,
    /// Heading, rad.
    pub yaw_rad: f64,
}

impl Default for Noise {
    /// A typical camera: 0.3 m, 0.1 m, 0.05 rad.
    fn default() -> Self {
        Self { position_m: 0.3, size_m: 0.1, yaw_rad: 0.05 }
    }
}

/// The periodic detections of an agent.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    every: Span,
    noise: Noise,
    actors: Vec<Actor>,
}

impl Script {
    /// A script with this period and without actors.
    pub fn every(interval: Duration) -> Self {
        let nanos = i64::try_from(interval.as_nanos()).unwrap_or(i64::MAX);
        // A shorter period would send frames without a pause.
        let every = Span::from_nanos(nanos).max(Span::from_millis(1));
        Self { every, noise: Noise::default(), actors: Vec::new() }
    }

    /// Adds actors.
    #[must_use]
    pub fn of(mut self, actors: impl IntoIterator<Item = Actor>) -> Self {
        self.actors.extend(actors);
        self
    }

    /// Sets the noise.
    #[must_use]
    pub const fn with_noise(mut self, noise: Noise) -> Self {
        self.noise = noise;
        self
    }

    /// Capture time of frame `number`, if the first one is captured at `begun_at`.
    pub fn capture_time(&self, begun_at: Timestamp, number: u64) -> Timestamp {
        let number = i64::try_from(number).unwrap_or(i64::MAX);
        begun_at + Span::from_nanos(self.every.as_nanos().saturating_mul(number))
    }

    /// The detections of frame `number`, captured at a time after the start of the network. The noise of an actor
    /// depends on (seed, agent, number) only, not on other actors.
    pub fn detections(
        &self,
        (seed, agent): (u64, &AgentId),
        number: u64,
        since_start: Span,
    ) -> Vec<Detection> {
        let objects = (0..).map(ObjectId).zip(&self.actors);
        let reports = objects.map(|(object, actor)| {
            let mut rng = keyed_rng(seed, Some(agent), number, Purpose::Measurement(object));
            let Noise { position_m, size_m, yaw_rad } = self.noise;
            let mut seen = actor.detection(since_start, self.noise);
            let BevBox { x, y, w, d, yaw } = seen.bev;
            let within = (MIN_SIZE_M, MAX_SIZE_M);
            seen.bev = BevBox {
                x: x + position_m * standard_normal(&mut rng),
                y: y + position_m * standard_normal(&mut rng),
                w: truncated_normal(&mut rng, w, size_m, within),
                d: truncated_normal(&mut rng, d, size_m, within),
                yaw: wrap_angle(yaw + yaw_rad * standard_normal(&mut rng)),
            };
            seen
        });
        reports.collect()
    }
}

impl Noise {
    /// The detection of an actor with noise.
    fn covariance(&self) -> BoxCovariance {
        let [position, size, yaw] =
            [self.position_m, self.size_m, self.yaw_rad].map(|sigma| sigma.max(MIN_SIGMA));
        let (ww, dd) = (size * size, size * size);
        BoxCovariance { position: Covariance2::isotropic(position), ww, dd, yaw: yaw * yaw }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: u64 = 2000;

    fn camera() -> AgentId {
        AgentId::new("camera").unwrap()
    }

    #[test]
    fn an_actor_moves_in_a_straight_line_and_heads_along_it() {
        let car = Actor::car(1.0, 2.0).driving(0.0, 10.0);
        let bev = car.bev_at(Span::from_millis(1500));
        assert!((bev.x - 1.0).abs() < 1e-12 && (bev.y - 17.0).abs() < 1e-12, "{bev:?}");
        assert!((bev.yaw - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{bev:?}");
        assert_eq!((bev.w, bev.d), Class::Car.typical_size());
    }

    #[test]
    fn errors_of_detections_have_the_reported_deviations() {
        let noise = Noise { position_m: 0.5, size_m: 0.2, yaw_rad: 0.1 };
        let script = Script::every(Duration::from_millis(100)).of([Actor::car(3.0, 4.0)]).with_noise(noise);
        let mut squares = [0.0; 3];
        for number in 0..NUMBERS {
            let seen = script.detections((7, &camera()), number, Span::ZERO);
            let [seen] = seen[..] else { panic!("one actor, not {seen:?}") };
            seen.validate(None).unwrap();
            assert_eq!(seen.covariance.position, Covariance2::isotropic(0.5));
            let (dx, dw) = (seen.bev.x - 3.0, seen.bev.w - Class::Car.typical_size().0);
            for (sum, error) in squares.iter_mut().zip([dx, dw, seen.bev.yaw]) {
                *sum += error * error;
            }
        }
        // The standard error of a σ from 2000 draws is 1.6 %; the tolerance is five standard errors.
        for (sum, sigma) in squares.into_iter().zip([0.5, 0.2, 0.1]) {
            let found = (sum / NUMBERS as f64).sqrt();
            assert!((found / sigma - 1.0).abs() < 0.08, "{found} for {sigma}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_noise_whatever_other_actors_there_are() {
        let script = Script::every(Duration::from_millis(100)).of([Actor::car(3.0, 4.0)]);
        let more = script.clone().of([Actor::pedestrian(0.0, 0.0)]);
        let seen = |script: &Script, seed| script.detections((seed, &camera()), 5, Span::ZERO);
        assert_eq!(seen(&script, 1)[0], seen(&more, 1)[0]);
        assert_ne!(seen(&script, 1)[0], seen(&script, 2)[0]);
    }
}
