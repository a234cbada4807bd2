//! Traffic on rings and straights, detected by agents with clock and pose errors, with the ground truth.

use crate::world::{agent, config, description};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::Accuracy;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::registration::{AgentRegistration, Bias, Registration};

/// What a vehicle declares: 0.5 m, 0.5°, 50 ms.
pub(super) const VEHICLE: Accuracy = Accuracy { position_m: 0.5, yaw_rad: 0.5 * DEGREE, clock_s: 0.05 };
/// What a surveyed roadside unit declares: 0.02 m, 0.02°, 1 µs.
pub(super) const SURVEYED: Accuracy = Accuracy { position_m: 0.02, yaw_rad: 0.02 * DEGREE, clock_s: 1e-6 };
pub(super) const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Every agent sends ten frames a second.
const PERIOD_MS: i64 = 100;
/// From the capture of a frame to its arrival, usually.
const DELAY_MS: i64 = 40;
const EPOCH_MS: i64 = 1_000_000;

/// A path on which something moves.
#[derive(Clone, Copy, Debug)]
pub(super) enum Path {
    /// Round a circle about the origin: radius (m), phase (rad), speed (m/s, negative: clockwise).
    Ring { radius_m: f64, phase: f64, speed_mps: f64 },
    /// Along a straight from a point, back again at its end: start, heading and speed.
    Straight { start: [f64; 2], yaw: f64, speed_mps: f64 },
    /// A fixed pose.
    Fixed([f64; 2]),
}

impl Path {
    pub(super) fn at(&self, t: f64) -> Pose {
        match *self {
            Self::Ring { radius_m, phase, speed_mps } => {
                let angle = phase + speed_mps * t / radius_m;
                let (sin, cos) = libm::sincos(angle);
                let side = std::f64::consts::FRAC_PI_2.copysign(speed_mps);
                Pose { x: radius_m * cos, y: radius_m * sin, yaw: wrap_angle(angle + side) }
            }
            Self::Straight { start: [x, y], yaw, speed_mps } => {
                let (sin, cos) = libm::sincos(yaw);
                Pose { x: x + speed_mps * t * cos, y: y + speed_mps * t * sin, yaw }
            }
            Self::Fixed([x, y]) => Pose { x, y, yaw: 0.3 },
        }
    }
}

/// An agent, and its errors.
#[derive(Clone, Debug)]
pub(super) struct Observer {
    pub(super) name: &'static str,
    pub(super) accuracy: Accuracy,
    pub(super) path: Path,
    pub(super) bias: Bias,
    /// Independent for each frame.
    pub(super) white: Accuracy,
    pub(super) range_m: f64,
    /// From the capture of a frame to its arrival, and by how much it may be longer.
    pub(super) delay_ms: (i64, u32),
}

pub(super) const EXACT: Accuracy = Accuracy { position_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 };

impl Observer {
    pub(super) fn unit() -> Self {
        let path = Path::Fixed([0.0, 0.0]);
        Self {
            name: "unit",
            accuracy: SURVEYED,
            path,
            bias: Bias::ZERO,
            white: EXACT,
            range_m: 200.0,
            delay_ms: (DELAY_MS, 0),
        }
    }

    pub(super) fn vehicle(name: &'static str, bias: Bias) -> Self {
        let path = Path::Ring { radius_m: 30.0, phase: f64::from(name.as_bytes()[0]), speed_mps: 8.0 };
        Self { name, accuracy: VEHICLE, path, bias, white: EXACT, range_m: 200.0, delay_ms: (DELAY_MS, 0) }
    }
}

/// Seven objects on rings, in both directions, at 5 to 13 m/s.
pub(super) fn rings(seed: u64) -> Vec<Path> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..7)
        .map(|k| {
            let direction = if k % 2 == 0 { 1.0 } else { -1.0 };
            let speed_mps = direction * (5.0 + 8.0 * unit(&mut rng));
            Path::Ring { radius_m: 40.0 + 8.0 * f64::from(k), phase: 6.3 * unit(&mut rng), speed_mps }
        })
        .collect()
}

