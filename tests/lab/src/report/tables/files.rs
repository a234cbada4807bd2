//! The tables as files.

use crate::report::folder;
use crate::report::rows_csv::rows_csv;
use crate::report::tables::figures::{Figure, figures};
use crate::report::tables::results::Tables;
use crate::report::tables::{html, latex, text};
use std::path::Path;

/// Writes the report, its figures as SVG and PDF, and the tables as Markdown, CSV, LaTeX and JSON into a folder, which
/// is made if it is missing.
pub(crate) fn write(tables: &Tables, folder: &Path) -> anyhow::Result<()> {
    let figures = figures(tables);
    let files = vec![
        ("report.html", html::html(tables, &figures)),
        ("tables.md", text::markdown(tables)),
        ("tables.csv", table_csv(tables)?),
        ("tables.tex", latex::latex(tables)),
        ("tables.json", serde_json::to_string(&tables.rows)?),
    ];
    folder::write(folder, files, figures.into_iter().map(|Figure { name, sheet, .. }| (name, sheet)))
}

/// The first columns. All others follow by name.
const FIRST_COLUMNS: [&str; 9] =
    ["table", "noise", "shape", "method", "counting", "subset", "class", "trials", "told"];

/// All rows, with the names of the JSON fields.
pub(crate) fn table_csv(tables: &Tables) -> anyhow::Result<String> {
    rows_csv(&tables.rows, &FIRST_COLUMNS, None)
}
