//! What an agent sees: field of view, misses, noise, clutter, and itself.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::{AgentId, FrameId, MapFrame};
use v2x_common::sensor::{Body, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};

use crate::pose_error::Belief;
use crate::random::{
    Purpose, chance, keyed_rng, poisson, standard_normal, truncated_normal, uniform, unit, weighted,
};
use crate::scenario::{AgentConfig, Scenario};
use crate::truth::{Identities, ObjectId, TrueObject};
use crate::world::World;

/// Simulated detectors are always sure, of true and of false detections alike: a score must not tell them apart.
const SCORE: f64 = 1.0;
/// How well a vehicle knows its own width and depth (1 σ), m.
const BODY_SIGMA_M: f64 = 0.01;
/// The only revision: a simulated sensor does not change while it runs.
const SENSOR_REVISION: u32 = 1;
/// What clutter looks like, by weight.
const CLUTTER_CLASSES: [(Class, f64); 6] = [
    (Class::Car, 5.0),
    (Class::Adult, 2.0),
    (Class::TrafficCone, 1.0),
    (Class::Barrier, 1.0),
    (Class::Bicycle, 0.5),
    (Class::Truck, 0.5),
];

/// What one start of an agent is given from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boot {
    /// The run's seed, the same for all agents.
    pub seed: u64,
    /// The agent's boot epoch; it only labels frames and changes no draw.
    pub epoch: u64,
    /// The time at which scenario time is 0.
    pub start: Timestamp,
}

/// One agent's sensor in its world. Every frame is a function of (scenario, seed, agent, sequence).
#[derive(Clone, Debug)]
pub struct SimulatedAgent {
    config: AgentConfig,
    map_frame: Option<MapFrame>,
    world: Arc<World>,
    index: usize,
    boot: Boot,
    /// First capture after the scenario's start.
    phase: Span,
}

/// One frame, and what only the simulation knows of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// What is sent.
    pub frame: DetectionFrame,
    /// Whose detections they are.
    pub identities: Identities,
}

impl SimulatedAgent {
    /// The agent of this id in a world made from the same scenario; `None` where the scenario has no such agent.
    pub fn new(scenario: &Scenario, world: Arc<World>, id: &AgentId, boot: Boot) -> Option<Self> {
        let index = scenario.agent_index(id)?;
        let config = scenario.agents[index].clone();
        let mut rng = keyed_rng(boot.seed, Some(id), 0, Purpose::CapturePhase);
        let phase = config.phase.within(config.rate.elapsed(1), &mut rng);
        Some(Self { config, map_frame: scenario.map_frame, world, index, boot, phase })
    }

    /// The agent's configuration.
    pub const fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// The world that it is in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// How it was started.
    pub const fn boot(&self) -> Boot {
        self.boot
    }

    /// When the frame of this number is captured: true Unix time, whatever the agent's clock shows.
    pub fn capture_time(&self, sequence: u64) -> Timestamp {
        self.boot.start + self.scenario_time(sequence)
    }

    /// What the agent's clock shows when the frame of this number is captured, Unix time: the frame's `captured_at`.
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

    /// The object that the agent itself is; `None` for a roadside unit.
    pub fn own_object(&self) -> Option<ObjectId> {
        self.world.agent_object(self.index)
    }

    /// What the agent tells of its sensor.
    pub fn description(&self) -> SensorDescription {
        let config = &self.config;
        SensorDescription {
            revision: SENSOR_REVISION,
            kind: config.kind,
            field_of_view: config.field_of_view,
            detection_probability: config.send.report_probability(config.detection_probability, config.rate),
            clutter_per_m2: config.clutter_per_frame / config.field_of_view.area_m2(),
            size_noise: Some(config.noise.size),
            body: self.world.agent_body(self.index),
            accuracy: config.accuracy,
            rate_hz: config.rate.hz(),
        }
    }

    /// The frame of this number.
    pub fn observe(&self, sequence: u64) -> Observation {
        let mut objects = Vec::new();
        self.objects_at_capture(sequence, &mut objects);
        let belief = self.belief(sequence);
        let mut seen = self.detections(&objects, &belief, sequence);
        self.add_clutter(&mut seen, &belief, sequence);
        if let Some(body) = self.world.agent_body(self.index) {
            seen.push((self.own_object(), self.self_report(&body, &belief.believed)));
        }
        seen.shuffle(&mut self.rng(sequence, Purpose::Order));
        let (identities, detections) = seen.into_iter().unzip();
        Observation {
            frame: DetectionFrame {
                id: FrameId { agent: self.config.id, epoch: self.boot.epoch, sequence },
                captured_at: self.stamp(sequence),
                sensor_pose: Some(belief.believed),
                sensor_revision: SENSOR_REVISION,
                map_frame: self.map_frame,
                detections,
            },
            identities: Identities { epoch: self.boot.epoch, sequence, objects: identities },
        }
    }

