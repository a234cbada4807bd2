//! What the status says of the agents.

use super::core::Core;
use super::roster::Roster;
use super::status::{AgentStatus, RegistrationStatus};
use crate::engine::{AgentRecord, Engine};
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// Every agent that is alive, or of which the hub has received anything, by name.
pub(super) fn agent_statuses(core: &Core, roster: &Roster) -> Vec<AgentStatus> {
    let engine = core.engine();
    let agents = engine.agents();
    let silent = roster.tokens().alive.iter().filter(|agent| agents.record(agent).is_none());
    let mut statuses: Vec<_> = silent.map(|agent| AgentStatus::silent(*agent)).collect();
    statuses.extend(agents.iter().map(|(agent, record)| AgentStatus {
        alive: roster.is_alive(agent, engine),
        transport: core.survey().transport(agent),
        ..status_of(engine, agent, record)
    }));
    for status in &mut statuses {
        status.idle = roster.tokens().idle.get(&status.id).cloned();
    }
    statuses.sort_by_key(|status| status.id);
    statuses
}

fn status_of(engine: &Engine, agent: &AgentId, record: &AgentRecord) -> AgentStatus {
    let statistics = &record.statistics;
    let dropped = statistics.dropped.by_cause.iter();
    let unmapped = statistics.unmapped_classes.names();
    let registration = engine.registration().find(|one| one.agent == *agent);
    AgentStatus {
        id: *agent,
        alive: false,
        idle: None,
        accepted: statistics.accepted,
        synchronous: statistics.synchronous,
        out_of_sequence: statistics.out_of_sequence,
        ahead_of_time: statistics.ahead_of_time,
        clock_set_back: statistics.clock_set_back,
        refused: statistics
            .refused
            .iter()
            .map(|(reason, count)| (reason.clone().into_owned(), *count))
            .collect(),
        last_refusal: statistics.last_refusal.as_ref().map(ToString::to_string),
        dropped_detections: dropped
            .map(|((field, cause), count)| (format!("{field} {cause}"), *count))
            .collect(),
        last_dropped: statistics.dropped.last.as_ref().map(ToString::to_string),
        unmapped_classes: statistics.unmapped_classes.total(),
        unmapped_names: unmapped.map(|(name, count)| (name.to_owned(), count)).collect(),
        descriptions_refused: statistics.descriptions_refused,
        nis_per_dof: statistics.recent_nis_per_dof(engine.now()),
        registration: registration.map(|one| RegistrationStatus::of(&one)),
        learnt: engine.learnt(agent),
        transport: None,
        newest_captured_at: record.newest_captured_at.map(Timestamp::as_micros),
        sensor: record.description,
    }
}
