//! The summary of a run as tables for the terminal. The Markdown report has the same tables.

use crate::report::table::Table;
use crate::score::frame_metrics::Metrics;
use crate::score::percentiles::Percentiles;
use crate::score::run::summary::Summary;

/// The summary as text, for a terminal at least 80 columns wide.
pub(crate) fn summary_table(summary: &Summary) -> String {
    let blocks = [
        headline(summary),
        format!("Objects that all agents cover:\n{}", accuracy(summary, Of::Common).text()),
        format!("Everything that each covers:\n{}", accuracy(summary, Of::Everything).text()),
        frames(summary).text(),
        spans(summary).text(),
        [Some(tracks(summary)), comparison(summary)].into_iter().flatten().collect::<Vec<_>>().join("\n"),
        format!("{}\n{}", verdict(summary), reasons(summary)),
    ];
    blocks.map(|block| block.trim_end().to_owned() + "\n").join("\n")
}

/// Which objects count.
#[derive(Clone, Copy)]
pub(super) enum Of {
    Common,
    Everything,
}

pub(super) fn headline(summary: &Summary) -> String {
    format!(
        "{}, seed {}: {}, {:.1} s of which {:.1} s scored, {} fused frames, match radius {:.2} m",
        summary.scenario,
        summary.seed,
        match summary.processes {
            1 => "1 process".to_owned(),
            n => format!("{n} processes"),
        },
        summary.duration_s,
        summary.scored_s,
        summary.fused.metrics.frames,
        summary.match_radius_m,
    )
}

pub(super) fn accuracy(summary: &Summary, of: Of) -> Table {
    let row = |name: String, metrics: &Metrics| {
        let Metrics { ate_m, ade_m, aoe_deg, precision, recall, gospa_m, nees_position, .. } = *metrics;
        let figures = [(ate_m, 3), (ade_m, 3), (aoe_deg, 2), (precision, 4), (recall, 4), (gospa_m, 2)];
        let figures = figures.into_iter().chain([(nees_position, 2)]);
        std::iter::once(name).chain(figures.map(|(value, digits)| figure(value, digits))).collect()
    };
    let pick = |all, common| match of {
        Of::Common => common,
        Of::Everything => all,
    };
    let agents = summary.agents.iter().map(|agent| {
        row(format!("{} ({})", agent.id, agent.kind.name()), pick(&agent.metrics, &agent.common))
    });
    let fused = row("fused".to_owned(), pick(&summary.fused.metrics, &summary.fused.common));
    Table {
        header: ["", "ATE m", "ADE m", "AOE °", "precision", "recall", "GOSPA m", "NEES/2"]
            .map(str::to_owned)
            .into(),
        rows: agents.chain([fused]).collect(),
    }
}

