//! The report of a run as one self-contained page: the verdict first.

use crate::data::run_log::RunLog;
use crate::report::markdown::EXPLANATIONS;
use crate::report::page::{Section, figure, notes, page, verdict_html};
use crate::report::palette::{AGENTS, OURS, SERIES};
use crate::report::plot::bev::bev_pieces;
use crate::report::plot::curves::{CurvePlot, Panel, Point, Style, Top};
use crate::report::plot::marker::Marker;
use crate::report::plot::scene::BevScene;
use crate::report::summary::{Of, accuracy, frames, gain, headline, spans, tracks};
use crate::report::table::{Table, escaped};
use crate::score::run::scored_run::ScoredRun;
use crate::score::timing::{ages_ms, arrival_to_consumer_spans_ms, end_to_end_spans_ms};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;

/// The points of a curve are at most so many: means over equal parts of the time.
const MAX_POINTS: usize = 150;

/// What the column of the agents' table is that no other report has.
const NIS: &str = "**NIS/2**: squared distance of an agent's detections from what the hub expects of them, over what both \
    covariances promise, for each degree of freedom; mean over the hub's last minute. 1 is right; more says that the agent \
    states too small errors.";

/// What the page shows.
pub(crate) struct RunPage<'a> {
    pub(crate) scored: &'a ScoredRun,
    pub(crate) log: &'a RunLog,
    /// Mean NIS of each agent's positions over its degrees of freedom, in the hub's last minute.
    pub(crate) nis: BTreeMap<AgentId, f64>,
    /// Key frames.
    pub(crate) moments: &'a [BevScene],
    /// When and by which build it was recorded.
    pub(crate) commit: Option<String>,
}

/// The page.
pub(crate) fn run_page(run: &RunPage<'_>) -> String {
    let summary = &run.scored.summary;
    let title = format!("{}, seed {}", summary.scenario, summary.seed);
    let reasons: Vec<String> = summary.verdict.reasons.iter().cloned().chain([gain(summary)]).collect();
    let word = if summary.verdict.passed { "Passed" } else { "Not passed" };
    let commit = run.commit.as_ref().map_or_else(String::new, |commit| format!(" {commit}."));
    let top = format!(
        "{}<p>{}.{} {}</p>\n",
        verdict_html(summary.verdict.passed, word, &reasons),
        escaped(&headline(summary)),
        escaped(&commit),
        escaped(&tracks(summary))
    );
    let moments: String = run.moments.iter().map(|scene| figure(&bev_pieces(scene), None)).collect();
    let sections = [
        ("common", "Objects that all agents cover", accuracy(summary, Of::Common).html(&["fused"])),
        ("everything", "Everything that each covers", accuracy(summary, Of::Everything).html(&["fused"])),
        ("errors", "Errors over time", figure(&errors(run).pieces(), None)),
        ("time", "Time", figure(&latencies(run).pieces(), None) + &spans(summary).html(&[])),
        ("agents", "Agents", agents(run).html(&[])),
        ("moments", "Key frames", moments),
        ("meaning", "What the figures mean", notes(explanations())),
    ];
    let sections = sections.into_iter().filter(|(_, _, html)| !html.is_empty());
    let sections: Vec<_> = sections.map(|(id, title, html)| Section::new(id, title, html)).collect();
    page(&title, &top, &sections)
}

/// The counts of frames, and the NIS.
fn agents(run: &RunPage<'_>) -> Table {
    let mut table = frames(&run.scored.summary);
    table.header[0] = "agent".to_owned();
    table.header.push("NIS/2".to_owned());
    for (row, agent) in table.rows.iter_mut().zip(&run.scored.summary.agents) {
        row.push(run.nis.get(&agent.id).map_or_else(|| "–".to_owned(), |nis| format!("{nis:.2}")));
    }
    table
}

fn style(name: &str, colour: crate::report::palette::Colour, dash: f64) -> Style {
    let is_first = colour == OURS;
    Style { name: name.to_owned(), colour, dash, marker: Marker::Disc, is_dotted: false, is_first }
}

/// The fused error of each frame beside each agent's mean, and how consistent its covariance is.
fn errors(run: &RunPage<'_>) -> CurvePlot {
    let ScoredRun { summary, frame_errors, frame_nees, .. } = run.scored;
    let fused = means_over_time(run.log, frame_errors);
    let reach = fused.last().map_or(1.0, |last| last.x);
    let mut styles = vec![style("fused", OURS, 0.0)];
    let mut curves = vec![fused];
    for (agent, colour) in summary.agents.iter().zip(AGENTS.into_iter().cycle()) {
        let Some(ate_m) = agent.metrics.ate_m else { continue };
        styles.push(style(&format!("{}, mean", agent.id), colour, 5.0));
        curves.push([0.0, reach].map(|x| Point { x, y: ate_m, spread: 0.0 }).into());
    }
    let nees = means_over_time(run.log, frame_nees);
    CurvePlot {
        title: "Position error and consistency".to_owned(),
        subtitle: "all that is covered; dashed: the NEES of a consistent filter".to_owned(),
        x_label: "since scoring began, s".to_owned(),
        x_names: None,
        styles,
        panels: vec![
            Panel { label: "ATE (m)".to_owned(), curves, top: Top::Whole, target: None },
            Panel { label: "NEES/2".to_owned(), curves: vec![nees], top: Top::Whole, target: Some(1.0) },
        ],
    }
}

