//! From a run and the truth to its summary.
//!
//! Scoring starts 2 s after the consumer received a first frame of every agent (of the scenario), and ends with the last
//! fused frame, at its `fused_at`. Fused objects are scored at `fused_at`, in every fused frame of that time; raw
//! detections at `captured_at`, in every detection frame of that time.

use crate::data::run_log::RunLog;
use crate::data::simulation::AgentFacts;
use crate::data::truth::{Observer, Truth};
use crate::score::coverage::Coverage;
use crate::score::percentiles::{Percentiles, nearest_rank};
use crate::score::run::error::ScoreError;
use crate::score::run::summary::{AgentSummary, Summary, Verdict, ratio_to_best_agent};
use crate::score::run::window::Window;
use crate::score::run::{agent, fused};
use crate::score::timing::{age_of_information_ms, end_to_end_ms};
use v2x_common::fused::AgentHealth;
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// From every agent's first frame to the start of scoring.
pub(crate) const SETTLE: Span = Span::from_millis(2000);
/// Least match radius, m.
pub(crate) const MIN_MATCH_RADIUS_M: f64 = 2.0;
/// The match radius over the largest reported standard deviation.
pub(crate) const MATCH_RADIUS_SIGMAS: f64 = 4.0;

/// The facts of a run that are not in its recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunFacts {
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Its duration, s.
    pub duration_s: f64,
    /// Number of operating-system processes.
    pub processes: usize,
    /// The agents of the scenario.
    pub agents: Vec<AgentFacts>,
    /// From the hub's status: frame received → first fused frame put that contains it, ms.
    pub latency_ms: Option<Percentiles>,
    /// From the hub's status: the computing time in it, ms.
    pub compute_ms: Option<Percentiles>,
}

/// A run's summary, and the error of each scored fused frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ScoredRun {
    /// The summary.
    pub summary: Summary,
    /// Fused frames that have an error: place in the log and ATE (m), in order of arrival.
    pub frame_errors: Vec<(usize, f64)>,
    /// Fused frames that have a NEES: place in the log and mean position NEES/2.
    pub frame_nees: Vec<(usize, f64)>,
    /// The agents, in the order of the scenario.
    pub observers: Vec<Observer>,
}

impl ScoredRun {
    /// Place in the log of the fused frame with the median error; `None` where no frame has one.
    pub(crate) fn median_frame(&self) -> Option<usize> {
        let mut by_error = self.frame_errors.clone();
        by_error.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        nearest_rank(&by_error, 50).map(|(place, _)| *place)
    }
}

/// Scores a run.
pub(crate) fn score(log: &RunLog, truth: Truth<'_>, facts: &RunFacts) -> Result<ScoredRun, ScoreError> {
    let observers = observers(log, &facts.agents)?;
    let window = window(log, &observers)?;
    let match_radius_m = match_radius_m(log, &observers);
    let mut coverage = Coverage::new(truth, &observers);
    let fused = fused::score(&log.fused, window, match_radius_m, &mut coverage);
    let health = log.fused.last().map_or(&[][..], |last| &last.frame.agents);
    let mut agents = Vec::with_capacity(facts.agents.len());
    for (place, facts) in facts.agents.iter().enumerate() {
        let (metrics, common) = agent::score(log, place, window, match_radius_m, &mut coverage)?;
        let kind = log.descriptions.get(&facts.id).ok_or(ScoreError::NoDescription(facts.id))?.kind;
        let health = health.iter().find(|health| health.agent == facts.id);
        let count = |of: fn(&AgentHealth) -> u64| health.map(of);
        agents.push(AgentSummary {
            id: facts.id,
            kind,
            metrics,
            common,
            frames_sent: facts.frames_sent,
            frames_received: count(|health| health.accepted + health.refused),
            frames_refused: count(|health| health.refused),
            frames_late: count(|health| health.out_of_sequence),
        });
    }
    let scored = || log.fused.iter().filter(|received| window.contains(received.frame.fused_at));
    let last_received_at = scored().map(|received| received.received_at).max().unwrap_or(window.end);
    let summary = Summary {
        verdict: Verdict::of(&fused.summary, &agents),
        scenario: facts.scenario.clone(),
        seed: facts.seed,
        processes: facts.processes,
        duration_s: facts.duration_s,
        scored_s: (window.end - window.start).as_secs_f64(),
        match_radius_m,
        ate_ratio_to_best_agent: ratio_to_best_agent(&fused.summary, &agents),
        fused: fused.summary,
        agents,
        latency_ms: facts.latency_ms,
        compute_ms: facts.compute_ms,
        end_to_end_ms: end_to_end_ms(scored()),
        age_of_information_ms: age_of_information_ms(&log.fused, window.start, last_received_at),
    };
    Ok(ScoredRun { summary, frame_errors: fused.frame_errors, frame_nees: fused.frame_nees, observers })
}

fn observers(log: &RunLog, agents: &[AgentFacts]) -> Result<Vec<Observer>, ScoreError> {
    let observer = |facts: &AgentFacts| {
        let description = log.descriptions.get(&facts.id).ok_or(ScoreError::NoDescription(facts.id))?;
        Ok(Observer { agent: facts.id, field_of_view: description.field_of_view, itself: facts.itself })
    };
    agents.iter().map(observer).collect()
}

fn window(log: &RunLog, observers: &[Observer]) -> Result<Window, ScoreError> {
    let first_of = |agent: AgentId| {
        let frames = log.detections.iter().filter(|received| received.frame.id.agent == agent);
        frames.map(|received| received.received_at).min().ok_or(ScoreError::NoDetections(agent))
    };
    let firsts = observers.iter().map(|o| first_of(o.agent)).collect::<Result<Vec<_>, _>>()?;
    let start = *firsts.iter().max().ok_or(ScoreError::NoAgents)? + SETTLE;
    let end = log.fused.iter().map(|received| received.frame.fused_at).max();
    let end = end.filter(|end| *end >= start).ok_or(ScoreError::NoFusedFrames { start })?;
    Ok(Window { start, end })
}

/// max(2 m, 4 × the largest marginal σ of a position that any agent of the scenario reported).
fn match_radius_m(log: &RunLog, observers: &[Observer]) -> f64 {
    let frames = log.detections.iter().map(|received| &received.frame);
    let ours = frames.filter(|frame| observers.iter().any(|o| o.agent == frame.id.agent));
    let sigmas = ours.flat_map(|frame| &frame.detections).map(|d| d.covariance.position.max_sigma());
    sigmas.fold(MIN_MATCH_RADIUS_M, |radius, sigma| radius.max(MATCH_RADIUS_SIGMAS * sigma))
}