pub(super) fn frames(summary: &Summary) -> Table {
    let rows = summary.agents.iter().map(|agent| {
        let counts = [agent.frames_sent, agent.frames_received, agent.frames_late, agent.frames_refused];
        let counts = counts.map(|count| count.map_or_else(missing, |count| count.to_string()));
        std::iter::once(agent.id.to_string()).chain(counts).collect()
    });
    Table {
        header: ["Frames", "sent", "received", "late", "refused"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

pub(super) fn spans(summary: &Summary) -> Table {
    let row = |name: &str, spans: Option<Percentiles>| {
        let spans = [spans.map(|s| s.p50), spans.map(|s| s.p95), spans.map(|s| s.p99)];
        std::iter::once(name.to_owned()).chain(spans.map(span)).collect()
    };
    Table {
        header: ["Time, ms", "p50", "p95", "p99"].map(str::to_owned).into(),
        rows: vec![
            row("hub latency", summary.latency_ms),
            row("hub compute", summary.compute_ms),
            row("end to end", summary.end_to_end_ms),
            row("age of information", summary.age_of_information_ms),
        ],
    }
}

pub(super) fn tracks(summary: &Summary) -> String {
    let tracks = &summary.fused.tracks;
    format!(
        "{} objects tracked, {} track ids each on average, {} id switches.",
        tracks.objects,
        figure(tracks.ids_per_object, 2),
        tracks.id_switches,
    )
}

/// The fused error compared with the best agent's; `None` where either is missing.
pub(super) fn comparison(summary: &Summary) -> Option<String> {
    let word = if summary.agents.len() == 2 { "better" } else { "best" };
    let ratio = summary.ate_ratio_to_best_agent?;
    Some(format!("On common objects the fused error is {ratio:.2} × the {word} agent's."))
}

/// What fusion gains, with the errors behind the ratio. A missing figure is a dash.
pub(super) fn gain(summary: &Summary) -> String {
    let Metrics { ate_m, precision, recall, .. } = summary.fused.common;
    let errors = summary.agents.iter().filter_map(|agent| Some((agent.id, agent.common.ate_m?)));
    let best = errors.min_by(|(_, a), (_, b)| a.total_cmp(b));
    let word = if summary.agents.len() == 2 { "better" } else { "best" };
    let beside = match (best, summary.ate_ratio_to_best_agent) {
        (Some((id, error_m)), Some(ratio)) => {
            format!(", {ratio:.2} × the {word} agent's ({id}: {error_m:.3} m)")
        }
        (Some((id, error_m)), None) => format!(", the {word} agent's is {error_m:.3} m ({id})"),
        (None, _) => String::new(),
    };
    format!(
        "On the objects that all agents cover, the fused error is {} m{beside}; recall {}, precision {}.",
        figure(ate_m, 3),
        figure(recall, 3),
        figure(precision, 3),
    )
}

pub(super) fn verdict(summary: &Summary) -> &'static str {
    if summary.verdict.passed { "PASSED" } else { "NOT PASSED" }
}

pub(super) fn reasons(summary: &Summary) -> String {
    summary.verdict.reasons.iter().map(|reason| format!("- {reason}\n")).collect()
}

/// A span in ms: microseconds say nothing beside tens of milliseconds.
fn span(value_ms: Option<f64>) -> String {
    figure(value_ms, if value_ms.is_some_and(|ms| ms >= 10.0) { 1 } else { 3 })
}

fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(missing, |value| format!("{value:.digits$}"))
}

fn missing() -> String {
    "–".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::fixture::summary;

    #[test]
    fn columns_line_up_and_missing_figures_are_dashes() {
        let text = summary_table(&summary());
        let line = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap();
        assert_eq!(line("hub compute"), "hub compute             –      –      –");
        assert_eq!(line("end to end"), "end to end           61.0  122.0  183.0");
        assert_eq!(line("ego  "), "ego      200       198    31        2");
        let table: Vec<_> = text.lines().skip_while(|line| !line.contains("ATE m")).take(4).collect();
        let width = |line: &str| line.chars().count();
        assert!(table.iter().all(|line| width(line) == width(table[0])), "{text}");
        assert!(text.lines().skip(1).all(|line| width(line) <= 80), "{text}");
    }

    #[test]
    fn the_gain_names_both_errors_and_what_is_found_whatever_the_verdict() {
        let mut summary = summary();
        summary.verdict.fail("rsu ended with exit code 3".to_owned());
        assert_eq!(
            gain(&summary),
            "On the objects that all agents cover, the fused error is 0.176 m, 0.44 × the better agent's (rsu: 0.400 m); \
             recall 0.950, precision 0.990."
        );
        (summary.fused.common.ate_m, summary.ate_ratio_to_best_agent) = (None, None);
        assert!(gain(&summary).contains("is – m, the better agent's is 0.400 m (rsu)"), "{}", gain(&summary));
    }

    #[test]
    fn the_summary_ends_with_the_comparison_and_the_verdict() {
        let mut summary = summary();
        let text = summary_table(&summary);
        assert!(text.ends_with("is 0.44 × the better agent's.\n\nPASSED\n"), "{text}");
        summary.verdict.fail("rsu ended with exit code 3".to_owned());
        summary.agents.pop();
        summary.ate_ratio_to_best_agent = None;
        let text = summary_table(&summary);
        assert!(text.ends_with("switches.\n\nNOT PASSED\n- rsu ended with exit code 3\n"), "{text}");
    }
}
