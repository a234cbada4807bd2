//! What a scenario's agents send, in the order in which it arrives, and an engine fed with it in virtual time.
//!
//! The network is a queue ordered by arrival. Frames go through the same wire bytes as live; the same scenario and
//! seed give the same bits.

use crate::run_log::ReceivedFused;
use std::collections::BTreeMap;
use std::sync::Arc;
use v2x_agent::link::Link;
use v2x_agent::scenario::{AgentConfig, Scenario};
use v2x_agent::sensor::{Boot, Observation, SimulatedAgent};
use v2x_agent::truth::Identities;
use v2x_agent::world::World;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::refusal::Disposition;
use v2x_fusion_hub::schedule::{PublishMode, Schedule};

/// A frame as it arrives.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// When, by the hub's clock.
    pub received_at: Timestamp,
    /// What came off the wire.
    pub frame: DetectionFrame,
    /// Its size on the wire, bytes.
    pub bytes: usize,
    /// Which true object stands behind each detection.
    pub identities: Identities,
}

/// All that arrives in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traffic {
    /// What the agents say of their sensors.
    pub descriptions: BTreeMap<AgentId, SensorDescription>,
    /// Frames by arrival.
    pub arrivals: Vec<Arrival>,
}

/// Whom an engine hears, and when it is asked.
#[derive(Clone, Copy, Debug)]
pub struct Listening<F> {
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
    pub fn new(
        scenario: &Scenario,
        seed: u64,
        (start, duration): (Timestamp, Span),
        n_agents: usize,
    ) -> Result<Self, WireError> {
        let world = Arc::new(World::new(scenario, seed));
        let boot = Boot { seed, epoch: 1, start };
        let agent = |config: &AgentConfig| SimulatedAgent::new(scenario, world.clone(), &config.id, boot);
        let agents: Vec<_> = scenario.agents.iter().take(n_agents).filter_map(agent).collect();
        let describe = |agent: &SimulatedAgent| (agent.config().id, agent.description());
        let descriptions = agents.iter().map(describe).collect();
        let due = arrivals(&agents, seed, (start, start + duration));
        let mut arrivals = Vec::with_capacity(due.len());
        let mut bytes = Vec::new();
        for ((received_at, _), Observation { frame, identities }) in due {
            bytes.clear();
            wire::detections::encode(&frame, &mut bytes)?;
            let frame = wire::detections::decode(&bytes)?;
            arrivals.push(Arrival { received_at, frame, bytes: bytes.len(), identities });
        }
        Ok(Self { descriptions, arrivals })
    }

    /// Feeds an engine; `on_fused` gets every fused frame as a consumer next to the hub would.
    pub fn feed(
        &self,
        engine: &mut Engine,
        listening: Listening<impl Fn(&AgentId) -> bool>,
        mut on_fused: impl FnMut(ReceivedFused),
    ) -> Result<(), WireError> {
        let Listening { publish, start, until, listens_to } = listening;
        for (agent, description) in self.descriptions.iter().filter(|(agent, _)| listens_to(agent)) {
            engine.handle_description(*agent, *description);
        }
        let mut schedule = Schedule::new(publish, start);
        for Arrival { received_at, frame, .. } in &self.arrivals {
            if !listens_to(&frame.id.agent) {
                continue;
            }
            publish_until(engine, &mut schedule, *received_at, &mut on_fused)?;
            if matches!(engine.handle_frame(frame, *received_at), Disposition::Accepted { .. }) {
                schedule.note_update();
            }
            if schedule.take_due(*received_at) {
                on_fused(fused(engine, *received_at)?);
            }
        }
        until.map_or(Ok(()), |until| publish_until(engine, &mut schedule, until, &mut on_fused))
    }
}

/// Publishes whatever is due before a time.
fn publish_until(
    engine: &mut Engine,
    schedule: &mut Schedule,
    until: Timestamp,
    on_fused: &mut impl FnMut(ReceivedFused),
) -> Result<(), WireError> {
    while schedule.next_deadline() < until {
        let due = schedule.next_deadline();
        schedule.take_due(due);
        on_fused(fused(engine, due)?);
    }
    Ok(())
}

/// Every frame that its link delivers, by arrival.
fn arrivals(
    agents: &[SimulatedAgent],
    seed: u64,
    (start, end): (Timestamp, Timestamp),
) -> BTreeMap<(Timestamp, FrameId), Observation> {
    let mut arrivals = BTreeMap::new();
    for agent in agents {
        let config = agent.config();
        let link = Link::new(config.link.clone(), seed, config.id);
        let mut newest_due = Timestamp::MIN;
        for sequence in agent.sequence_at_or_after(start).. {
            if agent.capture_time(sequence) > end {
                break;
            }
            if let Some((due, observation)) = agent.delivery(&link, sequence) {
                let due = if config.link.reorder { due } else { due.max(newest_due) };
                newest_due = newest_due.max(due);
                arrivals.insert((due, observation.frame.id), observation);
            }
        }
    }
    arrivals
}

/// The fused frame as of `now`, as it comes off the wire.
fn fused(engine: &mut Engine, now: Timestamp) -> Result<ReceivedFused, WireError> {
    let mut bytes = Vec::new();
    wire::fused::encode(engine.fused(now), &mut bytes)?;
    Ok(ReceivedFused { received_at: now, frame: wire::fused::decode(&bytes)? })
}