pub(super) struct Traffic {
    pub(super) engine: Engine,
    pub(super) observers: Vec<Observer>,
    pub(super) objects: Vec<Path>,
    rng: ChaCha8Rng,
    on_the_way: Vec<(DetectionFrame, Timestamp)>,
    step: i64,
    /// Sum of the squared errors of published objects against the nearest true ones, and their number.
    squared_error: f64,
    n_published: u32,
}

impl Traffic {
    pub(super) fn new(
        registration: Registration,
        objects: Vec<Path>,
        observers: Vec<Observer>,
        seed: u64,
    ) -> Self {
        let config = config().with_tracking(|tracking| tracking.registration = registration);
        Self::with_config(config, objects, observers, seed)
    }

    pub(super) fn with_config(
        config: EngineConfig,
        objects: Vec<Path>,
        observers: Vec<Observer>,
        seed: u64,
    ) -> Self {
        let mut engine = Engine::new(config);
        for observer in &observers {
            let accuracy = observer.accuracy;
            let described = v2x_common::sensor::SensorDescription { accuracy, ..description(1e-7) };
            engine.handle_description(agent(observer.name), described).expect("a valid description");
        }
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            engine,
            observers,
            objects,
            rng,
            on_the_way: Vec::new(),
            step: 0,
            squared_error: 0.0,
            n_published: 0,
        }
    }

    /// Runs this many seconds.
    pub(super) fn run(&mut self, seconds: i64) -> &mut Self {
        for _ in 0..seconds * 1000 / PERIOD_MS {
            self.step_once();
            self.score();
        }
        self
    }

    /// Runs a tenth of a second without a fused list.
    pub(super) fn step_once(&mut self) {
        for place in 0..self.observers.len() {
            let sent = self.frame(place);
            self.on_the_way.push(sent);
        }
        self.step += 1;
        self.deliver();
    }

    /// Delivers the frames that have arrived, in order.
    fn deliver(&mut self) {
        let now = self.latest_now();
        self.on_the_way.sort_by_key(|(_, arrives_at)| *arrives_at);
        let n_arrived = self.on_the_way.partition_point(|(_, arrives_at)| *arrives_at <= now);
        for (frame, arrives_at) in self.on_the_way.drain(..n_arrived) {
            self.engine.handle_frame(&frame, arrives_at);
        }
    }

    /// The next frame of an observer, and when it arrives; the hub's clock is true.
    pub(super) fn frame(&mut self, place: usize) -> (DetectionFrame, Timestamp) {
        // They do not send at the same time.
        let t = seconds(self.step * PERIOD_MS + 23 * i64::try_from(place).expect("few"));
        let observer = self.observers[place].clone();
        let white = observer.white;
        let [ex, ey, eyaw, eclock] = [white.position_m, white.position_m, white.yaw_rad, white.clock_s]
            .map(|s| s * normal(&mut self.rng));
        let true_pose = observer.path.at(t);
        let pose = Pose {
            x: true_pose.x + observer.bias.dx_m + ex,
            y: true_pose.y + observer.bias.dy_m + ey,
            yaw: wrap_angle(true_pose.yaw + observer.bias.yaw_rad + eyaw),
        };
        let objects: Vec<Pose> = self.objects.iter().map(|path| path.at(t)).collect();
        let covered =
            objects.iter().filter(|object| true_pose.distance_to(object.x, object.y) < observer.range_m);
        let detections = covered.map(|object| detected(object, &true_pose, &pose, &mut self.rng)).collect();
        let frame = DetectionFrame {
            id: FrameId { agent: agent(observer.name), epoch: 1, sequence: self.step.unsigned_abs() },
            captured_at: at(t + observer.bias.clock_s + eclock),
            sensor_pose: Some(pose),
            sensor_revision: 1,
            map_frame: None,
            detections,
        };
        let (least_ms, more_ms) = observer.delay_ms;
        let delay = Span::from_millis(least_ms + i64::from(self.rng.next_u32() % (more_ms + 1)));
        (frame, at(t) + delay)
    }

    /// The newest time given to the engine.
    pub(super) fn latest_now(&self) -> Timestamp {
        at(seconds(self.step * PERIOD_MS + DELAY_MS))
    }

    /// The published objects.
    pub(super) fn published(&mut self) -> &[FusedObject] {
        let now = self.latest_now();
        &self.engine.fused(now).objects
    }

    /// Compares the published objects with the truth.
    pub(super) fn score(&mut self) {
        let now = self.latest_now();
        let t = seconds(self.step * PERIOD_MS + DELAY_MS);
        for object in &self.engine.fused(now).objects {
            let apart = self.objects.iter().map(|path| {
                let truth = path.at(t);
                libm::hypot(truth.x - object.bev.x, truth.y - object.bev.y)
            });
            let nearest = apart.fold(f64::INFINITY, f64::min);
            if nearest < 5.0 {
                self.squared_error += nearest * nearest;
                self.n_published += 1;
            }
        }
    }

    /// Root mean square error of the published objects since the last call, m.
    pub(super) fn rmse_m(&mut self) -> f64 {
        let rmse = libm::sqrt(self.squared_error / f64::from(self.n_published));
        (self.squared_error, self.n_published) = (0.0, 0);
        rmse
    }

    pub(super) fn registration_of(&self, name: &str) -> AgentRegistration {
        let name: AgentId = agent(name);
        self.engine.registration().find(|one| one.agent == name).expect("it described itself")
    }
}

