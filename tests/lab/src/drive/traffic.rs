//! The frames of a scenario's agents in order of arrival, and an engine that is fed with them in virtual time.
//!
//! The network is a queue ordered by arrival. Frames go through the same wire bytes as live; the same scenario and
//! seed give the same bits.

use crate::data::run_log::ReceivedFused;
use crate::drive::driver::{Consumer, Driver};
use crate::drive::publishing::AsHub;
use std::collections::BTreeMap;
use std::sync::Arc;
use v2x_agent::scenario::{AgentConfig, Scenario};
use v2x_agent::sending::{Fate, Sender};
use v2x_agent::sensor::{Boot, Observation};
use v2x_agent::truth::Identities;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::{Engine, Refusal};
use v2x_fusion_hub::hub::HubSettings;

/// A frame as it arrives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// Time of arrival by the hub's clock, which is right.
    pub received_at: Timestamp,
    /// When it was captured and sent, in true time.
    pub times: SendTimes,
    /// The frame, decoded from its wire bytes.
    pub frame: DetectionFrame,
    /// Its size on the wire, bytes.
    pub bytes: usize,
    /// The true object of each detection.
    pub identities: Identities,
}

/// When a frame was captured and sent, in true time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SendTimes {
    /// Time of capture.
    pub captured_at: Timestamp,
    /// When the agent handed it to the link.
    pub sent_at: Timestamp,
}

impl SendTimes {
    /// The times of an agent's frame of this sequence number.
    pub(crate) fn of(sender: &Sender, sequence: u64) -> Self {
        Self { captured_at: sender.sensor().capture_time(sequence), sent_at: sender.sent_at(sequence) }
    }
}

/// Everything that arrives in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Traffic {
    /// The agents' sensor descriptions.
    pub descriptions: BTreeMap<AgentId, SensorDescription>,
    /// Frames in order of arrival.
    pub arrivals: Vec<Arrival>,
}

/// How a hub listens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listening<'a> {
    /// Whom it listens to, how it reads their frames, and when it publishes.
    pub settings: &'a HubSettings,
    /// When it starts.
    pub start: Timestamp,
    /// It publishes at least until this time. Frames that arrive later are accepted too.
    pub until: Option<Timestamp>,
}

impl Listening<'_> {
    /// A frame as the hub reads it; `None` where it does not listen to its agent.
    fn read(&self, frame: &DetectionFrame) -> Result<Option<DetectionFrame>, WireError> {
        if !self.settings.listens_to(&frame.id.agent) {
            return Ok(None);
        }
        let mut frame = frame.clone();
        self.settings.of_agent(&frame.id.agent).conventions.convert(&mut frame)?;
        Ok(Some(frame))
    }
}

impl Traffic {
    /// The traffic of the first agents of a scenario.
    pub(crate) fn new(
        scenario: &Scenario,
        seed: u64,
        (start, duration): (Timestamp, Span),
        n_agents: usize,
    ) -> Result<Self, WireError> {
        let mut agents: Vec<_> = agents(scenario, seed, start).take(n_agents).collect();
        let describe = |agent: &Sender| (agent.sensor().config().agent, agent.description());
        let descriptions = agents.iter().map(describe).collect();
        let due = arrivals(&mut agents, (start, start + duration));
        let mut arrivals = Vec::with_capacity(due.len());
        let mut bytes = Vec::new();
        for ((received_at, _), (times, Observation { frame, identities })) in due {
            bytes.clear();
            wire::detections::encode(&frame, &mut bytes)?;
            let frame = wire::detections::decode(&bytes)?;
            arrivals.push(Arrival { received_at, times, frame, bytes: bytes.len(), identities });
        }
        Ok(Self { descriptions, arrivals })
    }

    /// Feeds an engine, and returns it. `on_fused` gets every fused frame as a consumer next to the hub would.
    pub(crate) fn feed(
        &self,
        engine: Engine,
        listening: Listening<'_>,
        on_fused: impl FnMut(ReceivedFused),
    ) -> Result<Engine, WireError> {
        let Listening { settings, start, until } = listening;
        let mut driver = Driver::new(engine, AsHub::new(settings.publish, start));
        let mut consumer = OverTheWire(on_fused);
        for (agent, description) in self.descriptions.iter().filter(|(agent, _)| settings.listens_to(agent)) {
            driver.describe(*agent, *description);
        }
        for Arrival { received_at, frame, .. } in &self.arrivals {
            match listening.read(frame)? {
                Some(frame) => {
                    driver.arrive(&frame, *received_at, &mut consumer)?;
                }
                // As a hub counts it.
                None => driver.refuse(frame.id.agent, Refusal::NotListenedTo),
            }
        }
        if let Some(until) = until {
            driver.publish_before(until, &mut consumer)?;
        }
        Ok(driver.into_engine())
    }
}

/// A consumer next to the hub: it receives fused frames as wire bytes.
struct OverTheWire<F>(F);

impl<F: FnMut(ReceivedFused)> Consumer for OverTheWire<F> {
    type Error = WireError;

    fn receive(&mut self, now: Timestamp, frame: &FusedFrame) -> Result<(), WireError> {
        let mut bytes = Vec::new();
        wire::fused::encode(frame, &mut bytes)?;
        (self.0)(ReceivedFused { received_at: now, frame: wire::fused::decode(&bytes)? });
        Ok(())
    }
}

/// The agents of a scenario, in order.
pub(crate) fn agents(scenario: &Scenario, seed: u64, start: Timestamp) -> impl Iterator<Item = Sender> {
    let world = Arc::new(scenario.world(seed));
    let boot = Boot { seed, epoch: 1, start };
    let agent = move |config: &AgentConfig| config.sender(world.clone(), boot).ok();
    scenario.agents.iter().filter_map(agent)
}

/// Every frame that its link delivers, by arrival, in true time. The agents' clocks affect only their time stamps.
fn arrivals(
    agents: &mut [Sender],
    (start, end): (Timestamp, Timestamp),
) -> BTreeMap<(Timestamp, FrameId), (SendTimes, Observation)> {
    let mut arrivals = BTreeMap::new();
    for agent in agents {
        let may_overtake = agent.link().config().reorder;
        let mut newest_due = Timestamp::MIN;
        for sequence in agent.sensor().sequence_at_or_after(start).. {
            if agent.sensor().capture_time(sequence) > end {
                break;
            }
            if let Fate::Arrives { at, observation } = agent.send(sequence) {
                let due = if may_overtake { at } else { at.max(newest_due) };
                newest_due = newest_due.max(due);
                let times = SendTimes::of(agent, sequence);
                arrivals.insert((due, observation.frame.id), (times, observation));
            }
        }
    }
    arrivals
}
