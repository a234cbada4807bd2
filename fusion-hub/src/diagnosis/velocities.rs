//! An agent's reported velocities against where its own next frames have what it reports.
//!
//! Nothing of the fused objects is used: wrong velocities spoil them.

use super::observation::Observation;
use v2x_common::detection::DetectionFrame;
use v2x_common::geometry::Pose;
use v2x_common::time::Span;

/// Frames so far apart are compared: what moves has moved, and has not turned far.
const APART: (Span, Span) = (Span::from_millis(250), Span::from_millis(900));
/// Reported speeds below this say nothing, m/s.
const MOVING_MPS: f64 = 3.0;
/// A detection is there where one is this near to its predicted place: standard deviations, within these, m, and a share of the way.
const NEAR_SIGMAS: f64 = 2.5;
const NEAR_M: (f64, f64) = (0.8, 1.5);
const NEAR_SHARE: f64 = 0.1;
/// Two readings are told apart where their places are so far from each other, m.
const DIFFER_M: f64 = 3.0;
/// Most detections of a frame that are looked at.
const MAX_DETECTIONS: usize = 64;
/// Fewest detections that say anything.
const MIN_DETECTIONS: u64 = 15;
/// A reading is right where it explains such a share of them, and what is said no more than such a one.
const EXPLAINS: f64 = 0.6;
const EXPLAINS_NOT: f64 = 0.25;

/// What reported velocities may be instead of m/s along the axes of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    /// km/h.
    KilometresPerHour,
    /// Miles per hour.
    MilesPerHour,
    /// Along the axes of the sensor, or of the vehicle that it is on.
    SensorAxes,
    /// Along and across each box.
    BoxAxes,
    /// Relative to the sensor, which moves itself.
    Relative,
    /// The other way.
    Opposite,
    /// x and y the wrong way round.
    Exchanged,
    /// y points south.
    Mirrored,
    /// The speed, and the direction of motion in radians.
    Polar,
    /// The same in degrees.
    PolarDegrees,
}

/// Of those that explain as much, the last one is taken.
const READINGS: [Reading; 10] = [
    Reading::KilometresPerHour,
    Reading::MilesPerHour,
    Reading::SensorAxes,
    Reading::BoxAxes,
    Reading::Relative,
    Reading::Opposite,
    Reading::Exchanged,
    Reading::Mirrored,
    Reading::PolarDegrees,
    Reading::Polar,
];

/// A reported detection.
#[derive(Clone, Copy, Debug)]
struct Seen {
    at: [f64; 2],
    yaw: f64,
}

/// What is needed of the sensor.
#[derive(Clone, Copy, Debug, Default)]
struct Sensor {
    yaw: Option<f64>,
    velocity: Option<[f64; 2]>,
}

impl Reading {
    /// The velocity that is meant, m/s along the axes of the map; `None` where it is not known.
    fn velocity(self, seen: &Seen, reported: [f64; 2], sensor: &Sensor) -> Option<[f64; 2]> {
        /// m/s.
        const KMH: f64 = 1.0 / 3.6;
        const MPH: f64 = 0.447_04;
        let [x, y] = reported;
        Some(match self {
            Self::KilometresPerHour => reported.map(|one| one * KMH),
            Self::MilesPerHour => reported.map(|one| one * MPH),
            Self::SensorAxes => turned(reported, sensor.yaw?),
            Self::BoxAxes => turned(reported, seen.yaw),
            Self::Relative => {
                let [by_x, by_y] = sensor.velocity?;
                [x + by_x, y + by_y]
            }
            Self::Opposite => [-x, -y],
            Self::Exchanged => [y, x],
            Self::Mirrored => [x, -y],
            // A speed is never negative.
            Self::Polar => turned([(x >= 0.0).then_some(x)?, 0.0], y),
            Self::PolarDegrees => turned([(x >= 0.0).then_some(x)?, 0.0], y.to_radians()),
        })
    }
}

fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(angle);
    [x * cos - y * sin, x * sin + y * cos]
}

/// Where a reading and what is said differ.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    n: u64,
    explained: u64,
    explained_as_said: u64,
}

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Velocities {
    before: Option<Box<DetectionFrame>>,
    tallies: [Tally; READINGS.len()],
}

