//! Whether an agent publishes what another one has: then its detections are, to the millimetre, where those of the other one were.
//!
//! Two sensors' errors differ: that two detections are at one place to the millimetre is no chance. What stands can be at one place in
//! exact reports, such as a simulation's; so only places count at which its agent has not seen anything before.

use super::observation::Observation;
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Frames are remembered that arrive in the first part of each slot: the length divides no usual interval of sensors.
const SLOT: Span = Span::from_millis(410);
const FIRST_PART: Span = Span::from_millis(130);
/// A copy comes within this after what it copies.
const REMEMBERED: Span = Span::from_millis(2_000);
/// Places that are remembered, and detections of a frame that are looked at.
const MAX_PLACES: usize = 8_192;
const MAX_DETECTIONS: usize = 12;
/// A copy has so many places of one frame, and this share of its own. On the wire positions are whole millimetres.
const LEAST_FOUND: usize = 2;
const MOST: f64 = 0.9;

/// Where whose detections were, by millimetres.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    places: BTreeMap<[i64; 2], Place>,
    slot: Option<Timestamp>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    agent: AgentId,
    at: Timestamp,
    captured_at: Timestamp,
    /// Its agent has seen something there before.
    stands: bool,
}

impl Places {
    /// Takes in a frame; the agent whose frame it repeats, where it does.
    pub(super) fn note(&mut self, seen: &Observation<'_>) -> Option<AgentId> {
        let now = seen.received_at;
        let slot = now.floor_to(SLOT);
        if self.slot != Some(slot) {
            self.places.retain(|_, place| (now - place.at).abs() <= REMEMBERED);
            self.slot = Some(slot);
        }
        let keys: Vec<_> =
            seen.frame.detections.iter().take(MAX_DETECTIONS).map(|one| key(one.bev.x, one.bev.y)).collect();
        let of_whom = self.of_whom(seen, &keys);
        if now - slot < FIRST_PART && of_whom.is_none() {
            self.remember(seen, &keys);
        }
        of_whom
    }

    #[expect(clippy::cast_precision_loss, reason = "a few")]
    fn of_whom(&self, seen: &Observation<'_>, keys: &[[i64; 2]]) -> Option<AgentId> {
        let own = seen.frame.id.agent;
        let others = || {
            keys.iter()
                .filter_map(|key| self.places.get(key))
                .filter(|place| place.agent != own && !place.stands)
        };
        let first = others().next()?;
        let is_of_one = |place: &&Place| place.agent == first.agent && place.captured_at == first.captured_at;
        let n_found = others().filter(is_of_one).count();
        (n_found >= LEAST_FOUND && n_found as f64 >= MOST * keys.len() as f64).then_some(first.agent)
    }

    fn remember(&mut self, seen: &Observation<'_>, keys: &[[i64; 2]]) {
        let (agent, at, captured_at) = (seen.frame.id.agent, seen.received_at, seen.frame.captured_at);
        for key in keys {
            if self.places.len() >= MAX_PLACES && !self.places.contains_key(key) {
                return;
            }
            let known = self.places.get(key);
            let stands = known.is_some_and(|place| place.stands || place.captured_at != captured_at);
            self.places.insert(*key, Place { agent, at, captured_at, stands });
        }
    }
}

/// A place in whole millimetres.
#[expect(clippy::cast_possible_truncation, reason = "saturates, and what is no number is 0")]
fn key(x: f64, y: f64) -> [i64; 2] {
    [x, y].map(|one| libm::round(1e3 * one) as i64)
}
