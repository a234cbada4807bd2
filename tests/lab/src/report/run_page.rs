//! The report of a run as one self-contained page: the verdict first.

use crate::data::run_log::RunLog;
use crate::report::markdown::EXPLANATIONS;
use crate::report::page::{figure, page, verdict_html};
use crate::report::palette::{AGENTS, OURS, SERIES};
use crate::report::plot::bev::bev_sheet;
use crate::report::plot::curves::{CurvePlot, Panel, Point, Style, Top};
use crate::report::plot::scene::BevScene;
use crate::report::summary::{Of, accuracy, comparison, frames, headline, spans, tracks};
use crate::report::table::{Table, escaped};
use crate::score::run::scored_run::ScoredRun;
use crate::score::timing::{ages_ms, arrival_to_consumer_spans_ms, end_to_end_spans_ms};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;

/// The points of a curve are at most so many: means over equal parts of the time.
const MAX_POINTS: usize = 150;

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
    let said = if summary.verdict.passed { comparison(summary) } else { None };
    let reasons = summary.verdict.reasons.iter().cloned().chain(said).collect::<Vec<_>>().join("; ");
    let mut body = format!("<h1>{}</h1>\n", escaped(&title));
    let word = if summary.verdict.passed { "Passed" } else { "Not passed" };
    body += &verdict_html(summary.verdict.passed, word, &reasons);
    let commit = run.commit.as_ref().map_or_else(String::new, |commit| format!(" {commit}."));
    body += &format!(
        "<p>{}.{} {}</p>\n",
        escaped(&headline(summary)),
        escaped(&commit),
        escaped(&tracks(summary))
    );
    for (name, what, of) in [
        ("Objects that all agents cover", "common", Of::Common),
        ("Everything that each covers", "everything", Of::Everything),
    ] {
        body += &format!("<h2 id=\"{what}\">{name}</h2>\n{}", accuracy(summary, of).html(&["fused"]));
    }
    body += &format!("<h2>Errors over time</h2>\n{}", figure(&errors(run).sheet().svg(), None));
    body += &format!("<h2>Time</h2>\n{}", figure(&latencies(run).sheet().svg(), None));
    body += &spans(summary).html(&[]);
    body += &format!("<h2>Agents</h2>\n{}", agents(run).html(&[]));
    if !run.moments.is_empty() {
        body += "<h2>Key frames</h2>\n";
    }
    for scene in run.moments {
        body += &figure(&bev_sheet(scene).svg(), None);
    }
    body += &format!("<h2>What the figures mean</h2>\n{}", explanations());
    page(&title, &body)
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
    Style { name: name.to_owned(), colour, dash, is_dotted: false }
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
        title: "Position error, and NEES/2 (1 is consistent)".to_owned(),
        x_label: "s since scoring began".to_owned(),
        x_names: None,
        styles,
        panels: vec![
            Panel { label: "ATE (m)".to_owned(), curves, top: Top::Whole },
            Panel { label: "NEES/2".to_owned(), curves: vec![nees], top: Top::Whole },
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
        x_label: "ms".to_owned(),
        x_names: None,
        styles: names.into_iter().zip(colours).map(|(name, colour)| style(name, colour, 0.0)).collect(),
        panels: vec![Panel {
            label: "share that is at most so long".to_owned(),
            curves: curves.map(shares).into(),
            top: Top::At(1.0),
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

/// The Markdown list as HTML.
fn explanations() -> String {
    let item = |line: &str| {
        let line = escaped(line.trim_start_matches("- ")).into_owned();
        let bold = |(place, part): (usize, &str)| {
            if place % 2 == 1 { format!("<b>{part}</b>") } else { part.to_owned() }
        };
        format!("<li>{}</li>\n", line.split("**").enumerate().map(bold).collect::<String>())
    };
    format!("<ul class=\"notes\">\n{}</ul>\n", EXPLANATIONS.lines().map(item).collect::<String>())
}
