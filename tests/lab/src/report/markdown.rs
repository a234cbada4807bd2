//! The report of a run in Markdown.

use crate::report::summary::{Of, accuracy, comparison, frames, headline, reasons, spans, tracks, verdict};
use crate::score::run::summary::Summary;

pub(super) const EXPLANATIONS: &str = "\
- **ATE**: distance of a matched box's centre from the true one, m; per frame the mean over its pairs, then the mean over frames (as every figure here).
- **ADE**: error of a matched box's dimensions, sqrt(Δw² + Δd²), m.
- **AOE**: error of a matched box's heading, degrees, 0 to 180.
- **precision**: share of boxes that are of a real object; boxes on a real object that need not be reported are ignored.
- **recall**: share of the objects that are reported, among those that the field of view held for the last second; for the fused list any agent's, and vehicle agents themselves.
- **GOSPA**: localisation error, missed and false objects in one figure (p = 2, α = 2, cut-off = match radius), m.
- **NEES/2**: squared position error over what the reported covariance promises; 1 is consistent, more is overconfident.
- **common objects**: those in the field of view of all agents for the last second, agents themselves not among them.
- **match radius**: within it a fused box is matched to a true object, most pairs first, then least total distance, whatever the class: max(2 m, 4 × the largest σ that an agent reported). Raw detections are matched by identity, at any distance.
- **late**: accepted by the hub although something newer was already fused. **refused**: by the hub, for any reason.
- **hub latency**: detection frame received → first fused frame put that contains it. **hub compute**: the part of it in which the hub worked.
- **end to end**: captured by the agent → the consumer has the first fused frame that contains it.
- **age of information**: at the consumer, every 10 ms: now less the newest capture time contained in what it has.
- **id switches**: how often a true object was matched by another track than the last time.
";

/// The report of a run: all figures, the picture `bev.svg`, and the definition of each figure.
pub(crate) fn report_md(summary: &Summary) -> String {
    let blocks = [
        format!("# Run of `{}`", summary.scenario),
        format!("**{}**", verdict(summary)),
        reasons(summary),
        headline(summary) + ".",
        comparison(summary).unwrap_or_default(),
        "![A typical moment from above: truth, agents' detections and fused objects](bev.svg)".to_owned(),
        "## Objects that all agents cover".to_owned(),
        accuracy(summary, Of::Common).markdown(),
        "## Everything that each covers".to_owned(),
        accuracy(summary, Of::Everything).markdown(),
        tracks(summary),
        "## Frames at the hub".to_owned(),
        frames(summary).markdown(),
        "## Time".to_owned(),
        spans(summary).markdown(),
        "## What the figures mean".to_owned(),
        EXPLANATIONS.to_owned(),
    ];
    let blocks = blocks.iter().filter(|block| !block.is_empty());
    blocks.map(|block| block.trim_end()).collect::<Vec<_>>().join("\n\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::fixture::summary;

    #[test]
    fn the_report_has_every_figure_of_the_table_and_the_picture() {
        let summary = summary();
        let report = report_md(&summary);
        for table in [accuracy(&summary, Of::Common), frames(&summary), spans(&summary)] {
            for cell in table.rows.iter().flatten() {
                assert!(report.contains(cell.as_str()), "{cell} is missing in\n{report}");
            }
        }
        assert!(report.contains("](bev.svg)"));
        assert!(report.contains("**PASSED**"));
    }
}
