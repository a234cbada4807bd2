//! Whether two agents report the same objects at the same places.
//!
//! Of pairs of agents, frames that were captured at one time are kept: a few of each pair. [`fit`] looks for the change of
//! one agent's positions that brings most of them onto those of the other one.

pub(super) mod change;
pub(super) mod fit;

use super::headings::Moving;
use super::observation::Observation;
use std::collections::{BTreeMap, VecDeque};
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Frames captured within this are of one time: half the interval of 10 Hz, and some jitter.
const AT_ONE_TIME: Span = Span::from_millis(60);
/// Frames of an agent that wait for late ones of others.
const N_RECENT: usize = 8;
/// Pairs of frames of two agents that are kept, this far apart, until they hold so many detections.
const MAX_SNAPSHOTS: usize = 48;
const ENOUGH_SPOTS: usize = 400;
const APART: Span = Span::from_millis(300);
/// Detections of a frame that are kept.
const MAX_SPOTS: usize = 32;
/// Pairs of agents that are compared in one window, and partners of each agent among them.
const MAX_PAIRS: usize = 20;
const MAX_PARTNERS: usize = 5;

/// A detection moves as the nearest object within this: an agent whose clock is off by a third of a second is off by it, m.
const MOVED_M: f64 = 4.0;

/// A detection, as far as it is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// m
    pub(super) at: [f64; 2],
    /// m/s; zero where it is not known.
    pub(super) velocity: [f64; 2],
    /// Variance of the position, m².
    pub(super) variance: f64,
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

/// The newest frames of each agent, and what is kept of pairs.
#[derive(Clone, Debug, Default)]
pub(super) struct Snapshots {
    recent: BTreeMap<AgentId, VecDeque<Sighting>>,
    pairs: BTreeMap<[AgentId; 2], Vec<Snapshot>>,
}

impl Snapshots {
    pub(super) fn note(&mut self, seen: &Observation<'_>, moving: &Moving) {
        let agent = seen.frame.id.agent;
        let sighting = Sighting::of(seen, moving);
        if sighting.spots.is_empty() {
            return;
        }
        for (other, theirs) in self.recent.iter().filter(|(other, _)| **other != agent) {
            let off = |theirs: &&Sighting| (theirs.captured_at - sighting.captured_at).abs();
            let nearest = theirs.iter().min_by_key(off).filter(|theirs| off(theirs) <= AT_ONE_TIME);
            let Some(theirs) = nearest else { continue };
            let (pair, snapshot) = if agent < *other {
                ([agent, *other], [&sighting, theirs])
            } else {
                ([*other, agent], [theirs, &sighting])
            };
            if is_wanted(&self.pairs, &pair, sighting.captured_at) {
                let [first, second] = snapshot;
                let snapshot = [first.clone(), second.at_time_of(first)];
                self.pairs.entry(pair).or_default().push(snapshot);
            }
        }
        let recent = self.recent.entry(agent).or_default();
        if recent.len() >= N_RECENT {
            recent.pop_front();
        }
        recent.push_back(sighting);
    }

    /// The pairs of which anything is kept.
    pub(super) fn pairs(&self) -> impl Iterator<Item = &[AgentId; 2]> {
        self.pairs.keys()
    }

    /// What is kept of a pair.
    pub(super) fn of(&self, pair: &[AgentId; 2]) -> Option<&[Snapshot]> {
        self.pairs.get(pair).map(Vec::as_slice)
    }
}

fn is_wanted(pairs: &BTreeMap<[AgentId; 2], Vec<Snapshot>>, pair: &[AgentId; 2], at: Timestamp) -> bool {
    if let Some(known) = pairs.get(pair) {
        let is_later = known.last().is_none_or(|[last, _]| (at - last.captured_at).abs() >= APART);
        let spots: usize = known.iter().map(|[first, _]| first.spots.len()).sum();
        return known.len() < MAX_SNAPSHOTS && spots < ENOUGH_SPOTS && is_later;
    }
    let partners = |agent: &AgentId| pairs.keys().filter(|pair| pair.contains(agent)).count();
    pairs.len() < MAX_PAIRS && pair.iter().any(|agent| partners(agent) < MAX_PARTNERS)
}

impl Sighting {
    fn of(seen: &Observation<'_>, moving: &Moving) -> Self {
        let frame = seen.frame;
        let detections = frame.detections.iter().take(MAX_SPOTS);
        let spots = detections.map(|one| {
            let (at, position) = ([one.bev.x, one.bev.y], one.covariance.position);
            let velocity = moving.velocity_at(at, frame.captured_at, MOVED_M).unwrap_or_default();
            Spot { at, velocity, variance: f64::midpoint(position.xx, position.yy) }
        });
        let is_place = |spot: &Spot| spot.at.iter().all(|one| one.is_finite()) && spot.variance.is_finite();
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