/// What velocities are that are not what they are said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) reading: Reading,
    /// Detections where it makes a difference, and those that it explains.
    pub(super) n: u64,
    pub(super) explained: u64,
}

impl Velocities {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let now = seen.frame;
        if let Some(before) = &self.before {
            let passed = now.captured_at - before.captured_at;
            if passed >= Span::ZERO && passed < APART.0 {
                return;
            }
            if passed >= Span::ZERO && passed <= APART.1 {
                let passed_s = passed.as_secs_f64();
                compare(&mut self.tallies, before, now, passed_s);
            }
        }
        let has_velocities = now.detections.iter().any(|one| one.velocity.is_some());
        self.before = has_velocities.then(|| Box::new(now.clone()));
    }

    /// `None` where they are what they are said to be, or nothing else explains them, or too few were seen.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub(super) fn found(&self) -> Option<Found> {
        let share = |part: u64, of: u64| part as f64 / (of as f64).max(1.0);
        let is_right = |tally: &&(Reading, Tally)| {
            let Tally { n, explained, explained_as_said } = tally.1;
            n >= MIN_DETECTIONS
                && share(explained, n) >= EXPLAINS
                && share(explained_as_said, n) <= EXPLAINS_NOT
        };
        let all: Vec<_> = READINGS.into_iter().zip(self.tallies).collect();
        let right = all.iter().filter(is_right);
        let explains = |tally: &Tally| share(tally.explained, tally.n);
        let (reading, tally) = right.max_by(|(_, a), (_, b)| explains(a).total_cmp(&explains(b)))?;
        Some(Found { reading: *reading, n: tally.n, explained: tally.explained })
    }
}

fn compare(
    tallies: &mut [Tally; READINGS.len()],
    before: &DetectionFrame,
    now: &DetectionFrame,
    passed_s: f64,
) {
    let of = |pose: Option<Pose>| pose.map(|pose| [pose.x, pose.y]);
    let moved = of(before.sensor_pose).zip(of(now.sensor_pose));
    let sensor = Sensor {
        yaw: before.sensor_pose.map(|pose| pose.yaw),
        velocity: moved.map(|(was, is)| [0, 1].map(|axis| (is[axis] - was[axis]) / passed_s)),
    };
    let is_there = |place: [f64; 2], way_m: f64, variance: f64| {
        now.detections.iter().any(|one| {
            let sigma_m = libm::sqrt(variance + one.covariance.position.xx.max(one.covariance.position.yy));
            let near_m = (NEAR_SIGMAS * sigma_m).clamp(NEAR_M.0, NEAR_M.1) + NEAR_SHARE * way_m;
            libm::hypot(one.bev.x - place[0], one.bev.y - place[1]) <= near_m
        })
    };
    let after = |at: [f64; 2], velocity: [f64; 2]| [0, 1].map(|axis| at[axis] + velocity[axis] * passed_s);
    for one in before.detections.iter().take(MAX_DETECTIONS) {
        let seen = Seen { at: [one.bev.x, one.bev.y], yaw: one.bev.yaw };
        let said = one.velocity.as_ref().map(|velocity| [velocity.x, velocity.y]);
        let Some(said) = said.filter(|[x, y]| libm::hypot(*x, *y) >= MOVING_MPS) else { continue };
        let variance = one.covariance.position.xx.max(one.covariance.position.yy);
        let way_m = |velocity: [f64; 2]| libm::hypot(velocity[0], velocity[1]) * passed_s;
        let place_as_said = after(seen.at, said);
        let mut as_said = None;
        for (reading, tally) in READINGS.iter().zip(tallies.iter_mut()) {
            let Some(velocity) = reading.velocity(&seen, said, &sensor) else { continue };
            let place = after(seen.at, velocity);
            if libm::hypot(place[0] - place_as_said[0], place[1] - place_as_said[1]) < DIFFER_M {
                continue;
            }
            let is_as_said = *as_said.get_or_insert_with(|| is_there(place_as_said, way_m(said), variance));
            tally.n += 1;
            tally.explained += u64::from(is_there(place, way_m(velocity), variance));
            tally.explained_as_said += u64::from(is_as_said);
        }
    }
}
