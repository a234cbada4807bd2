//! Scoring a run in the world of its scenario.

use crate::data::run_log::RunLog;
use crate::data::simulation::Simulation;
use crate::score::run::error::ScoreError;
use crate::score::run::scored_run::{RunFacts, ScoredRun, score};

/// Scores a run in its world.
pub(crate) fn score_in_world(
    simulation: &Simulation<'_>,
    log: &RunLog,
    facts: &RunFacts,
) -> Result<ScoredRun, ScoreError> {
    let corrected = simulation.with_true_capture_times(log);
    simulation.with_truth(|truth| score(corrected.as_ref().unwrap_or(log), truth, facts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::virtual_run::VirtualRun;
    use v2x_agent::scenario::Scenario;
    use v2x_common::time::{Span, Timestamp};
    use v2x_fusion_hub::engine::Engine;
    use v2x_fusion_hub::hub::HubSettings;

    /// Median end-to-end latency and age of information of ten seconds, ms.
    fn ages_ms(car: &str) -> (f64, f64) {
        let text = include_str!("../../../../../deploy/scenarios/latency.toml");
        let text = text.replace("kind = \"vehicle\"\n", &format!("kind = \"vehicle\"\n{car}\n"));
        let scenario = Scenario::from_toml(&text).unwrap();
        let settings = HubSettings::from_table(scenario.hub.clone()).unwrap();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000_000);
        let duration = Span::from_millis(10_000);
        let run = VirtualRun { scenario: &scenario, seed: 1, start, duration, settings: &settings };
        let log = run.run(Engine::new(settings.engine)).unwrap();
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
        let summary = score_in_world(&simulation, &log, &facts).unwrap().summary;
        (summary.end_to_end_ms.unwrap().p95, summary.age_of_information_ms.unwrap().p50)
    }

    #[test]
    fn clock_errors_do_not_reduce_the_age_of_information() {
        let (right, wrong) = (ages_ms(""), ages_ms("clock = { offset_ms = 200 }"));
        assert!((right.0 - wrong.0).abs() < 1.0 && (right.1 - wrong.1).abs() < 1.0, "{right:?} {wrong:?}");
    }
}
