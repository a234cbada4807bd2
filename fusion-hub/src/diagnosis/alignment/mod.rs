//! Whether two agents report the same objects at the same places.
//!
//! Some frames of each agent are kept, and of a bounded number of pairs of agents those that were captured at one time are
//! compared: [`fit`] looks for the change of one agent's positions that brings most of them onto those of the other one.

pub(super) mod change;
pub(super) mod fit;
mod pairs;
mod scale;
mod search;
pub(super) mod sizes;
mod squares;
mod times;

use super::headings::Moving;
use super::observation::Observation;
use super::steps;
use pairs::Place;
use std::collections::BTreeMap;
use v2x_common::class::ClassGroup;
use v2x_common::detection::Detection;
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Frames captured within this are of one time: half the interval of 10 Hz, and some jitter.
const AT_ONE_TIME: Span = Span::from_millis(60);
/// Frames that are kept of one agent, and of all.
const MAX_SIGHTINGS: usize = 96;
const MAX_ALL_SIGHTINGS: usize = 2048;
/// Pairs of frames of two agents that are compared, this far apart, until they hold so many detections.
const MAX_SNAPSHOTS: usize = 48;
const ENOUGH_SPOTS: usize = 400;
const APART: Span = Span::from_millis(300);
/// Fewest frames with one before and one after them that say how much lasts.
const MIN_FOLLOWED: usize = 6;
/// Frames of one agent so far apart are those before and after each other.
const FOLLOWED: (Span, Span) = (Span::from_millis(250), Span::from_millis(900));
/// Detections of a frame that are kept.
const MAX_SPOTS: usize = 32;

/// A detection moves as the nearest object within this: an agent whose clock is off by a third of a second is off by it, m.
const MOVED_M: f64 = 4.0;

/// What is at least so fast moves, m/s; what stands has such a velocity at its first detections at most, and not in one of so many.
const MOVES_MPS: f64 = 1.0;
const ONE_OF: usize = 20;
/// What is slower shows by where it has been: in one of so many cases further than this from all places of the first third of a window, m, and
/// standard deviations of how positions scatter.
const MOVED_ONE_OF: usize = 10;
const MOVED_AWAY_M: f64 = 1.5;
const MOVED_SIGMAS: f64 = 3.0;
/// By its own places something moves otherwise than what is published near it, m/s.
const OTHERWISE_MPS: f64 = 3.0;
/// The window must last so long.
const MOVED_IN: Span = Span::from_millis(5_000);

/// A detection, as far as it is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// m
    pub(super) at: [f64; 2],
    /// m/s; zero where it is not known.
    pub(super) velocity: [f64; 2],
    /// Variance of the position, m².
    pub(super) variance: f64,
    /// Width and depth of a vehicle, m; `None` of other things, and where it is not given.
    pub(super) size: Option<[f64; 2]>,
}

/// One agent's detections of one time.
#[derive(Clone, Debug)]
pub(super) struct Sighting {
    captured_at: Timestamp,
    pub(super) pose: Option<Pose>,
    pub(super) spots: Vec<Spot>,
}

/// Two agents' detections of one time.
pub(super) type Snapshot = [Sighting; 2];

/// Frames of each agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Snapshots {
    of_agents: BTreeMap<AgentId, Vec<Sighting>>,
    n: usize,
}

impl Snapshots {
    pub(super) fn note(&mut self, seen: &Observation<'_>, moving: &Moving) {
        if self.n >= MAX_ALL_SIGHTINGS {
            return;
        }
        let of_agent = self.of_agents.entry(seen.frame.id.agent).or_default();
        if of_agent.len() >= MAX_SIGHTINGS {
            return;
        }
        let sighting = Sighting::of(seen, moving);
        if !sighting.spots.is_empty() {
            of_agent.push(sighting);
            self.n += 1;
        }
    }

