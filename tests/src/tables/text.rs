//! The tables for people: terminal and Markdown.

use super::Tables;
use super::gain::{Ratio, gains};
use super::published::{FOOTNOTES, Published, published};
use super::rows::Row;
use crate::protocol::counting::{Counting, Subset};
use crate::protocol::method::Method;
use crate::protocol::noise::NoisePair;
use crate::report::table::Table;

/// Metrics and their digits.
pub(super) const COLUMNS: [(&str, usize); 5] =
    [("mATE m", 3), ("mADE m", 3), ("mAOE °", 2), ("precision", 4), ("recall", 4)];

/// For a terminal: aligned, the paper's counting, all objects.
pub(super) fn terminal(tables: &Tables) -> String {
    let mut blocks = vec![headline(tables)];
    for (place, noise) in tables.plan.noise.iter().enumerate() {
        let heading = format!("Table II, {}", noise.name());
        blocks.push(format!("{heading}\n{}", table(tables, *noise, Subset::All).text()));
        blocks.push(gain_lines(tables, place));
    }
    blocks.push(notes());
    blocks.retain(|block| !block.is_empty());
    blocks.iter().map(|block| block.trim_end()).collect::<Vec<_>>().join("\n\n")
}

/// As Markdown, with the subsets.
pub(super) fn markdown(tables: &Tables) -> String {
    let mut blocks = vec!["# Table II".to_owned(), headline(tables)];
    for (place, noise) in tables.plan.noise.iter().enumerate() {
        blocks.push(format!("## {}", noise.name()));
        blocks.push(table(tables, *noise, Subset::All).markdown());
        blocks.push(gain_lines(tables, place));
        for (subset, name) in [(Subset::Static, "standing"), (Subset::Moving, "moving")] {
            blocks.push(format!("### {}, {name} objects", noise.name()));
            blocks.push(table(tables, *noise, subset).markdown());
        }
    }
    blocks.push(notes());
    blocks.retain(|block| !block.is_empty());
    blocks.iter().map(|block| block.trim_end()).collect::<Vec<_>>().join("\n\n") + "\n"
}

fn headline(tables: &Tables) -> String {
    let plan = &tables.plan;
    format!(
        "{}: {}\n{} trials, seed {}; errors of all boxes over true positives, mean ± standard deviation over frames; \
         the paper's value and ours less the paper's beside it.",
        tables.dataset,
        tables.statistics.text(),
        plan.trials,
        plan.seed,
    )
}

fn table(tables: &Tables, noise: NoisePair, subset: Subset) -> Table {
    let mut header = vec!["method".to_owned()];
    for (place, (name, _)) in COLUMNS.into_iter().enumerate() {
        let columns = [name, "paper", "diff"];
        header.extend(columns[..n_columns(place)].iter().map(|name| (*name).to_owned()));
    }
    header.push("told".to_owned());
    let is_shown = |row: &&Row| row.noise == noise && row.subset == subset && row.counting == Counting::Table;
    let rows = tables.rows.iter().filter(is_shown).map(|row| cells(row, subset)).collect();
    Table { header, rows }
}

/// Of a metric: the value, the paper's, and for errors the difference.
const fn n_columns(metric: usize) -> usize {
    if metric < 3 { 3 } else { 2 }
}

fn cells(row: &Row, subset: Subset) -> Vec<String> {
    // The paper has no subsets.
    let paper = published(row.noise, row.method).filter(|_| subset == Subset::All);
    let paper = paper.unwrap_or(Published([None; 5]));
    let mut cells = vec![row.method.key().to_owned()];
    for (place, ((_, digits), value)) in COLUMNS.into_iter().zip(row.metrics.0).enumerate() {
        let figure = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.digits$}"));
        let coarse = digits - 1;
        // Precision and recall vary little: the deviation over frames is in the files.
        let own = match (value.mean, value.std) {
            (Some(mean), Some(std)) if place < 3 => format!("{mean:.digits$}±{std:.coarse$}"),
            (mean, _) => figure(mean),
        };
        let difference = value.mean.zip(paper.0[place]).map(|(own, paper)| own - paper);
        let difference = difference.map_or("–".to_owned(), |value| format!("{value:+.digits$}"));
        cells.extend([own, figure(paper.0[place]), difference].into_iter().take(n_columns(place)));
    }
    cells.push(if row.told.is_empty() { "–".to_owned() } else { row.told.clone() });
    cells
}

/// What ours gains over least squares, alone and filtered, for all objects and for parts of them.
fn gain_lines(tables: &Tables, noise: usize) -> String {
    let line = |other: Method, (subset, name): (Subset, &str)| {
        let [ate, ade, aoe] = gains(tables, noise, (other, Method::Ours), subset)?;
        let figure = |Ratio { ratio, low, high }| format!("{ratio:.2}× [{low:.2}, {high:.2}]");
        Some(format!(
            "ours over {}, {name}: mATE {}, mADE {}, mAOE {} (95 %, bootstrap over scenes)",
            other.key(),
            figure(ate),
            figure(ade),
            figure(aoe)
        ))
    };
    let subsets = [(Subset::All, "all objects"), (Subset::Static, "standing"), (Subset::Moving, "moving")];
    let lines = subsets.map(|subset| line(Method::CsbaWls, subset));
    let filtered = line(Method::CsbaWlsCv, subsets[0]);
    lines.into_iter().chain([filtered]).flatten().collect::<Vec<_>>().join("\n")
}

fn notes() -> String {
    let notes: Vec<String> = FOOTNOTES.iter().map(|note| format!("- {note}")).collect();
    format!("Where the paper cannot be matched:\n\n{}", notes.join("\n"))
}
