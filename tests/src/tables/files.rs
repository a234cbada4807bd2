//! The tables as files.

use super::Tables;
use super::figures::{Figure, figures};
use super::{html, latex, text};
use crate::report::rows_csv::rows_csv;
use anyhow::Context;
use std::path::{Path, PathBuf};

/// Writes the report, its figures as SVG and PDF, and the tables as Markdown, CSV, LaTeX and JSON into a folder,
/// which is made where there is none.
pub(super) fn write(tables: &Tables, folder: &Path) -> anyhow::Result<()> {
    let plots = folder.join("plots");
    std::fs::create_dir_all(&plots).with_context(|| format!("making {}", plots.display()))?;
    let figures = figures(tables);
    let json = serde_json::to_string(&tables.rows)?;
    let mut files: Vec<(PathBuf, Vec<u8>)> = vec![
        (folder.join("report.html"), html::html(tables, &figures).into()),
        (folder.join("tables.md"), text::markdown(tables).into()),
        (folder.join("tables.csv"), table_csv(tables)?.into()),
        (folder.join("tables.tex"), latex::latex(tables).into()),
        (folder.join("tables.json"), json.into()),
    ];
    for Figure { name, plot, .. } in &figures {
        let sheet = plot.sheet();
        files.push((plots.join(format!("{name}.svg")), sheet.svg().into()));
        files.push((plots.join(format!("{name}.pdf")), sheet.pdf()));
    }
    for (path, bytes) in files {
        std::fs::write(&path, bytes).with_context(|| format!("writing {}", path.display()))?;
    }
    Ok(())
}

/// The first columns; all others follow by name.
const FIRST_COLUMNS: [&str; 9] =
    ["table", "noise", "shape", "method", "counting", "subset", "class", "trials", "told"];

/// All rows, with the names of the JSON ones.
pub(super) fn table_csv(tables: &Tables) -> anyhow::Result<String> {
    rows_csv(&tables.rows, &FIRST_COLUMNS)
}
