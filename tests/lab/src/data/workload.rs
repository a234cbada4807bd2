//! The load of `lab throughput`: moving objects, reported by many agents, as wire bytes.

use rand::seq::SliceRandom;
use v2x_agent::random::{self, Purpose, keyed_rng};
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};

/// Objects drive on rings about one centre, as on a wide roundabout: none drives through another. The distance of one ring
/// from the next, the radius of the innermost, and the room for each object on its ring, m: together one object for each
/// 100 m².
const RING_SPACING_M: f64 = 5.0;
const INNERMOST_M: f64 = 10.0;
const ROOM_ON_RING_M: f64 = 20.0;
/// Delay of a frame that is not late.
const ON_TIME: Span = Span::from_millis(5);
/// Least and greatest delay of a late frame, ms: up to two and a half newer frames of every other agent arrive before
/// it.
const LATE_MS: (f64, f64) = (60.0, 250.0);
/// Standard deviations of a report: position m, size relative, heading rad.
const SIGMA_POSITION_M: f64 = 0.3;
const SIGMA_SIZE: f64 = 0.1;
const SIGMA_YAW_RAD: f64 = 0.05;
/// True and declared detection probability.
const DETECTION_PROBABILITY: f64 = 0.95;
/// Area for each object, m².
const ROOM_M2: f64 = RING_SPACING_M * ROOM_ON_RING_M;
/// Range of a sensor that sees everything, m.
const UNLIMITED_M: f64 = 5000.0;
/// Objects in a frame of a sensor that sees more: it has several frames then, of a sector each.
const MOST_IN_FRAME: u32 = 3000;
/// Of a full turn: places that are spread evenly over a disc, as the seeds of a sunflower.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105;

/// The size of a load.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    /// Agents, with evenly spread phases.
    pub agents: u32,
    /// Frames of each agent, Hz.
    pub rate_hz: u32,
    /// Objects.
    pub objects: u32,
    /// How many of them an agent sees: those nearest to it, where agents are spread over the area. `None` if every agent is at
    /// the centre and sees all.
    pub view: Option<u32>,
    /// Share of frames that are 60 to 250 ms late.
    pub late_share: f64,
    /// Seed of objects and detections.
    pub seed: u64,
}

impl Load {
    /// Frames of an agent at one time.
    const fn n_sectors(&self) -> u32 {
        let seen = match self.view {
            Some(view) if view < self.objects => view,
            _ => self.objects,
        };
        let n = seen.div_ceil(MOST_IN_FRAME);
        if n == 0 { 1 } else { n }
    }

    /// Where an agent is.
    fn place_of(&self, agent: u32) -> [f64; 2] {
        if self.view.is_none() {
            return [0.0; 2];
        }
        let share = (f64::from(agent) + 0.5) / f64::from(self.agents);
        let radius_m = libm::sqrt(share * f64::from(self.objects) * ROOM_M2 / std::f64::consts::PI);
        let (sin, cos) = libm::sincos(f64::from(agent) * GOLDEN_TURN * std::f64::consts::TAU);
        [radius_m * cos, radius_m * sin]
    }

    /// What a frame of an agent holds at most.
    fn field_of_view(&self) -> FieldOfView {
        let range_max_m = self
            .view
            .map_or(UNLIMITED_M, |view| libm::sqrt(f64::from(view) * ROOM_M2 / std::f64::consts::PI));
        let width_rad = std::f64::consts::TAU / f64::from(self.n_sectors());
        FieldOfView { width_rad, ..FieldOfView::omnidirectional(0.0, range_max_m) }
    }
}

/// A frame as it arrives.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// When, by the hub's clock.
    pub received_at: Timestamp,
    /// The frame's bytes.
    pub bytes: Vec<u8>,
    /// How many detections it holds.
    pub n_detections: u64,
}

/// A load that is generated second by second.
#[derive(Debug)]
pub struct Workload {
    load: Load,
    start: Timestamp,
    orbits: Vec<Orbit>,
    /// Frames that arrive later than the last requested second.
    waiting: Vec<Arrival>,
    next_frame: u64,
}

/// An object that drives on a ring.
#[derive(Clone, Copy, Debug)]
struct Orbit {
    radius_m: f64,
    phase_rad: f64,
    rate_rad_s: f64,
    size: (f64, f64),
}

