//! The report of a recording without ground truth as one self-contained page: what looks wrong first.

use crate::data::recorded_lists::RecordedLists;
use crate::data::run_log::ReceivedFused;
use crate::drive::found::Found;
use crate::drive::rerun::Rerun;
use crate::report::page::{Section, beside, figure, notes, page, remark_html, verdict_html};
use crate::report::palette::OURS;
use crate::report::plot::bev::bev_parts;
use crate::report::plot::curves::{CurvePlot, Panel, Point, Top};
use crate::report::plot::scene::BevScene;
use crate::report::run_curves::{
    AGE, END_TO_END, HUB_TO_CONSUMER, coloured, latencies, means, nis_over_time, style,
};
use crate::report::table::{Table, escaped};
use crate::score::percentiles::Percentiles;
use crate::score::timing::{ages_ms, arrival_to_consumer_spans_ms, end_to_end_spans_ms};
use std::collections::BTreeSet;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// Without a truth.
const NO_TRUTH: &str = "Not scored: whether positions are right is judged by the scenario alone, which this recording does not have.";

const NOTE_OF_NO_TRUTH: &str = "**Nothing is scored**: that needs the scenario, which a recording of `v2x up --record` and the folder of a run have. Whether positions are right \
     is not said here; `lab fuse --truth` scores a log by a truth of yours.";

const NOTES: [&str; 4] = [
    "**NIS/2**: squared distance of an agent's detections from what the hub expects of them, over what both covariances promise, \
     for each degree of freedom. 1 is right; more says that the agent states too small errors, or that something else is wrong \
     with it.",
    "**late**: captured before a frame that had been fused already. **refused**: was not fused, for any reason.",
    "**hub → consumer**: from a frame's arrival at the hub until the recorder had the first list that contains it; \
     **end to end**: from its capture, by its agent's clock. **Age of information**: of the newest capture in any \
     list so far, at every 10 ms.",
    "**What the hub makes of it**: NIS, counts and findings are those of the hub's core on the recorded frames, computed again.",
];

/// What the page shows.
pub(crate) struct RecordingPage<'a> {
    /// The name of the recording.
    pub(crate) name: &'a str,
    /// What a hub published.
    pub(crate) recorded: &'a RecordedLists,
    /// Whether the lists are those of a hub that was recorded; else they are computed from the frames.
    pub(crate) is_published: bool,
    /// What the hub's core makes of the frames.
    pub(crate) again: &'a Rerun,
    /// Key frames.
    pub(crate) moments: &'a [BevScene],
    /// By which build it was recorded.
    pub(crate) commit: Option<String>,
    /// How good the lists are by a truth, line by line; none without one.
    pub(crate) score: &'a [String],
}

/// The page.
pub(crate) fn recording_page(run: &RecordingPage<'_>) -> String {
    let lists = &run.recorded.lists;
    let commit = run.commit.as_ref().map_or_else(String::new, |commit| format!(" {}.", escaped(commit)));
    let top = format!("{}<p>{}{commit}</p>\n", findings(run), escaped(&headline(run)));
    let (start, end) = span(lists);
    let ages = ages_ms(lists, start, end);
    let moments: String = run.moments.iter().map(|scene| figure(&bev_parts(scene), None)).collect();
    let sections = [
        ("agents", "Agents", agents(run).html(&[])),
        ("moments", "Key frames", moments),
        ("curves", "Objects and consistency over time", figure(&over_time(run).parts(), None)),
        ("time", "Latency", latency(lists, ages)),
        ("meaning", "What the figures mean", meaning(run)),
    ];
    let sections = sections.into_iter().filter(|(_, _, html)| !html.is_empty());
    let sections: Vec<_> = sections.map(|(id, title, html)| Section::new(id, title, html)).collect();
    page(run.name, &top, &sections)
}

/// A figure, where there are latencies, and a table; nothing where no frame is in a list.
fn latency(lists: &[ReceivedFused], ages: Vec<f64>) -> String {
    if ages.is_empty() && lists.iter().all(|list| list.frame.includes.is_empty()) {
        return String::new();
    }
    let drawn = latencies(lists.iter(), ages.clone()).map_or_else(String::new, |parts| figure(&parts, None));
    beside(&drawn, &spans(lists, ages).html(&[]))
}

fn meaning(run: &RecordingPage<'_>) -> String {
    let of_no_truth = if run.score.is_empty() { Some(NOTE_OF_NO_TRUTH) } else { None };
    notes(of_no_truth.into_iter().chain(NOTES))
}

fn span(lists: &[ReceivedFused]) -> (Timestamp, Timestamp) {
    let start = lists.first().map_or(Timestamp::EPOCH, |list| list.frame.fused_at);
    (start, lists.last().map_or(start, |list| list.received_at))
}

