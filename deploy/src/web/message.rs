//! The messages to the page: JSON, with numbers in flat lists, so that reading them makes little garbage.
//!
//! Times are ms since the Unix epoch; lengths m, angles rad, speeds m/s.

use super::errors::{Errors, RADIUS_M};
use super::rounding::rounded;
use serde::Serialize;
use v2x_agent::truth::TrueObject;
use v2x_agent::world::{Road, RoadKind};
use v2x_common::class::Class;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::{FusedFrame, FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubStatus;

/// Digits of lengths and angles: a millimetre, a milliradian.
const FINE: f64 = 1e3;
/// Digits of variances.
const FINEST: f64 = 1e6;
/// Places of xx, xy and yy in a kinematic covariance.
const POSITION: [usize; 3] = [0, 1, 4];

fn ms(at: Timestamp) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "µs since the epoch are below 2^53")]
    let us = at.as_micros() as f64;
    us / 1000.0
}

/// One message.
#[derive(Debug, Serialize)]
#[serde(tag = "t", rename_all = "lowercase")]
pub(super) enum Message<'a> {
    Hello(Hello<'a>),
    Connection(Connection<'a>),
    Presence(Presence<'a>),
    Sensor(Sensor<'a>),
    Status(Status<'a>),
    Detections(Detections),
    Fused(Fused),
}

/// What holds for the whole time.
#[derive(Debug, Serialize)]
pub(super) struct Hello<'a> {
    pub(super) network: NetworkId,
    pub(super) version: &'static str,
    /// All class names, by their numbers.
    pub(super) classes: Vec<&'static str>,
    /// The scenario, where it is known.
    pub(super) scenario: Option<&'a str>,
    pub(super) roads: Vec<RoadLine>,
    /// The largest distance to the truth that counts as an error, m.
    pub(super) radius_m: f64,
}

impl<'a> Hello<'a> {
    /// With roads where a world is known.
    pub(super) fn new(network: NetworkId, scenario: Option<&'a str>, roads: &[Road]) -> Self {
        Self {
            network,
            version: env!("CARGO_PKG_VERSION"),
            classes: Class::ALL.iter().map(|class| class.name()).collect(),
            scenario,
            roads: roads.iter().map(RoadLine::of).collect(),
            radius_m: RADIUS_M,
        }
    }
}

/// A road as the page draws it.
#[derive(Debug, Serialize)]
pub(super) struct RoadLine {
    kind: &'static str,
    width_m: f64,
    /// x, y, x, y, …
    points: Vec<f64>,
}

impl RoadLine {
    fn of(road: &Road) -> Self {
        let kind = match road.kind {
            RoadKind::Area => "area",
            RoadKind::Surface => "surface",
            RoadKind::Marking => "marking",
            RoadKind::StopLine => "stop",
        };
        let points = road.points.iter().flat_map(|(x, y)| [rounded(*x, FINE), rounded(*y, FINE)]).collect();
        Self { kind, width_m: road.width_m, points }
    }
}

/// Whether the view has reached a hub or router.
#[derive(Debug, Serialize)]
pub(super) struct Connection<'a> {
    pub(super) connected: bool,
    pub(super) endpoints: &'a [String],
}

/// Who holds a liveliness token.
#[derive(Debug, Serialize)]
pub(super) struct Presence<'a> {
    pub(super) hubs: &'a [String],
    pub(super) agents: &'a [String],
}

/// An agent's sensor description.
#[derive(Debug, Serialize)]
pub(super) struct Sensor<'a> {
    pub(super) agent: AgentId,
    pub(super) description: &'a SensorDescription,
}

/// The answers of all hubs, and why there may be fewer.
#[derive(Debug, Serialize)]
pub(super) struct Status<'a> {
    pub(super) hubs: &'a [HubStatus],
    pub(super) error: Option<String>,
}

/// A detection frame.
#[derive(Debug, Serialize)]
pub(super) struct Detections {
    agent: AgentId,
    sequence: u64,
    captured: f64,
    received: f64,
    /// x, y, yaw of the sensor.
    pose: Option<[f64; 3]>,
    /// [`DETECTION`] numbers of each detection.
    detections: Vec<f64>,
    errors: Option<Errors>,
}

/// Numbers of one detection: class, score, x, y, w, d, yaw, and the position's covariance.
pub(super) const DETECTION: usize = 10;

impl Detections {
    /// Of a frame that arrived at this time.
    pub(super) fn new(frame: &DetectionFrame, received_at: Timestamp, errors: Option<Errors>) -> Self {
        let numbers = frame.detections.iter().flat_map(|detection| {
            let (bev, position) = (&detection.bev, &detection.covariance.position);
            let numbers: [f64; DETECTION] = [
                f64::from(detection.class as u8),
                rounded(detection.score, FINE),
                rounded(bev.x, FINE),
                rounded(bev.y, FINE),
                rounded(bev.w, FINE),
                rounded(bev.d, FINE),
                rounded(bev.yaw, FINE),
                rounded(position.xx, FINEST),
                rounded(position.xy, FINEST),
                rounded(position.yy, FINEST),
            ];
            numbers
        });
        Self {
            agent: frame.id.agent,
            sequence: frame.id.sequence,
            captured: ms(frame.captured_at),
            received: ms(received_at),
            pose: frame.sensor_pose.map(|pose| [pose.x, pose.y, pose.yaw].map(|value| rounded(value, FINE))),
            detections: numbers.collect(),
            errors,
        }
    }
}