impl Orbit {
    /// All objects, from the innermost ring outwards. Those of one ring have one speed, and keep their distances.
    fn all(load: &Load) -> Vec<Self> {
        let n = load.objects as usize;
        let mut orbits = Vec::with_capacity(n);
        let mut radius_m = INNERMOST_M;
        while orbits.len() < n {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few")]
            let on_ring = (std::f64::consts::TAU * radius_m / ROOM_ON_RING_M) as u32;
            let first = u32::try_from(orbits.len()).expect("at most as many as objects");
            let rng = &mut keyed_rng(load.seed, None, 0, Purpose::Measurement(ObjectId(first)));
            let direction = if random::chance(rng, 0.5) { 1.0 } else { -1.0 };
            let rate_rad_s = direction * random::uniform(rng, 1.0, 8.0) / radius_m;
            let turn = random::uniform(rng, 0.0, std::f64::consts::TAU);
            orbits.extend((0..on_ring).map(|place| Self {
                radius_m,
                phase_rad: turn + std::f64::consts::TAU * f64::from(place) / f64::from(on_ring),
                rate_rad_s,
                size: (random::uniform(rng, 1.7, 2.0), random::uniform(rng, 4.0, 5.0)),
            }));
            radius_m += RING_SPACING_M;
        }
        orbits.truncate(n);
        orbits
    }

    fn at(&self, t_s: f64) -> BevBox {
        let angle = self.phase_rad + self.rate_rad_s * t_s;
        let quarter_turn = libm::copysign(std::f64::consts::FRAC_PI_2, self.rate_rad_s);
        BevBox {
            x: self.radius_m * libm::cos(angle),
            y: self.radius_m * libm::sin(angle),
            w: self.size.0,
            d: self.size.1,
            yaw: wrap_angle(angle + quarter_turn),
        }
    }
}

impl Workload {
    /// A load that begins at `start`.
    pub fn new(load: Load, start: Timestamp) -> Self {
        Self { load, start, orbits: Orbit::all(&load), waiting: Vec::new(), next_frame: 0 }
    }

    /// The agents' names.
    pub fn agents(&self) -> impl Iterator<Item = AgentId> + use<> {
        (0..self.load.agents).map(agent_name)
    }

    /// The sensor description of each agent.
    pub fn description(&self) -> SensorDescription {
        SensorDescription {
            revision: 1,
            kind: SensorKind::RoadsideUnit,
            field_of_view: self.load.field_of_view(),
            detection_probability: DETECTION_PROBABILITY,
            clutter_per_m2: 1e-6,
            size_noise: None,
            body: None,
            accuracy: Accuracy { position_m: 0.02, yaw_rad: 3e-4, clock_s: 1e-6 },
            rate_hz: self.load.rate_hz.into(),
        }
    }

    /// Everything that arrives before `until`, in order of arrival.
    pub fn arrivals_before(&mut self, until: Timestamp) -> Result<Vec<Arrival>, WireError> {
        let spacing = 1_000_000_000 / i64::from(self.load.agents * self.load.rate_hz);
        loop {
            let number = i64::try_from(self.next_frame).expect("seconds, not centuries");
            let captured_at = self.start + Span::from_nanos(number * spacing);
            if captured_at + ON_TIME >= until {
                break;
            }
            for sector in 0..self.load.n_sectors() {
                let arrival = self.frame(self.next_frame, sector, captured_at)?;
                self.waiting.push(arrival);
            }
            self.next_frame += 1;
        }
        let arrived = self.waiting.extract_if(.., |arrival| arrival.received_at < until);
        let mut arrived: Vec<_> = arrived.collect();
        arrived.sort_by_key(|arrival| arrival.received_at);
        Ok(arrived)
    }

    /// The frame of a sector of the agent whose turn it is.
    fn frame(&self, number: u64, sector: u32, captured_at: Timestamp) -> Result<Arrival, WireError> {
        let agents = u64::from(self.load.agents);
        let agent = u32::try_from(number % agents).expect("below the number of agents");
        let n_sectors = self.load.n_sectors();
        let sequence = number / agents * u64::from(n_sectors) + u64::from(sector);
        let rng = &mut keyed_rng(self.load.seed, Some(&agent_name(agent)), sequence, Purpose::Order);
        let t_s = (captured_at - self.start).as_secs_f64();
        let [x, y] = self.load.place_of(agent);
        let yaw = wrap_angle(std::f64::consts::TAU * f64::from(sector) / f64::from(n_sectors));
        let (pose, view) = (Pose { x, y, yaw }, self.load.field_of_view());
        let visible =
            self.orbits.iter().map(|orbit| orbit.at(t_s)).filter(|bev| view.contains(&pose, bev.x, bev.y));
        let seen: Vec<_> = visible.filter(|_| random::chance(rng, DETECTION_PROBABILITY)).collect();
        let mut detections: Vec<_> = seen.into_iter().map(|truth| report(&truth, rng)).collect();
        detections.shuffle(rng);
        let is_late = random::chance(rng, self.load.late_share);
        let late_ms = random::uniform(rng, LATE_MS.0, LATE_MS.1);
        let delay = if is_late { Span::from_secs_f64(late_ms * 1e-3) } else { ON_TIME };
        let n_detections = detections.len() as u64;
        let frame = DetectionFrame {
            id: FrameId { agent: agent_name(agent), epoch: 1, sequence },
            captured_at,
            sensor_pose: Some(pose),
            sensor_revision: 1,
            map_frame: None,
            detections,
        };
        let mut bytes = Vec::new();
        wire::detections::encode(&frame, &mut bytes)?;
        Ok(Arrival { received_at: captured_at + delay, bytes, n_detections })
    }
}