    /// The pairs of agents to compare, those first that are compared in any case; as far as it can be those of `before`.
    pub(super) fn pairs(&self, before: &[[AgentId; 2]]) -> Vec<[AgentId; 2]> {
        let places: Vec<_> = self.of_agents.iter().filter_map(|(agent, seen)| place(*agent, seen)).collect();
        pairs::choose(&places, before)
    }

    /// How many detections of a frame of an agent are there in the frames before and after it, too, in the mean: objects, and no
    /// clutter. Zero where frames are too few or too far apart to say so.
    #[expect(clippy::cast_precision_loss, reason = "some thousand at most")]
    pub(super) fn lasting(&self, agent: &AgentId) -> f64 {
        let mut all: Vec<_> = self.of_agents.get(agent).into_iter().flatten().collect();
        all.sort_by_key(|sighting| sighting.captured_at);
        let (mut frames, mut lasting) = (0_usize, 0_usize);
        for three in all.windows(3) {
            let Some(Three { places, steps_s }) = places_and_steps([three[0], three[1], three[2]]) else {
                continue;
            };
            let places = places.each_ref().map(|one| &one[..]);
            frames += 1;
            lasting +=
                (0..places[1].len()).filter(|n| steps::velocity(*n, places, steps_s).is_some()).count();
        }
        if frames < MIN_FOLLOWED { 0.0 } else { lasting as f64 / frames as f64 }
    }

    /// Whether some of what an agent sees moves, whose positions scatter so from frame to frame, m.
    pub(super) fn has_motion(&self, agent: &AgentId, scatter_m: f64) -> bool {
        let Some(seen) = self.of_agents.get(agent) else { return false };
        let spots = seen.iter().flat_map(|sighting| &sighting.spots);
        let (mut n, mut moving) = (0_usize, 0_usize);
        for spot in spots {
            n += 1;
            moving += usize::from(libm::hypot(spot.velocity[0], spot.velocity[1]) >= MOVES_MPS);
        }
        (n > 0 && moving * ONE_OF >= n) || has_moved(seen, scatter_m)
    }

    /// Frames of two agents that were captured at one time.
    pub(super) fn of(&self, [first, second]: &[AgentId; 2]) -> Vec<Snapshot> {
        // Of a hub that has just begun no speed is known; own places do not know all.
        let moves = |spot: &Spot| libm::hypot(spot.velocity[0], spot.velocity[1]) >= MOVES_MPS;
        let is_published = [first, second].iter().any(|agent| {
            let seen = self.of_agents.get(*agent).into_iter().flatten();
            seen.flat_map(|sighting| &sighting.spots).any(moves)
        });
        let of_agent = |agent| {
            let mut all: Vec<Sighting> = self.of_agents.get(agent).cloned().unwrap_or_default();
            all.sort_by_key(|sighting| sighting.captured_at);
            if is_published { with_own_velocities(all) } else { all }
        };
        let (firsts, seconds) = (of_agent(first), of_agent(second));
        let (mut snapshots, mut spots): (Vec<Snapshot>, usize) = (Vec::new(), 0);
        for sighting in &firsts {
            let is_later =
                snapshots.last().is_none_or(|[last, _]| sighting.captured_at - last.captured_at >= APART);
            let off = |theirs: &&Sighting| (theirs.captured_at - sighting.captured_at).abs();
            let theirs = seconds.iter().min_by_key(off).filter(|theirs| off(theirs) <= AT_ONE_TIME);
            if let Some(theirs) = theirs.filter(|_| is_later) {
                spots += sighting.spots.len();
                snapshots.push([sighting.clone(), theirs.at_time_of(sighting)]);
            }
            if snapshots.len() >= MAX_SNAPSHOTS || spots >= ENOUGH_SPOTS {
                break;
            }
        }
        snapshots
    }
}