    fn scenario_time(&self, sequence: u64) -> Span {
        self.phase + self.config.rate.elapsed(sequence)
    }

    fn rng(&self, sequence: u64, purpose: Purpose) -> ChaCha8Rng {
        keyed_rng(self.boot.seed, Some(&self.config.id), sequence, purpose)
    }

    fn belief(&self, sequence: u64) -> Belief {
        let pose = self.world.agent_pose(self.index, self.scenario_time(sequence));
        let (who, rate_hz) = ((self.boot.seed, &self.config.id), self.config.rate.hz());
        let believed = match &self.config.pose_error {
            Some(error) => error.believed(&pose, who, sequence, rate_hz),
            None => self.declared_error(&pose, sequence),
        };
        Belief { pose, believed }
    }

    /// Without a pose error of its own a surveyed pose is exact, and a vehicle reports itself with the accuracy that
    /// it declares; its detections have no part in that.
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

    /// Detections of the objects whose true centre is in the field of view, the agent itself apart.
    fn detections(
        &self,
        objects: &[TrueObject],
        belief: &Belief,
        sequence: u64,
    ) -> Vec<(Option<ObjectId>, Detection)> {
        let own = self.own_object();
        let pose = &belief.pose;
        let visible = |object: &&TrueObject| {
            Some(object.id) != own && self.config.field_of_view.contains(pose, object.bev.x, object.bev.y)
        };
        let mut seen = Vec::new();
        for object in objects.iter().filter(visible) {
            let mut rng = self.rng(sequence, Purpose::Measurement(object.id));
            if chance(&mut rng, self.config.detection_probability) {
                let measured = self.config.noise.perturb(&object.bev, pose, &mut rng);
                seen.push((Some(object.id), self.detection(object.class, measured, belief)));
            }
        }
        seen
    }

    /// What a detector that measured this box tells of it; of the pose's error it knows nothing.
    fn detection(&self, class: Class, measured: BevBox, belief: &Belief) -> Detection {
        let bev = if self.config.pose_error.is_some() { belief.misplace(&measured) } else { measured };
        Detection {
            class,
            score: SCORE,
            bev,
            covariance: self.config.noise.reported_covariance(&bev, &belief.believed),
            velocity: None,
            source_track: None,
        }
    }

    /// A Poisson number of false detections, uniform over the field of view.
    fn add_clutter(&self, seen: &mut Vec<(Option<ObjectId>, Detection)>, belief: &Belief, sequence: u64) {
        let mut rng = self.rng(sequence, Purpose::Clutter);
        for _ in 0..poisson(&mut rng, self.config.clutter_per_frame) {
            let (class, phantom) = self.phantom(&belief.pose, &mut rng);
            seen.push((None, self.detection(class, phantom, belief)));
        }
    }

    fn phantom(&self, pose: &Pose, rng: &mut ChaCha8Rng) -> (Class, BevBox) {
        let fov = &self.config.field_of_view;
        let (near2, far2) = (fov.range_min_m * fov.range_min_m, fov.range_max_m * fov.range_max_m);
        let range_m = libm::sqrt(uniform(rng, near2, far2));
        let bearing = fov.azimuth_rad + (unit(rng) - 0.5) * fov.width_rad;
        let (sin, cos) = libm::sincos(bearing);
        let (x, y) = pose.offset(range_m * cos, range_m * sin);
        let class = weighted(rng, &CLUTTER_CLASSES);
        let (w, d) = class.typical_size();
        let size_sigma = self.config.noise.size.sigma;
        let mut factor = || truncated_normal(rng, 1.0, size_sigma, (self.config.noise.size.lower, 5.0));
        let (w, d) = (w * factor(), d * factor());
        (class, BevBox { x, y, w, d, yaw: wrap_angle(uniform(rng, -PI, TAU - PI)) })
    }

    /// The agent's own body, as an ordinary detection: it is never missed.
    fn self_report(&self, body: &Body, believed_pose: &Pose) -> Detection {
        let accuracy = &self.config.accuracy;
        Detection {
            class: body.class,
            score: SCORE,
            bev: body.at(believed_pose),
            covariance: BoxCovariance {
                position: Covariance2::isotropic(accuracy.position_m),
                ww: BODY_SIGMA_M * BODY_SIGMA_M,
                dd: BODY_SIGMA_M * BODY_SIGMA_M,
                yaw: accuracy.yaw_rad * accuracy.yaw_rad,
            },
            velocity: None,
            source_track: None,
        }
    }
}

#[cfg(test)]
mod tests;