fn agent_name(number: u32) -> AgentId {
    AgentId::new(&format!("agent-{number:04}")).expect("letters and digits")
}

fn report(truth: &BevBox, rng: &mut rand_chacha::ChaCha8Rng) -> Detection {
    let mut normal = || random::standard_normal(rng);
    let (w, d) = (truth.w * (1.0 + SIGMA_SIZE * normal()), truth.d * (1.0 + SIGMA_SIZE * normal()));
    let bev = BevBox {
        x: truth.x + SIGMA_POSITION_M * normal(),
        y: truth.y + SIGMA_POSITION_M * normal(),
        w,
        d,
        yaw: wrap_angle(truth.yaw + SIGMA_YAW_RAD * normal()),
    };
    let variance = |value: f64| value * value;
    let covariance = BoxCovariance {
        position: Covariance2::isotropic(SIGMA_POSITION_M),
        ww: variance(SIGMA_SIZE * w),
        dd: variance(SIGMA_SIZE * d),
        yaw: variance(SIGMA_YAW_RAD),
    };
    Detection {
        class: Class::Car,
        score: 0.9,
        bev,
        covariance,
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_arrives_once_and_the_given_fraction_is_late() {
        let load = Load { agents: 5, rate_hz: 10, objects: 3, view: None, late_share: 0.2, seed: 1 };
        let start = Timestamp::EPOCH;
        let mut workload = Workload::new(load, start);
        let mut arrivals = Vec::new();
        for second in 1..=20 {
            arrivals.extend(workload.arrivals_before(start + Span::from_millis(1000 * second)).unwrap());
        }
        assert!(arrivals.is_sorted_by_key(|arrival| arrival.received_at));
        let frames: Vec<_> =
            arrivals.iter().map(|arrival| wire::detections::decode(&arrival.bytes).unwrap()).collect();
        let late = frames.iter().zip(&arrivals);
        let late = late.filter(|(frame, arrival)| arrival.received_at - frame.captured_at > ON_TIME).count();
        // 1000 frames, standard deviation 1.3 %: four of them.
        assert!((990..=1000).contains(&frames.len()), "{} frames", frames.len());
        assert!((148..=252).contains(&late), "{late} of 1000 are late");
    }

    #[test]
    fn no_object_drives_through_another() {
        for objects in [1, 100, 700] {
            let orbits =
                Orbit::all(&Load { agents: 1, rate_hz: 10, objects, view: None, late_share: 0.0, seed: 7 });
            assert_eq!(orbits.len(), objects as usize);
            for second in 0..60 {
                let boxes: Vec<_> = orbits.iter().map(|orbit| orbit.at(f64::from(second))).collect();
                for (place, a) in boxes.iter().enumerate() {
                    let nearest = boxes[..place].iter().map(|b| libm::hypot(a.x - b.x, a.y - b.y));
                    let nearest = nearest.fold(f64::INFINITY, f64::min);
                    assert!(nearest > 4.9, "{nearest} m at {second} s");
                }
            }
        }
    }

    /// The frames of one round of all agents.
    fn round(load: Load) -> Vec<DetectionFrame> {
        let mut workload = Workload::new(load, Timestamp::EPOCH);
        let arrivals = workload.arrivals_before(Timestamp::EPOCH + Span::from_millis(100)).unwrap();
        arrivals.iter().map(|arrival| wire::detections::decode(&arrival.bytes).unwrap()).collect()
    }

    #[test]
    fn an_agent_with_a_view_sees_about_so_many_objects_all_within_its_range() {
        let load = Load { agents: 20, rate_hz: 10, objects: 500, view: Some(50), late_share: 0.0, seed: 1 };
        let range_m = load.field_of_view().range_max_m;
        let frames = round(load);
        assert!((19..=20).contains(&frames.len()), "{}", frames.len());
        let seen: usize = frames.iter().map(|frame| frame.detections.len()).sum();
        // Those at the rim see less.
        assert!((30..=50).contains(&(seen / frames.len())), "{seen}");
        for frame in &frames {
            let pose = frame.sensor_pose.unwrap();
            let far = frame.detections.iter().map(|one| pose.distance_to(one.bev.x, one.bev.y));
            assert!(far.fold(0.0, f64::max) < range_m + 3.0);
        }
    }

    #[test]
    fn more_objects_than_a_frame_holds_come_in_several_frames_each_object_once() {
        let load = Load { agents: 1, rate_hz: 10, objects: 20_000, view: None, late_share: 0.0, seed: 1 };
        let frames = round(load);
        assert_eq!(frames.len(), 7);
        assert!(frames.iter().all(|frame| frame.detections.len() <= 4096));
        let seen: usize = frames.iter().map(|frame| frame.detections.len()).sum();
        // One standard deviation is 31.
        assert!((18_850..=19_150).contains(&seen), "{seen}");
    }
}