/// Whether some of what was seen last is where nothing was at first: what walks is slower than velocities show in each frame.
fn has_moved(seen: &[Sighting], scatter_m: f64) -> bool {
    let times = || seen.iter().map(|sighting| sighting.captured_at);
    let Some((from, to)) = times().min().zip(times().max()).filter(|(from, to)| *to - *from >= MOVED_IN)
    else {
        return false;
    };
    let third = Span::from_secs_f64((to - from).as_secs_f64() / 3.0);
    let first: Vec<_> = seen.iter().filter(|sighting| sighting.captured_at <= from + third).collect();
    let reach_m = MOVED_AWAY_M.max(MOVED_SIGMAS * scatter_m);
    let was_there = |[x, y]: [f64; 2]| {
        let mut places = first.iter().flat_map(|sighting| &sighting.spots);
        places.any(|was| libm::hypot(was.at[0] - x, was.at[1] - y) <= reach_m)
    };
    let last = seen.iter().filter(|sighting| sighting.captured_at >= to - third);
    let (mut n, mut moved) = (0_usize, 0_usize);
    for spot in last.flat_map(|sighting| &sighting.spots) {
        n += 1;
        moved += usize::from(!was_there(spot.at));
    }
    n > 0 && moved * MOVED_ONE_OF >= n
}

/// Three frames of one agent, one after the other.
struct Three {
    /// Where their detections are, m.
    places: [Vec<[f64; 2]>; 3],
    /// The times between them, s.
    steps_s: [f64; 2],
}

/// Frames in the order of their times, where what moves otherwise than what is published near it has its velocity by its own places before and
/// after: of objects that are far from where others see them nothing may be published.
fn with_own_velocities(mut all: Vec<Sighting>) -> Vec<Sighting> {
    let mut found = Vec::new();
    for (k, three) in all.windows(3).enumerate() {
        let Some(Three { places, steps_s }) = places_and_steps([&three[0], &three[1], &three[2]]) else {
            continue;
        };
        let places = places.each_ref().map(|one| &one[..]);
        for (n, spot) in three[1].spots.iter().enumerate() {
            let own = steps::velocity(n, places, steps_s);
            let differ = |own: &[f64; 2]| libm::hypot(own[0] - spot.velocity[0], own[1] - spot.velocity[1]);
            found.extend(own.filter(|own| differ(own) >= OTHERWISE_MPS).map(|own| (k + 1, n, own)));
        }
    }
    for (k, n, velocity) in found {
        all[k].spots[n].velocity = velocity;
    }
    all
}

/// Three frames; `None` where they are not one after the other.
fn places_and_steps(three: [&Sighting; 3]) -> Option<Three> {
    let steps = [0, 1].map(|step| three[step + 1].captured_at - three[step].captured_at);
    let are_near = steps.iter().all(|step| (FOLLOWED.0..=FOLLOWED.1).contains(step));
    let places = |one: &Sighting| one.spots.iter().map(|spot| spot.at).collect();
    are_near.then(|| Three { places: three.map(places), steps_s: steps.map(Span::as_secs_f64) })
}

/// The size that is given of a vehicle, m. One that is exactly that of its class stands where none was given.
fn size(one: &Detection) -> Option<[f64; 2]> {
    let (w, d) = (one.bev.w, one.bev.d);
    let (of_class_w, of_class_d) = one.class.typical_size();
    let is_given = w.total_cmp(&of_class_w).is_ne() && d.total_cmp(&of_class_d).is_ne();
    let is_vehicle = one.class.group() == ClassGroup::FourWheeled;
    (is_vehicle && is_given && w.is_finite() && d.is_finite() && w > 0.0 && d > 0.0).then_some([w, d])
}

/// Where an agent is, and where the objects are that it reports.
fn place(agent: AgentId, seen: &[Sighting]) -> Option<Place> {
    let spots = seen.iter().flat_map(|sighting| &sighting.spots);
    let (sum, n) =
        spots.fold(([0.0; 2], 0_u32), |(sum, n), spot| ([sum[0] + spot.at[0], sum[1] + spot.at[1]], n + 1));
    let sensor = seen.last()?.pose.map(|pose| [pose.x, pose.y]);
    Some(Place { agent, sensor, objects: sum.map(|sum| sum / f64::from(n.max(1))) })
}

