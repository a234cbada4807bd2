//! Curves over the time of a run, and distributions of its latencies: of a scored run and of any recording.

use crate::data::run_log::ReceivedFused;
use crate::drive::rerun::FrameInnovations;
use crate::report::palette::{AGENTS, Colour, OURS, SERIES};
use crate::report::plot::curves::{CurvePlot, Panel, Point, Style, Top};
use crate::report::plot::figure_parts::FigureParts;
use crate::report::plot::marker::Marker;
use crate::score::timing::{arrival_to_consumer_spans_ms, end_to_end_spans_ms};
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// The points of a curve are at most so many: means over equal parts of the time.
const MAX_POINTS: usize = 150;
/// A mean of innovations is taken over so many frames at least: single ones say little.
const MIN_FRAMES: usize = 10;

/// The style of a curve by its colour: what is fused is thicker than the others.
pub(super) fn style(name: &str, colour: Colour, dash: f64) -> Style {
    let is_first = colour == OURS;
    let marker = Marker::Disc;
    Style { name: name.to_owned(), colour, dash, marker, is_dotted: false, is_first, is_marked: false }
}

/// Agents with the colours that they have in every figure, in their order.
pub(super) fn coloured(agents: impl IntoIterator<Item = AgentId>) -> impl Iterator<Item = (AgentId, Colour)> {
    agents.into_iter().zip(AGENTS.into_iter().cycle())
}

/// Means of values over equal parts of their time, which is counted from `start`, s.
pub(super) fn means(values: &[(Timestamp, f64)], start: Timestamp) -> Vec<Point> {
    let mean = |part: &[(Timestamp, f64)]| {
        let n = part.len() as f64;
        let x = part.iter().map(|(at, _)| (*at - start).as_secs_f64()).sum::<f64>() / n;
        Point { x, y: part.iter().map(|(_, y)| y).sum::<f64>() / n, spread: 0.0 }
    };
    values.chunks(values.len().div_ceil(MAX_POINTS).max(1)).map(mean).collect()
}

/// NIS/2 of an agent's positions over the time since `start`, s: means over some frames each.
pub(super) fn nis_over_time(of: AgentId, frames: &[FrameInnovations], start: Timestamp) -> Vec<Point> {
    let frames: Vec<_> = frames.iter().filter(|frame| frame.agent == of && frame.at >= start).collect();
    let n = frames.len().div_ceil(MAX_POINTS).max(MIN_FRAMES);
    let mean = |part: &[&FrameInnovations]| {
        let (sum, count) = part.iter().fold((0.0, 0), |(sum, count), frame| {
            (sum + frame.innovations.nis_sum, count + frame.innovations.count)
        });
        let x = part.iter().map(|frame| (frame.at - start).as_secs_f64()).sum::<f64>() / part.len() as f64;
        Point { x, y: sum / (2.0 * count.max(1) as f64), spread: 0.0 }
    };
    // What is left over at the end is too little for a mean of its own.
    let (whole, rest) = frames.split_at(frames.len() - frames.len() % n);
    let last = whole.len().saturating_sub(n);
    let joined = if rest.is_empty() { &[][..] } else { &frames[last..] };
    let whole = if rest.is_empty() { whole } else { &whole[..last] };
    whole.chunks(n).chain(joined.chunks(2 * n)).map(mean).collect()
}

/// Names of spans, in figures and in tables.
pub(super) const HUB_TO_CONSUMER: &str = "hub → consumer";
pub(super) const END_TO_END: &str = "end to end";
pub(super) const AGE: &str = "age of information";

/// Distributions of latencies at the consumer: of the frames in these lists, and of ages, ms. What the hub needs is so much less
/// than the whole way that each has a panel with an axis of its own. `None` where there is no latency at all.
pub(super) fn latencies<'a>(
    lists: impl Iterator<Item = &'a ReceivedFused> + Clone,
    ages_ms: Vec<f64>,
) -> Option<FigureParts> {
    let hub = (HUB_TO_CONSUMER, SERIES[6], arrival_to_consumer_spans_ms(lists.clone()));
    let whole = [(END_TO_END, SERIES[4], end_to_end_spans_ms(lists)), (AGE, SERIES[5], ages_ms)];
    let plots = [
        distributions("from hub to consumer no longer than, ms", vec![hub]),
        distributions("end to end, or age, no longer than, ms", whole.into()),
    ];
    let mut plots = plots.into_iter().flatten().map(|plot| plot.parts());
    let mut parts = plots.next()?;
    for others in plots {
        parts.panels.extend(others.panels);
        parts.legend.extend(others.legend);
    }
    Some(parts)
}

