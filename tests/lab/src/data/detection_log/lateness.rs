//! Frames of a log that arrive later than they did, by a time that is drawn.

use super::Arrival;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// How much later frames arrive: by a time from the least to the most, each as likely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// Whose; `None` for those that are not named.
    pub sensor: Option<AgentId>,
    /// The least.
    pub least: Span,
    /// The most.
    pub most: Span,
}

/// Frames on the way, in the order in which they arrive. The same seed and log give the same times.
#[derive(Debug)]
pub(super) struct Lateness {
    delays: Vec<Delay>,
    rng: ChaCha8Rng,
    n_drawn: u64,
    on_the_way: BTreeMap<(Timestamp, u64), Arrival>,
}

impl Lateness {
    pub(super) fn new(delays: Vec<Delay>, seed: u64) -> Self {
        Self { delays, rng: ChaCha8Rng::seed_from_u64(seed), n_drawn: 0, on_the_way: BTreeMap::new() }
    }

    /// Sends a frame on its way. Each is sent after those that arrived before it in the log.
    pub(super) fn send(&mut self, mut arrival: Arrival) {
        let of = |sensor: Option<AgentId>| self.delays.iter().rfind(|delay| delay.sensor == sensor);
        if let Some(Delay { least, most, .. }) = of(Some(arrival.frame.id.agent)).or_else(|| of(None)) {
            let nanoseconds = self.rng.random_range(least.as_nanos()..=most.as_nanos());
            arrival.received_at += Span::from_nanos(nanoseconds);
        }
        self.on_the_way.insert((arrival.received_at, self.n_drawn), arrival);
        self.n_drawn += 1;
    }

    /// When the next one arrives.
    pub(super) fn next_at(&self) -> Option<Timestamp> {
        self.on_the_way.first_key_value().map(|((at, _), _)| *at)
    }

    /// The next one.
    pub(super) fn receive(&mut self) -> Option<Arrival> {
        self.on_the_way.pop_first().map(|(_, arrival)| arrival)
    }
}
