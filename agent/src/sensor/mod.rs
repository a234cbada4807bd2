//! An agent's sensor: field of view, missed detections, noise, clutter, and the agent's report of itself.

mod clutter;
mod config;
mod profiled;

use std::sync::Arc;

use rand::distr::Distribution;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::FrameId;
use v2x_common::sensor::{Body, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};

use crate::noise::MeasurementNoise;
use crate::pose_error::{EstimatedPose, FrameKey};
use crate::random::{Purpose, chance, keyed_rng, standard_normal};
use crate::truth::{Identities, ObjectId, TrueObject};
use crate::world::World;

pub use config::{Boot, SensorConfig, SensorError};

/// Simulated detectors give every detection this score, true or false: a score must not distinguish them.
const SCORE: f64 = 1.0;
/// Accuracy of a vehicle's own width and depth (1 σ), m.
const BODY_SIGMA_M: f64 = 0.01;
/// The only revision: a simulated sensor does not change while it runs.
const SENSOR_REVISION: u32 = 1;

/// One agent's sensor in its world. Every frame is a function of (configuration, world, seed, sequence).
#[derive(Clone, Debug)]
pub struct Sensor {
    config: SensorConfig,
    noise: MeasurementNoise,
    world: Arc<World>,
    /// Of the agent in the world.
    index: usize,
    boot: Boot,
    /// First capture after the scenario's start.
    phase: Span,
}

/// A frame, and the identities of its detections, which only the simulation knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// The frame as it is published.
    pub frame: DetectionFrame,
    /// The true object of each detection.
    pub identities: Identities,
}

/// A detection with the true object that it is of; `None` for clutter.
type Identified = (Option<ObjectId>, Detection);

impl Sensor {
    /// The sensor of an agent of this world.
    pub fn new(config: SensorConfig, world: Arc<World>, boot: Boot) -> Result<Self, SensorError> {
        config.validate()?;
        let index = world.agent_index(&config.agent).ok_or(SensorError::NoSuchAgent(config.agent))?;
        let mut rng = keyed_rng(boot.seed, Some(&config.agent), 0, Purpose::CapturePhase);
        let phase = config.phase.within(config.rate.elapsed(1), &mut rng);
        let noise = MeasurementNoise::new(config.noise);
        Ok(Self { config, noise, world, index, boot, phase })
    }