/// A detection: measured about the true pose, reported about the estimated one. N1: 0.2 m and 1 % of the range, 3°.
fn detected(object: &Pose, true_pose: &Pose, estimated: &Pose, rng: &mut ChaCha8Rng) -> Detection {
    let range = true_pose.distance_to(object.x, object.y);
    let bearing = true_pose.bearing_to(object.x, object.y);
    let sigma = 0.2 + 0.01 * range;
    let (sin, cos) = libm::sincos(bearing);
    let (ahead, left) = (range * cos + sigma * normal(rng), range * sin + sigma * normal(rng));
    let (x, y) = estimated.offset(ahead, left);
    let yaw_sigma = 3.0 * DEGREE;
    let yaw = wrap_angle(object.yaw - true_pose.yaw + estimated.yaw + yaw_sigma * normal(rng));
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox { x, y, w: 1.8, d: 4.5, yaw },
        covariance: BoxCovariance {
            position: Covariance2::isotropic(sigma),
            ww: 0.1,
            dd: 0.6,
            yaw: yaw_sigma * yaw_sigma,
        },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

fn at(t: f64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(EPOCH_MS) + Span::from_secs_f64(t)
}

fn seconds(ms: i64) -> f64 {
    Span::from_millis(ms).as_secs_f64()
}

fn unit(rng: &mut ChaCha8Rng) -> f64 {
    (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0
}

/// A standard normal draw (Box & Muller 1958).
pub(super) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v) = (unit(rng), unit(rng));
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(2.0 * std::f64::consts::PI * v)
}

/// Eight objects on straights through the scene, at 5 to 13 m/s, each in its own direction.
pub(super) fn straights(seed: u64) -> Vec<Path> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..8)
        .map(|k| {
            let speed_mps = 5.0 + 8.0 * unit(&mut rng);
            let yaw = wrap_angle(f64::from(k) * 0.785 + 0.4 * unit(&mut rng));
            let (sin, cos) = libm::sincos(yaw);
            let aside = 12.0 * (f64::from(k) - 3.5);
            // It is nearest after ten seconds.
            let back = 10.0 * speed_mps;
            Path::Straight { start: [-back * cos - aside * sin, -back * sin + aside * cos], yaw, speed_mps }
        })
        .collect()
}
