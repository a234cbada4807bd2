//! What is gathered in ten seconds.

use super::alignment::Snapshots;
use super::alignment::fit::{Fit, fit};
use super::alignment::sizes::{Ratio, ratio};
use super::arrivals::Arrivals;
use super::coasting::Coasting;
use super::contents::Contents;
use super::headings::Headings;
use super::own_tracks::OwnTracks;
use super::paces::Paces;
use super::scatter::Scatter;
use super::sizes::Sizes;
use super::speeds::Speeds;
use super::stale::Stale;
use super::streams::Streams;
use super::velocities::Velocities;
use super::views::Views;
use super::writing::Writing;
use crate::engine::{AgentRecord, Engine, Label, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_common::unmapped_names::UnmappedNames;

/// An agent of which nothing has arrived for so long has left.
const HEARD_WITHIN: Span = Span::from_millis(10_000);
/// Agents that are surveyed; more send, but nobody reads so many findings.
pub(super) const MAX_AGENTS: usize = 256;

/// Where frames come from: what to change is said in its terms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Source {
    /// Agents that publish them.
    #[default]
    Network,
    /// The rows of a table.
    Log,
}

impl Source {
    /// The words of the two that hold for this one.
    pub(super) const fn words(self, of_network: &'static str, of_log: &'static str) -> &'static str {
        match self {
            Self::Network => of_network,
            Self::Log => of_log,
        }
    }

    /// Where a line of the settings goes that is of this agent.
    pub(super) fn table_of(self, agent: &AgentId) -> String {
        format!("under `[hub.agents.{agent}]`{}", self.words("", " in the file of --hub-config"))
    }
}

/// What there is to look at beside the frames.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// What it counts and learns of the agents.
    pub engine: &'a Engine,
    /// The agents' liveliness tokens.
    pub tokens: &'a Tokens,
    /// Where frames come from.
    pub source: Source,
}

/// What agents say by liveliness tokens.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tokens {
    /// Those that are there.
    pub alive: BTreeSet<AgentId>,
    /// Those that see nothing, because what they ride on, by its name, is not in the world.
    pub idle: BTreeMap<AgentId, String>,
}

/// Of one agent in one window.
#[derive(Clone, Debug, Default)]
pub(super) struct AgentSurvey {
    pub(super) arrivals: Arrivals,
    pub(super) streams: Streams,
    pub(super) contents: Contents,
    /// Frames that hold objects of the hub's own lists.
    pub(super) fed_back: u64,
    pub(super) writing: Writing,
    pub(super) headings: Headings,
    /// The same, if they were degrees in place of radians, or the other way round.
    pub(super) headings_in_other_unit: Headings,
    pub(super) velocities: Velocities,
    pub(super) speeds: Speeds,
    pub(super) sizes: Sizes,
    pub(super) own_tracks: OwnTracks,
    pub(super) paces: Paces,
    pub(super) scatter: Scatter,
    pub(super) stale: Stale,
    pub(super) coasting: Coasting,
    pub(super) views: Views,
    /// Frames that are those of another agent, by whose.
    pub(super) copied: BTreeMap<AgentId, u64>,
    /// Refused frames by reason, each with the newest.
    pub(super) refused: BTreeMap<&'static str, (u64, Refusal)>,
    /// What the engine had counted when the window began.
    pub(super) before: Counts,
    /// The same when it ended; `None` until then.
    pub(super) after: Option<Counts>,
}

/// Counts of the engine.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    /// Impossible detections by field and cause.
    pub(super) dropped: BTreeMap<(Label, Label), u64>,
    pub(super) unmapped: UnmappedNames,
    pub(super) descriptions_refused: u64,
}

impl Counts {
    pub(super) fn of(record: &AgentRecord) -> Self {
        let statistics = &record.statistics;
        Self {
            dropped: statistics.dropped.by_cause.clone(),
            unmapped: statistics.unmapped_classes.clone(),
            descriptions_refused: statistics.descriptions_refused,
        }
    }

