//! The truth of a simulated run: the scenario's world, asked by Unix time.

use crate::run_log::RunLog;
use crate::score::{AgentFacts, RunFacts, ScoreError, ScoredRun, score};
use crate::truth::Truth;
use v2x_agent::clock::ClockError;
use v2x_agent::scenario::Scenario;
use v2x_agent::truth::TrueObject;
use v2x_agent::world::World;
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// A scenario's world with its start in Unix time.
#[derive(Debug)]
pub struct Simulation<'a> {
    scenario: &'a Scenario,
    world: World,
    start: Timestamp,
}

impl<'a> Simulation<'a> {
    /// The world of a run.
    pub fn new(scenario: &'a Scenario, seed: u64, start: Timestamp) -> Self {
        Self { scenario, world: World::new(scenario, seed), start }
    }

    fn objects_at(&self, at: Timestamp, out: &mut Vec<TrueObject>) {
        self.world.objects_at(at - self.start, out);
    }

    fn agent_pose(&self, agent: &AgentId, at: Timestamp) -> Option<Pose> {
        Some(self.world.agent_pose(self.scenario.agent_index(agent)?, at - self.start))
    }

    /// The agents of the scenario, as the score wants them; `frames_sent` is what each says of itself.
    pub fn agent_facts(&self, frames_sent: impl Fn(&AgentId) -> Option<u64>) -> Vec<AgentFacts> {
        let facts = |(index, agent): (usize, &v2x_agent::scenario::AgentConfig)| AgentFacts {
            id: agent.id,
            itself: self.world.agent_object(index),
            frames_sent: frames_sent(&agent.id),
        };
        self.scenario.agents.iter().enumerate().map(facts).collect()
    }

    /// Scores a run in this world. How old something is goes by when it was captured in truth, not by its stamp.
    pub fn score(&self, log: &RunLog, facts: &RunFacts) -> Result<ScoredRun, ScoreError> {
        if self.scenario.agents.iter().all(|agent| agent.clock == ClockError::default()) {
            return self.with_truth(|truth| score(log, truth, facts));
        }
        let mut log = log.clone();
        for included in log.fused.iter_mut().flat_map(|received| &mut received.frame.includes) {
            let agent = self.scenario.agents.iter().find(|agent| agent.id == included.frame.agent);
            let ahead = agent.map_or(Span::ZERO, |agent| agent.clock.at(included.captured_at - self.start));
            included.captured_at = included.captured_at - ahead;
        }
        self.with_truth(|truth| score(&log, truth, facts))
    }

    /// Lends the truth.
    pub fn with_truth<R>(&self, use_it: impl FnOnce(Truth<'_>) -> R) -> R {
        let objects_at = |at, out: &mut Vec<TrueObject>| self.objects_at(at, out);
        let agent_pose = |agent: &AgentId, at| self.agent_pose(agent, at);
        use_it(Truth { objects_at: &objects_at, agent_pose: &agent_pose })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::virtual_run::VirtualRun;
    use v2x_fusion_hub::engine::Engine;
    use v2x_fusion_hub::settings::HubSettings;

    /// Median end-to-end latency and age of information of ten seconds, ms.
    fn ages_ms(car: &str) -> (f64, f64) {
        let text = include_str!("../../../deploy/scenarios/latency.toml");
        let text = text.replace("kind = \"vehicle\"\n", &format!("kind = \"vehicle\"\n{car}\n"));
        let scenario = Scenario::from_toml(&text).unwrap();
        let settings = HubSettings::from_table(scenario.hub.clone()).unwrap();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
        let (duration, publish) = (Span::from_millis(10_000), settings.publish);
        let run = VirtualRun { scenario: &scenario, seed: 1, start, duration, publish };
        let log = run.run(&mut Engine::new(settings.engine)).unwrap();
        let simulation = Simulation::new(&scenario, 1, start);
        let agents = simulation.agent_facts(|_| None);
        let scenario = scenario.name.clone();
        let facts = RunFacts {
            scenario,
            seed: 1,
            duration_s: 10.0,
            processes: 1,
            agents,
            latency_ms: None,
            compute_ms: None,
        };
        let summary = simulation.score(&log, &facts).unwrap().summary;
        (summary.end_to_end_ms.unwrap().p95, summary.age_of_information_ms.unwrap().p50)
    }

    #[test]
    fn a_wrong_clock_makes_nothing_younger() {
        let (right, wrong) = (ages_ms(""), ages_ms("clock = { offset_ms = 200 }"));
        assert!((right.0 - wrong.0).abs() < 1.0 && (right.1 - wrong.1).abs() < 1.0, "{right:?} {wrong:?}");
    }
}
