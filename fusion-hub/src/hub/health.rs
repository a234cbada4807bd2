//! Whether all is well: findings about the agents and the hub itself, each of them logged once when it begins and once when it ends.

use super::core::Core;
use super::denials::Denials;
use super::roster::Roster;
use super::unnamed::InvalidName;
use crate::diagnosis::{Code, Finding};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::net::zenoh_refusals::ZenohRefusals;
use v2x_common::time::{Span, Timestamp};

/// After a start nobody is missed for so long.
const PATIENCE: Span = Span::from_millis(5_000);
/// Dropped frames are reported for so long.
const OVERLOADED_FOR: Span = Span::from_millis(10_000);

/// All in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// At least one agent is alive, and nothing that is found makes the list worse.
    #[default]
    Healthy,
    /// Something does; the findings say what.
    Degraded,
}

impl Verdict {
    /// Of some findings.
    pub fn of(findings: &[Finding]) -> Self {
        if findings.iter().any(Finding::is_fault) { Self::Degraded } else { Self::Healthy }
    }
}

/// What was found at the last check.
#[derive(Debug, Default)]
pub(super) struct Health {
    findings: Vec<Finding>,
    dropped: u64,
    dropped_at: Option<Timestamp>,
    denials: Denials,
}

/// What the hub itself has seen, beside its core.
pub(super) struct Seen<'a> {
    pub(super) roster: &'a Roster,
    pub(super) started_at: Timestamp,
    /// Samples dropped from full queues so far.
    pub(super) dropped: u64,
    pub(super) invalid_names: Vec<InvalidName>,
    /// The lineage of another hub of this name.
    pub(super) twin: Option<u32>,
    /// Whether the Zenoh configuration in its file is not the one in force.
    pub(super) is_access_behind: bool,
    /// By Zenoh, since the start.
    pub(super) refused_by_zenoh: ZenohRefusals,
}

/// Whose a finding is; of the network there may be several of one kind, which differ by more than their numbers.
fn of_whom(finding: &Finding) -> String {
    let is_word = |c: &char| !(c.is_ascii_digit() || matches!(c, '+' | '-' | '.'));
    finding.agent.map_or_else(|| finding.says.chars().filter(is_word).collect(), |agent| agent.to_string())
}

impl Health {
    /// Checks the agents and the hub; warns of each fault when it begins, and says when it has ended.
    pub(super) fn check(&mut self, core: &mut Core, seen: &Seen<'_>, now: Timestamp) {
        core.diagnose(seen.roster.tokens(), now);
        let mut findings = core.findings().to_vec();
        findings.extend(self.of_hub(core, seen, now));
        fn faults(findings: &[Finding]) -> BTreeMap<(Code, String), &Finding> {
            let faults = findings.iter().filter(|one| one.is_fault());
            faults.map(|one| ((one.code, of_whom(one)), one)).collect()
        }
        let (before, after) = (faults(&self.findings), faults(&findings));
        for (key, one) in after.iter().filter(|(key, _)| !before.contains_key(key)) {
            tracing::warn!(finding = key.0.name(), "{one}");
        }
        for (key, one) in before.iter().filter(|(key, _)| !after.contains_key(key)) {
            tracing::info!(finding = key.0.name(), "no longer found: {}", one.in_short());
        }
        self.findings = findings;
    }

    /// What is found of the network and of the hub.
    fn of_hub(&mut self, core: &Core, seen: &Seen<'_>, now: Timestamp) -> Vec<Finding> {
        let mut findings = Vec::new();
        if seen.dropped > self.dropped {
            self.dropped_at = Some(now);
        }
        // Of frames it is said whose they were.
        let is_said = core.findings().iter().any(|one| one.code == Code::Overload);
        if !is_said && self.dropped_at.is_some_and(|at| now - at < OVERLOADED_FOR) {
            let says = format!("this hub has dropped {} samples for lack of time", seen.dropped);
            let change =
                "Fewer agents, lower rates, or a faster machine; `agents[].refused.queue_full` says whose";
            findings.push(Finding::of_network(Code::Overload, says, change));
        }
        self.dropped = seen.dropped;
        findings.extend(self.denials.findings(seen.refused_by_zenoh.clone(), now));
        if seen.is_access_behind {
            let says = "the Zenoh configuration was written anew and is not followed: who was revoked in it is still let in";
            let change = "The hub's log says why; it tries again by itself";
            findings.push(Finding::of_network(Code::RefusedByZenoh, says, change));
        }
        for InvalidName { name, reason, .. } in &seen.invalid_names {
            let says = format!("nothing of agent {name:?} is used: {reason}");
            findings.push(Finding::of_network(Code::InvalidName, says, "Give it another name"));
        }
        if let Some(lineage) = seen.twin {
            let says = format!(
                "another hub (lineage {lineage}) publishes under this hub's name: consumers get both lists in turn"
            );
            let change = "Give one of them another name (`v2x hub --id`), or end it; if nobody else should run one, somebody \
                          claims its name: `v2x certs`";
            findings.push(Finding::of_network(Code::TwoHubs, says, change));
        }
        let is_anybody_alive =
            core.engine().agents().iter().any(|(agent, _)| seen.roster.is_alive(agent, core.engine()));
        if !is_anybody_alive && seen.roster.tokens().alive.is_empty() && now - seen.started_at >= PATIENCE {
            let says = "no agent sends anything to this hub";
            let change = "Do agents use its network's name and its endpoint? `v2x check` listens beside the expected keys";
            findings.push(Finding::of_network(Code::NoAgents, says, change));
        }
        findings
    }

    /// Everything that was found at the last check.
    pub(super) fn findings(&self) -> &[Finding] {
        &self.findings
    }
}
