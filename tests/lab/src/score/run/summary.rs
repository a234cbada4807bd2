//! The summary of a run: the contents of `summary.json`.

use crate::score::continuity::TrackSummary;
use crate::score::frame_metrics::Metrics;
use crate::score::percentiles::Percentiles;
use serde::{Deserialize, Serialize};
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorKind;

/// The score of a run. A figure without data is null, never 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Whether fusion beats every agent, and if not, why.
    pub verdict: Verdict,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the world and of every agent's noise.
    pub seed: u64,
    /// Number of operating-system processes.
    pub processes: usize,
    /// Duration of the run, s.
    pub duration_s: f64,
    /// Duration of the scored part, s: from 2 s after every agent's first frame to the last fused frame.
    pub scored_s: f64,
    /// Match radius of fused objects, m.
    pub match_radius_m: f64,
    /// The fused list.
    pub fused: FusedSummary,
    /// Every agent's raw detections, in the order of the scenario.
    pub agents: Vec<AgentSummary>,
    /// Fused `ate_m` on common objects over the best agent's.
    pub ate_ratio_to_best_agent: Option<f64>,
    /// Detection frame received by the hub → first fused frame put that contains it, ms.
    pub latency_ms: Option<Percentiles>,
    /// The hub's computing time in it, ms.
    pub compute_ms: Option<Percentiles>,
    /// Captured by the agent → received by the consumer in the first fused frame that contains it, ms.
    pub end_to_end_ms: Option<Percentiles>,
    /// At the consumer, every 10 ms: now less the newest contained `captured_at`, ms.
    pub age_of_information_ms: Option<Percentiles>,
}

/// The score of the fused list.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FusedSummary {
    /// Over the objects that any agent covers, agents included.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Over the objects that all agents cover at that moment.
    pub common: Metrics,
    /// Track continuity.
    pub tracks: TrackSummary,
}

/// The score of one agent's raw detections, and the hub's counts of its frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgentSummary {
    /// Which agent.
    pub id: AgentId,
    /// The kind of its sensor.
    pub kind: SensorKind,
    /// Over the objects that this agent covers, without itself.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Over the objects that all agents cover at that moment.
    pub common: Metrics,
    /// Frames that the agent reports as sent.
    pub frames_sent: Option<u64>,
    /// Frames that reached the hub, accepted or refused.
    pub frames_received: Option<u64>,
    /// Frames that the hub refused, for any reason.
    pub frames_refused: Option<u64>,
    /// Frames that the hub accepted out of sequence.
    pub frames_late: Option<u64>,
}

/// Whether the run passes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verdict {
    /// There are no reasons against it.
    pub passed: bool,
    /// The reasons against it.
    pub reasons: Vec<String>,
}

/// A recall or precision below this is bad, unless the best agent's is no better: a small mean error over few objects, or
/// beside many false ones, is no success.
const LEAST_SHARE: f64 = 0.8;
/// The same of a method that somebody chose.
const LEAST_OF_CHOSEN: f64 = 0.2;

impl Verdict {
    /// It passes if the fused error on common objects is below every agent's, and neither recall nor precision is bad on
    /// these objects. A missing error is a reason against it.
    pub fn of(fused: &FusedSummary, agents: &[AgentSummary]) -> Self {
        let mut verdict = Self { passed: true, reasons: Vec::new() };
        let Some(fused_m) = fused.common.ate_m else {
            verdict.fail("no fused object was matched to an object that all agents cover".to_owned());
            return verdict;
        };
        for AgentSummary { id, common, .. } in agents {
            match common.ate_m {
                None => verdict.fail(format!("{id} detected no object that all agents cover")),
                Some(agent_m) if fused_m < agent_m => {}
                Some(agent_m) => verdict.fail(format!(
                    "the fused error on common objects, {fused_m:.3} m, is not below that of {id}, {agent_m:.3} m"
                )),
            }
        }
        verdict.judge_share(("recall", LEAST_SHARE), agents, fused, |metrics| metrics.recall);
        verdict.judge_share(("precision", LEAST_SHARE), agents, fused, |metrics| metrics.precision);
        verdict
    }

    /// It passes if the published objects are the true ones, however accurate they are: of objects that agents cover some are found, and
    /// neither recall nor precision is bad: by less for a method that was chosen, such as a rule for single frames, whose figures are a result.
    pub fn of_objects(fused: &FusedSummary, agents: &[AgentSummary], is_method_chosen: bool) -> Self {
        let mut verdict = Self { passed: true, reasons: Vec::new() };
        if fused.metrics.ate_m.is_none() && fused.metrics.recall.is_some() {
            verdict.fail("no published object is where a true one is".to_owned());
            return verdict;
        }
        let least = if is_method_chosen { LEAST_OF_CHOSEN } else { LEAST_SHARE };
        verdict.judge_share(("recall", least), agents, fused, |metrics| metrics.recall);
        verdict.judge_share(("precision", least), agents, fused, |metrics| metrics.precision);
        verdict
    }

    fn judge_share(
        &mut self,
        (name, limit): (&str, f64),
        agents: &[AgentSummary],
        fused: &FusedSummary,
        share: fn(&Metrics) -> Option<f64>,
    ) {
        let best = agents.iter().filter_map(|agent| share(&agent.common)).max_by(f64::total_cmp);
        let least = best.map_or(limit, |best| best.min(limit));
        if let Some(fused) = share(&fused.common).filter(|fused| *fused < least) {
            self.fail(format!(
                "the fused {name} on common objects, {fused:.3}, is below {limit} and the best agent's"
            ));
        }
    }