    /// What was counted since then.
    pub(super) fn since(self, before: &Self) -> Self {
        let known = |cause: &(Label, Label)| before.dropped.get(cause).copied().unwrap_or(0);
        let dropped = self.dropped.into_iter().map(|(cause, all)| {
            let known = known(&cause);
            (cause, all.saturating_sub(known))
        });
        Self {
            dropped: dropped.filter(|(_, n)| *n > 0).collect(),
            unmapped: self.unmapped.since(&before.unmapped),
            descriptions_refused: self.descriptions_refused.saturating_sub(before.descriptions_refused),
        }
    }
}

/// All agents in one window.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    pub(super) since: Option<Timestamp>,
    /// It lasted long enough to say what did not happen.
    pub(super) is_over: bool,
    /// The agents that held a token at its beginning, and at its end.
    pub(super) alive: BTreeSet<AgentId>,
    /// The agents that were idle at any time of it.
    pub(super) idle: BTreeSet<AgentId>,
    pub(super) agents: BTreeMap<AgentId, AgentSurvey>,
    pub(super) snapshots: Snapshots,
    pub(super) fits: BTreeMap<[AgentId; 2], Fit>,
    /// Of pairs that share enough vehicles, how large each says that they are.
    pub(super) sizes: BTreeMap<[AgentId; 2], Ratio>,
    /// Lists that were published, and those with an object.
    pub(super) lists: u64,
    pub(super) lists_with_objects: u64,
    /// Pairs to compare, and how many of them are left: the last ones are the first to be compared.
    pub(super) pairs: Vec<[AgentId; 2]>,
    pub(super) n_to_fit: usize,
}

impl Window {
    /// Begins it.
    pub(super) fn begin(&mut self, around: &Surroundings<'_>, now: Timestamp) {
        self.since = Some(now);
        self.alive.clone_from(&around.tokens.alive);
        self.note_idle(around);
        let is_here =
            |record: &AgentRecord| record.last_heard_at().is_some_and(|at| now - at <= HEARD_WITHIN);
        let agents = around.engine.agents().iter().filter(|(_, record)| is_here(record));
        for (agent, record) in agents.take(MAX_AGENTS) {
            self.agents.entry(*agent).or_default().before = Counts::of(record);
        }
    }

    /// Ends it: nothing is gathered any more, and pairs are to be compared, those of the window before where that goes.
    pub(super) fn end(&mut self, around: &Surroundings<'_>, before: &[[AgentId; 2]]) {
        self.is_over = true;
        self.alive.retain(|agent| around.tokens.alive.contains(agent));
        self.note_idle(around);
        for (agent, survey) in &mut self.agents {
            survey.after = around.engine.agents().record(agent).map(Counts::of);
        }
        self.pairs = self.snapshots.pairs(before);
        self.n_to_fit = self.pairs.len();
    }

    /// Notes who is idle now.
    pub(super) fn note_idle(&mut self, around: &Surroundings<'_>) {
        self.idle.extend(around.tokens.idle.keys());
    }

    /// Whether there was no room for another agent.
    pub(super) fn is_full(&self) -> bool {
        self.agents.len() >= MAX_AGENTS
    }

    /// What is gathered of an agent; `None` where there is no room.
    pub(super) fn agent(&mut self, agent: AgentId) -> Option<&mut AgentSurvey> {
        let has_room = self.agents.len() < MAX_AGENTS || self.agents.contains_key(&agent);
        has_room.then(|| self.agents.entry(agent).or_default())
    }

    /// Compares some of the pairs that are left; whether none is.
    pub(super) fn fit_some(&mut self, most: usize) -> bool {
        for _ in 0..most {
            let Some(pair) = self.n_to_fit.checked_sub(1).and_then(|n| self.pairs.get(n)) else { break };
            self.n_to_fit -= 1;
            let snapshots = self.snapshots.of(pair);
            let found = fit(&snapshots);
            tracing::debug!(?pair, snapshots = snapshots.len(), ?found, "compared");
            if let Some(ratio) = ratio(&snapshots, &found) {
                self.sizes.insert(*pair, ratio);
            }
            self.fits.insert(*pair, found);
        }
        self.n_to_fit == 0
    }
}
