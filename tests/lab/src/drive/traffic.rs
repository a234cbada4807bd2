//! What a scenario's agents send, in the order in which it arrives, and an engine fed with it in virtual time.
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
use v2x_agent::sensor::{Boot, Observation, SimulatedAgent};
use v2x_agent::truth::Identities;
use v2x_agent::world::World;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::schedule::PublishMode;

/// A frame as it arrives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// When, by the hub's clock, which is right.
    pub received_at: Timestamp,
    /// When it was captured and sent, in true time.
    pub times: SendTimes,
    /// What came off the wire.
    pub frame: DetectionFrame,
    /// Its size on the wire, bytes.
    pub bytes: usize,
    /// Which true object stands behind each detection.
    pub identities: Identities,
}

/// When a frame was captured and sent, in true time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SendTimes {
    /// Captured.
    pub captured_at: Timestamp,
    /// Handed to the link.
    pub sent_at: Timestamp,
}

impl SendTimes {
    /// Of an agent's frame of this number.
    pub(crate) fn of(agent: &SimulatedAgent, sender: &Sender, sequence: u64) -> Self {
        Self { captured_at: agent.capture_time(sequence), sent_at: sender.sent_at(agent, sequence) }
    }
}

/// All that arrives in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Traffic {
    /// What the agents say of their sensors.
    pub descriptions: BTreeMap<AgentId, SensorDescription>,
    /// Frames by arrival.
    pub arrivals: Vec<Arrival>,
}

/// Whom an engine hears, and when it is asked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listening<F> {
    /// When the hub publishes.
    pub publish: PublishMode,
    /// When it starts.
    pub start: Timestamp,
    /// Until when it publishes at least; frames that arrive later are taken in all the same.
    pub until: Option<Timestamp>,
    /// Whom it listens to.
    pub listens_to: F,
}

impl Traffic {
    /// Of the first `n_agents` of a scenario, which capture from `start` for `duration`.
    pub(crate) fn new(
        scenario: &Scenario,
        seed: u64,
        (start, duration): (Timestamp, Span),
        n_agents: usize,
    ) -> Result<Self, WireError> {
        let agents: Vec<_> = agents(scenario, seed, start).take(n_agents).collect();
        let describe = |agent: &SimulatedAgent| (agent.config().id, agent.description());
        let descriptions = agents.iter().map(describe).collect();
        let due = arrivals(&agents, (start, start + duration));
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

    /// Feeds an engine, and gives it back; `on_fused` gets every fused frame as a consumer next to the hub would.
    pub(crate) fn feed(
        &self,
        engine: Engine,
        listening: Listening<impl Fn(&AgentId) -> bool>,
        on_fused: impl FnMut(ReceivedFused),
    ) -> Result<Engine, WireError> {
        let Listening { publish, start, until, listens_to } = listening;
        let mut driver = Driver::new(engine, AsHub::new(publish, start));
        let mut consumer = OverTheWire(on_fused);
        for (agent, description) in self.descriptions.iter().filter(|(agent, _)| listens_to(agent)) {
            driver.describe(*agent, *description);
        }
        for Arrival { received_at, frame, .. } in &self.arrivals {
            if listens_to(&frame.id.agent) {
                driver.arrive(frame, *received_at, &mut consumer)?;
            }
        }
        if let Some(until) = until {
            driver.publish_before(until, &mut consumer)?;
        }
        Ok(driver.into_engine())
    }
}

/// A consumer next to the hub: fused frames come to it as wire bytes.
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

/// The agents of a scenario, in its order.
pub(crate) fn agents(
    scenario: &Scenario,
    seed: u64,
    start: Timestamp,
) -> impl Iterator<Item = SimulatedAgent> {
    let world = Arc::new(World::new(scenario, seed));
    let boot = Boot { seed, epoch: 1, start };
    let agent = move |config: &AgentConfig| SimulatedAgent::new(scenario, world.clone(), &config.id, boot);
    scenario.agents.iter().filter_map(agent)
}

/// Every frame that its link delivers, by arrival, in true time: clocks of agents show in their stamps alone.
fn arrivals(
    agents: &[SimulatedAgent],
    (start, end): (Timestamp, Timestamp),
) -> BTreeMap<(Timestamp, FrameId), (SendTimes, Observation)> {
    let mut arrivals = BTreeMap::new();
    for agent in agents {
        let mut sender = Sender::new(agent);
        let may_overtake = sender.link().config().reorder;
        let mut newest_due = Timestamp::MIN;
        for sequence in agent.sequence_at_or_after(start).. {
            if agent.capture_time(sequence) > end {
                break;
            }
            if let Fate::Arrives { at, observation } = sender.send(agent, sequence) {
                let due = if may_overtake { at } else { at.max(newest_due) };
                newest_due = newest_due.max(due);
                arrivals.insert(
                    (due, observation.frame.id),
                    (SendTimes::of(agent, &sender, sequence), observation),
                );
            }
        }
    }
    arrivals
}