impl Sighting {
    fn of(seen: &Observation<'_>, moving: &Moving) -> Self {
        let frame = seen.frame;
        let detections = frame.detections.iter().take(MAX_SPOTS);
        let spots = detections.map(|one| {
            let (at, position) = ([one.bev.x, one.bev.y], one.covariance.position);
            // Where no object is near, as its clock is off by far, it moves as the detection says.
            let reported = || one.velocity.map(|velocity| [velocity.x, velocity.y]);
            let fused = moving.velocity_at(at, frame.captured_at, MOVED_M);
            let velocity = fused.or_else(reported);
            Spot {
                at,
                velocity: velocity.unwrap_or_default(),
                variance: f64::midpoint(position.xx, position.yy),
                size: size(one),
            }
        });
        let is_place = |spot: &Spot| {
            let of_place = spot.at.iter().chain(&spot.velocity);
            of_place.chain([&spot.variance]).all(|one| one.is_finite())
        };
        Self {
            captured_at: frame.captured_at,
            pose: frame.sensor_pose,
            spots: spots.filter(is_place).collect(),
        }
    }

    /// The same objects as they are when another frame was captured.
    fn at_time_of(&self, other: &Self) -> Self {
        let by_s = (other.captured_at - self.captured_at).as_secs_f64();
        let moved =
            |spot: &Spot| Spot { at: [0, 1].map(|axis| spot.at[axis] + by_s * spot.velocity[axis]), ..*spot };
        Self { spots: self.spots.iter().map(moved).collect(), ..*self }
    }

    #[cfg(test)]
    pub(super) fn new(pose: Option<Pose>, spots: Vec<Spot>) -> Self {
        Self { captured_at: Timestamp::EPOCH, pose, spots }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_does_not_move_though_its_first_velocities_are_noise() {
        let agent = AgentId::new("a").unwrap();
        let has_motion = |speeds: &[f64]| {
            let spots = speeds.iter().map(|speed| Spot {
                at: [0.0; 2],
                velocity: [0.0, *speed],
                variance: 1.0,
                size: None,
            });
            let seen = vec![Sighting::new(None, spots.collect())];
            Snapshots { of_agents: [(agent, seen)].into(), n: 1 }.has_motion(&agent, 0.0)
        };
        let mut standing = vec![0.1; 30];
        standing[0] = 2.0;
        assert!(!has_motion(&standing) && !has_motion(&[]));
        standing[10..13].fill(-2.0);
        assert!(has_motion(&standing));
        assert!(!Snapshots::default().has_motion(&agent, 0.0));
    }

    #[test]
    fn what_goes_at_walking_pace_moves_whatever_its_velocities_are_taken_for_and_what_scatters_in_its_place_does_not()
     {
        let agent = AgentId::new("a").unwrap();
        let has_motion = |place: &dyn Fn(f64) -> [f64; 2], scatter_m: f64| {
            let sighting = |k: u32| {
                let t = 0.4 * f64::from(k);
                let spot = Spot { at: place(t), velocity: [0.0; 2], variance: 1.0, size: None };
                let standing = Spot { at: [50.0, 0.0], ..spot };
                Sighting {
                    captured_at: Timestamp::EPOCH + Span::from_secs_f64(t),
                    pose: None,
                    spots: vec![spot, standing],
                }
            };
            let seen = (0..24).map(sighting).collect();
            Snapshots { of_agents: [(agent, seen)].into(), n: 24 }.has_motion(&agent, scatter_m)
        };
        for speed_mps in [0.6, 1.0, 2.0] {
            assert!(has_motion(&|t| [speed_mps * t, 3.0], 0.0), "{speed_mps} m/s");
        }
        assert!(!has_motion(&|_| [10.0, 3.0], 0.0));
        let scattered = |t: f64| [2.0 * libm::sin(37.0 * t * t), 2.0 * libm::cos(53.0 * t)];
        assert!(!has_motion(&scattered, 1.4));
    }
}