/// A fused frame, with the truth of its time where that is known.
#[derive(Debug, Serialize)]
pub(super) struct Fused {
    hub: HubId,
    lineage: u32,
    sequence: u64,
    fused: f64,
    received: f64,
    /// Names, which other lists refer to by their place.
    names: Vec<AgentId>,
    /// Of each agent: name, accepted, refused, out of sequence, and the capture time of the newest frame.
    agents: Vec<[f64; 5]>,
    tracks: Vec<String>,
    /// [`OBJECT`] numbers of each object.
    objects: Vec<f64>,
    /// Of each object: name, sequence and index of each measurement.
    contributors: Vec<Vec<u64>>,
    /// Of each detection frame that is new: name, capture time, time of arrival at the hub.
    includes: Vec<[f64; 3]>,
    /// [`TRUTH`] numbers of each true object.
    truth: Option<Vec<f64>>,
    errors: Option<Errors>,
}

/// Numbers of one object: class, x, y, w, d, yaw, vx, vy, the position's covariance, existence, age in s, the time from
/// its last measurement in ms, and the standard deviations of yaw, w, d, vx and vy.
pub(super) const OBJECT: usize = 19;
/// Numbers of one true object: id, class, x, y, w, d, yaw, vx, vy.
pub(super) const TRUTH: usize = 9;

impl Fused {
    /// Of a frame that arrived at this time.
    pub(super) fn new(
        frame: &FusedFrame,
        received_at: Timestamp,
        truth: Option<&[TrueObject]>,
        errors: Option<Errors>,
    ) -> Self {
        let names = names(frame);
        let place = |agent: &AgentId| names.binary_search(agent).unwrap_or(usize::MAX) as u64;
        #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
        let number = |count: u64| count as f64;
        let contributors = |object: &FusedObject| {
            let measurements = object.contributors.iter();
            let numbers = measurements.flat_map(|measurement| {
                let frame = &measurement.frame;
                [place(&frame.agent), frame.sequence, u64::from(measurement.index)]
            });
            numbers.collect()
        };
        let agents = frame.agents.iter().map(|health| {
            let (accepted, refused) = (number(health.accepted), number(health.refused));
            let late = number(health.out_of_sequence);
            [number(place(&health.agent)), accepted, refused, late, ms(health.newest_captured_at)]
        });
        let includes = frame.includes.iter().map(|inclusion| {
            let agent = number(place(&inclusion.frame.agent));
            [agent, ms(inclusion.captured_at), ms(inclusion.received_at)]
        });
        Self {
            hub: frame.hub,
            lineage: frame.lineage,
            sequence: frame.sequence,
            fused: ms(frame.fused_at),
            received: ms(received_at),
            agents: agents.collect(),
            tracks: frame.objects.iter().map(|object| object.track.to_string()).collect(),
            objects: frame.objects.iter().flat_map(|object| numbers_of(object, frame.fused_at)).collect(),
            contributors: frame.objects.iter().map(contributors).collect(),
            includes: includes.collect(),
            truth: truth.map(|truth| truth.iter().flat_map(numbers_of_truth).collect()),
            errors,
            names,
        }
    }
}

/// All agents that a frame names, sorted.
fn names(frame: &FusedFrame) -> Vec<AgentId> {
    let measured = frame.objects.iter().flat_map(|object| &object.contributors);
    let mut names: Vec<_> = frame
        .agents
        .iter()
        .map(|health| health.agent)
        .chain(measured.map(|measurement| measurement.frame.agent))
        .chain(frame.includes.iter().map(|inclusion| inclusion.frame.agent))
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn numbers_of(object: &FusedObject, fused_at: Timestamp) -> [f64; OBJECT] {
    let (bev, covariance) = (&object.bev, &object.kinematic_covariance);
    let [xx, xy, yy] = POSITION.map(|place| rounded(covariance[place], FINEST));
    let [_, _, vx_variance, vy_variance] = KINEMATIC_DIAGONAL.map(|place| covariance[place]);
    let sigma = |variance: f64| rounded(variance.max(0.0).sqrt(), FINE);
    [
        f64::from(object.class as u8),
        rounded(bev.x, FINE),
        rounded(bev.y, FINE),
        rounded(bev.w, FINE),
        rounded(bev.d, FINE),
        rounded(bev.yaw, FINE),
        rounded(object.velocity.0, FINE),
        rounded(object.velocity.1, FINE),
        xx,
        xy,
        yy,
        rounded(object.existence, FINEST),
        rounded(object.age.as_secs_f64(), FINE),
        rounded((fused_at - object.last_measured_at).as_millis_f64(), FINE),
        sigma(object.yaw_variance),
        sigma(object.ww),
        sigma(object.dd),
        sigma(vx_variance),
        sigma(vy_variance),
    ]
}

fn numbers_of_truth(object: &TrueObject) -> [f64; TRUTH] {
    let (bev, (vx, vy)) = (&object.bev, object.velocity);
    let [x, y, w, d, yaw, vx, vy] =
        [bev.x, bev.y, bev.w, bev.d, bev.yaw, vx, vy].map(|value| rounded(value, FINE));
    [f64::from(object.id.0), f64::from(object.class as u8), x, y, w, d, yaw, vx, vy]
}