    /// Draws the errors of detections in x and y from this law, in units of their σ.
    ///
    /// The sensor still declares the σ of its noise model: with a law whose variance is not 1 that is wrong, as it can
    /// be of a real detector. A detection that [`Detection::validate`] refuses counts as missed.
    ///
    /// Any distribution of `rand_distr` serves, here Student's t with heavy tails:
    ///
    /// ```
    /// # use rand_distr::StudentT;
    /// # use std::sync::Arc;
    /// # use v2x_agent::{Boot, Scenario};
    /// # use v2x_common::Timestamp;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let text = r#"
    /// #     name = "t"
    /// #     world.kind = "crossing"
    /// #     [[agents]]
    /// #     id = "rsu"
    /// #     kind = "roadside-unit"
    /// #     pose = { x = 9, y = 9 }
    /// # "#;
    /// # let scenario = Scenario::from_toml(text)?;
    /// # let world = Arc::new(scenario.world(1));
    /// # let boot = Boot { seed: 1, epoch: 1, start: Timestamp::EPOCH };
    /// let sensor = scenario.agents[0].sensor(world, boot)?;
    /// let heavy_tailed = sensor.with_position_noise(StudentT::new(3.0).expect("3 is positive"));
    /// assert_eq!(heavy_tailed.observe(0).frame.validate(), Ok(()));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn with_position_noise(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { noise: self.noise.with_position_law(law), ..self }
    }

    /// Draws the errors of detections in heading from this law, in units of their σ.
    #[must_use]
    pub fn with_heading_noise(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { noise: self.noise.with_heading_law(law), ..self }
    }

    /// Draws the factors measured size / true size of detections from this law.
    #[must_use]
    pub fn with_size_noise(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { noise: self.noise.with_size_law(law), ..self }
    }

    /// Its configuration.
    pub const fn config(&self) -> &SensorConfig {
        &self.config
    }

    /// The world that it observes.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// Gives it the same world of which more is known. Nothing changes where the agent is not in it.
    pub fn set_world(&mut self, world: Arc<World>) {
        if let Some(index) = world.agent_index(&self.config.agent) {
            (self.world, self.index) = (world, index);
        }
    }

    /// Whether its body is known: one that rides on an object of a live world has none before that comes.
    pub fn has_body(&self) -> bool {
        self.config.kind != SensorKind::Vehicle || self.world.agent_body(self.index).is_some()
    }

    /// How it was started.
    pub const fn boot(&self) -> Boot {
        self.boot
    }

    /// When the frame of this number is captured: true Unix time, independent of the agent's clock.
    pub fn capture_time(&self, sequence: u64) -> Timestamp {
        self.boot.start + self.scenario_time(sequence)
    }

    /// The frame's `captured_at`: Unix time by the agent's clock when the frame of this number is captured.
    pub fn stamp(&self, sequence: u64) -> Timestamp {
        self.capture_time(sequence) + self.config.clock.at(self.scenario_time(sequence))
    }

    /// The number of the first frame that is captured at `t` (true Unix time) or later.
    pub fn sequence_at_or_after(&self, t: Timestamp) -> u64 {
        self.config.rate.sequence_at_or_after(t - (self.boot.start + self.phase))
    }

    /// The true objects when the frame of this number is captured, in `out` (which is cleared first).
    pub fn objects_at_capture(&self, sequence: u64, out: &mut Vec<TrueObject>) {
        self.world.objects_at(self.scenario_time(sequence), out);
    }

    /// The object of the agent itself; `None` for a roadside unit.
    pub fn own_object(&self) -> Option<ObjectId> {
        self.world.agent_object(self.index)
    }

    /// What the sensor declares about itself.
    pub fn description(&self) -> SensorDescription {
        let config = &self.config;
        SensorDescription {
            revision: SENSOR_REVISION,
            kind: config.kind,
            field_of_view: config.field_of_view,
            detection_probability: config.detection_probability,
            clutter_per_m2: config.clutter_per_frame / config.field_of_view.area_m2(),
            size_noise: Some(config.noise.size),
            body: self.world.agent_body(self.index),
            accuracy: config.accuracy,
            rate_hz: config.rate.hz(),
        }
    }

    /// Whether the agent is in the world when the frame of this number is captured: one that rides on a recorded object is
    /// not where that is absent.
    pub fn is_present(&self, sequence: u64) -> bool {
        self.world.agent_pose(self.index, self.scenario_time(sequence)).is_some()
    }

    /// The frame of this number. Of an agent that is not in the world it has neither a pose nor detections.
    pub fn observe(&self, sequence: u64) -> Observation {
        let mut objects = Vec::new();
        self.objects_at_capture(sequence, &mut objects);
        let Some(pose) = self.estimated_pose(sequence) else {
            return self.observation(sequence, None, Vec::new());
        };
        let mut detected = if let Some(detector) = self.detector() {
            self.profiled_detections((&detector, &objects), &pose, sequence)
        } else {
            let mut detected = self.detections(&objects, &pose, sequence);
            self.add_clutter(&mut detected, &pose, sequence);
            detected
        };
        if let Some(body) = self.world.agent_body(self.index) {
            detected.push((self.own_object(), self.self_report(&body, &pose.estimate)));
        }
        // A user's law of noise can give any number.
        detected.retain(|(_, detection)| detection.validate(Some(&pose.estimate)).is_ok());
        detected.shuffle(&mut self.rng(sequence, Purpose::Order));
        self.observation(sequence, Some(pose.estimate), detected)
    }

    fn observation(
        &self,
        sequence: u64,
        sensor_pose: Option<Pose>,
        detected: Vec<Identified>,
    ) -> Observation {
        let (identities, detections) = detected.into_iter().unzip();
        Observation {
            frame: DetectionFrame {
                id: FrameId { agent: self.config.agent, epoch: self.boot.epoch, sequence },
                captured_at: self.stamp(sequence),
                sensor_pose,
                sensor_revision: SENSOR_REVISION,
                map_frame: self.config.map_frame,
                detections,
            },
            identities: Identities { epoch: self.boot.epoch, sequence, objects: identities },
        }
    }

    fn scenario_time(&self, sequence: u64) -> Span {
        self.phase + self.config.rate.elapsed(sequence)
    }

    fn rng(&self, sequence: u64, purpose: Purpose) -> ChaCha8Rng {
        keyed_rng(self.boot.seed, Some(&self.config.agent), sequence, purpose)
    }

    fn frame_key(&self, sequence: u64) -> FrameKey<'_> {
        FrameKey { seed: self.boot.seed, agent: &self.config.agent, sequence }
    }

    /// `None` while the agent is not in the world.
    fn estimated_pose(&self, sequence: u64) -> Option<EstimatedPose> {
        let truth = self.world.agent_pose(self.index, self.scenario_time(sequence))?;
        let estimate = match &self.config.pose_error {
            Some(error) => error.estimate(&truth, &self.frame_key(sequence), self.config.rate.hz()),
            None => self.declared_error(&truth, sequence),
        };
        Some(EstimatedPose { truth, estimate })
    }

    /// Without a configured pose error a surveyed pose is exact, and a vehicle reports itself with the accuracy that it
    /// declares; its detections do not share that error.
    fn declared_error(&self, pose: &Pose, sequence: u64) -> Pose {
        if self.config.kind == SensorKind::RoadsideUnit {
            return *pose;
        }
        let accuracy = &self.config.accuracy;
        let mut rng = self.rng(sequence, Purpose::SelfReport);
        Pose {
            x: pose.x + accuracy.position_m * standard_normal(&mut rng),
            y: pose.y + accuracy.position_m * standard_normal(&mut rng),
            yaw: wrap_angle(pose.yaw + accuracy.yaw_rad * standard_normal(&mut rng)),
        }
    }

    /// Whether an object's true centre is in the field of view; the agent itself is not.
    fn is_visible(&self, object: &TrueObject, pose: &EstimatedPose) -> bool {
        let bev = &object.bev;
        Some(object.id) != self.own_object() && self.config.field_of_view.contains(&pose.truth, bev.x, bev.y)
    }

    /// Detections of the visible objects.
    fn detections(&self, objects: &[TrueObject], pose: &EstimatedPose, sequence: u64) -> Vec<Identified> {
        let mut detected = Vec::new();
        for object in objects.iter().filter(|object| self.is_visible(object, pose)) {
            let mut rng = self.rng(sequence, Purpose::Measurement(object.id));
            if chance(&mut rng, self.config.detection_probability) {
                let measured = self.noise.measure(&object.bev, &pose.truth, &mut rng);
                detected.push((Some(object.id), self.detection(object.class, measured, pose)));
            }
        }
        detected
    }

    /// The detection of a box that was measured; the detector does not know the error of the pose.
    fn detection(&self, class: Class, measured: BevBox, pose: &EstimatedPose) -> Detection {
        let bev = if self.config.pose_error.is_some() { pose.place(&measured) } else { measured };
        Detection {
            class,
            score: SCORE,
            bev,
            covariance: self.noise.model().reported_covariance(&bev, &pose.estimate),
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        }
    }

    /// Adds false detections.
    fn add_clutter(&self, detected: &mut Vec<Identified>, pose: &EstimatedPose, sequence: u64) {
        let mut rng = self.rng(sequence, Purpose::Clutter);
        let false_boxes = clutter::draw(&self.config, &pose.truth, &mut rng);
        detected.extend(false_boxes.into_iter().map(|(class, bev)| (None, self.detection(class, bev, pose))));
    }

    /// The agent's own body, as an ordinary detection: it is never missed.
    fn self_report(&self, body: &Body, estimated_pose: &Pose) -> Detection {
        let accuracy = &self.config.accuracy;
        Detection {
            class: body.class,
            score: SCORE,
            bev: body.at(estimated_pose),
            covariance: BoxCovariance {
                position: Covariance2::isotropic(accuracy.position_m),
                ww: BODY_SIGMA_M * BODY_SIGMA_M,
                dd: BODY_SIGMA_M * BODY_SIGMA_M,
                yaw: accuracy.yaw_rad * accuracy.yaw_rad,
            },
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        }
    }
}

#[cfg(test)]
mod tests;