fn findings(run: &RecordingPage<'_>) -> String {
    let start = span(&run.recorded.lists).0;
    let line = |found: &Found| {
        let [first, last] = [found.first, found.last].map(|at| (at - start).as_secs_f64().max(0.0));
        let when = if last - first < 1.0 {
            format!("at {first:.0} s")
        } else {
            format!("{first:.0} to {last:.0} s")
        };
        let agent = found.finding.agent.map_or_else(String::new, |agent| format!("{agent}, "));
        let [says, change] = [&found.finding.says, &found.finding.change].map(|text| sentence(text));
        let remark = if found.finding.is_fault() { "" } else { "Remark: " };
        format!("{remark}{agent}{when}: {says} {change}").trim_end().to_owned()
    };
    let (faults, notes): (Vec<_>, Vec<_>) =
        run.again.found.iter().partition(|found| found.finding.is_fault());
    let lines: Vec<String> = faults.iter().chain(&notes).map(|found| line(found)).collect();
    let scored =
        if run.score.is_empty() { vec![NO_TRUTH.to_owned()] } else { vec![run.score.join("; ") + "."] };
    let lines = [scored, lines].concat();
    let remarks = match notes.len() {
        0 => String::new(),
        1 => "; 1 remark".to_owned(),
        n => format!("; {n} remarks"),
    };
    match (faults.len(), notes.len()) {
        (0, 0) => verdict_html(true, "Nothing looks wrong", &lines),
        (0, _) => remark_html(&format!("No fault{remarks}"), &lines),
        (n, _) => {
            let things = if n == 1 { "thing looks" } else { "things look" };
            verdict_html(false, &format!("{n} {things} wrong{remarks}"), &lines)
        }
    }
}

/// With an end.
fn sentence(text: &str) -> String {
    if text.is_empty() || text.ends_with(['.', '?', '!']) { text.to_owned() } else { format!("{text}.") }
}

fn headline(run: &RecordingPage<'_>) -> String {
    let lists = &run.recorded.lists;
    let (start, end) = span(lists);
    let tracks: BTreeSet<_> =
        lists.iter().flat_map(|list| &list.frame.objects).map(|object| object.track).collect();
    let objects: usize = lists.iter().map(|list| list.frame.objects.len()).sum();
    let whose = match (&run.recorded.hub, run.is_published) {
        (Some(hub), true) => format!("lists that {hub} published"),
        _ => "lists, computed from the frames: no hub was recorded".to_owned(),
    };
    format!(
        "{} {whose}, in {:.1} s; {:.1} objects in a list, {} tracks, {} agents.",
        lists.len(),
        (end - start).as_secs_f64(),
        objects as f64 / lists.len().max(1) as f64,
        tracks.len(),
        run.again.agents.len()
    )
}

fn agents(run: &RecordingPage<'_>) -> Table {
    let row = |(agent, statistics): &(AgentId, v2x_fusion_hub::engine::AgentStatistics)| {
        let delays = run.recorded.lists.iter().flat_map(|list| &list.frame.includes);
        let delays = delays.filter(|included| included.frame.agent == *agent);
        let delays = delays.map(|included| (included.received_at - included.captured_at).as_millis_f64());
        let delays = Percentiles::of(delays.collect());
        let ms = |delay: Option<f64>| delay.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.0}"));
        let nis = statistics.nis_per_dof().map_or_else(|| "–".to_owned(), |nis| format!("{nis:.2}"));
        let reasons: Vec<_> = statistics.refused.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
        let reasons = if reasons.is_empty() { "–".to_owned() } else { reasons.join(", ") };
        let counts = [statistics.accepted, statistics.out_of_sequence, statistics.refused_total()]
            .map(|n| n.to_string());
        let delays = [ms(delays.map(|delay| delay.p50)), ms(delays.map(|delay| delay.p95))];
        std::iter::once(agent.to_string()).chain(counts).chain(delays).chain([nis, reasons]).collect()
    };
    let header =
        ["agent", "accepted", "late", "refused", "delay p50, ms", "p95, ms", "NIS/2", "refused because"];
    Table { header: header.map(str::to_owned).into(), rows: run.again.agents.iter().map(row).collect() }
}

/// How many objects are published, and how consistent each agent is.
fn over_time(run: &RecordingPage<'_>) -> CurvePlot {
    let lists = &run.recorded.lists;
    let start = span(lists).0;
    let counts: Vec<_> =
        lists.iter().map(|list| (list.frame.fused_at, list.frame.objects.len() as f64)).collect();
    let mut styles = vec![style("fused", OURS, 0.0)];
    let mut nis: Vec<Vec<Point>> = vec![Vec::new()];
    for (agent, colour) in coloured(run.again.agents.iter().map(|(agent, _)| *agent)) {
        styles.push(style(agent.as_str(), colour, 0.0));
        nis.push(nis_over_time(agent, &run.again.innovations, start));
    }
    let mut panels = vec![Panel {
        label: "objects in a list".to_owned(),
        curves: vec![means(&counts, start)],
        top: Top::Whole,
        target: None,
        levels: vec![],
    }];
    if nis.iter().any(|curve| !curve.is_empty()) {
        panels.push(Panel {
            label: "NIS/2".to_owned(),
            curves: nis,
            top: Top::Most,
            target: Some(1.0),
            levels: vec![],
        });
    }
    CurvePlot {
        title: "Objects and consistency".to_owned(),
        subtitle: "dashed: the NIS of an agent whose stated errors are right".to_owned(),
        x_label: "since the first list, s".to_owned(),
        x_names: None,
        styles,
        panels,
    }
}

