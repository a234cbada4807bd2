//! The report of a run as one self-contained page: the verdict first.

use crate::data::run_log::{ReceivedFused, RunLog};
use crate::drive::rerun::FrameInnovations;
use crate::report::markdown::EXPLANATIONS;
use crate::report::page::{Section, beside, figure, notes, page, verdict_html};
use crate::report::palette::OURS;
use crate::report::plot::bev::bev_parts;
use crate::report::plot::curves::{CurvePlot, Panel, Point, Top};
use crate::report::plot::scene::BevScene;
use crate::report::run_curves::{HUB_TO_CONSUMER, coloured, latencies, means, nis_over_time, style};
use crate::report::summary::{Of, accuracy, frames, gain, headline, spans as summary_spans, tracks};
use crate::report::table::{Table, escaped};
use crate::score::percentiles::Percentiles;
use crate::score::run::scored_run::ScoredRun;
use crate::score::run::summary::Summary;
use crate::score::timing::{ages_ms, arrival_to_consumer_spans_ms};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;

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
    /// Innovations of each frame, of the hub's core on what the hub was given; empty where the recording does not hold that.
    pub(crate) innovations: &'a [FrameInnovations],
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
    let moments: String = run.moments.iter().map(|scene| figure(&bev_parts(scene), None)).collect();
    let sections = [
        ("scores", "Scores", scores(summary)),
        ("moments", "Key frames", moments),
        ("errors", "Errors over time", figure(&errors(run).parts(), None)),
        ("time", "Latency", latencies_of(run)),
        ("agents", "Agents", agents(run).html(&[])),
        ("meaning", "What the figures mean", notes(explanations())),
    ];
    let sections = sections.into_iter().filter(|(_, _, html)| !html.is_empty());
    let sections: Vec<_> = sections.map(|(id, title, html)| Section::new(id, title, html)).collect();
    page(&title, &top, &sections)
}

/// The tables of what all agents cover and of everything, beside each other where there is room.
fn scores(summary: &Summary) -> String {
    let table = |title: &str, of: Of| {
        format!("<div><h3>{title}</h3>\n{}</div>\n", accuracy(summary, of).html(&["fused"]))
    };
    let tables =
        [("Objects that all agents cover", Of::Common), ("Everything that each covers", Of::Everything)];
    let tables: String = tables.into_iter().map(|(title, of)| table(title, of)).collect();
    format!("<div class=\"pair\">\n{tables}</div>\n")
}

