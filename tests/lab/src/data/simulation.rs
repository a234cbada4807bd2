//! The truth of a simulated run: the scenario's world by Unix time.

use crate::data::run_log::RunLog;
use crate::data::truth::Truth;
use v2x_agent::clock::ClockError;
use v2x_agent::scenario::Scenario;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_agent::world::{Road, World};
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// What the launcher knows of one agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AgentFacts {
    /// Which agent.
    pub id: AgentId,
    /// The object of the world that is this agent, if there is one.
    pub itself: Option<ObjectId>,
    /// Number of frames that it reports as sent.
    pub frames_sent: Option<u64>,
}

/// A scenario's world with its start in Unix time.
#[derive(Debug)]
pub(crate) struct Simulation<'a> {
    scenario: &'a Scenario,
    world: World,
    start: Timestamp,
}

impl<'a> Simulation<'a> {
    /// The world of a run.
    pub(crate) fn new(scenario: &'a Scenario, seed: u64, start: Timestamp) -> Self {
        Self { scenario, world: scenario.world(seed), start }
    }

    /// The scenario's name.
    pub(crate) fn name(&self) -> &str {
        &self.scenario.name
    }

    /// The lines on the ground of its world.
    pub(crate) fn roads(&self) -> Vec<Road> {
        self.scenario.world.roads()
    }

    fn objects_at(&self, at: Timestamp, out: &mut Vec<TrueObject>) {
        self.world.objects_at(at - self.start, out);
    }

    fn agent_pose(&self, agent: &AgentId, at: Timestamp) -> Option<Pose> {
        self.world.agent_pose(self.scenario.agent_index(agent)?, at - self.start)
    }

    /// The agents of the scenario, for scoring; `frames_sent` gives the number that each reports as sent.
    pub(crate) fn agent_facts(&self, frames_sent: impl Fn(&AgentId) -> Option<u64>) -> Vec<AgentFacts> {
        let facts = |(index, agent): (usize, &v2x_agent::scenario::AgentConfig)| AgentFacts {
            id: agent.id(),
            itself: self.world.agent_object(index),
            frames_sent: frames_sent(&agent.id()),
        };
        self.scenario.agents.iter().enumerate().map(facts).collect()
    }

    /// The same log with true capture times in the `includes` of fused frames; `None` where all clocks are right. The age of
    /// information is measured from the true capture, not from the time stamp.
    pub(crate) fn with_true_capture_times(&self, log: &RunLog) -> Option<RunLog> {
        if self.scenario.agents.iter().all(|agent| agent.sensor.clock == ClockError::default()) {
            return None;
        }
        let mut log = log.clone();
        for included in log.fused.iter_mut().flat_map(|received| &mut received.frame.includes) {
            let agent = self.scenario.agents.iter().find(|agent| agent.id() == included.frame.agent);
            let ahead =
                agent.map_or(Span::ZERO, |agent| agent.sensor.clock.at(included.captured_at - self.start));
            included.captured_at = included.captured_at - ahead;
        }
        Some(log)
    }

    /// Calls a function with the truth.
    pub(crate) fn with_truth<R>(&self, use_it: impl FnOnce(Truth<'_>) -> R) -> R {
        let objects_at = |at, out: &mut Vec<TrueObject>| self.objects_at(at, out);
        let agent_pose = |agent: &AgentId, at| self.agent_pose(agent, at);
        use_it(Truth { objects_at: &objects_at, agent_pose: &agent_pose })
    }
}
