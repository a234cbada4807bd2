//! From an observation to its arrival: what of it is sent, when it leaves, and what the link does to it.
//!
//! Total delay = sensing (the detector's time) + waiting for an opportunity to send + link, all in true time.

mod inclusion;
mod slots;

pub use inclusion::{InclusionRules, LONGEST_SILENCE, Sighting};
pub use slots::Slots;

use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

use crate::link::{Link, Parcel, Transit};
use crate::random::{Purpose, keyed_rng};
use crate::scenario::{Phase, Rate};
use crate::sensor::{Boot, Observation, SimulatedAgent};

/// When frames that are ready leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transmit {
    /// At once.
    #[default]
    Immediately,
    /// At the next opportunity.
    Slotted {
        /// From one opportunity to the next.
        period: Span,
        /// One of them, since the scenario's start.
        phase: Phase,
    },
}

/// What of its detections an agent sends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SendRule {
    /// All of them, in each frame.
    #[default]
    Periodic,
    /// By [`InclusionRules`].
    Etsi,
}

impl SendRule {
    /// Probability that an object in the field of view is reported in a frame, where it is detected with `detected`.
    ///
    /// By ETSI's rules an object can stay away for as many frames as there are in [`LONGEST_SILENCE`], and a hub must
    /// not take that for misses: what is told of the sensor is the least share of frames that the rules guarantee.
    /// The rate of clutter is told as without rules: frames with a false detection are always sent, so those that are
    /// sent have a little more of it where many are not.
    pub fn report_probability(self, detected: f64, rate: Rate) -> f64 {
        match self {
            Self::Periodic => detected,
            Self::Etsi => detected / f64::from(rate.frames_in_a_second()),
        }
    }
}

/// What becomes of a frame.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "taken apart at once, and nearly always the large one")]
pub enum Fate {
    /// There is nothing in it that had to be sent.
    Withheld,
    /// The link lost it.
    Lost,
    /// It arrives.
    Arrives {
        /// When, true Unix time.
        at: Timestamp,
        /// What is left of it.
        observation: Observation,
    },
}

/// One agent's way to the network. Frames are put through it in their order: the rules of inclusion remember.
#[derive(Clone, Debug)]
pub struct Sender {
    link: Link,
    slots: Option<Slots>,
    rules: Option<InclusionRules>,
}

impl Sender {
    /// The agent's own.
    pub fn new(agent: &SimulatedAgent) -> Self {
        let (config, Boot { seed, .. }) = (agent.config(), agent.boot());
        let slots = match config.transmit {
            Transmit::Immediately => None,
            Transmit::Slotted { period, phase } => {
                let mut rng = keyed_rng(seed, Some(&config.id), 0, Purpose::TransmitPhase);
                Some(Slots { period, phase: phase.within(period, &mut rng) })
            }
        };
        Self {
            link: Link::new(config.link.clone(), seed, config.id),
            slots,
            rules: (config.send == SendRule::Etsi).then(InclusionRules::default),
        }
    }

    /// Its link.
    pub const fn link(&self) -> &Link {
        &self.link
    }

    /// What becomes of the agent's frame of this number.
    pub fn send(&mut self, agent: &SimulatedAgent, sequence: u64) -> Fate {
        let is_size_needed = self.link.config().rate_bps.is_some();
        // Without rules and where size is of no matter a frame's fate is known before the frame is.
        let observation = match &mut self.rules {
            None => is_size_needed.then(|| agent.observe(sequence)),
            Some(rules) => match included(agent, sequence, rules) {
                None => return Fate::Withheld,
                included => included,
            },
        };
        let sent_at = self.sent_at(agent, sequence);
        let bytes = if is_size_needed { observation.as_ref().map_or(0, wire_bytes) } else { 0 };
        match self.link.transit(Parcel { sequence, since_start: sent_at - agent.boot().start, bytes }) {
            Transit::Lost => Fate::Lost,
            Transit::Delivered { delay } => {
                let observation = observation.unwrap_or_else(|| agent.observe(sequence));
                Fate::Arrives { at: sent_at + delay, observation }
            }
        }
    }

    /// When the frame of this number leaves, true Unix time.
    pub fn sent_at(&self, agent: &SimulatedAgent, sequence: u64) -> Timestamp {
        let Boot { seed, start, .. } = agent.boot();
        let captured = agent.capture_time(sequence) - start;
        let mut rng = keyed_rng(seed, Some(&agent.config().id), sequence, Purpose::Sensing);
        let ready = captured + Span::from_secs_f64(agent.config().sensing.draw(&mut rng, captured));
        start + self.slots.map_or(ready, |slots| slots.at_or_after(ready))
    }
}

/// The frame with what the rules let into it; `None` where it is not sent.
fn included(agent: &SimulatedAgent, sequence: u64, rules: &mut InclusionRules) -> Option<Observation> {
    let mut observation = agent.observe(sequence);
    let mut objects = Vec::new();
    agent.objects_at_capture(sequence, &mut objects);
    let named = observation.identities.objects.iter().zip(&observation.frame.detections);
    let sightings: Vec<Sighting> = named
        .map(|(id, detection)| match id {
            Some(_) if *id == agent.own_object() => Sighting::Own,
            // A world lists its objects by id.
            Some(id) => match objects.binary_search_by_key(id, |object| object.id) {
                Ok(place) => Sighting::Object(objects[place]),
                Err(_) => Sighting::Phantom(detection.class),
            },
            None => Sighting::Phantom(detection.class),
        })
        .collect();
    let chosen = rules.choose(agent.capture_time(sequence) - agent.boot().start, &sightings)?;
    keep(&mut observation.identities.objects, &chosen);
    keep(&mut observation.frame.detections, &chosen);
    Some(observation)
}

fn keep<T>(items: &mut Vec<T>, chosen: &[bool]) {
    let mut chosen = chosen.iter();
    items.retain(|_| chosen.next().copied().unwrap_or(false));
}

/// The frame's size on the wire, bytes; 0 for one that the wire cannot hold.
fn wire_bytes(observation: &Observation) -> usize {
    let mut buffer = Vec::new();
    wire::detections::encode(&observation.frame, &mut buffer).map_or(0, |()| buffer.len())
}

#[cfg(test)]
mod tests;
