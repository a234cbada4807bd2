//! From a captured frame to its arrival: which detections are sent, when the frame is sent, and what the link does to it.
//!
//! Total delay = sensing (the detector's processing time) + waiting for an opportunity to send + link, all in true time.

mod config;
mod inclusion;
mod slots;

pub use config::{SendRule, SendingConfig, Transmit};
pub use inclusion::LONGEST_SILENCE;
use inclusion::{InclusionRules, Subject};
use slots::Slots;

use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

use crate::link::{Link, Parcel, Transit};
use crate::random::{Purpose, keyed_rng};
use crate::sensor::{Boot, Observation, Sensor};

/// The outcome of one frame.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "taken apart at once, and nearly always the large one")]
pub enum Fate {
    /// Not sent: it has no detection that the rules require to be sent, or the agent is not in the world.
    Withheld,
    /// Lost by the link.
    Lost,
    /// Delivered.
    Arrives {
        /// Time of arrival, true Unix time.
        at: Timestamp,
        /// The frame as it was sent.
        observation: Observation,
    },
}

/// An agent's sensor with its connection to the network. Frames are sent in the order of their numbers: the inclusion
/// rules depend on what was sent before.
#[derive(Clone, Debug)]
pub struct Sender {
    sensor: Sensor,
    config: SendingConfig,
    link: Link,
    slots: Option<Slots>,
    rules: Option<InclusionRules>,
}

impl Sender {
    /// Sends the frames of this sensor.
    pub fn new(sensor: Sensor, config: SendingConfig) -> Self {
        let (agent, Boot { seed, .. }) = (sensor.config().agent, sensor.boot());
        let slots = match config.transmit {
            Transmit::Immediately => None,
            Transmit::Slotted { period, phase } => {
                let mut rng = keyed_rng(seed, Some(&agent), 0, Purpose::TransmitPhase);
                Some(Slots { period, phase: phase.within(period, &mut rng) })
            }
        };
        Self {
            link: Link::new(config.link.clone(), seed, agent),
            slots,
            rules: (config.rule == SendRule::Etsi).then(InclusionRules::default),
            sensor,
            config,
        }
    }

    /// The sensor whose frames are sent.
    pub const fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// The same, to give it another view of its world.
    pub const fn sensor_mut(&mut self) -> &mut Sensor {
        &mut self.sensor
    }

    /// The link to the hub.
    pub const fn link(&self) -> &Link {
        &self.link
    }

    /// The sensor description that the agent publishes: the sensor's, with the probability that an object is reported
    /// in a frame under the rule of sending.
    pub fn description(&self) -> SensorDescription {
        let of_sensor = self.sensor.description();
        let (detected, rate) = (of_sensor.detection_probability, self.sensor.config().rate);
        SensorDescription {
            detection_probability: self.config.rule.report_probability(detected, rate),
            ..of_sensor
        }
    }

    /// Sends the frame of this number.
    pub fn send(&mut self, sequence: u64) -> Fate {
        if !self.sensor.is_present(sequence) {
            return Fate::Withheld;
        }
        let is_size_needed = self.link.config().rate_bps.is_some();
        // Without rules, and where the size does not matter, the outcome is known before the frame is computed.
        let observation = match &mut self.rules {
            None => is_size_needed.then(|| self.sensor.observe(sequence)),
            Some(rules) => match included(&self.sensor, sequence, rules) {
                None => return Fate::Withheld,
                included => included,
            },
        };
        let sent_at = self.sent_at(sequence);
        let bytes = if is_size_needed { observation.as_ref().map_or(0, wire_bytes) } else { 0 };
        let since_start = sent_at - self.sensor.boot().start;
        match self.link.transit(Parcel { sequence, since_start, bytes }) {
            Transit::Lost => Fate::Lost,
            Transit::Delivered { delay } => {
                let observation = observation.unwrap_or_else(|| self.sensor.observe(sequence));
                Fate::Arrives { at: sent_at + delay, observation }
            }
        }
    }

    /// When the frame of this number is sent, true Unix time.
    pub fn sent_at(&self, sequence: u64) -> Timestamp {
        let Boot { seed, start, .. } = self.sensor.boot();
        let captured = self.sensor.capture_time(sequence) - start;
        let mut rng = keyed_rng(seed, Some(&self.sensor.config().agent), sequence, Purpose::SensorModel);
        let ready = captured + Span::from_secs_f64(self.config.sensing.draw(&mut rng, captured));
        start + self.slots.map_or(ready, |slots| slots.at_or_after(ready))
    }
}

/// The frame with the detections that the rules select; `None` where it is not sent.
fn included(sensor: &Sensor, sequence: u64, rules: &mut InclusionRules) -> Option<Observation> {
    let mut observation = sensor.observe(sequence);
    let mut objects = Vec::new();
    sensor.objects_at_capture(sequence, &mut objects);
    let named = observation.identities.objects.iter().zip(&observation.frame.detections);
    let subjects: Vec<Subject> = named
        .map(|(id, detection)| match id {
            Some(_) if *id == sensor.own_object() => Subject::Own,
            // The objects are sorted by id.
            Some(id) => match objects.binary_search_by_key(id, |object| object.id) {
                Ok(place) => Subject::Object(objects[place]),
                Err(_) => Subject::Clutter(detection.class),
            },
            None => Subject::Clutter(detection.class),
        })
        .collect();
    let chosen = rules.choose(sensor.capture_time(sequence) - sensor.boot().start, &subjects)?;
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