/// The spans of the summary, and the one from hub to consumer that the figure has.
fn spans(run: &RunPage<'_>) -> Table {
    let mut table = summary_spans(&run.scored.summary);
    let spans = Percentiles::of(arrival_to_consumer_spans_ms(scored_lists(run)));
    let row = spans.map(|spans| [spans.p50, spans.p95, spans.p99].map(|ms| format!("{ms:.1}")));
    if let Some(row) = row {
        let place = table.rows.len().min(2);
        table.rows.insert(place, std::iter::once(HUB_TO_CONSUMER.to_owned()).chain(row).collect());
    }
    table
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

/// The fused error of each frame beside each agent's mean, and how consistent its covariance is.
fn errors(run: &RunPage<'_>) -> CurvePlot {
    let ScoredRun { summary, frame_errors, frame_nees, .. } = run.scored;
    let fused = means_over_time(run.log, frame_errors);
    let start = frame_errors.first().and_then(|(place, _)| Some(run.log.fused.get(*place)?.frame.fused_at));
    let mut styles = vec![style("fused", OURS, 0.0)];
    let (mut means, mut nis) = (Vec::new(), vec![Vec::new()]);
    for (agent, colour) in coloured(summary.agents.iter().map(|agent| agent.id)) {
        let ate_m = summary.agents.iter().find(|of| of.id == agent).and_then(|of| of.metrics.ate_m);
        means.extend(ate_m.map(|ate_m| (styles.len(), ate_m)));
        styles.push(style(agent.as_str(), colour, 0.0));
        nis.push(start.map_or_else(Vec::new, |start| nis_over_time(agent, run.innovations, start)));
    }
    let nees = means_over_time(run.log, frame_nees);
    let mut panels = vec![
        panel("ATE (m)", vec![fused], (Top::Whole, None), means),
        panel("NEES/2", vec![nees], (Top::Whole, Some(1.0)), Vec::new()),
    ];
    if nis.iter().any(|curve| !curve.is_empty()) {
        panels.push(panel("NIS/2", nis, (Top::Most, Some(1.0)), Vec::new()));
    }
    CurvePlot {
        title: "Position error and consistency".to_owned(),
        subtitle:
            "everything that is covered; dashed: an agent's mean, and the NEES and NIS of a consistent filter"
                .to_owned(),
        x_label: "since scoring began, s".to_owned(),
        x_names: None,
        styles,
        panels,
    }
}

fn panel(
    label: &str,
    curves: Vec<Vec<Point>>,
    (top, target): (Top, Option<f64>),
    levels: Vec<(usize, f64)>,
) -> Panel {
    Panel { label: label.to_owned(), curves, top, target, levels }
}

/// Values of fused frames over the time since the first of them, s.
fn means_over_time(log: &RunLog, values: &[(usize, f64)]) -> Vec<Point> {
    let at = |(place, y): &(usize, f64)| Some((log.fused.get(*place)?.frame.fused_at, *y));
    let values: Vec<_> = values.iter().filter_map(at).collect();
    values.first().map_or_else(Vec::new, |(start, _)| means(&values, *start))
}

/// Latencies of what was scored: a figure, where there are any, and a table.
fn latencies_of(run: &RunPage<'_>) -> String {
    let start = scored_lists(run).map(|received| received.frame.fused_at).min();
    let end = scored_lists(run).map(|received| received.received_at).max();
    let ages = start.zip(end).map_or_else(Vec::new, |(start, end)| ages_ms(&run.log.fused, start, end));
    let drawn = latencies(scored_lists(run), ages).map_or_else(String::new, |parts| figure(&parts, None));
    beside(&drawn, &spans(run).html(&[]))
}

fn scored_lists<'a>(run: &RunPage<'a>) -> impl Iterator<Item = &'a ReceivedFused> + Clone {
    let log = run.log;
    run.scored.frame_errors.iter().filter_map(|(place, _)| log.fused.get(*place))
}

/// What the figures mean, one a line.
fn explanations() -> impl Iterator<Item = &'static str> {
    EXPLANATIONS.lines().map(|line| line.trim_start_matches("- ")).chain([NIS])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{agent, at_ms};
    use crate::report::plot::scene::{Moment, scene_at};
    use crate::score::run::test_run::{pose, run, scored, world};
    use v2x_fusion_hub::fusion::Innovations;

    fn innovations_of_ego(k: i64) -> FrameInnovations {
        FrameInnovations {
            agent: agent("ego"),
            at: at_ms(1_000 + 100 * k),
            innovations: Innovations { nis_sum: 4.0, count: 2 },
        }
    }

    fn page_of(change: impl FnOnce(&mut ScoredRun)) -> String {
        let (log, facts) = run();
        let mut scored = scored(&log, &facts).unwrap();
        change(&mut scored);
        let truth = crate::data::truth::Truth { objects_at: &world, agent_pose: &pose };
        let moments: Vec<_> = scene_at(Moment::Typical, &scored, &log, truth).into_iter().collect();
        let commit = Some("Started then".to_owned());
        let innovations: Vec<_> = (0..40).map(innovations_of_ego).collect();
        let page = RunPage {
            scored: &scored,
            log: &log,
            nis: BTreeMap::new(),
            innovations: &innovations,
            moments: &moments,
            commit,
        };
        run_page(&page)
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
    fn consistency_is_shown_over_time_of_the_list_and_of_the_agents() {
        let page = page_of(|_| {});
        for panel in ["ATE (m)", "NEES/2", "NIS/2"] {
            assert!(
                page.contains(&format!("aria-label=\"Position error and consistency: {panel}\"")),
                "{panel}"
            );
        }
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
