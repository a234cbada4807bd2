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
use v2x_common::wire;

use crate::link::{Link, Parcel, Transit};
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
}

/// One frame, and what only the simulation knows of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// What is sent.
    pub frame: DetectionFrame,
    /// Whose detections they are.
    pub identities: Identities,
}

impl Observation {
    /// The frame's size on the wire, bytes; 0 for one that the wire cannot hold.
    fn wire_bytes(&self) -> usize {
        let mut buffer = Vec::new();
        wire::detections::encode(&self.frame, &mut buffer).map_or(0, |()| buffer.len())
    }
}

impl SimulatedAgent {
    /// The agent of this id in a world made from the same scenario; `None` where the scenario has no such agent.
    pub fn new(scenario: &Scenario, world: Arc<World>, id: &AgentId, boot: Boot) -> Option<Self> {
        let index = scenario.agent_index(id)?;
        Some(Self {
            config: scenario.agents[index].clone(),
            map_frame: scenario.map_frame,
            world,
            index,
            boot,
        })
    }

    /// When the frame of this number arrives over a link, and what it is; `None` where it is lost.
    pub fn delivery(&self, link: &Link, sequence: u64) -> Option<(Timestamp, Observation)> {
        let captured_at = self.capture_time(sequence);
        // Only where its size matters must it be known before its fate.
        let observation = link.config().rate_bps.map(|_| self.observe(sequence));
        let bytes = observation.as_ref().map_or(0, Observation::wire_bytes);
        let since_start = captured_at - self.boot.start;
        match link.transit(Parcel { sequence, since_start, bytes }) {
            Transit::Lost => None,
            Transit::Delivered { delay } => {
                Some((captured_at + delay, observation.unwrap_or_else(|| self.observe(sequence))))
            }
        }
    }

    /// The agent's configuration.
    pub const fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// The world that it is in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// When the frame of this number is captured, Unix time.
    pub fn capture_time(&self, sequence: u64) -> Timestamp {
        self.boot.start + self.scenario_time(sequence)
    }

    /// The number of the first frame that is captured at `t` (Unix time) or later.
    pub fn sequence_at_or_after(&self, t: Timestamp) -> u64 {
        self.config.rate.sequence_at_or_after(t - (self.boot.start + self.config.phase))
    }

    /// What the agent tells of its sensor.
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
            accuracy: config.self_report,
            rate_hz: config.rate.hz(),
        }
    }

    /// The frame of this number.
    pub fn observe(&self, sequence: u64) -> Observation {
        let time = self.scenario_time(sequence);
        let mut objects = Vec::new();
        self.world.objects_at(time, &mut objects);
        let pose = self.world.agent_pose(self.index, time);
        let believed_pose = self.believed_pose(&pose, sequence);
        let mut seen = self.detections(&objects, &pose, &believed_pose, sequence);
        self.add_clutter(&mut seen, &pose, &believed_pose, sequence);
        if let Some(body) = self.world.agent_body(self.index) {
            seen.push((self.world.agent_object(self.index), self.self_report(&body, &believed_pose)));
        }
        seen.shuffle(&mut self.rng(sequence, Purpose::Order));
        let (identities, detections) = seen.into_iter().unzip();
        Observation {
            frame: DetectionFrame {
                id: FrameId { agent: self.config.id, epoch: self.boot.epoch, sequence },
                captured_at: self.capture_time(sequence),
                sensor_pose: Some(believed_pose),
                sensor_revision: SENSOR_REVISION,
                map_frame: self.map_frame,
                detections,
            },
            identities: Identities { epoch: self.boot.epoch, sequence, objects: identities },
        }
    }

    fn scenario_time(&self, sequence: u64) -> Span {
        self.config.phase + self.config.rate.elapsed(sequence)
    }

    fn rng(&self, sequence: u64, purpose: Purpose) -> ChaCha8Rng {
        keyed_rng(self.boot.seed, Some(&self.config.id), sequence, purpose)
    }

    /// Where the agent believes to be: a surveyed pose is exact, a vehicle errs by its self-report's σ.
    fn believed_pose(&self, pose: &Pose, sequence: u64) -> Pose {
        if self.config.kind == SensorKind::RoadsideUnit {
            return *pose;
        }
        let accuracy = &self.config.self_report;
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
        pose: &Pose,
        believed_pose: &Pose,
        sequence: u64,
    ) -> Vec<(Option<ObjectId>, Detection)> {
        let own = self.world.agent_object(self.index);
        let visible = |object: &&TrueObject| {
            Some(object.id) != own && self.config.field_of_view.contains(pose, object.bev.x, object.bev.y)
        };
        let mut seen = Vec::new();
        for object in objects.iter().filter(visible) {
            let mut rng = self.rng(sequence, Purpose::Measurement(object.id));
            if chance(&mut rng, self.config.detection_probability) {
                let measured = self.config.noise.perturb(&object.bev, pose, &mut rng);
                seen.push((Some(object.id), self.detection(object.class, measured, believed_pose)));
            }
        }
        seen
    }

    fn detection(&self, class: Class, measured: BevBox, believed_pose: &Pose) -> Detection {
        Detection {
            class,
            score: SCORE,
            bev: measured,
            covariance: self.config.noise.reported_covariance(&measured, believed_pose),
            velocity: None,
            source_track: None,
        }
    }

    /// A Poisson number of false detections, uniform over the field of view.
    fn add_clutter(
        &self,
        seen: &mut Vec<(Option<ObjectId>, Detection)>,
        pose: &Pose,
        believed_pose: &Pose,
        sequence: u64,
    ) {
        let mut rng = self.rng(sequence, Purpose::Clutter);
        for _ in 0..poisson(&mut rng, self.config.clutter_per_frame) {
            let (class, phantom) = self.phantom(pose, &mut rng);
            seen.push((None, self.detection(class, phantom, believed_pose)));
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
        let accuracy = &self.config.self_report;
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