    /// Adds a reason against.
    pub fn fail(&mut self, reason: String) {
        self.passed = false;
        self.reasons.push(reason);
    }
}

/// The fused error on common objects over the best agent's; `None` where either is missing.
pub(crate) fn ratio_to_best_agent(fused: &FusedSummary, agents: &[AgentSummary]) -> Option<f64> {
    let best = agents.iter().filter_map(|agent| agent.common.ate_m).min_by(f64::total_cmp)?;
    (best > 0.0).then_some(fused.common.ate_m? / best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::fixture::summary;

    fn verdict_of(fused_m: Option<f64>, agents_m: [Option<f64>; 2]) -> Verdict {
        let mut summary = summary();
        summary.fused.common.ate_m = fused_m;
        for (agent, ate_m) in summary.agents.iter_mut().zip(agents_m) {
            agent.common.ate_m = ate_m;
        }
        Verdict::of(&summary.fused, &summary.agents)
    }

    #[test]
    fn fusion_must_be_better_than_every_agent_and_the_summary_names_exceptions() {
        assert!(verdict_of(Some(0.3), [Some(0.5), Some(0.4)]).passed);
        let lost = verdict_of(Some(0.4), [Some(0.5), Some(0.4)]);
        assert!(!lost.passed);
        assert_eq!(lost.reasons.len(), 1);
        assert!(lost.reasons[0].contains("rsu, 0.400 m"), "{:?}", lost.reasons);
    }

    #[test]
    fn a_small_error_does_not_excuse_the_fault_of_objects_that_are_missed_or_made_up() {
        let verdict_with = |recall, precision, of_agents| {
            let mut summary = summary();
            summary.fused.common = Metrics {
                ate_m: Some(0.01),
                recall: Some(recall),
                precision: Some(precision),
                ..summary.fused.common
            };
            for agent in &mut summary.agents {
                agent.common.recall = Some(of_agents);
                agent.common.precision = Some(of_agents);
            }
            Verdict::of(&summary.fused, &summary.agents)
        };
        assert!(verdict_with(0.8, 0.8, 0.95).passed);
        let missing = verdict_with(0.79, 0.99, 0.95).reasons;
        assert!(missing.len() == 1 && missing[0].contains("recall on common objects, 0.790"), "{missing:?}");
        let made_up = verdict_with(0.99, 0.5, 0.95).reasons;
        assert!(made_up.len() == 1 && made_up[0].contains("precision"), "{made_up:?}");
        // Where no agent sees more, the list cannot either.
        assert!(verdict_with(0.6, 0.6, 0.6).passed);
    }

    #[test]
    fn objects_that_are_not_the_true_ones_are_told_and_inaccurate_ones_are_a_result() {
        let of_objects = |ate_m, recall| {
            let mut summary = summary();
            summary.fused.metrics = Metrics { ate_m, recall, ..summary.fused.metrics };
            summary.fused.common.ate_m = Some(9.0);
            Verdict::of_objects(&summary.fused, &summary.agents, false)
        };
        assert!(of_objects(Some(9.0), Some(1.0)).passed, "less accurate than an agent");
        assert!(of_objects(None, None).passed, "nothing to see");
        let nothing = of_objects(None, Some(0.0)).reasons;
        assert_eq!(nothing, ["no published object is where a true one is"]);
        let chosen = |precision, is_method_chosen| {
            let mut summary = summary();
            summary.fused.common =
                Metrics { precision: Some(precision), recall: Some(1.0), ..summary.fused.common };
            summary.agents.iter_mut().for_each(|agent| agent.common.precision = Some(0.95));
            Verdict::of_objects(&summary.fused, &summary.agents, is_method_chosen).passed
        };
        assert!(
            chosen(0.6, true) && !chosen(0.6, false) && !chosen(0.1, true),
            "a rule that leaves doubles is a result"
        );
    }

    #[test]
    fn a_run_without_data_to_compare_does_not_pass() {
        assert!(!verdict_of(None, [Some(0.5), Some(0.4)]).passed);
        assert!(!verdict_of(Some(0.1), [None, Some(0.4)]).passed);
    }

    #[test]
    fn the_ratio_is_to_the_best_agent_and_missing_without_data() {
        let mut summary = summary();
        summary.fused.common.ate_m = Some(0.2);
        assert_eq!(ratio_to_best_agent(&summary.fused, &summary.agents), Some(0.5));
        summary.fused.common.ate_m = None;
        assert_eq!(ratio_to_best_agent(&summary.fused, &summary.agents), None);
    }

    #[test]
    fn json_has_the_documented_field_names() {
        let json = serde_json::to_value(summary()).unwrap();
        for pointer in [
            "/fused/ate_m",
            "/fused/ade_m",
            "/fused/aoe_deg",
            "/fused/precision",
            "/fused/recall",
            "/fused/gospa_m",
            "/fused/common/ate_m",
            "/agents/0/id",
            "/agents/0/kind",
            "/agents/0/ate_m",
            "/agents/0/common/aoe_deg",
            "/agents/0/frames_sent",
            "/agents/0/frames_received",
            "/agents/0/frames_refused",
            "/latency_ms/p50",
            "/end_to_end_ms/p95",
            "/age_of_information_ms/p99",
            "/compute_ms",
            "/processes",
            "/seed",
            "/duration_s",
            "/match_radius_m",
        ] {
            assert!(json.pointer(pointer).is_some(), "{pointer} is missing in {json:#}");
        }
        assert_eq!(json["agents"][0]["kind"], "vehicle");
        assert!(json["compute_ms"].is_null());
        let back: Summary = serde_json::from_value(json).unwrap();
        assert_eq!(back, summary());
    }
}
