//! A sweep's results as files.

use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::PUBLISH_HZ;
use crate::report::folder;
use crate::report::page::{figure, page, verdict_html};
use crate::report::palette::is_ours;
use crate::report::rows_csv::rows_csv;
use crate::report::sweep::figures::{Figure, figures};
use crate::report::sweep::results::Results;
use crate::report::sweep::rows::{Row, Stage};
use crate::report::sweep::text;
use crate::report::sweep::text::{QUANTITIES, families};
use crate::report::table::{Table, escaped};
use clap::ValueEnum;
use std::path::Path;

/// The first columns. All others follow by name.
const FIRST_COLUMNS: [&str; 8] = ["method", "axis", "x", "x_text", "axis_2", "y", "delta_max_ms", "subset"];
/// Highlighted rows.
const MARKED: [&str; 1] = ["ours"];

/// Writes the report, its figures as SVG and PDF, and the rows as CSV, JSON and Markdown.
pub(crate) fn write(rows: &[Row], results: &[Results], command: &str, folder: &Path) -> anyhow::Result<()> {
    let figures = figures(rows, results);
    let files = vec![
        ("report.html", html(rows, &figures, command)),
        ("rows.csv", rows_csv(rows, &FIRST_COLUMNS, Some(&Row::full()))?),
        ("rows.json", serde_json::to_string(rows)?),
        ("tables.md", text::markdown(rows)),
    ];
    folder::write(
        folder,
        files,
        figures.iter().map(|Figure { name, plot }| ((*name).to_owned(), plot.sheet())),
    )
}

fn html(rows: &[Row], figures: &[Figure], command: &str) -> String {
    let axis = rows.first().map_or("", |row| row.axis.as_str());
    let title = format!("Error and timing against {axis}");
    let mut body = format!(
        "<h1>{}</h1>\n{}<pre>{}</pre>\n<p>Objects count that both of the first two agents have in view. Errors are \
         matched by identity, at any distance; bars reach one standard deviation over seeds to either side. A curve \
         that explodes is cut off at the border. Hubs publish at {PUBLISH_HZ} Hz, and what arrives waits for that. Rows \
         with every column: rows.csv, rows.json.</p>\n",
        escaped(&title),
        verdict(rows),
        escaped(command),
    );
    body += &format!(
        "<h2>What is compared</h2>\n{}",
        methods(rows).html(&MARKED).replace("class=\"table\"", "class=\"table words\"")
    );
    for Figure { name, plot } in figures {
        body += &figure(&plot.sheet().svg(), Some(name));
    }
    for family in families(rows) {
        body += &format!("<h2>{}</h2>\n", escaped(&family.name()));
        for quantity in &QUANTITIES {
            let table = family.table(quantity);
            if !table.rows.is_empty() {
                body += &format!("<h3>{}</h3>\n{}", escaped(quantity.title), table.html(&MARKED));
            }
        }
        let stages = stages(&family.rows);
        body += &format!("<h3>Stage by stage, ms (median / 95 % / 99 %)</h3>\n{}", stages.html(&MARKED));
    }
    page(&title, &body)
}

/// At how many values ours has the least error; empty where it is not compared. Ours without other agents is no other.
fn verdict(rows: &[Row]) -> String {
    let others = |row: &&Row| row.subset == "all" && !row.method.contains("ours");
    let ratio = |ours: &Row| {
        let is_same = |row: &&Row| {
            (&row.x_text, row.y.map(f64::to_bits), row.delta_max_ms)
                == (&ours.x_text, ours.y.map(f64::to_bits), ours.delta_max_ms)
        };
        let best =
            rows.iter().filter(others).filter(is_same).filter_map(|row| row.mate_m).reduce(f64::min)?;
        Some(ours.mate_m? / best)
    };
    let ours = rows.iter().filter(|row| row.subset == "all" && is_ours(row.method));
    let ratios: Vec<f64> = ours.filter_map(ratio).collect();
    let Some(largest) = ratios.iter().copied().reduce(f64::max) else { return String::new() };
    let least = ratios.iter().copied().fold(largest, f64::min);
    let (won, all) = (ratios.iter().filter(|ratio| **ratio < 1.0).count(), ratios.len());
    let word = if won == all { "Ours is the most accurate" } else { "Ours is not always the most accurate" };
    let reasons = format!(
        "least position error at {won} of {all} values; {least:.2} to {largest:.2} × that of the best other method"
    );
    verdict_html(won == all, word, &reasons)
}

/// The methods in words.
fn methods(rows: &[Row]) -> Table {
    let is_there = |method: &SweepMethod| rows.iter().any(|row| row.method == method.key());
    let in_words = |method: SweepMethod| {
        let value = method.to_possible_value();
        let help = value.as_ref().and_then(|value| value.get_help()).map(ToString::to_string);
        vec![method.key().to_owned(), help.unwrap_or_default()]
    };
    let rows = SweepMethod::ALL.into_iter().filter(is_there).map(in_words).collect();
    Table { header: ["method", "what it does"].map(str::to_owned).to_vec(), rows }
}

/// Latency by stage, from capture to the consumer.
fn stages(rows: &[&Row]) -> Table {
    let header = ["method", "value", "capture → send", "send → arrive", "arrive → fused", "fused → consumed"];
    let cell = |stage: Option<Stage>| {
        stage.map_or_else(|| "–".to_owned(), |s| format!("{:.1} / {:.1} / {:.1}", s.p50, s.p95, s.p99))
    };
    let line = |row: &&Row| {
        let stages =
            [row.capture_to_send_ms, row.send_to_arrive_ms, row.arrive_to_fused_ms, row.fused_to_consumed_ms];
        let mut line = vec![row.method.to_owned(), row.x_text.clone()];
        line.extend(stages.map(cell));
        line
    };
    let rows = rows.iter().copied().filter(|row| row.subset == "all").collect::<Vec<_>>();
    Table { header: header.map(str::to_owned).to_vec(), rows: rows.iter().map(line).collect() }
}
