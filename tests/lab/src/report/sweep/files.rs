//! A sweep's results as files.

use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::PUBLISH_HZ;
use crate::report::folder;
use crate::report::page::{Section, figure, page};
use crate::report::rows_csv::rows_csv;
use crate::report::sweep::figures::{Figure, figures};
use crate::report::sweep::results::Results;
use crate::report::sweep::rows::{Row, Stage};
use crate::report::sweep::text;
use crate::report::sweep::text::{QUANTITIES, families};
use crate::report::sweep::verdict::verdict;
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
    let top = format!(
        "{}<pre>{}</pre>\n<p>Objects count that both of the first two agents have in view. Errors are \
         matched by identity, at any distance; bars reach one standard deviation over seeds to either side. A curve \
         that explodes is cut off at the border. Hubs publish at {PUBLISH_HZ} Hz, and what arrives waits for that. Rows \
         with every column: <a href=\"rows.csv\">rows.csv</a>, <a href=\"rows.json\">rows.json</a>.</p>\n",
        verdict(rows),
        escaped(command),
    );
    let plots = figures.iter().map(|Figure { name, plot }| figure(&plot.parts(), Some(name))).collect();
    let mut sections = vec![
        Section::new("methods", "What is compared", methods(rows).html(&MARKED)),
        Section::new("figures", "Figures", plots),
    ];
    let families = families(rows).into_iter().enumerate();
    sections.extend(families.map(|(place, family)| {
        let name = family.name();
        let table =
            |(title, table): (&str, Table)| format!("<h3>{}</h3>\n{}", escaped(title), table.html(&MARKED));
        let quantities = QUANTITIES.iter().map(|quantity| (quantity.title, family.table(quantity)));
        let quantities = quantities.filter(|(_, table)| !table.rows.is_empty());
        let stages = ("Stage by stage, ms (median / 95 % / 99 %)", stages(&family.rows));
        Section::new(&format!("tables-{place}"), &name, quantities.chain([stages]).map(table).collect())
    }));
    page(&title, &top, &sections)
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