/// Values of fused frames over the time since the first of them, s.
fn means_over_time(log: &RunLog, values: &[(usize, f64)]) -> Vec<Point> {
    let at = |place: usize| log.fused.get(place).map(|received| received.frame.fused_at);
    let Some(start) = values.first().and_then(|(place, _)| at(*place)) else { return Vec::new() };
    let mean = |part: &[(usize, f64)]| {
        let points = part.iter().filter_map(|(place, y)| Some(((at(*place)? - start).as_secs_f64(), *y)));
        let (n, x, y) = points.fold((0.0, 0.0, 0.0), |(n, xs, ys), (x, y)| (n + 1.0, xs + x, ys + y));
        (n > 0.0).then(|| Point { x: x / n, y: y / n, spread: 0.0 })
    };
    values.chunks(values.len().div_ceil(MAX_POINTS).max(1)).filter_map(mean).collect()
}

/// Distributions of latencies at the consumer.
fn latencies(run: &RunPage<'_>) -> CurvePlot {
    let scored = || run.scored.frame_errors.iter().filter_map(|(place, _)| run.log.fused.get(*place));
    let start = scored().map(|received| received.frame.fused_at).min();
    let end = scored().map(|received| received.received_at).max();
    let ages = start.zip(end).map_or_else(Vec::new, |(start, end)| ages_ms(&run.log.fused, start, end));
    let curves = [arrival_to_consumer_spans_ms(scored()), end_to_end_spans_ms(scored()), ages];
    let names = ["at the hub → at the consumer", "captured → at the consumer", "age of information"];
    let colours = [SERIES[6], SERIES[4], SERIES[5]];
    CurvePlot {
        title: "Latency of detection frames, and age of what the consumer has".to_owned(),
        subtitle: "the longest hundredth is left out".to_owned(),
        x_label: "at most, ms".to_owned(),
        x_names: None,
        styles: names.into_iter().zip(colours).map(|(name, colour)| style(name, colour, 0.0)).collect(),
        panels: vec![Panel {
            label: "share that is at most so long".to_owned(),
            curves: curves.map(shares).into(),
            top: Top::At(1.0),
            target: None,
        }],
    }
}

/// The distribution by percent, without the longest one: it would make all others narrow.
fn shares(mut spans_ms: Vec<f64>) -> Vec<Point> {
    spans_ms.sort_by(f64::total_cmp);
    let at = |percent: u32| {
        let place = (spans_ms.len() * percent as usize / 100).min(spans_ms.len().saturating_sub(1));
        Some(Point { x: *spans_ms.get(place)?, y: f64::from(percent) / 100.0, spread: 0.0 })
    };
    (0..100).filter_map(at).collect()
}

/// What the figures mean, one a line.
fn explanations() -> impl Iterator<Item = &'static str> {
    EXPLANATIONS.lines().map(|line| line.trim_start_matches("- ")).chain([NIS])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::scene::{Moment, scene_at};
    use crate::score::run::test_run::{pose, run, scored, world};

    fn page_of(change: impl FnOnce(&mut ScoredRun)) -> String {
        let (log, facts) = run();
        let mut scored = scored(&log, &facts).unwrap();
        change(&mut scored);
        let truth = crate::data::truth::Truth { objects_at: &world, agent_pose: &pose };
        let moments: Vec<_> = scene_at(Moment::Typical, &scored, &log, truth).into_iter().collect();
        let commit = Some("Started then".to_owned());
        run_page(&RunPage { scored: &scored, log: &log, nis: BTreeMap::new(), moments: &moments, commit })
    }

    #[test]
    fn what_fusion_gains_is_in_the_verdict_also_where_the_run_does_not_pass() {
        let passed = page_of(|_| {});
        let failed = page_of(|scored| scored.summary.verdict.fail("rsu ended with exit code 3".to_owned()));
        for page in [&passed, &failed] {
            let verdict = page.split("class=\"verdict").nth(1).unwrap().split("</div>").next().unwrap();
            assert!(verdict.contains("the fused error is") && verdict.contains("recall"), "{verdict}");
        }
        assert!(failed.contains("<p>rsu ended with exit code 3</p>") && failed.contains("Not passed"));
    }

    #[test]
    fn the_page_links_to_its_parts_and_explains_the_nis() {
        let page = page_of(|_| {});
        for part in ["href=\"#moments\"", "id=\"moments\"", "<b>NIS/2</b>", "last minute", "m. Started then."]
        {
            assert!(page.contains(part), "{part} in {page}");
        }
        assert!(!page.contains("src="), "nothing from elsewhere");
    }
}