/// `None` where no span is longer than nothing: that is no distribution.
fn distributions(x_label: &str, mut of: Vec<(&str, Colour, Vec<f64>)>) -> Option<CurvePlot> {
    of.retain(|(.., spans_ms)| !spans_ms.is_empty());
    if of.iter().all(|(.., spans_ms)| spans_ms.iter().all(|ms| *ms == 0.0)) {
        return None;
    }
    let styles = of.iter().map(|(name, colour, _)| style(name, colour, 0.0)).collect();
    let curves = of.into_iter().map(|(_, _, spans_ms)| shares(spans_ms)).collect();
    Some(CurvePlot {
        title: "Latency".to_owned(),
        subtitle:
            "of detection frames, and how old is what the consumer has; the longest hundredth is left out"
                .to_owned(),
        x_label: x_label.to_owned(),
        x_names: None,
        styles,
        panels: vec![Panel {
            label: "share".to_owned(),
            curves,
            top: Top::At(1.0),
            target: None,
            levels: vec![],
        }],
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{agent, at_ms, fused};
    use v2x_fusion_hub::fusion::Innovations;

    #[test]
    fn the_nis_over_time_weighs_detections_and_not_frames() {
        let frame = |k: i64| FrameInnovations {
            agent: agent("ego"),
            at: at_ms(100 * k),
            // Nine frames of one detection with NIS/2 = 1, and one of 91 with 3.
            innovations: if k % 10 == 9 {
                Innovations { nis_sum: 546.0, count: 91 }
            } else {
                Innovations { nis_sum: 2.0, count: 1 }
            },
        };
        let mut frames: Vec<_> = (0..20).map(frame).collect();
        frames.push(FrameInnovations { agent: agent("rsu"), ..frames[0].clone() });
        let curve = nis_over_time(agent("ego"), &frames, at_ms(0));
        assert_eq!(curve.len(), 2);
        frames.truncate(13);
        let joined = nis_over_time(agent("ego"), &frames, at_ms(0));
        assert_eq!(joined.len(), 1, "three frames have no mean of their own");
        for (point, x) in curve.iter().zip([0.45, 1.45]) {
            assert!((point.x - x).abs() < 1e-9 && (point.y - 2.82).abs() < 1e-9, "{point:?}");
        }
    }

    #[test]
    fn what_the_hub_needs_has_an_axis_of_its_own_beside_the_whole_way() {
        let lists: Vec<_> = (1..20).map(|k| fused(100 * k + 60, 100 * k + 55, &[100 * k])).collect();
        let parts = latencies(lists.iter(), vec![150.0; 40]).unwrap();
        assert_eq!((parts.panels.len(), parts.legend.len()), (2, 3));
        let has = |place: usize, text: &str| parts.panels[place].1.svg().contains(text);
        assert!(has(1, AGE) && has(1, END_TO_END) && has(0, HUB_TO_CONSUMER));
        assert!(!has(0, END_TO_END), "the first axis is the hub's");
    }

    #[test]
    fn without_a_latency_no_figure_of_latencies_is_drawn() {
        // At the hub 5 ms after the capture, and in the list at once.
        let at_once: Vec<_> = (1..20).map(|k| fused(100 * k + 5, 100 * k + 5, &[100 * k])).collect();
        let parts = latencies(at_once.iter(), Vec::new()).unwrap();
        assert_eq!((parts.panels.len(), parts.legend[0].1.as_str()), (1, END_TO_END));
        assert!(latencies([].iter(), Vec::new()).is_none());
        let parts = latencies([].iter(), vec![150.0; 40]).unwrap();
        assert_eq!((parts.panels.len(), parts.legend.len()), (1, 1), "what there is, is drawn alone");
    }

    #[test]
    fn a_long_run_has_a_curve_of_few_points_over_all_its_time() {
        let values: Vec<_> = (0..10_000).map(|k| (at_ms(100 * k), 1.0)).collect();
        let curve = means(&values, at_ms(0));
        assert!(curve.len() <= MAX_POINTS && curve.last().is_some_and(|last| last.x > 990.0));
    }
}