fn spans(lists: &[ReceivedFused], ages: Vec<f64>) -> Table {
    let row = |name: &str, values: Vec<f64>| {
        let figures = Percentiles::of(values);
        let figures = [figures.map(|f| f.p50), figures.map(|f| f.p95), figures.map(|f| f.p99)];
        let figure = |ms: Option<f64>| ms.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.1}"));
        std::iter::once(name.to_owned()).chain(figures.map(figure)).collect()
    };
    Table {
        header: ["Time, ms", "p50", "p95", "p99"].map(str::to_owned).into(),
        rows: vec![
            row(HUB_TO_CONSUMER, arrival_to_consumer_spans_ms(lists)),
            row(END_TO_END, end_to_end_spans_ms(lists)),
            row(AGE, ages),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{agent, at_ms, fused};
    use v2x_common::id::HubId;
    use v2x_fusion_hub::diagnosis::{Code, Finding, Severity};
    use v2x_fusion_hub::engine::AgentStatistics;

    fn page_with(found: Vec<Found>) -> String {
        scored_page_with(found, &[])
    }

    fn scored_page_with(found: Vec<Found>, score: &[String]) -> String {
        let recorded = RecordedLists {
            hub: HubId::new("corner").ok(),
            lists: (0..20).map(|k| fused(100 * k + 60, 100 * k + 55, &[100 * k])).collect(),
            ..RecordedLists::default()
        };
        let mut statistics = AgentStatistics::default();
        statistics.accepted = 20;
        let again = Rerun { agents: vec![(agent("ego"), statistics)], found, ..Rerun::default() };
        let run = RecordingPage {
            name: "corner.mcap",
            recorded: &recorded,
            is_published: true,
            again: &again,
            moments: &[],
            commit: None,
            score,
        };
        recording_page(&run)
    }

    fn found(severity: Severity) -> Found {
        let finding = Finding {
            code: Code::Degrees,
            severity,
            agent: Some(agent("ego")),
            says: "headings look like degrees.".to_owned(),
            change: "Set unit = \"deg\".".to_owned(),
        };
        Found { finding, first: at_ms(1055), last: at_ms(2955) }
    }

    #[test]
    fn a_log_with_a_truth_has_its_score_and_is_not_called_unscored() {
        let page = scored_page_with(Vec::new(), &["ATE 0.130 m".to_owned(), "F1 0.9000".to_owned()]);
        assert!(page.contains("ATE 0.130 m; F1 0.9000.") && !page.contains("scored:"), "{page}");
        assert!(page_with(Vec::new()).contains("Not scored:"));
    }

    #[test]
    fn a_question_ends_a_sentence_as_a_full_stop_does() {
        assert_eq!(["Set it", "Set it.", "Is it UTC?"].map(sentence), ["Set it.", "Set it.", "Is it UTC?"]);
    }

    #[test]
    fn what_looks_wrong_stands_first_with_its_time_and_its_remedy() {
        let page = page_with(vec![found(Severity::Fault)]);
        let top = page.split("<nav>").next().unwrap();
        assert!(top.contains("verdict bad") && top.contains("1 thing looks wrong"), "{top}");
        assert!(
            top.contains("ego, 1 to 3 s: headings look like degrees. Set unit = &quot;deg&quot;."),
            "{top}"
        );
        assert!(!page_with(vec![found(Severity::Note)]).contains("verdict bad"));
        assert!(page_with(vec![]).contains("Nothing looks wrong"));
    }

    #[test]
    fn what_is_counted_is_what_is_listed() {
        let [fault, note] = [Severity::Fault, Severity::Note].map(found);
        let page = page_with(vec![note.clone(), fault, note.clone()]);
        assert!(page.contains("1 thing looks wrong; 2 remarks"), "{page}");
        assert_eq!(page.matches("<p>Remark: ego, 1 to 3 s").count(), 2);
        assert_eq!(page.matches("<p>ego, 1 to 3 s").count(), 1);
        assert!(page_with(vec![note]).contains("No fault; 1 remark<"));
    }

    #[test]
    fn a_page_whose_lists_contain_no_frame_has_no_chart_of_latencies() {
        let lists: Vec<_> = (0..20).map(|k| fused(100 * k, 100 * k, &[])).collect();
        assert_eq!(latency(&lists, Vec::new()), "");
        assert!(page_with(vec![]).contains("Latency"));
    }

    #[test]
    fn the_page_says_whose_lists_it_shows_and_how_late_each_agent_is() {
        let page = page_with(vec![]);
        assert!(page.contains("20 lists that corner published, in 1.9 s"), "{page}");
        // Captured, at the hub 5 ms later, at the consumer after 60.
        for cell in ["data-column=\"delay p50, ms\">5</td>", "<td>end to end</td><td>60.0</td>"] {
            assert!(page.contains(cell), "{cell} in {page}");
        }
    }
}
