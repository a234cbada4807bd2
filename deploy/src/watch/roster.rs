//! The agents of a hub, as the table shows them: from the fused frames, which are always new, and from the hub's status,
//! which says why frames are refused and who is alive.

use std::collections::BTreeMap;
use v2x_common::fused::{AgentHealth, FusedFrame};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::hub::{AgentStatus, HubStatus};

/// An agent without a liveliness token that has sent nothing for so long has left.
const FORGOTTEN_AFTER: Span = Span::from_millis(10_000);
/// A refusal is recent for so long.
const RECENT: Span = Span::from_millis(5_000);

/// One agent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AgentRow {
    pub(super) id: AgentId,
    /// Whether it holds its liveliness token; programs that are not ours may have none.
    pub(super) is_alive: bool,
    pub(super) accepted: u64,
    pub(super) late: u64,
    pub(super) refused: u64,
    /// Capture time of its newest accepted frame.
    pub(super) newest: Option<Timestamp>,
    /// The newest refusal in words.
    pub(super) last_refusal: Option<String>,
    heard_at: Timestamp,
    refused_at: Timestamp,
}

impl AgentRow {
    const fn new(id: AgentId) -> Self {
        Self {
            id,
            is_alive: false,
            accepted: 0,
            late: 0,
            refused: 0,
            newest: None,
            last_refusal: None,
            heard_at: Timestamp::MIN,
            refused_at: Timestamp::MIN,
        }
    }

    /// Whether it is refused now.
    pub(super) fn is_refused(&self, now: Timestamp) -> bool {
        now - self.refused_at < RECENT
    }

    fn is_here(&self, now: Timestamp) -> bool {
        self.is_alive || now - self.heard_at < FORGOTTEN_AFTER
    }

    /// Takes the counts; an agent that is new here was last heard of when its newest frame was captured.
    fn count(
        &mut self,
        (accepted, late, refused): (u64, u64, u64),
        newest: Option<Timestamp>,
        now: Timestamp,
    ) {
        let is_new = self.accepted + self.refused == 0;
        if is_new {
            self.heard_at = newest.unwrap_or(Timestamp::MIN).min(now);
        } else if (self.accepted, self.refused) != (accepted, refused) {
            self.heard_at = now;
        }
        if !is_new && self.refused != refused {
            self.refused_at = now;
        }
        (self.accepted, self.late, self.refused, self.newest) = (accepted, late, refused, newest);
    }
}

/// All agents of a hub.
#[derive(Clone, Debug, Default)]
pub(super) struct Roster {
    lineage: u32,
    agents: BTreeMap<AgentId, AgentRow>,
}

impl Roster {
    /// Takes the counts of a fused frame.
    pub(super) fn take_frame(&mut self, frame: &FusedFrame, now: Timestamp) {
        self.follow(frame.lineage);
        for AgentHealth { agent, newest_captured_at, accepted, refused, out_of_sequence, .. } in &frame.agents
        {
            let row = self.agent(*agent);
            row.count((*accepted, *out_of_sequence, *refused), Some(*newest_captured_at), now);
        }
    }

    /// Takes what a status says; its counts only of agents that no fused frame lists.
    pub(super) fn take_status(&mut self, status: &HubStatus, now: Timestamp) {
        self.follow(status.lineage);
        for AgentStatus {
            id,
            alive,
            accepted,
            out_of_sequence,
            refused,
            last_refusal,
            newest_captured_at,
            ..
        } in &status.agents
        {
            let row = self.agent(*id);
            row.is_alive = *alive;
            row.last_refusal.clone_from(last_refusal);
            let refused = refused.values().sum();
            if row.accepted == 0 {
                let newest = newest_captured_at.and_then(Timestamp::from_micros);
                row.count((*accepted, *out_of_sequence, refused), newest, now);
            }
        }
    }

    /// The agents that have not left, by name.
    pub(super) fn rows(&self, now: Timestamp) -> Vec<&AgentRow> {
        self.agents.values().filter(|row| row.is_here(now)).collect()
    }

    /// A restarted hub counts anew.
    fn follow(&mut self, lineage: u32) {
        if self.lineage != lineage {
            *self = Self { lineage, ..Self::default() };
        }
    }

    fn agent(&mut self, id: AgentId) -> &mut AgentRow {
        self.agents.entry(id).or_insert(AgentRow::new(id))
    }
}
